//! WGS-84 through `libm`: the same formulas as `drive::geodesy`, with the same bits on every platform.

use drivescope_drive::geodesy::{EARTH_RATE, ECCENTRICITY2, FLATTENING, GM, Geodetic, SEMI_MAJOR_AXIS};
use nalgebra::{Matrix3, Vector3};

use crate::math::sin_cos;

/// What an inertial sensor needs to know of the place where it is.
#[derive(Clone, Copy, Debug)]
pub struct Local {
    /// Meridian radius of curvature plus height, m.
    pub north_radius: f64,
    /// Transverse radius of curvature plus height, m.
    pub east_radius: f64,
    /// Normal gravity, downward, m/s^2.
    pub gravity: f64,
    /// Rotation of the Earth in north, east, down axes, rad/s.
    pub earth_rate: Vector3<f64>,
    /// Tangent of the latitude.
    pub tan_lat: f64,
}

impl Local {
    /// Radii, normal gravity (Somigliana with the height series) and Earth rate at a place.
    pub fn at(place: &Geodetic) -> Self {
        let (sin, cos) = sin_cos(place.lat);
        let s2 = sin * sin;
        let w2 = 1.0 - ECCENTRICITY2 * s2;
        let w = w2.sqrt();
        let height = place.alt;
        let semi_minor = SEMI_MAJOR_AXIS * (1.0 - FLATTENING);
        let m = EARTH_RATE * EARTH_RATE * SEMI_MAJOR_AXIS * SEMI_MAJOR_AXIS * semi_minor / GM;
        let at_ellipsoid = 9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * s2) / w;
        let relative = height / SEMI_MAJOR_AXIS;
        let series = 1.0 - 2.0 * relative * (1.0 + FLATTENING + m - 2.0 * FLATTENING * s2) + 3.0 * relative * relative;
        Self {
            north_radius: SEMI_MAJOR_AXIS * (1.0 - ECCENTRICITY2) / (w2 * w) + height,
            east_radius: SEMI_MAJOR_AXIS / w + height,
            gravity: at_ellipsoid * series,
            earth_rate: Vector3::new(EARTH_RATE * cos, 0.0, -EARTH_RATE * sin),
            tan_lat: sin / cos,
        }
    }

    /// Rotation of the level axes against the Earth at a velocity (north, east, down; m/s), rad/s.
    pub fn transport_rate(&self, velocity: &Vector3<f64>) -> Vector3<f64> {
        let east = velocity.y / self.east_radius;
        Vector3::new(east, -velocity.x / self.north_radius, -east * self.tan_lat)
    }
}

/// Tangent frame at the drive's origin.
#[derive(Clone, Copy, Debug)]
pub struct TangentFrame {
    origin: Vector3<f64>,
    to_ned: Matrix3<f64>,
}

/// Earth-centred coordinates of a place, m, and the rotation from them to north, east, down.
pub(crate) fn earth_centred(place: &Geodetic) -> (Vector3<f64>, Matrix3<f64>) {
    let (sl, cl) = sin_cos(place.lat);
    let (so, co) = sin_cos(place.lon);
    let transverse = SEMI_MAJOR_AXIS / (1.0 - ECCENTRICITY2 * sl * sl).sqrt();
    let horizontal = (transverse + place.alt) * cl;
    let vertical = (transverse * (1.0 - ECCENTRICITY2) + place.alt) * sl;
    let to_ned = Matrix3::new(-sl * co, -sl * so, cl, -so, co, 0.0, -cl * co, -cl * so, -sl);
    (Vector3::new(horizontal * co, horizontal * so, vertical), to_ned)
}

impl TangentFrame {
    /// The frame that touches the Earth at `origin`.
    pub fn new(origin: &Geodetic) -> Self {
        let (origin, to_ned) = earth_centred(origin);
        Self { origin, to_ned }
    }

    /// North, east and down of a place, m.
    pub fn to_ned(&self, place: &Geodetic) -> Vector3<f64> {
        self.to_ned * (earth_centred(place).0 - self.origin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::geodesy;

    #[test]
    fn this_earth_is_the_earth_of_the_law() {
        let origin = Geodetic { lat: 0.6348, lon: 2.2228, alt: 60.0 };
        let place = Geodetic { lat: 0.6353, lon: 2.2221, alt: 140.0 };
        let law = geodesy::LocalFrame::new(origin).to_ned(place);
        // Subtracting Earth-centred coordinates of 6e6 m leaves a few nanometres.
        assert!((TangentFrame::new(&origin).to_ned(&place) - law).norm() < 2e-8);
        let local = Local::at(&place);
        let (north, east) = geodesy::radii(place.lat);
        assert!((local.north_radius - north - 140.0).abs() < 1e-8 && (local.east_radius - east - 140.0).abs() < 1e-8);
        assert!((local.gravity - geodesy::gravity(place.lat, place.alt)).abs() < 1e-14);
    }
}
