//! Kalman filters that correct an attitude by the magnetic field.
//!
//! Source: Hwang & Choi 2016 (11) to (13). Every filter here: midpoint rule, `Phi = I + F dt + (F dt)^2 / 2` at the state
//! before the step, `P <- Phi P Phi' + Q dt`, one field update; no normalisation of the field's strength.

use drivescope_drive::frames::{Euler, wrap_angle};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3, vector};

use super::attitude::predicted_field;
use super::model::{self, Input, Rates, Suspension};
use super::params::OrientationParams;
use crate::kalman::{NotPositiveDefinite, Outcome, predict, transition, update_scalar};

/// Noise of the attitude filters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// Random walks of roll, pitch and yaw, squared, rad^2/s.
    walk: Vector3<f64>,
    /// Variance of one magnetometer axis, uT^2.
    field: f64,
}

impl Noise {
    pub(super) fn new(p: &OrientationParams) -> Self {
        Self {
            walk: vector![p.roll_walk.powi(2), p.pitch_walk.powi(2), p.yaw_walk.powi(2)],
            field: p.field_sigma.powi(2),
        }
    }
}

/// A state with a covariance, three of whose states are roll, pitch and yaw.
#[derive(Clone, Debug)]
pub(super) struct AttitudeFilter<const N: usize> {
    pub(super) x: SVector<f64, N>,
    pub(super) p: SMatrix<f64, N, N>,
    /// Where roll, pitch and yaw stand in the state.
    angles: [usize; 3],
    noise: Noise,
}

/// Roll, pitch, yaw.
pub(super) type GyroFilter = AttitudeFilter<3>;
/// Roll, roll rate, pitch, pitch rate, yaw.
pub(super) type SprungFilter = AttitudeFilter<5>;

impl GyroFilter {
    pub(super) fn new(start: &Euler, noise: Noise) -> Self {
        let sigma = 3f64.to_radians();
        Self {
            x: vector![start.roll, start.pitch, start.yaw],
            p: SMatrix::identity() * (sigma * sigma),
            angles: [0, 1, 2],
            noise,
        }
    }

    pub(super) fn predict(&mut self, yaw_rate: f64, rates: Rates, dt: f64) {
        let jacobian = model::gyro_jacobian(&self.x, yaw_rate, rates);
        self.advance(|x| model::gyro_rates(x, yaw_rate, rates), &jacobian, dt);
    }
}

impl SprungFilter {
    pub(super) fn new(start: &Euler, noise: Noise) -> Self {
        let (angle, rate) = (1f64.to_radians(), 2f64.to_radians());
        Self {
            x: vector![start.roll, 0.0, start.pitch, 0.0, start.yaw],
            p: SMatrix::from_diagonal(&vector![angle, rate, angle, rate, angle].map(|s| s * s)),
            angles: [model::ROLL, model::PITCH, model::YAW],
            noise,
        }
    }

    pub(super) fn predict(&mut self, u: &Input, s: &Suspension, rates: Rates, dt: f64) {
        let jacobian = model::sprung_jacobian(&self.x, u, s, rates);
        self.advance(|x| model::sprung_rates(x, u, s, rates), &jacobian, dt);
    }
}

impl<const N: usize> AttitudeFilter<N> {
    fn advance(&mut self, rates: impl Fn(&SVector<f64, N>) -> SVector<f64, N>, jacobian: &SMatrix<f64, N, N>, dt: f64) {
        let phi = transition(jacobian, dt);
        self.x = midpoint(&self.x, rates, dt);
        let mut q = SMatrix::zeros();
        for (walk, &i) in self.noise.walk.iter().zip(&self.angles) {
            q[(i, i)] = walk * dt; // (13)
        }
        predict(&mut self.p, &phi, &q);
    }

