//! ZIP archives (with ZIP64): every member is read by the reader of its own format.

use std::collections::VecDeque;

use flate2::{Decompress, FlushDecompress, Status};

use super::gzip::check_depth;
use super::{Context, Detecting, Reader, Seeking};
use crate::error::{ImportError, decode, form};
use crate::opening::Gathered;
use crate::order::sort_by;
use crate::source::Source;

/// Compressed bytes of a member that one step takes.
const SLICE: usize = 256 << 10;
/// Unpacked bytes handed on at a time.
const OUT: usize = 128 << 10;
/// A directory longer than this, bytes, is refused.
const LONGEST_DIRECTORY: u64 = 256 << 20;

/// A member as the directory has it.
#[derive(Clone, Debug)]
struct Member {
    name: String,
    method: u16,
    packed: u64,
    unpacked: u64,
    header: u64,
    encrypted: bool,
}

/// Reads the members one after the other.
pub(crate) struct Zip {
    context: Context,
    members: Option<VecDeque<Member>>,
    count: usize,
    current: Option<Current>,
}

/// A member that is being read.
struct Current {
    member: Member,
    offset: u64,
    end: u64,
    inflate: Option<Decompress>,
    reader: Detecting,
    out: Vec<u8>,
}

fn le(bytes: &[u8], at: usize, size: usize) -> u64 {
    bytes.get(at..at + size).unwrap_or_default().iter().rev().fold(0, |v, b| v << 8 | u64::from(*b))
}

impl Zip {
    pub fn new(context: Context) -> Self {
        Self { context, members: None, count: 0, current: None }
    }

    fn bad(&self, place: &str, expected: &str, found: &str) -> ImportError {
        form(&self.context.file, place.into(), expected, found, "copy or download the archive again")
    }

    fn read(&self, source: &mut dyn Source, offset: u64, length: usize) -> Result<Vec<u8>, ImportError> {
        let mut bytes = vec![0; length];
        let failed = |cause| ImportError::Read { file: self.context.file.to_string(), cause };
        let count = source.read_at(offset, &mut bytes).map_err(failed)?;
        bytes.truncate(count);
        Ok(bytes)
    }

    fn directory(&self, source: &mut dyn Source) -> Result<Vec<Member>, ImportError> {
        let tail = source.len().min(66_000);
        let start = source.len() - tail;
        let bytes = self.read(source, start, tail as usize)?;
        let end = bytes.windows(4).rposition(|w| w == b"PK\x05\x06");
        let Some(end) = end else {
            return Err(self.bad("end of the file", "the archive's directory", "none"));
        };
        let (mut size, mut offset) = (le(&bytes, end + 12, 4), le(&bytes, end + 16, 4));
        if (size == 0xffff_ffff || offset == 0xffff_ffff) && end >= 20 {
            let large = self.read(source, le(&bytes, end - 20 + 8, 8), 56)?;
            if large.starts_with(b"PK\x06\x06") {
                (size, offset) = (le(&large, 40, 8), le(&large, 48, 8));
            }
        }
        if size > LONGEST_DIRECTORY.min(source.len()) {
            return Err(self.bad("end of the file", "a directory inside the file", &format!("one of {size} bytes")));
        }
        let bytes = self.read(source, offset, size as usize)?;
        let mut members = Vec::new();
        let mut at = 0;
        while bytes.get(at..at + 4) == Some(b"PK\x01\x02") {
            let (name, extra, comment) = (le(&bytes, at + 28, 2), le(&bytes, at + 30, 2), le(&bytes, at + 32, 2));
            let (name, extra) = (name as usize, extra as usize);
            members.extend(member(&bytes, at, name, extra));
            at += 46 + name + extra + comment as usize;
        }
        Ok(members)
    }

    fn begin(&self, source: &mut dyn Source, member: Member) -> Result<Current, ImportError> {
        let place = format!("member `{}`", member.name);
        if member.encrypted {
            return Err(self.bad(&place, "a member that can be read", "an encrypted one"));
        }
        let inflate = match member.method {
            0 => None,
            8 => Some(Decompress::new(false)),
            other => {
                let found = format!("compression method {other}");
                return Err(self.bad(&place, "a stored or deflated member", &found));
            }
        };
        let head = self.read(source, member.header, 30)?;
        if !head.starts_with(b"PK\x03\x04") || head.len() < 30 {
            return Err(self.bad(&place, &format!("its header at offset {}", member.header), "something else"));
        }
        let offset = member.header.saturating_add(30 + le(&head, 26, 2) + le(&head, 28, 2));
        // Deflate packs a thousandfold at most, and no more of it than the archive has: what is said beyond is not believed.
        let packed = member.packed.min(source.len().saturating_sub(offset));
        let context = Context {
            part: member.name.clone(),
            bytes: Some(member.unpacked).filter(|u| *u <= packed.saturating_mul(1100)),
            depth: self.context.depth + 1,
            ..self.context.clone()
        };
        let end = offset.saturating_add(member.packed);
        Ok(Current { member, offset, end, inflate, reader: Detecting::new(context), out: vec![0; OUT] })
    }

