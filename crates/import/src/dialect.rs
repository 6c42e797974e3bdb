//! What the beginning of a text file tells: separator, decimal mark, header, units, and where the rows begin.

use crate::cell::{Content, Cut, RowScan, content, is_comment};
use crate::error::{MAX_TABLE_COLUMNS, decode};
use crate::header::{named_columns, split_unit, strip_brackets, text_of};
use crate::names::is_time_name;
use crate::units::is_unit;

/// The layout of a text file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dialect {
    /// How rows are cut.
    pub cut: Cut,
    /// The decimal mark.
    pub decimal: u8,
    /// No decimal mark was seen yet, and a comma would be free to be one.
    pub decimal_open: bool,
    /// Name and unit of each column.
    pub columns: Vec<(String, Option<String>)>,
    /// Line of the header, from 1.
    pub header_line: Option<usize>,
    /// Line of the row of units.
    pub unit_line: Option<usize>,
    /// Offset and line of the first row of data.
    pub body: (usize, usize),
    /// Lines before the body that are neither header nor units.
    pub skipped: usize,
    /// What comments before the body state as `# name = value`.
    pub stated: Vec<(String, String)>,
}

/// Why there is no layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SniffError {
    /// Nothing but blank lines and comments.
    Empty,
    /// The row at this line has too many columns.
    TooManyColumns(usize),
    /// The quote that opens in this line is not closed as far as the head goes.
    UnclosedQuote(usize),
}

/// A line of the head: where it begins, its number and its cells under the separator in question.
struct Line<'a> {
    offset: usize,
    number: usize,
    bytes: &'a [u8],
    comment: bool,
}

/// Rows that decide; more would not change the decision.
const SAMPLE: usize = 500;

/// The name that a separator has for people.
pub(crate) fn separator_name(cut: Cut) -> &'static str {
    match cut.separator {
        b',' => "comma",
        b';' => "semicolon",
        b'\t' => "tab",
        b'|' => "pipe",
        _ => "spaces",
    }
}

/// Find the layout from the head of a file; `whole` says that the head is the whole file.
pub(crate) fn sniff(head: &[u8], whole: bool) -> Result<Dialect, SniffError> {
    let start = if head.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let eol = if !head.contains(&b'\n') && head.contains(&b'\r') { b'\r' } else { b'\n' };
    let (stated, start, first_line) = stated_separator(head, start, eol);
    let mut candidates: Vec<Cut> =
        [b',', b';', b'\t', b'|'].map(|separator| Cut { separator, collapse: false, eol }).into();
    candidates.push(Cut { separator: b' ', collapse: true, eol });
    if let Some(separator) = stated {
        candidates = vec![Cut { separator, collapse: false, eol }];
    }
    let mut best: Option<(f64, Cut, Vec<Line>)> = None;
    let mut unclosed = None;
    for cut in candidates {
        let lines = match lines(head, start, first_line, cut, whole) {
            // Under another separator the quote may be no opening one.
            Err(error @ SniffError::UnclosedQuote(_)) => {
                unclosed.get_or_insert(error);
                continue;
            }
            other => other?,
        };
        let score = score(&lines, cut);
        if best.as_ref().is_none_or(|(s, ..)| score > *s) {
            best = Some((score, cut, lines));
        }
    }
    if let (Some(error), true) = (unclosed, best.as_ref().is_none_or(|(score, ..)| *score == 0.0)) {
        return Err(error);
    }
    let (_, cut, lines) = best.ok_or(SniffError::Empty)?;
    if lines.iter().all(|l| l.comment) {
        return Err(SniffError::Empty);
    }
    let dialect = layout(&lines, cut);
    if dialect.columns.is_empty() { Err(SniffError::Empty) } else { Ok(dialect) }
}

/// The separator that a first line `sep=;` states, where the text after it begins, and that line's number.
fn stated_separator(head: &[u8], start: usize, eol: u8) -> (Option<u8>, usize, usize) {
    let first = head[start..].split(|&b| b == eol).next().unwrap_or_default();
    match first.trim_ascii_end() {
        [b's' | b'S', b'e' | b'E', b'p' | b'P', b'=', separator] => (Some(*separator), start + first.len() + 1, 2),
        _ if first.eq_ignore_ascii_case(b"sep=\t") => (Some(b'\t'), start + first.len() + 1, 2),
        _ => (None, start, 1),
    }
}

