//! What tests of the command share: a folder for what they write, and the command itself.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

/// A folder of its own for every test, gone at the end.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("drivescope-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.0.join(name);
        fs::write(&path, content).unwrap();
        path.to_string_lossy().into_owned()
    }
    pub fn path(&self, name: &str) -> String {
        self.0.join(name).to_string_lossy().into_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The command with these arguments.
pub fn drivescope(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_drivescope")).args(args).output().unwrap()
}
