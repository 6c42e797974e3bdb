//! NumPy `.npy` arrays, alone or as the members of a zip (`.npz`): columns that share the clock of their folder.

use std::rc::Rc;

use super::{Context, Reader};
use crate::error::{ImportError, form};
use crate::opening::Gathered;
use crate::order::sort_by;
use crate::table::{RawColumn, Table};

/// A header longer than this, bytes, is refused.
const LONGEST_HEADER: usize = 1 << 20;
/// Columns of one array beyond this are refused.
const WIDEST: usize = 1024;

/// An array of one or two dimensions, column by column.
#[derive(Clone, Debug)]
pub(crate) struct Array {
    /// Path without `.npy`.
    pub path: String,
    pub columns: Vec<Vec<f64>>,
}

/// How one number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Item {
    kind: u8,
    size: usize,
    big: bool,
}

impl Item {
    fn parse(descr: &str) -> Option<Self> {
        let bytes = descr.as_bytes();
        let (order, rest) = match bytes.first()? {
            b'<' | b'>' | b'|' | b'=' => (bytes[0], &descr[1..]),
            _ => (b'<', descr),
        };
        let (kind, size) = (*rest.as_bytes().first()?, rest.get(1..)?.parse().ok()?);
        let known = matches!((kind, size), (b'f', 4 | 8) | (b'i' | b'u', 1 | 2 | 4 | 8) | (b'b', 1));
        known.then_some(Self { kind, size, big: order == b'>' })
    }

    fn value(self, bytes: &[u8]) -> f64 {
        let mut raw = [0; 8];
        for (i, b) in bytes.iter().take(self.size).enumerate() {
            raw[if self.big { self.size - 1 - i } else { i }] = *b;
        }
        let unsigned = u64::from_le_bytes(raw);
        let unused = 64 - 8 * self.size as u32;
        match (self.kind, self.size) {
            (b'f', 4) => f64::from(f32::from_bits(unsigned as u32)),
            (b'f', _) => f64::from_bits(unsigned),
            (b'i', _) => (((unsigned << unused) as i64) >> unused) as f64,
            _ => unsigned as f64,
        }
    }
}

/// Reads one array.
pub(crate) struct Npy {
    file: Rc<str>,
    path: String,
    carry: Vec<u8>,
    body: Option<Body>,
}

struct Body {
    /// `None` for an array of something other than numbers, which is passed over.
    item: Option<Item>,
    rows: usize,
    fortran: bool,
    columns: Vec<Vec<f64>>,
    count: usize,
}

impl Npy {
    pub fn new(context: Context) -> Self {
        let path = if context.part.is_empty() { context.file.to_string() } else { context.part };
        let path = path.strip_suffix(".npy").map(str::to_owned).unwrap_or(path);
        Self { file: context.file, path, carry: Vec::new(), body: None }
    }

    fn bad(&self, place: &str, expected: &str, found: &str) -> ImportError {
        form(&self.file, format!("`{}`, {place}", self.path), expected, found, "save the array again with numpy.save")
    }

    /// Read the header once all of it is there; how long it is.
    fn header(&mut self) -> Result<Option<usize>, ImportError> {
        let head = &self.carry;
        let long = head.get(6).is_some_and(|v| *v > 1);
        let start = if long { 12 } else { 10 };
        if head.len() < start {
            return Ok(None);
        }
        let length =
            u32::from_le_bytes([head[8], head[9], if long { head[10] } else { 0 }, if long { head[11] } else { 0 }]);
        let end = start + length as usize;
        if length as usize > LONGEST_HEADER {
            return Err(self.bad("offset 8", "a header of at most 1 MiB", &format!("{length} bytes")));
        }
        if head.len() < end {
            return Ok(None);
        }
        let text = String::from_utf8_lossy(&head[start..end]).into_owned();
        self.body = Some(self.body_of(&text)?);
        Ok(Some(end))
    }

    fn body_of(&self, text: &str) -> Result<Body, ImportError> {
        let after = |key: &str| text.split_once(key).map(|(_, rest)| rest.trim_start_matches([' ', ':']));
        let broken = |what: &str| self.bad("header", what, &crate::error::excerpt(text.as_bytes()));
        let descr = after("'descr'").ok_or_else(|| broken("a type under 'descr'"))?;
        let descr = descr.strip_prefix('\'').and_then(|d| d.split_once('\'')).map_or("", |(d, _)| d);
        let fortran = after("'fortran_order'").is_some_and(|v| v.starts_with("True"));
        let shape = after("'shape'").and_then(|s| s.strip_prefix('(')).and_then(|s| s.split_once(')'));
        let shape = shape.map(|(s, _)| s).ok_or_else(|| broken("dimensions under 'shape'"))?;
        let sizes: Result<Vec<usize>, _> =
            shape.split(',').map(str::trim).filter(|s| !s.is_empty()).map(str::parse).collect();
        let sizes = sizes.map_err(|_| broken("whole numbers under 'shape'"))?;
        let (rows, width) = match sizes.as_slice() {
            [] => (1, 1),
            [rows] => (*rows, 1),
            [rows, rest @ ..] => (*rows, rest.iter().fold(1usize, |a, b| a.saturating_mul(*b))),
        };
        if width > WIDEST {
            return Err(self.bad("header", &format!("at most {WIDEST} columns"), &width.to_string()));
        }
        Ok(Body { item: Item::parse(descr), rows, fortran, columns: vec![Vec::new(); width], count: 0 })
    }
}

