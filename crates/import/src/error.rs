//! Why a file does not become a drive: one sentence each, naming the place, what was expected and what was found.

use crate::offer::Offer;
use crate::source::ReadError;

/// Columns beyond this are refused.
pub const MAX_TABLE_COLUMNS: usize = 4096;
/// A row longer than this, bytes, is refused.
pub const MAX_ROW_BYTES: usize = 4 << 20;

/// What can be opened, for a sentence.
const OPENABLE: &str = "CSV, MDF 4, BLF, ASC and candump with their DBC, MCAP, ROS 1 bag, PX4 ULog, NMEA, GPX, VBO, OxTS, \
                        NumPy, OpenXC, and these in ZIP or gzip";

/// Why a file does not become a drive. `Display` is the sentence for people.
///
/// Rows are lines of the file as an editor counts them, the first being 1.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[allow(missing_docs, reason = "the fields say what their names say; each sentence is the variant's doc")]
pub enum ImportError {
    /// The file holds nothing.
    #[error("{file}: expected a header row and rows of numbers, found an empty file; record or export the log again.")]
    Empty { file: String },
    /// The file is in a format that is known by its first bytes and not read.
    #[error("{file}: expected a log, found {found}; what can be opened: {OPENABLE}.")]
    OtherFormat { file: String, found: &'static str },
    /// The file is not text.
    #[error(
        "{file}, row {row}: expected text, found binary data (byte {byte:#04x} at offset {offset}) of an unknown format; what can be opened: {OPENABLE}."
    )]
    Binary { file: String, row: usize, byte: u8, offset: usize },
    /// More columns than a log has.
    #[error("{file}, row {row}: expected at most {limit} columns, found more; choose the columns to export.")]
    TooManyColumns { file: String, row: usize, limit: usize },
    /// A row without end.
    #[error(
        "{file}, row {row}: expected a line of at most {limit} bytes, found a longer one; check that this is a CSV file."
    )]
    RowTooLong { file: String, row: usize, limit: usize },
    /// A quote that is never closed.
    #[error(
        "{file}, row {row}: expected a closing quote, found none; close or remove the quote that opens in this row."
    )]
    UnclosedQuote { file: String, row: usize },
    /// A row with another number of cells than the header.
    #[error(
        "{file}, row {row}: expected {expected} cells as in {reference}, found {found}; complete or delete the row."
    )]
    Ragged { file: String, row: usize, expected: usize, found: usize, reference: String },
    /// Text where the column holds numbers.
    #[error(
        "{file}, row {row}, column `{column}`: expected a number, found `{found}`; correct the cell or leave it blank."
    )]
    NotANumber { file: String, row: usize, column: String, found: String },
    /// Text where the column holds date and time.
    #[error(
        "{file}, row {row}, column `{column}`: expected a time such as 2024-05-31 12:00:00.5, found `{found}`; correct the cell or delete the row."
    )]
    NotATime { file: String, row: usize, column: String, found: String },
    /// Fewer than two rows.
    #[error(
        "{file}: expected at least 2 rows of data, found {found} ({place}); check that the recording or the export was not cut off."
    )]
    TooFewRows { file: String, found: usize, place: String },
    /// No column tells the time.
    #[error(
        "{file}, {place}: expected a time column (`t`, `time`, `timestamp`, ..), found {found}; name one column so or give a mapping."
    )]
    NoTime { file: String, place: String, found: String },
    /// The time column has too few values.
    #[error(
        "{file}, column `{column}`: expected at least 2 different times, found {found}; check the export of this column."
    )]
    TooFewTimes { file: String, column: String, found: usize },
    /// Time goes back.
    #[error(
        "{file}, row {row}, column `{column}`: expected a time after {previous} (row {previous_row}), found {found}; time runs backwards here: sort the rows by time or cut the file in two."
    )]
    TimeBackwards { file: String, row: usize, column: String, found: f64, previous: f64, previous_row: usize },
    /// Nothing that an estimator could use.
    #[error(
        "{file}, {place}: expected a column with a known signal (`accel_x`, `gyro_z`, `speed`, `gnss_lat`, ..), found {found}; rename the columns or give a mapping."
    )]
    NoSignals { file: String, place: String, found: String },
    /// The mapping names a column that the file does not have.
    #[error(
        "{file}: expected the column `{column}` that the mapping gives for {signal}, found {found}; correct the mapping."
    )]
    UnknownColumn { file: String, signal: String, column: String, found: String },
    /// The mapping names a column that does not hold numbers.
    #[error(
        "{file}, column `{column}`: expected numbers for {signal} as the mapping says, found text such as `{found}`; correct the mapping."
    )]
    TextColumn { file: String, signal: String, column: String, found: String },
    /// The mapping is not JSON of the expected form.
    #[error(
        "{file}: expected a mapping as in {{\"version\": 1, \"time\": {{\"column\": \"t\"}}, \"signals\": {{..}}}}, found an error: {found}; correct the file."
    )]
    MappingForm { file: String, found: String },
    /// The mapping is of another version.
    #[error(
        "{file}: expected a mapping of version {expected}, found version {found}; save the mapping again with this version."
    )]
    MappingVersion { file: String, expected: u32, found: u32 },
    /// The mapping names a signal that does not exist.
    #[error("{file}: expected the canonical name of a signal in the mapping, found `{found}`; {suggestion}.")]
    UnknownSignal { file: String, found: String, suggestion: String },
    /// The mapping gives a unit that does not fit.
    #[error("{file}: expected a unit of {signal} that converts to {expected}, found `{found}`; {suggestion}.")]
    UnknownUnit { file: String, signal: String, expected: String, found: String, suggestion: String },
    /// The mapping gives a scale or an offset that is no number or zero.
    #[error(
        "{file}: expected a finite {field} for {signal} in the mapping (a scale is not 0), found {found}; correct the mapping."
    )]
    BadFactor { file: String, signal: String, field: &'static str, found: f64 },
    /// A table of raw ranges lacks a column.
    #[error(
        "{file}, {place}: expected the column `{column}` of a table of raw ranges (`t`, `prn`, `sat_x`, .., `pr`), found {found}; rename the columns."
    )]
    RawColumn { file: String, place: String, column: &'static str, found: String },
    /// A row of raw ranges whose satellite has no number.
    #[error(
        "{file}, row {row}, column `prn`: expected the number of a satellite, found {found}; correct the cell or delete the row."
    )]
    RawRow { file: String, row: usize, found: f64 },
    /// There is no memory for the columns.
    #[error(
        "{file}, row {row}: expected to hold {columns} columns in memory, found no more of it; choose fewer columns or cut the file."
    )]
    OutOfMemory { file: String, row: usize, columns: usize },
    /// The file would take more memory than it may.
    #[error(
        "{file}: expected a log that fits into {limit} MB, found one that needs about {needed} MB ({rows} rows of {columns} columns); read {offer}."
    )]
    TooLarge { file: String, needed: u64, limit: u64, rows: u64, columns: usize, offer: Offer },
    /// Something in a file of a known format that is not as the format has it.
    #[error("{file}, {place}: expected {expected}, found {found}; {advice}.")]
    Form { file: String, place: String, expected: String, found: String, advice: &'static str },
    /// No file held anything to read.
    #[error("{sentence}")]
    Nothing { sentence: String },
    /// The system stopped the reading.
    #[error("{file}: expected to read to its end, found that reading stopped: {cause}; try again.")]
    Read { file: String, cause: ReadError },
}

