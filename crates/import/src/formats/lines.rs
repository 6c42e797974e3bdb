//! Text in slices, cut into lines.

use crate::error::{ImportError, MAX_ROW_BYTES};

/// What is done with each line: its number from 1 and its bytes without the end of line.
pub(crate) type OnLine<'a> = &'a mut dyn FnMut(usize, &[u8]) -> Result<(), ImportError>;

/// Cuts slices into lines; keeps the unfinished one.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    carry: Vec<u8>,
    number: usize,
}

impl Lines {
    /// Take the next slice.
    pub fn feed(&mut self, file: &str, mut slice: &[u8], on_line: OnLine) -> Result<(), ImportError> {
        while let Some(end) = slice.iter().position(|&b| b == b'\n') {
            self.number += 1;
            if self.carry.is_empty() {
                on_line(self.number, trim_end(&slice[..end]))?;
            } else {
                self.carry.extend_from_slice(&slice[..end]);
                let line = std::mem::take(&mut self.carry);
                on_line(self.number, trim_end(&line))?;
            }
            slice = &slice[end + 1..];
        }
        self.carry.extend_from_slice(slice);
        if self.carry.len() > MAX_ROW_BYTES {
            let (file, row) = (file.to_owned(), self.number + 1);
            return Err(ImportError::RowTooLong { file, row, limit: MAX_ROW_BYTES });
        }
        Ok(())
    }

    /// The last line, if it has no end.
    pub fn finish(&mut self, on_line: OnLine) -> Result<(), ImportError> {
        let line = std::mem::take(&mut self.carry);
        if line.is_empty() {
            return Ok(());
        }
        self.number += 1;
        on_line(self.number, trim_end(&line))
    }
}

fn trim_end(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// The words of a line, cut at spaces and tabs.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|b| matches!(b, b' ' | b'\t')).filter(|w| !w.is_empty())
}

/// A decimal number that fills the whole text.
pub(crate) fn number(text: &[u8]) -> Option<f64> {
    let text = text.trim_ascii();
    let (value, used) = crate::number::parse_prefix(text, b'.')?;
    (used == text.len() && value.is_finite()).then_some(value)
}

/// A whole number in decimal digits.
pub(crate) fn integer(text: &[u8]) -> Option<i64> {
    std::str::from_utf8(text).ok()?.trim().parse().ok()
}

/// A decimal number of seconds as whole nanoseconds, exactly.
pub(crate) fn nanoseconds(text: &[u8]) -> Option<i64> {
    let text = text.trim_ascii();
    let (sign, text) = text.strip_prefix(b"-").map_or((1, text), |t| (-1, t));
    let point = text.iter().position(|&b| b == b'.').unwrap_or(text.len());
    let mut value: i64 = 0;
    let whole = &text[..point];
    let part = text.get(point + 1..).unwrap_or_default();
    if whole.is_empty() && part.is_empty() || whole.len() > 11 {
        return None;
    }
    let digits = whole.iter().chain(part.iter().take(9)).chain(std::iter::repeat_n(&b'0', 9 - part.len().min(9)));
    for b in digits {
        value = value.checked_mul(10)?.checked_add(i64::from(char::from(*b).to_digit(10)?))?;
    }
    part.iter().all(u8::is_ascii_digit).then_some(sign * value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_the_same_whole_or_byte_by_byte() {
        let text = b"a\r\n\nbc\nd";
        for size in 1..text.len() {
            let mut found = Vec::new();
            let mut lines = Lines::default();
            let mut keep = |n: usize, l: &[u8]| {
                found.push((n, l.to_vec()));
                Ok(())
            };
            text.chunks(size).for_each(|c| lines.feed("x", c, &mut keep).unwrap());
            lines.finish(&mut keep).unwrap();
            let expected = [(1, b"a".to_vec()), (2, vec![]), (3, b"bc".to_vec()), (4, b"d".to_vec())];
            assert_eq!(found, expected, "{size}");
        }
    }

    #[test]
    fn seconds_become_nanoseconds_without_rounding() {
        assert_eq!(nanoseconds(b"1533226488.300013"), Some(1_533_226_488_300_013_000));
        assert_eq!(nanoseconds(b"-0.5"), Some(-500_000_000));
        assert_eq!(nanoseconds(b"12"), Some(12_000_000_000));
        assert_eq!(nanoseconds(b"1.0000000019"), Some(1_000_000_001));
        for bad in [&b""[..], b".", b"1e3", b"1.2x", b"999999999999.0"] {
            assert_eq!(nanoseconds(bad), None);
        }
    }
}
