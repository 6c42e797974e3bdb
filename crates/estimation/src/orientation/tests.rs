//! The orientation estimator against the reference of SPEC orientation 13, and against bad input.

use drivescope_drive::drive::Drive;
use drivescope_drive::frames::body_to_nav;
use drivescope_drive::param::Choice;
use drivescope_drive::signals::{Imu, Mag, Wheels};
use nalgebra::{Matrix3, Matrix5};
use serde_json::Value;

use super::road_model::RoadModel;
use super::*;
use crate::case_log::{Table, shared};

const CASES: [&str; 4] = ["case1_flat_dlc80", "case2_bank20_straight80", "case3_hill80", "case4_mountain_dlc120"];
const VARIANTS: [Variant; 8] = [
    Variant::Model,
    Variant::Triad,
    Variant::EkfNoModel,
    Variant::EkfModel,
    Variant::Switch,
    Variant::Road,
    Variant::Robust,
    Variant::RobustAx,
];

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

/// The tolerance of the specification for the same order of operations in double precision, rad.
fn tolerance(variant: Variant) -> f64 {
    if matches!(variant, Variant::Robust | Variant::RobustAx) { 1e-5 } else { 1e-6 }
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
                    let limit = tolerance(variant);
                    assert!(error <= limit, "{name} {} t {t}: {value} reference {}", variant.name(), wanted[row]);
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

#[test]
fn suspension_road_bias_and_gate_are_those_of_the_reference() {
    for name in CASES {
        let Some((drive, expected)) = case(name) else { return };
        let out = run(&drive, &with(Variant::Robust));
        for (column, pick) in [
            ("robust_roll_susp", (|e| e.suspension_roll) as fn(&OrientationEstimate) -> f64),
            ("robust_pitch_susp", |e| e.suspension_pitch),
            ("robust_bank", |e| e.road_bank),
            ("robust_grade", |e| e.road_grade),
            ("robust_gyro_bias", |e| e.gyro_bias),
            ("robust_mag_status", |e| e.gate),
        ] {
            for ((t, e), wanted) in out.iter().zip(expected.column(column)) {
                assert!((pick(e) - wanted).abs() <= 1e-5, "{name} {column} t {t}: {} reference {wanted}", pick(e));
            }
        }
    }
}

/// Steady stretch of each case, s, its end not included (SPEC orientation 13).
const STEADY: [(f64, f64); 4] = [(20.0, 25.0), (10.0, 20.0), (8.5, 11.5), (37.0, 42.0)];

/// Root mean square, mean over the steady stretch and largest error from 2 s on, deg.
fn errors(
    out: &[(f64, OrientationEstimate)],
    truth: &[f64],
    steady: (f64, f64),
    pick: fn(&OrientationEstimate) -> f64,
) -> [f64; 3] {
    let (mut squares, mut count, mut sum, mut steadies, mut largest) = (0.0, 0.0, 0.0, 0.0, 0.0f64);
    for ((t, e), truth) in out.iter().zip(truth).filter(|((t, e), _)| *t >= 2.0 && pick(e).is_finite()) {
        let error = wrap_angle(pick(e) - truth).to_degrees();
        (squares, count, largest) = (squares + error * error, count + 1.0, largest.max(error.abs()));
        if (steady.0..steady.1).contains(t) {
            (sum, steadies) = (sum + error, steadies + 1.0);
        }
    }
    [f64::sqrt(squares / count), sum / steadies, largest]
}

#[test]
fn the_four_cases_reach_every_number_of_the_printed_table() {
    let Some(spec) = shared("spec/orientation/SPEC.md") else { return };
    let spec = std::fs::read_to_string(spec).unwrap();
    let mut compared = 0;
    for (index, name) in CASES.into_iter().enumerate() {
        let Some((drive, _)) = case(name) else { return };
        for variant in VARIANTS {
            let key = format!("| case{} | {} |", index + 1, variant.name());
            let line = spec.lines().find(|l| l.starts_with(&key)).unwrap();
            let printed: Vec<f64> =
                line[key.len()..].split(['|', '/']).filter_map(|cell| cell.trim().parse().ok()).collect();
            let out = run(&drive, &with(variant));
            let of = |truth: &str, pick| errors(&out, drive.truth.column(truth).unwrap(), STEADY[index], pick);
            let angles = [of("roll", |e| e.roll), of("pitch", |e| e.pitch), of("yaw", |e| e.yaw)];
            let mut found: Vec<f64> = (0..3).flat_map(|statistic| angles.map(|a| a[statistic])).collect();
            found.push(of("sideslip", |e| e.sideslip)[0]);
            if printed.len() > found.len() {
                found.extend([of("bank", |e| e.road_bank)[0], of("grade", |e| e.road_grade)[0]]);
            }
            assert_eq!(printed.len(), found.len(), "{line}");
            for (found, printed) in found.iter().zip(&printed) {
                // Half a unit of the table's last digit, and a little for the log's own rounding.
                assert!((found - printed).abs() <= 0.0052, "{name} {}: {found} table {printed}", variant.name());
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 4 * (5 * 10 + 3 * 12));
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
    for v in vectors["cone"].as_array().unwrap() {
        let field = Vector3::from_vec(numbers(&v["B"]));
        let pitch = v["pitch_ref"].as_f64().unwrap();
        let found = cone::gravity_on_cone(&field, v["fy"].as_f64().unwrap(), &reference, pitch);
        if v["cond"].as_f64().unwrap() >= 0.15 {
            assert_close(found.unwrap().as_slice(), &v["u"], "cone");
        } else {
            assert!(found.is_none());
        }
    }
    let s = Suspension::new(&VehicleParams::default());
    let m = RoadModel::new(&OrientationParams::default(), &VehicleParams::default());
    for v in vectors["jac"].as_array().unwrap() {
        let [yaw_rate, accel_y, change] = ["r", "fy", "vd"].map(|n| v[n].as_f64().unwrap());
        let u = Input { yaw_rate, accel_y, pitch: PitchDrive::Derived(change) };
        let x = Vector5::from_vec(numbers(&v["x5"]));
        assert_close(model::sprung_rates(&x, &u, &s, Rates::Euler).as_slice(), &v["f5"], "f5");
        let j: Matrix5<f64> = model::sprung_jacobian(&x, &u, &s, Rates::Euler).transpose();
        assert_close(j.as_slice(), &v["F5"], "F5");
        let x = road_model::State::from_vec(numbers(&v["x9"]));
        let point = road_model::Point::new(&x, &u, &m);
        assert_close(road_model::rates(&x, &point, &u, &m).as_slice(), &v["f9"], "f9");
        let j = road_model::dense(&road_model::jacobian(&point, &u, &m)).transpose();
        assert_close(j.as_slice(), &v["F9"], "F9");
    }
}

fn level(time: f64, yaw: f64, speed: f64) -> Epoch<'static> {
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
    let start = LogStart { imu_step: 0.01, ..LogStart::UNKNOWN };
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
fn a_filter_that_started_in_a_disturbed_field_finds_its_way_back() {
    // Catches a gate that shuts the truth out for good: started 2 rad off, as beside a steel door.
    // Without the gate the filter bends the grade instead: the field and the lateral force have two solutions.
    for variant in [Variant::Robust, Variant::RobustAx] {
        let mut o = fresh(variant);
        for k in 0..100 {
            o.step(&level(k as f64 * 0.01, 0.5, 0.0)).unwrap();
        }
        let out = (100..4000).map(|k| o.step(&level(k as f64 * 0.01, 2.5, 0.0)).unwrap().unwrap());
        let out: Vec<OrientationEstimate> = out.collect();
        let last = out[3899];
        assert!((last.yaw - 2.5).abs() < 0.02 && last.roll.abs() < 0.02, "{} {last:?}", variant.name());
        assert_eq!(out[10].gate, 2.0);
        assert!(out[10].field_nis.is_nan() && out[10].gate_reason > 0.0, "a field left out is no innovation");
    }
}

/// Worst roll and pitch after a field that turns about the car by up to `turn` in a second and then gets too strong.
fn led_astray(hindsight: f64) -> f64 {
    let params = OrientationParams { gate_hindsight: hindsight, ..with(Variant::Robust) };
    let start = LogStart { imu_step: 0.01, ..LogStart::UNKNOWN };
    let mut o = Orientation::new(&params, &VehicleParams::default(), &start);
    let mut worst = 0.0f64;
    for k in 0..1000 {
        let mut e = level(k as f64 * 0.01, 0.5, 20.0);
        let grown = (k as f64 * 0.01 - 8.0).max(0.0);
        if let Some(m) = &mut e.mag {
            m.mag_z -= 25.0 * grown;
            m.mag_x += 25.0 * grown;
        }
        let out = o.step(&e).unwrap().unwrap();
        if out.gate == 2.0 {
            worst = worst.max(out.roll.abs()).max(out.pitch.abs());
        }
    }
    worst.to_degrees()
}

#[test]
fn when_the_gate_shuts_the_fields_of_the_last_moments_are_taken_back() {
    let (kept, taken_back) = (led_astray(0.0), led_astray(0.5));
    assert!(kept > 3.0 && taken_back < 0.5 * kept, "{kept} deg, {taken_back} deg");
}

#[test]
fn a_start_with_the_field_across_the_car_is_level() {
    // Noise of 0.05 m/s^2 in one sample is worth 6 deg of the cone's pitch there.
    let mut o = fresh(Variant::Robust);
    let mut e = level(0.0, 1.55, 20.0);
    if let Some(imu) = &mut e.imu {
        imu.accel_y = 0.1;
    }
    let out = o.step(&e).unwrap().unwrap();
    assert!(out.pitch.abs() < 0.02, "{}", out.pitch.to_degrees());
}

#[test]
fn without_fresh_inputs_the_lateral_force_is_not_explained_and_driving_is_not_static() {
    let mut o = fresh(Variant::Robust);
    let mut last = o.step(&level(0.0, 0.5, 20.0)).unwrap().unwrap();
    for k in 1..200 {
        let mut e = level(k as f64 * 0.01, 0.5, 20.0);
        if k > 100
            && let Some(imu) = &mut e.imu
        {
            imu.gyro_z = f64::NAN;
        }
        last = o.step(&e).unwrap().unwrap();
        // Held for 0.2 s; twenty sums of 0.01 may lie on either side.
        assert!(last.lateral_nis.is_finite() || k >= 120, "{k}");
        assert!(last.lateral_nis.is_nan() || k <= 121, "{k}");
    }
    assert_eq!(last.is_static, 0.0, "a missing yaw rate is not a small one");
}

#[test]
fn a_lost_yaw_and_a_missing_forward_accelerometer_are_said() {
    // Catches a gate that stays shut without a word. The bias of the gyro is not learned in a second: 0.3 deg/s lose 10 deg
    // in half a minute.
    let said = |o: &Orientation, text: &str| o.notices().list().iter().find(|n| n.text == text).map(|n| n.first);
    for variant in [Variant::Robust, Variant::RobustAx] {
        let mut o = fresh(variant);
        for k in 0..6000 {
            let mut e = level(k as f64 * 0.01, 0.5, 20.0);
            if let (Some(m), Some(imu)) = (&mut e.mag, &mut e.imu) {
                m.mag_z += if k > 100 { 30.0 } else { 0.0 };
                imu.accel_x = if k < 3000 { 0.0 } else { f64::NAN };
            }
            let out = o.step(&e).unwrap().unwrap();
            assert_eq!(out.yaw_sigma > 10f64.to_radians(), said(&o, LOST).is_some(), "{k}");
        }
        let first = said(&o, LOST).unwrap();
        assert!((20.0..60.0).contains(&first), "{first}");
        // Held for 0.2 s.
        assert_eq!(
            said(&o, NO_FORWARD).map(|t| (t * 5.0).round() / 5.0),
            (variant == Variant::RobustAx).then_some(30.2)
        );
    }
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
    assert!(o.notices().list().iter().any(|n| n.text == RESTARTED));
    let mut o = fresh(Variant::Robust);
    o.step(&level(0.0, 1.0, 0.0)).unwrap().unwrap();
    if let Some(Filter::Road(f)) = &mut o.filter {
        f.p[(3, 3)] = -1.0;
    }
    assert!(o.step(&level(0.01, 1.0, 0.0)).unwrap().unwrap().road_bank.is_nan());
    assert!((o.step(&level(0.02, 1.0, 0.0)).unwrap().unwrap().yaw - 1.0).abs() < 1e-9);
}
