//! Inertial samples as the filter uses them: complete, plausible, held over short holes.

use drivescope_drive::signals::Imu;
use nalgebra::Vector3;

/// Longest time for which a missing value is silently replaced by the last good one, s (SPEC navigation 11).
const LONGEST_HOLD: f64 = 0.2;
/// Factor on the process noise beyond that.
const HELD_NOISE: f64 = 10.0;
/// Largest specific force of a car, m/s^2: beyond it the unit is wrong or the sensor broken.
const LARGEST_ACCEL: f64 = 200.0;
/// Largest rate of a car, rad/s.
const LARGEST_RATE: f64 = 35.0;

/// A complete sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Specific force, body axes, m/s^2.
    pub accel: Vector3<f64>,
    /// Rates, body axes, rad/s.
    pub gyro: Vector3<f64>,
    /// Factor on the process noise: 1, or more when a value is missing for long.
    pub noise_factor: f64,
    /// What was wrong with it.
    pub flaw: Option<&'static str>,
}

/// The last good value of every axis, and when it was.
#[derive(Clone, Copy, Debug)]
pub struct Hold {
    value: [f64; 6],
    time: [f64; 6],
}

impl Default for Hold {
    fn default() -> Self {
        Self { value: [f64::NAN; 6], time: [f64::NEG_INFINITY; 6] }
    }
}

impl Hold {
    /// Complete a sample; `None` until every axis has had a good value.
    pub fn complete(&mut self, time: f64, imu: &Imu) -> Option<Sample> {
        let axes = [imu.accel_x, imu.accel_y, imu.accel_z, imu.gyro_x, imu.gyro_y, imu.gyro_z];
        let mut flaw = None;
        for (axis, value) in axes.into_iter().enumerate() {
            let largest = if axis < 3 { LARGEST_ACCEL } else { LARGEST_RATE };
            if value.abs() <= largest {
                self.value[axis] = value;
                self.time[axis] = time;
            } else if value.is_finite() {
                flaw = Some("inertial value out of a car's range treated as missing (unit: degrees or g?)");
            } else {
                flaw = flaw.or(Some("missing inertial value replaced by the last good one"));
            }
        }
        if self.value.iter().any(|v| v.is_nan()) {
            return None;
        }
        let age = self.time.iter().fold(0.0, |age: f64, t| age.max(time - t));
        let mut noise_factor = 1.0;
        if age > LONGEST_HOLD + 1e-9 {
            noise_factor = HELD_NOISE;
            flaw = Some("inertial value missing for more than 0.2 s: process noise raised tenfold");
        }
        let v = self.value;
        Some(Sample { accel: Vector3::new(v[0], v[1], v[2]), gyro: Vector3::new(v[3], v[4], v[5]), noise_factor, flaw })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_hole_is_held_silently_and_a_long_one_raises_the_noise() {
        let good = Imu { accel_x: 1.0, accel_y: 0.0, accel_z: -9.8, gyro_x: 0.0, gyro_y: 0.0, gyro_z: 0.1 };
        let mut hold = Hold::default();
        assert!(hold.complete(0.0, &Imu { gyro_z: f64::NAN, ..good }).is_none(), "nothing to hold yet");
        assert_eq!(hold.complete(0.01, &good).unwrap().flaw, None);
        let short = hold.complete(0.2, &Imu { gyro_z: f64::NAN, ..good }).unwrap();
        assert_eq!((short.gyro.z, short.noise_factor), (0.1, 1.0));
        assert_eq!(hold.complete(0.3, &Imu { gyro_z: f64::NAN, ..good }).unwrap().noise_factor, 10.0);
    }

    #[test]
    fn a_value_in_another_unit_never_reaches_the_filter() {
        let good = Imu { accel_x: 0.0, accel_y: 0.0, accel_z: -9.8, gyro_x: 0.0, gyro_y: 0.0, gyro_z: 0.2 };
        let mut hold = Hold::default();
        hold.complete(0.0, &good).unwrap();
        let sample = hold.complete(0.01, &Imu { gyro_z: 57.0, ..good }).unwrap();
        assert_eq!(sample.gyro.z, 0.2);
        assert!(sample.flaw.unwrap().contains("unit"));
    }
}
