//! What the room of motion asks besides runs: the decisions of the mode, labels painted by hand, and as what the
//! six-accelerometer disk is read.

use drivescope_door::plain;
use drivescope_drive::disk::Disk;
use drivescope_estimation::motion_mode::decisions::changes;
use drivescope_estimation::score::labels::Labels;
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

use crate::session::Session;

#[wasm_bindgen]
impl Session {
    /// Every change of mode of a result of `motion_mode`, thirteen numbers each: time, mode before (NaN at the start), mode
    /// after, rule, indicator, then JD, TD, FD, YD, each followed by its threshold.
    pub fn decisions(&self, source: &str) -> Float64Array {
        let changes = self.series(source).map(changes).unwrap_or_default();
        let flat: Vec<f64> = (changes.iter())
            .flat_map(|c| [c.time, c.from, c.to, c.rule, c.indicator].into_iter().chain(c.statistics))
            .collect();
        Float64Array::from(flat.as_slice())
    }

    /// Paint a mode (NaN wipes) over a stretch of time, s. Labels are times and, in the second half, modes, NaN where
    /// nothing is said.
    pub fn labels_paint(&self, labels: &[f64], from: f64, to: f64, mode: f64) -> Float64Array {
        let mut labels = read(labels);
        labels.paint(from, to, (mode >= 0.0).then_some(mode as u8));
        let list = labels.list();
        let times = list.iter().map(|l| l.time);
        let modes = list.iter().map(|l| l.mode.map_or(f64::NAN, f64::from));
        Float64Array::from(times.chain(modes).collect::<Vec<f64>>().as_slice())
    }

    /// The decided mode of a result held against labels; null where no row has both.
    pub fn labels_score(&self, source: &str, labels: &[f64]) -> Result<JsValue, JsError> {
        let labels = read(labels);
        plain(&self.series(source).and_then(|series| labels.score_series(series, "mode")))
    }

    /// Read the drive's disk as one of these 42 numbers; without numbers as it is drawn. What it was read as comes back,
    /// empty for the drawing.
    pub fn disk_apply(&mut self, numbers: &[f64]) -> Float64Array {
        let before = std::mem::replace(&mut self.drive.disk, Disk::from_numbers(numbers));
        Float64Array::from(before.map_or_else(Vec::new, |d| d.numbers()).as_slice())
    }
}

fn read(labels: &[f64]) -> Labels {
    let (times, modes) = labels.split_at(labels.len() / 2);
    Labels::from_rows(times, modes)
}
