//! Single columns held against the motion over ground, and what is told of named axes that have no triad.

use super::gnss::{Interval, Motion};
use super::hold::Held;
use super::scene::Field;
use super::survey::{Kind, Role, Survey, kind};
use crate::candidate::Confidence;
use crate::fit::nearest;

/// Weaker, a column is not said to go with anything.
const CLEAR: f64 = 0.8;
/// Fewer intervals are too few.
const ENOUGH: usize = 15;
/// Least spread of turn rate, rad/s, and of accelerations, m/s^2, that shows something.
const SHOWN: [f64; 3] = [0.02, 0.25, 0.4];

/// The motion's part that a signal shows: a name, and which of turn rate, change of speed and their product it is.
fn part(signal: &str) -> Option<(&'static str, usize)> {
    match signal {
        "gyro_z" => Some(("d(course)/dt", 0)),
        "accel_x" => Some(("d(speed)/dt", 1)),
        "accel_y" => Some(("speed times d(course)/dt", 2)),
        _ => None,
    }
}

/// Hold a column against the part of the motion that a signal shows; `speed` is the car's own, m/s, where it is known.
pub(crate) fn against(
    s: &Survey,
    column: usize,
    signal: &str,
    (motion, late): (&Motion, f64),
    speed: Option<&(usize, Field)>,
) -> Option<Held> {
    let (name, what) = part(signal)?;
    // A speed that is measured tells its change better than places do.
    let speed = speed.filter(|_| what == 1);
    let field = &s.scene.fields[column];
    let against = match speed {
        Some((column, _)) => format!("{name} of {}", s.label(*column)),
        None => format!("{name} of {}", motion.label),
    };
    let pair = |i: Interval| {
        let rate = i.turn / (i.to - i.from);
        let change = speed.map_or(i.accel, |(_, v)| (v.at(i.to) - v.at(i.from)) / (i.to - i.from));
        ([rate, change, i.speed * rate][what], field.mean(i.from, i.to))
    };
    let pairs: Vec<(f64, f64)> = motion.intervals(late).into_iter().map(pair).collect();
    Some(Held::new(against, &pairs)).filter(|h| h.shows(ENOUGH, SHOWN[what]))
}

/// Units of acceleration and of turn rates: what 1 SI unit reads.
const UNITS: [(Kind, &str, f64); 5] = [
    (Kind::Accel, "m/s^2", 1.0),
    (Kind::Accel, "g", 1.0 / drivescope_drive::geodesy::STANDARD_GRAVITY),
    (Kind::Gyro, "rad/s", 1.0),
    (Kind::Gyro, "deg/s", 180.0 / std::f64::consts::PI),
    (Kind::Gyro, "mrad/s", 1000.0),
];

/// Named single axes, of cars that have no third one: unit, sign and scale by what they show of the motion.
pub(crate) fn lone_axes(s: &mut Survey, motion: (&Motion, f64), speed: Option<&(usize, Field)>) {
    for column in 0..s.roles.len() {
        let Some(name) = s.names[column].as_ref().map(|c| c.signal.clone()).filter(|_| s.roles[column].is_none())
        else {
            continue;
        };
        let field = &s.scene.fields[column];
        if field.count < 10 || field.is_constant() || field.period > 0.6 || s.of(&name).is_some() {
            continue;
        }
        let Some(e) = against(s, column, &name, motion, speed).filter(|e| e.correlation.abs() > CLEAR) else {
            continue;
        };
        let units: Vec<(&str, f64)> = UNITS.iter().filter(|u| u.0 == kind(&name)).map(|u| (u.1, u.2)).collect();
        let (unit, _) = nearest(e.slope.abs(), &units);
        let one = units.iter().find(|u| u.0 == unit).map_or(1.0, |u| u.1);
        let why = format!(
            "is {:.2} times {} in {unit}, correlation {:.2} over {} intervals",
            e.slope / one,
            e.against,
            e.correlation,
            e.count
        );
        let scale = e.slope.signum();
        let role = Role { signal: name, unit: unit.into(), scale, offset: 0.0, confidence: Confidence::Likely, why };
        s.assign(column, role);
    }
}
