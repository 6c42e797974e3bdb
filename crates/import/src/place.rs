//! What positions, courses and speeds say about each other's units.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::radii;

use crate::clock::median;
use crate::evidence::{Binned, Draft};
use crate::fit::{Fit, fit};

/// Shortest way between two fixes that tells units and axes from noise, m.
const LONG_STEP: f64 = 5.0;

/// Logarithm of a ratio of lengths beyond which fixes and speed contradict each other.
const DOUBT: f64 = 0.14;

const DEG: f64 = std::f64::consts::PI / 180.0;
/// Units that files give angles of place in, and the factor to rad.
const UNITS: [(&str, f64); 3] = [("deg", DEG), ("rad", 1.0), ("1e-7 deg", 1e-7 * DEG)];
/// The longest time between two fixes that count as one step, s.
const STEP: f64 = 3.0;

/// One step between two bins.
struct Step {
    /// Raw latitude and longitude, before and after.
    raw: [(f64, f64); 2],
    time: f64,
    /// Speed that another signal states, m/s; NaN if none.
    speed: f64,
}

impl Step {
    /// Length in metres with the raw angles times `factor` as radians.
    fn length(&self, factor: f64) -> f64 {
        let [(lat, lon), (lat2, lon2)] = self.raw.map(|(a, b)| (a * factor, b * factor));
        let (meridian, transverse) = radii(0.5 * (lat + lat2));
        ((lat2 - lat) * meridian).hypot(wrap_angle(lon2 - lon) * transverse * lat.cos())
    }
}

/// Whether latitude and longitude are degrees, radians or 1e-7 degrees: the way they cover against a speed.
pub(crate) fn check(draft: &mut Draft, [lat, lon]: [&str; 2]) {
    if draft.get(lat).is_none() || draft.get(lon).is_none() {
        return;
    }
    let (top_lat, top_lon) = (draft.max_abs(lat), draft.max_abs(lon));
    let fits = |factor: f64| top_lat * factor < 1.5709 && top_lon * factor < 6.2833;
    let possible: Vec<(&str, f64)> = UNITS.into_iter().filter(|(_, factor)| fits(*factor)).collect();
    let columns = format!("{} and {}", draft.column(lat), draft.column(lon));
    let now = draft.get(lat).map_or(String::new(), |c| c.unit.clone());
    if !possible.iter().any(|(_, f)| (f / draft.factor(lat)).ln().abs() < 1e-9)
        && top_lat < 9100.0
        && top_lon < 18_100.0
    {
        let reason = "look like degrees and minutes in one number (NMEA), which this version does not read";
        draft.remove(lat, reason);
        draft.remove(lon, reason);
        draft.note(format!("{columns} reach {top_lat} and {top_lon} and {reason}: they were left out."));
        return;
    }
    let (label, steps) = steps(draft, [lat, lon]);
    let moving: Vec<&Step> = steps.iter().filter(|s| s.speed > 1.0).collect();
    let ratio = |factor: f64| median(moving.iter().map(|s| s.length(factor) / (s.speed * s.time)).collect());
    let total = |factor: f64| moving.iter().map(|s| s.length(factor)).sum::<f64>();
    let mean_speed = |factor: f64| median(steps.iter().map(|s| s.length(factor) / s.time).collect());
    let (unit, reason) = if moving.len() >= 5 {
        let best = possible.iter().min_by(|a, b| ratio(a.1).ln().abs().total_cmp(&ratio(b.1).ln().abs()));
        let Some(&(unit, factor)) = best else { return };
        let stated: f64 = moving.iter().map(|s| s.speed * s.time).sum();
        let other = if unit == "deg" { UNITS[1] } else { UNITS[0] };
        let reason = format!(
            "the fixes then cover {:.1} m where {label} gives {stated:.1} m; as {} they would cover {:.1} m",
            total(factor),
            other.0,
            total(other.1)
        );
        if ratio(factor).ln().abs() > 2.0 {
            return draft.note(format!("{columns} do not agree with {label}: in no unit ({reason})."));
        }
        // Steps long enough that the receiver's noise does not lengthen them.
        let long = moving.iter().filter(|s| s.speed * s.time > LONG_STEP);
        let long: Vec<f64> = long.map(|s| s.length(factor) / (s.speed * s.time)).collect();
        if long.len() >= 5 && median(long).ln().abs() > DOUBT {
            draft.note(format!(
                "{columns} do not agree with {label}: {reason}. Latitude and longitude may be swapped, or the speed is in \
                 another unit; give a mapping."
            ));
        }
        (unit, reason)
    } else if fits(1.0) && mean_speed(1.0) > 0.3 && mean_speed(1.0) < 90.0 {
        let text = "they stay within pi, which in degrees is the sea off West Africa, and in radians the fixes move at";
        ("rad", format!("{text} {:.1} m/s", mean_speed(1.0)))
    } else if fits(DEG) {
        return;
    } else {
        ("1e-7 deg", format!("they reach {top_lat} and {top_lon}"))
    };
    settle(draft, [lat, lon], unit, &now, &columns, &reason);
}

