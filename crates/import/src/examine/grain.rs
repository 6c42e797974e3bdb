//! What is odd in single columns: coarse steps, values that never change, copies of another column.

use super::survey::{Finding, Kind, Survey, Weight, canonical_unit, kind};
use crate::table::{RawColumn, Table};
use crate::units;

/// Values of a column that are looked at.
const LOOKED_AT: usize = 4000;
/// A column of so many different values is coarse; of fewer than the first, a state.
const COARSE: std::ops::Range<usize> = 4..240;
/// Columns that are compared with one another, and that are named in one sentence.
const COMPARED: usize = 512;
const NAMED: usize = 8;

/// Say what is odd in tables as they were read: before they are one, since columns without a name are left out there.
pub(crate) fn odd_columns(tables: &[Table]) -> Vec<Finding> {
    let label = |t: &Table, c: &RawColumn| {
        if tables.len() == 1 || t.part.is_empty() {
            format!("`{}`", c.name)
        } else {
            format!("`{}` of {}", c.name, t.part)
        }
    };
    let all = tables.iter().flat_map(|t| t.columns.iter().map(move |c| (t, c)));
    let columns: Vec<Labelled> =
        all.filter(|(_, c)| c.epoch.is_none()).map(|(t, c)| Labelled { label: label(t, c), column: c }).collect();
    still(&columns).into_iter().chain(copies(&columns)).collect()
}

/// A column with its name for people.
struct Labelled<'t> {
    label: String,
    column: &'t RawColumn,
}

/// Several sentences as one list, the first few in full.
fn finding(weight: Weight, columns: Vec<String>, list: &[String], frame: impl Fn(String) -> String) -> Option<Finding> {
    let more = if list.len() > NAMED { format!(", and {} more", list.len() - NAMED) } else { String::new() };
    let some = list[..list.len().min(NAMED)].join(", ") + &more;
    (!list.is_empty()).then(|| Finding { weight, columns, text: frame(some), correction: None })
}

/// The step in which values come, if there is one and it is coarse.
fn step(column: &RawColumn) -> Option<f64> {
    let finite = column.values.iter().copied().filter(|v| v.is_finite());
    let mut values: Vec<f64> = finite.take(LOOKED_AT).collect();
    let count = values.len();
    crate::order::sort_by(&mut values, |a, b| a.total_cmp(b));
    values.dedup();
    if count < 200 || !COARSE.contains(&values.len()) || 4 * values.len() > count {
        return None;
    }
    let gaps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let step = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let off = |gap: &f64| (gap / step - (gap / step).round()).abs();
    gaps.iter().all(|gap| off(gap) < 0.02).then_some(step)
}

