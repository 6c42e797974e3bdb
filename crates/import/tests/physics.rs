//! Units and signs that no name states follow from physics, and each guess is said in words.
//!
//! One drive, written down as a point on a circle would be (no estimator's model): speed 12 +- 4 m/s, yaw rate up to
//! 0.15 rad/s, and everything else by its definition. Each test writes it in other units or axes and expects the same
//! SI values back.

#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_import::{IoSource, OpenReport, open_csv};

/// One instant of the drive, SI, forward-right-down.
struct Sample {
    t: f64,
    speed: f64,
    yaw_rate: f64,
    course: f64,
    accel: [f64; 3],
    lat: f64,
    lon: f64,
    steering_wheel: f64,
}

fn drive() -> Vec<Sample> {
    let (mut course, mut lat, mut lon) = (0.3_f64, 0.65_f64, -2.1_f64);
    let step = 0.02;
    let mut out = Vec::new();
    for k in 0..6000 {
        let t = f64::from(k) * step;
        let (speed, yaw_rate) = (12.0 + 4.0 * (0.2 * t).sin(), 0.15 * (0.25 * t).sin());
        // A little noise without a random generator: incommensurate fast waves.
        let shake = 0.2 * (173.0 * t).sin() + 0.1 * (311.0 * t).cos();
        let accel = [0.8 * (0.2 * t).cos() + shake, speed * yaw_rate + 0.5 * shake, -9.81 + shake];
        out.push(Sample { t, speed, yaw_rate, course, accel, lat, lon, steering_wheel: 15.0 * 2.7 * yaw_rate / speed });
        course += yaw_rate * step;
        lat += speed * course.cos() * step / 6.36e6;
        lon += speed * course.sin() * step / (6.38e6 * lat.cos());
    }
    out
}

fn open(header: &str, row: impl Fn(&Sample) -> Vec<f64>) -> (Drive, OpenReport) {
    let mut text = format!("{header}\n");
    for sample in drive() {
        let cells: Vec<String> =
            row(&sample).iter().map(|v| if v.is_nan() { String::new() } else { v.to_string() }).collect();
        text.push_str(&format!("{}\n", cells.join(",")));
    }
    open_csv(&mut IoSource::new(text.as_bytes(), None), "x.csv", None).expect("the drive opens")
}

/// Largest difference of a drive's column from what the samples say, relative to 1.
fn error(drive: &Drive, name: &str, truth: impl Fn(&Sample) -> f64) -> f64 {
    let (series, index) = drive.column(name).expect("the signal exists");
    let samples = self::drive();
    assert_eq!(series.len(), samples.len());
    let difference = |(s, v): (&Sample, &f64)| (v - truth(s)).abs();
    samples.iter().zip(series.column_at(index)).map(difference).fold(0.0, f64::max)
}

fn has_note(report: &OpenReport, part: &str) {
    assert!(report.notes.iter().any(|n| n.contains(part)), "expected a note with {part:?}, found {:#?}", report.notes);
}

#[test]
fn places_in_radians_and_in_1e_7_degrees_are_recognised_by_the_way_they_cover() {
    let (drive, report) = open("t,gnss_lat,gnss_lon,speed", |s| vec![s.t, s.lat, s.lon, s.speed]);
    assert!(error(&drive, "gnss_lat", |s| s.lat) < 1e-12);
    has_note(&report, "are read as rad, not as deg");
    let (drive, report) = open("t,lat,lon,speed", |s| {
        vec![s.t, (s.lat.to_degrees() * 1e7).round(), (s.lon.to_degrees() * 1e7).round(), s.speed]
    });
    assert!(error(&drive, "gnss_lat", |s| s.lat) < 2e-9, "half a unit of 1e-7 deg is 9e-10 rad");
    has_note(&report, "are read as 1e-7 deg");
    let (drive, report) = open("t,lat,lon,speed", |s| vec![s.t, s.lat.to_degrees(), s.lon.to_degrees(), s.speed]);
    assert!(error(&drive, "gnss_lat", |s| s.lat) < 1e-12);
    assert!(report.notes.is_empty(), "{:?}", report.notes);
}

#[test]
fn speed_in_km_h_is_recognised_by_the_positions_and_a_strange_scale_is_doubted() {
    let write =
        |factor: f64| open("t,lat,lon,v", move |s| vec![s.t, s.lat.to_degrees(), s.lon.to_degrees(), factor * s.speed]);
    let (drive, report) = write(3.6);
    assert!(error(&drive, "speed", |s| s.speed) < 1e-12);
    has_note(&report, "`v` states no unit: taken as km/h");
    let (drive, report) = write(1.0 / 0.44704);
    assert!(error(&drive, "speed", |s| s.speed) < 1e-12);
    has_note(&report, "taken as mph");
    let (drive, report) = write(1.3);
    assert!(error(&drive, "speed", |s| 1.3 * s.speed) < 1e-12, "nothing is changed without an explanation");
    has_note(&report, "no unit of speed explains that");
}

