//! The error-state filter: nominal state, covariance, and how they move.

use nalgebra::{SVector, Vector3};

use super::covariance::{self, CLOCK_BIAS, CLOCK_DRIFT, Covariance, Errors};
use super::measurement::Prediction;
use super::state::State;
use super::store::{Interval, Node, Store};
use super::tuning::Tuning;
use crate::estimator::EstimatorError;
use crate::ins::{ACCEL_BIAS, ATTITUDE, Earth, GravityModel, Navigation, POSITION, STATES, VELOCITY};
use crate::kalman::Outcome;

/// Steps between two repairs of the rotation.
const STEPS_PER_REPAIR: usize = 1000;
/// Latitude beyond which the tangent of the latitude leaves the model, rad.
const LARGEST_LATITUDE: f64 = 89.9 * std::f64::consts::PI / 180.0;

/// Acceleration that a car may have held through a hole in the data, m/s^2.
const HARD_BRAKING: f64 = 4.0;

/// What a sensor's last measurement was worth; NaN in `nis` where there was none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Normalized innovation squared.
    pub nis: f64,
    /// Rows that the statistic counts.
    pub rows: usize,
    /// Whether it was applied.
    pub is_accepted: bool,
}

/// Nominal state and covariance of its errors.
#[derive(Clone, Debug)]
pub struct Filter {
    /// What is estimated.
    pub state: State,
    /// Covariance of the errors at the last [`Filter::commit`].
    pub covariance: Covariance,
    /// What a smoother needs; `None` without one.
    pub store: Option<Box<Store>>,
    /// Time of the state, s.
    pub time: f64,
    /// Rate of the body at the last sample without bias, rad/s.
    pub rate: Vector3<f64>,
    /// Gravity.
    pub gravity: GravityModel,
    pending: Interval,
    steps: usize,
    revision: u64,
}

impl Filter {
    /// Start from a state.
    pub fn new(navigation: Navigation, gyro_bias: Vector3<f64>, covariance: Covariance, gravity: GravityModel) -> Self {
        Self {
            state: State::new(navigation, gyro_bias),
            covariance,
            store: None,
            time: 0.0,
            rate: Vector3::zeros(),
            gravity,
            pending: Interval::default(),
            steps: 0,
            revision: 0,
        }
    }

    /// The Earth below.
    pub fn earth(&self) -> Earth {
        Earth::at(&self.state.navigation.place, self.gravity)
    }

    /// Move on by one inertial sample: specific force (m/s^2) and rates (rad/s) as measured, over `dt` s.
    ///
    /// The covariance follows when a node is full. `noise_factor` is 1, or more where the sample was held over.
    ///
    /// # Errors
    /// [`EstimatorError::OutOfRange`] near a pole or when the state is not finite.
    pub fn predict(
        &mut self,
        accel: &Vector3<f64>,
        gyro: &Vector3<f64>,
        dt: f64,
        noise_factor: f64,
        tuning: &Tuning,
    ) -> Result<(), EstimatorError> {
        if self.pending.samples == 0 {
            self.begin_node();
        }
        self.fade_biases(dt, tuning);
        self.rate = gyro - self.state.gyro_bias;
        let navigation = &mut self.state.navigation;
        let force = navigation.advance(&(accel - self.state.accel_bias), &self.rate, dt, self.gravity);
        self.state.clock_bias += self.state.clock_drift * dt;
        self.time += dt;
        self.steps += 1;
        if self.steps.is_multiple_of(STEPS_PER_REPAIR) {
            self.state.navigation.orthonormalize();
        }
        self.check_range()?;
        let pending = &mut self.pending;
        pending.samples += 1;
        pending.time += dt;
        pending.noise_time += dt * noise_factor;
        pending.force += force * dt;
        pending.rotation += self.state.navigation.body_to_nav * dt;
        if pending.samples >= tuning.node {
            self.commit(tuning);
        }
        Ok(())
    }

