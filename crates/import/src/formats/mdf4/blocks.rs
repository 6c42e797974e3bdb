//! Blocks of an MDF4 file: reading them one by one, and what the groups of records hold.

use super::channel::{Channel, Conversion};
use crate::error::{ImportError, decode, form};
use crate::formats::carry::le;
use crate::register::Numbered;
use crate::source::Source;

/// Bytes read around a block, so that its neighbours need no reading of their own.
const WINDOW: usize = 64 << 10;
/// A block of the structure longer than this, bytes, is refused.
const LONGEST: u64 = 16 << 20;
/// Channels of a file beyond this are refused.
const MOST_CHANNELS: usize = 200_000;
/// Structures inside structures beyond this are not followed.
const NESTED: usize = 8;

/// A block: its links and its data.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub id: [u8; 4],
    pub links: Vec<u64>,
    pub data: Vec<u8>,
}

impl Block {
    pub fn link(&self, index: usize) -> u64 {
        self.links.get(index).copied().unwrap_or(0)
    }
    pub fn number(&self, at: usize, size: usize) -> u64 {
        le(&self.data, at, size)
    }
}

/// Reads blocks through a window on the file.
pub(super) struct Blocks<'a> {
    source: &'a mut dyn Source,
    file: String,
    window: Vec<u8>,
    start: u64,
    seen: Numbered<()>,
    pub channels: usize,
}

impl<'a> Blocks<'a> {
    pub fn new(source: &'a mut dyn Source) -> Self {
        let file = source.name().to_owned();
        Self { source, file, window: Vec::new(), start: 0, seen: Numbered::default(), channels: 0 }
    }

    pub fn bad(&self, offset: u64, expected: &str, found: &str) -> ImportError {
        let advice = "copy the file again, or save it anew with the logger's software";
        form(&self.file, format!("offset {offset}"), expected, found, advice)
    }

    /// Length of the file.
    pub fn end(&self) -> u64 {
        self.source.len()
    }

    /// `length` bytes at `offset`, fewer at the end of the file.
    pub fn bytes(&mut self, offset: u64, length: usize) -> Result<&[u8], ImportError> {
        let inside =
            offset >= self.start && offset.saturating_add(length as u64) <= self.start + self.window.len() as u64;
        if !inside {
            self.window.resize(length.max(WINDOW), 0);
            let file = &self.file;
            let failed = |cause| ImportError::Read { file: file.clone(), cause };
            let count = self.source.read_at(offset, &mut self.window).map_err(failed)?;
            self.window.truncate(count);
            self.start = offset;
        }
        let from = ((offset - self.start) as usize).min(self.window.len());
        Ok(&self.window[from..(from + length).min(self.window.len())])
    }

    /// Kind and length of the block at `offset`.
    pub fn head(&mut self, offset: u64) -> Result<([u8; 4], u64, usize), ImportError> {
        let bytes = self.bytes(offset, 24)?;
        if bytes.len() < 24 || !bytes.starts_with(b"##") {
            let found = if bytes.len() < 24 { "the end of the file" } else { "something else" };
            return Err(self.bad(offset, "a block (##..)", found));
        }
        let (length, links) = (le(bytes, 8, 8), le(bytes, 16, 8));
        Ok(([bytes[0], bytes[1], bytes[2], bytes[3]], length, links.min(1 << 24) as usize))
    }

    /// The whole block at `offset`.
    pub fn block(&mut self, offset: u64) -> Result<Block, ImportError> {
        let (id, length, count) = self.head(offset)?;
        if length > LONGEST.min(self.end()) || 24 + 8 * count as u64 > length {
            let found = format!("one of {length} bytes with {count} links");
            return Err(self.bad(offset, "a block of at most 16 MiB inside the file", &found));
        }
        let bytes = self.bytes(offset, length as usize)?;
        let links = (0..count).map(|i| le(bytes, 24 + 8 * i, 8)).collect();
        let data = bytes.get(24 + 8 * count..).unwrap_or_default().to_vec();
        Ok(Block { id, links, data })
    }

    /// Whether the block at `offset` is there and was not met before in this chain: chains may not be rings.
    pub fn follow(&mut self, offset: u64) -> bool {
        offset != 0 && self.seen.insert(offset, ())
    }

    /// The text of a text or metadata block; empty for a link to nothing.
    pub fn text(&mut self, offset: u64) -> String {
        if offset == 0 {
            return String::new();
        }
        let Ok(block) = self.block(offset) else { return String::new() };
        let text = decode(block.data.split(|b| *b == 0).next().unwrap_or_default());
        if block.id != *b"##MD" {
            return text.trim().to_owned();
        }
        let inner = text.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>")).map(|(inner, _)| inner);
        inner.unwrap_or_default().trim().to_owned()
    }

    /// The channels of a chain, those inside structures too.
    pub fn channels(&mut self, first: u64, depth: usize, out: &mut Vec<Channel>) -> Result<(), ImportError> {
        let mut at = first;
        while self.follow(at) {
            let block = self.block(at)?;
            if block.id != *b"##CN" {
                // An array (##CA) in place of a structure: not read.
                return Ok(());
            }
            self.channels += 1;
            if self.channels > MOST_CHANNELS {
                return Err(self.bad(at, &format!("at most {MOST_CHANNELS} channels"), "more"));
            }
            let conversion = block.link(4);
            let (conversion, unit) = self.conversion(conversion)?;
            let own = self.text(block.link(6));
            let flags = block.number(12, 4);
            out.push(Channel {
                name: self.text(block.link(2)),
                unit: if own.is_empty() { unit } else { own },
                kind: block.number(0, 1) as u8,
                data_type: block.number(2, 1) as u8,
                bit_offset: block.number(3, 1) as u8 & 7,
                byte_offset: block.number(4, 4) as usize,
                bits: block.number(8, 4) as usize,
                data: block.link(5),
                invalid: (flags & 2 != 0).then(|| block.number(16, 4) as usize),
                conversion,
            });
            if depth < NESTED && block.link(1) != 0 {
                self.channels(block.link(1), depth + 1, out)?;
            }
            at = block.link(0);
        }
        Ok(())
    }

    fn conversion(&mut self, offset: u64) -> Result<(Conversion, String), ImportError> {
        if offset == 0 {
            return Ok((Conversion::None, String::new()));
        }
        let block = self.block(offset)?;
        let values: Vec<f64> =
            block.data.get(24..).unwrap_or_default().chunks_exact(8).map(|v| le(v, 0, 8)).map(f64::from_bits).collect();
        let count = (block.number(6, 2) as usize).min(values.len());
        let unit = self.text(block.link(1));
        Ok((Conversion::new(block.number(0, 1) as u8, &values[..count]), unit))
    }
}
