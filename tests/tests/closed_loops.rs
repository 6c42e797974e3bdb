//! The closed loops of SPEC navigation 10 against the reference's tables and summaries (SPEC navigation 13 d, f, h).
//!
//! A failure here means that a controller, a plant or the tyre no longer does what the specification's reference does.
//! Runs with noise have other random numbers than the reference: their means over 20 seeds are compared.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use drivescope_control::Pose;
use drivescope_control::tyre::{LateralTyre, SHAPE, TyreName};
use drivescope_drive::drive::Epoch;
use drivescope_estimation::gnss_ins::{GnssIns, GnssInsParams, KnownStart};
use drivescope_simulation::closed_loop::{ClosedLoop, Settings, Start, Summary};
use drivescope_simulation::fingerprint;
use drivescope_tests::{shared, table};
use serde_json::{Value, json};

const GRAVITY: f64 = 9.80665;
const SEEDS: u64 = 20;

fn expected(name: &str) -> Option<BTreeMap<String, Vec<f64>>> {
    Some(table(&shared(&format!("spec/navigation/expected/{name}.csv.gz"))?))
}

/// The GNSS/INS filter from what may be known, as the command closes the loop.
fn navigator(start: &Start) -> impl FnMut(&Epoch) -> Option<Pose> + use<> {
    let params = GnssInsParams { initial_yaw_sigma: start.yaw_sigma.min(1.571), ..GnssInsParams::default() };
    let Start { time, place, velocity, body_to_nav, .. } = *start;
    let mut filter = GnssIns::from_known(&params, &KnownStart { time, place, velocity, body_to_nav });
    move |epoch| filter.planar(epoch).map(Pose::from)
}

fn run(scenario: &str, changes: Value, seed: u64) -> ClosedLoop {
    let mut settings = Settings::named(scenario).unwrap();
    settings.set_all(&changes).unwrap();
    let mut run = ClosedLoop::new(settings, seed);
    let mut navigator = navigator(&run.start());
    while !run.advance(60.0, &mut navigator) {}
    run
}

fn summaries(scenario: &str, changes: Value) -> Vec<Summary> {
    (1..=SEEDS).map(|seed| run(scenario, changes.clone(), seed).summary()).collect()
}

fn mean(runs: &[Summary], of: fn(&Summary) -> f64) -> f64 {
    runs.iter().map(of).sum::<f64>() / runs.len() as f64
}

/// SPEC navigation 13 (d): within 10 % or 0.05.
fn is_close(value: f64, reference: f64) -> bool {
    (value - reference).abs() <= (0.1 * reference.abs()).max(0.05)
}

#[test]
fn tyre_forces_match_the_reference() {
    let Some(t) = expected("tyre") else { return };
    let sets = [TyreName::Table2, TyreName::Table2A5Fix, TyreName::Bakker1987];
    for row in 0..t["fz"].len() {
        let curve = LateralTyre::named(sets[t["set"][row] as usize]).curve(t["fz"][row], 1.0);
        let angle = t["alpha_deg"][row].to_radians();
        // The table's longitudinal slip is -0.05 throughout: its ratio of forces says so.
        let (fx, fy) = curve.combined(-0.05, angle);
        let pairs = [
            ("B", curve.stiffness_factor.to_radians()),
            ("D", curve.peak),
            ("E", curve.curvature),
            ("BCD", (curve.stiffness_factor * SHAPE * curve.peak).to_radians()),
            ("fy", curve.force(angle)),
            ("fx_comb", fx),
            ("fy_comb", fy),
        ];
        for (name, ours) in pairs {
            let theirs = t[name][row];
            assert!((ours - theirs).abs() <= 1e-6 * theirs.abs(), "row {row}, {name}: {ours} instead of {theirs}");
        }
    }
}

