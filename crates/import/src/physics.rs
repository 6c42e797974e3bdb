//! Checks of a proposed mapping against physics: units that no name states, turned axes, and what looks wrong.
//!
//! A unit that the file states is never changed, only doubted in a note. A sign is turned only under an alias; under a
//! canonical name a contradiction is a note. Each note gives the numbers it rests on.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::STANDARD_GRAVITY;

use crate::clock::median;
use crate::evidence::{Binned, Draft};
use crate::fit::{Fit, fit, nearest};

const DEG: f64 = std::f64::consts::PI / 180.0;
/// Correlation from which two signals are taken to be about the same thing.
const SAME: f64 = 0.8;

/// Run every check; places and speeds first, since the others lean on them.
pub(crate) fn check(draft: &mut Draft) {
    crate::place::check(draft, ["gnss_lat", "gnss_lon"]);
    crate::place::check(draft, ["truth_lat", "truth_lon"]);
    speeds(draft);
    course(draft);
    gravity(draft);
    field(draft);
    yaw_rate(draft);
    lateral(draft);
    forward(draft);
    steering(draft);
    constants(draft);
    crate::place::repeats(draft);
}

/// Speeds without unit against GNSS; a stated unit is only doubted.
fn speeds(draft: &mut Draft) {
    const UNITS: &[(&str, f64)] = &[("m/s", 1.0), ("km/h", 3.6), ("mph", 1.0 / 0.447_04), ("knots", 3600.0 / 1852.0)];
    const NAMES: [&str; 6] =
        ["gnss_speed", "speed", "wheel_speed_fl", "wheel_speed_fr", "wheel_speed_rl", "wheel_speed_rr"];
    for name in NAMES {
        if draft.get(name).is_none() {
            continue;
        }
        let (label, pairs) = crate::place::speed_beside(draft, name);
        let column = draft.column(name);
        if pairs.len() < 5 {
            let top = draft.max_abs(name);
            if draft.unit_is_open(name) && top > 75.0 {
                draft.revise(name, Some("km/h"), false, "km/h by its size");
                draft.note(format!("{column} states no unit and reaches {top:.1}: taken as km/h, since no car of this kind drives {top:.0} m/s."));
            }
            continue;
        }
        let ratio = median(pairs.iter().map(|(own, other)| own / other).collect());
        let (unit, distance) = nearest(ratio, UNITS);
        if draft.unit_is_open(name) && unit != "m/s" && distance < 0.08 {
            draft.revise(name, Some(unit), false, &format!("{unit}, since it is {ratio:.3} times {label}"));
            draft.note(format!(
                "{column} states no unit: taken as {unit}, since it is {ratio:.3} times the speed of {label} in m/s."
            ));
        } else if draft.unit_is_open(name) && unit == "m/s" && distance < 0.08 {
            draft.revise(name, Some("m/s"), false, &format!("agrees with {label} (ratio {ratio:.3})"));
        } else if (ratio.ln()).abs() > 0.15 {
            draft.note(format!(
                "{column} is {ratio:.3} times the speed of {label}: no unit of speed explains that; check its scale."
            ));
        }
    }
}

/// Course in degrees or radians: by its range, else by the direction of motion.
fn course(draft: &mut Draft) {
    if !draft.unit_is_open("course") {
        return;
    }
    let (top, column) = (draft.max_abs("course"), draft.column("course"));
    if top > 6.9 {
        draft.revise("course", Some("deg"), false, "degrees, since it exceeds 2 pi");
        draft.note(format!(
            "{column} states no unit and reaches {top:.1}: taken as degrees, since radians end at 6.28."
        ));
        return;
    }
    let pairs = crate::place::directions(draft);
    let error =
        |factor: f64| median(pairs.iter().map(|(raw, way)| wrap_angle(raw * factor - way).abs()).collect()) / DEG;
    let (as_rad, as_deg) = (error(1.0), error(DEG));
    if pairs.len() < 5 && !is_alias(draft, "course") {
        // The canonical unit stands.
    } else if pairs.len() < 5 {
        draft.note(format!(
            "{column} states no unit and stays below {top:.3}: taken as rad; nothing in the file can tell."
        ));
    } else if as_deg < as_rad {
        draft.revise("course", Some("deg"), false, "degrees, by the direction of motion");
        draft.note(format!("{column} states no unit: taken as degrees, then {as_deg:.1} deg from the direction of motion (median); as rad {as_rad:.1} deg."));
    } else {
        draft.revise("course", Some("rad"), false, "rad, by the direction of motion");
        let _ = is_alias(draft, "course").then(|| draft.note(format!("{column} states no unit: taken as rad, then {as_rad:.2} deg from the direction of motion (median); as degrees {as_deg:.2} deg.")));
    }
}

