//! The magnetometer's errors and what a sample says of them.
//!
//! `m = (I + D)^-1 (C H + b) + noise`, `D` symmetric: `B = (I + D) m - b` is the field in the body. State
//! `x = [b1 b2 b3 D11 D22 D33 D12 D13 D23]`, uT and pure numbers.
//! Source: Crassidis, Lai & Harman 2005, equations (1) to (13), as re-derived in SPEC orientation 7.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Number of unknowns.
pub const STATES: usize = 9;
/// The unknowns; see the module.
pub type State = SVector<f64, STATES>;

/// `I + D` of a state.
pub fn shape(x: &State) -> Matrix3<f64> {
    let [d11, d22, d33, d12, d13, d23] = [x[3], x[4], x[5], x[6], x[7], x[8]];
    Matrix3::new(1.0 + d11, d12, d13, d12, 1.0 + d22, d23, d13, d23, 1.0 + d33)
}

/// The state of a shape `I + D` and an offset `b`.
pub fn state(shape: &Matrix3<f64>, b: &Vector3<f64>) -> State {
    let s = shape;
    SVector::from([b.x, b.y, b.z, s[(0, 0)] - 1.0, s[(1, 1)] - 1.0, s[(2, 2)] - 1.0, s[(0, 1)], s[(0, 2)], s[(1, 2)]])
}

/// The field in the body that a reading stands for, `(I + D) m - b`.
pub fn corrected(x: &State, m: &Vector3<f64>) -> Vector3<f64> {
    shape(x) * m - Vector3::new(x[0], x[1], x[2])
}

/// What the scalar measurement `|m|^2 - |H|^2` should be: `h(x) = |m|^2 - |B|^2`.
pub fn scalar(x: &State, m: &Vector3<f64>) -> f64 {
    m.norm_squared() - corrected(x, m).norm_squared()
}

/// Derivative of [`scalar`], from the reading and its corrected field.
pub fn scalar_jacobian(m: &Vector3<f64>, b: &Vector3<f64>) -> State {
    SVector::from([
        2.0 * b.x,
        2.0 * b.y,
        2.0 * b.z,
        -2.0 * b.x * m.x,
        -2.0 * b.y * m.y,
        -2.0 * b.z * m.z,
        -2.0 * (b.x * m.y + b.y * m.x),
        -2.0 * (b.x * m.z + b.z * m.x),
        -2.0 * (b.y * m.z + b.z * m.y),
    ])
}

/// Derivative of [`corrected`] with respect to the state.
pub fn corrected_jacobian(m: &Vector3<f64>) -> SMatrix<f64, 3, STATES> {
    SMatrix::from_row_slice(&[
        -1.0, 0.0, 0.0, m.x, 0.0, 0.0, m.y, m.z, 0.0, //
        0.0, -1.0, 0.0, 0.0, m.y, 0.0, m.x, 0.0, m.z, //
        0.0, 0.0, -1.0, 0.0, 0.0, m.z, 0.0, m.x, m.y,
    ])
}

/// Mean and variance of the scalar measurement's noise for a sensor's noise per axis (1-sigma, uT).
///
/// Departure: the mean is `+sigma^2 tr A^2`; the specification prints a minus, which belongs to `h - z`.
pub fn scalar_noise(shape: &Matrix3<f64>, b: &Vector3<f64>, sigma: f64) -> (f64, f64) {
    let (s2, square) = (sigma * sigma, shape * shape);
    (s2 * square.trace(), 4.0 * s2 * (shape * b).norm_squared() + 2.0 * s2 * s2 * (square * square).trace())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case_log::shared;

    #[test]
    fn points_of_the_reference_are_met_to_nine_digits() {
        let Some(path) = shared("spec/orientation/expected/vectors.json") else { return };
        let all: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        let numbers =
            |v: &serde_json::Value| -> Vec<f64> { v.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect() };
        let points = all["magcal"].as_array().unwrap();
        assert!(points.len() > 2);
        for point in points {
            let (m, x) = (Vector3::from_vec(numbers(&point["m"])), State::from_vec(numbers(&point["x"])));
            let close = |value: f64, wanted: f64| (value - wanted).abs() <= 1e-9 * wanted.abs().max(1.0);
            assert!(close(scalar(&x, &m), point["h"].as_f64().unwrap()));
            let jacobian = scalar_jacobian(&m, &corrected(&x, &m));
            assert!(jacobian.iter().zip(numbers(&point["J"])).all(|(j, wanted)| close(*j, wanted)), "{jacobian}");
        }
    }

    #[test]
    fn jacobians_are_the_derivatives_of_their_functions() {
        let m = Vector3::new(23.0, 2.0, 34.0);
        let x = State::from([2.3, -4.3, 1.8, -0.03, 0.026, -0.0015, -0.0055, -0.02, 0.037]);
        let (of_scalar, of_field) = (scalar_jacobian(&m, &corrected(&x, &m)), corrected_jacobian(&m));
        for i in 0..STATES {
            let mut step = State::zeros();
            step[i] = 1e-4;
            // Both functions are at most quadratic: central differences are exact to rounding.
            let slope = (scalar(&(x + step), &m) - scalar(&(x - step), &m)) / 2e-4;
            assert!((slope - of_scalar[i]).abs() < 1e-6, "{i}");
            let slope = (corrected(&(x + step), &m) - corrected(&(x - step), &m)) / 2e-4;
            assert!((slope - of_field.column(i)).amax() < 1e-8, "{i}");
        }
        assert!((state(&shape(&x), &Vector3::new(x[0], x[1], x[2])) - x).amax() < 1e-15);
    }
}
