//! What the road filters of `orientation` are for, on drives: a bank that the springs cannot see, and a magnetic field that
//! is not the Earth's. A failure means that bank goes into the suspension again, or that the gate lets steel through.
#![allow(clippy::unwrap_used)]

use std::sync::OnceLock;

use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;
use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::reference::TruthTable;
use drivescope_simulation::rng::Rng;
use drivescope_simulation::{named_with, simulate, simulate_measured};
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
    let seeds = [102, 1, 2, 3, 4];
    let spec = named_with("bank20_80", &json!({"parts": {"imu": "ideal"}})).unwrap();
    for (seed, simulated) in seeds.into_iter().zip(simulate_measured(&spec, &seeds.map(|s| (&spec, s))).unwrap()) {
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

/// Mean errors of pitch and yaw, deg, where the road climbs by 8 deg, with ideal inertial sensors and three seeds.
fn on_a_climb(heading_deg: usize, variant: &str) -> [[f64; 2]; 3] {
    let spec = named_with("hill80", &json!({"parts": {"imu": "ideal"}, "heading_deg": heading_deg})).unwrap();
    let drives = simulate_measured(&spec, &[1, 2, 3].map(|seed| (&spec, seed))).unwrap();
    let climb = |drive: &Drive, angle| {
        let times = drive.truth.time().iter().zip(drive.truth.column("grade").unwrap());
        let steep: Vec<f64> = times.filter(|(_, grade)| **grade > 0.138).map(|(t, _)| *t).collect();
        mean(&errors(drive, variant, angle, |t, _| (steep[0]..=steep[steep.len() - 1]).contains(&t)))
    };
    std::array::from_fn(|k| ["pitch", "yaw"].map(|angle| climb(&drives[k], angle)))
}

#[test]
fn on_a_climb_the_switch_errs_by_the_heading_and_robust_keeps_little_of_it() {
    // SPEC orientation 14, claim 4 and beyond: the static solution takes every road for one without grade. Printed are, for
    // `switch`, 0.00/-0.35 deg at magnetic north, -3.9/8.2 at 30 deg and -8.2/10.8 at magnetic east, where `robust` keeps -1.4/1.9: there
    // the field does not tell pitch from yaw, and what is kept is the chance of the start.
    let near = |found: [[f64; 2]; 3], printed: [f64; 2]| {
        found.iter().all(|f| f.iter().zip(printed).all(|(f, p)| (f - p).abs() <= 0.5))
    };
    let switch = [352, 30, 82].map(|heading| on_a_climb(heading, "switch"));
    let robust = [352, 30, 82].map(|heading| on_a_climb(heading, "robust"));
    println!("{switch:.2?} {robust:.2?}");
    assert!(
        near(switch[0], [0.0, -0.35]) && near(switch[1], [-3.9, 8.2]) && near(switch[2], [-8.2, 10.8]),
        "{switch:?}"
    );
    assert!(near(robust[0], [0.0, 0.0]) && near(robust[1], [0.0, 0.0]), "{robust:?}");
    // Twice what is printed: one draw of it.
    assert!(robust[2].iter().all(|[pitch, yaw]| pitch.abs() < 2.8 && yaw.abs() < 3.8), "{robust:?}");
}

/// The inertial sensors of the specification: noise of 0.1 deg/s and 0.05 m/s^2 in each sample and a gyro bias of 0.1 deg/s,
/// but no bias of the accelerometer.
fn with_specified_sensors(mut drive: Drive, seed: u64) -> Drive {
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

/// Errors of roll, pitch and yaw over their sigmas from 2 s on: root mean squares.
fn over_sigmas(drive: &Drive, variant: &str) -> [f64; 3] {
    let run = run_by_name("orientation", drive, &json!({ "variant": variant }), None).unwrap();
    let series = run.series();
    let mut truths = TruthTable::new(drive, series.time());
    ["roll", "pitch", "yaw"].map(|angle| {
        let truth = truths.get(angle).unwrap();
        let sigma = series.column(&format!("{angle}_sigma")).unwrap();
        let rows = series.time().iter().zip(series.column(angle).unwrap()).zip(sigma.iter().zip(truth));
        rms(rows.filter(|((t, _), _)| **t >= 2.0).map(|((_, e), (sigma, truth))| wrap_angle(e - truth) / sigma))
    })
}

/// What the truss bridge gives from one heading with one seed.
#[derive(Debug)]
struct Crossing {
    heading: usize,
    seed: u64,
    /// RMS of yaw, deg, with the sensors of the specification: `robust`, `road`; for three seeds.
    specified: Option<[f64; 2]>,
    /// With those of the drive, whose accelerometers are off by 0.1 m/s^2 (1-sigma): yaw of `robust_ax`, deg.
    forward: f64,
    /// Errors of `robust` over its sigmas.
    over_sigmas: [f64; 3],
}

fn crossings_from(heading: usize) -> Vec<Crossing> {
    let spec = |more| named_with("truss_bridge", &json!({"parts": more, "heading_deg": heading})).unwrap();
    let (own, ideal) = (spec(json!({})), spec(json!({"imu": "ideal"})));
    let by = [(&own, 1), (&own, 2), (&own, 3), (&own, 4), (&ideal, 1), (&ideal, 2), (&ideal, 3)];
    let mut drives = simulate_measured(&own, &by).unwrap();
    let mut ideals = drives.split_off(4).into_iter();
    let crossing = |(own, seed): (Drive, u64)| {
        let specified = ideals.next().map(|drive| with_specified_sensors(drive, seed));
        Crossing {
            heading,
            seed,
            specified: specified.map(|drive| ["robust", "road"].map(|variant| yaw(&drive, variant))),
            forward: yaw(&own, "robust_ax"),
            over_sigmas: over_sigmas(&own, "robust"),
        }
    };
    drives.into_iter().zip(1..).map(crossing).collect()
}

/// The truss bridge from twelve headings, driven once from each; half of them in a thread of their own.
fn crossings() -> &'static [Crossing] {
    static CROSSINGS: OnceLock<Vec<Crossing>> = OnceLock::new();
    CROSSINGS.get_or_init(|| {
        let from = |first: usize| (first..360).step_by(60).flat_map(crossings_from).collect::<Vec<_>>();
        std::thread::scope(|scope| {
            let half = scope.spawn(|| from(30));
            let mut all = from(0);
            all.extend(half.join().unwrap());
            all
        })
    })
}

#[test]
fn from_twelve_headings_the_gated_yaw_errs_by_less_than_2_deg_and_the_ungated_one_by_more_than_10() {
    // Requirement: 2 deg. Catches a gate that follows a truck's field before it shuts, and a start on noise where the
    // field lies across the car.
    let with_specified = crossings().iter().filter_map(|c| Some((c, c.specified?)));
    assert_eq!(with_specified.clone().count(), 36);
    for (Crossing { heading, seed, .. }, [robust, ungated]) in with_specified {
        println!("{heading} deg, seed {seed}: robust {robust:.2}, road {ungated:.1}");
        assert!(robust <= 2.0, "{heading} deg, seed {seed}: robust {robust}");
        assert!(ungated > 10.0, "{heading} deg, seed {seed}: road {ungated}");
    }
}

#[test]
fn with_a_biased_accelerometer_the_forward_one_keeps_the_yaw_within_2_deg_from_twelve_headings() {
    // `robust` cannot know that bias.
    for Crossing { heading, seed, forward, .. } in crossings() {
        assert!(*forward <= 2.0, "{heading} deg, seed {seed}: robust_ax {forward}");
    }
}

#[test]
fn what_a_biased_accelerometer_does_to_robust_is_as_large_as_its_sigmas_say() {
    // The bias is no state, but the walks of bank and grade leave room for it. Four seeds are four biases: the band of their RMS
    // is 0.35 to 1.67 (95 %). Catches walks or a field's variance that make the filter surer than a car's sensors allow.
    for (index, angle) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
        let found = rms(crossings().iter().map(|c| c.over_sigmas[index]));
        println!("{angle}: {found:.2} sigmas RMS");
        assert!((0.35..=1.67).contains(&found), "{angle}: {found} sigmas RMS");
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
