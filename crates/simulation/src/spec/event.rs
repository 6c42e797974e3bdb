//! What happens on a drive beyond its road: faults of sensors, things on the road, manoeuvres.

use drivescope_drive::channel::Record;
use drivescope_drive::signals::{Baro, Gnss, Imu, Mag, Steering, Wheels};
use serde::Serialize;

use super::error::{SpecError, expect, known, ranges};
use super::read::{nameable, readable};

/// What kind of [`Fault`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// No satellites.
    Outage,
    /// Only satellites above 50 deg.
    Canyon,
    /// Reflections: the two lowest satellites are `size` m and 1.44 times as much too far; 18 without a size.
    Multipath,
    /// The receiver's clock jumps by `size` m at the start, for good; 299,792 (1 ms) without a size.
    ClockJump,
    /// Steel of a bridge: an extra magnetic field that grows and vanishes smoothly, peak `size` uT; 12 without a size.
    Bridge,
    /// A truck passes on the left, a dipole of `size` A m^2; 1500 without a size.
    Truck,
    /// A tunnel: no satellites, and reinforced concrete that distorts the field by the share `size`; 0.3 without one.
    Tunnel,
    /// The signal named reads `size` more.
    Bias,
    /// The signal named keeps its value.
    Freeze,
}

/// Something wrong for a while, or on a stretch of the road.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// What is wrong.
    pub kind: FaultKind,
    /// When it begins, s.
    #[serde(skip_serializing_if = "f64_is_nan")]
    pub start: f64,
    /// How long it lasts, s.
    pub duration: f64,
    /// Where along the road it begins, m, in place of `start`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// How much of the road it covers, m, in place of `duration`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// How strong it is; unit and default as the kind says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
    /// The column that `bias` and `freeze` act on, as in `gyro_z`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signal: Option<String>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn f64_is_nan(value: &f64) -> bool {
    value.is_nan()
}

/// A hump across the road.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bump {
    /// Where it begins along the road, m.
    pub at: f64,
    /// Its length, m.
    pub length: f64,
    /// Its height, m.
    pub height: f64,
}

/// Which wheels a [`Grip`] is under.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Both tracks.
    #[default]
    Both,
    /// The left track.
    Left,
    /// The right track.
    Right,
}

/// A slippery or a rough patch of road.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Grip {
    /// Where it begins along the road, m.
    pub at: f64,
    /// Its length, m.
    pub length: f64,
    /// Its friction as a share of the dry road's.
    pub share: f64,
    /// The wheels it is under.
    pub side: Side,
}

/// A post on or beside the road; the car does not feel it, the ultrasonic ring sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Obstacle {
    /// Where along the road, m.
    pub at: f64,
    /// How far right of the centre line, m.
    pub right: f64,
    /// Radius, m.
    pub radius: f64,
}

/// A smooth change of the line that the driver follows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LaneChange {
    /// Where it begins along the road, m.
    pub at: f64,
    /// Its length, m.
    pub length: f64,
    /// Offset from the centre line that it ends at, right positive, m.
    pub to: f64,
}

/// What kind of [`Manoeuvre`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ManoeuvreKind {
    /// Steer to `steer_deg` within `rise` s and hold it, at held speed (ISO 7401).
    StepSteer,
    /// One period of a sine of amplitude `steer_deg` with a hold of `dwell` s at its second peak (ISO 19365), rolling.
    SineWithDwell,
    /// Steer to `steer_deg` within `rise` s and hold it, rolling freely.
    JTurn,
    /// Brake straight on with `deceleration` to a stop.
    Braking,
    /// Closed loop: two lane changes after ISO 3888-1, sections stretched by `stretch`.
    DoubleLaneChange,
}

/// A manoeuvre that begins at a place; but for the double lane change, the drive ends with it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Manoeuvre {
    /// Which one.
    pub kind: ManoeuvreKind,
    /// Where along the road it begins, m.
    pub at: f64,
    /// Angle of the road wheels, right positive, deg.
    pub steer_deg: f64,
    /// How long the steering takes to its angle, s.
    pub rise: f64,
    /// How long it lasts in all, s; the car is then brought to a stop.
    pub duration: f64,
    /// Frequency of the sine, Hz.
    pub frequency: f64,
    /// Hold at the sine's second peak, s.
    pub dwell: f64,
    /// Braking, m/s^2.
    pub deceleration: f64,
    /// Factor on the lengths of the double lane change.
    pub stretch: f64,
}

nameable!(FaultKind, [
    "outage" => FaultKind::Outage,
    "canyon" => FaultKind::Canyon,
    "multipath" => FaultKind::Multipath,
    "clock_jump" => FaultKind::ClockJump,
    "bridge" => FaultKind::Bridge,
    "truck" => FaultKind::Truck,
    "tunnel" => FaultKind::Tunnel,
    "bias" => FaultKind::Bias,
    "freeze" => FaultKind::Freeze,
]);
nameable!(Side, ["both" => Side::Both, "left" => Side::Left, "right" => Side::Right]);
nameable!(ManoeuvreKind, [
    "step_steer" => ManoeuvreKind::StepSteer,
    "sine_with_dwell" => ManoeuvreKind::SineWithDwell,
    "j_turn" => ManoeuvreKind::JTurn,
    "braking" => ManoeuvreKind::Braking,
    "double_lane_change" => ManoeuvreKind::DoubleLaneChange,
]);
readable!(Fault, Fault::outage(f64::NAN, 0.0), [kind, start, duration, at, length, size, signal], ["kind"]);
readable!(Bump, Bump { at: 0.0, length: 0.0, height: 0.0 }, [at, length, height], ["at", "length", "height"]);
readable!(
    Grip,
    Grip { at: 0.0, length: 0.0, share: 0.0, side: Side::Both },
    [at, length, share, side],
    ["at", "length", "share"]
);
readable!(Obstacle, Obstacle { at: 0.0, right: 0.0, radius: 0.0 }, [at, right, radius], ["at", "radius"]);
readable!(LaneChange, LaneChange { at: 0.0, length: 0.0, to: 0.0 }, [at, length, to], ["at", "length", "to"]);
readable!(
    Manoeuvre,
    Manoeuvre {
        kind: ManoeuvreKind::StepSteer,
        at: 0.0,
        steer_deg: 0.0,
        rise: 0.2,
        duration: 5.0,
        frequency: 0.7,
        dwell: 0.5,
        deceleration: 5.0,
        stretch: 1.0,
    },
    [kind, at, steer_deg, rise, duration, frequency, dwell, deceleration, stretch],
    ["kind", "at"]
);

