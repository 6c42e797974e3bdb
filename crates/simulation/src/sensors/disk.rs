//! Disk of six single-axis accelerometers: three tangential, three axial, at 0, 120 and 240 deg (motion specification, 3.1).

use drivescope_drive::signals::AccelArray;
use nalgebra::Vector3;

use super::quantized;
use super::vibration::Vibration;
use crate::grades::ImuGrade;
use crate::math::sin_cos;
use crate::motion::Inertial;
use crate::rng::Rng;

/// Radius of the circle of sensors, m.
pub const RADIUS: f64 = 0.10;

/// State of the disk.
#[derive(Clone, Debug)]
pub struct Disk {
    grade: ImuGrade,
    noise: f64,
    walk: f64,
    bias: [f64; 6],
    vibration: Vibration,
    rng: Rng,
}

/// Specific force along the six axes for that of the disk's centre (m/s^2), its turn rate (rad/s) and the change of it.
pub fn outputs(force: &Vector3<f64>, rate: &Vector3<f64>, turning: &Vector3<f64>) -> [f64; 6] {
    std::array::from_fn(|i| {
        let (sin, cos) = sin_cos((i % 3) as f64 * std::f64::consts::TAU / 3.0);
        let arm = Vector3::new(cos, sin, 0.0) * RADIUS;
        let there = force + turning.cross(&arm) + rate.cross(&rate.cross(&arm));
        if i < 3 { cos * there.y - sin * there.x } else { there.z }
    })
}

impl Disk {
    /// A disk of accelerometers of a grade, sampled every `step` s.
    pub fn new(grade: &ImuGrade, step: f64, seed: u64) -> Self {
        let mut rng = Rng::new(seed, "disk");
        let bias = std::array::from_fn(|_| grade.accel_bias * rng.normal());
        let (noise, walk) = (grade.accel_noise / step.sqrt(), grade.accel_walk * step.sqrt());
        Self { grade: *grade, noise, walk, bias, vibration: Vibration::new(step, seed), rng }
    }

    /// The next sample, at a speed (m/s) and an engine speed (rad/s).
    pub fn next(&mut self, truth: &Inertial, turning: &Vector3<f64>, speed: f64, engine_speed: f64) -> AccelArray {
        let (force, rate) = self.vibration.next(speed, engine_speed);
        let factor = self.grade.vibration;
        let mut f = outputs(&(truth.force + force * factor), &(truth.rate + rate * factor), turning);
        for (value, bias) in f.iter_mut().zip(&mut self.bias) {
            let reading = *value + *bias + self.noise * self.rng.normal();
            *value = quantized(reading, self.grade.accel_resolution).clamp(-self.grade.range[0], self.grade.range[0]);
            *bias += self.walk * self.rng.normal();
        }
        let [acc6_1, acc6_2, acc6_3, acc6_4, acc6_5, acc6_6] = f;
        AccelArray { acc6_1, acc6_2, acc6_3, acc6_4, acc6_5, acc6_6 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_of_the_specification_gives_force_and_turning_back() {
        let (force, turning) = (Vector3::new(0.3, -1.2, -9.8), Vector3::new(0.5, -0.4, 0.9));
        let y = outputs(&force, &Vector3::zeros(), &turning);
        let azimuth = |i: usize| (i as f64 * 120.0).to_radians().sin_cos();
        let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
        let fx = -2.0 / 3.0 * sum(&|i| azimuth(i).0 * y[i]);
        let fy = 2.0 / 3.0 * sum(&|i| azimuth(i).1 * y[i]);
        let fz = sum(&|i| y[i + 3]) / 3.0;
        let x = 2.0 / (3.0 * RADIUS) * sum(&|i| azimuth(i).0 * y[i + 3]);
        let y_turn = -2.0 / (3.0 * RADIUS) * sum(&|i| azimuth(i).1 * y[i + 3]);
        let z = sum(&|i| y[i]) / (3.0 * RADIUS);
        assert!((Vector3::new(fx, fy, fz) - force).norm() < 1e-12);
        assert!((Vector3::new(x, y_turn, z) - turning).norm() < 1e-12);
    }
}
