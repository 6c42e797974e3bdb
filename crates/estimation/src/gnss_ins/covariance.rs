//! The covariance of the fifteen errors: propagation over a node of inertial samples, and updates.
//!
//! Departure from SPEC navigation 3: transition and noise are not multiplied up sample by sample; the rates of the
//! errors are averaged over the node (10 samples by default) and integrated once, to third order. The two differ by the
//! commutators of the rates inside one node; a test holds them together, and the cost falls by an order of magnitude.

use nalgebra::{Cholesky, SMatrix, SVector};

use crate::ins::{ACCEL_BIAS, ATTITUDE, ErrorRates, GYRO_BIAS, NAVIGATION_STATES, STATES, VELOCITY};
use crate::kalman::{NotPositiveDefinite, Outcome};

/// Error of the odometer's scale, indicated minus true.
pub const ODOMETER_SCALE: usize = STATES;
/// Error of the receiver clock's offset, m.
pub const CLOCK_BIAS: usize = STATES + 1;
/// Error of the receiver clock's drift, m/s.
pub const CLOCK_DRIFT: usize = STATES + 2;
/// Room for all errors: the fifteen of [`crate::ins`], the odometer's scale and the receiver clock. An error that a run does
/// not estimate has zero rows and columns.
pub const ALL_STATES: usize = STATES + 3;
/// Errors after those of navigation: six biases, odometer scale, clock.
const TAIL: usize = ALL_STATES - NAVIGATION_STATES;

/// Covariance of the errors.
pub type Covariance = SMatrix<f64, ALL_STATES, ALL_STATES>;
/// The errors.
pub type Errors = SVector<f64, ALL_STATES>;

/// Spectral densities of what drives the errors, and how fast the biases forget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcessNoise {
    /// Accelerometer noise, (m/s^2)^2 s.
    pub accel: f64,
    /// Gyro noise, (rad/s)^2 s.
    pub gyro: f64,
    /// Walk of the accelerometer biases, (m/s^2)^2 / s.
    pub accel_bias: f64,
    /// Walk of the gyro biases, (rad/s)^2 / s.
    pub gyro_bias: f64,
    /// Decay of the accelerometer biases, 1/s; 0 for a random walk.
    pub accel_bias_decay: f64,
    /// Decay of the gyro biases, 1/s; 0 for a random walk.
    pub gyro_bias_decay: f64,
    /// Walk of the odometer's scale, 1/s; 0 where it is not estimated.
    pub odometer_scale: f64,
    /// Noise of the receiver clock's offset, m^2/s; 0 where the clock is not estimated.
    pub clock_bias: f64,
    /// Noise of the receiver clock's drift, (m/s)^2/s.
    pub clock_drift: f64,
}

impl ProcessNoise {
    /// Density of the noise that drives one error.
    fn density(&self, state: usize) -> f64 {
        match state {
            CLOCK_BIAS.. => 0.0,
            ODOMETER_SCALE => self.odometer_scale,
            GYRO_BIAS.. => self.gyro_bias,
            ACCEL_BIAS.. => self.accel_bias,
            ATTITUDE.. => self.gyro,
            VELOCITY.. => self.accel,
            _ => 0.0,
        }
    }

    /// Rate at which a bias forgets, 1/s.
    fn decay(&self, state: usize) -> f64 {
        match state {
            ODOMETER_SCALE.. => 0.0,
            GYRO_BIAS.. => self.gyro_bias_decay,
            _ => self.accel_bias_decay,
        }
    }
}

/// Transition of the nine navigation errors over a node, and of the others (diagonal, but for the clock).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// Rows of the navigation errors.
    pub navigation: ErrorRates,
    /// What is left of each bias, of the odometer's scale and of the clock.
    pub tail: SVector<f64, TAIL>,
    /// Share of the clock's drift that goes into its offset, s.
    pub clock: f64,
}

