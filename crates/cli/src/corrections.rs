//! Taking over what physics proposes: a mapping with the corrections of contradictions, and what was left.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use drivescope_import::{Amendment, Finding, Mapping, OpenReport, SignalSource, Weight};

use crate::log::LogArgs;
use crate::output;

/// How often a log is corrected and read anew.
const ROUNDS: usize = 3;

/// A mapping put right, and what was done to it.
struct Corrected {
    /// The mapping that the log was read with, with all corrections that were taken.
    mapping: Mapping,
    /// What was taken, in lines.
    applied: String,
    /// What was left, in lines.
    left: String,
}

/// Take over every correction of a contradiction, and with `guesses` those that are likely only (how housings lean, how late
/// sensors are). A correction of a signal that another one has changed already is left.
///
/// What the log says of columns that are read otherwise than under `first` is no contradiction any more: nothing measured is
/// against it.
fn correct(report: &OpenReport, first: &Mapping, guesses: bool) -> Corrected {
    let mut mapping = report.mapping.clone();
    let mut taken: Vec<&Amendment> = Vec::new();
    let (mut applied, mut left) = (String::new(), String::new());
    for Finding { weight, text, correction, columns } in &report.findings {
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
            None if columns.iter().any(|c| reading(&report.mapping, c) != reading(first, c)) => continue,
            None if contradicts => "no change of the mapping is proposed",
            None => continue,
        };
        let _ = writeln!(left, "left: {text} ({why})");
    }
    Corrected { mapping, applied, left }
}

/// Correct the mapping of a log until nothing more is to be applied, reading the log anew with what was, and write it: what one
/// correction puts right is contradicted no more, and what it hid is found. A log from standard input is read once.
///
/// # Errors
/// Those of reading the log and of writing the mapping; one sentence.
pub fn save(log: &LogArgs, report: &OpenReport, path: &Path, guesses: bool) -> Result<String, String> {
    let mut found = correct(report, &report.mapping, guesses);
    let mut applied = String::new();
    for _ in 0..ROUNDS {
        output::write(path, |file| writeln!(file, "{}", found.mapping.to_json()))?;
        applied += &found.applied;
        if found.applied.is_empty() || log.is_standard_input() {
            break;
        }
        let again = log.with_mapping(path).open_examined()?;
        found = correct(&again.report, &report.mapping, guesses);
    }
    if applied.is_empty() {
        applied = "applied: nothing; no correction is certain\n".into();
    }
    Ok(applied + &found.left)
}

/// The signals that come from a column, and how.
fn reading<'m>(mapping: &'m Mapping, column: &str) -> Vec<(&'m String, &'m SignalSource)> {
    mapping.signals.iter().filter(|(_, source)| source.column == column).collect()
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
