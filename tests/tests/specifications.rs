//! The case logs of the specifications, opened the way the page opens them, give the numbers of the reference
//! implementation. A failure means that reading, mapping, epochs or an estimator departs from its specification.
#![allow(clippy::unwrap_used)]

use drivescope_drive::channel::Series;
use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::score;
use drivescope_tests::{open, rms, rows_at, shared, table, worst};
use serde_json::{Value, json};

/// Stretches of time, s.
type Windows<'a> = &'a [(f64, f64)];

fn estimate(case: &std::path::Path, estimator: &str, params: &Value) -> (drivescope_drive::drive::Drive, Series) {
    let drive = open(case);
    let run = run_by_name(estimator, &drive, params, None).unwrap_or_else(|e| panic!("{}: {e}", case.display()));
    (drive, run.into_series())
}

#[test]
fn slope_cases_match_the_reference_column_by_column() {
    // Section 8: 1e-6 relative + 1e-7 absolute, forces 1e-3 N.
    const COLUMNS: [(&str, &str, f64); 16] = [
        ("e1_vx", "speed", 1e-7),
        ("e1_vy", "lateral_speed", 1e-7),
        ("e1_r", "yaw_rate", 1e-7),
        ("e1_fxf", "force_xf", 1e-3),
        ("e1_fyf", "force_yf", 1e-3),
        ("e1_fyr", "force_yr", 1e-3),
        ("e1_ax", "accel_x_estimated", 1e-7),
        ("e2_theta", "slope", 1e-7),
        ("e2_axnet", "accel_x_net", 1e-7),
        ("e2_sd", "slope_sigma", 1e-7),
        ("g_theta", "grade", 1e-7),
        ("g_pitch", "body_pitch", 1e-7),
        ("g_pitchrate", "body_pitch_rate", 1e-7),
        ("g_bias", "accel_bias", 1e-7),
        ("g_h", "altitude", 1e-7),
        ("g_sd", "grade_sigma", 1e-7),
    ];
    for case in ["b1_uphill15_gearshift", "b2_flat_accel_brake", "b3_slope_speedbump", "b4_mild_grade_accel_brake"] {
        let Some(log) = shared(&format!("spec/slope/{case}.csv.gz")) else { return };
        let Some(expected) = shared(&format!("spec/slope/expected/{case}.csv.gz")) else { return };
        let (expected, (_, series)) = (table(&expected), estimate(&log, "slope", &Value::Null));
        for (theirs, ours, absolute) in COLUMNS {
            let worst = worst(&series, ours, &expected["t"], &expected[theirs], 1e-6, absolute, false);
            assert!(worst <= 1.0, "{case} {ours}: {worst} times the tolerance");
        }
    }
}

#[test]
fn orientation_cases_match_the_reference_sample_by_sample() {
    // Section 13: 1e-6 rad sample-wise, 1e-5 behind the gate.
    for case in ["case1_flat_dlc80", "case2_bank20_straight80", "case3_hill80", "case4_mountain_dlc120"] {
        let Some(log) = shared(&format!("spec/orientation/{case}.csv.gz")) else { return };
        let Some(expected) = shared(&format!("spec/orientation/expected/{case}.csv.gz")) else { return };
        let expected = table(&expected);
        for variant in ["model", "triad", "ekf_nomodel", "ekf_model", "switch", "road", "robust", "robust_ax"] {
            let (_, series) = estimate(&log, "orientation", &json!({"variant": variant}));
            let limit = if variant.starts_with("robust") { 1e-5 } else { 1e-6 };
            for angle in ["roll", "pitch", "yaw"] {
                let theirs = &expected[&format!("{variant}_{angle}")];
                let worst = worst(&series, angle, &expected["t"], theirs, 0.0, limit, true);
                assert!(worst <= 1.0, "{case} {variant} {angle}: {worst} times {limit} rad");
            }
        }
    }
}

#[test]
fn motion_cases_match_the_reference_statistics_and_modes() {
    // Section 4: statistics 1e-8 relative + 1e-9; modes identical on every kept row.
    for case in ["c1_u_3acc3gyro", "c3_stopgo_3acc3gyro"] {
        let Some(log) = shared(&format!("spec/motion/{case}.csv.gz")) else { return };
        let Some(expected) = shared(&format!("spec/motion/expected/{case}.csv.gz")) else { return };
        let expected = table(&expected);
        let times = &expected["t"];
        for (adaptive, mode) in [(false, "mode"), (true, "mode_adaptive")] {
            let (drive, series) = estimate(&log, "motion_mode", &json!({"adaptive": adaptive}));
            for name in ["jd", "td", "fd", "yd"] {
                let worst = worst(&series, name, times, &expected[name], 1e-8, 1e-9, false);
                assert!(worst <= 1.0, "{case} {name}: {worst} times the tolerance");
            }
            let modes = series.column("mode").unwrap();
            let wrong =
                rows_at(&series, times).iter().zip(&expected[mode]).filter(|(row, e)| modes[**row] != **e).count();
            assert_eq!(wrong, 0, "{case} {mode}");
            let mode = score(&series, &drive, None).mode.unwrap();
            assert!(mode.accuracy >= 0.95 && mode.accuracy_guarded >= 0.98, "{case}: {mode:?}");
        }
    }
}

