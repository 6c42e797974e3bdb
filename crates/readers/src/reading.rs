//! Files on their way to a drive, read slice by slice.

use drivescope_door::sentence;
use drivescope_drive::drive::Drive;
use drivescope_import::{CsvReader, Mapping, OpenReport, Table, is_raw_gnss, open_table, raw_gnss};
use js_sys::{ArrayBuffer, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{File, FileReaderSync};

/// Bytes read from a file at a time.
const SLICE: f64 = 2_097_152.0;

/// Files that are being read, one after the other.
pub struct Reading {
    file: File,
    offset: f64,
    reader: CsvReader,
    mapping: Option<Mapping>,
    waiting: Vec<File>,
    tables: Vec<Table>,
}

impl Reading {
    /// Start on a file; `waiting` are the others that were dropped with it.
    pub fn new(file: File, mapping: Option<Mapping>, waiting: Vec<File>) -> Self {
        let reader = reader(&file);
        Self { file, offset: 0.0, reader, mapping, waiting, tables: Vec::new() }
    }

    /// Do one more piece of work; whether there is more to do.
    pub fn step(&mut self) -> Result<bool, JsError> {
        if self.offset < self.file.size() {
            self.reader.feed(&slice(&self.file, self.offset, SLICE)?).map_err(sentence)?;
            self.offset += SLICE;
            return Ok(true);
        }
        let Some(file) = self.waiting.pop() else { return Ok(false) };
        let read = std::mem::replace(&mut self.reader, reader(&file));
        self.tables.push(read.finish().map_err(sentence)?);
        (self.file, self.offset) = (file, 0.0);
        Ok(true)
    }

    /// The drive, once nothing is left to do, and what was found.
    pub fn finish(mut self) -> Result<(Drive, OpenReport), JsError> {
        self.tables.push(self.reader.finish().map_err(sentence)?);
        joined(self.tables, self.mapping.as_ref())
    }

    /// Share of the file read so far, 0 to 1.
    pub fn fraction(&self) -> f64 {
        (self.offset / self.file.size()).min(1.0)
    }

    /// Rows of the file read so far.
    pub fn rows(&self) -> usize {
        self.reader.rows()
    }
}

fn reader(file: &File) -> CsvReader {
    let mut reader = CsvReader::new(&file.name());
    reader.expect_bytes(file.size() as u64);
    reader
}

/// The drive of one log, and of the raw ranges that were dropped with it.
fn joined(tables: Vec<Table>, mapping: Option<&Mapping>) -> Result<(Drive, OpenReport), JsError> {
    let (mut raw, mut logs): (Vec<Table>, Vec<Table>) = tables.into_iter().partition(is_raw_gnss);
    let (Some(log), true) = (logs.pop(), logs.is_empty() && raw.len() < 2) else {
        return Err(JsError::new("expected one log, alone or with its table of raw ranges (t, prn, sat_x, .., pr)"));
    };
    let (mut drive, report) = open_table(log, mapping).map_err(sentence)?;
    if let Some(table) = raw.pop() {
        drive.raw_gnss = raw_gnss(&table, report.mapping.time.offset).map_err(sentence)?;
    }
    Ok((drive, report))
}

fn slice(file: &File, offset: f64, length: f64) -> Result<Vec<u8>, JsError> {
    let failed = |_| JsError::new(&format!("{}: the browser could not read the file; open it again", file.name()));
    let blob = file.slice_with_f64_and_f64(offset, offset + length).map_err(failed)?;
    let buffer: ArrayBuffer = FileReaderSync::new().and_then(|r| r.read_as_array_buffer(&blob)).map_err(failed)?;
    Ok(Uint8Array::new(&buffer).to_vec())
}
