//! The door of the sensors' doctor: a WebAssembly module of its own, which the page loads once a drive is there to be
//! examined, so that the core that it loads first stays small.
//!
//! In: the sensors of a drive as it was read, in parts that the core hands over. Out: what is wrong with its magnetometer
//! and what would mend it, and the calibration of its six-accelerometer disk. The core applies it. No view into wasm memory
//! outlives a call. No arithmetic happens here.

mod compass;
mod disk;

use drivescope_door::{Arrival, sentence};
use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_drive::parts::Head;
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

/// One drive under examination. Lives in a worker.
#[wasm_bindgen]
#[derive(Default)]
pub struct Doctor {
    drive: Drive,
    arrival: Option<Arrival>,
    field: [Option<Series>; 2],
}

#[wasm_bindgen]
impl Doctor {
    /// A doctor without a drive.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Start on a drive that the core hands over: its head, as `drivescope_door::Handover` gives it.
    pub fn begin_parts(
        &mut self,
        name: String,
        vehicle: Option<Vec<f64>>,
        rear_axle: Option<f64>,
        unix_zero: Option<f64>,
        report: JsValue,
        disk: Option<Vec<f64>>,
    ) -> Result<(), JsError> {
        // The drive before is let go first: two of them need not fit.
        *self = Self::default();
        self.arrival = Some(Arrival::new(Head { name, vehicle, rear_axle, unix_zero, disk }, report)?);
        Ok(())
    }

    /// Take one part: its name, the names of its columns, its times (s), its columns (an empty one has no value).
    pub fn add_part(
        &mut self,
        part: &str,
        names: Vec<String>,
        time: Vec<f64>,
        columns: Vec<Float64Array>,
    ) -> Result<(), JsError> {
        self.arrival.as_mut().ok_or_else(not_coming)?.add(part, names, time, &columns)
    }

    /// The parts have all come.
    pub fn end_parts(&mut self) -> Result<(), JsError> {
        self.drive = self.arrival.take().ok_or_else(not_coming)?.finish().drive;
        Ok(())
    }
}

fn not_coming() -> JsError {
    sentence("no drive is coming")
}
