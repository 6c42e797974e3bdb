//! Vector BLF: bus frames as objects in compressed containers.
//!
//! Objects may run on from one container into the next. Source: the layout as python-can and Wireshark read it.

use std::rc::Rc;

use flate2::{Decompress, FlushDecompress};

use super::can::Frames;
use super::carry::{Carry, le};
use super::dbc::EXTENDED;
use super::grower::Zero;
use super::{Context, Reader};
use crate::error::{ImportError, form};
use crate::opening::Gathered;
use crate::stamp::days_since_1970;

const OBJECT: usize = 16;
/// An object longer than this, bytes, is refused.
const LONGEST: usize = 64 << 20;
const CONTAINER: u64 = 10;

/// Reads objects and the frames in them.
pub(crate) struct Blf {
    file: Rc<str>,
    outer: Carry,
    inner: Vec<u8>,
    start: Option<i64>,
    frames: Frames,
    lost: usize,
}

impl Blf {
    pub fn new(context: Context) -> Self {
        let frames = Frames::new(&context);
        Self { file: context.file, outer: Carry::default(), inner: Vec::new(), start: None, frames, lost: 0 }
    }

    fn bad(&self, offset: u64, expected: &str, found: &str) -> ImportError {
        form(&self.file, format!("offset {offset}"), expected, found, "copy the file again or save it as ASC")
    }

    /// The file header; whether all of it was there.
    fn header(&mut self) -> Result<bool, ImportError> {
        let Some(head) = self.outer.peek(72) else { return Ok(false) };
        let length = le(head, 4, 4) as usize;
        if !(72..=4096).contains(&length) {
            return Err(self.bad(4, "a header of 144 bytes", &format!("{length} bytes")));
        }
        let field = |i: usize| le(head, 40 + 2 * i, 2) as i64;
        let (year, month, day) = (field(0), field(1).clamp(1, 12), field(3).clamp(1, 31));
        let seconds =
            ((days_since_1970(year.clamp(1970, 2200), month, day) * 24 + field(4)) * 60 + field(5)) * 60 + field(6);
        let start = (year >= 1980).then_some(seconds * 1_000_000_000 + field(7) * 1_000_000);
        if self.outer.peek(length).is_none() {
            return Ok(false);
        }
        self.outer.consume(length);
        self.start = Some(start.unwrap_or(0));
        Ok(true)
    }

    fn objects(&mut self) -> Result<(), ImportError> {
        loop {
            self.skip_padding();
            let Some(head) = self.outer.peek(OBJECT) else { return Ok(()) };
            let (size, kind) = (le(head, 8, 4) as usize, le(head, 12, 4));
            if !(OBJECT..=LONGEST).contains(&size) {
                let found = format!("{size} bytes");
                return Err(self.bad(self.outer.offset(), "an object of at most 64 MiB", &found));
            }
            let Some(object) = self.outer.peek(size).map(<[u8]>::to_vec) else { return Ok(()) };
            if kind == CONTAINER {
                self.container(&object)?;
            } else {
                object_of(&object, &mut self.frames)?;
            }
            self.outer.consume(size);
        }
    }

    /// Between objects there are up to three bytes of padding; a damaged length leaves more to be passed over.
    fn skip_padding(&mut self) {
        while let Some(head) = self.outer.peek(4).filter(|h| *h != b"LOBJ") {
            let next = head[1..].iter().position(|b| *b == b'L').map_or(4, |i| i + 1);
            self.lost += next;
            self.outer.consume(next);
        }
    }

    fn container(&mut self, object: &[u8]) -> Result<(), ImportError> {
        let header = (le(object, 4, 2) as usize).max(OBJECT);
        let (method, unpacked) = (le(object, header, 2), le(object, header + 8, 4) as usize);
        let Some(data) = object.get(header + 16..) else { return Ok(()) };
        match method {
            0 => self.inner.extend_from_slice(data),
            2 => {
                let before = self.inner.len();
                let room = unpacked.min(LONGEST).min(data.len().saturating_mul(1100) + 64);
                self.inner.reserve(room);
                let status = Decompress::new(true).decompress_vec(data, &mut self.inner, FlushDecompress::Finish);
                if status.is_err() || self.inner.len() == before {
                    return Err(self.bad(self.outer.offset(), "deflated objects", "damaged data"));
                }
            }
            other => {
                let found = format!("compression method {other}");
                return Err(self.bad(self.outer.offset(), "a container stored or deflated", &found));
            }
        }
        let done = self.inner_objects()?;
        self.inner.drain(..done);
        Ok(())
    }

    /// Take the objects that the unpacked bytes begin with; how many bytes they are.
    fn inner_objects(&mut self) -> Result<usize, ImportError> {
        let mut pos = 0;
        loop {
            let rest = &self.inner[pos..];
            if rest.len() < OBJECT {
                return Ok(pos);
            }
            if !rest.starts_with(b"LOBJ") {
                pos += 1;
                self.lost += 1;
                continue;
            }
            let size = (le(rest, 8, 4) as usize).max(OBJECT);
            if size > LONGEST {
                pos += 4;
                self.lost += 4;
                continue;
            }
            let Some(object) = rest.get(..size) else { return Ok(pos) };
            object_of(object, &mut self.frames)?;
            pos += size;
        }
    }
}

/// The frame that an object holds, if it is one.
fn object_of(object: &[u8], frames: &mut Frames) -> Result<(), ImportError> {
    let (header, kind) = (le(object, 4, 2) as usize, le(object, 12, 4));
    let Some(body) = object.get(header..) else { return Ok(()) };
    // Both versions of the header have the time at the same place.
    let raw = le(object, 24, 8) as i64;
    let time = if le(object, 16, 4) == 1 { raw.saturating_mul(10_000) } else { raw };
    let (channel, id, data) = match kind {
        // CAN_MESSAGE and CAN_MESSAGE2.
        1 | 86 => {
            let length = (le(body, 3, 1) as usize).min(8);
            (le(body, 0, 2), le(body, 4, 4), body.get(8..8 + length))
        }
        // CAN_FD_MESSAGE.
        100 => {
            let length = (le(body, 14, 1) as usize).min(64);
            (le(body, 0, 2), le(body, 4, 4), body.get(20..20 + length))
        }
        // CAN_FD_MESSAGE_64.
        101 => {
            let length = (le(body, 2, 1) as usize).min(64);
            (le(body, 0, 1), le(body, 4, 4), body.get(40..40 + length))
        }
        _ => return Ok(()),
    };
    let Some(data) = data else { return Ok(()) };
    let id = id as u32;
    let id = if id & EXTENDED == 0 { id & 0x7ff } else { id & (EXTENDED | 0x1fff_ffff) };
    frames.frame(time, channel as u8, id, data)
}

impl Reader for Blf {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        self.outer.extend(bytes);
        if self.start.is_none() && !self.header()? {
            return Ok(());
        }
        self.objects()
    }

    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        if self.lost > 1024 {
            log.warn(format!("{}: bytes between objects passed over ({}).", self.file, self.lost));
        }
        if self.outer.left() > 16 {
            log.warn(format!("{}: the file ends inside an object; what came before was read.", self.file));
        }
        if self.frames.count == 0 {
            return Err(self.bad(self.outer.offset(), "frames of a CAN bus", "none"));
        }
        let zero = self.start.filter(|s| *s > 0).map_or(Zero::Unknown, Zero::At);
        self.frames.finish("BLF", zero, log);
        Ok(())
    }

    fn rows(&self) -> usize {
        self.frames.count
    }
}
