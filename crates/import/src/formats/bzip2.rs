//! bzip2, unpacking only. Checksums are passed over.

/// Most code lengths of a table; symbols are two runs, 255 places and the end.
const SYMBOLS: usize = 258;
const GROUP: usize = 50;

struct Bits<'a> {
    data: &'a [u8],
    pos: usize,
    held: u64,
    count: u32,
}

impl Bits<'_> {
    fn get(&mut self, count: u32) -> Option<u32> {
        while self.count < count {
            self.held = self.held << 8 | u64::from(*self.data.get(self.pos)?);
            self.pos += 1;
            self.count += 8;
        }
        self.count -= count;
        Some((self.held >> self.count) as u32 & ((1u64 << count) - 1) as u32)
    }
}

/// A canonical code: symbols by length and value.
struct Code {
    /// First code of each length and where its symbols begin, from length 1 on.
    first: [u32; 22],
    start: [usize; 22],
    symbols: Vec<u16>,
}

impl Code {
    fn new(lengths: &[u8]) -> Self {
        let mut code = Self { first: [0; 22], start: [0; 22], symbols: Vec::with_capacity(lengths.len()) };
        let mut next = 0u32;
        for length in 1..=20u8 {
            next <<= 1;
            code.first[usize::from(length)] = next;
            code.start[usize::from(length)] = code.symbols.len();
            let of_length = (0..lengths.len()).filter(|i| lengths[*i] == length);
            code.symbols.extend(of_length.map(|i| i as u16));
            next += (code.symbols.len() - code.start[usize::from(length)]) as u32;
        }
        code.start[21] = code.symbols.len();
        code
    }

    fn read(&self, bits: &mut Bits) -> Option<usize> {
        let mut value = 0;
        for length in 1..=20 {
            value = value << 1 | bits.get(1)?;
            let (start, end) = (self.start[length], self.start[length + 1]);
            let index = value.checked_sub(self.first[length]).map(|i| start + i as usize);
            if let Some(index) = index.filter(|i| *i < end) {
                return Some(usize::from(self.symbols[index]));
            }
        }
        None
    }
}

/// Unpack at most `most` bytes; `None` if the data are damaged.
pub(crate) fn unpack(data: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut bits = Bits { data, pos: 0, held: 0, count: 0 };
    let mut out = Vec::new();
    if bits.get(24)? != 0x42_5a68 {
        return None;
    }
    let level = bits.get(8)?.checked_sub(u32::from(b'0')).filter(|l| (1..=9).contains(l))?;
    loop {
        match (bits.get(24)?, bits.get(24)?) {
            (0x31_4159, 0x26_5359) => block(&mut bits, level as usize * 100_000, &mut out, most)?,
            (0x17_7245, 0x38_5090) => return Some(out),
            _ => return None,
        }
    }
}

fn block(bits: &mut Bits, size: usize, out: &mut Vec<u8>, most: usize) -> Option<()> {
    bits.get(32)?;
    let randomised = bits.get(1)?;
    let origin = bits.get(24)? as usize;
    if randomised == 1 {
        return None;
    }
    let used = bits.get(16)?;
    let mut places = Vec::with_capacity(256);
    for high in 0..16 {
        if used >> (15 - high) & 1 == 1 {
            let low = bits.get(16)?;
            places.extend((0..16).filter(|l| low >> (15 - l) & 1 == 1).map(|l| (high * 16 + l) as u8));
        }
    }
    let (codes, selectors) = tables(bits, places.len() + 2)?;
    let (text, mut counts) = symbols(bits, &codes, &selectors, places, size)?;
    // Inverse of the Burrows-Wheeler transform.
    let mut sum = 0;
    for count in &mut counts {
        (sum, *count) = (sum + *count, sum);
    }
    let mut links = vec![0u32; text.len()];
    for (i, &byte) in text.iter().enumerate() {
        links[counts[usize::from(byte)]] = i as u32;
        counts[usize::from(byte)] += 1;
    }
    let mut at = *links.get(origin)? as usize;
    let mut run = (0u16, 0);
    for _ in 0..text.len() {
        let byte = text[at];
        at = links[at] as usize;
        if run.1 == 4 {
            // The byte after four equal ones counts further ones.
            out.resize(out.len() + usize::from(byte), run.0 as u8);
            run.1 = 0;
        } else {
            run = if run.1 > 0 && run.0 == u16::from(byte) { (run.0, run.1 + 1) } else { (u16::from(byte), 1) };
            out.push(byte);
        }
        if out.len() > most {
            return None;
        }
    }
    Some(())
}

