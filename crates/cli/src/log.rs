//! Opening a log for a command.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use drivescope_drive::drive::Drive;
use drivescope_import::{
    FORMATS, IoSource, Mapping, MemorySource, OpenReport, Opening, Origin, SeekSource, Source, open_log,
    open_log_whole, open_raw, raw_gnss, read_csv,
};
use serde_json::Value;

use crate::part::{PartArgs, sentence};

/// Which log, and how to read it.
#[derive(clap::Args, Clone)]
pub struct LogArgs {
    /// The log; several files or a folder are one drive, with the DBC of a bus log among them; `-` reads standard input.
    #[arg(required_unless_present = "gnss_raw")]
    log: Vec<PathBuf>,
    /// Which column is which signal, as JSON; proposed from names, units and physics without it.
    #[arg(long, value_name = "M.json")]
    mapping: Option<PathBuf>,
    /// Format of standard input.
    #[arg(long, value_name = "FORMAT", value_parser = FORMATS.iter().map(|f| f.1).collect::<Vec<_>>())]
    format: Option<String>,
    /// Raw satellite ranges that belong to the log, or alone without one, as CSV: t, prn, sat_x/y/z, sat_vx/vy/vz, pr, prr.
    #[arg(long, value_name = "FILE")]
    gnss_raw: Option<PathBuf>,
    /// Origin of local coordinates, deg, deg, m; the first place of the truth or of the satellites without it.
    #[arg(long, value_name = "LAT,LON,ALT", value_parser = origin, allow_hyphen_values = true)]
    origin: Option<Origin>,
    #[command(flatten)]
    part: PartArgs,
}

/// Three numbers with commas between; the height may be missing.
fn origin(text: &str) -> Result<Origin, String> {
    let numbers: Vec<f64> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    match (numbers.as_slice(), text.split(',').count()) {
        ([lat, lon], 2) => Origin::new(*lat, *lon, 0.0),
        ([lat, lon, alt], 3) => Origin::new(*lat, *lon, *alt),
        _ => Err("expected latitude, longitude and height with commas between".into()),
    }
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
        Self { log: vec![log], mapping, format: None, gnss_raw: None, origin: None, part: PartArgs::default() }
    }

    /// The same log under another mapping.
    pub fn with_mapping(&self, path: &Path) -> Self {
        Self { mapping: Some(path.to_owned()), ..self.clone() }
    }

    /// Whether the log can be read only once.
    pub fn is_standard_input(&self) -> bool {
        self.log.iter().any(|path| path.as_os_str() == "-")
    }

    /// Read the log slice by slice.
    ///
    /// # Errors
    /// One sentence naming file, row and column.
    pub fn open(&self) -> Result<Opened, String> {
        self.open_and(false)
    }

    /// The same, held against physics however large it is.
    ///
    /// # Errors
    /// Those of [`LogArgs::open`].
    pub fn open_examined(&self) -> Result<Opened, String> {
        self.open_and(true)
    }

    fn open_and(&self, examine: bool) -> Result<Opened, String> {
        let mut opened = match &self.gnss_raw {
            Some(path) if self.log.is_empty() => {
                let file = File::open(path).map_err(|e| unreadable(path, e))?;
                let table =
                    read_csv(&mut IoSource::new(file, None), &path.display().to_string()).map_err(|e| e.to_string())?;
                let (drive, report) = open_raw(&table).map_err(|e| e.to_string())?;
                Opened { drive, report }
            }
            _ => self.open_log(examine)?,
        };
        if let Some(origin) = self.origin {
            opened.drive.set_origin(origin.place());
            opened.report.mapping.origin = Some(origin);
        }
        Ok(opened)
    }

    fn open_log(&self, examine: bool) -> Result<Opened, String> {
        let mapping = match &self.mapping {
            Some(path) => {
                Some(Mapping::from_json(&text_file(path)?, &path.display().to_string()).map_err(|e| e.to_string())?)
            }
            None => None,
        };
        let mut sources: Vec<Box<dyn Source>> = Vec::new();
        for path in &self.log {
            if path.as_os_str() == "-" {
                sources.push(Box::new(self.standard_input()?));
            } else if path.is_dir() {
                folder(path, path, &mut sources)?;
            } else {
                let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
                sources.push(file(path, &name)?);
            }
        }
        let keep = self.part.keep()?;
        let mut opening = Opening::new(sources).map_err(|e| e.to_string())?;
        opening.keep(keep);
        while opening.step().map_err(sentence)? {}
        let log = opening.finish().map_err(sentence)?;
        self.part.check(&log)?;
        let open = if examine { open_log_whole } else { open_log };
        let (mut drive, report) = open(log, mapping.as_ref()).map_err(sentence)?;
        if let Some(path) = &self.gnss_raw {
            let file = File::open(path).map_err(|e| unreadable(path, e))?;
            let table =
                read_csv(&mut IoSource::new(file, None), &path.display().to_string()).map_err(|e| e.to_string())?;
            drive.raw_gnss = raw_gnss(&table, report.mapping.time.offset).map_err(|e| e.to_string())?;
        }
        Ok(Opened { drive, report })
    }

    fn standard_input(&self) -> Result<MemorySource, String> {
        let Some(format) = &self.format else {
            return Err("standard input has no name to tell its format; give --format csv".into());
        };
        let mut bytes = Vec::new();
        std::io::stdin().lock().read_to_end(&mut bytes).map_err(|e| format!("-: could not be read: {e}"))?;
        // The name's ending is what a name can tell of a format.
        let name = if format == "csv" { "-".to_owned() } else { format!("-.{format}") };
        Ok(MemorySource::new(&name, bytes))
    }
}

fn file(path: &Path, name: &str) -> Result<Box<dyn Source>, String> {
    let file = File::open(path).map_err(|e| unreadable(path, e))?;
    Ok(Box::new(SeekSource::new(name, file).map_err(|e| unreadable(path, e))?))
}

/// Every file below a folder, named by its way from the folder.
fn folder(root: &Path, at: &Path, sources: &mut Vec<Box<dyn Source>>) -> Result<(), String> {
    let failed = |e: std::io::Error| unreadable(at, e);
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(at).map_err(failed)? {
        entries.push(entry.map_err(failed)?.path());
    }
    entries.sort();
    for path in entries {
        let hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
        if path.is_dir() && !hidden {
            folder(root, &path, sources)?;
        } else if !hidden {
            let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            sources.push(file(&path, &name)?);
        }
    }
    Ok(())
}

fn unreadable(path: &Path, error: impl std::fmt::Display) -> String {
    format!("{}: could not be read: {error}", path.display())
}

/// A JSON file.
///
/// # Errors
/// One sentence naming the file and, for bad JSON, line and column.
pub fn json_file(path: &Path) -> Result<Value, String> {
    serde_json::from_str(&text_file(path)?).map_err(|e| format!("{}: is not JSON: {e}", path.display()))
}

fn text_file(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|e| unreadable(path, e))
}
