//! Small files of every format, made here: forty samples, 0.1 s apart, of one slow drive.

#![allow(dead_code, clippy::unwrap_used)]

use std::io::Write;

mod bzip2;
mod mdf;

use flate2::Compression;
use flate2::write::{DeflateEncoder, GzEncoder, ZlibEncoder};

/// Samples of every file.
pub const ROWS: usize = 40;

/// Time of a sample, s.
pub fn time(i: usize) -> f64 {
    i as f64 / 10.0
}
/// Forward acceleration, m/s^2; a multiple of 0.01.
pub fn accel(i: usize) -> f64 {
    i as f64 / 100.0
}
/// Yaw rate, rad/s; a power of two apart, so that f32 holds it.
pub fn rate(i: usize) -> f64 {
    i as f64 / 256.0
}
/// Latitude, deg.
pub fn latitude(i: usize) -> f64 {
    42.0 + i as f64 * 1e-5
}

/// Files that are one drive.
#[derive(Clone)]
pub struct Sample {
    /// What they are.
    pub name: &'static str,
    /// Name and bytes of each.
    pub files: Vec<(&'static str, Vec<u8>)>,
}

fn one(name: &'static str, file: &'static str, bytes: Vec<u8>) -> Sample {
    Sample { name, files: vec![(file, bytes)] }
}

/// Every sample.
pub fn all() -> Vec<Sample> {
    let bus = |name, file, bytes| Sample { name, files: vec![(file, bytes), ("bus.dbc", dbc())] };
    vec![
        one("csv", "log.csv", csv(0)),
        one("csv of a spreadsheet", "log.csv", spreadsheet()),
        one("nmea", "log.nmea", nmea()),
        one("gpx", "log.gpx", gpx()),
        one("vbo", "log.vbo", vbo()),
        one("kitti", "kitti.zip", zip(&kitti(), true)),
        one("npz", "log.npz", zip(&arrays(), false)),
        one("npy", "value.npy", npy(&[1.0, 2.0, 3.0], 1)),
        one("csv.gz", "log.csv.gz", gzip(&csv(0))),
        one("sensor logger", "phone.zip", zip(&sensor_logger(), true)),
        one("phyphox", "phyphox.zip", zip(&phyphox(), true)),
        one("openxc", "trace.json", openxc()),
        bus("dbc", "empty.asc", asc()),
        bus("blf", "bus.blf", blf()),
        bus("asc", "bus.asc", asc()),
        bus("candump", "bus.log", candump()),
        one("ulog", "log.ulg", ulog()),
        one("mcap", "log.mcap", mcap("")),
        one("mcap zstd", "log.mcap", mcap("zstd")),
        one("mcap lz4", "log.mcap", mcap("lz4")),
        one("mcap protobuf", "log.mcap", mcap_protobuf()),
        one("bag", "log.bag", bag(b"none")),
        one("bag lz4", "log.bag", bag(b"lz4")),
        one("bag bz2", "log.bag", bag(b"bz2")),
        one("mdf sorted", "log.mf4", mdf::measured(mdf::Form::Sorted)),
        one("mdf unsorted", "log.mf4", mdf::measured(mdf::Form::Unsorted)),
        one("mdf deflated", "log.mf4", mdf::measured(mdf::Form::Deflated)),
        one("mdf transposed", "log.mf4", mdf::measured(mdf::Form::Transposed)),
        one("mdf unfinished", "log.mf4", mdf::measured(mdf::Form::Unfinished)),
        bus("mdf bus", "bus.mf4", mdf::bus()),
    ]
}

/// CSV of the rows from `first` on.
pub fn csv(first: usize) -> Vec<u8> {
    let rows = (first..first + ROWS).map(|i| format!("{},{},{}\n", time(i), accel(i), rate(i)));
    format!("t,accel_x,gyro_z\n{}", rows.collect::<String>()).into_bytes()
}

/// The same as a spreadsheet in German writes it, with comments, times of day, quotes, blanks and a column of text.
pub fn spreadsheet() -> Vec<u8> {
    let row = |i: usize| {
        let blank = if i.is_multiple_of(5) { String::new() } else { format!("{:e}", rate(i)) };
        let text = format!("12:00:{:04.1};{:.2};{blank};\"word; \"\"{i}\"\"\nmore\"\r\n", time(i), accel(i));
        if i % 7 == 3 { format!("# comment \"{i}\r\n{text}") } else { text.replace("0.", "0,") }
    };
    let rows: String = (0..ROWS).map(row).collect();
    format!("\u{feff}# speed = 3\r\ntime;ax [g];gyro_z (rad/s);\"note\"\r\n{rows}").into_bytes()
}

pub fn nmea() -> Vec<u8> {
    let mut out = String::new();
    for i in 0..ROWS {
        let (lat, second) = (4200.0 + (latitude(i) - 42.0) * 60.0, time(i));
        let clock = format!("2359{:06.3}", 58.0 + second);
        let clock = if second >= 2.0 { format!("0000{:06.3}", second - 2.0) } else { clock };
        let date = if second >= 2.0 { "010124" } else { "311223" };
        for body in [
            format!("GNGGA,{clock},{lat:.5},N,07105.37703,W,1,11,0.96,8.1,M,-33.2,M,,"),
            format!("GNRMC,{clock},A,{lat:.5},N,07105.37703,W,{:.3},90.0,{date},,,A", 10.0 + accel(i)),
        ] {
            let sum = body.bytes().fold(0, |a, b| a ^ b);
            out += &format!("${body}*{sum:02X}\r\n");
        }
    }
    out.into_bytes()
}

pub fn gpx() -> Vec<u8> {
    let point = |i: usize| {
        format!(
            "<trkpt lat=\"{}\" lon=\"-71.0896\"><!-- > --><ele>{}</ele><time>2024-05-31T12:00:{:04.1}Z</time>\
             <extensions><gpxtpx:speed>{}</gpxtpx:speed></extensions></trkpt>\n",
            latitude(i),
            10 + i,
            time(i),
            accel(i)
        )
    };
    let points: String = (0..ROWS).map(point).collect();
    format!("<?xml version=\"1.0\"?>\n<gpx version=\"1.1\"><trk><trkseg>\n{points}</trkseg></trk></gpx>\n").into_bytes()
}

pub fn vbo() -> Vec<u8> {
    let mut out = String::from(
        "File created on 31/05/2024 @ 12:00\r\n\r\n[header]\r\nsatellites\r\ntime\r\n\r\n[channel units]\r\nrad/s\r\n\r\n\
         [column names]\r\nsats time lat long velocity heading height vert-vel Longacc YawRate\r\n\r\n[data]\r\n",
    );
    for i in 0..ROWS {
        out += &format!(
            "{:03} 1200{:05.2} +{:.5} +04265.37703 {:.3} 090.00 +0010.00 +0.36 {:+.3} {:+.8}\r\n",
            64 + 9,
            time(i),
            latitude(i) * 60.0,
            36.0,
            accel(i) / 10.0,
            rate(i)
        );
    }
    out.into_bytes()
}

type Files = Vec<(String, Vec<u8>)>;

pub fn kitti() -> Files {
    let mut files = Files::new();
    let mut stamps = String::new();
    for i in 0..ROWS {
        let mut row = vec![latitude(i), 8.4, 116.0, 0.01, 0.02, 1.5, 1.0, 2.0, 3.0, 0.1, 0.2, accel(i), 0.5, 9.8];
        row.extend([0.0, 0.0, 0.0, 0.001, 0.002, rate(i), 0.0, 0.0, 0.0, 0.1, 0.1, 4.0, 9.0, 6.0, 6.0, 6.0]);
        let text: Vec<String> = row.iter().map(f64::to_string).collect();
        files.push((format!("d/oxts/data/{i:010}.txt"), text.join(" ").into_bytes()));
        stamps += &format!("2011-09-26 13:02:{:012.9}\n", 20.0 + time(i));
    }
    files.push(("d/oxts/timestamps.txt".into(), stamps.into_bytes()));
    files
}

pub fn npy(values: &[f64], width: usize) -> Vec<u8> {
    let rows = values.len() / width;
    let shape = if width == 1 { format!("({rows},)") } else { format!("({rows}, {width})") };
    let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    while !(header.len() + 11).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut out = b"\x93NUMPY\x01\0".to_vec();
    out.extend((header.len() as u16).to_le_bytes());
    out.extend(header.as_bytes());
    values.iter().for_each(|v| out.extend(v.to_le_bytes()));
    out
}

pub fn arrays() -> Files {
    let times: Vec<f64> = (0..ROWS).map(time).collect();
    let accel: Vec<f64> = (0..ROWS).flat_map(|i| [accel(i), 0.0, -9.8]).collect();
    let gyro: Vec<f64> = (0..ROWS).flat_map(|i| [0.0, 0.0, rate(i)]).collect();
    vec![
        ("IMU/t.npy".into(), npy(&times, 1)),
        ("IMU/accelerometer.npy".into(), npy(&accel, 3)),
        ("IMU/gyro.npy".into(), npy(&gyro, 3)),
    ]
}

pub fn sensor_logger() -> Files {
    let file = |late: u64, value: &dyn Fn(usize) -> [f64; 3]| {
        let mut out = String::from("time,seconds_elapsed,z,y,x\n");
        for i in 0..ROWS {
            let [x, y, z] = value(i);
            let ns = 1_700_000_000_000_000_000 + 100_000_000 * i as u64 + late;
            out += &format!("{ns},{},{z},{y},{x}\n", time(i));
        }
        out.into_bytes()
    };
    let location = |i: usize| {
        format!("{},{},-71.0896,{}\n", 1_700_000_000_000_000_000 + 100_000_000 * i as u64, latitude(i), accel(i))
    };
    let location: String = (0..ROWS).map(location).collect();
    vec![
        ("TotalAcceleration.csv".into(), file(20_000_000, &|i| [accel(i), 0.0, 9.8])),
        ("Accelerometer.csv".into(), file(0, &|i| [accel(i), 0.0, 0.0])),
        ("Gyroscope.csv".into(), file(0, &|i| [0.0, 0.0, rate(i)])),
        ("Location.csv".into(), format!("time,latitude,longitude,speed\n{location}").into_bytes()),
        ("Metadata.csv".into(), b"version,device name\n3,phone\n".to_vec()),
    ]
}

pub fn phyphox() -> Files {
    let rows = |value: &dyn Fn(usize) -> f64| -> String {
        (0..ROWS).map(|i| format!("{},{},0.0E0,9.8E0\n", time(i), value(i))).collect()
    };
    let names = |n: &str, u: &str| format!("\"Time (s)\",\"{n} x ({u})\",\"{n} y ({u})\",\"{n} z ({u})\"\n");
    vec![
        ("Accelerometer.csv".into(), (names("Acceleration", "m/s^2") + &rows(&accel)).into_bytes()),
        ("Gyroscope.csv".into(), (names("Gyroscope", "rad/s") + &rows(&rate)).into_bytes()),
        (
            "meta/time.csv".into(),
            b"\"event\",\"experiment time\",\"system time\",\"system time text\"\n\
              \"START\",0.0E0,1.7E9,\"2023-11-14 23:13:20.000 UTC+01:00\"\n\"PAUSE\",4.0E0,1.700000004E9,\"2023-11-14 23:13:24.000 UTC+01:00\"\n"
                .to_vec(),
        ),
    ]
}

pub fn openxc() -> Vec<u8> {
    let row = |i: usize| {
        let at = 1_364_323_939.0 + time(i);
        format!("{{\"name\":\"vehicle_speed\",\"value\":{},\"timestamp\":{at:.6}}}\n", i)
            + &format!("{{\"name\":\"door\",\"value\":\"open\",\"timestamp\":{at:.6}}}\n")
    };
    (0..ROWS).map(row).collect::<String>().into_bytes()
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

pub fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// An archive of files, stored or deflated. Checksums are left at 0.
pub fn zip(files: &[(String, Vec<u8>)], deflated: bool) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in files {
        let packed = if deflated {
            let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        } else {
            bytes.clone()
        };
        let method: u16 = if deflated { 8 } else { 0 };
        let mut shared = Vec::new();
        shared.extend([20, 0, 0, 0]);
        shared.extend(method.to_le_bytes());
        shared.extend([0; 8]);
        shared.extend((packed.len() as u32).to_le_bytes());
        shared.extend((bytes.len() as u32).to_le_bytes());
        shared.extend((name.len() as u16).to_le_bytes());
        shared.extend([0, 0]);
        let at = out.len() as u32;
        out.extend(b"PK\x03\x04");
        out.extend(&shared);
        out.extend(name.as_bytes());
        out.extend(packed);
        directory.extend(b"PK\x01\x02\x14\0");
        directory.extend(&shared);
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (at, size) = (out.len() as u32, directory.len() as u32);
    out.extend(directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend((files.len() as u16).to_le_bytes());
    out.extend((files.len() as u16).to_le_bytes());
    out.extend(size.to_le_bytes());
    out.extend(at.to_le_bytes());
    out.extend([0, 0]);
    out
}

pub fn dbc() -> Vec<u8> {
    b"VERSION \"\"\n\nNS_ :\n\nBU_: XXX\n\nBO_ 291 KINEMATICS: 8 XXX\n \
      SG_ ACCEL_X : 7|16@0- (0.01,0) [0|0] \"m/s^2\" XXX\n SG_ YAW_RATE : 16|16@1- (0.00390625,0) [0|0] \"rad/s\" XXX\n\n\
      BO_ 2566844672 CCVS: 8 XXX\n SG_ SpeedMux M : 0|8@1+ (1,0) [0|0] \"\" XXX\n \
      SG_ SPEED m1 : 8|16@1+ (0.01,0) [0|0] \"km/h\" XXX\n SG_ OTHER m2 : 8|16@1+ (1,0) [0|0] \"\" XXX\n"
        .to_vec()
}

/// Frames of the bus: time in us, identifier, whether it is of 29 bits, bytes.
pub fn frames() -> Vec<(u64, u32, bool, [u8; 8])> {
    let mut out = Vec::new();
    for i in 0..ROWS {
        let a = (i as i16).to_be_bytes();
        let w = (i as i16).to_le_bytes();
        out.push((i as u64 * 100_000, 0x123, false, [a[0], a[1], w[0], w[1], 0, 0, 0, 0]));
        let v = (3600 + i as u16).to_le_bytes();
        out.push((i as u64 * 100_000 + 50, 0x18fe_f100, true, [1 + (i % 2) as u8, v[0], v[1], 0, 0, 0, 0, 0]));
    }
    out
}

pub fn asc() -> Vec<u8> {
    let mut out =
        String::from("date Fri May 31 12:00:00.000 2024\nbase hex  timestamps absolute\ninternal events logged\n");
    for (us, id, extended, data) in frames() {
        let bytes: Vec<String> = data.iter().map(|b| format!("{b:02X}")).collect();
        let mark = if extended { "x" } else { "" };
        out += &format!(" {}.{:06} 1  {id:X}{mark}  Rx   d 8 {}\n", us / 1_000_000, us % 1_000_000, bytes.join(" "));
    }
    out.into_bytes()
}

pub fn candump() -> Vec<u8> {
    let mut out = String::new();
    for (us, id, extended, data) in frames() {
        let bytes: String = data.iter().map(|b| format!("{b:02X}")).collect();
        let id = if extended { format!("{id:08X}") } else { format!("{id:03X}") };
        out += &format!("({}.{:06}) can0 {id}#{bytes}\n", 1_717_156_800 + us / 1_000_000, us % 1_000_000);
    }
    out.into_bytes()
}

pub fn blf() -> Vec<u8> {
    let mut inner = Vec::new();
    for (us, id, extended, data) in frames() {
        inner.extend(b"LOBJ");
        inner.extend(32u16.to_le_bytes());
        inner.extend(1u16.to_le_bytes());
        inner.extend(48u32.to_le_bytes());
        inner.extend(86u32.to_le_bytes());
        inner.extend(2u32.to_le_bytes());
        inner.extend([0; 4]);
        inner.extend((us * 1000).to_le_bytes());
        inner.extend([1, 0, 0, 8]);
        inner.extend((id | u32::from(extended) << 31).to_le_bytes());
        inner.extend(data);
    }
    let mut out = b"LOGG".to_vec();
    out.extend(144u32.to_le_bytes());
    out.extend([0; 32]);
    for field in [2024u16, 5, 5, 31, 12, 0, 0, 0] {
        out.extend(field.to_le_bytes());
    }
    out.resize(144, 0);
    // Two containers that cut an object in two.
    for part in inner.chunks(inner.len() / 2 + 7) {
        let packed = zlib(part);
        out.extend(b"LOBJ");
        out.extend(16u16.to_le_bytes());
        out.extend(1u16.to_le_bytes());
        out.extend((32 + packed.len() as u32).to_le_bytes());
        out.extend(10u32.to_le_bytes());
        out.extend(2u16.to_le_bytes());
        out.extend([0; 6]);
        out.extend((part.len() as u32).to_le_bytes());
        out.extend([0; 4]);
        out.extend(&packed);
        out.extend(vec![0; packed.len() % 4]);
    }
    out
}

pub fn ulog() -> Vec<u8> {
    let mut out = b"ULog\x01\x12\x35\x01".to_vec();
    out.extend(5_000_000u64.to_le_bytes());
    let mut message = |kind: u8, body: &[u8]| {
        out.extend((body.len() as u16).to_le_bytes());
        out.push(kind);
        out.extend(body);
    };
    message(b'B', &[0; 40]);
    message(b'F', b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint8_t[4] _padding0;float[3] accelerometer_m_s2;inner i;");
    message(b'F', b"inner:int16_t a;char[2] text;");
    message(b'A', b"\0\x07\0sensor_combined");
    for i in 0..ROWS {
        let mut body = vec![7, 0];
        body.extend((5_000_000 + 100_000 * i as u64).to_le_bytes());
        [0.0, 0.0, rate(i)].iter().for_each(|v| body.extend((*v as f32).to_le_bytes()));
        body.extend([9; 4]);
        [accel(i), 0.0, -9.8].iter().for_each(|v| body.extend((*v as f32).to_le_bytes()));
        body.extend((-(i as i16)).to_le_bytes());
        body.extend(b"ab");
        message(b'D', &body);
    }
    message(b'O', &[5, 0]);
    out
}

const IMU: &str = "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
    geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
    geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n\
    ================\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n\
    ================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ================\nMSG: std_msgs/Header\n";

fn imu(i: usize, ros1: bool) -> Vec<u8> {
    let mut out = if ros1 { (i as u32).to_le_bytes().to_vec() } else { vec![0, 1, 0, 0] };
    let ns = i as u64 * 100_000_000;
    out.extend((1_700_000_000 + (ns / 1_000_000_000) as u32).to_le_bytes());
    out.extend(((ns % 1_000_000_000) as u32).to_le_bytes());
    out.extend(4u32.to_le_bytes());
    out.extend(b"imu\0");
    if !ros1 {
        out.resize(4 + (out.len() - 4).next_multiple_of(8), 0);
    }
    let mut numbers = vec![0.0; 37];
    (numbers[15], numbers[25]) = (rate(i), accel(i));
    numbers.iter().for_each(|v: &f64| out.extend(v.to_le_bytes()));
    out
}

fn string(out: &mut Vec<u8>, text: &[u8]) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text);
}

fn mcap_record(out: &mut Vec<u8>, kind: u8, body: &[u8]) {
    out.push(kind);
    out.extend((body.len() as u64).to_le_bytes());
    out.extend(body);
}

/// An LZ4 frame of one block of literals only.
fn lz4(bytes: &[u8]) -> Vec<u8> {
    let mut block = vec![0xf0];
    let mut rest = bytes.len() - 15;
    while rest >= 255 {
        block.push(255);
        rest -= 255;
    }
    block.push(rest as u8);
    block.extend(bytes);
    let mut out = vec![0x04, 0x22, 0x4d, 0x18, 0x60, 0x40, 0];
    out.extend((block.len() as u32).to_le_bytes());
    out.extend(block);
    out.extend([0; 4]);
    out
}

pub fn mcap(compression: &str) -> Vec<u8> {
    let mut inner = Vec::new();
    let mut schema = 1u16.to_le_bytes().to_vec();
    string(&mut schema, b"sensor_msgs/msg/Imu");
    string(&mut schema, b"ros2msg");
    let text = format!("{IMU}builtin_interfaces/Time stamp\nstring frame_id\n");
    string(&mut schema, text.as_bytes());
    mcap_record(&mut inner, 3, &schema);
    for (id, schema, topic, encoding) in [(0u16, 1u16, "/imu", "cdr"), (1, 0, "/speed", "json")] {
        let mut channel = id.to_le_bytes().to_vec();
        channel.extend(schema.to_le_bytes());
        string(&mut channel, topic.as_bytes());
        string(&mut channel, encoding.as_bytes());
        channel.extend([0; 4]);
        mcap_record(&mut inner, 4, &channel);
    }
    for i in 0..ROWS {
        let json = format!("{{\"speed\": {}, \"list\": [1], \"ok\": true}}", accel(i)).into_bytes();
        for (id, data) in [(0u16, imu(i, false)), (1, json)] {
            let at = 1_700_000_000_000_000_000 + 100_000_000 * i as u64 + 3_000_000;
            let mut message = id.to_le_bytes().to_vec();
            message.extend((i as u32).to_le_bytes());
            message.extend(at.to_le_bytes());
            message.extend(at.to_le_bytes());
            message.extend(data);
            mcap_record(&mut inner, 5, &message);
        }
    }
    let packed = match compression {
        "zstd" => ruzstd::encoding::compress_to_vec(inner.as_slice(), ruzstd::encoding::CompressionLevel::Fastest),
        "lz4" => lz4(&inner),
        _ => inner.clone(),
    };
    let mut chunk = vec![0; 16];
    chunk.extend((inner.len() as u64).to_le_bytes());
    chunk.extend([0; 4]);
    string(&mut chunk, compression.as_bytes());
    chunk.extend((packed.len() as u64).to_le_bytes());
    chunk.extend(packed);
    let mut out = b"\x89MCAP0\r\n".to_vec();
    mcap_record(&mut out, 1, &[0; 8]);
    mcap_record(&mut out, 6, &chunk);
    mcap_record(&mut out, 15, &[0; 4]);
    mcap_record(&mut out, 2, &[0; 20]);
    out.extend(b"\x89MCAP0\r\n");
    out
}

/// A field of a protobuf message that holds bytes.
fn proto(number: u8, content: &[u8]) -> Vec<u8> {
    let length = [(content.len() & 127) as u8 | 128, (content.len() >> 7) as u8];
    [&[number << 3 | 2], &length[..], content].concat()
}

/// Messages `p.M` of a double `speed` and of a message `v` with a double `x` and a sint32 `n`.
pub fn mcap_protobuf() -> Vec<u8> {
    let field = |name: &str, id: u8, kind: u8, message: &str| {
        [proto(1, name.as_bytes()), vec![3 << 3, id, 4 << 3, 1, 5 << 3, kind], proto(6, message.as_bytes())].concat()
    };
    let v = [proto(1, b"V"), proto(2, &field("x", 1, 1, "")), proto(2, &field("n", 2, 17, ""))].concat();
    let m = [proto(1, b"M"), proto(2, &field("speed", 1, 1, "")), proto(2, &field("v", 3, 11, ".p.V"))].concat();
    let file = [proto(2, b"p"), proto(4, &v), proto(4, &m)].concat();
    let mut out = b"\x89MCAP0\r\n".to_vec();
    mcap_record(&mut out, 1, &[0; 8]);
    let mut schema = 1u16.to_le_bytes().to_vec();
    string(&mut schema, b"p.M");
    string(&mut schema, b"protobuf");
    string(&mut schema, &proto(1, &file));
    mcap_record(&mut out, 3, &schema);
    let mut channel = [0u16.to_le_bytes(), 1u16.to_le_bytes()].concat();
    string(&mut channel, b"/can");
    string(&mut channel, b"protobuf");
    channel.extend([0; 4]);
    mcap_record(&mut out, 4, &channel);
    for i in 0..ROWS {
        let double = |number: u8, value: f64| [&[number << 3 | 1][..], &value.to_le_bytes()].concat();
        let at = 1_700_000_000_000_000_000 + 100_000_000 * i as u64;
        let mut message = [&[0; 2][..], &(i as u32).to_le_bytes(), &at.to_le_bytes(), &at.to_le_bytes()].concat();
        message.extend([double(1, accel(i)), proto(3, &[double(1, rate(i)), vec![2 << 3, i as u8]].concat())].concat());
        mcap_record(&mut out, 5, &message);
    }
    mcap_record(&mut out, 15, &[0; 4]);
    out.extend(b"\x89MCAP0\r\n");
    out
}

fn bag_record(out: &mut Vec<u8>, fields: &[(&str, &[u8])], data: &[u8]) {
    let mut header = Vec::new();
    for (name, value) in fields {
        header.extend((name.len() as u32 + 1 + value.len() as u32).to_le_bytes());
        header.extend(name.as_bytes());
        header.push(b'=');
        header.extend(*value);
    }
    string(out, &header);
    string(out, data);
}

pub fn bag(compression: &[u8]) -> Vec<u8> {
    let mut inner = Vec::new();
    let mut connection = Vec::new();
    let text = format!("{IMU}uint32 seq\ntime stamp\nstring frame_id\n");
    for (name, value) in [("type", "sensor_msgs/Imu"), ("message_definition", text.as_str())] {
        string(&mut connection, format!("{name}={value}").as_bytes());
    }
    bag_record(&mut inner, &[("op", &[7]), ("conn", &[0; 4]), ("topic", b"/imu")], &connection);
    for i in 0..ROWS {
        let mut time = (1_700_000_000 + i as u32 / 10).to_le_bytes().to_vec();
        time.extend((i as u32 % 10 * 100_000_000 + 5_000_000).to_le_bytes());
        bag_record(&mut inner, &[("op", &[2]), ("conn", &[0; 4]), ("time", &time)], &imu(i, true));
    }
    let packed = match compression {
        b"lz4" => lz4(&inner),
        b"bz2" => bzip2::pack(&inner),
        _ => inner.clone(),
    };
    let mut out = b"#ROSBAG V2.0\n".to_vec();
    bag_record(&mut out, &[("op", &[3]), ("index_pos", &[0; 8])], &[b' '; 30]);
    let size = (inner.len() as u32).to_le_bytes();
    bag_record(&mut out, &[("op", &[5]), ("compression", compression), ("size", &size)], &packed);
    bag_record(&mut out, &[("op", &[4]), ("ver", &[1, 0, 0, 0])], &[0; 12]);
    out
}
