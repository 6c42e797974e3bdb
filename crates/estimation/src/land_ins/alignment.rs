//! The state to start from: levelled at rest, or taken from satellites or wheels by a car that already moves.

use drivescope_drive::frames::body_to_nav;
use drivescope_drive::signals::Mag;
use nalgebra::{Matrix3, Vector3};

use super::aids::Fix;
use super::errors::{ATTITUDE, GYRO_BIAS, POSITION, VELOCITY};
use super::filter::Filter;
use super::tuning::Tuning;

/// Time at the end of a rest that may hold the onset of motion: left out where the car drives off before the time is up, s.
const ONSET: f64 = 0.5;
/// Mean rate above which a resting car is not resting, rad/s.
const LARGEST_BIAS: f64 = 0.1;
/// Slowest speed that a moving start takes its course from, m/s.
const MOVING_START_SPEED: f64 = 1.0;
/// Sigma of roll and pitch of a car that starts in motion, rad: grade and mounting.
const MOVING_TILT_SIGMA: f64 = 0.087;
/// Sigma of a heading from an uncalibrated magnetometer, rad.
const MAGNETIC_SIGMA: f64 = 0.2;
/// Part of a course's sigma that more courses do not take away: sideslip and mounting, 1 deg in rad.
pub const COURSE_FLOOR: f64 = 0.017453;
/// Distance of the satellites' mean position from the origin, in its sigmas, from which the origin is not the start.
const FAR: f64 = 5.0;

/// How well the heading is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heading {
    /// Not at all: counted from the start's.
    Unknown,
    /// From the magnetometer: the satellites' course replaces it.
    Magnetic,
    /// Given, or from the course.
    Known,
}

/// A filter ready to run.
#[derive(Clone, Debug)]
pub struct Start {
    /// The filter.
    pub filter: Filter,
    /// Its heading.
    pub heading: Heading,
}

/// Sums over some rows.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    count: f64,
    force: Vector3<f64>,
    rate: Vector3<f64>,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.force += other.force;
        self.rate += other.rate;
    }
}

/// What was measured since the car came to rest.
#[derive(Clone, Debug, Default)]
pub struct Alignment {
    since: Option<f64>,
    settled: Sums,
    fresh: Sums,
    fresh_since: f64,
    field: Vector3<f64>,
    fields: usize,
    fix_sum: Vector3<f64>,
    fixes: usize,
}

impl Alignment {
    /// Time at rest, s.
    pub fn duration(&self, time: f64) -> f64 {
        self.since.map_or(0.0, |since| time - since)
    }

    /// Take in a row at rest.
    pub fn rest(&mut self, time: f64, force: &Vector3<f64>, rate: &Vector3<f64>) {
        if self.since.is_none() {
            self.since = Some(time);
            self.fresh_since = time;
        }
        if time - self.fresh_since >= ONSET {
            self.settled.add(&self.fresh);
            self.fresh = Sums::default();
            self.fresh_since = time;
        }
        self.fresh.add(&Sums { count: 1.0, force: *force, rate: *rate });
    }

    /// Take in a sample of the magnetometer.
    pub fn field(&mut self, mag: &Mag) {
        let field = Vector3::new(mag.mag_x, mag.mag_y, mag.mag_z);
        if field.iter().all(|v| v.abs() < 1e6) {
            self.field += field;
            self.fields += 1;
        }
    }

    /// Take in a fix at rest.
    pub fn fix(&mut self, fix: &Fix) {
        if let Some(position) = fix.position {
            self.fix_sum += position;
            self.fixes += 1;
        }
    }

