//! A mapping proposed from names, units and physics, with the reason for each entry.

use drivescope_drive::csv::file_unit;
use serde::Serialize;

use crate::by_name::ByName;
use crate::candidate::{Candidate, Confidence, Unused};
use crate::channels::signal;
use crate::clock;
use crate::error::ImportError;
use crate::evidence::{Draft, Settled};
use crate::mapping::{Mapping, SignalSource};
use crate::names::{self, time_name};
use crate::order::sort_by;
use crate::table::{RawColumn, Table};
use crate::units;

/// One entry of a proposed mapping.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Canonical name of the signal; `t` for the clock.
    pub signal: String,
    /// Raw column.
    pub column: String,
    /// Why: name, alias, unit, physics.
    pub why: String,
    /// How sure.
    pub confidence: Confidence,
}

/// A mapping with its reasons.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Proposal {
    /// The mapping.
    pub mapping: Mapping,
    /// A reason for every entry.
    pub entries: Vec<Entry>,
    /// What is left out.
    pub unused: Vec<Unused>,
    /// Every guess and every doubt, in words and with its numbers.
    pub notes: Vec<String>,
}

/// Propose a mapping of a table from its columns' names and units, checked against physics.
///
/// # Errors
/// [`ImportError::NoTime`], [`ImportError::TimeBackwards`], [`ImportError::TooFewTimes`], and
/// [`ImportError::NoSignals`] if no column is understood.
pub fn propose(table: &Table) -> Result<Proposal, ImportError> {
    let clock = clock::propose(table)?;
    let time = clock::times(table, &clock.source)?;
    let is_time =
        |name: &str| name == clock.source.column || clock.source.fraction.as_ref().is_some_and(|f| f.column == name);
    let mut notes: Vec<String> = clock.guess.iter().cloned().collect();
    let mut unused: Vec<Unused> = Vec::new();
    let candidates = choose(table, &is_time, &mut notes, &mut unused);
    if candidates.is_empty() {
        let (place, found) = (table.header_place(), table.columns_found());
        return Err(ImportError::NoSignals { file: table.name.clone(), place, found });
    }
    let mut draft = Draft::new(table, &time, candidates, notes);
    crate::physics::check(&mut draft);
    let Settled { candidates, notes, removed, repeating } = draft.finish();
    unused.extend(removed);
    let mut signals = ByName::default();
    let confidence = if clock.guess.is_some() { Confidence::Likely } else { Confidence::Certain };
    let mut entries =
        vec![Entry { signal: "t".into(), column: clock.source.column.clone(), why: clock.why, confidence }];
    for c in candidates {
        let column = table.columns[c.column].name.clone();
        let unit = (signal(&c.signal).map(|s| file_unit(&c.signal, s.unit)) != Some(c.unit.as_str())).then_some(c.unit);
        let source = SignalSource { unit, scale: c.scale, ..SignalSource::plain(&column) };
        signals.insert(c.signal.clone(), source);
        entries.push(Entry { signal: c.signal, column, why: c.why.join("; "), confidence: c.confidence });
    }
    unused.extend(
        table
            .text_columns
            .iter()
            .map(|t| Unused { column: t.name.clone(), reason: format!("holds text such as `{}`", t.example) }),
    );
    Ok(Proposal {
        mapping: Mapping { signals, drop_repeats: repeating, ..Mapping::of(clock.source) },
        entries,
        unused,
        notes,
    })
}

/// For every column the signal it is, best names first; what is left out goes to `unused`, doubts to `notes`.
pub(crate) fn choose(
    table: &Table,
    is_time: &dyn Fn(&str) -> bool,
    notes: &mut Vec<String>,
    unused: &mut Vec<Unused>,
) -> Vec<Candidate> {
    let mut chosen: Vec<Candidate> = Vec::new();
    let mut open: Vec<(usize, names::Match)> = Vec::new();
    let mut reasons: Vec<Option<String>> = vec![None; table.columns.len()];
    for (index, column) in table.columns.iter().enumerate().filter(|(_, c)| !is_time(&c.name)) {
        match understand(column, table) {
            Ok(found) => open.extend(found.into_iter().map(|m| (index, m))),
            Err(reason) => reasons[index] = Some(reason),
        }
    }
    sort_by(&mut open, |a, b| (a.1.rank, a.0).cmp(&(b.1.rank, b.0)));
    for (index, found) in open {
        if chosen.iter().any(|c| c.column == index) {
            continue;
        }
        if let Some(taken) = chosen.iter().find(|c| c.signal == found.signal) {
            let by = &table.columns[taken.column].name;
            reasons[index].get_or_insert_with(|| format!("{} is already taken from `{by}`", found.signal));
            continue;
        }
        if let Some(doubt) = found.doubt {
            notes.push(format!("`{}` is read as {}: {doubt}.", table.columns[index].name, found.signal));
        }
        chosen.push(candidate(index, &table.columns[index], found));
    }
    for (index, column) in table.columns.iter().enumerate() {
        if !is_time(&column.name) && !chosen.iter().any(|c| c.column == index) {
            let reason = reasons[index].take().unwrap_or_else(|| stranger(column, &chosen, table));
            unused.push(Unused { column: column.name.clone(), reason });
        }
    }
    sort_by(&mut chosen, |a, b| a.column.cmp(&b.column));
    chosen
}

