//! A mapping in use against the log and against what was found about it: contradictions in numbers, with the correction
//! of each.

use super::clash::{Clash, clashes};
use super::reading::Reading;
use super::survey::{Finding, Kind, Weight, canonical_unit, kind};
use super::thinned::Thinned;
use super::{ColumnView, Examination};
use crate::candidate::Confidence;
use crate::channels::signal;
use crate::correction::Amendment;
use crate::mapping::{Mapping, SignalSource};
use crate::units;

/// Factors of one signal that differ by less agree (log).
const SAME: f64 = 0.05;

/// What a mapping gets wrong: what contradicts itself as it reads the log, and what was found to be otherwise.
pub(crate) fn contradictions(used: &Mapping, found: &Examination, thin: &Thinned) -> Vec<Finding> {
    let (turned, mut differ) = differences(used, found);
    let mut out: Vec<Finding> =
        clashes(thin, used, &Reading::new(thin, used)).into_iter().map(|c| told(c, used)).collect();
    let mut other = Vec::new();
    for triad in [Kind::Accel, Kind::Gyro, Kind::Mag] {
        let of_kind: Vec<_> = turned.iter().filter(|(_, name)| kind(name) == triad).copied().collect();
        if !of_kind.is_empty() {
            other.push(axes(&of_kind, triad, found));
        }
    }
    let single = turned.iter().filter(|(_, name)| !matches!(kind(name), Kind::Accel | Kind::Gyro | Kind::Mag));
    other.extend(single.map(|(view, name)| self::other(view, name, found)));
    // Axes that are exchanged, and units that the file itself states wrongly, explain what contradicts them.
    let stated = found.findings.iter().filter(|f| f.weight == Weight::Contradiction && f.correction.is_some());
    let explained = |f: &Finding, by: &Finding| f.columns.iter().all(|c| by.columns.contains(c));
    out.retain(|f| !other.iter().chain(stated.clone()).any(|by| explained(f, by)));
    differ.retain(|f| !out.iter().any(|by| explained(f, by)));
    out.extend(differ);
    out.extend(other);
    out
}

/// Columns that are another signal than the mapping says, with what it says, and those with another sign or unit.
fn differences<'a>(used: &'a Mapping, found: &'a Examination) -> (Vec<(&'a ColumnView, &'a str)>, Vec<Finding>) {
    let (mut turned, mut differ) = (Vec::new(), Vec::new());
    let sure = |v: &&ColumnView| !v.by_name && v.confidence.is_some_and(|c| c >= Confidence::Likely);
    for view in found.columns.iter().filter(sure) {
        let Some(own) = view.signal.as_deref().filter(|s| *s != "t" && kind(s) != Kind::Place) else { continue };
        let Some((name, source)) = used.signals.iter().find(|(_, s)| s.column == view.column) else { continue };
        if name != own {
            turned.push((view, name.as_str()));
        } else {
            differ.extend(factor(view, own, source, found));
        }
    }
    (turned, differ)
}

/// What contradicts itself, with what puts it right.
fn told(clash: Clash, used: &Mapping) -> Finding {
    let mut correction = Amendment::default();
    for c in &clash.corrections {
        if let Some(source) = used.signals.get(&c.signal) {
            correction.signals.insert(c.signal.clone(), c.of(source));
        }
    }
    let correction = Some(correction).filter(|c| !c.is_empty());
    Finding { weight: Weight::Contradiction, columns: clash.columns, text: clash.text, correction }
}

/// Raw value to SI under a source.
fn to_si(name: &str, source: &SignalSource) -> Option<f64> {
    let unit = source.unit.as_deref().unwrap_or(canonical_unit(name));
    Some(units::factor(unit, signal(name)?.unit)? * source.scale)
}

fn correct(found: &Examination, names: &[&str], remove: &[&str]) -> Option<Amendment> {
    let mut out = Amendment::default();
    for name in names {
        if let Some(source) = found.mapping.signals.get(name) {
            out.signals.insert((*name).to_owned(), source.clone());
        }
    }
    out.remove = remove.iter().filter(|r| !names.contains(r)).map(|r| (*r).to_owned()).collect();
    Some(out).filter(|c| !c.is_empty())
}

/// The same signal with another sign, unit or scale.
fn factor(view: &ColumnView, name: &str, source: &SignalSource, found: &Examination) -> Option<Finding> {
    let (now, own) = (to_si(name, source)?, to_si(name, found.mapping.signals.get(name)?)?);
    let ratio = own / now;
    let column = &view.column;
    let what = format!("what it should go with: {}", view.why);
    let text = if ratio < 0.0 {
        format!("`{column}` as {name} has the opposite sign of {what}.")
    } else if ratio.ln().abs() > SAME {
        let unit = view.unit.as_deref().unwrap_or("1");
        format!(
            "`{column}` as {name} has another unit or scale than {what}: its values are {unit}, {ratio:.4} times what the mapping makes of them."
        )
    } else {
        return None;
    };
    let correction = correct(found, &[name], &[]);
    Some(Finding { weight: Weight::Contradiction, columns: vec![column.clone()], text, correction })
}

/// Columns of a triad that do not lie where their names say.
fn axes(turned: &[(&ColumnView, &str)], triad: Kind, found: &Examination) -> Finding {
    let all: Vec<&ColumnView> =
        found.columns.iter().filter(|v| v.signal.as_deref().is_some_and(|s| kind(s) == triad)).collect();
    let lies = |v: &&ColumnView| {
        let sign = if v.scale < 0.0 { "-" } else { "+" };
        let doubt = if v.confidence == Some(Confidence::Guess) { " (a guess)" } else { "" };
        format!("{} is {sign}`{}`{doubt}", v.signal.as_deref().unwrap_or(""), v.column)
    };
    let whys: Vec<String> = turned.iter().map(|(v, name)| format!("`{}` is no {name}: {}", v.column, v.why)).collect();
    let text = format!(
        "the sensor sits otherwise than its names say: {}; {}.",
        all.iter().map(lies).collect::<Vec<_>>().join(", "),
        whys.join("; ")
    );
    let names: Vec<&str> = all.iter().filter_map(|v| v.signal.as_deref()).collect();
    let removed: Vec<&str> = turned.iter().map(|t| t.1).collect();
    let columns = all.iter().map(|v| v.column.clone()).collect();
    Finding { weight: Weight::Contradiction, columns, text, correction: correct(found, &names, &removed) }
}

/// A column that is another signal than its name says.
fn other(view: &ColumnView, name: &str, found: &Examination) -> Finding {
    let own = view.signal.as_deref().unwrap_or("");
    let text = format!("`{}` is called {name}, but measures {own}: {}.", view.column, view.why);
    let correction = correct(found, &[own], &[name]);
    Finding { weight: Weight::Contradiction, columns: vec![view.column.clone()], text, correction }
}
