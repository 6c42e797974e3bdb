//! What `info` and `list` print.

use std::fmt::Write;

use drivescope_drive::channel::{Column, Record};
use drivescope_drive::csv::file_unit;
use drivescope_drive::param::{Kind, ParamSpec};
use drivescope_drive::signals::{AccelArray, Baro, Gnss, Imu, Mag, Range, Steering, Wheels};
use drivescope_drive::truth::TRUTH_COLUMNS;
use drivescope_drive::vehicle::PRESETS;
use drivescope_estimation::registry::ESTIMATORS;
use drivescope_import::{Confidence, OpenReport};
use serde_json::{Value, json};

use crate::log::Opened;

fn pretty(value: &Value) -> String {
    format!("{value:#}")
}

/// Estimators with needs and columns.
pub fn estimators(as_json: bool) -> String {
    if as_json {
        return pretty(&json!(ESTIMATORS));
    }
    let mut text = String::new();
    for e in ESTIMATORS {
        let _ = writeln!(text, "{}: {}\n  {}", e.name, e.title, e.doc);
        for need in e.needs {
            let kind = if need.required { "needs" } else { "takes" };
            let _ = writeln!(text, "  {kind} {}: {}", need.signal.label(), need.why);
        }
        let columns: Vec<&str> = e.columns.iter().map(|c| c.name).collect();
        let _ = writeln!(text, "  columns: {}", columns.join(", "));
    }
    text
}

/// Built-in drives.
pub fn drives(as_json: bool) -> String {
    let drives = drivescope_simulation::drives();
    if as_json {
        let list: Vec<Value> = drives
            .iter()
            .map(|d| json!({"name": d.name, "title": d.title, "doc": d.doc, "duration_s": d.duration_hint}))
            .collect();
        return pretty(&json!(list));
    }
    drives.iter().fold(String::new(), |text, d| {
        format!("{text}{}: {} ({:.0} s)\n  {}\n", d.name, d.title, d.duration_hint, d.doc)
    })
}

/// Canonical signals of files.
pub fn signals(as_json: bool) -> String {
    let measured = [
        Imu::COLUMNS,
        Mag::COLUMNS,
        Wheels::COLUMNS,
        Steering::COLUMNS,
        Gnss::COLUMNS,
        Baro::COLUMNS,
        AccelArray::COLUMNS,
        Range::COLUMNS,
    ];
    let measured = measured.into_iter().flatten().map(|c| (c.name.to_string(), c));
    let truth = TRUTH_COLUMNS.iter().map(|c| (format!("truth_{}", c.name), c));
    let all: Vec<(String, &Column)> = measured.chain(truth).collect();
    if as_json {
        let list: Vec<Value> =
            all.iter().map(|(n, c)| json!({"name": n, "unit": file_unit(n, c.unit), "doc": c.doc})).collect();
        return pretty(&json!(list));
    }
    all.iter()
        .fold("t [s]: Time.\n".into(), |text, (n, c)| format!("{text}{n} [{}]: {}\n", file_unit(n, c.unit), c.doc))
}

/// Parameters of every estimator.
pub fn params(as_json: bool) -> String {
    if as_json {
        let entries = ESTIMATORS.iter().map(|e| (e.name.to_string(), json!(e.params)));
        return pretty(&Value::Object(entries.collect()));
    }
    let mut text = String::new();
    for e in ESTIMATORS {
        let _ = writeln!(text, "{}", e.name);
        for p in e.params {
            let _ = writeln!(text, "  {}", param_line(p));
        }
    }
    text
}

fn param_line(p: &ParamSpec) -> String {
    let symbol = if p.symbol.is_empty() { String::new() } else { format!(" ({})", p.symbol) };
    let values = match p.kind {
        Kind::Number { default, min, max, .. } => format!("{default} {} in {min}..={max}", p.unit),
        Kind::Optional { min, max } => format!("none, or {} in {min}..={max}", p.unit),
        Kind::Toggle { default } => format!("{default}"),
        Kind::Choice { default, options } => format!("{default} of {}", options.join(", ")),
    };
    format!("{}{symbol} = {values}: {} [{}]", p.name, p.doc, p.source)
}

