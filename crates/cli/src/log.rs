//! Opening a log for a command.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use drivescope_drive::drive::Drive;
use drivescope_import::{CsvReader, Mapping, OpenReport, open_table};
use serde_json::Value;

/// Bytes read at a time.
const SLICE: usize = 1 << 20;

/// Which log, and how to read it.
#[derive(clap::Args)]
pub struct LogArgs {
    /// The log; `-` reads standard input.
    log: PathBuf,
    /// Which column is which signal, as JSON; proposed from names, units and physics without it.
    #[arg(long, value_name = "M.json")]
    mapping: Option<PathBuf>,
    /// Format of standard input.
    #[arg(long, value_name = "FORMAT", value_parser = ["csv"])]
    format: Option<String>,
}

/// A log that has been opened.
pub struct Opened {
    /// The drive.
    pub drive: Drive,
    /// What the reader has to say, with the mapping it used.
    pub report: OpenReport,
}

impl LogArgs {
    /// A log that another argument names.
    pub fn of(log: PathBuf, mapping: Option<PathBuf>) -> Self {
        Self { log, mapping, format: None }
    }

    /// Read the log slice by slice.
    ///
    /// # Errors
    /// One sentence naming file, row and column.
    pub fn open(&self) -> Result<Opened, String> {
        let mapping = match &self.mapping {
            Some(path) => {
                Some(Mapping::from_json(&text_file(path)?, &path.display().to_string()).map_err(|e| e.to_string())?)
            }
            None => None,
        };
        let name = self.log.file_name().map_or_else(|| "-".into(), |n| n.to_string_lossy().into_owned());
        let failed = |e: std::io::Error| format!("{}: could not be read: {e}", self.log.display());
        let mut source: Box<dyn Read> = if self.log.as_os_str() == "-" {
            if self.format.is_none() {
                return Err("standard input has no name to tell its format; give --format csv".into());
            }
            Box::new(std::io::stdin().lock())
        } else {
            Box::new(File::open(&self.log).map_err(failed)?)
        };
        let mut reader = CsvReader::new(&name);
        let mut slice = vec![0; SLICE];
        loop {
            let length = source.read(&mut slice).map_err(failed)?;
            if length == 0 {
                break;
            }
            reader.feed(&slice[..length]).map_err(|e| e.to_string())?;
        }
        let table = reader.finish().map_err(|e| e.to_string())?;
        let (drive, report) = open_table(table, mapping.as_ref()).map_err(|e| e.to_string())?;
        Ok(Opened { drive, report })
    }
}

/// A JSON file.
///
/// # Errors
/// One sentence naming the file and, for bad JSON, line and column.
pub fn json_file(path: &Path) -> Result<Value, String> {
    serde_json::from_str(&text_file(path)?).map_err(|e| format!("{}: is not JSON: {e}", path.display()))
}

fn text_file(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|e| format!("{}: could not be read: {e}", path.display()))
}