/// `I + A (I + A/2 (I + A/3))` for rates that held for `time` seconds.
pub fn transition(rates: &ErrorRates, noise: &ProcessNoise, time: f64) -> Transition {
    let a = rates * time;
    let mut navigation = ErrorRates::zeros();
    let mut tail = SVector::<f64, TAIL>::from_element(1.0);
    for (i, order) in [3.0, 2.0, 1.0].into_iter().enumerate() {
        let scaled = a / order;
        let mut next = ErrorRates::zeros();
        if i > 0 {
            multiply(&scaled, &navigation, &tail, &mut next);
        } else {
            next = scaled;
        }
        for k in 0..NAVIGATION_STATES {
            next[(k, k)] += 1.0;
        }
        for (k, left) in tail.iter_mut().enumerate() {
            *left = 1.0 - noise.decay(NAVIGATION_STATES + k) * time / order * *left;
        }
        navigation = next;
    }
    Transition { navigation, tail, clock: time }
}

/// `out = a [top; 0 diag(bottom)]` added to zeros: the product of two matrices with diagonal bias rows.
fn multiply(a: &ErrorRates, top: &ErrorRates, bottom: &SVector<f64, TAIL>, out: &mut ErrorRates) {
    let a = &a.data.0;
    for (column, (out, top)) in out.data.0.iter_mut().zip(&top.data.0).enumerate() {
        for (factor, a) in top.iter().zip(a).filter(|(factor, _)| **factor != 0.0) {
            accumulate(out, a, *factor);
        }
        if column >= NAVIGATION_STATES {
            accumulate(out, &a[column], bottom[column - NAVIGATION_STATES]);
        }
    }
}

/// `out += a * factor`, element by element.
#[inline(always)]
fn accumulate<const N: usize>(out: &mut [f64; N], a: &[f64; N], factor: f64) {
    for (o, v) in out.iter_mut().zip(a) {
        *o += v * factor;
    }
}

/// `P <- Phi P Phi' + Q` over a node of `time` seconds in which the mean rates were `rates`.
///
/// White noise acts for `noise_time` seconds (more than `time` where samples were missing). It is carried through half
/// the node, `(I + A/2) Qc T (I + A/2)' + A Qc A' T / 12`: the Taylor series of the integral to second order, never indefinite.
pub fn propagate(
    p: &mut Covariance,
    rates: &ErrorRates,
    noise: &ProcessNoise,
    time: f64,
    noise_time: f64,
) -> Transition {
    let phi = transition(rates, noise, time);
    // Columns of `half` are rows of Phi P; P is symmetric, so its columns serve as rows.
    let mut half = [[0.0; ALL_STATES]; NAVIGATION_STATES];
    for (row, half) in half.iter_mut().enumerate() {
        for (column, p) in phi.navigation.data.0.iter().zip(&p.data.0) {
            if column[row] != 0.0 {
                accumulate(half, p, column[row]);
            }
        }
    }
    for (s, half) in half.iter().enumerate() {
        let mut column = [0.0; NAVIGATION_STATES];
        for (phi, factor) in phi.navigation.data.0.iter().zip(half) {
            accumulate(&mut column, phi, *factor);
        }
        p.data.0[s][..NAVIGATION_STATES].copy_from_slice(&column);
        for (k, (value, left)) in half[NAVIGATION_STATES..].iter().zip(phi.tail.iter()).enumerate() {
            let tail = NAVIGATION_STATES + k;
            p.data.0[s][tail] = value * left;
            p.data.0[tail][s] = value * left;
        }
    }
    for b in NAVIGATION_STATES..ALL_STATES {
        for c in NAVIGATION_STATES..ALL_STATES {
            p[(b, c)] *= phi.tail[b - NAVIGATION_STATES] * phi.tail[c - NAVIGATION_STATES];
        }
    }
    if noise.clock_bias > 0.0 {
        propagate_clock(p, noise, phi.clock, noise_time);
    }
    add_noise(p, rates, noise, time, noise_time);
    symmetrize(p);
    phi
}

/// The offset of the clock runs with its drift: rows, columns and noise of the pair.
fn propagate_clock(p: &mut Covariance, noise: &ProcessNoise, time: f64, noise_time: f64) {
    let drift = p.data.0[CLOCK_DRIFT];
    accumulate(&mut p.data.0[CLOCK_BIAS], &drift, time);
    for column in &mut p.data.0 {
        column[CLOCK_BIAS] += time * column[CLOCK_DRIFT];
    }
    let (offset, drift) = (noise.clock_bias * noise_time, noise.clock_drift * noise_time);
    p[(CLOCK_BIAS, CLOCK_BIAS)] += offset + drift * time * time / 3.0;
    p[(CLOCK_BIAS, CLOCK_DRIFT)] += 0.5 * drift * time;
    p[(CLOCK_DRIFT, CLOCK_BIAS)] += 0.5 * drift * time;
    p[(CLOCK_DRIFT, CLOCK_DRIFT)] += drift;
}

