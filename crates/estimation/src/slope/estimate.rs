//! What the slope estimator puts out.

use drivescope_drive::record;

use super::motion::{MotionNis, Steer};
use super::params::FilterChoice;
use super::{GRAVITY, Slope, grade, motion, pitch};

/// Speed above which a sideslip angle means anything, m/s.
const SIDESLIP_SPEED: f64 = 1.0;

record! {
    /// Motion, effective forces, slope, road grade and body pitch at one instant.
    pub struct SlopeEstimate {
        /// Forward speed (first filter).
        speed: "m/s", truth "vx";
        /// 1-sigma of the forward speed.
        speed_sigma: "m/s", sigma_of "speed";
        /// Lateral speed at the centre of gravity, to the right positive.
        lateral_speed: "m/s", truth "vy";
        /// 1-sigma of the lateral speed.
        lateral_speed_sigma: "m/s", sigma_of "lateral_speed";
        /// Yaw rate.
        yaw_rate: "rad/s", truth "gyro_z";
        /// 1-sigma of the yaw rate.
        yaw_rate_sigma: "rad/s", sigma_of "yaw_rate";
        /// Effective longitudinal force, front axle: what the accelerometer feels; drag, rolling resistance and rear braking are inside, so it is not the tyre force.
        force_xf: "N";
        /// 1-sigma of the effective longitudinal force.
        force_xf_sigma: "N", sigma_of "force_xf";
        /// Lateral force of the front axle.
        force_yf: "N", truth "force_yf";
        /// 1-sigma of the front lateral force.
        force_yf_sigma: "N", sigma_of "force_yf";
        /// Lateral force of the rear axle.
        force_yr: "N", truth "force_yr";
        /// 1-sigma of the rear lateral force.
        force_yr_sigma: "N", sigma_of "force_yr";
        /// Forward specific force from the estimated forces: the accelerometer without its noise.
        accel_x_estimated: "m/s^2", truth "specific_force_x";
        /// 1-sigma of the forward specific force.
        accel_x_estimated_sigma: "m/s^2", sigma_of "accel_x_estimated";
        /// Forward acceleration over ground: specific force less gravity along the slope.
        accel_x_net: "m/s^2", truth "accel_net";
        /// 1-sigma of the acceleration over ground, were the errors of force and slope independent.
        accel_x_net_sigma: "m/s^2", sigma_of "accel_x_net";
        /// Slope of the body, uphill positive: road grade plus pitch of the body on its suspension.
        slope: "rad", truth "pitch";
        /// 1-sigma of the slope.
        slope_sigma: "rad", sigma_of "slope";
        /// Grade of the road, uphill positive.
        grade: "rad", truth "grade";
        /// 1-sigma of the road grade.
        grade_sigma: "rad", sigma_of "grade";
        /// Pitch of the body on its suspension, nose up positive.
        body_pitch: "rad", truth "body_pitch";
        /// 1-sigma of the body pitch.
        body_pitch_sigma: "rad", sigma_of "body_pitch";
        /// Rate of the body pitch.
        body_pitch_rate: "rad/s";
        /// 1-sigma of the body pitch rate.
        body_pitch_rate_sigma: "rad/s", sigma_of "body_pitch_rate";
        /// Bias of the forward accelerometer; without barometer or GNSS it cannot be told from a constant grade.
        accel_bias: "m/s^2";
        /// 1-sigma of the accelerometer bias.
        accel_bias_sigma: "m/s^2", sigma_of "accel_bias";
        /// Altitude in the barometer's datum; without a barometer the GNSS height, without either the height above the start.
        altitude: "m";
        /// 1-sigma of the altitude.
        altitude_sigma: "m", sigma_of "altitude";
        /// Sideslip at the centre of gravity above 1 m/s.
        sideslip: "rad", truth "sideslip";
        /// 1-sigma of the sideslip.
        sideslip_sigma: "rad", sigma_of "sideslip";
        /// Normalized innovation squared of the wheel speed, first filter.
        /// Below 1 where the sensor is better than its sigma, whose default fits the sensors of stability control.
        wheel_nis: "1", nis 1;
        /// Normalized innovation squared of the yaw gyro, after the wheel speed.
        /// Below 1 where the sensor is better than its sigma, whose default fits the sensors of stability control.
        gyro_nis: "1", nis 1;
        /// Normalized innovation squared of the forward accelerometer, after wheel speed and gyro.
        /// Below 1 where the sensor is better than its sigma, whose default fits the sensors of stability control.
        accel_x_nis: "1", nis 1;
        /// Normalized innovation squared of the lateral accelerometer, after wheel speed, gyro and forward accelerometer.
        /// Below 1 where the sensor is better than its sigma, whose default fits the sensors of stability control.
        accel_y_nis: "1", nis 1;
        /// Normalized innovation squared of the wheel speed, second filter.
        /// Below 1 where the sensor is better than its sigma, whose default fits the sensors of stability control.
        ekf2_wheel_nis: "1", nis 1;
        /// Normalized innovation squared of the wheel speed, grade filter.
        /// Below 1 where the sensor is better than its sigma, whose default fits the sensors of stability control.
        grade_wheel_nis: "1", nis 1;
        /// Normalized innovation squared of the barometric altitude.
        /// Below 1 where the sensor is better than its sigma, whose default fits the sensors of stability control.
        baro_nis: "1", nis 1;
        /// Normalized innovation squared of the GNSS height, where there is no barometer.
        /// Far below 1 where the receiver's error is slow: it is taken for white.
        gnss_height_nis: "1", nis 1;
        /// Normalized innovation squared of the GNSS vertical velocity.
        /// Below 1 where the sensor is better than its sigma, whose default fits the sensors of stability control.
        gnss_nis: "1", nis 1;
    }
}

