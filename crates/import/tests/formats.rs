//! Every format gives back the drive that was written, whole or cut into pieces.

#![allow(clippy::unwrap_used)]

mod samples;

use drivescope_drive::drive::Drive;
use drivescope_import::{ImportError, Log, MemorySource, OpenReport, Opening, ReadError, Source, open_log};
use samples::{ROWS, accel, latitude, rate, time};

/// A source that gives its bytes in pieces of one size only: readers may not depend on where a slice ends.
struct Pieces(MemorySource, usize);

impl Source for Pieces {
    fn name(&self) -> &str {
        self.0.name()
    }
    fn len(&self) -> u64 {
        self.0.len()
    }
    fn read_at(&mut self, offset: u64, buf: &mut [u8]) -> Result<usize, ReadError> {
        // Only the large reads of slices are cut: structures are read whole.
        let most = if buf.len() >= 1 << 20 { self.1 } else { buf.len() };
        self.0.read_at(offset, &mut buf[..most])
    }
}

fn read(files: &[(&str, Vec<u8>)], piece: usize) -> Result<Log, ImportError> {
    let source = |(name, bytes): &(&str, Vec<u8>)| -> Box<dyn Source> {
        Box::new(Pieces(MemorySource::new(name, bytes.clone()), piece))
    };
    let mut opening = Opening::new(files.iter().map(source).collect())?;
    while opening.step()? {}
    assert_eq!(opening.progress().fraction, 1.0);
    opening.finish()
}

fn open(files: &[(&str, Vec<u8>)]) -> (Drive, OpenReport) {
    open_log(read(files, 1 << 20).unwrap(), None).unwrap()
}

fn sample(name: &str) -> samples::Sample {
    samples::all().into_iter().find(|s| s.name == name).unwrap()
}

fn near(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance
}

#[test]
fn every_sample_is_the_same_in_pieces_of_any_size() {
    // Would catch a reader that loses bytes between slices.
    for sample in samples::all() {
        let whole = read(&sample.files, 1 << 20).unwrap_or_else(|e| panic!("{}: {e}", sample.name));
        for piece in [1, 7, 1000] {
            let cut = read(&sample.files, piece).unwrap_or_else(|e| panic!("{}: {e}", sample.name));
            // NaN equals nothing: what is compared is what would be printed.
            assert_eq!(
                format!("{:?}", cut.tables),
                format!("{:?}", whole.tables),
                "{} in pieces of {piece}",
                sample.name
            );
        }
    }
}

#[test]
fn inertial_samples_come_back_from_every_format_that_has_them() {
    // Signs: the phones' and robots' z axes point up, those of the others are taken as they are.
    for (name, turned) in [
        ("csv", 1.0),
        ("csv.gz", 1.0),
        ("npz", 1.0),
        ("ulog", 1.0),
        ("mcap", -1.0),
        ("mcap zstd", -1.0),
        ("mcap lz4", -1.0),
        ("bag", -1.0),
        ("bag lz4", -1.0),
        ("bag bz2", -1.0),
        ("kitti", -1.0),
        ("mdf sorted", 1.0),
        ("mdf unsorted", 1.0),
        ("mdf deflated", 1.0),
        ("mdf transposed", 1.0),
        ("mdf unfinished", 1.0),
        ("mdf bus", 1.0),
        ("blf", 1.0),
        ("asc", 1.0),
        ("candump", 1.0),
    ] {
        let (drive, report) = open(&sample(name).files);
        assert_eq!(drive.imu.len(), ROWS, "{name}: {report:?}");
        for i in 0..ROWS {
            let (t, imu) = drive.imu.at(i);
            assert!(near(t - drive.imu.at(0).0, time(i), 1e-9), "{name}, row {i}: t {t}");
            assert!(near(imu.accel_x, accel(i), 1e-7), "{name}, row {i}: {imu:?}");
            assert!(near(imu.gyro_z, turned * rate(i), 1e-9), "{name}, row {i}: {imu:?}");
        }
    }
}

