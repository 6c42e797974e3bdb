//! What of a large file is kept: some columns, a part of its time, every nth row; and how much memory it may take.

use serde::{Deserialize, Serialize};

use crate::clock;
use crate::error::ImportError;
use crate::offer::Offer;
use crate::table::{Table, Warning};
use crate::units;

/// Bytes of memory per row beside its columns: its time, its place in a channel.
const ROW_BYTES: f64 = 16.0;

/// What of a file is kept. The default keeps everything.
///
/// ```
/// use drivescope_import::{CsvReader, Keep};
/// let mut reader = CsvReader::new("log.csv");
/// reader.keep(Keep { columns: vec!["speed".into()], from: Some(1.0), ..Keep::default() });
/// reader.feed(b"t,accel_x,speed\n10,0,1\n11,0,2\n12,0,3\n")?;
/// let table = reader.finish()?;
/// assert_eq!(table.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["t", "speed"]);
/// assert_eq!(table.columns[1].values, [2.0, 3.0]);
/// # Ok::<(), drivescope_import::ImportError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Keep {
    /// Names of the columns; none for all. The clock is kept in any case.
    pub columns: Vec<String>,
    /// Rows before this are left out, s after the first row of the file.
    pub from: Option<f64>,
    /// Rows after this are left out, s after the first row of the file.
    pub to: Option<f64>,
    /// Every nth row; 0 and 1 for all. Rows between are kept where a column has a value that it had not in the row before:
    /// what comes from a slower sensor.
    pub every: usize,
    /// Bytes that the columns may take; a file that is expected to need more is refused before it is read.
    pub memory: Option<u64>,
}

impl Keep {
    /// Whether rows are left out.
    pub(crate) fn picks_rows(&self) -> bool {
        self.every > 1 || self.from.is_some() || self.to.is_some()
    }

    /// What was left out, for the report; nothing if nothing was.
    pub(crate) fn warning(&self) -> Option<Warning> {
        let mut parts = Vec::new();
        if !self.columns.is_empty() {
            parts.push(format!("{} columns beside the clock", self.columns.len()));
        }
        if self.from.is_some() || self.to.is_some() {
            let to = self.to.map_or_else(|| "the end".into(), |t| format!("{t} s"));
            parts.push(format!("the time from {} s to {to}", self.from.unwrap_or(0.0)));
        }
        if self.every > 1 {
            parts.push(format!("one row in {} and those with values of slower sensors", self.every));
        }
        let message = format!("as asked for, only a part was read: {}.", parts.join(", "));
        (!parts.is_empty()).then_some(Warning { message, column: None, row: None, count: 1 })
    }

    /// Whether the column of this name is kept if it is not the clock.
    pub(crate) fn has_column(&self, name: &str) -> bool {
        let base = name.strip_suffix(drivescope_drive::csv::REST).unwrap_or(name);
        self.columns.is_empty() || self.columns.iter().any(|c| c == name || c == base)
    }
}

/// The clock of a file, found in its first rows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HeadClock {
    /// Its column.
    pub name: String,
    /// From its unit to s.
    pub factor: f64,
    /// Median step, s.
    pub step: f64,
}

impl HeadClock {
    /// The clock of the table that the head of a file makes, if it has one.
    pub fn of(head: &Table) -> Option<Self> {
        let source = clock::propose(head).ok()?.source;
        let factor = units::factor(&source.unit, "s")?;
        let step = factor * clock::median_step(&head.column(&source.column)?.values);
        Some(Self { name: source.column, factor, step })
    }
}

/// Which rows are kept, as they come.
#[derive(Clone, Debug)]
pub(crate) struct Picker {
    keep: Keep,
    /// Column of the clock and its factor to s.
    clock: Option<(usize, f64)>,
    first: f64,
    row: usize,
    had: Vec<bool>,
}

impl Picker {
    pub fn new(keep: Keep, clock: Option<(usize, f64)>) -> Self {
        Self { keep, clock, first: f64::NAN, row: 0, had: Vec::new() }
    }

    /// Whether the next row is kept.
    pub fn takes(&mut self, row: &[f64]) -> bool {
        let index = self.row;
        self.row += 1;
        if let Some((column, factor)) = self.clock {
            let time = row[column] * factor;
            if self.first.is_nan() {
                self.first = time;
            }
            let since = time - self.first;
            if self.keep.from.is_some_and(|from| since < from) || self.keep.to.is_some_and(|to| since > to) {
                return false;
            }
        }
        if self.keep.every <= 1 {
            return true;
        }
        self.had.resize(row.len(), true);
        let slower = row.iter().zip(&self.had).any(|(v, had)| !v.is_nan() && !had);
        self.had.iter_mut().zip(row).for_each(|(had, v)| *had = !v.is_nan());
        slower || index.is_multiple_of(self.keep.every)
    }
}

/// What a file is expected to need, judged by its head.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Need {
    /// Rows in the file.
    pub rows: f64,
    /// Columns of numbers that are kept, with the clock.
    pub columns: usize,
    /// Seconds from one row to the next; NaN if unknown.
    pub step: f64,
}

impl Need {
    /// Rows that are kept.
    pub fn kept_rows(&self, keep: &Keep) -> f64 {
        let span = keep.to.unwrap_or(f64::INFINITY) - keep.from.unwrap_or(0.0);
        let of_range = if self.step > 0.0 { (span / self.step).max(0.0) + 1.0 } else { f64::INFINITY };
        self.rows.min(of_range) / keep.every.max(1) as f64
    }

    /// Refuse a file that needs more memory than there is.
    ///
    /// # Errors
    /// [`ImportError::TooLarge`].
    pub fn check(&self, file: &str, keep: &Keep) -> Result<(), ImportError> {
        let Some(limit) = keep.memory.map(|m| m as f64) else { return Ok(()) };
        let rows = self.kept_rows(keep);
        let needed = rows * (8.0 * self.columns as f64 + ROW_BYTES);
        if needed <= limit {
            return Ok(());
        }
        let offer = Offer {
            columns: (((limit / rows - ROW_BYTES) / 8.0) as usize).saturating_sub(1),
            seconds: (rows * keep.every.max(1) as f64 * self.step * limit / needed).floor(),
            every: (keep.every.max(1) as f64 * needed / limit).ceil() as usize,
        };
        let mega = |bytes: f64| (bytes / 1e6).ceil() as u64;
        let (needed, limit) = (mega(needed), mega(limit));
        Err(ImportError::TooLarge {
            file: file.to_owned(),
            needed,
            limit,
            rows: rows as u64,
            columns: self.columns,
            offer,
        })
    }
}