    fn fade_biases(&mut self, dt: f64, tuning: &Tuning) {
        let noise = &tuning.noise;
        if noise.accel_bias_decay > 0.0 {
            self.state.accel_bias *= (-dt * noise.accel_bias_decay).exp();
        }
        if noise.gyro_bias_decay > 0.0 {
            self.state.gyro_bias *= (-dt * noise.gyro_bias_decay).exp();
        }
    }

    fn check_range(&self) -> Result<(), EstimatorError> {
        let n = &self.state.navigation;
        let ranges = [
            (n.place.lat.abs(), LARGEST_LATITUDE, "latitude"),
            (n.place.alt.abs(), 1e6, "height"),
            (n.velocity.norm(), 1e4, "velocity"),
            (n.place.lon.abs(), 1e3, "longitude"),
        ];
        // What is not a number lies in no range.
        match ranges.iter().find(|(value, largest, _)| value.is_nan() || value > largest) {
            Some((_, _, what)) => Err(EstimatorError::OutOfRange { what }),
            None => Ok(()),
        }
    }

    /// Carry the covariance up to the nominal state. Returns whether there was anything to carry.
    pub fn commit(&mut self, tuning: &Tuning) -> bool {
        let pending = std::mem::take(&mut self.pending);
        if pending.samples == 0 {
            return false;
        }
        let rates = pending.rates(&self.state.navigation, self.gravity, tuning.params.earth_terms);
        covariance::propagate(&mut self.covariance, &rates, &tuning.noise, pending.time, pending.noise_time);
        self.end_node(Node::Interval(pending));
        self.revision += 1;
        true
    }

    /// A number that changes whenever the covariance does.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Gate and fold in a measurement; `sigma` is the noise of each row. `None` where nothing could be computed.
    pub fn update<const M: usize>(
        &mut self,
        prediction: &Prediction<M>,
        sigma: &SVector<f64, M>,
        tuning: &Tuning,
    ) -> Option<Verdict> {
        self.update_repeated(prediction, sigma, 1.0, tuning)
    }

    /// The same of a measurement that shares its error with others, `repeats` in all: see [`covariance::update`].
    pub fn update_repeated<const M: usize>(
        &mut self,
        prediction: &Prediction<M>,
        sigma: &SVector<f64, M>,
        repeats: f64,
        tuning: &Tuning,
    ) -> Option<Verdict> {
        self.commit(tuning);
        let variance = sigma.map(|s| s * s);
        let gate = tuning.gates.rows::<M>();
        let (p, z, h) = (&mut self.covariance, &prediction.z, &prediction.h);
        let outcome = covariance::update(p, z, h, &variance, repeats, gate).ok()?;
        if let Outcome::Accepted { dx, .. } = outcome {
            self.correct(&dx);
            self.revision += 1;
        }
        let is_accepted = matches!(outcome, Outcome::Accepted { .. });
        Some(Verdict { nis: outcome.nis(), rows: M, is_accepted }).filter(|v| v.nis.is_finite())
    }

    /// Take estimated errors off the state; residual biases add to the biases.
    pub fn correct(&mut self, errors: &Errors) {
        let earth = self.earth();
        self.state.correct(errors, &earth);
    }

    /// Count refusals in a row of measurements of a kind, and doubt the filter at `limit` of them.
    pub fn count_refusals(&mut self, refusals: &mut usize, verdict: Option<Verdict>, limit: f64) {
        *refusals = if verdict.is_some_and(|v| !v.is_accepted) { *refusals + 1 } else { 0 };
        if *refusals as f64 >= limit {
            self.open_up();
            *refusals = 0;
        }
    }

    /// Doubt position and velocity after too many refusals in a row.
    pub fn open_up(&mut self) {
        self.begin_node();
        add_doubt(&mut self.covariance);
        self.end_node(Node::Doubt);
        self.revision += 1;
    }

    /// Set the receiver clock anew: offset (m), drift (m/s) and the variances of both. A variance that is not a number leaves
    /// what is known of it.
    pub fn set_clock(&mut self, bias: f64, drift: f64, variance: [f64; 2]) {
        self.begin_node();
        self.state.clock_bias = bias;
        self.state.clock_drift = drift;
        doubt_clock(&mut self.covariance, variance);
        self.end_node(Node::Clock(variance));
        self.revision += 1;
    }

