//! The clock of a table: which column it is, its unit, and that it runs forward.

use crate::error::{ImportError, name_list};
use crate::gps_time;
use crate::mapping::{TimeFraction, TimeSource};
use crate::names::time_name;
use crate::stamp::format_utc;
use crate::table::{RawColumn, Table, TimeEpoch};
use crate::units;

/// A proposed clock and why.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ProposedClock {
    pub source: TimeSource,
    pub why: String,
    /// What was guessed.
    pub guess: Option<String>,
}

/// Propose the time column: date and time or a known name, in the unit it states or else the one its step suggests.
///
/// # Errors
/// [`ImportError::NoTime`].
pub(crate) fn propose(table: &Table) -> Result<ProposedClock, ImportError> {
    let mut clock = by_name(table)?;
    if let Some(gps) = gps_time::of(table, &clock.source) {
        clock.why = gps.behind(&clock.why);
        if !gps.sure {
            let unit = clock.guess.take().map_or(String::new(), |text| format!("{text} "));
            clock.guess = Some(unit + &gps.text);
        }
    }
    Ok(clock)
}

fn by_name(table: &Table) -> Result<ProposedClock, ImportError> {
    let named = |c: &RawColumn| time_name(&c.name);
    let best =
        table.columns.iter().filter(|c| named(c).is_some() && has_values(c)).min_by_key(|c| named(c).map(|n| n.0));
    let stamped = table.columns.iter().find(|c| c.epoch.is_some());
    let Some(column) = best.or(stamped) else {
        return split_clock(table).ok_or_else(|| no_time(table));
    };
    let source = |unit: &str| TimeSource::plain(&column.name, unit);
    if let Some(epoch) = column.epoch {
        let why = format!("date and time, counted in seconds from the first: {}", epoch_text(epoch));
        return Ok(ProposedClock { source: source("s"), why, guess: None });
    }
    let stated = column.unit.as_deref().or(named(column).and_then(|n| n.1)).filter(|u| units::factor(u, "s").is_some());
    if let Some(unit) = stated {
        return Ok(ProposedClock {
            source: source(unit),
            why: format!("a name of time, with the unit {unit}"),
            guess: None,
        });
    }
    let (unit, reason, sure) = unit_by_size(&column.values, gps_time::is_named(&column.name));
    let text = format!("time column `{}` states no unit: taken as {unit} because {reason}.", column.name);
    let guess = (!sure).then_some(text);
    Ok(ProposedClock { source: source(unit), why: format!("a name of time; {unit} because {reason}"), guess })
}

fn has_values(column: &RawColumn) -> bool {
    column.values.iter().any(|v| v.is_finite())
}

/// Seconds and nanoseconds in two columns, as ROS exports have them; the pair with most values.
fn split_clock(table: &Table) -> Option<ProposedClock> {
    let count = |c: &RawColumn| c.values.iter().filter(|v| v.is_finite()).count();
    let twin = |c: &RawColumn| {
        let others = ["nanosec", "nsec", "nanosecs"].map(|ns| c.name.replacen("sec", ns, 1));
        table.columns.iter().find(|other| others.contains(&other.name) && other.name != c.name)
    };
    let pairs = table
        .columns
        .iter()
        .filter(|c| c.name.contains("sec") && !c.name.contains("nsec") && !c.name.contains("nanosec"));
    let (seconds, nanos) = pairs.filter_map(|c| Some((c, twin(c)?))).max_by_key(|(c, _)| count(c))?;
    let fraction = TimeFraction { column: nanos.name.clone(), unit: "ns".into() };
    let source = TimeSource { fraction: Some(fraction), ..TimeSource::plain(&seconds.name, "s") };
    let text = format!("time is `{}` in seconds plus `{}` in nanoseconds", seconds.name, nanos.name);
    Some(ProposedClock { source, why: text.clone(), guess: Some(format!("{text}.")) })
}

/// Median step beyond which values are no seconds of a log, s.
const LONGEST_STEP: f64 = 3600.0;