    /// The car moved before it was of use.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The state that the rest leads to; `None` without enough rows, or where they turn.
    ///
    /// `with_onset`: the last half second is at rest too.
    pub fn start(&self, tuning: &Tuning, with_onset: bool) -> Option<Start> {
        let mut sums = self.settled;
        if with_onset {
            sums.add(&self.fresh);
        }
        let (force, rate) = (sums.force / sums.count, sums.rate / sums.count);
        if sums.count < 2.0 || force.norm() < 1.0 || rate.norm() > LARGEST_BIAS {
            return None;
        }
        let roll = (-force.y).atan2(-force.z);
        let pitch = force.x.atan2(force.y.hypot(force.z));
        let (heading, yaw, sigma) = self.yaw(tuning, roll, pitch);
        let mut p = tuning.initial_covariance;
        p[(ATTITUDE + 2, ATTITUDE + 2)] = sigma * sigma;
        let mut filter = Filter::new(body_to_nav(roll, pitch, yaw), rate, p);
        if tuning.params.gnss {
            self.place(&mut filter, tuning);
        }
        Some(Start { filter, heading })
    }

    fn yaw(&self, tuning: &Tuning, roll: f64, pitch: f64) -> (Heading, f64, f64) {
        let given = tuning.params.initial_yaw;
        if given.is_finite() {
            return (Heading::Known, given, tuning.params.initial_yaw_sigma);
        }
        let level = body_to_nav(roll, pitch, 0.0) * self.field;
        if self.fields > 0 && level.xy().norm() > 0.0 {
            return (Heading::Magnetic, (-level.y).atan2(level.x), MAGNETIC_SIGMA);
        }
        (Heading::Unknown, 0.0, tuning.params.initial_yaw_sigma)
    }

    /// Start at the satellites' mean position where the log's origin is not where the car stands.
    fn place(&self, filter: &mut Filter, tuning: &Tuning) {
        let mean = self.fix_sum / self.fixes as f64;
        let sigma = tuning.params.gnss_position_sigma;
        if mean.norm() > FAR * sigma {
            filter.position = mean;
            (POSITION..VELOCITY).for_each(|k| filter.p[(k, k)] = sigma * sigma);
        }
    }
}

/// The state of a car that already moves: level, along its course with the satellites' velocity, else at the reported speed
/// along a given yaw; `None` if neither is known.
pub fn moving_start(fix: Option<&Fix>, speed: Option<f64>, tuning: &Tuning) -> Option<Start> {
    let params = &tuning.params;
    let mut p = tuning.initial_covariance;
    for k in 0..2 {
        p[(ATTITUDE + k, ATTITUDE + k)] = MOVING_TILT_SIGMA.powi(2);
    }
    (GYRO_BIAS..GYRO_BIAS + 3).for_each(|k| p[(k, k)] *= 4.0);
    let velocity = fix.and_then(|f| f.velocity).filter(|v| v.xy().norm() > MOVING_START_SPEED);
    let is_reversing = speed.is_some_and(|v| v < 0.0);
    let (yaw, velocity, velocity_sigma, yaw_sigma) = match velocity {
        Some(v) => {
            let course = v.y.atan2(v.x) + if is_reversing { std::f64::consts::PI } else { 0.0 };
            let yaw = if params.initial_yaw.is_finite() { params.initial_yaw } else { course };
            (yaw, v, params.gnss_velocity_sigma, course_sigma(&v, tuning))
        }
        None => {
            let yaw = Some(params.initial_yaw).filter(|y| y.is_finite())?;
            let (sin, cos) = yaw.sin_cos();
            let sigma = params.wheel_sigma + params.initial_yaw_sigma * speed?.abs();
            (yaw, Vector3::new(cos, sin, 0.0) * speed?, sigma, params.initial_yaw_sigma)
        }
    };
    p[(ATTITUDE + 2, ATTITUDE + 2)] = yaw_sigma * yaw_sigma;
    (VELOCITY..VELOCITY + 3).for_each(|k| p[(k, k)] = velocity_sigma * velocity_sigma);
    let mut filter = Filter::new(body_to_nav(0.0, 0.0, yaw), Vector3::zeros(), p);
    filter.velocity = velocity;
    if let Some(position) = fix.and_then(|f| f.position).filter(|_| params.gnss) {
        filter.position = position;
        (POSITION..VELOCITY).for_each(|k| filter.p[(k, k)] = params.gnss_position_sigma.powi(2));
    }
    Some(Start { filter, heading: Heading::Known })
}

