//! Data of an MDF4 file: lists of blocks, stored, deflated or transposed and deflated.

use std::collections::VecDeque;

use flate2::{Decompress, FlushDecompress};

use super::blocks::Blocks;
use crate::error::ImportError;
use crate::formats::carry::le;

/// Stored bytes handed on at a time.
const SLICE: u64 = 1 << 20;
/// A deflated block that unpacks to more than this, bytes, is refused.
const LONGEST_BLOCK: usize = 256 << 20;
/// Signal data of one channel kept in memory, bytes at most.
const LONGEST_SIGNAL: usize = 512 << 20;

/// Bytes of records, somewhere in the file.
#[derive(Clone, Debug)]
pub(super) struct Fragment {
    offset: u64,
    length: u64,
    deflated: bool,
}

impl Fragment {
    pub fn length(&self) -> u64 {
        self.length
    }
}

/// The fragments below a link to data. A block without a length, as an unfinished file has, goes on to the next block or the file's end.
pub(super) fn fragments(blocks: &mut Blocks, link: u64, unfinished: bool) -> Result<VecDeque<Fragment>, ImportError> {
    let mut found = VecDeque::new();
    let mut lists = VecDeque::from([link]);
    while let Some(at) = lists.pop_front() {
        if !blocks.follow(at) {
            continue;
        }
        let (id, length, _) = blocks.head(at)?;
        match &id {
            b"##HL" => lists.push_back(blocks.block(at)?.link(0)),
            b"##DL" => {
                let block = blocks.block(at)?;
                // The list goes on after its own blocks.
                block.links.iter().skip(1).rev().for_each(|l| lists.push_front(*l));
                lists.push_back(block.link(0));
            }
            b"##DZ" => found.push_back(Fragment { offset: at, length, deflated: true }),
            b"##DT" | b"##SD" | b"##DV" => {
                let rest = blocks.end().saturating_sub(at);
                let open = length <= 24 && unfinished;
                let length = if open { rest } else { length.min(rest) }.saturating_sub(24);
                found.push_back(Fragment { offset: at + 24, length, deflated: false });
            }
            other => {
                let found = decode_id(other);
                return Err(blocks.bad(at, "a block of data (##DT, ##DZ, ##DL, ##HL)", &found));
            }
        }
    }
    Ok(found)
}

fn decode_id(id: &[u8; 4]) -> String {
    format!("`{}`", crate::error::excerpt(id))
}

/// The next bytes of the first fragment; it is taken off when it is read.
pub(super) fn next(blocks: &mut Blocks, fragments: &mut VecDeque<Fragment>) -> Result<Option<Vec<u8>>, ImportError> {
    let Some(first) = fragments.front_mut() else { return Ok(None) };
    if first.deflated {
        let bytes = inflate(blocks, first.offset, first.length)?;
        fragments.pop_front();
        return Ok(Some(bytes));
    }
    let count = first.length.min(SLICE);
    let bytes = blocks.bytes(first.offset, count as usize)?.to_vec();
    first.offset += count;
    first.length -= count;
    if first.length == 0 || bytes.len() < count as usize {
        fragments.pop_front();
    }
    Ok(Some(bytes))
}

fn inflate(blocks: &mut Blocks, at: u64, length: u64) -> Result<Vec<u8>, ImportError> {
    let head = blocks.bytes(at, 48)?.to_vec();
    let (kind, width) = (le(&head, 26, 1), le(&head, 28, 4) as usize);
    let (unpacked, packed) = (le(&head, 32, 8), le(&head, 40, 8));
    let packed = packed.min(length.saturating_sub(48)).min(blocks.end()) as usize;
    let most = LONGEST_BLOCK.min(packed.saturating_mul(1100) + 64);
    if unpacked > most as u64 {
        let expected = format!("at most {most} bytes in a deflated block");
        return Err(blocks.bad(at, &expected, &unpacked.to_string()));
    }
    if kind > 1 {
        return Err(blocks.bad(at, "data deflated or transposed and deflated", &format!("compression {kind}")));
    }
    let mut bytes = Vec::with_capacity(unpacked as usize);
    let data = blocks.bytes(at + 48, packed)?;
    let status = Decompress::new(true).decompress_vec(data, &mut bytes, FlushDecompress::Finish);
    if status.is_err() || bytes.len() as u64 != unpacked {
        return Err(blocks.bad(at, &format!("{unpacked} bytes of deflated data"), &format!("{} bytes", bytes.len())));
    }
    Ok(if kind == 1 && width > 1 { transpose(&bytes, width) } else { bytes })
}

/// Columns of bytes back to records of `width` bytes; what fills no record stays at the end.
fn transpose(bytes: &[u8], width: usize) -> Vec<u8> {
    let rows = bytes.len() / width;
    let mut out = vec![0; bytes.len()];
    for (column, values) in bytes[..rows * width].chunks_exact(rows.max(1)).enumerate() {
        for (row, value) in values.iter().enumerate() {
            out[row * width + column] = *value;
        }
    }
    out[rows * width..].copy_from_slice(&bytes[rows * width..]);
    out
}

/// All signal data below a link.
pub(super) fn signal_data(blocks: &mut Blocks, link: u64) -> Result<Vec<u8>, ImportError> {
    let mut parts = fragments(blocks, link, false)?;
    let mut all = Vec::new();
    while let Some(bytes) = next(blocks, &mut parts)? {
        if all.len() + bytes.len() > LONGEST_SIGNAL {
            let expected = format!("at most {LONGEST_SIGNAL} bytes of signal data");
            return Err(blocks.bad(link, &expected, "more"));
        }
        all.extend_from_slice(&bytes);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transposed_records_come_back() {
        assert_eq!(transpose(b"adbecfX", 3), b"abcdefX");
        assert_eq!(transpose(b"ab", 3), b"ab");
    }
}
