//! Faults in the open drive: put in, and taken out again.

use drivescope_door::sentence;
use drivescope_drive::drive::Drive;
use drivescope_drive::fault::Fault;
use serde_json::Value;
use wasm_bindgen::prelude::*;

use crate::session::Session;

/// The faults in a drive, and the drive without them.
#[derive(Default)]
pub struct Faults {
    list: Vec<Fault>,
    good: Option<Box<Drive>>,
}

impl Faults {
    /// The drive without its faults; `None` where it has none.
    pub fn good(&self) -> Option<&Drive> {
        self.good.as_deref()
    }
}

#[wasm_bindgen]
impl Session {
    /// Put faults into the drive in place of those that are in it; objects as `drive::fault::Fault` reads them, an empty list for
    /// none. Nothing changes if one of them cannot be. Results stay until they are run again.
    pub fn set_faults(&mut self, faults: JsValue) -> Result<(), JsError> {
        let value: Value = serde_wasm_bindgen::from_value(faults).map_err(sentence)?;
        let objects = value.as_array().map_or(&[][..], Vec::as_slice);
        let list = objects.iter().map(Fault::from_json).collect::<Result<Vec<_>, _>>().map_err(sentence)?;
        let before = self.take_faults();
        let put = self.put_faults(list);
        if put.is_err() {
            // They were in before: they can be put in again.
            self.put_faults(before)?;
        }
        put
    }
}

impl Session {
    /// Take the faults out of the drive.
    pub(crate) fn take_faults(&mut self) -> Vec<Fault> {
        if let Some(good) = self.faults.good.take() {
            self.drive = *good;
        }
        std::mem::take(&mut self.faults.list)
    }

    /// Put faults into a drive that has none.
    pub(crate) fn put_faults(&mut self, list: Vec<Fault>) -> Result<(), JsError> {
        if list.is_empty() {
            return Ok(());
        }
        let mut faulty = self.drive.clone();
        for fault in &list {
            fault.inject(&mut faulty).map_err(sentence)?;
        }
        self.faults = Faults { list, good: Some(Box::new(std::mem::replace(&mut self.drive, faulty))) };
        Ok(())
    }
}
