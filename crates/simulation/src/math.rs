//! Arithmetic that gives the same bits natively and in wasm.
//!
//! The transcendental functions of `std` are the platform's own; this crate uses those of `libm` only.

use nalgebra::{Matrix3, Vector3};

/// Sine and cosine of an angle, rad.
pub fn sin_cos(angle: f64) -> (f64, f64) {
    libm::sincos(angle)
}

/// Smooth step from 0 to 1 over `t` in 0 to 1 with two vanishing derivatives at both ends; constant outside.
pub fn smooth_step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

/// Derivative of [`smooth_step`].
pub fn smooth_step_slope(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    let u = t * (1.0 - t);
    30.0 * u * u
}

/// Second derivative of [`smooth_step`].
pub fn smooth_step_bend(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    60.0 * t * (1.0 - t) * (1.0 - 2.0 * t)
}

/// Integral of [`smooth_step`] from 0 to `t`, for `t` in 0 to 1; at 1 it is one half.
pub fn smooth_step_integral(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    let t2 = t * t;
    t2 * t2 * (2.5 + t * (t - 3.0))
}

/// Wrap an angle to `(-pi, pi]`, rad.
pub fn wrap_angle(angle: f64) -> f64 {
    drivescope_drive::frames::wrap_angle(angle)
}

/// Rotation from body (FRD) to level (NED) axes, from roll, pitch and yaw, rad.
pub fn rotation(roll: f64, pitch: f64, yaw: f64) -> Matrix3<f64> {
    let (sr, cr) = sin_cos(roll);
    let (sp, cp) = sin_cos(pitch);
    let (sy, cy) = sin_cos(yaw);
    let about_yaw = Matrix3::new(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0);
    let about_pitch = Matrix3::new(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp);
    let about_roll = Matrix3::new(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr);
    about_yaw * about_pitch * about_roll
}

/// Roll, pitch and yaw of a rotation from body to level axes, rad.
pub fn roll_pitch_yaw(r: &Matrix3<f64>) -> [f64; 3] {
    let roll = libm::atan2(r[(2, 1)], r[(2, 2)]);
    let pitch = -libm::asin(r[(2, 0)].clamp(-1.0, 1.0));
    [roll, pitch, libm::atan2(r[(1, 0)], r[(0, 0)])]
}

/// Rotation by a vector of any length, rad.
pub fn rotation_by(vector: &Vector3<f64>) -> Matrix3<f64> {
    let angle2 = vector.norm_squared();
    // Below 1e-3 rad the series' next terms are under 1e-20.
    let (s, c) = if angle2 < 1e-6 {
        (1.0 - angle2 / 6.0 * (1.0 - angle2 / 20.0), 0.5 - angle2 / 24.0 * (1.0 - angle2 / 30.0))
    } else {
        let angle = angle2.sqrt();
        let (sin, cos) = sin_cos(angle);
        (sin / angle, (1.0 - cos) / angle2)
    };
    let k = vector.cross_matrix();
    Matrix3::identity() + k * s + k * k * c
}

/// Vector of a rotation by less than half a turn, rad: inverse of [`rotation_by`].
pub fn vector_of(r: &Matrix3<f64>) -> Vector3<f64> {
    let twice_sin = Vector3::new(r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]);
    let sin2 = 0.25 * twice_sin.norm_squared();
    if sin2 < 1e-4 {
        // asin(x)/x by its series; next term below 2e-18 for x < 0.01.
        let series = 1.0 + sin2 * (1.0 / 6.0 + sin2 * (3.0 / 40.0 + sin2 * (15.0 / 336.0 + sin2 * (105.0 / 3456.0))));
        return twice_sin * (0.5 * series);
    }
    let sin = sin2.sqrt();
    twice_sin * (0.5 * libm::atan2(sin, 0.5 * (r.trace() - 1.0)) / sin)
}

/// Rotation matrix of a unit quaternion `[w, x, y, z]`.
pub fn matrix_of(q: &[f64; 4]) -> Matrix3<f64> {
    let [w, x, y, z] = *q;
    let (x2, y2, z2) = (x + x, y + y, z + z);
    let (xx, yy, zz) = (x * x2, y * y2, z * z2);
    let (xy, xz, yz) = (x * y2, x * z2, y * z2);
    let (wx, wy, wz) = (w * x2, w * y2, w * z2);
    Matrix3::new(1.0 - yy - zz, xy - wz, xz + wy, xy + wz, 1.0 - xx - zz, yz - wx, xz - wy, yz + wx, 1.0 - xx - yy)
}

/// Unit quaternion `[w, x, y, z]` from roll, pitch and yaw, rad.
pub fn quaternion(roll: f64, pitch: f64, yaw: f64) -> [f64; 4] {
    let (sr, cr) = sin_cos(0.5 * roll);
    let (sp, cp) = sin_cos(0.5 * pitch);
    let (sy, cy) = sin_cos(0.5 * yaw);
    [cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_the_integral_of_its_slope_and_its_own_integral_ends_at_one_half() {
        let n = 20_000;
        let (mut rise, mut area) = (0.0, 0.0);
        for k in 0..n {
            let t = (f64::from(k) + 0.5) / f64::from(n);
            rise += smooth_step_slope(t) / f64::from(n);
            area += smooth_step(t) / f64::from(n);
        }
        // Midpoint rule: error of the order 1/n^2.
        assert!((rise - 1.0).abs() < 1e-7 && (area - 0.5).abs() < 1e-7);
        assert_eq!((smooth_step(1.0), smooth_step_integral(1.0)), (1.0, 0.5));
    }

    #[test]
    fn angles_come_back_from_matrix_and_quaternion_as_the_law_defines_them() {
        let (roll, pitch, yaw) = (0.2, -0.1, 2.5);
        let law = drivescope_drive::frames::body_to_nav(roll, pitch, yaw);
        assert!((rotation(roll, pitch, yaw) - law).norm() < 1e-14);
        assert!((matrix_of(&quaternion(roll, pitch, yaw)) - law).norm() < 1e-14);
        let back = roll_pitch_yaw(&law);
        assert!((back[0] - roll).abs() + (back[1] - pitch).abs() + (back[2] - yaw).abs() < 1e-14);
    }

    #[test]
    fn rotation_vectors_come_back_from_tiny_to_large() {
        for a in [1e-9, 9e-4, 1.1e-3, 9.9e-3, 0.011, 0.5, 3.0] {
            let v = Vector3::new(0.6, -0.64, 0.48) * a;
            assert!((vector_of(&rotation_by(&v)) - v).norm() < 1e-15 + 1e-13 * a, "{a}");
        }
    }
}
