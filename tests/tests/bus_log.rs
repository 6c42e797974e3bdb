//! Motion modes of 26 minutes of a car's bus, in three MDF4 files, held against the speed and course of its receiver. A
//! failure means that the files no longer are one drive, that the sensor's odd mounting is not found, or that modes come
//! wrongly from a real sensor that is coarse and shaken by an idling engine.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use drivescope_drive::channel::{Channel, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;
use drivescope_drive::signals::Gnss;
use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::mode::ModeScore;
use drivescope_import::{Mapping, Opening, SeekSource, Source, open_log};
use serde_json::json;

/// Samples of the receiver further apart than this, s, say nothing of what is between.
const LONGEST_STEP: f64 = 2.5;

fn read() -> Option<drivescope_import::Log> {
    let root = drivescope_tests::shared("data/css_canedge_mf4")?;
    let parts = ["00000001-60FEB68B", "00000002-60FEB8E3", "00000003-60FEBB3B"];
    let mut paths: Vec<PathBuf> =
        parts.iter().map(|p| root.join(format!("gps_imu_obd2_3BA199E2_165_{p}.MF4"))).collect();
    paths.push(root.join("canmod-gps.dbc"));
    let source = |path: &PathBuf| -> Box<dyn Source> {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        Box::new(SeekSource::new(&name, std::fs::File::open(path).unwrap()).unwrap())
    };
    let mut opening = Opening::new(paths.iter().map(source).collect()).unwrap();
    while opening.step().unwrap() {}
    Some(opening.finish().unwrap())
}

/// The drive with every correction taken that is proposed when it is opened.
fn corrected() -> Option<(Drive, Mapping)> {
    let report = open_log(read()?, None).unwrap().1;
    let mut mapping = report.mapping.clone();
    report.findings.iter().filter_map(|f| f.correction.as_ref()).for_each(|c| mapping.correct(c));
    Some((open_log(read()?, Some(&mapping)).unwrap().0, mapping))
}

/// A column of the receiver at a time, on the straight line between its samples.
fn at(series: &Series, values: &[f64], time: f64) -> Option<f64> {
    let times = series.time();
    let after = times.partition_point(|&t| t < time);
    let before = after.checked_sub(1).filter(|_| after < times.len())?;
    let step = times[after] - times[before];
    let value = values[before] + (values[after] - values[before]) * ((time - times[before]) / step);
    (step < LONGEST_STEP && value.is_finite()).then_some(value)
}

#[test]
fn modes_of_twenty_six_minutes_agree_with_the_receivers_speed_and_course() {
    let Some((drive, mapping)) = corrected() else { return };
    let (speeds, fixes) = (drive.wheels.series().clone(), drive.gnss.series().clone());
    let speed = |t: f64| at(&speeds, speeds.column("speed").unwrap(), t);
    let mut course = fixes.column("course").unwrap().to_vec();
    (1..course.len()).for_each(|k| course[k] = course[k - 1] + wrap_angle(course[k] - course[k - 1]));
    let turn = |t: f64| Some(0.5 * (at(&fixes, &course, t + 1.0)? - at(&fixes, &course, t - 1.0)?));

    // X points up, forward is -Y and right is +Z, as those who recorded it say.
    let of = |signal: &str| (mapping.signals[signal].column.as_str(), mapping.signals[signal].scale);
    assert_eq!(
        ["accel_x", "accel_y", "accel_z"].map(of),
        [("AccelerationY", -1.0), ("AccelerationZ", 1.0), ("AccelerationX", -1.0)]
    );
    // Without the receiver's speed: that is what the modes are held against.
    let run = run_by_name("motion_mode", &drive, &json!({"use_speed": false}), None).unwrap();
    let series = run.series();
    let said: Vec<f64> = (series.time().iter())
        .map(|&t| match (speed(t), turn(t)) {
            (Some(..0.15), _) => 0.0,
            (Some(2.0..), Some(turn)) if turn.abs() > 0.08 => 2.0,
            (Some(1.0..), Some(turn)) if turn.abs() < 0.025 => 1.0,
            // Creeping, or a bend that is hardly one: the receiver does not tell.
            _ => f64::NAN,
        })
        .collect();
    let found = ModeScore::new(series.time(), series.column("mode").unwrap(), &said).unwrap();
    println!("{found:?}");
    assert!(found.count > 130_000 && found.accuracy_guarded >= 0.95, "{found:?}");
    // With the places of the fixes and nothing else of the receiver: the reference is its speed, which it measures by itself. The
    // engine idles in every rest and was never off; wherever the modes come to rest by the fixes, the receiver says so too.
    let mut bare = Drive { wheels: Channel::default(), gnss: Channel::default(), ..drive.clone() };
    for (time, fix) in drive.gnss.iter() {
        let place = Gnss { lat: fix.lat, lon: fix.lon, valid: fix.valid, ..Gnss::default() };
        bare.gnss.push(time, place).unwrap();
    }
    let by_places = run_by_name("motion_mode", &bare, &serde_json::Value::Null, None).unwrap();
    let modes = by_places.series().column("mode").unwrap();
    let placed = ModeScore::new(series.time(), modes, &said).unwrap();
    println!("with places: {placed:?}");
    assert!(placed.accuracy_guarded >= found.accuracy_guarded + 0.01, "{placed:?}, {found:?}");
    assert_eq!(placed.confusion[1][0] + placed.confusion[2][0], 0, "never at rest on the road: {placed:?}");
    // For the first half minute the receiver repeats one place, and zero speed, of a car that turns at up to 0.5 rad/s.
    let turning = |series: &Series| {
        let (modes, turns) = (series.column("mode").unwrap(), series.column("yd").unwrap());
        modes.iter().zip(turns).filter(|(mode, turn)| **mode == 0.0 && turn.abs() > 0.05).count()
    };
    assert_eq!(turning(by_places.series()), turning(series), "the fixes tell no rest of a car that turns");
    let [_, straight, corner] = found.confusion;
    assert_eq!(straight[0] + corner[0], 0, "never at rest on the road: {found:?}");
    assert!(corner[2] as f64 / corner.iter().sum::<usize>() as f64 >= 0.99, "{found:?}");
}
