//! The Earth's magnetic field at a place and a date: the World Magnetic Model.
//!
//! Models of 2015 (second version), 2020 and 2025, degree and order 12, each with its linear change over five years.
//! Source: Chulliat et al. 2025, The US/UK World Magnetic Model for 2025-2030, equations (7) to (13).
//! Not modelled: rocks, buildings, cars and the ionosphere; the model itself errs by about 0.15 uT and 0.4 deg.

mod coefficients;

use nalgebra::Vector3;

use self::coefficients::{MODELS, Model};
use crate::geodesy::{ECCENTRICITY2, Geodetic, radii};

/// First decimal year that a published model covers.
pub const FIRST_YEAR: f64 = 2015.0;
/// Decimal year at which the last published model ends.
pub const LAST_YEAR: f64 = 2030.0;
/// Reference radius of the model, m.
const REFERENCE_RADIUS: f64 = 6_371_200.0;
const DEGREE: usize = 12;

/// The Earth's field at a place (north, east, down; microtesla) at a decimal year.
///
/// A year before the first or after the last model is taken as the nearest one that is covered; NaN where the place or
/// the year is not finite.
pub fn earth_field(place: &Geodetic, year: f64) -> Vector3<f64> {
    if !(place.lat.is_finite() && place.lon.is_finite() && place.alt.is_finite() && year.is_finite()) {
        return Vector3::repeat(f64::NAN);
    }
    let year = year.clamp(FIRST_YEAR, LAST_YEAR);
    let model = MODELS.iter().rev().find(|m| m.year <= year).unwrap_or(&MODELS[0]);
    // Geocentric latitude and radius from the place's height over the ellipsoid. (7), (8)
    let (sin_lat, cos_lat) = place.lat.sin_cos();
    let (_, transverse) = radii(place.lat);
    let axial = (transverse * (1.0 - ECCENTRICITY2) + place.alt) * sin_lat;
    let equatorial = (transverse + place.alt) * cos_lat;
    let radius = axial.hypot(equatorial);
    let (sin, cos) = (axial / radius, (equatorial / radius).max(1e-10));
    let geocentric = synthesis(model, year - model.year, sin, cos, place.lon, REFERENCE_RADIUS / radius);
    // Turn from geocentric to geodetic north and down. (17)
    let (turn_sin, turn_cos) = (sin * cos_lat - cos * sin_lat, cos * cos_lat + sin * sin_lat);
    let (north, down) = (geocentric.x, geocentric.z);
    Vector3::new(north * turn_cos - down * turn_sin, geocentric.y, north * turn_sin + down * turn_cos)
}

/// Sum of the harmonics at a sine and cosine of geocentric latitude: geocentric north, east, down, uT.
fn synthesis(model: &Model, years: f64, sin: f64, cos: f64, lon: f64, ratio: f64) -> Vector3<f64> {
    // Legendre functions of this degree and the two below, by order, and their derivatives over the colatitude.
    let (mut p, mut p1) = ([0.0; DEGREE + 1], [0.0; DEGREE + 1]);
    let (mut d, mut d1) = ([0.0; DEGREE + 1], [0.0; DEGREE + 1]);
    p[0] = 1.0;
    let angles: [(f64, f64); DEGREE + 1] = std::array::from_fn(|m| (m as f64 * lon).sin_cos());
    let mut field = Vector3::zeros();
    let (mut power, mut index) = (ratio * ratio, 0);
    for n in 1..=DEGREE {
        let (p2, d2) = (std::mem::replace(&mut p1, p), std::mem::replace(&mut d1, d));
        power *= ratio;
        for m in 0..=n {
            (p[m], d[m]) = legendre(n, m, (sin, cos), (&p1, &d1), (&p2, &d2));
            let value = |i: usize| f64::from(model.field[i]) + years * f64::from(model.change[i]);
            let (g, h) = (value(index), value(index + 1));
            index += 2;
            let (s, c) = angles[m];
            let along = g * c + h * s;
            field.x += power * along * d[m]; // (10)
            field.y += power * m as f64 * (g * s - h * c) * p[m] / cos; // (11)
            field.z -= power * (n + 1) as f64 * along * p[m]; // (12)
        }
    }
    field * 1e-4
}

/// Schmidt semi-normalised Legendre function of degree `n` and order `m` and its derivative, from the degrees below.
fn legendre(
    n: usize,
    m: usize,
    (sin, cos): (f64, f64),
    (p1, d1): (&[f64], &[f64]),
    (p2, d2): (&[f64], &[f64]),
) -> (f64, f64) {
    let nf = n as f64;
    if n == m {
        let k = if n == 1 { 1.0 } else { ((2.0 * nf - 1.0) / (2.0 * nf)).sqrt() };
        return (k * cos * p1[n - 1], k * (cos * d1[n - 1] + sin * p1[n - 1]));
    }
    let m2 = (m * m) as f64;
    let root = (nf * nf - m2).sqrt();
    let below = ((nf - 1.0) * (nf - 1.0) - m2).max(0.0).sqrt();
    let a = 2.0 * nf - 1.0;
    ((a * sin * p1[m] - below * p2[m]) / root, (a * (sin * d1[m] - cos * p1[m]) - below * d2[m]) / root)
}

