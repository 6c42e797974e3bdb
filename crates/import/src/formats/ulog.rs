//! PX4 ULog: topics declared in the file, logged as messages.

use std::rc::Rc;

use super::carry::{Carry, le};
use super::grower::{Grower, Zero, is};
use super::{Context, Reader};
use crate::error::{ImportError, form};
use crate::opening::Gathered;
use crate::register::{Named, Numbered};
use crate::table::Meaning;

/// Columns of one topic beyond this are left out.
const WIDEST: usize = 256;
/// Formats inside formats beyond this are not followed.
const NESTED: usize = 4;

/// Topic, field, unit and meaning of what PX4 itself defines. Body axes are forward, right, down.
const KNOWN: &[(&str, &str, &str, Option<Meaning>)] = &[
    ("sensor_combined", "gyro_rad_0", "rad/s", is("gyro_x")),
    ("sensor_combined", "gyro_rad_1", "rad/s", is("gyro_y")),
    ("sensor_combined", "gyro_rad_2", "rad/s", is("gyro_z")),
    ("sensor_combined", "accelerometer_m_s2_0", "m/s^2", is("accel_x")),
    ("sensor_combined", "accelerometer_m_s2_1", "m/s^2", is("accel_y")),
    ("sensor_combined", "accelerometer_m_s2_2", "m/s^2", is("accel_z")),
    ("sensor_combined", "magnetometer_ga_0", "gauss", is("mag_x")),
    ("sensor_combined", "magnetometer_ga_1", "gauss", is("mag_y")),
    ("sensor_combined", "magnetometer_ga_2", "gauss", is("mag_z")),
    ("sensor_combined", "baro_alt_meter", "m", is("baro_alt")),
    ("vehicle_magnetometer", "magnetometer_ga_0", "gauss", is("mag_x")),
    ("vehicle_magnetometer", "magnetometer_ga_1", "gauss", is("mag_y")),
    ("vehicle_magnetometer", "magnetometer_ga_2", "gauss", is("mag_z")),
    ("vehicle_air_data", "baro_alt_meter", "m", is("baro_alt")),
    ("vehicle_gps_position", "lat", "1e-7 deg", is("gnss_lat")),
    ("vehicle_gps_position", "lon", "1e-7 deg", is("gnss_lon")),
    ("vehicle_gps_position", "alt", "mm", is("gnss_alt")),
    ("vehicle_gps_position", "latitude_deg", "deg", is("gnss_lat")),
    ("vehicle_gps_position", "longitude_deg", "deg", is("gnss_lon")),
    ("vehicle_gps_position", "altitude_msl_m", "m", is("gnss_alt")),
    ("vehicle_gps_position", "vel_n_m_s", "m/s", is("gnss_vn")),
    ("vehicle_gps_position", "vel_e_m_s", "m/s", is("gnss_ve")),
    ("vehicle_gps_position", "vel_d_m_s", "m/s", is("gnss_vd")),
    ("vehicle_gps_position", "vel_m_s", "m/s", is("gnss_speed")),
    ("vehicle_gps_position", "cog_rad", "rad", is("course")),
    ("vehicle_gps_position", "satellites_used", "", is("gnss_nsat")),
];

/// A field of a format.
#[derive(Clone, Debug)]
struct Field {
    kind: String,
    count: usize,
    name: String,
}

/// A number in a message.
#[derive(Clone, Copy, Debug)]
struct Slot {
    offset: usize,
    kind: Number,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    Unsigned(usize),
    Signed(usize),
    Float,
    Double,
}

/// A topic that is logged.
struct Topic {
    time: usize,
    slots: Vec<Slot>,
    grower: Grower,
}

/// Reads messages.
pub(crate) struct Ulog {
    file: Rc<str>,
    part: String,
    carry: Carry,
    begun: bool,
    formats: Named<Vec<Field>>,
    topics: Numbered<Topic>,
    dropouts: usize,
    messages: usize,
    row: Vec<f64>,
}

impl Ulog {
    pub fn new(context: Context) -> Self {
        Self {
            file: context.file,
            part: context.part,
            carry: Carry::default(),
            begun: false,
            formats: Named::default(),
            topics: Numbered::default(),
            dropouts: 0,
            messages: 0,
            row: Vec::new(),
        }
    }

    fn message(&mut self, kind: u8, body: &[u8]) -> Result<(), ImportError> {
        match kind {
            b'F' => self.format(&String::from_utf8_lossy(body)),
            b'A' => self.add(body),
            b'D' => return self.data(body),
            b'O' => self.dropouts += 1,
            _ => {}
        }
        Ok(())
    }

    /// `name:type field;type[3] field;`.
    fn format(&mut self, text: &str) {
        let Some((name, fields)) = text.split_once(':') else { return };
        let field = |f: &str| {
            let (kind, name) = f.trim().split_once(' ')?;
            let (kind, count) = match kind.split_once('[') {
                Some((kind, rest)) => (kind, rest.trim_end_matches(']').parse().ok()?),
                None => (kind, 1),
            };
            Some(Field { kind: kind.to_owned(), count, name: name.to_owned() })
        };
        self.formats.insert(name.to_owned(), fields.split(';').filter_map(field).collect());
    }

