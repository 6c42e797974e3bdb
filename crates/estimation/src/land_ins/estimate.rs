//! The columns of the land INS.

use drivescope_drive::frames::euler_zyx;
use drivescope_drive::record;

use super::errors::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, POSITION, VELOCITY};
use super::filter::{Filter, Verdict};

record! {
    /// Position, velocity, attitude and sensor biases over a flat Earth, and which aid held them.
    pub struct LandInsEstimate {
        /// North of the local origin; no value until the heading is known.
        north: "m", truth "n";
        /// Sigma of the position to the north.
        north_sigma: "m", sigma_of "north";
        /// East of the local origin; no value until the heading is known.
        east: "m", truth "e";
        /// Sigma of the position to the east.
        east_sigma: "m", sigma_of "east";
        /// Below the local origin.
        down: "m", truth "d";
        /// Sigma of the position downward.
        down_sigma: "m", sigma_of "down";
        /// Velocity to the north; no value until the heading is known.
        v_north: "m/s", truth "vn";
        /// Sigma of the velocity to the north.
        v_north_sigma: "m/s", sigma_of "v_north";
        /// Velocity to the east; no value until the heading is known.
        v_east: "m/s", truth "ve";
        /// Sigma of the velocity to the east.
        v_east_sigma: "m/s", sigma_of "v_east";
        /// Velocity downward.
        v_down: "m/s", truth "vd";
        /// Sigma of the velocity downward.
        v_down_sigma: "m/s", sigma_of "v_down";
        /// Forward velocity of the inertial sensor.
        speed: "m/s", truth "vx";
        /// Its sigma.
        speed_sigma: "m/s", sigma_of "speed";
        /// Roll, right side down positive.
        roll: "rad", truth "roll";
        /// Sigma of the roll.
        roll_sigma: "rad", sigma_of "roll";
        /// Pitch, nose up positive.
        pitch: "rad", truth "pitch";
        /// Sigma of the pitch.
        pitch_sigma: "rad", sigma_of "pitch";
        /// Yaw, clockwise from true north; no value until it is known.
        yaw: "rad", truth "yaw";
        /// Sigma of the yaw.
        yaw_sigma: "rad", sigma_of "yaw";
        /// Bias of the roll gyro.
        gyro_bias_x: "rad/s", truth "gyro_bias_x";
        /// Its sigma.
        gyro_bias_x_sigma: "rad/s", sigma_of "gyro_bias_x";
        /// Bias of the pitch gyro.
        gyro_bias_y: "rad/s", truth "gyro_bias_y";
        /// Its sigma.
        gyro_bias_y_sigma: "rad/s", sigma_of "gyro_bias_y";
        /// Bias of the yaw gyro.
        gyro_bias_z: "rad/s", truth "gyro_bias_z";
        /// Its sigma.
        gyro_bias_z_sigma: "rad/s", sigma_of "gyro_bias_z";
        /// Bias of the forward accelerometer.
        accel_bias_x: "m/s^2", truth "accel_bias_x";
        /// Its sigma.
        accel_bias_x_sigma: "m/s^2", sigma_of "accel_bias_x";
        /// Bias of the rightward accelerometer.
        accel_bias_y: "m/s^2", truth "accel_bias_y";
        /// Its sigma.
        accel_bias_y_sigma: "m/s^2", sigma_of "accel_bias_y";
        /// Bias of the downward accelerometer.
        accel_bias_z: "m/s^2", truth "accel_bias_z";
        /// Its sigma.
        accel_bias_z_sigma: "m/s^2", sigma_of "accel_bias_z";
        /// Motion mode that chose the aids: 0 stationary, 1 straight, 2 cornering.
        mode: "1", truth "mode";
        /// 1 while the zero velocity of a car at rest holds the filter, 0 while it is idle or refused.
        zupt_active: "1";
        /// 1 while the zero rate of a car at rest holds the filter, 0 while it is idle or refused.
        zaru_active: "1";
        /// 1 while the non-holonomic constraint holds the filter, 0 while it is idle or refused.
        nhc_active: "1";
        /// 1 while the zero yaw rate of a straight holds the filter, 0 while it is idle or refused.
        straight_active: "1";
        /// 1 while the reported speed holds the filter, 0 while it is idle or refused.
        wheel_active: "1";
        /// 1 while satellites hold the filter, 0 from a refused fix or 2 s after the last one.
        gnss_active: "1";
        /// Normalized innovation squared of the zero velocity. Below 1: a standing car keeps stiller than its sigma says.
        zupt_nis: "1", nis 3;
        /// Normalized innovation squared of the zero rate. Below 1, for the same reason.
        zaru_nis: "1", nis 3;
        /// Normalized innovation squared of the non-holonomic constraint. Below 1: its sigma leaves room for sideslip.
        nhc_nis: "1", nis 2;
        /// Normalized innovation squared of the zero yaw rate of a straight. Below 1: a straight is straighter than its sigma says.
        straight_nis: "1", nis 1;
        /// Normalized innovation squared of the reported speed. Below 1 where its sigma leaves room for a wrong scale.
        wheel_nis: "1", nis 1;
        /// Normalized innovation squared of a satellite position; no value if its height was missing. Below 1 where the receiver
        /// errs slowly: the filter follows it then.
        gnss_position_nis: "1", nis 3;
        /// Normalized innovation squared of a satellite velocity; no value if its vertical part was missing. Below 1 where the
        /// receiver measures better than its sigma says.
        gnss_velocity_nis: "1", nis 3;
    }
}

