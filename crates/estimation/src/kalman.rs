//! The Kalman steps, for any number of states, written once.
//!
//! A full-state filter adds the returned `dx` to its state; an error-state filter injects it. Nothing here knows which
//! sensor an observation came from.

use nalgebra::{Cholesky, SMatrix, SVector};

/// A measurement, linearized: all that the update reads. Each sensor builds one; none is special.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<const N: usize, const M: usize> {
    /// Innovation `y = z - h(x)`.
    pub y: SVector<f64, M>,
    /// Jacobian of `h` with respect to the state (or the error state).
    pub h: SMatrix<f64, M, N>,
    /// Measurement noise covariance.
    pub r: SMatrix<f64, M, M>,
}

/// What an update did. A rejected measurement is a result, not an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<const N: usize> {
    /// The covariance has been updated.
    Accepted {
        /// State correction.
        dx: SVector<f64, N>,
        /// Normalized innovation squared.
        nis: f64,
    },
    /// The gate was exceeded; the covariance is unchanged.
    Rejected {
        /// Normalized innovation squared.
        nis: f64,
    },
}

impl<const N: usize> Outcome<N> {
    /// Normalized innovation squared, accepted or not.
    pub fn nis(&self) -> f64 {
        match *self {
            Self::Accepted { nis, .. } | Self::Rejected { nis } => nis,
        }
    }
}

/// The filter's own numbers cannot support an update.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
#[error("innovation covariance is not positive definite")]
pub struct NotPositiveDefinite;

/// Make `p` symmetric by averaging it with its transpose.
pub fn symmetrize<const N: usize>(p: &mut SMatrix<f64, N, N>) {
    for i in 0..N {
        for j in 0..i {
            let mean = 0.5 * (p[(i, j)] + p[(j, i)]);
            p[(i, j)] = mean;
            p[(j, i)] = mean;
        }
    }
}

/// `P <- Phi P Phi' + Q`, kept symmetric.
pub fn predict<const N: usize>(p: &mut SMatrix<f64, N, N>, phi: &SMatrix<f64, N, N>, q: &SMatrix<f64, N, N>) {
    *p = phi * *p * phi.transpose() + q;
    symmetrize(p);
}

/// `I + F dt + (F dt)^2 / 2`.
pub fn transition<const N: usize>(f: &SMatrix<f64, N, N>, dt: f64) -> SMatrix<f64, N, N> {
    let fd = f * dt;
    SMatrix::identity() + fd + fd * fd * 0.5
}

/// Fold one measurement into covariance `p` and return the state correction.
///
/// Joseph form, so that `p` stays positive semi-definite under rounding. `gate` is the largest accepted normalized
/// innovation squared (chi-square with `M` degrees of freedom); `None` accepts all that is finite.
///
/// # Errors
/// [`NotPositiveDefinite`] if `h p h' + r` cannot be factored or is not finite; `p` is unchanged.
pub fn update<const N: usize, const M: usize>(
    p: &mut SMatrix<f64, N, N>,
    obs: &Observation<N, M>,
    gate: Option<f64>,
) -> Result<Outcome<N>, NotPositiveDefinite> {
    let Observation { y, h, r } = obs;
    let hp = h * *p;
    let s = Cholesky::new(hp * h.transpose() + r).ok_or(NotPositiveDefinite)?;
    let nis = y.dot(&s.solve(y));
    if nis.is_nan() || nis > gate.unwrap_or(f64::MAX) {
        return Ok(Outcome::Rejected { nis: nis.clamp(0.0, f64::MAX) });
    }
    let k = s.solve(&hp).transpose();
    let a = SMatrix::<f64, N, N>::identity() - k * h;
    *p = a * *p * a.transpose() + k * r * k.transpose();
    symmetrize(p);
    Ok(Outcome::Accepted { dx: k * y, nis })
}

/// [`update`] for one scalar measurement, in `O(N^2)`: the Joseph form written as two rank-one steps.
///
/// # Errors
/// [`NotPositiveDefinite`] if `h p h' + r` is not positive and finite; `p` is unchanged.
pub fn update_scalar<const N: usize>(
    p: &mut SMatrix<f64, N, N>,
    y: f64,
    h: &SVector<f64, N>,
    r: f64,
    gate: Option<f64>,
) -> Result<Outcome<N>, NotPositiveDefinite> {
    let ph = *p * h;
    let s = h.dot(&ph) + r;
    if !(s > 0.0 && s < f64::INFINITY) {
        return Err(NotPositiveDefinite);
    }
    let nis = y * y / s;
    if nis.is_nan() || nis > gate.unwrap_or(f64::MAX) {
        return Ok(Outcome::Rejected { nis: nis.clamp(0.0, f64::MAX) });
    }
    let k = ph / s;
    // A = (I - k h) P; P = A (I - k h)' + k r k'
    let a = *p - k * ph.transpose();
    let ah = a * h;
    *p = a + (k * r - ah) * k.transpose();
    symmetrize(p);
    Ok(Outcome::Accepted { dx: k * y, nis })
}

