//! What was found in a file, in a form that the page and the command line show.

use drivescope_drive::drive::{Drive, Signal};
use serde::Serialize;

use crate::apply::{ChannelReport, MapReport, apply};
use crate::clock::epoch_text;
use crate::csv::read_csv;
use crate::error::ImportError;
use crate::examine::{Examination, Finding, Thinned, Weight, examine, heaviest_first, odd_columns, sketch};
use crate::mapping::{Mapping, TimeSource};
use crate::merge::{Merged, merge};
use crate::names::signal;
use crate::opening::Log;
use crate::propose::{Confidence, Entry, Proposal, Unused, propose};
use crate::raw_gnss::{add_raw, take_raw};
use crate::settle::settle;
use crate::source::ByteSource;
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

/// Read a source as CSV and make a drive of it: under `mapping`, or under the one that is proposed.
///
/// # Errors
/// The first thing that is wrong, as one sentence.
pub fn open_csv(
    source: &mut dyn ByteSource,
    name: &str,
    mapping: Option<&Mapping>,
) -> Result<(Drive, OpenReport), ImportError> {
    open_table(read_csv(source, name)?, mapping)
}

/// Make a drive of a table: under `mapping`, or under the one that is proposed.
///
/// # Errors
/// Those of [`propose`] and [`apply`].
pub fn open_table(table: Table, mapping: Option<&Mapping>) -> Result<(Drive, OpenReport), ImportError> {
    let odd = odd_columns(std::slice::from_ref(&table));
    open_examined(table, mapping, odd)
}

/// Bytes of a file beyond which columns that their names explain are not examined while it is opened: an hour at 100 Hz would
/// take half as long again in a browser.
const EXAMINED_AT_ONCE: u64 = 24 << 20;
const NOT_EXAMINED: &str =
    "The file is large: its columns are held against physics when the table of columns is opened.";

/// The same, with what was odd in the tables that it was made of.
fn open_examined(
    table: Table,
    mapping: Option<&Mapping>,
    odd: Vec<Finding>,
) -> Result<(Drive, OpenReport), ImportError> {
    let by_name = propose(&table);
    let is_large = table.bytes > EXAMINED_AT_ONCE && (mapping.is_some() || by_name.is_ok());
    let examined = if is_large { None } else { examine(&table).ok() };
    let mut proposal = match (mapping, by_name, &examined) {
        (Some(mapping), ..) => given(&table, mapping),
        (None, Ok(_), Some(found)) if !found.names_believed => by_physics(found),
        (None, Ok(by_name), _) => by_name,
        (None, Err(error), Some(found)) if replaces_names(found, &error) => by_physics(found),
        (None, Err(error), _) => return Err(error),
    };
    let mut findings = examined.map_or(Vec::new(), |found| settle(&mut proposal, found, mapping.is_some()));
    findings.extend(odd);
    heaviest_first(&mut findings);
    let name = table.name.clone();
    let mut report = frame(&table, &proposal);
    let contradicts = findings.iter().filter(|f| f.weight == Weight::Contradiction);
    report.warnings.extend(contradicts.map(|f| Warning {
        message: f.text.clone(),
        column: f.columns.first().cloned(),
        row: None,
        count: 1,
    }));
    report.findings = findings;
    if is_large {
        report.notes.push(NOT_EXAMINED.into());
    }
    let (drive, mapped) = apply(table, &proposal.mapping, &name)?;
    fill(&mut report, &proposal, mapped, &drive);
    Ok((drive, report))
}

/// Make a drive of raw satellite ranges alone.
///
/// # Errors
/// Those of [`raw_gnss`](crate::raw_gnss()).
pub fn open_raw(table: &Table) -> Result<(Drive, OpenReport), ImportError> {
    let raw_gnss = crate::raw_gnss(table, 0.0)?;
    let mapping = Mapping::of(TimeSource::plain("t", "s"));
    let proposal = Proposal { mapping, entries: Vec::new(), unused: Vec::new(), notes: Vec::new() };
    let mut report = frame(table, &proposal);
    let drive = Drive { name: table.name.clone(), raw_gnss, ..Drive::default() };
    fill(&mut report, &proposal, MapReport::default(), &drive);
    Ok((drive, report))
}

