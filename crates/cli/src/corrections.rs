//! Taking over what physics proposes: a mapping with the corrections of contradictions, and what was left.

use std::fmt::Write;

use drivescope_import::{Amendment, Finding, Mapping, OpenReport, Weight};

/// A mapping put right, and what was done to it.
pub struct Corrected {
    /// The mapping that the log was read with, with all corrections that were taken.
    pub mapping: Mapping,
    /// What was taken and what was left, in lines.
    pub said: String,
}

/// Take over every correction of a contradiction, and with `guesses` those that are likely only (how housings lean, how late
/// sensors are). A correction of a signal that another one has changed already is left.
pub fn correct(report: &OpenReport, guesses: bool) -> Corrected {
    let mut mapping = report.mapping.clone();
    let mut taken: Vec<&Amendment> = Vec::new();
    let (mut applied, mut left) = (String::new(), String::new());
    for Finding { weight, text, correction, .. } in &report.findings {
        let contradicts = *weight == Weight::Contradiction;
        let why = match correction.as_ref().filter(|c| !c.is_empty()) {
            Some(change) if change.is_done(&mapping) => continue,
            Some(change) if taken.iter().any(|t| overlap(t, change)) => "another correction changed the same",
            Some(change) if contradicts || guesses => {
                mapping.correct(change);
                taken.push(change);
                let _ = writeln!(applied, "applied: {text}\n{}", in_words(change));
                continue;
            }
            Some(_) => "likely, not certain: --with-guesses takes it",
            None if contradicts => "no change of the mapping is proposed",
            None => continue,
        };
        let _ = writeln!(left, "left: {text} ({why})");
    }
    if applied.is_empty() {
        applied = "applied: nothing; no correction is certain\n".into();
    }
    Corrected { mapping, said: applied + &left }
}

/// Whether two corrections change the same in different ways.
fn overlap(a: &Amendment, b: &Amendment) -> bool {
    let touches = |x: &Amendment, name: &String| x.signals.contains_key(name) || x.remove.contains(name);
    a.signals.keys().chain(&a.remove).any(|name| touches(b, name))
        || a.mounts.keys().any(|channel| b.mounts.contains_key(channel))
        || a.delays.keys().any(|channel| b.delays.contains_key(channel))
}

/// What a correction changes, a line each.
fn in_words(change: &Amendment) -> String {
    let signals = change.signals.iter().map(|(name, s)| {
        let unit = s.unit.as_ref().map_or(String::new(), |unit| format!(", {unit}"));
        let scale = if s.scale == 1.0 { String::new() } else { format!(", times {}", s.scale) };
        format!("  {name} <- {}{unit}{scale}", s.column)
    });
    let removed = change.remove.iter().map(|name| format!("  {name} is not read any more"));
    let mounts = change.mounts.iter().map(|(channel, m)| {
        format!("  {channel} mounted at roll {:.2}, pitch {:.2}, yaw {:.2} deg", m.roll_deg, m.pitch_deg, m.yaw_deg)
    });
    let delays = change.delays.iter().map(|(channel, late)| format!("  {channel} late by {late:.3} s"));
    signals.chain(removed).chain(mounts).chain(delays).collect::<Vec<_>>().join("\n")
}
