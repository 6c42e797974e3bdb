//! Inertial sensor: scale, bias, noise, vibration and resolution on top of the error-free averages.

use drivescope_drive::signals::Imu;
use nalgebra::{Matrix3, Vector3};

use super::quantized;
use crate::grades::ImuGrade;
use crate::motion::Inertial;
use crate::rng::Rng;
use crate::sensors::vibration::Vibration;

/// One triad: accelerometers or gyros.
#[derive(Clone, Debug)]
struct Triad {
    bias: Vector3<f64>,
    scale: Vector3<f64>,
    noise: f64,
    walk: f64,
    resolution: f64,
    misaligned: Option<Matrix3<f64>>,
    range: f64,
    rng: Rng,
}

impl Triad {
    fn next(&mut self, truth: &Vector3<f64>) -> Vector3<f64> {
        let noise = self.rng.normal3() * self.noise;
        let turned = self.misaligned.map(|m| m * truth);
        let truth = turned.as_ref().unwrap_or(truth);
        let reading = truth + truth.component_mul(&self.scale) + self.bias + noise;
        self.bias += self.rng.normal3() * self.walk;
        reading.map(|v| quantized(v, self.resolution).clamp(-self.range, self.range))
    }
}

/// Axes that each lean away from where they should point by angles of this 1-sigma, rad.
fn misalignment(sigma: f64, seed: u64, name: &str) -> Matrix3<f64> {
    let mut rng = Rng::new(seed, &format!("{name} axes"));
    Matrix3::from_fn(|i, j| if i == j { 1.0 } else { sigma * rng.normal() })
}

/// State of the sensor.
#[derive(Clone, Debug)]
pub struct ImuSensor {
    accel: Triad,
    gyro: Triad,
    vibration: Vibration,
    vibrates: f64,
}

impl ImuSensor {
    /// A sensor of a grade, sampled every `step` s, switched on with this seed.
    pub fn new(grade: &ImuGrade, step: f64, seed: u64) -> Self {
        let triad = |name: &str, [bias, noise, walk, resolution, range]: [f64; 5]| {
            let mut rng = Rng::new(seed, name);
            let (bias, scale) = (rng.normal3() * bias, rng.normal3() * grade.scale);
            let (noise, walk) = (noise / step.sqrt(), walk * step.sqrt());
            let misaligned = (grade.misalignment > 0.0).then(|| misalignment(grade.misalignment, seed, name));
            Triad { bias, scale, noise, walk, resolution, misaligned, range, rng }
        };
        let g = grade;
        Self {
            accel: triad("accel", [g.accel_bias, g.accel_noise, g.accel_walk, g.accel_resolution, g.range[0]]),
            gyro: triad("gyro", [g.gyro_bias, g.gyro_noise, g.gyro_walk, g.gyro_resolution, g.range[1]]),
            vibration: Vibration::new(step, seed),
            vibrates: g.vibration,
        }
    }

    /// Bias of the accelerometers now, m/s^2.
    pub fn accel_bias(&self) -> Vector3<f64> {
        self.accel.bias
    }
    /// Bias of the gyros now, rad/s.
    pub fn gyro_bias(&self) -> Vector3<f64> {
        self.gyro.bias
    }

    /// The next sample, at a speed (m/s) and an engine speed (rad/s).
    pub fn next(&mut self, truth: &Inertial, speed: f64, engine_speed: f64) -> Imu {
        let (force, rate) = self.vibration.next(speed, engine_speed);
        let f = self.accel.next(&(truth.force + force * self.vibrates));
        let w = self.gyro.next(&(truth.rate + rate * self.vibrates));
        Imu { accel_x: f.x, accel_y: f.y, accel_z: f.z, gyro_x: w.x, gyro_y: w.y, gyro_z: w.z }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grades::Grade;

    #[test]
    fn readings_stop_at_the_range_and_axes_lean_by_the_misalignment() {
        let ideal = Grade::named("ideal").unwrap().imu;
        let rest = Inertial { force: Vector3::new(0.0, 0.0, -9.8), rate: Vector3::zeros(), forward_acceleration: 0.0 };
        let limited = ImuGrade { range: [5.0, 1.0], ..ideal };
        let reading = ImuSensor::new(&limited, 0.01, 1).next(&rest, 0.0, 80.0);
        assert_eq!((reading.accel_x, reading.accel_z), (0.0, -5.0));
        let leaning = ImuGrade { misalignment: 0.01, ..ideal };
        let squares: f64 = (0..2000)
            .map(|seed| ImuSensor::new(&leaning, 0.01, seed).next(&rest, 0.0, 80.0).accel_x.powi(2) / 2000.0)
            .sum();
        // 2,000 draws know a spread to 1.6 %; four of them.
        assert!((squares.sqrt() / 0.098 - 1.0).abs() < 0.065, "{}", squares.sqrt());
    }
}
