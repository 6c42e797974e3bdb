//! Writing results: nothing half-written, and a closed pipe is not a failure.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Write a file through a temporary one beside it, renamed at the end.
///
/// # Errors
/// One sentence naming the file.
pub fn write(path: &Path, content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), String> {
    let failed = |e: io::Error| format!("{}: could not be written: {e}", path.display());
    let mut name = path.file_name().ok_or_else(|| format!("{}: is not a file name", path.display()))?.to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    let temporary = path.with_file_name(name);
    let written = (|| {
        let mut file = BufWriter::new(File::create(&temporary)?);
        content(&mut file)?;
        file.flush()?;
        drop(file);
        std::fs::rename(&temporary, path)
    })();
    if written.is_err() {
        let _ = std::fs::remove_file(&temporary);
    }
    written.map_err(failed)
}

/// Print to standard output.
///
/// # Errors
/// One sentence, except for a pipe closed by its reader.
pub fn print(text: &str) -> Result<(), String> {
    match writeln!(io::stdout(), "{}", text.trim_end()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(format!("could not print: {e}")),
        _ => Ok(()),
    }
}