#[test]
fn course_is_degrees_by_its_range_or_by_the_direction_of_motion() {
    let (drive, report) = open("t,course,lat,lon,speed", |s| {
        vec![s.t, s.course.to_degrees().rem_euclid(360.0), s.lat.to_degrees(), s.lon.to_degrees(), s.speed]
    });
    assert!(error(&drive, "course", |s| s.course.rem_euclid(std::f64::consts::TAU)) < 1e-12);
    has_note(&report, "since radians end at 6.28");
    // Nearly north, between 0 and 6.9 degrees: the range cannot tell.
    let (drive, report) = open("t,track,gnss_vn,gnss_ve", |s| {
        let course = 0.05 + 0.01 * (0.1 * s.t).sin();
        vec![s.t, course.to_degrees(), 15.0 * course.cos(), 15.0 * course.sin()]
    });
    assert!(error(&drive, "course", |s| 0.05 + 0.01 * (0.1 * s.t).sin()) < 1e-12);
    has_note(&report, "taken as degrees, then 0.0 deg from the direction of motion");
}

#[test]
fn gravity_tells_g_from_m_s2_and_z_up_from_z_down() {
    let (drive, report) = open("t,ax,ay,az,wx,wy,wz", |s| {
        let [x, y, z] = s.accel.map(|a| a / 9.80665);
        vec![s.t, x, -y, -z, 0.01, -0.02, -s.yaw_rate]
    });
    for (i, name) in ["accel_x", "accel_y", "accel_z"].into_iter().enumerate() {
        assert!(error(&drive, name, |s| s.accel[i]) < 1e-12, "{name}");
    }
    assert!(error(&drive, "gyro_z", |s| s.yaw_rate) < 1e-12);
    assert!(error(&drive, "gyro_y", |_| 0.02) < 1e-12);
    has_note(&report, "the accelerometer states no unit: taken as g");
    has_note(&report, "ISO 8855 axes");
    let (_, report) = open("t,ax,ay,az", |s| vec![s.t, s.accel[0], s.accel[1], s.accel[2] + 9.81]);
    has_note(&report, "whether gravity was taken out");
    let (_, report) = open("t,ax,ay,az", |s| vec![s.t, s.accel[2], s.accel[0], s.accel[1]]);
    let lies = report.findings.iter().find(|f| f.text.contains("accel_z is +`ax`")).unwrap();
    assert_eq!(lies.correction.as_ref().unwrap().signals["accel_z"].column, "ax");
}

#[test]
fn gyro_in_degrees_is_recognised_by_size_by_course_and_by_lateral_acceleration() {
    let (drive, report) = open("t,gyro_x,gyro_z", |s| vec![s.t, 0.0, s.yaw_rate.to_degrees() * 2.0]);
    assert!(error(&drive, "gyro_z", |s| 2.0 * s.yaw_rate) < 1e-12);
    has_note(&report, "more than any car turns in rad/s");
    let (drive, report) = open("t,gyro_z,gnss_speed,course", |s| {
        vec![s.t, s.yaw_rate.to_degrees(), s.speed, s.course.rem_euclid(std::f64::consts::TAU)]
    });
    assert!(error(&drive, "gyro_z", |s| s.yaw_rate) < 1e-12);
    has_note(&report, "the rate at which the course turns");
    let (drive, report) = open("t,gyro_z,accel_y,speed", |s| vec![s.t, s.yaw_rate.to_degrees(), s.accel[1], s.speed]);
    assert!(error(&drive, "gyro_z", |s| s.yaw_rate) < 1e-12);
    has_note(&report, "lateral acceleration over speed");
}

#[test]
fn signs_are_turned_under_aliases_and_doubted_under_canonical_names() {
    let row = |s: &Sample| {
        vec![s.t, -s.accel[0], -s.accel[1], -s.yaw_rate, s.speed, s.course.rem_euclid(std::f64::consts::TAU)]
    };
    let (drive, report) = open("t,long_acc,lat_acc,yaw_rate,speed,course", row);
    assert!(error(&drive, "gyro_z", |s| s.yaw_rate) < 1e-12);
    assert!(error(&drive, "accel_y", |s| s.accel[1]) < 1e-12);
    assert!(error(&drive, "accel_x", |s| s.accel[0]) < 1e-12);
    for name in ["`yaw_rate`", "`lat_acc`", "`long_acc`"] {
        has_note(&report, &format!("{name} counts the other way"));
    }
    let (drive, report) = open("t,accel_x,accel_y,gyro_z,speed,course", row);
    assert!(error(&drive, "gyro_z", |s| -s.yaw_rate) < 1e-12);
    has_note(&report, "`gyro_z` seems to have the wrong sign");
    // With its numbers, and the correction that would turn it.
    let told = report.findings.iter().find(|f| f.text.contains("`accel_x` as accel_x has the opposite sign")).unwrap();
    assert!(told.text.contains("correlation -0.9") || told.text.contains("correlation -1.0"), "{}", told.text);
    assert_eq!(told.correction.as_ref().unwrap().signals["accel_x"].scale, -1.0);
}

