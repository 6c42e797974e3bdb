//! ROS 1 bags (version 2.0): connections and messages in chunks, stored, or packed by bzip2 or LZ4.

use super::carry::{Carry, le};
use super::ros::{Plan, Wire};
use super::topics::{Layout, Topic};
use super::{Context, Reader, bzip2, lz4};
use crate::error::{ImportError, excerpt, form};
use crate::opening::Gathered;
use crate::register::{Named, Numbered};

const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// A record longer than this, bytes, is refused.
const LONGEST: usize = 1 << 30;

/// Reads records as they come.
pub(crate) struct Bag {
    context: Context,
    carry: Carry,
    begun: bool,
    topics: Numbered<Option<Topic>>,
    other: Named<()>,
    messages: usize,
}

/// The named fields of a record's header.
fn field<'a>(header: &'a [u8], name: &str) -> Option<&'a [u8]> {
    let mut rest = header;
    while rest.len() > 4 {
        let length = le(rest, 0, 4) as usize;
        let entry = rest.get(4..4 + length)?;
        rest = &rest[4 + length..];
        let equals = entry.iter().position(|&b| b == b'=')?;
        if &entry[..equals] == name.as_bytes() {
            return Some(&entry[equals + 1..]);
        }
    }
    None
}

impl Bag {
    pub fn new(context: Context) -> Self {
        Self {
            context,
            carry: Carry::default(),
            begun: false,
            topics: Numbered::default(),
            other: Named::default(),
            messages: 0,
        }
    }

    fn bad(&self, expected: &str, found: &str) -> ImportError {
        let place = format!("offset {}", self.carry.offset());
        form(&self.context.file, place, expected, found, "copy the bag again or run `rosbag reindex` on it")
    }

    fn record(&mut self, header: &[u8], data: &[u8], depth: usize) -> Result<(), ImportError> {
        match field(header, "op").and_then(|op| op.first()) {
            Some(5) if depth == 0 => self.chunk(header, data),
            Some(7) => {
                self.connection(header, data);
                Ok(())
            }
            Some(2) => {
                let id = field(header, "conn").map_or(u64::MAX, |v| le(v, 0, 4));
                let time = field(header, "time").unwrap_or_default();
                let time = le(time, 0, 4) as i64 * 1_000_000_000 + le(time, 4, 4) as i64;
                self.messages += 1;
                match self.topics.get_mut(&id) {
                    Some(Some(topic)) => topic.message(time, data),
                    _ => Ok(()),
                }
            }
            _ => Ok(()),
        }
    }

    fn chunk(&mut self, header: &[u8], data: &[u8]) -> Result<(), ImportError> {
        let size = field(header, "size").map_or(0, |s| le(s, 0, 4) as usize);
        let unpacked = match field(header, "compression").unwrap_or(b"none") {
            b"none" => None,
            b"bz2" => Some(bzip2::unpack(data, size.min(LONGEST))),
            b"lz4" => Some(lz4::unpack_frame(data, size.min(LONGEST))),
            other => {
                let found = format!("compression `{}`", excerpt(other));
                return Err(self.bad("a chunk stored or packed by bz2 or lz4", &found));
            }
        };
        match unpacked {
            None => self.records(data),
            Some(Some(bytes)) => self.records(&bytes),
            Some(None) => Err(self.bad("packed records", "damaged data")),
        }
    }

    fn records(&mut self, mut bytes: &[u8]) -> Result<(), ImportError> {
        while let Some((header, data, length)) = split(bytes) {
            self.record(header, data, 1)?;
            bytes = &bytes[length..];
        }
        Ok(())
    }

    fn connection(&mut self, header: &[u8], data: &[u8]) {
        let id = field(header, "conn").map_or(u64::MAX, |v| le(v, 0, 4));
        if self.topics.contains(&id) || self.topics.len() > 4096 {
            return;
        }
        let text = |bytes: Option<&[u8]>| String::from_utf8_lossy(bytes.unwrap_or_default()).into_owned();
        let (topic, kind) = (text(field(header, "topic")), text(field(data, "type")));
        let plan = Plan::new(&text(field(data, "message_definition")), Wire::Ros1).filter(|p| !p.names.is_empty());
        if plan.is_none() {
            self.other.insert(kind.clone(), ());
        }
        let layout = plan.map(Layout::Ros);
        self.topics.insert(id, layout.map(|layout| Topic::new(&self.context, &topic, &kind, layout)));
    }
}

/// Header, data and whole length of the record that `bytes` begin with, if all of it is there.
fn split(bytes: &[u8]) -> Option<(&[u8], &[u8], usize)> {
    if bytes.len() < 8 {
        return None;
    }
    let header = le(bytes, 0, 4) as usize;
    let data = bytes.get(4 + header..8 + header)?;
    let length = le(data, 0, 4) as usize;
    Some((&bytes[4..4 + header], bytes.get(8 + header..8 + header + length)?, 8 + header + length))
}

impl Reader for Bag {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        self.carry.extend(bytes);
        if !self.begun {
            if self.carry.peek(MAGIC.len()).is_none() {
                return Ok(());
            }
            self.carry.consume(MAGIC.len());
            self.begun = true;
        }
        loop {
            let Some(head) = self.carry.peek(4) else { return Ok(()) };
            let header = le(head, 0, 4) as usize;
            if header > LONGEST {
                return Err(self.bad("a record of at most 1 GiB", &format!("a header of {header} bytes")));
            }
            let Some(head) = self.carry.peek(8 + header) else { return Ok(()) };
            let data = le(head, 4 + header, 4) as usize;
            if data > LONGEST {
                return Err(self.bad("a record of at most 1 GiB", &format!("one of {data} bytes")));
            }
            let Some(record) = self.carry.peek(8 + header + data).map(<[u8]>::to_vec) else { return Ok(()) };
            self.record(&record[4..4 + header], &record[8 + header..], 0)?;
            self.carry.consume(record.len());
        }
    }

    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        if self.carry.left() > 0 {
            log.warn(format!("{}: the bag ends inside a record; what came before was read.", self.context.file));
        }
        if self.messages == 0 {
            return Err(self.bad("messages", "none"));
        }
        self.topics.into_sorted().filter_map(|(_, topic)| topic).for_each(|topic| topic.finish("ROS 1 bag", log));
        if !self.other.is_empty() {
            let kinds = self.other.into_sorted().take(6).map(|(kind, ())| kind).collect::<Vec<_>>().join(", ");
            log.warn(format!("{}: messages without numbers left out ({kinds}).", self.context.file));
        }
        Ok(())
    }

    fn rows(&self) -> usize {
        self.topics.values().flatten().map(Topic::rows).sum()
    }
}
