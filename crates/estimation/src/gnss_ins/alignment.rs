//! Finding the state to start from: a window at rest, or the first fix of a car that is already moving.
//!
//! At rest (SPEC navigation 4): roll and pitch from the mean specific force, gyro bias from the mean rate less the Earth's,
//! position from the mean fix; yaw as given, else open until the satellites show a course. The sample before the one that
//! shows motion is not used, for it may hold the onset. In motion: position, velocity and course from one fix, or from
//! two of a receiver that gives places alone; roll and pitch zero with a larger sigma.

use drivescope_drive::frames::body_to_nav;
use drivescope_drive::geodesy::Geodetic;
use nalgebra::Vector3;

use super::filter::Filter;
use super::fix::Fix;
use super::tuning::Tuning;
use crate::ins::{Earth, GYRO_BIAS, GravityModel, Navigation, STATES, VELOCITY};

/// Shortest window at rest, in samples, that is worth levelling on.
const FEWEST_SAMPLES: usize = 20;
/// Mean rate above which a resting car is not resting, rad/s.
const LARGEST_GYRO_BIAS: f64 = 0.02;
/// What is left of a gyro bias that was found at rest, however long, rad/s: it walks, and a car at rest is not quite still.
const RESTING_GYRO_BIAS: f64 = 1e-4;
/// Slowest satellite speed at which a moving start takes its course, m/s.
const MOVING_START_SPEED: f64 = 1.0;
/// Sigma of a yaw of which nothing is known: uniform over the circle, rad.
pub const UNKNOWN_YAW_SIGMA: f64 = std::f64::consts::PI / 1.732_050_807_568_877_2;

/// A filter ready to run, and whether its yaw means anything.
#[derive(Clone, Debug)]
pub struct Start {
    /// The filter.
    pub filter: Filter,
    /// Whether the yaw is known.
    pub is_yaw_known: bool,
}

/// The mean of what has been measured since the car came to rest.
#[derive(Clone, Debug, Default)]
pub struct Alignment {
    samples: usize,
    accel: Vector3<f64>,
    gyro: Vector3<f64>,
    newest: Option<(Vector3<f64>, Vector3<f64>)>,
    since: Option<f64>,
    length: f64,
    first_fix: Option<Geodetic>,
    fixes: usize,
    fix_offsets: Vector3<f64>,
    newest_fix: Option<Geodetic>,
    is_confirmed: bool,
}

impl Alignment {
    /// A sample at rest. `is_confirmed`: odometer or satellites say so, not only the quiet of the sample itself.
    pub fn rest(&mut self, time: f64, accel: Vector3<f64>, gyro: Vector3<f64>, is_confirmed: bool) {
        self.length = time - *self.since.get_or_insert(time);
        self.is_confirmed |= is_confirmed;
        if let Some((accel, gyro)) = self.newest.replace((accel, gyro)) {
            self.samples += 1;
            self.accel += accel;
            self.gyro += gyro;
        }
        if let Some(place) = self.newest_fix.take() {
            let first = *self.first_fix.get_or_insert(place);
            self.fixes += 1;
            self.fix_offsets += Vector3::new(place.lat - first.lat, place.lon - first.lon, place.alt - first.alt);
        }
    }

    /// A place at rest, measured at the newest sample.
    pub fn fix(&mut self, place: Geodetic) {
        self.newest_fix = Some(place);
    }

    /// Whether a sample differs so little from the mean that it may be one at rest.
    pub fn is_quiet(&self, accel: &Vector3<f64>, gyro: &Vector3<f64>) -> bool {
        if self.samples < FEWEST_SAMPLES {
            return gyro.norm() < 0.1 && (accel.norm() - 9.8).abs() < 1.0;
        }
        let count = self.samples as f64;
        (gyro - self.gyro / count).norm() < 0.1 && (accel - self.accel / count).norm() < 1.0
    }

    /// Time spent at rest up to `time`, s.
    pub fn duration(&self, time: f64) -> f64 {
        self.since.map_or(0.0, |since| time - since)
    }

