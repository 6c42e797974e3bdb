//! The closed loops of SPEC navigation 10 against the reference's tables and summaries (SPEC navigation 13 d, f, h).

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use drivescope_control::Pose;
use drivescope_drive::drive::Epoch;
use drivescope_estimation::gnss_ins::{GnssIns, GnssInsParams, KnownStart};
use drivescope_simulation::closed_loop::{ClosedLoop, Settings, Start};
use drivescope_tests::{shared, table};
use serde_json::json;

const GRAVITY: f64 = 9.80665;

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

fn run(scenario: &str, changes: serde_json::Value, seed: u64) -> ClosedLoop {
    let mut settings = Settings::named(scenario).unwrap();
    settings.set_all(&changes).unwrap();
    let mut run = ClosedLoop::new(settings, seed);
    let mut navigator = navigator(&run.start());
    while !run.advance(5.0, &mut navigator) {}
    run
}

#[test]
fn probe() {
    for (name, changes) in [
        ("jturn_none", json!({"yaw_target": "off"})),
        ("jturn_smc", json!({})),
        ("jturn_smc_nohold", json!({"hold_speed": false})),
        ("jturn_smc_mu08_model_mu1", json!({"road_friction": 0.8})),
        ("jturn_zero", json!({"yaw_target": "zero"})),
    ] {
        let run = run("j_turn", changes, 1);
        println!("{name} {:?}", run.summary());
        let Some(e) = expected(name) else { return };
        for (ours, theirs, f) in [
            ("yaw_rate", "r", 1.0),
            ("lateral_acceleration", "ay_g", GRAVITY),
            ("moment", "Mz", 1.0),
            ("lateral_speed", "vy", 1.0),
            ("brake_fr", "bFR", 1.0),
            ("surface", "s", 1.0),
            ("north", "n", 1.0),
        ] {
            let Some(t) = e.get(theirs) else { continue };
            let o = run.rows().column(ours).unwrap();
            let w = o.iter().zip(t).map(|(a, b)| (a / f - b).abs()).fold(0.0, f64::max);
            println!("   {ours} {w:.2e} ({} {})", o.len(), t.len());
        }
    }
    for nav in ["fixed_gain", "filter"] {
        for (target, lim) in [("off", 0.6), ("limited", 0.6), ("limited", 0.15)] {
            let mut sum = [0.0; 5];
            for seed in 1..=20 {
                let run = run("corner", json!({"navigation": nav, "yaw_target": target, "a_lim": lim * GRAVITY}), seed);
                let s = run.summary();
                for (a, b) in sum.iter_mut().zip([
                    s.max_cross_track,
                    s.rms_cross_track,
                    s.peak_lateral_g,
                    s.peak_sideslip_deg,
                    s.position_rms,
                ]) {
                    *a += b / 20.0;
                }
            }
            println!("{nav} {target} {lim} {sum:.3?}");
        }
    }
    for nav in ["fixed_gain", "filter"] {
        for radius in [0.0, 0.2] {
            let mut all: Vec<[f64; 5]> = Vec::new();
            for seed in 1..=40 {
                let run = run("obstacle_course", json!({"navigation": nav, "obstacle_radius": radius}), seed);
                let s = run.summary();
                all.push([
                    s.max_cross_track,
                    s.clearance,
                    s.return_distance,
                    s.late_cross_track,
                    s.late_max_cross_track,
                ]);
            }
            for (i, n) in ["max", "clr", "ret", "late", "latemax"].iter().enumerate() {
                let v: Vec<f64> = all.iter().map(|a| a[i]).filter(|v| v.is_finite()).collect();
                println!(
                    "{nav} {radius} {n} n {} mean {:.3} min {:.3} max {:.3}",
                    v.len(),
                    v.iter().sum::<f64>() / v.len() as f64,
                    v.iter().copied().fold(f64::INFINITY, f64::min),
                    v.iter().copied().fold(0.0, f64::max)
                );
            }
        }
    }
    for err in [0.7853981634, -0.34906585] {
        for nav in ["fixed_gain", "filter"] {
            for seed in 1..=5 {
                let run = run("goal", json!({"navigation": nav, "heading_error": err}), seed);
                let s = run.summary();
                println!("goal {nav} {err} miss {:.2} off {:.2} pos {:.2}", s.miss, s.max_cross_track, s.position_rms);
            }
        }
    }
    for car in ["yun_2007", "bmw_320i", "saloon", "vw_vanagon"] {
        for (v, st, lim, mz) in [(5.0, 0.0629, 0.15, 400.0), (20.0, 0.05, 0.4, 4000.0)] {
            for t in ["off", "limited"] {
                let run = run(
                    "j_turn",
                    json!({"plant": "six_dof", "car": car, "yaw_target": t, "V": v, "delta": st, "a_lim": lim * GRAVITY, "mz_max": mz}),
                    1,
                );
                let s = run.summary();
                println!(
                    "six {car} {v} {t} peak {:.3} end {:.3} Mz {:.0} beta {:.2} v {:.2} var {:.0}",
                    s.peak_lateral_g,
                    s.end_lateral_g,
                    s.peak_moment,
                    s.peak_sideslip_deg,
                    s.end_speed,
                    s.moment_variation
                );
            }
        }
        for nav in ["truth", "filter"] {
            let run = run("obstacle_course", json!({"plant": "six_dof", "car": car, "navigation": nav}), 1);
            let s = run.summary();
            println!(
                "six {car} obstacle {nav} max {:.2} clr {:.2} ret {:.1} late {:.2} {:.2} pos {:.3}",
                s.max_cross_track,
                s.clearance,
                s.return_distance,
                s.late_cross_track,
                s.late_max_cross_track,
                s.position_rms
            );
            let run = crate::run("corner", json!({"plant": "six_dof", "car": car, "navigation": nav}), 1);
            let s = run.summary();
            println!(
                "six {car} corner {nav} max {:.2} rms {:.2} g {:.3} beta {:.2} pos {:.3}",
                s.max_cross_track, s.rms_cross_track, s.peak_lateral_g, s.peak_sideslip_deg, s.position_rms
            );
        }
    }
    for phi in [0.0, 0.002, 0.01, 0.02, 0.05] {
        let s = run("j_turn", json!({"Phi": phi}), 1).summary();
        println!(
            "Phi {phi} variation {:.0} peak {:.4} end {:.4}",
            s.moment_variation, s.peak_lateral_g, s.end_lateral_g
        );
    }
}
