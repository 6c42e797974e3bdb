//! Whether a mapping puts a scrambled copy right.

use drivescope_import::{Confidence, Examination, factor, signal};

use super::{Matrix, Scramble, Source, lean, product};

/// What is wrong with a mapping, and whether the wizard was certain of it.
pub struct Verdict {
    pub wrong: Vec<String>,
    pub certain_and_wrong: Vec<String>,
}

fn confidence(found: &Examination, name: &str) -> Option<Confidence> {
    found.columns.iter().find(|c| c.signal.as_deref() == Some(name)).and_then(|c| c.confidence)
}

/// The factor to SI that the mapping gives a signal.
fn mapped(found: &Examination, name: &str) -> Option<(String, f64)> {
    let source = found.mapping.signals.get(name)?;
    let si = signal(name)?.unit;
    let file = if name == "gnss_lat" || name == "gnss_lon" { "deg" } else { si };
    Some((source.column.clone(), factor(source.unit.as_deref().unwrap_or(file), si)? * source.scale))
}

/// By how much, deg, a triad is turned after the mapping; infinite where columns, unit or sense are wrong.
fn triad_error(found: &Examination, first: &str, columns: &[String; 3], raw: &Matrix) -> f64 {
    let stem = &first[..first.len() - 1];
    let channel = if stem == "mag_" { "mag" } else { "imu" };
    let mut to_housing = [[0.0; 3]; 3];
    for (axis, row) in to_housing.iter_mut().enumerate() {
        let Some((column, factor)) = mapped(found, &format!("{stem}{}", ["x", "y", "z"][axis])) else {
            return f64::INFINITY;
        };
        let Some(i) = columns.iter().position(|c| *c == column) else { return f64::INFINITY };
        row[i] = factor;
    }
    let mount = found.mapping.mounts.get(channel).copied().unwrap_or_default();
    let turn = lean([mount.roll_deg, mount.pitch_deg, mount.yaw_deg].map(f64::to_radians));
    let all = product(&turn, &product(&to_housing, raw));
    let size = (all.iter().flatten().map(|v| v * v).sum::<f64>() / 3.0).sqrt();
    if (size - 1.0).abs() > 0.01 {
        return f64::INFINITY;
    }
    let det = all[0][0] * (all[1][1] * all[2][2] - all[1][2] * all[2][1])
        - all[0][1] * (all[1][0] * all[2][2] - all[1][2] * all[2][0])
        + all[0][2] * (all[1][0] * all[2][1] - all[1][1] * all[2][0]);
    if det < 0.0 {
        return f64::INFINITY;
    }
    ((all[0][0] + all[1][1] + all[2][2] - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
}

pub fn judge(source: &Source, scramble: &Scramble, found: &Examination) -> Verdict {
    let mut v = Verdict { wrong: Vec::new(), certain_and_wrong: Vec::new() };
    for (name, (column, to_si)) in &scramble.scalars {
        let own = if *name == "t" {
            let time = &found.mapping.time;
            factor(&time.unit, "s").map(|f| (time.column.clone(), f))
        } else {
            mapped(found, name)
        };
        let good = own.as_ref().is_some_and(|(c, f)| c == column && (f / to_si - 1.0).abs() < 0.01);
        let untold = match *name {
            n if n.contains("std") || n.contains("nsat") || n.contains("pdop") || n.contains("valid") => true,
            "gnss_alt" | "baro_alt" | "gnss_vd" => source.climb < 8.0,
            n if n.starts_with("wheel") => source.sharpest_turn < 0.2,
            _ => false,
        };
        if !good && !untold {
            v.wrong.push(format!("{name}: {own:?}, not {column} {to_si:.4}"));
        }
        if !good && own.is_some() && confidence(found, name) == Some(Confidence::Certain) {
            v.certain_and_wrong.push(format!("{name}: {own:?}, not {column} {to_si:.4}"));
        }
    }
    for (first, (columns, raw)) in &scramble.triads {
        let error = triad_error(found, first, columns, raw);
        let limit = if *first == "mag_x" { 5.0 } else { 3.0 };
        let untold = *first == "mag_x" && source.heading < 60_f64.to_radians();
        let sure = ["x", "y", "z"]
            .iter()
            .all(|a| confidence(found, &format!("{}{a}", &first[..first.len() - 1])) == Some(Confidence::Certain));
        if error > limit && !untold {
            v.wrong.push(format!("{first}: turned by {error:.1} deg"));
        }
        // Certain are unit, axis and sign.
        if sure && error > 20.0 {
            v.certain_and_wrong.push(format!("{first}: turned by {error:.1} deg"));
        }
    }
    for (channel, &late) in &scramble.late {
        let there = match *channel {
            "mag" => scramble.triads.contains_key("mag_x") && source.heading > 60_f64.to_radians(),
            "steering" => scramble.scalars.contains_key("steering_wheel"),
            _ => true,
        };
        let limit = match *channel {
            "steering" => 0.12,
            "gnss" => 0.06,
            _ => 0.05,
        };
        let own = found.mapping.delays.get(channel).copied().unwrap_or(0.0);
        if there && (own - late).abs() > limit {
            v.wrong.push(format!("{channel}: late by {late:.3} s, found {own:.3}"));
        }
    }
    v
}
