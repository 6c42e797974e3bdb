//! Opening a drive whose parts another module hands over. The open drive stays until this has succeeded.

use drivescope_door::sentence;
use drivescope_drive::drive::Drive;
use drivescope_drive::parts::{Assembly, Head};
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

/// A drive that has been opened.
pub struct Opened {
    /// The drive.
    pub drive: Drive,
    /// What the reader said, with the mapping it used, a plain object; absent for a simulation.
    pub report: Option<JsValue>,
}

/// A drive of which parts are still to come.
pub struct Opening {
    assembly: Assembly,
    report: Option<JsValue>,
}

impl Opening {
    /// Start on the parts of a drive; `report` is what the reader said, undefined or null for a simulation.
    pub fn new(head: Head, report: JsValue) -> Result<Self, JsError> {
        let report = Some(report).filter(|r| !r.is_null() && !r.is_undefined());
        Ok(Self { assembly: Assembly::new(head).map_err(sentence)?, report })
    }

    /// Take one part of the drive.
    pub fn add(
        &mut self,
        part: &str,
        names: Vec<String>,
        time: Vec<f64>,
        columns: &[Float64Array],
    ) -> Result<(), JsError> {
        if names.len() != columns.len() {
            return Err(JsError::new("a part of a drive has as many columns as names"));
        }
        let columns = names.into_iter().zip(columns.iter().map(Float64Array::to_vec)).collect();
        self.assembly.add(part, time, columns).map_err(sentence)
    }

    /// The drive: nothing more comes.
    pub fn finish(self) -> Opened {
        Opened { drive: self.assembly.finish(), report: self.report }
    }
}
