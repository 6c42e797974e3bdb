//! The attitude filter on the urban case log of SPEC navigation, and what it does with damaged input.

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;

use super::*;
use crate::case_log::navigation_case;

fn run(drive: &Drive, params: &AttitudeParams) -> Series {
    crate::estimator::run::<Attitude>(drive, params, None).unwrap().into_series()
}

/// Root mean square error of a column from `from` on, deg.
fn rms(drive: &Drive, estimates: &Series, name: &str, from: f64) -> f64 {
    let truth = drive.truth.index_of(name).unwrap();
    let (mut sum, mut count) = (0.0, 0);
    for (row, &t) in estimates.time().iter().enumerate().filter(|(_, t)| **t >= from) {
        let error = wrap_angle(estimates.column(name).unwrap()[row] - drive.truth.interpolate(truth, t, 0.1));
        assert!(error.is_finite(), "{name} at {t}");
        sum += error * error;
        count += 1;
    }
    (sum / f64::from(count)).sqrt().to_degrees()
}

/// SPEC navigation 10.7: yaw 0.16, pitch 0.08, roll 0.08 deg after 48 s, from a start yaw wrong by 5 deg; to 0.05 deg.
#[test]
fn the_urban_drive_is_as_good_as_the_references() {
    let Some(drive) = navigation_case("urban") else { return };
    let yaw = drive.truth.column("yaw").unwrap()[900] + 5f64.to_radians();
    let estimates = run(&drive, &AttitudeParams { initial_yaw: yaw, ..AttitudeParams::default() });
    let measured = ["yaw", "pitch", "roll"].map(|name| rms(&drive, &estimates, name, 48.0));
    println!("yaw, pitch, roll: {measured:.3?} deg");
    for (ours, theirs) in measured.iter().zip([0.16, 0.08, 0.08]) {
        assert!(*ours < theirs + 0.05, "{measured:?}");
    }
    // Honest: the mean of (error / sigma)^2 of the angles is near 1, that of the height accelerometer too, with the local gravity.
    let score = crate::score::score(&estimates, &drive, Some((48.0, 600.0)));
    for name in ["roll", "pitch", "yaw", "accel_bias_z"] {
        let nees = score.metrics.iter().find(|m| m.column == name).and_then(|m| m.nees).unwrap();
        assert!(nees > 0.05 && nees < 1.5, "{name} {nees}");
    }
}

/// Speed and course of the satellites alone, once a second, and no start yaw: the same drive to half a degree.
#[test]
fn without_odometer_and_start_yaw_the_satellites_do() {
    let Some(mut drive) = navigation_case("urban") else { return };
    drive.wheels = Default::default();
    let estimates = run(&drive, &AttitudeParams::default());
    let known = estimates.column("yaw").unwrap().iter().position(|v| v.is_finite()).unwrap();
    assert!((20.0..24.0).contains(&estimates.time()[known]), "{}", estimates.time()[known]);
    let measured = ["yaw", "pitch", "roll"].map(|name| rms(&drive, &estimates, name, 48.0));
    println!("satellites only: {measured:.3?} deg");
    assert!(measured.iter().all(|v| *v < 0.5), "{measured:?}");
}

fn epoch(time: f64, speed: f64, accel: Vector3<f64>, gyro: Vector3<f64>) -> Epoch<'static> {
    let imu =
        Imu { accel_x: accel.x, accel_y: accel.y, accel_z: accel.z, gyro_x: gyro.x, gyro_y: gyro.y, gyro_z: gyro.z };
    let wheels = drivescope_drive::signals::Wheels { speed, ..Default::default() };
    Epoch { time, imu: Some(imu), wheels: Some(wheels), ..Epoch::default() }
}

const START: LogStart = LogStart { imu_step: 0.01, ..LogStart::UNKNOWN };

/// A parked car nose up and left side high, with gyro biases: levelled, and its biases are those of the gyros.
#[test]
fn a_parked_car_is_levelled_and_its_gyro_biases_are_found() {
    let mut estimator = Attitude::new(&AttitudeParams::default(), &VehicleParams::default(), &START);
    let force =
        drivescope_drive::frames::body_to_nav(0.05, 0.08, 1.0).transpose() * Vector3::new(0.0, 0.0, -STANDARD_GRAVITY);
    let mut last = None;
    for k in 0..3000 {
        let sample = epoch(f64::from(k) * 0.01, 0.0, force, Vector3::new(1e-3, -2e-3, 3e-3));
        last = estimator.step(&sample).unwrap().or(last);
    }
    let row = last.unwrap();
    assert!((row.roll - 0.05).abs() < 1e-6 && (row.pitch - 0.08).abs() < 1e-6 && row.yaw.is_nan());
    assert!((row.gyro_bias_x - 1e-3).abs() < 1e-9 && (row.gyro_bias_z - 3e-3).abs() < 1e-9);
}

/// A car that stands on its nose has no yaw: no row beyond 89 deg instead of numbers without meaning, and a fresh start.
#[test]
fn a_pitch_beyond_its_range_starts_anew() {
    let mut estimator = Attitude::new(&AttitudeParams::default(), &VehicleParams::default(), &START);
    let level = Vector3::new(0.0, 0.0, -STANDARD_GRAVITY);
    let mut without = 0;
    for k in 0..400 {
        let (gyro, speed) = if k < 50 { (0.0, 0.0) } else { (0.6, 5.0) };
        let row = estimator.step(&epoch(f64::from(k) * 0.01, speed, level, Vector3::new(0.0, gyro, 0.0))).unwrap();
        assert!(row.is_none_or(|row| row.pitch.abs() < LARGEST_PITCH));
        without += usize::from(k > 50 && row.is_none());
    }
    assert_eq!(without, 1);
    assert!(estimator.notices().list().iter().any(|n| n.text.contains("pitch")));
}

#[test]
fn hostile_samples_never_enter_the_state() {
    let values = [f64::NAN, f64::INFINITY, -1e300, 1e9, 300.0];
    let mut estimator = Attitude::new(&AttitudeParams::default(), &VehicleParams::default(), &START);
    let mut time = 0.0;
    for k in 0..20_000usize {
        time += if k % 3001 == 3000 { 7.0 } else { 0.01 };
        let mut accel = Vector3::new(0.0, 0.0, -STANDARD_GRAVITY);
        let mut gyro = Vector3::zeros();
        if k % 7 == 3 {
            accel[k % 3] = values[k % 5];
        }
        if k % 11 == 5 {
            gyro[k % 3] = values[k % 5];
        }
        let speed = if k % 13 == 0 { values[k % 3] } else { if k < 500 { 0.0 } else { 10.0 } };
        if let Some(row) = estimator.step(&epoch(time, speed, accel, gyro)).unwrap() {
            assert!(row.roll.is_finite() && row.pitch_sigma.is_finite() && row.gyro_bias_x.is_finite(), "{k} {row:?}");
        }
    }
}
