//! Records of one kind: rows of measured channels, frames of a bus, or bytes that another kind points to.

use std::collections::VecDeque;

use super::blocks::{Block, Blocks};
use super::channel::Channel;
use super::data::signal_data;
use crate::error::ImportError;
use crate::formats::Context;
use crate::formats::can::Frames;
use crate::formats::carry::le;
use crate::formats::dbc::EXTENDED;
use crate::formats::grower::{Grower, Zero};
use crate::opening::Gathered;
use crate::register::Numbered;
use crate::table::Table;

/// Frames that wait for their bytes, or bytes for their frame, at most.
const WAITING: usize = 1 << 20;

/// Records of one kind.
pub(super) struct Records {
    data_bytes: usize,
    size: Option<usize>,
    count: u64,
    kind: Kind,
}

enum Kind {
    /// Rows: the clock and the columns.
    Measured { clock: Option<Channel>, channels: Vec<Channel>, grower: Box<Grower>, row: Vec<f64> },
    /// Frames of a CAN bus.
    Bus(Box<Bus>),
    /// Bytes of variable length, or nothing that is read.
    Other,
}

struct Bus {
    clock: Channel,
    id: Channel,
    extended: Option<Channel>,
    channel: Option<Channel>,
    length: Option<Channel>,
    place: Place,
    waiting: VecDeque<(i64, u8, u32)>,
    arrived: VecDeque<Vec<u8>>,
}

/// Where the bytes of a frame are.
enum Place {
    Record {
        offset: usize,
        length: usize,
    },
    Signal {
        offset: Channel,
        data: Vec<u8>,
    },
    /// In records of the kind whose block is there; then of that number.
    Block(u64),
    Number(u64),
}

impl Records {
    /// What a channel group block says.
    pub fn new(
        block: &Block,
        name: &str,
        channels: Vec<Channel>,
        blocks: &mut Blocks,
        context: &Context,
        log: &mut Gathered,
    ) -> Result<Self, ImportError> {
        let (data_bytes, more) = (block.number(24, 4) as usize, block.number(28, 4) as usize);
        let variable = block.number(16, 2) & 1 == 1;
        let size = (!variable).then(|| data_bytes.saturating_add(more));
        let kind = if variable {
            Kind::Other
        } else if let Some(bus) = Bus::new(&channels, blocks)? {
            Kind::Bus(Box::new(bus))
        } else if channels
            .iter()
            .any(|c| c.name.contains("_Frame.") || c.name.contains("Frame.") || c.name.contains("Error."))
        {
            Kind::Other
        } else {
            measured(channels, name, context, log)
        };
        Ok(Self { data_bytes, size, count: 0, kind })
    }

    /// Bytes of a record; `None` where each states its own.
    pub fn size(&self) -> Option<usize> {
        self.size
    }

    /// Turn the place of a block into the number of its records.
    pub fn place_bytes(&mut self, numbers: &Numbered<u64>) {
        if let Kind::Bus(bus) = &mut self.kind
            && let Place::Block(at) = bus.place
        {
            bus.place = Place::Number(numbers.get(&at).copied().unwrap_or(u64::MAX));
        }
    }

    /// Take a record.
    pub fn record(&mut self, record: &[u8], frames: &mut Frames) -> Result<(), ImportError> {
        let index = self.count;
        self.count += 1;
        let data_bytes = self.data_bytes;
        match &mut self.kind {
            Kind::Measured { clock, channels, grower, row } => {
                let time = match clock {
                    // A virtual clock counts records.
                    Some(c) if c.kind == 3 => c.conversion.apply(index as f64),
                    Some(c) => c.value(record, data_bytes),
                    None => index as f64,
                };
                row.clear();
                row.extend(channels.iter().map(|c| c.value(record, data_bytes)));
                if time.is_finite() { grower.row((time * 1e9).round() as i64, row) } else { Ok(()) }
            }
            Kind::Bus(bus) => bus.record(record, data_bytes, frames),
            Kind::Other => Ok(()),
        }
    }

    /// Take bytes of variable length that records of that number brought.
    pub fn bytes(&mut self, number: u64, bytes: &[u8], frames: &mut Frames) -> Result<(), ImportError> {
        let Kind::Bus(bus) = &mut self.kind else { return Ok(()) };
        if !matches!(bus.place, Place::Number(n) if n == number) {
            return Ok(());
        }
        match bus.waiting.pop_front() {
            Some((time, channel, id)) => frames.frame(time, channel, id, bytes),
            None => {
                if bus.arrived.len() < WAITING {
                    bus.arrived.push_back(bytes.to_vec());
                }
                Ok(())
            }
        }
    }

