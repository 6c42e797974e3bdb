//! What the sensors should read at a navigation state, and how the errors move it.
//!
//! Every function gives `z = indicated - measured` and its Jacobian `h`, so that `z = h dx + noise` with errors indicated
//! minus true. Source: SPEC navigation 4, after Yun & Yu 2007 (18), (19) with the misprints put right (cosine of the
//! latitude in the longitude row, sign of the height, no velocity in the position rows). Lever arms are in body axes, m.

use drivescope_drive::frames::skew;
use drivescope_drive::geodesy::Geodetic;
use nalgebra::{SMatrix, SVector, Vector3};

use super::covariance::{ALL_STATES, ODOMETER_SCALE};
use crate::ins::{ATTITUDE, Earth, GYRO_BIAS, Navigation, POSITION, VELOCITY};

/// Innovation and Jacobian of `M` rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction<const M: usize> {
    /// Indicated minus measured.
    pub z: SVector<f64, M>,
    /// Jacobian with respect to the errors.
    pub h: SMatrix<f64, M, ALL_STATES>,
}

impl Prediction<3> {
    /// The first two rows.
    pub fn horizontal(&self) -> Prediction<2> {
        Prediction { z: self.z.fixed_rows::<2>(0).into_owned(), h: self.h.fixed_rows::<2>(0).into_owned() }
    }
    /// The first row.
    pub fn forward(&self) -> Prediction<1> {
        Prediction { z: self.z.fixed_rows::<1>(0).into_owned(), h: self.h.fixed_rows::<1>(0).into_owned() }
    }
    /// The last two rows.
    pub fn sideways(&self) -> Prediction<2> {
        Prediction { z: self.z.fixed_rows::<2>(1).into_owned(), h: self.h.fixed_rows::<2>(1).into_owned() }
    }
}

/// Position of the antenna, NED, m, against a fix. (18)
pub fn position(navigation: &Navigation, earth: &Earth, antenna: &Vector3<f64>, fix: &Geodetic) -> Prediction<3> {
    let arm = navigation.body_to_nav * antenna;
    let mut h = SMatrix::<f64, 3, ALL_STATES>::zeros();
    h.fixed_view_mut::<3, 3>(0, POSITION).fill_with_identity();
    h.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&skew(&arm));
    Prediction { z: earth.displacement(fix, &navigation.place) + arm, h }
}

/// Velocity of the antenna, NED, m/s, against a measured one; `rate` is the body's, rad/s. (19)
pub fn velocity(
    navigation: &Navigation,
    antenna: &Vector3<f64>,
    rate: &Vector3<f64>,
    measured: &Vector3<f64>,
) -> Prediction<3> {
    let turning = navigation.body_to_nav * rate.cross(antenna);
    let mut h = SMatrix::<f64, 3, ALL_STATES>::zeros();
    h.fixed_view_mut::<3, 3>(0, VELOCITY).fill_with_identity();
    h.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&skew(&turning));
    h.fixed_view_mut::<3, 3>(0, GYRO_BIAS).copy_from(&-(navigation.body_to_nav * skew(antenna)));
    Prediction { z: navigation.velocity + turning - measured, h }
}

/// Velocity of the odometer's point in body axes, m/s, against a forward speed and no motion sideways or upward.
///
/// An odometer of scale `scale` shows that much of the forward velocity.
pub fn body_velocity(
    navigation: &Navigation,
    odometer: &Vector3<f64>,
    rate: &Vector3<f64>,
    forward_speed: f64,
    scale: f64,
) -> Prediction<3> {
    let nav_to_body = navigation.body_to_nav.transpose();
    let mut h = SMatrix::<f64, 3, ALL_STATES>::zeros();
    h.fixed_view_mut::<3, 3>(0, VELOCITY).copy_from(&nav_to_body);
    h.fixed_view_mut::<3, 3>(0, ATTITUDE).copy_from(&-(nav_to_body * skew(&navigation.velocity)));
    h.fixed_view_mut::<3, 3>(0, GYRO_BIAS).copy_from(&-skew(odometer));
    let mut z = nav_to_body * navigation.velocity + rate.cross(odometer);
    h.row_mut(0).scale_mut(scale);
    h[(0, ODOMETER_SCALE)] = z.x;
    z.x = z.x * scale - forward_speed;
    Prediction { z, h }
}

/// Velocity of a car that stands, NED, m/s.
pub fn zero_velocity(navigation: &Navigation) -> Prediction<3> {
    let mut h = SMatrix::<f64, 3, ALL_STATES>::zeros();
    h.fixed_view_mut::<3, 3>(0, VELOCITY).fill_with_identity();
    Prediction { z: navigation.velocity, h }
}