#[test]
fn fixes_come_back_with_their_units() {
    for name in ["nmea", "gpx", "vbo", "kitti"] {
        let (drive, report) = open(&sample(name).files);
        assert_eq!(drive.gnss.len(), ROWS, "{name}: {report:?}");
        for i in 0..ROWS {
            let (t, fix) = drive.gnss.at(i);
            assert!(near(t - drive.gnss.at(0).0, time(i), 1e-9), "{name}, row {i}: t {t}");
            // Five decimals of a minute are 2e-7 deg.
            assert!(near(fix.lat.to_degrees(), latitude(i), 2e-7), "{name}, row {i}: {fix:?}");
        }
    }
    let (drive, report) = open(&sample("nmea").files);
    let (_, fix) = drive.gnss.at(5);
    assert!(near(fix.speed, (10.0 + accel(5)) * 1852.0 / 3600.0, 1e-3) && near(fix.alt, 8.1, 1e-12), "{fix:?}");
    assert!(near(fix.lon.to_degrees(), -(71.0 + 5.37703 / 60.0), 1e-9), "{fix:?}");
    assert_eq!(report.epoch.as_deref(), Some("2023-12-31T23:59:58Z"), "midnight and the year's end are passed");
    let (drive, _) = open(&sample("vbo").files);
    let (_, fix) = drive.gnss.at(5);
    assert!(near(fix.lon.to_degrees(), -71.0896, 1e-4), "west is positive in VBO: {fix:?}");
    assert!(near(fix.speed, 10.0, 1e-12) && fix.satellites == 9.0 && near(fix.v_down, -0.1, 1e-12), "{fix:?}");
    assert!(near(drive.imu.at(5).1.gyro_z, rate(5), 1e-8), "units of further channels are listed at the end");
}

#[test]
fn sensors_of_a_phone_become_one_inertial_sample() {
    for name in ["sensor logger", "phyphox"] {
        let (drive, report) = open(&sample(name).files);
        assert_eq!(drive.imu.len(), ROWS, "{name}: {report:?}");
        let (_, imu) = drive.imu.at(10);
        // The clock of the accelerometer is 20 ms late in one of them: 0.02 s of 0.1 m/s^3.
        let late = if name == "phyphox" { 0.0 } else { 0.002 };
        assert!(near(imu.accel_x, accel(10) - late, 1e-6), "{name}: {imu:?}");
        assert!(near(imu.accel_z, -9.8, 1e-9), "{name}: z points up on the phone: {imu:?}");
        assert!(report.epoch.as_deref().is_some_and(|e| e.starts_with("2023-11-14T22:13:20")), "{report:?}");
    }
    let (drive, _) = open(&sample("sensor logger").files);
    assert_eq!(drive.gnss.len(), ROWS);
}

/// Catches a field that is found but read as another number: sint32 is zigzag, a message within a message has its own.
#[test]
fn messages_of_json_and_protobuf_hold_the_numbers_that_were_written() {
    let values = |sample_name: &str, column: &str| {
        let log = read(&sample(sample_name).files, 1 << 20).unwrap();
        let names: Vec<String> = log.tables.iter().flat_map(|t| t.columns.iter().map(|c| c.name.clone())).collect();
        let found = log.tables.iter().find_map(|t| t.column(column).map(|c| c.values.clone()));
        found.unwrap_or_else(|| panic!("{sample_name} has no {column}: {names:?}"))
    };
    let unzigzag = |i: usize| if i.is_multiple_of(2) { i as f64 / 2.0 } else { -((i + 1) as f64) / 2.0 };
    for (name, column, written) in [
        ("mcap", "/speed.speed", &accel as &dyn Fn(usize) -> f64),
        ("mcap zstd", "/speed.speed", &accel),
        ("mcap protobuf", "/can.speed", &accel),
        ("mcap protobuf", "/can.v.x", &rate),
        ("mcap protobuf", "/can.v.n", &unzigzag),
    ] {
        let expected: Vec<f64> = (0..ROWS).map(written).collect();
        assert_eq!(values(name, column), expected, "{name}, {column}");
    }
}

#[test]
fn multiplexed_signals_of_29_bit_frames_are_there_every_other_time() {
    let (drive, _) = open(&sample("blf").files);
    assert_eq!(drive.wheels.len(), ROWS / 2);
    assert!(near(drive.wheels.at(1).1.speed, 36.02 / 3.6, 1e-9));
}

#[test]
fn a_bus_log_without_its_database_says_what_is_missing() {
    let files = vec![sample("asc").files.remove(0)];
    let error = read(&files, 1 << 20).unwrap_err().to_string();
    assert!(error.contains("found 80 frames of 2 identifiers (123, 18FEF100, ..) and no DBC database"), "{error}");
    let error = read(&[("bus.dbc", samples::dbc())], 1 << 20).unwrap_err().to_string();
    assert!(error.contains("open it together with a log"), "{error}");
}

#[test]
fn the_order_of_a_log_and_its_database_does_not_matter() {
    let mut files = sample("candump").files;
    let first = open(&files).0;
    files.reverse();
    assert_eq!(first.imu.len(), open(&files).0.imu.len());
}

