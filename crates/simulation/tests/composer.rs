//! Drives composed from data: faults, the road's obstacles and patches, manoeuvres, sensors and their raw rows.

#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_drive::geodesy::Geodetic;
use drivescope_simulation::sensors::disk;
use drivescope_simulation::{DriveSpec, Simulation, named, simulate};
use nalgebra::Vector3;

fn spec(segments: &str, more: &str) -> DriveSpec {
    let text = format!(r#"{{"name": "x", "description": "y", "seed": 3, {more} "segments": [{segments}]}}"#);
    DriveSpec::from_json(&text).unwrap_or_else(|e| panic!("{e}"))
}

fn error(segments: &str, more: &str) -> String {
    let text = format!(r#"{{"name": "x", "description": "y", {more} "segments": [{segments}]}}"#);
    DriveSpec::from_json(&text).unwrap_err().to_string()
}

const STRAIGHT: &str = r#"{"length": 300, "speed_kmh": 50}"#;

fn truth<'a>(drive: &'a Drive, name: &str) -> &'a [f64] {
    drive.truth.column(name).unwrap()
}

#[test]
fn errors_name_path_value_and_what_was_expected() {
    for (segments, more, expected) in [
        (r#"{"duration": 5, "length": 9, "speed_kmh": 30}"#, "", "`segments[0]`: `length` or `duration`, not both"),
        (
            STRAIGHT,
            r#""faults": [{"kind": "bias", "start": 5, "duration": 3, "signal": "gyro"}],"#,
            "`faults[0].signal` = \"gyro\" is not known",
        ),
        (STRAIGHT, r#""faults": [{"kind": "outage", "start": -1}],"#, "`faults[0].start` = -1 is outside 0..=1000000"),
        (STRAIGHT, r#""car_changes": {"m": 1e6},"#, "`car_changes.m`: "),
        (STRAIGHT, r#""grip": [{"at": 5, "length": 3, "share": 0}],"#, "`grip[0].share` = 0 is outside 0.05..=1.5"),
        (STRAIGHT, r#""repeat": 0,"#, "`repeat` = 0 is outside 1..=1000"),
        (
            STRAIGHT,
            r#""parts": {"imu": "best"},"#,
            "`parts.imu` = \"best\" is not known; there are automotive, esc, phone",
        ),
        (STRAIGHT, r#""manoeuvre": {"kind": "j_turn", "at": 900},"#, "`manoeuvre.at` = 900 is outside 0..=300"),
        (
            r#"{"length": 90, "speed_kmh": 30, "turn_deg": 40}"#,
            r#""manoeuvre": {"kind": "j_turn", "at": 20},"#,
            "`manoeuvre.at`: the road must be straight and level",
        ),
    ] {
        let found = error(segments, more);
        assert!(found.starts_with(expected), "{found}");
    }
}

#[test]
fn a_piece_given_by_time_is_as_long_as_its_speed_says_and_repeats_are_written_out() {
    let spec = spec(r#"{"duration": 36, "speed_kmh": 50}"#, r#""repeat": 3,"#);
    assert_eq!(spec.segments.len(), 3);
    assert!(spec.segments.iter().all(|s| (s.length - 500.0).abs() < 1e-9 && s.duration.is_none()));
}

/// Elevation of a place as seen from the true place at a second of the drive, deg.
fn elevation(drive: &Drive, second: usize, place: &Vector3<f64>) -> f64 {
    let [lat, lon, alt] = ["lat", "lon", "alt"].map(|name| truth(drive, name)[100 * second]);
    let here = Geodetic { lat, lon, alt }.to_ecef();
    let up = Vector3::new(lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin());
    (place - here).normalize().dot(&up).asin().to_degrees()
}

#[test]
fn the_fix_comes_from_the_raw_rows_and_faults_reach_it_through_them() {
    let faults = r#""stand_at_start": 300, "faults": [
        {"kind": "multipath", "start": 100, "duration": 20}, {"kind": "outage", "start": 150, "duration": 20},
        {"kind": "canyon", "start": 200, "duration": 20}, {"kind": "clock_jump", "start": 250}],"#;
    let mut simulation = Simulation::new(&spec(STRAIGHT, faults), None).unwrap();
    simulation.advance(290.0);
    let drive = simulation.drive();
    let seen = |t: f64| drive.raw_gnss.iter().find(|(time, _)| *time == t).map_or(&[][..], |(_, view)| view);
    for (time, fix) in drive.gnss.iter() {
        assert_eq!(fix.satellites, seen(time).len() as f64, "at {time}");
        assert_eq!(fix.is_usable(), fix.lat.is_finite());
        assert!(!fix.is_usable() || (fix.pdop > 1.0 && fix.pdop < 30.0));
    }
    assert!(seen(160.0).is_empty(), "no satellites during an outage");
    assert!(
        seen(210.0).len() < seen(199.0).len() && seen(210.0).iter().all(|s| elevation(drive, 210, &s.place) > 50.0)
    );
    // The satellites' own motion is below 1 km/s in range; the jump of 1 ms is 299.8 km.
    let clock = |t: f64| seen(t)[0].range - seen(t - 1.0)[0].range;
    assert!((clock(250.0) - 299_792.458).abs() < 1000.0 && clock(251.0).abs() < 1000.0);
    let error = |t: usize| {
        let (_, fix) = drive.gnss.at(t);
        let k = t * 100;
        let north = (fix.lat - truth(drive, "lat")[k]) * 6.36e6;
        let east = (fix.lon - truth(drive, "lon")[k]) * 5.13e6;
        (north * north + east * east + (fix.alt - truth(drive, "alt")[k]).powi(2)).sqrt()
    };
    let mean = |from: usize| (from..from + 20).map(error).sum::<f64>() / 20.0;
    assert!(mean(70) < 5.0 && mean(100) > mean(70) + 4.0, "{} {}", mean(70), mean(100));
    assert!(mean(252) < 5.0, "the fix does not care about the clock: {}", mean(252));
}

#[test]
fn a_fault_on_a_stretch_of_road_acts_there_and_nowhere_else() {
    let faults = r#""faults": [{"kind": "tunnel", "at": 100, "length": 80}, {"kind": "bias", "at": 200, "length": 20,
        "signal": "gyro_z", "size": 0.1}],"#;
    let (with, without) =
        (simulate(&spec(STRAIGHT, faults), None).unwrap(), simulate(&spec(STRAIGHT, ""), None).unwrap());
    // Straight to the north: what lies behind is the way north, some 2 cm off for the sensor's place on the pitching body.
    for (k, &north) in truth(&with, "n").iter().enumerate() {
        let inside = |from: f64, to: f64| (from + 0.1..to - 0.1).contains(&north);
        let outside = |from: f64, to: f64| north < from - 0.1 || north > to + 0.1;
        let shift = with.imu.at(k).1.gyro_z - without.imu.at(k).1.gyro_z;
        assert!(!inside(200.0, 220.0) || (shift - 0.1).abs() < 1e-12, "at {north} m: {shift}");
        assert!(!outside(200.0, 220.0) || shift == 0.0, "at {north} m: {shift}");
        let same = with.mag.at(k) == without.mag.at(k);
        assert!((!inside(100.0, 180.0) || !same) && (!outside(100.0, 180.0) || same), "at {north} m");
    }
    for (time, fix) in with.gnss.iter() {
        let north = truth(&with, "n")[(time * 100.0).round() as usize];
        assert!((north - 140.0).abs() > 39.0 || !fix.is_usable(), "at {north} m");
    }
    let both = r#""faults": [{"kind": "tunnel", "at": 100, "start": 80}],"#;
    assert_eq!(error(STRAIGHT, both), "`faults[0]`: `start` and `duration`, or `at` and `length` along the road");
    assert!(error(STRAIGHT, r#""faults": [{"kind": "tunnel"}],"#).contains("`start` and `duration`"));
}

#[test]
fn a_bias_and_a_frozen_sensor_begin_and_end_when_they_should_and_touch_nothing_else() {
    let faults = r#""stand_at_start": 2, "faults": [
        {"kind": "bias", "start": 5, "duration": 3, "signal": "gyro_z", "size": 0.1},
        {"kind": "freeze", "start": 6, "duration": 4, "signal": "speed"}],"#;
    let (with, without) = (
        simulate(&spec(STRAIGHT, faults), None).unwrap(),
        simulate(&spec(STRAIGHT, r#""stand_at_start": 2,"#), None).unwrap(),
    );
    for k in 0..with.imu.len() {
        let (t, a) = with.imu.at(k);
        let biased = (5.0..8.0).contains(&t);
        let expected = without.imu.at(k).1.gyro_z + if biased { 0.1 } else { 0.0 };
        assert_eq!((a.gyro_z, a.gyro_x), (expected, without.imu.at(k).1.gyro_x), "at {t}");
        let (frozen, free) = (with.wheels.at(k).1.speed, without.wheels.at(k).1.speed);
        assert_eq!(frozen, if (6.0..10.0).contains(&t) { without.wheels.at(600).1.speed } else { free }, "at {t}");
    }
}

#[test]
fn magnetic_faults_change_the_field_while_they_last() {
    let faults = r#""stand_at_start": 2, "sensors": "ideal", "faults": [{"kind": "bridge", "start": 4, "duration": 4},
        {"kind": "truck", "start": 10, "duration": 4}, {"kind": "tunnel", "start": 16, "duration": 4}],"#;
    let drive = simulate(&spec(STRAIGHT, faults), None).unwrap();
    let size = |t: usize| {
        let (_, m) = drive.mag.at(t * 100);
        (m.mag_x * m.mag_x + m.mag_y * m.mag_y + m.mag_z * m.mag_z).sqrt()
    };
    let still = size(1);
    // WMM at the built-in place: 50.35 uT.
    assert!((still - 50.35).abs() < 0.02 && (size(9) - still).abs() < 1e-9 && (size(15) - still).abs() < 1e-9);
    for peak in [6, 12, 18] {
        assert!((size(peak) - still).abs() > 1.0, "{}", size(peak) - still);
    }
}

#[test]
fn hard_and_soft_iron_distort_as_declared() {
    let iron =
        r#""sensors": "ideal", "iron": {"hard": [10, 0, -5], "soft": [[1.1, 0, 0], [0, 1, 0.05], [0, 0, 0.9]]},"#;
    let plain = simulate(&spec(STRAIGHT, r#""sensors": "ideal","#), None).unwrap();
    let drive = simulate(&spec(STRAIGHT, iron), None).unwrap();
    for k in (0..drive.mag.len()).step_by(50) {
        let (a, b) = (drive.mag.at(k).1, plain.mag.at(k).1);
        assert!((a.mag_x - (1.1 * b.mag_x + 10.0)).abs() < 1e-9);
        assert!((a.mag_y - (b.mag_y + 0.05 * b.mag_z)).abs() < 1e-9 && (a.mag_z - (0.9 * b.mag_z - 5.0)).abs() < 1e-9);
    }
}

#[test]
fn the_disk_reads_what_an_error_free_full_sensor_implies() {
    let more = |cluster: &str| format!(r#""sensors": "ideal", "roughness": "B", "cluster": "{cluster}","#);
    let corner = r#"{"length": 60, "speed_kmh": 40}, {"length": 18, "speed_kmh": 25, "turn_deg": 90}, {"length": 60, "speed_kmh": 40}"#;
    let full = simulate(&spec(corner, &more("full")), None).unwrap();
    let disk_drive = simulate(&spec(corner, &more("disk")), None).unwrap();
    assert!(!disk_drive.imu.series().has("accel_x") && disk_drive.imu.series().has("gyro_z"));
    for k in (2..full.imu.len()).step_by(7) {
        let rate = |k: usize| {
            let (_, i) = full.imu.at(k);
            Vector3::new(i.gyro_x, i.gyro_y, i.gyro_z)
        };
        let (_, i) = full.imu.at(k);
        let turning = (rate(k + 1 - usize::from(k + 1 == full.imu.len())) - rate(k - 1)) / 0.02;
        let y = disk::outputs(&Vector3::new(i.accel_x, i.accel_y, i.accel_z), &rate(k), &turning);
        let (_, d) = disk_drive.accel_array.at(k);
        // The change of the turn rate is differenced over two steps here: 0.1 m times what it misses.
        assert!((y[0] - d.acc6_1).abs() < 0.12 && (y[3] - d.acc6_4).abs() < 0.12, "{k}: {y:?} {d:?}");
    }
}

#[test]
fn the_ring_sees_the_post_and_the_driver_goes_round_it() {
    let spec = named("obstacle").unwrap();
    let drive = simulate(&spec, None).unwrap();
    let reading =
        |k: usize| (1..=12).map(|i| drive.range.column(&format!("range_{i}")).unwrap()[k]).fold(9.0, f64::min);
    let nearest = (0..drive.range.len()).map(reading).fold(9.0, f64::min);
    assert!((0.3..1.5).contains(&nearest), "{nearest}");
    assert_eq!(reading(0), 4.0, "10 m away");
    let clear =
        truth(&drive, "n").iter().zip(truth(&drive, "e")).map(|(n, e)| (n - 10.0).hypot(*e)).fold(9.0, f64::min);
    assert!(clear - 0.2 > 0.5, "{clear} m from the centre of the post");
    assert!(truth(&drive, "e").last().unwrap().abs() < 0.1, "back on the line");
}

#[test]
fn a_bump_is_felt_and_ice_on_one_side_turns_a_braking_car() {
    let felt = |more: &str| {
        let drive = simulate(&spec(STRAIGHT, &format!(r#""sensors": "ideal", {more}"#)), None).unwrap();
        drive.imu.iter().map(|(_, i)| i.accel_z + 9.8).fold(0.0_f64, |a, v| a.max(v.abs()))
    };
    let bump = felt(r#""bumps": [{"at": 150, "length": 3.7, "height": 0.05}],"#);
    assert!(bump > 1.5 && felt("") < 0.5, "{bump}");
    let yaw = |side: &str| {
        let text = std::format!(
            r#""start_speed_kmh": 60, "grip": [{{"at": 40, "length": 6, "share": 0.2, "side": "{side}"}}],
            "manoeuvre": {{"kind": "braking", "at": 30, "deceleration": 6}},"#
        );
        let drive = simulate(&spec(STRAIGHT, &text), None).unwrap();
        *truth(&drive, "yaw").last().unwrap()
    };
    // The side with grip holds the car back and turns it towards itself.
    assert!(yaw("right") < -0.01 && yaw("left") > 0.01, "{} {}", yaw("right"), yaw("left"));
}

#[test]
fn the_double_lane_change_reaches_the_side_lane_and_comes_back() {
    let drive = simulate(&DriveSpec { heading_deg: 0.0, ..named("dlc80_flat").unwrap() }, None).unwrap();
    let at = |n: f64| {
        let k = truth(&drive, "n").iter().position(|v| *v >= n).unwrap();
        truth(&drive, "e")[k]
    };
    // ISO 3888-1 from 150 m: side lane from 195 to 220 m at 3.5 m, back after 245 m.
    assert!(
        (at(207.0) + 3.5).abs() < 0.5 && at(160.0).abs() < 0.5 && at(290.0).abs() < 0.6,
        "{} {}",
        at(207.0),
        at(290.0)
    );
    let lateral =
        truth(&drive, "yaw_rate").iter().zip(truth(&drive, "vx")).map(|(r, v)| (r * v).abs()).fold(0.0, f64::max);
    assert!((4.0..9.0).contains(&lateral), "{lateral} m/s^2");
}

#[test]
fn an_open_loop_step_turns_the_wheels_as_declared_and_ends_in_a_stop() {
    let drive = simulate(&named("step_steer").unwrap(), None).unwrap();
    let steer = drive.steering.column("steer").unwrap();
    let largest = steer.iter().fold(0.0_f64, |a, v| a.max(*v));
    // Offset 0.01 rad and resolution 0.0017 rad at the steering wheel are 7e-4 rad at the road wheels, 1-sigma.
    assert!((largest - 1.5_f64.to_radians()).abs() < 3e-3, "{largest}");
    assert!(truth(&drive, "vx").last().unwrap().abs() < 0.05);
}
