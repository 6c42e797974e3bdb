//! The compass doctor: a drive's magnetometer examined, its calibration applied and taken back.

use drivescope_door::{plain, sentence};
use drivescope_drive::channel::{Channel, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::signals::{Gnss, Imu, Mag};
use drivescope_estimation::magnetometer_calibration::{
    AgainstCourse, CALIBRATION_VERSION, Calibration, ClockOffset, Examination, Kind, Quality, Scatter, examine,
    field_along_road, shift_gnss, turn_sensor,
};
use drivescope_estimation::orientation::{DEFAULT_YEAR, OrientationParams, reference_of};
use serde::Serialize;
use wasm_bindgen::prelude::*;

use crate::session::Session;

/// Points of the picture of readings.
const POINTS: usize = 1500;

/// What the compass doctor keeps of a drive.
#[derive(Default)]
pub struct Compass {
    /// The channels as they were read, and what has been applied; absent where nothing has.
    applied: Option<Box<Applied>>,
    /// Strength and dip along the road, as read and calibrated.
    field: [Option<Series>; 2],
}

struct Applied {
    imu: Channel<Imu>,
    mag: Channel<Mag>,
    gnss: Channel<Gnss>,
    calibration: Calibration,
}

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

impl Compass {
    /// The field along the road, `raw` or `calibrated`.
    pub fn field(&self, which: &str) -> Option<&Series> {
        self.field[usize::from(which == "calibrated")].as_ref()
    }

    /// Make the drive what it was as read.
    fn give_back(&mut self, drive: &mut Drive) {
        self.swap(drive);
        self.applied = None;
    }

    fn swap(&mut self, drive: &mut Drive) {
        if let Some(raw) = &mut self.applied {
            std::mem::swap(&mut raw.imu, &mut drive.imu);
            std::mem::swap(&mut raw.mag, &mut drive.mag);
            std::mem::swap(&mut raw.gnss, &mut drive.gnss);
        }
    }
}

#[wasm_bindgen]
impl Session {
    /// Examine the magnetometer as it was read; null without one. `year`, `latitude` and `longitude` (rad) say where and
    /// when, for a log that does not; NaN leaves that to the log. `with_field` also computes what the sources
    /// `compass:raw` and `compass:calibrated` give.
    pub fn compass(&mut self, year: f64, latitude: f64, longitude: f64, with_field: bool) -> Result<JsValue, JsError> {
        if self.drive.mag.is_empty() {
            return Ok(JsValue::NULL);
        }
        let params = OrientationParams {
            field_year: year,
            field_latitude: latitude,
            field_longitude: longitude,
            ..OrientationParams::default()
        };
        let (earth, notices) = reference_of(&self.drive, &params);
        let now = self.compass.applied.is_some().then(|| examine(&self.drive, &earth));
        self.compass.swap(&mut self.drive);
        let examination = examine(&self.drive, &earth);
        let applied = self.compass.applied.as_ref().map(|a| a.calibration.clone());
        let calibration = applied.as_ref().or(examination.calibration.as_ref());
        let scatter = Scatter::of(&self.drive, calibration, &earth, POINTS);
        if with_field {
            let date = if year.is_finite() { year } else { self.drive.start().date.unwrap_or(DEFAULT_YEAR) };
            let year = latitude.is_nan().then_some(date);
            let along = |calibration| field_along_road(&self.drive, calibration, &earth, year).ok();
            self.compass.field = [along(None), calibration.and_then(|c| along(Some(c)))];
        }
        self.compass.swap(&mut self.drive);
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

    /// Correct the drive, as it was read, with the nine numbers of a calibration (offset, distortion); turn its sensors by
    /// `mount_yaw` (rad) and set the receiver's clock right by `clock` (s), where these are not 0.
    pub fn compass_apply(&mut self, numbers: &[f64], planar: bool, mount_yaw: f64, clock: f64) -> Result<(), JsError> {
        let &[x, y, z, a, b, c, d, e, f] = numbers else { return Err(JsError::new("a calibration has nine numbers")) };
        let kind = if planar { Kind::Planar } else { Kind::Full };
        let (offset, distortion) = ([x, y, z], [a, b, c, d, e, f]);
        let faults = self.take_faults();
        let calibration = Calibration { version: CALIBRATION_VERSION, kind, offset, distortion };
        self.compass.give_back(&mut self.drive);
        let Drive { imu, mag, gnss, .. } = &self.drive;
        let raw = Applied { imu: imu.clone(), mag: mag.clone(), gnss: gnss.clone(), calibration };
        raw.calibration.apply(&mut self.drive).map_err(sentence)?;
        self.compass.applied = Some(Box::new(raw));
        if mount_yaw != 0.0 {
            turn_sensor(&mut self.drive, mount_yaw).map_err(sentence)?;
        }
        if clock != 0.0 {
            shift_gnss(&mut self.drive, clock).map_err(sentence)?;
        }
        self.put_faults(faults)
    }

    /// Take back what has been applied: the drive is as it was read.
    pub fn compass_undo(&mut self) -> Result<(), JsError> {
        let faults = self.take_faults();
        self.compass.give_back(&mut self.drive);
        self.put_faults(faults)
    }
}
