//! Speed and course of a car whose receiver gives places alone: from two of them, for the start.
//!
//! The chord between two places points where the car headed halfway; the yaw gyro says how far it has turned since then.
//! Both errors count in full, since nothing is known of how alike they are.

use drivescope_drive::geodesy::{Geodetic, LocalFrame};
use nalgebra::Vector3;

use super::fix::Fix;

/// Longest time between two places whose chord is a velocity, s.
const LONGEST: f64 = 2.5;
/// Shortest chord that has a direction, in sigmas of it.
const CLEAR: f64 = 1.5;

/// The place before, and what the car has turned since.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pair {
    last: Option<(f64, Geodetic, Vector3<f64>)>,
    turned: f64,
}

impl Pair {
    /// The car turned by `angle`, rad, as its yaw gyro says.
    pub fn turn(&mut self, angle: f64) {
        self.turned += angle;
    }

    /// Take the place of a fix at `time`, s, that states neither velocity nor speed; the fix with both if the last place is near in
    /// time and far enough away.
    pub fn complete(&mut self, time: f64, fix: &Fix) -> Option<Fix> {
        let place = fix.place.filter(|_| fix.velocity.is_none() && fix.ground_speed.is_nan())?;
        let turned = std::mem::take(&mut self.turned);
        let (before, from, sigma) = self.last.replace((time, place, fix.position_sigma))?;
        let passed = time - before;
        if !(passed > 0.0 && passed <= LONGEST) {
            return None;
        }
        let chord = LocalFrame::new(from).to_ned(place);
        let spread = sigma.x.max(sigma.y).hypot(fix.position_sigma.x.max(fix.position_sigma.y));
        let length = chord.x.hypot(chord.y);
        if length < CLEAR * spread {
            return None;
        }
        let (sin, cos) = (0.5 * turned).sin_cos();
        let (north, east) = (chord.x * cos - chord.y * sin, chord.x * sin + chord.y * cos);
        Some(Fix {
            velocity: Some(Vector3::new(north, east, 0.0) / passed),
            has_vertical_velocity: false,
            velocity_sigma: Vector3::repeat(spread / passed),
            ground_speed: length / passed,
            ..*fix
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::fix::NOMINAL_ORIGIN;
    use super::super::tuning::GnssInsParams;
    use super::*;
    use drivescope_drive::signals::Gnss;

    fn fix(north: f64, east: f64, speed: f64) -> Fix {
        let gnss = Gnss { north, east, down: 0.0, speed, std_north: 0.5, std_east: 0.5, ..Gnss::default() };
        Fix::read(&gnss, NOMINAL_ORIGIN, &GnssInsParams::default()).unwrap()
    }

    /// Catches the course of the chord, half a second's turn behind, taken for that of now: 10 deg at 20 deg/s.
    #[test]
    fn the_course_is_that_at_the_second_place_of_a_car_that_turns() {
        let (rate, speed) = (0.35_f64, 10.0);
        let on_circle =
            |t: f64| fix(speed / rate * (rate * t).sin(), speed / rate * (1.0 - (rate * t).cos()), f64::NAN);
        let mut pair = Pair::default();
        assert!(pair.complete(0.0, &on_circle(0.0)).is_none());
        (0..100).for_each(|_| pair.turn(rate * 0.01));
        let found = pair.complete(1.0, &on_circle(1.0)).unwrap();
        let (course, sigma) = found.course().unwrap();
        // The chord is shorter than the arc by a part in 200.
        assert!((course - rate).abs() < 1e-6 && (found.ground_speed - speed).abs() < 0.06, "{course} {found:?}");
        assert!((sigma - (0.5_f64.hypot(0.5) / 10.0 + 1_f64.to_radians())).abs() < 1e-3, "{sigma}");
    }

    /// Catches noise at rest taken for motion, an old place taken for the last one, and a measured speed overruled.
    #[test]
    fn places_too_near_too_old_or_beside_a_measured_speed_tell_nothing() {
        let mut pair = Pair::default();
        for (time, north, speed) in
            [(0.0, 0.0, f64::NAN), (1.0, 1.0, f64::NAN), (4.0, 31.0, f64::NAN), (5.0, 41.0, 10.0)]
        {
            assert!(pair.complete(time, &fix(north, 0.0, speed)).is_none(), "{time}");
        }
        assert!(pair.complete(6.0, &fix(51.0, 0.0, f64::NAN)).is_some());
    }
}
