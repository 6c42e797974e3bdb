//! What the road filters of `orientation` are for, on drives: a bank that the springs cannot see, and a magnetic field that
//! is not the Earth's. A failure means that bank goes into the suspension again, or that the gate lets steel through.
#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;
use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::reference::TruthTable;
use drivescope_simulation::rng::Rng;
use drivescope_simulation::{named_with, simulate};
use drivescope_tests::{open, rms, shared};
use serde_json::json;

fn built_in(name: &str, changes: serde_json::Value) -> Drive {
    simulate(&named_with(name, &changes).unwrap(), None).unwrap()
}

/// Errors of an angle from 2 s on, deg, where `keep(time, bank)`.
fn errors(drive: &Drive, variant: &str, angle: &str, keep: impl Fn(f64, f64) -> bool) -> Vec<f64> {
    let run = run_by_name("orientation", drive, &json!({ "variant": variant }), None).unwrap();
    let series = run.series();
    let mut truths = TruthTable::new(drive, series.time());
    let bank = truths.get("bank").unwrap().to_vec();
    let truth = truths.get(angle).unwrap();
    let rows = series.time().iter().zip(bank).zip(series.column(angle).unwrap().iter().zip(truth));
    rows.filter(|((t, bank), _)| **t >= 2.0 && keep(**t, *bank))
        .map(|(_, (e, truth))| wrap_angle(e - truth).to_degrees())
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn a_bank_of_20_deg_leaves_the_robust_roll_without_a_steady_error() {
    // Requirement: 0.3 deg. The suspension model is 16 deg off there: it reads the bank as a lean.
    // Simulated here without the accelerometer's bias, which no filter on these sensors can know; see below.
    let on_bank = |_: f64, bank: f64| bank > 19.9f64.to_radians();
    for seed in [102, 1, 2, 3, 4] {
        let simulated = built_in("bank20_80", json!({"parts": {"imu": "ideal"}, "seed": seed}));
        let steady = mean(&errors(&simulated, "robust", "roll", on_bank));
        println!("seed {seed}: {steady}");
        assert!(steady.abs() <= 0.3, "simulated here, seed {seed}: {steady}");
        assert!(mean(&errors(&simulated, "ekf_model", "roll", on_bank)) < -10.0);
    }
    let Some(log) = shared("spec/orientation/case2_bank20_straight80.csv.gz") else { return };
    let steady = mean(&errors(&open(&log), "robust", "roll", |t, _| (10.0..20.0).contains(&t)));
    assert!(steady.abs() <= 0.3, "case log: {steady}");
}

#[test]
fn a_biased_lateral_accelerometer_tilts_the_robust_roll_by_its_bias_over_g() {
    // What the filter cannot know: 0.1 m/s^2 is 0.58 deg. Catches a bias that is amplified or, on the level, ignored.
    let level = built_in("dlc80_flat", json!({"parts": {"imu": "ideal"}, "heading_deg": 8}));
    let fault = json!([{"kind": "bias", "start": 0, "duration": 1000, "signal": "accel_y", "size": 0.1}]);
    let biased = built_in("dlc80_flat", json!({"parts": {"imu": "ideal"}, "heading_deg": 8, "faults": fault}));
    let steady = |drive: &Drive| mean(&errors(drive, "robust", "roll", |t, _| (15.0..35.0).contains(&t)));
    let tilt = steady(&biased) - steady(&level);
    assert!((-0.75..-0.4).contains(&tilt), "{tilt}");
}

/// The drive with the inertial sensors of the specification: noise of 0.1 deg/s and 0.05 m/s^2 in each sample and a gyro
/// bias of 0.1 deg/s, but no bias of the accelerometer.
fn truss_bridge(heading: usize, seed: u64) -> Drive {
    let mut drive = built_in("truss_bridge", json!({"parts": {"imu": "ideal"}, "heading_deg": heading, "seed": seed}));
    let mut rng = Rng::new(seed, "sensors of the specification");
    for row in 0..drive.imu.len() {
        let (_, mut imu) = drive.imu.at(row);
        imu.gyro_z += (0.1 + 0.1 * rng.normal()).to_radians();
        imu.accel_y += 0.05 * rng.normal();
        drive.imu.replace(row, imu);
    }
    drive
}

fn yaw(drive: &Drive, variant: &str) -> f64 {
    rms(errors(drive, variant, "yaw", |_, _| true))
}

#[test]
fn from_twelve_headings_the_gated_yaw_errs_by_less_than_2_deg_and_the_ungated_one_by_more_than_10() {
    // Requirement: 2 deg. Catches a gate that follows a truck's field before it shuts, and a start on noise where the
    // field lies across the car.
    for heading in (0..360).step_by(30) {
        for seed in 1..=3 {
            let drive = truss_bridge(heading, seed);
            let (robust, ungated) = (yaw(&drive, "robust"), yaw(&drive, "road"));
            println!("{heading} deg, seed {seed}: robust {robust:.2}, road {ungated:.1}");
            assert!(robust <= 2.0, "{heading} deg, seed {seed}: robust {robust}");
            assert!(ungated > 10.0, "{heading} deg, seed {seed}: road {ungated}");
        }
    }
}

#[test]
fn with_a_biased_accelerometer_the_forward_one_keeps_the_yaw_within_2_deg_from_twelve_headings() {
    // Sensors of stability control, whose accelerometers are off by 0.1 m/s^2 (1-sigma): `robust` cannot know that.
    for heading in (0..360).step_by(30) {
        for seed in 1..=2 {
            let drive = built_in("truss_bridge", json!({"heading_deg": heading, "seed": seed}));
            let found = yaw(&drive, "robust_ax");
            assert!(found <= 2.0, "{heading} deg, seed {seed}: robust_ax {found}");
        }
    }
}

#[test]
fn a_truss_bridge_trucks_and_a_tunnel_move_the_gated_yaw_by_less_than_2_deg_and_the_ungated_one_by_more_than_10() {
    let drive = built_in("truss_bridge", json!({}));
    let (robust, with_accel_x, ungated) = (yaw(&drive, "robust"), yaw(&drive, "robust_ax"), yaw(&drive, "road"));
    assert!(robust <= 2.0, "robust: {robust}");
    assert!(with_accel_x <= 2.0, "robust_ax: {with_accel_x}");
    assert!(ungated > 10.0, "road: {ungated}");
}
