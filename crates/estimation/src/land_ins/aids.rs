//! What a car's motion mode, wheels and satellites say of the state, as rows of the filter.
//!
//! Source: SPEC motion 2, after Lee et al. 2010, section 4. Rows are measured minus indicated with their derivative by the
//! errors; the non-holonomic constraint and the wheels hold at the rear axle, satellites at their antenna.

use drivescope_drive::frames::skew;
use nalgebra::{Matrix3, Vector3};

use super::errors::{ATTITUDE, GYRO_BIAS, POSITION, VELOCITY};
use super::filter::{Filter, Row};
use super::tuning::Tuning;

/// Factor on the sigma of the non-holonomic constraint while cornering, where tyres slip sideways.
pub const CORNERING_FACTOR: f64 = 2.0;

/// A satellite fix in local north, east, down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Position, m.
    pub position: Option<Vector3<f64>>,
    /// Its sigmas, m; infinite where an axis was not measured.
    pub position_sigma: Vector3<f64>,
    /// Velocity, m/s.
    pub velocity: Option<Vector3<f64>>,
    /// Whether its vertical part was measured.
    pub has_vertical_velocity: bool,
}

/// No velocity.
pub fn zero_velocity(filter: &Filter, tuning: &Tuning) -> [Row; 3] {
    std::array::from_fn(|i| {
        Row::new(-filter.velocity[i], tuning.params.zupt_sigma).by(VELOCITY, &Matrix3::identity().column(i).into())
    })
}

/// No rate: `mean` is the mean of the gyros since the last aid, rad/s.
pub fn zero_rate(filter: &Filter, mean: &Vector3<f64>, tuning: &Tuning) -> [Row; 3] {
    std::array::from_fn(|i| {
        Row::new(mean[i] - filter.gyro_bias[i], tuning.params.zaru_sigma)
            .by(GYRO_BIAS, &Matrix3::identity().column(i).into())
    })
}

/// No yaw rate.
pub fn straight(filter: &Filter, mean: &Vector3<f64>, tuning: &Tuning) -> Row {
    Row::new(mean.z - filter.gyro_bias.z, tuning.params.straight_sigma).by(GYRO_BIAS, &Vector3::z())
}

/// Velocity of the rear axle along one body axis, against `speed` m/s.
fn axle_velocity(filter: &Filter, tuning: &Tuning, axis: usize, speed: f64, sigma: f64) -> Row {
    let nav_to_body = filter.rotation.transpose();
    let turning = filter.rate.cross(&tuning.axle);
    let indicated = (nav_to_body * filter.velocity + turning)[axis];
    let by = |matrix: Matrix3<f64>| matrix.row(axis).transpose();
    Row::new(speed - indicated, sigma)
        .by(VELOCITY, &by(nav_to_body))
        .by(ATTITUDE, &by(nav_to_body * skew(&filter.velocity)))
        .by(GYRO_BIAS, &by(skew(&tuning.axle)))
}

/// No motion sideways or upward at the rear axle.
pub fn non_holonomic(filter: &Filter, tuning: &Tuning, is_cornering: bool) -> [Row; 2] {
    let factor = if is_cornering { CORNERING_FACTOR } else { 1.0 };
    [1, 2].map(|axis| axle_velocity(filter, tuning, axis, 0.0, tuning.params.nhc_sigma * factor))
}

/// The reported speed, m/s.
pub fn wheel(filter: &Filter, tuning: &Tuning, speed: f64) -> Row {
    axle_velocity(filter, tuning, 0, speed, tuning.params.wheel_sigma)
}

/// Position of a fix that is `age` s old, of which the car went on with its velocity; returns how many rows hold.
pub fn satellite_position(filter: &Filter, tuning: &Tuning, fix: &Fix, age: f64) -> ([Row; 3], usize) {
    let arm = filter.rotation * tuning.antenna;
    let indicated = filter.position + arm - filter.velocity * age;
    let by_attitude = -skew(&arm);
    let mut rows = [Row::new(0.0, 1.0); 3];
    let mut count = 0;
    if let Some(position) = fix.position {
        for i in (0..3).filter(|&i| fix.position_sigma[i].is_finite()) {
            rows[count] = Row::new(position[i] - indicated[i], fix.position_sigma[i])
                .by(POSITION, &Matrix3::identity().column(i).into())
                .by(ATTITUDE, &by_attitude.row(i).transpose());
            count += 1;
        }
    }
    (rows, count)
}