fn settle(draft: &mut Draft, names: [&str; 2], unit: &str, now: &str, columns: &str, reason: &str) {
    let open = names.iter().all(|n| draft.unit_is_open(n));
    let same = crate::units::factor(now, "rad") == crate::units::factor(unit, "rad");
    if !open && !same {
        return draft.note(format!("{columns} are said to be {now} but look like {unit}: {reason}."));
    }
    if open {
        names.iter().for_each(|n| draft.revise(n, Some(unit), false, &format!("{unit}, since {reason}")));
    }
    if open && !same {
        draft.note(format!("{columns} are read as {unit}, not as {now}: {reason}."));
    }
}

/// A speed that a file may state: label and value from bins.
const SPEEDS: [&str; 9] = [
    "gnss_speed",
    "gnss_vn",
    "gnss_ve",
    "speed",
    "wheel_speed_rl",
    "wheel_speed_fl",
    "truth_vx",
    "truth_vn",
    "truth_ve",
];

/// Which of [`SPEEDS`] is there first, leaving `but` out; two indices where it is a velocity.
fn first_speed(draft: &Draft, but: &str) -> Option<(usize, Option<usize>)> {
    let there = |i: usize| SPEEDS[i] != but && draft.get(SPEEDS[i]).is_some();
    [(0, None), (1, Some(2)), (3, None), (4, None), (5, None), (6, None), (7, Some(8))]
        .into_iter()
        .find(|(a, b)| there(*a) && b.is_none_or(there))
}

fn speed_of(bins: &[Binned], kind: (usize, Option<usize>)) -> f64 {
    match kind.1 {
        Some(other) => bins[kind.0].mean.hypot(bins[other].mean),
        None => bins[kind.0].mean.abs(),
    }
}

fn steps(draft: &Draft, [lat, lon]: [&str; 2]) -> (String, Vec<Step>) {
    let kind = first_speed(draft, "");
    let label = kind.map_or(String::new(), |k| draft.column(SPEEDS[k.0]));
    let mut names = [""; 11];
    names[..2].copy_from_slice(&[lat, lon]);
    names[2..].copy_from_slice(&SPEEDS);
    let (to_raw_lat, to_raw_lon) = (1.0 / draft.factor(lat), 1.0 / draft.factor(lon));
    let fixes: Vec<[Binned; 11]> =
        draft.bins(names, 1.0).into_iter().filter(|b| b[0].mean != 0.0 || b[1].mean != 0.0).collect();
    let step = |w: &[[Binned; 11]]| {
        let time = w[1][0].time - w[0][0].time;
        let speed = kind.map_or(f64::NAN, |k| 0.5 * (speed_of(&w[0][2..], k) + speed_of(&w[1][2..], k)));
        let raw = |b: &[Binned; 11]| (b[0].mean * to_raw_lat, b[1].mean * to_raw_lon);
        let step = Step { raw: [raw(&w[0]), raw(&w[1])], time, speed };
        (time > 0.0 && time < STEP && step.length(1.0).is_finite()).then_some(step)
    };
    let fixes: Vec<[Binned; 11]> =
        fixes.into_iter().filter(|b| b[0].mean.is_finite() && b[1].mean.is_finite()).collect();
    (label, fixes.windows(2).filter_map(step).collect())
}

