//! The error-state filter over a flat Earth: nominal state, fifteen errors, prediction and updates.
//!
//! The errors are those of [`super::errors`]. Source: SPEC motion 2, after Lee et al. 2010, section 2.
//! The Earth's rotation is left out: a car's gyro bias swallows it.

use drivescope_drive::frames::{exp_rotation, orthonormalize};
use nalgebra::{Matrix3, Vector3};

use super::errors::{ACCEL_BIAS, ATTITUDE, Covariance, GYRO_BIAS, Noise, POSITION, STATES, VELOCITY};
use super::tuning::Tuning;
use crate::kalman::symmetrize;

/// Steps between two repairs of the rotation: rounding damages it by 1e-16 a step.
const STEPS_PER_REPAIR: u32 = 1000;

/// One scalar measurement, linearized: `z = h . errors + noise`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Measured minus indicated.
    pub z: f64,
    /// Its derivative by the errors.
    pub h: [f64; STATES],
    /// Variance of its noise.
    pub variance: f64,
}

impl Row {
    /// A row without derivative yet.
    pub fn new(z: f64, sigma: f64) -> Self {
        Self { z, h: [0.0; STATES], variance: sigma * sigma }
    }
    /// The same with the derivative by the three errors from `first` on.
    pub fn by(mut self, first: usize, derivative: &Vector3<f64>) -> Self {
        self.h[first..first + 3].copy_from_slice(derivative.as_slice());
        self
    }
}

/// What a measurement was worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Normalized innovation squared.
    pub nis: f64,
    /// How many numbers were measured.
    pub rows: usize,
    /// Whether it was applied.
    pub is_accepted: bool,
}

/// Nominal state and covariance of its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    /// North, east, down, m.
    pub position: Vector3<f64>,
    /// Velocity, north, east, down, m/s.
    pub velocity: Vector3<f64>,
    /// Rotation from body to navigation axes.
    pub rotation: Matrix3<f64>,
    /// Gyro biases, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// Accelerometer biases, m/s^2.
    pub accel_bias: Vector3<f64>,
    /// Body rates at the last sample, less their biases, rad/s.
    pub rate: Vector3<f64>,
    /// Covariance of the errors.
    pub p: Covariance,
    steps: u32,
}

impl Filter {
    /// Start from a rotation, at rest at the origin.
    pub fn new(rotation: Matrix3<f64>, gyro_bias: Vector3<f64>, p: Covariance) -> Self {
        Self {
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            rotation,
            gyro_bias,
            accel_bias: Vector3::zeros(),
            rate: Vector3::zeros(),
            p,
            steps: 0,
        }
    }

    /// Move on by `dt` s with a specific force (m/s^2) and body rates (rad/s) as measured.
    pub fn predict(&mut self, force: &Vector3<f64>, rate: &Vector3<f64>, dt: f64, tuning: &Tuning) {
        self.rate = rate - self.gyro_bias;
        let half_turn = exp_rotation(&(self.rate * (0.5 * dt)));
        let middle = self.rotation * half_turn;
        let force = middle * (force - self.accel_bias);
        propagate(&mut self.p, &force, &middle, dt, &tuning.noise);
        let mut acceleration = force;
        acceleration.z += tuning.gravity;
        self.position += self.velocity * dt + acceleration * (0.5 * dt * dt);
        self.velocity += acceleration * dt;
        self.rotation = middle * half_turn;
        self.steps += 1;
        if self.steps == STEPS_PER_REPAIR {
            self.steps = 0;
            self.rotation = orthonormalize(&self.rotation);
        }
    }

    /// Fold in measurements together: all of them, or none where they lie outside `gate` times their number.
    ///
    /// `None` where an innovation variance is not positive; nothing changes then.
    pub fn update(&mut self, rows: &[Row], gate: Option<f64>) -> Option<Verdict> {
        let before = self.p;
        let mut errors = [0.0; STATES];
        let mut nis = 0.0;
        for row in rows {
            match apply(&mut self.p, row, &mut errors) {
                Some(share) => nis += share,
                None => {
                    self.p = before;
                    return None;
                }
            }
        }
        // A statistic that is not a number is refused too.
        let is_accepted = nis <= gate.map_or(f64::MAX, |g| g * rows.len() as f64);
        if is_accepted {
            symmetrize(&mut self.p);
            self.correct(&errors);
        } else {
            self.p = before;
        }
        nis.is_finite().then_some(Verdict { nis, rows: rows.len(), is_accepted })
    }

    fn correct(&mut self, errors: &[f64; STATES]) {
        let three = |first: usize| Vector3::new(errors[first], errors[first + 1], errors[first + 2]);
        self.position += three(POSITION);
        self.velocity += three(VELOCITY);
        self.rotation = exp_rotation(&three(ATTITUDE)) * self.rotation;
        self.gyro_bias += three(GYRO_BIAS);
        self.accel_bias += three(ACCEL_BIAS);
    }

