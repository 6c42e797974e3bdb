//! The magnetic innovation of the road filter in three independent parts.

use nalgebra::{Matrix3, Vector3};

use super::road_model::{BANK, GRADE, LEAN, SQUAT, State, YAW};

/// An innovation of three axes made into three independent ones of unit variance, by `S = L L'`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whitened {
    /// Rows of the lower triangle of `L`.
    factor: [f64; 6],
    pub(super) innovation: [f64; 3],
    pub(super) nis: f64,
}

impl Whitened {
    /// `S = J A J' + r`, `A` the covariance of roll, pitch and yaw; `None` if that cannot be factored.
    pub(super) fn new(shared: &[State; 3], j: &Matrix3<f64>, r: f64, y: &Vector3<f64>) -> Option<Self> {
        let [roll, pitch, yaw] = shared;
        let (rp, ry, py) = (roll[SQUAT] + roll[GRADE], roll[YAW], pitch[YAW]);
        let angles = Matrix3::new(
            roll[LEAN] + roll[BANK],
            rp,
            ry, //
            rp,
            pitch[SQUAT] + pitch[GRADE],
            py, //
            ry,
            py,
            yaw[YAW],
        );
        let s = j * angles * j.transpose();
        let a = (s.m11 + r).sqrt();
        let (b, c) = (s.m21 / a, s.m31 / a);
        let d = (s.m22 + r - b * b).sqrt();
        let e = (s.m32 - b * c) / d;
        let f = (s.m33 + r - c * c - e * e).sqrt();
        let z0 = y.x / a;
        let z1 = (y.y - b * z0) / d;
        let z2 = (y.z - c * z0 - e * z1) / f;
        let nis = z0 * z0 + z1 * z1 + z2 * z2;
        // A root of a negative number or a division by zero ends here.
        nis.is_finite().then_some(Self { factor: [a, b, c, d, e, f], innovation: [z0, z1, z2], nis })
    }

    /// `W = P J' L'^-1`, column by column.
    pub(super) fn gains(&self, shared: &[State; 3], j: &Matrix3<f64>) -> [State; 3] {
        let [a, b, c, d, e, f] = self.factor;
        let [roll, pitch, yaw] = shared;
        let axis = |i: usize| roll * j[(i, 0)] + pitch * j[(i, 1)] + yaw * j[(i, 2)];
        let w0 = axis(0) / a;
        let w1 = (axis(1) - w0 * b) / d;
        let w2 = (axis(2) - w0 * c - w1 * e) / f;
        [w0, w1, w2]
    }
}
