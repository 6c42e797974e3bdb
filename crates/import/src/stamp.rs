//! Date and time in cells: ISO 8601 and its common variants.

const DAY: i64 = 86_400;
const NS: i64 = 1_000_000_000;

/// An instant written in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stamp {
    /// Nanoseconds since 1970-01-01 UTC (local time where the cell names no zone).
    Instant(i64),
    /// Nanoseconds since midnight.
    TimeOfDay(i64),
}

/// Parse `YYYY-MM-DD[T ]hh:mm[:ss[.f]][Z|+hh:mm]` (also with `/`), or `hh:mm:ss[.f]`; `None` for anything else.
pub(crate) fn parse(text: &[u8]) -> Option<Stamp> {
    // Everything accepted has a digit first and a colon; most cells are turned away here.
    if text.len() < 7 || text.len() > 40 || !text[0].is_ascii_digit() || !text.contains(&b':') {
        return None;
    }
    let mut cursor = Cursor { text, pos: 0 };
    let separator = *text.get(4)?;
    if separator != b'-' && separator != b'/' {
        let time = cursor.time(true)?;
        return cursor.at_end().then_some(Stamp::TimeOfDay(time));
    }
    let year = cursor.number(4)?;
    cursor.expect(separator)?;
    let month = cursor.number(2)?;
    cursor.expect(separator)?;
    let day = cursor.number(2)?;
    if !(1900..=2200).contains(&year) || !(1..=12).contains(&month) || day < 1 || day > days_in_month(year, month) {
        return None;
    }
    if !matches!(cursor.next()?, b'T' | b't' | b' ' | b'_') {
        return None;
    }
    let time = cursor.time(false)?;
    let zone = cursor.zone()?;
    cursor.at_end().then_some(Stamp::Instant((days_since_1970(year, month, day) * DAY - zone) * NS + time))
}

/// `YYYY-MM-DDThh:mm:ssZ` of seconds since 1970, for people.
pub(crate) fn format_utc(seconds: f64) -> String {
    let whole = seconds.floor() as i64;
    let (days, rest) = (whole.div_euclid(DAY), whole.rem_euclid(DAY));
    let (mut year, mut month) = (1970 + days.div_euclid(366), 1);
    while days_since_1970(year + 1, 1, 1) <= days {
        year += 1;
    }
    while month < 12 && days_since_1970(year, month + 1, 1) <= days {
        month += 1;
    }
    let day = days - days_since_1970(year, month, 1) + 1;
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", rest / 3600, rest / 60 % 60, rest % 60)
}

fn is_leap(year: i64) -> bool {
    year % 4 == 0 && (year % 100 != 0 || year % 400 == 0)
}

fn days_in_month(year: i64, month: i64) -> i64 {
    match month {
        2 => 28 + i64::from(is_leap(year)),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

pub(crate) fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let before = year - 1;
    let leap_days = before / 4 - before / 100 + before / 400 - 477;
    let months: i64 = (1..month).map(|m| days_in_month(year, m)).sum();
    (year - 1970) * 365 + leap_days + months + day - 1
}

struct Cursor<'a> {
    text: &'a [u8],
    pos: usize,
}

