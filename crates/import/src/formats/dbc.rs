//! DBC: what the signals in the frames of a CAN bus are.

use std::rc::Rc;

use super::lines::number;
use super::{Context, Reader};
use crate::error::{ImportError, decode, excerpt, form};
use crate::opening::Gathered;
use crate::register::Numbered;

/// A database longer than this, bytes, is refused.
const LONGEST: usize = 64 << 20;
/// Selectors that select selectors beyond this are not followed.
const NESTED: usize = 8;
/// Set in identifiers of 29 bits.
pub(crate) const EXTENDED: u32 = 1 << 31;

/// Messages by identifier.
#[derive(Clone, Debug, Default)]
pub(crate) struct Dbc {
    messages: Numbered<Rc<Message>>,
    /// Messages by parameter group number, where the database is one of J1939.
    groups: Numbered<Rc<Message>>,
    /// Names of the files.
    pub files: Vec<String>,
}

/// A message and its signals.
#[derive(Clone, Debug, Default)]
pub(crate) struct Message {
    pub name: String,
    pub signals: Vec<Signal>,
    /// Whether values of all ones mean that there is none.
    pub j1939: bool,
}

/// Where a signal is in the bytes of its message, and what it is worth.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Signal {
    pub name: String,
    pub unit: String,
    start: usize,
    length: usize,
    big: bool,
    signed: bool,
    /// Bytes of the floating-point number that it is, or 0.
    float: usize,
    factor: f64,
    offset: f64,
    /// Selector by index, and the values of it with which this signal is there.
    pub condition: Option<(usize, Vec<(u64, u64)>)>,
    selects: bool,
}

impl Signal {
    /// The bits of the signal; `None` if the frame is too short.
    pub fn raw(&self, data: &[u8]) -> Option<u64> {
        let (first, drop) = if self.big {
            let from = self.start / 8 * 8 + 7 - self.start % 8;
            (from / 8, (8 - (from + self.length) % 8) % 8)
        } else {
            (self.start / 8, self.start % 8)
        };
        let count = (if self.big { 7 - self.start % 8 } else { drop } + self.length).div_ceil(8);
        let bytes = data.get(first..first + count)?;
        let join = |wide: u128, b: &u8| wide << 8 | u128::from(*b);
        let wide = if self.big { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) };
        Some((wide >> drop) as u64 & (u64::MAX >> (64 - self.length)))
    }

    /// Whether the value is the bits themselves.
    pub fn is_raw(&self) -> bool {
        self.factor == 1.0 && self.offset == 0.0
    }

    /// The physical value of the bits; NaN where `j1939` and the bits say that there is none.
    pub fn value(&self, raw: u64, j1939: bool) -> f64 {
        let unused = 64 - self.length;
        if j1939 && !self.signed && self.length >= 8 && raw >> (self.length - 8) >= 0xfe {
            return f64::NAN;
        }
        let number = match self.float {
            4 => f64::from(f32::from_bits(raw as u32)),
            8 => f64::from_bits(raw),
            _ if self.signed => (((raw << unused) as i64) >> unused) as f64,
            _ => raw as f64,
        };
        number * self.factor + self.offset
    }
}

impl Message {
    /// Whether the signal is in these bytes.
    pub fn holds(&self, signal: &Signal, data: &[u8]) -> bool {
        let mut condition = &signal.condition;
        for _ in 0..NESTED {
            let Some((selector, ranges)) = condition else { return true };
            let Some(selector) = self.signals.get(*selector) else { return false };
            let Some(raw) = selector.raw(data) else { return false };
            if !ranges.iter().any(|(low, high)| (*low..=*high).contains(&raw)) {
                return false;
            }
            condition = &selector.condition;
        }
        false
    }
}

/// The parameter group number of a 29-bit identifier.
fn group(id: u32) -> u32 {
    let group = id >> 8 & 0x3_ffff;
    if group >> 8 & 0xff < 240 { group & 0x3_ff00 } else { group }
}

impl Dbc {
    pub fn is_empty(&self) -> bool {
        self.messages.is_empty()
    }

    /// The message of an identifier.
    pub fn message(&self, id: u32) -> Option<&Rc<Message>> {
        let of_group = || if id & EXTENDED == 0 { None } else { self.groups.get(&group(id).into()) };
        self.messages.get(&id.into()).or_else(of_group)
    }

    /// Take the messages of another database; those that are already there stay.
    fn add(&mut self, other: Self) {
        self.files.extend(other.files);
        for (own, other) in [(&mut self.messages, other.messages), (&mut self.groups, other.groups)] {
            other.into_sorted().for_each(|(id, message)| {
                own.entry(id, || message);
            });
        }
    }

