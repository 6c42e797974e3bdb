//! Angles and sensor biases: how they move, what the sensors show of them, and the Jacobians of both.
//!
//! State: yaw, pitch, roll (rad); biases of the yaw, pitch and roll gyros (rad/s); biases of the forward, rightward and
//! downward accelerometers (m/s^2). Source: Yun & Yu 2007 (3); SPEC navigation 6.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Number of states.
pub const STATES: usize = 9;
/// Yaw; pitch and roll follow.
pub const YAW: usize = 0;
/// Bias of the yaw gyro; those of pitch and roll follow.
pub const GYRO_BIAS: usize = 3;
/// Bias of the forward accelerometer; the others follow.
pub const ACCEL_BIAS: usize = 6;

/// Yaw, pitch, roll, gyro biases z, y, x, accelerometer biases x, y, z.
pub type State = SVector<f64, STATES>;
/// Covariance of the state.
pub type Covariance = SMatrix<f64, STATES, STATES>;

/// Rates of yaw, pitch and roll for measured body rates (x, y, z, rad/s). (3)
pub fn rates(state: &State, gyro: &Vector3<f64>) -> Vector3<f64> {
    kinematics(state[1], state[2]) * (gyro - Vector3::new(state[5], state[4], state[3]))
}

/// From body rates x, y, z to the rates of yaw, pitch, roll.
pub fn kinematics(pitch: f64, roll: f64) -> Matrix3<f64> {
    let ((sr, cr), (sp, cp)) = (roll.sin_cos(), pitch.sin_cos());
    Matrix3::new(0.0, sr / cp, cr / cp, 0.0, cr, -sr, 1.0, sr * sp / cp, cr * sp / cp)
}

/// Derivative of [`rates`] with respect to pitch, roll and the gyro biases z, y, x, in this order; to all else it is zero. (3)
pub fn rates_jacobian(state: &State, gyro: &Vector3<f64>) -> SMatrix<f64, 3, 5> {
    let (pitch, roll) = (state[1], state[2]);
    let (q, r) = (gyro.y - state[4], gyro.z - state[3]);
    let ((sr, cr), (sp, cp)) = (roll.sin_cos(), pitch.sin_cos());
    let (turn, tilt, tan) = (q * sr + r * cr, q * cr - r * sr, sp / cp);
    SMatrix::<f64, 3, 5>::from_row_slice(&[
        turn * sp / (cp * cp),
        tilt / cp,
        -cr / cp,
        -sr / cp,
        0.0,
        0.0,
        -turn,
        sr,
        -cr,
        0.0,
        turn / (cp * cp),
        tan * tilt,
        -tan * cr,
        -tan * sr,
        -1.0,
    ])
}

/// Specific force of a car that accelerates forward and rightward (m/s^2, in the horizontal plane along its heading), and its
/// derivative.
///
/// `f = C'(a - g) + bias`, `g` the gravity, m/s^2; yaw cancels because the acceleration is given along the heading.
pub fn specific_force(state: &State, forward: f64, rightward: f64, g: f64) -> (Vector3<f64>, SMatrix<f64, 3, STATES>) {
    let ((sr, cr), (sp, cp)) = (state[2].sin_cos(), state[1].sin_cos());
    // After the pitch, before the roll.
    let (x, z) = (forward * cp + g * sp, forward * sp - g * cp);
    let force = Vector3::new(x, rightward * cr + z * sr, z * cr - rightward * sr);
    let mut h = SMatrix::<f64, 3, STATES>::zeros();
    h.column_mut(1).copy_from(&Vector3::new(-z, x * sr, x * cr));
    h.column_mut(2).copy_from(&Vector3::new(0.0, force.z, -force.y));
    h.fixed_view_mut::<3, 3>(0, ACCEL_BIAS).fill_with_identity();
    (force + state.fixed_rows::<3>(ACCEL_BIAS), h)
}