    /// The table of measured channels.
    pub fn finish(self, zero: Zero) -> Option<Table> {
        match self.kind {
            Kind::Measured { grower, .. } => grower.finish("MDF4", zero),
            _ => None,
        }
    }
}

fn measured(channels: Vec<Channel>, name: &str, context: &Context, log: &mut Gathered) -> Kind {
    let (clocks, channels): (Vec<Channel>, Vec<Channel>) = channels.into_iter().partition(|c| matches!(c.kind, 2 | 3));
    let channels: Vec<Channel> = channels.into_iter().filter(Channel::is_number).collect();
    let clock = clocks.into_iter().find(|c| c.kind == 3 || c.is_number());
    if channels.is_empty() {
        return Kind::Other;
    }
    if clock.is_none() {
        log.warn(format!("{}: the group `{name}` has no clock: its records are taken as 1 s apart.", context.file));
    }
    let name = if name.is_empty() { channels[0].name.clone() } else { name.to_owned() };
    let mut grower = Box::new(Grower::new(&context.file, &name));
    channels.iter().for_each(|c| grower.column(&c.name, &c.unit, None));
    Kind::Measured { clock, channels, grower, row: Vec::new() }
}

impl Bus {
    /// The channels of a CAN data frame, if these are those of one.
    fn new(channels: &[Channel], blocks: &mut Blocks) -> Result<Option<Self>, ImportError> {
        let find = |end: &str| {
            let name = |c: &&Channel| c.name.strip_prefix("CAN_DataFrame").is_some_and(|rest| rest == end);
            channels.iter().find(name).cloned()
        };
        let clock = channels.iter().find(|c| c.kind == 2).cloned();
        let (Some(clock), Some(id), Some(bytes)) = (clock, find(".ID"), find(".DataBytes")) else { return Ok(None) };
        let place = match bytes.kind {
            1 if bytes.data == 0 => return Ok(None),
            1 => {
                let (block, ..) = blocks.head(bytes.data)?;
                if block == *b"##CG" {
                    Place::Block(bytes.data)
                } else {
                    Place::Signal { data: signal_data(blocks, bytes.data)?, offset: bytes }
                }
            }
            _ => Place::Record { offset: bytes.byte_offset, length: bytes.bits / 8 },
        };
        Ok(Some(Self {
            clock,
            id,
            extended: find(".IDE"),
            channel: find(".BusChannel"),
            length: find(".DataLength"),
            place,
            waiting: VecDeque::new(),
            arrived: VecDeque::new(),
        }))
    }

    fn record(&mut self, record: &[u8], data_bytes: usize, frames: &mut Frames) -> Result<(), ImportError> {
        let time = (self.clock.value(record, data_bytes) * 1e9).round() as i64;
        let raw = |c: &Option<Channel>| c.as_ref().map(|c| c.raw(record));
        let id = self.id.raw(record) as u32;
        let id = match raw(&self.extended) {
            Some(0) => id & 0x7ff,
            Some(_) => id & 0x1fff_ffff | EXTENDED,
            None => id,
        };
        let channel = raw(&self.channel).unwrap_or(1).min(255) as u8;
        let stated = raw(&self.length).map_or(64, |l| l.min(64) as usize);
        match &self.place {
            Place::Record { offset, length } => {
                let end = offset.saturating_add(stated.min(*length)).min(record.len());
                frames.frame(time, channel, id, record.get(*offset..end).unwrap_or_default())
            }
            Place::Signal { offset, data } => {
                let at = usize::try_from(offset.raw(record)).unwrap_or(usize::MAX);
                let length = le(data, at, 4) as usize;
                let from = at.saturating_add(4).min(data.len());
                frames.frame(time, channel, id, &data[from..from.saturating_add(length).min(data.len())])
            }
            Place::Block(_) | Place::Number(_) => match self.arrived.pop_front() {
                Some(bytes) => frames.frame(time, channel, id, &bytes),
                None => {
                    if self.waiting.len() < WAITING {
                        self.waiting.push_back((time, channel, id));
                    }
                    Ok(())
                }
            },
        }
    }
}
