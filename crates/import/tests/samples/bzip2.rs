//! bzip2, packing only, as plainly as it goes: rotations sorted one by one, every symbol's code as long as the others.

struct Bits {
    out: Vec<u8>,
    held: u32,
    count: u32,
}

impl Bits {
    fn put(&mut self, value: u64, count: u32) {
        for i in (0..count).rev() {
            self.held = self.held << 1 | (value.checked_shr(i).unwrap_or(0) & 1) as u32;
            self.count += 1;
            if self.count == 8 {
                self.out.push(self.held as u8);
                (self.held, self.count) = (0, 0);
            }
        }
    }
}

/// Four equal bytes are followed by the number of further ones.
fn runs(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    for run in bytes.chunk_by(|a, b| a == b).flat_map(|run| run.chunks(255)) {
        out.extend(&run[..run.len().min(4)]);
        if run.len() >= 4 {
            out.push((run.len() - 4) as u8);
        }
    }
    out
}

/// Pack as one block, of at most 100,000 bytes. Checksums are left at 0.
pub fn pack(bytes: &[u8]) -> Vec<u8> {
    let text = runs(bytes);
    let n = text.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| (0..n).map(|i| text[(a + i) % n]).cmp((0..n).map(|i| text[(b + i) % n])));
    let mut places: Vec<u8> = (0..=255).filter(|b| text.contains(b)).collect();
    let mut bits = Bits { out: b"BZh1".to_vec(), held: 0, count: 0 };
    bits.put(0x3141_5926_5359, 48);
    bits.put(0, 33);
    bits.put(order.iter().position(|&i| i == 0).unwrap_or(0) as u64, 24);
    let used = |high: usize| (0..16).map(move |low| (high * 16 + low) as u8);
    let row = |high: usize, places: &[u8]| used(high).fold(0, |v, b| v << 1 | u64::from(places.contains(&b)));
    bits.put((0..16).fold(0, |v, high| v << 1 | u64::from(row(high, &places) > 0)), 16);
    (0..16).map(|high| row(high, &places)).filter(|r| *r > 0).for_each(|r| bits.put(r, 16));
    let mut symbols = Vec::new();
    let (end, mut zeros) = (places.len() as u64 + 1, 0u64);
    let flush = |zeros: &mut u64, symbols: &mut Vec<u64>| {
        // Run lengths in digits worth 1 and 2, the lowest first.
        while *zeros > 0 {
            symbols.push(1 - *zeros % 2);
            *zeros = (*zeros - 1) / 2;
        }
    };
    for &i in &order {
        let byte = text[(i + n - 1) % n];
        let index = places.iter().position(|&b| b == byte).unwrap_or(0);
        places[..=index].rotate_right(1);
        if index == 0 {
            zeros += 1;
        } else {
            flush(&mut zeros, &mut symbols);
            symbols.push(index as u64 + 1);
        }
    }
    flush(&mut zeros, &mut symbols);
    symbols.push(end);
    let groups = symbols.len().div_ceil(50);
    bits.put(2, 3);
    bits.put(groups as u64, 15);
    bits.put(0, groups as u32);
    for _ in 0..2 {
        bits.put(9, 5);
        bits.put(0, end as u32 + 1);
    }
    symbols.iter().for_each(|s| bits.put(*s, 9));
    bits.put(0x1772_4538_5090, 48);
    bits.put(0, 40);
    bits.out
}
