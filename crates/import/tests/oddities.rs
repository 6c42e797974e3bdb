//! What is odd in real recordings is found and said when they are opened, where they are there.
//!
//! What is expected of each log is what the notes on the recordings list, as far as the recording itself can reveal it. It
//! cannot: the bus log does not hold the sources of copied frames; a log of an aircraft says itself that it is one.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use drivescope_import::{Examination, OpenReport, Opening, SeekSource, Source, examine_log, open_drawn, open_log};

fn shared(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(path);
    if found.exists() {
        return Some(found);
    }
    println!("SKIPPED: shared/data/{path} is not here");
    None
}

fn read(paths: &[PathBuf]) -> drivescope_import::Log {
    let source = |path: &PathBuf| -> Box<dyn Source> {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        Box::new(SeekSource::new(&name, std::fs::File::open(path).unwrap()).unwrap())
    };
    let mut opening = Opening::new(paths.iter().map(source).collect()).unwrap();
    while opening.step().unwrap() {}
    opening.finish().unwrap()
}

fn examined(paths: &[PathBuf]) -> Examination {
    examine_log(read(paths)).unwrap_or_else(|e| panic!("{e}"))
}

fn opened(paths: &[PathBuf]) -> OpenReport {
    let (_, report) = open_log(read(paths), None).unwrap_or_else(|e| panic!("{e}"));
    for u in &report.used {
        println!("{:12} <- {:28} {}: {}", u.signal, u.column, u.conversion, u.why);
    }
    report.notes.iter().for_each(|n| println!("note: {n}"));
    for f in &report.findings {
        println!("{:?}: {}{}", f.weight, f.text, if f.correction.is_some() { " [correction]" } else { "" });
    }
    report
}

/// Raw column and sign of a signal.
fn of<'f>(found: &'f Examination, signal: &str) -> (&'f str, f64) {
    found.mapping.signals.get(signal).map_or(("none", 0.0), |s| (s.column.as_str(), s.scale))
}

