//! The error-state filter: nominal navigation state, biases, covariance, and how they move.

use nalgebra::{Matrix3, SVector, Vector3};

use super::covariance::{self, Covariance, Errors};
use super::measurement::Prediction;
use super::tuning::Tuning;
use crate::estimator::EstimatorError;
use crate::ins::{
    ACCEL_BIAS, ATTITUDE, Earth, GYRO_BIAS, GravityModel, Navigation, POSITION, STATES, VELOCITY, error_rates,
};
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

/// Sums over the inertial samples of which the covariance does not know yet.
#[derive(Clone, Copy, Debug, Default)]
struct Pending {
    samples: usize,
    time: f64,
    noise_time: f64,
    force: Vector3<f64>,
    rotation: Matrix3<f64>,
}

/// Nominal state, biases and covariance of the errors.
#[derive(Clone, Debug)]
pub struct Filter {
    /// Where, how fast, how turned.
    pub navigation: Navigation,
    /// Accelerometer biases, body axes, m/s^2.
    pub accel_bias: Vector3<f64>,
    /// Gyro biases, body axes, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// Covariance of the errors at the last [`Filter::commit`].
    pub covariance: Covariance,
    /// Rate of the body at the last sample without bias, rad/s.
    pub rate: Vector3<f64>,
    gravity: GravityModel,
    pending: Pending,
    steps: usize,
    revision: u64,
}

impl Filter {
    /// Start from a state.
    pub fn new(navigation: Navigation, gyro_bias: Vector3<f64>, covariance: Covariance, gravity: GravityModel) -> Self {
        Self {
            navigation,
            accel_bias: Vector3::zeros(),
            gyro_bias,
            covariance,
            rate: Vector3::zeros(),
            gravity,
            pending: Pending::default(),
            steps: 0,
            revision: 0,
        }
    }

    /// The Earth below.
    pub fn earth(&self) -> Earth {
        Earth::at(&self.navigation.place, self.gravity)
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
        self.fade_biases(dt, tuning);
        self.rate = gyro - self.gyro_bias;
        let force = self.navigation.advance(&(accel - self.accel_bias), &self.rate, dt, self.gravity);
        self.steps += 1;
        if self.steps.is_multiple_of(STEPS_PER_REPAIR) {
            self.navigation.orthonormalize();
        }
        self.check_range()?;
        let pending = &mut self.pending;
        pending.samples += 1;
        pending.time += dt;
        pending.noise_time += dt * noise_factor;
        pending.force += force * dt;
        pending.rotation += self.navigation.body_to_nav * dt;
        if pending.samples >= tuning.node {
            self.commit(tuning);
        }
        Ok(())
    }

    fn fade_biases(&mut self, dt: f64, tuning: &Tuning) {
        let noise = &tuning.noise;
        if noise.accel_bias_decay > 0.0 {
            self.accel_bias *= (-dt * noise.accel_bias_decay).exp();
        }
        if noise.gyro_bias_decay > 0.0 {
            self.gyro_bias *= (-dt * noise.gyro_bias_decay).exp();
        }
    }

    fn check_range(&self) -> Result<(), EstimatorError> {
        let n = &self.navigation;
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
        let mean = Navigation { body_to_nav: pending.rotation / pending.time, ..self.navigation };
        let force = pending.force / pending.time;
        let rates = error_rates(&mean, &force, &self.earth(), tuning.params.earth_terms);
        covariance::propagate(&mut self.covariance, &rates, &tuning.noise, pending.time, pending.noise_time);
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
        self.commit(tuning);
        let variance = sigma.map(|s| s * s);
        let gate = tuning.gates.rows::<M>();
        let outcome = covariance::update(&mut self.covariance, &prediction.z, &prediction.h, &variance, gate).ok()?;
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
        self.navigation.correct(&errors.fixed_rows::<9>(POSITION).into_owned(), &earth);
        self.accel_bias += errors.fixed_rows::<3>(ACCEL_BIAS);
        self.gyro_bias += errors.fixed_rows::<3>(GYRO_BIAS);
    }

    /// Doubt position and velocity after too many refusals in a row: 25 m^2 and 1 (m/s)^2 on their diagonals.
    pub fn open_up(&mut self) {
        for axis in 0..3 {
            self.covariance[(POSITION + axis, POSITION + axis)] += 25.0;
            self.covariance[(VELOCITY + axis, VELOCITY + axis)] += 1.0;
        }
        self.revision += 1;
    }

    /// Forget what is known of one error: its variance becomes `variance`, its correlations zero.
    pub fn forget(&mut self, state: usize, variance: f64) {
        self.covariance.row_mut(state).fill(0.0);
        self.covariance.column_mut(state).fill(0.0);
        self.covariance[(state, state)] = variance;
        self.revision += 1;
    }

    /// Zero the correlations of the yaw error and keep its variance: a yaw that is not known yet must not be corrected.
    pub fn isolate_yaw(&mut self) {
        self.forget(ATTITUDE + 2, self.covariance[(ATTITUDE + 2, ATTITUDE + 2)]);
    }

    /// Replace the yaw, keep roll and pitch; `sigma` is that of the new yaw, rad.
    pub fn set_yaw(&mut self, yaw: f64, sigma: f64) {
        let angles = drivescope_drive::frames::euler_zyx(&self.navigation.body_to_nav);
        self.navigation.body_to_nav = drivescope_drive::frames::body_to_nav(angles.roll, angles.pitch, yaw);
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
        let distance = self.navigation.velocity.norm() * seconds + 0.5 * speed_change * seconds;
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