/// What each aid of an instant was worth; `None` where it was idle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verdicts {
    /// Zero velocity.
    pub zupt: Option<Verdict>,
    /// Zero rate.
    pub zaru: Option<Verdict>,
    /// Non-holonomic constraint.
    pub nhc: Option<Verdict>,
    /// Zero yaw rate on a straight.
    pub straight: Option<Verdict>,
    /// Reported speed.
    pub wheel: Option<Verdict>,
}

fn nis(verdict: Option<Verdict>, rows: usize) -> f64 {
    verdict.filter(|v| v.rows == rows).map_or(f64::NAN, |v| v.nis)
}

pub(super) fn active(verdict: Option<Verdict>) -> f64 {
    f64::from(u8::from(verdict.is_some_and(|v| v.is_accepted)))
}

/// Put the aids of an instant into their columns; `None` between two instants, where the strips stay as they are.
pub(super) fn write_aids(verdicts: Option<&Verdicts>, gnss: &[Option<Verdict>; 2], row: &mut LandInsEstimate) {
    if let Some(v) = verdicts {
        row.zupt_active = active(v.zupt);
        row.zaru_active = active(v.zaru);
        row.nhc_active = active(v.nhc);
        row.straight_active = active(v.straight);
        row.wheel_active = active(v.wheel);
    }
    let v = verdicts.copied().unwrap_or_default();
    row.zupt_nis = nis(v.zupt, 3);
    row.zaru_nis = nis(v.zaru, 3);
    row.nhc_nis = nis(v.nhc, 2);
    row.straight_nis = nis(v.straight, 1);
    row.wheel_nis = nis(v.wheel, 1);
    [row.gnss_position_nis, row.gnss_velocity_nis] = gnss.map(|v| nis(v, 3));
}

/// Put the state into its columns.
pub(super) fn write_state(filter: &Filter, row: &mut LandInsEstimate) {
    let f = filter;
    [row.north, row.east, row.down] = f.position.into();
    [row.v_north, row.v_east, row.v_down] = f.velocity.into();
    row.speed = f.rotation.column(0).dot(&f.velocity);
    let angles = euler_zyx(&f.rotation);
    (row.roll, row.pitch, row.yaw) = (angles.roll, angles.pitch, angles.yaw);
    [row.gyro_bias_x, row.gyro_bias_y, row.gyro_bias_z] = f.gyro_bias.into();
    [row.accel_bias_x, row.accel_bias_y, row.accel_bias_z] = f.accel_bias.into();
}

/// Put the sigmas into their columns.
pub(super) fn write_sigmas(filter: &Filter, row: &mut LandInsEstimate) {
    let three = |first: usize| [0, 1, 2].map(|k| filter.sigma(first + k));
    [row.north_sigma, row.east_sigma, row.down_sigma] = three(POSITION);
    [row.v_north_sigma, row.v_east_sigma, row.v_down_sigma] = three(VELOCITY);
    [row.gyro_bias_x_sigma, row.gyro_bias_y_sigma, row.gyro_bias_z_sigma] = three(GYRO_BIAS);
    [row.accel_bias_x_sigma, row.accel_bias_y_sigma, row.accel_bias_z_sigma] = three(ACCEL_BIAS);
    let c = &filter.rotation;
    let cos_pitch = c[(2, 1)].hypot(c[(2, 2)]).max(1e-6);
    let (sin_yaw, cos_yaw, tan_pitch) = (c[(1, 0)] / cos_pitch, c[(0, 0)] / cos_pitch, -c[(2, 0)] / cos_pitch);
    // Roll, pitch and yaw by a small rotation about north, east, down.
    row.roll_sigma = along(filter, ATTITUDE, [cos_yaw / cos_pitch, sin_yaw / cos_pitch, 0.0]);
    row.pitch_sigma = along(filter, ATTITUDE, [-sin_yaw, cos_yaw, 0.0]);
    row.yaw_sigma = along(filter, ATTITUDE, [tan_pitch * cos_yaw, tan_pitch * sin_yaw, 1.0]);
    row.speed_sigma = along(filter, VELOCITY, [c[(0, 0)], c[(1, 0)], c[(2, 0)]]);
}

/// Sigma of a combination of three errors. That of the speed leaves out what the attitude adds: a hundredth of the speed
/// sideways.
fn along(filter: &Filter, first: usize, factors: [f64; 3]) -> f64 {
    let mut variance = 0.0;
    for (i, a) in factors.iter().enumerate() {
        for (j, b) in factors.iter().enumerate() {
            variance += a * b * filter.p[(first + i, first + j)];
        }
    }
    variance.max(0.0).sqrt()
}

/// Take out what means nothing without a heading.
pub(super) fn blank_heading(row: &mut LandInsEstimate) {
    for value in [
        &mut row.north,
        &mut row.north_sigma,
        &mut row.east,
        &mut row.east_sigma,
        &mut row.v_north,
        &mut row.v_north_sigma,
        &mut row.v_east,
        &mut row.v_east_sigma,
        &mut row.yaw,
        &mut row.yaw_sigma,
    ] {
        *value = f64::NAN;
    }
}