    /// Let `seconds` pass unseen: the car may have held its velocity, or not.
    pub fn wait(&mut self, seconds: f64, is_standing: bool) {
        // What a car may do meanwhile: 2 m/s^2, and turns of 0.2 rad/s.
        let (acceleration, turn) = if is_standing { (0.0, 0.0) } else { (2.0, 0.2) };
        let seconds = seconds.min(60.0);
        self.position += self.velocity * seconds;
        for axis in 0..3 {
            self.p[(VELOCITY + axis, VELOCITY + axis)] += (acceleration * seconds).powi(2);
            self.p[(POSITION + axis, POSITION + axis)] += (0.5 * acceleration * seconds * seconds).powi(2);
        }
        self.p[(ATTITUDE + 2, ATTITUDE + 2)] += (turn * seconds).min(3.0).powi(2);
    }

    /// Doubt the velocity and, where `position` is set, the position: too many measurements in a row were refused.
    pub fn open_up(&mut self, position: bool) {
        for axis in 0..3 {
            self.p[(VELOCITY + axis, VELOCITY + axis)] += 1.0;
            self.p[(ATTITUDE + axis, ATTITUDE + axis)] += 1e-4;
            if position {
                self.p[(POSITION + axis, POSITION + axis)] += 25.0;
            }
        }
    }

    /// Turn the whole state about the vertical through the origin by `angle` rad, known to `sigma` rad.
    ///
    /// What was estimated without a heading keeps its meaning: nothing that a car's own sensors say depends on it.
    pub fn turn(&mut self, angle: f64, sigma: f64) {
        let (sin, cos) = angle.sin_cos();
        let about = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        self.position = about * self.position;
        self.velocity = about * self.velocity;
        self.rotation = about * self.rotation;
        let mut full = Covariance::identity();
        for first in [POSITION, VELOCITY, ATTITUDE] {
            full.fixed_view_mut::<3, 3>(first, first).copy_from(&about);
        }
        self.p = full * self.p * full.transpose();
        // The angle's own error turns position, velocity and heading together.
        let (p, v) = (self.position, self.velocity);
        let mut lever = [0.0; STATES];
        (lever[POSITION], lever[POSITION + 1]) = (-p.y, p.x);
        (lever[VELOCITY], lever[VELOCITY + 1]) = (-v.y, v.x);
        lever[ATTITUDE + 2] = 1.0;
        for (column, factor) in lever.into_iter().enumerate() {
            for (row, other) in lever.into_iter().enumerate() {
                self.p[(row, column)] += sigma * sigma * factor * other;
            }
        }
    }

    /// Take the yaw of a car at rest as exact: directions are counted from it until a turn says where it points.
    pub fn count_from_yaw(&mut self) {
        self.p.fill_row(ATTITUDE + 2, 0.0);
        self.p.fill_column(ATTITUDE + 2, 0.0);
    }

    /// Sigma of one error.
    pub fn sigma(&self, state: usize) -> f64 {
        self.p[(state, state)].max(0.0).sqrt()
    }

    /// Whether state and variances are numbers and no variance is negative.
    pub fn is_sound(&self) -> bool {
        let sum = self.position.sum() + self.velocity.sum() + self.rotation.sum();
        let sum = sum + self.gyro_bias.sum() + self.accel_bias.sum();
        sum.abs() < 1e12 && (0..STATES).all(|k| self.p[(k, k)] >= 0.0 && self.p[(k, k)] < 1e18)
    }
}

/// `P <- F P F' + Q dt`. `F` is the identity but for `dt` (position by velocity), `-dt [force x]` and `-dt R` (velocity by
/// attitude and accelerometer bias) and `-dt R` (attitude by gyro bias); terms of `dt^2` are left out on purpose.
///
/// Columns of `P F'` are sums of columns of `P`; transposed and done again they are `F P F'`, for `P` is symmetric.
fn propagate(p: &mut Covariance, force: &Vector3<f64>, rotation: &Matrix3<f64>, dt: f64, noise: &Noise) {
    let f = force * -dt;
    let b = rotation * -dt;
    for pass in 0..2 {
        let c = &mut p.data.0;
        for i in 0..3 {
            add(c, POSITION + i, VELOCITY + i, dt);
        }
        let tilt = [[0.0, -f.z, f.y], [f.z, 0.0, -f.x], [-f.y, f.x, 0.0]];
        for (i, tilt) in tilt.iter().enumerate() {
            for (j, tilt) in tilt.iter().enumerate() {
                if i != j {
                    add(c, VELOCITY + i, ATTITUDE + j, *tilt);
                }
                add(c, VELOCITY + i, ACCEL_BIAS + j, b[(i, j)]);
            }
        }
        for i in 0..3 {
            for j in 0..3 {
                add(c, ATTITUDE + i, GYRO_BIAS + j, b[(i, j)]);
            }
        }
        if pass == 0 {
            p.transpose_mut();
        }
    }
    for (first, density) in
        [(VELOCITY, noise.accel), (ATTITUDE, noise.gyro), (GYRO_BIAS, noise.gyro_bias), (ACCEL_BIAS, noise.accel_bias)]
    {
        for k in first..first + 3 {
            p[(k, k)] += density * dt;
        }
    }
}