impl Cursor<'_> {
    fn peek(&self) -> Option<u8> {
        self.text.get(self.pos).copied()
    }
    fn next(&mut self) -> Option<u8> {
        self.pos += 1;
        self.text.get(self.pos - 1).copied()
    }
    fn at_end(&self) -> bool {
        self.pos == self.text.len()
    }
    fn expect(&mut self, byte: u8) -> Option<()> {
        (self.next()? == byte).then_some(())
    }
    /// A number of one to `width` digits; four have to be four.
    fn number(&mut self, width: usize) -> Option<i64> {
        let start = self.pos;
        let mut value = 0;
        while let Some(b) = self.peek().filter(u8::is_ascii_digit).filter(|_| self.pos - start < width) {
            value = value * 10 + i64::from(b - b'0');
            self.pos += 1;
        }
        (self.pos > start && (width < 4 || self.pos - start == width)).then_some(value)
    }
    /// `hh:mm[:ss[.f]]` in nanoseconds; seconds are required where `seconds` says so.
    fn time(&mut self, seconds: bool) -> Option<i64> {
        let hour = self.number(2)?;
        self.expect(b':')?;
        let minute = self.number(2)?;
        let (mut second, mut nanos) = (0, 0);
        if seconds || self.peek() == Some(b':') {
            self.expect(b':')?;
            second = self.number(2)?;
            if let Some(b'.' | b',') = self.peek() {
                self.pos += 1;
                let start = self.pos;
                let mut unit = NS / 10;
                while let Some(b) = self.peek().filter(u8::is_ascii_digit) {
                    nanos += i64::from(b - b'0') * unit;
                    unit /= 10;
                    self.pos += 1;
                }
                if self.pos == start {
                    return None;
                }
            }
        }
        // 60 is a leap second.
        (hour < 24 && minute < 60 && second <= 60).then_some(((hour * 60 + minute) * 60 + second) * NS + nanos)
    }
    /// Seconds that the stated zone is east of UTC; 0 without one.
    fn zone(&mut self) -> Option<i64> {
        if self.peek() == Some(b' ') {
            self.pos += 1;
        }
        let sign = match self.peek() {
            None => return Some(0),
            Some(b'Z' | b'z') => {
                self.pos += 1;
                return Some(0);
            }
            Some(b'+') => 1,
            Some(b'-') => -1,
            Some(_) => {
                let utc = self.text.get(self.pos..) == Some(b"UTC");
                self.pos += 3;
                return utc.then_some(0);
            }
        };
        self.pos += 1;
        let hours = self.number(2)?;
        if self.peek() == Some(b':') {
            self.pos += 1;
        }
        let minutes = if self.at_end() { 0 } else { self.number(2)? };
        (hours < 24 && minutes < 60).then_some(sign * (hours * 3600 + minutes * 60))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(text: &str) -> f64 {
        match parse(text.as_bytes()) {
            Some(Stamp::Instant(ns)) => ns as f64 / 1e9,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn dates_count_from_1970_across_leap_years() {
        // Values from `date -u -d .. +%s`; would catch a missed leap day or century rule.
        assert_eq!(seconds("1970-01-01T00:00:00Z"), 0.0);
        assert_eq!(seconds("2000-03-01 00:00:00"), 951_868_800.0);
        assert_eq!(seconds("2100-03-01 00:00"), 4_107_542_400.0);
        assert_eq!(seconds("2024-02-29T12:34:56.789Z"), 1_709_210_096.789);
        assert_eq!(seconds("2024/2/9 1:02:03,5"), 1_707_440_523.5);
        assert_eq!(seconds("1969-12-31T23:59:59Z"), -1.0);
    }

    #[test]
    fn zones_are_taken_off() {
        assert_eq!(seconds("2024-05-31T12:00:00+09:00"), seconds("2024-05-31T03:00:00Z"));
        assert_eq!(seconds("2024-05-31T12:00:00-0330"), seconds("2024-05-31 15:30:00 UTC"));
        assert_eq!(seconds("2024-05-31 12:00:00 +02"), seconds("2024-05-31T10:00Z"));
    }

    #[test]
    fn a_time_of_day_counts_from_midnight_and_other_texts_are_none() {
        assert_eq!(parse(b"01:02:03.25"), Some(Stamp::TimeOfDay(3_723_250_000_000)));
        for text in [
            "",
            "12:34",
            "2024-02-30 00:00:00",
            "2024-13-01 00:00",
            "2024-05-31",
            "25:00:00",
            "12:00:00.",
            "1.5",
            "2024-05-31 12:00:00 CEST",
            "2024-05-31T12:00:00+99",
            "aa:bb:cc",
            "12:00:00 x",
        ] {
            assert_eq!(parse(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn a_formatted_instant_reads_back() {
        for text in ["1970-01-01T00:00:00Z", "2024-02-29T23:59:59Z", "2024-12-31T00:00:00Z", "2099-03-01T12:00:00Z"] {
            assert_eq!(format_utc(seconds(text)), text);
        }
    }
}