    /// One more piece of a member; whether there is more.
    fn piece(&self, source: &mut dyn Source, current: &mut Current) -> Result<bool, ImportError> {
        let wanted = current.end.saturating_sub(current.offset).min(SLICE as u64) as usize;
        let packed = self.read(source, current.offset, wanted)?;
        current.offset += packed.len() as u64;
        if packed.is_empty() {
            return Ok(false);
        }
        let Some(inflate) = &mut current.inflate else {
            current.reader.feed(&packed)?;
            return Ok(true);
        };
        let mut rest = packed.as_slice();
        loop {
            let (before, made) = (inflate.total_in(), inflate.total_out());
            let status = inflate.decompress(rest, &mut current.out, FlushDecompress::None).map_err(|_| {
                let place = format!("member `{}`", current.member.name);
                form(&self.context.file, place, "deflated data", "damaged data", "copy or download the archive again")
            })?;
            let (used, made) = ((inflate.total_in() - before) as usize, (inflate.total_out() - made) as usize);
            rest = &rest[used..];
            current.reader.feed(&current.out[..made])?;
            if status == Status::StreamEnd {
                return Ok(false);
            }
            if made == 0 && (used == 0 || rest.is_empty()) {
                return Ok(true);
            }
        }
    }

    /// A member that could not be read does not keep the others from being read.
    fn pass_over(&self, log: &mut Gathered, name: &str, error: &ImportError) {
        log.failures.push(format!("member `{name}` left out: {error}"));
    }
}

/// The member whose directory entry begins at `at`, unless it is a folder or a file that no log is.
fn member(bytes: &[u8], at: usize, name: usize, extra: usize) -> Option<Member> {
    // A name is said in sentences of one line.
    let text = decode(bytes.get(at + 46..at + 46 + name)?).replace(char::is_control, "?");
    let mut member = Member {
        method: le(bytes, at + 10, 2) as u16,
        packed: le(bytes, at + 20, 4),
        unpacked: le(bytes, at + 24, 4),
        header: le(bytes, at + 42, 4),
        encrypted: le(bytes, at + 8, 2) & 1 == 1,
        name: text,
    };
    let fields = bytes.get(at + 46 + name..at + 46 + name + extra)?;
    let mut pos = 0;
    while pos + 4 <= fields.len() {
        let (id, size) = (le(fields, pos, 2), le(fields, pos + 2, 2) as usize);
        let mut value = pos + 4;
        if id == 1 {
            for field in [&mut member.unpacked, &mut member.packed, &mut member.header] {
                if *field == 0xffff_ffff {
                    *field = le(fields, value, 8);
                    value += 8;
                }
            }
        }
        pos += 4 + size;
    }
    let file = member.name.rsplit('/').next().unwrap_or_default();
    let ending = file.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    let other = matches!(
        ending.as_str(),
        "png" | "jpg" | "jpeg" | "mp4" | "mov" | "hevc" | "md" | "pdf" | "bin" | "pcd" | "py" | "m4a" | "wav"
    );
    let hidden = file.is_empty() || file.starts_with('.') || member.name.starts_with("__MACOSX");
    (!hidden && !other && member.unpacked > 0).then_some(member)
}

impl Seeking for Zip {
    fn step(&mut self, source: &mut dyn Source, log: &mut Gathered) -> Result<f64, ImportError> {
        check_depth(&self.context)?;
        if self.members.is_none() {
            let mut members = self.directory(source)?;
            // Databases of bus signals first.
            let is_last = |m: &Member| !m.name.to_ascii_lowercase().ends_with(".dbc");
            sort_by(&mut members, |a, b| is_last(a).cmp(&is_last(b)));
            self.count = members.len();
            self.members = Some(members.into());
        }
        if let Some(mut current) = self.current.take() {
            match self.piece(source, &mut current) {
                Ok(true) => self.current = Some(current),
                Ok(false) => {
                    let name = current.member.name;
                    let finished: Box<dyn Reader> = Box::new(current.reader);
                    if let Err(error) = finished.finish(log) {
                        self.pass_over(log, &name, &error);
                    }
                }
                Err(error) => self.pass_over(log, &current.member.name, &error),
            }
        } else if let Some(member) = self.members.as_mut().and_then(VecDeque::pop_front) {
            let name = member.name.clone();
            self.context.dbc = log.dbc.clone();
            match self.begin(source, member) {
                Ok(current) => self.current = Some(current),
                Err(error) => self.pass_over(log, &name, &error),
            }
        } else {
            return Ok(1.0);
        }
        let left = self.members.as_ref().map_or(0, VecDeque::len) + usize::from(self.current.is_some());
        Ok(if left == 0 { 1.0 } else { 0.99 * (1.0 - left as f64 / (self.count + 1) as f64) })
    }

    fn rows(&self) -> usize {
        self.current.as_ref().map_or(0, |c| c.reader.rows())
    }
}