/// Pairs of a speed signal and the speed that others state (GNSS, else positions, else the truth), moving.
pub(crate) fn speed_beside(draft: &Draft, name: &str) -> (String, Vec<(f64, f64)>) {
    let by_position = |draft: &Draft| {
        let (lat, lon) = ("gnss_lat", "gnss_lon");
        let factor = draft.factor(lat);
        let bins = draft.bins([name, lat, lon], 1.0);
        let fixes: Vec<&[Binned; 3]> = bins.iter().filter(|b| b.iter().all(|v| v.mean.is_finite())).collect();
        let pair = |w: &[&[Binned; 3]]| {
            let time = w[1][1].time - w[0][1].time;
            let raw = |b: &[Binned; 3]| (b[1].mean / factor, b[2].mean / factor);
            let step = Step { raw: [raw(w[0]), raw(w[1])], time, speed: f64::NAN };
            (time > 0.0 && time < STEP).then(|| (0.5 * (w[0][0].mean + w[1][0].mean).abs(), step.length(factor) / time))
        };
        fixes.windows(2).filter_map(pair).filter(|p| p.1 > 2.0).collect::<Vec<_>>()
    };
    let beside = |draft: &Draft, kind: (usize, Option<usize>)| {
        let mut names = [""; 10];
        names[0] = name;
        names[1..].copy_from_slice(&SPEEDS);
        let bins = draft.bins(names, 1.0);
        let pairs = bins.iter().map(|b| (b[0].mean.abs(), speed_of(&b[1..], kind)));
        pairs.filter(|p| p.0.is_finite() && p.1 > 2.0).collect::<Vec<_>>()
    };
    let other = first_speed(draft, name);
    match other {
        Some(kind) if name != "gnss_speed" && kind.0 < 2 => (draft.column(SPEEDS[kind.0]), beside(draft, kind)),
        _ if draft.get("gnss_lat").is_some() && draft.get("gnss_lon").is_some() => {
            ("the positions".into(), by_position(draft))
        }
        Some(kind) if kind.0 >= 6 => (draft.column(SPEEDS[kind.0]), beside(draft, kind)),
        _ => (String::new(), Vec::new()),
    }
}

/// Pairs of raw course and direction of motion (rad), from velocity, else from positions at least 3 m apart.
pub(crate) fn directions(draft: &Draft) -> Vec<(f64, f64)> {
    let to_raw = 1.0 / draft.factor("course");
    let bins = draft.bins(["course", "gnss_vn", "gnss_ve", "gnss_lat", "gnss_lon", "gnss_n", "gnss_e"], 1.0);
    let pair = |w: &[[Binned; 7]]| {
        let course = w[1][0].last * to_raw;
        if w[1][1].mean.hypot(w[1][2].mean) > 2.0 {
            return (course, w[1][2].mean.atan2(w[1][1].mean));
        }
        let lat = w[1][3].mean;
        let (meridian, transverse) = radii(lat);
        let geodetic = ((lat - w[0][3].mean) * meridian, (w[1][4].mean - w[0][4].mean) * transverse * lat.cos());
        let local = (w[1][5].mean - w[0][5].mean, w[1][6].mean - w[0][6].mean);
        let (north, east) = if geodetic.0.is_finite() { geodetic } else { local };
        (course, if north.hypot(east) > 3.0 { east.atan2(north) } else { f64::NAN })
    };
    bins.windows(2).map(pair).filter(|p| p.0.is_finite() && p.1.is_finite()).collect()
}

/// The rate at which the course turns against the yaw gyro as mapped: course from velocity, receiver or truth.
pub(crate) fn turning(draft: &Draft) -> Fit {
    let bins = draft.bins(["gyro_z", "course", "gnss_vn", "gnss_ve", "truth_yaw", "gnss_speed", "speed"], 1.0);
    let course = |b: &[Binned; 7]| {
        let speed = b[2].last.hypot(b[3].last);
        if speed > 3.0 {
            return b[3].last.atan2(b[2].last);
        }
        let slow = b[5].mean < 3.0 || b[6].mean.abs() < 3.0;
        if b[1].last.is_finite() && !slow { b[1].last } else { b[4].last }
    };
    // The course of a bin is that of its end, so that the rate between two ends belongs to the gyro's mean in the second.
    fit(&mut bins.windows(2).map(|w| {
        let step = w[1][0].time - w[0][0].time;
        let rate = if step > 0.5 && step < 1.5 { wrap_angle(course(&w[1]) - course(&w[0])) / step } else { f64::NAN };
        (w[1][0].mean, rate)
    }))
}

/// Fixes that a logger repeats in every row until the next one comes.
pub(crate) fn repeats(draft: &mut Draft) {
    let (lat, lon) = (draft.raw("gnss_lat"), draft.raw("gnss_lon"));
    let fixes: Vec<(f64, f64)> =
        lat.iter().zip(lon).map(|(a, b)| (*a, *b)).filter(|f| f.0.is_finite() && f.1.is_finite()).collect();
    let changes = fixes.windows(2).filter(|w| w[0] != w[1]).count();
    if fixes.len() < 50 || changes < 5 || 2 * changes > fixes.len() {
        return;
    }
    let every = fixes.len() as f64 / changes as f64;
    draft.drop_repeats("gnss");
    draft.note(format!(
        "the log repeats each GNSS fix {every:.1} times on average ({changes} changes in {} rows): repeats were left out, since an estimator would take each as a new measurement.",
        fixes.len()
    ));
}
