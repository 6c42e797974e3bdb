//! Tuning of the orientation estimator.

use drivescope_drive::{choice, params};

choice! {
    /// Which filter turns the vectors and rates into an attitude.
    pub enum Variant {
        /// The road filter behind a gate that leaves disturbed magnetic fields out.
        Robust = "robust",
        /// The robust filter with the forward accelerometer, which knows the grade where the field is disturbed.
        RobustAx = "robust_ax",
        /// Kalman filter that also estimates bank and grade of the road and the bias of the yaw gyro; believes every field.
        Road = "road",
        /// The paper's: static attitude from field and pseudo gravity while the car goes straight and steadily, suspension filter otherwise.
        Switch = "switch",
        /// Static attitude from field and pseudo gravity at every sample; wrong while the car turns.
        Triad = "triad",
        /// Kalman filter on field and yaw rate with the suspension's springs as roll and pitch model.
        EkfModel = "ekf_model",
        /// Kalman filter on field and yaw rate alone; roll and pitch are random walks.
        EkfNoModel = "ekf_nomodel",
        /// Suspension and yaw rate alone, open loop; knows neither bank nor grade.
        Model = "model",
    }
}

choice! {
    /// Where the forward specific force that pitches the body comes from.
    pub enum PitchForce {
        /// From the change of speed and the estimated pitch.
        Derived = "derived",
        /// From the forward accelerometer.
        Sensor = "sensor",
        /// Not at all.
        None = "none",
    }
}

choice! {
    /// Where the Earth's field that the measured one is compared with comes from.
    pub enum FieldModel {
        /// From the World Magnetic Model at the log's place and date; the three numbers where one of them is changed, or where the log has no place.
        Auto = "auto",
        /// From the three numbers.
        Given = "given",
    }
}