/// [`ImportError::Form`] from borrowed parts.
pub(crate) fn form(file: &str, place: String, expected: &str, found: &str, advice: &'static str) -> ImportError {
    ImportError::Form { file: file.to_owned(), place, expected: expected.to_owned(), found: found.to_owned(), advice }
}

impl ImportError {
    /// The row that the sentence names, if any.
    pub fn row(&self) -> Option<usize> {
        match self {
            Self::Binary { row, .. }
            | Self::TooManyColumns { row, .. }
            | Self::RowTooLong { row, .. }
            | Self::UnclosedQuote { row, .. }
            | Self::Ragged { row, .. }
            | Self::NotANumber { row, .. }
            | Self::NotATime { row, .. }
            | Self::TimeBackwards { row, .. }
            | Self::RawRow { row, .. }
            | Self::OutOfMemory { row, .. } => Some(*row),
            _ => None,
        }
    }

    /// The column that the sentence names, if any.
    pub fn column(&self) -> Option<&str> {
        match self {
            Self::NotANumber { column, .. }
            | Self::NotATime { column, .. }
            | Self::TooFewTimes { column, .. }
            | Self::TimeBackwards { column, .. }
            | Self::UnknownColumn { column, .. }
            | Self::TextColumn { column, .. } => Some(column),
            _ => None,
        }
    }
}

/// A few names for a sentence, each in backquotes.
pub(crate) fn name_list<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    const SHOWN: usize = 8;
    let count = names.len();
    if count == 0 {
        return "no column of numbers".into();
    }
    let shown: Vec<String> = names.take(SHOWN).map(|n| format!("`{}`", excerpt(n.as_bytes()))).collect();
    let more = if count > SHOWN { format!(" and {} more", count - SHOWN) } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

/// The beginning of a cell, for a sentence: one line, printable, at most 40 characters.
pub(crate) fn excerpt(cell: &[u8]) -> String {
    const SHOWN: usize = 40;
    let text = decode(&cell[..cell.len().min(4 * SHOWN)]);
    let mut out = String::new();
    for c in text.chars().take(SHOWN) {
        if c.is_control() { out.extend(c.escape_default()) } else { out.push(c) }
    }
    if text.chars().nth(SHOWN).is_some() || cell.len() > 4 * SHOWN {
        out.push_str("..");
    }
    out
}

/// Text of bytes: UTF-8, else Latin-1, which gives every byte a character.
pub(crate) fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}
