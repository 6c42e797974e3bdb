//! NMEA 0183 sentences of a GNSS receiver (RMC, GGA, GLL, VTG, GSA, GST, ZDA): one row per time of fix.

use std::rc::Rc;

use super::grower::{Grower, Zero, is};
use super::lines::{Lines, integer, nanoseconds, number};
use super::{Context, Reader};
use crate::error::{ImportError, form};
use crate::opening::Gathered;
use crate::stamp::days_since_1970;
use crate::table::Meaning;

const DAY: i64 = 86_400_000_000_000;

const LAT: usize = 0;
const LON: usize = 1;
const ALT: usize = 2;
const SPEED: usize = 3;
const COURSE: usize = 4;
const SATELLITES: usize = 5;
const PDOP: usize = 6;
const VALID: usize = 7;
const STD_N: usize = 8;
const STD_E: usize = 9;
const STD_D: usize = 10;
const HDOP: usize = 11;
const GEOID: usize = 12;
const WIDTH: usize = 13;

const COLUMNS: [(&str, &str, Option<Meaning>); WIDTH] = [
    ("latitude", "deg", is("gnss_lat")),
    ("longitude", "deg", is("gnss_lon")),
    ("altitude", "m", is("gnss_alt")),
    ("speed over ground", "kn", is("gnss_speed")),
    ("course over ground", "deg", is("course")),
    ("satellites", "", is("gnss_nsat")),
    ("PDOP", "", is("gnss_pdop")),
    ("valid", "", is("gnss_valid")),
    ("latitude sigma", "m", is("gnss_std_n")),
    ("longitude sigma", "m", is("gnss_std_e")),
    ("altitude sigma", "m", is("gnss_std_d")),
    ("HDOP", "", None),
    ("geoid separation", "m", None),
];

/// Reads sentences; those of one time of day are one row.
pub(crate) struct Nmea {
    file: Rc<str>,
    lines: Lines,
    fixes: Fixes,
}

/// Rows in the making.
struct Fixes {
    grower: Grower,
    row: [f64; WIDTH],
    /// Time of day of the row and days since the first, ns.
    time: Option<i64>,
    days: i64,
    /// Day since 1970 minus `days`, as the first date says.
    first_day: Option<i64>,
    sentences: usize,
    damaged: (usize, usize),
    foreign: usize,
}

impl Nmea {
    pub fn new(context: Context) -> Self {
        let fixes = Fixes {
            grower: Grower::with(&context.file, &context.part, &COLUMNS),
            row: [f64::NAN; WIDTH],
            time: None,
            days: 0,
            first_day: None,
            sentences: 0,
            damaged: (0, 0),
            foreign: 0,
        };
        Self { file: context.file, lines: Lines::default(), fixes }
    }
}

/// Whether a line holds a sentence: `$`, a talker and a type, a comma.
pub(crate) fn is_sentence(line: &[u8]) -> bool {
    let Some(start) = line.iter().position(|&b| b == b'$') else { return false };
    let body = &line[start + 1..];
    let comma = body.iter().position(|&b| b == b',').unwrap_or(0);
    comma == 5
        && matches!(&body[..2], b"GP" | b"GN" | b"GL" | b"GA" | b"GB" | b"BD" | b"GQ" | b"GI" | b"QZ")
        && body[2..5].iter().all(u8::is_ascii_uppercase)
}

/// The content between `$` and `*`, if the checksum, where there is one, is right.
fn content(line: &[u8]) -> Option<&[u8]> {
    let body = &line[line.iter().position(|&b| b == b'$')? + 1..];
    let Some(star) = body.iter().position(|&b| b == b'*') else { return Some(body) };
    let sum = body[..star].iter().fold(0, |a, b| a ^ b);
    let stated = std::str::from_utf8(body.get(star + 1..star + 3)?).ok()?;
    (u8::from_str_radix(stated, 16) == Ok(sum)).then_some(&body[..star])
}

/// `hhmmss.ss` as nanoseconds since midnight.
fn time_of_day(text: &[u8]) -> Option<i64> {
    if text.len() < 6 || !text[..6].iter().all(u8::is_ascii_digit) {
        return None;
    }
    let (hours, minutes) = (integer(&text[..2])?, integer(&text[2..4])?);
    let seconds = nanoseconds(&text[4..])?;
    (hours < 24 && minutes < 60 && seconds < 61_000_000_000)
        .then_some((hours * 60 + minutes) * 60_000_000_000 + seconds)
}

/// `ddmm.mmmm` and `N`, `S`, `E` or `W` as degrees.
fn angle(value: &[u8], side: &[u8]) -> f64 {
    let sign = match side {
        b"N" | b"E" => 1.0,
        b"S" | b"W" => -1.0,
        _ => return f64::NAN,
    };
    let raw = number(value).unwrap_or(f64::NAN);
    let degrees = (raw / 100.0).floor();
    sign * (degrees + (raw - 100.0 * degrees) / 60.0)
}