    /// Forget the window: the car moved before it was of use.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Mean fix of the window.
    fn place(&self) -> Option<Geodetic> {
        let first = self.first_fix?;
        let mean = self.fix_offsets / self.fixes as f64;
        Some(Geodetic { lat: first.lat + mean.x, lon: first.lon + mean.y, alt: first.alt + mean.z })
    }

    /// The filter that the window leads to; `None` while a fix, enough samples or proof of rest are missing.
    pub fn start(&self, tuning: &Tuning, gravity: GravityModel) -> Option<Start> {
        let place = self.place().filter(|_| self.samples >= FEWEST_SAMPLES && self.is_confirmed)?;
        let f = self.accel / self.samples as f64;
        let roll = (-f.y).atan2(-f.z);
        let pitch = f.x.atan2(f.y.hypot(f.z));
        let (yaw, yaw_sigma) = start_yaw(tuning).unwrap_or((0.0, UNKNOWN_YAW_SIGMA));
        let rotation = body_to_nav(roll, pitch, yaw);
        let navigation = Navigation { place, velocity: Vector3::zeros(), body_to_nav: rotation };
        let mean_rate = self.gyro / self.samples as f64;
        let bias = mean_rate - rotation.transpose() * Earth::at(&place, gravity).rate();
        let is_bias = bias.norm() < LARGEST_GYRO_BIAS;
        let bias = if is_bias { bias } else { Vector3::zeros() };
        let mut covariance = tuning.initial_covariance(tuning.params.initial_tilt_sigma, yaw_sigma);
        if is_bias && tuning.params.resting_gyro_bias {
            let variance = tuning.noise.gyro / self.length + RESTING_GYRO_BIAS.powi(2);
            for state in GYRO_BIAS..STATES {
                covariance[(state, state)] = covariance[(state, state)].min(variance);
            }
        }
        let filter = Filter::new(navigation, bias, covariance, gravity);
        Some(Start { filter, is_yaw_known: tuning.params.initial_yaw.is_finite() })
    }
}

fn start_yaw(tuning: &Tuning) -> Option<(f64, f64)> {
    let yaw = tuning.params.initial_yaw;
    yaw.is_finite().then_some((yaw, tuning.params.initial_yaw_sigma))
}

/// The filter of a car that is already moving: everything from one fix; `None` if it has no place or no course.
///
/// `is_reversing`: the car goes backward, its heading is opposite to the course.
pub fn moving_start(fix: &Fix, is_reversing: bool, tuning: &Tuning, gravity: GravityModel) -> Option<Start> {
    let (place, velocity, (course, course_sigma)) = (fix.place?, fix.velocity?, fix.course()?);
    if fix.ground_speed.is_nan() || fix.ground_speed < MOVING_START_SPEED {
        return None;
    }
    let heading = if is_reversing { course + std::f64::consts::PI } else { course };
    let (yaw, yaw_sigma) = start_yaw(tuning).unwrap_or((heading, course_sigma));
    let navigation = Navigation { place, velocity, body_to_nav: body_to_nav(0.0, 0.0, yaw) };
    let mut covariance = tuning.initial_covariance(tuning.params.moving_tilt_sigma, yaw_sigma);
    for axis in 0..2 {
        let variance = &mut covariance[(VELOCITY + axis, VELOCITY + axis)];
        *variance = variance.max(fix.velocity_sigma[axis].powi(2));
    }
    if !fix.has_vertical_velocity {
        // A road of 10 % at this speed.
        covariance[(VELOCITY + 2, VELOCITY + 2)] += (0.1 * fix.ground_speed).powi(2);
    }
    let filter = Filter::new(navigation, Vector3::zeros(), covariance, gravity);
    Some(Start { filter, is_yaw_known: true })
}

#[cfg(test)]
mod tests {
    use super::super::tuning::GnssInsParams;
    use super::*;

    fn tuning(yaw: f64) -> Tuning {
        Tuning::new(&GnssInsParams { initial_yaw: yaw, ..GnssInsParams::default() }, None)
    }

