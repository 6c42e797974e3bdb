//! Third filter: road grade apart from the pitch of the body on its suspension.
//!
//! State: speed, m/s; road grade, rad; body pitch, rad; its rate, rad/s; bias of the forward accelerometer, m/s^2;
//! altitude, m. Inputs from the first filter: forward acceleration without gravity, and forward specific force, m/s^2.
//! Measurements: wheel speed, barometric altitude, GNSS vertical velocity.
//! Source: SPEC slope 7 (future work of Kim, Kim & Lee 2014). Squat follows the specific force, not the acceleration over
//! ground: a car that stands on a hill squats. Grade noise grows with distance: a standing car's grade does not change.
//! Not modelled: body pitch excited by the road (speed bumps); part of it appears in the grade.

use nalgebra::{SMatrix, SVector, matrix, vector};

use super::GRAVITY;
use super::params::SlopeParams;
use crate::kalman::{NotPositiveDefinite, Outcome, predict, transition, update_scalar};

pub(super) const SPEED: usize = 0;
pub(super) const GRADE: usize = 1;
pub(super) const BODY_PITCH: usize = 2;
pub(super) const BODY_PITCH_RATE: usize = 3;
pub(super) const ACCEL_BIAS: usize = 4;
pub(super) const ALTITUDE: usize = 5;

/// Longest step of the midpoint rule, s.
const LONGEST_STEP: f64 = 0.0101;

type State = SVector<f64, 6>;
type Matrix = SMatrix<f64, 6, 6>;

/// The body's pitch on its suspension: a damped oscillator driven by specific force.
#[derive(Clone, Copy, Debug)]
struct Suspension {
    /// Square of the natural frequency, 1/s^2.
    stiffness: f64,
    /// Twice damping ratio times frequency, 1/s.
    damping: f64,
    /// Static squat, rad per m/s^2.
    squat: f64,
}

/// `dx/dt` for the forward acceleration `u` (without gravity) and the forward specific force `a`.
fn derivative(x: &State, body: &Suspension, u: f64, a: f64) -> State {
    let [v, theta, p, q, b, _] = x.data.0[0];
    vector![
        u - b - GRAVITY * (theta + p).sin(),
        0.0,
        q,
        -body.stiffness * p - body.damping * q + body.stiffness * body.squat * (a - b),
        0.0,
        v * theta.sin(),
    ]
}

/// Jacobian of [`derivative`] with respect to the state.
fn jacobian(x: &State, body: &Suspension) -> Matrix {
    let (sin, cos) = x[GRADE].sin_cos();
    let g = -GRAVITY * (x[GRADE] + x[BODY_PITCH]).cos();
    let Suspension { stiffness, damping, squat } = *body;
    matrix![
        0.0, g,                g,          0.0,      -1.0,               0.0;
        0.0, 0.0,              0.0,        0.0,      0.0,                0.0;
        0.0, 0.0,              0.0,        1.0,      0.0,                0.0;
        0.0, 0.0,              -stiffness, -damping, -stiffness * squat, 0.0;
        0.0, 0.0,              0.0,        0.0,      0.0,                0.0;
        sin, x[SPEED] * cos,   0.0,        0.0,      0.0,                0.0;
    ]
}

/// What an update of an aid did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Aid {
    /// Normalized innovation squared; NaN without a measurement or when it only started the state.
    pub(super) nis: f64,
    /// Whether the gate refused the measurement.
    pub(super) is_rejected: bool,
}

/// State, covariance and noise of the grade filter.
#[derive(Clone, Debug)]
pub(super) struct GradeFilter {
    pub(super) x: State,
    pub(super) p: Matrix,
    has_altitude: bool,
    body: Suspension,
    rate: State,
    rate_per_speed: f64,
    baro_variance: f64,
    gnss_variance: f64,
    gate: f64,
}

impl GradeFilter {
    pub(super) fn new(params: &SlopeParams, speed: f64) -> Self {
        let walks = vector![
            params.grade_speed_walk,
            params.grade_walk_time,
            0.0,
            params.body_pitch_walk,
            params.accel_bias_walk,
            params.altitude_walk
        ];
        let frequency = params.pitch_frequency;
        let mut filter = Self {
            x: State::zeros(),
            p: Matrix::zeros(),
            has_altitude: false,
            body: Suspension {
                stiffness: frequency * frequency,
                damping: 2.0 * params.pitch_damping_ratio * frequency,
                squat: params.squat_gain,
            },
            rate: walks.component_mul(&walks),
            rate_per_speed: params.grade_walk_distance.powi(2),
            baro_variance: params.baro_sigma.powi(2),
            gnss_variance: params.gnss_sigma.powi(2),
            gate: params.aid_gate,
        };
        filter.restart(speed);
        filter
    }

    /// Forget everything but the speed.
    pub(super) fn restart(&mut self, speed: f64) {
        self.x = State::zeros();
        self.x[SPEED] = speed;
        self.p = Matrix::from_diagonal(&vector![0.5, 0.1, 0.01, 0.05, 0.10, 1.0].map(|s: f64| s * s));
        self.has_altitude = false;
    }

