//! Real recordings of every format open, and those of one drive in several formats agree, where they are there.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use drivescope_drive::drive::Drive;
use drivescope_import::{Format, ImportError, Log, OpenReport, Opening, SeekSource, Source, Table, open_log};

fn shared(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(path);
    if found.exists() {
        return Some(found);
    }
    println!("SKIPPED: shared/{path} is not here");
    None
}

fn read(paths: &[PathBuf]) -> Result<Log, ImportError> {
    let source = |path: &PathBuf| -> Box<dyn Source> {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        Box::new(SeekSource::new(&name, std::fs::File::open(path).unwrap()).unwrap())
    };
    let mut opening = Opening::new(paths.iter().map(source).collect())?;
    while opening.step()? {}
    opening.finish()
}

fn open(paths: &[PathBuf]) -> (Drive, OpenReport) {
    open_log(read(paths).unwrap_or_else(|e| panic!("{e}")), None).unwrap_or_else(|e| panic!("{e}"))
}

fn files_below(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files_below(&path, out) } else { out.push(path) }
    }
}

#[test]
fn every_file_opens() {
    let Some(root) = shared("data") else { return };
    let mut files = Vec::new();
    files_below(&root, &mut files);
    files.sort();
    let mut opened = 0;
    for path in files {
        let name = path.strip_prefix(&root).unwrap().to_string_lossy().into_owned();
        let head = std::fs::read(&path).unwrap();
        let format = Format::detect(&head[..head.len().min(8192)], &name);
        if name.contains("LICENSE") || name.ends_with(".md") || format == Format::Dbc {
            continue;
        }
        let mut paths = vec![path.clone()];
        let databases: &[&str] = if name.contains("rawcan") {
            &["comma2k19_rav4/toyota_rav4_2019.dbc"]
        } else if name.contains("canedge") {
            &[
                "css_canedge_mf4/canmod-gps.dbc",
                "css_canedge_mf4/gnss.dbc",
                "css_canedge_mf4/CSS-Electronics-SAE-J1939-DEMO.dbc",
            ]
        } else {
            &[]
        };
        paths.extend(databases.iter().map(|d| root.join(d)));
        match read(&paths) {
            Ok(log) => {
                let rows: usize = log.tables.iter().map(|t| t.rows).sum();
                println!("{name}: {}, {} tables, {rows} rows", format.label(), log.tables.len());
                assert!(rows > 0, "{name}");
                opened += 1;
            }
            // Eight bytes of a frame in each cell: no numbers.
            Err(error) => assert!(name.ends_with("raw_can/data"), "{name}: {error}"),
        }
    }
    assert!(opened >= 57, "{opened}");
}

/// Values of a signal of the car's bus, first source first, with their times.
fn signal(log: &Log, part: &str, name: &str) -> Vec<(f64, f64)> {
    let table: &Table = log.tables.iter().find(|t| t.part.starts_with(part)).unwrap_or_else(|| panic!("no {part}"));
    let values = &table.column(name).unwrap().values;
    let clock = &table.columns[0];
    let Some(drivescope_import::TimeEpoch::Instant(start)) = clock.epoch else { panic!("no instant") };
    let zero = (start - 1_533_226_488_000_000_000) as f64 / 1e9;
    clock.values.iter().map(|t| t + zero).zip(values.iter().copied()).collect()
}

#[test]
fn the_bus_log_gives_the_channels_of_the_csv_in_every_container() {
    let Some(root) = shared("data/comma2k19_rav4") else { return };
    let truth = read(&[root.join("canonical.csv")]).unwrap().tables.remove(0);
    let time = &truth.column("t").unwrap().values;
    let kph = 1.0 / 3.6;
    let deg = std::f64::consts::PI / 180.0;
    for container in ["blf", "asc", "candump.log"] {
        let log = read(&[root.join(format!("comma2k19_rav4_rawcan.{container}")), root.join("toyota_rav4_2019.dbc")])
            .unwrap();
        // The steering angle comes in steps of 1.5 deg and a fraction beside it.
        let fraction = signal(&log, "STEER_ANGLE_SENSOR (bus 1)", "STEER_FRACTION");
        let mut steering = signal(&log, "STEER_ANGLE_SENSOR (bus 1)", "STEER_ANGLE");
        steering.iter_mut().zip(&fraction).for_each(|(a, f)| a.1 += f.1);
        let wheel = |name: &str| signal(&log, "WHEEL_SPEEDS (bus 1)", name);
        let motion = |name: &str| signal(&log, "KINEMATICS (bus 1)", name);
        for (column, factor, found) in [
            ("wheel_speed_fl", kph, wheel("WHEEL_SPEED_FL")),
            ("wheel_speed_fr", kph, wheel("WHEEL_SPEED_FR")),
            ("wheel_speed_rl", kph, wheel("WHEEL_SPEED_RL")),
            ("wheel_speed_rr", kph, wheel("WHEEL_SPEED_RR")),
            ("steering_wheel_angle", -deg, steering),
            ("can_yaw_rate", -deg, motion("YAW_RATE")),
            ("can_accel_x", -1.0, motion("ACCEL_X")),
            ("can_accel_y", 1.0, motion("ACCEL_Y")),
        ] {
            let values = &truth.column(column).unwrap().values;
            let rows: Vec<usize> = (0..truth.rows).filter(|&r| values[r].is_finite()).collect();
            // The clocks differ by a constant, that of the first frame and row.
            let offset = 46408.58 - 0.3;
            let end = found.last().unwrap().0;
            let mut compared = 0;
            for &row in rows.iter().filter(|&&r| time[r] - offset < end) {
                let at = time[row] - offset;
                let first = found.partition_point(|(t, _)| *t < at - 0.03);
                let mut near = found[first..].iter().take_while(|(t, _)| *t < at + 0.03);
                // Nine digits in the CSV.
                let same = near.any(|(_, v)| (v * factor - values[row]).abs() < 1e-7);
                assert!(same, "{container}, {column}, row {row}: {} at {}", values[row], time[row]);
                compared += 1;
            }
            assert!(compared > if container == "blf" { 4500 } else { 900 }, "{container}, {column}: {compared}");
        }
    }
}

