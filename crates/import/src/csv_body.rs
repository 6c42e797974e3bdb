//! The rows of a CSV file below its header, parsed as they come.

#[cfg(not(target_arch = "wasm32"))]
mod parallel;
mod plain;
mod start_and_end;

#[cfg(not(target_arch = "wasm32"))]
pub(crate) use parallel::Split;
use plain::Plain;

use crate::cell::{Cell, Content, RowScan, content};
use crate::column::{ColumnBuilder, Kind};
use crate::dialect::Dialect;
use crate::error::{ImportError, MAX_ROW_BYTES, MAX_TABLE_COLUMNS};
use crate::keep::{Keep, Need, Picker};
use crate::table::Warnings;

/// Where the parsing of one row ended.
enum Row {
    /// The next row begins there.
    Next(usize),
    /// The bytes end before the row does.
    Unfinished,
}

/// The rows below the header.
#[derive(Debug)]
pub(crate) struct Body {
    file: String,
    dialect: Dialect,
    columns: Vec<ColumnBuilder>,
    /// What the columns held when plain rows were last looked for.
    kinds: Vec<Kind>,
    row: Vec<f64>,
    /// Plain rows on their way to the columns, row after row.
    block: Vec<f64>,
    /// Rows to be read cell by cell before plain ones are looked for again.
    patience: usize,
    /// How many that is when none are found.
    next_patience: usize,
    #[cfg(not(target_arch = "wasm32"))]
    pub split: Split,
    taken: u64,
    keep: Keep,
    /// Where rows are left out.
    picker: Option<Picker>,
    pub rows: usize,
    capacity: usize,
    line: usize,
    next_line: usize,
    line_marks: Vec<(usize, usize)>,
    comments: usize,
    carry: Vec<u8>,
    scan: RowScan,
    last_row: bool,
    warnings: Warnings,
}

impl Body {
    /// No rows yet, below the header that `dialect` found.
    pub fn new(file: String, dialect: Dialect) -> Result<Self, ImportError> {
        let row = dialect.header_line.unwrap_or(dialect.body.1);
        if dialect.columns.len() > MAX_TABLE_COLUMNS {
            return Err(ImportError::TooManyColumns { file, row, limit: MAX_TABLE_COLUMNS });
        }
        let columns: Vec<ColumnBuilder> =
            dialect.columns.iter().map(|(name, unit)| ColumnBuilder::new(name.clone(), unit.clone())).collect();
        Ok(Self {
            file,
            row: vec![f64::NAN; columns.len()],
            kinds: Vec::new(),
            columns,
            block: Vec::new(),
            patience: 0,
            next_patience: 1,
            #[cfg(not(target_arch = "wasm32"))]
            split: Split::default(),
            taken: 0,
            keep: Keep::default(),
            picker: None,
            rows: 0,
            capacity: 0,
            line: dialect.body.1,
            next_line: 0,
            line_marks: Vec::new(),
            comments: 0,
            carry: Vec::new(),
            scan: RowScan::default(),
            last_row: false,
            warnings: Warnings::default(),
            dialect,
        })
    }

    /// Ask for memory for as many rows as a file of `bytes` holds, judged by the rows of the head.
    pub fn reserve(&mut self, sample: &[u8], bytes: u64) -> Result<(), ImportError> {
        let rows = sample.iter().filter(|b| **b == self.dialect.cut.eol).count();
        if rows > 0 {
            let expected = bytes as f64 * 1.05 * rows as f64 / sample.len() as f64;
            let every = self.keep.every.max(1) as f64;
            self.grow((expected / every) as usize + 16)?;
        }
        Ok(())
    }

    fn grow(&mut self, rows: usize) -> Result<(), ImportError> {
        let wanted = self.capacity.max(rows);
        let need = Need {
            rows: self.rows as f64,
            columns: self.columns.iter().filter(|c| c.kind.is_kept()).count(),
            step: f64::NAN,
        };
        // What is kept already counts here, not what was picked from: rows, not a share of them.
        need.check(&self.file, &Keep { memory: self.keep.memory, ..Keep::default() })?;
        for column in &mut self.columns {
            if column.reserve(wanted).is_err() {
                let (file, row) = (self.file.clone(), self.line);
                return Err(ImportError::OutOfMemory { file, row, columns: self.columns.len() });
            }
        }
        self.capacity = wanted;
        Ok(())
    }

