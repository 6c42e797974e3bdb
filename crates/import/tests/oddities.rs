//! What is odd in real recordings is found and said, where they are there.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use drivescope_import::{Examination, Opening, SeekSource, Source, examine_log};

fn shared(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(path);
    if found.exists() {
        return Some(found);
    }
    println!("SKIPPED: shared/data/{path} is not here");
    None
}

fn examined(paths: &[PathBuf]) -> Examination {
    let source = |path: &PathBuf| -> Box<dyn Source> {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        Box::new(SeekSource::new(&name, std::fs::File::open(path).unwrap()).unwrap())
    };
    let mut opening = Opening::new(paths.iter().map(source).collect()).unwrap();
    while opening.step().unwrap() {}
    let found = examine_log(opening.finish().unwrap()).unwrap_or_else(|e| panic!("{e}"));
    for c in &found.columns {
        println!("{:28} {:?} {:?} x{} {:?}: {}", c.column, c.signal, c.unit, c.scale, c.confidence, c.why);
    }
    for m in &found.mounts {
        println!("MOUNT {m:?}");
    }
    for d in &found.delays {
        println!("DELAY {d:?}");
    }
    for f in &found.findings {
        println!("{:?}: {}", f.weight, f.text);
    }
    found
}

fn says(found: &Examination, part: &str) {
    let texts: Vec<&String> = found.findings.iter().map(|f| &f.text).collect();
    assert!(texts.iter().any(|t| t.contains(part)), "expected {part:?} in {texts:#?}");
}

/// Raw column and sign of a signal.
fn of<'f>(found: &'f Examination, signal: &str) -> (&'f str, f64) {
    found.mapping.signals.get(signal).map_or(("none", 0.0), |s| (s.column.as_str(), s.scale))
}

#[test]
fn the_motorway_phone_leans_on_its_mount_its_wheels_read_low_and_its_places_are_radians() {
    let Some(path) = shared("comma2k19_rav4/canonical.csv") else { return };
    let found = examined(&[path]);
    assert!(found.names_believed);
    assert_eq!(found.mapping.signals["gnss_lat"].unit.as_deref(), Some("rad"));
    says(&found, "the car's speeds read 0.");
    says(&found, "% low");
    let imu = found.mounts.iter().find(|m| m.channel == "imu").unwrap();
    // README: about -3.8 deg; the road's own mean grade is taken out only as far as the altitude tells it.
    assert!((imu.mount.pitch_deg.abs() - 3.8).abs() < 1.0, "{imu:?}");
}

#[test]
fn the_bus_loggers_sensor_stands_on_edge_and_its_altitude_is_none_before_the_first_fix() {
    let Some(root) = shared("css_canedge_mf4") else { return };
    let mf4 = root.join("gps_imu_obd2_3BA199E2_165_00000002-60FEB8E3.MF4");
    let found = examined(&[mf4, root.join("canmod-gps.dbc")]);
    let columns = ["accel_x", "accel_y", "accel_z"].map(|s| of(&found, s));
    let ends = columns.map(|(c, sign)| (c.chars().last().unwrap_or('?'), sign));
    assert_eq!(ends, [('Y', -1.0), ('Z', 1.0), ('X', -1.0)], "X up, forward -Y, right +Z");
}

#[test]
fn altitude_of_minus_5400_m_is_no_altitude() {
    let Some(root) = shared("css_canedge_mf4") else { return };
    let mf4 = root.join("gps_imu_obd2_3BA199E2_165_00000001-60FEB68B.MF4");
    let found = examined(&[mf4, root.join("canmod-gps.dbc")]);
    says(&found, "reads -5400");
    assert_eq!(found.mapping.signals["gnss_alt"].blank, [-5400.0]);
}

#[test]
fn the_robots_sensor_has_its_y_axis_up() {
    let Some(path) = shared("clearpath_bag/test1.bag") else { return };
    let found = examined(&[path]);
    let (column, _) = of(&found, "accel_z");
    assert!(column.contains('y'), "{column}");
}