/// Sigma of the course of a satellite velocity, rad: what its noise makes of it, and 1 deg.
pub fn course_sigma(velocity: &Vector3<f64>, tuning: &Tuning) -> f64 {
    tuning.params.gnss_velocity_sigma / velocity.xy().norm() + COURSE_FLOOR
}

/// Whether a rotation is one: no NaN has entered it.
pub fn is_rotation(r: &Matrix3<f64>) -> bool {
    (r.determinant() - 1.0).abs() < 1e-3
}

#[cfg(test)]
mod tests {
    use super::super::filter::tests::tuning;
    use super::*;
    use drivescope_drive::frames::euler_zyx;

    fn rest(alignment: &mut Alignment, rows: usize, from: usize) {
        let force = body_to_nav(0.05, 0.08, 0.0).transpose() * Vector3::new(0.0, 0.0, -9.8);
        for k in from..from + rows {
            alignment.rest(k as f64 * 0.01, &force, &Vector3::new(1e-3, -2e-3, 3e-3));
        }
    }

    #[test]
    fn a_parked_car_is_levelled_by_gravity_and_headed_by_its_magnetometer() {
        let mut alignment = Alignment::default();
        rest(&mut alignment, 200, 0);
        let start = alignment.start(&tuning(), true).unwrap();
        let angles = euler_zyx(&start.filter.rotation);
        assert!((angles.roll - 0.05).abs() < 1e-12 && (angles.pitch - 0.08).abs() < 1e-12);
        assert!((start.filter.gyro_bias - Vector3::new(1e-3, -2e-3, 3e-3)).norm() < 1e-15);
        assert_eq!(start.heading, Heading::Unknown);
        let b = body_to_nav(0.05, 0.08, 2.0).transpose() * Vector3::new(30.0, 0.0, 40.0);
        alignment.field(&Mag { mag_x: b.x, mag_y: b.y, mag_z: b.z });
        let start = alignment.start(&tuning(), true).unwrap();
        assert!((euler_zyx(&start.filter.rotation).yaw - 2.0).abs() < 1e-12 && start.heading == Heading::Magnetic);
    }

    /// The last half second before a launch may hold its onset; a start that used it would be tilted.
    #[test]
    fn the_onset_of_motion_is_kept_out_of_a_rest_that_was_cut_short() {
        let mut alignment = Alignment::default();
        rest(&mut alignment, 200, 0);
        for k in 200..240 {
            alignment.rest(k as f64 * 0.01, &Vector3::new(1.5, 0.0, -9.8), &Vector3::zeros());
        }
        let pitch = |with_onset| euler_zyx(&alignment.start(&tuning(), with_onset).unwrap().filter.rotation).pitch;
        assert!((pitch(false) - 0.08).abs() < 1e-12 && (pitch(true) - 0.08).abs() > 0.005);
    }

    #[test]
    fn a_moving_car_starts_along_its_course_and_without_one_along_the_given_yaw() {
        let fix = Fix {
            position: None,
            position_sigma: Vector3::repeat(2.0),
            velocity: Some(Vector3::new(3.0, 4.0, 0.0)),
            has_vertical_velocity: true,
        };
        let start = moving_start(Some(&fix), None, &tuning()).unwrap();
        assert!((euler_zyx(&start.filter.rotation).yaw - 4f64.atan2(3.0)).abs() < 1e-12);
        let back = moving_start(Some(&fix), Some(-5.0), &tuning()).unwrap();
        assert!((back.filter.rotation * Vector3::x() + start.filter.rotation * Vector3::x()).norm() < 1e-12);
        assert!(moving_start(None, Some(5.0), &tuning()).is_none(), "a speed without a direction is no velocity");
    }
}