    /// Take the next bytes of the body.
    pub fn feed(&mut self, mut slice: &[u8]) -> Result<(), ImportError> {
        if !self.carry.is_empty() {
            let end = self.scan.find_end(slice, self.dialect.cut);
            let taken = end.map_or(slice.len(), |i| i + 1);
            self.carry.extend_from_slice(&slice[..taken]);
            if end.is_none() {
                return self.check_length(self.carry.len());
            }
            let carry = std::mem::take(&mut self.carry);
            self.rows_of(&carry)?;
            slice = &slice[taken..];
        }
        let done = self.rows_of(slice)?;
        self.carry = slice[done..].to_vec();
        self.scan = RowScan::default();
        let _ = self.scan.find_end(&self.carry, self.dialect.cut);
        self.check_length(self.carry.len())
    }

    /// Parse the whole rows that `bytes` begin with; how many bytes they are.
    fn rows_of(&mut self, bytes: &[u8]) -> Result<usize, ImportError> {
        let eol = self.dialect.cut.eol;
        let end = bytes.iter().rposition(|&b| b == eol).map_or(0, |i| i + 1);
        let region = &bytes[..end];
        #[cfg(not(target_arch = "wasm32"))]
        if self.patience == 0 && self.rows > 0 && self.picker.is_none() {
            let borders = self.split.borders(region, eol);
            if !borders.is_empty() {
                return self.rows_of_parts(region, &borders);
            }
        }
        self.rows_from(region, 0)
    }

    /// Parse the whole rows from `pos` on; where the first one begins that is not whole.
    fn rows_from(&mut self, region: &[u8], mut pos: usize) -> Result<usize, ImportError> {
        let mut quotes = None;
        while pos < region.len() {
            if self.patience == 0 {
                let next = self.plain_rows(region, pos)?;
                if next > pos {
                    pos = next;
                    continue;
                }
            }
            // A row that is not whole is left alone: its cells must not be taken twice.
            let quotes = *quotes.get_or_insert_with(|| region[pos..].contains(&b'"'));
            if quotes && RowScan::default().find_end(&region[pos..], self.dialect.cut).is_none() {
                break;
            }
            match self.parse_row(region, pos)? {
                Row::Next(next) => {
                    self.check_length(next - pos)?;
                    self.taken += (next - pos) as u64;
                    pos = next;
                }
                Row::Unfinished => break,
            }
            self.patience = self.patience.saturating_sub(1);
        }
        Ok(pos)
    }

    /// Take some plain rows from `pos` on; where they end.
    fn plain_rows(&mut self, region: &[u8], pos: usize) -> Result<usize, ImportError> {
        self.kinds.clear();
        self.kinds.extend(self.columns.iter().map(|c| c.kind));
        let plain = Plain { cut: self.dialect.cut, decimal: self.dialect.decimal, kinds: &self.kinds };
        let next = plain.rows(region, pos, &mut self.block);
        if next == pos {
            self.patience = self.next_patience;
            self.next_patience = (2 * self.next_patience).min(64);
            return Ok(pos);
        }
        self.next_patience = 1;
        let width = self.columns.len();
        if self.picker.is_some() {
            let block = std::mem::take(&mut self.block);
            for row in block.chunks_exact(width) {
                self.row.copy_from_slice(row);
                self.push_row(0)?;
            }
            self.block = block;
            return Ok(next);
        }
        self.begin_rows(self.block.len() / width, next - pos)?;
        for (i, column) in self.columns.iter_mut().enumerate() {
            column.take(&self.block, width, i);
        }
        Ok(next)
    }

    /// Make room for rows of one line each, and count them.
    fn begin_rows(&mut self, rows: usize, bytes: usize) -> Result<(), ImportError> {
        if self.rows + rows > self.capacity {
            self.grow(2 * self.rows + rows + 1024)?;
        }
        if self.line != self.next_line {
            self.line_marks.push((self.rows, self.line));
        }
        self.rows += rows;
        self.line += rows;
        self.next_line = self.line;
        self.taken += bytes as u64;
        Ok(())
    }

    fn check_length(&self, length: usize) -> Result<(), ImportError> {
        if length <= MAX_ROW_BYTES {
            return Ok(());
        }
        if let Some(inner) = RowScan::open_quote(&self.carry, self.dialect.cut) {
            return Err(self.unclosed(inner));
        }
        Err(ImportError::RowTooLong { file: self.file.clone(), row: self.line, limit: MAX_ROW_BYTES })
    }

    fn unclosed(&self, inner: usize) -> ImportError {
        ImportError::UnclosedQuote { file: self.file.clone(), row: self.line + inner }
    }

