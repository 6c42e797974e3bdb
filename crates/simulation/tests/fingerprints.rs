//! Every shipped drive has the bits that it had; the test of the same table in `crates/wasm` says that it has them there too.
//!
//! A change of plant, drives or sensors changes the table: `DRIVESCOPE_GOLDEN_UPDATE=1` writes it anew, for review.
#![allow(clippy::unwrap_used)]

use std::fmt::Write;

use drivescope_simulation::{Simulation, drives, fingerprint, named};

/// Seconds of each drive that are compared.
const SECONDS: f64 = 200.0;

#[test]
fn every_drive_has_the_bits_it_had_and_has_in_wasm() {
    let mut table = String::new();
    for drive in drives() {
        let mut simulation = Simulation::new(&named(drive.name).unwrap(), None).unwrap();
        simulation.advance(SECONDS);
        writeln!(table, "{} {:016x}", drive.name, fingerprint(simulation.drive())).unwrap();
    }
    if std::env::var_os("DRIVESCOPE_GOLDEN_UPDATE").is_some() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fingerprints.txt");
        std::fs::write(path, &table).unwrap();
        return;
    }
    assert_eq!(table, include_str!("fingerprints.txt"), "a difference to be explained; see the head of this file");
}
