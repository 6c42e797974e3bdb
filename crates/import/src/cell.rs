//! Cells of a text row: where they end, quotes, and what a cell holds.

use crate::number::parse_prefix;
use crate::stamp::{self, Stamp};

/// How rows are cut into cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cut {
    /// The byte between cells.
    pub separator: u8,
    /// Several separators in a row count as one (columns aligned with spaces).
    pub collapse: bool,
    /// The byte that ends a row.
    pub eol: u8,
}

/// One cell of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cell<'a> {
    /// Content without quotes and without space around it; doubled quotes are still doubled.
    pub text: &'a [u8],
    /// Where the next cell or, if `last`, the next row begins.
    pub next: usize,
    /// Whether the row ends here.
    pub last: bool,
    /// Ends of line inside the quotes.
    pub inner_lines: usize,
}

impl Cut {
    /// The cell at `start`; `None` if the bytes end before the row does.
    pub fn cell<'a>(&self, bytes: &'a [u8], start: usize) -> Option<Cell<'a>> {
        let mut pos = start;
        while bytes.get(pos).is_some_and(|&b| self.is_padding(b) || (self.collapse && b == self.separator)) {
            pos += 1;
        }
        if bytes.get(pos) == Some(&b'"') {
            return self.quoted(bytes, pos + 1);
        }
        let length = bytes.get(pos..)?.iter().position(|&b| b == self.separator || b == self.eol)?;
        Some(self.ended(bytes, pos, pos + length, 0))
    }

    fn is_padding(&self, byte: u8) -> bool {
        byte != self.separator && byte != self.eol && matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c)
    }

    /// The cell of `bytes[from..end]`, where `end` is a separator or the end of the row.
    fn ended<'a>(&self, bytes: &'a [u8], from: usize, end: usize, inner_lines: usize) -> Cell<'a> {
        let mut next = end;
        if self.collapse {
            while bytes.get(next).is_some_and(|&b| b == self.separator || self.is_padding(b)) {
                next += 1;
            }
        }
        let last = bytes.get(next) == Some(&self.eol);
        if last || !self.collapse {
            next += 1;
        }
        Cell { text: bytes[from..end].trim_ascii(), next, last, inner_lines }
    }

    /// A cell whose quote opened just before `start`. Text between the closing quote and the separator is dropped.
    fn quoted<'a>(&self, bytes: &'a [u8], start: usize) -> Option<Cell<'a>> {
        let mut pos = start;
        let mut inner_lines = 0;
        loop {
            match *bytes.get(pos)? {
                b'"' if bytes.get(pos + 1) == Some(&b'"') => pos += 2,
                b'"' => break,
                b => {
                    inner_lines += usize::from(b == self.eol);
                    pos += 1;
                }
            }
        }
        let rest = bytes.get(pos + 1..)?.iter().position(|&b| b == self.separator || b == self.eol)?;
        let mut cell = self.ended(bytes, start, pos + 1 + rest, inner_lines);
        cell.text = bytes[start..pos].trim_ascii();
        Some(cell)
    }

    /// The cells of one row that ends with `eol`; empty if it does not end.
    pub fn row<'a>(&self, bytes: &'a [u8]) -> Vec<&'a [u8]> {
        let mut cells = Vec::new();
        let mut pos = 0;
        while let Some(cell) = self.cell(bytes, pos) {
            cells.push(cell.text);
            pos = cell.next;
            if cell.last {
                return cells;
            }
        }
        Vec::new()
    }
}

/// Whether a row that begins with these bytes is a comment.
pub(crate) fn is_comment(row: &[u8]) -> bool {
    let text = row.trim_ascii_start();
    matches!(text.first(), Some(b'#' | b'%')) || text.starts_with(b"//")
}

/// Finds the end of a row across slices, with the same idea of quotes and comments as [`Cut::cell`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum RowScan {
    #[default]
    RowStart,
    FirstSlash,
    Comment,
    CellStart,
    Cell,
    Quoted,
    QuoteInQuoted,
}

impl RowScan {
    /// Go on through `bytes`; the index of the byte that ends the row, if it is there.
    pub fn find_end(&mut self, bytes: &[u8], cut: Cut) -> Option<usize> {
        for (i, &b) in bytes.iter().enumerate() {
            let outside = !matches!(self, Self::Quoted);
            if outside && b == cut.eol {
                *self = Self::RowStart;
                return Some(i);
            }
            *self = self.after(b, cut);
        }
        None
    }

    /// Lines before the one in which the quote opens that `bytes`, from the start of a row on, leave open; `None` if none.
    pub fn open_quote(bytes: &[u8], cut: Cut) -> Option<usize> {
        let (mut scan, mut lines, mut opened) = (Self::default(), 0, 0);
        for &b in bytes {
            let next = if scan != Self::Quoted && b == cut.eol { Self::RowStart } else { scan.after(b, cut) };
            if next == Self::Quoted && matches!(scan, Self::RowStart | Self::CellStart) {
                opened = lines;
            }
            lines += usize::from(b == cut.eol);
            scan = next;
        }
        (scan == Self::Quoted).then_some(opened)
    }

