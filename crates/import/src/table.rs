//! What a file holds: named columns of numbers, without meaning yet.

use drivescope_drive::csv::{REST, file_unit};
use serde::Serialize;

/// A column of numbers as the file has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawColumn {
    /// Name, without the unit.
    pub name: String,
    /// Unit as the file writes it, if it does.
    pub unit: Option<String>,
    /// One value per row; NaN is a blank cell. Of date and time, seconds since the column's first.
    pub values: Vec<f64>,
    /// Set on date and time: what they count from.
    pub epoch: Option<TimeEpoch>,
    /// What the column is, where the format itself defines it.
    pub meaning: Option<Meaning>,
}

/// What a format's own definition says of a column.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Meaning {
    /// Canonical name of the signal.
    pub signal: &'static str,
    /// -1 where the format counts the other way (up, left).
    pub sign: f64,
}

/// What the seconds of a column of date and time count from: its first cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeEpoch {
    /// Nanoseconds since 1970-01-01 UTC (of the file's own clock where it names no zone).
    Instant(i64),
    /// Nanoseconds since midnight: the day is unknown.
    Midnight(i64),
}

/// A column of text: kept out, with an example for the report.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TextColumn {
    /// Name.
    pub name: String,
    /// Its first text.
    pub example: String,
}

/// Something in a file that was passed over or looks wrong; reading went on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// One sentence.
    pub message: String,
    /// The column concerned.
    pub column: Option<String>,
    /// Row (line of the file, from 1) where it happened first.
    pub row: Option<usize>,
    /// How many times.
    pub count: usize,
}

/// How a text file is laid out, as found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Layout {
    /// `comma`, `semicolon`, `tab`, `pipe` or `spaces`; empty where it is no text file, or several with layouts of their own.
    pub separator: &'static str,
    /// The decimal mark.
    pub decimal: char,
    /// Line of the header; `None` if the file has none.
    pub header_row: Option<usize>,
    /// Line of the row of units.
    pub unit_row: Option<usize>,
    /// Lines before the header, and comments anywhere, that were passed over.
    pub skipped_lines: usize,
}

/// What a file holds: columns over the same rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// File name.
    pub name: String,
    /// Which part of the file: topic, message, channel group or member of an archive; empty for the whole of it.
    pub part: String,
    /// The format that it was read from.
    pub format: &'static str,
    /// Columns of numbers, in the order of the file.
    pub columns: Vec<RawColumn>,
    /// Columns of text.
    pub text_columns: Vec<TextColumn>,
    /// Number of rows of every column.
    pub rows: usize,
    /// What was passed over.
    pub warnings: Vec<Warning>,
    /// How the file is laid out.
    pub layout: Layout,
    /// Bytes read.
    pub bytes: u64,
    /// What comments at the head state as `# name = value`.
    pub stated: Vec<(String, String)>,
    /// What columns of degrees leave of angles, rad, with the name of the column: see [`drivescope_drive::csv::REST`].
    pub(crate) rests: Vec<(String, Vec<f64>)>,
    /// `(row index, its line)` where lines do not simply count on.
    pub(crate) line_marks: Vec<(usize, usize)>,
}

impl Table {
    /// The column of that name.
    pub fn column(&self, name: &str) -> Option<&RawColumn> {
        self.columns.iter().find(|c| c.name == name)
    }
    /// The line of the file (from 1) that holds a row (from 0).
    pub fn line_of(&self, row: usize) -> usize {
        let mark = self.line_marks.partition_point(|(r, _)| *r <= row);
        match mark.checked_sub(1).map(|i| self.line_marks[i]) {
            Some((first, line)) => line + (row - first),
            None => row + 1,
        }
    }
    /// Take what columns of degrees leave of angles out of the columns.
    pub(crate) fn take_rests(&mut self) {
        let is_angle = |name: &str| file_unit(name, "") == "deg";
        for i in (0..self.columns.len()).rev() {
            if let Some(angle) = self.columns[i].name.strip_suffix(REST).filter(|n| is_angle(n)) {
                let angle = angle.to_owned();
                self.rests.push((angle, self.columns.remove(i).values));
            }
        }
    }
    /// `row 1`, or that there is no header: the place for a sentence about columns.
    pub(crate) fn header_place(&self) -> String {
        self.layout.header_row.map_or_else(|| "no header row".into(), |row| format!("row {row}"))
    }
    /// The columns of numbers, for a sentence.
    pub(crate) fn columns_found(&self) -> String {
        crate::error::name_list(self.columns.iter().map(|c| c.name.as_str()))
    }
}

/// Warnings of one kind on one column are one warning with a count.
#[derive(Clone, Debug, Default)]
pub(crate) struct Warnings {
    list: Vec<(&'static str, Warning)>,
}

impl Warnings {
    /// Count one; `what` names the kind and, with the count before it, makes the sentence.
    pub fn add(&mut self, what: &'static str, column: Option<&str>, row: usize) {
        let known = self.list.iter_mut().find(|(w, old)| *w == what && old.column.as_deref() == column);
        match known {
            Some((_, warning)) => warning.count += 1,
            None => {
                let column = column.map(str::to_owned);
                self.list.push((what, Warning { message: String::new(), column, row: Some(row), count: 1 }));
            }
        }
    }
    /// Say something of a whole column.
    pub fn note(&mut self, what: &'static str, column: Option<&str>) {
        let column = column.map(str::to_owned);
        self.list.push((what, Warning { message: String::new(), column, row: None, count: 1 }));
    }
    /// The warnings with their sentences.
    pub fn finish(self) -> Vec<Warning> {
        let sentence = |(what, mut warning): (&str, Warning)| {
            let column = warning.column.as_ref().map_or(String::new(), |c| format!("column `{c}`: "));
            warning.message = match (warning.row, warning.count) {
                (Some(row), 1) => format!("{column}{what} (once, in row {row})."),
                (Some(row), count) => format!("{column}{what} ({count} times, first in row {row})."),
                (None, _) => format!("{column}{what}."),
            };
            warning
        };
        self.list.into_iter().map(sentence).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_knows_its_line_across_skipped_lines() {
        let table = Table { line_marks: vec![(0, 3), (2, 9)], ..Table::default() };
        assert_eq!([0, 1, 2, 5].map(|r| table.line_of(r)), [3, 4, 9, 12]);
    }

    #[test]
    fn warnings_of_a_kind_are_counted() {
        let mut warnings = Warnings::default();
        warnings.add("infinite value taken as blank", Some("a"), 7);
        warnings.add("infinite value taken as blank", Some("a"), 8);
        warnings.add("infinite value taken as blank", Some("b"), 9);
        let list = warnings.finish();
        assert_eq!(list[0].message, "column `a`: infinite value taken as blank (2 times, first in row 7).");
        assert_eq!(list[1].message, "column `b`: infinite value taken as blank (once, in row 9).");
    }
}
