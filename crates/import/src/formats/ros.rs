//! Messages of ROS 1 and ROS 2: definitions as text, and the numbers in their serialized form.
//!
//! ROS 1 packs fields without padding; CDR of ROS 2 (XCDR 1, either byte order) aligns each to its size.
//! Axes are those of REP 103 (x forward, y left, z up), specific force is what an `Imu` calls linear acceleration.

use crate::register::Named;
use crate::table::Meaning;

use super::grower::{is, turned};

/// Numbers of one message beyond this are left out.
const WIDEST: usize = 256;
/// Definitions inside definitions beyond this are not followed.
const NESTED: usize = 8;
/// Elements of a sequence that are read over at most.
const LONGEST: usize = 1 << 24;
/// Fixed arrays longer than this are read over.
const ARRAY: usize = 8;

/// How messages are serialized.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wire {
    Ros1,
    Cdr,
}

/// One step of reading a message.
#[derive(Clone, Debug)]
enum Step {
    /// A number that is a column, or is read over.
    Number { kind: Number, keep: bool },
    /// Text.
    Text,
    /// A fixed number of elements.
    Array { count: usize, steps: Vec<Step> },
    /// As many elements as the message says.
    Sequence { steps: Vec<Step> },
    /// Seconds and nanoseconds that stamp the message.
    Stamp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    Unsigned(usize),
    Signed(usize),
    Float,
    Double,
    /// Seconds and nanoseconds of 32 bits each.
    Time,
}

/// How to read the messages of one type.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    wire: Wire,
    steps: Vec<Step>,
    /// Path of every number that is kept.
    pub names: Vec<String>,
}

/// Columns of known types: end of the path, unit, meaning.
type Known = (&'static str, &'static str, Option<Meaning>);

const IMU: &[Known] = &[
    ("angular_velocity.x", "rad/s", is("gyro_x")),
    ("angular_velocity.y", "rad/s", turned("gyro_y")),
    ("angular_velocity.z", "rad/s", turned("gyro_z")),
    ("linear_acceleration.x", "m/s^2", is("accel_x")),
    ("linear_acceleration.y", "m/s^2", turned("accel_y")),
    ("linear_acceleration.z", "m/s^2", turned("accel_z")),
];
const MAG: &[Known] = &[
    ("magnetic_field.x", "T", is("mag_x")),
    ("magnetic_field.y", "T", turned("mag_y")),
    ("magnetic_field.z", "T", turned("mag_z")),
];
const FIX: &[Known] =
    &[("latitude", "deg", is("gnss_lat")), ("longitude", "deg", is("gnss_lon")), ("altitude", "m", is("gnss_alt"))];
const ODOMETRY: &[Known] = &[("twist.twist.linear.x", "m/s", is("speed"))];
const TWIST: &[Known] = &[("twist.linear.x", "m/s", is("speed"))];

/// What the columns of a type mean: of `sensor_msgs/Imu`, `sensor_msgs/msg/Imu`, and a plain `Imu` of JSON or protobuf.
pub(crate) fn known(kind: &str, path: &str) -> (&'static str, Option<Meaning>) {
    let table = match kind.rsplit(['/', '.']).next().unwrap_or_default() {
        "Imu" | "IMU" => IMU,
        "MagneticField" => MAG,
        "NavSatFix" | "LocationFix" => FIX,
        "Odometry" => ODOMETRY,
        "TwistStamped" | "TwistWithCovarianceStamped" => {
            if path.starts_with("twist.twist") {
                ODOMETRY
            } else {
                TWIST
            }
        }
        _ => &[],
    };
    table.iter().find(|(end, ..)| *end == path).map_or(("", None), |(_, unit, meaning)| (unit, *meaning))
}

