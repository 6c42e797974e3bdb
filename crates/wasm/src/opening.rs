//! Opening a drive in steps: a simulation, or a file read slice by slice. The open drive stays until this has succeeded.

use drivescope_drive::drive::Drive;
use drivescope_import::{CsvReader, Mapping, OpenReport, Table, is_raw_gnss, open_table, raw_gnss};
use drivescope_simulation::Simulation;
use js_sys::{ArrayBuffer, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{File, FileReaderSync};

use crate::reports::{Progress, sentence};

/// Bytes read from a file at a time.
const SLICE: f64 = 2_097_152.0;
/// Seconds simulated at a time.
const SIMULATED: f64 = 5.0;

/// A drive that has been opened.
pub struct Opened {
    /// The drive.
    pub drive: Drive,
    /// What the reader said, with the mapping it used; absent for a simulation.
    pub report: Option<OpenReport>,
}

/// What one piece of work led to.
pub enum Step {
    /// The drive is there.
    Done(Box<Opened>),
    /// There is more to do.
    More(Opening),
}

/// Work on opening a drive.
pub enum Opening {
    /// A drive that is being simulated.
    Simulation(Box<Simulation>),
    /// Files that are being read, one after the other.
    Reading(Box<Reading>),
}

/// Files on their way to a drive.
pub struct Reading {
    file: File,
    offset: f64,
    reader: CsvReader,
    mapping: Option<Mapping>,
    waiting: Vec<File>,
    tables: Vec<Table>,
}

impl Opening {
    /// Start on a file; `waiting` are the others that were dropped with it.
    pub fn files(file: File, mapping: Option<Mapping>, waiting: Vec<File>) -> Self {
        let reader = reader(&file);
        Self::Reading(Box::new(Reading { file, offset: 0.0, reader, mapping, waiting, tables: Vec::new() }))
    }

    /// Do one more piece of work: the drive, or what is left to do.
    pub fn step(self) -> Result<Step, JsError> {
        match self {
            Self::Simulation(mut simulation) => Ok(if simulation.advance(SIMULATED) {
                if let Some(failure) = simulation.failure() {
                    return Err(sentence(failure));
                }
                Step::Done(Box::new(Opened { drive: simulation.finish(), report: None }))
            } else {
                Step::More(Self::Simulation(simulation))
            }),
            Self::Reading(mut reading) => {
                if reading.offset < reading.file.size() {
                    reading.reader.feed(&slice(&reading.file, reading.offset, SLICE)?).map_err(sentence)?;
                    reading.offset += SLICE;
                    return Ok(Step::More(Self::Reading(reading)));
                }
                let Some(file) = reading.waiting.pop() else {
                    let Reading { reader, mapping, mut tables, .. } = *reading;
                    tables.push(reader.finish().map_err(sentence)?);
                    return joined(tables, mapping.as_ref());
                };
                let read = std::mem::replace(&mut reading.reader, reader(&file));
                reading.tables.push(read.finish().map_err(sentence)?);
                (reading.file, reading.offset) = (file, 0.0);
                Ok(Step::More(Self::Reading(reading)))
            }
        }
    }

    /// The drive as simulated so far; `None` for a file, which is no drive before its end.
    pub fn so_far(&self) -> Option<&Drive> {
        match self {
            Self::Simulation(simulation) => Some(simulation.drive()),
            Self::Reading(_) => None,
        }
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        match self {
            Self::Simulation(s) => {
                let rows = s.drive().imu.len();
                Progress { done: false, fraction: s.fraction(), stage: "simulating", rows }
            }
            Self::Reading(r) => Progress {
                done: false,
                fraction: (r.offset / r.file.size()).min(1.0),
                stage: "reading",
                rows: r.reader.rows(),
            },
        }
    }
}

fn reader(file: &File) -> CsvReader {
    let mut reader = CsvReader::new(&file.name());
    reader.expect_bytes(file.size() as u64);
    reader
}

/// The drive of one log, and of the raw ranges that were dropped with it.
fn joined(tables: Vec<Table>, mapping: Option<&Mapping>) -> Result<Step, JsError> {
    let (mut raw, mut logs): (Vec<Table>, Vec<Table>) = tables.into_iter().partition(is_raw_gnss);
    let (Some(log), true) = (logs.pop(), logs.is_empty() && raw.len() < 2) else {
        return Err(JsError::new("expected one log, alone or with its table of raw ranges (t, prn, sat_x, .., pr)"));
    };
    let (mut drive, report) = open_table(log, mapping).map_err(sentence)?;
    if let Some(table) = raw.pop() {
        drive.raw_gnss = raw_gnss(&table, report.mapping.time.offset).map_err(sentence)?;
    }
    Ok(Step::Done(Box::new(Opened { drive, report: Some(report) })))
}

fn slice(file: &File, offset: f64, length: f64) -> Result<Vec<u8>, JsError> {
    let failed = |_| JsError::new(&format!("{}: the browser could not read the file; open it again", file.name()));
    let blob = file.slice_with_f64_and_f64(offset, offset + length).map_err(failed)?;
    let buffer: ArrayBuffer = FileReaderSync::new().and_then(|r| r.read_as_array_buffer(&blob)).map_err(failed)?;
    Ok(Uint8Array::new(&buffer).to_vec())
}
