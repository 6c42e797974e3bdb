//! Logs of candump: `(1436509053.650713) can0 0B4#0011AA` and the console's `can0  0B4   [3]  00 11 AA`.

use std::rc::Rc;

use super::can::Frames;
use super::dbc::EXTENDED;
use super::grower::Zero;
use super::lines::{Lines, integer, nanoseconds, words};
use super::{Context, Reader};
use crate::error::{ImportError, form};
use crate::opening::Gathered;

/// Reads frames line by line.
pub(crate) struct Candump {
    file: Rc<str>,
    lines: Lines,
    body: Body,
}

struct Body {
    frames: Frames,
    interfaces: Vec<Vec<u8>>,
    other: (usize, usize),
    first: Option<i64>,
}

/// A frame of a line.
struct Line<'a> {
    time: i64,
    interface: &'a [u8],
    id: u32,
    data: [u8; 64],
    length: usize,
}

/// Whether a line is one of candump.
pub(crate) fn is_frame(line: &[u8]) -> bool {
    parse(line).is_some()
}

/// The frame of a line; a remote or error frame has no data.
fn parse(line: &[u8]) -> Option<Line<'_>> {
    let mut words = words(line.trim_ascii());
    let time = words.next()?.strip_prefix(b"(")?.strip_suffix(b")")?;
    let time = nanoseconds(time)?;
    let (interface, frame) = (words.next()?, words.next()?);
    let mut found = Line { time, interface, id: 0, data: [0; 64], length: 0 };
    let digits = if let Some(hash) = frame.iter().position(|&b| b == b'#') {
        let data = &frame[hash + 1..];
        // `##` and one digit of flags begin the data of CAN FD.
        let data = if data.first() == Some(&b'#') { data.get(2..)? } else { data };
        if data.first() != Some(&b'R') {
            let plain: Vec<u8> = data.iter().copied().filter(|b| *b != b'.' && *b != b'_').collect();
            for pair in plain.chunks_exact(2).take(64) {
                found.push(pair)?;
            }
        }
        &frame[..hash]
    } else {
        let length = words.next()?.strip_prefix(b"[")?.strip_suffix(b"]")?;
        for byte in words.take(integer(length)?.clamp(0, 64) as usize) {
            found.push(byte)?;
        }
        frame
    };
    let id = u32::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    found.id = if digits.len() > 3 { id & 0x1fff_ffff | EXTENDED } else { id };
    (id < 1 << 30 && matches!(digits.len(), 3 | 8)).then_some(found)
}

impl Line<'_> {
    fn push(&mut self, digits: &[u8]) -> Option<()> {
        self.data[self.length] = u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
        self.length += 1;
        Some(())
    }
}

impl Candump {
    pub fn new(context: Context) -> Self {
        let frames = Frames::new(&context);
        let body = Body { frames, interfaces: Vec::new(), other: (0, 0), first: None };
        Self { file: context.file, lines: Lines::default(), body }
    }
}

impl Body {
    fn line(&mut self, row: usize, line: &[u8]) -> Result<(), ImportError> {
        let Some(found) = parse(line) else {
            if !line.trim_ascii().is_empty() {
                self.other = (self.other.0 + 1, if self.other.0 == 0 { row } else { self.other.1 });
            }
            return Ok(());
        };
        let known = self.interfaces.iter().position(|i| i == found.interface);
        let index = known.unwrap_or_else(|| {
            self.interfaces.push(found.interface.to_vec());
            self.interfaces.len() - 1
        });
        self.first.get_or_insert(found.time);
        self.frames.frame(found.time, (index + 1).min(255) as u8, found.id, &found.data[..found.length])
    }
}

impl Reader for Candump {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        let body = &mut self.body;
        self.lines.feed(&self.file, bytes, &mut |row, line| body.line(row, line))
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let body = &mut self.body;
        self.lines.finish(&mut |row, line| body.line(row, line))?;
        if body.frames.count == 0 {
            return Err(form(&self.file, "all rows".into(), "frames of candump", "none", "log with `candump -l`"));
        }
        let (other, row) = body.other;
        if other > 0 {
            log.warn(format!("{}: rows that are no frame left out ({other}, first in row {row}).", self.file));
        }
        // Times since 1970, unless candump was told to count from zero.
        let zero = if body.first.is_some_and(|t| t > 900_000_000_000_000_000) { Zero::Unix } else { Zero::Unknown };
        self.body.frames.finish("candump", zero, log);
        Ok(())
    }

    fn rows(&self) -> usize {
        self.body.frames.count
    }
}
