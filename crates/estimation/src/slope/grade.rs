//! Third filter: road grade apart from the pitch of the body on its suspension.
//!
//! State: speed, m/s; road grade, rad; body pitch, rad; its rate, rad/s; bias of the forward accelerometer, m/s^2;
//! altitude, m. Inputs from the first filter: forward acceleration without gravity, and forward specific force, m/s^2.
//! Measurements: wheel speed, barometric altitude, GNSS vertical velocity.
//! Source: SPEC slope 7 (future work of Kim, Kim & Lee 2014). Squat follows the specific force, not the acceleration over
//! ground: a car that stands on a hill squats. Grade noise grows with distance: a standing car's grade does not change.
//! Not modelled: body pitch excited by the road (speed bumps); part of it appears in the grade.

use nalgebra::{SMatrix, SVector, vector};

use super::GRAVITY;
use super::params::SlopeParams;
use crate::kalman::{NotPositiveDefinite, Outcome, propagate, update_sparse};

pub(super) const SPEED: usize = 0;
pub(super) const GRADE: usize = 1;
pub(super) const BODY_PITCH: usize = 2;
pub(super) const BODY_PITCH_RATE: usize = 3;
pub(super) const ACCEL_BIAS: usize = 4;
pub(super) const ALTITUDE: usize = 5;

/// Longest step of the midpoint rule, s.
const LONGEST_STEP: f64 = 0.0101;

pub(super) type State = SVector<f64, 6>;
pub(super) type Matrix = SMatrix<f64, 6, 6>;

/// The body's pitch on its suspension: a damped oscillator driven by specific force.
#[derive(Clone, Copy, Debug)]
pub(super) struct Suspension {
    /// Square of the natural frequency, 1/s^2.
    stiffness: f64,
    /// Twice damping ratio times frequency, 1/s.
    damping: f64,
    /// Static squat, rad per m/s^2.
    squat: f64,
}

/// Sines and cosines that a step needs.
#[derive(Clone, Copy, Debug)]
struct Angles {
    sin_grade: f64,
    cos_grade: f64,
    sin_body: f64,
    cos_body: f64,
}

impl Angles {
    fn new(x: &State) -> Self {
        let (sin_grade, cos_grade) = x[GRADE].sin_cos();
        let (sin_body, cos_body) = (x[GRADE] + x[BODY_PITCH]).sin_cos();
        Self { sin_grade, cos_grade, sin_body, cos_body }
    }
}

/// `dx/dt` for the forward acceleration `u` (without gravity) and the forward specific force `a`, with the sines of the
/// grade and of the grade and body pitch together.
fn derivative(x: &State, body: &Suspension, u: f64, a: f64, sin_grade: f64, sin_body: f64) -> State {
    let [v, _, p, q, b, _] = x.data.0[0];
    vector![
        u - b - GRAVITY * sin_body,
        0.0,
        q,
        -body.stiffness * p - body.damping * q + body.stiffness * body.squat * (a - b),
        0.0,
        v * sin_grade,
    ]
}

/// The states that change within a step.
const CHANGING: [usize; 4] = [SPEED, BODY_PITCH, BODY_PITCH_RATE, ALTITUDE];

/// The entries of the Jacobian of [`derivative`] in the rows of [`CHANGING`]; the other rows are zero.
struct Rates {
    gravity: f64,
    body: Suspension,
    climb_per_speed: f64,
    climb_per_grade: f64,
}

impl Rates {
    fn new(x: &State, body: &Suspension, angles: &Angles) -> Self {
        Self {
            gravity: -GRAVITY * angles.cos_body,
            body: *body,
            climb_per_speed: angles.sin_grade,
            climb_per_grade: x[SPEED] * angles.cos_grade,
        }
    }

    /// The entries that are not zero of `A h + (A h)^2 / 2`.
    fn change(&self, h: f64) -> Change {
        let Self { gravity: g, body, climb_per_speed: s, climb_per_grade: c } = *self;
        let Suspension { stiffness: k, damping: d, squat } = body;
        let (half, ks) = (0.5 * h * h, k * squat);
        Change {
            speed: [(GRADE, g * h), (BODY_PITCH, g * h), (BODY_PITCH_RATE, g * half), (ACCEL_BIAS, -h)],
            pitch: [(BODY_PITCH, -k * half), (BODY_PITCH_RATE, h - d * half), (ACCEL_BIAS, -ks * half)],
            rate: [
                (BODY_PITCH, -k * h + d * k * half),
                (BODY_PITCH_RATE, -d * h + (d * d - k) * half),
                (ACCEL_BIAS, -ks * h + d * ks * half),
            ],
            altitude: [
                (SPEED, s * h),
                (GRADE, c * h + s * g * half),
                (BODY_PITCH, s * g * half),
                (ACCEL_BIAS, -s * half),
            ],
        }
    }
}