/// A log: its files, and for each oddity some words that belong into one sentence.
type Log = (&'static [&'static str], &'static [&'static [&'static str]]);

const LOGS: [Log; 8] = [
    (
        &["comma2k19_rav4/canonical.csv"],
        &[
            // Places in radians, which the names do not say.
            &["`gnss_lat`", "read as rad"],
            // The phone's mount, wheels that read low, a road without a turn.
            &["imu leans", "pitch -"],
            &["the car's speeds read 0.", "% low"],
            &["stays within", "which way is right"],
            // The magnetometer is in uT, and far from the Earth's field.
            &["the magnetometer reads", "an offset of"],
            // The bus's own yaw rate and accelerations.
            &["`can_yaw_rate` follows", "correlation 0."],
            &["`can_accel_x` follows", "correlation"],
        ],
    ),
    (
        &["comma2k19_rav4/comma2k19_rav4_rawcan.blf", "comma2k19_rav4/toyota_rav4_2019.dbc"],
        &[
            // Positive when braking.
            &["ACCEL_X", "opposite sign", "d(speed)/dt", "correlation -0."],
            // Positive to the left.
            &["YAW_RATE", "opposite sign"],
            &["`YAW_RATE` comes in steps of 0.244 deg/s"],
        ],
    ),
    (
        &["css_canedge_mf4/gps_imu_obd2_3BA199E2_165_00000002-60FEB8E3.MF4", "css_canedge_mf4/canmod-gps.dbc"],
        &[
            &["accel_x is -`AccelerationY`", "accel_y is +`AccelerationZ`", "accel_z is -`AccelerationX`"],
            &["`AccelerationX`", "steps of 0.125"],
            &["`AngularRateX`", "steps of 0.250 deg/s"],
        ],
    ),
    (
        &["css_canedge_mf4/gps_imu_obd2_3BA199E2_165_00000001-60FEB68B.MF4", "css_canedge_mf4/canmod-gps.dbc"],
        &[&["`Altitude` reads -5400", "no value"], &["`Roll`", "is 0 in all"]],
    ),
    (&["vn100_circles/circle_data_0_imu.csv"], &[&["hard iron of"], &["the magnetometer states no unit: taken as T"]]),
    (&["vn100_circles/car2/data_going_in_circles.csv"], &[&["-10.1", "not calibrated"], &["hard iron of"]]),
    (&["clearpath_bag/test1.bag"], &[&["accel_z is -`/imu/data.linear_acceleration.y`"]]),
    (&["clearpath_bag/husky_test1_ros2.mcap"], &[&["accel_z is -`/imu/data.linear_acceleration.y`"]]),
];

#[test]
fn every_oddity_that_a_recording_reveals_is_said_when_it_is_opened() {
    let mut missing = Vec::new();
    for (files, oddities) in LOGS {
        let paths: Option<Vec<PathBuf>> = files.iter().map(|f| shared(f)).collect();
        let Some(paths) = paths else { continue };
        println!("== {}", files[0]);
        let report = opened(&paths);
        let said: Vec<&String> = report.notes.iter().chain(report.findings.iter().map(|f| &f.text)).collect();
        for words in oddities {
            if !said.iter().any(|s| words.iter().all(|w| s.contains(w))) {
                missing.push(format!("{}: {words:?}", files[0]));
            }
        }
    }
    assert!(missing.is_empty(), "not said: {missing:#?}");
}

/// Catches a finding that nobody sees: the page shows warnings, notes, and what was found beside the table of columns.
#[test]
fn whatever_is_found_is_told_in_a_warning_a_note_or_the_table_of_columns() {
    for (files, _) in LOGS {
        let paths: Option<Vec<PathBuf>> = files.iter().map(|f| shared(f)).collect();
        let Some(paths) = paths else { continue };
        let (_, report, examined) = open_drawn(read(&paths), None, 80).unwrap_or_else(|e| panic!("{e}"));
        let examined = examined.expect("logs of this size are examined when they are opened");
        assert!(report.is_examined && examined.pictures.len() == examined.found.columns.len());
        let table = examined.found.findings.iter().map(|f| &f.text);
        let told: Vec<&String> = report.warnings.iter().map(|w| &w.message).chain(&report.notes).chain(table).collect();
        let untold: Vec<&String> = report.findings.iter().map(|f| &f.text).filter(|t| !told.contains(t)).collect();
        assert!(untold.is_empty(), "{}: {untold:#?}", files[0]);
    }
}

#[test]
fn the_motorway_phone_leans_on_its_mount_and_its_places_are_radians() {
    let Some(path) = shared("comma2k19_rav4/canonical.csv") else { return };
    let found = examined(&[path]);
    assert!(found.names_believed);
    assert_eq!(found.mapping.signals["gnss_lat"].unit.as_deref(), Some("rad"));
    let imu = found.mounts.iter().find(|m| m.channel == "imu").unwrap();
    // README: about -3.8 deg; the road's own mean grade is taken out only as far as the altitude tells it.
    assert!((imu.mount.pitch_deg.abs() - 3.8).abs() < 1.0, "{imu:?}");
}

#[test]
fn the_bus_loggers_sensor_stands_on_edge_and_the_correction_puts_it_right() {
    let Some(root) = shared("css_canedge_mf4") else { return };
    let mf4 = root.join("gps_imu_obd2_3BA199E2_165_00000002-60FEB8E3.MF4");
    let paths = [mf4, root.join("canmod-gps.dbc")];
    let found = examined(&paths);
    let columns = ["accel_x", "accel_y", "accel_z"].map(|s| of(&found, s));
    let ends = columns.map(|(c, sign)| (c.chars().last().unwrap_or('?'), sign));
    assert_eq!(ends, [('Y', -1.0), ('Z', 1.0), ('X', -1.0)], "X up, forward -Y, right +Z");
    let report = opened(&paths);
    let mut mapping = report.mapping.clone();
    report.findings.iter().filter_map(|f| f.correction.as_ref()).for_each(|c| mapping.correct(c));
    let (drive, again) = open_log(read(&paths), Some(&mapping)).unwrap();
    let z = drive.imu.column("accel_z").unwrap();
    let mean = z.iter().sum::<f64>() / z.len() as f64;
    assert!((mean + 9.7).abs() < 0.2, "{mean}");
    let left: Vec<&String> = again.findings.iter().filter(|f| f.correction.is_some()).map(|f| &f.text).collect();
    assert!(left.is_empty(), "what was corrected is not proposed again: {left:#?}");
}

#[test]
fn the_three_files_of_the_bus_logger_tell_its_mounting_too() {
    // The first one repeats an old place for 34 s; then its receiver finds itself 51 m away. Taken for a change of speed, that
    // jump hid which way forward is, and the correction left the log without a forward acceleration.
    let Some(root) = shared("css_canedge_mf4") else { return };
    let parts = ["1-60FEB68B", "2-60FEB8E3", "3-60FEBB3B"];
    let mut paths: Vec<PathBuf> =
        parts.iter().map(|p| root.join(format!("gps_imu_obd2_3BA199E2_165_0000000{p}.MF4"))).collect();
    paths.push(root.join("canmod-gps.dbc"));
    let report = opened(&paths);
    let mut mapping = report.mapping.clone();
    report.findings.iter().filter_map(|f| f.correction.as_ref()).for_each(|c| mapping.correct(c));
    for stem in ["accel", "gyro"] {
        let read = ["x", "y", "z"].map(|axis| {
            let source = &mapping.signals[&format!("{stem}_{axis}")];
            (source.column.chars().last().unwrap_or('?'), source.scale)
        });
        assert_eq!(read, [('Y', -1.0), ('Z', 1.0), ('X', -1.0)], "{stem}: X up, forward -Y, right +Z");
    }
}

#[test]
fn altitude_of_minus_5400_m_is_no_altitude() {
    let Some(root) = shared("css_canedge_mf4") else { return };
    let mf4 = root.join("gps_imu_obd2_3BA199E2_165_00000001-60FEB68B.MF4");
    let (drive, report) = open_log(read(&[mf4, root.join("canmod-gps.dbc")]), None).unwrap();
    assert_eq!(report.mapping.signals["gnss_alt"].blank, [-5400.0]);
    let altitudes = drive.gnss.column("alt").or_else(|| drive.gnss.column("gnss_alt")).unwrap();
    assert!(altitudes.iter().any(|a| a.is_nan()) && !altitudes.contains(&-5400.0));
}
