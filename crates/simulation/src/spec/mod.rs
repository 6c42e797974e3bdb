//! A drive as data: what a JSON file says, and its checks.

mod error;
mod event;
mod options;
mod read;
pub mod set;

use drivescope_drive::param::Params;
use drivescope_drive::vehicle::VehicleParams;
use serde::Serialize;

pub use error::SpecError;
use error::{expect, known, ranges, within};
pub use event::{Bump, Fault, FaultKind, Grip, LaneChange, Manoeuvre, ManoeuvreKind, Obstacle, Side};
pub use options::{Changes, Cluster, Iron, Limits, Parts};

use read::{Read, readable};

use crate::roughness::Class;

/// A drive to be simulated. Fields carry their units in their names; lengths are metres, durations seconds.
///
/// Read from JSON by [`DriveSpec::from_json`]; unknown fields are refused.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriveSpec {
    /// Name for files and menus.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Car: a name of `drive::vehicle::PRESETS`.
    pub car: String,
    /// Sensor grade: a name of [`GRADES`](crate::grades::GRADES).
    pub sensors: String,
    /// Seed of all noise where the caller gives none.
    pub seed: u64,
    /// Heading at the start, clockwise from true north.
    pub heading_deg: f64,
    /// How long the car stands before it sets off.
    pub stand_at_start: f64,
    /// Class of the road's roughness after ISO 8608; without it the road is smooth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roughness: Option<Class>,
    /// The road, piece by piece.
    pub segments: Vec<Segment>,
    /// When there is no satellite fix.
    pub gnss_outages: Vec<Outage>,
    /// Where the sensors sit: ahead, right and below of the centre of gravity, m.
    pub lever_arm: [f64; 3],
    /// How often the road's pieces follow one another.
    pub repeat: usize,
    /// When the drive ends at the latest, s; without it, at the end of its road.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
    /// Speed at the start; the car sets off from standstill without it.
    pub start_speed_kmh: f64,
    /// Parameters that differ from the car's, by symbol or name as in `VehicleParams`.
    pub car_changes: Changes,
    /// Air drag and rolling resistance as a share of the car's.
    pub resistance: f64,
    /// Relaxation lengths of the tyres as a share of the car's.
    pub relaxation: f64,
    /// How the driver drives.
    pub driver: Limits,
    /// Sensors of other grades than `sensors`.
    pub parts: Parts,
    /// Which inertial sensors there are.
    pub cluster: Cluster,
    /// The car's own magnetism, in place of the grade's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iron: Option<Iron>,
    /// Whether fixes come from single satellites, whose ranges are kept as raw rows; some faults need it and switch it on.
    pub satellites: bool,
    /// Whether the car carries the ultrasonic ring.
    pub ring: bool,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// Humps across the road.
    pub bumps: Vec<Bump>,
    /// Slippery patches.
    pub grip: Vec<Grip>,
    /// Posts on and beside the road.
    pub obstacles: Vec<Obstacle>,
    /// Where the driver leaves the centre line.
    pub lane_changes: Vec<LaneChange>,
    /// A manoeuvre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub manoeuvre: Option<Manoeuvre>,
}

/// A piece of road with constant curvature, grade and bank, and how it is driven.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Segment {
    /// Length along the road, m; `duration` can stand in its place.
    pub length: f64,
    /// How long the piece takes at its speed, s; [`DriveSpec::from_json`] turns it into the length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
    /// Speed that the driver aims at; curves may call for less.
    pub speed_kmh: f64,
    /// Change of heading over the whole piece, right positive.
    pub turn_deg: f64,
    /// Grade, uphill positive.
    pub grade_percent: f64,
    /// Bank, right side down positive.
    pub bank_deg: f64,
    /// Length over which curvature, grade and bank change from the piece before, m; never longer than either piece.
    pub blend: f64,
    /// How long the car stands at the end of the piece; without it the car drives on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<f64>,
    /// The driver's acceleration in this piece, m/s^2, where it is not the drive's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<f64>,
}

/// A time without satellite fixes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Outage {
    /// First instant without a fix, s.
    pub start: f64,
    /// How long it lasts, s.
    pub duration: f64,
}

impl Default for DriveSpec {
    /// The defaults of all fields that a drive's file may leave out.
    fn default() -> Self {
        Self {
            name: String::new(),
            description: String::new(),
            car: "saloon".into(),
            sensors: "automotive".into(),
            seed: 0,
            heading_deg: 0.0,
            stand_at_start: 0.0,
            roughness: None,
            segments: Vec::new(),
            gnss_outages: Vec::new(),
            lever_arm: [0.0; 3],
            repeat: 1,
            duration: None,
            start_speed_kmh: 0.0,
            car_changes: Changes::default(),
            resistance: 1.0,
            relaxation: 1.0,
            driver: Limits::default(),
            parts: Parts::default(),
            cluster: Cluster::Full,
            iron: None,
            satellites: false,
            ring: false,
            faults: Vec::new(),
            bumps: Vec::new(),
            grip: Vec::new(),
            obstacles: Vec::new(),
            lane_changes: Vec::new(),
            manoeuvre: None,
        }
    }
}

