//! Tuning of the land INS, and the numbers derived from it once.

use drivescope_drive::drive::LogStart;
use drivescope_drive::geodesy::{STANDARD_GRAVITY, gravity};
use drivescope_drive::params;
use nalgebra::Vector3;

use super::errors::{ACCEL_BIAS, ATTITUDE, Covariance, GYRO_BIAS, Noise, POSITION, VELOCITY};

params! {
    /// Which aids hold the land INS, and how much each is believed.
    pub struct LandInsParams {
        /// Use that a car at rest has no velocity.
        zupt (""): toggle = true, from "SPEC motion 2";
        /// Use that a car at rest does not turn.
        zaru (""): toggle = true, from "SPEC motion 2";
        /// Use that a moving car moves neither sideways nor upward (non-holonomic constraint).
        nhc (""): toggle = true, from "SPEC motion 2";
        /// Use that a car on a straight does not turn.
        straight (""): toggle = true, from "SPEC motion 2";
        /// Use the speed that the car or its wheels report.
        wheel (""): toggle = false, from "SPEC motion 2: an option";
        /// Use satellite positions and velocities.
        gnss (""): toggle = false, from "Lee et al. 2010 go without; with it, their future work";
        /// Yaw to start from; not given: the satellites' course once the car moves, till then the magnetometer's.
        initial_yaw (""): optional, "rad", -7.0 ..= 7.0, from "SPEC motion 2";
        /// Whether the mode's thresholds follow the noise floor at rest.
        adaptive (""): toggle = true, from "SPEC motion 1";
        /// Whether turning wheels contradict rest (in a log without: satellites, and fixes that stay tell it).
        use_speed (""): toggle = true, from "ours, as in motion_mode";
        /// Time at rest that is spent on levelling and gyro biases before the navigator starts.
        align_time ("t_align"): number = 5.0, "s", 0.5 ..= 60.0 Linear, from "SPEC motion 2";
        /// Sigma of the zero velocity at rest.
        zupt_sigma (""): number = 0.05, "m/s", 0.005 ..= 0.5 Log, from "SPEC motion 2";
        /// Sigma of the zero rate at rest.
        zaru_sigma (""): number = 0.010, "rad/s", 0.001 ..= 0.1 Log, from "SPEC motion 2";
        /// Sigma of the velocity sideways and upward; twice as much while cornering.
        nhc_sigma (""): number = 0.20, "m/s", 0.02 ..= 2.0 Log, from "SPEC motion 2";
        /// Sigma of the yaw rate on a straight.
        straight_sigma (""): number = 0.03, "rad/s", 0.003 ..= 0.3 Log, from "SPEC motion 2";
        /// Sigma of the reported speed.
        wheel_sigma (""): number = 0.10, "m/s", 0.01 ..= 1.0 Log, from "SPEC motion 2";
        /// Sigma of a satellite position to the north and east where the receiver states none.
        gnss_position_sigma (""): number = 2.0, "m", 0.2 ..= 20.0 Log, from "SPEC motion 2";
        /// Sigma of a satellite height where the receiver states none.
        gnss_height_sigma (""): number = 3.0, "m", 0.3 ..= 30.0 Log, from "SPEC motion 2";
        /// Sigma of a satellite velocity.
        gnss_velocity_sigma (""): number = 0.15, "m/s", 0.015 ..= 1.5 Log, from "SPEC motion 2";
        /// Normalized innovation squared per measured number above which a measurement is refused.
        gate (""): number = 25.0, "1", 3.0 ..= 1000.0 Log, from "SPEC motion 2";
        /// Accelerometer noise density, vibration included. More: aids are believed more.
        accel_noise ("s_acc"): number = 0.06, "m/s^2/sqrt(Hz)", 0.006 ..= 0.6 Log, from "SPEC motion 2";
        /// Gyro noise density, vibration included.
        gyro_noise ("s_gyro"): number = 0.003, "rad/s/sqrt(Hz)", 3e-4 ..= 0.03 Log, from "SPEC motion 2";
        /// Walk of the accelerometer biases.
        accel_bias_walk ("s_ba"): number = 0.001, "m/s^2/sqrt(s)", 1e-4 ..= 0.01 Log, from "SPEC motion 2";
        /// Walk of the gyro biases.
        gyro_bias_walk ("s_bg"): number = 5e-5, "rad/s/sqrt(s)", 5e-6 ..= 5e-4 Log, from "SPEC motion 2";
        /// Sigma of the position at the start.
        initial_position_sigma (""): number = 0.1, "m", 0.01 ..= 10.0 Log, from "SPEC motion 2, P0";
        /// Sigma of the velocity at the start.
        initial_velocity_sigma (""): number = 0.02, "m/s", 0.002 ..= 0.2 Log, from "SPEC motion 2, P0";
        /// Sigma of roll and pitch at the start.
        initial_tilt_sigma (""): number = 0.02, "rad", 0.002 ..= 0.2 Log, from "SPEC motion 2, P0";
        /// Sigma of the yaw at the start, where it is given.
        initial_yaw_sigma (""): number = 0.05, "rad", 0.005 ..= 0.5 Log, from "SPEC motion 2, P0";
        /// Sigma of the gyro biases at the start.
        initial_gyro_bias_sigma (""): number = 0.003, "rad/s", 3e-4 ..= 0.03 Log, from "SPEC motion 2, P0";
        /// Sigma of the accelerometer biases at the start.
        initial_accel_bias_sigma (""): number = 0.08, "m/s^2", 0.008 ..= 0.8 Log, from "SPEC motion 2, P0";
        /// Rear axle ahead of the inertial sensor. None: where the drive says it is, else at the sensor.
        axle_x ("l_x"): optional, "m", -10.0 ..= 10.0, from "SPEC motion 2: at the sensor";
        /// Rear axle to the right of the inertial sensor.
        axle_y ("l_y"): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC motion 2: none";
        /// Rear axle below the inertial sensor.
        axle_z ("l_z"): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC motion 2: none";
        /// Antenna ahead of the inertial sensor.
        antenna_x (""): number = 0.0, "m", -10.0 ..= 10.0 Linear, from "SPEC motion 2: none";
        /// Antenna to the right of the inertial sensor.
        antenna_y (""): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC motion 2: none";
        /// Antenna below the inertial sensor.
        antenna_z (""): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC motion 2: none";
    }
}

