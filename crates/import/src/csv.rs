//! Reading CSV in slices: only columns of numbers, one slice and one unfinished row are ever in memory.

use crate::cell::{Cell, Content, RowScan, content};
use crate::column::{ColumnBuilder, Kind};
use crate::dialect::{Dialect, SniffError, separator_name, sniff};
use crate::error::{ImportError, MAX_ROW_BYTES, MAX_TABLE_COLUMNS};
use crate::magic;
use crate::number::parse_prefix;
use crate::source::ByteSource;
use crate::table::{Layout, Table, Warnings};

/// The head of the file is looked at when it has grown to one of these sizes, so that what is found does not depend on
/// the slices it came in.
const HEAD_SIZES: [usize; 4] = [64 << 10, 256 << 10, 1 << 20, MAX_ROW_BYTES];

/// Reads CSV text slice by slice into a [`Table`].
///
/// Rows are counted as an editor counts lines, from 1. A blank cell is NaN.
///
/// ```
/// use drivescope_import::CsvReader;
/// let mut reader = CsvReader::new("log.csv");
/// reader.feed(b"t;ax [g]\n0,0;0,")?;
/// reader.feed(b"5\n0,1;0,25\n")?;
/// let table = reader.finish()?;
/// assert_eq!(table.columns[1].values, [0.5, 0.25]);
/// assert_eq!(table.columns[1].unit.as_deref(), Some("g"));
/// # Ok::<(), drivescope_import::ImportError>(())
/// ```
#[derive(Debug)]
pub struct CsvReader {
    file: String,
    expected_bytes: Option<u64>,
    bytes: u64,
    head: Vec<u8>,
    body: Option<Body>,
}

impl CsvReader {
    /// A reader for the file of this name.
    pub fn new(file: &str) -> Self {
        Self { file: file.to_owned(), expected_bytes: None, bytes: 0, head: Vec::new(), body: None }
    }

    /// Say how long the file is, so that memory is asked for once.
    pub fn expect_bytes(&mut self, bytes: u64) {
        self.expected_bytes = Some(bytes);
    }

    /// Number of bytes taken so far.
    pub fn bytes_read(&self) -> u64 {
        self.bytes
    }

    /// Number of rows of data taken so far.
    pub fn rows(&self) -> usize {
        self.body.as_ref().map_or(0, |b| b.rows)
    }

    /// Take the next slice of the file.
    ///
    /// # Errors
    /// The first thing that is wrong with the file; the reader is of no use afterwards.
    pub fn feed(&mut self, mut slice: &[u8]) -> Result<(), ImportError> {
        self.bytes += slice.len() as u64;
        while self.body.is_none() {
            let target = HEAD_SIZES.into_iter().find(|s| *s > self.head.len()).unwrap_or(MAX_ROW_BYTES);
            let taken = slice.len().min(target - self.head.len());
            self.head.extend_from_slice(&slice[..taken]);
            slice = &slice[taken..];
            if self.head.len() < target {
                return Ok(());
            }
            self.look(false)?;
        }
        match &mut self.body {
            Some(body) => body.feed(slice),
            None => Ok(()),
        }
    }

    /// The table, once all slices were taken.
    ///
    /// # Errors
    /// The first thing that is wrong with the file.
    pub fn finish(mut self) -> Result<Table, ImportError> {
        if self.body.is_none() {
            self.look(true)?;
        }
        let empty = ImportError::Empty { file: self.file };
        self.body.ok_or(empty)?.finish(self.bytes)
    }

    /// Look at the head; when it tells the layout, its rows are read and it is dropped.
    fn look(&mut self, whole: bool) -> Result<(), ImportError> {
        let file = || self.file.clone();
        if self.head.is_empty() {
            return Err(ImportError::Empty { file: file() });
        }
        if let Some(found) = magic::other_format(&self.head) {
            return Err(ImportError::OtherFormat { file: file(), found });
        }
        if let Some((offset, byte)) = magic::binary_byte(&self.head) {
            let row = 1 + self.head[..offset].iter().filter(|b| **b == b'\n').count();
            return Err(ImportError::Binary { file: file(), row, byte, offset });
        }
        let last_look = whole || self.head.len() >= MAX_ROW_BYTES;
        let ends = self.head.iter().filter(|b| matches!(b, b'\n' | b'\r')).count();
        let dialect = match sniff(&self.head, whole) {
            Err(SniffError::Empty) if !last_look => return Ok(()),
            Err(SniffError::Empty) => return Err(ImportError::Empty { file: file() }),
            Err(SniffError::TooManyColumns(row)) => {
                return Err(ImportError::TooManyColumns { file: file(), row, limit: MAX_TABLE_COLUMNS });
            }
            Ok(_) if ends < 8 && !last_look => return Ok(()),
            Ok(_) if ends == 0 && !whole => {
                return Err(ImportError::RowTooLong { file: file(), row: 1, limit: MAX_ROW_BYTES });
            }
            Ok(dialect) => dialect,
        };
        let head = std::mem::take(&mut self.head);
        let start = dialect.body.0.min(head.len());
        let mut body = Body::new(file(), dialect)?;
        body.reserve(&head[start..], self.expected_bytes.unwrap_or(0))?;
        body.feed(&head[start..])?;
        self.body = Some(body);
        Ok(())
    }
}

