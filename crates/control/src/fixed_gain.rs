//! Position by dead reckoning, pulled towards each fix by a fixed share: "INS and GPS without EKF" of the paper.
//!
//! Source: SPEC navigation 8. It knows no covariance and no sensor bias; that is its point.

use drivescope_drive::drive::Epoch;
use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::{Geodetic, LocalFrame};

use crate::Pose;

/// Share of the difference to a fix that the position takes.
const POSITION_GAIN: f64 = 0.3;
/// Share of the difference to the course that the heading takes.
const YAW_GAIN: f64 = 0.1;
/// A slower car has no course, m/s.
const SLOWEST_COURSE: f64 = 0.4;
/// Longest time that is carried on over without an inertial sample, s.
const LONGEST_STEP: f64 = 0.5;

/// Dead reckoning with yaw gyro and odometer.
#[derive(Clone, Debug)]
pub struct FixedGain {
    pose: Pose,
    frame: LocalFrame,
    time: Option<f64>,
}

impl FixedGain {
    /// Start from a known pose in the local frame of an origin.
    pub fn new(start: Pose, origin: Geodetic) -> Self {
        Self { pose: start, frame: LocalFrame::new(origin), time: None }
    }

    /// Use an epoch and say where the car is.
    pub fn step(&mut self, epoch: &Epoch) -> Pose {
        if let Some(speed) = epoch.wheels.map(|w| w.forward_speed()).filter(|v| v.is_finite()) {
            self.pose.speed = speed;
        }
        if let Some(rate) = epoch.imu.map(|imu| imu.gyro_z).filter(|v| v.is_finite()) {
            let dt = epoch.time - self.time.unwrap_or(epoch.time);
            if dt > 0.0 && dt <= LONGEST_STEP {
                self.reckon(rate, dt);
            }
            self.pose.yaw_rate = rate;
            self.time = Some(epoch.time);
        }
        if let Some(gnss) = epoch.gnss.filter(|g| g.is_usable()) {
            let place = Geodetic { lat: gnss.lat, lon: gnss.lon, alt: gnss.alt };
            let ned = self.frame.to_ned(place);
            if ned.x.is_finite() && ned.y.is_finite() {
                self.pose.north += POSITION_GAIN * (ned.x - self.pose.north);
                self.pose.east += POSITION_GAIN * (ned.y - self.pose.east);
            }
            let (v_north, v_east) = gnss.horizontal_velocity();
            let course = libm::atan2(v_east, v_north);
            if (v_north * v_north + v_east * v_east).sqrt() > SLOWEST_COURSE && course.is_finite() {
                self.pose.yaw = wrap_angle(self.pose.yaw + YAW_GAIN * wrap_angle(course - self.pose.yaw));
            }
        }
        self.pose
    }

    fn reckon(&mut self, rate: f64, dt: f64) {
        let (sin, cos) = libm::sincos(self.pose.yaw + 0.5 * rate * dt);
        self.pose.north += self.pose.speed * cos * dt;
        self.pose.east += self.pose.speed * sin * dt;
        self.pose.yaw = wrap_angle(self.pose.yaw + rate * dt);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::signals::{Gnss, Imu, Wheels};

    fn epoch(time: f64, gyro_z: f64, speed: f64) -> Epoch<'static> {
        Epoch {
            time,
            imu: Some(Imu { gyro_z, ..Imu::default() }),
            wheels: Some(Wheels { speed, ..Wheels::default() }),
            ..Epoch::default()
        }
    }

    #[test]
    fn without_fixes_a_circle_is_driven_as_the_gyro_says() {
        let mut filter = FixedGain::new(Pose::default(), Geodetic::default());
        let last = (0..=628).map(|k| filter.step(&epoch(f64::from(k) * 0.01, 1.0, 2.0))).last().unwrap();
        // One turn of radius 2 m within 3 ms of its end: 6 mm of way, and chords shorter by 4e-6.
        assert!(last.north.abs() < 0.01 && last.east.abs() < 0.01, "{last:?}");
    }

    #[test]
    fn a_fix_takes_its_share_and_nonsense_takes_none() {
        let origin = Geodetic { lat: 0.6, lon: 2.0, alt: 50.0 };
        let mut filter = FixedGain::new(Pose::default(), origin);
        let place = LocalFrame::new(origin).to_geodetic(&nalgebra::Vector3::new(10.0, -4.0, 0.0));
        let gnss =
            Gnss { lat: place.lat, lon: place.lon, alt: place.alt, v_north: 0.0, v_east: 1.0, ..Gnss::default() };
        let pose = filter.step(&Epoch { gnss: Some(gnss), ..Epoch::default() });
        assert!((pose.north - 3.0).abs() < 1e-6 && (pose.east + 1.2).abs() < 1e-6);
        assert!((pose.yaw - 0.1 * std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        let before = pose;
        let pose = filter.step(&Epoch { gnss: Some(Gnss::default()), ..epoch(0.0, f64::NAN, f64::NAN) });
        assert_eq!(pose, before);
        let slow = Gnss { lat: f64::NAN, v_north: 0.1, v_east: 0.1, ..gnss };
        assert_eq!(filter.step(&Epoch { gnss: Some(slow), ..Epoch::default() }), before);
    }
}