const ACCEL: [&str; 3] = ["accel_x", "accel_y", "accel_z"];
const GYRO: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];
const MAG: [&str; 3] = ["mag_x", "mag_y", "mag_z"];

/// Unit and axes of the accelerometer from gravity.
fn gravity(draft: &mut Draft) {
    if draft.get("accel_z").is_none() {
        return;
    }
    let magnitude = |draft: &Draft| {
        let norm =
            |b: &[Binned; 3]| b.iter().map(|a| a.mean).filter(|a| a.is_finite()).map(|a| a * a).sum::<f64>().sqrt();
        median(draft.bins(ACCEL, 0.5).iter().map(norm).filter(|n| *n > 0.0).collect())
    };
    let raw = magnitude(draft);
    if ACCEL.iter().any(|n| draft.unit_is_open(n)) {
        let (unit, distance) = nearest(raw, &[("m/s^2", STANDARD_GRAVITY), ("g", 1.0), ("mg", 1000.0)]);
        for name in ACCEL.iter().filter(|_| distance < 0.35) {
            if draft.unit_is_open(name) {
                draft.revise(name, Some(unit), false, &format!("{unit}, since the median magnitude is {raw:.3}"));
            }
        }
        if distance < 0.35 && unit != "m/s^2" {
            draft.note(format!(
                "the accelerometer states no unit: taken as {unit}, since the median of its magnitude is {raw:.3}."
            ));
        }
    }
    let magnitude = magnitude(draft);
    if (magnitude / STANDARD_GRAVITY).ln().abs() > 0.12 {
        draft.note(format!(
            "the accelerometer's magnitude has a median of {magnitude:.2} m/s^2, not 9.81: check its unit, or whether gravity was taken out."
        ));
    }
    let [x, y, z] = ACCEL.map(|n| median(draft.some_raw(n)) * draft.factor(n));
    if z > 0.6 * STANDARD_GRAVITY {
        turn_axes(draft, z);
    } else if x.abs().max(y.abs()) > 0.6 * STANDARD_GRAVITY && z.abs() < 0.6 * STANDARD_GRAVITY {
        let (axis, value) = if x.abs() > y.abs() { ("x", x) } else { ("y", y) };
        draft.note(format!(
            "gravity lies along the accelerometer's {axis} axis (median {value:.2} m/s^2): the sensor is mounted on its side; give a mapping that names its axes."
        ));
    }
}

/// Unit of the magnetometer: the Earth's field is 25 to 65 uT, a car's own field adds as much again.
fn field(draft: &mut Draft) {
    const EARTH: f64 = 48.0;
    const UNITS: &[(&str, f64)] =
        &[("uT", EARTH), ("nT", 1e3 * EARTH), ("mG", 10.0 * EARTH), ("G", 0.01 * EARTH), ("T", 1e-6 * EARTH)];
    if MAG.iter().any(|n| draft.get(n).is_none()) {
        return;
    }
    let magnitude = |draft: &Draft| {
        let norm = |b: &[Binned; 3]| b.iter().map(|m| m.mean * m.mean).sum::<f64>().sqrt();
        median(draft.bins(MAG, 0.5).iter().map(norm).filter(|n| n.is_finite()).collect())
    };
    let raw = magnitude(draft);
    let (unit, distance) = nearest(raw, UNITS);
    if MAG.iter().all(|n| draft.unit_is_open(n)) && unit != "uT" && distance < 1.1 {
        for name in MAG {
            draft.revise(name, Some(unit), false, &format!("{unit}, since the median magnitude is {raw:.4}"));
        }
        draft.note(format!(
            "the magnetometer states no unit: taken as {unit}, since the median of its magnitude is {raw:.3e}."
        ));
    }
    let found = magnitude(draft);
    if !(15.0..150.0).contains(&found) && found.is_finite() {
        draft.note(format!("the magnetometer's magnitude has a median of {found:.1} uT, the Earth's field has 25 to 65: check its unit or its offsets."));
    }
}

/// ISO 8855 axes (x forward, y left, z up) become forward, right, down.
fn turn_axes(draft: &mut Draft, z: f64) {
    let mut turned = Vec::new();
    for name in [ACCEL, GYRO, MAG].iter().flat_map(|axes| &axes[1..]) {
        if draft.get(name).is_some() {
            draft.revise(name, None, true, "z-up axes: sign turned");
            turned.push(*name);
        }
    }
    draft.note(format!(
        "accel_z has a median of {z:+.2} m/s^2, so that z points up (ISO 8855 axes): the signs of {} were turned to x forward, y right, z down.",
        turned.join(", ")
    ));
}

