//! The magnetometer: examined as it was read, with what a calibration makes of it.

use drivescope_door::{plain, sentence};
use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_estimation::magnetometer_calibration::{
    AgainstCourse, CALIBRATION_VERSION, Calibration, ClockOffset, Examination, Kind, Quality, Scatter, examine,
    field_along_road, shift_gnss, turn_sensor,
};
use drivescope_estimation::orientation::{DEFAULT_YEAR, OrientationParams, reference_of};
use js_sys::{Array, Float64Array};
use serde::Serialize;
use wasm_bindgen::prelude::*;

use crate::Doctor;

/// Points of the picture of readings.
const POINTS: usize = 1500;

/// A drive's magnetometer: as it was read, what a calibration makes of it, and what has been applied.
#[derive(Serialize)]
struct Diagnosis {
    earth: [f64; 3],
    quality: Quality,
    calibration: Option<Calibration>,
    refusal_text: Option<String>,
    clock: Option<ClockOffset>,
    before: Option<AgainstCourse>,
    after: Option<AgainstCourse>,
    /// What had to be assumed for the Earth's field.
    notes: Vec<&'static str>,
    scatter: Scatter,
    /// The calibration in use.
    applied: Option<Calibration>,
    /// The heading of the drive as it is now against the course, where something is applied.
    now: Option<AgainstCourse>,
    /// Why the magnetometer as it is now should not be believed, if it should not.
    warning_now: Option<String>,
}

/// What has been applied to the drive in the core.
struct Applied {
    calibration: Calibration,
    mount_yaw: f64,
    clock: f64,
}

impl Applied {
    /// From twelve numbers: offset, distortion, 1 for a planar calibration, yaw of the mount (rad), clock (s).
    fn read(numbers: &[f64]) -> Option<Self> {
        let &[x, y, z, a, b, c, d, e, f, planar, mount_yaw, clock] = numbers else { return None };
        let kind = if planar == 1.0 { Kind::Planar } else { Kind::Full };
        let (offset, distortion) = ([x, y, z], [a, b, c, d, e, f]);
        let calibration = Calibration { version: CALIBRATION_VERSION, kind, offset, distortion };
        Some(Self { calibration, mount_yaw, clock })
    }

    /// The drive as it is in the core.
    fn drive(&self, read: &Drive) -> Result<Drive, JsError> {
        let mut drive = read.clone();
        self.calibration.apply(&mut drive).map_err(sentence)?;
        turn_sensor(&mut drive, self.mount_yaw).map_err(sentence)?;
        shift_gnss(&mut drive, self.clock).map_err(sentence)?;
        Ok(drive)
    }
}

#[wasm_bindgen]
impl Doctor {
    /// Examine the magnetometer as it was read; null without one. `year`, `latitude` and `longitude` (rad) say where and
    /// when, for a log that does not; NaN leaves that to the log. `applied` are the twelve numbers of what has been applied,
    /// empty where nothing has. `with_field` also computes what [`Doctor::field`] gives.
    pub fn compass(
        &mut self,
        year: f64,
        latitude: f64,
        longitude: f64,
        applied: &[f64],
        with_field: bool,
    ) -> Result<JsValue, JsError> {
        if self.drive.mag.is_empty() {
            return Ok(JsValue::NULL);
        }
        let params = OrientationParams {
            field_year: year,
            field_latitude: latitude,
            field_longitude: longitude,
            ..OrientationParams::default()
        };
        let applied = Applied::read(applied);
        let (earth, notices) = reference_of(&self.drive, &params);
        let now = applied.as_ref().map(|a| a.drive(&self.drive)).transpose()?.map(|drive| examine(&drive, &earth));
        let examination = examine(&self.drive, &earth);
        let applied = applied.map(|a| a.calibration);
        let calibration = applied.as_ref().or(examination.calibration.as_ref());
        let scatter = Scatter::of(&self.drive, calibration, &earth, POINTS);
        if with_field {
            let date = if year.is_finite() { year } else { self.drive.start().date.unwrap_or(DEFAULT_YEAR) };
            let year = latitude.is_nan().then_some(date);
            let along = |calibration| field_along_road(&self.drive, calibration, &earth, year).ok();
            self.field = [along(None), calibration.and_then(|c| along(Some(c)))];
        }
        // Without a place the strength of the field is not known.
        let is_placed = self.drive.origin().is_some() || latitude.is_finite();
        let warning_now = now.as_ref().map_or(&examination, |now| now).warning.clone().filter(|_| is_placed);
        let now = now.and_then(|now| now.before);
        let notes = notices.list().iter().map(|n| n.text).collect();
        let Examination { earth, quality, calibration, refusal_text, clock, before, after, .. } = examination;
        plain(&Diagnosis {
            earth,
            quality,
            calibration,
            refusal_text,
            clock,
            before,
            after,
            notes,
            scatter,
            applied,
            now,
            warning_now,
        })
    }

    /// The field along the road, as read or `calibrated`: times, then the columns; empty before it was asked for.
    pub fn field(&self, calibrated: bool) -> Array {
        self.field[usize::from(calibrated)].as_ref().map_or_else(Array::new, given)
    }
}

fn given(series: &Series) -> Array {
    let columns = (0..series.schema().len()).map(|i| series.column_at(i));
    std::iter::once(series.time()).chain(columns).map(Float64Array::from).collect()
}