impl Body {
    /// Take the numbers that `bytes` begin with; how many bytes they are, `None` if there is no memory.
    fn take(&mut self, bytes: &[u8]) -> Option<usize> {
        let Some(item) = self.item else { return Some(bytes.len()) };
        let width = self.columns.len();
        for number in bytes.chunks_exact(item.size) {
            if width == 0 || self.count / width >= self.rows {
                return Some(bytes.len());
            }
            let column = if self.fortran { self.count / self.rows } else { self.count % width };
            let column = &mut self.columns[column];
            if column.len() == column.capacity() {
                column.try_reserve_exact(column.len().max(256)).ok()?;
            }
            column.push(item.value(number));
            self.count += 1;
        }
        Some(bytes.len() - bytes.len() % item.size)
    }
}

impl Reader for Npy {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        self.carry.extend_from_slice(bytes);
        if self.body.is_none()
            && let Some(end) = self.header()?
        {
            self.carry.drain(..end);
        }
        let Some(body) = &mut self.body else { return Ok(()) };
        let Some(done) = body.take(&self.carry) else {
            let (file, row, columns) = (self.file.to_string(), body.count, body.columns.len());
            return Err(ImportError::OutOfMemory { file, row, columns });
        };
        self.carry.drain(..done);
        Ok(())
    }

    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let Some(body) = &self.body else {
            return Err(self.bad("header", "a whole header", "the end of the file"));
        };
        if body.item.is_none() {
            log.warn(format!("{}: `{}` holds no plain numbers and was left out.", self.file, self.path));
            return Ok(());
        }
        let total = body.rows.saturating_mul(body.columns.len());
        if body.count < total {
            let expected = format!("{total} numbers as its header says");
            return Err(self.bad("end of the file", &expected, &body.count.to_string()));
        }
        let columns = self.body.map(|b| b.columns).unwrap_or_default();
        log.arrays.push((self.file, Array { path: self.path, columns }));
        Ok(())
    }

    fn rows(&self) -> usize {
        self.body.as_ref().map_or(0, |b| b.columns.first().map_or(0, Vec::len))
    }
}

/// Folder and own name of a path.
fn split(path: &str) -> (&str, &str) {
    path.rsplit_once('/').unwrap_or(("", path))
}

/// The beginning that the arrays over this clock share: all of the folder for `t`, `imu` for `imu_t`.
fn clock_stem(name: &str) -> Option<&str> {
    const CLOCKS: [&str; 5] = ["timestamps", "timestamp", "times", "time", "t"];
    CLOCKS.iter().find_map(|c| {
        let stem = name.strip_suffix(c)?;
        (stem.is_empty() || stem.ends_with('_')).then_some(stem)
    })
}

/// Make tables of the arrays: each clock with the arrays of its length beside it, the rest on their own.
pub(crate) fn assemble(log: &mut Gathered) {
    let mut arrays = std::mem::take(&mut log.arrays);
    let length = |a: &Array| a.columns.first().map_or(0, Vec::len);
    let mut clocks: Vec<(Rc<str>, Array)> = Vec::new();
    arrays.retain(|(file, a)| {
        let is_clock = a.columns.len() == 1 && clock_stem(split(&a.path).1).is_some();
        if is_clock {
            clocks.push((file.clone(), a.clone()));
        }
        !is_clock
    });
    // `imu_t` before `t`: the longer stem is the nearer clock.
    sort_by(&mut clocks, |(_, a), (_, b)| b.path.len().cmp(&a.path.len()));
    for (file, clock) in clocks {
        let (folder, name) = split(&clock.path);
        let stem = clock_stem(name).unwrap_or_default();
        let mut columns = Vec::new();
        arrays.retain(|(_, a)| {
            let (place, own) = split(&a.path);
            let beside = place == folder && own.starts_with(stem) && length(a) == length(&clock);
            if beside {
                let label = if own == "value" { split(folder).1 } else { own };
                columns.extend(columns_of(label, a));
            }
            !beside
        });
        let part = if stem.is_empty() { folder } else { clock.path.as_str() };
        let time = RawColumn { name: "t".into(), values: clock.columns.concat(), ..RawColumn::default() };
        columns.insert(0, time);
        log.tables.push(table(&file, part, columns));
    }
    for (file, array) in arrays {
        let columns = columns_of(split(&array.path).1, &array);
        log.tables.push(table(&file, &array.path, columns));
    }
}

fn columns_of(label: &str, array: &Array) -> Vec<RawColumn> {
    let width = array.columns.len();
    let name = |i: usize| match width {
        1 => label.to_owned(),
        3 => format!("{label}_{}", ["x", "y", "z"][i]),
        _ => format!("{label}_{i}"),
    };
    let column = |(i, values): (usize, &Vec<f64>)| RawColumn {
        name: name(i),
        values: values.iter().map(|v| if v.is_finite() { *v } else { f64::NAN }).collect(),
        ..RawColumn::default()
    };
    array.columns.iter().enumerate().map(column).collect()
}

fn table(file: &str, part: &str, columns: Vec<RawColumn>) -> Table {
    let rows = columns.first().map_or(0, |c| c.values.len());
    Table { name: file.to_owned(), part: part.to_owned(), format: "NumPy", columns, rows, ..Table::default() }
}
