//! The door, in a worker of a real browser: blinded runs with their drift, the sweep, faults, errors as curves.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used)]

use drivescope_simulation::drives;
use drivescope_wasm::Session;
use js_sys::{Array, JSON};
use wasm_bindgen::prelude::*;
use wasm_bindgen_test::*;

mod support;

use support::{get, text, with};

wasm_bindgen_test_configure!(run_in_dedicated_worker);

const BLIND: &str = "gnss_ins@blind";
/// A minute in the middle of the first built-in drive, in which its own receiver sees satellites.
const WINDOW: [f64; 2] = [200.0, 260.0];

fn number(object: &JsValue, key: &str) -> f64 {
    get(object, key).as_f64().unwrap()
}

fn no_params() -> JsValue {
    JSON::parse("{}").unwrap()
}

fn is_done(progress: Result<JsValue, JsError>) -> bool {
    get(&progress.map_err(text).unwrap(), "done").as_bool().unwrap()
}

fn finish(session: &mut Session, run: &str) {
    while !is_done(session.run_some(run, 50.0)) {}
}

/// The first built-in drive, estimated.
fn estimated() -> Session {
    let mut session = with(drives()[0].name);
    session.begin_run("gnss_ins", no_params(), None).map_err(text).unwrap();
    finish(&mut session, "gnss_ins");
    session
}

/// Drift of a run with some sensors blind in the window: that at the window's end, m.
fn drift(session: &mut Session, sensors: &[&str]) -> f64 {
    let names = sensors.iter().map(|s| (*s).to_owned()).collect();
    let flat = WINDOW.repeat(sensors.len());
    session.begin_blind_run(BLIND, no_params(), None, names, &flat).map_err(text).unwrap();
    finish(session, BLIND);
    let drifts = Array::from(&session.drift(BLIND, "gnss_ins", &WINDOW).map_err(text).unwrap());
    assert_eq!(drifts.length(), 1);
    let drift = drifts.get(0);
    assert!(number(&drift, "driven") > 100.0);
    let at = Array::from(&get(&drift, "at"));
    assert_eq!(at.iter().map(|a| number(&a, "after")).collect::<Vec<_>>(), [10.0, 30.0, 60.0]);
    assert!(number(&drift, "largest") >= number(&at.get(2), "distance"));
    number(&at.get(2), "distance")
}

/// Catches a window that reaches another sensor, and a second sensor that takes the place of the first.
#[wasm_bindgen_test]
fn a_run_is_blind_to_the_sensors_that_are_named_and_only_in_their_windows() {
    let mut session = estimated();
    assert!(session.drift(BLIND, "gnss_ins", &WINDOW).map_err(text).unwrap().is_null());
    let (gnss, both) = (drift(&mut session, &["gnss"]), drift(&mut session, &["gnss", "odometer"]));
    assert!(both > 1.5 * gnss, "{gnss} m without satellites, {both} m without wheels too");
    let at = |session: &Session, source: &str, t: f64| session.value_at(source, "north", t);
    let before = at(&session, "gnss_ins@blind:current", 190.0) - at(&session, "gnss_ins:current", 190.0);
    let inside = at(&session, "gnss_ins@blind:current", 259.0) - at(&session, "gnss_ins:current", 259.0);
    assert!(before == 0.0 && inside.abs() > 0.1, "{before} m before, {inside} m inside");
    let refused = session.begin_blind_run(BLIND, no_params(), None, vec!["radar".into()], &WINDOW).map_err(text);
    assert!(refused.unwrap_err().contains("radar"));
}

/// Catches a sweep that never ends, that counts windows twice, or whose distribution is of something else than its drifts.
#[wasm_bindgen_test]
fn a_sweep_goes_on_in_pieces_and_tells_the_distribution_of_its_drifts() {
    let mut session = estimated();
    assert!(session.swept().map_err(text).unwrap().is_null());
    let begun = session.begin_sweep("gnss_ins", no_params(), None, "gnss", 30.0, 60.0, 30.0);
    begun.map_err(text).unwrap();
    let (mut pieces, mut last) = (0, 0.0);
    loop {
        let progress = session.sweep_some(20.0).map_err(text).unwrap();
        let fraction = number(&progress, "fraction");
        assert!(fraction >= last, "{fraction} after {last}");
        (pieces, last) = (pieces + 1, fraction);
        if get(&progress, "done").as_bool().unwrap() {
            break;
        }
    }
    assert!(pieces > 1);
    let swept = session.swept().map_err(text).unwrap();
    let ends: Vec<f64> = Array::from(&get(&swept, "drifts"))
        .iter()
        .map(|d| number(&Array::from(&get(&d, "at")).get(1), "distance"))
        .collect();
    assert!(ends.len() > 5);
    let end = Array::from(&get(&swept, "distribution")).get(1);
    assert!((number(&end, "after") - 30.0).abs() < 1e-9);
    assert_eq!(number(&end, "count"), ends.len() as f64);
    let largest = Array::from(&get(&end, "distance")).get(2).as_f64().unwrap();
    assert_eq!(largest, ends.iter().copied().fold(0.0, f64::max));
    session.cancel_sweep();
    assert!(session.sweep_some(1.0).is_err());
}

/// Catches a fault that stays in the drive, that changes the truth, or that half of a refused list leaves behind.
#[wasm_bindgen_test]
fn faults_are_in_the_drive_until_they_are_taken_out_and_a_refused_list_changes_nothing() {
    let mut session = estimated();
    let rate = |session: &Session, source: &str| session.value_at(source, "gyro_z", 230.0);
    let good = rate(&session, "drive");
    let bias = r#"{"kind": "bias", "signal": "gyro_z", "amount": 0.01, "from": 200, "to": 260, "seed": 1}"#;
    let set = |session: &mut Session, list: &str| session.set_faults(JSON::parse(list).unwrap()).map_err(text);
    set(&mut session, &format!("[{bias}]")).unwrap();
    assert!((rate(&session, "drive") - good - 0.01).abs() < 1e-12);
    let bad = format!(r#"[{bias}, {{"kind": "freeze", "signal": "nothing", "from": 0, "to": 1, "seed": 0}}]"#);
    assert!(set(&mut session, &bad).unwrap_err().contains("nothing"));
    assert!((rate(&session, "drive") - good - 0.01).abs() < 1e-12);
    set(&mut session, "[]").unwrap();
    assert_eq!(rate(&session, "drive"), good);
}

#[wasm_bindgen_test]
fn errors_are_estimate_less_truth_and_carry_the_sigmas_and_the_ellipse_of_the_estimate() {
    let session = estimated();
    let value = |source: &str, column: &str| session.value_at(source, column, 230.0);
    let error = value("gnss_ins:current", "north") - value("truth", "n");
    assert!((value("gnss_ins:current_errors", "north") - error).abs() < 1e-6 && error.abs() < 5.0);
    assert_eq!(value("gnss_ins:current_errors", "north_sigma"), value("gnss_ins:current", "north_sigma"));
    assert!(value("gnss_ins:current", "north_east_correlation").abs() <= 1.0);
    assert!(value("gnss_ins:previous_errors", "north").is_nan());
}