    /// Read a database.
    pub fn parse(file: &str, text: &str) -> Result<Self, ImportError> {
        let mut parser = Parser { file, ..Parser::default() };
        let mut in_text = false;
        for (i, line) in text.lines().enumerate() {
            let quotes = line.bytes().filter(|b| *b == b'"').count();
            if !in_text {
                parser.line(i + 1, line.trim())?;
            }
            // A comment may go on over lines that look like statements.
            in_text ^= quotes % 2 == 1 && !line.trim_start().starts_with("//");
        }
        Ok(parser.finish())
    }
}

#[derive(Default)]
struct Parser<'a> {
    file: &'a str,
    messages: Vec<(u32, Message)>,
    index: Numbered<usize>,
    j1939: bool,
}

impl Parser<'_> {
    fn line(&mut self, row: usize, line: &str) -> Result<(), ImportError> {
        let broken = |expected: &str| {
            let found = format!("`{}`", excerpt(line.as_bytes()));
            form(self.file, format!("row {row}"), expected, &found, "correct the row")
        };
        if let Some(rest) = line.strip_prefix("BO_ ") {
            let mut words = rest.split_whitespace();
            let id = words
                .next()
                .and_then(|w| w.parse::<u32>().ok())
                .ok_or_else(|| broken("BO_ identifier name: length"))?;
            let name = words.next().unwrap_or_default().trim_end_matches(':').to_owned();
            self.index.insert(id.into(), self.messages.len());
            self.messages.push((id, Message { name, ..Message::default() }));
        } else if let Some(rest) = line.strip_prefix("SG_ ") {
            let signal = signal(rest).ok_or_else(|| broken("SG_ name : start|length@order (factor,offset) ..."))?;
            if let Some((_, message)) = self.messages.last_mut() {
                message.signals.push(signal);
            }
        } else if let Some(rest) = line.strip_prefix("SG_MUL_VAL_ ") {
            self.selection(rest).ok_or_else(|| broken("SG_MUL_VAL_ identifier signal selector ranges;"))?;
        } else if let Some(rest) = line.strip_prefix("SIG_VALTYPE_ ") {
            self.float(rest).ok_or_else(|| broken("SIG_VALTYPE_ identifier signal : type;"))?;
        } else if line.starts_with("BA_ \"ProtocolType\"") && line.contains("J1939") {
            self.j1939 = true;
        }
        Ok(())
    }

    fn signal_of(&mut self, id: &str, name: &str) -> Option<(usize, usize)> {
        let message = *self.index.get(&u64::from(id.parse::<u32>().ok()?))?;
        Some((message, self.messages[message].1.signals.iter().position(|s| s.name == name)?))
    }

    /// `identifier signal selector 3-3, 5-7;`, of messages that are known.
    fn selection(&mut self, rest: &str) -> Option<()> {
        let mut words = rest.trim_end_matches(';').splitn(4, ' ');
        let (id, name, selector, ranges) = (words.next()?, words.next()?, words.next()?, words.next()?);
        let range = |r: &str| r.trim().split_once('-').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        let ranges: Option<Vec<(u64, u64)>> = ranges.split(',').map(range).collect();
        let ranges = ranges?;
        if let (Some((m, s)), Some((_, selector))) = (self.signal_of(id, name), self.signal_of(id, selector)) {
            self.messages[m].1.signals[s].condition = Some((selector, ranges));
        }
        Some(())
    }

    /// `identifier signal : 1;`: 1 is a float, 2 a double.
    fn float(&mut self, rest: &str) -> Option<()> {
        let (target, kind) = rest.trim_end_matches(';').split_once(':')?;
        let mut words = target.split_whitespace();
        let (id, name) = (words.next()?, words.next()?);
        let size = match kind.trim() {
            "1" => 4,
            "2" => 8,
            _ => 0,
        };
        if let Some((m, s)) = self.signal_of(id, name)
            && self.messages[m].1.signals[s].length == 8 * size
        {
            self.messages[m].1.signals[s].float = size;
        }
        Some(())
    }

    fn finish(self) -> Dbc {
        let mut dbc = Dbc { files: vec![self.file.to_owned()], ..Dbc::default() };
        for (id, mut message) in self.messages {
            // Simple multiplexing names no selector: it is the one marked `M`.
            if let Some(selector) = message.signals.iter().position(|s| s.selects) {
                for s in message.signals.iter_mut().filter(|s| s.condition.as_ref().is_some_and(|c| c.0 == usize::MAX))
                {
                    s.condition.iter_mut().for_each(|c| c.0 = selector);
                }
            }
            message.j1939 = self.j1939;
            let message = Rc::new(message);
            if self.j1939 && id & EXTENDED != 0 {
                dbc.groups.insert(group(id).into(), message.clone());
            }
            dbc.messages.insert(id.into(), message);
        }
        dbc
    }
}