    /// A car parked nose up and left side high, with a gyro bias.
    fn parked(alignment: &mut Alignment, samples: usize) -> (Vector3<f64>, Vector3<f64>) {
        let f = body_to_nav(0.05, 0.08, 1.0).transpose() * Vector3::new(0.0, 0.0, -9.8);
        let bias = Vector3::new(1e-3, -2e-3, 3e-3);
        for k in 0..samples {
            alignment.rest(k as f64 * 0.01, f, bias, true);
            if k == 3 {
                alignment.fix(Geodetic { lat: 0.6, lon: 2.0, alt: 10.0 });
            }
        }
        (f, bias)
    }

    #[test]
    fn a_parked_car_is_levelled_by_gravity_and_its_gyro_bias_found() {
        let mut alignment = Alignment::default();
        let (_, bias) = parked(&mut alignment, 100);
        let start = alignment.start(&tuning(1.0), GravityModel::Wgs84).unwrap();
        let angles = drivescope_drive::frames::euler_zyx(&start.filter.state.navigation.body_to_nav);
        assert!((angles.roll - 0.05).abs() < 1e-12 && (angles.pitch - 0.08).abs() < 1e-12 && start.is_yaw_known);
        // Within the Earth's rotation, 7.3e-5 rad/s.
        assert!((start.filter.state.gyro_bias - bias).norm() < 7.4e-5 && start.filter.state.gyro_bias != bias);
    }

    /// The newest sample may hold the onset of motion; a window that used it would tilt the start.
    #[test]
    fn the_newest_sample_is_kept_out_of_the_window() {
        let (mut clean, mut jolted) = (Alignment::default(), Alignment::default());
        parked(&mut clean, 50);
        parked(&mut jolted, 49);
        jolted.rest(0.49, Vector3::new(5.0, 0.0, -9.0), Vector3::new(1.0, 0.0, 0.0), true);
        let navigation = |a: &Alignment| a.start(&tuning(0.0), GravityModel::Wgs84).unwrap().filter.state.navigation;
        assert_eq!(navigation(&clean).body_to_nav, navigation(&jolted).body_to_nav);
    }

    #[test]
    fn without_a_fix_or_a_proof_of_rest_there_is_no_start() {
        let mut alignment = Alignment::default();
        for k in 0..100 {
            alignment.rest(k as f64 * 0.01, Vector3::new(0.0, 0.0, -9.8), Vector3::zeros(), false);
        }
        alignment.fix(Geodetic::default());
        alignment.rest(1.0, Vector3::new(0.0, 0.0, -9.8), Vector3::zeros(), false);
        assert!(alignment.start(&tuning(0.0), GravityModel::Wgs84).is_none(), "smooth cruising is quiet too");
        let mut blind = Alignment::default();
        (0..100).for_each(|k| blind.rest(k as f64 * 0.01, Vector3::new(0.0, 0.0, -9.8), Vector3::zeros(), true));
        assert!(blind.start(&tuning(0.0), GravityModel::Wgs84).is_none());
    }

    #[test]
    fn a_moving_car_starts_along_its_course_and_a_reversing_one_against_it() {
        let gnss = drivescope_drive::signals::Gnss {
            lat: 0.6,
            lon: 2.0,
            alt: 5.0,
            speed: 10.0,
            course: 0.7,
            ..drivescope_drive::signals::Gnss::default()
        };
        let tuning = tuning(f64::NAN);
        let fix = Fix::read(&gnss, Geodetic::default(), &tuning.params).unwrap();
        for (is_reversing, yaw) in [(false, 0.7), (true, 0.7 - std::f64::consts::PI)] {
            let start = moving_start(&fix, is_reversing, &tuning, GravityModel::Wgs84).unwrap();
            let angles = drivescope_drive::frames::euler_zyx(&start.filter.state.navigation.body_to_nav);
            assert!((angles.yaw - yaw).abs() < 1e-12 && start.filter.sigma(5) > 1.0);
        }
    }
}
