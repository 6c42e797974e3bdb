//! GPX tracks (1.0, 1.1): one row per track point with a time.

use std::rc::Rc;

use super::grower::{Grower, Zero, is};
use super::lines::number;
use super::{Context, Reader};
use crate::error::{ImportError, excerpt, form};
use crate::opening::Gathered;
use crate::stamp::{self, Stamp};
use crate::table::Meaning;

/// A tag or a text longer than this, bytes, is refused.
const LONGEST: usize = 1 << 20;

/// Elements of a point, by local name, and their columns.
const COLUMNS: [(&str, &str, Option<Meaning>); 9] = [
    ("lat", "deg", is("gnss_lat")),
    ("lon", "deg", is("gnss_lon")),
    ("ele", "m", is("gnss_alt")),
    ("speed", "m/s", is("gnss_speed")),
    ("course", "deg", is("course")),
    ("sat", "", is("gnss_nsat")),
    ("pdop", "", is("gnss_pdop")),
    ("hdop", "", None),
    ("bearing", "deg", is("course")),
];

/// Reads the points of all tracks in a row.
pub(crate) struct Gpx {
    file: Rc<str>,
    grower: Grower,
    carry: Vec<u8>,
    offset: u64,
    point: Option<Point>,
    points: usize,
    timeless: usize,
}

struct Point {
    values: [f64; COLUMNS.len()],
    time: Option<i64>,
    text: Vec<u8>,
}

impl Gpx {
    pub fn new(context: Context) -> Self {
        let grower = Grower::with(&context.file, &context.part, &COLUMNS);
        Self { file: context.file, grower, carry: Vec::new(), offset: 0, point: None, points: 0, timeless: 0 }
    }

    fn bad(&self, expected: &str, found: &str) -> ImportError {
        form(&self.file, format!("offset {}", self.offset), expected, found, "check that the export was not cut off")
    }

    /// Take the markup and texts that `bytes` begin with; how many bytes they are.
    fn take(&mut self, bytes: &[u8]) -> Result<usize, ImportError> {
        let mut pos = 0;
        while let Some(length) = bytes[pos..].iter().position(|&b| b == b'<') {
            let Some(end) = end_of_markup(&bytes[pos + length..]) else { break };
            if let Some(point) = &mut self.point {
                point.text.extend_from_slice(&bytes[pos..pos + length]);
            }
            let markup = &bytes[pos + length + 1..pos + length + end - 1];
            self.offset += (length + end) as u64;
            pos += length + end;
            self.markup(markup)?;
        }
        Ok(pos)
    }

    fn markup(&mut self, tag: &[u8]) -> Result<(), ImportError> {
        match tag.first() {
            Some(b'!' | b'?') => Ok(()),
            Some(b'/') => self.close(local(&tag[1..])),
            _ => {
                let name = local(tag);
                if matches!(name, b"trkpt" | b"rtept") {
                    self.open(tag)?;
                    if tag.ends_with(b"/") {
                        return self.close(name);
                    }
                } else if let Some(point) = &mut self.point {
                    point.text.clear();
                }
                Ok(())
            }
        }
    }

    fn open(&mut self, tag: &[u8]) -> Result<(), ImportError> {
        let mut values = [f64::NAN; COLUMNS.len()];
        for (i, name) in ["lat", "lon"].into_iter().enumerate() {
            let text = attribute(tag, name.as_bytes());
            values[i] = text.and_then(number).ok_or_else(|| {
                let found = text.map_or("none".into(), |t| format!("`{}`", excerpt(t)));
                self.bad(&format!("a number as the attribute `{name}` of a point"), &found)
            })?;
        }
        self.point = Some(Point { values, time: None, text: Vec::new() });
        Ok(())
    }

    fn close(&mut self, name: &[u8]) -> Result<(), ImportError> {
        let Some(point) = &mut self.point else { return Ok(()) };
        let text = std::mem::take(&mut point.text);
        if name == b"time" {
            point.time = match stamp::parse(text.trim_ascii()) {
                Some(Stamp::Instant(ns)) => Some(ns),
                _ => return Err(self.bad("a time such as 2024-05-31T12:00:00Z", &format!("`{}`", excerpt(&text)))),
            };
        } else if let Some(i) = COLUMNS.iter().position(|(n, ..)| n.as_bytes() == name) {
            point.values[i] = number(&text).unwrap_or(f64::NAN);
        } else if matches!(name, b"trkpt" | b"rtept")
            && let Some(point) = self.point.take()
        {
            self.points += 1;
            match point.time {
                Some(time) => self.grower.row(time, &point.values)?,
                None => self.timeless += 1,
            }
        }
        Ok(())
    }
}

/// Length of a tag, comment or CDATA section that `bytes` begin with; `None` if they end before it does.
fn end_of_markup(bytes: &[u8]) -> Option<usize> {
    let until = |end: &[u8]| bytes.windows(end.len()).position(|w| w == end).map(|i| i + end.len());
    if bytes.starts_with(b"<!--") {
        return until(b"-->");
    }
    if bytes.starts_with(b"<![CDATA[") {
        return until(b"]]>");
    }
    if bytes.len() < 9 && bytes.get(1).is_none_or(|b| *b == b'!') {
        return None;
    }
    until(b">")
}

/// The name of a tag without its namespace.
fn local(tag: &[u8]) -> &[u8] {
    let end = tag.iter().position(|b| b.is_ascii_whitespace() || *b == b'/').unwrap_or(tag.len());
    let name = &tag[..end];
    name.iter().rposition(|&b| b == b':').map_or(name, |i| &name[i + 1..])
}

/// The value of an attribute.
fn attribute<'a>(tag: &'a [u8], name: &[u8]) -> Option<&'a [u8]> {
    let mut rest = tag;
    while let Some(equals) = rest.iter().position(|&b| b == b'=') {
        let key = rest[..equals].trim_ascii_end();
        let key = key.iter().rposition(u8::is_ascii_whitespace).map_or(key, |i| &key[i + 1..]);
        let value = rest[equals + 1..].trim_ascii_start();
        let quote = *value.first()?;
        let end = value.get(1..)?.iter().position(|&b| b == quote)?;
        if key == name {
            return Some(&value[1..=end]);
        }
        rest = &value[end + 2..];
    }
    None
}

impl Reader for Gpx {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        let mut carry = std::mem::take(&mut self.carry);
        carry.extend_from_slice(bytes);
        let done = self.take(&carry)?;
        carry.drain(..done);
        if carry.len() > LONGEST + bytes.len() {
            return Err(self.bad("a tag of at most 1 MiB", "a longer one"));
        }
        self.carry = carry;
        Ok(())
    }

    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        if self.carry.contains(&b'<') || self.point.is_some() {
            log.warn(format!("{}: the file is cut off; what came before was read.", self.file));
        }
        if self.timeless > 0 && self.grower.rows() > 0 {
            log.warn(format!("{}: points without a time left out ({} of {}).", self.file, self.timeless, self.points));
        }
        let missing = format!("{} points, {} of them without one", self.points, self.timeless);
        let file = self.file.clone();
        let table = self.grower.finish("GPX", Zero::Unix).ok_or_else(|| {
            form(
                &file,
                "all points".into(),
                "track points with a <time>",
                &missing,
                "export the recorded track, not a route",
            )
        })?;
        log.tables.push(table);
        Ok(())
    }

    fn rows(&self) -> usize {
        self.grower.rows()
    }
}
