//! Tuning of the slope estimator.

use drivescope_drive::vehicle::VehicleParams;
use drivescope_drive::{choice, params};

choice! {
    /// How speed, forces and slope are estimated; the grade filter follows either.
    pub enum FilterChoice {
        /// The paper's two filters, one for motion and forces and one for the slope.
        Cascade = "cascade",
        /// One filter of seven states that has the slope among them, for comparison.
        Single = "single",
    }
}

params! {
    /// Noise, sensors, pitch model and aids of the three filters.
    pub struct SlopeParams {
        /// The paper's cascade, or one filter for everything.
        filter (""): choice FilterChoice, from "Kim, Kim & Lee 2014; SPEC slope 6";
        /// At the end of the drive look back over it: speed, grade and altitude from both directions of time, without lag.
        two_way (""): toggle = false, from "ours: a filter that only looks forward is the specification's";
        /// Model noise of the forward speed in the first filter; larger follows the wheels more.
        speed_walk ("q_vx"): number = 0.10, "m/s/sqrt(s)", 0.01 ..= 1.0 Log, from "SPEC slope 5";
        /// Model noise of the lateral speed in the first filter; larger trusts the rear-axle aid more.
        lateral_speed_walk ("q_vy"): number = 0.10, "m/s/sqrt(s)", 0.01 ..= 1.0 Log, from "SPEC slope 5";
        /// Model noise of the yaw rate in the first filter; larger follows the gyro more.
        yaw_rate_walk ("q_r"): number = 0.05, "rad/s/sqrt(s)", 0.005 ..= 0.5 Log, from "SPEC slope 5";
        /// Random walk of each tyre force; smaller smooths the forces and the acceleration and delays the slope.
        force_walk ("q_f"): number = 3000.0, "N/sqrt(s)", 300.0 ..= 30000.0 Log, from "SPEC slope 5";
        /// Error of the wheel speed in the first filter.
        wheel_sigma ("s_vx"): number = 0.06, "m/s", 0.01 ..= 0.5 Log, from "SPEC slope 5";
        /// Error of the yaw gyro.
        yaw_rate_sigma ("s_r"): number = 0.006, "rad/s", 0.001 ..= 0.05 Log, from "SPEC slope 5";
        /// Error of the forward accelerometer.
        accel_x_sigma ("s_ax"): number = 0.25, "m/s^2", 0.05 ..= 1.0 Log, from "SPEC slope 5; table 3 of the paper suggests 0.23";
        /// Error of the lateral accelerometer.
        accel_y_sigma ("s_ay"): number = 0.25, "m/s^2", 0.05 ..= 1.0 Log, from "SPEC slope 5; table 3 of the paper suggests 0.23";
        /// Use that the rear axle hardly slides; off is the paper's filter, whose lateral speed drifts on a straight road.
        rear_axle_aid ("vy_aid"): toggle = true, from "SPEC slope 3";
        /// Lateral speed of the rear axle that the aid allows.
        rear_axle_sigma ("s_vy"): number = 0.30, "m/s", 0.05 ..= 2.0 Log, from "SPEC slope 5";
        /// Trust the wheel speed less while front and rear wheels disagree more than they lately did: an axle jumps over a bump.
        axle_check (""): toggle = true, from "ours; does nothing for a log with one speed";
        /// Grade filter: trust the wheel speed less while a bump shakes the body up and down by more than 2 m/s^2.
        shake_check (""): toggle = true, from "ours; does nothing on the specification's cases";
        /// Constant offset of the forward accelerometer, taken off before everything: its bias and the pitch of its mount times gravity.
        accel_offset ("a_0"): number = 0.0, "m/s^2", -3.0 ..= 3.0 Linear, from "ours: none unless found";
        /// How late the wheel speed comes; the inertial sensor is delayed to match, and with it every estimate.
        wheel_latency ("tau"): number = 0.0, "s", 0.0 ..= 0.3 Linear, from "SPEC slope 6";
        /// Give the slope of the second filter back to the first one; off, the first one assumes a level road.
        slope_feedback ("feedback"): toggle = true, from "SPEC slope 3";
        /// Model noise of the speed in the second filter.
        slope_speed_walk ("q2_v"): number = 0.05, "m/s/sqrt(s)", 0.005 ..= 0.5 Log, from "SPEC slope 5";
        /// Random walk of the slope; larger follows faster (lag 0.31 s at 0.02, 0.08 s at 0.15) and is noisier.
        slope_walk ("q2_th"): number = 0.04, "rad/sqrt(s)", 0.005 ..= 0.3 Log, from "SPEC slope 5";
        /// Error of the wheel speed in the second filter.
        slope_wheel_sigma ("s2_v"): number = 0.06, "m/s", 0.01 ..= 0.5 Log, from "SPEC slope 5";
        /// Speed below which wheel pulses get sparse and the error of the wheel speed rises.
        low_speed ("v_low"): number = 1.0, "m/s", 0.3 ..= 3.0 Linear, from "SPEC slope 6";
        /// Factor on the error of the wheel speed at standstill.
        low_speed_gain ("low_gain"): number = 5.0, "1", 1.0 ..= 20.0 Linear, from "SPEC slope 6";
        /// Static squat of the body per unit of forward specific force; 0 puts all body pitch into the grade.
        squat_gain ("k_pitch"): number = 0.0050, "rad/(m/s^2)", 0.0 ..= 0.02 Linear, from "SPEC slope 7 (2.8 deg/g)";
        /// Natural frequency of the body's pitch on its suspension.
        pitch_frequency ("w0"): number = 8.3, "rad/s", 4.0 ..= 15.0 Linear, from "SPEC slope 7";
        /// Damping ratio of the body's pitch.
        pitch_damping_ratio ("z"): number = 0.30, "1", 0.05 ..= 1.0 Linear, from "SPEC slope 7";
        /// Model noise of the speed in the grade filter.
        grade_speed_walk ("q3_v"): number = 0.05, "m/s/sqrt(s)", 0.005 ..= 0.5 Log, from "SPEC slope 7";
        /// Random walk of the road grade over distance; larger follows hills faster.
        grade_walk_distance ("q3_s"): number = 0.010, "rad/sqrt(m)", 0.001 ..= 0.1 Log, from "SPEC slope 7";
        /// Random walk of the road grade over time, also of a standing car.
        grade_walk_time ("q3_t"): number = 0.0005, "rad/sqrt(s)", 0.00005 ..= 0.005 Log, from "SPEC slope 7";
        /// Model noise of the body's pitch rate: bumps and other causes than squat.
        body_pitch_walk ("q3_p"): number = 0.02, "rad/s/sqrt(s)", 0.002 ..= 0.2 Log, from "SPEC slope 7";
        /// Random walk of the forward accelerometer's bias.
        accel_bias_walk ("q3_b"): number = 0.002, "m/s^2/sqrt(s)", 0.0002 ..= 0.02 Log, from "SPEC slope 7";
        /// Random walk of the altitude beside what speed and grade explain: weather in the barometer.
        altitude_walk ("q3_h"): number = 0.03, "m/sqrt(s)", 0.003 ..= 0.3 Log, from "SPEC slope 7";
        /// Error of the wheel speed in the grade filter.
        grade_wheel_sigma ("s3_v"): number = 0.06, "m/s", 0.01 ..= 0.5 Log, from "SPEC slope 7";
        /// Use the barometer where the drive has one.
        use_baro (""): toggle = true, from "SPEC slope 7";
        /// Error of the barometric altitude.
        baro_sigma ("s3_h"): number = 0.30, "m", 0.03 ..= 3.0 Log, from "SPEC slope 7";
        /// Use the GNSS vertical velocity where the drive has one.
        use_gnss (""): toggle = true, from "SPEC slope 7";
        /// Error of the GNSS vertical velocity.
        gnss_sigma ("s3_vd"): number = 0.12, "m/s", 0.012 ..= 1.2 Log, from "SPEC slope 7";
        /// Use the GNSS height where the drive has no barometer; it helps once the offset of the accelerometer has been found.
        use_gnss_height (""): toggle = false, from "SPEC slope 7 has none; ours for drives without barometer and vertical velocity";
        /// Error of the GNSS height where the receiver states none.
        gnss_height_sigma (""): number = 3.0, "m", 0.1 ..= 30.0 Log, from "placeholder: a receiver of one frequency in the open";
        /// Largest accepted normalized innovation squared of barometer and GNSS.
        aid_gate (""): number = 25.0, "1", 4.0 ..= 1000.0 Log, from "SPEC slope 7";
    }
}

