//! Helpers of the unit tests.

use nalgebra::{SMatrix, SVector};

/// Assert that `jacobian` is the derivative of `f` at `x`, by central differences.
///
/// `tolerance` is relative to `1 + |derivative|`; with steps of 1e-6 (scaled) rounding is near 1e-10 and truncation below
/// 1e-9 for the smooth models here, so 1e-6 lets no dropped or sign-flipped term above 1e-6 pass.
pub fn assert_jacobian<const N: usize, const M: usize>(
    f: impl Fn(&SVector<f64, N>) -> SVector<f64, M>,
    jacobian: &SMatrix<f64, M, N>,
    x: &SVector<f64, N>,
    tolerance: f64,
) {
    for c in 0..N {
        let h = 1e-6 * x[c].abs().max(1.0);
        let (mut above, mut below) = (*x, *x);
        above[c] += h;
        below[c] -= h;
        let numeric = (f(&above) - f(&below)) / (2.0 * h);
        for r in 0..M {
            let error = (numeric[r] - jacobian[(r, c)]).abs();
            assert!(
                error <= tolerance * (1.0 + numeric[r].abs()),
                "d f[{r}] / d x[{c}]: model {} numeric {}",
                jacobian[(r, c)],
                numeric[r]
            );
        }
    }
}