/// The decimal year of a Unix time (seconds since 1970-01-01 UTC).
pub fn decimal_year(unix: f64) -> f64 {
    const YEAR: f64 = 365.25 * 86_400.0;
    let start = |year: f64| {
        let before = year - 1.0;
        let leap_days = (before / 4.0).floor() - (before / 100.0).floor() + (before / 400.0).floor() - 477.0;
        ((year - 1970.0) * 365.0 + leap_days) * 86_400.0
    };
    let mut year = (1970.0 + unix / YEAR).floor();
    if start(year) > unix {
        year -= 1.0;
    } else if start(year + 1.0) <= unix {
        year += 1.0;
    }
    year + (unix - start(year)) / (start(year + 1.0) - start(year))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Year, height km, latitude and longitude deg; north, east, down nT.
    /// Rows of NOAA's WMM2025_TestValues.txt, spread over years, heights and both hemispheres.
    const PUBLISHED: [[f64; 7]; 10] = [
        [2025.0, 28.0, 89.0, -121.0, -255.388723, -1482.460628, 56194.288771],
        [2025.0, 65.0, 43.0, 93.0, 24299.852822, 210.517066, 50037.923998],
        [2025.0, 51.0, -33.0, 109.0, 21737.778822, -2090.274098, -52710.003920],
        [2025.5, 6.0, -36.0, -137.0, 23781.930678, 8786.698927, -32577.518648],
        [2025.5, 8.0, -66.0, 17.0, 15201.438652, -9925.501123, -30881.123197],
        [2026.0, 74.0, -57.0, 3.0, 13268.119649, -5498.179626, -23576.062921],
        [2026.0, 62.0, -14.0, 99.0, 33437.828630, -835.919473, -33100.922253],
        [2026.5, 14.0, 0.0, 80.0, 39431.415992, -2133.456168, -12188.838466],
        [2027.0, 37.0, -66.0, -5.0, 16390.771268, -5079.626554, -28608.243575],
        [2027.5, 73.0, -72.0, 95.0, -2912.418045, -12984.118939, -55399.217725],
    ];

    fn at(lat: f64, lon: f64, alt: f64) -> Geodetic {
        Geodetic { lat: lat.to_radians(), lon: lon.to_radians(), alt }
    }

    #[test]
    fn the_field_is_that_of_the_published_test_values() {
        for [year, height, lat, lon, north, east, down] in PUBLISHED {
            let field = earth_field(&at(lat, lon, height * 1e3), year) * 1e3;
            let error = field - Vector3::new(north, east, down);
            // The values are printed to a millionth of a nanotesla; 1e-3 leaves room for another order of summation.
            assert!(error.amax() < 1e-3, "{year} {lat} {lon}: {field} nT");
        }
    }

    #[test]
    fn declination_and_dip_are_those_of_the_published_test_values() {
        // Year, height km, latitude, longitude, declination, dip deg: more rows of the same file, printed to 0.01 deg.
        for [year, height, lat, lon, declination, dip] in [
            [2025.0, 48.0, 80.0, -96.0, -29.91, 87.77],
            [2026.5, 12.0, -79.0, 115.0, -137.58, -77.37],
            [2028.0, 86.0, -85.0, -79.0, 41.09, -70.25],
            [2029.0, 50.0, 87.0, -154.0, -73.48, 89.07],
            [2029.5, 77.0, -18.0, 138.0, 4.45, -47.55],
        ] {
            let field = earth_field(&at(lat, lon, height * 1e3), year);
            assert!((field.y.atan2(field.x).to_degrees() - declination).abs() < 0.0051, "{lat} {lon}");
            assert!(((field.z / field.norm()).asin().to_degrees() - dip).abs() < 0.0051, "{lat} {lon}");
        }
    }

    #[test]
    fn each_model_serves_its_own_five_years() {
        // Daejeon with WMM2015v2 at 2016.2 and WMM2025 at 2026.9 (SPEC orientation 4, four decimals).
        let daejeon = at(36.3721, 127.3604, 60.0);
        for (year, field) in [(2016.2, [30.1124, -4.2270, 40.1258]), (2026.9, [30.0756, -4.6092, 40.5328])] {
            assert!((earth_field(&daejeon, year) - Vector3::from(field)).amax() < 1e-4, "{year}");
        }
        // A model's change over its five years leads to the next model within the accuracy of its forecast.
        for year in [2020.0, 2025.0] {
            let step = earth_field(&daejeon, year) - earth_field(&daejeon, year - 1e-9);
            assert!(step.amax() > 1e-3 && step.amax() < 0.25, "{year}: {step}");
        }
    }

    #[test]
    fn poles_and_bad_input_do_no_harm() {
        for lat in [90.0, -90.0] {
            let field = earth_field(&at(lat, 45.0, 0.0), 2027.0);
            let beside = earth_field(&at(lat * (1.0 - 1e-7), 45.0, 0.0), 2027.0);
            assert!((field - beside).amax() < 1e-3, "{lat}: {field} {beside}");
        }
        assert!(earth_field(&at(f64::NAN, 0.0, 0.0), 2025.0).x.is_nan());
        assert!(earth_field(&at(0.0, 0.0, 0.0), f64::NAN).x.is_nan());
        assert_eq!(earth_field(&at(10.0, 0.0, 0.0), 1990.0), earth_field(&at(10.0, 0.0, 0.0), FIRST_YEAR));
    }

    #[test]
    fn a_unix_time_has_its_decimal_year() {
        // 2016 and 2024 are leap years; seconds from `date -u +%s`.
        for (unix, year) in [
            (0.0, 1970.0),
            (1_451_606_400.0, 2016.0),
            (1_704_067_200.0, 2024.0),
            (1_719_878_400.0, 2024.0 + 183.0 / 366.0),
            (1_735_689_599.0, 2025.0 - 1.0 / (366.0 * 86_400.0)),
        ] {
            assert!((decimal_year(unix) - year).abs() < 1e-9, "{unix}: {}", decimal_year(unix));
        }
    }
}
