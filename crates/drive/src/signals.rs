//! What is measured: one record per sensor, with the canonical column names of files.

use crate::record;

record! {
    /// Inertial sample in the body frame (FRD); a field is NaN where the sensor does not exist.
    pub struct Imu {
        /// Forward specific force.
        accel_x: "m/s^2";
        /// Rightward specific force.
        accel_y: "m/s^2";
        /// Downward specific force; level and at rest -9.80665.
        accel_z: "m/s^2";
        /// Roll rate of the body.
        gyro_x: "rad/s";
        /// Pitch rate of the body.
        gyro_y: "rad/s";
        /// Yaw rate of the body, to the right positive.
        gyro_z: "rad/s";
    }
}
record! {
    /// Magnetic field in the body frame (FRD).
    pub struct Mag {
        /// Forward component.
        mag_x: "uT";
        /// Rightward component.
        mag_y: "uT";
        /// Downward component.
        mag_z: "uT";
    }
}
record! {
    /// Speeds that the car reports.
    pub struct Wheels {
        /// Signed forward speed that the car reports.
        speed: "m/s";
        /// Speed of the front left wheel's rim.
        wheel_speed_fl: "m/s";
        /// Speed of the front right wheel's rim.
        wheel_speed_fr: "m/s";
        /// Speed of the rear left wheel's rim.
        wheel_speed_rl: "m/s";
        /// Speed of the rear right wheel's rim.
        wheel_speed_rr: "m/s";
    }
}
record! {
    /// Steering angles, to the right positive.
    pub struct Steering {
        /// Angle of the road wheels.
        steer: "rad";
        /// Angle of the steering wheel.
        steering_wheel: "rad";
    }
}
record! {
    /// A satellite fix: geodetic or local position, velocity, course, and what the receiver says of them.
    pub struct Gnss {
        /// Latitude.
        lat: "rad", name "gnss_lat";
        /// Longitude.
        lon: "rad", name "gnss_lon";
        /// Height above the ellipsoid.
        alt: "m", name "gnss_alt";
        /// North of the log's own local origin.
        north: "m", name "gnss_n";
        /// East of the log's own local origin.
        east: "m", name "gnss_e";
        /// Below the log's own local origin.
        down: "m", name "gnss_d";
        /// Velocity to the north.
        v_north: "m/s", name "gnss_vn";
        /// Velocity to the east.
        v_east: "m/s", name "gnss_ve";
        /// Velocity downward.
        v_down: "m/s", name "gnss_vd";
        /// Speed over ground.
        speed: "m/s", name "gnss_speed";
        /// Course over ground, clockwise from true north.
        course: "rad";
        /// 1-sigma of the position to the north, as the receiver states it.
        std_north: "m", name "gnss_std_n";
        /// 1-sigma of the position to the east.
        std_east: "m", name "gnss_std_e";
        /// 1-sigma of the height.
        std_down: "m", name "gnss_std_d";
        /// Satellites used.
        satellites: "1", name "gnss_nsat";
        /// Position dilution of precision.
        pdop: "1", name "gnss_pdop";
        /// 0 where the receiver says that the fix is not to be used.
        valid: "1", name "gnss_valid";
    }
}
record! {
    /// Barometric altitude.
    pub struct Baro {
        /// Altitude.
        altitude: "m", name "baro_alt";
    }
}
record! {
    /// Outputs of a disk of six single-axis accelerometers (1-3 tangential, 4-6 axial).
    pub struct AccelArray {
        /// Tangential accelerometer at azimuth 0.
        acc6_1: "m/s^2";
        /// Tangential accelerometer at azimuth 120 deg.
        acc6_2: "m/s^2";
        /// Tangential accelerometer at azimuth 240 deg.
        acc6_3: "m/s^2";
        /// Axial accelerometer at azimuth 0.
        acc6_4: "m/s^2";
        /// Axial accelerometer at azimuth 120 deg.
        acc6_5: "m/s^2";
        /// Axial accelerometer at azimuth 240 deg.
        acc6_6: "m/s^2";
    }
}
record! {
    /// Distances of an ultrasonic ring, axes from left to right.
    pub struct Range {
        /// Axis 1.
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

impl Wheels {
    /// Forward speed, m/s: what the car reports, else the mean of the rear wheels, else of the front wheels; NaN if none.
    pub fn forward_speed(&self) -> f64 {
        let mean = |a: f64, b: f64| match (a.is_finite(), b.is_finite()) {
            (true, true) => 0.5 * (a + b),
            (true, false) => a,
            _ => b,
        };
        if self.speed.is_finite() {
            return self.speed;
        }
        let rear = mean(self.wheel_speed_rl, self.wheel_speed_rr);
        if rear.is_finite() { rear } else { mean(self.wheel_speed_fl, self.wheel_speed_fr) }
    }
}

impl Gnss {
    /// Whether the receiver lets this fix be used (absent means yes).
    pub fn is_usable(&self) -> bool {
        self.valid != 0.0
    }
    /// Horizontal velocity to the north and east, m/s: stated, else from speed and course; NaN if neither.
    pub fn horizontal_velocity(&self) -> (f64, f64) {
        if self.v_north.is_finite() && self.v_east.is_finite() {
            return (self.v_north, self.v_east);
        }
        (self.speed * self.course.cos(), self.speed * self.course.sin())
    }
    /// Course over ground, rad: stated, else from the velocity when faster than `slowest` m/s; NaN if neither.
    pub fn course_over_ground(&self, slowest: f64) -> f64 {
        if self.course.is_finite() {
            return self.course;
        }
        if self.v_north.hypot(self.v_east) >= slowest { self.v_east.atan2(self.v_north) } else { f64::NAN }
    }
    /// Speed over ground, m/s: stated, else from the velocity; NaN if neither.
    pub fn ground_speed(&self) -> f64 {
        if self.speed.is_finite() { self.speed } else { self.v_north.hypot(self.v_east) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_speed_prefers_what_the_car_says_then_the_rear_axle() {
        let mut w = Wheels { wheel_speed_fl: 9.0, wheel_speed_rl: 1.0, wheel_speed_rr: 2.0, ..Wheels::default() };
        assert_eq!(w.forward_speed(), 1.5);
        w.wheel_speed_rl = f64::NAN;
        assert_eq!(w.forward_speed(), 2.0);
        w.wheel_speed_rr = f64::NAN;
        assert_eq!(w.forward_speed(), 9.0);
        w.speed = -1.0;
        assert_eq!(w.forward_speed(), -1.0);
        assert!(Wheels::default().forward_speed().is_nan());
    }

    #[test]
    fn course_comes_from_velocity_only_when_moving() {
        let g = Gnss { v_north: 0.0, v_east: 2.0, ..Gnss::default() };
        assert!((g.course_over_ground(1.0) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!(g.course_over_ground(3.0).is_nan());
    }
}
