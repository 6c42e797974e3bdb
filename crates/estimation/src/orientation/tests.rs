//! The orientation estimator against the reference of SPEC orientation 13, and against bad input.

use drivescope_drive::drive::Drive;
use drivescope_drive::frames::body_to_nav;
use drivescope_drive::param::Choice;
use drivescope_drive::signals::{Imu, Mag, Wheels};
use nalgebra::{Matrix3, Matrix5};
use serde_json::Value;

use super::*;
use crate::case_log::{Table, shared};

const CASES: [&str; 4] = ["case1_flat_dlc80", "case2_bank20_straight80", "case3_hill80", "case4_mountain_dlc120"];
const VARIANTS: [Variant; 5] =
    [Variant::Model, Variant::Triad, Variant::EkfNoModel, Variant::EkfModel, Variant::Switch];

fn with(variant: Variant) -> OrientationParams {
    OrientationParams { variant, ..OrientationParams::default() }
}

fn run(drive: &Drive, params: &OrientationParams) -> Vec<(f64, OrientationEstimate)> {
    let mut estimator = Orientation::new(params, &VehicleParams::default(), &drive.start());
    drive.epochs().filter_map(|e| estimator.step(&e).unwrap().map(|out| (e.time, out))).collect()
}

fn case(name: &str) -> Option<(Drive, Table)> {
    let log = shared(&format!("spec/orientation/{name}.csv.gz"))?;
    let expected = shared(&format!("spec/orientation/expected/{name}.csv.gz"))?;
    Some((Table::read(&log).drive(), Table::read(&expected)))
}

#[test]
fn the_four_cases_match_the_reference_sample_by_sample() {
    for name in CASES {
        let Some((drive, expected)) = case(name) else { return };
        for variant in VARIANTS {
            let out = run(&drive, &with(variant));
            let wanted = ["roll", "pitch", "yaw"].map(|angle| expected.column(&format!("{}_{angle}", variant.name())));
            assert_eq!(out.len(), wanted[0].len(), "{name} {}", variant.name());
            let mut worst = 0.0f64;
            for (row, (t, e)) in out.iter().enumerate() {
                for (value, wanted) in [e.roll, e.pitch, e.yaw].into_iter().zip(wanted) {
                    let error = wrap_angle(value - wanted[row]).abs();
                    // The tolerance of the specification for the same order of operations in double precision.
                    assert!(error <= 1e-6, "{name} {} t {t}: {value} reference {}", variant.name(), wanted[row]);
                    worst = worst.max(error);
                }
                if variant == Variant::Switch {
                    assert_eq!(e.is_static, expected.column("switch_mode")[row], "{name} mode at {t}");
                }
            }
            assert!(worst > 0.0, "{name} {}: printed digits always differ", variant.name());
        }
    }
}

/// RMS roll, pitch, yaw and sideslip in degrees over t >= 2 s, in the order of `VARIANTS` (SPEC orientation 13).
const TABLE: [[[f64; 4]; 5]; 4] = [
    [
        [0.02, 0.01, 1.32, 1.35],
        [7.02, 3.77, 11.07, 11.08],
        [1.11, 0.92, 1.87, 1.89],
        [0.12, 0.12, 0.08, 0.23],
        [0.32, 0.31, 0.68, 0.68],
    ],
    [
        [15.99, 0.27, 1.85, 1.89],
        [0.33, 0.33, 0.70, 0.68],
        [1.30, 1.03, 2.12, 2.15],
        [16.26, 4.39, 25.30, 25.20],
        [0.33, 0.33, 0.70, 0.68],
    ],
    [
        [0.02, 5.89, 1.58, 1.59],
        [2.90, 2.38, 5.01, 4.95],
        [0.78, 0.63, 1.29, 1.31],
        [1.32, 2.95, 3.40, 3.39],
        [2.90, 2.38, 5.01, 4.95],
    ],
    [
        [4.51, 4.21, 2.76, 2.78],
        [4.98, 5.73, 10.64, 10.67],
        [1.46, 1.96, 3.20, 3.22],
        [2.58, 2.70, 4.77, 4.76],
        [2.57, 2.70, 4.82, 4.80],
    ],
];