/// Make a drive of everything that was read from one or several files: under `mapping`, or under the one proposed. A
/// table of raw satellite ranges among them is that of the drive, and a drive alone.
///
/// # Errors
/// Those of [`open_table`] and of [`raw_gnss`](crate::raw_gnss), and [`ImportError::OutOfMemory`] where the tables do not
/// fit into one. Files that are no parts of one drive are [`ImportError::Nothing`].
pub fn open_log(mut log: Log, mapping: Option<&Mapping>) -> Result<(Drive, OpenReport), ImportError> {
    let ranges = take_raw(&mut log.tables)?;
    if let (Some(ranges), true) = (&ranges, log.tables.is_empty()) {
        return open_raw(ranges);
    }
    let odd = odd_columns(&log.tables);
    let Merged { table, unused, notes } = merge(log)?;
    let (mut drive, mut report) = open_examined(table, mapping, odd)?;
    if let Some(ranges) = ranges {
        report.notes.push(add_raw(&mut drive, &ranges, report.mapping.time.offset)?);
    }
    report.unused.extend(unused);
    report.notes.splice(0..0, notes);
    Ok((drive, report))
}

/// Whether an examination can stand in for names that led to an error: where they told nothing, and where the clock steps
/// back, which is put right by leaving rows out, if no column with a known name is lost for it.
fn replaces_names(found: &Examination, error: &ImportError) -> bool {
    match error {
        ImportError::NoSignals { .. } | ImportError::NoTime { .. } => true,
        ImportError::TimeBackwards { .. } => found.columns.iter().all(|c| c.name_says.is_none() || c.signal.is_some()),
        _ => false,
    }
}

/// Where names explain nothing: what physics says, with every entry's reason.
fn by_physics(found: &Examination) -> Proposal {
    let entries = found.columns.iter().filter_map(|c| {
        let (signal, confidence) = (c.signal.clone()?, c.confidence?);
        Some(Entry { signal, column: c.column.clone(), why: c.why.clone(), confidence })
    });
    let unused = found.columns.iter().filter(|c| c.signal.is_none());
    let unused = unused.map(|c| Unused { column: c.column.clone(), reason: c.why.clone() }).collect();
    let said = found.findings.iter().filter(|f| f.weight < Weight::Contradiction);
    let notes = said.map(|f| f.text.clone()).collect();
    Proposal { entries: entries.collect(), mapping: found.mapping.clone(), unused, notes }
}

/// Examine everything that was read from one or several files, as [`open_log`] puts it together.
///
/// # Errors
/// Those of [`examine`], and [`ImportError::OutOfMemory`] where the tables do not fit into one.
pub fn examine_log(log: Log) -> Result<Examination, ImportError> {
    let odd = odd_columns(&log.tables);
    let mut found = examine(&merge(log)?.table)?;
    found.findings.extend(odd);
    heaviest_first(&mut found.findings);
    Ok(found)
}

/// The same as [`examine_log`], with a small picture of every column of numbers in the order of
/// [`Examination::columns`] (the least and the largest value of each of `buckets` equal parts of its rows, in turn, not a
/// number where a part has none), and the columns thinned for trying mappings on them.
///
/// # Errors
/// Those of [`examine_log`].
pub fn examine_drawn(log: Log, buckets: usize) -> Result<(Examination, Vec<Vec<f64>>, Thinned), ImportError> {
    let odd = odd_columns(&log.tables);
    let table = merge(log)?.table;
    let mut found = examine(&table)?;
    found.findings.extend(odd);
    heaviest_first(&mut found.findings);
    let thin = Thinned::new(&table, &found.mapping.time)?;
    Ok((found, table.columns.iter().map(|c| sketch(&c.values, buckets)).collect(), thin))
}

/// The reasons of a mapping that a person gave.
fn given(table: &Table, mapping: &Mapping) -> Proposal {
    let is_used = |name: &str| {
        let time = &mapping.time;
        time.column == name
            || time.fraction.as_ref().is_some_and(|f| f.column == name)
            || mapping.signals.values().any(|s| s.column == name)
    };
    let unused = table.columns.iter().filter(|c| !is_used(&c.name));
    let unused = unused.map(|c| Unused { column: c.name.clone(), reason: "not in the mapping".into() });
    let text = table.text_columns.iter();
    let text = text.map(|t| Unused { column: t.name.clone(), reason: format!("holds text such as `{}`", t.example) });
    Proposal { mapping: mapping.clone(), entries: Vec::new(), unused: unused.chain(text).collect(), notes: Vec::new() }
}

/// What is known before the columns are handed over.
fn frame(table: &Table, proposal: &Proposal) -> OpenReport {
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
        missing: Vec::new(),
        mapping: proposal.mapping.clone(),
    }
}

fn fill(report: &mut OpenReport, proposal: &Proposal, mapped: MapReport, drive: &Drive) {
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
