//! Small dense algebra on slices, one copy for every size: Cholesky and Jacobi's eigenvalues.

use nalgebra::{Matrix3, Vector3};

/// Factor a symmetric matrix (`n` by `n`, row by row) as `l l'`, in place in its lower triangle; `None` if not positive definite.
pub(super) fn cholesky(a: &mut [f64], n: usize) -> Option<()> {
    for j in 0..n {
        for i in j..n {
            let sum: f64 = a[i * n + j] - (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum::<f64>();
            if i > j {
                a[i * n + j] = sum / a[j * n + j];
            } else if sum > 0.0 && sum.is_finite() {
                a[j * n + j] = sum.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(())
}

/// Solve `l l' x = b` in place, with the factor of [`cholesky`].
pub(super) fn solve_factored(l: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        b[i] = (b[i] - (0..i).map(|k| l[i * n + k] * b[k]).sum::<f64>()) / l[i * n + i];
    }
    for i in (0..n).rev() {
        b[i] = (b[i] - (i + 1..n).map(|k| l[k * n + i] * b[k]).sum::<f64>()) / l[i * n + i];
    }
}

/// Solve `a x = b` for a symmetric positive definite `a`, in place; `None` if it is not.
pub(super) fn solve(a: &mut [f64], n: usize, b: &mut [f64]) -> Option<()> {
    cholesky(a, n)?;
    solve_factored(a, n, b);
    b[..n].iter().all(|v| v.is_finite()).then_some(())
}

/// Eigenvalues and eigenvectors (columns) of a symmetric 3 x 3 matrix, by Jacobi's rotations; order as they come.
pub(super) fn eigen(a: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let (mut a, mut v) = (*a, Matrix3::identity());
    // Three rotations a sweep; convergence is quadratic: six sweeps reach rounding from anywhere.
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[(p, q)].abs() <= f64::MIN_POSITIVE {
                continue;
            }
            let ratio = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
            let tangent = ratio.signum() / (ratio.abs() + ratio.hypot(1.0));
            let cos = 1.0 / tangent.hypot(1.0);
            let mut turn = Matrix3::identity();
            (turn[(p, p)], turn[(q, q)]) = (cos, cos);
            (turn[(p, q)], turn[(q, p)]) = (tangent * cos, -tangent * cos);
            a = turn.transpose() * a * turn;
            v *= turn;
        }
    }
    (a.diagonal(), v)
}

/// The symmetric square root of a matrix given by its eigenvalues and eigenvectors, times a factor.
pub(super) fn square_root((values, vectors): &(Vector3<f64>, Matrix3<f64>), factor: f64) -> Matrix3<f64> {
    vectors * Matrix3::from_diagonal(&values.map(|v| (v * factor).sqrt())) * vectors.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_solved_and_an_indefinite_one_refused() {
        let a = [4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0];
        let mut b = [1.0, 2.0, 3.0];
        solve(&mut a.clone(), 3, &mut b).unwrap();
        let back = Matrix3::from_row_slice(&a) * Vector3::from(b);
        assert!((back - Vector3::new(1.0, 2.0, 3.0)).amax() < 1e-14);
        assert!(solve(&mut [1.0, 2.0, 2.0, 1.0], 2, &mut [0.0, 0.0]).is_none());
        assert!(solve(&mut [f64::NAN, 0.0, 0.0, 1.0], 2, &mut [0.0, 0.0]).is_none());
    }

    #[test]
    fn eigenvalues_and_vectors_rebuild_the_matrix_and_its_root() {
        let a = Matrix3::new(2.0, -0.3, 0.9, -0.3, 1.0, 0.2, 0.9, 0.2, 5.0);
        let e = eigen(&a);
        assert!((e.1 * Matrix3::from_diagonal(&e.0) * e.1.transpose() - a).amax() < 1e-14);
        let root = square_root(&e, 4.0);
        assert!((root * root - a * 4.0).amax() < 1e-13);
        // A diagonal matrix has nothing to turn.
        assert_eq!(eigen(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 2.0))).1, Matrix3::identity());
    }
}