/// `P <- Phi P Phi' + Q` for one sample of `dt` s, to first order; zeros of the rates' derivative cost nothing.
///
/// `noise`: variance of the gyro (per s), of the walks of gyro and accelerometer biases.
pub fn propagate(p: &mut Covariance, jacobian: &SMatrix<f64, 3, 5>, angles: &Matrix3<f64>, noise: [f64; 3], dt: f64) {
    let a = jacobian * dt;
    // Rows of the angles take their share of rows 1 to 5, from the values before.
    let before = *p;
    for row in 0..3 {
        for column in 0..STATES {
            p[(row, column)] += (0..5).map(|k| a[(row, k)] * before[(1 + k, column)]).sum::<f64>();
        }
    }
    let before = *p;
    for column in 0..3 {
        for row in 0..STATES {
            p[(row, column)] += (0..5).map(|k| a[(column, k)] * before[(row, 1 + k)]).sum::<f64>();
        }
    }
    let shaken = angles * angles.transpose() * (noise[0] * dt);
    let mut block = p.fixed_view_mut::<3, 3>(YAW, YAW);
    block += shaken;
    for k in 0..3 {
        p[(GYRO_BIAS + k, GYRO_BIAS + k)] += noise[1] * dt;
        p[(ACCEL_BIAS + k, ACCEL_BIAS + k)] += noise[2] * dt;
    }
    crate::kalman::symmetrize(p);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kalman;
    use crate::testing::assert_jacobian;
    use drivescope_drive::frames::body_to_nav;
    use drivescope_drive::geodesy::STANDARD_GRAVITY;

    fn states() -> [State; 3] {
        [
            State::from([0.4, 0.05, -0.03, 1e-3, -2e-3, 3e-3, 0.02, -0.03, 0.05]),
            State::from([-2.0, 0.6, -0.9, 0.01, 0.02, -0.01, 0.2, 0.1, -0.1]),
            State::from([3.0, -1.2, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ]
    }

    const GYRO: Vector3<f64> = Vector3::new(0.1, -0.2, 0.5);

    #[test]
    fn both_jacobians_are_the_derivatives_of_their_models() {
        for state in states() {
            let mut full = SMatrix::<f64, 3, STATES>::zeros();
            full.fixed_view_mut::<3, 5>(0, 1).copy_from(&rates_jacobian(&state, &GYRO));
            assert_jacobian(|x| rates(x, &GYRO), &full, &state, 1e-6);
            let h = specific_force(&state, 1.5, -2.5, STANDARD_GRAVITY).1;
            assert_jacobian(|x| specific_force(x, 1.5, -2.5, STANDARD_GRAVITY).0, &h, &state, 1e-6);
        }
    }

    /// Against the rotation itself: a step of the angles is the rotation by the body rates.
    #[test]
    fn the_angles_follow_the_rotation() {
        for state in states() {
            let rates = rates(&state, &GYRO);
            let rate = GYRO - Vector3::new(state[5], state[4], state[3]);
            let dt = 1e-6;
            let at = |s: f64| body_to_nav(state[2] + s * rates.z, state[1] + s * rates.y, state[0] + s * rates.x);
            let turned = at(0.0) * (Matrix3::identity() + drivescope_drive::frames::skew(&(rate * dt)));
            assert!((at(dt) - turned).amax() < 1e-10, "{state}");
        }
    }

    /// Against the rotation itself: gravity and acceleration seen from the body.
    #[test]
    fn the_specific_force_is_the_rotated_acceleration_less_gravity() {
        for state in states() {
            let (yaw, pitch, roll) = (state[0], state[1], state[2]);
            let (forward, rightward) = (1.5, -2.5);
            let level = body_to_nav(0.0, 0.0, yaw) * Vector3::new(forward, rightward, -STANDARD_GRAVITY);
            let expected = body_to_nav(roll, pitch, yaw).transpose() * level + state.fixed_rows::<3>(ACCEL_BIAS);
            assert!((specific_force(&state, forward, rightward, STANDARD_GRAVITY).0 - expected).norm() < 1e-13);
        }
    }

    #[test]
    fn the_sparse_propagation_is_the_dense_one() {
        let state = states()[1];
        let jacobian = rates_jacobian(&state, &GYRO);
        let angles = kinematics(state[1], state[2]);
        let mut p = Covariance::from_fn(|r, c| 0.01 * ((r * c) as f64).cos()) + Covariance::identity();
        p = p * p.transpose();
        let mut dense = p;
        let mut phi = Covariance::identity();
        let mut block = phi.fixed_view_mut::<3, 5>(0, 1);
        block += jacobian * 0.02;
        let mut q = Covariance::zeros();
        q.fixed_view_mut::<3, 3>(0, 0).copy_from(&(angles * angles.transpose() * (4e-8 * 0.02)));
        (0..3).for_each(|k| q[(3 + k, 3 + k)] = 9e-12 * 0.02);
        (0..3).for_each(|k| q[(6 + k, 6 + k)] = 4e-8 * 0.02);
        kalman::predict(&mut dense, &phi, &q);
        propagate(&mut p, &jacobian, &angles, [4e-8, 9e-12, 4e-8], 0.02);
        assert!((p - dense).amax() < 1e-13);
    }

    /// Null directions of what the sensors show over 40 steps of 0.1 s (SPEC navigation 10.7): singular values below
    /// `smallest` of the observability matrix, its columns scaled to the start sigmas and rows to the noise.
    fn null_directions(gyro: &Vector3<f64>, forward: f64, rightward: f64, has_course: bool, smallest: f64) -> usize {
        let mut state = State::zeros();
        let scale = Covariance::from_diagonal(&State::from([0.1, 0.01, 0.01, 3e-3, 3e-3, 3e-3, 0.05, 0.05, 0.05]));
        let mut phi = Covariance::identity();
        let mut gram = Covariance::zeros();
        for k in 0..40 {
            // A turn to the right, then one to the left, as a drive has them.
            let sign = if k < 20 { 1.0 } else { -1.0 };
            let h = specific_force(&state, forward * sign, rightward * sign, STANDARD_GRAVITY).1 / 0.15;
            let seen = h * phi * scale;
            gram += seen.transpose() * seen;
            if has_course {
                let seen =
                    SMatrix::<f64, 1, STATES>::from_fn(|_, c| if c == 0 { 1.0 / 0.02 } else { 0.0 }) * phi * scale;
                gram += seen.transpose() * seen;
            }
            let mut step = Covariance::identity();
            let mut block = step.fixed_view_mut::<3, 5>(0, 1);
            block += rates_jacobian(&state, &(gyro * sign)) * 0.1;
            phi = step * phi;
            let moved = rates(&state, &(gyro * sign)) * 0.1;
            state[0] += moved.x;
        }
        gram.symmetric_eigenvalues().iter().filter(|v| v.max(0.0).sqrt() < smallest).count()
    }

    /// A parked car: yaw, its gyro bias, and tilt against accelerometer bias in two directions stay unknown. On a straight at
    /// constant speed the course tells the first two. Turns and braking tell the rest.
    #[test]
    fn what_cannot_be_known_at_rest_is_told_by_driving() {
        let still = Vector3::zeros();
        assert_eq!(null_directions(&still, 0.0, 0.0, false, 1e-3), 4);
        assert_eq!(null_directions(&still, 0.0, 0.0, true, 1e-3), 2);
        assert_eq!(null_directions(&Vector3::new(0.0, 0.0, 0.3), 1.5, 3.0, true, 0.05), 0);
    }
}
