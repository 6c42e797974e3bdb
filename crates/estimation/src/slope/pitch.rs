//! Second filter: speed and slope of the body from the wheel speed and the first filter's acceleration.
//!
//! State: speed, m/s; slope, rad, uphill positive (road grade plus pitch of the body). Input: forward acceleration without
//! gravity, m/s^2. Measurement: the wheel speed itself, since the first filter's speed would use the same data twice.
//! Source: Kim, Kim & Lee 2014, (5). Departure: uphill is positive (SPEC slope 10, erratum 3).

use nalgebra::{Matrix2, Vector2, vector};

use super::GRAVITY;
use super::params::SlopeParams;
use crate::kalman::{NotPositiveDefinite, Outcome, propagate, update_sparse};

pub(super) const SPEED: usize = 0;
pub(super) const SLOPE: usize = 1;

/// Largest slope, rad: steeper than any road.
pub(super) const STEEPEST: f64 = 0.6;

/// State, covariance and noise of the second filter.
#[derive(Clone, Debug)]
pub(super) struct PitchFilter {
    pub(super) x: Vector2<f64>,
    pub(super) p: Matrix2<f64>,
    rate: Vector2<f64>,
}

impl PitchFilter {
    pub(super) fn new(params: &SlopeParams, speed: f64) -> Self {
        let rate = vector![params.slope_speed_walk.powi(2), params.slope_walk.powi(2)];
        let mut filter = Self { x: Vector2::zeros(), p: Matrix2::zeros(), rate };
        filter.restart(speed);
        filter
    }

    pub(super) fn restart(&mut self, speed: f64) {
        self.x = vector![speed, 0.0];
        self.p = Matrix2::from_diagonal(&vector![0.25, 0.01]);
    }

    /// Euler step over `dt` under the acceleration `forward` (without gravity).
    pub(super) fn predict(&mut self, dt: f64, forward: f64) {
        let (sin, cos) = self.x[SLOPE].sin_cos();
        self.x[SPEED] += (forward - GRAVITY * sin) * dt; // (5)
        propagate(&mut self.p, &[SPEED], &[&[(SLOPE, -GRAVITY * cos * dt)]], &(self.rate * dt));
    }

    /// Fold in the wheel speed; NaN if there is none.
    pub(super) fn update(&mut self, wheel: f64, sigma: f64) -> Result<f64, NotPositiveDefinite> {
        if !wheel.is_finite() {
            return Ok(f64::NAN);
        }
        let outcome = update_sparse(&mut self.p, wheel - self.x[SPEED], &[(SPEED, 1.0)], sigma * sigma, None)?;
        if let Outcome::Accepted { dx, .. } = outcome {
            self.x += dx;
        }
        self.x[SLOPE] = self.x[SLOPE].clamp(-STEEPEST, STEEPEST);
        Ok(outcome.nis())
    }

    pub(super) fn is_sound(&self) -> bool {
        super::is_sound(&self.x, &self.p)
    }
}
