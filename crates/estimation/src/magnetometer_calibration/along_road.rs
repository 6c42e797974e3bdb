//! Strength and dip of the measured field along the road, beside those of the model.

use drivescope_drive::channel::{Channel, OutOfOrder, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::geodesy::{Geodetic, SEMI_MAJOR_AXIS};
use drivescope_drive::magnetic_model::earth_field;
use drivescope_drive::record;
use nalgebra::Vector3;

use super::Calibration;

record! {
    /// Strength and dip of the field at one instant, measured and by the model.
    pub struct FieldSample {
        /// Strength of the measured field, calibrated where a calibration is given.
        field_norm: "uT";
        /// Strength of the Earth's field by the model.
        field_norm_model: "uT";
        /// Angle of the measured field below the plane normal to the averaged specific force; NaN without accelerometers.
        dip: "rad";
        /// Dip of the Earth's field by the model.
        dip_model: "rad";
    }
}

/// The model is evaluated again after this distance, m: the field changes by about 5 nT on it.
const STEP: f64 = 1_000.0;
/// Specific force is averaged over this long to tell which way is down, s.
const AVERAGE: f64 = 2.0;

/// Strength and dip along the drive against the model: the model at the fixes if `year` is given (decimal), else `earth`.
///
/// # Errors
/// None for a drive that was read: its times are in order already.
pub fn field_along_road(
    drive: &Drive,
    calibration: Option<&Calibration>,
    earth: &Vector3<f64>,
    year: Option<f64>,
) -> Result<Series, OutOfOrder> {
    let mut out = Channel::<FieldSample>::default();
    out.reserve(drive.mag.len());
    let (mut model, mut evaluated) = (*earth, None::<Geodetic>);
    let (mut fixes, mut forces) = (drive.gnss.iter().peekable(), drive.imu.iter().peekable());
    let (mut down, mut before) = (Vector3::repeat(f64::NAN), f64::NAN);
    for (time, m) in drive.mag.iter() {
        while let Some((_, fix)) = fixes.next_if(|(t, _)| *t <= time) {
            let place = Geodetic { lat: fix.lat, lon: fix.lon, alt: if fix.alt.is_finite() { fix.alt } else { 0.0 } };
            let is_far = evaluated.is_none_or(|e| {
                SEMI_MAJOR_AXIS * (place.lat - e.lat).hypot((place.lon - e.lon) * place.lat.cos()) > STEP
            });
            if let Some(year) = year.filter(|_| fix.is_usable() && is_far && place.lat.is_finite()) {
                (model, evaluated) = (earth_field(&place, year), Some(place));
            }
        }
        while let Some((t, s)) = forces.next_if(|(t, _)| *t <= time) {
            let up = Vector3::new(s.accel_x, s.accel_y, s.accel_z);
            if up.iter().all(|v| v.is_finite()) {
                let share = if before.is_finite() { ((t - before) / AVERAGE).clamp(0.0, 1.0) } else { 1.0 };
                down = if before.is_finite() { down + (-up - down) * share } else { -up };
                before = t;
            }
        }
        let reading = Vector3::new(m.mag_x, m.mag_y, m.mag_z);
        let field = calibration.map_or(reading, |c| c.correct(&reading));
        let dip =
            |v: &Vector3<f64>, down: &Vector3<f64>| (v.dot(down) / (v.norm() * down.norm())).clamp(-1.0, 1.0).asin();
        let sample = FieldSample {
            field_norm: field.norm(),
            field_norm_model: model.norm(),
            dip: dip(&field, &down),
            dip_model: dip(&model, &Vector3::z()),
        };
        out.push(time, sample)?;
    }
    Ok(out.into_series())
}