/// Named cars.
pub fn vehicles(as_json: bool) -> String {
    if as_json {
        let list: Vec<Value> = PRESETS.iter().map(|p| json!({"name": p.name, "doc": p.doc})).collect();
        return pretty(&json!(list));
    }
    PRESETS.iter().fold(String::new(), |text, p| format!("{text}{}: {}\n", p.name, p.doc))
}

/// Which estimators can run, and what the others lack.
fn runnable(opened: &Opened) -> Vec<(&'static str, Vec<String>)> {
    let drive = &opened.drive;
    ESTIMATORS
        .iter()
        .map(|e| {
            let missing = e.missing(drive).filter(|n| n.required);
            (e.name, missing.map(|n| format!("{}: {}", n.signal.label(), n.why)).collect())
        })
        .collect()
}

/// What a log holds, as JSON.
pub fn info_json(opened: &Opened) -> String {
    let span = opened.drive.span();
    let channels: Vec<Value> = (opened.drive.channel_summaries().into_iter())
        .map(|c| json!({"name": c.name, "rows": c.rows, "rate_hz": c.rate, "columns": c.columns}))
        .collect();
    let estimators: Vec<Value> = (runnable(opened).into_iter())
        .map(|(name, missing)| json!({"name": name, "runnable": missing.is_empty(), "missing": missing}))
        .collect();
    pretty(&json!({
        "name": opened.drive.name, "start": span.map(|s| s.0), "end": span.map(|s| s.1), "channels": channels, "report": opened.report, "estimators": estimators,
    }))
}

/// How the columns were read, what was passed over and what looks wrong.
fn reading(text: &mut String, report: &OpenReport) {
    for used in &report.used {
        let sure = match used.confidence {
            Confidence::Guess => "a guess",
            Confidence::Likely => "likely",
            Confidence::Certain => "certain",
        };
        let _ = writeln!(text, "  {} <- {} ({}; {sure}): {}", used.signal, used.column, used.conversion, used.why);
    }
    for unused in &report.unused {
        let _ = writeln!(text, "  not used: {}: {}", unused.column, unused.reason);
    }
    for note in &report.notes {
        let _ = writeln!(text, "note: {note}");
    }
    for warning in &report.warnings {
        let _ = writeln!(text, "warning: {}", warning.message);
    }
    let is_said =
        |sentence: &String| report.notes.contains(sentence) || report.warnings.iter().any(|w| w.message == *sentence);
    for found in report.findings.iter().filter(|f| !is_said(&f.text)) {
        let _ = writeln!(text, "found: {}", found.text);
    }
}

/// What a log holds, in words.
pub fn info_text(opened: &Opened) -> String {
    let mut text = String::new();
    let (start, end) = opened.drive.span().unwrap_or((0.0, 0.0));
    let _ = writeln!(text, "{}: {:.1} s, from {start:.3} to {end:.3} s", opened.drive.name, end - start);
    for c in opened.drive.channel_summaries() {
        let _ = writeln!(text, "  {}: {} samples at {:.1} Hz: {}", c.name, c.rows, c.rate, c.columns.join(", "));
    }
    let truth: Vec<&str> = opened.drive.truth.schema().iter().map(|c| c.name).collect();
    if !truth.is_empty() {
        let _ = writeln!(text, "  truth: {} samples: {}", opened.drive.truth.len(), truth.join(", "));
    }
    reading(&mut text, &opened.report);
    for (name, missing) in runnable(opened) {
        let verdict =
            if missing.is_empty() { "can run".into() } else { format!("cannot run; it lacks {}", missing.join("; ")) };
        let _ = writeln!(text, "{name} {verdict}");
    }
    text
}
