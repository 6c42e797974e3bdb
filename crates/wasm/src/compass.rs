//! The compass doctor's hands: the drive as it was read is handed to the doctor's module, a calibration is applied and taken
//! back, and what the doctor found along the road is kept for plots.

use drivescope_door::{Handover, sentence};
use drivescope_drive::channel::{Channel, Record, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::signals::{Gnss, Imu, Mag};
use drivescope_estimation::magnetometer_calibration::{
    CALIBRATION_VERSION, Calibration, FieldSample, Kind, shift_gnss, turn_sensor,
};
use js_sys::{Array, Float64Array};
use wasm_bindgen::prelude::*;

use crate::session::Session;

/// What the core keeps of a drive for the doctor.
#[derive(Default)]
pub struct Compass {
    /// The channels as they were read; absent where nothing has been applied.
    applied: Option<Box<Applied>>,
    /// Strength and dip along the road, as read and calibrated.
    field: [Option<Series>; 2],
    /// What is still to be handed over.
    handover: Option<Handover>,
}

struct Applied {
    imu: Channel<Imu>,
    mag: Channel<Mag>,
    gnss: Channel<Gnss>,
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

/// The first row of a series that has the drive's origin, for whoever needs no more of it.
fn first_rows(series: &Series) -> Option<Series> {
    let columns =
        (0..series.schema().len()).map(|i| series.column_at(i).first().copied().into_iter().collect()).collect();
    let time = series.time().first().copied().into_iter().collect();
    Series::from_columns(series.schema(), time, columns).ok()
}

#[wasm_bindgen]
impl Session {
    /// Begin to hand what the doctor examines of the drive, as it was read, to another module; gives the head.
    /// [`Session::next_part`] gives the parts.
    pub fn hand_over(&mut self) -> Array {
        let drive = self.faults.good().unwrap_or(&self.drive);
        let (imu, mag, gnss) = match &self.compass.applied {
            Some(raw) => (&raw.imu, &raw.mag, &raw.gnss),
            None => (&drive.imu, &drive.mag, &drive.gnss),
        };
        let examined = Drive {
            name: drive.name.clone(),
            imu: imu.clone(),
            mag: mag.clone(),
            gnss: gnss.clone(),
            accel_array: drive.accel_array.clone(),
            truth: first_rows(&drive.truth).unwrap_or_default(),
            unix_zero: drive.unix_zero,
            ..Drive::default()
        };
        let handover = Handover::new(examined, JsValue::UNDEFINED);
        let head = handover.head();
        self.compass.handover = Some(handover);
        head
    }

    /// The next part of what is handed over; undefined after the last one.
    pub fn next_part(&mut self) -> Option<Array> {
        let part = self.compass.handover.as_mut().and_then(Iterator::next);
        if part.is_none() {
            self.compass.handover = None;
        }
        part
    }

    /// Keep what the doctor found along the road, as read and calibrated, each as times and then its columns, empty where
    /// there is none: the sources `compass:raw` and `compass:calibrated`.
    pub fn keep_field(&mut self, raw: Vec<Float64Array>, calibrated: Vec<Float64Array>) {
        self.compass.field = [raw, calibrated].map(|given| {
            let mut columns: Vec<Vec<f64>> = given.iter().map(Float64Array::to_vec).collect();
            let time = (!columns.is_empty()).then(|| columns.remove(0))?;
            Series::from_columns(FieldSample::COLUMNS, time, columns).ok()
        });
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
        let raw = Applied { imu: imu.clone(), mag: mag.clone(), gnss: gnss.clone() };
        calibration.apply(&mut self.drive).map_err(sentence)?;
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
