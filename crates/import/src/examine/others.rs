//! Steering angle, altitudes and vertical speed among the columns.

use super::delay::{correlation, lag};
use super::gnss::{Motion, SPEEDS, speed_unit};
use super::inertial::integral;
use super::linear::{Normal, Solved};
use super::scene::{Field, slope};
use super::survey::{Kind, Role, Survey, Weight};
use crate::candidate::Confidence;
use crate::fit::nearest;
use crate::order::sort_by;

/// What 1 rad of path curvature times metres reads: road wheels and steering wheel, of a car of 2.7 m with some understeer.
const STEERING: [(&str, &str, f64); 4] = [
    ("steer", "rad", 3.0),
    ("steering_wheel", "rad", 47.0),
    ("steer", "deg", 3.0 * 180.0 / std::f64::consts::PI),
    ("steering_wheel", "deg", 47.0 * 180.0 / std::f64::consts::PI),
];

/// The columns that go with the curvature of the path: steering wheel and road wheels.
///
/// `fast` is yaw rate and speed on the grid: with it, a gyro that leans is told from a steering angle by what the column
/// follows better, the turn rate or the curvature.
pub(crate) fn find_steering(s: &mut Survey, motion: &Motion, late: f64, fast: Option<(&[f64], &[f64])>) {
    let intervals = motion.intervals(late);
    let mut list: Vec<(usize, Solved)> = Vec::new();
    for column in s.columns(Kind::Steering) {
        let field = &s.scene.fields[column];
        if field.period > 0.3 {
            continue;
        }
        let mut n = Normal::default();
        for i in intervals.iter().filter(|i| i.speed > 3.0) {
            n.add(&[i.turn / (i.to - i.from) / i.speed, 1.0], field.mean(i.from, i.to));
        }
        let f = n.solve(2);
        let named = s.names[column].is_some();
        let bends = || fast.is_some_and(|(rate, speed)| bends(&field.grid, rate, speed));
        if f.count >= 12.0 && f.explained > 0.6 && (named || bends()) {
            list.push((column, f));
        }
    }
    sort_by(&mut list, |a, b| b.1.explained.total_cmp(&a.1.explained));
    for (column, f) in list {
        steering(s, column, &f, motion);
    }
}

/// Whether a column follows the curvature, at whatever delay, better than the turn rate of the same instant: a steering
/// angle does, a gyro that leans does not.
fn bends(grid: &[f64], rate: &[f64], speed: &[f64]) -> bool {
    let smooth = |v: &[f64]| slope(&integral(v), 4);
    let (own, turn) = (smooth(grid), smooth(rate));
    let moving = |i: usize| speed[i] > 3.0;
    let curve: Vec<f64> = (0..turn.len()).map(|i| if moving(i) { turn[i] / speed[i] } else { f64::NAN }).collect();
    let turn: Vec<f64> = (0..turn.len()).map(|i| if moving(i) { turn[i] } else { f64::NAN }).collect();
    let at_once = correlation(&own, &turn, 0).abs();
    lag(&own, &curve, 0.9).is_some_and(|l| l.correlation.abs() > at_once + 0.003)
}

fn steering(s: &mut Survey, column: usize, f: &Solved, motion: &Motion) {
    let (slope, explained) = (f.x[0], f.explained);
    let named = s.names[column].as_ref().map(|c| c.signal.clone());
    let list: Vec<(usize, f64)> = (0..4)
        .filter(|&k| named.as_ref().is_none_or(|n| n == STEERING[k].0))
        .map(|k| (k, (slope.abs() / STEERING[k].2).ln().abs()))
        .collect();
    let Some(&(k, off)) = list.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let (signal, unit, _) = STEERING[k];
    if off > 0.8 || s.of(signal).is_some() {
        return;
    }
    // Without a name, a gyro that leans may stand in for it.
    let confidence = match (explained > 0.9 && named.is_some(), off < 0.5) {
        (true, true) => Confidence::Certain,
        (_, true) => Confidence::Likely,
        _ => Confidence::Guess,
    };
    let why = format!(
        "is {slope:.2} times the curvature of the way of {}, correlation {:.3} over {} intervals: that of a {} in {unit}",
        motion.label,
        explained.sqrt(),
        f.count,
        if signal == "steer" { "road wheel" } else { "steering wheel" }
    );
    let role = Role { signal: signal.into(), unit: unit.into(), scale: slope.signum(), offset: 0.0, confidence, why };
    s.assign(column, role);
}

/// A column of altitude: how much of its change the climbing explains.
struct Height {
    column: usize,
    slope: f64,
    explained: f64,
    change: f64,
}

