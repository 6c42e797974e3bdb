//! Attitude from two vectors: the magnetic field and gravity.

use drivescope_drive::frames::{Euler, euler_zyx};
use nalgebra::{Matrix3, Vector3};

use super::GRAVITY;

/// Sine of the smallest usable angle between field and gravity (5 deg).
const SMALLEST_SINE: f64 = 0.0872;
/// Length below which a vector has no direction.
const SMALLEST_NORM: f64 = 1e-9;

/// Body-frame direction of gravity that a lateral accelerometer tells of a car without grade and lateral motion.
///
/// `[0, y, sqrt(1 - y^2)]`, `y = -accel_y / g`; `None` when `|accel_y| > g`.
/// Source: Hwang & Choi 2016 (7), in FRD axes. Only valid without grade and without lateral acceleration.
pub(super) fn pseudo_gravity(accel_y: f64) -> Option<Vector3<f64>> {
    let y = -accel_y / GRAVITY;
    (y.abs() <= 1.0).then(|| Vector3::new(0.0, y, (1.0 - y * y).sqrt()))
}

/// The TRIAD solution against a fixed reference field.
///
/// Source: Hwang & Choi 2016 (8) to (10). Departure: the third reference axis is `r1 x r2`; (9) prints `s1 x s2`, which
/// gives no attitude. The field's direction is met exactly; gravity as closely as that allows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triad {
    /// Transpose of the reference triad; `None` where the reference field is vertical or has no length.
    reference: Option<Matrix3<f64>>,
}

/// Orthonormal triad whose first axis is `first` and whose second is normal to both; `None` if they are too parallel.
fn triad(first: &Vector3<f64>, second: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let (a, b) = (first.try_normalize(SMALLEST_NORM)?, second.try_normalize(SMALLEST_NORM)?);
    let normal = a.cross(&b);
    let sine = normal.norm();
    if sine.is_nan() || sine < SMALLEST_SINE {
        return None;
    }
    let normal = normal / sine;
    Some(Matrix3::from_columns(&[a, normal, a.cross(&normal)]))
}

impl Triad {
    pub(super) fn new(reference: &Vector3<f64>) -> Self {
        Self { reference: triad(reference, &Vector3::z()).map(|r| r.transpose()) }
    }

    /// Attitude from the body-frame field and the body-frame direction of gravity; `None` where they do not fix one.
    pub(super) fn attitude(&self, field: &Vector3<f64>, down: &Vector3<f64>) -> Option<Euler> {
        let nav_to_body = triad(field, down)? * self.reference?; // (9)
        Some(euler_zyx(&nav_to_body.transpose())) // (10)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::frames::{body_to_nav, wrap_angle};

    const FIELD: Vector3<f64> = Vector3::new(30.11237, -4.22703, 40.12585);

    #[test]
    fn a_level_road_gives_the_attitude_back_exactly() {
        // Without pitch the pseudo gravity is the true one. Catches the printed (9), and a swapped sign of accel_y.
        for (roll, yaw) in [(0.0, 0.5), (0.3, -2.0), (-0.5, 3.0)] {
            let c = body_to_nav(roll, 0.0, yaw).transpose();
            let accel_y = -GRAVITY * f64::sin(roll);
            let e = Triad::new(&FIELD).attitude(&(c * FIELD), &pseudo_gravity(accel_y).unwrap()).unwrap();
            assert!((e.roll - roll).abs() < 1e-14 && e.pitch.abs() < 1e-14 && wrap_angle(e.yaw - yaw).abs() < 1e-14);
        }
    }

    #[test]
    fn vectors_that_fix_no_attitude_give_none() {
        let t = Triad::new(&FIELD);
        assert!(pseudo_gravity(9.9).is_none() && pseudo_gravity(f64::NAN).is_none());
        assert!(t.attitude(&Vector3::zeros(), &Vector3::z()).is_none());
        assert!(t.attitude(&Vector3::new(f64::NAN, 0.0, 0.0), &Vector3::z()).is_none());
        assert!(t.attitude(&Vector3::new(0.08, 0.0, 1.0), &Vector3::z()).is_none(), "4.6 deg from gravity");
        assert!(t.attitude(&Vector3::new(0.09, 0.0, 1.0), &Vector3::z()).is_some(), "5.1 deg from gravity");
        assert!(Triad::new(&Vector3::z()).attitude(&FIELD, &Vector3::z()).is_none(), "a vertical reference");
    }
}