#[test]
fn consecutive_parts_are_joined_in_the_order_of_their_times() {
    let (drive, report) = open(&[("b.csv", samples::csv(ROWS)), ("a.csv", samples::csv(0))]);
    assert_eq!(drive.imu.len(), 2 * ROWS, "{report:?}");
    assert!(near(drive.imu.at(2 * ROWS - 1).0, time(2 * ROWS - 1), 1e-12));
    assert_eq!(report.name, "b.csv and a.csv");
}

#[test]
fn parts_that_begin_at_the_same_time_are_put_behind_each_other_and_that_is_said() {
    let (drive, report) = open(&[("a.csv", samples::csv(0)), ("b.csv", samples::csv(0))]);
    assert_eq!(drive.imu.len(), 2 * ROWS);
    assert!(report.notes.iter().any(|n| n.contains("taken as its continuation")), "{:?}", report.notes);
}

#[test]
fn sensors_of_several_files_are_merged_on_time() {
    // The receiver's clock is absolute, that of the inertial log is not: it begins with the other, which is said.
    let (drive, report) = open(&[("imu.csv", samples::csv(0)), ("log.gpx", samples::gpx())]);
    assert_eq!((drive.imu.len(), drive.gnss.len()), (ROWS, ROWS));
    assert!(near(drive.imu.at(0).0, drive.gnss.at(0).0, 1e-9));
    assert!(report.notes.iter().any(|n| n.contains("unknown start")), "{:?}", report.notes);
}

#[test]
fn files_of_several_days_are_not_one_drive() {
    let log = |day: u32| {
        format!("time,ax [g]\n2024-05-{day:02}T10:00:00Z,0.1\n2024-05-{day:02}T10:00:01Z,0.2\n").into_bytes()
    };
    let opened = |a, b| open_log(read(&[("b.csv", log(b)), ("a.csv", log(a))], 1 << 20).unwrap(), None);
    let error = opened(3, 7).unwrap_err().to_string();
    assert!(error.starts_with("b.csv begins 4.0 days after the end of a.csv"), "{error}");
    assert_eq!(opened(3, 3).unwrap().0.imu.len(), 2);
}

#[test]
fn a_table_of_raw_ranges_belongs_to_the_log_beside_it() {
    let raw =
        |t: u32| format!("t,prn,sat_x,sat_y,sat_z,pr\n{t},3,1,2,3,7\n{t},9,1,2,3,8\n{t}.5,3,1,2,3,9\n").into_bytes();
    let together = |files: &[(&str, Vec<u8>)]| open_log(read(files, 1 << 20).unwrap(), None);
    let (drive, report) = together(&[("raw.csv", raw(0)), ("log.csv", samples::csv(0))]).unwrap();
    assert_eq!((drive.imu.len(), drive.raw_gnss.len(), drive.raw_gnss.at(0).1.len()), (ROWS, 2, 2));
    assert!(report.name == "log.csv" && report.notes.iter().any(|n| n.contains("raw.csv: raw ranges")), "{report:?}");
    let (drive, report) = together(&[("raw.csv", raw(0))]).unwrap();
    assert_eq!(
        (drive.imu.len(), drive.raw_gnss.len(), report.name.as_str()),
        (0, 2, "raw.csv"),
        "ranges alone are a drive"
    );
    for (files, expected) in [
        (
            vec![("raw.csv", raw(0)), ("b.csv", raw(0)), ("log.csv", samples::csv(0))],
            "expected one table of raw ranges",
        ),
        (vec![("raw.csv", raw(900)), ("log.csv", samples::csv(0))], "raw.csv, column `t`: expected times within those"),
    ] {
        let error = together(&files).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn the_database_that_decoded_the_frames_is_named() {
    let (_, report) = open(&sample("asc").files);
    assert!(report.notes.iter().any(|n| n.contains("decoded as `") && n.contains(".dbc`")), "{:?}", report.notes);
}

#[test]
fn a_log_that_is_cut_off_is_read_as_far_as_it_goes() {
    for name in ["nmea", "gpx", "vbo", "blf", "asc", "candump", "ulog", "mcap", "bag", "mdf unfinished", "csv.gz"] {
        let mut files = sample(name).files;
        let whole = files[0].1.len();
        files[0].1.truncate(if name == "mcap" || name == "bag" || name == "blf" { whole - 40 } else { whole * 4 / 5 });
        match read(&files, 1 << 20) {
            Ok(log) => assert!(log.tables.iter().any(|t| t.rows > ROWS / 4), "{name}"),
            // What is packed in one piece cannot be read in part.
            Err(error) => assert!(matches!(name, "mcap" | "bag" | "blf"), "{name}: {error}"),
        }
    }
}