/// `P <- (I + D) P (I + D)' + diag(q)` for a transition that changes few states: `rows[k]` is the state that row `k` of `D`
/// changes, `change[k]` the entries of that row that are not zero. `P` must be symmetric and stays so exactly.
pub fn propagate<const N: usize, const R: usize>(
    p: &mut SMatrix<f64, N, N>,
    rows: &[usize; R],
    change: &[&[(usize, f64)]; R],
    q: &SVector<f64, N>,
) {
    let mut moved = [SVector::<f64, N>::zeros(); R];
    for (moved, change) in moved.iter_mut().zip(change) {
        for &(column, value) in *change {
            *moved += p.column(column) * value;
        }
    }
    for (k, &row) in rows.iter().enumerate() {
        for j in 0..N {
            p[(j, row)] += moved[k][j];
            p[(row, j)] += moved[k][j];
        }
        for (l, &other) in rows.iter().enumerate().take(k + 1) {
            let both: f64 = change[l].iter().map(|&(column, value)| moved[k][column] * value).sum();
            p[(row, other)] += both;
            if l != k {
                p[(other, row)] += both;
            }
        }
    }
    for i in 0..N {
        p[(i, i)] += q[i];
    }
}

/// [`update_scalar`] for a row `h` with few entries, given as pairs of state and value; the work is one pass over half of `p`.
///
/// # Errors
/// [`NotPositiveDefinite`] if `h p h' + r` is not positive and finite; `p` is unchanged.
pub fn update_sparse<const N: usize>(
    p: &mut SMatrix<f64, N, N>,
    y: f64,
    h: &[(usize, f64)],
    r: f64,
    gate: Option<f64>,
) -> Result<Outcome<N>, NotPositiveDefinite> {
    let mut ph = SVector::<f64, N>::zeros();
    for &(column, value) in h {
        ph += p.column(column) * value;
    }
    let s = h.iter().map(|&(i, value)| value * ph[i]).sum::<f64>() + r;
    if !(s > 0.0 && s < f64::INFINITY) {
        return Err(NotPositiveDefinite);
    }
    let nis = y * y / s;
    if nis.is_nan() || nis > gate.unwrap_or(f64::MAX) {
        return Ok(Outcome::Rejected { nis: nis.clamp(0.0, f64::MAX) });
    }
    let k = ph / s;
    // A = (I - k h) P; P = A (I - k h)' + k r k'
    let mut rest = k * r;
    for &(column, value) in h {
        rest -= (p.column(column) - k * ph[column]) * value;
    }
    for j in 0..N {
        for i in j..N {
            let value = p[(i, j)] - k[i] * ph[j] + rest[i] * k[j];
            p[(i, j)] = value;
            p[(j, i)] = value;
        }
    }
    Ok(Outcome::Accepted { dx: k * y, nis })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{matrix, vector};

    #[test]
    fn the_gate_boundary_is_accepted_and_the_next_number_is_not() {
        let p0 = SMatrix::<f64, 1, 1>::new(3.0);
        let obs = Observation { y: vector![4.0], h: matrix![1.0], r: matrix![1.0] };
        for (gate, accepted) in [(4.0, true), (f64::from_bits(4.0f64.to_bits() - 1), false)] {
            let mut p = p0;
            let outcome = update(&mut p, &obs, Some(gate)).unwrap();
            assert_eq!(matches!(outcome, Outcome::Accepted { .. }), accepted);
            assert_eq!(p == p0, !accepted, "a rejected measurement leaves the covariance alone");
        }
    }

    #[test]
    fn scalar_and_dense_updates_agree() {
        let mut p = matrix![2.0, 0.3, 0.1; 0.3, 1.0, -0.2; 0.1, -0.2, 0.5];
        let mut q = p;
        let h = vector![1.0, -2.0, 0.5];
        let dense = update(&mut p, &Observation { y: vector![0.7], h: matrix![1.0, -2.0, 0.5], r: matrix![0.4] }, None)
            .unwrap();
        let scalar = update_scalar(&mut q, 0.7, &h, 0.4, None).unwrap();
        let (Outcome::Accepted { dx: a, nis: m }, Outcome::Accepted { dx: b, nis: n }) = (dense, scalar) else {
            panic!()
        };
        assert!((a - b).norm() < 1e-14 && (m - n).abs() < 1e-14 && (p - q).norm() < 1e-14);
    }

    #[test]
    fn sparse_steps_are_the_dense_ones() {
        // Catches a row or a transition entry that reaches the wrong state, and a covariance that loses its symmetry.
        let p0 = matrix![2.0, 0.3, 0.1; 0.3, 1.0, -0.2; 0.1, -0.2, 0.5];
        let (mut dense, mut sparse) = (p0, p0);
        let phi = matrix![1.0, 0.4, 0.0; 0.0, 1.0, 0.0; -0.3, 0.2, 0.9];
        let q = vector![0.1, 0.2, 0.3];
        predict(&mut dense, &phi, &SMatrix::from_diagonal(&q));
        propagate(&mut sparse, &[0, 2], &[&[(1, 0.4)], &[(0, -0.3), (1, 0.2), (2, -0.1)]], &q);
        assert!((dense - sparse).norm() < 1e-15 && sparse == sparse.transpose());
        let a = update_scalar(&mut dense, 0.7, &vector![0.0, -2.0, 0.5], 0.4, None).unwrap();
        let b = update_sparse(&mut sparse, 0.7, &[(1, -2.0), (2, 0.5)], 0.4, None).unwrap();
        let (Outcome::Accepted { dx: a, nis: m }, Outcome::Accepted { dx: b, nis: n }) = (a, b) else { panic!() };
        assert!((a - b).norm() < 1e-15 && (m - n).abs() < 1e-15 && (dense - sparse).norm() < 1e-15);
        let before = sparse;
        assert!(matches!(update_sparse(&mut sparse, 9.0, &[(0, 1.0)], 0.1, Some(4.0)), Ok(Outcome::Rejected { .. })));
        assert_eq!(sparse, before);
        assert_eq!(update_sparse(&mut sparse, 0.0, &[(0, 1.0)], -9.0, None), Err(NotPositiveDefinite));
    }

    #[test]
    fn joseph_form_survives_an_ill_conditioned_covariance_that_the_short_form_does_not() {
        let p0 = matrix![1e8, 1e8 - 1.0; 1e8 - 1.0, 1e8];
        let obs = Observation { y: vector![0.0], h: matrix![1.0, 0.0], r: matrix![1e-8] };
        let mut p = p0;
        for _ in 0..50 {
            update(&mut p, &obs, None).unwrap();
        }
        assert!(p[(0, 0)] > 0.0 && p[(1, 1)] > 0.0 && p.determinant() >= -1e-12, "{p}");
        let mut s = p0;
        for _ in 0..50 {
            update_scalar(&mut s, 0.0, &vector![1.0, 0.0], 1e-8, None).unwrap();
        }
        assert!(s[(0, 0)] > 0.0 && s[(1, 1)] > 0.0, "{s}");
        let mut s = p0;
        for _ in 0..50 {
            update_sparse(&mut s, 0.0, &[(0, 1.0)], 1e-8, None).unwrap();
        }
        assert!(s[(0, 0)] > 0.0 && s[(1, 1)] > 0.0, "{s}");
    }

    #[test]
    fn an_innovation_that_is_not_finite_is_rejected_and_a_broken_covariance_is_an_error() {
        let mut p = matrix![1.0];
        let obs = Observation { y: vector![f64::NAN], h: matrix![1.0], r: matrix![1.0] };
        assert!(matches!(update(&mut p, &obs, None), Ok(Outcome::Rejected { .. })));
        assert!(matches!(update_scalar(&mut p, f64::NAN, &vector![1.0], 1.0, None), Ok(Outcome::Rejected { .. })));
        let mut broken = matrix![-5.0];
        assert_eq!(update_scalar(&mut broken, 0.0, &vector![1.0], 1.0, None), Err(NotPositiveDefinite));
        assert_eq!(
            update(&mut broken, &Observation { y: vector![0.0], h: matrix![1.0], r: matrix![1.0] }, None),
            Err(NotPositiveDefinite)
        );
    }
}