    /// The numbers of a format, by name; the length of the format.
    fn layout(
        &self,
        name: &str,
        prefix: &str,
        start: usize,
        depth: usize,
        out: &mut Vec<(String, Slot)>,
    ) -> Option<usize> {
        let mut offset = start;
        for field in self.formats.get(name).filter(|_| depth < NESTED)? {
            let simple = simple(&field.kind);
            for i in 0..field.count.min(4096) {
                let label = if field.count > 1 {
                    format!("{prefix}{}_{i}", field.name)
                } else {
                    format!("{prefix}{}", field.name)
                };
                match simple {
                    Some((size, number)) => {
                        if let Some(kind) = number
                            && out.len() < WIDEST
                            && !field.name.starts_with("_padding")
                        {
                            out.push((label, Slot { offset, kind }));
                        }
                        offset += size;
                    }
                    None => offset = self.layout(&field.kind, &format!("{label}_"), offset, depth + 1, out)?,
                }
            }
        }
        Some(offset)
    }

    fn add(&mut self, body: &[u8]) {
        let (instance, id) = (le(body, 0, 1), le(body, 1, 2) as u16);
        let name = String::from_utf8_lossy(body.get(3..).unwrap_or_default()).into_owned();
        let mut layout = Vec::new();
        if self.layout(&name, "", 0, 0, &mut layout).is_none() {
            return;
        }
        let Some(time) = layout.iter().position(|(n, _)| n == "timestamp").map(|i| layout.remove(i).1.offset) else {
            return;
        };
        let within = if self.part.is_empty() { String::new() } else { format!("{}: ", self.part) };
        let label = if instance == 0 { format!("{within}{name}") } else { format!("{within}{name} {instance}") };
        let mut grower = Grower::new(&self.file, &label);
        for (field, _) in &layout {
            let known = KNOWN.iter().find(|(t, f, ..)| *t == name && f == field);
            let meaning = known.and_then(|k| k.3).filter(|_| instance == 0);
            // Only what PX4 defines is a signal: states and set points have the same names as measurements.
            let column = if known.is_some() { field.clone() } else { format!("{name}.{field}") };
            grower.column(&column, known.map_or("", |k| k.2), meaning);
        }
        let slots = layout.into_iter().map(|(_, slot)| slot).collect();
        self.topics.insert(id.into(), Topic { time, slots, grower });
    }

    fn data(&mut self, body: &[u8]) -> Result<(), ImportError> {
        let Some(topic) = self.topics.get_mut(&le(body, 0, 2)) else { return Ok(()) };
        let data = body.get(2..).unwrap_or_default();
        if data.len() < topic.time + 8 {
            return Ok(());
        }
        let time = (le(data, topic.time, 8) as i64).saturating_mul(1000);
        self.row.clear();
        self.row.extend(topic.slots.iter().map(|s| s.value(data)));
        self.messages += 1;
        topic.grower.row(time, &self.row)
    }
}

/// Bytes of a simple type, and the number it is; text is none.
fn simple(kind: &str) -> Option<(usize, Option<Number>)> {
    Some(match kind {
        "int8_t" => (1, Some(Number::Signed(1))),
        "uint8_t" | "bool" => (1, Some(Number::Unsigned(1))),
        "int16_t" => (2, Some(Number::Signed(2))),
        "uint16_t" => (2, Some(Number::Unsigned(2))),
        "int32_t" => (4, Some(Number::Signed(4))),
        "uint32_t" => (4, Some(Number::Unsigned(4))),
        "int64_t" => (8, Some(Number::Signed(8))),
        "uint64_t" => (8, Some(Number::Unsigned(8))),
        "float" => (4, Some(Number::Float)),
        "double" => (8, Some(Number::Double)),
        "char" => (1, None),
        _ => return None,
    })
}

impl Slot {
    fn value(self, data: &[u8]) -> f64 {
        let size = match self.kind {
            Number::Unsigned(size) | Number::Signed(size) => size,
            Number::Float => 4,
            Number::Double => 8,
        };
        if self.offset + size > data.len() {
            return f64::NAN;
        }
        let raw = le(data, self.offset, size);
        match self.kind {
            Number::Unsigned(_) => raw as f64,
            Number::Signed(size) => {
                let unused = 64 - 8 * size as u32;
                (((raw << unused) as i64) >> unused) as f64
            }
            Number::Float => f64::from(f32::from_bits(raw as u32)),
            Number::Double => f64::from_bits(raw),
        }
    }
}

impl Reader for Ulog {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        self.carry.extend(bytes);
        if !self.begun {
            if self.carry.peek(16).is_none() {
                return Ok(());
            }
            self.carry.consume(16);
            self.begun = true;
        }
        while let Some(head) = self.carry.peek(3) {
            let (size, kind) = (le(head, 0, 2) as usize, head[2]);
            let Some(message) = self.carry.peek(3 + size) else { break };
            let body = message[3..].to_vec();
            self.carry.consume(3 + size);
            self.message(kind, &body)?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        if self.carry.left() > 0 {
            log.warn(format!("{}: the file ends inside a message; what came before was read.", self.file));
        }
        if self.dropouts > 0 {
            log.warn(format!("{}: the logger lost data ({} dropouts).", self.file, self.dropouts));
        }
        if self.messages == 0 {
            let advice = "check that the recording was not cut off";
            return Err(form(&self.file, "all messages".into(), "logged data", "none", advice));
        }
        log.tables.extend(self.topics.into_sorted().filter_map(|(_, t)| t.grower.finish("ULog", Zero::Unknown)));
        Ok(())
    }

    fn rows(&self) -> usize {
        self.messages
    }
}
