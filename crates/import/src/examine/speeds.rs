//! Speeds among the columns: the car's own against the motion over ground, and which wheel is which.

use super::gnss::{Follow, Motion, follow, speed_unit};
use super::linear::Normal;
use super::scene::Field;
use super::survey::{Kind, Role, Survey, Weight};
use crate::candidate::Confidence;
use crate::order::sort_by;

/// A column that follows the speed over ground.
#[derive(Clone, Copy, Debug)]
struct Speed {
    column: usize,
    follow: Follow,
    unit: &'static str,
    /// What is left beside the unit: the scale of a wheel.
    ratio: f64,
}

/// Find the speed columns and give each its role; `rate` is the yaw gyro in rad/s, once it is known.
pub(crate) fn find(s: &mut Survey, motion: &Motion, rate: Option<&Field>) {
    if s.of("gnss_speed").is_none() {
        find_gnss_speed(s, motion);
    }
    let mut list: Vec<Speed> = Vec::new();
    for column in s.columns(Kind::Speed).into_iter().filter(|c| Some(*c) != motion.column) {
        let field = &s.scene.fields[column];
        let reach = if motion.noise > 0.3 { 1.0 } else { 0.3 };
        let f = follow(field, motion, reach, &|i| motion.speed[i]);
        let (unit, ratio) = speed_unit(f.factor);
        let varies = f.correlation.abs() > 0.9 || (f.left < 0.03 && ratio.ln().abs() < 0.025);
        let named = s.names[column].is_some();
        if field.period < 0.6 && f.left < 0.2 && ratio.ln().abs() < 0.08 && (varies || named) {
            list.push(Speed { column, follow: f, unit, ratio });
        }
    }
    if list.is_empty() {
        return;
    }
    let spans = spans(motion, rate);
    let sides = sides(s, &list, &spans);
    if s.names.iter().flatten().count() > 0 {
        named(s, &list, &sides, motion, rate.is_some());
    } else {
        nameless(s, &list, &sides, motion, &spans, rate.is_some());
    }
    if rate.is_some() {
        scale_note(s, &list, motion);
    }
}

/// A stretch of time with its turn rate, rad/s, speed, m/s, and change of speed.
struct Span {
    from: f64,
    to: f64,
    rate: f64,
    speed: f64,
    accel: f64,
}

/// Half seconds of the yaw gyro, or what the fixes say where there is none.
fn spans(motion: &Motion, rate: Option<&Field>) -> Vec<Span> {
    let Some(rate) = rate else {
        let span = |i: &super::gnss::Interval| Span {
            from: i.from,
            to: i.to,
            rate: i.turn / (i.to - i.from),
            speed: i.speed,
            accel: i.accel,
        };
        return motion.intervals(0.0).iter().map(span).collect();
    };
    let mut out = Vec::new();
    for i in motion.intervals(0.0) {
        let middle = 0.5 * (i.from + i.to);
        for (from, to) in [(i.from, middle), (middle, i.to)] {
            out.push(Span { from, to, rate: rate.mean(from, to), speed: i.speed, accel: i.accel });
        }
    }
    out
}

fn find_gnss_speed(s: &mut Survey, motion: &Motion) {
    let mut best: Option<(usize, Follow)> = None;
    for column in s.columns(Kind::GnssSpeed) {
        let field = &s.scene.fields[column];
        if field.is_fast() && s.names[column].is_none() {
            continue;
        }
        let f = follow(field, motion, 0.0, &|i| motion.speed[i]);
        let (_, ratio) = speed_unit(f.factor);
        let fits = f.left < 0.15 && ratio.ln().abs() < 0.06 && f.factor > 0.0 && f.correlation > 0.7;
        if fits && best.is_none_or(|b| f.left < b.1.left) {
            best = Some((column, f));
        }
    }
    let Some((column, f)) = best else { return };
    let (unit, ratio) = speed_unit(f.factor);
    let why = format!("is {ratio:.3} times the speed of {} in {unit}, {:.1} % left", motion.label, 100.0 * f.left);
    let confidence = if f.left < 0.06 { Confidence::Certain } else { Confidence::Likely };
    let role = Role { signal: "gnss_speed".into(), unit: unit.into(), scale: 1.0, offset: 0.0, confidence, why };
    s.assign(column, role);
}