impl Default for Segment {
    /// A piece of no length: level, straight, blended over 40 m.
    fn default() -> Self {
        Self {
            length: 0.0,
            duration: None,
            speed_kmh: 0.0,
            turn_deg: 0.0,
            grade_percent: 0.0,
            bank_deg: 0.0,
            blend: 40.0,
            stop: None,
            acceleration: None,
        }
    }
}

readable!(
    DriveSpec,
    DriveSpec::default(),
    [
        name,
        description,
        car,
        sensors,
        seed,
        heading_deg,
        stand_at_start,
        roughness,
        segments,
        gnss_outages,
        lever_arm,
        repeat,
        duration,
        start_speed_kmh,
        car_changes,
        resistance,
        relaxation,
        driver,
        parts,
        cluster,
        iron,
        satellites,
        ring,
        faults,
        bumps,
        grip,
        obstacles,
        lane_changes,
        manoeuvre
    ],
    ["name", "description", "segments"]
);
readable!(
    Segment,
    Segment::default(),
    [length, duration, speed_kmh, turn_deg, grade_percent, bank_deg, blend, stop, acceleration],
    ["speed_kmh"]
);
readable!(Outage, Outage { start: 0.0, duration: 0.0 }, [start, duration], ["start", "duration"]);

/// Smallest radius of a turn, m: a saloon's turning circle has about 11 m diameter.
pub const SMALLEST_RADIUS: f64 = 7.0;

/// Longest drive, s: four hours at 100 Hz fill about 1 GB.
pub const LONGEST_DRIVE: f64 = 14_400.0;

impl DriveSpec {
    /// Read and check a drive: durations become lengths and repeated pieces are written out.
    ///
    /// # Errors
    /// [`SpecError`] with the path and the value of what is wrong first.
    pub fn from_json(text: &str) -> Result<Self, SpecError> {
        Self::of_value(&serde_json::from_str(text).map_err(|e| SpecError::Json(e.to_string()))?)
    }

    /// Read and check a drive with some of its values replaced: `path=value`, see [`replace`](set::replace).
    ///
    /// # Errors
    /// [`SpecError`] with the path and the value of what is wrong first.
    pub fn from_json_with(text: &str, changes: &[impl AsRef<str>]) -> Result<Self, SpecError> {
        let mut value = serde_json::from_str(text).map_err(|e| SpecError::Json(e.to_string()))?;
        changes.iter().try_for_each(|change| set::replace(&mut value, change.as_ref()))?;
        Self::of_value(&value)
    }

    fn of_value(value: &serde_json::Value) -> Result<Self, SpecError> {
        let mut spec = Self::read(value)?;
        for (index, segment) in spec.segments.iter_mut().enumerate() {
            let Some(duration) = segment.duration.take() else { continue };
            let path = format!("segments[{index}]");
            expect(segment.length == 0.0, &path, "`length` or `duration`, not both")?;
            segment.length = duration * segment.speed_kmh / 3.6;
        }
        within("repeat", spec.repeat as f64, 1.0, 1000.0)?;
        spec.segments = spec.segments.repeat(spec.repeat);
        spec.repeat = 1;
        spec.check()?;
        Ok(spec)
    }

    /// Check every value against its range and every name against the known ones.
    ///
    /// # Errors
    /// The first [`SpecError`] found.
    pub fn check(&self) -> Result<(), SpecError> {
        self.check_car_and_sensors()?;
        within("heading_deg", self.heading_deg, -360.0, 360.0)?;
        within("stand_at_start", self.stand_at_start, 0.0, 3600.0)?;
        within("duration", self.duration.unwrap_or(1.0), 1.0, LONGEST_DRIVE)?;
        within("start_speed_kmh", self.start_speed_kmh, 0.0, 200.0)?;
        let rolls = self.start_speed_kmh > 0.0;
        expect(!(rolls && self.stand_at_start > 0.0), "start_speed_kmh", "`stand_at_start` or a speed, not both")?;
        self.driver.check()?;
        if self.segments.is_empty() {
            return Err(SpecError::Empty { path: "segments".into() });
        }
        all("segments", &self.segments, Segment::check)?;
        let shortest = self.shortest_duration().min(self.duration.unwrap_or(f64::INFINITY));
        within("duration without delays, s", shortest, 0.0, LONGEST_DRIVE)?;
        all("gnss_outages", &self.gnss_outages, |outage, path| {
            ranges(path, &[("start", outage.start, 0.0, 1e6), ("duration", outage.duration, 0.0, 1e6)])
        })?;
        all("faults", &self.faults, Fault::check)?;
        all("bumps", &self.bumps, Bump::check)?;
        all("grip", &self.grip, Grip::check)?;
        all("obstacles", &self.obstacles, Obstacle::check)?;
        all("lane_changes", &self.lane_changes, LaneChange::check)?;
        self.check_manoeuvre()
    }

