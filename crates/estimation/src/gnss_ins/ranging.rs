//! Tight coupling: pseudoranges and their rates, satellite by satellite, and the receiver clock.
//!
//! Source: SPEC navigation 4. Each range is a scalar update, linearized at the state that the ones before it left, and gated on
//! its own: one, two or three satellites still help. The clock starts from the first ranges against the position that the
//! filter has then; a common jump of most ranges is taken for one of the clock.

use drivescope_drive::frames::skew;
use drivescope_drive::geodesy::LocalFrame;
use drivescope_drive::satellites::Satellite;
use nalgebra::{RowVector3, SMatrix, Vector3, vector};

use super::covariance::{ALL_STATES, CLOCK_BIAS, CLOCK_DRIFT};
use super::estimate::Verdicts;
use super::filter::Filter;
use super::measurement::Prediction;
use super::state::State;
use super::tuning::{START_CLOCK_SIGMA, Tuning};
use crate::gnss::sight::{Geometry, Sight, median, usable};
use crate::ins::{ATTITUDE, GYRO_BIAS, POSITION, VELOCITY};

/// Disagreement with the clock from which ranges may tell that it jumped, m.
const SMALLEST_JUMP: f64 = 50.0;
/// Largest distance from the common jump of a range that agrees with it, m.
const AGREEMENT: f64 = 50.0;
/// Sigma of the clock's offset after a jump, m.
const JUMP_SIGMA: f64 = 30.0;

/// How old ranges are, how the car accelerated since (north, east, down, m/s^2), and how much they have in common.
#[derive(Clone, Copy, Debug)]
pub struct Lag {
    /// Age, s.
    pub age: f64,
    /// How many ranges of a satellite share one error: see [`Tuning::ranges_per_error`].
    pub repeats: f64,
    /// Acceleration.
    pub acceleration: Vector3<f64>,
}

/// The antenna of a navigation state.
struct Antenna {
    frame: LocalFrame,
    arm: Vector3<f64>,
    turning: Vector3<f64>,
}

impl Antenna {
    fn new(state: &State, antenna: &Vector3<f64>, rate: &Vector3<f64>) -> Self {
        let n = &state.navigation;
        let turning = n.body_to_nav * rate.cross(antenna);
        Self { frame: LocalFrame::new(n.place), arm: n.body_to_nav * antenna, turning }
    }
    fn sight(&self, satellite: &Satellite) -> Sight {
        Sight::new(&self.frame, &self.arm, satellite)
    }
}

/// Distance to a satellite with the receiver clock against a pseudorange, m; the clock as `clock_bias`.
pub fn range(state: &State, antenna: &Vector3<f64>, satellite: &Satellite) -> Prediction<1> {
    let antenna = Antenna::new(state, antenna, &Vector3::zeros());
    let sight = antenna.sight(satellite);
    let e = sight.direction.transpose();
    let mut h = SMatrix::<f64, 1, ALL_STATES>::zeros();
    put(&mut h, POSITION, &-e);
    put(&mut h, ATTITUDE, &-(e * skew(&antenna.arm)));
    h[CLOCK_BIAS] = 1.0;
    Prediction { z: vector![sight.distance + state.clock_bias - satellite.range], h }
}

/// Rate of the distance to a satellite with the receiver clock against a measured one, m/s; `rate` is the body's, rad/s.
///
/// The change of the direction with the position (at most 3e-4 1/s) is left out.
pub fn range_rate(state: &State, antenna: &Vector3<f64>, rate: &Vector3<f64>, satellite: &Satellite) -> Prediction<1> {
    let at = Antenna::new(state, antenna, rate);
    let sight = at.sight(satellite);
    let e = sight.direction.transpose();
    let velocity = state.navigation.velocity + at.turning;
    let mut h = SMatrix::<f64, 1, ALL_STATES>::zeros();
    put(&mut h, VELOCITY, &-e);
    put(&mut h, ATTITUDE, &-(e * skew(&at.turning)));
    put(&mut h, GYRO_BIAS, &(e * state.navigation.body_to_nav * skew(antenna)));
    h[CLOCK_DRIFT] = 1.0;
    Prediction { z: vector![sight.distance_rate(&velocity) + state.clock_drift - satellite.rate], h }
}

