//! The magnetic field that a magnetometer should see, from attitude and the reference field.

use drivescope_drive::frames::Euler;
use nalgebra::{Matrix3, Vector3};

use super::trig::sin_cos;

/// Sines and cosines of an attitude.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rotation {
    roll: (f64, f64),
    pitch: (f64, f64),
    yaw: (f64, f64),
}

impl Rotation {
    pub(super) fn new(attitude: &Euler) -> Self {
        Self { roll: sin_cos(attitude.roll), pitch: sin_cos(attitude.pitch), yaw: sin_cos(attitude.yaw) }
    }

    /// Predicted body-frame field `h = C(roll, pitch, yaw) H` and its derivatives by roll, pitch and yaw (columns).
    ///
    /// `C` maps navigation to body. Source: Hwang & Choi 2016 (1) and (12). Departure: element (1, 2) of (12) repeats
    /// `cos pitch cos yaw` in print; here it is `cos pitch sin yaw`, as a rotation needs.
    pub(super) fn predicted_field(&self, reference: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
        let ((sr, cr), (sp, cp), (sy, cy)) = (self.roll, self.pitch, self.yaw);
        // Turned by yaw, then by pitch: (ahead, right, below).
        let ahead = cy * reference.x + sy * reference.y;
        let right = -sy * reference.x + cy * reference.y;
        let x = cp * ahead - sp * reference.z;
        let below = sp * ahead + cp * reference.z;
        let (y, z) = (sr * below + cr * right, cr * below - sr * right);
        let by_roll = Vector3::new(0.0, z, -y);
        let by_pitch = Vector3::new(-below, sr * x, cr * x);
        let by_yaw = Vector3::new(cp * right, sr * sp * right - cr * ahead, cr * sp * right + sr * ahead);
        (Vector3::new(x, y, z), Matrix3::from_columns(&[by_roll, by_pitch, by_yaw]))
    }

    /// Direction of gravity in the body frame: the third column of `C`.
    pub(super) fn down(&self) -> Vector3<f64> {
        let ((sr, cr), (sp, cp)) = (self.roll, self.pitch);
        Vector3::new(-sp, sr * cp, cr * cp)
    }
}

/// [`Rotation::predicted_field`] of an attitude.
pub(super) fn predicted_field(attitude: &Euler, reference: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    Rotation::new(attitude).predicted_field(reference)
}

/// [`Rotation::down`] of an attitude.
pub(super) fn down_in_body(attitude: &Euler) -> Vector3<f64> {
    Rotation::new(attitude).down()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::assert_jacobian;
    use drivescope_drive::frames::body_to_nav;
    use nalgebra::vector;

    #[test]
    fn the_predicted_field_is_the_rotated_reference_and_its_columns_are_its_derivatives() {
        // Catches the paper's misprint of (12), which is no rotation, and any swapped sine.
        let reference = Vector3::new(30.0, -4.0, 40.0);
        for (roll, pitch, yaw) in [(0.3, -0.2, 2.5), (-0.7, 0.6, -3.0), (0.0, 0.0, 0.0)] {
            let (h, j) = predicted_field(&Euler { roll, pitch, yaw }, &reference);
            assert!((h - body_to_nav(roll, pitch, yaw).transpose() * reference).norm() < 1e-13);
            let model = |x: &Vector3<f64>| predicted_field(&Euler { roll: x[0], pitch: x[1], yaw: x[2] }, &reference).0;
            // Values near 50 and steps of 1e-6 leave 1e-8 of rounding in a central difference.
            assert_jacobian(model, &j, &vector![roll, pitch, yaw], 1e-7);
            let down = body_to_nav(roll, pitch, yaw).transpose() * Vector3::z();
            assert!((down_in_body(&Euler { roll, pitch, yaw }) - down).norm() < 1e-15);
        }
    }
}
