//! The gyro among the columns: unit and sign of the yaw axis by the course, of the others by how the accelerometer leans.

use drivescope_drive::geodesy::STANDARD_GRAVITY;

use super::gnss::Motion;
use super::inertial::{Triad, along, candidates, integral, sideways, swung};
use super::linear::{Normal, Solved, lean_rows};
use super::scene::{STEP, slope};
use super::survey::{Kind, Role, Survey, Weight};
use crate::candidate::Confidence;
use crate::fit::nearest;

/// Units of turn rates: what 1 rad/s reads.
const RATES: [(&str, f64); 3] = [("rad/s", 1.0), ("deg/s", 180.0 / std::f64::consts::PI), ("mrad/s", 1000.0)];

/// A yaw gyro: column, unit, what 1 rad/s of the car reads (signed), and how well it follows the course.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Yaw {
    pub column: usize,
    pub unit: &'static str,
    /// What 1 rad/s to the right reads.
    pub factor: f64,
    pub fit: Solved,
    pub bias: f64,
}

/// The column that turns with the course; `upright` is what share of the turn it reads, if the lean is known.
pub(crate) fn find_yaw(s: &Survey, motion: &Motion, late: f64, upright: Option<f64>) -> Option<Yaw> {
    let intervals = motion.intervals(late);
    let mut best: Option<(f64, Yaw)> = None;
    for column in candidates(s, Kind::Gyro) {
        let mut n = Normal::default();
        for i in intervals.iter().filter(|i| i.turn.is_finite()) {
            n.add(&[i.turn / (i.to - i.from), 1.0], s.scene.fields[column].mean(i.from, i.to));
        }
        let fit = n.solve(2);
        let (name, _) = nearest(fit.x[0].abs(), &RATES);
        let one = RATES.iter().find(|u| u.0 == name).map_or(1.0, |u| u.1);
        let off = (fit.x[0].abs() / one / upright.unwrap_or(0.97)).ln().abs();
        // The bias of a gyro is small; what is left beside the turn too.
        let bias = fit.x[1].abs() / one;
        let worth = (off / 0.05).powi(2) + (bias / 0.05).powi(2) + (1.0 - fit.explained) / 0.02;
        let clear = fit.count >= 12.0 && fit.explained > 0.5 && fit.x[0].abs() > 8.0 * fit.sigma[0];
        if clear && off < 0.3 && best.is_none_or(|b| worth < b.0) {
            best = Some((worth, Yaw { column, unit: name, factor: fit.x[0], fit, bias: fit.x[1] }));
        }
    }
    best.map(|b| b.1)
}

/// A roll or pitch gyro: column, sign, likelihood ratio against the next best reading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Across {
    pub column: usize,
    pub sign: f64,
    pub margin: f64,
}

/// Smooth derivative twice over, 0.8 s to both sides in all.
fn bent(values: &[f64]) -> Vec<f64> {
    slope(&slope(values, 4), 4)
}

/// A turn rate as smooth as what is expected of it.
fn smoothed(grid: &[f64]) -> Vec<f64> {
    bent(&integral(&integral(grid)))
}

/// Roll, pitch and yaw rate of the car, the first two by what gravity adds to the accelerometer; smooth, rad/s.
pub(crate) fn car_rates(s: &Survey, accel: &Triad, rate: &[f64], speed: &[f64]) -> [Vec<f64>; 3] {
    let n = speed.len();
    let (force_x, force_y) = (along(s, accel, 0), along(s, accel, 1));
    // Integrals of pitch and roll.
    let lost = integral(&swung(speed, rate));
    let force_x = integral(&force_x);
    let pitch: Vec<f64> = (0..n).map(|i| (force_x[i] - speed[i] + lost[i]) / STANDARD_GRAVITY).collect();
    let aside = sideways(speed, rate);
    let side: Vec<f64> = (0..n).map(|i| (aside[i] - force_y[i]) / STANDARD_GRAVITY).collect();
    let roll = integral(&side);
    let (pitch_angle, roll_angle) = (slope(&pitch, 4), slope(&roll, 4));
    let yaw = smoothed(rate);
    let (pitch_rate, roll_rate) = (bent(&pitch), bent(&roll));
    // Angles of a banked or hilly road turn into each other as the car yaws.
    let p = (0..n).map(|i| roll_rate[i] - yaw[i] * pitch_angle[i]).collect();
    let q = (0..n).map(|i| pitch_rate[i] + yaw[i] * roll_angle[i]).collect();
    [p, q, yaw]
}

