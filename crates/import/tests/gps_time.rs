//! Clocks of GPS time: the date they tell, how sure that is, and that the times between rows are untouched.

#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_import::{Confidence, MemorySource, OpenReport, Opening, Source, open_log};

/// A minute at 10 Hz of a car on a straight road, with the clock and further columns as given.
fn log(head: &str, clock: impl Fn(usize) -> String) -> Vec<u8> {
    let row = |i: usize| {
        let t = i as f64 / 10.0;
        let (accel, speed) = (1.5 * (0.3 * t).cos(), 10.0 + 5.0 * (0.3 * t).sin());
        format!("{},{accel},0.01,-9.8,{speed}\n", clock(i))
    };
    let rows: String = (0..600).map(row).collect();
    format!("{head},accel_x,accel_y,accel_z,speed\n{rows}").into_bytes()
}

fn open(files: &[(&str, Vec<u8>)]) -> (Drive, OpenReport) {
    let sources = files.iter().map(|(name, bytes)| Box::new(MemorySource::new(name, bytes.clone())) as Box<dyn Source>);
    let mut opening = Opening::new(sources.collect()).unwrap();
    while opening.step().unwrap() {}
    open_log(opening.finish().unwrap(), None).unwrap()
}

fn clock(report: &OpenReport) -> (Confidence, String) {
    let used = report.used.iter().find(|u| u.signal == "t").unwrap();
    (used.confidence, used.why.clone())
}

/// Catches seconds since 1980 read as Unix time (ten years early, certain), and a doubt that is not said.
#[test]
fn a_gps_clock_tells_its_date_and_how_sure_it_is() {
    let since_1980 = |first: f64| move |i: usize| format!("{:.1}", first + i as f64 / 10.0);
    let (likely, sure) = (Confidence::Likely, Confidence::Certain);
    for (head, file, year, confidence, said) in [
        (
            "gps_time",
            log("gps_time", since_1980(1.38e9)),
            2023.75,
            likely,
            "GPS time, seconds since 1980, that is 2023-09-29T05:19:42Z",
        ),
        (
            "gps_time [s]",
            log("gps_time [s]", since_1980(1.38e9)),
            2023.75,
            likely,
            "as Unix time it would be 2013-09-24",
        ),
        (
            "gps_time",
            log("gps_time", since_1980(9e8)),
            2008.53,
            sure,
            "GPS time, seconds since 1980, that is 2008-07-13T15:59:46Z",
        ),
        ("gps_time", log("gps_time", since_1980(1.7e9)), 2023.87, likely, "taken as Unix time, 2023-11-14T22:13:20Z"),
        ("unix_time", log("unix_time", since_1980(1.7e9)), 2023.87, sure, "is Unix time in s"),
        (
            "iTOW,gps_week",
            log("iTOW,gps_week", |i| format!("{},2281", 259_200_000 + 100 * i)),
            2023.74,
            sure,
            "seconds of GPS week 2281 in `gps_week`, that is 2023-09-26T23:59:42Z",
        ),
    ] {
        let (drive, report) = open(&[("log.csv", file)]);
        assert_eq!(drive.imu.len(), 600, "{head}: {report:?}");
        assert!((report.duration - 59.9).abs() < 1e-6, "{head}: {}", report.duration);
        let date = drive.date().unwrap_or_else(|| panic!("{head}: no date"));
        assert!((date - year).abs() < 0.01, "{head}: {date}, not {year}");
        let (found, why) = clock(&report);
        assert!(found == confidence && why.contains(said), "{head}: {found:?}, {why}");
        // A doubt is a note beside the log, once.
        let notes = report.notes.iter().filter(|n| n.contains("Unix time") && n.contains("GPS time")).count();
        assert_eq!(notes, usize::from(confidence == likely), "{head}: {:?}", report.notes);
    }
}

/// Catches a week number that begins anew every 1024 weeks and is believed, which is twenty years early.
#[test]
fn a_time_of_week_without_a_week_that_can_be_is_no_date() {
    for (head, week) in [("gps_tow", ""), ("gps_tow,week", ",233")] {
        let (drive, report) = open(&[("log.csv", log(head, |i| format!("{:.1}{week}", 259_200.0 + i as f64 / 10.0)))]);
        assert_eq!((drive.imu.len(), drive.date()), (600, None), "{head}");
        let why = clock(&report).1;
        assert!(why.contains("seconds of a GPS week"), "{head}: {why}");
    }
}

/// Catches files of one drive that are laid beside each other by clocks of different zeros.
#[test]
fn a_log_in_gps_time_and_one_in_unix_time_are_merged_where_they_belong() {
    let inertial = log("gps_time", |i| format!("{:.1}", 1_380_000_000.0 + i as f64 / 10.0));
    let unix = 1_380_000_000 + 315_964_800 - 18;
    let fixes: String = (0..60).map(|i| format!("{},42.{:05},1.0\n", unix + 2 + i, i * 10)).collect();
    let fixes = format!("unix_time,gnss_lat,gnss_lon\n{fixes}").into_bytes();
    let (drive, report) = open(&[("imu.csv", inertial), ("fixes.csv", fixes)]);
    assert_eq!((drive.imu.len(), drive.gnss.len()), (600, 60), "{report:?}");
    let apart = drive.gnss.at(0).0 - drive.imu.at(0).0;
    assert!((apart - 2.0).abs() < 1e-6, "the first fix is 2 s after the first row: {apart}");
    assert_eq!(report.epoch.as_deref(), Some("2023-09-29T05:19:42Z"));
}
