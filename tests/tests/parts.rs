//! A drive taken apart and put together again is the same drive, bit for bit. A failure means that a log opened in the page,
//! where one module reads and another estimates, is not the log that the command line opens.
#![allow(clippy::unwrap_used)]

use drivescope_drive::channel::Series;
use drivescope_drive::csv::{write_drive, write_raw_gnss};
use drivescope_drive::disk::{Disk, DiskSensor};
use drivescope_drive::drive::Drive;
use drivescope_drive::parts::{Assembly, parts};
use drivescope_drive::satellites::Satellite;
use drivescope_import::{CsvReader, Table, open_table, raw_gnss};
use drivescope_simulation::{Simulation, named};

fn through_parts(drive: Drive) -> Drive {
    let (head, parts) = parts(drive);
    let mut assembly = Assembly::new(head).unwrap();
    for part in parts {
        let columns = part.columns.into_iter().map(|(name, values)| (name.to_owned(), values)).collect();
        assembly.add(part.name, part.time, columns).unwrap();
    }
    assembly.finish()
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

fn assert_same_series(a: &Series, b: &Series, what: &str) {
    assert_eq!(a.schema(), b.schema(), "{what}: schema");
    assert_eq!(bits(a.time()), bits(b.time()), "{what}: times");
    for (i, column) in a.schema().iter().enumerate() {
        assert!(bits(a.column_at(i)) == bits(b.column_at(i)), "{what}: {} differs", column.name);
    }
}

fn satellites(drive: &Drive) -> Vec<u64> {
    let cells = |s: &Satellite| s.cells().map(f64::to_bits);
    drive.raw_gnss.iter().flat_map(|(t, all)| [t.to_bits()].into_iter().chain(all.iter().flat_map(cells))).collect()
}

fn assert_same(a: &Drive, b: &Drive) {
    for (one, other) in a.channels().into_iter().zip(b.channels()).chain([(&a.truth, &b.truth)]) {
        assert_same_series(one, other, &a.name);
    }
    assert_eq!(a.raw_gnss.len(), b.raw_gnss.len());
    assert!(satellites(a) == satellites(b), "{}: raw ranges differ", a.name);
    let head =
        |d: &Drive| (d.name.clone(), d.vehicle.clone(), d.rear_axle.map(f64::to_bits), d.unix_zero.map(f64::to_bits));
    assert_eq!(head(a), head(b));
    assert_eq!(a.disk, b.disk);
}

fn simulated(name: &str) -> Drive {
    let mut simulation = Simulation::new(&named(name).unwrap(), None).unwrap();
    simulation.advance(90.0);
    simulation.drive().clone()
}

fn table(name: &str, text: &[u8]) -> Table {
    let mut reader = CsvReader::new(name);
    text.chunks(1 << 16).for_each(|slice| reader.feed(slice).unwrap());
    reader.finish().unwrap()
}

/// The drive as the readers of the page hand it out.
fn read(drive: &Drive) -> Drive {
    let (mut text, mut raw) = (Vec::new(), Vec::new());
    write_drive(drive, &mut text).unwrap();
    let (mut read, _) = open_table(table(&drive.name, &text), None).unwrap();
    if !drive.raw_gnss.is_empty() {
        write_raw_gnss(&drive.raw_gnss, &mut raw).unwrap();
        read.raw_gnss = raw_gnss(&table("raw.csv", &raw), 0.0).unwrap();
    }
    read
}

#[test]
fn every_built_in_drive_survives_its_parts_simulated_and_read() {
    let mut ranges = 0;
    for drive in drivescope_simulation::drives() {
        let live = simulated(drive.name);
        assert_same(&live, &through_parts(live.clone()));
        let read = read(&live);
        assert_same(&read, &through_parts(read.clone()));
        assert!(
            read.truth.schema().len() > 10 && !read.imu.is_empty() | !read.accel_array.is_empty(),
            "{}",
            drive.name
        );
        ranges += read.raw_gnss.len();
    }
    assert!(ranges > 0, "one of them has raw ranges");
}

/// Catches a calibration or an axle that a written drive loses: opened again, the disk would be read as drawn.
#[test]
fn a_written_drive_gives_the_estimates_of_the_one_it_was_written_from() {
    use drivescope_estimation::registry::run_by_name;
    for (name, estimator) in [("u_drive_disk", "gyro_free"), ("u_drive_disk", "land_ins"), ("urban", "gnss_ins")] {
        let mut live = simulated(name);
        if name == "u_drive_disk" {
            let mut disk = Disk::drawn(0.1);
            let lean =
                |(k, s): (usize, &mut DiskSensor)| (s.axis[0], s.bias) = (s.axis[0] + 0.01 / 3.0, 0.1 / (k + 3) as f64);
            disk.sensors.iter_mut().enumerate().for_each(lean);
            live.disk = Some(disk);
        }
        let read = read(&live);
        assert_eq!((read.disk, read.rear_axle), (live.disk, live.rear_axle), "{name}");
        assert!(read.rear_axle.is_some());
        let estimates = |drive| run_by_name(estimator, drive, &serde_json::Value::Null, None).unwrap().into_series();
        let (here, there) = (estimates(&live), estimates(&read));
        assert!(here.len() > 1000);
        assert_same_series(&here, &there, estimator);
    }
}

#[test]
fn a_disk_that_is_not_one_is_left_out_with_a_sentence_and_a_mapping_s_own_comes_first() {
    let rows = "t,acc6_1,acc6_2,acc6_3,acc6_4,acc6_5,acc6_6\n0,1,1,1,9,9,9\n0.01,1,1,1,9,9,9\n0.02,1,1,1,9,9,9\n";
    let open = |stated: &str, mapping| {
        let text = format!("# disk = {stated}\n{rows}");
        let (drive, report) = open_table(table("disk.csv", text.as_bytes()), mapping).unwrap();
        (drive.disk, report)
    };
    let drawn = Disk::drawn(0.0833333333333333);
    let text = drawn.numbers().iter().map(f64::to_string).collect::<Vec<_>>();
    let (disk, report) = open(&text.join(", "), None);
    assert_eq!(disk, Some(drawn));
    let other = Disk::drawn(0.2);
    let mapping = drivescope_import::Mapping { disk: Some(other), ..report.mapping };
    assert_eq!(open(&text.join(","), Some(&mapping)).0, Some(other));
    for bad in [text[..41].join(", "), text.join(", ") + ", 1", "nan".into(), text[1..].join(",") + ",inf", "a".into()]
    {
        let (disk, report) = open(&bad, None);
        assert!(disk.is_none());
        assert!(report.warnings.iter().any(|w| w.message.contains("42 numbers")), "{bad}: {:?}", report.warnings);
    }
}

#[test]
fn what_a_log_says_of_car_axle_and_date_survives_and_so_do_gaps() {
    let text = "# rear_axle_x = -1.2345678901234567\n# vehicle = {\"mass\": 1234.5678901234567}\n\
                time,accel_x,gyro_z,speed,truth_yaw,truth_roll\n\
                2024-05-01T10:00:00.000Z,0.1,,10,0.5,\n2024-05-01T10:00:00.010Z,-0.0,0.3,,,\n\
                2024-05-01T10:00:00.020Z,,0.2,11,0.7,\n2024-05-01T10:00:00.030Z,0.3,0.1,12,,\n";
    let (mut drive, _) = open_table(table("gaps.csv", text.as_bytes()), None).unwrap();
    drive.disk = Some(Disk::drawn(0.08));
    assert!(drive.rear_axle.is_some() && drive.unix_zero.is_some() && drive.vehicle.is_some());
    let cells = drive.imu.column("gyro_z").unwrap();
    assert!(cells[0].is_nan() && cells[1] == 0.3);
    assert_same(&drive, &through_parts(drive.clone()));
    assert_same(&Drive::default(), &through_parts(Drive::default()));
}
