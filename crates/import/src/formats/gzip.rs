//! gzip around any other format (RFC 1952), and members that have to be unpacked before they can be read.

use std::io::Write;

use flate2::write::MultiGzDecoder;

use super::{Context, Detecting, Reader};
use crate::error::{ImportError, form};
use crate::opening::Gathered;
use crate::source::MemorySource;

/// Compressed bytes taken at a time: deflate makes at most about a thousand times as many of them.
const PIECE: usize = 16 << 10;
/// Archives around archives beyond this are refused.
const DEPTH: usize = 4;
/// A member that has to be unpacked into memory may be this long.
const UNPACKED: usize = 1 << 30;

/// Reads gzip and hands its content to the reader of the format inside.
pub(crate) struct Gunzip {
    context: Context,
    offset: u64,
    decoder: MultiGzDecoder<Vec<u8>>,
    inner: Detecting,
}

impl Gunzip {
    pub fn new(context: Context) -> Self {
        let mut inner = Context { bytes: None, depth: context.depth + 1, ..context.clone() };
        let name = if inner.part.is_empty() { &*inner.file } else { inner.part.as_str() };
        inner.part = name.strip_suffix(".gz").unwrap_or(name).to_owned();
        Self { context, offset: 0, decoder: MultiGzDecoder::new(Vec::new()), inner: Detecting::new(inner) }
    }

    fn broken(&self, cause: &std::io::Error) -> ImportError {
        let (place, found) = (format!("offset {}", self.offset), format!("an error ({cause})"));
        form(&self.context.file, place, "gzip data", &found, "copy or download the file again")
    }
}

impl Reader for Gunzip {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        check_depth(&self.context)?;
        for piece in bytes.chunks(PIECE) {
            self.decoder.write_all(piece).map_err(|e| self.broken(&e))?;
            self.offset += piece.len() as u64;
            let out = self.decoder.get_mut();
            self.inner.feed(out)?;
            out.clear();
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        if let Err(cause) = self.decoder.try_finish() {
            log.warn(format!("{}: the gzip data is cut off ({cause}); what came before was read.", self.context.file));
        }
        let rest = std::mem::take(self.decoder.get_mut());
        self.inner.feed(&rest)?;
        Box::new(self.inner).finish(log)
    }

    fn rows(&self) -> usize {
        self.inner.rows()
    }
}

/// That there are not too many archives around a member.
pub(crate) fn check_depth(context: &Context) -> Result<(), ImportError> {
    if context.depth < DEPTH {
        return Ok(());
    }
    let found = format!("more of them around `{}`", context.part);
    let expected = format!("at most {DEPTH} archives inside each other");
    Err(form(&context.file, "archive".into(), &expected, &found, "unpack the file first"))
}

/// Keeps a member in memory, because its format is read from several places.
pub(crate) struct Unpack {
    context: Context,
    bytes: Vec<u8>,
}

impl Unpack {
    pub fn new(context: Context) -> Self {
        Self { context, bytes: Vec::new() }
    }
}

impl Reader for Unpack {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        if self.bytes.len() + bytes.len() > UNPACKED || self.bytes.try_reserve(bytes.len()).is_err() {
            let (file, place) = (&self.context.file, format!("member `{}`", self.context.part));
            let expected = format!("at most {UNPACKED} bytes to unpack into memory");
            return Err(form(file, place, &expected, "more", "unpack the file first and open what was in it"));
        }
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }

    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let source = MemorySource::new(&self.context.part, self.bytes);
        log.unpacked.push((source, Context { bytes: None, ..self.context }));
        Ok(())
    }
}
