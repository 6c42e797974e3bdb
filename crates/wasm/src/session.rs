//! The calls of JavaScript.

use drivescope_door::{Arrival, Arrived, Progress, plain, sentence};
use drivescope_drive::channel::Series;
use drivescope_drive::csv::{write_drive, write_series};
use drivescope_drive::decimate::{Grid, sample_rows, visible_gap};
use drivescope_drive::drive::Drive;
use drivescope_drive::parts::Head;
use drivescope_drive::vehicle::VehicleParams;
use drivescope_estimation::outage::Sweep;
use drivescope_estimation::registry::AnyRun;
use drivescope_estimation::trajectory::{PathPoint, estimated_path, fixes, held, true_path};
use js_sys::{Date, Float64Array, Uint8Array};
use serde_json::Value;
use wasm_bindgen::prelude::*;

use crate::faults::Faults;
use crate::reports::{Catalogue, DriveReport};
use crate::runs::{Slot, Slots, estimator_of};

/// Epochs stepped between two looks at the clock.
pub(crate) const EPOCHS: usize = 2000;

/// One open drive with its runs. Lives in a worker.
#[wasm_bindgen]
pub struct Session {
    pub(crate) drive: Drive,
    pub(crate) compass: crate::compass::Compass,
    pub(crate) road: crate::profile::Road,
    pub(crate) faults: Faults,
    pub(crate) sweep: Option<Box<Sweep>>,
    report: DriveReport,
    opening: Option<Arrival>,
    pub(crate) slots: Slots,
}

impl Default for Session {
    fn default() -> Self {
        Self::new()
    }
}

