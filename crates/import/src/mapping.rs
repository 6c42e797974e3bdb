//! A mapping: which raw column is which physical signal. Data, saved and shared as JSON.

use drivescope_drive::disk::Disk;
use drivescope_drive::geodesy::Geodetic;
use serde::{Deserialize, Serialize};

use crate::by_name::ByName;
use crate::error::ImportError;

/// The version of mappings that this library writes and reads.
pub const MAPPING_VERSION: u32 = 1;

/// Which raw column is which physical signal, and how its values become SI values.
///
/// ```
/// let text = r#"{"version": 1, "time": {"column": "ms", "unit": "ms"},
///     "signals": {"accel_x": {"column": "ax", "unit": "g"}, "gyro_z": {"column": "r", "unit": "deg/s", "scale": -1}}}"#;
/// let mapping = drivescope_import::Mapping::from_json(text, "mapping.json")?;
/// assert_eq!(mapping.signals["gyro_z"].scale, -1.0);
/// # Ok::<(), drivescope_import::ImportError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mapping {
    /// [`MAPPING_VERSION`].
    pub version: u32,
    /// Where time comes from.
    pub time: TimeSource,
    /// Where each signal comes from, by canonical name.
    pub signals: ByName<SignalSource>,
    /// Channels (`gnss`, `baro`, ..) whose samples repeat in the file until a new one comes: repeats are left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drop_repeats: Vec<String>,
    /// How the housings of triads sit in the car, by channel (`imu`, `mag`); without an entry along the car's axes.
    #[serde(default, skip_serializing_if = "ByName::is_empty")]
    pub mounts: ByName<Mount>,
    /// By how many seconds the times of a channel's samples are late, by channel; subtracted from them.
    #[serde(default, skip_serializing_if = "ByName::is_empty")]
    pub delays: ByName<f64>,
    /// The six-accelerometer disk as calibrated; without it the disk is as drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disk: Option<Disk>,
    /// Origin of local coordinates; without it the first place of the truth or of the satellites.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
}

/// Origin of local coordinates as a person gives it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "OriginForm")]
pub struct Origin {
    /// Latitude, deg.
    pub lat_deg: f64,
    /// Longitude, deg.
    pub lon_deg: f64,
    /// Height above the ellipsoid, m.
    pub alt: f64,
}

/// The same before it has been checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OriginForm {
    lat_deg: f64,
    lon_deg: f64,
    #[serde(default)]
    alt: f64,
}

impl TryFrom<OriginForm> for Origin {
    type Error = String;
    fn try_from(form: OriginForm) -> Result<Self, String> {
        Self::new(form.lat_deg, form.lon_deg, form.alt)
    }
}

impl Origin {
    /// A checked origin: latitude and longitude in degrees, height in metres.
    ///
    /// # Errors
    /// A sentence where one of them is none.
    pub fn new(lat_deg: f64, lon_deg: f64, alt: f64) -> Result<Self, String> {
        // What is not a number is inside no limit.
        let ranges = [("latitude", lat_deg, 89.9), ("longitude", lon_deg, 360.0), ("height", alt, 1e5)];
        match ranges.iter().find(|(_, value, limit)| value.is_nan() || value.abs() > *limit) {
            Some((what, value, limit)) => Err(format!("{what} of the origin: expected at most {limit}, found {value}")),
            None => Ok(Self { lat_deg, lon_deg, alt }),
        }
    }

    /// The place.
    pub fn place(&self) -> Geodetic {
        Geodetic { lat: self.lat_deg.to_radians(), lon: self.lon_deg.to_radians(), alt: self.alt }
    }
}

/// Where time comes from: `offset + column in s + fraction in s`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeSource {
    /// Raw column.
    pub column: String,
    /// Its unit; date and time are in `s`.
    #[serde(default = "second")]
    pub unit: String,
    /// Added, s.
    #[serde(default)]
    pub offset: f64,
    /// A second column to add, as some loggers split seconds and nanoseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fraction: Option<TimeFraction>,
    /// Rows earlier than one before them are left out; without this such a file is refused.
    #[serde(default, skip_serializing_if = "is_false")]
    pub skip_steps_back: bool,
}

/// How a housing sits in the car: its attitude there, as of a body in the navigation frame.
///
/// Applied after columns, signs and units: `vector in the car = body_to_nav(roll, pitch, yaw) * vector read`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mount {
    /// Right side down, deg.
    #[serde(default)]
    pub roll_deg: f64,
    /// Front up, deg.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Clockwise from above, deg.
    #[serde(default)]
    pub yaw_deg: f64,
}

/// The part of a second, where a file keeps it in a column of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeFraction {
    /// Raw column.
    pub column: String,
    /// Its unit.
    pub unit: String,
}

