//! Magnetometer: the Earth's field in body axes, distorted by the car's iron, with noise.

use drivescope_drive::signals::Mag;
use nalgebra::{Matrix3, Vector3};

use super::quantized;
use crate::grades::MagGrade;
use crate::motion::{DAEJEON_FIELD, Motion};
use crate::rng::Rng;

/// State of the sensor.
#[derive(Clone, Debug)]
pub struct MagSensor {
    field: Vector3<f64>,
    soft_iron: Matrix3<f64>,
    hard_iron: Vector3<f64>,
    noise: f64,
    resolution: f64,
    rng: Rng,
}

impl MagSensor {
    /// A sensor of a grade in the field of the built-in drives' place.
    pub fn new(grade: &MagGrade, seed: u64) -> Self {
        let rows = &grade.soft_iron;
        Self {
            field: Vector3::from(DAEJEON_FIELD),
            soft_iron: Matrix3::from_fn(|i, j| rows[i][j]),
            hard_iron: Vector3::from(grade.hard_iron),
            noise: grade.noise,
            resolution: grade.resolution,
            rng: Rng::new(seed, "mag"),
        }
    }

    /// The undisturbed field, north, east and down, uT.
    pub fn field(&self) -> Vector3<f64> {
        self.field
    }

    /// The next sample in a field given in north, east and down, uT.
    pub fn next(&mut self, motion: &Motion, field: &Vector3<f64>) -> Mag {
        let field = self.soft_iron * (motion.attitude.transpose() * field) + self.hard_iron;
        let b = (field + self.rng.normal3() * self.noise).map(|v| quantized(v, self.resolution));
        Mag { mag_x: b.x, mag_y: b.y, mag_z: b.z }
    }
}