#[wasm_bindgen]
impl Session {
    /// A session without a drive.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        let drive = Drive::default();
        let report = DriveReport::new(&drive, None);
        Self {
            compass: Default::default(),
            faults: Faults::default(),
            sweep: None,
            drive,
            road: Default::default(),
            report,
            opening: None,
            slots: Slots::new(),
        }
    }

    /// Estimators and vehicles.
    pub fn catalogue(&self) -> Result<JsValue, JsError> {
        plain(&Catalogue::new())
    }

    /// Start on a drive that another module has read or simulated: what it says besides its columns, then what was found in
    /// its file, undefined for a simulation; then its six-accelerometer disk, if it has one that is not as drawn. Its parts follow; [`Session::end_parts`] puts it in place.
    pub fn begin_parts(
        &mut self,
        name: String,
        vehicle: Option<Vec<f64>>,
        rear_axle: Option<f64>,
        unix_zero: Option<f64>,
        report: JsValue,
        disk: Option<Vec<f64>>,
    ) -> Result<(), JsError> {
        self.opening = Some(Arrival::new(Head { name, vehicle, rear_axle, unix_zero, disk }, report)?);
        Ok(())
    }

    /// Take one part: its name, the names of its columns, its times (s), its columns (an empty one has no value). One that
    /// does not fit ends the opening.
    pub fn add_part(
        &mut self,
        part: &str,
        names: Vec<String>,
        time: Vec<f64>,
        columns: Vec<Float64Array>,
    ) -> Result<(), JsError> {
        let mut opening = self.opening.take().ok_or_else(not_opening)?;
        opening.add(part, names, time, &columns)?;
        self.opening = Some(opening);
        Ok(())
    }

    /// The parts have all come: the new drive is in place and all runs are gone.
    pub fn end_parts(&mut self) -> Result<(), JsError> {
        let opened = self.opening.take().ok_or_else(not_opening)?.finish();
        self.put_in_place(opened);
        Ok(())
    }

    /// Give up the parts that have come; the drive that was open stays.
    pub fn cancel_parts(&mut self) {
        self.opening = None;
    }

    /// What the open drive holds.
    pub fn report(&self) -> Result<JsValue, JsError> {
        self.report.plain()
    }

    /// Start a run of an estimator, or with `orientation@some_name` a further one with results of its own. `params` is an
    /// object of names and values, `vehicle` the name of a car or null for the drive's own.
    pub fn begin_run(&mut self, estimator: &str, params: JsValue, vehicle: Option<String>) -> Result<(), JsError> {
        let params: Value = serde_wasm_bindgen::from_value(params).map_err(sentence)?;
        let vehicle = crate::session::vehicle(vehicle)?;
        let run = AnyRun::new(estimator_of(estimator), &self.drive, &params, vehicle.as_ref()).map_err(sentence)?;
        self.slots.start(estimator, run);
        Ok(())
    }

    /// Go on with a run for about `budget_ms`; at the end it has become the current result.
    pub fn run_some(&mut self, estimator: &str, budget_ms: f64) -> Result<JsValue, JsError> {
        let begin = Date::now();
        let (drive, slot) = (&self.drive, self.slots.get_mut(estimator).ok_or_else(|| unknown(estimator))?);
        let run = slot.running.as_mut().ok_or_else(|| JsError::new(&format!("{estimator} is not running")))?;
        loop {
            let done = match run.advance(drive, EPOCHS) {
                Ok(done) => done,
                Err(error) => {
                    slot.running = None;
                    return Err(sentence(error));
                }
            };
            let now = Date::now();
            if done || now >= begin + budget_ms {
                let (fraction, rows) = (run.fraction(drive), run.series().len());
                slot.seconds += (now - begin) / 1000.0;
                if done {
                    slot.finish(drive);
                }
                return plain(&Progress { done, fraction, stage: "estimating", rows });
            }
        }
    }

    /// Give up a run; earlier results stay.
    pub fn cancel_run(&mut self, estimator: &str) -> Result<(), JsError> {
        self.slot_mut(estimator)?.running = None;
        Ok(())
    }

    /// Forget a further run; those of estimators stay.
    pub fn forget_run(&mut self, name: &str) {
        self.slots.forget(name);
    }

    /// Report on the `current` or `previous` result; null if there is none.
    pub fn result(&self, estimator: &str, which: &str) -> Result<JsValue, JsError> {
        let slot = self.slot(estimator)?;
        let finished = if which == "previous" { &slot.previous } else { &slot.current };
        plain(&finished.as_ref().map(|f| f.report()))
    }

    /// What changed from the previous to the current result; null if there is no previous one.
    pub fn change(&self, estimator: &str) -> Result<JsValue, JsError> {
        plain(&self.slot(estimator)?.change())
    }

    /// Keep the previous result in its place whatever is run next, or let the next run replace it.
    pub fn keep_previous(&mut self, estimator: &str, keep: bool) -> Result<(), JsError> {
        self.slot_mut(estimator)?.keeps_previous = keep;
        Ok(())
    }

    /// Forget the previous result.
    pub fn drop_previous(&mut self, estimator: &str) -> Result<(), JsError> {
        self.slot_mut(estimator)?.previous = None;
        Ok(())
    }

    /// Times of the points that [`Session::grid`] gives.
    pub fn grid_times(&self, t0: f64, t1: f64, buckets: usize) -> Float64Array {
        Float64Array::from(Grid { start: t0, end: t1, buckets: buckets.max(1) }.times().as_slice())
    }

    /// Least and greatest value of a column per bucket, in order of occurrence; NaN is a gap.
    pub fn grid(&self, source: &str, column: &str, t0: f64, t1: f64, buckets: usize, is_step: bool) -> Float64Array {
        let grid = Grid { start: t0, end: t1, buckets: buckets.max(1) };
        let Some((series, index)) = self.column(source, column) else { return Float64Array::new_with_length(0) };
        Float64Array::from(grid.extremes(series, index, visible_gap(series), is_step).as_slice())
    }

    /// The value of a column at a time, between samples on the straight line; NaN if there is none.
    pub fn value_at(&self, source: &str, column: &str, t: f64) -> f64 {
        let Some((series, index)) = self.column(source, column) else { return f64::NAN };
        if matches!(column, "mode" | "rule" | "gate" | "gate_reason") || source == "road:lamps" {
            held(series, column, t)
        } else {
            series.interpolate(index, t, visible_gap(series))
        }
    }

    /// Points of a trajectory, five numbers each: time, north, east, sigma, mode.
    pub fn path(&self, source: &str, t0: f64, t1: f64, max_points: usize) -> Float64Array {
        let modes = self.series("motion_mode:current");
        let points = match source {
            "drive" => fixes(&self.drive, (t0, t1), max_points),
            "truth" => true_path(&self.drive, (t0, t1), max_points),
            _ => match self.series(source) {
                Some(series) => estimated_path(series, modes, (t0, t1), max_points),
                None => Vec::new(),
            },
        };
        let flat: Vec<f64> =
            points.iter().flat_map(|p: &PathPoint| [p.time, p.north, p.east, p.sigma, p.mode]).collect();
        Float64Array::from(flat.as_slice())
    }

    /// At most `rows` rows of a window, each as time and the named columns.
    pub fn table(&self, source: &str, columns: Vec<String>, t0: f64, t1: f64, rows: usize) -> Float64Array {
        let names: Vec<&str> = columns.iter().map(String::as_str).collect();
        let series = match source {
            "drive" => columns.first().and_then(|c| self.drive.column(c)).map(|(s, _)| s),
            _ => self.series(source),
        };
        let flat = series.map_or_else(Vec::new, |s| sample_rows(s, &names, (t0, t1), rows));
        Float64Array::from(flat.as_slice())
    }

    /// A result, the truth or the whole drive (`drive`) as CSV.
    pub fn export_csv(&self, source: &str) -> Result<Uint8Array, JsError> {
        let mut text = Vec::new();
        match (source, self.series(source)) {
            ("drive", _) => write_drive(&self.drive, &mut text).map_err(sentence)?,
            (_, Some(series)) => write_series(series, &mut text).map_err(sentence)?,
            _ => return Err(JsError::new(&format!("there is nothing to export from {source}"))),
        }
        Ok(Uint8Array::from(text.as_slice()))
    }
}

