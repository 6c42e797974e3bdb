//! A drive whose parts another module hands over.

use drivescope_drive::drive::Drive;
use drivescope_drive::parts::{Assembly, Head};
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

use crate::sentence;

/// A drive that has come.
pub struct Arrived {
    /// The drive.
    pub drive: Drive,
    /// What the reader said, with the mapping it used, a plain object; absent for a simulation.
    pub report: Option<JsValue>,
}

/// A drive of which parts are still to come.
pub struct Arrival {
    assembly: Assembly,
    report: Option<JsValue>,
}

impl Arrival {
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
    pub fn finish(self) -> Arrived {
        Arrived { drive: self.assembly.finish(), report: self.report }
    }
}
