//! Columns and tuning of the attitude filter.

use drivescope_drive::{params, record};

use super::model::{Covariance, State};

record! {
    /// Attitude and sensor biases.
    pub struct AttitudeEstimate {
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
        /// Normalized innovation squared of the specific force against gravity and the change of speed. Above 1 where bumps, sideslip
        /// and a sensor away from the rear axle add accelerations that speed and yaw rate do not tell.
        force_nis: "1", nis 3;
        /// Normalized innovation squared of the satellite course. Below 1 because its sigma leaves room for sideslip.
        course_nis: "1", nis 1;
        /// 1 where the specific force was used, 0 where it was refused.
        force_accepted: "1";
        /// 1 where the satellite course was used, 0 where it was refused.
        course_accepted: "1";
    }
}

params! {
    /// Tuning of the attitude filter.
    pub struct AttitudeParams {
        /// Gyro noise density. More: the angles follow force and course faster and shake more.
        gyro_noise ("ng"): number = 2e-4, "rad/s/sqrt(Hz)", 1e-7 ..= 1e-2 Log, from "SPEC navigation 3";
        /// Walk of the gyro biases. More: biases are relearnt faster.
        gyro_bias_walk ("rbg"): number = 3e-6, "rad/s/sqrt(s)", 1e-10 ..= 1e-4 Log, from "SPEC navigation 3";
        /// Walk of the accelerometer biases. More: biases are relearnt faster.
        accel_bias_walk ("rba"): number = 2e-4, "m/s^2/sqrt(s)", 1e-7 ..= 1e-2 Log, from "SPEC navigation 3";
        /// Sigma of the mean specific force against gravity and the change of speed.
        accel_sigma (""): number = 0.067, "m/s^2", 0.01 ..= 2.0 Log, from "SPEC navigation 6: 0.15 at 10 Hz, averaged over the interval";
        /// Time over which force and change of speed are compared. More: less noise of the speed, and slower.
        interval (""): number = 0.5, "s", 0.05 ..= 5.0 Log, from "ours: speed noise of 0.05 m/s makes 0.14 m/s^2";
        /// Sigma of the course of a fast car: sideslip and noise.
        course_sigma (""): number = 0.017_453_292_519_943_295, "rad", 0.001 ..= 0.2 Log, from "SPEC navigation 4: 1 deg";
        /// Noise of the satellite velocity across the course, divided by the speed in the course's sigma.
        course_speed_sigma (""): number = 0.05, "m/s", 0.005 ..= 1.0 Log, from "SPEC navigation 5: rate noise";
        /// Slowest satellite speed at which the course tells the yaw.
        course_speed (""): number = 2.0, "m/s", 0.3 ..= 20.0 Log, from "SPEC navigation 6";
        /// Sigma of roll and pitch after a start at rest.
        initial_tilt_sigma (""): number = 0.01, "rad", 1e-4 ..= 0.5 Log, from "SPEC navigation 3, P0";
        /// Sigma of roll and pitch when the log starts in motion.
        moving_tilt_sigma (""): number = 0.087, "rad", 0.01 ..= 0.5 Log, from "ours: 5 deg, half a m/s^2 of acceleration and a slope";
        /// Sigma of a given start yaw.
        initial_yaw_sigma (""): number = 0.087_266_462_599_716_47, "rad", 0.008 ..= 1.571 Log, from "SPEC navigation 3, P0: 5 deg";
        /// Sigma of the gyro biases at the start.
        initial_gyro_bias_sigma (""): number = 1e-3, "rad/s", 1e-6 ..= 0.1 Log, from "ours: after a rest; the walk of minutes";
        /// Sigma of the accelerometer biases at the start.
        initial_accel_bias_sigma (""): number = 0.05, "m/s^2", 1e-5 ..= 1.0 Log, from "SPEC navigation 3, P0";
        /// Longest time at rest that is spent on levelling and gyro bias before the filter starts.
        align_time ("k0"): number = 18.0, "s", 0.0 ..= 120.0 Linear, from "SPEC navigation 11: k0";
        /// Yaw to start from; not given: the satellite course, as soon as the car moves.
        initial_yaw (""): optional, "rad", -7.0 ..= 7.0, from "SPEC navigation 6";
        /// Probability with which a good measurement passes its gate.
        gate_probability ("p_gate"): number = 0.999, "1", 0.9 ..= 0.99999 Linear, from "SPEC navigation 3";
        /// Refuse measurements that the filter finds too improbable.
        gate (""): toggle = true, from "SPEC navigation 4";
    }
}

/// Put state and sigmas into their columns.
pub fn write(state: &State, covariance: &Covariance, is_yaw_known: bool, row: &mut AttitudeEstimate) {
    let sigma = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    [row.pitch, row.roll, row.gyro_bias_z, row.gyro_bias_y, row.gyro_bias_x] = std::array::from_fn(|k| state[1 + k]);
    [row.pitch_sigma, row.roll_sigma] = [sigma(1), sigma(2)];
    [row.gyro_bias_z_sigma, row.gyro_bias_y_sigma, row.gyro_bias_x_sigma] = [sigma(3), sigma(4), sigma(5)];
    [row.accel_bias_x, row.accel_bias_y, row.accel_bias_z] = [state[6], state[7], state[8]];
    [row.accel_bias_x_sigma, row.accel_bias_y_sigma, row.accel_bias_z_sigma] = [sigma(6), sigma(7), sigma(8)];
    if is_yaw_known {
        (row.yaw, row.yaw_sigma) = (state[0], sigma(0));
    }
}
