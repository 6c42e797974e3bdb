//! The door, in a worker of a real browser: what crosses it, what it says when it refuses, and the same numbers as native.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used)]

use drivescope_simulation::drives;
use drivescope_wasm::Session;
use js_sys::{Array, Float64Array, JSON, Object, Reflect};
use wasm_bindgen::prelude::*;
use wasm_bindgen_test::*;

mod support;

use support::{get, text, with};

wasm_bindgen_test_configure!(run_in_dedicated_worker);

const ESTIMATORS: [&str; 4] = ["orientation", "slope", "motion_mode", "gnss_ins"];

/// Put the parts that have come in place.
fn open(session: &mut Session) -> Result<(), String> {
    session.end_parts().map_err(text)
}

fn run(session: &mut Session, estimator: &str, params: &str) -> Result<(), String> {
    session.begin_run(estimator, JSON::parse(params).unwrap(), None).map_err(text)?;
    loop {
        let progress = session.run_some(estimator, 50.0).map_err(text)?;
        if get(&progress, "done").as_bool().unwrap() {
            return Ok(());
        }
    }
}

/// A session with the first built-in drive, handed over as the page does.
fn built_in() -> Session {
    with(drives()[0].name)
}

fn begin(session: &mut Session, name: &str, report: JsValue) {
    session.begin_parts(name.into(), None, None, None, report, None).map_err(text).unwrap();
}

/// A part at 100 Hz whose columns are constant.
fn add(session: &mut Session, part: &str, rows: usize, columns: &[(&str, f64)]) -> Result<(), String> {
    let time = (0..rows).map(|k| k as f64 * 0.01).collect();
    let names = columns.iter().map(|(name, _)| (*name).into()).collect();
    let columns = columns.iter().map(|(_, value)| Float64Array::from(vec![*value; rows].as_slice())).collect();
    session.add_part(part, names, time, columns).map_err(text)
}

#[wasm_bindgen_test]
fn every_estimator_runs_on_the_built_in_drive_and_its_columns_have_names_units_and_length() {
    let mut session = built_in();
    let report = session.report().map_err(text).unwrap();
    assert_eq!(get(&report, "kind").as_string().unwrap(), "simulated");
    assert!(get(&report, "has_vehicle").as_bool().unwrap() && get(&report, "import").is_null());
    for name in ESTIMATORS {
        run(&mut session, name, "{}").unwrap();
        let report = session.result(name, "current").map_err(text).unwrap();
        let rows = get(&report, "rows").as_f64().unwrap();
        assert!(rows > 50_000.0, "{name}: {rows} rows");
        assert!(get(&get(&report, "score"), "metrics").unchecked_into::<Array>().length() > 0, "{name} is scored");
    }
    let catalogue = session.catalogue().map_err(text).unwrap();
    for estimator in get(&catalogue, "estimators").unchecked_into::<Array>().iter() {
        for column in get(&estimator, "columns").unchecked_into::<Array>().iter() {
            assert!(!get(&column, "unit").as_string().unwrap().is_empty());
            assert!(!get(&column, "doc").as_string().unwrap().is_empty());
        }
    }
}

#[wasm_bindgen_test]
fn a_column_given_to_javascript_survives_later_runs() {
    let mut session = built_in();
    run(&mut session, "slope", "{}").unwrap();
    let before: Float64Array = session.grid("slope:current", "grade", 0.0, 600.0, 500, false);
    let copy = before.to_vec();
    assert!(copy.iter().filter(|v| v.is_finite()).count() > 900);
    for name in ESTIMATORS {
        run(&mut session, name, "{}").unwrap();
    }
    // A view into wasm memory would be detached (length 0) or overwritten by now.
    let same = before.to_vec().iter().zip(&copy).all(|(a, b)| a.to_bits() == b.to_bits());
    assert!(before.length() == 1000 && same);
}