/// Normalized innovations squared of one epoch.
pub(super) struct Nis {
    pub(super) motion: MotionNis,
    pub(super) pitch_wheel: f64,
    pub(super) grade_wheel: f64,
    pub(super) altitude: f64,
    pub(super) height: f64,
    pub(super) upward: f64,
}

impl Nis {
    pub(super) const NONE: Self = Self {
        motion: MotionNis { wheel: f64::NAN, yaw_rate: f64::NAN, accel_x: f64::NAN, accel_y: f64::NAN },
        pitch_wheel: f64::NAN,
        grade_wheel: f64::NAN,
        altitude: f64::NAN,
        height: f64::NAN,
        upward: f64::NAN,
    };
}

impl Slope {
    /// The estimate as the filters stand.
    pub(super) fn estimate(&self, nis: &Nis) -> SlopeEstimate {
        let (m, g) = (&self.motion, &self.grade);
        let sigma_m = |i: usize| m.p[(i, i)].sqrt();
        let sigma_g = |i: usize| g.p[(i, i)].sqrt();
        let (speed, lateral) = (m.x[motion::SPEED], m.x[motion::LATERAL_SPEED]);
        let is_moving = speed > SIDESLIP_SPEED;
        let (slope, slope_variance) = match self.params.filter {
            FilterChoice::Cascade => (self.pitch.x[pitch::SLOPE], self.pitch.p[(pitch::SLOPE, pitch::SLOPE)]),
            FilterChoice::Single => (m.x[motion::SLOPE], m.p[(motion::SLOPE, motion::SLOPE)]),
        };
        let (accel_x, accel_x_sigma) = m.specific_force(Steer::new(self.steer));
        SlopeEstimate {
            speed,
            speed_sigma: sigma_m(motion::SPEED),
            lateral_speed: lateral,
            lateral_speed_sigma: sigma_m(motion::LATERAL_SPEED),
            yaw_rate: m.x[motion::YAW_RATE],
            yaw_rate_sigma: sigma_m(motion::YAW_RATE),
            force_xf: m.x[motion::FORCE_XF],
            force_xf_sigma: sigma_m(motion::FORCE_XF),
            force_yf: m.x[motion::FORCE_YF],
            force_yf_sigma: sigma_m(motion::FORCE_YF),
            force_yr: m.x[motion::FORCE_YR],
            force_yr_sigma: sigma_m(motion::FORCE_YR),
            accel_x_estimated: accel_x,
            accel_x_estimated_sigma: accel_x_sigma,
            accel_x_net: accel_x - GRAVITY * slope.sin(), // (5)
            accel_x_net_sigma: (accel_x_sigma.powi(2) + (GRAVITY * slope.cos()).powi(2) * slope_variance).sqrt(),
            slope,
            slope_sigma: slope_variance.sqrt(),
            grade: g.x[grade::GRADE],
            grade_sigma: sigma_g(grade::GRADE),
            body_pitch: g.x[grade::BODY_PITCH],
            body_pitch_sigma: sigma_g(grade::BODY_PITCH),
            body_pitch_rate: g.x[grade::BODY_PITCH_RATE],
            body_pitch_rate_sigma: sigma_g(grade::BODY_PITCH_RATE),
            accel_bias: g.x[grade::ACCEL_BIAS],
            accel_bias_sigma: sigma_g(grade::ACCEL_BIAS),
            altitude: g.x[grade::ALTITUDE],
            altitude_sigma: sigma_g(grade::ALTITUDE),
            sideslip: if is_moving { lateral.atan2(speed) } else { f64::NAN },
            sideslip_sigma: if is_moving { m.sideslip_sigma() } else { f64::NAN },
            wheel_nis: nis.motion.wheel,
            gyro_nis: nis.motion.yaw_rate,
            accel_x_nis: nis.motion.accel_x,
            accel_y_nis: nis.motion.accel_y,
            ekf2_wheel_nis: nis.pitch_wheel,
            grade_wheel_nis: nis.grade_wheel,
            baro_nis: nis.altitude,
            gnss_height_nis: nis.height,
            gnss_nis: nis.upward,
        }
    }
}