/// Unit of a time column that states none, from its size (Unix time, or seconds since 1980 where its name says so) or its median
/// step; whether that is beyond doubt.
pub(crate) fn unit_by_size(values: &[f64], is_gps: bool) -> (&'static str, String, bool) {
    let first = values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let step = median_step(values);
    for (unit, factor) in [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)] {
        // A date only if rows follow one another as those of a log do: 0.7 s after the start are 7e8 ns as well.
        if step / factor > LONGEST_STEP {
            continue;
        }
        // 2000 to 2028 as GPS time.
        if is_gps && (6.3e8..4e9).contains(&(first / factor)) {
            return (unit, format!("its first value {first} is a date in {unit}"), unit == "s");
        }
        // 2001 to 2096 in that unit.
        if (1e9..4e9).contains(&(first / factor)) {
            let year = format_utc(first / factor);
            return (unit, format!("its first value {first} is Unix time in {unit} ({year})"), unit == "s");
        }
    }
    let reason = format!("the median step is {step:.6}");
    match step {
        s if s < 2.5 => ("s", reason, s < 0.9),
        s if s < 2_500.0 => ("ms", reason, false),
        s if s < 2.5e6 => ("us", reason, false),
        s if s.is_finite() => ("ns", reason, false),
        _ => ("s", "it has too few values to judge".into(), false),
    }
}

/// Median of the positive steps; NaN without any. Looks at up to 20,000 rows.
pub(crate) fn median_step(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).take(20_000).collect();
    let steps = finite.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 0.0).collect();
    median(steps)
}

/// The median; NaN of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    drivescope_drive::select::median(&mut values)
}

/// The instant that seconds count from, for people.
pub(crate) fn epoch_text(epoch: TimeEpoch) -> String {
    match epoch {
        TimeEpoch::Instant(ns) => format_utc(ns as f64 / 1e9),
        TimeEpoch::Midnight(ns) => format!("{} after midnight", format_utc(ns as f64 / 1e9)[11..19].to_owned()),
    }
}

/// The time of every row, s; NaN where the row has none. Never runs backwards.
///
/// # Errors
/// [`ImportError::TimeBackwards`] at the first row that is earlier than the one before it, [`ImportError::TooFewTimes`].
pub(crate) fn times(table: &Table, source: &TimeSource) -> Result<Vec<f64>, ImportError> {
    let (factor, fraction_factor) = source.factors(&table.name)?;
    let column = table.column(&source.column).ok_or_else(|| no_time(table))?;
    let fraction = source.fraction.as_ref().and_then(|f| table.column(&f.column));
    let mut times = Vec::with_capacity(table.rows);
    let (mut previous, mut previous_row, mut instants) = (f64::NEG_INFINITY, 0, 0);
    // Milli, micro and nano divide: 1234 ms is 1.234 s to the last bit, 1234 * 0.001 is not.
    let scaled = |v: f64, factor: f64| if factor < 1.0 { v / (1.0 / factor).round() } else { v * factor };
    for row in 0..table.rows {
        let rest = fraction.map_or(0.0, |f| scaled(f.values[row], fraction_factor));
        let time = scaled(column.values[row], factor) + rest + source.offset;
        if time.is_finite() {
            if time < previous && source.skip_steps_back {
                times.push(f64::NAN);
                continue;
            }
            if time < previous {
                let (file, row, previous_row) = (table.name.clone(), table.line_of(row), table.line_of(previous_row));
                let (found, previous) = (column_value(time, source, factor), column_value(previous, source, factor));
                return Err(ImportError::TimeBackwards {
                    file,
                    row,
                    column: column.name.clone(),
                    found,
                    previous,
                    previous_row,
                });
            }
            instants += usize::from(time > previous);
            (previous, previous_row) = (time, row);
        }
        times.push(if time.is_finite() { time } else { f64::NAN });
    }
    if instants < 2 {
        return Err(ImportError::TooFewTimes {
            file: table.name.clone(),
            column: column.name.clone(),
            found: instants,
        });
    }
    Ok(times)
}

/// A time as the file writes it, so that people find it there.
fn column_value(time: f64, source: &TimeSource, factor: f64) -> f64 {
    let raw = (time - source.offset) / factor;
    if factor < 1.0 { (raw * 1e6).round() / 1e6 } else { raw }
}

