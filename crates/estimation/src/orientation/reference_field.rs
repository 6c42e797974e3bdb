//! The Earth's field that the measured one is compared with: from the World Magnetic Model, or typed in.

use drivescope_drive::drive::{Drive, LogStart};
use drivescope_drive::geodesy::Geodetic;
use drivescope_drive::magnetic_model::{FIRST_YEAR, LAST_YEAR, earth_field};
use nalgebra::{Vector3, vector};

use super::params::{FieldModel, OrientationParams};
use crate::estimator::Notices;

/// Decimal year taken where neither the log nor the user says when.
pub const DEFAULT_YEAR: f64 = 2026.0;

const NO_PLACE: &str = "the log has no place: the Earth's field is that of the three parameters field_north, field_east and field_down \
     (Daejeon by default)";
const NO_DATE: &str = "the log has no date: the Earth's field at its place is that of 2026.0 (parameter field_year)";
const OLD_DATE: &str =
    "the World Magnetic Model covers 2015 to 2030: the Earth's field is that of the nearest of these years";

/// The Earth's field (north, east, down; uT) that the estimator takes for a drive, and what had to be assumed for it.
pub fn reference_of(drive: &Drive, params: &OrientationParams) -> (Vector3<f64>, Notices) {
    let mut notices = Notices::default();
    let field = reference_field(params, &drive.start(), &mut notices);
    (field, notices)
}

/// North, east and down, uT. What had to be assumed becomes a notice.
pub(super) fn reference_field(params: &OrientationParams, start: &LogStart, notices: &mut Notices) -> Vector3<f64> {
    let given = vector![params.field_north, params.field_east, params.field_down];
    let defaults = OrientationParams::default();
    let is_typed = given != vector![defaults.field_north, defaults.field_east, defaults.field_down];
    if params.field_model == FieldModel::Given || is_typed {
        return given;
    }
    let typed = Geodetic { lat: params.field_latitude, lon: params.field_longitude, alt: 0.0 };
    let typed = (typed.lat.is_finite() && typed.lon.is_finite()).then_some(typed);
    let Some(place) = typed.or(start.origin) else {
        notices.add(NO_PLACE, 0.0);
        return given;
    };
    let year = if params.field_year.is_finite() { params.field_year } else { start.date.unwrap_or(f64::NAN) };
    if !year.is_finite() {
        notices.add(NO_DATE, 0.0);
    } else if !(FIRST_YEAR..=LAST_YEAR).contains(&year) {
        notices.add(OLD_DATE, 0.0);
    }
    let field = earth_field(&place, if year.is_finite() { year } else { DEFAULT_YEAR });
    if field.x.is_finite() { field } else { given }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOSTON: Geodetic = Geodetic { lat: 0.738_92, lon: -1.240_75, alt: 8.0 };

    fn start(origin: Option<Geodetic>, date: Option<f64>) -> LogStart {
        LogStart { imu_step: 0.01, origin, date, ..LogStart::UNKNOWN }
    }

    fn field(params: &OrientationParams, start: &LogStart) -> (Vector3<f64>, Vec<&'static str>) {
        let mut notices = Notices::default();
        let field = reference_field(params, start, &mut notices);
        (field, notices.list().iter().map(|n| n.text).collect())
    }

    #[test]
    fn the_field_follows_the_place_and_date_of_the_log_without_a_word() {
        let (field, notices) = field(&OrientationParams::default(), &start(Some(BOSTON), Some(2025.88)));
        // WMM2025 for 42.337 N 71.090 W, from the Python package pygeomag 1.1.0: declination -13.98 deg, dip 66.25 deg.
        assert!((field.y.atan2(field.x).to_degrees() + 13.98).abs() < 0.02, "{field}");
        assert!((field.z.atan2(field.xy().norm()).to_degrees() - 66.25).abs() < 0.02, "{field}");
        assert!(notices.is_empty(), "{notices:?}");
    }

    #[test]
    fn a_log_without_date_or_place_gets_a_stated_assumption() {
        let params = OrientationParams::default();
        let (undated, notices) = field(&params, &start(Some(BOSTON), None));
        assert_eq!((undated, notices), (earth_field(&BOSTON, DEFAULT_YEAR), vec![NO_DATE]));
        let (placeless, notices) = field(&params, &start(None, Some(2025.0)));
        assert_eq!((placeless.x, notices), (params.field_north, vec![NO_PLACE]));
        let (old, notices) = field(&params, &start(Some(BOSTON), Some(2009.0)));
        assert_eq!((old, notices), (earth_field(&BOSTON, FIRST_YEAR), vec![OLD_DATE]));
    }

    #[test]
    fn what_the_user_types_comes_before_what_the_log_says() {
        let dated = start(Some(BOSTON), Some(2025.88));
        let typed = OrientationParams { field_north: 20.0, ..OrientationParams::default() };
        assert_eq!(field(&typed, &dated).0.x, 20.0, "one number changed: all three are meant");
        let given = OrientationParams { field_model: FieldModel::Given, ..OrientationParams::default() };
        assert_eq!(field(&given, &dated).0.x, given.field_north);
        let elsewhere = OrientationParams {
            field_latitude: 0.0,
            field_longitude: 0.3665,
            field_year: 2025.0,
            ..OrientationParams::default()
        };
        // NOAA's test value there, 18 km up, has a dip of -26.06 deg.
        let (field, notices) = field(&elsewhere, &start(None, None));
        assert!((field.z.atan2(field.xy().norm()).to_degrees() + 26.06).abs() < 0.2 && notices.is_empty(), "{field}");
    }
}
