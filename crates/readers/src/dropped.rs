//! A dropped file as a source of bytes.

use drivescope_import::{Format, ReadError, Source};
use js_sys::{ArrayBuffer, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{File, FileReaderSync};

/// Bytes that are read around a place of which fewer were asked for: formats with a directory ask for many short pieces.
const WINDOW: usize = 128 << 10;
/// Bytes that are read at once where a file is read from its beginning to its end: a browser answers a request of 16 MB in
/// little more time than one of 1 MB.
const AHEAD: usize = 16 << 20;
/// Bytes at the beginning of a file that tell its format.
const HEAD: usize = 8 << 10;

/// A dropped file. It is read when its bytes are asked for: no more is kept than a window of it and what was read ahead.
pub struct Dropped {
    file: File,
    name: String,
    length: u64,
    window: Vec<u8>,
    start: u64,
    /// What was read ahead stays with JavaScript, whose memory can shrink.
    ahead: Uint8Array,
    ahead_start: u64,
    /// Where the last large reading ended.
    next: u64,
}

impl Dropped {
    /// A source over the whole file; its name holds the folders above it where the page has put them there.
    pub fn new(file: File) -> Self {
        let (name, length) = (file.name(), file.size() as u64);
        let ahead = Uint8Array::new_with_length(0);
        Self { file, name, length, window: Vec::new(), start: 0, ahead, ahead_start: 0, next: 0 }
    }

    /// The format of the file.
    pub fn format(&mut self) -> Result<Format, ReadError> {
        let mut head = vec![0; HEAD];
        let count = self.read_at(0, &mut head)?;
        Ok(Format::detect(&head[..count], &self.name))
    }

    /// The bytes at `offset`, at most `length`.
    fn slice(&self, offset: u64, length: usize) -> Result<Uint8Array, ReadError> {
        let end = offset.saturating_add(length as u64).min(self.length);
        let read = || -> Result<JsValue, JsValue> {
            let blob = self.file.slice_with_f64_and_f64(offset.min(end) as f64, end as f64)?;
            Ok(FileReaderSync::new()?.read_as_array_buffer(&blob)?.into())
        };
        let buffer: ArrayBuffer = read().map_err(refused)?.unchecked_into();
        Ok(Uint8Array::new(&buffer))
    }

    /// Many bytes at once, from what was read ahead if the file is read in order.
    fn many(&mut self, offset: u64, length: usize) -> Result<Uint8Array, ReadError> {
        let end = offset.saturating_add(length as u64).min(self.length);
        let held = |of: &Self| of.ahead_start <= offset && end <= of.ahead_start + u64::from(of.ahead.length());
        let goes_on = offset == self.next;
        self.next = end;
        if !held(self) {
            if !goes_on || length >= AHEAD {
                return self.slice(offset, length);
            }
            self.ahead = self.slice(offset, AHEAD)?;
            self.ahead_start = offset;
        }
        let from = (offset.min(self.length) - self.ahead_start) as u32;
        Ok(self.ahead.subarray(from, from + end.saturating_sub(offset) as u32))
    }
}

fn refused(reason: JsValue) -> ReadError {
    let name = js_sys::Reflect::get(&reason, &"name".into()).ok().and_then(|n| n.as_string());
    let name = name.unwrap_or_else(|| "no reason given".into());
    ReadError { message: format!("the browser refused ({name}), perhaps because the file was changed or moved") }
}

impl Source for Dropped {
    fn name(&self) -> &str {
        &self.name
    }

    fn len(&self) -> u64 {
        self.length
    }

    fn read_at(&mut self, offset: u64, buf: &mut [u8]) -> Result<usize, ReadError> {
        if buf.len() >= WINDOW {
            let bytes = self.many(offset, buf.len())?;
            let count = buf.len().min(bytes.length() as usize);
            bytes.copy_to(&mut buf[..count]);
            return Ok(count);
        }
        let end = offset.saturating_add(buf.len() as u64).min(self.length);
        if offset < self.start || end > self.start + self.window.len() as u64 {
            self.window = self.slice(offset, WINDOW)?.to_vec();
            self.start = offset;
        }
        let from = ((offset - self.start) as usize).min(self.window.len());
        let count = buf.len().min(self.window.len() - from);
        buf[..count].copy_from_slice(&self.window[from..from + count]);
        Ok(count)
    }
}
