//! Gravity in the body from the field and the lateral accelerometer alone, without assuming a level road.

use nalgebra::{Vector3, vector};

use super::GRAVITY;

/// The least share of the field that has to lie along the car to fix its pitch.
pub(super) const LEAST_CONDITION: f64 = 0.15;

/// Body-frame direction of gravity: on the cone that the dip of the reference gives round the measured field, at the
/// tilt that the lateral accelerometer feels. `None` where the cone only touches that tilt.
///
/// `accel_y` holds gravity alone (the turn taken off), `pitch` is the one last known, which decides between the two
/// solutions. Source: SPEC orientation 5.2.
pub(super) fn gravity_on_cone(
    field: &Vector3<f64>,
    accel_y: f64,
    reference: &Vector3<f64>,
    pitch: f64,
) -> Option<Vector3<f64>> {
    let (b, y) = (field.normalize(), -accel_y / GRAVITY);
    let rho2 = b.x * b.x + b.z * b.z;
    let w = reference.z / reference.norm() - b.y * y;
    let determinant = ((1.0 - y * y) * rho2 - w * w).max(0.0).sqrt();
    if determinant.is_nan() || determinant < LEAST_CONDITION {
        return None;
    }
    let root = |sign: f64| {
        let u = vector![(w * b.x - sign * b.z * determinant) / rho2, y, (w * b.z + sign * b.x * determinant) / rho2];
        u.normalize()
    };
    let miss = |u: &Vector3<f64>| (-u.x.clamp(-1.0, 1.0).asin() - pitch).abs();
    let mut best: Option<Vector3<f64>> = None;
    for u in [root(1.0), root(-1.0)] {
        if u.z >= 0.0 && best.is_none_or(|other| miss(&u) < miss(&other)) {
            best = Some(u);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::frames::body_to_nav;

    const FIELD: Vector3<f64> = Vector3::new(30.11237, -4.22703, 40.12585);

    #[test]
    fn gravity_is_found_on_a_slope_where_the_static_solution_takes_it_for_level() {
        // Heading 30 deg, 8 deg uphill, leaning 10 deg. Catches a swapped root and a sign of accel_y.
        for (roll, pitch, yaw) in [(0.17f64, 0.14, 0.52), (-0.3, -0.1, 2.9), (0.0, 0.0, 0.1)] {
            let to_body = body_to_nav(roll, pitch, yaw).transpose();
            let down = to_body * Vector3::z();
            let found = gravity_on_cone(&(to_body * FIELD), -GRAVITY * down.y, &FIELD, pitch + 0.05).unwrap();
            assert!((found - down).norm() < 1e-12, "{found} {down}");
        }
    }

    #[test]
    fn a_field_across_the_car_fixes_no_pitch() {
        // At magnetic east the determinant, cos(dip) |cos(heading)| on the level, vanishes.
        let declination = FIELD.y.atan2(FIELD.x);
        let at = |heading: f64| {
            let to_body = body_to_nav(0.0, 0.0, declination + heading).transpose();
            gravity_on_cone(&(to_body * FIELD), 0.0, &FIELD, 0.0)
        };
        assert!(at(std::f64::consts::FRAC_PI_2).is_none() && at(1.1).is_some());
        assert!(gravity_on_cone(&FIELD, f64::NAN, &FIELD, 0.0).is_none());
    }
}
