//! Binary data in slices: what has come and was not consumed yet.

/// Bytes between slices.
#[derive(Debug, Default)]
pub(crate) struct Carry {
    bytes: Vec<u8>,
    from: usize,
    consumed: u64,
    skip: u64,
}

impl Carry {
    /// Take the next slice.
    pub fn extend(&mut self, mut slice: &[u8]) {
        let skipped = self.skip.min(slice.len() as u64);
        self.skip -= skipped;
        slice = &slice[skipped as usize..];
        self.bytes.drain(..self.from);
        self.from = 0;
        self.bytes.extend_from_slice(slice);
    }

    /// The next `count` bytes, if they are there.
    pub fn peek(&self, count: usize) -> Option<&[u8]> {
        self.bytes.get(self.from..self.from.checked_add(count)?)
    }

    /// Go on behind `count` bytes, whether they are there yet or not.
    pub fn consume(&mut self, count: usize) {
        self.pass(count as u64);
    }

    /// Go on behind `count` bytes, whether they are there yet or not.
    pub fn pass(&mut self, count: u64) {
        self.consumed = self.consumed.saturating_add(count);
        let here = count.min((self.bytes.len() - self.from) as u64);
        self.from += here as usize;
        self.skip = self.skip.saturating_add(count - here);
    }

    /// Where in the file the next byte is.
    pub fn offset(&self) -> u64 {
        self.consumed
    }

    /// Bytes that have come and were not consumed.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.from
    }
}

/// A little-endian number of up to eight bytes; bytes that are not there are zero.
pub(crate) fn le(bytes: &[u8], at: usize, size: usize) -> u64 {
    let end = at.saturating_add(size).min(bytes.len());
    bytes.get(at..end).unwrap_or_default().iter().rev().fold(0, |v, b| v << 8 | u64::from(*b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_to_come_can_be_passed_over() {
        let mut carry = Carry::default();
        carry.extend(&[1, 2, 3]);
        assert_eq!(carry.peek(2), Some(&[1, 2][..]));
        carry.pass(5);
        assert_eq!((carry.peek(1), carry.offset()), (None, 5));
        carry.extend(&[4, 5, 6]);
        assert_eq!(carry.peek(1), Some(&[6][..]));
        assert_eq!(le(&[1, 2], 0, 4), 0x201);
    }
}
