//! The receiver filter: constant velocity, a clock that drifts, one scalar update for each range and rate.
//!
//! Source: Yun & Yu 2007 (10) to (13), corrected; SPEC navigation 5.

use drivescope_drive::geodesy::LocalFrame;
use drivescope_drive::satellites::Satellite;
use nalgebra::{SMatrix, SVector, Vector3};

use super::estimate::{GnssEstimate, GnssParams};
use super::integrity::Integrity;
use super::sight::{Sight, median, usable};
use super::snapshot::Snapshot;
use crate::chi_square;
use crate::kalman::{self, Outcome};

/// Number of states.
pub const STATES: usize = 8;
/// Offset of the receiver clock, m; its drift follows.
pub const CLOCK: usize = 6;

/// State: place and velocity of each axis in turn, then the clock.
pub type State = SVector<f64, STATES>;
/// Covariance of the state.
pub type Covariance = SMatrix<f64, STATES, STATES>;

/// Sigmas of a fresh start: north, its rate, east, its rate, down, its rate, clock, its rate (m, m/s).
const START_SIGMA: [f64; STATES] = [3.0, 0.3, 3.0, 0.3, 5.0, 0.3, 5.0, 0.3];
/// Disagreement with the clock from which ranges may tell that it jumped, and largest distance from the common jump of a range
/// that agrees with it, m (SPEC navigation 4).
const SMALLEST_JUMP: f64 = 50.0;
/// Sigma of the clock's offset after a jump, m.
const JUMP_SIGMA: f64 = 30.0;

/// Parameters, and the numbers derived from them once.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuning {
    /// The parameters.
    pub params: GnssParams,
    /// Largest accepted normalized innovation squared.
    pub gate: Option<f64>,
    /// The integrity test.
    pub integrity: Integrity,
}

impl Tuning {
    /// Derive everything once.
    pub fn new(params: &GnssParams) -> Self {
        let gate = params.gate.then(|| chi_square::quantile(params.gate_probability, 1.0));
        let integrity = Integrity::new(params.integrity_probability, params.exclude, params.range_sigma);
        Self { gate, integrity, params: params.clone() }
    }
}

/// What the ranges and rates of an instant were worth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Used {
    /// Ranges.
    pub range: Tally,
    /// Rates.
    pub rate: Tally,
}

/// Counts of one kind of measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Measurements.
    pub count: usize,
    /// Those that were used.
    pub accepted: usize,
    /// Sum of the normalized innovations squared.
    pub nis: f64,
}

impl Used {
    /// Put statistics and decisions into their columns; no measurement is no value.
    pub fn write(&self, row: &mut GnssEstimate) {
        let mean = |tally: &Tally, sum: f64| sum / tally.count as f64;
        row.range_nis = mean(&self.range, self.range.nis);
        row.range_rate_nis = mean(&self.rate, self.rate.nis);
        row.range_accepted = mean(&self.range, self.range.accepted as f64);
        row.range_rate_accepted = mean(&self.rate, self.rate.accepted as f64);
    }
}

/// State and covariance.
#[derive(Clone, Debug)]
pub struct Filter {
    /// State.
    pub state: State,
    /// Its covariance.
    pub covariance: Covariance,
}

impl Filter {
    /// Start from a fix.
    pub fn new(fix: &Snapshot) -> Self {
        let (velocity, drift) = fix.velocity.unwrap_or_default();
        let state = [fix.place.x, velocity.x, fix.place.y, velocity.y, fix.place.z, velocity.z, fix.clock_bias, drift];
        let mut covariance = Covariance::from_diagonal(&SVector::from(START_SIGMA.map(|s| s * s)));
        if fix.velocity.is_none() {
            // A car and a crystal of which nothing is known.
            [1, 3, 5, 7].into_iter().for_each(|k| covariance[(k, k)] = 900.0);
        }
        Self { state: SVector::from(state), covariance }
    }

    /// Place and velocity, north, east, down, m and m/s.
    pub fn motion(&self) -> (Vector3<f64>, Vector3<f64>) {
        let x = &self.state;
        (Vector3::new(x[0], x[2], x[4]), Vector3::new(x[1], x[3], x[5]))
    }

    /// Move on by `time` s. (11), (12)
    pub fn predict(&mut self, time: f64, tuning: &Tuning) {
        let p = &tuning.params;
        for pair in (0..STATES).step_by(2) {
            self.state[pair] += time * self.state[pair + 1];
            // Phi P Phi' pair by pair: the place takes its share of the rate, in rows and then in columns.
            for k in 0..STATES {
                self.covariance[(pair, k)] += time * self.covariance[(pair + 1, k)];
            }
            for k in 0..STATES {
                self.covariance[(k, pair)] += time * self.covariance[(k, pair + 1)];
            }
            let (density, white) =
                if pair == CLOCK { (p.clock_drift_noise, p.clock_bias_noise) } else { (p.acceleration_noise, 0.0) };
            self.covariance[(pair, pair)] += density * time.powi(3) / 3.0 + white * time;
            self.covariance[(pair, pair + 1)] += 0.5 * density * time * time;
            self.covariance[(pair + 1, pair)] += 0.5 * density * time * time;
            self.covariance[(pair + 1, pair + 1)] += density * time;
        }
        kalman::symmetrize(&mut self.covariance);
    }

