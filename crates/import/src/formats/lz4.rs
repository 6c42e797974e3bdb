//! LZ4: frames as chunks of robots' logs have them. Checksums are passed over.

use super::carry::le;

/// Unpack a frame of at most `most` bytes; `None` if it is damaged.
pub(crate) fn unpack_frame(data: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let mut rest = data;
    while rest.len() >= 7 && le(rest, 0, 4) == 0x184d_2204 {
        let flags = rest[4];
        let with_size = usize::from(flags & 8 != 0) * 8 + usize::from(flags & 1 != 0) * 4;
        rest = rest.get(6 + with_size + 1..)?;
        let start = out.len();
        loop {
            let size = le(rest.get(..4)?, 0, 4) as usize;
            rest = &rest[4..];
            if size == 0 {
                break;
            }
            let (stored, size) = (size >> 31 == 1, size & 0x7fff_ffff);
            let block = rest.get(..size)?;
            if stored {
                out.extend_from_slice(block);
            } else {
                let window = if flags & 0x20 == 0 { start } else { out.len() };
                unpack_block(block, &mut out, window, most)?;
            }
            if out.len() > most {
                return None;
            }
            rest = rest.get(size + if flags & 0x10 != 0 { 4 } else { 0 }..)?;
        }
        rest = if flags & 4 != 0 { rest.get(4..)? } else { rest };
    }
    Some(out)
}

/// A length that begins in a token and goes on in bytes of 255.
fn length(token: u8, block: &[u8], pos: &mut usize) -> Option<usize> {
    let mut length = usize::from(token);
    if token == 15 {
        loop {
            let byte = *block.get(*pos)?;
            *pos += 1;
            length += usize::from(byte);
            if byte != 255 {
                break;
            }
        }
    }
    Some(length)
}

/// Unpack a block behind what is there; matches reach back to `window` at most.
fn unpack_block(block: &[u8], out: &mut Vec<u8>, window: usize, most: usize) -> Option<()> {
    let mut pos = 0;
    while pos < block.len() {
        let token = block[pos];
        pos += 1;
        let literals = length(token >> 4, block, &mut pos)?;
        out.extend_from_slice(block.get(pos..pos.checked_add(literals)?)?);
        pos += literals;
        if pos == block.len() {
            return Some(());
        }
        let distance = le(block.get(pos..pos + 2)?, 0, 2) as usize;
        pos += 2;
        let count = length(token & 15, block, &mut pos)? + 4;
        if distance == 0 || distance > out.len() - window || out.len() + count > most {
            return None;
        }
        let from = out.len() - distance;
        for i in 0..count {
            out.push(out[from + i]);
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matches_may_overlap_themselves() {
        let block = [0x35, b'a', b'b', b'c', 3, 0, 0x10, b'x'];
        let mut frame = vec![0x04, 0x22, 0x4d, 0x18, 0x60, 0x40, 0];
        frame.extend((block.len() as u32).to_le_bytes());
        frame.extend(block);
        frame.extend([0; 4]);
        assert_eq!(unpack_frame(&frame, 100).unwrap(), b"abcabcabcabcx");
        assert_eq!(unpack_frame(&frame, 5), None);
        assert_eq!(unpack_frame(&frame[..frame.len() - 6], 100), None);
    }
}