/// Unit and sign of the yaw gyro (and unit of its companions) from how the course turns, else from lateral acceleration.
fn yaw_rate(draft: &mut Draft) {
    let open = GYRO.iter().filter(|n| draft.unit_is_open(n)).count() > 0;
    let size = GYRO.iter().map(|n| percentile(draft, n)).fold(0.0, f64::max);
    let by_size = open && size > 12.0;
    if by_size {
        gyro_in_degrees(draft, &format!("its 99.9 % value is {size:.1}, more than any car turns in rad/s"));
    }
    if draft.get("gyro_z").is_none() {
        return;
    }
    let turning = crate::place::turning(draft);
    let sideways = sideways(draft);
    let (found, what) = match turning {
        f if is_clear(f, 0.02) => (f, "the rate at which the course turns"),
        _ if is_clear(sideways, 0.3) => (sideways, "lateral acceleration over speed"),
        _ => return,
    };
    let (unit, distance) = nearest(found.slope.abs(), &[("rad/s", 1.0), ("deg/s", DEG)]);
    let numbers = format!(
        "{what} is {:.4} times it (correlation {:.2} over {} values)",
        found.slope, found.correlation, found.count
    );
    if open && !by_size && unit == "deg/s" && distance < 0.7 {
        gyro_in_degrees(draft, &numbers);
    } else if open && !by_size && distance < 0.5 {
        draft.revise("gyro_z", Some("rad/s"), false, &format!("rad/s, since {numbers}"));
    }
    // Lateral acceleration has a doubtful sign of its own; only the course decides the gyro's.
    if found.correlation < -SAME && is_clear(turning, 0.02) {
        turn_or_doubt(draft, "gyro_z", &numbers);
    }
}

fn gyro_in_degrees(draft: &mut Draft, numbers: &str) {
    for name in GYRO {
        if draft.unit_is_open(name) {
            draft.revise(name, Some("deg/s"), false, "deg/s by physics");
        }
    }
    draft.note(format!("the gyro states no unit: taken as deg/s, since {numbers}."));
}

/// The lateral accelerometer against yaw rate times speed.
fn sideways(draft: &Draft) -> Fit {
    let bins = draft.bins(["accel_y", "gyro_z", "speed", "wheel_speed_rl", "gnss_speed"], 0.5);
    fit(&mut bins.iter().map(|b| (b[1].mean * first_speed(&b[2..]), b[0].mean)))
}

/// Sign of the lateral accelerometer from yaw rate times speed.
fn lateral(draft: &mut Draft) {
    let found = sideways(draft);
    if is_clear(found, 0.3) && found.correlation < -SAME {
        let numbers =
            format!("it is {:.2} times speed times yaw rate (correlation {:.2})", found.slope, found.correlation);
        turn_or_doubt(draft, "accel_y", &numbers);
    }
}

/// Sign of the forward accelerometer, and its unit where no vertical one tells, from how the speed changes.
fn forward(draft: &mut Draft) {
    if draft.get("accel_x").is_none() {
        return;
    }
    let bins = draft.bins(["accel_x", "speed", "wheel_speed_rl", "gnss_speed"], 0.5);
    let mut change = bins.windows(3).map(|w| {
        let speed = |b: &[Binned; 4]| first_binned(&b[1..]);
        let (before, after) = (speed(&w[0]), speed(&w[2]));
        let step = after.time - before.time;
        let rate = if step > 0.2 && step < 2.0 { (after.mean - before.mean) / step } else { f64::NAN };
        (w[1][0].mean, rate)
    });
    let found = fit(&mut change);
    if !is_clear(found, 0.3) {
        return;
    }
    let numbers = format!(
        "the change of speed is {:.3} times it (correlation {:.2} over {} values)",
        found.slope, found.correlation, found.count
    );
    let (unit, distance) = nearest(found.slope.abs(), &[("m/s^2", 1.0), ("g", STANDARD_GRAVITY)]);
    if draft.unit_is_open("accel_x") && draft.get("accel_z").is_none() && unit == "g" && distance < 0.5 {
        for name in ACCEL {
            draft.revise(name, Some("g"), false, "g, from the change of speed");
        }
        draft.note(format!("the accelerometer states no unit: taken as g, since {numbers}."));
    }
    if found.correlation < -SAME {
        turn_or_doubt(draft, "accel_x", &numbers);
    }
}

