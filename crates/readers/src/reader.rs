//! The calls of JavaScript.

use drivescope_door::{Handover, Progress, plain, sentence};
use drivescope_import::Mapping;
use js_sys::{Array, Date};
use wasm_bindgen::prelude::*;
use web_sys::File;

use crate::reading::Reading;

/// Reads files. Lives in the worker of the session.
#[wasm_bindgen]
#[derive(Default)]
pub struct Reader {
    reading: Option<Reading>,
    read: Option<Handover>,
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
        self.read = Some(Handover::new(drive, plain(&report)?));
        plain(&Progress { done: true, fraction: 1.0, stage: "reading", rows: report.rows })
    }

    /// What the drive says besides its columns: name, parameters of the car, rear axle (m), Unix time of `t = 0` (s), each
    /// undefined where it says nothing; then the report on what was found.
    pub fn head(&self) -> Result<Array, JsError> {
        let read = self.read.as_ref().ok_or_else(|| JsError::new("nothing was read"))?;
        Ok(read.head())
    }

    /// The next part: its name, the names of its columns, its times (s), its columns (an empty one has no value);
    /// undefined after the last one. What was taken is no longer held here.
    pub fn next_part(&mut self) -> Option<Array> {
        let part = self.read.as_mut()?.next();
        if part.is_none() {
            self.read = None;
        }
        part
    }

    /// Give up what is being read or was read.
    pub fn cancel(&mut self) {
        (self.reading, self.read) = (None, None);
    }
}
