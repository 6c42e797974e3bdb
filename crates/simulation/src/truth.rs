//! The truth of one instant as columns.

use drivescope_drive::channel::{Column, Series};
use drivescope_drive::truth::truth_column;
use nalgebra::{Matrix3, Vector3};

use crate::math::{roll_pitch_yaw, rotation};
use crate::motion::{Inertial, Motion};
use crate::plant::Plant;

/// Slower than this the car stands, m/s.
pub const STANDING: f64 = 0.05;
/// Turning faster than this the car corners, rad/s.
pub const CORNERING: f64 = 0.04;
/// Slower than this, course and sideslip have no value, m/s.
const NO_COURSE: f64 = 0.5;

const NAMES: [&str; 37] = [
    "roll",
    "pitch",
    "yaw",
    "suspension_roll",
    "suspension_pitch",
    "bank",
    "grade",
    "body_pitch",
    "sideslip",
    "course",
    "vx",
    "vy",
    "n",
    "e",
    "d",
    "lat",
    "lon",
    "alt",
    "vn",
    "ve",
    "vd",
    "gyro_x",
    "gyro_y",
    "gyro_z",
    "yaw_rate",
    "mode",
    "accel_net",
    "specific_force_x",
    "force_xf",
    "force_yf",
    "force_yr",
    "accel_bias_x",
    "accel_bias_y",
    "accel_bias_z",
    "gyro_bias_x",
    "gyro_bias_y",
    "gyro_bias_z",
];

/// An empty series with the columns of [`row`].
pub fn series() -> Series {
    let columns: Vec<Column> = NAMES.iter().filter_map(|name| truth_column(name).copied()).collect();
    Series::new(&columns)
}

/// Biases of accelerometers (m/s^2) and gyros (rad/s) when the sample was taken.
#[derive(Clone, Copy, Debug)]
pub struct Biases {
    /// Accelerometers.
    pub accel: Vector3<f64>,
    /// Gyros.
    pub gyro: Vector3<f64>,
}

/// Axes of the plane under the wheels at the car's heading, body to level, from the plane's downward normal.
fn wheel_plane(normal: &Vector3<f64>, yaw: f64) -> (f64, f64, Matrix3<f64>) {
    let seen = rotation(0.0, 0.0, yaw).transpose() * normal;
    let bank = -libm::asin(seen.y.clamp(-1.0, 1.0));
    let grade = libm::atan2(seen.x, seen.z);
    (bank, grade, rotation(bank, grade, yaw))
}

/// One row: the sensors' motion, the inertial averages over the step that ends now, the car's forces, the biases.
pub fn row(
    motion: &Motion,
    ned: &Vector3<f64>,
    inertial: &Inertial,
    plant: &Plant,
    biases: &Biases,
) -> [f64; NAMES.len()] {
    let [roll, pitch, yaw] = roll_pitch_yaw(&motion.attitude);
    let (bank, grade, plane) = wheel_plane(&plant.wheel_plane(), yaw);
    let [suspension_roll, suspension_pitch, _] = roll_pitch_yaw(&(plane.transpose() * motion.attitude));
    let v = motion.velocity;
    let body = motion.attitude.transpose() * v;
    let moves = v.norm() > NO_COURSE;
    let when_moving = |angle: f64| if moves { angle } else { f64::NAN };
    let yaw_rate = yaw_rate(motion, roll, pitch);
    let w = motion.rate;
    let f = plant.forces();
    let place = motion.place;
    let groups: [&[f64]; 9] = [
        &[roll, pitch, yaw, suspension_roll, suspension_pitch, bank, grade, suspension_pitch],
        &[when_moving(libm::atan2(body.y, body.x)), when_moving(libm::atan2(v.y, v.x)), body.x, body.y],
        &[ned.x, ned.y, ned.z, place.lat, place.lon, place.alt],
        &[v.x, v.y, v.z, w.x, w.y, w.z],
        &[yaw_rate, mode(v.norm(), yaw_rate)],
        &[inertial.forward_acceleration, inertial.force.x],
        &[f.ahead[0] + f.ahead[1], f.aside[0] + f.aside[1], f.aside[2] + f.aside[3]],
        biases.accel.as_slice(),
        biases.gyro.as_slice(),
    ];
    let mut row = [f64::NAN; NAMES.len()];
    row.iter_mut().zip(groups.into_iter().flatten()).for_each(|(cell, value)| *cell = *value);
    row
}

fn yaw_rate(motion: &Motion, roll: f64, pitch: f64) -> f64 {
    let (sin_roll, cos_roll) = crate::math::sin_cos(roll);
    (motion.rate.y * sin_roll + motion.rate.z * cos_roll) / crate::math::sin_cos(pitch).1
}

fn mode(speed: f64, yaw_rate: f64) -> f64 {
    if speed < STANDING {
        0.0
    } else if yaw_rate.abs() > CORNERING {
        2.0
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_is_a_truth_signal() {
        assert_eq!(series().schema().len(), NAMES.len());
    }

    #[test]
    fn the_wheel_plane_is_the_rotation_it_was_made_of() {
        let (bank, grade, yaw) = (0.1, -0.07, 2.0);
        let axes = rotation(bank, grade, yaw);
        let (b, g, again) = wheel_plane(&axes.column(2).into_owned(), yaw);
        assert!((b - bank).abs() < 1e-14 && (g - grade).abs() < 1e-14 && (again - axes).norm() < 1e-14);
    }
}