/// Parameters, and what follows from them and from the log's start.
#[derive(Clone, Debug)]
pub struct Tuning {
    /// The parameters.
    pub params: LandInsParams,
    /// Noise that drives the errors.
    pub noise: Noise,
    /// Rear axle, seen from the inertial sensor, body axes, m.
    pub axle: Vector3<f64>,
    /// Antenna, seen from the inertial sensor, body axes, m.
    pub antenna: Vector3<f64>,
    /// Gravity, m/s^2: of the place where the log says it, else standard.
    pub gravity: f64,
    /// Covariance at a start from rest.
    pub initial_covariance: Covariance,
}

impl Tuning {
    /// Derive.
    pub fn new(params: &LandInsParams, start: &LogStart) -> Self {
        let p = params;
        let square = |v: f64| v * v;
        let mut initial_covariance = Covariance::zeros();
        for (first, sigma) in [
            (POSITION, p.initial_position_sigma),
            (VELOCITY, p.initial_velocity_sigma),
            (ATTITUDE, p.initial_tilt_sigma),
            (GYRO_BIAS, p.initial_gyro_bias_sigma),
            (ACCEL_BIAS, p.initial_accel_bias_sigma),
        ] {
            (first..first + 3).for_each(|k| initial_covariance[(k, k)] = square(sigma));
        }
        initial_covariance[(ATTITUDE + 2, ATTITUDE + 2)] = square(p.initial_yaw_sigma);
        let axle_x = if p.axle_x.is_finite() { p.axle_x } else { start.rear_axle.unwrap_or(0.0) };
        Self {
            noise: Noise {
                accel: square(p.accel_noise),
                gyro: square(p.gyro_noise),
                gyro_bias: square(p.gyro_bias_walk),
                accel_bias: square(p.accel_bias_walk),
            },
            axle: Vector3::new(axle_x, p.axle_y, p.axle_z),
            antenna: Vector3::new(p.antenna_x, p.antenna_y, p.antenna_z),
            gravity: start.origin.map_or(STANDARD_GRAVITY, |place| gravity(place.lat, place.alt)),
            initial_covariance,
            params: params.clone(),
        }
    }
}
