//! A first calibration in closed form, from which the refinement starts.

use nalgebra::{Matrix3, Vector3};

use super::Kind;
use super::model::{State, state};
use super::small::{eigen, solve, square_root};

/// Relative spread of the Earth's strength along the drive from which the centred solution is used.
const CENTRED_SPREAD: f64 = 0.02;
/// Smallest eigenvalue of a shape that is an ellipsoid.
const SMALLEST_EIGENVALUE: f64 = 0.05;

/// Closed-form calibration of readings (uT) to the strength of the Earth's field at each of them; `None` where the readings are no ellipsoid.
///
/// At one place the strength is constant and the centred solution has the exact solution `E = -I` (SPEC orientation 7): it
/// is used only where the strength varies. Planar readings have no third component and the horizontal strength.
pub(super) fn first_step(readings: &[Vector3<f64>], strength: &[f64], kind: Kind) -> Option<State> {
    let count = strength.len() as f64;
    let mean = strength.iter().sum::<f64>() / count;
    let spread = (strength.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / count).sqrt();
    if kind == Kind::Full && spread > CENTRED_SPREAD * mean {
        centred(readings, strength)
    } else {
        ellipsoid(readings, mean, kind)
    }
}

/// Normal equations of rows `coefficients . unknowns = value`, solved.
fn least_squares<const N: usize>(rows: impl Iterator<Item = ([f64; N], f64)>) -> Option<[f64; N]> {
    let (mut normal, mut right) = ([0.0; 81], [0.0; N]);
    for (row, value) in rows {
        for i in 0..N {
            right[i] += row[i] * value;
            for j in 0..=i {
                normal[i * N + j] += row[i] * row[j];
            }
        }
    }
    solve(&mut normal[..N * N], N, &mut right)?;
    Some(right)
}

/// `u' A u - 2 c' u + k = 0` with trace A fixed, over readings centred and divided by the strength.
fn ellipsoid(readings: &[Vector3<f64>], strength: f64, kind: Kind) -> Option<State> {
    let mean = readings.iter().sum::<Vector3<f64>>() / readings.len() as f64;
    let scaled = readings.iter().map(|m| (m - mean) / strength);
    let (a, c, k) = match kind {
        Kind::Full => {
            let [a11, a22, a12, a13, a23, c1, c2, c3, k] = least_squares(scaled.map(|u| {
                let (x, y, z) = (u.x, u.y, u.z);
                let row = [
                    x * x - z * z,
                    y * y - z * z,
                    2.0 * x * y,
                    2.0 * x * z,
                    2.0 * y * z,
                    -2.0 * x,
                    -2.0 * y,
                    -2.0 * z,
                    1.0,
                ];
                (row, -3.0 * z * z)
            }))?;
            let a = Matrix3::new(a11, a12, a13, a12, a22, a23, a13, a23, 3.0 - a11 - a22);
            (a, Vector3::new(c1, c2, c3), k)
        }
        Kind::Planar => {
            let [a11, a12, c1, c2, k] = least_squares(scaled.map(|u| {
                let (x, y) = (u.x, u.y);
                ([x * x - y * y, 2.0 * x * y, -2.0 * x, -2.0 * y, 1.0], -2.0 * y * y)
            }))?;
            (Matrix3::new(a11, a12, 0.0, a12, 2.0 - a11, 0.0, 0.0, 0.0, 1.0), Vector3::new(c1, c2, 0.0), k)
        }
    };
    let axes = eigen(&a);
    if axes.0.min() < SMALLEST_EIGENVALUE {
        return None;
    }
    let centre = axes.1 * (axes.1.transpose() * c).component_div(&axes.0);
    let factor = 1.0 / (c.dot(&centre) - k);
    if !(factor > 0.0 && factor.is_finite()) {
        return None;
    }
    let mut shape = square_root(&axes, factor);
    if kind == Kind::Planar {
        shape[(2, 2)] = 1.0;
    }
    Some(state(&shape, &(shape * (centre * strength + mean))))
}

/// The first step of TWOSTEP: deviations of `|m|^2 - |H|^2` from their mean, linear in `E = 2 D + D^2` and `c = (I + D) b`.
fn centred(readings: &[Vector3<f64>], strength: &[f64]) -> Option<State> {
    let row = |m: &Vector3<f64>| {
        let e = [-m.x * m.x, -m.y * m.y, -m.z * m.z, -2.0 * m.x * m.y, -2.0 * m.x * m.z, -2.0 * m.y * m.z];
        [2.0 * m.x, 2.0 * m.y, 2.0 * m.z, e[0], e[1], e[2], e[3], e[4], e[5]]
    };
    let samples = || readings.iter().zip(strength).map(|(m, s)| (row(m), m.norm_squared() - s * s));
    let (mut mean_row, mut mean) = ([0.0; 9], 0.0);
    for (row, value) in samples() {
        mean_row.iter_mut().zip(row).for_each(|(sum, v)| *sum += v / readings.len() as f64);
        mean += value / readings.len() as f64;
    }
    let x = least_squares(samples().map(|(mut row, value)| {
        row.iter_mut().zip(mean_row).for_each(|(v, mean)| *v -= mean);
        (row, value - mean)
    }))?;
    let e = Matrix3::new(x[3], x[6], x[7], x[6], x[4], x[8], x[7], x[8], x[5]);
    let axes = eigen(&(Matrix3::identity() + e));
    if axes.0.min() < SMALLEST_EIGENVALUE {
        return None;
    }
    let shape = square_root(&axes, 1.0);
    let turned = axes.1.transpose() * Vector3::new(x[0], x[1], x[2]);
    Some(state(&shape, &(axes.1 * turned.component_div(&axes.0.map(f64::sqrt)))))
}
