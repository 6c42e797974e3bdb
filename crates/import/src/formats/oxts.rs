//! OxTS text as KITTI has it: thirty numbers a row (one file per row in KITTI), times in a file `timestamps.txt` beside.
//!
//! Axes there are x forward, y left, z up; roll and the accelerations are turned to our convention by the signs below.
//! Source: the data format page of the KITTI raw recordings.

use std::rc::Rc;

use super::grower::{Grower, Zero, is, turned};
use super::lines::{Lines, number, words};
use super::{Context, Reader};
use crate::error::{ImportError, excerpt, form};
use crate::opening::Gathered;
use crate::order::sort_by;
use crate::stamp::{self, Stamp};
use crate::table::Meaning;

const WIDTH: usize = 30;

const COLUMNS: [(&str, &str, Option<Meaning>); WIDTH] = [
    ("lat", "deg", is("gnss_lat")),
    ("lon", "deg", is("gnss_lon")),
    ("alt", "m", is("gnss_alt")),
    ("roll", "rad", is("truth_roll")),
    ("pitch", "rad", turned("truth_pitch")),
    ("yaw (east, left)", "rad", None),
    ("vn", "m/s", is("gnss_vn")),
    ("ve", "m/s", is("gnss_ve")),
    ("vf", "m/s", is("truth_vx")),
    ("vl", "m/s", turned("truth_vy")),
    ("vu", "m/s", turned("gnss_vd")),
    ("ax", "m/s^2", is("accel_x")),
    ("ay", "m/s^2", turned("accel_y")),
    ("az", "m/s^2", turned("accel_z")),
    ("af", "m/s^2", None),
    ("al", "m/s^2", None),
    ("au", "m/s^2", None),
    ("wx", "rad/s", is("gyro_x")),
    ("wy", "rad/s", turned("gyro_y")),
    ("wz", "rad/s", turned("gyro_z")),
    ("wf", "rad/s", None),
    ("wl", "rad/s", None),
    ("wu", "rad/s", None),
    ("pos_accuracy", "m", None),
    ("vel_accuracy", "m/s", None),
    ("navstat", "", None),
    ("numsats", "", is("gnss_nsat")),
    ("posmode", "", None),
    ("velmode", "", None),
    ("orimode", "", None),
];

/// Rows of one file and where it was.
#[derive(Debug)]
pub(crate) struct Rows {
    path: String,
    rows: Vec<[f64; WIDTH]>,
}

/// Times of a file `timestamps.txt`.
#[derive(Debug)]
pub(crate) struct Stamps {
    path: String,
    times: Vec<i64>,
}

/// Whether a line is a row of thirty numbers.
pub(crate) fn is_row(line: &[u8]) -> bool {
    words(line).count() == WIDTH && words(line).all(|w| number(w).is_some())
}

/// Whether a file is the list of times.
pub(crate) fn is_stamps(name: &str, head: &[u8]) -> bool {
    let first = head.split(|&b| b == b'\n').next().unwrap_or_default();
    name.ends_with("timestamps.txt") && stamp_of(first).is_some()
}

fn stamp_of(line: &[u8]) -> Option<i64> {
    match stamp::parse(line.trim_ascii()) {
        Some(Stamp::Instant(ns)) => Some(ns),
        _ => None,
    }
}

fn path_of(context: &Context) -> String {
    if context.part.is_empty() { context.file.to_string() } else { context.part.clone() }
}

/// The folder above a path, and the one above that where it is called `data`.
fn folder(path: &str) -> &str {
    let above = path.rsplit_once('/').map_or("", |(folder, _)| folder);
    above.strip_suffix("/data").unwrap_or(if above == "data" { "" } else { above })
}

/// Reads rows of thirty numbers.
pub(crate) struct Oxts {
    file: Rc<str>,
    lines: Lines,
    found: Rows,
}

impl Oxts {
    pub fn new(context: Context) -> Self {
        let found = Rows { path: path_of(&context), rows: Vec::new() };
        Self { file: context.file, lines: Lines::default(), found }
    }
}

