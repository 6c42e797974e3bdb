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
        /// Sideslip: course less yaw, where a course arrives and the speed is above 3 m/s.
        sideslip: "rad", truth "sideslip";
        /// Whether the car goes straight and steadily: 1 or 0.
        is_static: "1";
        /// Strength of the measured field less that of the reference.
        field_norm_error: "uT";
        /// Angle of the measured field below the horizontal less that of the reference.
        dip_error: "rad";
        /// Normalized innovation squared of the magnetic field; none where the filter did not use it. Mostly below 1 and at times
        /// far above: the sigma is larger than the sensor's noise, but the model knows neither grade nor bank.
        field_nis: "1", nis 3;
    }
}
