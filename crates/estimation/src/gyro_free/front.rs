//! From the disk's readings to what a motion-mode detector and an inertial navigator read, row by row.

use drivescope_drive::disk::Disk;
use drivescope_drive::signals::AccelArray;
use nalgebra::Vector3;

use super::GyroFreeParams;
use super::geometry::{Geometry, Motion, SingularLayout};
use super::rates::RateFilter;
use crate::motion_mode::{InertialRow, MotionMode};

/// Time in which the tilt rates that the mode is decided from forget, s.
const FORGETTING: f64 = 0.10;
/// Largest reading of an accelerometer, m/s^2, and of the yaw gyro, rad/s: beyond them the sensor is broken.
const LARGEST_READING: f64 = 200.0;
const LARGEST_RATE: f64 = 35.0;

/// Geometry, rate filter and the high-passed tilt rates.
///
/// The mode must not be decided from the filtered rates: at rest they are held at zero, sway vanishes, and the mode would
/// lock itself in. It reads the angular accelerations integrated with a short memory, and the raw yaw gyro.
#[derive(Clone, Debug)]
pub struct Front {
    geometry: Geometry,
    filter: RateFilter,
    motion: Motion,
    passing: [f64; 2],
    plain: [f64; 3],
    memory: (f64, f64),
}

impl Front {
    /// A front for a disk; one that is not given is as drawn.
    ///
    /// # Errors
    /// [`SingularLayout`], see [`Geometry::new`].
    pub fn new(disk: Option<&Disk>, params: &GyroFreeParams) -> Result<Self, SingularLayout> {
        let geometry = Geometry::new(disk.unwrap_or(&Disk::default()))?;
        Ok(Self {
            geometry,
            filter: RateFilter::new(params),
            motion: Motion { force: Vector3::new(0.0, 0.0, -9.80665), angular_acceleration: Vector3::zeros() },
            passing: [0.0; 2],
            plain: [0.0; 3],
            memory: (f64::NAN, 0.0),
        })
    }

    /// Fold in a row that is `dt` s after the one before; `gyro` is the yaw gyro (rad/s; NaN without), `mode` that of the row
    /// before. Returns whether all six sensors could be read.
    pub fn step(&mut self, dt: f64, readings: &AccelArray, gyro: f64, mode: MotionMode) -> bool {
        let r = readings;
        let outputs = [r.acc6_1, r.acc6_2, r.acc6_3, r.acc6_4, r.acc6_5, r.acc6_6];
        let is_good = outputs.iter().all(|v| v.abs() <= LARGEST_READING);
        let acceleration = if is_good {
            self.motion = self.geometry.motion(&outputs, &Vector3::from(self.filter.rate()));
            self.motion.angular_acceleration.into()
        } else {
            [0.0; 3]
        };
        self.filter.step(&acceleration, dt, sane_rate(gyro), mode);
        if !self.filter.is_finite() {
            self.filter.restart();
        }
        if dt != self.memory.0 {
            self.memory = (dt, (-dt / FORGETTING).exp());
        }
        for (value, acceleration) in self.passing.iter_mut().zip(acceleration) {
            *value = (*value + acceleration * dt) * self.memory.1;
        }
        for (value, acceleration) in self.plain.iter_mut().zip(acceleration) {
            *value += acceleration * dt;
        }
        is_good
    }

    /// What the mode is decided from; `gyro` is the yaw gyro of the row, rad/s.
    pub fn mode_row(&self, gyro: f64) -> InertialRow {
        let yaw_rate = if sane_rate(gyro).is_finite() { gyro } else { self.filter.rate()[2] };
        InertialRow { force: self.motion.force.into(), rate: [self.passing[0], self.passing[1], yaw_rate] }
    }

    /// What a navigator integrates: specific force, and the filtered rates.
    pub fn inertial_row(&self) -> InertialRow {
        InertialRow { force: self.motion.force.into(), rate: self.filter.rate() }
    }

    /// Specific force and angular acceleration of the last row that could be read.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// The rate filter.
    pub fn filter(&self) -> &RateFilter {
        &self.filter
    }

    /// Angular accelerations integrated and nothing else, rad/s: what the filter is measured against.
    pub fn plain_rate(&self) -> [f64; 3] {
        self.plain
    }

    /// After a hole of `dt` s in the log: the high-passed rates start again, the filter is less sure.
    pub fn wait(&mut self, dt: f64) {
        self.passing = [0.0; 2];
        self.filter.wait(dt);
    }
}

fn sane_rate(gyro: f64) -> f64 {
    if gyro.abs() <= LARGEST_RATE { gyro } else { f64::NAN }
}
