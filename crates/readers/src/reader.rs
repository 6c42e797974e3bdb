//! The calls of JavaScript.

use drivescope_door::{Handover, Progress, plain, sentence};
use drivescope_import::{
    Examined, Format, ImportError, Keep, Mapping, Offer, Opening, Source, choices, examine_drawn, open_drawn,
};
use js_sys::{Array, Date, Float64Array};
use wasm_bindgen::prelude::*;
use web_sys::File;

use crate::dropped::Dropped;

/// Parts of a column's small picture.
const PICTURE: usize = 80;

/// What a dropped file is to the others: `database` says what the frames of a bus log mean, `bus` may be or hold a bus
/// log, `log` needs none.
#[wasm_bindgen]
pub fn role(file: File) -> Result<String, JsError> {
    let name = file.name();
    let format = Dropped::new(file).format().map_err(|e| JsError::new(&format!("{name}: {e}")))?;
    let role = match format {
        Format::Dbc => "database",
        Format::Blf | Format::Asc | Format::Candump | Format::Mdf4 | Format::Gzip | Format::Zip => "bus",
        _ => "log",
    };
    Ok(role.into())
}

/// Reads files. Lives in the worker of the session.
#[wasm_bindgen]
#[derive(Default)]
pub struct Reader {
    reading: Option<Reading>,
    read: Option<Handover>,
    examined: Option<Array>,
    offer: Option<Offer>,
}

/// Files that are being read.
struct Reading {
    opening: Opening,
    mapping: Option<Mapping>,
    /// It ends in an examination, not in a drive.
    is_examination: bool,
    /// Nothing is left to read.
    is_read: bool,
}

#[wasm_bindgen]
impl Reader {
    /// A reader without a file.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Start reading dropped files, which are one drive; `mapping` is the text of a saved mapping, undefined lets the
    /// reader propose one; `keep` says as JSON what is read of a large file ([`Keep`]), undefined all of it.
    pub fn begin(&mut self, files: Vec<File>, mapping: Option<String>, keep: Option<String>) -> Result<(), JsError> {
        self.cancel();
        let mapping = mapping.map(|text| Mapping::from_json(&text, "mapping.json")).transpose().map_err(sentence)?;
        let sources = files.into_iter().map(|f| -> Box<dyn Source> { Box::new(Dropped::new(f)) }).collect();
        let mut opening = Opening::new(sources).map_err(sentence)?;
        if let Some(keep) = keep {
            opening.keep(serde_json::from_str::<Keep>(&keep).map_err(sentence)?);
        }
        self.reading = Some(Reading { opening, mapping, is_examination: false, is_read: false });
        Ok(())
    }

    /// Start reading dropped files in order to examine them by physics: [`Reader::examination`] instead of a drive.
    pub fn begin_examination(&mut self, files: Vec<File>, keep: Option<String>) -> Result<(), JsError> {
        self.begin(files, None, keep)?;
        if let Some(reading) = &mut self.reading {
            reading.is_examination = true;
        }
        Ok(())
    }

    /// Go on reading for about `budget_ms`; at the end the drive can be taken as its head and its parts. An error ends it.
    pub fn read_some(&mut self, budget_ms: f64) -> Result<JsValue, JsError> {
        let deadline = Date::now() + budget_ms;
        let Some(mut reading) = self.reading.take() else { return Err(JsError::new("nothing is being read")) };
        while !reading.is_read {
            reading.is_read = !reading.opening.step().map_err(|e| self.refused(&e))?;
            if reading.is_read || Date::now() >= deadline {
                let progress = reading.opening.progress();
                let stage = if reading.is_read { "mapping" } else { "reading" };
                self.reading = Some(reading);
                return plain(&Progress { done: false, fraction: progress.fraction, stage, rows: progress.rows });
            }
        }
        let log = reading.opening.finish().map_err(sentence)?;
        if reading.is_examination {
            self.examined = Some(handed(&examine_drawn(log, PICTURE).map_err(sentence)?)?);
            return plain(&Progress { done: true, fraction: 1.0, stage: "mapping", rows: 0 });
        }
        let (drive, report, examined) = open_drawn(log, reading.mapping.as_ref(), PICTURE).map_err(sentence)?;
        self.examined = examined.as_ref().map(handed).transpose()?;
        self.read = Some(Handover::new(drive, plain(&report)?));
        plain(&Progress { done: true, fraction: 1.0, stage: "mapping", rows: report.rows })
    }

    /// What the drive says besides its columns: name, parameters of the car, rear axle (m), Unix time of `t = 0` (s), each
    /// undefined where it says nothing; then the report on what was found.
    pub fn head(&self) -> Result<Array, JsError> {
        let read = self.read.as_ref().ok_or_else(|| JsError::new("nothing was read"))?;
        Ok(read.head())
    }

    /// What was examined: what was found ([`drivescope_import::Examination`]), and of each of its columns a small picture,
    /// the least and the largest value of equal parts in turn; then what a column can be read as
    /// ([`drivescope_import::choices`]), and the columns thinned for [`crate::try_mapping`]. Undefined before, and after
    /// a drive was read whose columns were not examined. What was taken is no longer held here.
    pub fn examination(&mut self) -> Option<Array> {
        self.examined.take()
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

    /// What would make the file fit that was refused for its size: columns, seconds, every nth row; undefined otherwise.
    pub fn offer(&self) -> Result<JsValue, JsError> {
        self.offer.as_ref().map_or(Ok(JsValue::UNDEFINED), plain)
    }

    /// Give up what is being read or was read.
    pub fn cancel(&mut self) {
        (self.reading, self.read, self.examined, self.offer) = (None, None, None, None);
    }
}

/// What was examined, as JavaScript holds it.
fn handed(examined: &Examined) -> Result<Array, JsError> {
    let Examined { found, pictures, thin } = examined;
    let pictures: Array = pictures.iter().map(|p| Float64Array::from(p.as_slice())).collect();
    Ok(Array::of4(&plain(found)?, &pictures, &plain(&choices())?, &crate::trial::handed(thin)))
}

impl Reader {
    fn refused(&mut self, error: &ImportError) -> JsError {
        if let ImportError::TooLarge { offer, .. } = error {
            self.offer = Some(*offer);
        }
        sentence(error)
    }
}
