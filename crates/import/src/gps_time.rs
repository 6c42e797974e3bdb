//! GPS time: seconds since 1980, or a week and the time of that week; told by a column's name and its values.

use crate::mapping::TimeSource;
use crate::names::normalize;
use crate::stamp::format_utc;
use crate::table::{RawColumn, Table};
use crate::units;

/// GPS time counts from 1980-01-06, s since 1970.
const ZERO: f64 = 315_964_800.0;
/// Seconds of a week.
const WEEK: f64 = 604_800.0;
/// The year 2000, s since 1970: no log is older.
const OLDEST: f64 = 946_684_800.0;
/// The year 2028 in GPS time, s: what a column of GPS time counts beyond this is taken for Unix time.
const LATEST: f64 = 1_830_297_600.0 - ZERO;
/// By how many seconds GPS time is ahead of UTC from an instant on, s since 1970 (IERS Bulletins C 30 to 52).
const LEAPS: [(f64, f64); 5] = [
    (1_483_228_800.0, 18.0),
    (1_435_708_800.0, 17.0),
    (1_341_100_800.0, 16.0),
    (1_230_768_000.0, 15.0),
    (1_136_073_600.0, 14.0),
];
/// Names of the week beside a time of week.
const WEEKS: [&str; 8] =
    ["gps_week", "gnss_week", "gps_week_number", "week_number", "weekno", "week_no", "week", "gps_wn"];

/// What a clock of GPS time counts from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GpsTime {
    /// Unix time of its zero, s; `None` where only the time of a week is known, and where it is Unix time.
    pub zero: Option<f64>,
    /// Whether that is beyond doubt.
    pub sure: bool,
    /// One sentence.
    pub text: String,
}

impl GpsTime {
    /// The reason for a clock with what is told here behind it.
    pub fn behind(&self, why: &str) -> String {
        format!("{why}; {}", self.text.trim_end_matches('.'))
    }
}

/// Whether a name says that a column is of a receiver's time.
pub(crate) fn is_named(name: &str) -> bool {
    let name = normalize(name);
    let is_word = |w: &str| ["gps", "gnss", "gpst", "gpstime", "tow", "itow", "sow"].contains(&w);
    name.split('_').any(is_word) || name.contains("time_of_week")
}

/// UTC as Unix time of seconds of GPS time.
fn utc(gps: f64) -> f64 {
    let unix = gps + ZERO;
    unix - LEAPS.iter().find(|(from, leap)| unix - leap >= *from).map_or(13.0, |(_, leap)| *leap)
}

/// What a clock counts from, if its name says that it is GPS time.
pub(crate) fn of(table: &Table, source: &TimeSource) -> Option<GpsTime> {
    let column = table.column(&source.column).filter(|c| c.epoch.is_none() && is_named(&c.name))?;
    let first = first(column)? * units::factor(&source.unit, "s")?;
    let begins = format!("`{}` begins at {first:.1} s: ", column.name);
    if (OLDEST - ZERO..LATEST).contains(&first) {
        let date = format_utc(utc(first));
        // As Unix time it would be older than any log.
        let sure = first < OLDEST;
        let doubt = if sure { String::new() } else { format!("; as Unix time it would be {}", format_utc(first)) };
        let text = format!("{begins}taken as GPS time, seconds since 1980, that is {date}{doubt}.");
        return Some(GpsTime { zero: Some(utc(first) - first), sure, text });
    }
    if (LATEST..4e9).contains(&first) {
        let (unix, gps) = (format_utc(first), format_utc(utc(first)));
        let text = format!("{begins}taken as Unix time, {unix}; as GPS time it would be {gps}.");
        return Some(GpsTime { zero: None, sure: false, text });
    }
    let of_week = (0.0..=WEEK).contains(&first);
    let week = table.columns.iter().find(|c| WEEKS.contains(&normalize(&c.name).as_str()));
    match week.and_then(|c| Some((c, self::first(c)?))).filter(|_| of_week) {
        Some((week, number)) => Some(with_week(&begins, first, &week.name, number)),
        None if of_week && first > 3600.0 => {
            let day = (first / 86_400.0).floor();
            let text = format!("{begins}seconds of a GPS week (day {day:.0} of it); the week is not stated.");
            Some(GpsTime { zero: None, sure: true, text })
        }
        None => None,
    }
}