/// Column `to` += `factor` times column `from`, which comes after it.
#[inline(always)]
fn add(columns: &mut [[f64; STATES]; STATES], to: usize, from: usize, factor: f64) {
    let (left, right) = columns.split_at_mut(from);
    for (a, b) in left[to].iter_mut().zip(&right[0]) {
        *a += b * factor;
    }
}

/// Joseph form of one row as two rank-one steps; returns its share of the normalized innovation squared.
fn apply(p: &mut Covariance, row: &Row, errors: &mut [f64; STATES]) -> Option<f64> {
    let ph = times(p, &row.h);
    let (mut innovation, mut s) = (row.z, row.variance);
    for k in 0..STATES {
        innovation -= row.h[k] * errors[k];
        s += row.h[k] * ph[k];
    }
    if !(s > 0.0 && s < f64::INFINITY) {
        return None;
    }
    let gain = ph.map(|v| v / s);
    for (column, factor) in p.data.0.iter_mut().zip(ph) {
        column.iter_mut().zip(&gain).for_each(|(p, k)| *p -= k * factor);
    }
    let left = times(p, &row.h);
    let back: [f64; STATES] = std::array::from_fn(|k| gain[k] * row.variance - left[k]);
    for (column, factor) in p.data.0.iter_mut().zip(gain) {
        column.iter_mut().zip(&back).for_each(|(p, b)| *p += b * factor);
    }
    errors.iter_mut().zip(&gain).for_each(|(e, k)| *e += k * innovation);
    Some(innovation * innovation / s)
}

/// `P h`, without the zeros of `h`.
fn times(p: &Covariance, h: &[f64; STATES]) -> [f64; STATES] {
    let mut product = [0.0; STATES];
    for (column, factor) in p.data.0.iter().zip(h).filter(|(_, f)| **f != 0.0) {
        product.iter_mut().zip(column).for_each(|(o, v)| *o += v * factor);
    }
    product
}

#[cfg(test)]
pub(super) mod tests {
    use nalgebra::SMatrix;

    use super::*;
    use crate::kalman::{self, Observation};
    use crate::land_ins::LandInsParams;
    use drivescope_drive::drive::LogStart;
    use drivescope_drive::frames::{body_to_nav, skew};
    use nalgebra::SVector;

    const START: LogStart = LogStart { imu_step: 0.01, ..LogStart::UNKNOWN };

    pub(crate) fn tuning() -> Tuning {
        Tuning::new(&LandInsParams::default(), &START)
    }

    pub(crate) fn moving() -> Filter {
        let mut filter =
            Filter::new(body_to_nav(0.02, -0.03, 1.0), Vector3::new(1e-3, -2e-3, 3e-3), tuning().initial_covariance);
        filter.velocity = Vector3::new(6.0, 9.0, 0.2);
        filter.position = Vector3::new(100.0, -50.0, 2.0);
        for k in 0..300 {
            let t = f64::from(k) * 0.01;
            let force = Vector3::new(t.sin(), 2.0 * t.cos(), -9.8);
            filter.predict(&force, &Vector3::new(0.02 * t.sin(), 0.01, 0.3), 0.01, &tuning());
        }
        filter
    }

    /// The transition as the specification writes it, dense.
    fn transition(force: &Vector3<f64>, rotation: &Matrix3<f64>, dt: f64) -> Covariance {
        let mut f = Covariance::identity();
        f.fixed_view_mut::<3, 3>(POSITION, VELOCITY).fill_with_identity();
        f.fixed_view_mut::<3, 3>(POSITION, VELOCITY).scale_mut(dt);
        f.fixed_view_mut::<3, 3>(VELOCITY, ATTITUDE).copy_from(&(skew(force) * -dt));
        f.fixed_view_mut::<3, 3>(VELOCITY, ACCEL_BIAS).copy_from(&(rotation * -dt));
        f.fixed_view_mut::<3, 3>(ATTITUDE, GYRO_BIAS).copy_from(&(rotation * -dt));
        f
    }