/// Rows of a transition less the identity, in the order of [`CHANGING`].
struct Change {
    speed: [(usize, f64); 4],
    pitch: [(usize, f64); 3],
    rate: [(usize, f64); 3],
    altitude: [(usize, f64); 4],
}

impl Change {
    fn rows(&self) -> [&[(usize, f64)]; 4] {
        [&self.speed, &self.pitch, &self.rate, &self.altitude]
    }
}

/// Jacobian of [`derivative`] with respect to the state.
pub(super) fn jacobian(x: &State, body: &Suspension) -> Matrix {
    let rates = Rates::new(x, body, &Angles::new(x));
    let Suspension { stiffness, damping, squat } = *body;
    let mut a = Matrix::zeros();
    for (row, column, value) in [
        (SPEED, GRADE, rates.gravity),
        (SPEED, BODY_PITCH, rates.gravity),
        (SPEED, ACCEL_BIAS, -1.0),
        (BODY_PITCH, BODY_PITCH_RATE, 1.0),
        (BODY_PITCH_RATE, BODY_PITCH, -stiffness),
        (BODY_PITCH_RATE, BODY_PITCH_RATE, -damping),
        (BODY_PITCH_RATE, ACCEL_BIAS, -stiffness * squat),
        (ALTITUDE, SPEED, rates.climb_per_speed),
        (ALTITUDE, GRADE, rates.climb_per_grade),
    ] {
        a[(row, column)] = value;
    }
    a
}

/// Row of the vertical velocity `v sin(grade)`.
pub(super) fn climb_row(x: &State) -> [(usize, f64); 2] {
    let (sin, cos) = x[GRADE].sin_cos();
    [(SPEED, sin), (GRADE, x[SPEED] * cos)]
}

/// What the altitude counts from; the better source replaces the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Datum {
    /// The start of the drive.
    Start,
    /// The receiver's ellipsoid.
    Gnss,
    /// The barometer's pressure level.
    Baro,
}

/// What an update of an aid did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Aid {
    /// Normalized innovation squared; NaN without a measurement or when it only started the state.
    pub(super) nis: f64,
    /// Whether the gate refused the measurement.
    pub(super) is_rejected: bool,
}

impl Suspension {
    pub(super) fn new(params: &SlopeParams) -> Self {
        let frequency = params.pitch_frequency;
        Self {
            stiffness: frequency * frequency,
            damping: 2.0 * params.pitch_damping_ratio * frequency,
            squat: params.squat_gain,
        }
    }
}

/// State, covariance and noise of the grade filter.
#[derive(Clone, Debug)]
pub(super) struct GradeFilter {
    pub(super) x: State,
    pub(super) p: Matrix,
    /// What the altitude counts from.
    datum: Datum,
    body: Suspension,
    rate: State,
    rate_per_speed: f64,
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
        let mut filter = Self {
            x: State::zeros(),
            p: Matrix::zeros(),
            datum: Datum::Start,
            body: Suspension::new(params),
            rate: walks.component_mul(&walks),
            rate_per_speed: params.grade_walk_distance.powi(2),
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
        self.datum = Datum::Start;
    }

    /// Advance by `dt`, in steps that the pitch oscillation allows.
    pub(super) fn predict(&mut self, dt: f64, u: f64, a: f64) {
        let steps = (dt / LONGEST_STEP).ceil().max(1.0);
        let h = dt / steps;
        for _ in 0..steps as usize {
            let angles = Angles::new(&self.x);
            let change = Rates::new(&self.x, &self.body, &angles).change(h);
            let start = derivative(&self.x, &self.body, u, a, angles.sin_grade, angles.sin_body);
            let middle = self.x + start * (0.5 * h);
            // The grade does not move within a step, so that its sine is that of the start.
            let sin_body = (middle[GRADE] + middle[BODY_PITCH]).sin();
            self.x += derivative(&middle, &self.body, u, a, angles.sin_grade, sin_body) * h;
            let mut noise = self.rate;
            noise[GRADE] += self.rate_per_speed * self.x[SPEED].abs();
            propagate(&mut self.p, &CHANGING, &change.rows(), &(noise * h));
        }
    }