/// The lower triangle takes the upper's place: rounding leaves them 1e-16 apart.
fn symmetrize(p: &mut Covariance) {
    for column in 0..ALL_STATES {
        for row in column + 1..ALL_STATES {
            p.data.0[row][column] = p.data.0[column][row];
        }
    }
}

fn add_noise(p: &mut Covariance, rates: &ErrorRates, noise: &ProcessNoise, time: f64, noise_time: f64) {
    for source in VELOCITY..STATES {
        let variance = noise.density(source) * noise_time;
        let a = rates.data.0[source].map(|r| r * time);
        let mut middle = a.map(|v| 0.5 * v);
        if source < NAVIGATION_STATES {
            middle[source] += 1.0;
        }
        for s in 0..NAVIGATION_STATES {
            let (m, v) = (middle[s] * variance, a[s] * variance / 12.0);
            if m == 0.0 && v == 0.0 {
                continue;
            }
            for r in 0..NAVIGATION_STATES {
                p.data.0[s][r] += middle[r] * m + a[r] * v;
            }
            if source >= NAVIGATION_STATES {
                p.data.0[s][source] += m;
                p.data.0[source][s] += m;
            }
        }
        if source >= NAVIGATION_STATES {
            p[(source, source)] += variance;
        }
    }
    p[(ODOMETER_SCALE, ODOMETER_SCALE)] += noise.odometer_scale * noise_time;
}

/// Fold in `M` measurements with independent noise: gated together, then applied one after the other.
///
/// `z` is indicated minus measured, `h` its Jacobian with respect to the errors, `variance` the noise of each row. Where
/// `repeats` measurements share one error, which lasts, each is gated by its own noise but folded in with a variance so many
/// times as large; 1 where every error is new. With uncorrelated noise this then equals the joint Joseph update of
/// [`crate::kalman::update`]; zeros of `h` cost nothing.
///
/// # Errors
/// [`NotPositiveDefinite`] if the innovation covariance cannot be factored or is not finite; `p` is unchanged.
pub fn update<const M: usize>(
    p: &mut Covariance,
    z: &SVector<f64, M>,
    h: &SMatrix<f64, M, ALL_STATES>,
    variance: &SVector<f64, M>,
    repeats: f64,
    gate: Option<f64>,
) -> Result<Outcome<ALL_STATES>, NotPositiveDefinite> {
    let rows: [Row; M] = std::array::from_fn(|row| Row::new(h, row));
    let mut s = SMatrix::<f64, M, M>::from_diagonal(variance);
    for (column, row) in rows.iter().enumerate() {
        let ph = row.times(p);
        for (other, h) in rows.iter().enumerate() {
            s[(other, column)] += h.dot(&ph);
        }
    }
    let nis = z.dot(&Cholesky::new(s).ok_or(NotPositiveDefinite)?.solve(z));
    // A statistic that is not a number is refused too.
    if nis.is_nan() || nis > gate.unwrap_or(f64::MAX) {
        return Ok(Outcome::Rejected { nis });
    }
    let mut dx = Errors::zeros();
    for (k, row) in rows.iter().enumerate() {
        apply_row(p, z[k], row, variance[k] * repeats, &mut dx);
    }
    symmetrize(p);
    Ok(Outcome::Accepted { dx, nis })
}

/// One row of a Jacobian without its zeros.
struct Row {
    count: usize,
    index: [usize; ALL_STATES],
    value: [f64; ALL_STATES],
}

impl Row {
    fn new<const M: usize>(h: &SMatrix<f64, M, ALL_STATES>, row: usize) -> Self {
        let mut out = Self { count: 0, index: [0; ALL_STATES], value: [0.0; ALL_STATES] };
        for column in 0..ALL_STATES {
            let value = h[(row, column)];
            if value != 0.0 {
                out.index[out.count] = column;
                out.value[out.count] = value;
                out.count += 1;
            }
        }
        out
    }

    fn terms(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.index[..self.count].iter().copied().zip(self.value[..self.count].iter().copied())
    }

