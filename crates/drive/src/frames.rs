//! Rotations between body (FRD) and navigation (NED) axes.

use nalgebra::{Matrix3, Vector3};

/// Roll, pitch and yaw in radians, ZYX Tait-Bryan: roll right side down, pitch nose up, yaw clockwise from true north.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Euler {
    /// Roll, rad, right side down positive.
    pub roll: f64,
    /// Pitch, rad, nose up positive.
    pub pitch: f64,
    /// Yaw, rad, clockwise from true north.
    pub yaw: f64,
}

/// Rotation from body (FRD) to navigation (NED) axes, from ZYX Tait-Bryan angles in radians.
///
/// `v_n = body_to_nav(roll, pitch, yaw) * v_b`. Transpose of the matrix of Hwang & Choi 2016 (1), which maps
/// navigation to body. Inverse: [`euler_zyx`].
pub fn body_to_nav(roll: f64, pitch: f64, yaw: f64) -> Matrix3<f64> {
    let (sr, cr) = roll.sin_cos();
    let (sp, cp) = pitch.sin_cos();
    let (sy, cy) = yaw.sin_cos();
    Matrix3::new(
        cp * cy,
        -cr * sy + sr * sp * cy,
        sr * sy + cr * sp * cy,
        cp * sy,
        cr * cy + sr * sp * sy,
        -sr * cy + cr * sp * sy,
        -sp,
        sr * cp,
        cr * cp,
    )
}

/// ZYX Tait-Bryan angles of a body-to-navigation rotation; pitch in `[-pi/2, pi/2]`.
pub fn euler_zyx(body_to_nav: &Matrix3<f64>) -> Euler {
    let c = body_to_nav;
    Euler {
        roll: c[(2, 1)].atan2(c[(2, 2)]),
        pitch: -c[(2, 0)].clamp(-1.0, 1.0).asin(),
        yaw: c[(1, 0)].atan2(c[(0, 0)]),
    }
}

/// Wrap an angle to `(-pi, pi]`, radians. Not finite in, not finite out.
pub fn wrap_angle(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if angle > -PI && angle <= PI {
        return angle;
    }
    let wrapped = angle.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}

/// Cross-product matrix: `skew(a) * b = a x b`.
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Rotation by the vector `a` (radians): `exp([a x])`, Rodrigues' formula, exact to rounding also near zero.
pub fn exp_rotation(a: &Vector3<f64>) -> Matrix3<f64> {
    let angle2 = a.norm_squared();
    // Series below 1e-4 rad: the next terms are under 1e-18.
    let (s, c) = if angle2 < 1e-8 {
        (1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0)
    } else {
        let angle = angle2.sqrt();
        let (sin, cos) = angle.sin_cos();
        (sin / angle, (1.0 - cos) / angle2)
    };
    let k = skew(a);
    Matrix3::identity() + k * s + k * k * c
}

/// Rotation vector of a rotation matrix, radians: inverse of [`exp_rotation`] for angles below pi.
pub fn log_rotation(r: &Matrix3<f64>) -> Vector3<f64> {
    let twice_sin = Vector3::new(r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]);
    let sin = 0.5 * twice_sin.norm();
    let cos = 0.5 * (r.trace() - 1.0);
    let angle = sin.atan2(cos);
    if sin < 1e-9 {
        return twice_sin * 0.5;
    }
    twice_sin * (0.5 * angle / sin)
}

/// Nearest rotation to a slightly damaged one, by one Gram-Schmidt pass over its columns.
pub fn orthonormalize(r: &Matrix3<f64>) -> Matrix3<f64> {
    let x = r.column(0).normalize();
    let y = r.column(1) - x * x.dot(&r.column(1));
    let y = y.normalize();
    Matrix3::from_columns(&[x, y, x.cross(&y)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn euler_angles_come_back_from_their_matrix() {
        for &(roll, pitch, yaw) in &[(0.3, -0.2, 2.5), (-1.0, 0.7, -3.0), (0.0, 0.0, PI)] {
            let e = euler_zyx(&body_to_nav(roll, pitch, yaw));
            assert!((e.roll - roll).abs() < 1e-14 && (e.pitch - pitch).abs() < 1e-14);
            assert!(wrap_angle(e.yaw - yaw).abs() < 1e-14);
        }
    }

    #[test]
    fn signs_follow_the_law() {
        // Yaw 90 deg: forward points east. Pitch up: forward points up (down component negative). Roll: right goes down.
        assert!((body_to_nav(0.0, 0.0, PI / 2.0) * Vector3::x() - Vector3::y()).norm() < 1e-15);
        assert!((body_to_nav(0.0, 0.1, 0.0) * Vector3::x()).z < 0.0);
        assert!((body_to_nav(0.1, 0.0, 0.0) * Vector3::y()).z > 0.0);
    }

    #[test]
    fn wrap_keeps_plus_pi_and_turns_minus_pi() {
        assert_eq!(wrap_angle(PI), PI);
        assert_eq!(wrap_angle(-PI), PI);
        assert!((wrap_angle(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-15);
        assert!(wrap_angle(f64::NAN).is_nan());
    }

    #[test]
    fn exponential_and_logarithm_are_inverse_from_tiny_to_large() {
        for a in [1e-12, 1e-6, 1e-3, 0.5, 3.0] {
            let v = Vector3::new(0.6, -0.64, 0.48) * a;
            assert!((log_rotation(&exp_rotation(&v)) - v).norm() < 1e-9 * a.max(1e-6), "{a}");
        }
    }

    #[test]
    fn orthonormalize_restores_a_rotation() {
        let r = body_to_nav(0.2, 0.1, 1.0);
        let fixed = orthonormalize(&(r * 1.001));
        assert!((fixed - r).norm() < 1e-12);
    }
}
