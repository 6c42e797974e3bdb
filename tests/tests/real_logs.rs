//! Real logs, when they are on the machine: they open without a word of configuration and give believable numbers.
#![allow(clippy::unwrap_used)]

use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::score;
use drivescope_tests::{open, rms, shared};
use serde_json::{Value, json};

const RAV4: &str = "data/comma2k19_rav4/canonical.csv";

#[test]
fn the_motorway_drive_gives_the_road_grade_from_wheels_and_accelerometer_alone() {
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    let run = run_by_name("slope", &drive, &json!({"use_baro": false, "use_gnss": false}), None).unwrap();
    // The limits, over every row from the first on. Without the check for shakes 0.947 and 0.64 deg: the rear axle
    // crosses a bump at 1.4 s, and its wheels swing by 0.3 m/s.
    let grade = score(run.series(), &drive, None).metrics.into_iter().find(|m| m.column == "grade").unwrap();
    let rms = grade.rmse_centred.to_degrees();
    println!("every row: correlation {:.4}, {rms:.3} deg once the mount offset is removed", grade.correlation);
    assert!(grade.correlation >= 0.955, "correlation {:.4}", grade.correlation);
    assert!(rms <= 0.58, "{rms:.3} deg once the mount offset is removed");
}

#[test]
fn the_motorway_drive_stays_on_the_road() {
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    let run = run_by_name("gnss_ins", &drive, &Value::Null, None).unwrap();
    let position = score(run.series(), &drive, None).position.unwrap();
    assert!(position.rmse_horizontal <= 5.0, "{:.2} m RMS", position.rmse_horizontal);
}

#[test]
fn the_motorway_drive_is_navigated_by_modes_with_satellites_and_with_wheels() {
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    let error = |params: &Value| {
        let run = run_by_name("land_ins", &drive, params, None).unwrap();
        let position = score(run.series(), &drive, None).position.unwrap();
        println!("{params}: {:.2} m RMS, at the end {:.1} m", position.rmse_horizontal, position.last);
        position.rmse_horizontal
    };
    let plain = json!({"zupt": false, "zaru": false, "nhc": false, "straight": false});
    let (plain, modes, wheel) = (error(&plain), error(&Value::Null), error(&json!({"wheel": true})));
    let satellites = error(&json!({"gnss": true}));
    assert!(satellites <= 5.0 && wheel <= modes && modes <= plain, "{satellites} {wheel} {modes} {plain}");
}

#[test]
fn the_motorway_drive_is_straight_throughout() {
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    let run = run_by_name("motion_mode", &drive, &Value::Null, None).unwrap();
    let modes = run.series().column("mode").unwrap();
    assert_eq!(modes.iter().filter(|m| **m != 1.0).count(), 0, "of {} rows", modes.len());
}

#[test]
fn latitude_in_radians_under_a_name_that_promises_degrees_is_found_by_physics() {
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    let frame = drivescope_drive::geodesy::LocalFrame::new(drive.origin().unwrap());
    let places: Vec<_> = drive.gnss.iter().filter(|(_, g)| g.lat.is_finite()).collect();
    let length: f64 = places
        .windows(2)
        .map(|w| {
            let at = |g: &drivescope_drive::signals::Gnss| {
                frame.to_ned(drivescope_drive::geodesy::Geodetic { lat: g.lat, lon: g.lon, alt: g.alt })
            };
            (at(&w[1].1) - at(&w[0].1)).xy().norm()
        })
        .sum();
    let speed = rms(places.iter().map(|(_, g)| g.ground_speed()).filter(|v| v.is_finite()));
    let time = places.last().unwrap().0 - places[0].0;
    assert!((length / (speed * time) - 1.0).abs() < 0.1, "{length:.0} m in {time:.0} s at {speed:.1} m/s");
}
