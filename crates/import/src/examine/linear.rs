//! Least squares of a few unknowns, and rotations, without a matrix library.

/// Most unknowns of a fit.
const MOST: usize = 5;

/// Normal equations of `y = sum of coefficients times terms`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Normal {
    a: [[f64; MOST]; MOST],
    b: [f64; MOST],
    squares: f64,
    sum: f64,
    count: f64,
}

/// A solved fit.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Solved {
    /// Coefficients; those of terms that were not given are 0.
    pub x: [f64; MOST],
    /// 1-sigma of each, as the residuals suggest, taken as independent.
    pub sigma: [f64; MOST],
    /// Share of the spread of `y` that is explained, 0 to 1.
    pub explained: f64,
    /// Root mean square of what is left.
    pub residual: f64,
    /// Number of rows.
    pub count: f64,
}

impl Normal {
    /// Take in one row; rows with a value that is not finite are passed over.
    pub fn add(&mut self, terms: &[f64], y: f64) {
        if !y.is_finite() || terms.iter().any(|t| !t.is_finite()) {
            return;
        }
        for (i, p) in terms.iter().enumerate() {
            self.b[i] += p * y;
            for (j, q) in terms.iter().enumerate() {
                self.a[i][j] += p * q;
            }
        }
        (self.squares, self.sum, self.count) = (self.squares + y * y, self.sum + y, self.count + 1.0);
    }

    /// Solve for the first `n` terms; terms without any excitation get 0 and an infinite sigma.
    pub fn solve(&self, n: usize) -> Solved {
        let inverse = self.inverse(n);
        let mut out = Solved { count: self.count, ..Solved::default() };
        for (x, row) in out.x.iter_mut().zip(&inverse).take(n) {
            *x = row.iter().zip(&self.b).take(n).map(|(a, b)| a * b).sum();
        }
        let fitted: f64 = (0..n).map(|i| out.x[i] * self.b[i]).sum();
        let left = (self.squares - fitted).max(0.0);
        let spread = (self.squares - self.sum * self.sum / self.count).max(1e-300);
        let free = (self.count - n as f64).max(1.0);
        out.residual = (left / free).sqrt();
        out.explained = (1.0 - left / spread).clamp(0.0, 1.0);
        for (i, (sigma, row)) in out.sigma.iter_mut().zip(&inverse).take(n).enumerate() {
            *sigma = if row[i] > 0.0 { out.residual * row[i].sqrt() } else { f64::INFINITY };
        }
        out
    }

    /// Inverse of the leading block by Gauss-Jordan on the scaled matrix; rows of idle terms stay 0.
    fn inverse(&self, n: usize) -> [[f64; MOST]; MOST] {
        let scale: [f64; MOST] = std::array::from_fn(|i| if self.a[i][i] > 0.0 { self.a[i][i].sqrt() } else { 0.0 });
        let unit =
            |i: usize, j: usize| if scale[i] * scale[j] > 0.0 { self.a[i][j] / scale[i] / scale[j] } else { 0.0 };
        let mut m: [[f64; MOST]; MOST] = std::array::from_fn(|i| std::array::from_fn(|j| unit(i, j)));
        let mut out = [[0.0; MOST]; MOST];
        (0..n).for_each(|i| out[i][i] = 1.0);
        let mut idle = [false; MOST];
        for i in 0..n {
            let pivot = m[i][i];
            if pivot < 1e-9 {
                idle[i] = true;
                continue;
            }
            for j in 0..n {
                (m[i][j], out[i][j]) = (m[i][j] / pivot, out[i][j] / pivot);
            }
            for k in (0..n).filter(|k| *k != i) {
                let factor = m[k][i];
                for j in 0..n {
                    (m[k][j], out[k][j]) = (m[k][j] - factor * m[i][j], out[k][j] - factor * out[i][j]);
                }
            }
        }
        for i in 0..n {
            for j in 0..n {
                let idle = idle[i] || idle[j] || scale[i] * scale[j] == 0.0;
                out[i][j] = if idle { 0.0 } else { out[i][j] / scale[i] / scale[j] };
            }
        }
        out
    }
}