#[test]
fn a_steering_angle_is_turned_and_converted_by_the_yaw_rate() {
    let (drive, report) =
        open("t,steering_angle,gyro_z,speed", |s| vec![s.t, -s.steering_wheel.to_degrees() * 0.4, s.yaw_rate, s.speed]);
    assert!(error(&drive, "steering_wheel", |s| 0.4 * s.steering_wheel) < 1e-12);
    has_note(&report, "a steering angle may be that of the steering wheel or of the road wheels");
    has_note(&report, "taken as degrees");
    has_note(&report, "counts the other way");
}

#[test]
fn the_magnetometers_unit_follows_from_the_earths_field() {
    for (unit, factor) in [("T", 1e-6), ("G", 0.01), ("mG", 10.0), ("nT", 1e3)] {
        let (drive, report) =
            open("t,mx,my,mz", |s| vec![s.t, 20.0 * factor, -10.0 * factor, (40.0 + s.yaw_rate) * factor]);
        assert!(error(&drive, "mag_x", |_| 20.0) < 1e-9, "{unit}");
        has_note(&report, &format!("the magnetometer states no unit: taken as {unit},"));
    }
}

#[test]
fn a_stated_unit_is_not_changed() {
    let (drive, report) = open("t,lat [deg],lon [deg],speed [m/s]", |s| vec![s.t, s.lat, s.lon, 3.6 * s.speed]);
    assert!(error(&drive, "gnss_lat", |s| s.lat.to_radians()) < 1e-12);
    assert!(error(&drive, "speed", |s| 3.6 * s.speed) < 1e-12);
    has_note(&report, "are said to be deg but look like rad");
}

#[test]
fn repeated_fixes_null_fixes_and_stuck_columns_are_noticed() {
    let held = |s: &Sample, v: f64| if s.t < 1.0 { 0.0 } else { (v * 1e6).round() / 1e6 };
    let (drive, report) = open("t,lat,lon,speed,accel_z", |s| {
        let second = Sample { t: s.t, ..self::drive().swap_remove((s.t.floor() * 50.0) as usize) };
        vec![s.t, held(&second, second.lat.to_degrees()), held(&second, second.lon.to_degrees()), s.speed, -9.75]
    });
    assert_eq!(drive.gnss.len(), 120, "one fix a second, of 6000 rows");
    has_note(&report, "the log repeats each GNSS fix 50");
    has_note(&report, "`accel_z` holds -9.75 in all 6000 rows");
    assert!(report.warnings.iter().any(|w| w.message.contains("latitude and longitude 0")), "{:?}", report.warnings);
    assert_eq!(report.mapping.drop_repeats, ["gnss"]);
}

#[test]
fn samples_of_a_sensor_at_one_time_are_merged_and_counted() {
    let text = "t,accel_x,speed\n0,1,\n0,,5\n0.1,2,6\n0.1,3,7\n0.2,4,8\n,5,9\n";
    let (drive, report) = open_csv(&mut IoSource::new(text.as_bytes(), None), "x.csv", None).unwrap();
    assert_eq!(drive.imu.column("accel_x").unwrap(), [1.0, 2.0, 4.0]);
    assert_eq!(drive.wheels.column("speed").unwrap(), [5.0, 6.0, 8.0], "the row of the same time adds its sensor");
    let messages: Vec<&str> = report.warnings.iter().map(|w| w.message.as_str()).collect();
    assert!(messages.contains(&"1 row without a time left out."), "{messages:?}");
    assert!(
        messages.contains(&"imu: 1 sample at the time of the one before left out, first in row 5."),
        "{messages:?}"
    );
}

#[test]
fn a_mapping_by_hand_reads_a_file_without_names() {
    let json = r#"{"version": 1, "time": {"column": "c1", "unit": "ms", "offset": 10},
        "signals": {"accel_x": {"column": "c2", "unit": "g", "scale": -1}, "speed": {"column": "c3", "unit": "km/h"}}}"#;
    let mapping = drivescope_import::Mapping::from_json(json, "m.json").unwrap();
    let text = &b"0,1,36\n10,2,72\n"[..];
    let (drive, report) = open_csv(&mut IoSource::new(text, None), "x.csv", Some(&mapping)).unwrap();
    assert_eq!(drive.imu.time(), [10.0, 10.01]);
    assert_eq!(drive.imu.column("accel_x").unwrap(), [-9.80665, -19.6133]);
    assert!((drive.wheels.at(1).1.speed - 20.0).abs() < 1e-12);
    assert_eq!(report.used[1].why, "given by the mapping");
    let wrong = json.replace("\"c3\"", "\"c9\"");
    let mapping = drivescope_import::Mapping::from_json(&wrong, "m.json").unwrap();
    let error = open_csv(&mut IoSource::new(text, None), "x.csv", Some(&mapping)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "x.csv: expected the column `c9` that the mapping gives for `speed`, found `c1`, `c2`, `c3`; correct the mapping."
    );
}
