//! Rows of plain numbers: what most of a log is. Parsing them changes nothing but the rows that are handed out, so that
//! parts of a file are parsed at the same time and the order in which it happens does not matter.

use crate::cell::Cut;
use crate::column::Kind;
use crate::error::MAX_ROW_BYTES;
use crate::number::{parse_prefix, short};

/// Rows that are parsed before they go to their columns: few enough to stay in the nearest cache.
const BLOCK: usize = 64;

/// What plain rows are under one layout.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain<'a> {
    /// How rows are cut.
    pub cut: Cut,
    /// The decimal mark.
    pub decimal: u8,
    /// What the columns hold so far.
    pub kinds: &'a [Kind],
}

/// A value, where the next cell begins, and whether the row ends between.
type PlainCell = (f64, usize, bool);

impl Plain<'_> {
    /// A number without quotes or spaces, or nothing at all, in a column of numbers.
    #[inline(always)]
    pub fn number(&self, bytes: &[u8], pos: usize) -> Option<PlainCell> {
        match *bytes.get(pos)? {
            b if b == self.cut.separator => self.ended(bytes, f64::NAN, pos),
            b'n' | b'N' => self.blank(bytes, pos),
            _ => {
                let (value, used) = parse_prefix(&bytes[pos..], self.decimal)?;
                if value.is_infinite() { None } else { self.ended(bytes, value, pos + used) }
            }
        }
    }

    /// Nothing, or `nan`.
    fn blank(&self, bytes: &[u8], pos: usize) -> Option<PlainCell> {
        let nan = bytes.get(pos..pos + 3).is_some_and(|b| b.eq_ignore_ascii_case(b"nan"));
        self.ended(bytes, f64::NAN, if nan { pos + 3 } else { pos })
    }

    /// The cell that ends before `end`, if it ends there.
    #[inline(always)]
    fn ended(&self, bytes: &[u8], value: f64, end: usize) -> Option<PlainCell> {
        let after = *bytes.get(end)?;
        let last = after == self.cut.eol;
        if last || (after == self.cut.separator && !self.cut.collapse) {
            return Some((value, end + 1, last));
        }
        (after == b'\r' && bytes.get(end + 1) == Some(&self.cut.eol)).then_some((value, end + 2, true))
    }

    /// A word in a column of text that is neither a number under any decimal mark nor infinite.
    fn word(&self, bytes: &[u8], pos: usize) -> Option<PlainCell> {
        let Cut { separator, eol, .. } = self.cut;
        let first = *bytes.get(pos)?;
        if !first.is_ascii_alphabetic() || first | 0x20 == b'i' {
            return None;
        }
        let length = bytes[pos..].iter().position(|&b| b == separator || b == eol)?;
        self.ended(bytes, f64::NAN, pos + length)
    }

    /// Whatever stands there, without quotes.
    fn unquoted(&self, bytes: &[u8], pos: usize) -> Option<PlainCell> {
        let Cut { separator, eol, .. } = self.cut;
        let length = bytes[pos..].iter().position(|&b| b == separator || b == eol)?;
        let end = pos + length;
        (!bytes[pos..end].contains(&b'"')).then_some((f64::NAN, end + 1, bytes[end] == eol))
    }

    /// Parse plain rows from `pos` on, at most [`BLOCK`], into `values`, row after row; where the first one begins that was
    /// not parsed, because it is not plain, not whole or too many.
    pub fn rows(&self, bytes: &[u8], mut pos: usize, values: &mut Vec<f64>) -> usize {
        let width = self.kinds.len();
        let (mut rows, start) = (0, pos);
        if self.kinds.first() == Some(&Kind::Number) && !self.cut.collapse {
            values.resize(BLOCK * width, f64::NAN);
            for row in values.chunks_exact_mut(width) {
                match self.row(bytes, pos, row) {
                    Some(next) if next - pos <= MAX_ROW_BYTES => pos = next,
                    _ => break,
                }
                rows += 1;
            }
        }
        values.truncate(rows * width);
        debug_assert!(rows > 0 || pos == start);
        pos
    }

    /// One row; where the next one begins.
    fn row(&self, bytes: &[u8], mut pos: usize, row: &mut [f64]) -> Option<usize> {
        let cells = row.len();
        for (i, (slot, &kind)) in row.iter_mut().zip(self.kinds).enumerate() {
            if bytes.get(pos) == Some(&self.cut.separator) {
                *slot = f64::NAN;
                pos += 1;
                continue;
            }
            if kind == Kind::Number
                && let Some(window) = bytes.get(pos..).and_then(<[u8]>::first_chunk)
                && let Some((value, end)) = short(window, self.decimal)
                && window[end] == self.cut.separator
            {
                *slot = value;
                pos += end + 1;
                continue;
            }
            let (value, next, last) = self.cell(bytes, pos, kind, i == 0)?;
            *slot = value;
            pos = next;
            if last {
                return (i + 1 == cells).then_some(pos);
            }
        }
        // A separator after the last cell is let pass.
        self.ended(bytes, f64::NAN, pos).filter(|(.., last)| *last).map(|(_, next, _)| next)
    }

    /// Any plain cell.
    #[inline(never)]
    fn cell(&self, bytes: &[u8], pos: usize, kind: Kind, first: bool) -> Option<PlainCell> {
        if kind == Kind::Number
            && let Some(cell) = self.number(bytes, pos)
        {
            return Some(cell);
        }
        // A row that begins with nothing may be a blank line or a comment.
        if first {
            return None;
        }
        let word = match kind {
            Kind::Text => self.word(bytes, pos),
            Kind::Left => self.unquoted(bytes, pos),
            _ => None,
        };
        word.or_else(|| self.blank(bytes, pos))
    }
}
