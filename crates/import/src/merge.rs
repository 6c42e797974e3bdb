//! Tables of one drive made one: consecutive parts are joined, different sensors are merged on time.

use crate::candidate::Unused;
use crate::clock;
use crate::error::ImportError;
use crate::names::{self, time_name};
use crate::opening::Log;
use crate::order::sort_by;
use crate::pairing::{gather_fixes, pair_inertial};
use crate::register::Named;
use crate::table::{RawColumn, Table, TimeEpoch, Warning};

/// Seconds between 2001 and 2096: such a time is one since 1970.
const UNIX: std::ops::Range<f64> = 1e9..4e9;
const DAY: f64 = 86_400.0;

/// Everything of a log over one clock, and what that cost.
#[derive(Debug)]
pub(crate) struct Merged {
    pub table: Table,
    /// Columns that no name or format explains.
    pub unused: Vec<Unused>,
    /// What was assumed.
    pub notes: Vec<String>,
}

/// What the times of a part count from, ns since 1970 (`Day`: since midnight).
#[derive(Clone, Copy, Debug, PartialEq)]
enum Base {
    Absolute(i64),
    Day(i64),
    Unknown,
}

const SECOND: i64 = 1_000_000_000;

/// Seconds from one instant to another, without the rounding of either.
fn seconds(from: i64, to: i64) -> f64 {
    to.saturating_sub(from) as f64 / 1e9
}

/// A table with its times.
#[derive(Debug)]
pub(crate) struct Part {
    pub table: Table,
    pub time: Vec<f64>,
    base: Base,
}

impl Part {
    fn new(table: Table) -> Result<Self, Box<(Table, ImportError)>> {
        let read = clock::propose(&table).and_then(|c| Ok((clock::times(&table, &c.source)?, c.source)));
        let (time, source) = match read {
            Ok(found) => found,
            Err(error) => return Err(Box::new((table, error))),
        };
        let epoch = table.column(&source.column).and_then(|c| c.epoch);
        let gps = crate::gps_time::of(&table, &source).and_then(|gps| gps.zero);
        let first = time.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0);
        let base = match (epoch, gps) {
            (Some(TimeEpoch::Instant(ns)), _) => Base::Absolute(ns),
            (Some(TimeEpoch::Midnight(ns)), _) => Base::Day(ns),
            (None, Some(zero)) => Base::Absolute((zero as i64).saturating_mul(SECOND)),
            (None, None) if UNIX.contains(&first) => Base::Absolute(0),
            (None, None) => Base::Unknown,
        };
        Ok(Self { table, time, base })
    }

    fn ends(&self) -> (f64, f64) {
        let finite = || self.time.iter().copied().filter(|t| t.is_finite());
        (finite().next().unwrap_or(f64::NAN), finite().next_back().unwrap_or(f64::NAN))
    }

    fn shift(&mut self, seconds: f64) {
        if seconds != 0.0 {
            self.time.iter_mut().for_each(|t| *t += seconds);
        }
    }

    /// What a consecutive part of the same recording has in common with this one.
    fn schema(&self) -> (&str, Vec<&str>) {
        (&self.table.part, self.table.columns.iter().map(|c| c.name.as_str()).collect())
    }

    pub fn label(&self) -> String {
        let Table { name, part, .. } = &self.table;
        if part.is_empty() { name.clone() } else { format!("{name}, {part}") }
    }

    pub fn is_clock(column: &RawColumn) -> bool {
        column.meaning.is_none() && (column.epoch.is_some() || time_name(&column.name).is_some())
    }

    /// The signals of a column.
    pub fn signals(column: &RawColumn) -> Vec<String> {
        match column.meaning {
            Some(m) => vec![m.signal.to_owned()],
            None => names::matches(&column.name).into_iter().map(|m| m.signal).collect(),
        }
    }

    pub fn has(&self, signal: &str) -> bool {
        self.table.columns.iter().any(|c| !Self::is_clock(c) && Self::signals(c).iter().any(|s| s == signal))
    }
}

/// Make one table of all.
///
/// # Errors
/// The first of the tables' own errors if no table has a clock; [`ImportError::OutOfMemory`].
pub(crate) fn merge(log: Log) -> Result<Merged, ImportError> {
    let Log { mut tables, mut warnings, mut notes, bytes } = log;
    if tables.len() == 1 {
        let mut table = tables.remove(0);
        table.bytes = table.bytes.max(bytes);
        table.warnings.append(&mut warnings);
        return Ok(Merged { table, unused: Vec::new(), notes });
    }
    let mut parts = timed(tables, &mut warnings)?;
    one_drive(&parts)?;
    let epoch = align(&mut parts, &mut notes);
    let name = file_names(&parts);
    let mut parts = join(parts, &mut notes);
    pair_inertial(&mut parts, &mut notes);
    gather_fixes(&mut parts, &mut notes);
    warnings.extend(parts.iter_mut().flat_map(|p| std::mem::take(&mut p.table.warnings)));
    let (mut table, unused) = wide(parts, &name, &mut warnings)?;
    if let Some(clock) = table.columns.first_mut() {
        clock.epoch = epoch;
    }
    (table.bytes, table.warnings) = (bytes, warnings);
    Ok(Merged { table, unused, notes })
}