/// The first rows that are not blank. A row that the head cuts off is left out unless the head is the whole file.
fn lines(head: &[u8], start: usize, first: usize, cut: Cut, whole: bool) -> Result<Vec<Line<'_>>, SniffError> {
    let mut lines = Vec::new();
    let (mut offset, mut number) = (start.min(head.len()), first);
    while offset < head.len() && lines.len() < SAMPLE {
        let mut scan = RowScan::default();
        let end = scan.find_end(&head[offset..], cut).map(|i| offset + i);
        let bytes = &head[offset..end.unwrap_or(head.len())];
        if let (None, Some(inner)) = (end, RowScan::open_quote(bytes, cut)) {
            // The rows before tell the layout; the body finds the quote again, with its place.
            if lines.is_empty() {
                return Err(SniffError::UnclosedQuote(number + inner));
            }
            break;
        }
        if !cut.collapse
            && bytes.iter().filter(|&&b| b == cut.separator).count() > MAX_TABLE_COLUMNS
            && !is_comment(bytes)
        {
            return Err(SniffError::TooManyColumns(number));
        }
        if end.is_none() && !whole && !lines.is_empty() {
            break;
        }
        if !bytes.trim_ascii().is_empty() {
            lines.push(Line { offset, number, bytes, comment: is_comment(bytes) });
        }
        number += 1 + bytes.iter().filter(|&&b| b == cut.eol).count();
        offset += bytes.len() + 1;
    }
    Ok(lines)
}

impl Line<'_> {
    /// Offset and number of the line after this one.
    fn after(&self, cut: Cut) -> (usize, usize) {
        let inner = self.bytes.iter().filter(|&&b| b == cut.eol).count();
        (self.offset + self.bytes.len() + 1, self.number + 1 + inner)
    }

    fn cells(&self, cut: Cut) -> Vec<Vec<u8>> {
        let mut row = self.bytes.to_vec();
        row.push(cut.eol);
        cut.row(&row).into_iter().map(<[u8]>::to_vec).collect()
    }
}

/// What the cells of a row look like: numbers (or times), blanks, texts.
#[derive(Clone, Copy, Debug, Default)]
struct Looks {
    cells: usize,
    numbers: usize,
    texts: usize,
}

fn looks(cells: &[Vec<u8>], cut: Cut) -> Looks {
    let mut looks = Looks { cells: cells.len(), ..Looks::default() };
    for cell in cells {
        let with_comma = || if cut.separator == b',' { Content::Text } else { content(cell, b',') };
        match content(cell, b'.') {
            Content::Text if with_comma() == Content::Text => looks.texts += 1,
            Content::Blank => {}
            _ => looks.numbers += 1,
        }
    }
    looks
}

/// The cell count that most rows have; the larger one of two that are equally frequent.
fn usual_count(lines: &[Looks]) -> (usize, usize) {
    let mut counts: Vec<usize> = lines.iter().map(|l| l.cells).collect();
    counts.sort_unstable();
    let runs = counts.chunk_by(|a, b| a == b).map(|run| (run[0], run.len()));
    runs.max_by_key(|&(count, times)| (times, count)).unwrap_or((0, 0))
}

/// How well a separator explains the rows: regular counts above one, and cells that are numbers.
fn score(lines: &[Line], cut: Cut) -> f64 {
    let rows: Vec<Looks> = lines.iter().filter(|l| !l.comment).map(|l| looks(&l.cells(cut), cut)).collect();
    let (count, times) = usual_count(&rows);
    if count < 2 {
        return 0.0;
    }
    let usual = rows.iter().filter(|l| l.cells == count);
    let (cells, texts) = usual.fold((0, 0), |(c, t), l| (c + l.cells, t + l.texts));
    let plain = 1.0 - texts as f64 / cells as f64;
    times as f64 / rows.len() as f64 * (0.1 + plain)
}