    /// Advance by `dt`, in steps that the pitch oscillation allows.
    pub(super) fn predict(&mut self, dt: f64, u: f64, a: f64) {
        let steps = (dt / LONGEST_STEP).ceil().max(1.0);
        let h = dt / steps;
        for _ in 0..steps as usize {
            let phi = transition(&jacobian(&self.x, &self.body), h);
            let middle = self.x + derivative(&self.x, &self.body, u, a) * (0.5 * h);
            self.x += derivative(&middle, &self.body, u, a) * h;
            let mut noise = self.rate;
            noise[GRADE] += self.rate_per_speed * self.x[SPEED].abs();
            predict(&mut self.p, &phi, &Matrix::from_diagonal(&(noise * h)));
        }
    }

    /// Fold in the wheel speed; NaN if there is none.
    pub(super) fn update_wheel(&mut self, wheel: f64, sigma: f64) -> Result<f64, NotPositiveDefinite> {
        if !wheel.is_finite() {
            return Ok(f64::NAN);
        }
        let row = vector![1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        Ok(self.fold(wheel - self.x[SPEED], &row, sigma * sigma, None)?.nis)
    }

    /// Fold in a barometric altitude; the first one sets the altitude.
    pub(super) fn update_altitude(&mut self, altitude: f64) -> Result<Aid, NotPositiveDefinite> {
        let none = Aid { nis: f64::NAN, is_rejected: false };
        if !altitude.is_finite() {
            return Ok(none);
        }
        if !self.has_altitude {
            self.has_altitude = true;
            self.x[ALTITUDE] = altitude;
            self.p.row_mut(ALTITUDE).fill(0.0);
            self.p.column_mut(ALTITUDE).fill(0.0);
            self.p[(ALTITUDE, ALTITUDE)] = self.baro_variance;
            return Ok(none);
        }
        let row = vector![0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        self.fold(altitude - self.x[ALTITUDE], &row, self.baro_variance, Some(self.gate))
    }

    /// Fold in the velocity upward that a satellite receiver gives.
    pub(super) fn update_climb(&mut self, upward: f64) -> Result<Aid, NotPositiveDefinite> {
        if !upward.is_finite() {
            return Ok(Aid { nis: f64::NAN, is_rejected: false });
        }
        let (sin, cos) = self.x[GRADE].sin_cos();
        let v = self.x[SPEED];
        let row = vector![sin, v * cos, 0.0, 0.0, 0.0, 0.0];
        self.fold(upward - v * sin, &row, self.gnss_variance, Some(self.gate))
    }

    fn fold(&mut self, y: f64, row: &State, variance: f64, gate: Option<f64>) -> Result<Aid, NotPositiveDefinite> {
        let outcome = update_scalar(&mut self.p, y, row, variance, gate)?;
        if let Outcome::Accepted { dx, .. } = outcome {
            self.x += dx;
        }
        Ok(Aid { nis: outcome.nis(), is_rejected: matches!(outcome, Outcome::Rejected { .. }) })
    }

    pub(super) fn is_sound(&self) -> bool {
        super::is_sound(&self.x, &self.p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::assert_jacobian;

    const BODY: Suspension = Suspension { stiffness: 68.89, damping: 4.98, squat: 0.005 };

    #[test]
    fn the_grade_jacobian_is_the_derivative_of_the_grade_model() {
        for x in [
            vector![20.0, 0.1, -0.02, 0.3, 0.2, 120.0],
            vector![0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            vector![-3.0, -0.3, 0.05, -0.1, -0.4, -50.0],
        ] {
            assert_jacobian(|x| derivative(x, &BODY, 1.0, 2.0), &jacobian(&x, &BODY), &x, 1e-7);
        }
    }

    #[test]
    fn the_body_settles_at_the_static_squat_of_the_specific_force() {
        // Catches squat driven by the acceleration over ground (0 here), and a wrong oscillator.
        let mut filter = GradeFilter::new(&SlopeParams::default(), 0.0);
        filter.x[GRADE] = 0.2;
        let a = GRAVITY * 0.2f64.sin();
        for _ in 0..1000 {
            filter.predict(0.01, a, a);
        }
        // Ten seconds are 25 decay times: what is left of the oscillation is below 1e-10.
        assert!((filter.x[BODY_PITCH] - 0.005 * a).abs() < 1e-9, "{}", filter.x[BODY_PITCH]);
    }

    #[test]
    fn the_first_altitude_only_sets_the_altitude() {
        let mut filter = GradeFilter::new(&SlopeParams::default(), 10.0);
        filter.predict(1.0, 0.0, 0.0);
        let before = filter.clone();
        assert!(filter.update_altitude(250.0).unwrap().nis.is_nan());
        assert_eq!(filter.x[ALTITUDE], 250.0);
        assert_eq!(filter.x.fixed_rows::<5>(0), before.x.fixed_rows::<5>(0));
        assert_eq!(filter.p.column(ALTITUDE).sum(), 0.09);
        assert!(filter.update_altitude(900.0).unwrap().is_rejected, "650 m at once is outside any gate");
    }
}
