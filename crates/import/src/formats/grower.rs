//! A table that grows row by row while a file of its own clock is read.

use std::rc::Rc;

use crate::error::ImportError;
use crate::order::order;
use crate::table::{Meaning, RawColumn, Table, TimeEpoch, Warning};

/// Columns over one clock, in nanoseconds.
#[derive(Debug)]
pub(crate) struct Grower {
    file: Rc<str>,
    part: String,
    time: Vec<i64>,
    columns: Vec<RawColumn>,
}

/// What the nanoseconds of a clock count from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Zero {
    /// 1970-01-01 UTC.
    Unix,
    /// This instant, ns since 1970.
    At(i64),
    /// Midnight of an unknown day.
    Midnight,
    /// Nothing that is known: the start of the device or of the recording.
    Unknown,
}

/// A canonical meaning whose sign is that of the format.
pub(crate) const fn is(signal: &'static str) -> Option<Meaning> {
    Some(Meaning { signal, sign: 1.0 })
}

/// A canonical meaning that the format counts the other way.
pub(crate) const fn turned(signal: &'static str) -> Option<Meaning> {
    Some(Meaning { signal, sign: -1.0 })
}

impl Grower {
    pub fn new(file: &Rc<str>, part: &str) -> Self {
        Self { file: file.clone(), part: part.to_owned(), time: Vec::new(), columns: Vec::new() }
    }

    /// A grower with columns of (name, unit, meaning).
    pub fn with(file: &Rc<str>, part: &str, columns: &[(&str, &str, Option<Meaning>)]) -> Self {
        let mut grower = Self::new(file, part);
        columns.iter().for_each(|(name, unit, meaning)| grower.column(name, unit, *meaning));
        grower
    }

    /// Append a column; blank in the rows so far.
    pub fn column(&mut self, name: &str, unit: &str, meaning: Option<Meaning>) {
        let unit = (!unit.is_empty()).then(|| unit.to_owned());
        let values = vec![f64::NAN; self.time.len()];
        self.columns.push(RawColumn { name: name.to_owned(), unit, values, epoch: None, meaning });
    }

    pub fn rows(&self) -> usize {
        self.time.len()
    }

    /// Append a row; columns beyond `values` are blank, infinite values too.
    pub fn row(&mut self, time: i64, values: &[f64]) -> Result<(), ImportError> {
        if self.time.len() == self.time.capacity() {
            self.grow()?;
        }
        self.time.push(time);
        for (i, column) in self.columns.iter_mut().enumerate() {
            let value = values.get(i).copied().filter(|v| v.is_finite());
            column.values.push(value.unwrap_or(f64::NAN));
        }
        Ok(())
    }

    #[cold]
    fn grow(&mut self) -> Result<(), ImportError> {
        let more = self.time.len().max(64);
        let room = self.time.try_reserve_exact(more).is_ok()
            && self.columns.iter_mut().all(|c| c.values.try_reserve_exact(more).is_ok());
        if room {
            return Ok(());
        }
        Err(ImportError::OutOfMemory { file: self.file.to_string(), row: self.rows() + 1, columns: self.columns.len() })
    }

    /// The first time.
    pub fn first(&self) -> Option<i64> {
        self.time.first().copied()
    }

    /// Add to all times.
    pub fn shift(&mut self, ns: i64) {
        self.time.iter_mut().for_each(|t| *t = t.saturating_add(ns));
    }

    /// Add to each row's time its own difference.
    pub fn retime(&mut self, differences: &[i64]) {
        for (time, difference) in self.time.iter_mut().zip(differences) {
            *time = time.saturating_add(*difference);
        }
    }

    /// The table: seconds from its first row, rows in time order, columns without any value left out.
    pub fn finish(mut self, format: &'static str, zero: Zero) -> Option<Table> {
        self.columns.retain(|c| c.values.iter().any(|v| !v.is_nan()));
        if self.time.is_empty() {
            return None;
        }
        let mut warnings = Vec::new();
        let back = self.time.windows(2).filter(|w| w[1] < w[0]).count();
        if back > 0 {
            warnings.push(self.sort(back));
        }
        let first = if zero == Zero::Unknown { 0 } else { self.time[0] };
        let epoch = match zero {
            Zero::Unix => Some(TimeEpoch::Instant(first)),
            Zero::At(start) => Some(TimeEpoch::Instant(start.saturating_add(first))),
            Zero::Midnight => Some(TimeEpoch::Midnight(first)),
            Zero::Unknown => None,
        };
        let values: Vec<f64> = self.time.iter().map(|t| t.saturating_sub(first) as f64 / 1e9).collect();
        let rows = values.len();
        let clock = RawColumn { name: "t".into(), unit: Some("s".into()), values, epoch, meaning: None };
        let mut columns = vec![clock];
        columns.append(&mut self.columns);
        Some(Table {
            name: self.file.to_string(),
            part: self.part,
            format,
            columns,
            rows,
            warnings,
            ..Table::default()
        })
    }

    fn sort(&mut self, back: usize) -> Warning {
        let order = order(self.time.len(), &mut |a, b| self.time[a].cmp(&self.time[b]));
        self.time = order.iter().map(|&i| self.time[i as usize]).collect();
        for column in &mut self.columns {
            column.values = order.iter().map(|&i| column.values[i as usize]).collect();
        }
        let part = if self.part.is_empty() { String::new() } else { format!("{}: ", self.part) };
        let message = format!("{part}time stepped back {}; the rows were sorted by time.", times(back));
        Warning { message, column: None, row: None, count: back }
    }
}

/// `once`, `2 times`.
pub(crate) fn times(count: usize) -> String {
    if count == 1 { "once".into() } else { format!("{count} times") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_out_of_order_are_sorted_and_said() {
        let mut grower = Grower::with(&"x".into(), "topic", &[("a", "m", None), ("b", "", is("speed"))]);
        for (t, a) in [(3_000_000_000, 3.0), (1_000_000_000, 1.0), (2_000_000_000, f64::INFINITY)] {
            grower.row(t, &[a]).unwrap();
        }
        let table = grower.finish("test", Zero::Unix).unwrap();
        assert_eq!(table.columns.len(), 2, "a column without values is left out");
        assert_eq!(table.columns[0].values, [0.0, 1.0, 2.0]);
        assert!(table.columns[1].values[1].is_nan() && table.columns[1].values[2] == 3.0);
        assert_eq!(table.columns[0].epoch, Some(TimeEpoch::Instant(1_000_000_000)));
        assert_eq!(table.warnings[0].message, "topic: time stepped back once; the rows were sorted by time.");
    }
}
