//! Specific force, angular acceleration and body rates from six accelerometers on a disk and one yaw gyro.
//!
//! Source: Lee et al. 2010, section 3, made precise by SPEC motion 3 (layout, inverse, filter). Disk to force and angular
//! acceleration ([`geometry`]), these to rates by seven states and the zero references of the motion mode ([`rates`]), and
//! rates to the mode ([`crate::motion_mode`]), row by row ([`Front`]). The disk's axes, scales and biases come from rests in
//! several poses ([`calibration`]). `motion_mode` and `land_ins` read such a log through the same front.
//! Not modelled: lever arm of the disk's centre; sensors that depend on temperature or on the force itself.

pub mod calibration;
mod front;
pub mod geometry;
mod linear;
pub mod rates;

use drivescope_drive::drive::{Epoch, LogStart, Signal};
use drivescope_drive::vehicle::VehicleParams;
use drivescope_drive::{params, record};

pub use self::front::Front;
pub use self::geometry::{Geometry, Motion, SingularLayout};
use crate::estimator::{Estimator, EstimatorError, Need, Notices};
use crate::motion_mode::{MotionModeDetector, MotionModeEstimate, MotionModeParams};

params! {
    /// Tuning of the rate filter of the disk.
    pub struct GyroFreeParams {
        /// Noise of the angular accelerations, as a density; more: rates follow gyro and zero references faster.
        acceleration_noise ("q_w"): number = 0.25, "rad/s/sqrt(s)", 0.025 ..= 2.5 Log, from "SPEC motion 3.3";
        /// Walk of the biases of the angular accelerations.
        acceleration_bias_walk ("q_ba"): number = 0.02, "rad/s^2/sqrt(s)", 0.002 ..= 0.2 Log, from "SPEC motion 3.3";
        /// Walk of the yaw gyro's bias.
        gyro_bias_walk ("q_bg"): number = 2e-4, "rad/s/sqrt(s)", 2e-5 ..= 2e-3 Log, from "SPEC motion 3.3";
        /// Sigma of a yaw gyro's sample.
        gyro_sigma ("r_g"): number = 0.006, "rad/s", 6e-4 ..= 0.06 Log, from "SPEC motion 3.3";
        /// Sigma of the rates of a car at rest about zero.
        rest_sigma ("r_rest"): number = 0.004, "rad/s", 4e-4 ..= 0.04 Log, from "SPEC motion 3.3";
        /// Sigma of roll and pitch rate of a moving car about zero.
        level_sigma ("r_move"): number = 0.03, "rad/s", 0.003 ..= 0.3 Log, from "SPEC motion 3.3";
        /// Sigma of the yaw rate of a car on a straight about zero.
        straight_sigma ("r_str"): number = 0.02, "rad/s", 0.002 ..= 0.2 Log, from "SPEC motion 3.3";
        /// Whether the yaw gyro is used.
        use_gyro (""): toggle = true, from "SPEC motion 3.3";
        /// Whether the motion mode's zero rates are used.
        zero_reference (""): toggle = true, from "SPEC motion 3.3";
        /// Whether the mode's thresholds follow the noise floor at rest.
        adaptive (""): toggle = true, from "SPEC motion 1";
        /// Whether turning wheels contradict rest (in a log without: satellites, and fixes that stay tell it).
        use_speed (""): toggle = true, from "ours, as in motion_mode";
    }
}

