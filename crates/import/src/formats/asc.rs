//! Vector ASC: bus frames as text, classic CAN and CAN FD.

use std::rc::Rc;

use super::can::Frames;
use super::dbc::EXTENDED;
use super::grower::Zero;
use super::lines::{Lines, integer, nanoseconds, words};
use super::{Context, Reader};
use crate::error::{ImportError, form};
use crate::opening::Gathered;
use crate::stamp::{days_since_1970, parse as stamp_of};

/// Reads frames line by line.
pub(crate) struct Asc {
    file: Rc<str>,
    lines: Lines,
    body: Body,
}

struct Body {
    frames: Frames,
    base: u32,
    relative: bool,
    previous: i64,
    start: Option<i64>,
    other: usize,
}

impl Asc {
    pub fn new(context: Context) -> Self {
        let frames = Frames::new(&context);
        let body = Body { frames, base: 16, relative: false, previous: 0, start: None, other: 0 };
        Self { file: context.file, lines: Lines::default(), body }
    }
}

/// Whether the beginning of a file is that of an ASC.
pub(crate) fn is_asc(head: &[u8]) -> bool {
    let mut lines = head.split(|&b| b == b'\n').take(20);
    lines.any(|l| {
        let mut words = words(l.trim_ascii());
        words.next() == Some(b"base") && matches!(words.next(), Some(b"hex" | b"dec"))
    })
}

/// `Thu Aug 02 04:14:48.300 pm 2018` and its variants: ns since 1970 of the file's own clock.
fn date(text: &[&[u8]]) -> Option<i64> {
    const MONTHS: [&[u8]; 12] =
        [b"jan", b"feb", b"m\0r", b"apr", b"ma\0", b"jun", b"jul", b"aug", b"sep", b"o\0t", b"nov", b"de\0"];
    let month = text.iter().find_map(|w| {
        let w = w.to_ascii_lowercase();
        let fits = |m: &&[u8]| w.len() >= 3 && m.iter().zip(&w).all(|(a, b)| *a == 0 || a == b);
        MONTHS
            .iter()
            .position(fits)
            .filter(|_| !matches!(w.as_slice(), b"mon" | b"mit" | b"mo" | b"mi"))
            .map(|i| i as i64 + 1)
    })?;
    let clock = text.iter().position(|w| w.contains(&b':'))?;
    let parts: Vec<&[u8]> = text[clock].split(|&b| b == b':').collect();
    let [hours, minutes, seconds] = parts.as_slice() else { return None };
    let afternoon = text.get(clock + 1).map(|w| w.to_ascii_lowercase());
    let hours = match (integer(hours)?, afternoon.as_deref()) {
        (h, Some(b"pm")) if h < 12 => h + 12,
        (12, Some(b"am")) => 0,
        (h, _) => h,
    };
    let numbers: Vec<i64> = text.iter().filter_map(|w| integer(w)).collect();
    let day = *numbers.iter().find(|n| (1..=31).contains(*n))?;
    let year = *numbers.iter().find(|n| (1980..=2200).contains(*n))?;
    let minutes = integer(minutes).filter(|m| (0..60).contains(m))?;
    let whole = (days_since_1970(year, month, day) * 24 + hours.clamp(0, 23)) * 60 + minutes;
    Some(whole * 60_000_000_000 + nanoseconds(seconds)?)
}

impl Body {
    fn line(&mut self, line: &[u8]) -> Result<(), ImportError> {
        let words: Vec<&[u8]> = words(line.trim_ascii()).collect();
        match words.as_slice() {
            [b"date", rest @ ..] => self.start = self.start.or_else(|| start_of(rest)),
            [b"Begin" | b"begin", b"Triggerblock" | b"TriggerBlock", rest @ ..] => {
                self.start = start_of(rest).or(self.start);
            }
            [b"base", base, b"timestamps", kind, ..] => {
                self.base = if *base == b"dec" { 10 } else { 16 };
                self.relative = *kind == b"relative";
            }
            [time, rest @ ..] => {
                if let Some(time) = nanoseconds(time) {
                    self.previous = if self.relative { self.previous.saturating_add(time) } else { time };
                    return self.event(self.previous, rest);
                }
            }
            [] => {}
        }
        Ok(())
    }

    fn event(&mut self, time: i64, words: &[&[u8]]) -> Result<(), ImportError> {
        let base = self.base;
        let hex = |w: &[u8]| std::str::from_utf8(w).ok().and_then(|t| u32::from_str_radix(t, base).ok());
        let identifier = |w: &[u8]| match w.split_last() {
            Some((b'x', digits)) => hex(digits).map(|id| id | EXTENDED),
            _ => hex(w),
        };
        let found = match words {
            [channel, id, b"Rx" | b"Tx", b"d", length, data @ ..] => {
                let length = hex(length).map(|l| (l as usize).min(8));
                (integer(channel), identifier(id), length, data)
            }
            [b"CANFD", channel, b"Rx" | b"Tx", id, rest @ ..] => {
                // A symbolic name may stand before the two flags.
                let flags = usize::from(rest.first().is_some_and(|w| !matches!(*w, b"0" | b"1")));
                let length = rest.get(flags + 3).and_then(|w| integer(w)).map(|l| l.clamp(0, 64) as usize);
                (integer(channel), identifier(id), length, rest.get(flags + 4..).unwrap_or_default())
            }
            _ => (None, None, None, words),
        };
        let (Some(channel), Some(id), Some(length), data) = found else {
            self.other += 1;
            return Ok(());
        };
        let mut bytes = [0; 64];
        let mut count = 0;
        for (byte, word) in bytes.iter_mut().zip(data).take(length) {
            let Some(value) = hex(word).filter(|v| *v < 256) else { break };
            *byte = value as u8;
            count += 1;
        }
        self.frames.frame(time, channel as u8, id, &bytes[..count])
    }
}

fn start_of(words: &[&[u8]]) -> Option<i64> {
    let joined = words.join(&b' ');
    date(words).or_else(|| match stamp_of(&joined) {
        Some(crate::stamp::Stamp::Instant(ns)) => Some(ns),
        _ => None,
    })
}

impl Reader for Asc {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        let body = &mut self.body;
        self.lines.feed(&self.file, bytes, &mut |_, line| body.line(line))
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let body = &mut self.body;
        self.lines.finish(&mut |_, line| body.line(line))?;
        if body.frames.count == 0 {
            let found = format!("{} other events", body.other);
            return Err(form(&self.file, "all rows".into(), "frames of a CAN bus", &found, "log CAN frames"));
        }
        let zero = body.start.map_or(Zero::Unknown, Zero::At);
        self.body.frames.finish("ASC", zero, log);
        Ok(())
    }

    fn rows(&self) -> usize {
        self.body.frames.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_of_several_loggers_are_read() {
        let of = |t: &str| date(&words(t.as_bytes()).collect::<Vec<_>>()).map(|ns| ns / 1_000_000);
        let expected = Some(1_533_226_488_300);
        assert_eq!(of("Thu Aug 02 16:14:48.300 2018"), expected);
        assert_eq!(of("Thu Aug 2 04:14:48.300 pm 2018"), expected);
        assert_eq!(of("Don Aug 2 16:14:48.300 2018"), expected);
        assert_eq!(of("Mon Dec 31 00:00:00 2018"), of("Mon Dez 31 12:00:00 am 2018"));
        assert_eq!(of("no date"), None);
    }
}
