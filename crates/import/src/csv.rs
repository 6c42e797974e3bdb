//! Reading CSV in slices: only columns of numbers, one slice and one unfinished row are ever in memory.

use crate::csv_body::Body;
#[cfg(not(target_arch = "wasm32"))]
use crate::csv_body::Split;
use crate::dialect::{SniffError, sniff};
use crate::error::{ImportError, MAX_ROW_BYTES, MAX_TABLE_COLUMNS};
use crate::keep::Keep;
use crate::magic;
use crate::source::ByteSource;
use crate::table::Table;

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
    keep: Option<Keep>,
    #[cfg(not(target_arch = "wasm32"))]
    split: Option<Split>,
}

impl CsvReader {
    /// A reader for the file of this name.
    pub fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            expected_bytes: None,
            bytes: 0,
            head: Vec::new(),
            body: None,
            keep: None,
            #[cfg(not(target_arch = "wasm32"))]
            split: None,
        }
    }

    /// Say how long the file is, so that memory is asked for once.
    pub fn expect_bytes(&mut self, bytes: u64) {
        self.expected_bytes = Some(bytes);
    }

    /// Let at most so many threads parse a slice, each at least so many bytes of it; without this call, as many as the
    /// machine has, and 128 KiB. What is read does not depend on it.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn split(&mut self, threads: usize, least_bytes: usize) {
        self.split = Some(Split { threads, least_bytes });
    }

    /// Keep a part of the file only, and refuse it where it needs more memory than it may. Say it, and
    /// [`CsvReader::expect_bytes`], before the first slice.
    pub fn keep(&mut self, keep: Keep) {
        self.keep = Some(keep);
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
            Err(SniffError::UnclosedQuote(_)) if !last_look => return Ok(()),
            Err(SniffError::UnclosedQuote(row)) => return Err(ImportError::UnclosedQuote { file: file(), row }),
            Ok(_) if ends < 8 && !last_look => return Ok(()),
            Ok(_) if ends == 0 && !whole => {
                return Err(ImportError::RowTooLong { file: file(), row: 1, limit: MAX_ROW_BYTES });
            }
            Ok(dialect) => dialect,
        };
        let head = std::mem::take(&mut self.head);
        let start = dialect.body.0.min(head.len());
        let mut body = Body::new(file(), dialect)?;
        #[cfg(not(target_arch = "wasm32"))]
        self.split.iter().for_each(|s| body.split = *s);
        if let Some(keep) = &self.keep {
            body.keep(keep, &head[start..], self.expected_bytes)?;
        }
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
    let mut slice = vec![0; 2 << 20];
    loop {
        let count = source.read(&mut slice).map_err(|cause| ImportError::Read { file: file.to_owned(), cause })?;
        if count == 0 {
            return reader.finish();
        }
        reader.feed(&slice[..count.min(slice.len())])?;
    }
}