record! {
    /// What the disk says of the car's motion.
    pub struct GyroFreeEstimate {
        /// Forward specific force.
        force_x: "m/s^2", truth "specific_force_x";
        /// Rightward specific force.
        force_y: "m/s^2";
        /// Downward specific force.
        force_z: "m/s^2";
        /// Angular acceleration about the forward axis.
        angular_accel_x: "rad/s^2";
        /// Angular acceleration about the rightward axis.
        angular_accel_y: "rad/s^2";
        /// Angular acceleration about the downward axis.
        angular_accel_z: "rad/s^2";
        /// Roll rate.
        rate_x: "rad/s", truth "gyro_x";
        /// Its sigma.
        rate_x_sigma: "rad/s", sigma_of "rate_x";
        /// Pitch rate.
        rate_y: "rad/s", truth "gyro_y";
        /// Its sigma.
        rate_y_sigma: "rad/s", sigma_of "rate_y";
        /// Yaw rate.
        rate_z: "rad/s", truth "gyro_z";
        /// Its sigma.
        rate_z_sigma: "rad/s", sigma_of "rate_z";
        /// Bias of the yaw gyro.
        gyro_bias: "rad/s", truth "gyro_bias_z";
        /// Its sigma.
        gyro_bias_sigma: "rad/s", sigma_of "gyro_bias";
        /// Roll rate by integrating the angular acceleration and nothing else: it drifts.
        plain_rate_x: "rad/s", truth "gyro_x";
        /// Pitch rate by integrating the angular acceleration and nothing else: it drifts.
        plain_rate_y: "rad/s", truth "gyro_y";
        /// Yaw rate by integrating the angular acceleration and nothing else: it drifts.
        plain_rate_z: "rad/s", truth "gyro_z";
        /// Mean absolute step of the specific force's magnitude from sample to sample.
        jd: "m/s^2";
        /// Mean rate about the horizontal axes, from the high-passed angular accelerations.
        td: "rad/s";
        /// Mean distance of the forward specific force from its value a launch window ago.
        fd: "m/s^2";
        /// Mean yaw rate of the gyro, to the right positive.
        yd: "rad/s";
        /// Dynamics indicator: 1 quiet, 2 shaken or swaying, 3 both.
        indicator: "1";
        /// Motion mode: 0 stationary, 1 straight, 2 cornering.
        mode: "1", truth "mode";
    }
}

/// The estimator: see the [module](self).
#[derive(Clone, Debug)]
pub struct GyroFree {
    detector: MotionModeDetector,
}

impl Estimator for GyroFree {
    const NAME: &'static str = "gyro_free";
    const TITLE: &'static str = "Six-accelerometer disk";
    const DOC: &'static str = "Specific force, angular acceleration and body rates from six accelerometers on a disk and one \
        yaw gyro, with the zero rates that the motion mode knows. After Lee et al. 2010.";
    const NEEDS: &'static [Need] = &[
        Need {
            signal: Signal::AccelArray,
            required: true,
            why: "force and angular acceleration are read from all six",
        },
        Need {
            signal: Signal::GyroZ,
            required: false,
            why: "holds the yaw rate; without it corners are read too small",
        },
        Need { signal: Signal::ForwardSpeed, required: false, why: "turning wheels contradict rest" },
        Need { signal: Signal::GnssPosition, required: false, why: "without wheels, fixes that stay tell rest" },
    ];
    const VEHICLE: &'static str = "saloon";
    type Params = GyroFreeParams;
    type Estimate = GyroFreeEstimate;

    fn new(params: &GyroFreeParams, _vehicle: &VehicleParams, start: &LogStart) -> Self {
        let mode =
            MotionModeParams { adaptive: params.adaptive, use_speed: params.use_speed, ..MotionModeParams::default() };
        Self { detector: MotionModeDetector::with_disk(&mode, params, start).disk_only() }
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<GyroFreeEstimate>, EstimatorError> {
        let mode = self.detector.step(epoch)?;
        Ok(mode.zip(self.detector.front()).map(|(mode, front)| estimate(&mode, front)))
    }

    fn notices(&self) -> &Notices {
        self.detector.notices()
    }
}

fn estimate(mode: &MotionModeEstimate, front: &Front) -> GyroFreeEstimate {
    let motion = front.motion();
    let [force_x, force_y, force_z] = motion.force.into();
    let [angular_accel_x, angular_accel_y, angular_accel_z] = motion.angular_acceleration.into();
    let [rate_x, rate_y, rate_z] = front.filter().rate();
    let [rate_x_sigma, rate_y_sigma, rate_z_sigma] = front.filter().rate_sigma();
    let (gyro_bias, gyro_bias_sigma) = front.filter().gyro_bias();
    let [plain_rate_x, plain_rate_y, plain_rate_z] = front.plain_rate();
    GyroFreeEstimate {
        force_x,
        force_y,
        force_z,
        angular_accel_x,
        angular_accel_y,
        angular_accel_z,
        rate_x,
        rate_x_sigma,
        rate_y,
        rate_y_sigma,
        rate_z,
        rate_z_sigma,
        gyro_bias,
        gyro_bias_sigma,
        plain_rate_x,
        plain_rate_y,
        plain_rate_z,
        jd: mode.jd,
        td: mode.td,
        fd: mode.fd,
        yd: mode.yd,
        indicator: mode.indicator,
        mode: mode.mode,
    }
}

#[cfg(test)]
mod tests;