/// The tables that have a clock.
fn timed(tables: Vec<Table>, warnings: &mut Vec<Warning>) -> Result<Vec<Part>, ImportError> {
    let mut parts = Vec::new();
    let mut left_out = Vec::new();
    let mut failure = None;
    for table in tables {
        match Part::new(table) {
            Ok(part) => parts.push(part),
            Err(failed) => {
                let (table, error) = *failed;
                if matches!(error, ImportError::TimeBackwards { .. }) {
                    return Err(error);
                }
                left_out.push(if table.part.is_empty() { table.name } else { table.part });
                failure.get_or_insert(error);
            }
        }
    }
    if let (true, Some(error)) = (parts.is_empty(), failure) {
        return Err(error);
    }
    if !left_out.is_empty() {
        let names = crate::error::name_list(left_out.iter().map(String::as_str));
        let message = format!("tables without a clock or with fewer than 2 times left out: {names}.");
        warnings.push(Warning { message, column: None, row: None, count: left_out.len() });
    }
    Ok(parts)
}

/// Refuse files that are days apart: they are several drives.
fn one_drive(parts: &[Part]) -> Result<(), ImportError> {
    let span = |p: &Part| match p.base {
        Base::Absolute(base) => Some((base as f64 / 1e9 + p.ends().0, base as f64 / 1e9 + p.ends().1)),
        _ => None,
    };
    let spans: Vec<(f64, f64, &str)> =
        parts.iter().filter_map(|p| span(p).map(|(start, end)| (start, end, p.table.name.as_str()))).collect();
    for later in &spans {
        let before = spans.iter().filter(|s| s.0 < later.0).max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((_, end, name)) = before.filter(|s| later.0 - s.1 > DAY && s.2 != later.2) else { continue };
        let days = (later.0 - end) / DAY;
        let sentence = format!(
            "{} begins {days:.1} days after the end of {name}: expected files of one drive; open them one after the other.",
            later.2
        );
        return Err(ImportError::Nothing { sentence });
    }
    Ok(())
}

/// Put all times on one clock; what it counts from, if that is known.
fn align(parts: &mut [Part], notes: &mut Vec<String>) -> Option<TimeEpoch> {
    let absolute = |p: &Part| match p.base {
        Base::Absolute(base) => Some(base.saturating_add((p.ends().0 * 1e9) as i64)),
        _ => None,
    };
    if let Some(start) = parts.iter().filter_map(absolute).min() {
        // A whole second, so that clocks shifted by it lose nothing that they had.
        let zero = start.div_euclid(SECOND).saturating_mul(SECOND);
        for part in parts.iter_mut() {
            match part.base {
                Base::Absolute(base) => part.shift(seconds(zero, base)),
                Base::Day(of_day) => {
                    let behind = seconds(of_day, zero) - part.ends().0;
                    part.shift((behind / DAY).round() * DAY - seconds(of_day, zero));
                }
                Base::Unknown => {
                    let first = part.ends().0;
                    part.shift(seconds(zero, start) - first);
                    let text = "its clock counts from an unknown start, which is taken as the start of the other files";
                    notes.push(format!("{}: {text}.", part.label()));
                }
            }
        }
        return Some(TimeEpoch::Instant(zero));
    }
    let midnight = |p: &Part| match p.base {
        Base::Day(base) => Some(base),
        _ => None,
    };
    let first = parts.iter().filter_map(midnight).min()?;
    for part in parts.iter_mut() {
        part.shift(midnight(part).map_or(0.0, |base| seconds(first, base)));
    }
    Some(TimeEpoch::Midnight(first))
}

