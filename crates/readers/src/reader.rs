//! The calls of JavaScript.

use drivescope_drive::parts::{Part, Parts, parts};
use drivescope_import::Mapping;
use js_sys::{Array, Date, Float64Array};
use serde::Serialize;
use wasm_bindgen::prelude::*;
use web_sys::File;

use crate::reading::Reading;

/// An error whose message is the sentence for the user.
pub fn sentence(error: impl std::fmt::Display) -> JsError {
    JsError::new(&error.to_string())
}

/// A plain object: maps become objects, no number becomes a BigInt.
fn plain(value: &impl Serialize) -> Result<JsValue, JsError> {
    value.serialize(&serde_wasm_bindgen::Serializer::json_compatible()).map_err(sentence)
}

/// How far a piece of long work has come.
#[derive(Serialize)]
struct Progress {
    done: bool,
    fraction: f64,
    stage: &'static str,
    rows: usize,
}

/// Reads files. Lives in the worker of the session.
#[wasm_bindgen]
#[derive(Default)]
pub struct Reader {
    reading: Option<Reading>,
    read: Option<Read>,
}

/// A drive that was read and not yet handed over.
struct Read {
    head: Array,
    parts: Parts,
}

#[wasm_bindgen]
impl Reader {
    /// A reader without a file.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Start reading a dropped log, perhaps with its raw ranges; `mapping` is the text of a saved mapping, undefined
    /// lets the reader propose one.
    pub fn begin(&mut self, mut files: Vec<File>, mapping: Option<String>) -> Result<(), JsError> {
        self.cancel();
        let mapping = mapping.map(|text| Mapping::from_json(&text, "mapping.json")).transpose().map_err(sentence)?;
        let file = files.pop().ok_or_else(|| JsError::new("no file was given; drop one log"))?;
        self.reading = Some(Reading::new(file, mapping, files));
        Ok(())
    }

    /// Go on reading for about `budget_ms`; at the end the drive can be taken as its head and its parts.
    pub fn read_some(&mut self, budget_ms: f64) -> Result<JsValue, JsError> {
        let deadline = Date::now() + budget_ms;
        let Some(mut reading) = self.reading.take() else { return Err(JsError::new("nothing is being read")) };
        while reading.step()? {
            if Date::now() >= deadline {
                let progress =
                    Progress { done: false, fraction: reading.fraction(), stage: "reading", rows: reading.rows() };
                self.reading = Some(reading);
                return plain(&progress);
            }
        }
        let (drive, report) = reading.finish()?;
        let (head, parts) = parts(drive);
        let vehicle = head.vehicle.map_or(JsValue::UNDEFINED, |v| Float64Array::from(v.as_slice()).into());
        let head =
            Array::of5(&head.name.into(), &vehicle, &head.rear_axle.into(), &head.unix_zero.into(), &plain(&report)?);
        self.read = Some(Read { head, parts });
        plain(&Progress { done: true, fraction: 1.0, stage: "reading", rows: report.rows })
    }

    /// What the drive says besides its columns: name, parameters of the car, rear axle (m), Unix time of `t = 0` (s), each
    /// undefined where it says nothing; then the report on what was found.
    pub fn head(&self) -> Result<Array, JsError> {
        let read = self.read.as_ref().ok_or_else(|| JsError::new("nothing was read"))?;
        Ok(read.head.clone())
    }

    /// The next part: its name, the names of its columns, its times (s), its columns (an empty one has no value);
    /// undefined after the last one. What was taken is no longer held here.
    pub fn next_part(&mut self) -> Option<Array> {
        let part = self.read.as_mut()?.parts.next();
        if part.is_none() {
            self.read = None;
        }
        part.map(given)
    }

    /// Give up what is being read or was read.
    pub fn cancel(&mut self) {
        (self.reading, self.read) = (None, None);
    }
}

/// A part as JavaScript takes it; each column is let go as soon as it is copied.
fn given(part: Part) -> Array {
    let (names, columns) = (Array::new(), Array::new());
    let time = Float64Array::from(part.time.as_slice());
    drop(part.time);
    for (name, column) in part.columns {
        names.push(&name.into());
        columns.push(&Float64Array::from(column.as_slice()));
    }
    Array::of4(&part.name.into(), &names, &time, &columns)
}
