//! Columns without a role, and what they follow all the same: their axis and sign, in numbers.

use super::delay::lag;
use super::evidence;
use super::gnss::Motion;
use super::hold::Held;
use super::inertial::integral;
use super::scene::slope;
use super::survey::{Survey, Weight};

/// Most columns that are asked.
const MOST: usize = 96;

/// Say of columns without a role which turn rate or acceleration they follow, and how often it they read.
pub(crate) fn look(s: &mut Survey, motion: &Motion, late: f64) {
    let asked = |c: &usize| {
        let field = &s.scene.fields[*c];
        s.roles[*c].is_none() && field.count >= 10 && !field.is_constant() && field.period <= 0.3
    };
    let asked: Vec<usize> = (0..s.roles.len()).filter(asked).take(MOST).collect();
    let known = known(s);
    for column in asked {
        let by_motion = by_motion(s, column, motion, late);
        let by_sensor = by_sensor(s, column, &known);
        let best = [by_motion, by_sensor]
            .into_iter()
            .flatten()
            .reduce(|a, b| if b.correlation.abs() > a.correlation.abs() { b } else { a });
        let Some(f) = best else { continue };
        let sign = if f.slope < 0.0 { ", the other way round" } else { "" };
        let text = format!(
            "{} follows {}{sign}: {:.3} times it in SI units, correlation {:.2}.",
            s.label(column),
            f.against,
            f.slope,
            f.correlation
        );
        s.find(Weight::Note, &[column], text);
    }
}

/// Turn rate, forward or sideways acceleration of the motion over ground.
fn by_motion(s: &Survey, column: usize, motion: &Motion, late: f64) -> Option<Held> {
    let each = ["gyro_z", "accel_x", "accel_y"].into_iter();
    let all = each.filter_map(|signal| evidence::against(s, column, signal, (motion, late), None));
    let best = all.reduce(|a, b| if b.correlation.abs() > a.correlation.abs() { b } else { a });
    best.filter(|b| b.correlation.abs() > 0.77)
}

/// Mean over 0.9 s.
fn smooth(grid: &[f64]) -> Vec<f64> {
    slope(&integral(grid), 4)
}

/// Yaw rate and accelerations that have a role, and the change of the car's speed, in SI, smooth.
fn known(s: &Survey) -> Vec<(String, Vec<f64>)> {
    let grid = |column: usize| -> Vec<f64> {
        let factor = s.factor(column);
        s.scene.fields[column].grid.iter().map(|v| v * factor).collect()
    };
    let of = |name: &&str| s.of(name).filter(|c| s.scene.fields[*c].is_fast());
    let mut out: Vec<(String, Vec<f64>)> =
        ["gyro_z", "accel_x", "accel_y"].iter().filter_map(of).map(|c| (s.label(c), smooth(&grid(c)))).collect();
    let speed = ["speed", "wheel_speed_rl", "wheel_speed_fl"].iter().find_map(of);
    out.extend(speed.map(|c| (format!("d({})/dt", s.label(c)), slope(&grid(c), 4))));
    out
}

/// The best of the known sensors that a column follows at any delay up to half a second.
fn by_sensor(s: &Survey, column: usize, known: &[(String, Vec<f64>)]) -> Option<Held> {
    let own = smooth(&s.scene.fields[column].grid);
    let mut best: Option<Held> = None;
    for (what, sensor) in known {
        let Some(l) = lag(&own, sensor, 0.9).filter(|l| l.correlation.abs() > 0.7) else { continue };
        if best.as_ref().is_some_and(|b| b.correlation.abs() >= l.correlation.abs()) {
            continue;
        }
        let shift = (l.late / super::scene::STEP).round() as i64;
        let later = |i: usize| usize::try_from(i as i64 + shift).ok().and_then(|k| own.get(k)).copied();
        let pairs: Vec<(f64, f64)> =
            sensor.iter().enumerate().map(|(i, x)| (*x, later(i).unwrap_or(f64::NAN))).collect();
        best = Some(Held { correlation: l.correlation, ..Held::new(what.clone(), &pairs) });
    }
    best
}
