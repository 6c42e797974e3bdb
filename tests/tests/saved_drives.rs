//! A simulated drive that is saved and opened again is the same drive: same car, same axle, same estimates. A failure means
//! that what is done with a saved log cannot be compared with what the page shows of the live one.
#![allow(clippy::unwrap_used)]

use drivescope_drive::channel::Series;
use drivescope_drive::csv::{write_drive, write_raw_gnss};
use drivescope_drive::drive::Drive;
use drivescope_estimation::registry::{ESTIMATORS, run_by_name};
use drivescope_import::{CsvReader, Table, open_table, raw_gnss};
use drivescope_simulation::{named, simulate};
use serde_json::Value;

fn table(name: &str, text: &[u8]) -> Table {
    let mut reader = CsvReader::new(name);
    text.chunks(1 << 16).for_each(|slice| reader.feed(slice).unwrap());
    reader.finish().unwrap()
}

fn saved_and_opened(drive: &Drive) -> Drive {
    let (mut text, mut raw) = (Vec::new(), Vec::new());
    write_drive(drive, &mut text).unwrap();
    let (mut opened, report) = open_table(table("saved.csv", &text), None).unwrap();
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    if !drive.raw_gnss.is_empty() {
        write_raw_gnss(&drive.raw_gnss, &mut raw).unwrap();
        opened.raw_gnss = raw_gnss(&table("raw.csv", &raw), 0.0).unwrap();
    }
    opened
}

/// The first value that differs by more than latitude and longitude in degrees can explain: a rounding of 4e-16 rad is
/// 3e-9 m on the ground.
fn difference(live: &Series, saved: &Series) -> Option<String> {
    if live.time() != saved.time() {
        return Some(format!("{} rows live, {} saved", live.len(), saved.len()));
    }
    (0..live.schema().len()).find_map(|i| {
        let (a, b) = (live.column_at(i), saved.column_at(i));
        let name = live.schema()[i].name;
        let row = (0..a.len()).find(|&k| {
            !(a[k] == b[k] || (a[k] - b[k]).abs() <= 1e-8 * a[k].abs().max(1.0) || a[k].is_nan() && b[k].is_nan())
        })?;
        Some(format!("{name} at {}: {} live, {} saved", live.time()[row], a[row], b[row]))
    })
}

#[test]
fn every_estimator_says_the_same_of_a_drive_saved_and_opened_again() {
    for name in ["u_drive", "u_drive_disk", "table1", "motorway_bank", "dlc80_flat", "city_hills"] {
        let live = simulate(&named(name).unwrap(), None).unwrap();
        let saved = saved_and_opened(&live);
        assert_eq!((saved.rear_axle, &saved.vehicle), (live.rear_axle, &live.vehicle), "{name}");
        assert_eq!(saved.raw_gnss, live.raw_gnss, "{name}");
        for (a, b) in live.channels().into_iter().zip(saved.channels()) {
            assert_eq!(a.len(), b.len(), "{name}: samples of {:?}", a.schema().first().map(|c| c.name));
        }
        for estimator in ESTIMATORS {
            let run = |drive: &Drive| run_by_name(estimator.name, drive, &Value::Null, None);
            match (run(&live), run(&saved)) {
                (Ok(a), Ok(b)) => assert_eq!(difference(a.series(), b.series()), None, "{} on {name}", estimator.name),
                (Err(a), Err(b)) => assert_eq!(a.to_string(), b.to_string()),
                (a, b) => panic!("{} on {name}: {:?} {:?}", estimator.name, a.is_ok(), b.is_ok()),
            }
        }
    }
}

#[test]
fn a_statement_that_is_none_is_passed_over_with_a_warning() {
    let rows = "t,gyro_z,speed\n0,0,1\n0.1,0,1\n0.2,0,1\n";
    let open = |head: &str| open_table(table("x.csv", format!("{head}\n{rows}").as_bytes()), None).unwrap();
    let (drive, report) = open("# rear_axle_x = far\n# vehicle = {\"mass\": -3}");
    assert_eq!((drive.rear_axle, drive.vehicle), (None, None));
    assert_eq!(report.warnings.len(), 2, "{:?}", report.warnings);
    let (drive, report) = open("# made = today\n# rear_axle_x = -1.25");
    assert_eq!((drive.rear_axle, report.warnings.len()), (Some(-1.25), 0));
}
