//! The six-accelerometer disk: the rests of a drive, and its calibration from poses.

use drivescope_door::{plain, sentence};
use drivescope_drive::disk::Disk;
use drivescope_estimation::gyro_free::calibration::{NOT_OBSERVABLE, Pose, calibrate, rests};
use wasm_bindgen::prelude::*;

use crate::Doctor;

/// Numbers of a pose: three of specific force, six means.
const POSE: usize = 9;

#[wasm_bindgen]
impl Doctor {
    /// The stretches of at least `shortest` s in which the disk lay still, with the pose that each seems to mean.
    pub fn disk_rests(&self, shortest: f64) -> Result<JsValue, JsError> {
        plain(&rests(&self.drive, &Disk::default(), shortest))
    }

    /// Calibrate the disk from poses, nine numbers each: specific force, then the six means (m/s^2).
    pub fn disk_calibrate(&self, poses: &[f64]) -> Result<JsValue, JsError> {
        let poses: Vec<Pose> = poses.chunks_exact(POSE).map(pose).collect();
        let found = calibrate(&Disk::default(), &poses).map_err(sentence)?;
        plain(&(&found, found.disk.numbers(), NOT_OBSERVABLE))
    }
}

fn pose(numbers: &[f64]) -> Pose {
    Pose { force: std::array::from_fn(|k| numbers[k]), mean: std::array::from_fn(|k| numbers[3 + k]) }
}