/// Unit and sign of a steering angle from speed and yaw rate; which angle it is where the name leaves that open.
fn steering(draft: &mut Draft) {
    // Yaw rate per speed and angle: 1 over wheelbase and understeer, and over the steering ratio of 12 to 20.
    const ROAD: f64 = 0.3;
    const WHEEL: f64 = 0.3 / 15.0;
    for (name, gain, limit) in [("steering_wheel", WHEEL, 14.0), ("steer", ROAD, 1.3)] {
        if draft.get(name).is_none() {
            continue;
        }
        let (column, top) = (draft.column(name), draft.max_abs(name));
        let bins = draft.bins([name, "gyro_z", "speed", "wheel_speed_rl", "gnss_speed"], 0.5);
        let found = fit(&mut bins.iter().map(|b| (b[0].mean * first_speed(&b[2..]), b[1].mean)));
        let clear = is_clear(found, 0.01);
        let numbers =
            format!("yaw rate over speed is {:.5} times it (correlation {:.2})", found.slope, found.correlation);
        let (unit, distance) = nearest(found.slope.abs(), &[("rad", gain), ("deg", gain * DEG)]);
        if draft.unit_is_open(name) && top > limit {
            draft.revise(name, Some("deg"), false, "degrees by its size");
            draft.note(format!("{column} states no unit and reaches {top:.1}: taken as degrees."));
        } else if draft.unit_is_open(name) && clear && unit == "deg" && distance < 1.4 {
            draft.revise(name, Some("deg"), false, "degrees by the yaw rate");
            draft.note(format!("{column} states no unit: taken as degrees, since {numbers}."));
        } else if draft.unit_is_open(name) && !clear && is_alias(draft, name) {
            draft.note(format!(
                "{column} states no unit and stays below {top:.3}: taken as rad; the drive turns too little to tell."
            ));
        }
        if clear && found.correlation < -SAME {
            turn_or_doubt(draft, name, &numbers);
        }
    }
}

/// Whether the name leaves the unit and the sign open: those of canonical names are law until contradicted.
fn is_alias(draft: &Draft, name: &str) -> bool {
    draft.get(name).is_some_and(|c| c.rank > 0)
}

/// Turn the sign of an alias; of a canonical name say only that it contradicts.
fn turn_or_doubt(draft: &mut Draft, name: &str, numbers: &str) {
    let column = draft.column(name);
    if is_alias(draft, name) {
        draft.revise(name, None, true, "sign turned by physics");
        draft.note(format!("{column} counts the other way, since {numbers}: its sign was turned."));
    } else {
        draft.note(format!("{column} seems to have the wrong sign, since {numbers}; it was left as it is because its name is canonical."));
    }
}

/// Columns that never change.
fn constants(draft: &mut Draft) {
    let others = [
        "speed",
        "wheel_speed_fl",
        "wheel_speed_fr",
        "wheel_speed_rl",
        "wheel_speed_rr",
        "gnss_lat",
        "gnss_lon",
        "baro_alt",
    ];
    for name in ACCEL.iter().chain(&GYRO).chain(&MAG).chain(&others) {
        let values: Vec<f64> = draft.raw(name).iter().copied().filter(|v| v.is_finite()).collect();
        if values.len() >= 100 && values.iter().all(|v| *v == values[0]) {
            let column = draft.column(name);
            draft.note(format!(
                "{column} holds {} in all {} rows: a stuck or unconnected sensor?",
                values[0],
                values.len()
            ));
        }
    }
}

/// A fit that decides: enough values, enough motion (`least` is a standard deviation), and a strong correlation.
fn is_clear(fit: Fit, least: f64) -> bool {
    fit.count >= 20 && fit.spread > least && fit.correlation.abs() >= SAME
}

fn first_binned(candidates: &[Binned]) -> Binned {
    candidates.iter().copied().find(|b| b.mean.is_finite()).unwrap_or(Binned {
        mean: f64::NAN,
        last: f64::NAN,
        time: f64::NAN,
    })
}

fn first_speed(candidates: &[Binned]) -> f64 {
    first_binned(candidates).mean
}

/// The magnitude that 99.9 % of the raw values do not exceed; 0 without values.
fn percentile(draft: &Draft, name: &str) -> f64 {
    let mut values: Vec<f64> = draft.some_raw(name).into_iter().map(f64::abs).collect();
    if values.is_empty() {
        return 0.0;
    }
    let index = (values.len() - 1) * 999 / 1000;
    drivescope_drive::select::nth(&mut values, index)
}