/// How much faster each runs in a turn to the right, m: half the track of a left wheel; with its 1-sigma.
fn sides(s: &Survey, list: &[Speed], spans: &[Span]) -> Vec<(f64, f64)> {
    let mut fits = vec![Normal::default(); list.len()];
    for i in spans {
        let own: Vec<f64> =
            list.iter().map(|w| s.scene.fields[w.column].mean(i.from, i.to) / w.follow.factor).collect();
        let mean = own.iter().sum::<f64>() / own.len() as f64;
        for (fit, v) in fits.iter_mut().zip(&own) {
            // Driven wheels slip with what drives the car and with the wind.
            fit.add(&[i.rate, mean, mean * mean, i.accel], v - mean);
        }
    }
    let solved = fits.iter().map(|f| f.solve(4));
    let list: Vec<(f64, f64)> = solved.map(|f| (f.x[0], f.sigma[0])).collect();
    // Wheels of both sides lie evenly about the middle one.
    let middle = crate::clock::median(list.iter().map(|l| l.0).collect());
    let shift = if list.len() % 2 == 1 { middle } else { 0.0 };
    list.into_iter().map(|(side, sigma)| (side - shift, sigma)).collect()
}

/// Squared wheelbase by which the squares of two speeds differ in turns, m^2, and its 1-sigma.
fn ahead(s: &Survey, a: &Speed, b: &Speed, spans: &[Span]) -> (f64, f64) {
    let mut fit = Normal::default();
    for i in spans {
        let [p, q] = [a, b].map(|w| s.scene.fields[w.column].mean(i.from, i.to) / w.follow.factor);
        fit.add(&[i.rate * i.rate, p * p, i.speed * i.accel], p * p - q * q);
    }
    let f = fit.solve(3);
    (f.x[0], f.sigma[0])
}

fn role(w: &Speed, signal: &str, confidence: Confidence, motion: &Motion, more: &str) -> Role {
    let why = format!(
        "is {:.3} times the speed of {} in {}, {:.1} % left{more}",
        w.ratio,
        motion.label,
        w.unit,
        100.0 * w.follow.left
    );
    let scale = w.follow.factor.signum();
    // A speed that hardly changes shows its size only.
    let confidence = if w.follow.correlation.abs() > 0.7 { confidence } else { confidence.min(Confidence::Likely) };
    Role { signal: signal.into(), unit: w.unit.into(), scale, offset: 0.0, confidence, why }
}

fn named(s: &mut Survey, list: &[Speed], sides: &[(f64, f64)], motion: &Motion, last: bool) {
    for (w, &(side, sigma)) in list.iter().zip(sides) {
        let Some(signal) = s.names[w.column].as_ref().map(|c| c.signal.clone()) else { continue };
        let left = signal.ends_with('l');
        let clear = signal.starts_with("wheel") && side.abs() > 0.3 && side.abs() > 6.0 * sigma;
        let (mut confidence, mut more) = (Confidence::Certain, String::new());
        if clear {
            let word = if side > 0.0 { "left" } else { "right" };
            more =
                format!("; in turns to the right {side:+.2} m times the yaw rate faster than the mean: a {word} wheel");
            if left != (side > 0.0) && last {
                confidence = Confidence::Likely;
                let text = format!(
                    "{} is called {signal}, but runs as a {word} wheel: {side:+.2} m times the yaw rate to the right faster than the mean.",
                    s.label(w.column)
                );
                s.find(Weight::Contradiction, &[w.column], text);
            }
        }
        s.assign(w.column, role(w, &signal, confidence, motion, &more));
    }
}

