//! What a closed loop writes down.

use drivescope_drive::record;

record! {
    /// The car and its yaw-moment controller, at every sample.
    pub struct LoopRow {
        /// True place, north of the start.
        north: "m", truth "n";
        /// True place, east of the start.
        east: "m", truth "e";
        /// True yaw.
        yaw: "rad", truth "yaw";
        /// True forward speed.
        speed: "m/s", truth "vx";
        /// True speed to the right.
        lateral_speed: "m/s", truth "vy";
        /// True yaw rate.
        yaw_rate: "rad/s", truth "yaw_rate";
        /// Sideslip of the centre of gravity.
        sideslip: "rad";
        /// Acceleration to the right.
        lateral_acceleration: "m/s^2";
        /// Angle of the front wheels.
        steer: "rad";
        /// Place north of the start as the controllers know it.
        known_north: "m", truth "n";
        /// Place east of the start as the controllers know it.
        known_east: "m", truth "e";
        /// Yaw as the controllers know it.
        known_yaw: "rad", truth "yaw";
        /// Distance to the sliding surface.
        surface: "rad/s";
        /// Yaw rate that is followed.
        yaw_rate_reference: "rad/s";
        /// Yaw moment that would hold the surface if the model were right.
        moment_equivalent: "N m";
        /// Gain of the switching part.
        switching_gain: "rad/s^2";
        /// Yaw moment asked for.
        moment_command: "N m";
        /// Yaw moment that the brakes give.
        moment: "N m";
        /// Brake force of the front left wheel.
        brake_fl: "N";
        /// Brake force of the front right wheel.
        brake_fr: "N";
        /// Brake force of the rear left wheel.
        brake_rl: "N";
        /// Brake force of the rear right wheel.
        brake_rr: "N";
    }
}

record! {
    /// What guidance saw and chose, at every decision.
    pub struct GuidanceRow {
        /// Offset of the car to the right of the path.
        cross_track: "m";
        /// Distance from the car's place to the nearest edge of an obstacle.
        clearance: "m";
        /// Point that is steered for, north of the start.
        target_north: "m";
        /// Point that is steered for, east of the start.
        target_east: "m";
        /// Direction that is steered into, clockwise from true north.
        chosen_direction: "rad";
        /// 0: the way to the target is free; 1: round an obstacle; 2: no way, stop.
        avoiding: "1";
        /// Angle of the wheels that is asked for.
        steer_command: "rad";
        /// Axis 1 of the ring, from left to right; 4 m is no echo.
        range_1: "m";
        /// Axis 2.
        range_2: "m";
        /// Axis 3.
        range_3: "m";
        /// Axis 4.
        range_4: "m";
        /// Axis 5.
        range_5: "m";
        /// Axis 6.
        range_6: "m";
        /// Axis 7.
        range_7: "m";
        /// Axis 8.
        range_8: "m";
        /// Axis 9.
        range_9: "m";
        /// Axis 10.
        range_10: "m";
        /// Axis 11.
        range_11: "m";
        /// Axis 12.
        range_12: "m";
    }
}

/// Number of columns before the ranges.
pub(super) const RANGES_AT: usize = 7;