/// Read a whole source as CSV.
///
/// # Errors
/// The first thing that is wrong with the file, or the system's refusal to read.
pub fn read_csv(source: &mut dyn ByteSource, file: &str) -> Result<Table, ImportError> {
    let mut reader = CsvReader::new(file);
    if let Some(bytes) = source.len() {
        reader.expect_bytes(bytes);
    }
    let mut slice = vec![0; 1 << 18];
    loop {
        let count = source.read(&mut slice).map_err(|cause| ImportError::Read { file: file.to_owned(), cause })?;
        if count == 0 {
            return reader.finish();
        }
        reader.feed(&slice[..count.min(slice.len())])?;
    }
}

/// Where the parsing of one row ended.
enum Row {
    /// The next row begins there.
    Next(usize),
    /// The bytes end before the row does.
    Unfinished,
}

/// The rows below the header.
#[derive(Debug)]
struct Body {
    file: String,
    dialect: Dialect,
    columns: Vec<ColumnBuilder>,
    row: Vec<f64>,
    rows: usize,
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
    fn new(file: String, dialect: Dialect) -> Result<Self, ImportError> {
        let row = dialect.header_line.unwrap_or(dialect.body.1);
        if dialect.columns.len() > MAX_TABLE_COLUMNS {
            return Err(ImportError::TooManyColumns { file, row, limit: MAX_TABLE_COLUMNS });
        }
        let columns: Vec<ColumnBuilder> =
            dialect.columns.iter().map(|(name, unit)| ColumnBuilder::new(name.clone(), unit.clone())).collect();
        Ok(Self {
            file,
            row: vec![f64::NAN; columns.len()],
            columns,
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
    fn reserve(&mut self, sample: &[u8], bytes: u64) -> Result<(), ImportError> {
        let rows = sample.iter().filter(|b| **b == self.dialect.cut.eol).count();
        if rows > 0 {
            let expected = bytes as f64 * 1.05 * rows as f64 / sample.len() as f64;
            self.grow(expected as usize + 16)?;
        }
        Ok(())
    }

    fn grow(&mut self, rows: usize) -> Result<(), ImportError> {
        let wanted = self.capacity.max(rows);
        for column in &mut self.columns {
            if column.reserve(wanted).is_err() {
                let (file, row) = (self.file.clone(), self.line);
                return Err(ImportError::OutOfMemory { file, row, columns: self.columns.len() });
            }
        }
        self.capacity = wanted;
        Ok(())
    }

    fn feed(&mut self, mut slice: &[u8]) -> Result<(), ImportError> {
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
        let mut pos = 0;
        while pos < region.len() {
            match self.parse_row(region, pos)? {
                Row::Next(next) => {
                    self.check_length(next - pos)?;
                    pos = next;
                }
                Row::Unfinished => break,
            }
        }
        Ok(pos)
    }

    fn check_length(&self, length: usize) -> Result<(), ImportError> {
        if length <= MAX_ROW_BYTES {
            return Ok(());
        }
        Err(ImportError::RowTooLong { file: self.file.clone(), row: self.line, limit: MAX_ROW_BYTES })
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
        let cut = self.dialect.cut;
        let (value, end) = match *bytes.get(pos)? {
            b if b == cut.separator && !cut.collapse => (f64::NAN, pos),
            b'n' | b'N' if bytes.get(pos + 1..pos + 3).is_some_and(|b| b.eq_ignore_ascii_case(b"an")) => {
                (f64::NAN, pos + 3)
            }
            _ => {
                let (value, used) = parse_prefix(&bytes[pos..], self.dialect.decimal)?;
                if value.is_infinite() {
                    return None;
                }
                (value, pos + used)
            }
        };
        let after = *bytes.get(end)?;
        let last = after == cut.eol;
        if last || (after == cut.separator && !cut.collapse) {
            self.row[column] = value;
            return Some((end + 1, last));
        }
        if after == b'\r' && bytes.get(end + 1) == Some(&cut.eol) {
            self.row[column] = value;
            return Some((end + 2, true));
        }
        None
    }

    /// Any cell.
    #[cold]
    fn cell(&mut self, index: usize, cell: Cell) -> Result<(), ImportError> {
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
        if self.rows == self.capacity {
            self.grow(2 * self.rows + 1024)?;
        }
        if self.line != self.next_line {
            self.line_marks.push((self.rows, self.line));
        }
        for (column, value) in self.columns.iter_mut().zip(&self.row) {
            column.push(*value);
        }
        self.rows += 1;
        self.line += 1 + inner_lines;
        self.next_line = self.line;
        Ok(())
    }

    fn finish(mut self, bytes: u64) -> Result<Table, ImportError> {
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
        let mut table =
            Table { name: self.file, rows: self.rows, layout, bytes, line_marks: self.line_marks, ..Table::default() };
        for column in self.columns {
            column.finish(&table.name, &mut table.columns, &mut table.text_columns, &mut self.warnings)?;
        }
        table.warnings = self.warnings.finish();
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
            return Err(ImportError::UnclosedQuote { file: self.file.clone(), row: self.line });
        }
        if open {
            self.warnings.add("last row is cut off and left out", None, self.line);
            return Ok(());
        }
        carry.push(eol);
        self.last_row = true;
        match self.parse_row(&carry, 0)? {
            Row::Next(_) => Ok(()),
            Row::Unfinished => Err(ImportError::UnclosedQuote { file: self.file.clone(), row: self.line }),
        }
    }
}