impl Fault {
    /// A time without satellites, s.
    pub(crate) fn outage(start: f64, duration: f64) -> Self {
        Self { start, duration, kind: FaultKind::Outage, at: None, length: None, size: None, signal: None }
    }
    /// Where it stands: the instant or the place, where it begins, and how far it goes, s or m.
    fn extent(&self, time: f64, s: f64) -> (f64, f64, f64) {
        match self.at {
            Some(at) => (s, at, self.length.unwrap_or(0.0)),
            None => (time, self.start, self.duration),
        }
    }
    /// The share of it that is over, 0 to 1, at a time (s) and a place along the road (m); `None` where it does not act.
    pub fn share(&self, time: f64, s: f64) -> Option<f64> {
        let (now, begin, length) = self.extent(time, s);
        (now >= begin && now < begin + length).then(|| (now - begin) / length)
    }
    /// Whether it acts at a time (s) and a place along the road (m).
    pub fn acts(&self, time: f64, s: f64) -> bool {
        self.share(time, s).is_some()
    }
    /// Whether it has begun.
    pub fn has_begun(&self, time: f64, s: f64) -> bool {
        let (now, begin, _) = self.extent(time, s);
        now >= begin
    }

    pub(super) fn check(&self, path: &str) -> Result<(), SpecError> {
        let in_time = !self.start.is_nan() || self.duration > 0.0;
        let expected = "`start` and `duration`, or `at` and `length` along the road";
        expect(in_time != (self.at.is_some() || self.length.is_some()), path, expected)?;
        expect(in_time || self.at.is_some(), path, expected)?;
        ranges(
            path,
            &[
                ("start", if in_time { self.start } else { 0.0 }, 0.0, 1e6),
                ("duration", self.duration, 0.0, 1e6),
                ("at", self.at.unwrap_or(0.0), 0.0, 1e6),
                ("length", self.length.unwrap_or(0.0), 0.0, 1e6),
                ("size", self.size.unwrap_or(0.0), -1e7, 1e7),
            ],
        )?;
        let on_signal = matches!(self.kind, FaultKind::Bias | FaultKind::Freeze);
        match &self.signal {
            Some(signal) if on_signal => {
                let columns =
                    [Imu::COLUMNS, Mag::COLUMNS, Wheels::COLUMNS, Steering::COLUMNS, Gnss::COLUMNS, Baro::COLUMNS];
                known(&format!("{path}.signal"), signal, columns.into_iter().flatten().map(|c| c.name))?;
            }
            signal => {
                expect(signal.is_some() == on_signal, path, "`signal` goes with `bias` and `freeze`, and only there")?
            }
        }
        expect(self.kind != FaultKind::Bias || self.size.is_some(), path, "a `bias` needs a `size`")
    }
}

impl Bump {
    pub(super) fn check(&self, path: &str) -> Result<(), SpecError> {
        ranges(
            path,
            &[("at", self.at, 0.0, 1e6), ("length", self.length, 0.3, 20.0), ("height", self.height, -0.2, 0.2)],
        )
    }
}

impl Grip {
    pub(super) fn check(&self, path: &str) -> Result<(), SpecError> {
        ranges(path, &[("at", self.at, 0.0, 1e6), ("length", self.length, 0.1, 1e6), ("share", self.share, 0.05, 1.5)])
    }
}

impl Obstacle {
    pub(super) fn check(&self, path: &str) -> Result<(), SpecError> {
        ranges(
            path,
            &[("at", self.at, 0.0, 1e6), ("right", self.right, -50.0, 50.0), ("radius", self.radius, 0.01, 10.0)],
        )
    }
}

impl LaneChange {
    pub(super) fn check(&self, path: &str) -> Result<(), SpecError> {
        ranges(path, &[("at", self.at, 0.0, 1e6), ("length", self.length, 1.0, 1000.0), ("to", self.to, -5.0, 5.0)])
    }
}

impl Manoeuvre {
    /// Whether driver and road leave each other.
    pub fn is_open_loop(&self) -> bool {
        self.kind != ManoeuvreKind::DoubleLaneChange
    }

    pub(super) fn check(&self, path: &str) -> Result<(), SpecError> {
        ranges(
            path,
            &[
                ("at", self.at, 0.0, 1e6),
                ("steer_deg", self.steer_deg, -30.0, 30.0),
                ("rise", self.rise, 0.02, 10.0),
                ("duration", self.duration, 0.1, 600.0),
                ("frequency", self.frequency, 0.1, 4.0),
                ("dwell", self.dwell, 0.0, 5.0),
                ("deceleration", self.deceleration, 0.5, 9.0),
                ("stretch", self.stretch, 0.5, 4.0),
            ],
        )
    }
}