/// `name [M|m3|m3M] : start|length@order sign (factor,offset) [min|max] "unit" ...`.
fn signal(text: &str) -> Option<Signal> {
    let (head, rest) = text.split_once(':')?;
    let mut words = head.split_whitespace();
    let mut signal = Signal { name: words.next()?.to_owned(), ..Signal::default() };
    if let Some(mark) = words.next() {
        signal.selects = mark.ends_with('M');
        let value = mark.trim_end_matches('M').strip_prefix('m').and_then(|v| v.parse().ok());
        signal.condition = value.map(|v| (usize::MAX, vec![(v, v)]));
    }
    let (start, rest) = rest.split_once('|')?;
    let (length, rest) = rest.split_once('@')?;
    (signal.start, signal.length) = (start.trim().parse().ok()?, length.trim().parse().ok()?);
    let mut chars = rest.chars();
    (signal.big, signal.signed) = (chars.next()? == '0', chars.next()? == '-');
    let (factor, rest) = rest.split_once('(')?.1.split_once(',')?;
    let (offset, rest) = rest.split_once(')')?;
    (signal.factor, signal.offset) = (number(factor.as_bytes())?, number(offset.as_bytes())?);
    signal.unit = rest.split('"').nth(1).unwrap_or_default().to_owned();
    (1..=64).contains(&signal.length).then_some(())?;
    (signal.start < 64 * 8).then_some(signal)
}

/// Reads a database.
pub(crate) struct Database {
    file: Rc<str>,
    bytes: Vec<u8>,
}

impl Database {
    pub fn new(context: Context) -> Self {
        Self { file: context.file, bytes: Vec::new() }
    }
}

impl Reader for Database {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        self.bytes.extend_from_slice(bytes);
        if self.bytes.len() <= LONGEST {
            return Ok(());
        }
        Err(form(&self.file, "size".into(), "a DBC of at most 64 MiB", "a longer one", "check that it is a DBC"))
    }

    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let mut all = (*log.dbc).clone();
        all.add(Dbc::parse(&self.file, &decode(&self.bytes))?);
        log.dbc = Rc::new(all);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "VERSION \"\"\n\nBO_ 170 WHEELS: 8 XXX\n SG_ FR : 7|16@0+ (0.01,-67.67) [0|250] \"kph\" XXX\n\
        SG_ RAW: 8|12@1- (0.5, 1)[0|0] \"\" XXX\n\nCM_ \"a comment\n SG_ no signal\";\n\
        BO_ 2566844926 CCVS1: 8 X\n SG_ Speed : 8|16@1+ (0.00390625,0) [0|250] \"km/h\" X\n\
        BO_ 5 OBD: 8 X\n SG_ Pid M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ A m13 : 8|8@1+ (1,0) [0|0] \"km/h\" X\n\
        SG_ B m14 : 8|32@1- (1,0) [0|0] \"\" X\nBA_ \"ProtocolType\" \"J1939\";\nSIG_VALTYPE_ 5 B : 1;\n";

    #[test]
    fn signals_of_both_byte_orders_are_cut_out() {
        // Would catch a wrong bit numbering of Motorola signals and a missing sign.
        let dbc = Dbc::parse("x.dbc", TEXT).unwrap();
        let message = dbc.message(170).unwrap();
        assert_eq!((message.name.as_str(), message.signals.len()), ("WHEELS", 2));
        let data = [0x1a, 0x6f, 0x0f, 0, 0, 0, 0, 0];
        let value = |i: usize| message.signals[i].value(message.signals[i].raw(&data).unwrap(), false);
        assert_eq!(value(0), f64::from(0x1a6f) * 0.01 - 67.67);
        assert_eq!(message.signals[1].raw(&data), Some(0xf6f));
        assert_eq!(value(1), f64::from(0xf6f - 0x1000) * 0.5 + 1.0);
        assert_eq!(message.signals[0].raw(&data[..1]), None);
    }

    #[test]
    fn a_parameter_group_matches_from_any_sender_and_ones_are_no_value() {
        let dbc = Dbc::parse("x.dbc", TEXT).unwrap();
        let message = dbc.message(EXTENDED | 0x18fe_f100).unwrap();
        assert_eq!(message.name, "CCVS1");
        let speed = &message.signals[0];
        assert!(speed.value(0xffff, true).is_nan());
        assert_eq!(speed.value(0x6400, true), 100.0);
        assert!(dbc.message(0x18fe_f100).is_none());
    }

    #[test]
    fn multiplexed_signals_are_there_only_with_their_selector() {
        let dbc = Dbc::parse("x.dbc", TEXT).unwrap();
        let message = dbc.message(5).unwrap();
        let data = [14, 0, 0, 0x80, 0x3f];
        assert!(!message.holds(&message.signals[1], &data));
        assert!(message.holds(&message.signals[2], &data));
        assert_eq!(message.signals[2].value(message.signals[2].raw(&data).unwrap(), false), 1.0);
    }

    #[test]
    fn a_broken_row_is_named() {
        let error = Dbc::parse("x.dbc", "BO_ 1 A: 8 X\n SG_ S : 7|99@0+ (1,0) [0|0] \"\" X\n").unwrap_err().to_string();
        assert!(error.starts_with("x.dbc, row 2: expected SG_ name"), "{error}");
    }
}
