//! Calibration sample by sample: an extended and an unscented Kalman filter on the scalar measurement.
//!
//! The unknowns do not move. Source: SPEC orientation 7, after Crassidis, Lai & Harman 2005.

use nalgebra::{SMatrix, Vector3};

use super::model::{STATES, State, corrected, corrected_jacobian, scalar, scalar_jacobian, scalar_noise, shape};
use super::small::cholesky;
use crate::kalman::symmetrize;

/// Start sigma of an offset, uT, and of a distortion.
const START_SIGMA: [f64; 2] = [20.0, 0.1];

/// Unknowns and their covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecursiveCalibration {
    /// The unknowns.
    pub x: State,
    /// Their covariance.
    pub p: SMatrix<f64, STATES, STATES>,
    /// Noise of one axis, uT.
    noise: f64,
}

impl RecursiveCalibration {
    /// A sensor without errors, known as badly as sensors are.
    pub fn new(noise: f64) -> Self {
        let p = SMatrix::from_diagonal(&State::from_fn(|i, _| START_SIGMA[usize::from(i > 2)].powi(2)));
        Self { x: State::zeros(), p, noise }
    }

    /// Fold in a reading (uT) taken where the Earth's field is `strength`, linearised.
    ///
    /// `h` is exactly quadratic, so that the terms of second order are complete: its mean falls by the trace of the
    /// field's covariance and its variance grows by twice that of its square. A reading that is not finite is left out.
    pub fn update_extended(&mut self, reading: &Vector3<f64>, strength: f64) {
        let b = corrected(&self.x, reading);
        let row = scalar_jacobian(reading, &b);
        let field = corrected_jacobian(reading);
        let t = field * self.p * field.transpose();
        let (mean, variance) = scalar_noise(&shape(&self.x), &b, self.noise);
        let innovation = reading.norm_squared() - strength * strength - (scalar(&self.x, reading) - t.trace() + mean);
        let cross = self.p * row;
        self.fold(innovation, cross, row.dot(&cross) + 2.0 * (t * t).trace() + variance);
    }

    /// The same by sigma points (alpha 1, beta 2, kappa 0).
    pub fn update_unscented(&mut self, reading: &Vector3<f64>, strength: f64) {
        const WEIGHT: f64 = 1.0 / (2.0 * STATES as f64);
        let mut root = [0.0; STATES * STATES];
        (0..STATES * STATES).for_each(|i| root[i] = self.p[(i / STATES, i % STATES)]);
        if cholesky(&mut root, STATES).is_none() {
            return;
        }
        let point = |i: usize| {
            let column = i % STATES;
            let sign = if i < STATES { 1.0 } else { -1.0 } * (STATES as f64).sqrt();
            State::from_fn(|r, _| if r >= column { sign * root[r * STATES + column] } else { 0.0 })
        };
        let centre = scalar(&self.x, reading);
        let values: [f64; 2 * STATES] = std::array::from_fn(|i| scalar(&(self.x + point(i)), reading));
        let predicted = values.iter().sum::<f64>() * WEIGHT;
        let mut spread = 2.0 * (centre - predicted).powi(2);
        let mut cross = State::zeros();
        for (i, value) in values.iter().enumerate() {
            spread += WEIGHT * (value - predicted).powi(2);
            cross += point(i) * (WEIGHT * (value - predicted));
        }
        let (mean, variance) = scalar_noise(&shape(&self.x), &corrected(&self.x, reading), self.noise);
        let innovation = reading.norm_squared() - strength * strength - predicted - mean;
        self.fold(innovation, cross, spread + variance);
    }

    fn fold(&mut self, innovation: f64, cross: State, variance: f64) {
        if !(innovation.is_finite() && variance > 0.0 && variance.is_finite()) {
            return;
        }
        let gain = cross / variance;
        self.x += gain * innovation;
        self.p -= gain * cross.transpose();
        symmetrize(&mut self.p);
    }
}