#[test]
fn a_bag_and_its_mcap_are_the_same_drive_bit_for_bit() {
    let Some(root) = shared("data/clearpath_bag") else { return };
    for (bag, mcap, samples) in
        [("test1.bag", "husky_test1_ros2.mcap", 11865), ("test2.bag", "jackal_test2_ros2.mcap", 3061)]
    {
        let (a, b) = (open(&[root.join(bag)]).0, open(&[root.join(mcap)]).0);
        assert_eq!(a.imu.len(), samples);
        let bits = |d: &Drive| -> Vec<u64> {
            let imu = (0..d.imu.len()).map(|i| d.imu.at(i));
            let imu = imu.flat_map(|(t, s)| [t, s.accel_x, s.accel_y, s.accel_z, s.gyro_x, s.gyro_y, s.gyro_z]);
            let fixes = (0..d.gnss.len()).map(|i| d.gnss.at(i)).flat_map(|(t, s)| [t, s.lat, s.lon, s.alt]);
            let wheels = (0..d.wheels.len()).map(|i| d.wheels.at(i)).flat_map(|(t, s)| [t, s.speed]);
            imu.chain(fixes).chain(wheels).map(f64::to_bits).collect()
        };
        assert!(bits(&a) == bits(&b), "{bag} and {mcap} differ");
    }
}

#[test]
fn consecutive_bus_logs_are_one_drive() {
    let Some(root) = shared("data/css_canedge_mf4") else { return };
    let parts = ["00000003-60FEBB3B", "00000001-60FEB68B", "00000002-60FEB8E3"];
    let mut paths: Vec<PathBuf> =
        parts.iter().map(|p| root.join(format!("gps_imu_obd2_3BA199E2_165_{p}.MF4"))).collect();
    paths.push(root.join("canmod-gps.dbc"));
    let (drive, report) = open(&paths);
    assert_eq!(drive.imu.len(), 36884 + 60775 + 60788);
    assert!((report.duration - 1564.7).abs() < 0.1, "{}", report.duration);
    // Quantised to 0.125 m/s^2, X up: 9.68 m/s^2 on average at rest.
    let column = drive.imu.column("accel_x").unwrap();
    assert!(column.iter().all(|a| (a * 8.0).fract() == 0.0));
    assert!((column.iter().sum::<f64>() / column.len() as f64 - 9.68).abs() < 0.1);
    assert!(drive.gnss.len() > 1400 && drive.gnss.at(1000).1.alt.is_finite());
}

#[test]
fn counts_of_other_readers_are_ours() {
    // 1298 and 1297 messages of sensor_combined: pyulog 1.2.
    let Some(root) = shared("data/ulog") else { return };
    for (file, count) in [("sample_log_small.ulg", 1298), ("foxglove_test_ulog.ulg", 1297)] {
        assert_eq!(open(&[root.join(file)]).0.imu.len(), count, "{file}");
    }
}

#[test]
fn the_receivers_sentences_are_the_fixes_of_the_csv() {
    let Some(root) = shared("data/vn100_circles") else { return };
    let (a, b) = (open(&[root.join("drive.nmea")]).0, open(&[root.join("driving_data_0_gps.csv")]).0);
    assert_eq!(a.gnss.len(), 2455);
    let fixes =
        |d: &Drive| -> Vec<(f64, f64)> { (0..d.gnss.len()).map(|i| d.gnss.at(i).1).map(|f| (f.lat, f.lon)).collect() };
    let (a, b) = (fixes(&a), fixes(&b));
    let same = |x: &(f64, f64), y: &(f64, f64)| (x.0 - y.0).abs() < 1e-12 && (x.1 - y.1).abs() < 1e-12;
    let found = b.iter().filter(|fix| a.iter().any(|other| same(fix, other))).count();
    assert_eq!(found, b.len(), "every fix of the CSV is one of the sentences'");
}