    fn after(self, b: u8, cut: Cut) -> Self {
        let space = b.is_ascii_whitespace() || b == 0x0b;
        match self {
            Self::Comment => Self::Comment,
            Self::Quoted => {
                if b == b'"' {
                    Self::QuoteInQuoted
                } else {
                    Self::Quoted
                }
            }
            Self::QuoteInQuoted if b == b'"' => Self::Quoted,
            Self::FirstSlash if b == b'/' => Self::Comment,
            Self::RowStart if matches!(b, b'#' | b'%') => Self::Comment,
            Self::RowStart if b == b'/' => Self::FirstSlash,
            Self::RowStart if space && (b != cut.separator || cut.collapse) => Self::RowStart,
            Self::RowStart | Self::CellStart if b == b'"' => Self::Quoted,
            Self::CellStart if space => Self::CellStart,
            _ if b == cut.separator => Self::CellStart,
            _ => Self::Cell,
        }
    }
}

/// What a cell holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Content {
    /// No value.
    Blank,
    /// A finite number.
    Number(f64),
    /// An infinite number, or one beyond f64.
    Infinite,
    /// Date and time.
    Stamp(Stamp),
    /// Anything else.
    Text,
}

/// Read a trimmed cell.
pub(crate) fn content(text: &[u8], decimal: u8) -> Content {
    if let Some((value, used)) = parse_prefix(text, decimal)
        && used == text.len()
    {
        return if value.is_finite() { Content::Number(value) } else { Content::Infinite };
    }
    let is = |words: &[&str]| words.iter().any(|w| text.eq_ignore_ascii_case(w.as_bytes()));
    if text.is_empty() || is(&["nan", "+nan", "-nan", "null", "na", "n/a", "none", "-", "--", "nan(ind)", "-nan(ind)"])
    {
        Content::Blank
    } else if is(&["inf", "+inf", "-inf", "infinity", "+infinity", "-infinity"]) {
        Content::Infinite
    } else if is(&["true"]) {
        Content::Number(1.0)
    } else if is(&["false"]) {
        Content::Number(0.0)
    } else {
        stamp::parse(text).map_or(Content::Text, Content::Stamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMMA: Cut = Cut { separator: b',', collapse: false, eol: b'\n' };
    const SPACES: Cut = Cut { separator: b' ', collapse: true, eol: b'\n' };

    fn row(cut: Cut, text: &str) -> Vec<&str> {
        cut.row(text.as_bytes()).into_iter().map(|c| std::str::from_utf8(c).unwrap()).collect()
    }

    #[test]
    fn cells_are_cut_at_separators_outside_quotes() {
        assert_eq!(row(COMMA, "a, b ,,\"c,\nd\" ,\"e\"\"f\"\r\n"), ["a", "b", "", "c,\nd", "e\"\"f"]);
        assert_eq!(row(COMMA, "a,\n"), ["a", ""]);
        assert_eq!(row(COMMA, "a,\"b\n"), Vec::<&str>::new());
        assert_eq!(row(SPACES, "  1   2 \"x y\"  \n"), ["1", "2", "x y"]);
        assert_eq!(row(Cut { separator: b'\t', ..COMMA }, "1\t\t 2\n"), ["1", "", "2"]);
    }

    #[test]
    fn the_end_of_a_row_is_the_same_whole_or_byte_by_byte() {
        // Would catch a scan that disagrees with the cutting about quotes or comments.
        let texts = [
            "a,b\n",
            "\"x\ny\",1\n",
            "# say \"hi\n",
            "a,b\"c\n",
            " \"q\"\"\n\" ,2\n",
            "//\"\n",
            "/\"a\n",
            "1,  \"a\nb\"\n",
        ];
        for text in texts {
            let mut scan = RowScan::default();
            assert_eq!(scan.find_end(text.as_bytes(), COMMA), Some(text.len() - 1), "{text:?}");
            let mut scan = RowScan::default();
            let ends: Vec<usize> =
                (0..text.len()).filter(|&i| scan.find_end(&text.as_bytes()[i..=i], COMMA).is_some()).collect();
            assert_eq!(ends, [text.len() - 1], "{text:?}");
        }
    }

    #[test]
    fn the_line_of_an_open_quote_is_that_of_its_own_not_of_the_row() {
        let line = |text: &str| RowScan::open_quote(text.as_bytes(), COMMA);
        assert_eq!(line("1,\"a\nb"), Some(0));
        assert_eq!(line("\"a\nb\"\"\nc\",\"d\n"), Some(2));
        assert_eq!(line("\"a\nb\",c\"d\n"), None);
    }

    #[test]
    fn cells_hold_numbers_blanks_times_or_text() {
        for blank in ["", "nan", "NaN", "NULL", "NA", "-"] {
            assert_eq!(content(blank.as_bytes(), b'.'), Content::Blank, "{blank}");
        }
        assert_eq!(content(b"-1.5e2", b'.'), Content::Number(-150.0));
        assert_eq!(content(b"1,5", b','), Content::Number(1.5));
        assert_eq!(content(b"1,5", b'.'), Content::Text);
        assert_eq!(content(b"1e999", b'.'), Content::Infinite);
        assert_eq!(content(b"-Inf", b'.'), Content::Infinite);
        assert_eq!(content(b"TRUE", b'.'), Content::Number(1.0));
        assert!(matches!(content(b"12:00:00", b'.'), Content::Stamp(_)));
        assert_eq!(content(b"0x1F", b'.'), Content::Text);
    }
}