fn put(h: &mut SMatrix<f64, 1, ALL_STATES>, first: usize, values: &RowVector3<f64>) {
    h.fixed_view_mut::<1, 3>(0, first).copy_from(values);
}

/// What tight coupling remembers between instants.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ranging {
    /// Whether the receiver clock has been set.
    pub is_clock_known: bool,
    /// Dilution of the position of the satellites last in view.
    pub pdop: f64,
    refusals: usize,
}

impl Ranging {
    /// Fold in the ranges of an instant. Returns whether the clock was found to have jumped.
    ///
    /// A yaw that is not known yet stays out of the corrections.
    pub fn aid(
        &mut self,
        filter: &mut Filter,
        satellites: &[Satellite],
        lag: &Lag,
        is_yaw_known: bool,
        tuning: &Tuning,
        verdicts: &mut Verdicts,
    ) -> bool {
        self.pdop = self.dilution(filter, satellites, tuning);
        let has_jumped = self.is_clock_known && self.follow_jump(filter, satellites, lag, tuning);
        if !self.is_clock_known {
            self.is_clock_known = start_clock(filter, satellites, lag, tuning);
        }
        let p = &tuning.params;
        for satellite in usable(satellites) {
            if !is_yaw_known {
                filter.isolate_yaw();
            }
            let mut prediction = range(&filter.state, &tuning.antenna, satellite);
            let lagging = filter.state.navigation.velocity * lag.age;
            prediction.z.x -= prediction.h.fixed_view::<1, 3>(0, POSITION).transpose().dot(&lagging)
                + filter.state.clock_drift * lag.age;
            let sigma = vector![p.range_sigma * p.gnss_scale];
            let verdict = filter.update_repeated(&prediction, &sigma, lag.repeats, tuning);
            verdicts.range.add(verdict);
            filter.count_refusals(&mut self.refusals, verdict, p.max_reject);
            if !is_yaw_known {
                filter.isolate_yaw();
            }
            let mut prediction = range_rate(&filter.state, &tuning.antenna, &filter.rate, satellite);
            if !prediction.z.x.is_finite() {
                continue;
            }
            let lagging = lag.acceleration * lag.age;
            prediction.z.x -= prediction.h.fixed_view::<1, 3>(0, VELOCITY).transpose().dot(&lagging);
            let verdict = filter.update(&prediction, &vector![p.range_rate_sigma * p.gnss_scale], tuning);
            verdicts.range_rate.add(verdict);
        }
        has_jumped
    }

    fn dilution(&self, filter: &Filter, satellites: &[Satellite], tuning: &Tuning) -> f64 {
        let antenna = Antenna::new(&filter.state, &tuning.antenna, &Vector3::zeros());
        let mut geometry = Geometry::default();
        usable(satellites).for_each(|s| geometry.add(&antenna.sight(s).direction));
        geometry.pdop()
    }

    /// Shift the clock where three or more ranges disagree with it, and most of them by the same distance.
    fn follow_jump(&self, filter: &mut Filter, satellites: &[Satellite], lag: &Lag, tuning: &Tuning) -> bool {
        let residual =
            |s: &Satellite| range(&filter.state, &tuning.antenna, s).z.x - filter.state.clock_drift * lag.age;
        let count = usable(satellites).count();
        let Some(middle) = median(usable(satellites).map(residual)) else { return false };
        let agreeing = usable(satellites).filter(|s| (residual(s) - middle).abs() < AGREEMENT).count();
        if count < 3 || middle.abs() < SMALLEST_JUMP + 5.0 * filter.sigma(CLOCK_BIAS) || 2 * agreeing <= count {
            return false;
        }
        let (bias, drift) = (filter.state.clock_bias - middle, filter.state.clock_drift);
        filter.set_clock(bias, drift, [JUMP_SIGMA * JUMP_SIGMA, f64::NAN]);
        true
    }
}