#[test]
fn j_turn_series_match_the_reference_sample_by_sample() {
    let cases = [
        ("jturn_none", json!({"yaw_target": "off"})),
        ("jturn_smc", json!({})),
        ("jturn_smc_nohold", json!({"hold_speed": false})),
        ("jturn_smc_mu08_model_mu1", json!({"road_friction": 0.8})),
        ("jturn_zero", json!({"yaw_target": "zero"})),
        ("jturn_a5fix_none", json!({"yaw_target": "off", "model_tyre": "table2_a5fix"})),
        ("jturn_a5fix_smc", json!({"model_tyre": "table2_a5fix"})),
    ];
    // Half of the last printed digit, a hundred times less than the 1e-3 g asked for; printed with six figures.
    let columns = [
        ("delta", "steer", 1.0, 1e-6),
        ("vx", "speed", 1.0, 1e-5),
        ("vy", "lateral_speed", 1.0, 1e-6),
        ("r", "yaw_rate", 1.0, 1e-6),
        ("ay_g", "lateral_acceleration", GRAVITY, 1e-6),
        ("Mz", "moment", 1.0, 1e-3),
        ("s", "surface", 1.0, 1e-6),
        ("rd", "yaw_rate_reference", 1.0, 1e-6),
        ("bFL", "brake_fl", 1.0, 1e-3),
        ("bFR", "brake_fr", 1.0, 1e-3),
        ("bRL", "brake_rl", 1.0, 1e-3),
        ("bRR", "brake_rr", 1.0, 1e-3),
    ];
    for (name, changes) in cases {
        let Some(t) = expected(name) else { return };
        let is_controlled = name.contains("smc");
        let run = run("j_turn", changes, 1);
        assert_eq!(run.rows().len(), t["t"].len(), "{name}");
        for (theirs, ours, unit, tolerance) in columns {
            if !is_controlled && matches!(theirs, "s" | "rd") {
                continue;
            }
            let column = run.rows().column(ours).unwrap();
            let worst = column.iter().zip(&t[theirs]).map(|(a, b)| (a / unit - b).abs()).fold(0.0, f64::max);
            assert!(worst <= tolerance, "{name}, {ours}: {worst}");
        }
    }
}

#[test]
fn j_turn_summaries_are_those_of_the_table() {
    // SPEC navigation 10.3: peak g, end g, peak moment, peak sideslip; half of the last digit.
    let rows = [
        (json!({"yaw_target": "off"}), 0.200, 0.200, 0.0, 1.70),
        (json!({}), 0.150, 0.150, 400.0, 0.84),
        (json!({"hold_speed": false}), 0.130, 0.101, 400.0, 0.64),
        (json!({"road_friction": 0.8}), 0.150, 0.150, 400.0, 0.84),
        (json!({"yaw_target": "zero"}), 0.045, 0.000, 332.0, 1.73),
        (json!({"yaw_target": "off", "model_tyre": "table2_a5fix"}), 0.2005, 0.2005, 0.0, 1.49),
        (json!({"model_tyre": "table2_a5fix"}), 0.159, 0.159, 400.0, 1.42),
    ];
    for (changes, peak, end, moment, sideslip) in rows {
        let s = run("j_turn", changes.clone(), 1).summary();
        let found = [s.peak_lateral_g - peak, s.end_lateral_g - end].map(f64::abs);
        assert!(found.iter().all(|d| *d <= 6e-4), "{changes}: {s:?}");
        assert!(
            (s.peak_moment - moment).abs() <= 0.5 && (s.peak_sideslip_deg - sideslip).abs() <= 0.01,
            "{changes}: {s:?}"
        );
    }
}

#[test]
fn the_boundary_layer_ends_the_chattering_and_costs_next_to_nothing() {
    let [switching, layered] = [0.0, 0.02].map(|phi| run("j_turn", json!({"Phi": phi}), 1).summary());
    // Measured: 27.7 kN m/s of ups and downs of the moment asked for without the layer, 0.19 with it.
    assert!(switching.moment_variation > 50.0 * layered.moment_variation, "{switching:?} {layered:?}");
    assert!((switching.end_lateral_g - layered.end_lateral_g).abs() < 1e-3);
    // Between a rise to the limit, a reversal and the settled moment there is no more than 2 kN m in 10 s.
    assert!(layered.moment_variation < 200.0, "{}", layered.moment_variation);
}