/// The sentence that a file has no time column.
fn no_time(table: &Table) -> ImportError {
    let names = table.columns.iter().map(|c| c.name.as_str());
    let texts = table.text_columns.iter().map(|c| c.name.as_str());
    let all: Vec<&str> = names.chain(texts).collect();
    ImportError::NoTime { file: table.name.clone(), place: table.header_place(), found: name_list(all.into_iter()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(columns: &[(&str, Option<&str>, &[f64])]) -> Table {
        let columns: Vec<RawColumn> = (columns.iter())
            .map(|(name, unit, values)| RawColumn {
                name: (*name).into(),
                unit: unit.map(str::to_owned),
                values: values.to_vec(),
                ..RawColumn::default()
            })
            .collect();
        Table {
            name: "x.csv".into(),
            rows: columns[0].values.len(),
            columns,
            line_marks: vec![(0, 2)],
            ..Table::default()
        }
    }

    #[test]
    fn the_unit_of_time_is_stated_or_follows_from_the_step() {
        let unit = |name: &str, unit: Option<&str>, values: &[f64]| {
            let clock = propose(&table(&[(name, unit, values)])).unwrap();
            (clock.source.unit, clock.guess.is_some())
        };
        assert_eq!(unit("t", None, &[0.0, 0.01, 0.02]), ("s".into(), false));
        assert_eq!(unit("time", Some("ms"), &[0.0, 1.0]), ("ms".into(), false));
        assert_eq!(unit("time_us", None, &[0.0, 1.0]), ("us".into(), false));
        assert_eq!(unit("timestamp", None, &[0.0, 10.0, 20.0]), ("ms".into(), true));
        assert_eq!(unit("timestamp", None, &[0.0, 1e4, 2e4]), ("us".into(), true));
        assert_eq!(unit("timestamp", None, &[0.0, 1e7, 2e7]), ("ns".into(), true));
        assert_eq!(unit("t", None, &[1.7635e9, 1.7635e9 + 20.0]), ("s".into(), false));
        assert_eq!(unit("t", None, &[1.7635e18, 1.7635e18 + 1e7]), ("ns".into(), true));
        assert_eq!(unit("t", None, &[0.0, 1.0, 2.0]), ("s".into(), true));
    }

    #[test]
    fn seconds_and_nanoseconds_in_two_columns_are_one_clock() {
        let t = table(&[("stamp_sec_imu", None, &[5.0, 5.0, 6.0]), ("stamp_nanosec_imu", None, &[0.0, 5e8, 2.5e8])]);
        let clock = propose(&t).unwrap();
        assert_eq!(times(&t, &clock.source).unwrap(), [5.0, 5.5, 6.25]);
    }

    #[test]
    fn time_running_backwards_is_refused_with_the_place() {
        let t = table(&[("t", Some("ms"), &[0.0, 10.0, 5.0])]);
        assert_eq!(
            times(&t, &propose(&t).unwrap().source).unwrap_err().to_string(),
            "x.csv, row 4, column `t`: expected a time after 10 (row 3), found 5; time runs backwards here: sort the rows by time or cut the file in two."
        );
    }

    #[test]
    fn a_standing_clock_and_no_clock_are_refused() {
        let t = table(&[("t", None, &[1.0, 1.0, f64::NAN])]);
        let error = times(&t, &propose(&t).unwrap().source).unwrap_err();
        assert_eq!(
            error.to_string(),
            "x.csv, column `t`: expected at least 2 different times, found 1; check the export of this column."
        );
        let error = propose(&table(&[("accel_x", None, &[1.0, 2.0])])).unwrap_err();
        assert!(error.to_string().contains("found `accel_x`"), "{error}");
    }

    /// Catches: a clock of nanoseconds since the start taken for a date in seconds, because its first value is of that size.
    #[test]
    fn a_clock_since_the_start_is_no_date_however_large_its_numbers() {
        let rows = |first: f64, step: f64| (0..100).map(|k| first + step * f64::from(k)).collect::<Vec<f64>>();
        assert_eq!(unit_by_size(&rows(7e8, 1e7), true).0, "ns");
        assert_eq!(unit_by_size(&rows(1.5e9, 1e7), false).0, "ns");
        assert_eq!(unit_by_size(&rows(1.2e9, 1e4), true).0, "us");
        assert_eq!(unit_by_size(&rows(1.2e9, 0.01), true).0, "s");
        assert_eq!(unit_by_size(&rows(1.7e9, 0.01), false).0, "s");
    }
}