    /// Fold in the wheel speed; NaN if there is none.
    pub(super) fn update_wheel(&mut self, wheel: f64, sigma: f64) -> Result<f64, NotPositiveDefinite> {
        if !wheel.is_finite() {
            return Ok(f64::NAN);
        }
        Ok(self.fold(wheel - self.x[SPEED], &[(SPEED, 1.0)], sigma * sigma, None)?.nis)
    }

    /// Fold in an altitude; the first one of each source sets the altitude, a receiver's counts only before a barometer's.
    pub(super) fn update_altitude(
        &mut self,
        altitude: f64,
        variance: f64,
        source: Datum,
    ) -> Result<Aid, NotPositiveDefinite> {
        let none = Aid { nis: f64::NAN, is_rejected: false };
        if !altitude.is_finite() || source < self.datum {
            return Ok(none);
        }
        if source > self.datum {
            self.datum = source;
            self.x[ALTITUDE] = altitude;
            self.p.row_mut(ALTITUDE).fill(0.0);
            self.p.column_mut(ALTITUDE).fill(0.0);
            self.p[(ALTITUDE, ALTITUDE)] = variance;
            return Ok(none);
        }
        self.fold(altitude - self.x[ALTITUDE], &[(ALTITUDE, 1.0)], variance, Some(self.gate))
    }

    /// Fold in the velocity upward that a satellite receiver gives.
    pub(super) fn update_climb(&mut self, upward: f64) -> Result<Aid, NotPositiveDefinite> {
        if !upward.is_finite() {
            return Ok(Aid { nis: f64::NAN, is_rejected: false });
        }
        let row = climb_row(&self.x);
        self.fold(upward - self.x[SPEED] * row[0].1, &row, self.gnss_variance, Some(self.gate))
    }

    fn fold(
        &mut self,
        y: f64,
        row: &[(usize, f64)],
        variance: f64,
        gate: Option<f64>,
    ) -> Result<Aid, NotPositiveDefinite> {
        let outcome = update_sparse(&mut self.p, y, row, variance, gate)?;
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
    use crate::kalman::transition;
    use crate::testing::assert_jacobian;

    const BODY: Suspension = Suspension { stiffness: 68.89, damping: 4.98, squat: 0.005 };

    #[test]
    fn the_grade_jacobian_is_the_derivative_of_the_grade_model() {
        for x in [
            vector![20.0, 0.1, -0.02, 0.3, 0.2, 120.0],
            vector![0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            vector![-3.0, -0.3, 0.05, -0.1, -0.4, -50.0],
        ] {
            let rates = |x: &State| {
                let angles = Angles::new(x);
                derivative(x, &BODY, 1.0, 2.0, angles.sin_grade, angles.sin_body)
            };
            assert_jacobian(rates, &jacobian(&x, &BODY), &x, 1e-7);
        }
    }

    #[test]
    fn the_sparse_transition_is_the_second_order_one() {
        let x = vector![20.0, 0.1, -0.02, 0.3, 0.2, 120.0];
        let dense = transition(&jacobian(&x, &BODY), 0.01) - Matrix::identity();
        let change = Rates::new(&x, &BODY, &Angles::new(&x)).change(0.01);
        let mut sparse = Matrix::zeros();
        for (row, entries) in CHANGING.into_iter().zip(change.rows()) {
            entries.iter().for_each(|&(column, value)| sparse[(row, column)] = value);
        }
        assert!((dense - sparse).norm() < 1e-15, "{}", dense - sparse);
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
        assert!(filter.update_altitude(250.0, 0.09, Datum::Baro).unwrap().nis.is_nan());
        assert_eq!(filter.x[ALTITUDE], 250.0);
        assert_eq!(filter.x.fixed_rows::<5>(0), before.x.fixed_rows::<5>(0));
        assert_eq!(filter.p.column(ALTITUDE).sum(), 0.09);
        assert!(
            filter.update_altitude(900.0, 0.09, Datum::Baro).unwrap().is_rejected,
            "650 m at once is outside any gate"
        );
        let held = filter.clone();
        assert!(filter.update_altitude(251.0, 9.0, Datum::Gnss).unwrap().nis.is_nan());
        assert_eq!(filter.x, held.x, "the receiver's datum is another one");
    }
}
