//! The door of the simulated drives, in a worker of a real browser: the bits of native, and what crosses it.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used)]

use drivescope_drive::parts::{Part, parts};
use drivescope_drives::Simulator;
use drivescope_simulation::{Simulation, drives, fingerprint, named};
use js_sys::{Array, Float64Array, Reflect};
use wasm_bindgen::prelude::*;
use wasm_bindgen_test::*;

wasm_bindgen_test_configure!(run_in_dedicated_worker);

/// A short drive.
const SHORT: &str = "sine_with_dwell";

fn get(object: &JsValue, key: &str) -> JsValue {
    Reflect::get(object, &key.into()).unwrap()
}

fn text(error: JsError) -> String {
    get(&JsValue::from(error), "message").as_string().unwrap()
}

/// Simulate until a drive can be taken; the rows that it says it has.
fn simulate(simulator: &mut Simulator) -> Result<usize, String> {
    loop {
        let progress = simulator.simulate_some(20.0).map_err(text)?;
        assert_eq!(get(&progress, "stage").as_string().unwrap(), "simulating");
        if get(&progress, "done").as_bool().unwrap() {
            return Ok(get(&progress, "rows").as_f64().unwrap() as usize);
        }
    }
}

fn numbers(array: JsValue) -> Vec<f64> {
    array.unchecked_into::<Float64Array>().to_vec()
}

/// Take all parts and hold them against those of a drive.
fn assert_parts(simulator: &mut Simulator, expected: impl Iterator<Item = Part>) -> usize {
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    let mut count = 0;
    for part in expected {
        let given = simulator.next_part().unwrap();
        assert_eq!(given.get(0).as_string().unwrap(), part.name);
        assert!(bits(&numbers(given.get(2))) == bits(&part.time), "{}: times", part.name);
        let (names, columns) = (given.get(1).unchecked_into::<Array>(), given.get(3).unchecked_into::<Array>());
        assert_eq!(names.length() as usize, part.columns.len());
        for (i, (name, values)) in part.columns.iter().enumerate() {
            assert_eq!(names.get(i as u32).as_string().unwrap(), *name);
            assert!(bits(&numbers(columns.get(i as u32))) == bits(values), "{}: {name}", part.name);
        }
        count += 1;
    }
    assert!(simulator.next_part().is_none() && simulator.head().is_err(), "what was taken is gone");
    count
}

#[wasm_bindgen_test]
fn every_drive_has_the_bits_that_it_has_natively() {
    // The table that the test of the same name in `crates/simulation` holds native to.
    let native = include_str!("../../simulation/tests/fingerprints.txt");
    let mut compared = 0;
    for (drive, line) in drives().iter().zip(native.lines()) {
        let mut simulation = Simulation::new(&named(drive.name).unwrap(), None).unwrap();
        simulation.advance(200.0);
        assert_eq!(format!("{} {:016x}", drive.name, fingerprint(simulation.drive())), line);
        compared += 1;
    }
    assert_eq!(compared, drives().len());
}

#[wasm_bindgen_test]
fn a_drive_is_handed_out_with_what_it_says_and_all_its_columns() {
    let mut simulator = Simulator::new();
    simulator.begin(SHORT, Some(5.0), None, None).map_err(text).unwrap();
    assert!(simulator.head().is_err(), "not before its end");
    let rows = simulate(&mut simulator).unwrap();
    assert!(!simulator.is_partial());
    let drive = drivescope_simulation::simulate(&named(SHORT).unwrap(), Some(5)).unwrap();
    assert_eq!(rows, drive.imu.len());
    let (expected, all) = parts(drive);
    let head = simulator.head().map_err(text).unwrap();
    assert_eq!(head.get(0).as_string().unwrap(), SHORT);
    assert_eq!(Some(numbers(head.get(1))), expected.vehicle);
    assert_eq!((head.get(2).as_f64(), head.get(3).as_f64()), (expected.rear_axle, expected.unix_zero));
    assert!(head.get(4).is_undefined(), "nothing was read");
    assert!(assert_parts(&mut simulator, all) > 4);
    assert!(simulator.simulate_some(1.0).is_err(), "there is no more to simulate");
}

#[wasm_bindgen_test]
fn the_beginning_comes_first_and_the_whole_is_what_it_is_without() {
    let mut simulator = Simulator::new();
    simulator.begin(SHORT, None, None, Some(7.0)).map_err(text).unwrap();
    assert_eq!(simulate(&mut simulator).unwrap(), 701);
    assert!(simulator.is_partial());
    let mut simulation = Simulation::new(&named(SHORT).unwrap(), None).unwrap();
    simulation.advance(7.0);
    assert_parts(&mut simulator, parts(simulation.drive().clone()).1);
    assert!(simulate(&mut simulator).unwrap() > 701);
    assert!(!simulator.is_partial());
    assert_parts(&mut simulator, parts(simulation.finish()).1);
    // A drive that ends before is whole.
    simulator.begin(SHORT, None, None, Some(600.0)).map_err(text).unwrap();
    simulate(&mut simulator).unwrap();
    assert!(!simulator.is_partial());
}

#[wasm_bindgen_test]
fn built_in_drives_are_listed_with_picture_and_description_which_can_be_changed() {
    let mut simulator = Simulator::new();
    let list: Array = simulator.catalogue().map_err(text).unwrap().unchecked_into();
    assert_eq!(list.length() as usize, drives().len());
    for entry in list.iter() {
        let name = get(&entry, "name").as_string().unwrap();
        assert!(get(&entry, "duration").as_f64().unwrap() > 1.0 && !get(&entry, "doc").as_string().unwrap().is_empty());
        let flat = simulator.sketch(&name).to_vec();
        let points = flat[1] as usize;
        assert!(flat[0] > 10.0 && points > 1 && flat.len() > 2 + 2 * points && flat.len().is_multiple_of(2), "{name}");
    }
    assert!(simulator.sketch("none").length() == 0 && simulator.description("none").is_empty());
    let own = simulator.description(SHORT).replace("\"name\": \"sine_with_dwell\"", "\"name\": \"my_own\"");
    simulator.begin("unused", None, Some(own), None).map_err(text).unwrap();
    simulate(&mut simulator).unwrap();
    assert_eq!(simulator.head().map_err(text).unwrap().get(0).as_string().unwrap(), "my_own");
}

#[wasm_bindgen_test]
fn what_cannot_be_simulated_is_one_sentence_and_what_was_begun_can_be_given_up() {
    let mut simulator = Simulator::new();
    let refused = simulator.begin("none", None, None, None).map_err(text).unwrap_err();
    assert!(refused.contains("`none`"), "{refused}");
    let refused = simulator.begin("mine", None, Some("{\"name\": ".into()), None).map_err(text).unwrap_err();
    assert!(refused.starts_with("mine: "), "{refused}");
    assert!(simulator.simulate_some(1.0).is_err() && simulator.head().is_err() && simulator.next_part().is_none());
    simulator.begin("city_hills", None, None, None).map_err(text).unwrap();
    let progress = simulator.simulate_some(0.0).map_err(text).unwrap();
    let fraction = get(&progress, "fraction").as_f64().unwrap();
    assert!(!get(&progress, "done").as_bool().unwrap() && fraction > 0.0 && fraction < 0.5, "{fraction}");
    assert!(simulator.is_partial());
    simulator.cancel();
    assert!(!simulator.is_partial() && simulator.simulate_some(1.0).is_err());
}
