//! ASAM MDF 4: measured channels and bus logs, sorted or not, deflated, transposed, unfinished.
//!
//! Counts of records are not trusted, so that an unfinished file reads like a finished one. Source: ASAM MDF 4.1.

mod blocks;
mod channel;
mod data;
mod records;

use std::collections::VecDeque;

use blocks::Blocks;
use data::Fragment;
use records::Records;

use super::can::Frames;
use super::carry::Carry;
use super::grower::Zero;
use super::{Context, Seeking};
use crate::error::ImportError;
use crate::opening::Gathered;
use crate::register::Numbered;
use crate::source::Source;

/// Reads the groups of records one after the other.
pub(crate) struct Mdf4 {
    context: Context,
    groups: Option<VecDeque<Group>>,
    frames: Option<Frames>,
    zero: Zero,
    total: u64,
    done: u64,
    rows: usize,
}

/// Records that lie together, of one or several kinds.
pub(super) struct Group {
    /// Bytes of the record's number before each record; none where there is one kind only.
    id_size: usize,
    fragments: VecDeque<Fragment>,
    records: Numbered<Records>,
    carry: Carry,
}

impl Mdf4 {
    pub fn new(context: Context) -> Self {
        let frames = Some(Frames::new(&context));
        Self { context, groups: None, frames, zero: Zero::Unknown, total: 0, done: 0, rows: 0 }
    }

    /// Read what the file says about itself.
    fn structure(&mut self, source: &mut dyn Source, log: &mut Gathered) -> Result<VecDeque<Group>, ImportError> {
        let mut blocks = Blocks::new(source);
        let head = blocks.bytes(0, 64)?.to_vec();
        let version = super::carry::le(&head, 28, 2);
        if head.len() < 64 || version < 400 {
            let found = format!("version {}", crate::error::excerpt(head.get(8..16).unwrap_or_default()));
            return Err(blocks.bad(8, "MDF of version 4", &found));
        }
        let unfinished = head.starts_with(b"UnFinMF");
        let header = blocks.block(64)?;
        // Local time where no zone is known: the offset of a zone that is known is in the file too, and not added.
        self.zero = match header.number(0, 8) {
            0 => Zero::Unknown,
            start => Zero::At(start.min(i64::MAX as u64) as i64),
        };
        let mut groups = VecDeque::new();
        let mut at = header.link(0);
        while blocks.follow(at) {
            let block = blocks.block(at)?;
            let mut group = Group {
                id_size: (block.number(0, 1) as usize).min(8),
                fragments: if block.link(2) == 0 {
                    VecDeque::new()
                } else {
                    data::fragments(&mut blocks, block.link(2), unfinished)?
                },
                records: Numbered::default(),
                carry: Carry::default(),
            };
            group.read_kinds(&mut blocks, block.link(1), &self.context, log)?;
            self.total += group.fragments.iter().map(Fragment::length).sum::<u64>();
            groups.push_back(group);
            at = block.link(0);
        }
        if unfinished {
            log.warn(format!("{}: the recording was not finished; everything in it was read.", self.context.file));
        }
        Ok(groups)
    }

    /// One more piece of the first group; whether there is more of it.
    fn piece(&mut self, source: &mut dyn Source, group: &mut Group) -> Result<bool, ImportError> {
        let mut blocks = Blocks::new(source);
        let before: u64 = group.fragments.iter().map(Fragment::length).sum();
        let Some(bytes) = data::next(&mut blocks, &mut group.fragments)? else { return Ok(false) };
        self.done += before - group.fragments.iter().map(Fragment::length).sum::<u64>();
        group.carry.extend(&bytes);
        if let Some(frames) = &mut self.frames {
            self.rows += group.take(&mut blocks, frames)?;
        }
        Ok(true)
    }
}

impl Group {
    /// What kinds of records there are.
    fn read_kinds(
        &mut self,
        blocks: &mut Blocks,
        first: u64,
        context: &Context,
        log: &mut Gathered,
    ) -> Result<(), ImportError> {
        let mut at = first;
        let mut places = Numbered::default();
        while blocks.follow(at) {
            let block = blocks.block(at)?;
            let number = block.number(0, 8);
            places.insert(at, number);
            let mut channels = Vec::new();
            blocks.channels(block.link(1), 0, &mut channels)?;
            let name = blocks.text(block.link(2));
            let records = Records::new(&block, &name, channels, blocks, context, log)?;
            self.records.insert(if self.id_size == 0 { 0 } else { number }, records);
            at = block.link(0);
        }
        // Bytes of variable length come as records of another kind here.
        for records in self.records.values_mut() {
            records.place_bytes(&places);
        }
        Ok(())
    }

    /// Take the whole records that have come.
    fn take(&mut self, blocks: &mut Blocks, frames: &mut Frames) -> Result<usize, ImportError> {
        let mut count = 0;
        while let Some(head) = self.carry.peek(self.id_size) {
            if self.carry.left() == 0 {
                break;
            }
            let number = super::carry::le(head, 0, self.id_size);
            let Some(records) = self.records.get(&number) else {
                let known = self.records.len();
                let expected = format!("the number of one of {known} kinds of records");
                return Err(blocks.bad(self.carry.offset(), &expected, &number.to_string()));
            };
            let size = match records.size() {
                Some(size) => size,
                None => match self.carry.peek(self.id_size + 4) {
                    Some(head) => 4 + super::carry::le(head, self.id_size, 4) as usize,
                    None => break,
                },
            };
            if size == 0 {
                self.carry.pass(u64::MAX);
                break;
            }
            let Some(whole) = self.carry.peek(self.id_size + size) else { break };
            let record = &whole[self.id_size..];
            if records.size().is_none() {
                let bytes = record[4..].to_vec();
                for other in self.records.values_mut() {
                    other.bytes(number, &bytes, frames)?;
                }
            } else if let Some(records) = self.records.get_mut(&number) {
                records.record(record, frames)?;
            }
            self.carry.consume(self.id_size + size);
            count += 1;
        }
        Ok(count)
    }
}

impl Seeking for Mdf4 {
    fn step(&mut self, source: &mut dyn Source, log: &mut Gathered) -> Result<f64, ImportError> {
        let mut groups = match self.groups.take() {
            Some(groups) => groups,
            None => self.structure(source, log)?,
        };
        if let Some(group) = groups.front_mut()
            && !self.piece(source, group)?
            && let Some(group) = groups.pop_front()
        {
            for records in group.records.into_sorted().map(|(_, records)| records) {
                log.tables.extend(records.finish(self.zero));
            }
        }
        let left = !groups.is_empty();
        self.groups = Some(groups);
        if left {
            return Ok(0.99 * self.done as f64 / self.total.max(1) as f64);
        }
        if let Some(frames) = self.frames.take() {
            frames.finish("MDF4", self.zero, log);
        }
        Ok(1.0)
    }

    fn rows(&self) -> usize {
        self.rows
    }
}
