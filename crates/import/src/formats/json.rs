//! JSON traces of OpenXC: one object `{"name": .., "value": .., "timestamp": ..}` a row.

use std::rc::Rc;

use serde_json::Value;

use super::grower::{Grower, Zero};
use super::lines::Lines;
use super::{Context, Reader};
use crate::error::{ImportError, excerpt, form};
use crate::opening::Gathered;
use crate::register::Named;

/// Signals of the OpenXC message set whose unit its definition states.
const UNITS: &[(&str, &str)] = &[
    ("vehicle_speed", "km/h"),
    ("steering_wheel_angle", "deg"),
    ("latitude", "deg"),
    ("longitude", "deg"),
    ("odometer", "km"),
    ("engine_speed", "rpm"),
    ("torque_at_transmission", "Nm"),
    ("accelerator_pedal_position", "%"),
];

/// Whether a line is a message.
pub(crate) fn is_message(line: &[u8]) -> bool {
    let text = line.trim_ascii();
    let has = |key: &[u8]| text.windows(key.len()).any(|w| w == key);
    text.first() == Some(&b'{') && has(b"\"name\"") && has(b"\"value\"") && has(b"\"timestamp\"")
}

/// Reads a trace: each name is a column over its own clock.
pub(crate) struct Trace {
    file: Rc<str>,
    lines: Lines,
    signals: Signals,
}

struct Signals {
    file: Rc<str>,
    columns: Named<Grower>,
    rows: usize,
    texts: usize,
}

impl Trace {
    pub fn new(context: Context) -> Self {
        let signals = Signals { file: context.file.clone(), columns: Named::default(), rows: 0, texts: 0 };
        Self { file: context.file, lines: Lines::default(), signals }
    }
}

impl Signals {
    fn line(&mut self, row: usize, line: &[u8]) -> Result<(), ImportError> {
        let line = line.trim_ascii();
        if line.is_empty() {
            return Ok(());
        }
        let message: Option<Value> = serde_json::from_slice(line).ok();
        let part = |key: &str| message.as_ref().and_then(|m| m.get(key));
        let (Some(name), Some(time)) =
            (part("name").and_then(Value::as_str), part("timestamp").and_then(Value::as_f64))
        else {
            let expected = "an object with name, value and timestamp";
            let found = format!("`{}`", excerpt(line));
            return Err(form(&self.file, format!("row {row}"), expected, &found, "correct or delete the row"));
        };
        let value = match part("value") {
            Some(Value::Bool(b)) => Some(f64::from(u8::from(*b))),
            other => other.and_then(Value::as_f64),
        };
        let Some(value) = value else {
            self.texts += 1;
            return Ok(());
        };
        let file = &self.file;
        let new = || {
            let unit = UNITS.iter().find(|(n, _)| *n == name).map_or("", |(_, unit)| unit);
            Grower::with(file, name, &[(name, unit, None)])
        };
        self.rows += 1;
        self.columns.entry(name.to_owned(), new).row((time * 1e9) as i64, &[value])
    }
}

impl Reader for Trace {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        let signals = &mut self.signals;
        self.lines.feed(&self.file, bytes, &mut |row, line| signals.line(row, line))
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let signals = &mut self.signals;
        self.lines.finish(&mut |row, line| signals.line(row, line))?;
        log.tables.extend(self.signals.columns.into_sorted().filter_map(|(_, g)| g.finish("OpenXC trace", Zero::Unix)));
        Ok(())
    }

    fn rows(&self) -> usize {
        self.signals.rows
    }
}
