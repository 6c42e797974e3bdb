//! A drive as data: what a JSON file says, and its checks.

use serde::{Deserialize, Serialize};

use crate::roughness::Class;

/// A drive to be simulated. Fields carry their units in their names; lengths are metres, durations seconds.
///
/// Read from JSON by [`DriveSpec::from_json`]; unknown fields are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveSpec {
    /// Name for files and menus.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Car: a name of `drive::vehicle::PRESETS`.
    #[serde(default = "default_car")]
    pub car: String,
    /// Sensor grade: a name of [`GRADES`](crate::grades::GRADES).
    #[serde(default = "default_sensors")]
    pub sensors: String,
    /// Seed of all noise where the caller gives none.
    #[serde(default)]
    pub seed: u64,
    /// Heading at the start, clockwise from true north.
    #[serde(default)]
    pub heading_deg: f64,
    /// How long the car stands before it sets off.
    #[serde(default)]
    pub stand_at_start: f64,
    /// Class of the road's roughness after ISO 8608; without it the road is smooth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<Class>,
    /// The road, piece by piece.
    pub segments: Vec<Segment>,
    /// When there is no satellite fix.
    #[serde(default)]
    pub gnss_outages: Vec<Outage>,
    /// Where the sensors sit: ahead, right and below of the centre of gravity, m.
    #[serde(default)]
    pub lever_arm: [f64; 3],
}

/// A piece of road with constant curvature, grade and bank, and how it is driven.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Length along the road, m.
    pub length: f64,
    /// Speed that the driver aims at; curves may call for less.
    pub speed_kmh: f64,
    /// Change of heading over the whole piece, right positive.
    #[serde(default)]
    pub turn_deg: f64,
    /// Grade, uphill positive.
    #[serde(default)]
    pub grade_percent: f64,
    /// Bank, right side down positive.
    #[serde(default)]
    pub bank_deg: f64,
    /// Length over which curvature, grade and bank change from the piece before, m; never longer than either piece.
    #[serde(default = "default_blend")]
    pub blend: f64,
    /// How long the car stands at the end of the piece; without it the car drives on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<f64>,
}

/// A time without satellite fixes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outage {
    /// First instant without a fix, s.
    pub start: f64,
    /// How long it lasts, s.
    pub duration: f64,
}

fn default_car() -> String {
    "saloon".into()
}
fn default_sensors() -> String {
    "automotive".into()
}
fn default_blend() -> f64 {
    40.0
}

/// Why a drive cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// Not JSON, or not the fields of a drive.
    #[error("the drive is not readable: {0}")]
    Json(String),
    /// A value outside its range.
    #[error("`{path}` = {value} is outside {min}..={max}")]
    OutOfRange {
        /// Where it stands, as in `segments[3].bank_deg`.
        path: String,
        /// What was found.
        value: f64,
        /// Smallest accepted value.
        min: f64,
        /// Largest accepted value.
        max: f64,
    },
    /// A name that is not known.
    #[error("`{path}` = \"{value}\" is not known; there are {known}")]
    Unknown {
        /// Where it stands.
        path: String,
        /// What was found.
        value: String,
        /// The names that there are.
        known: String,
    },
    /// A list without entries.
    #[error("`{path}` is empty; expected at least one entry")]
    Empty {
        /// Where it stands.
        path: String,
    },
    /// A turn too tight to be driven.
    #[error("`{path}` turns {turn_deg} deg in {length} m: radius {radius:.1} m, expected at least {min} m")]
    TooTight {
        /// Where it stands.
        path: String,
        /// Change of heading, deg.
        turn_deg: f64,
        /// Length, m.
        length: f64,
        /// Radius, m.
        radius: f64,
        /// Smallest accepted radius, m.
        min: f64,
    },
    /// The car left the road: too fast for it, or a car that cannot be steered like one.
    #[error("the car left the road at {position:.0} m after {time:.0} s: {offset:.1} m beside the centre line")]
    LeftRoad {
        /// Place along the road, m.
        position: f64,
        /// Time, s.
        time: f64,
        /// Offset to the right, m.
        offset: f64,
    },
    /// The car did not get on for a minute.
    #[error("the car got stuck at {position:.0} m after {time:.0} s")]
    Stuck {
        /// Place along the road, m.
        position: f64,
        /// Time, s.
        time: f64,
    },
}

/// Smallest radius of a turn, m: a saloon's turning circle has about 11 m diameter.
pub const SMALLEST_RADIUS: f64 = 7.0;

/// Longest drive, s: four hours at 100 Hz fill about 1 GB.
pub const LONGEST_DRIVE: f64 = 14_400.0;

impl DriveSpec {
    /// Read and check a drive.
    ///
    /// # Errors
    /// [`SpecError`] with the path and the value of what is wrong first.
    pub fn from_json(text: &str) -> Result<Self, SpecError> {
        let spec: Self = serde_json::from_str(text).map_err(|e| SpecError::Json(e.to_string()))?;
        spec.check()?;
        Ok(spec)
    }