#[test]
fn land_navigation_cases_match_the_reference_from_the_first_row_to_the_last() {
    // Section 4: 1e-6 relative + 1e-5 over the whole run, with all modes and neither wheels nor satellites.
    const COLUMNS: [(&str, &str); 9] = [
        ("north", "n"),
        ("east", "e"),
        ("down", "d"),
        ("v_north", "vn"),
        ("v_east", "ve"),
        ("v_down", "vd"),
        ("roll", "roll"),
        ("pitch", "pitch"),
        ("yaw", "yaw"),
    ];
    for (case, yaw) in [("c1_u_3acc3gyro", 0.0), ("c3_stopgo_3acc3gyro", 0.7)] {
        let Some(log) = shared(&format!("spec/motion/{case}.csv.gz")) else { return };
        let Some(expected) = shared(&format!("spec/motion/expected/{case}.csv.gz")) else { return };
        let (expected, (_, series)) = (table(&expected), estimate(&log, "land_ins", &json!({"initial_yaw": yaw})));
        for (ours, theirs) in COLUMNS {
            let worst = worst(&series, ours, &expected["t"], &expected[theirs], 1e-6, 1e-5, ours == "yaw");
            assert!(worst <= 1.0, "{case} {ours}: {worst} times the tolerance");
        }
    }
}

/// Largest difference in position (m) and yaw (rad) at the reference's times outside the given windows.
fn navigation_difference(
    series: &Series,
    expected: &std::collections::BTreeMap<String, Vec<f64>>,
    faults: Windows,
) -> (f64, f64) {
    let times = &expected["t"];
    let rows = rows_at(series, times);
    let column = |name: &str| series.column(name).unwrap();
    let mut largest = (0.0f64, 0.0f64);
    for (k, &row) in rows.iter().enumerate() {
        if faults.iter().any(|f| times[k] >= f.0 && times[k] <= f.1) {
            continue;
        }
        let axis = |ours: &str, theirs: &str| column(ours)[row] - expected[theirs][k];
        let position = axis("north", "n").hypot(axis("east", "e")).hypot(axis("down", "d"));
        let yaw = drivescope_drive::frames::wrap_angle(axis("yaw", "yaw")).abs();
        assert!(position.is_finite() && yaw.is_finite(), "at {}", times[k]);
        largest = (largest.0.max(position), largest.1.max(yaw));
    }
    largest
}

#[test]
fn navigation_cases_match_the_reference_outside_faults() {
    // Section 13 (c): position within 0.02 m, yaw 0.02 deg outside faults. Faults of the urban drive: section 11; 20 s
    // after each are left out too, because an unaided run needs them to come back.
    let urban: Windows = &[(150.0, 210.0), (300.0, 380.0), (420.0, 500.0)];
    let (yaw_urban, yaw_table1) = (15f64.to_radians(), 30f64.to_radians());
    let cases: [(&str, &str, Value, Windows); 6] = [
        ("table1", "table1_loose", json!({"odometer": false, "nhc": false, "zupt": false, "zaru": false}), &[]),
        ("table1", "table1_loose_aided", json!({}), &[]),
        ("urban", "urban_loose", json!({"odometer": false, "nhc": false, "zupt": false, "zaru": false}), urban),
        ("urban", "urban_loose_nhc", json!({"odometer": false}), urban),
        ("urban", "urban_loose_aided", json!({}), urban),
        ("urban", "urban_loose_aided_nogate", json!({"gate": false}), urban),
    ];
    for (log, reference, mut params, faults) in cases {
        let Some(log_path) = shared(&format!("spec/navigation/{log}.csv.gz")) else { return };
        let Some(expected) = shared(&format!("spec/navigation/expected/{reference}.csv.gz")) else { return };
        params["initial_yaw"] = json!(if log == "urban" { yaw_urban } else { yaw_table1 });
        // The specification's filter begins with the gyros' biases unknown, whatever they read at rest.
        params["resting_gyro_bias"] = json!(false);
        let (_, series) = estimate(&log_path, "gnss_ins", &params);
        let (position, yaw) = navigation_difference(&series, &table(&expected), faults);
        assert!(position <= 0.02, "{reference}: position differs by {position} m");
        assert!(yaw.to_degrees() <= 0.02, "{reference}: yaw differs by {} deg", yaw.to_degrees());
    }
}

#[test]
fn aiding_and_gating_hold_the_urban_drive_through_outage_canyon_and_multipath() {
    let Some(log) = shared("spec/navigation/urban.csv.gz") else { return };
    let (drive, series) = estimate(&log, "gnss_ins", &json!({"initial_yaw": 15f64.to_radians()}));
    let (truth_n, truth_e) = (drive.truth.index_of("n").unwrap(), drive.truth.index_of("e").unwrap());
    let (north, east) = (series.column("north").unwrap(), series.column("east").unwrap());
    let errors = |window: (f64, f64)| -> Vec<f64> {
        (series.time().iter().enumerate())
            .filter(|(_, t)| **t >= window.0 && **t <= window.1)
            .map(|(row, &t)| {
                let (n, e) = (drive.truth.interpolate(truth_n, t, 0.1), drive.truth.interpolate(truth_e, t, 0.1));
                (north[row] - n).hypot(east[row] - e)
            })
            .collect()
    };
    // Section 10.5, row "loose + odo + NHC": rms and largest error, +-10 % or 0.05 m (section 13 d).
    for (name, window, expected_rms, expected_max) in [
        ("multipath", (150.0, 190.0), 0.69, 0.75),
        ("outage", (300.0, 360.0), 0.66, 0.88),
        ("canyon", (420.0, 480.0), 1.11, 1.20),
    ] {
        let errors = errors(window);
        let (rms, max) = (rms(errors.iter().copied()), errors.iter().copied().fold(0.0, f64::max));
        let near = |a: f64, b: f64| (a - b).abs() <= f64::max(0.1 * b, 0.05);
        assert!(near(rms, expected_rms) && near(max, expected_max), "{name}: rms {rms:.3}, max {max:.3}");
    }
}
