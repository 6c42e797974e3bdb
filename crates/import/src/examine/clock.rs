//! The clock among the columns, and what is odd in it.

use super::survey::{Finding, Weight};
use crate::candidate::Confidence;
use crate::clock::{self, median_step};
use crate::error::ImportError;
use crate::mapping::TimeSource;
use crate::table::Table;

/// A clock, how sure it is and why.
pub(crate) struct Clock {
    pub source: TimeSource,
    pub confidence: Confidence,
    pub why: String,
}

/// How far samples are from a straight line over time, as a share of their range; 1 of fewer than three.
pub(crate) fn straightness(samples: &[(f64, f64)]) -> f64 {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return 1.0 };
    let (range, slope) = ((last.1 - first.1).abs(), (last.1 - first.1) / (last.0 - first.0));
    if samples.len() < 3 || range <= 0.0 || !slope.is_finite() {
        return 1.0;
    }
    samples.iter().map(|(t, v)| (v - first.1 - slope * (t - first.0)).abs()).fold(0.0, f64::max) / range
}

/// How well values serve as a clock: share of rows that have one and go forward in steps about as long as the median.
fn regularity(values: &[f64]) -> f64 {
    let step = median_step(values);
    if step.is_nan() || step <= 0.0 {
        return 0.0;
    }
    let (mut good, mut back, mut last) = (0_usize, 0_usize, f64::NAN);
    for &v in values.iter().filter(|v| v.is_finite()) {
        let d = (v - last) / step;
        good += usize::from(d > 0.2 && d < 5.0);
        back += usize::from(d < 0.0);
        last = v;
    }
    (good as f64 - 5.0 * back as f64) / values.len().max(1) as f64
}

/// The clock by its name, or by its steps where the name misleads or is missing.
///
/// # Errors
/// [`ImportError::NoTime`] if no column runs forward.
pub(crate) fn find(table: &Table, findings: &mut Vec<Finding>) -> Result<Clock, ImportError> {
    let named = clock::propose(table);
    let by_name = match &named {
        Ok(c) => {
            let column = table.column(&c.source.column);
            let stamped = column.is_some_and(|v| v.epoch.is_some()) || c.source.fraction.is_some();
            if stamped { 1.0 } else { column.map_or(0.0, |v| regularity(&v.values)) }
        }
        Err(_) => 0.0,
    };
    let best = (0..table.columns.len())
        .map(|i| (i, regularity(&table.columns[i].values)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|b| b.1 > 0.7);
    let Some((index, score)) = best.filter(|b| b.1 > by_name + 0.3 || named.is_err()) else {
        return named.map(|c| {
            let confidence = if c.guess.is_some() { Confidence::Likely } else { Confidence::Certain };
            Clock { source: c.source, confidence, why: c.why }
        });
    };
    let column = &table.columns[index];
    let (unit, reason, sure) = clock::unit_by_size(&column.values, crate::gps_time::is_named(&column.name));
    let why = format!(
        "the only column that runs forward in even steps ({:.0} % of the rows); {unit} because {reason}",
        100.0 * score
    );
    if let Ok(c) = named {
        let text = format!(
            "`{}` does not run forward evenly; `{}` does and was taken as the clock.",
            c.source.column, column.name
        );
        findings.push(Finding {
            weight: Weight::Contradiction,
            columns: vec![c.source.column, column.name.clone()],
            text,
            correction: None,
        });
    }
    let source = TimeSource::plain(&column.name, unit);
    let gps = crate::gps_time::of(table, &source);
    let sure = sure && gps.as_ref().is_none_or(|gps| gps.sure);
    let why = if let Some(gps) = gps { gps.behind(&why) } else { why };
    Ok(Clock { source, confidence: if sure { Confidence::Certain } else { Confidence::Likely }, why })
}

/// Shorter, nothing is missing, s: a bus log has messages of many rates.
const GAP: f64 = 0.1;

/// Steps back, standing clock, gaps, Unix or GPS time: what is odd in the times of the rows as the file has them.
pub(crate) fn oddities(table: &Table, source: &TimeSource, findings: &mut Vec<Finding>) -> bool {
    let Some(column) = table.column(&source.column) else { return false };
    let factor = crate::units::factor(&source.unit, "s").unwrap_or(1.0);
    let values = &column.values;
    let step = median_step(values);
    let (mut back, mut worst, mut first_back) = (0_usize, 0.0_f64, None);
    let (mut same, mut gaps, mut longest, mut latest, mut previous) =
        (0_usize, 0_usize, (0.0_f64, 0), f64::NAN, f64::NAN);
    for (row, &v) in values.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        let d = v - previous;
        if v < latest {
            back += 1;
            first_back.get_or_insert(row);
            worst = worst.max(latest - v);
        }
        same += usize::from(d == 0.0);
        let pause = v - latest;
        if pause > 10.0 * step && pause * factor > GAP {
            gaps += 1;
            longest = if pause > longest.0 { (pause, row) } else { longest };
        }
        previous = v;
        latest = v.max(if latest.is_nan() { v } else { latest });
    }
    let mut say = |weight: Weight, text: String| {
        findings.push(Finding { weight, columns: vec![column.name.clone()], text, correction: None });
    };
    if back > 0 && source.fraction.is_none() {
        let line = table.line_of(first_back.unwrap_or(0));
        say(
            Weight::Contradiction,
            format!(
                "`{}` steps back: {back} rows are earlier than one before them, by up to {:.3} s, first in row {line}; they were left out.",
                column.name,
                worst * factor
            ),
        );
    }
    if same > 0 && source.fraction.is_none() {
        say(
            Weight::Note,
            format!(
                "`{}` stands still in {same} of {} rows: samples of other sensors, or duplicates.",
                column.name,
                values.len()
            ),
        );
    }
    if gaps > 0 {
        say(
            Weight::Note,
            format!(
                "`{}` has {gaps} {} of more than ten steps of {:.4} s; the longest is {:.3} s, before row {}.",
                column.name,
                if gaps == 1 { "gap" } else { "gaps" },
                step * factor,
                longest.0 * factor,
                table.line_of(longest.1)
            ),
        );
    }
    match crate::gps_time::of(table, source) {
        Some(gps) => say(if gps.sure { Weight::Note } else { Weight::Guess }, gps.text),
        None => old_unix_time(values, factor, &column.name, &mut say),
    }
    back > 0 && source.fraction.is_none()
}

/// Unix time of so long ago that it may be seconds since 1980 as receivers count them.
fn old_unix_time(values: &[f64], factor: f64, name: &str, say: &mut dyn FnMut(Weight, String)) {
    let first = values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0) * factor;
    if (1.0e9..1.48e9).contains(&first) {
        // GPS time began on 1980-01-06; 18 leap seconds since.
        let gps = first + 315_964_800.0 - 18.0;
        let (unix_text, gps_text) = (crate::stamp::format_utc(first), crate::stamp::format_utc(gps));
        say(
            Weight::Note,
            format!("`{name}` begins at {first:.1} s: as Unix time {unix_text}; as GPS time it would be {gps_text}."),
        );
    }
}
