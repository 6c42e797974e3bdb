//! Protocol Buffers messages, by the descriptors that a log carries.
//!
//! Descriptors are themselves such messages: field numbers below are those of `google.protobuf.FileDescriptorSet`.

use crate::register::{Named, Numbered};

/// Messages inside messages beyond this are not followed.
const NESTED: usize = 8;

/// A message type: its fields by number.
type Message = Numbered<Field>;

#[derive(Clone, Debug, Default)]
struct Field {
    name: String,
    /// Type number of the descriptor: 1 double .. 18 sint64, 11 a message.
    kind: u64,
    repeated: bool,
    message: String,
}

/// The types that a schema knows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Schema {
    messages: Named<Message>,
}

/// A field as it is on the wire.
enum Wire<'a> {
    Number(u64, usize),
    Bytes(&'a [u8]),
}

fn varint(data: &[u8], pos: &mut usize) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = *data.get(*pos)?;
        *pos += 1;
        value |= u64::from(byte & 127) << shift;
        if byte < 128 {
            return Some(value);
        }
    }
    None
}

/// The next field: its number and what it holds.
fn next<'a>(data: &'a [u8], pos: &mut usize) -> Option<(u64, Wire<'a>)> {
    let tag = varint(data, pos)?;
    let mut fixed = |size: usize| {
        let bytes = data.get(*pos..*pos + size)?;
        *pos += size;
        Some(Wire::Number(super::carry::le(bytes, 0, size), size))
    };
    let wire = match tag & 7 {
        0 => Wire::Number(varint(data, pos)?, 0),
        1 => fixed(8)?,
        5 => fixed(4)?,
        2 => {
            let length = usize::try_from(varint(data, pos)?).ok()?;
            let bytes = data.get(*pos..pos.checked_add(length)?)?;
            *pos += length;
            Wire::Bytes(bytes)
        }
        _ => return None,
    };
    Some((tag >> 3, wire))
}

fn each(data: &[u8], mut take: impl FnMut(u64, &[u8], u64)) {
    let mut pos = 0;
    while let Some((number, wire)) = next(data, &mut pos) {
        match wire {
            Wire::Number(value, _) => take(number, &[], value),
            Wire::Bytes(bytes) => take(number, bytes, 0),
        }
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

impl Schema {
    /// From a `FileDescriptorSet`.
    pub fn new(data: &[u8]) -> Self {
        let mut schema = Self::default();
        each(data, |number, file, _| {
            if number == 1 {
                schema.file(file);
            }
        });
        schema
    }

    fn file(&mut self, file: &[u8]) {
        let mut package = String::new();
        let mut messages: Vec<Vec<u8>> = Vec::new();
        each(file, |number, bytes, _| match number {
            2 => package = text(bytes),
            4 => messages.push(bytes.to_vec()),
            _ => {}
        });
        messages.iter().for_each(|m| self.message(m, &package, 0));
    }

    fn message(&mut self, data: &[u8], within: &str, depth: usize) {
        let (mut name, mut fields, mut nested) = (String::new(), Message::default(), Vec::new());
        each(data, |number, bytes, _| match number {
            1 => name = text(bytes),
            2 => {
                let (id, field) = field(bytes);
                fields.insert(id, field);
            }
            3 => nested.push(bytes.to_vec()),
            _ => {}
        });
        let full = if within.is_empty() { name } else { format!("{within}.{name}") };
        if depth < NESTED {
            nested.iter().for_each(|m| self.message(m, &full, depth + 1));
        }
        self.messages.insert(full, fields);
    }

    /// The numbers of a message with their paths; `None` if it is damaged.
    pub fn read(&self, kind: &str, data: &[u8], take: &mut dyn FnMut(&str, f64)) -> Option<()> {
        self.walk(kind, data, "", 0, take)
    }

    fn walk(&self, kind: &str, data: &[u8], path: &str, depth: usize, take: &mut dyn FnMut(&str, f64)) -> Option<()> {
        let fields = self.messages.get(kind)?;
        let mut pos = 0;
        while pos < data.len() {
            let (number, wire) = next(data, &mut pos)?;
            let Some(field) = fields.get(&number).filter(|f| !f.repeated) else { continue };
            let path = if path.is_empty() { field.name.clone() } else { format!("{path}.{}", field.name) };
            match wire {
                Wire::Number(raw, size) => take(&path, field.value(raw, size)),
                Wire::Bytes(bytes) if field.kind == 11 && depth < NESTED => {
                    self.walk(field.message.trim_start_matches('.'), bytes, &path, depth + 1, take)?;
                }
                Wire::Bytes(_) => {}
            }
        }
        Some(())
    }
}

fn field(data: &[u8]) -> (u64, Field) {
    let (mut id, mut field) = (0, Field::default());
    each(data, |number, bytes, value| match number {
        1 => field.name = text(bytes),
        3 => id = value,
        4 => field.repeated = value == 3,
        5 => field.kind = value,
        6 => field.message = text(bytes),
        _ => {}
    });
    (id, field)
}

impl Field {
    fn value(&self, raw: u64, size: usize) -> f64 {
        match (self.kind, size) {
            (1, 8) => f64::from_bits(raw),
            (2, 4) => f64::from(f32::from_bits(raw as u32)),
            // sint32 and sint64 count 0, -1, 1, -2, ..
            (17 | 18, _) => ((raw >> 1) as i64 ^ -((raw & 1) as i64)) as f64,
            (15, _) => f64::from(raw as u32 as i32),
            (3 | 5 | 16, _) => raw as i64 as f64,
            _ => raw as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(number: u8, content: &[u8]) -> Vec<u8> {
        [&[number << 3 | 2, content.len() as u8], content].concat()
    }

    #[test]
    fn numbers_are_found_by_the_descriptor() {
        // message V { double x = 1; sint32 n = 2; } message M { V v = 3; } in package p.
        let field = |name: &[u8], id: u8, kind: u8, message: &[u8]| {
            [bytes(1, name), vec![3 << 3, id, 4 << 3, 1, 5 << 3, kind], bytes(6, message)].concat()
        };
        let v = [bytes(1, b"V"), bytes(2, &field(b"x", 1, 1, b"")), bytes(2, &field(b"n", 2, 17, b""))].concat();
        let m = [bytes(1, b"M"), bytes(2, &field(b"v", 3, 11, b".p.V"))].concat();
        let file = [bytes(2, b"p"), bytes(4, &v), bytes(4, &m)].concat();
        let schema = Schema::new(&bytes(1, &file));
        let inner = [&[1 << 3 | 1][..], &2.5f64.to_le_bytes(), &[2 << 3, 3]].concat();
        let mut found = Vec::new();
        let message = bytes(3, &inner);
        schema.read("p.M", &message, &mut |path, value| found.push((path.to_owned(), value))).unwrap();
        assert_eq!(found, [("v.x".to_owned(), 2.5), ("v.n".to_owned(), -2.0)]);
        assert!(schema.read("p.M", &message[..5], &mut |_, _| {}).is_none());
    }
}