    fn check_car_and_sensors(&self) -> Result<(), SpecError> {
        known("car", &self.car, drivescope_drive::vehicle::PRESETS.iter().map(|p| p.name))?;
        let grades = || crate::grades::GRADES.iter().map(|g| g.name);
        known("sensors", &self.sensors, grades())?;
        let Parts { imu, mag, wheels, gnss } = &self.parts;
        for (name, part) in [("imu", imu), ("mag", mag), ("wheels", wheels), ("gnss", gnss)] {
            part.as_ref().map_or(Ok(()), |part| known(&format!("parts.{name}"), part, grades()))?;
        }
        for (axis, value) in self.lever_arm.iter().enumerate() {
            within(&format!("lever_arm[{axis}]"), *value, -3.0, 3.0)?;
        }
        if let Some(iron) = &self.iron {
            let values = iron.hard.iter().chain(iron.soft.iter().flatten());
            values.into_iter().try_for_each(|value| within("iron", *value, -200.0, 200.0))?;
        }
        within("resistance", self.resistance, 0.0, 2.0)?;
        within("relaxation", self.relaxation, 0.2, 2.0)?;
        self.vehicle().map(|_| ())
    }

    /// The car with the drive's changes.
    ///
    /// # Errors
    /// [`SpecError`] when there is no car of that name, or with the path of a change that is not known or out of range.
    pub fn vehicle(&self) -> Result<VehicleParams, SpecError> {
        let mut car = VehicleParams::preset(&self.car).ok_or_else(|| SpecError::Conflict {
            path: "car".into(),
            expected: format!("a known car instead of \"{}\"", self.car),
        })?;
        for (symbol, value) in &self.car_changes.0 {
            car.set(symbol, &serde_json::json!(value))
                .map_err(|e| SpecError::Conflict { path: format!("car_changes.{symbol}"), expected: e.to_string() })?;
        }
        Ok(car)
    }

    fn check_manoeuvre(&self) -> Result<(), SpecError> {
        let Some(manoeuvre) = &self.manoeuvre else { return Ok(()) };
        manoeuvre.check("manoeuvre")?;
        let mut start = 0.0;
        for segment in &self.segments {
            let met = start + segment.length > manoeuvre.at - segment.blend;
            let plane = segment.turn_deg == 0.0 && segment.grade_percent == 0.0 && segment.bank_deg == 0.0;
            let expected = "the road must be straight and level from where an open-loop manoeuvre begins";
            expect(!manoeuvre.is_open_loop() || !met || plane, "manoeuvre.at", expected)?;
            start += segment.length;
        }
        within("manoeuvre.at", manoeuvre.at, 0.0, start)
    }

    /// How long the drive takes at the declared speeds with its stops, s; the car needs a little longer.
    pub fn shortest_duration(&self) -> f64 {
        let of = |s: &Segment| s.length / (s.speed_kmh / 3.6) + s.stop.unwrap_or(0.0);
        self.stand_at_start + self.segments.iter().map(of).sum::<f64>()
    }

    /// Whether fixes come from single satellites.
    pub fn has_satellites(&self) -> bool {
        let needs = |kind| matches!(kind, FaultKind::Canyon | FaultKind::Multipath | FaultKind::ClockJump);
        self.satellites || self.faults.iter().any(|f| needs(f.kind))
    }
}

/// Check every entry of a list under its path.
fn all<T>(path: &str, list: &[T], check: impl Fn(&T, &str) -> Result<(), SpecError>) -> Result<(), SpecError> {
    list.iter().enumerate().try_for_each(|(index, entry)| check(entry, &format!("{path}[{index}]")))
}

impl Segment {
    fn check(&self, path: &str) -> Result<(), SpecError> {
        ranges(
            path,
            &[
                ("length", self.length, 1.0, 100_000.0),
                ("speed_kmh", self.speed_kmh, 2.0, 200.0),
                ("turn_deg", self.turn_deg, -3600.0, 3600.0),
                ("grade_percent", self.grade_percent, -30.0, 30.0),
                ("bank_deg", self.bank_deg, -25.0, 25.0),
                ("blend", self.blend, 1.0, 1000.0),
                ("stop", self.stop.unwrap_or(0.0), 0.0, 3600.0),
                ("acceleration", self.acceleration.unwrap_or(1.0), 0.05, 4.0),
            ],
        )?;
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