/// Mean rates of a car that stands, rad/s: what is left beyond the Earth's rotation is bias.
pub fn zero_rate(navigation: &Navigation, earth: &Earth, mean_rate: &Vector3<f64>) -> Prediction<3> {
    let mut h = SMatrix::<f64, 3, ALL_STATES>::zeros();
    h.fixed_view_mut::<3, 3>(0, GYRO_BIAS).fill_with_identity();
    Prediction { z: mean_rate - navigation.body_to_nav.transpose() * earth.rate(), h }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::GravityModel;
    use crate::testing::assert_jacobian;
    use drivescope_drive::frames::body_to_nav;

    const ANTENNA: Vector3<f64> = Vector3::new(0.8, -0.3, -1.2);
    const RATE: Vector3<f64> = Vector3::new(0.05, -0.1, 0.4);

    fn truth() -> Navigation {
        Navigation {
            place: Geodetic { lat: 0.63, lon: 2.2, alt: 40.0 },
            velocity: Vector3::new(12.0, -7.0, 0.6),
            body_to_nav: body_to_nav(0.1, -0.15, 0.9),
        }
    }

    /// The state that indicates `truth` plus the errors.
    fn indicated(errors: &SVector<f64, ALL_STATES>) -> (Navigation, Earth, Vector3<f64>) {
        let mut navigation = truth();
        let earth = Earth::at(&navigation.place, GravityModel::Wgs84);
        navigation.correct(&-errors.fixed_rows::<9>(0).into_owned(), &earth);
        (navigation, earth, RATE + errors.fixed_rows::<3>(GYRO_BIAS))
    }

    /// Steps of 1e-6 in all errors: rounding of a latitude step is 1e-9 m / 1e-6 m = 1e-3 relative for the position rows, so
    /// their differences are taken from 1 m (below); every other row is good to 1e-8, and 1e-6 shows any missing term.
    fn check(f: impl Fn(&SVector<f64, ALL_STATES>) -> Prediction<3>) {
        let zero = SVector::zeros();
        assert_jacobian(|x| f(x).z, &f(&zero).h, &zero, 1e-6);
    }

    #[test]
    fn velocity_rows_are_the_derivative_of_the_antennas_velocity() {
        check(|x| {
            let (n, _, rate) = indicated(x);
            velocity(&n, &ANTENNA, &rate, &Vector3::new(1.0, 2.0, 3.0))
        });
    }

    #[test]
    fn body_rows_are_the_derivative_of_the_odometers_velocity() {
        check(|x| {
            let (n, _, rate) = indicated(x);
            body_velocity(&n, &ANTENNA, &rate, 12.0, 1.02 + x[ODOMETER_SCALE])
        });
    }

    #[test]
    fn standing_rows_are_the_derivatives_of_velocity_and_rate() {
        check(|x| zero_velocity(&indicated(x).0));
        let zero = SVector::zeros();
        let f = |x: &SVector<f64, ALL_STATES>| {
            let (n, earth, rate) = indicated(x);
            zero_rate(&n, &earth, &rate)
        };
        // The Earth's rotation seen through a tilted body (7e-5 rad/s per rad) is left out of the Jacobian.
        assert_jacobian(|x| f(x).z, &f(&zero).h, &zero, 1e-4);
    }

    /// Metres as steps in the position, so that rounding of the latitude (1e-9 m) does not matter.
    #[test]
    fn position_rows_are_the_derivative_of_the_antennas_position() {
        let fix = Geodetic { lat: 0.630_001, lon: 2.200_002, alt: 38.0 };
        let f = |errors: &SVector<f64, ALL_STATES>| {
            let (n, earth, _) = indicated(errors);
            position(&n, &earth, &ANTENNA, &fix)
        };
        let h = f(&SVector::zeros()).h;
        for column in 0..ALL_STATES {
            let size = if column < 3 { 1.0 } else { 1e-4 };
            let mut step = SVector::<f64, ALL_STATES>::zeros();
            step[column] = size;
            let numeric = (f(&step).z - f(&-step).z) / (2.0 * size);
            assert!((numeric - h.column(column)).amax() < 1e-4, "column {column}: {numeric}");
        }
    }

    /// A fix to the north of where we think we are must give a negative error to the north; below us, a negative one down.
    #[test]
    fn the_innovation_is_indicated_minus_measured() {
        let n = truth();
        let earth = Earth::at(&n.place, GravityModel::Wgs84);
        let fix = Geodetic { lat: n.place.lat + 1e-6, lon: n.place.lon, alt: n.place.alt - 4.0 };
        let z = position(&n, &earth, &Vector3::zeros(), &fix).z;
        assert!((z.x + 1e-6 * earth.north_radius).abs() < 1e-6 && z.y == 0.0 && (z.z + 4.0).abs() < 1e-9);
    }
}