/// Where a signal comes from: `scale * (raw value in SI) + offset`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalSource {
    /// Raw column.
    pub column: String,
    /// Unit of the raw values; absent for the canonical one (SI, degrees for latitude and longitude).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Pure factor: -1 turns an axis round.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub scale: f64,
    /// Added after the scale, SI.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub offset: f64,
    /// Raw values that stand for none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blank: Vec<f64>,
}

fn second() -> String {
    "s".into()
}
fn one() -> f64 {
    1.0
}
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_false(value: &bool) -> bool {
    !*value
}

impl TimeSource {
    /// A column in a unit, from its own zero.
    pub fn plain(column: &str, unit: &str) -> Self {
        Self { column: column.into(), unit: unit.into(), offset: 0.0, fraction: None, skip_steps_back: false }
    }
}

impl SignalSource {
    /// The column as it is, in the canonical unit.
    pub fn plain(column: &str) -> Self {
        Self { column: column.to_owned(), unit: None, scale: 1.0, offset: 0.0, blank: Vec::new() }
    }
}

impl Mapping {
    /// A mapping of no signal yet.
    pub fn of(time: TimeSource) -> Self {
        let (signals, mounts, delays) = (ByName::default(), ByName::default(), ByName::default());
        Self {
            version: MAPPING_VERSION,
            time,
            signals,
            drop_repeats: Vec::new(),
            mounts,
            delays,
            disk: None,
            origin: None,
        }
    }

    /// Read a mapping from JSON; `file` names it in errors.
    ///
    /// # Errors
    /// [`ImportError::MappingForm`], [`ImportError::MappingVersion`], and those of [`Mapping::validate`].
    pub fn from_json(text: &str, file: &str) -> Result<Self, ImportError> {
        let form = |e: serde_json::Error| ImportError::MappingForm { file: file.to_owned(), found: e.to_string() };
        let value: serde_json::Value = serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(form)?;
        let version = value.get("version").and_then(serde_json::Value::as_u64);
        if let Some(found) = version.map(|v| u32::try_from(v).unwrap_or(u32::MAX)).filter(|v| *v != MAPPING_VERSION) {
            return Err(ImportError::MappingVersion { file: file.to_owned(), expected: MAPPING_VERSION, found });
        }
        // From the text again: its errors name line and column.
        let mapping: Self = serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(form)?;
        mapping.validate(file)?;
        Ok(mapping)
    }

    /// The mapping as JSON, for saving.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        Mapping::from_json(text, "m.json").unwrap_err().to_string()
    }

    #[test]
    fn a_mapping_survives_json() {
        let mut mapping = Mapping {
            version: MAPPING_VERSION,
            time: TimeSource { offset: 0.5, skip_steps_back: true, ..TimeSource::plain("t", "ms") },
            signals: ByName::default(),
            drop_repeats: vec!["gnss".into()],
            origin: Origin::new(36.5, 127.25, 60.0).ok(),
            mounts: ByName::default(),
            delays: ByName::default(),
            disk: Some(Disk::drawn(0.08)),
        };
        let source = SignalSource {
            column: "ax".into(),
            unit: Some("g".into()),
            scale: -1.0,
            offset: 0.25,
            blank: vec![-5400.0],
        };
        mapping.signals.insert("accel_x".into(), source);
        mapping.signals.insert("gnss_lat".into(), SignalSource::plain("Lat"));
        mapping.mounts.insert("imu".into(), Mount { roll_deg: 1.5, pitch_deg: -3.75, yaw_deg: 90.0 });
        mapping.delays.insert("gnss".into(), 0.125);
        assert_eq!(Mapping::from_json(&mapping.to_json(), "m.json").unwrap(), mapping);
    }

    #[test]
    fn a_wrong_mapping_is_refused_with_the_place() {
        let message =
            error(r#"{"version": 1, "time": {"column": "t"}, "signals": {"accel_x": {"column": "a", "uint": "g"}}}"#);
        assert!(message.contains("unknown field `uint`") && message.contains("line 1"), "{message}");
        assert_eq!(
            error(r#"{"version": 2, "time": {}}"#),
            "m.json: expected a mapping of version 1, found version 2; save the mapping again with this version."
        );
        assert_eq!(
            error(r#"{"version": 1, "time": {"column": "t"}, "signals": {"acc_x": {"column": "a"}}}"#),
            "m.json: expected the canonical name of a signal in the mapping, found `acc_x`; use `accel_x`."
        );
        assert_eq!(
            error(r#"{"version": 1, "time": {"column": "t"}, "signals": {"gyro_x": {"column": "a", "unit": "m"}}}"#),
            "m.json: expected a unit of `gyro_x` that converts to rad/s, found `m`; use one of rad/s, deg/s, mrad/s, mdeg/s, deg/h."
        );
        assert!(
            error(r#"{"version": 1, "time": {"column": "t"}, "signals": {"speed": {"column": "a", "scale": 0}}}"#)
                .contains("scale")
        );
        assert!(error("").contains("EOF"));
        assert!(error(r#"{"version": 1, "signals": {}}"#).contains("missing field `time`"));
    }
}