fn row_of(file: &str, row: usize, line: &[u8], rows: &mut Vec<[f64; WIDTH]>) -> Result<(), ImportError> {
    if line.trim_ascii().is_empty() {
        return Ok(());
    }
    let mut values = [f64::NAN; WIDTH];
    let mut count = 0;
    for word in words(line) {
        let value = number(word).ok_or_else(|| {
            let column = COLUMNS.get(count).map_or("", |c| c.0).to_owned();
            ImportError::NotANumber { file: file.to_owned(), row, column, found: excerpt(word) }
        })?;
        values.get_mut(count).into_iter().for_each(|v| *v = value);
        count += 1;
    }
    if count != WIDTH {
        let reference = "the OxTS text format".into();
        return Err(ImportError::Ragged { file: file.to_owned(), row, expected: WIDTH, found: count, reference });
    }
    rows.push(values);
    Ok(())
}

impl Reader for Oxts {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        let rows = &mut self.found.rows;
        let file = self.file.clone();
        self.lines.feed(&self.file, bytes, &mut |n, line| row_of(&file, n, line, rows))
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let rows = &mut self.found.rows;
        self.lines.finish(&mut |n, line| row_of(&self.file, n, line, rows))?;
        log.oxts.push(self.found);
        Ok(())
    }

    fn rows(&self) -> usize {
        self.found.rows.len()
    }
}

/// Reads a list of times, one a row.
pub(crate) struct StampList {
    file: Rc<str>,
    lines: Lines,
    found: Stamps,
}

impl StampList {
    pub fn new(context: Context) -> Self {
        let found = Stamps { path: path_of(&context), times: Vec::new() };
        Self { file: context.file, lines: Lines::default(), found }
    }
}

fn time_of(file: &str, row: usize, line: &[u8], times: &mut Vec<i64>) -> Result<(), ImportError> {
    if line.trim_ascii().is_empty() {
        return Ok(());
    }
    let time = stamp_of(line).ok_or_else(|| {
        let column = "time".to_owned();
        ImportError::NotATime { file: file.to_owned(), row, column, found: excerpt(line) }
    })?;
    times.push(time);
    Ok(())
}

impl Reader for StampList {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        let times = &mut self.found.times;
        let file = self.file.clone();
        self.lines.feed(&self.file, bytes, &mut |n, line| time_of(&file, n, line, times))
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let times = &mut self.found.times;
        self.lines.finish(&mut |n, line| time_of(&self.file, n, line, times))?;
        log.stamps.push(self.found);
        Ok(())
    }
}

/// Make a table of the rows of each folder, with the times found beside them.
pub(crate) fn assemble(log: &mut Gathered) -> Result<(), ImportError> {
    let mut found = std::mem::take(&mut log.oxts);
    let stamps = std::mem::take(&mut log.stamps);
    sort_by(&mut found, |a, b| a.path.cmp(&b.path));
    let by_folder = found.chunk_by(|a, b| folder(&a.path) == folder(&b.path));
    for parts in by_folder {
        let place = folder(&parts[0].path);
        let rows: Vec<&[f64; WIDTH]> = parts.iter().flat_map(|p| &p.rows).collect();
        let times = stamps.iter().find(|s| folder(&s.path) == place).map(|s| s.times.as_slice());
        if let Some(times) = times.filter(|t| t.len() != rows.len()) {
            let (expected, found) = (format!("{} times, one for each row", rows.len()), times.len().to_string());
            return Err(form(place, "timestamps.txt".into(), &expected, &found, "give all files of the recording"));
        }
        if times.is_none() {
            log.warn(format!("{}: no timestamps.txt beside it: the rows are taken as 0.1 s apart.", parts[0].path));
        }
        let mut grower = Grower::with(&parts[0].path.as_str().into(), place, &COLUMNS);
        for (i, row) in rows.iter().enumerate() {
            grower.row(times.map_or(i as i64 * 100_000_000, |t| t[i]), *row)?;
        }
        let zero = if times.is_some() { Zero::Unix } else { Zero::Unknown };
        log.tables.extend(grower.finish("OxTS text", zero));
    }
    Ok(())
}