/// Coarse steps of sensors that should not come in steps.
pub(crate) fn look(s: &mut Survey) {
    let mut found: Vec<(Kind, &'static str, f64, Vec<usize>)> = Vec::new();
    for (column, raw) in s.table.columns.iter().enumerate() {
        let role = s.roles[column].as_ref().map(|r| (r.signal.clone(), r.unit.clone()));
        let known = role.or_else(|| s.names[column].as_ref().map(|c| (c.signal.clone(), c.unit.clone())));
        let Some((signal, unit)) = known else { continue };
        let kind = kind(&signal);
        if !matches!(kind, Kind::Accel | Kind::Gyro | Kind::Mag) || s.scene.fields[column].period > 0.6 {
            continue;
        }
        let si = canonical_unit(&signal);
        let (Some(step), Some(factor)) = (step(raw), units::factor(&unit, si)) else { continue };
        let step = step * factor;
        match found.iter_mut().find(|f| f.0 == kind && (f.2 / step - 1.0).abs() < 0.02) {
            Some(same) => same.3.push(column),
            None => found.push((kind, si, step, vec![column])),
        }
    }
    for (_, unit, step, columns) in found {
        let labels: Vec<String> = columns.iter().map(|c| s.label(*c)).collect();
        let shown =
            if unit == "rad/s" { format!("{:.3} deg/s", step.to_degrees()) } else { format!("{step:.4} {unit}") };
        let text = format!(
            "{} {} in steps of {shown}: a 1-sigma below {:.4} {unit} (the step over the root of 12) says more than they measure.",
            labels.join(", "),
            if labels.len() == 1 { "comes" } else { "come" },
            step / 12_f64.sqrt()
        );
        s.find(Weight::Note, &columns, text);
    }
}

/// Words of names of angles that move on any drive; what names explain, the proposal doubts itself.
const MOVES: [&str; 4] = ["roll", "pitch", "yaw", "heading"];

/// Columns that never change though they are called what moves.
fn still(columns: &[Labelled]) -> Option<Finding> {
    let mut found: Vec<(&Labelled, f64, usize)> = Vec::new();
    for one in columns {
        let name = &one.column.name;
        let is_angle = name.len() < 200 && crate::names::normalize(name).split('_').any(|w| MOVES.contains(&w));
        if !is_angle || name.starts_with("truth_") {
            continue;
        }
        let mut values = one.column.values.iter().copied().filter(|v| v.is_finite());
        let Some(first) = values.next() else { continue };
        let count = 1 + values.clone().count();
        if count >= 100 && values.all(|v| v == first) {
            found.push((one, first, count));
        }
    }
    let list: Vec<String> = found.iter().map(|(c, v, n)| format!("{} is {v} in all {n} rows", c.label)).collect();
    let names = found.iter().map(|f| f.0.column.name.clone()).collect();
    finding(Weight::Contradiction, names, &list, |some| {
        format!("what should move never changes: {some}; not measured, or not connected.")
    })
}

/// Columns whose values are those of another one, in the same order.
fn copies(columns: &[Labelled]) -> Option<Finding> {
    let key = |c: &Labelled| {
        let (mut count, mut sum, mut least, mut most) = (0_usize, 0.0, f64::INFINITY, f64::NEG_INFINITY);
        for &v in c.column.values.iter().filter(|v| v.is_finite()) {
            (count, sum, least, most) = (count + 1, sum + v, v.min(least), v.max(most));
        }
        (count >= 100 && least < most).then_some([count as f64, sum, least, most])
    };
    let same = |a: &RawColumn, b: &RawColumn| {
        let of = |c: &RawColumn| c.values.iter().copied().filter(|v| v.is_finite()).collect::<Vec<f64>>();
        let (a, b) = (of(a), of(b));
        // A state that changes seldom may be the same by chance, and a counter always is.
        let rises = a.windows(2).filter(|w| w[1] > w[0]).count();
        let changes = a.windows(2).filter(|w| w[0] != w[1]).count();
        changes >= 20 && 10 * rises < 9 * changes && a == b
    };
    let keys: Vec<Option<[f64; 4]>> = columns.iter().take(COMPARED).map(key).collect();
    let mut found: Vec<(usize, usize)> = Vec::new();
    for b in 0..keys.len() {
        let is_twin =
            |a: &usize| keys[*a].is_some() && keys[*a] == keys[b] && same(columns[*a].column, columns[b].column);
        found.extend((0..b).find(is_twin).map(|a| (a, b)));
    }
    let list: Vec<String> =
        found.iter().map(|(a, b)| format!("{} is {}", columns[*b].label, columns[*a].label)).collect();
    let names = found.iter().map(|f| columns[f.1].column.name.clone()).collect();
    finding(Weight::Note, names, &list, |some| format!("columns are copies of others, value by value: {some}."))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(values: impl Iterator<Item = f64>) -> RawColumn {
        RawColumn { name: "a".into(), values: values.collect(), ..RawColumn::default() }
    }

    /// Catches a step that is taken for one because two values happen to be near, and a state taken for a sensor.
    #[test]
    fn a_coarse_sensor_comes_in_one_step_and_a_fine_one_in_none() {
        let wave = |k: u32| (0.37 * f64::from(k)).sin() * 3.0;
        assert_eq!(step(&column((0..1000).map(|k| (wave(k) * 8.0).round() / 8.0))), Some(0.125));
        assert_eq!(step(&column((0..1000).map(wave))), None);
        assert_eq!(step(&column((0..1000).map(|k| f64::from(k % 2)))), None);
    }
}