    /// Check every value against its range and every name against the known ones.
    ///
    /// # Errors
    /// The first [`SpecError`] found.
    pub fn check(&self) -> Result<(), SpecError> {
        let cars: Vec<&str> = drivescope_drive::vehicle::PRESETS.iter().map(|p| p.name).collect();
        known("car", &self.car, &cars)?;
        let grades: Vec<&str> = crate::grades::GRADES.iter().map(|g| g.name).collect();
        known("sensors", &self.sensors, &grades)?;
        within("heading_deg", self.heading_deg, -360.0, 360.0)?;
        within("stand_at_start", self.stand_at_start, 0.0, 3600.0)?;
        for (axis, value) in self.lever_arm.iter().enumerate() {
            within(&format!("lever_arm[{axis}]"), *value, -3.0, 3.0)?;
        }
        if self.segments.is_empty() {
            return Err(SpecError::Empty { path: "segments".into() });
        }
        for (index, segment) in self.segments.iter().enumerate() {
            segment.check(&format!("segments[{index}]"))?;
        }
        within("duration without delays, s", self.shortest_duration(), 0.0, LONGEST_DRIVE)?;
        for (index, outage) in self.gnss_outages.iter().enumerate() {
            within(&format!("gnss_outages[{index}].start"), outage.start, 0.0, 1e6)?;
            within(&format!("gnss_outages[{index}].duration"), outage.duration, 0.0, 1e6)?;
        }
        Ok(())
    }
}

impl DriveSpec {
    /// How long the drive takes at the declared speeds with its stops, s; the car needs a little longer.
    pub fn shortest_duration(&self) -> f64 {
        let of = |s: &Segment| s.length / (s.speed_kmh / 3.6) + s.stop.unwrap_or(0.0);
        self.stand_at_start + self.segments.iter().map(of).sum::<f64>()
    }
}

impl Segment {
    fn check(&self, path: &str) -> Result<(), SpecError> {
        within(&format!("{path}.length"), self.length, 1.0, 100_000.0)?;
        within(&format!("{path}.speed_kmh"), self.speed_kmh, 5.0, 200.0)?;
        within(&format!("{path}.turn_deg"), self.turn_deg, -3600.0, 3600.0)?;
        within(&format!("{path}.grade_percent"), self.grade_percent, -30.0, 30.0)?;
        within(&format!("{path}.bank_deg"), self.bank_deg, -25.0, 25.0)?;
        within(&format!("{path}.blend"), self.blend, 1.0, 1000.0)?;
        if let Some(stop) = self.stop {
            within(&format!("{path}.stop"), stop, 0.0, 3600.0)?;
        }
        let radius = 1.0 / self.curvature().abs();
        if radius < SMALLEST_RADIUS {
            let (turn_deg, length) = (self.turn_deg, self.length);
            return Err(SpecError::TooTight { path: path.into(), turn_deg, length, radius, min: SMALLEST_RADIUS });
        }
        Ok(())
    }

    /// Change of heading per metre, rad/m.
    pub fn curvature(&self) -> f64 {
        self.turn_deg.to_radians() / self.length
    }
}

fn within(path: &str, value: f64, min: f64, max: f64) -> Result<(), SpecError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(SpecError::OutOfRange { path: path.into(), value, min, max })
}

fn known(path: &str, value: &str, names: &[&str]) -> Result<(), SpecError> {
    if names.contains(&value) {
        return Ok(());
    }
    Err(SpecError::Unknown { path: path.into(), value: value.into(), known: names.join(", ") })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        DriveSpec::from_json(text).unwrap_err().to_string()
    }

    fn with(segment: &str) -> String {
        format!(r#"{{"name": "x", "description": "y", "segments": [{segment}]}}"#)
    }

    #[test]
    fn what_is_wrong_is_said_with_its_path_and_value() {
        assert_eq!(
            error(&with(r#"{"length": 10, "speed_kmh": 30, "bank_deg": 70}"#)),
            "`segments[0].bank_deg` = 70 is outside -25..=25"
        );
        assert_eq!(
            error(&with(r#"{"length": 5, "speed_kmh": 30, "turn_deg": 90}"#)),
            "`segments[0]` turns 90 deg in 5 m: radius 3.2 m, expected at least 7 m"
        );
        assert_eq!(error(&with("")), "`segments` is empty; expected at least one entry");
        assert!(error(&with(r#"{"length": 10, "speed_kmh": 30, "slope": 3}"#)).contains("unknown field `slope`"));
        assert!(error("{").starts_with("the drive is not readable: EOF"));
        let car = r#"{"name": "x", "description": "y", "car": "tank", "segments": [{"length": 9, "speed_kmh": 9}]}"#;
        assert!(error(car).starts_with("`car` = \"tank\" is not known; there are bmw_320i, "));
    }

    #[test]
    fn a_number_that_is_no_number_is_refused() {
        let mut spec = DriveSpec::from_json(&with(r#"{"length": 10, "speed_kmh": 30}"#)).unwrap();
        spec.segments[0].length = f64::NAN;
        assert!(matches!(spec.check(), Err(SpecError::OutOfRange { .. })), "NaN is inside no range");
    }
}