/// Header, units and body under the chosen separator.
fn layout(lines: &[Line], cut: Cut) -> Dialect {
    let cells: Vec<Vec<Vec<u8>>> = lines.iter().map(|l| l.cells(cut)).collect();
    let row_looks: Vec<Looks> = cells.iter().map(|c| looks(c, cut)).collect();
    let names_time = |i: usize| cells[i].iter().any(|c| is_time_name(&split_unit(&text_of(c)).0));
    let is_data = |i: usize| {
        let l = row_looks[i];
        let clock = cells[i].first().is_some_and(|c| is_time_name(&split_unit(&text_of(c)).0));
        !lines[i].comment && l.numbers > 0 && l.texts <= l.cells / 2 && !clock
    };
    let first_data = (0..lines.len()).find(|&i| is_data(i));
    let width = first_data.map_or(0, |i| row_looks[i].cells);
    let before = first_data.unwrap_or(lines.len());
    let header = choose_header(lines, &cells, before, width, names_time);
    let unit_row = header.map(|h| h + 1).filter(|&u| u < before && !lines[u].comment && is_unit_row(&cells[u]));
    let body = match (unit_row.or(header), first_data) {
        (Some(last), _) => lines[last].after(cut),
        (None, Some(first)) => (lines[first].offset, lines[first].number),
        (None, None) => (0, 1),
    };
    let columns = match header {
        Some(h) => named_columns(&cells[h], unit_row.map(|u| &cells[u]), lines[h].comment),
        None => (1..=width).map(|i| (format!("c{i}"), None)).collect(),
    };
    let decimal_comma = cut.separator != b',' && prefers_comma(&cells, before);
    let any_point = cells
        .iter()
        .skip(before)
        .flatten()
        .any(|c| c.contains(&b'.') && matches!(content(c, b'.'), Content::Number(_)));
    Dialect {
        cut,
        decimal: if decimal_comma { b',' } else { b'.' },
        decimal_open: cut.separator != b',' && !decimal_comma && !any_point,
        columns,
        header_line: header.map(|h| lines[h].number),
        unit_line: unit_row.map(|u| lines[u].number),
        body,
        skipped: header.or(first_data).unwrap_or(0),
        stated: lines[..before].iter().filter_map(statement).collect(),
    }
}

/// The name and the value of a comment `# name = value`.
fn statement(line: &Line) -> Option<(String, String)> {
    let text = decode(line.bytes.trim_ascii());
    let (name, value) = text.strip_prefix('#')?.split_once('=')?;
    Some((name.trim().to_owned(), value.trim().to_owned()))
}

/// The line that names the columns: among the texts before the data the last that names a time, else the last as wide
/// as the data (before a row of units), else the last comment that is as wide.
fn choose_header(
    lines: &[Line],
    cells: &[Vec<Vec<u8>>],
    before: usize,
    width: usize,
    names_time: impl Fn(usize) -> bool,
) -> Option<usize> {
    let plain: Vec<usize> = (0..before).filter(|&i| !lines[i].comment && (cells[i].len() > 1 || width < 2)).collect();
    let named = |i: &&usize| !is_unit_row(&cells[**i]);
    let timed = |i: &&usize| names_time(**i);
    let last = |test: &dyn Fn(&&usize) -> bool| plain.iter().rev().find(|i| test(i)).copied();
    if let Some(i) = last(&|i| timed(i) && named(i)).or_else(|| last(&timed)).or_else(|| last(&named)) {
        return Some(i);
    }
    if width == 0 {
        // No row of numbers: the first row is a header over rows that are to be complained of.
        return plain.first().copied();
    }
    let trimmed = |i: usize| cells[i].iter().filter(|c| !c.is_empty() && c.as_slice() != b"#").count();
    (0..before).rev().find(|&i| lines[i].comment && width > 1 && (cells[i].len() == width || trimmed(i) == width))
}

/// Whether at least half of the cells of a row without numbers are units.
fn is_unit_row(cells: &[Vec<u8>]) -> bool {
    let texts: Vec<String> = cells.iter().map(|c| text_of(c)).filter(|t| !t.is_empty()).collect();
    let units = texts.iter().filter(|t| is_unit(strip_brackets(t)) || *t != strip_brackets(t)).count();
    !texts.is_empty() && 2 * units >= texts.len()
}

