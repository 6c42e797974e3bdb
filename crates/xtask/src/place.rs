//! Where things are: the workspace, its target folder, the cached tools.

use crate::failure::{Explain, Failure, Result, fail};
use crate::process;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The target that the page's core is compiled for.
pub const WASM: &str = "wasm32-unknown-unknown";

/// Folders of this clone and of this machine.
pub struct Place {
    /// The workspace: where the root `Cargo.toml` lies.
    pub root: PathBuf,
    /// Cargo's target folder, wherever the environment put it.
    pub target: PathBuf,
    /// What `cargo metadata --no-deps` says about the workspace.
    pub metadata: Value,
}

impl Place {
    /// Find the workspace from the environment or from the current folder upwards.
    ///
    /// # Errors
    ///
    /// There is no workspace, or cargo cannot read it.
    pub fn find() -> Result<Self> {
        let start = match std::env::var_os("CARGO_MANIFEST_DIR") {
            Some(folder) => PathBuf::from(folder),
            None => std::env::current_dir().when(|| "read the current folder".into())?,
        };
        let Some(root) = start.ancestors().find(|folder| folder.join("crates/xtask/Cargo.toml").is_file()) else {
            return fail("this is not inside a clone of Drivescope: no folder above has crates/xtask");
        };
        let metadata = metadata(root, &["--no-deps"])?;
        let Some(target) = metadata["target_directory"].as_str() else {
            return fail("cargo metadata does not say where the target folder is");
        };
        Ok(Self { root: root.to_path_buf(), target: target.into(), metadata })
    }

    /// The folder of the page's sources.
    pub fn web(&self) -> PathBuf {
        self.root.join("web")
    }

    /// Where the page's package of the core is generated.
    pub fn generated(&self) -> PathBuf {
        self.web().join("src/generated")
    }

    /// The built page.
    pub fn dist(&self) -> PathBuf {
        self.web().join("dist")
    }

    /// Cargo, started in the workspace's root.
    pub fn cargo(&self) -> Command {
        let mut command = process::cargo();
        command.current_dir(&self.root);
        command
    }

    /// npm, started in `web/`, without advertisements.
    pub fn npm(&self) -> Command {
        let mut command = process::program("npm");
        command.current_dir(self.web()).env("NPM_CONFIG_FUND", "false").env("NPM_CONFIG_AUDIT", "false");
        command.env("NPM_CONFIG_UPDATE_NOTIFIER", "false");
        command
    }

    /// The version that `Cargo.lock` fixes for a crate.
    ///
    /// # Errors
    ///
    /// There is no lock file, or the crate is not in it.
    pub fn locked_version(&self, name: &str) -> Result<String> {
        let lock = std::fs::read_to_string(self.root.join("Cargo.lock")).when(|| "read Cargo.lock".into())?;
        version_in_lock(&lock, name).ok_or_else(|| Failure(format!("Cargo.lock does not hold {name}")))
    }
}

/// What `cargo metadata` says about the workspace at `root`.
///
/// # Errors
///
/// Cargo cannot read the workspace.
pub fn metadata(root: &Path, arguments: &[&str]) -> Result<Value> {
    let text = process::output(
        process::cargo().current_dir(root).args(["metadata", "--format-version", "1"]).args(arguments),
    )?;
    serde_json::from_str(&text).when(|| "read cargo's metadata".into())
}

/// The folder of tools that this program installs for itself.
///
/// `DRIVESCOPE_TOOLS`, else `drivescope/tools` in the user's cache folder.
///
/// # Errors
///
/// Neither is known.
pub fn tools() -> Result<PathBuf> {
    if let Some(folder) = std::env::var_os("DRIVESCOPE_TOOLS") {
        return Ok(folder.into());
    }
    let cache = match std::env::var_os("XDG_CACHE_HOME").or_else(|| std::env::var_os("LOCALAPPDATA")) {
        Some(folder) => PathBuf::from(folder),
        None => home().map(|home| home.join(".cache")).ok_or_else(|| {
            Failure("no cache folder is known: set DRIVESCOPE_TOOLS to a folder for installed tools".into())
        })?,
    };
    Ok(cache.join("drivescope/tools"))
}

/// The user's home folder.
pub fn home() -> Option<PathBuf> {
    std::env::var_os("HOME").or_else(|| std::env::var_os("USERPROFILE")).map(PathBuf::from)
}

/// Cargo's home folder.
pub fn cargo_home() -> Option<PathBuf> {
    std::env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| home().map(|home| home.join(".cargo")))
}

fn version_in_lock(lock: &str, name: &str) -> Option<String> {
    let entry = format!("name = \"{name}\"");
    let mut lines = lock.lines().skip_while(|line| *line != entry).skip(1);
    Some(lines.next()?.strip_prefix("version = \"")?.strip_suffix('"')?.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_locked_version_is_that_of_the_very_crate() {
        let lock = "[[package]]\nname = \"serde\"\nversion = \"1.0.9\"\n\n[[package]]\nname = \"serde_json\"\nversion = \"1.2.3\"\n";
        assert_eq!(version_in_lock(lock, "serde_json").as_deref(), Some("1.2.3"));
        assert_eq!(version_in_lock(lock, "serde").as_deref(), Some("1.0.9"));
        assert_eq!(version_in_lock(lock, "ser"), None);
    }
}
