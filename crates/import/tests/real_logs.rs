//! Real recordings and the case logs of the specifications open without configuration, where they are there.

use std::path::{Path, PathBuf};

use drivescope_drive::drive::Drive;
use drivescope_import::{IoSource, OpenReport, Weight, open_csv};

/// A file below the folder `shared` beside the project; `None`, with a line that says so, where it is absent.
fn shared(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(path);
    if found.exists() {
        return Some(found);
    }
    println!("SKIPPED: shared/{path} is not here");
    None
}

fn open(path: &Path) -> (Drive, OpenReport) {
    let file = std::fs::File::open(path).expect("the log can be read");
    let name = path.file_name().expect("a file").to_string_lossy();
    let result = if path.extension().is_some_and(|e| e == "gz") {
        open_csv(&mut IoSource::new(flate2::read::GzDecoder::new(file), None), &name, None)
    } else {
        open_csv(&mut IoSource::new(file, None), &name, None)
    };
    result.unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn comma2k19_opens_with_its_places_read_as_radians() {
    let Some(path) = shared("data/comma2k19_rav4/canonical.csv") else { return };
    let (drive, report) = open(&path);
    assert_eq!(drive.imu.len(), 6256);
    assert_eq!(drive.truth.len(), 1199);
    // The drive is near San Francisco: 37.72 deg north, 122.47 deg west.
    let (_, fix) = drive.gnss.at(0);
    assert!((fix.lat.to_degrees() - 37.72).abs() < 0.01 && (fix.lon.to_degrees() + 122.47).abs() < 0.01, "{fix:?}");
    assert!((drive.truth.column("lat").unwrap()[0].to_degrees() - 37.72).abs() < 0.01);
    assert!((fix.course - 0.04).abs() < 0.03, "course is in radians: the track leads 2.4 deg east of north");
    assert!(
        report.notes.iter().any(|n| n.contains("`gnss_lat` and `gnss_lon` are read as rad, not as deg")),
        "{:?}",
        report.notes
    );
    let unused: Vec<&str> = report.unused.iter().map(|u| u.column.as_str()).collect();
    assert_eq!(unused, ["can_yaw_rate", "can_accel_x", "can_accel_y"]);
    let used = |name: &str| report.used.iter().find(|u| u.signal == name).unwrap();
    assert_eq!(used("steering_wheel").column, "steering_wheel_angle");
    // Units and signs of the inertial sensor are as the conventions say: nothing is turned.
    for name in ["accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z", "wheel_speed_rl"] {
        assert!(used(name).conversion.starts_with("as it is"), "{name}: {}", used(name).conversion);
    }
}

#[test]
fn case_logs_of_the_specifications_open_as_they_are() {
    let Some(root) = shared("spec") else { return };
    let folders = std::fs::read_dir(root).unwrap().map(|f| f.unwrap().path()).filter(|p| p.is_dir());
    let files = folders.flat_map(|f| std::fs::read_dir(f).unwrap().map(|f| f.unwrap().path()));
    let mut opened = 0;
    for path in files.filter(|p| p.to_string_lossy().ends_with(".csv.gz") && !p.to_string_lossy().contains("_gnss.csv"))
    {
        let (drive, report) = open(&path);
        opened += 1;
        let unused: Vec<_> = report.unused.iter().filter(|u| u.reason != "has no value in any row").collect();
        assert!(unused.is_empty(), "{}: {unused:?}", path.display());
        assert!(report.notes.is_empty(), "{}: {:?}", path.display(), report.notes);
        let against: Vec<_> = report.findings.iter().filter(|f| f.weight == Weight::Contradiction).collect();
        assert!(against.is_empty(), "{}: {against:?}", path.display());
        for used in &report.used {
            let expected = if used.signal.ends_with("_lat") || used.signal.ends_with("_lon") {
                "deg -> rad (x 0.017453)"
            } else {
                "as it is"
            };
            let clock = used.signal == "t" && used.conversion == "s -> s";
            assert!(clock || used.conversion.starts_with(expected), "{}: {used:?}", path.display());
        }
        assert!(drive.sample_count() > 1000 && !drive.truth.is_empty());
    }
    assert!(opened >= 13, "{opened}");
}

#[test]
fn circles_of_two_cars_open() {
    let Some(path) = shared("data/vn100_circles/circle_data_0_imu.csv") else { return };
    let (drive, report) = open(&path);
    assert!(
        report.notes.iter().any(|n| n.contains("the magnetometer states no unit: taken as T")),
        "{:?}",
        report.notes
    );
    let mean_z = drive.imu.column("accel_z").unwrap().iter().sum::<f64>() / drive.imu.len() as f64;
    assert!((mean_z + 9.8).abs() < 0.5, "{mean_z}");
    assert!((report.channels[0].rate - 40.0).abs() < 8.0, "{:?}", report.channels);
    let Some(path) = shared("data/vn100_circles/car2/data_going_in_circles.csv") else { return };
    let (drive, report) = open(&path);
    assert_eq!(report.used[0].column, "timestamp_sec_imu");
    assert!(drive.imu.len() > 3000, "{}", drive.imu.len());
    let Some(path) = shared("data/vn100_circles/driving_data_0_gps.csv") else { return };
    let (drive, report) = open(&path);
    assert!((drive.gnss.at(0).1.lat.to_degrees() - 42.337).abs() < 0.01);
    assert_eq!(report.used[0].column, "t");
}
