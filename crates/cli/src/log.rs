//! Opening a log for a command.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use drivescope_drive::drive::Drive;
use drivescope_import::{CsvReader, Mapping, OpenReport, Table, open_table, raw_gnss};
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
    /// Raw satellite ranges that belong to the log, as CSV: t, prn, sat_x/y/z, sat_vx/vy/vz, pr, prr.
    #[arg(long, value_name = "FILE")]
    gnss_raw: Option<PathBuf>,
}

/// A log that has been opened.
pub struct Opened {
    /// The drive.
    pub drive: Drive,
    /// What the reader has to say, with the mapping it used.
    pub report: OpenReport,
}

impl LogArgs {
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
        let failed = |e: std::io::Error| unreadable(&self.log, &e);
        let log = if self.log.as_os_str() == "-" {
            if self.format.is_none() {
                return Err("standard input has no name to tell its format; give --format csv".into());
            }
            table(&mut std::io::stdin().lock(), &name)
        } else {
            table(&mut File::open(&self.log).map_err(failed)?, &name)
        };
        let (mut drive, report) = open_table(log?, mapping.as_ref()).map_err(|e| e.to_string())?;
        if let Some(path) = &self.gnss_raw {
            let mut file = File::open(path).map_err(|e| unreadable(path, &e))?;
            let table = table(&mut file, &path.display().to_string())?;
            drive.raw_gnss = raw_gnss(&table, report.mapping.time.offset).map_err(|e| e.to_string())?;
        }
        Ok(Opened { drive, report })
    }
}

fn unreadable(path: &Path, error: &std::io::Error) -> String {
    format!("{}: could not be read: {error}", path.display())
}

/// Read CSV slice by slice.
fn table(source: &mut dyn Read, name: &str) -> Result<Table, String> {
    let mut reader = CsvReader::new(name);
    let mut slice = vec![0; SLICE];
    loop {
        let length = source.read(&mut slice).map_err(|e| unreadable(Path::new(name), &e))?;
        if length == 0 {
            return reader.finish().map_err(|e| e.to_string());
        }
        reader.feed(&slice[..length]).map_err(|e| e.to_string())?;
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