    /// Fold in a body-frame field and return its normalized innovation squared (three degrees of freedom).
    ///
    /// The three axes have independent noise, so they are folded in one after the other, linearized once.
    pub(super) fn update(
        &mut self,
        field: &Vector3<f64>,
        reference: &Vector3<f64>,
    ) -> Result<f64, NotPositiveDefinite> {
        let (predicted, by_angle) = predicted_field(&self.attitude(), reference); // (12)
        let innovation = field - predicted;
        let mut correction = SVector::<f64, N>::zeros();
        let mut nis = 0.0;
        for axis in 0..3 {
            let row = self.row(&by_angle, axis);
            let remaining = innovation[axis] - row.dot(&correction);
            let outcome = update_scalar(&mut self.p, remaining, &row, self.noise.field, None)?;
            if let Outcome::Accepted { dx, .. } = outcome {
                correction += dx;
            }
            nis += outcome.nis();
        }
        self.x += correction;
        let yaw = self.angles[2];
        self.x[yaw] = wrap_angle(self.x[yaw]);
        Ok(nis)
    }

    fn row(&self, by_angle: &Matrix3<f64>, axis: usize) -> SVector<f64, N> {
        let mut row = SVector::zeros();
        for (column, &i) in self.angles.iter().enumerate() {
            row[i] = by_angle[(axis, column)];
        }
        row
    }

    pub(super) fn attitude(&self) -> Euler {
        let [roll, pitch, yaw] = self.angles.map(|i| self.x[i]);
        Euler { roll, pitch, yaw: wrap_angle(yaw) }
    }

    /// 1-sigma of roll, pitch and yaw, rad.
    pub(super) fn sigma(&self) -> [f64; 3] {
        self.angles.map(|i| self.p[(i, i)].sqrt())
    }
}

/// One step of the midpoint rule with the inputs held.
pub(super) fn midpoint<const N: usize>(
    x: &SVector<f64, N>,
    rates: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    dt: f64,
) -> SVector<f64, N> {
    let middle = x + rates(x) * (0.5 * dt);
    x + rates(&middle) * dt
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kalman::{Observation, update};

    #[test]
    fn the_sequential_field_update_is_the_joint_one() {
        // Catches innovations that are not reduced by what earlier axes have explained.
        let params = OrientationParams::default();
        let reference = Vector3::new(30.0, -4.0, 40.0);
        let start = Euler { roll: 0.1, pitch: -0.05, yaw: 0.7 };
        let mut filter = SprungFilter::new(&start, Noise::new(&params));
        let (mut joint_p, x0) = (filter.p, filter.x);
        let field = Vector3::new(20.0, -22.0, 41.0);
        let (h, by_angle) = predicted_field(&start, &reference);
        let rows: [_; 3] = [0, 1, 2].map(|a| filter.row(&by_angle, a).transpose());
        let obs = Observation { y: field - h, h: SMatrix::from_rows(&rows), r: Matrix3::identity() * 0.36 };
        let Outcome::Accepted { dx, nis } = update(&mut joint_p, &obs, None).unwrap() else { panic!() };
        let sequential = filter.update(&field, &reference).unwrap();
        assert!((filter.x - x0 - dx).norm() < 1e-12 && (filter.p - joint_p).norm() < 1e-15);
        assert!((sequential - nis).abs() < 1e-9 * nis);
    }

    #[test]
    fn a_filter_stays_where_the_field_says_it_is() {
        let reference = Vector3::new(30.0, -4.0, 40.0);
        let start = Euler { roll: 0.02, pitch: 0.01, yaw: -2.0 };
        let mut filter = GyroFilter::new(&start, Noise::new(&OrientationParams::default()));
        let field = predicted_field(&start, &reference).0;
        for _ in 0..100 {
            filter.predict(0.0, Rates::Euler, 0.01);
            assert!(filter.update(&field, &reference).unwrap() < 1e-20);
        }
        assert!((filter.attitude().yaw + 2.0).abs() < 1e-12);
    }
}