/// How one column reads as the housing's roll or pitch gyro, by log likelihood: `[axis][sign]`, signs + and -.
fn readings(field: &[f64], one: f64, lean: [f64; 3], car: &[Vec<f64>; 3]) -> [[f64; 2]; 2] {
    /// How well the lean is known, as a share of the yaw rate.
    const LEAN: f64 = 0.03;
    let q = lean_rows(lean);
    let mut leak = Normal::default();
    field.iter().zip(&car[2]).for_each(|(y, w)| leak.add(&[*w, 1.0], *y / one));
    let leak = leak.solve(2);
    let mut out = [[0.0; 2]; 2];
    for (axis, signs) in out.iter_mut().enumerate() {
        let sideways = |i: usize| q[0][axis] * car[0][i] + q[1][axis] * car[1][i];
        let mut own = Normal::default();
        (0..field.len()).for_each(|i| own.add(&[car[2][i], 1.0], sideways(i)));
        let own = own.solve(2);
        // What both read beside the yaw rate; the gyro is the cleaner of the two.
        let (mut xx, mut xy, mut yy, mut count) = (0.0, 0.0, 0.0, 0.0);
        for i in 0..field.len() {
            let w = car[2][i];
            let (x, y) = (field[i] / one - leak.x[0] * w - leak.x[1], sideways(i) - own.x[0] * w - own.x[1]);
            if x.is_finite() && y.is_finite() {
                (xx, xy, yy, count) = (xx + x * x, xy + x * y, yy + y * y, count + 1.0);
            }
        }
        let free = (count * STEP / 1.2_f64).max(1.0);
        for (k, sign) in [1.0, -1.0].into_iter().enumerate() {
            let off = (sign * leak.x[0] - q[2][axis]) / LEAN;
            let slope = (sign * xy / xx).clamp(0.4, 1.6);
            let left = (yy - 2.0 * slope * sign * xy + slope * slope * xx) / yy;
            signs[k] = -0.5 * free * left.max(1e-4).ln() - 0.5 * off * off;
        }
    }
    out
}

/// The columns of roll and pitch gyro: they share the lean of the accelerometer, and turn as it says that the car does.
pub(crate) fn find_across(s: &Survey, yaw: &Yaw, lean: [f64; 3], car: &[Vec<f64>; 3]) -> Option<[Across; 2]> {
    let one = RATES.iter().find(|u| u.0 == yaw.unit).map_or(1.0, |u| u.1);
    let period = s.scene.fields[yaw.column].period;
    let mut columns = candidates(s, Kind::Gyro);
    columns.retain(|&c| c != yaw.column && (s.scene.fields[c].period / period - 1.0).abs() < 0.3);
    let table: Vec<(usize, [[f64; 2]; 2])> =
        columns.iter().map(|&c| (c, readings(&smoothed(&s.scene.fields[c].grid), one, lean, car))).collect();
    let mut list: Vec<(f64, [(usize, usize); 2])> = Vec::new();
    for a in 0..table.len() {
        for b in (0..table.len()).filter(|b| *b != a) {
            for signs in 0..4 {
                let (k, m) = (signs & 1, signs >> 1);
                list.push((table[a].1[0][k] + table[b].1[1][m], [(a, k), (b, m)]));
            }
        }
    }
    let best = list.iter().copied().reduce(|x, y| if y.0 > x.0 { y } else { x })?;
    let across = |axis: usize| {
        let (row, sign) = best.1[axis];
        // The best that reads this axis otherwise.
        let other = list.iter().filter(|l| l.1[axis] != best.1[axis]).map(|l| l.0).fold(f64::NEG_INFINITY, f64::max);
        Across { column: table[row].0, sign: if sign == 0 { 1.0 } else { -1.0 }, margin: best.0 - other }
    };
    (best.0 > -30.0).then(|| [across(0), across(1)])
}

/// Give the gyro's columns their roles.
pub(crate) fn seat_gyro(s: &mut Survey, yaw: &Yaw, across: Option<[Across; 2]>, motion: &Motion) {
    let f = yaw.fit;
    let correlation = f.explained.sqrt();
    let confidence = if correlation > 0.95 { Confidence::Certain } else { Confidence::Likely };
    let why = format!(
        "reads {:.2} {} for 1 rad/s of the course of {}, correlation {:.3} over {} intervals",
        yaw.factor, yaw.unit, motion.label, correlation, f.count
    );
    let role = |signal: &str, sign: f64, confidence: Confidence, why: String| Role {
        signal: signal.into(),
        unit: yaw.unit.into(),
        scale: sign,
        offset: 0.0,
        confidence,
        why,
    };
    s.assign(yaw.column, role("gyro_z", yaw.factor.signum(), confidence, why));
    let Some(across) = across else { return };
    for (axis, a) in across.iter().enumerate() {
        let (signal, word) = [("gyro_x", "roll"), ("gyro_y", "pitch")][axis];
        // Without a name, a steering angle that follows the same turns may stand in for a gyro that leans.
        let named = s.names[a.column].as_ref().is_some_and(|c| c.signal == signal);
        let confidence = match a.margin {
            m if m > 5.0 && named => Confidence::Certain,
            m if m > 5.0 => Confidence::Likely,
            _ => Confidence::Guess,
        };
        let why = format!(
            "leans as the accelerometer does and turns as it says that the car's {word} does: log likelihood {:.1} above the next reading",
            a.margin
        );
        s.assign(a.column, role(signal, a.sign, confidence, why));
        if confidence == Confidence::Guess {
            let text = format!(
                "{} is taken as {signal}: the drive leans too little to tell its axis and sign.",
                s.label(a.column)
            );
            s.find(Weight::Guess, &[a.column], text);
        }
    }
}
