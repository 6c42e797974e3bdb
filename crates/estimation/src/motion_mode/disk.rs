//! A log with a disk of six accelerometers in place of accelerometers and gyros: disk to rates to mode.

use drivescope_drive::drive::Epoch;

use super::{LARGEST_STEP, MotionModeDetector, MotionModeEstimate, NO_LAYOUT};
use crate::gyro_free::{Front, SingularLayout};

/// The disk's front, and the yaw gyro that belongs to its next row.
#[derive(Clone, Debug)]
pub(super) struct DiskSource {
    front: Option<Box<Front>>,
    is_active: bool,
    step: f64,
    gyro: f64,
}

impl DiskSource {
    pub(super) fn new(front: Result<Front, SingularLayout>, step: f64) -> Self {
        Self { front: front.ok().map(Box::new), is_active: false, step, gyro: f64::NAN }
    }

    /// Take the log for one of a disk.
    pub(super) fn activate(&mut self) {
        self.is_active = true;
    }

    /// The front, once the log is known to be one of a disk.
    pub(super) fn active(&self) -> Option<&Front> {
        self.front.as_deref().filter(|_| self.is_active)
    }
}

impl MotionModeDetector {
    /// Whether the log is one of a disk: the first sensor that gives a specific force decides.
    pub(super) fn is_disk_log(&mut self, epoch: &Epoch) -> bool {
        let Some(disk) = &mut self.disk else { return false };
        if disk.is_active {
            return true;
        }
        if epoch.imu.is_some_and(|imu| imu.accel_x.is_finite()) {
            self.disk = None;
            return false;
        }
        disk.is_active = epoch.accel_array.is_some_and(|a| a.acc6_1.is_finite());
        disk.is_active
    }

    /// A row of the disk; a yaw gyro with a clock of its own is used at the next row.
    pub(super) fn step_disk(&mut self, epoch: &Epoch) -> Option<MotionModeEstimate> {
        let disk = self.disk.as_mut()?;
        if let Some(gyro) = epoch.imu.map(|imu| imu.gyro_z).filter(|g| g.is_finite()) {
            disk.gyro = gyro;
        }
        let readings = epoch.accel_array?;
        if !self.is_later(epoch.time) {
            return None;
        }
        let passed = epoch.time - self.time;
        if passed > LARGEST_STEP {
            self.after_hole(epoch.time);
        }
        let mode = self.detector.mode();
        let disk = self.disk.as_mut()?;
        let Some(front) = &mut disk.front else {
            self.notices.add(NO_LAYOUT, epoch.time);
            return None;
        };
        let mut dt = passed;
        if passed > LARGEST_STEP {
            if passed.is_finite() {
                front.wait(passed);
            }
            dt = disk.step;
        }
        let gyro = std::mem::replace(&mut disk.gyro, f64::NAN);
        let is_read = front.step(dt, &readings, gyro, mode);
        let row = front.mode_row(gyro);
        let is_good = is_read && row.is_plausible();
        if row.is_plausible() {
            self.good = row;
        }
        Some(self.decide(epoch.time, is_good))
    }
}