    /// Forget what is known of one error: its variance becomes `variance`, its correlations zero. A smoother does not look
    /// across this.
    pub fn forget(&mut self, state: usize, variance: f64) {
        self.close_store();
        isolate(&mut self.covariance, state, variance);
        self.revision += 1;
    }

    fn begin_node(&mut self) {
        if let Some(store) = &mut self.store {
            store.begin(self.time, &self.state, &self.covariance);
        }
    }

    fn end_node(&mut self, node: Node) {
        if let Some(store) = &mut self.store {
            store.end(node, &self.state);
        }
    }

    /// Let the smoother's segment end here.
    pub fn close_store(&mut self) {
        if let Some(store) = &mut self.store {
            store.close(self.time, &self.state, &self.covariance);
        }
    }

    /// Zero the correlations of the yaw error and keep its variance: a yaw that is not known yet must not be corrected.
    pub fn isolate_yaw(&mut self) {
        self.forget(ATTITUDE + 2, self.covariance[(ATTITUDE + 2, ATTITUDE + 2)]);
    }

    /// Replace the yaw, keep roll and pitch; `sigma` is that of the new yaw, rad.
    pub fn set_yaw(&mut self, yaw: f64, sigma: f64) {
        self.close_store();
        let angles = drivescope_drive::frames::euler_zyx(&self.state.navigation.body_to_nav);
        self.state.navigation.body_to_nav = drivescope_drive::frames::body_to_nav(angles.roll, angles.pitch, yaw);
        self.forget(ATTITUDE + 2, sigma * sigma);
    }

    /// After a hole of `seconds`, too long to bridge: attitude is as uncertain as at the start, velocity and position by what the
    /// car may have done meanwhile.
    ///
    /// Departure from SPEC navigation 11, which sets the velocity back to its start sigma (0.2 m/s): a car that drove on unseen
    /// for 5 s would then refuse every fix.
    pub fn reset_motion(&mut self, fresh: &Covariance, seconds: f64, tuning: &Tuning) {
        self.commit(tuning);
        let speed_change = HARD_BRAKING * seconds;
        let distance = self.state.navigation.velocity.norm() * seconds + 0.5 * speed_change * seconds;
        for state in VELOCITY..ACCEL_BIAS {
            self.forget(state, fresh[(state, state)]);
        }
        for axis in 0..3 {
            self.covariance[(VELOCITY + axis, VELOCITY + axis)] += speed_change * speed_change;
            self.covariance[(POSITION + axis, POSITION + axis)] += distance * distance;
        }
    }

    /// Sigma of one error.
    pub fn sigma(&self, state: usize) -> f64 {
        self.covariance[(state, state)].max(0.0).sqrt()
    }

    /// Whether every variance is positive and finite.
    pub fn is_sound(&self) -> bool {
        (0..STATES).all(|k| self.covariance[(k, k)] > 0.0 && self.covariance[(k, k)].is_finite())
    }
}

/// 25 m^2 and 1 (m/s)^2 on the diagonals of position and velocity.
pub fn add_doubt(covariance: &mut Covariance) {
    for axis in 0..3 {
        covariance[(POSITION + axis, POSITION + axis)] += 25.0;
        covariance[(VELOCITY + axis, VELOCITY + axis)] += 1.0;
    }
}

/// Replace what is known of offset and drift of the clock; a variance that is not a number leaves one as it is.
pub fn doubt_clock(covariance: &mut Covariance, variance: [f64; 2]) {
    for (state, variance) in [CLOCK_BIAS, CLOCK_DRIFT].into_iter().zip(variance).filter(|(_, v)| v.is_finite()) {
        isolate(covariance, state, variance);
    }
}

fn isolate(covariance: &mut Covariance, state: usize, variance: f64) {
    covariance.row_mut(state).fill(0.0);
    covariance.column_mut(state).fill(0.0);
    covariance[(state, state)] = variance;
}
