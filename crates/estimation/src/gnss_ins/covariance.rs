//! The covariance of the fifteen errors: propagation over a node of inertial samples, and updates.
//!
//! Departure from SPEC navigation 3: transition and noise are not multiplied up sample by sample; the rates of the
//! errors are averaged over the node (10 samples by default) and integrated once, to third order. The two differ by the
//! commutators of the rates inside one node; a test holds them together, and the cost falls by an order of magnitude.

use nalgebra::{Cholesky, SMatrix, SVector};

use crate::ins::{ACCEL_BIAS, ATTITUDE, ErrorRates, GYRO_BIAS, NAVIGATION_STATES, STATES, VELOCITY};
use crate::kalman::{self, NotPositiveDefinite, Outcome};

/// Covariance of the fifteen errors.
pub type Covariance = SMatrix<f64, STATES, STATES>;
/// The fifteen errors.
pub type Errors = SVector<f64, STATES>;

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
}

impl ProcessNoise {
    /// Density of the noise that drives one error.
    fn density(&self, state: usize) -> f64 {
        match state {
            GYRO_BIAS.. => self.gyro_bias,
            ACCEL_BIAS.. => self.accel_bias,
            ATTITUDE.. => self.gyro,
            VELOCITY.. => self.accel,
            _ => 0.0,
        }
    }

    /// Rate at which a bias forgets, 1/s.
    fn decay(&self, state: usize) -> f64 {
        if state >= GYRO_BIAS { self.gyro_bias_decay } else { self.accel_bias_decay }
    }
}

/// Transition of the nine navigation errors over a node, and of the six biases (diagonal).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// Rows of the navigation errors.
    pub navigation: ErrorRates,
    /// What is left of each bias.
    pub bias: SVector<f64, { STATES - NAVIGATION_STATES }>,
}

/// `I + A (I + A/2 (I + A/3))` for rates that held for `time` seconds.
pub fn transition(rates: &ErrorRates, noise: &ProcessNoise, time: f64) -> Transition {
    let a = rates * time;
    let mut navigation = ErrorRates::zeros();
    let mut bias = SVector::<f64, { STATES - NAVIGATION_STATES }>::from_element(1.0);
    for (i, order) in [3.0, 2.0, 1.0].into_iter().enumerate() {
        let scaled = a / order;
        let mut next = ErrorRates::zeros();
        if i > 0 {
            multiply(&scaled, &navigation, &bias, &mut next);
        } else {
            next = scaled;
        }
        for k in 0..NAVIGATION_STATES {
            next[(k, k)] += 1.0;
        }
        for (k, left) in bias.iter_mut().enumerate() {
            *left = 1.0 - noise.decay(NAVIGATION_STATES + k) * time / order * *left;
        }
        navigation = next;
    }
    Transition { navigation, bias }
}

/// `out = a [top; 0 diag(bottom)]` added to zeros: the product of two matrices with diagonal bias rows.
fn multiply(
    a: &ErrorRates,
    top: &ErrorRates,
    bottom: &SVector<f64, { STATES - NAVIGATION_STATES }>,
    out: &mut ErrorRates,
) {
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
    // Columns of `half` are rows of P Phi'; P is symmetric, so its columns serve as rows.
    let mut half = [[0.0; STATES]; NAVIGATION_STATES];
    for (row, half) in half.iter_mut().enumerate() {
        for (column, p) in p.data.0.iter().enumerate() {
            accumulate(half, p, phi.navigation.data.0[column][row]);
        }
    }
    for (s, half) in half.iter().enumerate() {
        let mut column = [0.0; NAVIGATION_STATES];
        for (phi, factor) in phi.navigation.data.0.iter().zip(half) {
            accumulate(&mut column, phi, *factor);
        }
        p.data.0[s][..NAVIGATION_STATES].copy_from_slice(&column);
        for (k, (value, left)) in half[NAVIGATION_STATES..].iter().zip(phi.bias.iter()).enumerate() {
            let bias = NAVIGATION_STATES + k;
            p.data.0[s][bias] = value * left;
            p.data.0[bias][s] = value * left;
        }
    }
    for b in NAVIGATION_STATES..STATES {
        for c in NAVIGATION_STATES..STATES {
            p[(b, c)] *= phi.bias[b - NAVIGATION_STATES] * phi.bias[c - NAVIGATION_STATES];
        }
    }
    add_noise(p, rates, noise, time, noise_time);
    kalman::symmetrize(p);
    phi
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
}

/// Fold in `M` measurements with independent noise: gated together, then applied one after the other.
///
/// `z` is indicated minus measured, `h` its Jacobian with respect to the errors, `variance` the noise of each row.
/// With uncorrelated noise this equals the joint Joseph update of [`kalman::update`]; zeros of `h` cost nothing.
///
/// # Errors
/// [`NotPositiveDefinite`] if the innovation covariance cannot be factored or is not finite; `p` is unchanged.
pub fn update<const M: usize>(
    p: &mut Covariance,
    z: &SVector<f64, M>,
    h: &SMatrix<f64, M, STATES>,
    variance: &SVector<f64, M>,
    gate: Option<f64>,
) -> Result<Outcome<STATES>, NotPositiveDefinite> {
    let mut s = SMatrix::<f64, M, M>::from_diagonal(variance);
    for row in 0..M {
        let ph = times_row(p, h, row);
        for other in 0..M {
            s[(other, row)] += (0..STATES).map(|k| h[(other, k)] * ph[k]).sum::<f64>();
        }
    }
    let nis = z.dot(&Cholesky::new(s).ok_or(NotPositiveDefinite)?.solve(z));
    // A statistic that is not a number is refused too.
    if nis.is_nan() || nis > gate.unwrap_or(f64::MAX) {
        return Ok(Outcome::Rejected { nis });
    }
    let mut dx = Errors::zeros();
    for row in 0..M {
        apply_row(p, z[row], h, row, variance[row], &mut dx);
    }
    kalman::symmetrize(p);
    Ok(Outcome::Accepted { dx, nis })
}