/// Altitudes, by the climbing that speed and pitch add up to; `climb` is on the grid, m/s, up to a constant share of the speed.
pub(crate) fn find_altitude(s: &mut Survey, climb: &Field, speed: &Field, fixes: Option<usize>) {
    const SPAN: f64 = 6.0;
    let mut list: Vec<Height> = Vec::new();
    let end = climb.grid.len() as f64 * super::scene::STEP;
    for column in s.columns(Kind::Altitude) {
        let field = &s.scene.fields[column];
        let mut n = Normal::default();
        let mut t = 0.0;
        while t + SPAN < end {
            let by = |f: &Field| f.mean(t, t + SPAN) * SPAN;
            n.add(&[by(climb), by(speed), 1.0], field.at(t + SPAN) - field.at(t));
            t += 2.0;
        }
        let f = n.solve(3);
        if f.count >= 15.0 {
            let change = field.range[1] - field.range[0];
            list.push(Height { column, slope: f.x[0], explained: f.explained, change });
        }
    }
    list.retain(|h| h.explained > 0.6 && h.slope > 0.0 && h.change > 2.0);
    sort_by(&mut list, |a, b| b.explained.total_cmp(&a.explained));
    let is_fix = |s: &Survey, c: usize| {
        fixes.is_some_and(|f| (s.scene.fields[f].period / s.scene.fields[c].period - 1.0).abs() < 0.1)
    };
    for h in list {
        let named = s.names[h.column].as_ref().map(|c| c.signal.clone());
        let signal = named.clone().unwrap_or(if is_fix(s, h.column) { "gnss_alt" } else { "baro_alt" }.into());
        let (unit, off) = nearest(h.slope, &[("m", 1.0), ("ft", 1.0 / 0.3048)]);
        if s.of(&signal).is_some() || off > 0.5 {
            continue;
        }
        let confidence = match (h.explained > 0.85 && off < 0.3, named.is_some()) {
            (true, true) => Confidence::Certain,
            (true, _) => Confidence::Likely,
            _ => Confidence::Guess,
        };
        let why = format!(
            "climbs as speed and pitch of the car do: {:.2} times in {unit}, {:.0} % of its changes explained",
            h.slope,
            100.0 * h.explained
        );
        let role = Role { signal, unit: unit.into(), scale: 1.0, offset: 0.0, confidence, why };
        s.assign(h.column, role);
    }
}

/// The receiver's vertical speed, by the change of an altitude.
pub(crate) fn find_vertical(s: &mut Survey, motion: &Motion) {
    let Some(altitude) = s.of("baro_alt").or_else(|| s.of("gnss_alt")) else { return };
    let metre = s.factor(altitude);
    let mut best: Option<(usize, f64, f64, f64)> = None;
    // A receiver writes its velocities in one unit.
    let north = s.of("gnss_vn").and_then(|c| s.roles[c].as_ref()).map(|r| r.unit.clone());
    let own = SPEEDS.iter().find(|u| north.as_deref() == Some(u.0));
    for column in s.columns(Kind::Velocity) {
        let (field, height) = (&s.scene.fields[column], &s.scene.fields[altitude]);
        if (motion.time.len() as f64) < 0.5 * field.count as f64 && field.is_fast() {
            continue;
        }
        let mut n = Normal::default();
        for &t in &motion.time {
            let rate = metre * (height.at(t + 2.0) - height.at(t - 2.0)) / 4.0;
            n.add(&[rate, 1.0], field.mean(t - 2.0, t + 2.0));
        }
        let f = n.solve(2);
        let ratio = own.map_or(speed_unit(f.x[0]).1, |u| f.x[0].abs() / u.1);
        let fits = f.count >= 12.0 && f.explained > 0.5 && ratio.ln().abs() < 0.3 && f.x[1].abs() < 0.5 * f.x[0].abs();
        if fits && best.is_none_or(|b| f.explained > b.2) {
            best = Some((column, f.x[0], f.explained, f.count));
        }
    }
    let Some((column, slope, explained, count)) = best else { return };
    let unit = own.map_or(speed_unit(slope).0, |u| u.0);
    let confidence = if explained > 0.8 { Confidence::Certain } else { Confidence::Likely };
    let why = format!(
        "is {slope:.2} times the change of {}, correlation {:.2} over {count} fixes",
        s.label(altitude),
        explained.sqrt()
    );
    let scale = -slope.signum();
    s.assign(column, Role { signal: "gnss_vd".into(), unit: unit.into(), scale, offset: 0.0, confidence, why });
}

/// Values of an altitude that stand for none: far from all others, and the same each time.
pub(crate) fn sentinels(s: &mut Survey, columns: &[usize]) -> Vec<(usize, f64)> {
    let mut found = Vec::new();
    for &column in columns {
        let values = &s.table.columns[column].values;
        let usual = crate::clock::median(
            values.iter().copied().filter(|v| v.is_finite()).step_by(1 + values.len() / 20_000).collect(),
        );
        let Some(odd) = values.iter().copied().find(|v| (v - usual).abs() > 3000.0) else { continue };
        let count = values.iter().filter(|v| **v == odd).count();
        if count < 2 {
            continue;
        }
        let text = format!(
            "{} reads {odd} in {count} rows, first in row {}, where its median is {usual:.1}: taken as no value.",
            s.label(column),
            s.table.line_of(values.iter().position(|v| *v == odd).unwrap_or(0))
        );
        s.find(Weight::Guess, &[column], text);
        found.push((column, odd));
    }
    found
}
