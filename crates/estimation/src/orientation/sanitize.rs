//! Inputs made fit for the filters: faults held for a moment, then replaced; a field that cannot be the Earth's left out.

use drivescope_drive::signals::{Imu, Mag};
use nalgebra::Vector3;

use crate::estimator::Notices;

/// How long a missing or faulty inertial value is replaced by the last good one, s.
const HOLD: f64 = 0.2;
const LARGEST_YAW_RATE: f64 = 5.0;
const LARGEST_ACCEL: f64 = 30.0;
const LARGEST_SPEED: f64 = 120.0;
/// How long a speed may be held before the lateral acceleration is no longer explained by it, s.
const SPEED_HOLD: f64 = 1.0;
/// Field strengths outside these multiples of the reference are faults.
const WEAKEST: f64 = 0.2;
const STRONGEST: f64 = 3.0;

const OUT_OF_RANGE: &str = "a measurement beyond its sensor's range was replaced by the last good one";
const MISSING: &str = "an inertial value was missing for more than 0.2 s and was taken as zero";
const FIELD_REFUSED: &str = "a magnetic field that cannot be the Earth's was left out";

/// One inertial value with its last good one.
#[derive(Clone, Copy, Debug)]
struct Held {
    last: f64,
    age: f64,
    largest: f64,
}

impl Held {
    const fn new(largest: f64) -> Self {
        Self { last: f64::NAN, age: 0.0, largest }
    }

    /// This sample's value, the last good one for a while, or `None`.
    fn take(&mut self, value: f64, dt: f64, time: f64, notices: &mut Notices) -> Option<f64> {
        if value.abs() <= self.largest {
            (self.last, self.age) = (value, 0.0);
            return Some(value);
        }
        if !value.is_nan() {
            notices.add(OUT_OF_RANGE, time);
        }
        self.age += dt;
        (self.age <= HOLD && self.last.is_finite()).then_some(self.last)
    }
}

/// The inertial values of one sample, always finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inertial {
    /// Yaw gyro, rad/s.
    pub(super) yaw_rate: f64,
    /// Lateral specific force, m/s^2.
    pub(super) accel_y: f64,
    /// Forward specific force, m/s^2; `None` when it is missing for too long.
    pub(super) accel_x: Option<f64>,
    /// Whether the yaw rate is a measurement, if a held one, and whether the lateral force is.
    pub(super) has: [bool; 2],
}

/// Guard of the filters' inputs (SPEC orientation 12).
#[derive(Clone, Copy, Debug)]
pub(super) struct Sanitizer {
    yaw_rate: Held,
    accel_y: Held,
    accel_x: Held,
    speed: f64,
    speed_time: f64,
    field_strength: f64,
}

impl Sanitizer {
    /// `speed` is held until the first good one; `field_strength` is that of the reference, uT.
    pub(super) fn new(speed: f64, field_strength: f64) -> Self {
        Self {
            yaw_rate: Held::new(LARGEST_YAW_RATE),
            accel_y: Held::new(LARGEST_ACCEL),
            accel_x: Held::new(LARGEST_ACCEL),
            speed: if speed.abs() <= LARGEST_SPEED { speed } else { 0.0 },
            speed_time: f64::NAN,
            field_strength,
        }
    }

    pub(super) fn inertial(&mut self, imu: &Imu, dt: f64, time: f64, notices: &mut Notices) -> Inertial {
        let yaw_rate = self.yaw_rate.take(imu.gyro_z, dt, time, notices);
        let accel_y = self.accel_y.take(imu.accel_y, dt, time, notices);
        if yaw_rate.is_none() || accel_y.is_none() {
            notices.add(MISSING, time);
        }
        Inertial {
            yaw_rate: yaw_rate.unwrap_or(0.0),
            accel_y: accel_y.unwrap_or(0.0),
            accel_x: self.accel_x.take(imu.accel_x, dt, time, notices),
            has: [yaw_rate.is_some(), accel_y.is_some()],
        }
    }

    /// Hold a speed if it is one.
    pub(super) fn hold_speed(&mut self, speed: f64, time: f64, notices: &mut Notices) {
        if speed.abs() <= LARGEST_SPEED {
            (self.speed, self.speed_time) = (speed, time);
        } else if !speed.is_nan() {
            notices.add(OUT_OF_RANGE, time);
        }
    }

    /// The last good speed, m/s.
    pub(super) fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether that speed is not too old to explain what is felt now.
    pub(super) fn has_speed(&self, time: f64) -> bool {
        time - self.speed_time <= SPEED_HOLD
    }

    /// A magnetic sample as a vector; `None` if it is incomplete or cannot be the Earth's field.
    pub(super) fn field(&self, mag: &Mag, time: f64, notices: &mut Notices) -> Option<Vector3<f64>> {
        let field = Vector3::new(mag.mag_x, mag.mag_y, mag.mag_z);
        let ratio = field.norm() / self.field_strength;
        if (WEAKEST..=STRONGEST).contains(&ratio) {
            return Some(field);
        }
        if field.iter().all(|v| !v.is_nan()) {
            notices.add(FIELD_REFUSED, time);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_value_is_held_for_a_moment_and_then_zero() {
        let (mut s, mut n) = (Sanitizer::new(f64::NAN, 50.0), Notices::default());
        let good = Imu { gyro_z: 0.3, accel_y: 2.0, accel_x: 1.0, ..Imu::default() };
        let mut at = |k: usize, imu: &Imu| s.inertial(imu, 0.01, k as f64 * 0.01, &mut n);
        at(0, &good);
        let bad = Imu { gyro_z: 7.0, accel_y: f64::INFINITY, accel_x: f64::NAN, ..Imu::default() };
        let held: Vec<Inertial> = (1..=25).map(|k| at(k, &bad)).collect();
        let first_lost = held.iter().position(|h| h.accel_x.is_none()).unwrap();
        // Twenty sums of 0.01 may lie on either side of 0.2.
        assert!((19..=20).contains(&first_lost), "{first_lost}");
        assert_eq!(held[5], Inertial { yaw_rate: 0.3, accel_y: 2.0, accel_x: Some(1.0), has: [true; 2] });
        assert_eq!(held[24], Inertial { yaw_rate: 0.0, accel_y: 0.0, accel_x: None, has: [false; 2] });
        assert_eq!(n.list().len(), 2);
    }

    #[test]
    fn a_field_that_cannot_be_the_earths_is_left_out() {
        let (s, mut n) = (Sanitizer::new(0.0, 50.0), Notices::default());
        let mut take = |x: f64| s.field(&Mag { mag_x: x, mag_y: 0.0, mag_z: 0.0 }, 0.0, &mut n).is_some();
        assert_eq!(
            [9.9, 10.1, 149.0, 151.0, f64::NAN, f64::INFINITY].map(&mut take),
            [false, true, true, false, false, false]
        );
        assert_eq!(n.list()[0].count, 3, "a missing sample is no fault");
    }
}