/// Whether the cells of the data write numbers with a decimal comma more often than with a point.
fn prefers_comma(cells: &[Vec<Vec<u8>>], from: usize) -> bool {
    let (mut commas, mut points) = (0, 0);
    for cell in cells.iter().skip(from).flatten() {
        commas += usize::from(cell.contains(&b',') && matches!(content(cell, b','), Content::Number(_)));
        points += usize::from(cell.contains(&b'.') && matches!(content(cell, b'.'), Content::Number(_)));
    }
    commas > points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> (u8, u8, String, Option<usize>, (usize, usize)) {
        let d = sniff(text.as_bytes(), true).unwrap();
        let names: Vec<String> =
            d.columns.iter().map(|(n, u)| u.as_ref().map_or(n.clone(), |u| format!("{n}[{u}]"))).collect();
        (d.cut.separator, d.decimal, names.join("|"), d.header_line, d.body)
    }

    #[test]
    fn separators_and_decimal_marks_are_told_apart() {
        assert_eq!(found("t,a\n0,1.5\n1,2.5\n"), (b',', b'.', "t|a".into(), Some(1), (4, 2)));
        assert_eq!(found("t;a\n0;1,5\n1;2,5\n"), (b';', b',', "t|a".into(), Some(1), (4, 2)));
        assert_eq!(found("t;a;b\n0,5;1,5;3,25\n1,5;2,5;4,5\n").0, b';');
        assert_eq!(found("t\ta\n0,0\t1,5\n0,1\t2,5\n").1, b',');
        assert_eq!(found("t|a\n0|1.5\n1|2.5\n").0, b'|');
        assert_eq!(found("t   a\n0.0   1.5\n 1.0  2.5\n").0, b' ');
        assert_eq!(found("t, a, b\n0.0, 1.5, 2\n1.0, 2.5, 3\n").0, b',');
        assert_eq!(found("sep=;\nt;a\n0;1\n").3, Some(2));
        assert_eq!(found("time,a\n2024-01-01 00:00:00.5,1\n2024-01-01 00:00:01.5,2\n").0, b',');
    }

    #[test]
    fn headers_are_found_under_preamble_comments_and_over_units() {
        assert_eq!(found("Logger v2\nCar: x\nt,a,b\n0,1,2\n1,2,3\n").2, "t|a|b");
        assert_eq!(found("# made today\n\nt,a\n0,1\n").3, Some(3));
        assert_eq!(found("# t,ax,ay\n0,1,2\n1,2,3\n").2, "t|ax|ay");
        assert_eq!(found("t,ax [g]\n0,1\n").2, "t|ax[g]");
        assert_eq!(found("t,ax,note\ns,m/s^2,\n0,1,x\n1,2,y\n").2, "t[s]|ax[m/s^2]|note");
        assert_eq!(found("t,ax\n[s],[furlong]\n0,1\n").2, "t[s]|ax[furlong]");
        assert_eq!(found("0,1\n1,2\n").2, "c1|c2");
        assert_eq!(found("\"t, s\",\"a \"\"q\"\"\"\n0,1\n").2, "t, s|a \"q\"");
        assert_eq!(found("t,a,a,,\n0,1,2,3,\n").2, "t|a|a (2)|column 4");
    }

    #[test]
    fn a_bad_row_does_not_hide_the_header() {
        // A wrong row 2 has to be reported as such, not taken for a preamble.
        assert_eq!(found("t,a\nabc,def\n0,1\n").4, (4, 2));
        assert_eq!(found("t,a,b\n0,1\n1,2\n2,3\n").2, "t|a|b");
        assert_eq!(found("t,accel_x\n").2, "t|accel_x");
    }

    #[test]
    fn round_brackets_hold_a_unit_only_if_it_is_one() {
        assert_eq!(split_unit("ax (m/s^2)"), ("ax".into(), Some("m/s^2".into())));
        assert_eq!(split_unit("Speed (GPS)"), ("Speed (GPS)".into(), None));
        assert_eq!(split_unit("acc[0]"), ("acc[0]".into(), None));
    }

    #[test]
    fn nothing_or_too_much_is_refused() {
        assert_eq!(sniff(b"\n \n", true), Err(SniffError::Empty));
        assert_eq!(sniff(b"# only\n", true), Err(SniffError::Empty));
        assert_eq!(sniff(",".repeat(5000).as_bytes(), false), Err(SniffError::TooManyColumns(1)));
    }
}