/// Join the parts of one recording that follow each other.
fn join(parts: Vec<Part>, notes: &mut Vec<String>) -> Vec<Part> {
    let mut joined: Vec<Part> = Vec::new();
    // The kinds of tables keep the order in which they came; the parts of a kind go by time.
    let kind = |p: &Part| parts.iter().position(|q| q.schema() == p.schema()).unwrap_or(0);
    let mut index: Vec<(usize, f64, usize)> = parts.iter().enumerate().map(|(i, p)| (kind(p), p.ends().0, i)).collect();
    sort_by(&mut index, |a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut slots: Vec<Option<Part>> = parts.into_iter().map(Some).collect();
    for (_, _, i) in index {
        let Some(mut part) = slots[i].take() else { continue };
        let Some(before) = joined.iter_mut().rev().find(|p| p.schema() == part.schema()) else {
            joined.push(part);
            continue;
        };
        let (start, end) = (part.ends().0, before.ends().1);
        let elsewhere = before.table.name != part.table.name;
        if start <= end && elsewhere && part.base == Base::Unknown && before.base == Base::Unknown {
            let step = clock::median_step(&part.time).max(0.0);
            part.shift(end + step - start);
            let text = "has the columns of the file before and begins at the same time: taken as its continuation";
            notes.push(format!("{} {text}.", part.table.name));
        } else if start <= end {
            joined.push(part);
            continue;
        }
        append(before, part);
    }
    joined
}

fn append(before: &mut Part, mut part: Part) {
    before.time.append(&mut part.time);
    for (to, from) in before.table.columns.iter_mut().zip(&mut part.table.columns) {
        to.values.append(&mut from.values);
    }
    before.table.rows += part.table.rows;
    before.table.warnings.append(&mut part.table.warnings);
}

/// One table over all times, of the columns that a name or the format explains.
fn wide(mut parts: Vec<Part>, name: &str, warnings: &mut Vec<Warning>) -> Result<(Table, Vec<Unused>), ImportError> {
    let name = name.to_owned();
    let mut unused = Vec::new();
    for part in &mut parts {
        let label = part.label();
        let mut columns = std::mem::take(&mut part.table.columns);
        columns.retain(|c| {
            let known = !Part::is_clock(c) && !Part::signals(c).is_empty();
            if !known && !Part::is_clock(c) {
                let column = format!("{} ({label})", c.name);
                unused.push(Unused { column, reason: "its name is not known".into() });
            }
            known
        });
        part.table.columns = columns;
    }
    if parts.iter().all(|p| p.table.columns.is_empty()) {
        let found: Vec<&str> = unused.iter().map(|u| u.column.as_str()).collect();
        let found = crate::error::name_list(found.into_iter());
        return Err(ImportError::NoSignals { file: name, place: "all tables".into(), found });
    }
    parts.retain(|p| !p.table.columns.is_empty());
    let time = union(&parts);
    let mut taken = Named::<usize>::default();
    let width = parts.iter().map(|p| p.table.columns.len()).sum::<usize>() + 1;
    let full = || ImportError::OutOfMemory { file: name.clone(), row: 1, columns: width };
    let mut columns =
        vec![RawColumn { name: "t".into(), unit: Some("s".into()), values: time.clone(), ..RawColumn::default() }];
    let mut repeated = 0;
    for part in parts {
        let label = part.label();
        let rows = places(&part.time, &time, &mut repeated);
        for column in part.table.columns {
            let mut values = Vec::new();
            values.try_reserve_exact(time.len()).map_err(|_| full())?;
            values.resize(time.len(), f64::NAN);
            for (value, row) in column.values.iter().zip(&rows).filter(|(v, r)| v.is_finite() && **r != u32::MAX) {
                values[*row as usize] = *value;
            }
            let count = taken.entry(column.name.clone(), || 0);
            *count += 1;
            let name = if *count == 1 { column.name } else { format!("{} ({label})", column.name) };
            columns.push(RawColumn { name, values, ..column });
        }
    }
    if repeated > 0 {
        let message = format!("rows at the time of the one before were put together with it ({repeated}).");
        warnings.push(Warning { message, column: None, row: None, count: repeated });
    }
    Ok((Table { name, columns, rows: time.len(), format: "several tables", ..Table::default() }, unused))
}

/// `a.csv`, `a.csv and b.csv`, `a.csv and 3 more`.
fn file_names(parts: &[Part]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for part in parts {
        if !names.contains(&part.table.name.as_str()) {
            names.push(&part.table.name);
        }
    }
    match names.as_slice() {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [one, two] => format!("{one} and {two}"),
        [one, rest @ ..] => format!("{one} and {} more", rest.len()),
    }
}

/// All times in order, each once.
fn union(parts: &[Part]) -> Vec<f64> {
    let mut time: Vec<f64> = parts.iter().flat_map(|p| &p.time).copied().filter(|t| t.is_finite()).collect();
    time.sort_unstable_by(f64::total_cmp);
    time.dedup();
    time
}

/// Row of each time among all; `u32::MAX` for none.
fn places(own: &[f64], all: &[f64], repeated: &mut usize) -> Vec<u32> {
    let mut at = 0;
    let mut previous = f64::NAN;
    let place = |t: &f64| {
        if !t.is_finite() {
            return u32::MAX;
        }
        *repeated += usize::from(*t == previous);
        previous = *t;
        while at < all.len() && all[at] < *t {
            at += 1;
        }
        at as u32
    };
    own.iter().map(place).collect()
}