fn first(column: &RawColumn) -> Option<f64> {
    column.values.iter().copied().find(|v| v.is_finite())
}

fn with_week(begins: &str, first: f64, name: &str, number: f64) -> GpsTime {
    let gps = number * WEEK + first;
    let is_whole = number.fract() == 0.0 && (OLDEST - ZERO..LATEST).contains(&gps);
    if !is_whole {
        let text = format!(
            "{begins}seconds of a GPS week; `{name}` is {number}, which is no week from 2000 on (receivers that count to 1023 begin anew)."
        );
        return GpsTime { zero: None, sure: true, text };
    }
    let text = format!("{begins}seconds of GPS week {number} in `{name}`, that is {}.", format_utc(utc(gps)));
    GpsTime { zero: Some(utc(gps) - first), sure: true, text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(columns: &[(&str, f64)]) -> Table {
        let column = |(name, first): &(&str, f64)| RawColumn {
            name: (*name).into(),
            values: vec![f64::NAN, *first, first + 0.1],
            ..RawColumn::default()
        };
        Table { rows: 3, columns: columns.iter().map(column).collect(), ..Table::default() }
    }

    fn told(columns: &[(&str, f64)], unit: &str) -> Option<(Option<f64>, bool, String)> {
        of(&table(columns), &TimeSource::plain(columns[0].0, unit)).map(|g| (g.zero, g.sure, g.text))
    }

    /// Catches a leap second too many or too few at either side of every step, and Unix time of another zero.
    #[test]
    fn gps_time_is_ahead_of_utc_by_the_leap_seconds_of_its_date() {
        // 2016-12-31T23:59:59Z and 2017-01-01T00:00:00Z have 17 and 18 of them, and one between.
        for (gps, unix) in [
            (1_167_264_016.0, 1_483_228_799.0),
            (1_167_264_018.0, 1_483_228_800.0),
            (820_108_814.0, 1_136_073_600.0),
            (630_720_013.0, 946_684_800.0),
        ] {
            assert_eq!(utc(gps), unix, "{gps}");
        }
    }

    /// Catches Unix time taken for GPS time and the other way, and a date that is certain although both are likely.
    #[test]
    fn seconds_since_1980_are_told_by_name_and_value() {
        let (zero, sure, text) = told(&[("gps_time", 1.38e9)], "s").unwrap();
        assert_eq!((zero, sure), (Some(ZERO - 18.0), false));
        assert!(text.contains("as GPS time, seconds since 1980, that is 2023-09-29T05:19:42Z; as Unix time it would be 2013-09-24T05:20:00Z"), "{text}");
        let (zero, sure, text) = told(&[("GPS Time", 9.0e11)], "ms").unwrap();
        assert!(
            zero == Some(ZERO - 14.0) && sure && !text.contains("Unix"),
            "2008 in GPS time, 1998 in Unix time: {text}"
        );
        let (zero, sure, text) = told(&[("gps_time", 1.7e9)], "s").unwrap();
        assert!(zero.is_none() && !sure && text.contains("taken as Unix time, 2023-11-14T22:13:20Z"), "{text}");
        assert_eq!(told(&[("unix_time", 1.38e9)], "s"), None);
        assert_eq!(told(&[("gps_time", 12.5)], "s"), None, "seconds of the log");
    }

    /// Catches a week that is left out, one that has rolled over and is believed, and milliseconds as seconds.
    #[test]
    fn a_week_and_its_seconds_are_a_date() {
        let (zero, sure, text) = told(&[("itow", 259_200_000.0), ("gps_week", 2281.0)], "ms").unwrap();
        assert_eq!((zero, sure), (Some(2281.0 * WEEK + ZERO - 18.0), true));
        assert!(text.ends_with("seconds of GPS week 2281 in `gps_week`, that is 2023-09-26T23:59:42Z."), "{text}");
        let (zero, _, text) = told(&[("tow", 259_200.0), ("week", 233.0)], "s").unwrap();
        assert!(zero.is_none() && text.contains("begin anew"), "{text}");
        let (zero, _, text) = told(&[("tow", 259_200.0)], "s").unwrap();
        assert!(zero.is_none() && text.contains("day 3 of it); the week is not stated"), "{text}");
    }
}