impl Fixes {
    fn line(&mut self, row: usize, line: &[u8]) -> Result<(), ImportError> {
        if !is_sentence(line) {
            self.foreign += usize::from(!line.trim_ascii().is_empty());
            return Ok(());
        }
        let Some(body) = content(line) else {
            self.damaged = if self.damaged.0 == 0 { (1, row) } else { (self.damaged.0 + 1, self.damaged.1) };
            return Ok(());
        };
        let fields: Vec<&[u8]> = body.split(|&b| b == b',').map(<[u8]>::trim_ascii).collect();
        self.sentences += 1;
        self.sentence(&fields)
    }

    fn sentence(&mut self, fields: &[&[u8]]) -> Result<(), ImportError> {
        let field = |i: usize| fields.get(i).copied().unwrap_or_default();
        let value = |i: usize| number(field(i)).unwrap_or(f64::NAN);
        match &field(0)[2..] {
            b"RMC" => {
                self.at(field(1))?;
                self.valid(f64::from(field(2) == b"A"));
                self.place(field(3), field(4), field(5), field(6));
                self.set(SPEED, value(7));
                self.set(COURSE, value(8));
                let date = field(9);
                if date.len() == 6 {
                    let year = integer(&date[4..]).map(|y| if y < 80 { 2000 + y } else { 1900 + y });
                    self.date(integer(&date[..2]), integer(&date[2..4]), year);
                }
            }
            b"GGA" => {
                self.at(field(1))?;
                self.place(field(2), field(3), field(4), field(5));
                self.valid(f64::from(value(6) > 0.0));
                self.set(SATELLITES, value(7));
                self.set(HDOP, value(8));
                self.set(ALT, value(9));
                self.set(GEOID, value(11));
            }
            b"GLL" => {
                self.at(field(5))?;
                self.place(field(1), field(2), field(3), field(4));
            }
            b"VTG" => {
                self.set(COURSE, value(1));
                self.set(SPEED, value(5));
            }
            b"GSA" => self.set(PDOP, value(15)),
            b"GST" => {
                self.at(field(1))?;
                [(STD_N, 6), (STD_E, 7), (STD_D, 8)].into_iter().for_each(|(column, i)| self.set(column, value(i)));
            }
            b"ZDA" => {
                self.at(field(1))?;
                self.date(integer(field(2)), integer(field(3)), integer(field(4)));
            }
            _ => self.sentences -= 1,
        }
        Ok(())
    }

    fn set(&mut self, column: usize, value: f64) {
        if value.is_finite() {
            self.row[column] = value;
        }
    }

    fn place(&mut self, lat: &[u8], north: &[u8], lon: &[u8], east: &[u8]) {
        self.set(LAT, angle(lat, north));
        self.set(LON, angle(lon, east));
    }

    /// One sentence that says the fix is void is enough.
    fn valid(&mut self, valid: f64) {
        let before = self.row[VALID];
        self.row[VALID] = if before.is_nan() { valid } else { before.min(valid) };
    }

    fn date(&mut self, day: Option<i64>, month: Option<i64>, year: Option<i64>) {
        if let (None, Some(day @ 1..=31), Some(month @ 1..=12), Some(year @ 1980..=2200)) =
            (self.first_day, day, month, year)
        {
            self.first_day = Some(days_since_1970(year, month, day) - self.days);
        }
    }

    /// A sentence of this time of day comes: another time ends the row.
    fn at(&mut self, text: &[u8]) -> Result<(), ImportError> {
        let Some(of_day) = time_of_day(text) else { return Ok(()) };
        let before = self.time.map(|t| t - self.days * DAY);
        if before == Some(of_day) {
            return Ok(());
        }
        self.end_row()?;
        self.days += i64::from(before.is_some_and(|b| of_day < b - DAY / 2));
        self.time = Some(self.days * DAY + of_day);
        Ok(())
    }

    fn end_row(&mut self) -> Result<(), ImportError> {
        let row = std::mem::replace(&mut self.row, [f64::NAN; WIDTH]);
        match self.time {
            Some(time) if row.iter().any(|v| v.is_finite()) => self.grower.row(time, &row),
            _ => Ok(()),
        }
    }
}

impl Reader for Nmea {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        let fixes = &mut self.fixes;
        self.lines.feed(&self.file, bytes, &mut |row, line| fixes.line(row, line))
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let fixes = &mut self.fixes;
        self.lines.finish(&mut |row, line| fixes.line(row, line))?;
        fixes.end_row()?;
        let (damaged, row) = fixes.damaged;
        if damaged > 0 {
            log.warn(format!(
                "{}: NMEA sentences with a wrong checksum left out ({damaged}, first in row {row}).",
                self.file
            ));
        }
        if fixes.foreign > 0 {
            log.warn(format!("{}: lines that are no GNSS sentence left out ({}).", self.file, fixes.foreign));
        }
        if let Some(first) = self.fixes.first_day {
            self.fixes.grower.shift(first.saturating_mul(DAY));
        }
        let zero = if self.fixes.first_day.is_some() { Zero::Unix } else { Zero::Midnight };
        let table = self.fixes.grower.finish("NMEA", zero).ok_or_else(|| {
            let found = format!("{} of them, none with a time", self.fixes.sentences);
            form(&self.file, "all rows".into(), "RMC or GGA sentences", &found, "have the receiver send RMC and GGA")
        })?;
        log.tables.push(table);
        Ok(())
    }

    fn rows(&self) -> usize {
        self.fixes.grower.rows()
    }
}