    fn parse_row(&mut self, bytes: &[u8], start: usize) -> Result<Row, ImportError> {
        let cut = self.dialect.cut;
        let count = self.columns.len();
        let (mut pos, mut inner_lines) = (start, 0);
        for column in 0..count {
            let (next, last) = match self.plain_cell(bytes, pos, column) {
                Some(end) => end,
                None => {
                    let Some(cell) = cut.cell(bytes, pos) else { return Ok(Row::Unfinished) };
                    if column == 0 && (crate::cell::is_comment(cell.text) || (cell.last && cell.text.is_empty())) {
                        return Ok(self.skip_line(bytes, start, cell.text.is_empty()));
                    }
                    inner_lines += cell.inner_lines;
                    self.cell(column, cell)?;
                    (cell.next, cell.last)
                }
            };
            pos = next;
            if last && column + 1 < count {
                return self.short_row(column + 1, pos, inner_lines);
            }
            if column + 1 == count && !last {
                match self.surplus(bytes, pos)? {
                    Some(end) => pos = end,
                    None => return Ok(Row::Unfinished),
                }
            }
        }
        self.push_row(inner_lines)?;
        Ok(Row::Next(pos))
    }

    /// A number without quotes or spaces, or nothing at all, in a column of numbers: `(next cell, last of the row)`.
    #[inline]
    fn plain_cell(&mut self, bytes: &[u8], pos: usize, column: usize) -> Option<(usize, bool)> {
        if self.columns[column].kind != Kind::Number {
            return None;
        }
        let plain = Plain { cut: self.dialect.cut, decimal: self.dialect.decimal, kinds: &[] };
        let (value, next, last) = plain.number(bytes, pos)?;
        self.row[column] = value;
        Some((next, last))
    }

    /// Any cell.
    #[cold]
    fn cell(&mut self, index: usize, cell: Cell) -> Result<(), ImportError> {
        if self.columns[index].kind == Kind::Left {
            self.row[index] = f64::NAN;
            return Ok(());
        }
        let mut found = content(cell.text, self.dialect.decimal);
        if found == Content::Text && self.dialect.decimal_open {
            found = content(cell.text, b',');
            if let Content::Number(_) = found {
                self.dialect.decimal = b',';
                self.dialect.decimal_open = false;
            }
        }
        let row = self.line;
        let column = &mut self.columns[index];
        if found == Content::Infinite {
            self.warnings.add("infinite value taken as blank", Some(&column.name), row);
        }
        match column.value(found, cell.text, row) {
            Ok(value) => {
                self.row[index] = value;
                Ok(())
            }
            Err(refused) => {
                let (file, column, found) = (self.file.clone(), column.name.clone(), refused.found);
                Err(if refused.time {
                    ImportError::NotATime { file, row: refused.row, column, found }
                } else {
                    ImportError::NotANumber { file, row: refused.row, column, found }
                })
            }
        }
    }

    fn skip_line(&mut self, bytes: &[u8], start: usize, blank: bool) -> Row {
        let eol = self.dialect.cut.eol;
        match bytes[start..].iter().position(|&b| b == eol) {
            Some(length) => {
                self.comments += usize::from(!blank);
                self.line += 1;
                Row::Next(start + length + 1)
            }
            None => Row::Unfinished,
        }
    }

    /// A row that ends early: an error, except in a last line without its end, as a log that was cut off has.
    fn short_row(&mut self, found: usize, next: usize, inner_lines: usize) -> Result<Row, ImportError> {
        if !self.last_row {
            return Err(self.ragged(found));
        }
        self.warnings.add("last row is cut off and left out", None, self.line);
        self.line += 1 + inner_lines;
        Ok(Row::Next(next))
    }

    /// What follows the last column: one blank cell is let pass, more is an error. The end of the row.
    fn surplus(&self, bytes: &[u8], start: usize) -> Result<Option<usize>, ImportError> {
        let cut = self.dialect.cut;
        let (mut pos, mut found, mut blank) = (start, self.columns.len(), true);
        while let Some(cell) = cut.cell(bytes, pos) {
            found += 1;
            blank &= cell.text.is_empty();
            pos = cell.next;
            if cell.last {
                return if blank && found == self.columns.len() + 1 { Ok(Some(pos)) } else { Err(self.ragged(found)) };
            }
        }
        Ok(None)
    }

    fn ragged(&self, found: usize) -> ImportError {
        let reference =
            self.dialect.header_line.map_or("the rows before".into(), |line| format!("the header (row {line})"));
        ImportError::Ragged { file: self.file.clone(), row: self.line, expected: self.columns.len(), found, reference }
    }

    fn push_row(&mut self, inner_lines: usize) -> Result<(), ImportError> {
        if self.picker.as_mut().is_some_and(|p| !p.takes(&self.row)) {
            self.line += 1 + inner_lines;
            return Ok(());
        }
        self.begin_rows(1, 0)?;
        for (column, value) in self.columns.iter_mut().zip(&self.row) {
            column.push(*value);
        }
        self.line += inner_lines;
        Ok(())
    }
}