fn nameless(s: &mut Survey, list: &[Speed], sides: &[(f64, f64)], motion: &Motion, spans: &[Span], last: bool) {
    let of = |sign: f64| -> Vec<usize> {
        (0..list.len()).filter(|&i| sign * sides[i].0 > 0.1 && sides[i].0.abs() > 5.0 * sides[i].1).collect()
    };
    let (left, right) = (of(1.0), of(-1.0));
    for (wheels, names, word) in
        [(&left, ["wheel_speed_fl", "wheel_speed_rl"], "left"), (&right, ["wheel_speed_fr", "wheel_speed_rr"], "right")]
    {
        let side = |i: usize| {
            format!(
                "; in turns to the right {:+.2} m times the yaw rate faster than the mean: a {word} wheel",
                sides[i].0
            )
        };
        if let [a, b] = wheels[..] {
            let (square, sigma) = ahead(s, &list[a], &list[b], spans);
            let t = square.abs() / sigma;
            let believable = (2.0..20.0).contains(&square.abs());
            let confidence = if believable && t > 10.0 {
                Confidence::Certain
            } else if believable && t > 4.0 {
                Confidence::Likely
            } else {
                Confidence::Guess
            };
            let (front, rear) = if square > 0.0 { (a, b) } else { (b, a) };
            for (i, name) in [(front, names[0]), (rear, names[1])] {
                let more =
                    format!("{}; front or rear by the squared wheelbase of {:.1} m^2 in turns", side(i), square.abs());
                s.assign(list[i].column, role(&list[i], name, confidence, motion, &more));
            }
            if confidence == Confidence::Guess && last {
                let columns = [list[a].column, list[b].column];
                let text = format!(
                    "{} and {} are two {word} wheels; which of them is the front one cannot be told from this drive.",
                    s.label(columns[0]),
                    s.label(columns[1])
                );
                s.find(Weight::Guess, &columns, text);
            }
        } else if let [a] = wheels[..] {
            let more = format!("{}; taken for a rear one", side(a));
            s.assign(list[a].column, role(&list[a], names[1], Confidence::Guess, motion, &more));
        }
    }
    let told = !left.is_empty() && !right.is_empty();
    let mut rest: Vec<usize> = (0..list.len()).filter(|i| s.roles[list[*i].column].is_none()).collect();
    sort_by(&mut rest, |a, b| sides[*a].0.abs().total_cmp(&sides[*b].0.abs()));
    for (rank, i) in rest.into_iter().enumerate() {
        // Without turns any of them may be a wheel's.
        let confidence = match (rank, told || list.len() == 1) {
            (0, true) if list[i].follow.left < 0.1 => Confidence::Certain,
            (0, true) => Confidence::Likely,
            _ => Confidence::Guess,
        };
        if rank == 0 {
            let more = if told { "; the same in turns to both sides" } else { "" };
            s.assign(list[i].column, role(&list[i], "speed", confidence, motion, more));
        }
        if confidence == Confidence::Guess && last {
            let column = list[i].column;
            let text = format!(
                "{} follows the speed; whose it is cannot be told, since the drive turns too little.",
                s.label(column)
            );
            s.find(Weight::Guess, &[column], text);
        }
    }
}

/// Say by how much the car's speeds differ from the motion over ground.
fn scale_note(s: &mut Survey, list: &[Speed], motion: &Motion) {
    let ratios: Vec<f64> = list.iter().map(|w| w.ratio).collect();
    let ratio = crate::clock::median(ratios);
    if (ratio - 1.0).abs() < 0.004 {
        return;
    }
    let columns: Vec<usize> = list.iter().map(|w| w.column).collect();
    let text = format!(
        "the car's speeds read {:.1} % {} against {}: a scale of {:.4} would make them agree.",
        100.0 * (ratio - 1.0).abs(),
        if ratio < 1.0 { "low" } else { "high" },
        motion.label,
        1.0 / ratio
    );
    s.find(Weight::Note, &columns, text);
}
