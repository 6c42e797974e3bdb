//! The inverse of a small matrix, with its condition.

/// An inverse, and how much it may amplify a relative error.
pub(super) struct Inverse<const N: usize> {
    pub(super) inverse: [[f64; N]; N],
    /// Largest row sum of the matrix times that of its inverse.
    pub(super) condition: f64,
}

fn largest_row_sum<const N: usize>(a: &[[f64; N]; N]) -> f64 {
    a.iter().map(|row| row.iter().map(|v| v.abs()).sum()).fold(0.0, f64::max)
}

/// Gauss-Jordan with row pivots; `None` where a pivot is zero or not a number.
pub(super) fn invert<const N: usize>(matrix: &[[f64; N]; N]) -> Option<Inverse<N>> {
    let mut a = *matrix;
    let mut inverse = [[0.0; N]; N];
    for (k, row) in inverse.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    for column in 0..N {
        let pivot = (column..N).max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs()))?;
        a.swap(column, pivot);
        inverse.swap(column, pivot);
        let scale = 1.0 / a[column][column];
        if !scale.is_finite() {
            return None;
        }
        a[column].iter_mut().chain(&mut inverse[column]).for_each(|v| *v *= scale);
        let (row, image) = (a[column], inverse[column]);
        for i in (0..N).filter(|&i| i != column) {
            let factor = a[i][column];
            for k in 0..N {
                a[i][k] -= factor * row[k];
                inverse[i][k] -= factor * image[k];
            }
        }
    }
    let condition = largest_row_sum(matrix) * largest_row_sum(&inverse);
    Some(Inverse { inverse, condition })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_is_the_identity_even_with_a_zero_on_the_diagonal() {
        let a = [[0.0, 2.0, 1.0], [1.0, -1.0, 0.5], [3.0, 0.25, -2.0]];
        let b = invert(&a).unwrap();
        for (i, row) in a.iter().enumerate() {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| row[k] * b.inverse[k][j]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        assert!(invert(&[[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(invert(&[[f64::NAN, 2.0], [2.0, 4.0]]).is_none());
    }
}
