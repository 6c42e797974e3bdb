//! From what was read to a drive: names, units and physics make a mapping, the mapping a drive and a report.

use drivescope_drive::drive::Drive;

use crate::apply::apply;
use crate::candidate::Unused;
use crate::csv::read_csv;
use crate::error::ImportError;
use crate::examine::{Examination, Finding, Thinned, Weight, examine_thinned, heaviest_first, odd_columns, sketch};
use crate::load::MapReport;
use crate::mapping::{Mapping, TimeSource};
use crate::merge::{Merged, merge};
use crate::opening::Log;
use crate::propose::{Entry, Proposal, propose};
use crate::raw_gnss::{add_raw, take_raw};
use crate::report::{OpenReport, fill, frame};
use crate::settle::settle;
use crate::source::ByteSource;
use crate::table::{Table, Warning};

/// What physics found about a log, with what a table of its columns shows and what mappings are tried on.
#[derive(Clone, Debug)]
pub struct Examined {
    /// What was found.
    pub found: Examination,
    /// A small picture of every column of [`Examination::columns`]: the least and the largest value of equal parts of its
    /// rows, in turn, not a number where a part has none.
    pub pictures: Vec<Vec<f64>>,
    /// The columns, thinned.
    pub thin: Thinned,
}

impl Examined {
    fn new(table: &Table, buckets: usize) -> Result<Self, ImportError> {
        let (found, thin) = examine_thinned(table)?;
        let pictures = table.columns.iter().map(|c| sketch(&c.values, buckets)).collect();
        Ok(Self { found, pictures, thin })
    }

    /// With what was odd in the tables before they were one.
    fn with(mut self, odd: Vec<Finding>) -> Self {
        self.found.findings.extend(odd);
        heaviest_first(&mut self.found.findings);
        self
    }
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
    open_examined(table, mapping, odd, 0, EXAMINED_AT_ONCE).map(|(drive, report, _)| (drive, report))
}

/// Bytes of a file beyond which columns that their names explain are not examined while it is opened: an hour at 100 Hz would
/// take half as long again in a browser.
const EXAMINED_AT_ONCE: u64 = 24 << 20;
const NOT_EXAMINED: &str =
    "The file is large: its columns are held against physics when the table of columns is opened.";

/// The same, with what was odd in the tables that it was made of, and with what was found about it; a file of more than `most`
/// bytes that its names explain is not examined.
fn open_examined(
    table: Table,
    mapping: Option<&Mapping>,
    odd: Vec<Finding>,
    buckets: usize,
    most: u64,
) -> Result<(Drive, OpenReport, Option<Examined>), ImportError> {
    let by_name = propose(&table);
    let is_large = table.bytes > most && (mapping.is_some() || by_name.is_ok());
    let examined = if is_large { None } else { Examined::new(&table, buckets).ok() };
    let found = examined.as_ref().map(|e| &e.found);
    let is_given = mapping.is_some();
    let mut proposal = match (mapping, by_name, found) {
        (Some(mapping), ..) => given(&table, mapping),
        (None, Ok(_), Some(found)) if !found.names_believed => by_physics(found),
        (None, Ok(by_name), _) => by_name,
        (None, Err(error), Some(found)) if replaces_names(found, &error) => by_physics(found),
        (None, Err(error), _) => return Err(error),
    };
    let settled = examined.as_ref().map(|e| settle(&mut proposal, &e.found, &e.thin, is_given));
    let mut findings = settled.unwrap_or_default();
    findings.extend(odd.iter().cloned());
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
    report.is_examined = examined.is_some();
    if is_large {
        report.notes.push(NOT_EXAMINED.into());
    }
    let (drive, mapped) = apply(table, &proposal.mapping, &name)?;
    fill(&mut report, &proposal, mapped, &drive);
    Ok((drive, report, examined.map(|e| e.with(odd))))
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
pub fn open_log(log: Log, mapping: Option<&Mapping>) -> Result<(Drive, OpenReport), ImportError> {
    open_drawn(log, mapping, 0).map(|(drive, report, _)| (drive, report))
}

/// The same as [`open_log`], held against physics however large the files are.
///
/// # Errors
/// Those of [`open_log`].
pub fn open_log_whole(log: Log, mapping: Option<&Mapping>) -> Result<(Drive, OpenReport), ImportError> {
    open_up_to(log, mapping, 0, u64::MAX).map(|(drive, report, _)| (drive, report))
}

/// The same as [`open_log`], with what was found on the way, if the log was examined ([`OpenReport::is_examined`]): pictures
/// have `buckets` parts.
///
/// # Errors
/// Those of [`open_log`].
pub fn open_drawn(
    log: Log,
    mapping: Option<&Mapping>,
    buckets: usize,
) -> Result<(Drive, OpenReport, Option<Examined>), ImportError> {
    open_up_to(log, mapping, buckets, EXAMINED_AT_ONCE)
}

fn open_up_to(
    mut log: Log,
    mapping: Option<&Mapping>,
    buckets: usize,
    most: u64,
) -> Result<(Drive, OpenReport, Option<Examined>), ImportError> {
    let ranges = take_raw(&mut log.tables)?;
    if let (Some(ranges), true) = (&ranges, log.tables.is_empty()) {
        return open_raw(ranges).map(|(drive, report)| (drive, report, None));
    }
    let odd = odd_columns(&log.tables);
    let Merged { table, unused, notes } = merge(log)?;
    let (mut drive, mut report, examined) = open_examined(table, mapping, odd, buckets, most)?;
    if let Some(ranges) = ranges {
        report.notes.push(add_raw(&mut drive, &ranges, report.mapping.time.offset)?);
    }
    report.unused.extend(unused);
    report.notes.splice(0..0, notes);
    Ok((drive, report, examined))
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
/// Those of [`crate::examine`](fn@crate::examine), and [`ImportError::OutOfMemory`] where the tables do not fit into one.
pub fn examine_log(log: Log) -> Result<Examination, ImportError> {
    examine_drawn(log, 0).map(|examined| examined.found)
}

/// The same as [`examine_log`], with a small picture of every column in `buckets` parts, and the columns thinned.
///
/// # Errors
/// Those of [`examine_log`].
pub fn examine_drawn(log: Log, buckets: usize) -> Result<Examined, ImportError> {
    let odd = odd_columns(&log.tables);
    Ok(Examined::new(&merge(log)?.table, buckets)?.with(odd))
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