/// The clock that makes the ranges fit the position and velocity; `false` without a range.
fn start_clock(filter: &mut Filter, satellites: &[Satellite], lag: &Lag, tuning: &Tuning) -> bool {
    let clear = State { clock_bias: 0.0, clock_drift: 0.0, ..filter.state };
    let offsets = usable(satellites).map(|s| -range(&clear, &tuning.antenna, s).z.x);
    let rates = usable(satellites).map(|s| -range_rate(&clear, &tuning.antenna, &filter.rate, s).z.x);
    let drift = median(rates.filter(|rate| rate.is_finite())).unwrap_or(0.0);
    let Some(bias) = median(offsets) else { return false };
    filter.set_clock(bias + drift * lag.age, drift, START_CLOCK_SIGMA.map(|s| s * s));
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::{ACCEL_BIAS, Earth, GravityModel, Navigation};
    use drivescope_drive::frames::body_to_nav;
    use drivescope_drive::geodesy::Geodetic;
    use nalgebra::SVector;

    const ANTENNA: Vector3<f64> = Vector3::new(0.8, -0.3, -1.2);
    const RATE: Vector3<f64> = Vector3::new(0.05, -0.1, 0.4);

    fn state() -> State {
        let navigation = Navigation {
            place: Geodetic { lat: 0.63, lon: 2.2, alt: 40.0 },
            velocity: Vector3::new(12.0, -7.0, 0.6),
            body_to_nav: body_to_nav(0.1, -0.15, 0.9),
        };
        State { clock_bias: 3000.0, clock_drift: 30.0, ..State::new(navigation, Vector3::zeros()) }
    }

    /// A satellite to the south-east, 40 deg high, that moves.
    fn satellite() -> Satellite {
        let frame = LocalFrame::new(state().navigation.place);
        let place = frame.to_geodetic(&(Vector3::new(-0.5, 0.58, -0.643) * 2.2e7)).to_ecef();
        let velocity = Vector3::new(1500.0, -2000.0, 1700.0);
        Satellite { prn: 1, place, velocity, range: 2.2e7, rate: -300.0 }
    }

    /// The state that indicates [`state`] plus the errors, and its rate.
    fn indicated(errors: &SVector<f64, ALL_STATES>) -> (State, Vector3<f64>) {
        let mut state = state();
        let earth = Earth::at(&state.navigation.place, GravityModel::Wgs84);
        state.correct(&-errors, &earth);
        (state, RATE + errors.fixed_rows::<3>(GYRO_BIAS))
    }

    /// Steps of 10 m, 1 m/s, 1e-3 rad: places of 2e7 m are rounded to 4e-9 m, a dozen times, which over 1e-3 rad makes 5e-5; the
    /// second order of a range is 10^2 / 2.2e7 = 5e-6 m. The rate drops the change of the direction, (3e3 m/s / 2.2e7 m) =
    /// 1.4e-4 1/s: allowed for in the columns of the position.
    #[test]
    fn range_rows_are_the_derivatives_of_range_and_rate() {
        let zero = SVector::zeros();
        type Model = dyn Fn(&SVector<f64, ALL_STATES>) -> Prediction<1>;
        let models: [(&Model, f64); 2] = [
            (&|x| range(&indicated(x).0, &ANTENNA, &satellite()), 1e-5),
            (
                &|x| {
                    let (state, rate) = indicated(x);
                    range_rate(&state, &ANTENNA, &rate, &satellite())
                },
                2e-4,
            ),
        ];
        for (model, position_tolerance) in models {
            let h = model(&zero).h;
            for column in 0..ALL_STATES {
                let size = [10.0, 1.0, 1e-3, 1.0, 1e-3, 1.0][column / 3];
                let mut step = zero;
                step[column] = size;
                let numeric = (model(&step).z.x - model(&-step).z.x) / (2.0 * size);
                let tolerance = if column < 3 { position_tolerance } else { 1e-4 };
                assert!((numeric - h[column]).abs() < tolerance, "column {column}: {numeric} {}", h[column]);
            }
            assert!(h.fixed_view::<1, 3>(0, ACCEL_BIAS).amax() == 0.0);
        }
    }
}
