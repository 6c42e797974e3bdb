//! A drive on its way from the module that made it to the core.

use drivescope_drive::drive::Drive;
use drivescope_drive::parts::{Part, Parts, parts};
use js_sys::{Array, Float64Array};
use wasm_bindgen::prelude::*;

/// A drive that is handed over: its head, then part after part.
pub struct Handover {
    head: Array,
    parts: Parts,
}

impl Handover {
    /// Take a drive apart; `report` is what the reader says about it, undefined for a drive that was simulated.
    pub fn new(drive: Drive, report: JsValue) -> Self {
        let (head, parts) = parts(drive);
        let numbers = |n: Option<Vec<f64>>| n.map_or(JsValue::UNDEFINED, |v| Float64Array::from(v.as_slice()).into());
        let (vehicle, disk) = (numbers(head.vehicle), numbers(head.disk));
        let head = Array::of5(&head.name.into(), &vehicle, &head.rear_axle.into(), &head.unix_zero.into(), &report);
        head.push(&disk);
        Self { head, parts }
    }

    /// What the drive says besides its columns: name, parameters of the car, rear axle (m), Unix time of `t = 0` (s), each
    /// undefined where it says nothing; then the report, and the disk's numbers.
    pub fn head(&self) -> Array {
        self.head.clone()
    }
}

impl Iterator for Handover {
    type Item = Array;

    /// The next part: its name, the names of its columns, its times (s), its columns (an empty one has no value). What was
    /// taken is no longer held.
    fn next(&mut self) -> Option<Array> {
        self.parts.next().map(given)
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
