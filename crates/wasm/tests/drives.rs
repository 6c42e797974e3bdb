//! Simulation in the browser: the bits of native, and an hour in good time.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used)]

use drivescope_simulation::{Simulation, drives, fingerprint, named};
use wasm_bindgen_test::*;

wasm_bindgen_test_configure!(run_in_dedicated_worker);

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
