//! The gallery's door, in a worker of a real browser: a claim runs to its end with the figures that it has natively.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used)]

use drivescope_gallery::{Attempt, DrivenLoop, loop_catalogue, paper_catalogue};
use drivescope_papers::{PAPERS, ids};
use js_sys::{Array, Reflect};
use wasm_bindgen::prelude::*;
use wasm_bindgen_test::*;

wasm_bindgen_test_configure!(run_in_dedicated_worker);

fn get(object: &JsValue, key: &str) -> JsValue {
    Reflect::get(object, &key.into()).unwrap()
}

fn list(object: &JsValue, key: &str) -> Array {
    get(object, key).unchecked_into()
}

fn text(error: JsError) -> String {
    get(&JsValue::from(error), "message").as_string().unwrap()
}

/// Run a claim to its end; the progress of every call, and what came out.
fn run(id: &str) -> (Vec<f64>, JsValue) {
    let mut attempt = Attempt::new(id).map_err(text).unwrap();
    assert!(attempt.result().map_err(text).unwrap().is_null(), "nothing is found before the end");
    let mut fractions = Vec::new();
    loop {
        let progress = attempt.run_some(1.0).map_err(text).unwrap();
        fractions.push(get(&progress, "fraction").as_f64().unwrap());
        if get(&progress, "done").as_bool().unwrap() {
            return (fractions, attempt.result().map_err(text).unwrap());
        }
    }
}

#[wasm_bindgen_test]
fn claims_end_with_the_verdicts_that_they_have_natively() {
    // Natively: `tests/tests/papers.rs`. The first two run estimators on drives, the others closed loops.
    let native = [
        ("orientation/static_vectors", "supported"),
        ("orientation/compound_slopes", "not_supported"),
        ("control/j_turn", "supported"),
        ("control/free_line", "partly"),
    ];
    for (id, verdict) in native {
        let (fractions, finding) = run(id);
        assert_eq!(get(&finding, "verdict").as_string().unwrap(), verdict, "{id}");
        assert_eq!(get(&finding, "id").as_string().unwrap(), id);
        assert!(fractions.len() > 2 && fractions.is_sorted() && fractions.last() == Some(&1.0), "{id}: {fractions:?}");
    }
}

#[wasm_bindgen_test]
fn a_figure_crosses_with_its_unit_its_claimed_number_and_infinite_limits() {
    let (_, finding) = run("orientation/static_vectors");
    let first = list(&finding, "figures").get(0);
    assert_eq!(get(&first, "unit").as_string().unwrap(), "deg");
    let limits = list(&first, "limits");
    assert_eq!((limits.get(0).as_f64(), limits.get(1).as_f64()), (Some(5.0), Some(f64::INFINITY)), "at least 5 deg");
    let (_, finding) = run("control/j_turn");
    assert_eq!(get(&list(&finding, "figures").get(0), "claimed").as_f64(), Some(0.2));
}

#[wasm_bindgen_test]
fn the_catalogue_names_every_claim_and_an_unknown_one_is_refused_in_a_sentence() {
    let papers: Array = paper_catalogue().map_err(text).unwrap().unchecked_into();
    assert_eq!(papers.length() as usize, PAPERS.len());
    let claims: u32 = papers.iter().map(|paper| list(&paper, "claims").length()).sum();
    assert_eq!(claims as usize, ids().count());
    let error = Attempt::new("orientation/nothing").map(drop).map_err(text).unwrap_err();
    assert!(error.starts_with("there is no claim `orientation/nothing`; there are orientation/"), "{error}");
}

#[wasm_bindgen_test]
fn a_closed_loop_is_driven_to_its_end_and_shows_its_rows() {
    let catalogue = loop_catalogue().map_err(text).unwrap();
    let name = get(&list(&catalogue, "loops").get(0), "name").as_string().unwrap();
    let mut driven = DrivenLoop::new(&name, js_sys::Object::new().into(), 1.0).map_err(text).unwrap();
    let rows = loop {
        let progress = driven.drive_some(20.0).map_err(text).unwrap();
        if get(&progress, "done").as_bool().unwrap() {
            break get(&progress, "rows").as_f64().unwrap();
        }
    };
    assert!(rows > 100.0 && f64::from(driven.times("car").length()) == rows);
    let error = DrivenLoop::new("nothing", js_sys::Object::new().into(), 1.0).map(drop).map_err(text).unwrap_err();
    assert_eq!(error, "there is no closed loop `nothing`");
}
