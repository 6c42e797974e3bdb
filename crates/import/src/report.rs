//! What was found in a file, in a form that the page and the command line show.

use drivescope_drive::drive::{Drive, Signal};
use serde::Serialize;

use crate::candidate::{Confidence, Unused};
use crate::channels::signal;
use crate::clock::epoch_text;
use crate::examine::Finding;
use crate::load::{ChannelReport, MapReport};
use crate::mapping::Mapping;
use crate::propose::Proposal;
use crate::table::{Layout, Table, Warning};

/// Everything that was found while a file was opened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OpenReport {
    /// File name.
    pub name: String,
    /// Bytes read.
    pub bytes: u64,
    /// Rows of data.
    pub rows: usize,
    /// First instant, s.
    pub start: f64,
    /// From the first to the last instant, s.
    pub duration: f64,
    /// What time counts from, if the file says so (ISO 8601).
    pub epoch: Option<String>,
    /// How the file is laid out.
    pub layout: Layout,
    /// Channels with their rates.
    pub channels: Vec<ChannelReport>,
    /// Columns used.
    pub used: Vec<UsedSignal>,
    /// Columns not used.
    pub unused: Vec<Unused>,
    /// Every guess and every doubt, in words.
    pub notes: Vec<String>,
    /// What was passed over or looks wrong.
    pub warnings: Vec<Warning>,
    /// What physics found, contradictions first, with what each would change in the mapping.
    pub findings: Vec<Finding>,
    /// Whether the columns were held against physics: those of large files are only when someone asks.
    pub is_examined: bool,
    /// Signals that estimators may want and the file does not have.
    pub missing: Vec<Missing>,
    /// The mapping that was used, for saving.
    pub mapping: Mapping,
}

/// A column that was used.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UsedSignal {
    /// Canonical name; `t` for the clock.
    pub signal: String,
    /// Raw column.
    pub column: String,
    /// What was done to its values: `g -> m/s^2 (x 9.80665)`.
    pub conversion: String,
    /// Why it was taken for this signal.
    pub why: String,
    /// How sure that is.
    pub confidence: Confidence,
    /// Number of rows with a value.
    pub values: usize,
}

/// A signal that the file does not have.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Missing {
    /// The signal.
    pub signal: Signal,
    /// Its name for people.
    pub label: &'static str,
}

/// What is known before the columns are handed over.
pub(crate) fn frame(table: &Table, proposal: &Proposal) -> OpenReport {
    let clock = table.column(&proposal.mapping.time.column);
    OpenReport {
        name: table.name.clone(),
        bytes: table.bytes,
        rows: table.rows,
        start: f64::NAN,
        duration: 0.0,
        epoch: clock.and_then(|c| c.epoch).map(epoch_text),
        layout: table.layout.clone(),
        channels: Vec::new(),
        used: Vec::new(),
        unused: proposal.unused.clone(),
        notes: proposal.notes.clone(),
        warnings: table.warnings.clone(),
        findings: Vec::new(),
        is_examined: false,
        missing: Vec::new(),
        mapping: proposal.mapping.clone(),
    }
}

/// What is known once they are.
pub(crate) fn fill(report: &mut OpenReport, proposal: &Proposal, mapped: MapReport, drive: &Drive) {
    let (start, end) = drive.span().unwrap_or((f64::NAN, f64::NAN));
    (report.start, report.duration) = (start, end - start);
    let entry = |signal: &str| proposal.entries.iter().find(|e| e.signal == signal);
    let why = |signal: &str| entry(signal).map_or("given by the mapping".to_owned(), |e| e.why.clone());
    let confidence = |signal: &str| entry(signal).map_or(Confidence::Certain, |e| e.confidence);
    report.used.push(UsedSignal {
        signal: "t".into(),
        column: proposal.mapping.time.column.clone(),
        conversion: format!("{} -> s", proposal.mapping.time.unit),
        why: why("t"),
        confidence: confidence("t"),
        values: report.rows,
    });
    for used in mapped.used {
        report.used.push(UsedSignal {
            conversion: conversion(&used.signal, &used.unit, used.factor, used.offset),
            why: why(&used.signal),
            confidence: confidence(&used.signal),
            signal: used.signal,
            column: used.column,
            values: used.values,
        });
    }
    report.channels = mapped.channels;
    report.warnings.extend(mapped.warnings);
    let missing = ALL_SIGNALS.into_iter().filter(|s| !drive.has(*s));
    report.missing = missing.map(|signal| Missing { signal, label: signal.label() }).collect();
}

/// `g -> m/s^2 (x 9.80665)`, or `as it is`.
fn conversion(name: &str, unit: &str, factor: f64, offset: f64) -> String {
    if factor == 1.0 && offset == 0.0 {
        return format!("as it is, {unit}");
    }
    let si = match signal(name) {
        Some(c) if c.unit == "deg" => "rad",
        Some(c) => c.unit,
        None => "1",
    };
    let added = if offset == 0.0 { String::new() } else { format!(", then {offset:+}") };
    format!("{unit} -> {si} (x {factor:.6}{added})")
}

const ALL_SIGNALS: [Signal; 15] = [
    Signal::AccelX,
    Signal::AccelY,
    Signal::AccelZ,
    Signal::GyroX,
    Signal::GyroY,
    Signal::GyroZ,
    Signal::Mag,
    Signal::ForwardSpeed,
    Signal::Steer,
    Signal::GnssPosition,
    Signal::GnssVelocity,
    Signal::GnssCourse,
    Signal::GnssVerticalVelocity,
    Signal::BaroAltitude,
    Signal::AccelArray,
];