#[test]
fn tracking_the_yaw_rate_cuts_the_path_error_in_the_corner_and_limiting_it_does_not() {
    // SPEC navigation 10.4: largest and rms offset, peak g, peak sideslip, for no control, tracking, limiting to 0.15 g.
    let controls = [json!({"yaw_target": "off"}), json!({"a_lim": 0.6 * GRAVITY}), json!({"a_lim": 0.15 * GRAVITY})];
    let table: [(&str, [[f64; 4]; 3]); 3] = [
        ("truth", [[1.18, 0.63, 0.287, 4.66], [0.22, 0.11, 0.186, 1.93], [2.05, 0.89, 0.164, 1.93]]),
        ("fixed_gain", [[1.24, 0.62, 0.290, 4.65], [0.25, 0.12, 0.200, 2.13], [2.10, 0.91, 0.166, 1.87]]),
        ("filter", [[1.35, 0.68, 0.291, 4.68], [0.26, 0.13, 0.208, 2.22], [2.22, 0.99, 0.176, 1.84]]),
    ];
    for (navigation, rows) in table {
        for (control, reference) in controls.iter().zip(rows) {
            let mut changes = control.clone();
            changes["navigation"] = json!(navigation);
            let runs = if navigation == "truth" {
                vec![run("corner", changes, 1).summary()]
            } else {
                summaries("corner", changes)
            };
            let columns: [fn(&Summary) -> f64; 4] =
                [|s| s.max_cross_track, |s| s.rms_cross_track, |s| s.peak_lateral_g, |s| s.peak_sideslip_deg];
            for (of, theirs) in columns.into_iter().zip(reference) {
                let ours = mean(&runs, of);
                let variance = runs.iter().map(|s| (of(s) - ours).powi(2)).sum::<f64>() / runs.len() as f64;
                // The reference's noisy rows are means of three seeds, known no better than this.
                let standard_error = (variance / 3.0).sqrt();
                let tolerance = (0.1 * theirs).max(0.05) + standard_error;
                assert!((ours - theirs).abs() <= tolerance, "{navigation} {control}: {ours} instead of {theirs}");
            }
        }
    }
}

#[test]
fn the_obstacle_is_passed_and_the_line_found_again_with_a_perfect_estimate() {
    let s = run("obstacle_course", json!({"navigation": "truth"}), 1).summary();
    // SPEC navigation 10.2.
    for (ours, theirs) in
        [(s.max_cross_track, 2.10), (s.clearance, 0.82), (s.return_distance, 29.8), (s.late_cross_track, 0.08)]
    {
        assert!(is_close(ours, theirs), "{ours} instead of {theirs}: {s:?}");
    }
}

#[test]
fn the_obstacle_is_passed_with_the_filter_whatever_the_noise() {
    // SPEC navigation 13 (h): clearance above 0.35 m, offset below 0.5 m beyond 38 m.
    let runs = summaries("obstacle_course", json!({}));
    for (seed, s) in runs.iter().enumerate() {
        assert!(s.clearance > 0.35 && s.late_max_cross_track < 0.5, "seed {}: {s:?}", seed + 1);
    }
    // SPEC navigation 10.2, row c: the mean return lies at 29.0 m; ours may lie in its 10 %.
    assert!(is_close(mean(&runs, |s| s.return_distance), 29.0), "{}", mean(&runs, |s| s.return_distance));
    // Row b, without the filter: 29.9 m in the mean; the filter narrows the spread (2.5 against 8.2 m) and not the mean. A run
    // that does not find the line again within the 50 m has no distance.
    let without = summaries("obstacle_course", json!({"navigation": "fixed_gain"}));
    let back: Vec<f64> = without.iter().map(|s| s.return_distance).filter(|d| d.is_finite()).collect();
    let average = back.iter().sum::<f64>() / back.len() as f64;
    let spread = |distances: &mut dyn Iterator<Item = f64>| {
        let (low, high) = distances.fold((f64::MAX, f64::MIN), |(low, high), d| (low.min(d), high.max(d)));
        high - low
    };
    let (with, alone) = (spread(&mut runs.iter().map(|s| s.return_distance)), spread(&mut back.iter().copied()));
    println!(
        "without the filter: {average:.2} m in {} of {SEEDS}, spread {alone:.1} m; with it {with:.1} m",
        back.len()
    );
    assert!(back.len() as u64 >= SEEDS - 2 && is_close(average, 29.9), "{back:?}");
    assert!(with < alone, "{with} {alone}");
}