#[wasm_bindgen_test]
fn a_second_run_keeps_the_first_as_previous_and_says_what_changed() {
    let mut session = built_in();
    run(&mut session, "slope", "{}").unwrap();
    assert!(session.change("slope").map_err(text).unwrap().is_null());
    run(&mut session, "slope", r#"{"q2_th": 0.005}"#).unwrap();
    assert!(session.change("slope").map_err(text).unwrap().is_object());
    let one = session.grid("slope:previous", "slope", 100.0, 200.0, 50, false).to_vec();
    let two = session.grid("slope:current", "slope", 100.0, 200.0, 50, false).to_vec();
    assert_ne!(one, two);
    session.drop_previous("slope").map_err(text).unwrap();
    assert!(session.result("slope", "previous").map_err(text).unwrap().is_null());
}

#[wasm_bindgen_test]
fn a_refused_parameter_and_a_missing_signal_cross_as_one_sentence() {
    let mut session = built_in();
    let error = run(&mut session, "slope", r#"{"q2_th": 99}"#).unwrap_err();
    assert!(error.contains("99") && error.contains("outside"), "{error}");
    begin(&mut session, "wheels.csv", JsValue::NULL);
    add(&mut session, "wheels", 3, &[("speed", 1.0)]).unwrap();
    open(&mut session).unwrap();
    let error = run(&mut session, "orientation", "{}").unwrap_err();
    assert!(error.contains("orientation needs"), "{error}");
}

#[wasm_bindgen_test]
fn a_drive_in_parts_opens_and_a_broken_one_leaves_the_open_drive_in_place() {
    let mut session = Session::new();
    let (n, report) = (500, Object::new());
    Reflect::set(&report, &"rows".into(), &500.into()).unwrap();
    begin(&mut session, "good.csv", report.into());
    let rest = [("accel_x", 0.1), ("accel_y", 0.0), ("accel_z", -9.8), ("gyro_z", 0.01)];
    add(&mut session, "imu", n, &rest).unwrap();
    assert!(
        get(&session.report().map_err(text).unwrap(), "name").as_string().unwrap().is_empty(),
        "not before its end"
    );
    add(&mut session, "wheels", n, &[("speed", 10.0)]).unwrap();
    open(&mut session).unwrap();
    let good = |session: &Session| {
        let report = session.report().map_err(text).unwrap();
        assert_eq!(get(&report, "name").as_string().unwrap(), "good.csv");
        assert_eq!(get(&report, "kind").as_string().unwrap(), "file");
        assert_eq!(get(&get(&report, "import"), "rows").as_f64(), Some(500.0));
        assert!((session.value_at("drive", "speed", 1.0) - 10.0).abs() < 1e-12);
        assert!(session.value_at("drive", "gyro_x", 1.0).is_nan(), "a column that did not come has no value");
    };
    good(&session);
    for (part, names, rows) in [("imu", ["yaw"], 9), ("tyres", ["speed"], 9), ("wheels", ["speed"], 8)] {
        begin(&mut session, "broken.csv", JsValue::NULL);
        let column = Float64Array::from(vec![1.0; rows].as_slice());
        let time = (0..9).map(f64::from).collect();
        let error = session.add_part(part, names.map(String::from).to_vec(), time, vec![column]).map_err(text);
        assert!(error.unwrap_err().contains(part));
        assert!(open(&mut session).is_err(), "a broken opening is over");
    }
    begin(&mut session, "cancelled.csv", JsValue::NULL);
    session.cancel_parts();
    assert!(add(&mut session, "imu", n, &rest).is_err());
    good(&session);
}

/// A golden history: names and rows.
fn golden(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',').skip(1).map(String::from).collect();
    let rows = lines.map(|l| l.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()).collect();
    (names, rows)
}

#[wasm_bindgen_test]
fn the_numbers_are_the_native_ones() {
    // The golden histories are native; mathematical functions may differ in the last bit, hence 1e-6.
    let histories = [
        ("orientation", include_str!("../../../tests/golden/orientation.csv")),
        ("slope", include_str!("../../../tests/golden/slope.csv")),
        ("motion_mode", include_str!("../../../tests/golden/motion_mode.csv")),
        ("gnss_ins", include_str!("../../../tests/golden/gnss_ins.csv")),
    ];
    let mut session = built_in();
    for (estimator, text) in histories {
        run(&mut session, estimator, "{}").unwrap();
        let (names, rows) = golden(text);
        assert!(rows.len() > 50);
        let mut scale = vec![1e-3f64; names.len()];
        for row in &rows {
            scale.iter_mut().zip(&row[1..]).for_each(|(s, v)| *s = if v.is_finite() { s.max(v.abs()) } else { *s });
        }
        for row in &rows {
            let ours = session.table(&format!("{estimator}:current"), names.clone(), row[0], row[0], 1).to_vec();
            assert_eq!(ours.len(), row.len(), "{estimator} has no row at {}", row[0]);
            for (k, name) in names.iter().enumerate() {
                let (is, was) = (ours[k + 1], row[k + 1]);
                let same = is.is_nan() && was.is_nan() || (is - was).abs() <= 1e-6 * scale[k];
                assert!(same, "{estimator} {name} at {}: native {was}, here {is}", row[0]);
            }
        }
    }
}