    /// `P` times the transpose of the row.
    fn times(&self, p: &Covariance) -> [f64; ALL_STATES] {
        let mut product = [0.0; ALL_STATES];
        for (column, factor) in self.terms() {
            accumulate(&mut product, &p.data.0[column], factor);
        }
        product
    }

    fn dot(&self, vector: &[f64; ALL_STATES]) -> f64 {
        self.terms().map(|(column, factor)| factor * vector[column]).sum()
    }
}

/// Joseph form of one row, as two rank-one steps: `A = (I - k h) P`, `P = A (I - k h)' + k r k'`.
fn apply_row(p: &mut Covariance, z: f64, h: &Row, variance: f64, dx: &mut Errors) {
    let ph = h.times(p);
    let s = variance + h.dot(&ph);
    let innovation = z - h.dot(&dx.data.0[0]);
    let gain = ph.map(|v| v / s);
    for (p, ph) in p.data.0.iter_mut().zip(&ph).filter(|(_, ph)| **ph != 0.0) {
        accumulate(p, &gain, -ph);
    }
    let left = h.times(p);
    let back: [f64; ALL_STATES] = std::array::from_fn(|k| gain[k] * variance - left[k]);
    for (p, gain) in p.data.0.iter_mut().zip(&gain).filter(|(_, gain)| **gain != 0.0) {
        accumulate(p, &back, *gain);
    }
    for (dx, gain) in dx.data.0[0].iter_mut().zip(&gain) {
        *dx += gain * innovation;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::{Earth, GravityModel, Navigation, error_rates};
    use crate::kalman;
    use drivescope_drive::frames::body_to_nav;
    use drivescope_drive::geodesy::Geodetic;
    use nalgebra::{Vector3, vector};

    const NOISE: ProcessNoise = ProcessNoise {
        accel: 4e-6,
        gyro: 4e-8,
        accel_bias: 4e-8,
        gyro_bias: 9e-12,
        accel_bias_decay: 0.0,
        gyro_bias_decay: 0.0,
        odometer_scale: 1e-8,
        clock_bias: 0.009,
        clock_drift: 0.0355,
    };

    fn full(rates: &ErrorRates, noise: &ProcessNoise) -> Covariance {
        let mut f = Covariance::zeros();
        f.fixed_view_mut::<NAVIGATION_STATES, STATES>(0, 0).copy_from(rates);
        for k in NAVIGATION_STATES..STATES {
            f[(k, k)] = -noise.decay(k);
        }
        f[(CLOCK_BIAS, CLOCK_DRIFT)] = 1.0;
        f
    }

    fn initial() -> Covariance {
        let sigma =
            [3.0, 3.0, 5.0, 0.2, 0.2, 0.2, 0.01, 0.01, 0.0873, 0.05, 0.05, 0.05, 3e-3, 3e-3, 3e-3, 0.01, 100.0, 10.0];
        Covariance::from_diagonal(&SVector::from(sigma.map(|s| s * s)))
    }

    /// The specification's way: a transition and a noise matrix per sample, multiplied up densely.
    fn sample_by_sample(p: &mut Covariance, rates: &[ErrorRates], noise: &ProcessNoise, dt: f64) {
        let clock = [(CLOCK_BIAS, noise.clock_bias), (CLOCK_DRIFT, noise.clock_drift)];
        let mut q = Covariance::from_diagonal(&SVector::from_fn(|k, _| noise.density(k) * dt));
        clock.iter().for_each(|(k, density)| q[(*k, *k)] = density * dt);
        for rates in rates {
            kalman::predict(p, &kalman::transition(&full(rates, noise), dt), &q);
        }
    }

    /// A braking, turning, shaking car: specific force and heading change inside each node.
    fn shaken_rates(k: usize) -> ErrorRates {
        let t = k as f64 * 0.01;
        let navigation = Navigation {
            place: Geodetic { lat: 0.63, lon: 2.2, alt: 20.0 },
            velocity: Vector3::new(20.0 - t, 5.0, 0.1),
            body_to_nav: body_to_nav(0.02 * (9.0 * t).sin(), 0.03, 0.5 * t),
        };
        let force = Vector3::new(-1.0 + 2.0 * (30.0 * t).sin(), 2.0 * (17.0 * t).cos(), -9.8 + 2.0 * (40.0 * t).sin());
        error_rates(&navigation, &force, &Earth::at(&navigation.place, GravityModel::Wgs84), true)
    }

    /// Catches a wrong block, a lost transpose, a wrong order of the series: 20 s of a shaken, turning car. The two ways
    /// differ by the rates' commutators (5e-4 of the change of a node) and by the end at which the noise enters (half a sample
    /// of one node); sigmas agree to a thousandth.
    #[test]
    fn propagation_by_nodes_agrees_with_the_dense_product_over_samples() {
        for noise in [NOISE, ProcessNoise { accel_bias_decay: 0.01, gyro_bias_decay: 0.02, ..NOISE }] {
            let (mut fast, mut dense) = (initial(), initial());
            for node in 0..200 {
                let rates: Vec<_> = (0..10).map(|i| shaken_rates(10 * node + i)).collect();
                sample_by_sample(&mut dense, &rates, &noise, 0.01);
                let mean = rates.iter().sum::<ErrorRates>() / 10.0;
                propagate(&mut fast, &mean, &noise, 0.1, 0.1);
            }
            for r in 0..ALL_STATES {
                for c in 0..ALL_STATES {
                    let scale = (dense[(r, r)] * dense[(c, c)]).sqrt();
                    let error = (fast[(r, c)] - dense[(r, c)]) / scale;
                    assert!(error.abs() < 1e-3, "P[{r},{c}] off by {error:e}: {} {}", fast[(r, c)], dense[(r, c)]);
                }
            }
            assert_eq!(fast, fast.transpose());
        }
    }

    /// With rates that do not change the third-order series is the matrix exponential to (A T)^4 / 24.
    #[test]
    fn the_transition_is_the_exponential_of_constant_rates() {
        let noise = ProcessNoise { accel_bias_decay: 0.1, gyro_bias_decay: 0.2, ..NOISE };
        let rates = shaken_rates(77);
        let phi = transition(&rates, &noise, 0.1);
        let exact = (full(&rates, &noise) * 0.1).exp();
        let difference = phi.navigation - exact.fixed_view::<NAVIGATION_STATES, STATES>(0, 0);
        assert!(difference.amax() < 1e-5, "{difference:e}");
        for k in 0..STATES - NAVIGATION_STATES {
            assert!((phi.tail[k] - exact[(9 + k, 9 + k)]).abs() < 1e-7);
        }
    }

    /// Catches an error of the sequential form: gain of one row used with the innovation of before the other rows.
    #[test]
    fn sequential_and_joint_updates_agree() {
        let mut p = initial();
        propagate(&mut p, &shaken_rates(3), &NOISE, 0.5, 0.5);
        let mut joint = p;
        let h = SMatrix::<f64, 3, ALL_STATES>::from_fn(|r, c| ((r * 7 + c * 3) as f64).sin());
        let (z, variance) = (vector![0.5, -1.0, 0.7], vector![0.3, 0.1, 0.2]);
        let observation = kalman::Observation { y: z, h, r: SMatrix::from_diagonal(&variance) };
        let dense = kalman::update(&mut joint, &observation, None).unwrap();
        let sequential = update(&mut p, &z, &h, &variance, 1.0, None).unwrap();
        let (Outcome::Accepted { dx: a, nis: m }, Outcome::Accepted { dx: b, nis: n }) = (dense, sequential) else {
            panic!()
        };
        assert!((a - b).amax() < 1e-10 && (m - n).abs() < 1e-10 && (p - joint).amax() < 1e-9);
    }

    /// A refused measurement must leave no trace, and the gate is on all rows together.
    #[test]
    fn a_measurement_outside_the_joint_gate_changes_nothing() {
        let mut p = initial();
        let h = SMatrix::<f64, 3, ALL_STATES>::identity();
        let variance = vector![1.0, 1.0, 1.0];
        let gate = Some(16.266);
        // Each row alone is within three sigma; together they are not.
        let z = vector![8.5, 8.5, 12.0];
        assert!(matches!(update(&mut p, &z, &h, &variance, 1.0, gate), Ok(Outcome::Rejected { nis }) if nis > 16.266));
        assert_eq!(p, initial());
        assert!(update(&mut p, &vector![f64::NAN, 0.0, 0.0], &h, &variance, 1.0, None).is_ok_and(|o| o.nis().is_nan()));
        assert_eq!(p, initial());
    }
}