params! {
    /// Filter, reference field, noise and the detector of straight steady driving.
    pub struct OrientationParams {
        /// Which filter.
        variant (""): choice Variant, from "ours: the best over the built-in drives; all need the same signals";
        /// Earth's field to the north at the place of the drive.
        field_north ("H_n"): number = 30.11237, "uT", -80.0 ..= 80.0 Linear, from "WMM2015v2 at 2016.2, Daejeon";
        /// Earth's field to the east.
        field_east ("H_e"): number = -4.22703, "uT", -80.0 ..= 80.0 Linear, from "WMM2015v2 at 2016.2, Daejeon";
        /// Earth's field downward.
        field_down ("H_d"): number = 40.12585, "uT", -80.0 ..= 80.0 Linear, from "WMM2015v2 at 2016.2, Daejeon";
        /// Where the Earth's field that the measured one is compared with comes from.
        field_model (""): choice FieldModel, from "ours";
        /// Decimal year of the World Magnetic Model; none takes the log's date, or 2026.0 where the log has none.
        field_year (""): optional, "1", 2015.0 ..= 2030.0, from "none: the log's date";
        /// Latitude of the World Magnetic Model; none takes the log's first place.
        field_latitude (""): optional, "rad", -1.58 ..= 1.58, from "none: the log's place";
        /// Longitude of the World Magnetic Model, with its latitude.
        field_longitude (""): optional, "rad", -3.15 ..= 3.15, from "none: the log's place";
        /// Error of each magnetometer axis; larger trusts the gyro and the springs more.
        field_sigma ("s_mag"): number = 0.6, "uT", 0.1 ..= 10.0 Log, from "SPEC orientation 4";
        /// Random walk of roll; larger follows the field more.
        roll_walk ("s_phi"): number = 2.0_f64.to_radians(), "rad/sqrt(s)", 0.0034 ..= 1.75 Log, from "SPEC orientation 4 (2 deg/sqrt(s))";
        /// Random walk of pitch; larger follows the field more.
        pitch_walk ("s_theta"): number = 2.0_f64.to_radians(), "rad/sqrt(s)", 0.0034 ..= 1.75 Log, from "SPEC orientation 4 (2 deg/sqrt(s))";
        /// Random walk of yaw; larger follows the field more.
        yaw_walk ("s_psi"): number = 0.3_f64.to_radians(), "rad/sqrt(s)", 0.00017 ..= 0.088 Log, from "SPEC orientation 4 (0.3 deg/sqrt(s))";
        /// Where the forward specific force that pitches the body comes from.
        pitch_force (""): choice PitchForce, from "SPEC orientation 6";
        /// Use the rates as the paper prints them, for comparison.
        printed_rates (""): toggle = false, from "SPEC orientation 6";
        /// Yaw rate below which driving may count as static.
        static_yaw_rate ("r_in"): number = 0.020, "rad/s", 0.002 ..= 0.2 Log, from "SPEC orientation 4";
        /// Yaw rate above which driving stops being static.
        dynamic_yaw_rate ("r_out"): number = 0.035, "rad/s", 0.002 ..= 0.2 Log, from "SPEC orientation 4";
        /// Speed times yaw rate below which driving may count as static.
        static_lateral ("a_in"): number = 0.35, "m/s^2", 0.05 ..= 3.0 Log, from "SPEC orientation 4";
        /// Speed times yaw rate above which driving stops being static.
        dynamic_lateral ("a_out"): number = 0.70, "m/s^2", 0.05 ..= 3.0 Log, from "SPEC orientation 4";
        /// Change of speed below which driving may count as static.
        static_forward ("ax_in"): number = 0.5, "m/s^2", 0.1 ..= 5.0 Log, from "SPEC orientation 4";
        /// Change of speed above which driving stops being static.
        dynamic_forward ("ax_out"): number = 1.0, "m/s^2", 0.1 ..= 5.0 Log, from "SPEC orientation 4";
        /// How long driving has to be calm before it counts as static.
        static_dwell ("dwell"): number = 0.5, "s", 0.0 ..= 5.0 Linear, from "SPEC orientation 4";
        /// Noise of the course over ground; only widens the sigma of the sideslip.
        course_sigma ("s_chi"): number = 0.2_f64.to_radians(), "rad", 0.0001 ..= 0.2 Log, from "SPEC orientation 4 (0.2 deg)";
        /// Random walk of the road's bank; larger lets the bank change faster.
        bank_walk ("s_bank"): number = 4.0_f64.to_radians(), "rad/sqrt(s)", 0.0034 ..= 0.35 Log, from "SPEC orientation 4 (4 deg/sqrt(s))";
        /// Random walk of the road's grade; larger lets the grade change faster.
        grade_walk ("s_grade"): number = 2.0_f64.to_radians(), "rad/sqrt(s)", 0.0034 ..= 0.35 Log, from "SPEC orientation 4 (2 deg/sqrt(s))";
        /// Time in which an unobserved bank falls back to level; larger remembers it longer.
        bank_time ("tau_bank"): number = 60.0, "s", 5.0 ..= 100000.0 Log, from "SPEC orientation 4";
        /// Time in which an unobserved grade falls back to level; larger remembers it longer.
        grade_time ("tau_grade"): number = 60.0, "s", 5.0 ..= 100000.0 Log, from "SPEC orientation 4";
        /// Random walk of yaw in the road filters; larger follows the field more.
        road_yaw_walk ("s_psi_road"): number = 0.15_f64.to_radians(), "rad/sqrt(s)", 0.00017 ..= 0.088 Log, from "SPEC orientation 4 (0.15 deg/sqrt(s))";
        /// Random walk of the body's roll and pitch rates against the road; larger trusts the springs less.
        suspension_walk ("s_susp"): number = 0.15, "rad/s/sqrt(s)", 0.0 ..= 2.0 Linear, from "SPEC orientation 4";
        /// Random walk of the yaw gyro's bias; larger follows faster.
        gyro_bias_walk ("s_bias"): number = 0.003_f64.to_radians(), "rad/s/sqrt(s)", 0.000001 ..= 0.001 Log, from "SPEC orientation 4 (0.003 deg/s/sqrt(s))";
        /// Yaw-gyro bias at the start, 1-sigma; larger learns it faster.
        gyro_bias_start ("p_bias"): number = 0.3_f64.to_radians(), "rad/s", 0.0001 ..= 0.05 Log, from "SPEC orientation 4 (0.3 deg/s)";
        /// Correlation time of lateral acceleration that neither turn nor road explains; larger lets it last.
        mismatch_time ("tau_d"): number = 0.30, "s", 0.05 ..= 2.0 Log, from "SPEC orientation 4";
        /// Size of lateral acceleration that neither turn nor road explains; larger reads less bank into it.
        mismatch_sigma ("s_d"): number = 0.4, "m/s^2", 0.1 ..= 3.0 Log, from "SPEC orientation 4";
        /// Error of the lateral accelerometer; larger trusts the field more.
        lateral_sigma ("s_lat"): number = 0.15, "m/s^2", 0.05 ..= 2.0 Log, from "SPEC orientation 4";
        /// What a turn does to bank and grade: 0 the road turns with the car, 1 the car turns on a fixed plane.
        turn_share ("lam"): number = 0.5, "1", 0.0 ..= 1.0 Linear, from "SPEC orientation 4";
        /// Slip stiffness of the rear axle over its load; larger means less slip when the turn changes.
        rear_slip_stiffness ("K_r"): number = 20.0, "1/rad", 8.0 ..= 40.0 Linear, from "SPEC orientation 4";
        /// Error of the field's strength above which it counts less.
        gate_norm_soft ("n_soft"): number = 1.5, "uT", 0.5 ..= 20.0 Log, from "SPEC orientation 4";
        /// Error of the field's strength above which it is left out.
        gate_norm_hard ("n_hard"): number = 5.0, "uT", 0.5 ..= 20.0 Log, from "SPEC orientation 4";
        /// Error of the field's dip above which it is left out.
        gate_dip_hard ("dip_hard"): number = 6.0_f64.to_radians(), "rad", 0.0174 ..= 0.524 Log, from "SPEC orientation 4 (6 deg)";
        /// Normalized innovation squared above which a field counts less.
        gate_nis_soft ("nis_soft"): number = 11.34, "1", 1.0 ..= 200.0 Log, from "SPEC orientation 4 (99 % of chi-square with 3 degrees of freedom)";
        /// Normalized innovation squared above which a field is left out.
        gate_nis_hard ("nis_hard"): number = 40.0, "1", 3.0 ..= 1000.0 Log, from "SPEC orientation 4";
        /// Mean over 0.2 s of how badly the field's direction fits (normalized innovation squared less the strength's part, 2 is normal) above which it is left out.
        gate_direction ("nis_dir"): number = 6.0, "1", 2.0 ..= 1000.0 Log, from "ours: three times what is normal";
        /// How far back fields are not believed in hindsight when the gate shuts; 0 believes them.
        gate_hindsight ("back"): number = 0.5, "s", 0.0 ..= 5.0 Linear, from "ours: a girder's field grows for half a second";
        /// How long fields are left out after a strange one.
        gate_hold ("hold"): number = 0.6, "s", 0.0 ..= 5.0 Linear, from "SPEC orientation 4";
        /// After how long a field that is strange, but of the right strength, is believed again.
        gate_recovery ("rec_time"): number = 25.0, "s", 5.0 ..= 120.0 Log, from "SPEC orientation 4";
        /// Error of the forward accelerometer against the change of speed, a sample; it is coloured, so that this is large.
        forward_sigma ("s_lon"): number = 2.0, "m/s^2", 0.2 ..= 5.0 Log, from "SPEC orientation 4";
    }
}