fn tables(bits: &mut Bits, symbols: usize) -> Option<(Vec<Code>, Vec<u8>)> {
    let groups = bits.get(3)? as usize;
    let count = bits.get(15)? as usize;
    if !(2..=6).contains(&groups) || !(3..=SYMBOLS).contains(&symbols) {
        return None;
    }
    let mut order: Vec<u8> = (0..groups as u8).collect();
    let mut selectors = Vec::with_capacity(count);
    for _ in 0..count {
        let mut index = 0;
        while bits.get(1)? == 1 {
            index += 1;
        }
        let chosen = *order.get(index)?;
        order.copy_within(..index, 1);
        order[0] = chosen;
        selectors.push(chosen);
    }
    let mut codes = Vec::new();
    for _ in 0..groups {
        let mut length = bits.get(5)?;
        let mut lengths = Vec::with_capacity(symbols);
        for _ in 0..symbols {
            while bits.get(1)? == 1 {
                length = if bits.get(1)? == 0 { length + 1 } else { length.checked_sub(1)? };
            }
            if !(1..=20).contains(&length) {
                return None;
            }
            lengths.push(length as u8);
        }
        codes.push(Code::new(&lengths));
    }
    Some((codes, selectors))
}

/// The transformed text and how often each byte is in it.
fn symbols(
    bits: &mut Bits,
    codes: &[Code],
    selectors: &[u8],
    mut places: Vec<u8>,
    size: usize,
) -> Option<(Vec<u8>, [usize; 256])> {
    let end = places.len() + 1;
    let mut text = Vec::new();
    let mut counts = [0; 256];
    let (mut run, mut weight) = (0usize, 1usize);
    let mut read = 0;
    loop {
        let code = codes.get(usize::from(*selectors.get(read / GROUP)?))?;
        read += 1;
        let symbol = code.read(bits)?;
        if symbol < 2 {
            run += weight << symbol;
            weight <<= 1;
            if run > size {
                return None;
            }
            continue;
        }
        if run > 0 {
            let byte = *places.first()?;
            counts[usize::from(byte)] += run;
            text.resize(text.len() + run, byte);
            (run, weight) = (0, 1);
        }
        if symbol == end {
            return (text.len() <= size).then_some((text, counts));
        }
        let index = symbol - 1;
        let byte = *places.get(index)?;
        places.copy_within(..index, 1);
        places[0] = byte;
        counts[usize::from(byte)] += 1;
        text.push(byte);
        if text.len() > size {
            return None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_text_comes_back() {
        // `bzip2` of three times "aaaaaaaaaabbbbabcabcabc\n" and the bytes 0 to 39.
        let packed = [
            0x42, 0x5a, 0x68, 0x39, 0x31, 0x41, 0x59, 0x26, 0x53, 0x59, 0x07, 0xcc, 0xd4, 0x82, 0x00, 0x00, 0x1e, 0x71,
            0x00, 0x7f, 0xff, 0xff, 0xff, 0xff, 0x80, 0x38, 0x00, 0x20, 0x00, 0x48, 0xad, 0x46, 0x86, 0x4d, 0x1a, 0x34,
            0x00, 0x34, 0x19, 0x0c, 0x6a, 0x06, 0x54, 0x32, 0x0d, 0x00, 0x00, 0xd0, 0x00, 0x0d, 0x10, 0x21, 0x19, 0x64,
            0x96, 0x63, 0x08, 0x4e, 0x8a, 0x3e, 0x4c, 0x44, 0x4d, 0x55, 0xaa, 0xcb, 0x6e, 0xbf, 0x0c, 0x72, 0xcf, 0x4d,
            0x76, 0x5e, 0xfc, 0x73, 0xd3, 0x1b, 0xdf, 0x9e, 0xb9, 0xf0, 0x16, 0x81, 0x06, 0x41, 0x9a, 0x03, 0xf1, 0x61,
            0x03, 0xa2, 0xe9, 0x01, 0xb2, 0x07, 0xe2, 0xee, 0x48, 0xa7, 0x0a, 0x12, 0x00, 0xf9, 0x9a, 0x90, 0x40,
        ];
        let text: Vec<u8> = b"aaaaaaaaaabbbbabcabcabc\n".repeat(3).into_iter().chain(0..40).collect();
        assert_eq!(unpack(&packed, 1000).unwrap(), text);
        assert_eq!(unpack(&packed, 10), None);
        assert_eq!(unpack(&packed[..40], 1000), None);
        let empty = [0x42, 0x5a, 0x68, 0x39, 0x17, 0x72, 0x45, 0x38, 0x50, 0x90, 0, 0, 0, 0];
        assert_eq!(unpack(&empty, 100).unwrap(), b"");
    }
}