impl Session {
    /// Put an opened drive in place; all runs are gone.
    fn put_in_place(&mut self, opened: Arrived) {
        self.report = DriveReport::new(&opened.drive, opened.report);
        self.drive = opened.drive;
        self.compass = Default::default();
        self.faults = Faults::default();
        self.sweep = None;
        self.slots = Slots::new();
        self.road.clear();
    }

    fn slot_mut(&mut self, estimator: &str) -> Result<&mut Slot, JsError> {
        self.slots.get_mut(estimator).ok_or_else(|| unknown(estimator))
    }

    fn slot(&self, estimator: &str) -> Result<&Slot, JsError> {
        self.slots.get(estimator).ok_or_else(|| unknown(estimator))
    }

    pub(crate) fn series(&self, source: &str) -> Option<&Series> {
        if source == "truth" {
            return Some(&self.drive.truth);
        }
        let (name, which) = source.split_once(':')?;
        if name == "compass" {
            return self.compass.field(which);
        }
        if name == "road" {
            return self.road.series(which);
        }
        self.slots.get(name)?.series(which, &self.drive)
    }

    pub(crate) fn column(&self, source: &str, column: &str) -> Option<(&Series, usize)> {
        if source == "drive" {
            return self.drive.column(column);
        }
        let series = self.series(source)?;
        Some((series, series.index_of(column)?))
    }
}

/// A car by name; null for the drive's own.
pub(crate) fn vehicle(name: Option<String>) -> Result<Option<VehicleParams>, JsError> {
    name.map(|name| VehicleParams::preset(&name).ok_or_else(|| JsError::new(&format!("there is no car `{name}`"))))
        .transpose()
}

fn unknown(estimator: &str) -> JsError {
    JsError::new(&format!("there is no estimator `{estimator}`"))
}

fn not_opening() -> JsError {
    JsError::new("nothing is being opened")
}
