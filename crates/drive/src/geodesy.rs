//! WGS-84: radii, gravity, Earth-centred and local coordinates.

use nalgebra::{Matrix3, Vector3};

/// Semi-major axis of WGS-84, m.
pub const SEMI_MAJOR_AXIS: f64 = 6_378_137.0;
/// Flattening of WGS-84.
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared of WGS-84.
pub const ECCENTRICITY2: f64 = FLATTENING * (2.0 - FLATTENING);
/// Rotation rate of the Earth, rad/s.
pub const EARTH_RATE: f64 = 7.292_115e-5;
/// Gravitational constant times the mass of the Earth, m^3/s^2.
pub const GM: f64 = 3.986_004_418e14;
/// Standard gravity, m/s^2.
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// A place on or near the ellipsoid: latitude and longitude in radians, height above the ellipsoid in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Geodetic {
    /// Latitude, rad, north positive.
    pub lat: f64,
    /// Longitude, rad, east positive.
    pub lon: f64,
    /// Height above the ellipsoid, m.
    pub alt: f64,
}

/// Meridian and transverse radii of curvature at a latitude (rad), m.
pub fn radii(lat: f64) -> (f64, f64) {
    radii_at(lat.sin().powi(2))
}

/// [`radii`] from the squared sine of the latitude.
pub fn radii_at(sin2_lat: f64) -> (f64, f64) {
    let w2 = 1.0 - ECCENTRICITY2 * sin2_lat;
    let w = w2.sqrt();
    (SEMI_MAJOR_AXIS * (1.0 - ECCENTRICITY2) / (w2 * w), SEMI_MAJOR_AXIS / w)
}

/// Normal gravity (positive down), m/s^2, Somigliana's formula with the height series.
pub fn gravity(lat: f64, alt: f64) -> f64 {
    gravity_at(lat.sin().powi(2), alt)
}

/// [`gravity`] from the squared sine of the latitude.
pub fn gravity_at(sin2_lat: f64, alt: f64) -> f64 {
    const SEMI_MINOR_AXIS: f64 = SEMI_MAJOR_AXIS * (1.0 - FLATTENING);
    const M: f64 = EARTH_RATE * EARTH_RATE * SEMI_MAJOR_AXIS * SEMI_MAJOR_AXIS * SEMI_MINOR_AXIS / GM;
    let w = (1.0 - ECCENTRICITY2 * sin2_lat).sqrt();
    let at_ellipsoid = 9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * sin2_lat) / w;
    let height = alt / SEMI_MAJOR_AXIS;
    at_ellipsoid * (1.0 - 2.0 * height * (1.0 + FLATTENING + M - 2.0 * FLATTENING * sin2_lat) + 3.0 * height * height)
}

impl Geodetic {
    /// Earth-centred Earth-fixed coordinates, m.
    pub fn to_ecef(self) -> Vector3<f64> {
        let (_, transverse) = radii(self.lat);
        let (sl, cl) = self.lat.sin_cos();
        let (so, co) = self.lon.sin_cos();
        Vector3::new(
            (transverse + self.alt) * cl * co,
            (transverse + self.alt) * cl * so,
            (transverse * (1.0 - ECCENTRICITY2) + self.alt) * sl,
        )
    }

    /// Geodetic coordinates of an Earth-centred position (m); exact to 1e-9 m near the surface.
    pub fn from_ecef(p: &Vector3<f64>) -> Self {
        let horizontal = p.x.hypot(p.y);
        let lon = p.y.atan2(p.x);
        let mut lat = p.z.atan2(horizontal * (1.0 - ECCENTRICITY2));
        // Fixed point on tan(lat) = (z + e2 N sin lat) / p: contracts by e2 = 0.0067 a step.
        for _ in 0..8 {
            let (_, n) = radii(lat);
            lat = (p.z + ECCENTRICITY2 * n * lat.sin()).atan2(horizontal);
        }
        let (_, n) = radii(lat);
        let (s, c) = lat.sin_cos();
        let alt = horizontal * c + p.z * s - n * (1.0 - ECCENTRICITY2 * s * s);
        Self { lat, lon, alt }
    }
}

/// Tangent frame: north, east, down in metres about an origin, through Earth-centred coordinates (no shortcut).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    /// Where the frame touches the Earth.
    pub origin: Geodetic,
    ecef: Vector3<f64>,
    ecef_to_ned: Matrix3<f64>,
}

impl LocalFrame {
    /// The frame at `origin`.
    pub fn new(origin: Geodetic) -> Self {
        let (sl, cl) = origin.lat.sin_cos();
        let (so, co) = origin.lon.sin_cos();
        let ecef_to_ned = Matrix3::new(-sl * co, -sl * so, cl, -so, co, 0.0, -cl * co, -cl * so, -sl);
        Self { origin, ecef: origin.to_ecef(), ecef_to_ned }
    }

    /// A point in Earth-centred, Earth-fixed axes, m, as north, east, down from the origin.
    pub fn of_ecef(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.ecef_to_ned * (point - self.ecef)
    }

    /// A direction or velocity in Earth-centred, Earth-fixed axes, turned to north, east, down at the origin.
    pub fn turn(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        self.ecef_to_ned * vector
    }

    /// North, east, down of a place, m.
    pub fn to_ned(&self, place: Geodetic) -> Vector3<f64> {
        self.of_ecef(&place.to_ecef())
    }

    /// The place at a north, east, down offset, m.
    pub fn to_geodetic(&self, ned: &Vector3<f64>) -> Geodetic {
        Geodetic::from_ecef(&(self.ecef + self.ecef_to_ned.transpose() * ned))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_and_earth_coordinates_are_inverse() {
        let origin = Geodetic { lat: 0.6348, lon: 2.2228, alt: 60.0 };
        let frame = LocalFrame::new(origin);
        let ned = Vector3::new(4200.0, -3100.0, -35.0);
        assert!((frame.to_ned(frame.to_geodetic(&ned)) - ned).norm() < 1e-8);
    }

    #[test]
    fn a_small_step_north_is_the_meridian_radius_times_the_angle() {
        let origin = Geodetic { lat: 0.7, lon: 0.1, alt: 0.0 };
        let ned = LocalFrame::new(origin).to_ned(Geodetic { lat: 0.7 + 1e-6, ..origin });
        assert!((ned.x - radii(0.7).0 * 1e-6).abs() < 1e-5);
    }

    #[test]
    fn gravity_matches_the_published_values() {
        // Normal gravity of WGS-84 (NIMA TR8350.2): equator 9.7803253359, pole 9.8321849379 m/s^2.
        assert!((gravity(0.0, 0.0) - 9.780_325_335_9).abs() < 1e-9);
        assert!((gravity(std::f64::consts::FRAC_PI_2, 0.0) - 9.832_184_937_9).abs() < 1e-8);
        assert!((gravity(0.63, 1000.0) - gravity(0.63, 0.0) + 3.086e-3).abs() < 3e-6);
    }
}
