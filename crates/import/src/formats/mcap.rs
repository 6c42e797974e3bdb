//! MCAP: channels and messages in chunks, stored, or packed by zstd or LZ4; ROS 1, ROS 2, JSON and protobuf messages.
//!
//! Read from its beginning, so that a file without its index reads as well. Source: the MCAP specification.

use std::io::Read;
use std::rc::Rc;

use super::carry::{Carry, le};
use super::proto::Schema;
use super::ros::{Plan, Wire};
use super::topics::{Layout, Topic};
use super::{Context, Reader, lz4};
use crate::error::{ImportError, excerpt, form};
use crate::opening::Gathered;
use crate::register::{Named, Numbered};

const MAGIC: usize = 8;
/// A record longer than this, bytes, is refused; attachments are passed over at any length.
const LONGEST: u64 = 1 << 30;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;

/// Reads records as they come.
pub(crate) struct Mcap {
    context: Context,
    carry: Carry,
    begun: bool,
    schemas: Numbered<(String, String, Vec<u8>)>,
    topics: Numbered<Option<Topic>>,
    other: Named<()>,
    messages: usize,
}

/// A text with its length before it; where it ends.
fn text(data: &[u8], at: usize) -> (String, usize) {
    let length = le(data, at, 4) as usize;
    let end = at.saturating_add(4).saturating_add(length).min(data.len());
    (String::from_utf8_lossy(data.get(at + 4..end).unwrap_or_default()).into_owned(), end)
}

impl Mcap {
    pub fn new(context: Context) -> Self {
        Self {
            context,
            carry: Carry::default(),
            begun: false,
            schemas: Numbered::default(),
            topics: Numbered::default(),
            other: Named::default(),
            messages: 0,
        }
    }

    fn bad(&self, expected: &str, found: &str) -> ImportError {
        let place = format!("offset {}", self.carry.offset());
        form(&self.context.file, place, expected, found, "copy the file again or run `mcap recover` on it")
    }

    fn record(&mut self, kind: u8, data: &[u8], depth: usize) -> Result<(), ImportError> {
        match kind {
            SCHEMA => {
                let (name, at) = text(data, 2);
                let (encoding, at) = text(data, at);
                let content = data.get(at + 4..).unwrap_or_default().to_vec();
                self.schemas.insert(le(data, 0, 2), (name, encoding, content));
            }
            CHANNEL => self.channel(data),
            MESSAGE => {
                self.messages += 1;
                let time = le(data, 6, 8).min(i64::MAX as u64) as i64;
                if let Some(Some(topic)) = self.topics.get_mut(&le(data, 0, 2)) {
                    return topic.message(time, data.get(22..).unwrap_or_default());
                }
            }
            CHUNK if depth == 0 => return self.chunk(data),
            _ => {}
        }
        Ok(())
    }

    fn channel(&mut self, data: &[u8]) {
        let id = le(data, 0, 2);
        if self.topics.contains(&id) {
            return;
        }
        let (topic, at) = text(data, 4);
        let (encoding, _) = text(data, at);
        let schema = self.schemas.get(&le(data, 2, 2));
        let (kind, layout) = match (encoding.as_str(), schema) {
            ("cdr", Some((kind, form, content))) if form == "ros2msg" => (kind.clone(), plan(content, Wire::Cdr)),
            ("ros1", Some((kind, form, content))) if form == "ros1msg" => (kind.clone(), plan(content, Wire::Ros1)),
            ("json", schema) => (schema.map_or_else(String::new, |s| s.0.clone()), Some(Layout::Json)),
            ("protobuf", Some((kind, _, content))) => {
                (kind.clone(), Some(Layout::Proto(Rc::new(Schema::new(content)))))
            }
            (_, schema) => (schema.map_or_else(String::new, |s| format!("{} as {encoding} {}", s.0, s.1)), None),
        };
        if layout.is_none() {
            self.other.insert(kind.clone(), ());
        }
        self.topics.insert(id, layout.map(|layout| Topic::new(&self.context, &topic, &kind, layout)));
    }

    fn chunk(&mut self, data: &[u8]) -> Result<(), ImportError> {
        let size = le(data, 16, 8).min(LONGEST) as usize;
        let (compression, at) = text(data, 28);
        let length = le(data, at, 8) as usize;
        let start = (at + 8).min(data.len());
        let packed = &data[start..start.saturating_add(length).min(data.len())];
        let unpacked = match compression.as_str() {
            "" => return self.records(packed),
            "lz4" => lz4::unpack_frame(packed, size),
            "zstd" => unpack_zstd(packed, size),
            other => {
                let found = format!("compression `{}`", excerpt(other.as_bytes()));
                return Err(self.bad("a chunk stored or packed by zstd or lz4", &found));
            }
        };
        match unpacked {
            Some(bytes) => self.records(&bytes),
            None => Err(self.bad("packed records", "damaged data")),
        }
    }

    fn records(&mut self, mut bytes: &[u8]) -> Result<(), ImportError> {
        while bytes.len() >= 9 {
            let end = 9usize.saturating_add(le(bytes, 1, 8) as usize);
            let Some(record) = bytes.get(9..end) else { break };
            self.record(bytes[0], record, 1)?;
            bytes = &bytes[end..];
        }
        Ok(())
    }
}

fn plan(definition: &[u8], wire: Wire) -> Option<Layout> {
    let plan = Plan::new(&String::from_utf8_lossy(definition), wire)?;
    (!plan.names.is_empty()).then_some(Layout::Ros(plan))
}

/// Unpack zstd frames of at most `most` bytes.
fn unpack_zstd(packed: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut rest = packed;
    let decoder = ruzstd::decoding::StreamingDecoder::new(&mut rest).ok()?;
    let mut out = Vec::new();
    decoder.take(most as u64 + 1).read_to_end(&mut out).ok()?;
    (out.len() <= most).then_some(out)
}

impl Reader for Mcap {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        self.carry.extend(bytes);
        if !self.begun {
            if self.carry.peek(MAGIC).is_none() {
                return Ok(());
            }
            self.carry.consume(MAGIC);
            self.begun = true;
        }
        while let Some(head) = self.carry.peek(9) {
            let (kind, length) = (head[0], le(head, 1, 8));
            if kind == 0x89 || !matches!(kind, SCHEMA | CHANNEL | MESSAGE | CHUNK) {
                // The magic bytes at the end, or a record that holds no messages.
                self.carry.pass(if kind == 0x89 { u64::MAX } else { length.saturating_add(9) });
                continue;
            }
            if length > LONGEST {
                return Err(self.bad("a record of at most 1 GiB", &format!("one of {length} bytes")));
            }
            let Some(record) = self.carry.peek(9 + length as usize) else { break };
            let record = record[9..].to_vec();
            self.record(kind, &record, 0)?;
            self.carry.consume(9 + record.len());
        }
        Ok(())
    }

    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        if self.carry.left() > MAGIC {
            log.warn(format!("{}: the file ends inside a record; what came before was read.", self.context.file));
        }
        if self.messages == 0 {
            return Err(self.bad("messages", "none"));
        }
        self.topics.into_sorted().filter_map(|(_, topic)| topic).for_each(|topic| topic.finish("MCAP", log));
        if !self.other.is_empty() {
            let kinds = self.other.into_sorted().take(6).map(|(kind, ())| kind).collect::<Vec<_>>().join(", ");
            log.warn(format!(
                "{}: messages that hold no numbers or cannot be read left out ({kinds}).",
                self.context.file
            ));
        }
        Ok(())
    }

    fn rows(&self) -> usize {
        self.topics.values().flatten().map(Topic::rows).sum()
    }
}
