//! One column while it is read: what kind of cells it holds is decided by its first ones.

use std::collections::TryReserveError;

use crate::cell::Content;
use crate::error::{ImportError, excerpt};
use crate::stamp::Stamp;
use crate::table::{RawColumn, TextColumn, TimeEpoch, Warnings};

/// Cells that decide whether a column is one of text.
const DECIDING: usize = 20;
const DAY: i64 = 86_400_000_000_000;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Not known yet: this many numbers and texts so far.
    Open { numbers: usize, texts: usize },
    /// Numbers; a text is an error.
    Number,
    /// Date and time.
    Time,
    /// Text, not kept.
    Text,
    /// Not wanted: nothing of it is looked at.
    Left,
}

impl Kind {
    /// Whether values are kept.
    pub fn is_kept(self) -> bool {
        !matches!(self, Self::Text | Self::Left)
    }
}

/// A column while it is read.
#[derive(Clone, Debug)]
pub(crate) struct ColumnBuilder {
    pub name: String,
    pub kind: Kind,
    unit: Option<String>,
    values: Vec<f64>,
    first_text: Option<(usize, String)>,
    epoch: Option<TimeEpoch>,
    previous: i64,
}

/// A cell that does not fit its column.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Refused {
    /// Where the first cell that does not fit is.
    pub row: usize,
    /// What is there.
    pub found: String,
    /// Whether a time was expected rather than a number.
    pub time: bool,
}

impl ColumnBuilder {
    pub fn new(name: String, unit: Option<String>) -> Self {
        let kind = Kind::Open { numbers: 0, texts: 0 };
        Self { name, kind, unit, values: Vec::new(), first_text: None, epoch: None, previous: 0 }
    }

    /// Make room for `rows` rows in all.
    pub fn reserve(&mut self, rows: usize) -> Result<(), TryReserveError> {
        if !self.kind.is_kept() {
            return Ok(());
        }
        self.values.try_reserve_exact(rows.saturating_sub(self.values.len()))
    }

    /// Append a value that `value` or the caller's own parsing gave.
    #[inline]
    pub fn push(&mut self, value: f64) {
        if self.kind.is_kept() {
            self.values.push(value);
        }
    }

    /// Append the values of several rows.
    #[inline]
    #[cfg(not(target_family = "wasm"))]
    pub fn extend<'a>(&mut self, values: impl Iterator<Item = &'a f64>) {
        if self.kind.is_kept() {
            self.values.extend(values);
        }
    }

    /// Append the values of column `index` of rows that are `width` wide.
    pub fn take(&mut self, rows: &[f64], width: usize, index: usize) {
        if !self.kind.is_kept() {
            return;
        }
        let before = self.values.len();
        self.values.resize(before + rows.len() / width, f64::NAN);
        for (value, row) in self.values[before..].iter_mut().zip(rows.chunks_exact(width)) {
            *value = row[index];
        }
    }

    /// The value of a cell, or why it does not fit. Decides the kind of the column as cells come.
    pub fn value(&mut self, content: Content, text: &[u8], row: usize) -> Result<f64, Refused> {
        match (self.kind, content) {
            (Kind::Text | Kind::Left, _) | (_, Content::Blank) => Ok(f64::NAN),
            (Kind::Number, Content::Number(v)) => Ok(v),
            (Kind::Number, Content::Infinite) => Ok(f64::NAN),
            (Kind::Number, _) => Err(Refused { row, found: excerpt(text), time: false }),
            (Kind::Time, Content::Stamp(stamp)) => {
                self.stamp(stamp).ok_or_else(|| Refused { row, found: excerpt(text), time: true })
            }
            (Kind::Time, _) => Err(Refused { row, found: excerpt(text), time: true }),
            (Kind::Open { numbers: 0, texts: 0 }, Content::Stamp(stamp)) => {
                self.kind = Kind::Time;
                self.stamp(stamp).ok_or_else(|| Refused { row, found: excerpt(text), time: true })
            }
            (Kind::Open { numbers, texts }, content) => self.decide(numbers, texts, content, text, row),
        }
    }

    fn decide(
        &mut self,
        mut numbers: usize,
        mut texts: usize,
        content: Content,
        text: &[u8],
        row: usize,
    ) -> Result<f64, Refused> {
        let value = match content {
            Content::Number(v) => v,
            _ => f64::NAN,
        };
        if matches!(content, Content::Number(_) | Content::Infinite) {
            numbers += 1;
        } else {
            texts += 1;
            self.first_text.get_or_insert_with(|| (row, excerpt(text)));
        }
        self.kind = Kind::Open { numbers, texts };
        if 2 * texts > DECIDING {
            self.kind = Kind::Text;
            self.values = Vec::new();
        } else if 2 * numbers >= DECIDING {
            self.kind = Kind::Number;
            return self.refusal().map_or(Ok(value), Err);
        }
        Ok(value)
    }

    fn refusal(&self) -> Option<Refused> {
        self.first_text.clone().map(|(row, found)| Refused { row, found, time: false })
    }

    /// Seconds since the column's first; a time of day that falls by more than half a day has passed midnight.
    fn stamp(&mut self, stamp: Stamp) -> Option<f64> {
        let ns = match (stamp, self.epoch) {
            (Stamp::Instant(ns), None | Some(TimeEpoch::Instant(_))) => ns,
            (Stamp::TimeOfDay(ns), None) => ns,
            (Stamp::TimeOfDay(ns), Some(TimeEpoch::Midnight(_))) => {
                let days = (self.previous - ns + DAY / 2).div_euclid(DAY);
                ns + days.max(0) * DAY
            }
            _ => return None,
        };
        self.previous = ns;
        let epoch = *self.epoch.get_or_insert(match stamp {
            Stamp::Instant(_) => TimeEpoch::Instant(ns),
            Stamp::TimeOfDay(_) => TimeEpoch::Midnight(ns),
        });
        let (TimeEpoch::Instant(first) | TimeEpoch::Midnight(first)) = epoch;
        Some((ns - first) as f64 / 1e9)
    }

    /// Hand the column over, to the numbers or to the texts.
    pub fn finish(
        self,
        file: &str,
        columns: &mut Vec<RawColumn>,
        text_columns: &mut Vec<TextColumn>,
        warnings: &mut Warnings,
    ) -> Result<(), ImportError> {
        let is_text = match self.kind {
            Kind::Left => return Ok(()),
            Kind::Text => true,
            Kind::Open { numbers, texts } => texts > numbers,
            _ => false,
        };
        if is_text {
            let example = self.first_text.map(|(_, text)| text).unwrap_or_default();
            text_columns.push(TextColumn { name: self.name, example });
            return Ok(());
        }
        if let Some(Refused { row, found, .. }) = self.refusal() {
            return Err(ImportError::NotANumber { file: file.to_owned(), row, column: self.name, found });
        }
        if let Some(TimeEpoch::Midnight(_)) = self.epoch {
            warnings.note("times of day without a date: seconds are counted from the first", Some(&self.name));
        }
        columns.push(RawColumn {
            name: self.name,
            unit: self.unit,
            values: self.values,
            epoch: self.epoch,
            meaning: None,
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches: a column that the user leaves out for want of memory, held until the end of the file all the same.
    #[test]
    fn a_column_that_is_left_out_takes_no_memory() {
        let mut column = ColumnBuilder::new("left".into(), None);
        column.kind = Kind::Left;
        column.reserve(1000).unwrap();
        column.take(&[1.0, 2.0, 3.0, 4.0], 2, 1);
        assert_eq!(column.values.capacity(), 0);
    }
}
