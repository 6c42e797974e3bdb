//! Magnetic fields and velocities of ROS messages, ROS 2 in MCAP and ROS 1 in bags: the numbers, units and axes written are
//! those that come back.

#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_import::{MemorySource, OpenReport, Opening, open_log};

/// Messages of each topic.
const ROWS: usize = 30;
/// Of the first stamp, s since 1970.
const START: u32 = 1_700_000_000;
/// What stands between the numbers that are read: taken for one of them, no value fits.
const OTHER: f64 = 777.0;

const HEADER: &str = "================\nMSG: std_msgs/Header\n";
const VECTOR: &str = "================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const TWIST: &str = "================\nMSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n";
const MAGNETIC: &str = "# A vector in Tesla\nstd_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field # x, y, z\n\
    float64[9] magnetic_field_covariance\n";
const TWIST_STAMPED: &str = "std_msgs/Header header\nTwist twist\n";
const WITH_COVARIANCE: &str = "Header header\nTwistWithCovariance twist\n\
    ================\nMSG: geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance\n";

/// How a file's messages are written.
#[derive(Clone, Copy, PartialEq)]
enum Wire {
    Ros1,
    Little,
    Big,
}

impl Wire {
    fn bytes<const N: usize>(self, little: [u8; N]) -> Vec<u8> {
        let mut bytes = little.to_vec();
        if self == Self::Big {
            bytes.reverse();
        }
        bytes
    }
}

/// Field in the sensor's axes (x forward, y left, z up), T.
fn field(i: usize) -> [f64; 3] {
    [21.5e-6 + i as f64 * 1e-7, 3.25e-6 - i as f64 * 2e-7, -43.0e-6]
}

/// Forward speed, m/s.
fn speed(i: usize) -> f64 {
    8.0 + i as f64 / 16.0
}

/// A message: its header with a name of a frame of any length, then numbers, as `wire` has them.
fn message(wire: Wire, i: usize, frame: &str, numbers: &[f64]) -> Vec<u8> {
    let mut out = match wire {
        Wire::Ros1 => (OTHER as u32).to_le_bytes().to_vec(),
        Wire::Little => vec![0, 1, 0, 0],
        Wire::Big => vec![0, 0, 0, 0],
    };
    let nanos = i as u32 % 10 * 100_000_000;
    for number in [START + i as u32 / 10, nanos, frame.len() as u32 + u32::from(wire != Wire::Ros1)] {
        out.extend(wire.bytes(number.to_le_bytes()));
    }
    out.extend(frame.bytes());
    if wire != Wire::Ros1 {
        out.push(0);
        out.resize(4 + (out.len() - 4).next_multiple_of(8), 0);
    }
    numbers.iter().for_each(|v| out.extend(wire.bytes(v.to_le_bytes())));
    out
}

fn magnetic(wire: Wire, i: usize, frame: &str) -> Vec<u8> {
    message(wire, i, frame, &[&field(i)[..], &[OTHER; 9]].concat())
}

/// Speed forward, to the left and up; rates about the axes; numbers behind them.
fn twist(wire: Wire, i: usize, frame: &str, behind: usize) -> Vec<u8> {
    message(wire, i, frame, &[&[speed(i), -OTHER, OTHER, OTHER, OTHER, OTHER][..], &vec![OTHER; behind]].concat())
}

fn text(out: &mut Vec<u8>, text: &[u8]) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text);
}

/// A topic: name, type, definition, messages.
type Topic = (&'static str, &'static str, String, Vec<Vec<u8>>);

fn mcap(topics: &[Topic]) -> Vec<u8> {
    let record = |out: &mut Vec<u8>, kind: u8, body: &[u8]| {
        out.push(kind);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(body);
    };
    let mut out = b"\x89MCAP0\r\n".to_vec();
    record(&mut out, 1, &[0; 8]);
    for (id, (topic, kind, definition, messages)) in topics.iter().enumerate() {
        let mut schema = (id as u16 + 1).to_le_bytes().to_vec();
        [kind.as_bytes(), b"ros2msg", definition.as_bytes()].iter().for_each(|part| text(&mut schema, part));
        record(&mut out, 3, &schema);
        let mut channel = [(id as u16).to_le_bytes(), (id as u16 + 1).to_le_bytes()].concat();
        [topic.as_bytes(), b"cdr"].iter().for_each(|part| text(&mut channel, part));
        channel.extend([0; 4]);
        record(&mut out, 4, &channel);
        for (i, data) in messages.iter().enumerate() {
            let at = u64::from(START) * 1_000_000_000 + 100_000_000 * i as u64 + 4_000_000;
            let head = [&(id as u16).to_le_bytes()[..], &[0; 4], &at.to_le_bytes(), &at.to_le_bytes()].concat();
            record(&mut out, 5, &[head, data.clone()].concat());
        }
    }
    record(&mut out, 15, &[0; 4]);
    out.extend(b"\x89MCAP0\r\n");
    out
}

