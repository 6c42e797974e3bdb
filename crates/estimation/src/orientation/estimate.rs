//! What the orientation estimator puts out.

use drivescope_drive::record;

record! {
    /// Attitude of the body and what the magnetic field says of itself, at one instant.
    pub struct OrientationEstimate {
        /// Roll of the body, right side down positive.
        roll: "rad", truth "roll";
        /// 1-sigma of roll; none in variants without a covariance.
        roll_sigma: "rad", sigma_of "roll";
        /// Pitch of the body, nose up positive.
        pitch: "rad", truth "pitch";
        /// 1-sigma of pitch.
        pitch_sigma: "rad", sigma_of "pitch";
        /// Yaw of the body, clockwise from true north.
        yaw: "rad", truth "yaw";
        /// 1-sigma of yaw.
        yaw_sigma: "rad", sigma_of "yaw";
        /// Roll of the body against the road; road filters only.
        suspension_roll: "rad", truth "suspension_roll";
        /// 1-sigma of the suspension's roll.
        suspension_roll_sigma: "rad", sigma_of "suspension_roll";
        /// Pitch of the body against the road; road filters only.
        suspension_pitch: "rad", truth "suspension_pitch";
        /// 1-sigma of the suspension's pitch.
        suspension_pitch_sigma: "rad", sigma_of "suspension_pitch";
        /// Bank of the road, right side down positive; road filters only.
        road_bank: "rad", truth "bank";
        /// 1-sigma of the bank.
        road_bank_sigma: "rad", sigma_of "road_bank";
        /// Grade of the road, uphill positive; road filters only.
        road_grade: "rad", truth "grade";
        /// 1-sigma of the grade.
        road_grade_sigma: "rad", sigma_of "road_grade";
        /// Bias of the yaw gyro; road filters only.
        gyro_bias: "rad/s", truth "gyro_bias_z";
        /// 1-sigma of the gyro bias.
        gyro_bias_sigma: "rad/s", sigma_of "gyro_bias";
        /// Sideslip: course less yaw, where a course arrives and the speed is above 3 m/s.
        sideslip: "rad", truth "sideslip";
        /// 1-sigma of the sideslip, from those of yaw and course.
        sideslip_sigma: "rad", sigma_of "sideslip";
        /// Whether the car goes straight and steadily: 1 or 0.
        is_static: "1";
        /// Strength of the measured field less that of the reference.
        field_norm_error: "uT";
        /// Angle of the measured field below the horizontal less that of the reference.
        dip_error: "rad";
        /// Normalized innovation squared of the magnetic field; none where the filter did not use it. Mostly below 1: the sigma is
        /// larger than a good sensor's noise. At times far above 1 in the paper's variants, whose model knows neither grade nor bank.
        field_nis: "1", nis 3;
        /// What was made of the magnetic field: 0 used, 1 used with less weight, 2 left out, 3 believed again after long doubt.
        gate: "1";
        /// Why a field was left out: 1 strength, 2 dip, 3 it does not fit the attitude, 4 one of them a moment ago; 0 it was not.
        gate_reason: "1";
        /// Normalized innovation squared of the lateral acceleration; road filters only. Below 1 where the accelerometer is better than
        /// that of stability control. Even with noise exactly as stated its mean is 0.986: the model gives what neither turn nor
        /// road explains 3 % more variance than it has.
        lateral_nis: "1", nis 1;
    }
}

impl OrientationEstimate {
    /// No value in any column.
    pub(super) fn blank() -> Self {
        drivescope_drive::channel::Record::read(|_| f64::NAN)
    }
}
