//! Frames of a CAN bus, decoded while they are read: a table for every message, or for every page of a multiplexed one.

use std::rc::Rc;

use super::Context;
use super::dbc::{Dbc, EXTENDED, Message};
use super::grower::{Grower, Zero};
use crate::error::{ImportError, name_list};
use crate::opening::Gathered;
use crate::register::Numbered;

/// Identifiers that are remembered for what is said about them.
const REMEMBERED: usize = 4096;

/// Frames on their way into tables.
pub(crate) struct Frames {
    file: Rc<str>,
    part: String,
    dbc: Rc<Dbc>,
    slots: Numbered<Option<Slot>>,
    pub count: usize,
    unknown: Numbered<()>,
    row: Vec<f64>,
}

/// A message on one bus.
struct Slot {
    message: Rc<Message>,
    /// Signals by index that are there together, and their table.
    pages: Vec<(Vec<usize>, Grower)>,
}

impl Slot {
    fn new(file: &Rc<str>, part: &str, channel: u8, message: &Rc<Message>) -> Self {
        let mut pages: Vec<(Vec<usize>, Grower)> = Vec::new();
        for (i, signal) in message.signals.iter().enumerate() {
            let page = pages.iter().position(|(s, _)| message.signals[s[0]].condition == signal.condition);
            let page = page.unwrap_or_else(|| {
                let own = signal.condition.as_ref().map_or(String::new(), |_| format!(", {}", signal.name));
                let name = format!("{part}{}{own} (bus {channel})", message.name);
                pages.push((Vec::new(), Grower::new(file, &name)));
                pages.len() - 1
            });
            pages[page].0.push(i);
            // A number as it is on the bus, without a unit, is no physical quantity.
            let unit = if signal.unit.is_empty() && signal.is_raw() { "raw" } else { &signal.unit };
            pages[page].1.column(&signal.name, unit, None);
        }
        Self { message: message.clone(), pages }
    }
}

impl Frames {
    pub fn new(context: &Context) -> Self {
        let part = if context.part.is_empty() { String::new() } else { format!("{}: ", context.part) };
        Self {
            file: context.file.clone(),
            part,
            dbc: context.dbc.clone(),
            slots: Numbered::default(),
            count: 0,
            unknown: Numbered::default(),
            row: Vec::new(),
        }
    }

    /// Take a frame: time in ns, bus from 1, identifier with [`EXTENDED`] set where it has 29 bits.
    pub fn frame(&mut self, time: i64, channel: u8, id: u32, data: &[u8]) -> Result<(), ImportError> {
        self.count += 1;
        let slot = self.slots.entry(u64::from(channel) << 32 | u64::from(id), || {
            let message = self.dbc.message(id)?;
            Some(Slot::new(&self.file, &self.part, channel, message))
        });
        let Some(slot) = slot else {
            if self.unknown.len() < REMEMBERED {
                self.unknown.insert(id.into(), ());
            }
            return Ok(());
        };
        for (signals, grower) in &mut slot.pages {
            let first = &slot.message.signals[signals[0]];
            if !slot.message.holds(first, data) {
                continue;
            }
            self.row.clear();
            self.row.extend(signals.iter().map(|&i| {
                let signal = &slot.message.signals[i];
                signal.raw(data).map_or(f64::NAN, |raw| signal.value(raw, slot.message.j1939))
            }));
            if self.row.iter().any(|v| v.is_finite()) {
                grower.row(time, &self.row)?;
            }
        }
        Ok(())
    }

    /// Hand the tables over, and what could not be decoded.
    pub fn finish(self, format: &'static str, zero: Zero, log: &mut Gathered) {
        let before = log.tables.len();
        for slot in self.slots.into_sorted().filter_map(|(_, slot)| slot) {
            log.tables.extend(slot.pages.into_iter().filter_map(|(_, grower)| grower.finish(format, zero)));
        }
        if self.count == 0 {
            return;
        }
        let ids: Vec<String> =
            self.unknown.keys().take(6).map(|id| format!("{:X}", id & !u64::from(EXTENDED))).collect();
        let ids = format!("{} identifiers ({}, ..)", self.unknown.len(), ids.join(", "));
        let what = if self.dbc.is_empty() { "no DBC database" } else { "none of them in the DBC" };
        if log.tables.len() > before {
            let note = format!("Frames were decoded as {} says.", name_list(self.dbc.files.iter().map(String::as_str)));
            if !log.notes.contains(&note) {
                log.notes.push(note);
            }
        }
        if log.tables.len() == before {
            log.failures.push(format!(
                "{}: expected a DBC database that says what the frames hold, found {} frames of {ids} and {what}; open the \
                 car's DBC together with the log.",
                self.file, self.count
            ));
        } else if !self.unknown.is_empty() {
            log.warn(format!("{}: frames of {ids} that the DBC does not name were left out.", self.file));
        }
    }
}