/// The name that a column shares with an earlier one, if it is told apart from that by a number or a place in brackets.
fn twin<'a>(column: &'a RawColumn, table: &Table) -> Option<&'a str> {
    let (bare, _) = column.name.strip_suffix(')')?.split_once(" (")?;
    table.column(bare).map(|_| bare)
}

/// What a column may be, or why it is nothing.
fn understand(column: &RawColumn, table: &Table) -> Result<Vec<names::Match>, String> {
    if !column.values.iter().any(|v| v.is_finite()) {
        return Err("has no value in any row".into());
    }
    if column.epoch.is_some() || time_name(&column.name).is_some() {
        return Err("is another column of time".into());
    }
    let all = match column.meaning {
        Some(m) => vec![names::Match { signal: m.signal.to_owned(), sign: m.sign, unit: None, rank: 0, doubt: None }],
        None => names::matches(twin(column, table).unwrap_or(&column.name)),
    };
    let stated = |m: &names::Match| column.unit.as_deref().or(m.unit).map(str::to_owned);
    let fits = |m: &names::Match| {
        let si = signal(&m.signal).map_or("1", |c| c.unit);
        stated(m).is_none_or(|unit| units::factor(&unit, si).is_some())
    };
    if let (Some(first), false) = (all.first(), all.iter().any(fits)) {
        let unit = stated(first).unwrap_or_default();
        return Err(format!("its name is that of {}, but its unit {unit} is not", first.signal));
    }
    Ok(all.into_iter().filter(fits).collect())
}

fn candidate(index: usize, column: &RawColumn, found: names::Match) -> Candidate {
    let si = signal(&found.signal).map_or("1", |c| c.unit);
    let canonical = file_unit(&found.signal, si);
    let mut why = vec![match found.rank {
        _ if column.meaning.is_some() => format!("`{}` is {} by the format's definition", column.name, found.signal),
        0 => "canonical name".to_owned(),
        _ => format!("`{}` is a name of {}", column.name, found.signal),
    }];
    let stated = column.unit.as_deref().or(found.unit);
    match stated {
        Some(unit) => why.push(format!("unit {unit} as the file states")),
        None if canonical == "1" => {}
        None => why.push(format!("unit {canonical} by convention, none is stated")),
    }
    if found.sign < 0.0 {
        why.push("the name counts the other way: sign turned".into());
    }
    let confidence = match (found.rank, stated.is_some() || canonical == "1") {
        (2.., _) => Confidence::Guess,
        (0, _) | (_, true) => Confidence::Certain,
        _ => Confidence::Likely,
    };
    let unit = stated.unwrap_or(canonical).to_owned();
    Candidate {
        signal: found.signal,
        column: index,
        unit,
        stated: stated.is_some(),
        scale: found.sign,
        rank: found.rank,
        why,
        confidence,
    }
}

/// Why a column whose name is not understood is left out.
fn stranger(column: &RawColumn, chosen: &[Candidate], table: &Table) -> String {
    if column.name.starts_with("truth_") {
        return "no such truth signal".into();
    }
    let Some(like) = names::unknown_prefix(&column.name) else {
        return "its name is not known".into();
    };
    match chosen.iter().find(|c| c.signal == like.signal) {
        Some(taken) => {
            let by = &table.columns[taken.column].name;
            format!("looks like {}, which is already taken from `{by}`; its own axis and sign are unknown", like.signal)
        }
        None => format!("looks like {} of a source that is not known; a mapping can use it", like.signal),
    }
}