#[test]
fn the_four_cases_reach_the_printed_rms_errors() {
    for (name, table) in CASES.into_iter().zip(TABLE) {
        let Some((drive, _)) = case(name) else { return };
        for (variant, wanted) in VARIANTS.into_iter().zip(table) {
            let out = run(&drive, &with(variant));
            let rms = |truth: &str, pick: fn(&OrientationEstimate) -> f64| {
                let truth = drive.truth.column(truth).unwrap();
                let errors = (out.iter().zip(truth))
                    .filter(|((t, e), _)| *t >= 2.0 && pick(e).is_finite())
                    .map(|((_, e), truth)| wrap_angle(pick(e) - truth).to_degrees());
                let (sum, count) = errors.fold((0.0, 0.0), |(s, n), e| (s + e * e, n + 1.0));
                f64::sqrt(sum / count)
            };
            let found = [
                rms("roll", |e| e.roll),
                rms("pitch", |e| e.pitch),
                rms("yaw", |e| e.yaw),
                rms("sideslip", |e| e.sideslip),
            ];
            for (found, wanted) in found.into_iter().zip(wanted) {
                // Half a unit of the table's last digit, and a little for the log's own rounding.
                assert!((found - wanted).abs() <= 0.0052, "{name} {} {found} table {wanted}", variant.name());
            }
        }
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

fn assert_close(found: &[f64], wanted: &Value, what: &str) {
    let wanted = numbers(wanted);
    assert_eq!(found.len(), wanted.len(), "{what}");
    let scale = wanted.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    for (f, w) in found.iter().zip(&wanted) {
        // 1e-9 relative by the specification; an element that cancels is held to the largest one's rounding.
        assert!((f - w).abs() <= 1e-9 * w.abs() + 1e-15 * scale, "{what}: {f} reference {w}");
    }
}

#[test]
fn points_of_the_reference_are_met_to_nine_digits() {
    let Some(path) = shared("spec/orientation/expected/vectors.json") else { return };
    let vectors: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let rows = |m: &Matrix3<f64>| m.transpose().as_slice().to_vec();
    for v in vectors["dcm"].as_array().unwrap() {
        let a = numbers(&v["att"]);
        let attitude = Euler { roll: a[0], pitch: a[1], yaw: a[2] };
        assert_close(&rows(&body_to_nav(a[0], a[1], a[2]).transpose()), &v["C"], "C");
        let by_axis = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| attitude::predicted_field(&attitude, &e).1);
        let derivatives: Vec<f64> =
            (0..3).flat_map(|k| rows(&Matrix3::from_columns(&by_axis.map(|j| j.column(k).into_owned())))).collect();
        assert_close(&derivatives, &v["d"], "dC");
    }
    let reference = Vector3::from_vec(numbers(&vectors["H"]));
    for v in vectors["triad"].as_array().unwrap() {
        let down = pseudo_gravity(v["fy"].as_f64().unwrap()).unwrap();
        let e = Triad::new(&reference).attitude(&Vector3::from_vec(numbers(&v["B"])), &down).unwrap();
        assert_close(&[e.roll, e.pitch, e.yaw], &v["euler"], "TRIAD");
    }
    let s = Suspension::new(&VehicleParams::default());
    for v in vectors["jac"].as_array().unwrap() {
        let [yaw_rate, accel_y, change] = ["r", "fy", "vd"].map(|n| v[n].as_f64().unwrap());
        let u = Input { yaw_rate, accel_y, pitch: PitchDrive::Derived(change) };
        let x = Vector5::from_vec(numbers(&v["x5"]));
        assert_close(model::sprung_rates(&x, &u, &s, Rates::Euler).as_slice(), &v["f5"], "f5");
        let j: Matrix5<f64> = model::sprung_jacobian(&x, &u, &s, Rates::Euler).transpose();
        assert_close(j.as_slice(), &v["F5"], "F5");
    }
}

fn level(time: f64, yaw: f64, speed: f64) -> Epoch {
    let field = body_to_nav(0.0, 0.0, yaw).transpose() * Vector3::new(30.11237, -4.22703, 40.12585);
    Epoch {
        time,
        imu: Some(Imu { gyro_z: 0.0, accel_x: 0.0, accel_y: 0.0, accel_z: -GRAVITY, ..Imu::default() }),
        mag: Some(Mag { mag_x: field.x, mag_y: field.y, mag_z: field.z }),
        wheels: Some(Wheels { speed, ..Wheels::default() }),
        ..Epoch::default()
    }
}

fn fresh(variant: Variant) -> Orientation {
    let start = LogStart { imu_step: 0.01, speed: f64::NAN, origin: None, rear_axle: None, disk: None };
    Orientation::new(&with(variant), &VehicleParams::default(), &start)
}

#[test]
fn a_level_parked_car_shows_level_and_its_heading_in_every_variant() {
    for variant in VARIANTS {
        let mut o = fresh(variant);
        for k in 0..300 {
            let e = o.step(&level(k as f64 * 0.01, 2.0, 0.0)).unwrap().unwrap();
            assert!(e.roll.abs() < 1e-9 && e.pitch.abs() < 1e-9 && (e.yaw - 2.0).abs() < 1e-9, "{}", variant.name());
            assert!(e.field_norm_error.abs() < 1e-12 && e.dip_error.abs() < 1e-8);
        }
    }
}

#[test]
fn a_slow_magnetometer_is_used_once_per_sample_and_unused_sensors_change_nothing() {
    let mut o = fresh(Variant::EkfModel);
    let mut used = 0;
    for k in 0..200 {
        let t = k as f64 * 0.01;
        let mut e = level(t, 0.5, 10.0);
        if k % 10 != 0 {
            e.mag = None;
        }
        // A magnetic sample between two inertial ones waits for the next one.
        if k % 10 == 5 {
            let between = Epoch { time: t - 0.005, mag: level(t, 0.5, 0.0).mag, ..Epoch::default() };
            assert!(o.step(&between).unwrap().is_none());
        }
        let unused = Epoch { time: t - 0.002, baro: Some(Default::default()), ..Epoch::default() };
        assert!(o.step(&unused).unwrap().is_none());
        let out = o.step(&e).unwrap().unwrap();
        used += usize::from(out.field_nis.is_finite());
        assert!((out.yaw - 0.5).abs() < 1e-9);
    }
    assert_eq!(used, 40, "twenty samples on the instant and twenty between");
}

#[test]
fn bad_input_never_leaves_a_state_that_is_not_finite() {
    let nan = f64::NAN;
    for variant in VARIANTS {
        let mut o = fresh(variant);
        let mut blind = level(0.0, 1.0, 5.0);
        blind.mag = Some(Mag { mag_x: nan, mag_y: 1.0, mag_z: 0.0 });
        assert!(o.step(&blind).unwrap().is_none(), "no attitude before the first field");
        let mut k = 1;
        for hostile in [nan, f64::INFINITY, -1e300, 1e9, 0.0] {
            for field in [hostile, 25.0] {
                for dt in [0.01, 0.0, -1.0, 2.0] {
                    k += 1;
                    let mut e = level(k as f64 * 0.01 + dt, 1.0, hostile);
                    e.imu = Some(Imu { gyro_z: hostile, accel_x: hostile, accel_y: hostile, ..Imu::default() });
                    e.mag = Some(Mag { mag_x: field, mag_y: hostile, mag_z: 40.0 });
                    if let Some(out) = o.step(&e).unwrap() {
                        let values = [out.roll, out.pitch, out.yaw];
                        assert!(values.iter().all(|v| v.is_finite()), "{} {hostile}", variant.name());
                    }
                }
            }
        }
        let later = (0..200).map(|k| o.step(&level(100.0 + k as f64 * 0.01, 1.0, 0.0)).unwrap()).last().unwrap();
        let later = later.unwrap();
        assert!(later.roll.abs() < 1e-3 && (later.yaw - 1.0).abs() < 1e-3, "{} recovers", variant.name());
    }
}

#[test]
fn an_attitude_that_leaves_its_range_starts_again_from_the_vectors() {
    let mut o = fresh(Variant::EkfModel);
    o.step(&level(0.0, 1.0, 0.0)).unwrap().unwrap();
    if let Some(Filter::Sprung(f)) = &mut o.filter {
        f.x[0] = f64::NAN;
    }
    let held = o.step(&level(0.01, 1.0, 0.0)).unwrap().unwrap();
    assert!(held.yaw.is_finite() && held.yaw_sigma.is_nan());
    let after = o.step(&level(0.02, 1.0, 0.0)).unwrap().unwrap();
    assert!((after.yaw - 1.0).abs() < 1e-9 && after.yaw_sigma > 0.0);
    assert_eq!(o.notices().list()[0].text, RESTARTED);
}