fn bag(topics: &[Topic]) -> Vec<u8> {
    let record = |out: &mut Vec<u8>, fields: &[(&str, &[u8])], data: &[u8]| {
        let mut header = Vec::new();
        fields.iter().for_each(|(name, value)| text(&mut header, &[name.as_bytes(), b"=", value].concat()));
        text(out, &header);
        text(out, data);
    };
    let mut chunk = Vec::new();
    for (id, (topic, kind, definition, messages)) in topics.iter().enumerate() {
        let conn = (id as u32).to_le_bytes();
        let mut connection = Vec::new();
        text(&mut connection, format!("type={kind}").as_bytes());
        text(&mut connection, format!("message_definition={definition}").as_bytes());
        record(&mut chunk, &[("op", &[7]), ("conn", &conn), ("topic", topic.as_bytes())], &connection);
        for (i, data) in messages.iter().enumerate() {
            let mut time = (START + i as u32 / 10).to_le_bytes().to_vec();
            time.extend((i as u32 % 10 * 100_000_000 + 4_000_000).to_le_bytes());
            record(&mut chunk, &[("op", &[2]), ("conn", &conn), ("time", &time)], data);
        }
    }
    let mut out = b"#ROSBAG V2.0\n".to_vec();
    record(&mut out, &[("op", &[3])], &[b' '; 30]);
    let size = (chunk.len() as u32).to_le_bytes();
    record(&mut out, &[("op", &[5]), ("compression", b"none"), ("size", &size)], &chunk);
    out
}

/// Files with a magnetometer and a velocity, the latter with or without its covariance.
fn files(frame: &str, covariance: bool) -> Vec<(String, Vec<u8>)> {
    [Wire::Ros1, Wire::Little, Wire::Big]
        .map(|wire| {
            let (stamp, msg) = match wire {
                Wire::Ros1 => ("uint32 seq\ntime stamp\nstring frame_id\n", ""),
                _ => ("builtin_interfaces/Time stamp\nstring frame_id\n", "/msg"),
            };
            let parts = |own: &str| format!("{own}{TWIST}{VECTOR}{HEADER}{stamp}");
            let (kind, own, behind) = match (covariance, msg.is_empty()) {
                (true, true) => ("geometry_msgs/TwistWithCovarianceStamped", WITH_COVARIANCE, 36),
                (true, false) => ("geometry_msgs/msg/TwistWithCovarianceStamped", WITH_COVARIANCE, 36),
                (false, true) => ("geometry_msgs/TwistStamped", TWIST_STAMPED, 0),
                (false, false) => ("geometry_msgs/msg/TwistStamped", TWIST_STAMPED, 0),
            };
            let field = if msg.is_empty() { "sensor_msgs/MagneticField" } else { "sensor_msgs/msg/MagneticField" };
            let rows = || 0..ROWS;
            let topics: [Topic; 2] = [
                ("/mag", field, parts(MAGNETIC), rows().map(|i| magnetic(wire, i, frame)).collect()),
                ("/vel", kind, parts(own), rows().map(|i| twist(wire, i, frame, behind)).collect()),
            ];
            let name = format!("{kind}, frame `{frame}`, {}", if wire == Wire::Big { "big" } else { "little" });
            (name, if wire == Wire::Ros1 { bag(&topics) } else { mcap(&topics) })
        })
        .into()
}

fn open(name: &str, bytes: Vec<u8>) -> (Drive, OpenReport) {
    let mut opening = Opening::new(vec![Box::new(MemorySource::new("log", bytes))]).unwrap();
    while opening.step().unwrap_or_else(|e| panic!("{name}: {e}")) {}
    open_log(opening.finish().unwrap_or_else(|e| panic!("{name}: {e}")), None).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Catches a number read from another place (every other number is 777), gauss or microtesla for tesla, and axes that are
/// not turned from x forward, y left, z up to x forward, y right, z down.
#[test]
fn magnetic_fields_and_velocities_of_ros_hold_the_values_that_were_written() {
    // The length of the frame's name moves everything behind it: with and without padding.
    for frame in ["", "imu", "base_link", "mag_fr0"] {
        for covariance in [false, true] {
            for (name, bytes) in files(frame, covariance) {
                let (drive, report) = open(&name, bytes);
                assert_eq!((drive.mag.len(), drive.wheels.len()), (ROWS, ROWS), "{name}: {report:?}");
                assert_eq!(report.epoch.as_deref(), Some("2023-11-14T22:13:20Z"), "{name}");
                for i in 0..ROWS {
                    let (t, mag) = drive.mag.at(i);
                    assert!((t - drive.mag.at(0).0 - i as f64 / 10.0).abs() < 1e-9, "{name}, row {i}: t {t}");
                    let [x, y, z] = field(i);
                    // A drive holds microtesla: two roundings of 43 are below 1e-13.
                    let apart = [mag.mag_x - x * 1e6, mag.mag_y + y * 1e6, mag.mag_z + z * 1e6];
                    assert!(apart.iter().all(|d| d.abs() < 1e-12), "{name}, row {i}: {mag:?}");
                    let (t, wheels) = drive.wheels.at(i);
                    assert!((t - drive.wheels.at(0).0 - i as f64 / 10.0).abs() < 1e-9, "{name}, row {i}: t {t}");
                    assert_eq!(wheels.speed, speed(i), "{name}, row {i}");
                }
            }
        }
    }
}

/// Catches a message whose end is missing and whose blanks are read as numbers.
#[test]
fn messages_that_end_early_are_left_out_and_that_is_said() {
    let definition = format!("{MAGNETIC}{VECTOR}{HEADER}builtin_interfaces/Time stamp\nstring frame_id\n");
    let mut messages: Vec<Vec<u8>> = (0..ROWS).map(|i| magnetic(Wire::Little, i, "imu")).collect();
    messages[7].truncate(40);
    let bytes = mcap(&[("/mag", "sensor_msgs/msg/MagneticField", definition, messages)]);
    let (drive, report) = open("cut", bytes);
    assert_eq!(drive.mag.len(), ROWS - 1);
    assert!(drive.mag.series().time().iter().all(|t| (t - drive.mag.at(0).0 - 0.7).abs() > 1e-6));
    let said = "/mag: messages that do not fit their definition left out (1).";
    assert!(report.warnings.iter().any(|w| w.message == said), "{:?}", report.warnings);
}