/// Velocity of a fix; returns how many rows hold.
pub fn satellite_velocity(filter: &Filter, tuning: &Tuning, fix: &Fix) -> ([Row; 3], usize) {
    let turning = filter.rotation * filter.rate.cross(&tuning.antenna);
    let indicated = filter.velocity + turning;
    let by_attitude = -skew(&turning);
    let by_gyro = filter.rotation * skew(&tuning.antenna);
    let mut rows = [Row::new(0.0, 1.0); 3];
    let Some(velocity) = fix.velocity else { return (rows, 0) };
    for (i, row) in rows.iter_mut().enumerate() {
        *row = Row::new(velocity[i] - indicated[i], tuning.params.gnss_velocity_sigma)
            .by(VELOCITY, &Matrix3::identity().column(i).into())
            .by(ATTITUDE, &by_attitude.row(i).transpose())
            .by(GYRO_BIAS, &by_gyro.row(i).transpose());
    }
    (rows, if fix.has_vertical_velocity { 3 } else { 2 })
}

#[cfg(test)]
mod tests {
    use super::super::errors::STATES;
    use super::super::filter::tests::{moving, tuning};
    use super::*;
    use drivescope_drive::frames::exp_rotation;

    /// Every row is the derivative of what it indicates: an error put into the state takes `h` times itself off `z`.
    /// Catches a sign, a transposed rotation or a forgotten lever arm.
    #[test]
    fn rows_are_the_derivatives_of_what_they_indicate() {
        let base = moving();
        let mut tuning = tuning();
        tuning.axle = Vector3::new(-1.4, 0.2, 0.5);
        tuning.antenna = Vector3::new(0.3, -0.4, -1.1);
        let (mean, gyro) = (Vector3::new(0.01, -0.02, 0.3), base.rate + base.gyro_bias);
        let fix = Fix {
            position: Some(Vector3::new(1.0, 2.0, 3.0)),
            position_sigma: Vector3::new(2.0, 2.0, 3.0),
            velocity: Some(Vector3::new(3.0, -1.0, 0.5)),
            has_vertical_velocity: true,
        };
        let all = |f: &Filter| -> Vec<Row> {
            let mut rows = zero_velocity(f, &tuning).to_vec();
            rows.extend(zero_rate(f, &mean, &tuning));
            rows.extend(non_holonomic(f, &tuning, true));
            rows.extend([straight(f, &mean, &tuning), wheel(f, &tuning, 9.0)]);
            rows.extend(satellite_position(f, &tuning, &fix, 0.0).0);
            rows.extend(satellite_velocity(f, &tuning, &fix).0);
            rows
        };
        let before = all(&base);
        let step = 1e-6;
        for k in 0..STATES {
            let mut dx = [0.0; STATES];
            dx[k] = step;
            let three = |first: usize| Vector3::new(dx[first], dx[first + 1], dx[first + 2]);
            let mut f = base.clone();
            f.position += three(POSITION);
            f.velocity += three(VELOCITY);
            f.rotation = exp_rotation(&three(ATTITUDE)) * f.rotation;
            f.gyro_bias += three(GYRO_BIAS);
            f.rate = gyro - f.gyro_bias;
            for (i, (after, before)) in all(&f).iter().zip(&before).enumerate() {
                let slope = (before.z - after.z) / step;
                // Central rounding 1e-9 of a velocity of ten, second order 1e-5.
                assert!((slope - before.h[k]).abs() < 2e-5, "row {i}, error {k}: {slope} {}", before.h[k]);
            }
        }
    }

    #[test]
    fn axes_that_a_fix_lacks_give_no_rows() {
        let flat = Fix {
            position: Some(Vector3::zeros()),
            position_sigma: Vector3::new(2.0, 2.0, f64::INFINITY),
            velocity: Some(Vector3::zeros()),
            has_vertical_velocity: false,
        };
        assert_eq!(satellite_position(&moving(), &tuning(), &flat, 0.0).1, 2);
        assert_eq!(satellite_velocity(&moving(), &tuning(), &flat).1, 2);
        assert_eq!(satellite_position(&moving(), &tuning(), &Fix { position: None, ..flat }, 0.0).1, 0);
    }
}