/// Sum of products.
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
/// Length.
pub(crate) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
/// Vector product.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
/// `a + factor * b`.
pub(crate) fn plus(a: [f64; 3], factor: f64, b: [f64; 3]) -> [f64; 3] {
    [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]]
}
/// Direction; the zero vector of nothing.
pub(crate) fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = norm(a);
    if length > 0.0 { a.map(|v| v / length) } else { a }
}

/// How the columns of a triad lie along the axes of the car: `body axis k` is `sign * column[of]`, then a small rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seating {
    /// For x, y, z of the car: which of the three columns, and its sign.
    pub axes: [(usize, f64); 3],
    /// Roll, pitch and yaw of the housing after that, rad.
    pub lean: [f64; 3],
}

/// Seat a triad whose column `i` reads `rows[i]` (orthonormal rows) of the car's axes.
pub(crate) fn seat(rows: [[f64; 3]; 3]) -> Seating {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let fit = |o: &[usize; 3]| (0..3).map(|k| rows[o[k]][k].abs()).sum::<f64>();
    let order = ORDERS.iter().copied().reduce(|a, b| if fit(&b) > fit(&a) { b } else { a }).unwrap_or([0, 1, 2]);
    let axes: [(usize, f64); 3] = std::array::from_fn(|k| (order[k], rows[order[k]][k].signum()));
    // Rows of the turned triad; their transpose takes the triad to the car.
    let q: [[f64; 3]; 3] = std::array::from_fn(|k| rows[axes[k].0].map(|v| v * axes[k].1));
    let pitch = -q[0][2].clamp(-1.0, 1.0).asin();
    Seating { axes, lean: [q[1][2].atan2(q[2][2]), pitch, q[0][1].atan2(q[0][0])] }
}

/// Rows of the rotation from a housing to the car, from its roll, pitch and yaw on its mount.
pub(crate) fn lean_rows([roll, pitch, yaw]: [f64; 3]) -> [[f64; 3]; 3] {
    let ((sr, cr), (sp, cp), (sy, cy)) = (roll.sin_cos(), pitch.sin_cos(), yaw.sin_cos());
    [
        [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
        [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
        [-sp, sr * cp, cr * cp],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_gives_back_its_coefficients_and_passes_over_idle_terms() {
        let mut normal = Normal::default();
        for k in 0..50 {
            let (p, q) = (f64::from(k).sin(), f64::from(k) * 0.3);
            normal.add(&[p, 0.0, q, 1.0], 2.0 * p - 0.5 * q + 7.0);
        }
        normal.add(&[f64::NAN, 0.0, 0.0, 1.0], 5.0);
        let s = normal.solve(4);
        for (x, expected) in s.x.iter().zip([2.0, 0.0, -0.5, 7.0]) {
            assert!((x - expected).abs() < 1e-9, "{s:?}");
        }
        assert!(s.sigma[1].is_infinite() && s.explained > 0.999_999 && s.count == 50.0);
    }

    #[test]
    fn a_triad_is_seated_with_its_order_signs_and_lean() {
        let lean = [0.1, -0.2, 0.15];
        let turn = lean_rows(lean);
        // Column i of the file is an axis of the housing, the second and third exchanged, the first turned round.
        let axis = |k: usize| [turn[0][k], turn[1][k], turn[2][k]];
        let rows = [axis(0).map(|v| -v), axis(2), axis(1)];
        let seating = seat(rows);
        assert_eq!(seating.axes, [(0, -1.0), (2, 1.0), (1, 1.0)]);
        for (found, expected) in seating.lean.iter().zip(lean) {
            assert!((found - expected).abs() < 1e-12, "{seating:?}");
        }
    }
}