impl Plan {
    /// Read a definition: the type's own text, then those of other types below lines of `=`, each under `MSG: name`.
    pub fn new(definition: &str, wire: Wire) -> Option<Self> {
        let mut types: Named<String> = Named::default();
        let mut name = String::new();
        for line in definition.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if line.starts_with("====") {
                continue;
            }
            if let Some(next) = line.strip_prefix("MSG:") {
                name = next.trim().to_owned();
                continue;
            }
            let text = types.entry(name.clone(), String::new);
            text.push_str(line);
            text.push('\n');
        }
        let mut plan = Self { wire, steps: Vec::new(), names: Vec::new() };
        plan.steps = plan.steps_of(&types, "", "", 0, true)?;
        Some(plan)
    }

    fn steps_of(
        &mut self,
        types: &Named<String>,
        name: &str,
        path: &str,
        depth: usize,
        keep: bool,
    ) -> Option<Vec<Step>> {
        let text = find(types, name)?;
        let mut steps = Vec::new();
        for line in text.lines() {
            let mut words = line.split_whitespace();
            let (Some(kind), Some(field)) = (words.next(), words.next()) else { continue };
            // Constants are `type NAME=value` or `type NAME = value`.
            if field.contains('=') || words.next().is_some_and(|w| w.starts_with('=')) {
                continue;
            }
            let path = if path.is_empty() { field.to_owned() } else { format!("{path}.{field}") };
            steps.push(self.step_of(types, kind, &path, depth, keep)?);
        }
        Some(steps)
    }

    fn step_of(&mut self, types: &Named<String>, kind: &str, path: &str, depth: usize, keep: bool) -> Option<Step> {
        if depth > NESTED {
            return None;
        }
        if let Some((kind, size)) = kind.strip_suffix(']').and_then(|k| k.split_once('[')) {
            let count: Option<usize> = size.parse().ok();
            let Some(count) = count else {
                let steps = vec![self.step_of(types, kind, path, depth + 1, false)?];
                return Some(Step::Sequence { steps });
            };
            let inside = keep && count <= ARRAY;
            if inside {
                let steps: Option<Vec<Step>> =
                    (0..count).map(|i| self.step_of(types, kind, &format!("{path}.{i}"), depth + 1, true)).collect();
                return Some(Step::Array { count: 1, steps: steps? });
            }
            let steps = vec![self.step_of(types, kind, path, depth + 1, false)?];
            return Some(Step::Array { count, steps });
        }
        if TIMES.contains(&kind) {
            let stamp = keep && path == "header.stamp";
            return Some(if stamp { Step::Stamp } else { Step::Number { kind: Number::Time, keep: false } });
        }
        if kind == "string" || kind.starts_with("string<") {
            return Some(Step::Text);
        }
        let Some(number) = number_of(kind) else {
            // Definitions of ROS 1 leave the header's package out.
            let name = if kind == "Header" { "std_msgs/Header" } else { kind };
            let steps = self.steps_of(types, name, path, depth + 1, keep)?;
            return Some(Step::Array { count: 1, steps });
        };
        let keep = keep && self.names.len() < WIDEST && path != "header.seq";
        if keep {
            self.names.push(path.to_owned());
        }
        Some(Step::Number { kind: number, keep })
    }

    /// Read a message: its numbers go to `row`; its stamp in ns, if it has one.
    pub fn read(&self, data: &[u8], row: &mut Vec<f64>) -> Option<Option<i64>> {
        let mut cursor = Cursor { data, pos: 0, start: 0, big: false, wire: self.wire, stamp: None };
        if self.wire == Wire::Cdr {
            cursor.big = *data.get(1)? & 1 == 0;
            (cursor.pos, cursor.start) = (4, 4);
        }
        row.clear();
        cursor.run(&self.steps, row, true)?;
        Some(cursor.stamp)
    }
}

/// Types of two numbers of 32 bits.
const TIMES: [&str; 5] =
    ["time", "duration", "builtin_interfaces/Time", "builtin_interfaces/Duration", "builtin_interfaces/msg/Time"];

fn number_of(kind: &str) -> Option<Number> {
    Some(match kind {
        "bool" | "uint8" | "byte" | "char" => Number::Unsigned(1),
        "int8" => Number::Signed(1),
        "uint16" => Number::Unsigned(2),
        "int16" => Number::Signed(2),
        "uint32" => Number::Unsigned(4),
        "int32" => Number::Signed(4),
        "uint64" => Number::Unsigned(8),
        "int64" => Number::Signed(8),
        "float32" => Number::Float,
        "float64" => Number::Double,
        _ => return None,
    })
}

/// The definition of a type: by its name, or by the end of it where the package is left out.
fn find<'a>(types: &'a Named<String>, name: &str) -> Option<&'a String> {
    let short = name.rsplit('/').next().unwrap_or_default();
    let of = |n: &str| n.rsplit('/').next() == Some(short) && n.split('/').next() == name.split('/').next();
    let end = |n: &str| !name.contains('/') && n.rsplit('/').next() == Some(name);
    let first = |is: &dyn Fn(&str) -> bool| types.keys().find(|n| is(n)).and_then(|n| types.get(n));
    types.get(name).or_else(|| first(&of)).or_else(|| first(&end))
}

