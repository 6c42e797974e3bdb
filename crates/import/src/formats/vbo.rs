//! Racelogic VBO: a header of sections, then rows of numbers between spaces.

use std::rc::Rc;

use super::grower::{Grower, Zero, is, turned};
use super::lines::{Lines, integer, nanoseconds, number, words};
use super::{Context, Reader};
use crate::error::{ImportError, decode, excerpt, form};
use crate::opening::Gathered;
use crate::table::Meaning;

const DAY: i64 = 86_400_000_000_000;

/// Standard channels by short name: unit after reading, what they are, and the factor of reading.
/// Places are minutes of arc, longitude counts west.
const KNOWN: [(&str, &str, Option<Meaning>, f64); 8] = [
    ("lat", "deg", is("gnss_lat"), 1.0 / 60.0),
    ("long", "deg", is("gnss_lon"), -1.0 / 60.0),
    ("velocity", "km/h", is("gnss_speed"), 1.0),
    ("heading", "deg", is("course"), 1.0),
    ("height", "m", is("gnss_alt"), 1.0),
    ("vert-vel", "km/h", turned("gnss_vd"), 1.0),
    ("Longacc", "g", None, 1.0),
    ("Latacc", "g", None, 1.0),
];

/// Reads the rows of a VBO file.
pub(crate) struct Vbo {
    file: Rc<str>,
    lines: Lines,
    body: Body,
}

struct Body {
    file: Rc<str>,
    part: String,
    section: Section,
    names: Vec<String>,
    units: Vec<String>,
    grower: Option<Grower>,
    factors: Vec<f64>,
    clock: usize,
    satellites: Option<usize>,
    days: i64,
    previous: i64,
    row: Vec<f64>,
    cut: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Section {
    Other,
    Units,
    Names,
    Data,
}

impl Vbo {
    pub fn new(context: Context) -> Self {
        let body = Body {
            file: context.file.clone(),
            part: context.part,
            section: Section::Other,
            names: Vec::new(),
            units: Vec::new(),
            grower: None,
            factors: Vec::new(),
            clock: 0,
            satellites: None,
            days: 0,
            previous: 0,
            row: Vec::new(),
            cut: 0,
        };
        Self { file: context.file, lines: Lines::default(), body }
    }
}

impl Body {
    fn line(&mut self, row: usize, line: &[u8]) -> Result<(), ImportError> {
        let line = line.trim_ascii();
        if line.first() == Some(&b'[') && line.last() == Some(&b']') {
            self.section = match line.to_ascii_lowercase().as_slice() {
                b"[channel units]" => Section::Units,
                b"[column names]" => Section::Names,
                b"[data]" => Section::Data,
                _ => Section::Other,
            };
            return if self.section == Section::Data { self.begin(row) } else { Ok(()) };
        }
        match self.section {
            _ if line.is_empty() => Ok(()),
            Section::Other => Ok(()),
            Section::Units => {
                self.units.push(decode(line));
                Ok(())
            }
            Section::Names => {
                self.names.extend(words(line).map(decode));
                Ok(())
            }
            Section::Data => self.data(row, line),
        }
    }

    fn begin(&mut self, row: usize) -> Result<(), ImportError> {
        let find = |name: &str| self.names.iter().position(|n| n.eq_ignore_ascii_case(name));
        let Some(clock) = find("time") else {
            let found = crate::error::name_list(self.names.iter().map(String::as_str));
            let advice = "export the file again from the logger's software";
            return Err(form(&self.file, format!("row {row}"), "a column `time` under [column names]", &found, advice));
        };
        (self.clock, self.satellites) = (clock, find("sats"));
        let mut grower = Grower::new(&self.file, &self.part);
        // The units listed are those of the channels beyond the standard ones, at the end of the names.
        let plain = self.names.len().saturating_sub(self.units.len());
        for (i, name) in self.names.iter().enumerate() {
            let known = KNOWN.iter().find(|(n, ..)| n.eq_ignore_ascii_case(name));
            let listed = i.checked_sub(plain).map_or("", |j| self.units[j].trim_matches(['(', ')']));
            match known {
                Some((_, unit, meaning, _)) => grower.column(name, unit, *meaning),
                None if self.satellites == Some(i) => grower.column(name, "", is("gnss_nsat")),
                None => grower.column(name, listed, None),
            }
            self.factors.push(known.map_or(1.0, |(.., factor)| *factor));
        }
        self.grower = Some(grower);
        Ok(())
    }

    fn data(&mut self, row: usize, line: &[u8]) -> Result<(), ImportError> {
        let Some(grower) = &mut self.grower else { return Ok(()) };
        self.row.clear();
        let mut time = None;
        for (i, word) in words(line).enumerate() {
            let value = number(word).ok_or_else(|| ImportError::NotANumber {
                file: self.file.to_string(),
                row,
                column: self.names.get(i).cloned().unwrap_or_default(),
                found: excerpt(word),
            })?;
            if i == self.clock {
                time = time_of_day(word);
                self.row.push(f64::NAN);
            } else if self.satellites == Some(i) {
                // 64 marks the brake trigger, 128 a differential fix.
                self.row.push(f64::from(value as u32 & 63));
            } else {
                self.row.push(value * self.factors.get(i).copied().unwrap_or(1.0));
            }
        }
        let Some(time) = time.filter(|_| self.row.len() == self.names.len()) else {
            self.cut += 1;
            return Ok(());
        };
        self.days += i64::from(time < self.previous - DAY / 2);
        self.previous = time;
        grower.row(self.days * DAY + time, &self.row)
    }
}

/// `hhmmss.ss` as nanoseconds since midnight; the leading zeros may be missing.
fn time_of_day(text: &[u8]) -> Option<i64> {
    let point = text.iter().position(|&b| b == b'.').unwrap_or(text.len());
    let whole = integer(&text[..point]).filter(|t| (0..240_000).contains(t))?;
    let part = nanoseconds(&[b"0".as_slice(), &text[point..]].concat())?;
    Some(((whole / 10_000 * 60 + whole / 100 % 100) * 60 + whole % 100) * 1_000_000_000 + part)
}

impl Reader for Vbo {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        let body = &mut self.body;
        self.lines.feed(&self.file, bytes, &mut |row, line| body.line(row, line))
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let body = &mut self.body;
        self.lines.finish(&mut |row, line| body.line(row, line))?;
        if body.cut > 0 {
            log.warn(format!("{}: rows with another number of cells than names left out ({}).", self.file, body.cut));
        }
        let table = self.body.grower.and_then(|g| g.finish("VBO", Zero::Midnight)).ok_or_else(|| {
            let advice = "check that the recording was not cut off";
            form(&self.file, "[data]".into(), "rows of data under [data]", "none", advice)
        })?;
        log.tables.push(table);
        Ok(())
    }

    fn rows(&self) -> usize {
        self.body.grower.as_ref().map_or(0, Grower::rows)
    }
}