#[test]
fn the_filter_halves_the_error_of_fixed_gains_on_the_free_line() {
    // SPEC navigation 10.2: largest offset 0.22 to 0.44 m without the filter, 0.11 to 0.25 m (mean 0.17) with it.
    let free =
        |navigation: &str| summaries("obstacle_course", json!({"navigation": navigation, "obstacle_radius": 0.0}));
    let (fixed, filter) = (free("fixed_gain"), free("filter"));
    let [fixed, filter] = [&fixed, &filter].map(|runs| mean(runs, |s| s.max_cross_track));
    assert!((0.22..=0.44).contains(&fixed), "{fixed}");
    assert!((0.11..=0.25).contains(&filter), "{filter}");
    assert!(filter < 0.65 * fixed, "{filter} {fixed}");
}

#[test]
fn the_goal_is_reached_from_a_wrong_heading_but_not_along_the_line() {
    // SPEC navigation 10.1: miss 0.37 m; off the line by 0.68 m (45 deg) and 1.94 m (-20 deg) in one run each.
    for heading in [45.0_f64, -20.0] {
        let runs = summaries("goal", json!({"heading_error": heading.to_radians()}));
        let miss = mean(&runs, |s| s.miss);
        assert!(miss < 0.5 && runs.iter().all(|s| s.miss < 1.2), "{heading}: {miss}");
        assert!(mean(&runs, |s| s.max_cross_track) > 0.5, "{heading}");
        assert!(runs.iter().all(|s| s.end_speed < 1e-9), "{heading}: the car stands at the goal");
    }
}

#[test]
fn on_six_degrees_of_freedom_the_limit_holds_and_the_obstacle_is_passed() {
    let turn = |target: &str| {
        let changes = json!({
            "plant": "six_dof", "car": "bmw_320i", "V": 20.0, "delta": 0.05, "yaw_target": target,
            "a_lim": 0.4 * GRAVITY, "mz_max": 4000.0
        });
        run("j_turn", changes, 1).summary()
    };
    let (free, held) = (turn("off"), turn("limited"));
    // The reference settles at the limit; the model's tyres are not the plant's, the boundary layer lets 10 % through.
    assert!(free.end_lateral_g > 0.6 && held.end_lateral_g < 0.44, "{free:?} {held:?}");
    assert!(held.peak_sideslip_deg < free.peak_sideslip_deg);
    for car in ["yun_2007", "bmw_320i", "saloon", "vw_vanagon"] {
        let s = run("obstacle_course", json!({"plant": "six_dof", "car": car}), 1).summary();
        assert!(s.clearance > 0.35 && s.late_max_cross_track < 0.5, "{car}: {s:?}");
    }
}

#[test]
fn a_car_that_turns_over_ends_the_run_with_finite_rows() {
    // Table 2's car at 20 m/s with a step of 0.05 rad: 1.1 g on a track of 0.8 m.
    let changes = json!({"plant": "six_dof", "V": 20.0, "delta": 0.05, "yaw_target": "off"});
    let run = run("j_turn", changes, 1);
    assert!(run.has_failed() && run.is_done() && run.time() < 9.0);
    let rows = run.rows();
    assert!(rows.column("lateral_acceleration").unwrap().iter().all(|v| v.is_finite()));
}

#[test]
fn a_loop_is_the_same_run_at_once_or_in_slices_and_its_drive_opens_in_the_filter() {
    let whole = run("obstacle_course", json!({}), 3);
    let mut sliced = ClosedLoop::new(Settings::named("obstacle_course").unwrap(), 3);
    let mut navigator = navigator(&sliced.start());
    let mut last = 0.0;
    while !sliced.advance(0.37, &mut navigator) {
        assert!(sliced.fraction() > last && sliced.fraction() < 1.0);
        last = sliced.fraction();
    }
    assert_eq!(sliced.rows(), whole.rows());
    assert_eq!(fingerprint(sliced.drive()), fingerprint(whole.drive()));
    assert_eq!(sliced.magnitudes().len(), 72 * sliced.guidance().len());
    assert!(sliced.blocked().contains(&1) && sliced.blocked().len() == sliced.magnitudes().len());
    let estimate = drivescope_estimation::registry::run_by_name("gnss_ins", whole.drive(), &json!({}), None).unwrap();
    assert!(estimate.series().len() > 4000);
}