struct Cursor<'a> {
    data: &'a [u8],
    pos: usize,
    start: usize,
    big: bool,
    wire: Wire,
    stamp: Option<i64>,
}

impl Cursor<'_> {
    fn raw(&mut self, size: usize) -> Option<u64> {
        if self.wire == Wire::Cdr {
            self.pos = self.start + (self.pos - self.start).next_multiple_of(size);
        }
        let bytes = self.data.get(self.pos..self.pos.checked_add(size)?)?;
        self.pos += size;
        let join = |v: u64, b: &u8| v << 8 | u64::from(*b);
        Some(if self.big { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) })
    }

    fn number(&mut self, kind: Number) -> Option<f64> {
        Some(match kind {
            Number::Unsigned(size) => self.raw(size)? as f64,
            Number::Signed(size) => {
                let unused = 64 - 8 * size as u32;
                (((self.raw(size)? << unused) as i64) >> unused) as f64
            }
            Number::Float => f64::from(f32::from_bits(self.raw(4)? as u32)),
            Number::Double => f64::from_bits(self.raw(8)?),
            Number::Time => {
                self.raw(4)?;
                self.raw(4)? as f64
            }
        })
    }

    fn run(&mut self, steps: &[Step], row: &mut Vec<f64>, keep: bool) -> Option<()> {
        for step in steps {
            match step {
                Step::Number { kind, keep: kept } => {
                    let value = self.number(*kind)?;
                    if *kept && keep {
                        row.push(value);
                    }
                }
                Step::Stamp => {
                    let (seconds, nanos) = (self.raw(4)? as i64, self.raw(4)? as i64);
                    self.stamp = Some(seconds * 1_000_000_000 + nanos);
                }
                Step::Text => {
                    let length = self.raw(4)? as usize;
                    self.pos = self.pos.checked_add(length).filter(|end| *end <= self.data.len())?;
                }
                Step::Array { count, steps } => self.times(*count, steps, row, keep)?,
                Step::Sequence { steps } => {
                    let count = self.raw(4)? as usize;
                    self.times(count, steps, row, false)?;
                }
            }
        }
        Some(())
    }

    /// Elements one after the other; what takes no bytes is not repeated.
    fn times(&mut self, count: usize, steps: &[Step], row: &mut Vec<f64>, keep: bool) -> Option<()> {
        for _ in 0..count.min(LONGEST) {
            let before = self.pos;
            self.run(steps, row, keep)?;
            if self.pos == before {
                break;
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMU_TEXT: &str = "std_msgs/Header header\nfloat64[9] cov # c\nVector3 a\nuint8 X=1\nint8 s\n\
        ====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n====\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\n";

    #[test]
    fn a_message_of_ros_1_is_read_without_padding() {
        let plan = Plan::new(IMU_TEXT, Wire::Ros1).unwrap();
        assert_eq!(plan.names, ["a.x", "a.y", "s"]);
        let mut data = vec![1, 0, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 2, 0, 0, 0, b'a', b'b'];
        data.extend([0; 72]);
        data.extend(1.5f64.to_le_bytes());
        data.extend((-2.5f64).to_le_bytes());
        data.push(0xff);
        let mut row = Vec::new();
        assert_eq!(plan.read(&data, &mut row), Some(Some(7_000_000_009)));
        assert_eq!(row, [1.5, -2.5, -1.0]);
        assert_eq!(plan.read(&data[..40], &mut row), None);
    }

    #[test]
    fn cdr_aligns_numbers_to_their_size() {
        let text = "builtin_interfaces/Time t\nuint8 a\nfloat64 b\nstring c\nint16[2] d\n";
        let plan = Plan::new(text, Wire::Cdr).unwrap();
        let mut data = vec![0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0];
        data.extend(2.0f64.to_le_bytes());
        data.extend([2, 0, 0, 0, b'x', 0, 3, 0, 0xfe, 0xff]);
        let mut row = Vec::new();
        assert!(plan.read(&data, &mut row).is_some());
        assert_eq!(row, [5.0, 2.0, 3.0, -2.0]);
    }
}