impl SlopeParams {
    /// These parameters with the pitch of a car: static squat, frequency and damping from its springs, each inside its range.
    ///
    /// Squat is sprung mass times its arm over the pitch stiffness. The defaults are the specification's, for no certain car.
    pub fn with_pitch_of(&self, vehicle: &VehicleParams) -> Self {
        let (stiffness, inertia) = (vehicle.pitch_stiffness, vehicle.pitch_inertia);
        Self {
            squat_gain: (vehicle.sprung_mass * vehicle.sprung_cg_arm / stiffness).clamp(0.0, 0.02),
            pitch_frequency: (stiffness / inertia).sqrt().clamp(4.0, 15.0),
            pitch_damping_ratio: (0.5 * vehicle.pitch_damping / (stiffness * inertia).sqrt()).clamp(0.05, 1.0),
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::param::Params;

    #[test]
    fn the_pitch_of_every_named_car_is_inside_the_ranges() {
        for preset in drivescope_drive::vehicle::PRESETS {
            let vehicle = VehicleParams::preset(preset.name).unwrap();
            SlopeParams::default().with_pitch_of(&vehicle).validate().unwrap();
        }
        let saloon = SlopeParams::default().with_pitch_of(&VehicleParams::preset("saloon").unwrap());
        // 1560 kg on 0.45 m over 210 kN m/rad; 210 kN m/rad over 2900 kg m^2.
        assert!((saloon.squat_gain - 0.003343).abs() < 1e-6 && (saloon.pitch_frequency - 8.510).abs() < 1e-3);
    }
}
