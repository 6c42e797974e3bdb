//! What is decided before the first row, and what is done after the last slice.

use super::{Body, Row};
use crate::cell::RowScan;
use crate::column::Kind;
use crate::dialect::separator_name;
use crate::error::ImportError;
use crate::keep::{HeadClock, Keep, Need, Picker};
use crate::table::{Layout, Table};

impl Body {
    /// Keep a part only, by what the head of the file holds, which is `bytes` long as a whole.
    ///
    /// # Errors
    /// [`ImportError::TooLarge`].
    pub fn keep(&mut self, keep: &Keep, head: &[u8], bytes: Option<u64>) -> Result<(), ImportError> {
        self.keep = keep.clone();
        let mut probe = Self::new(self.file.clone(), self.dialect.clone())?;
        // What is wrong with the head is found again where it is read.
        let found = probe.feed(head).and_then(|()| probe.finish(0));
        let Ok(mut found) = found else { return Ok(()) };
        let clock = HeadClock::of(&found);
        let is_clock = |name: &str| clock.as_ref().is_some_and(|c| c.name == name);
        for column in &mut self.columns {
            if !keep.has_column(&column.name) && !is_clock(&column.name) {
                column.kind = Kind::Left;
            }
        }
        if keep.picks_rows() {
            let place = |c: &HeadClock| Some((self.columns.iter().position(|x| x.name == c.name)?, c.factor));
            self.picker = Some(Picker::new(keep.clone(), clock.as_ref().and_then(place)));
        }
        let Some(bytes) = bytes else { return Ok(()) };
        let rows = found.rows as f64 * bytes as f64 / head.len().max(1) as f64;
        found.columns.retain(|c| keep.has_column(&c.name) || is_clock(&c.name));
        let need = Need { rows, columns: found.columns.len(), step: clock.map_or(f64::NAN, |c| c.step) };
        need.check(&self.file, keep)
    }

    /// The table, once all bytes were taken.
    pub fn finish(mut self, bytes: u64) -> Result<Table, ImportError> {
        if !self.carry.is_empty() {
            self.finish_last_row()?;
        }
        let first = self.line_marks.first().map_or(0, |(_, line)| *line);
        if self.rows < 2 {
            let place = if self.rows == 1 { format!("row {first}") } else { "after the header".into() };
            return Err(ImportError::TooFewRows { file: self.file, found: self.rows, place });
        }
        let layout = Layout {
            separator: separator_name(self.dialect.cut),
            decimal: char::from(self.dialect.decimal),
            header_row: self.dialect.header_line,
            unit_row: self.dialect.unit_line,
            skipped_lines: self.dialect.skipped + self.comments,
        };
        let mut table = Table {
            name: self.file,
            format: "CSV",
            rows: self.rows,
            layout,
            bytes,
            stated: self.dialect.stated,
            line_marks: self.line_marks,
            ..Table::default()
        };
        for column in self.columns {
            column.finish(&table.name, &mut table.columns, &mut table.text_columns, &mut self.warnings)?;
        }
        table.warnings = self.warnings.finish();
        table.warnings.extend(self.keep.warning());
        table.take_rests();
        Ok(table)
    }

    /// The last line, when it has no end of line.
    fn finish_last_row(&mut self) -> Result<(), ImportError> {
        let eol = self.dialect.cut.eol;
        let mut carry = std::mem::take(&mut self.carry);
        if carry.trim_ascii().is_empty() || carry == b"\x1a" {
            return Ok(());
        }
        let open = matches!(self.scan, RowScan::Quoted);
        if open && carry.contains(&eol) {
            return Err(self.unclosed(RowScan::open_quote(&carry, self.dialect.cut).unwrap_or(0)));
        }
        if open {
            self.warnings.add("last row is cut off and left out", None, self.line);
            return Ok(());
        }
        carry.push(eol);
        self.last_row = true;
        match self.parse_row(&carry, 0)? {
            Row::Next(_) => Ok(()),
            Row::Unfinished => Err(self.unclosed(0)),
        }
    }
}