    /// Fold in the ranges and rates of an instant, satellite by satellite.
    pub fn update(&mut self, frame: &LocalFrame, satellites: &[Satellite], tuning: &Tuning) -> Used {
        let mut used = Used::default();
        let (range_noise, rate_noise) = (tuning.params.range_sigma.powi(2), tuning.params.range_rate_sigma.powi(2));
        for satellite in usable(satellites) {
            let (y, h) = self.range(frame, satellite);
            self.fold(y, &h, range_noise, tuning, &mut used.range);
            let (y, h) = self.range_rate(frame, satellite);
            if y.is_finite() {
                self.fold(y, &h, rate_noise, tuning, &mut used.rate);
            }
        }
        used
    }

    fn fold(&mut self, y: f64, h: &State, variance: f64, tuning: &Tuning, tally: &mut Tally) {
        tally.count += 1;
        let Ok(outcome) = kalman::update_scalar(&mut self.covariance, y, h, variance, tuning.gate) else { return };
        tally.nis += outcome.nis();
        if let Outcome::Accepted { dx, .. } = outcome {
            self.state += dx;
            tally.accepted += 1;
        }
    }

    /// Innovation of a pseudorange, m, and its row. (13)
    pub fn range(&self, frame: &LocalFrame, satellite: &Satellite) -> (f64, State) {
        let sight = Sight::new(frame, &self.motion().0, satellite);
        let e = sight.direction;
        let y = satellite.range - sight.distance - self.state[CLOCK];
        (y, SVector::from([-e.x, 0.0, -e.y, 0.0, -e.z, 0.0, 1.0, 0.0]))
    }

    /// Innovation of the rate of a pseudorange, m/s, and its row. (13)
    pub fn range_rate(&self, frame: &LocalFrame, satellite: &Satellite) -> (f64, State) {
        let (place, velocity) = self.motion();
        let sight = Sight::new(frame, &place, satellite);
        let (e, relative) = (sight.direction, sight.velocity - velocity);
        let along = e.dot(&relative);
        let g = (relative - e * along) / -sight.distance;
        let y = satellite.rate - along - self.state[CLOCK + 1];
        (y, SVector::from([g.x, -e.x, g.y, -e.y, g.z, -e.z, 0.0, 1.0]))
    }

    /// Shift the clock where three or more ranges disagree with it, and most of them by the same distance; whether they did.
    pub fn follow_jump(&mut self, frame: &LocalFrame, satellites: &[Satellite]) -> bool {
        let residual = |s: &Satellite| self.range(frame, s).0;
        let count = usable(satellites).count();
        let Some(middle) = median(usable(satellites).map(residual)) else { return false };
        let agreeing = usable(satellites).filter(|s| (residual(s) - middle).abs() < SMALLEST_JUMP).count();
        let sigma = self.covariance[(CLOCK, CLOCK)].max(0.0).sqrt();
        if count < 3 || middle.abs() < SMALLEST_JUMP + 5.0 * sigma || 2 * agreeing <= count {
            return false;
        }
        self.state[CLOCK] += middle;
        self.covariance.row_mut(CLOCK).fill(0.0);
        self.covariance.column_mut(CLOCK).fill(0.0);
        self.covariance[(CLOCK, CLOCK)] = JUMP_SIGMA * JUMP_SIGMA;
        true
    }

    /// Put state and sigmas into their columns.
    pub fn write(&self, frame: &LocalFrame, row: &mut GnssEstimate) {
        let (place, velocity) = self.motion();
        [row.north, row.east, row.down] = place.into();
        [row.v_north, row.v_east, row.v_down] = velocity.into();
        let geodetic = frame.to_geodetic(&place);
        (row.lat, row.lon, row.alt) = (geodetic.lat, geodetic.lon, geodetic.alt);
        (row.clock_bias, row.clock_drift) = (self.state[CLOCK], self.state[CLOCK + 1]);
        let sigma = |k: usize| self.covariance[(k, k)].max(0.0).sqrt();
        [row.north_sigma, row.east_sigma, row.down_sigma] = [sigma(0), sigma(2), sigma(4)];
        row.alt_sigma = row.down_sigma;
        [row.v_north_sigma, row.v_east_sigma, row.v_down_sigma] = [sigma(1), sigma(3), sigma(5)];
        [row.clock_bias_sigma, row.clock_drift_sigma] = [sigma(CLOCK), sigma(CLOCK + 1)];
    }
}