    #[test]
    fn sparse_propagation_is_the_dense_product() {
        let before = moving().p;
        let (force, rotation) = (Vector3::new(1.0, -2.0, -9.6), body_to_nav(0.1, -0.2, 0.7));
        let (dt, noise) = (0.01, tuning().noise);
        let mut sparse = before;
        propagate(&mut sparse, &force, &rotation, dt, &noise);
        let f = transition(&force, &rotation, dt);
        let mut dense = f * before * f.transpose();
        for (first, density) in [
            (VELOCITY, noise.accel),
            (ATTITUDE, noise.gyro),
            (GYRO_BIAS, noise.gyro_bias),
            (ACCEL_BIAS, noise.accel_bias),
        ] {
            (first..first + 3).for_each(|k| dense[(k, k)] += density * dt);
        }
        assert!((sparse - dense).amax() < 1e-12 * dense.amax());
    }

    /// Errors of a state against one near it, in the order of the filter.
    fn errors(true_state: &Filter, indicated: &Filter) -> SVector<f64, STATES> {
        let mut e = SVector::<f64, STATES>::zeros();
        let attitude = drivescope_drive::frames::log_rotation(&(true_state.rotation * indicated.rotation.transpose()));
        for (first, value) in [
            (POSITION, true_state.position - indicated.position),
            (VELOCITY, true_state.velocity - indicated.velocity),
            (ATTITUDE, attitude),
            (GYRO_BIAS, true_state.gyro_bias - indicated.gyro_bias),
            (ACCEL_BIAS, true_state.accel_bias - indicated.accel_bias),
        ] {
            e.fixed_rows_mut::<3>(first).copy_from(&value);
        }
        e
    }

    /// Catches a sign or a missing block: each error is put into the state, moved on, and compared with the transition. What
    /// is left is of order dt^2.
    #[test]
    fn the_transition_is_the_derivative_of_the_prediction() {
        let (base, dt, step) = (moving(), 1e-3, 1e-4);
        let (force, rate) = (Vector3::new(0.5, 1.5, -9.7), Vector3::new(0.05, -0.02, 0.3));
        let mut moved = base.clone();
        moved.predict(&force, &rate, dt, &tuning());
        let middle = base.rotation * exp_rotation(&((rate - base.gyro_bias) * (0.5 * dt)));
        let f = transition(&(middle * (force - base.accel_bias)), &middle, dt);
        for k in 0..STATES {
            let mut dx = [0.0; STATES];
            dx[k] = step;
            let mut other = base.clone();
            other.correct(&dx);
            other.predict(&force, &rate, dt, &tuning());
            let column = errors(&other, &moved) / step;
            let difference = (column - f.column(k)).amax();
            // dt^2 times a force of 10 is 1e-5.
            assert!(difference < 2e-5, "error {k}: {difference}");
        }
    }

    #[test]
    fn rows_folded_in_one_by_one_are_the_joint_update_with_its_gate() {
        let mut filter = moving();
        let rows: [Row; 3] = std::array::from_fn(|i| Row {
            z: [0.3, -0.5, 0.2][i],
            h: std::array::from_fn(|k| ((7 * i + 3 * k) as f64).sin()),
            variance: [0.3, 0.1, 0.2][i],
        });
        let before = filter.clone();
        let mut joint = filter.p;
        let h = SMatrix::<f64, 3, STATES>::from_fn(|r, c| rows[r].h[c]);
        let y = SVector::<f64, 3>::from_fn(|r, _| rows[r].z);
        let r = SMatrix::<f64, 3, 3>::from_diagonal(&SVector::from_fn(|r, _| rows[r].variance));
        let outcome = kalman::update(&mut joint, &Observation { y, h, r }, None).unwrap();
        let verdict = filter.update(&rows, None).unwrap();
        assert!((verdict.nis - outcome.nis()).abs() < 1e-10 && (filter.p - joint).amax() < 1e-9);
        let mut refused = before.clone();
        let verdict = refused.update(&rows, Some(0.99 * outcome.nis() / 3.0)).unwrap();
        assert!(!verdict.is_accepted && refused == before, "a refused measurement leaves no trace");
        let broken = [Row { z: f64::NAN, ..rows[0] }];
        assert!(refused.update(&broken, None).is_none() && refused == before);
    }

    /// A drive estimated without a heading and turned afterwards is the drive estimated with it.
    #[test]
    fn turning_the_state_afterwards_is_starting_with_the_heading() {
        let mut without = moving();
        let mut with = without.clone();
        with.turn(0.8, 0.0);
        for k in 0..200 {
            let t = f64::from(k) * 0.01;
            let (force, rate) = (Vector3::new(t.cos(), 1.0, -9.8), Vector3::new(0.01, 0.02, 0.2 * t.sin()));
            without.predict(&force, &rate, 0.01, &tuning());
            with.predict(&force, &rate, 0.01, &tuning());
        }
        without.turn(0.8, 0.0);
        assert!((with.position - without.position).norm() < 1e-9 && (with.rotation - without.rotation).norm() < 1e-12);
        assert!((with.p - without.p).amax() < 1e-9 * with.p.amax());
    }
}
