//! Names and units of columns in the header of a text file.

use crate::error::decode;
use crate::register::Named;
use crate::units::is_unit;

/// Names and units of the header's cells; a cell without name is named by its place, a name met again is numbered.
pub(crate) fn named_columns(
    header: &[Vec<u8>],
    units: Option<&Vec<Vec<u8>>>,
    comment: bool,
) -> Vec<(String, Option<String>)> {
    let mut texts: Vec<String> = header.iter().map(|c| text_of(c)).collect();
    if comment && let Some(first) = texts.first_mut() {
        *first = first.trim_start_matches(['#', '%', '/', ' ']).to_owned();
        if first.is_empty() {
            texts.remove(0);
        }
    }
    if texts.len() > 1 && texts.last().is_some_and(String::is_empty) {
        texts.pop();
    }
    let mut columns: Vec<(String, Option<String>)> = Vec::with_capacity(texts.len());
    let mut seen = Named::<usize>::default();
    for (i, text) in texts.iter().enumerate() {
        let (mut name, mut unit) = split_unit(text);
        if name.is_empty() {
            name = format!("column {}", i + 1);
        }
        let times = seen.entry(name.clone(), || 0);
        *times += 1;
        if *times > 1 {
            name = format!("{name} ({times})");
        }
        if let Some(below) = units.and_then(|u| u.get(i)) {
            let below = strip_brackets(&text_of(below)).to_owned();
            unit = unit.or(Some(below).filter(|u| !u.is_empty()));
        }
        columns.push((name, unit));
    }
    columns
}

/// The text of a cell on one line.
pub(crate) fn text_of(cell: &[u8]) -> String {
    decode(cell).replace("\"\"", "\"").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Without the brackets around all of it.
pub(crate) fn strip_brackets(text: &str) -> &str {
    let inner = |open, close| text.strip_prefix(open).and_then(|t| t.strip_suffix(close)).map(str::trim);
    inner('[', ']').or_else(|| inner('(', ')')).or_else(|| inner('{', '}')).unwrap_or(text)
}

/// Split `ax [g]` or `ax (m/s^2)` into name and unit. Square brackets always hold a unit, round ones if it is known.
pub(crate) fn split_unit(text: &str) -> (String, Option<String>) {
    for (open, close, sure) in [('[', ']', true), ('(', ')', false), ('{', '}', false)] {
        if let Some((name, rest)) = text.rsplit_once(open)
            && let Some(unit) = rest.trim_end().strip_suffix(close)
            && (is_unit(unit.trim()) || (sure && unit.parse::<u64>().is_err() && !unit.trim().is_empty()))
            && !name.trim().is_empty()
        {
            return (name.trim().to_owned(), Some(unit.trim().to_owned()));
        }
    }
    (text.trim().to_owned(), None)
}