/// `P` times the transpose of one row of `h`, without the zeros.
fn times_row<const M: usize>(p: &Covariance, h: &SMatrix<f64, M, STATES>, row: usize) -> [f64; STATES] {
    let mut product = [0.0; STATES];
    for (column, p) in p.data.0.iter().enumerate() {
        let factor = h[(row, column)];
        if factor != 0.0 {
            accumulate(&mut product, p, factor);
        }
    }
    product
}

/// Joseph form of one row, as two rank-one steps: `A = (I - k h) P`, `P = A (I - k h)' + k r k'`.
fn apply_row<const M: usize>(
    p: &mut Covariance,
    z: f64,
    h: &SMatrix<f64, M, STATES>,
    row: usize,
    variance: f64,
    dx: &mut Errors,
) {
    let ph = times_row(p, h, row);
    let (mut innovation, mut s) = (z, variance);
    for k in 0..STATES {
        innovation -= h[(row, k)] * dx[k];
        s += h[(row, k)] * ph[k];
    }
    let gain = ph.map(|v| v / s);
    for (column, p) in p.data.0.iter_mut().enumerate() {
        accumulate(p, &gain, -ph[column]);
    }
    let left = times_row(p, h, row);
    let mut back = [0.0; STATES];
    for k in 0..STATES {
        back[k] = gain[k] * variance - left[k];
        dx[k] += gain[k] * innovation;
    }
    for (column, p) in p.data.0.iter_mut().enumerate() {
        accumulate(p, &back, gain[column]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::{Earth, GravityModel, Navigation, error_rates};
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
    };

    fn full(rates: &ErrorRates, noise: &ProcessNoise) -> Covariance {
        let mut f = Covariance::zeros();
        f.fixed_view_mut::<NAVIGATION_STATES, STATES>(0, 0).copy_from(rates);
        for k in NAVIGATION_STATES..STATES {
            f[(k, k)] = -noise.decay(k);
        }
        f
    }

    fn initial() -> Covariance {
        let sigma = [3.0, 3.0, 5.0, 0.2, 0.2, 0.2, 0.01, 0.01, 0.0873, 0.05, 0.05, 0.05, 3e-3, 3e-3, 3e-3];
        Covariance::from_diagonal(&SVector::from(sigma.map(|s| s * s)))
    }

    /// The specification's way: a transition and a noise matrix per sample, multiplied up densely.
    fn sample_by_sample(p: &mut Covariance, rates: &[ErrorRates], noise: &ProcessNoise, dt: f64) {
        let q = Covariance::from_diagonal(&SVector::from_fn(|k, _| noise.density(k) * dt));
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
            for r in 0..STATES {
                for c in 0..STATES {
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
            assert!((phi.bias[k] - exact[(9 + k, 9 + k)]).abs() < 1e-7);
        }
    }

    /// Catches an error of the sequential form: gain of one row used with the innovation of before the other rows.
    #[test]
    fn sequential_and_joint_updates_agree() {
        let mut p = initial();
        propagate(&mut p, &shaken_rates(3), &NOISE, 0.5, 0.5);
        let mut joint = p;
        let h = SMatrix::<f64, 3, STATES>::from_fn(|r, c| ((r * 7 + c * 3) as f64).sin());
        let (z, variance) = (vector![0.5, -1.0, 0.7], vector![0.3, 0.1, 0.2]);
        let observation = kalman::Observation { y: z, h, r: SMatrix::from_diagonal(&variance) };
        let dense = kalman::update(&mut joint, &observation, None).unwrap();
        let sequential = update(&mut p, &z, &h, &variance, None).unwrap();
        let (Outcome::Accepted { dx: a, nis: m }, Outcome::Accepted { dx: b, nis: n }) = (dense, sequential) else {
            panic!()
        };
        assert!((a - b).amax() < 1e-10 && (m - n).abs() < 1e-10 && (p - joint).amax() < 1e-9);
    }

    /// A refused measurement must leave no trace, and the gate is on all rows together.
    #[test]
    fn a_measurement_outside_the_joint_gate_changes_nothing() {
        let mut p = initial();
        let h = SMatrix::<f64, 3, STATES>::identity();
        let variance = vector![1.0, 1.0, 1.0];
        let gate = Some(16.266);
        // Each row alone is within three sigma; together they are not.
        let z = vector![8.5, 8.5, 12.0];
        assert!(matches!(update(&mut p, &z, &h, &variance, gate), Ok(Outcome::Rejected { nis }) if nis > 16.266));
        assert_eq!(p, initial());
        assert!(update(&mut p, &vector![f64::NAN, 0.0, 0.0], &h, &variance, None).is_ok_and(|o| o.nis().is_nan()));
        assert_eq!(p, initial());
    }
}
