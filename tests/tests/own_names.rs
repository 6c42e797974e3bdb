//! Drives under their own names are contradicted nowhere: a check that is wrong about a right log is worse than none.
#![allow(clippy::unwrap_used)]

use drivescope_drive::csv::write_drive;
use drivescope_import::{IoSource, Weight, open_csv};
use drivescope_simulation::{Simulation, drives, named};

/// Catches a check that takes sensors' noise, lean, delays, banked or steep roads, tyres' slip or a disturbed field for a
/// wrong name, sign or unit.
#[test]
fn built_in_drives_are_contradicted_nowhere() {
    let mut wrong = Vec::new();
    for drive in drives() {
        let mut simulation = Simulation::new(&named(drive.name).unwrap(), None).unwrap();
        simulation.advance(120.0);
        let mut text = Vec::new();
        write_drive(simulation.drive(), &mut text).unwrap();
        let (_, report) = open_csv(&mut IoSource::new(&text[..], None), "drive.csv", None).unwrap();
        let against = report.findings.iter().filter(|f| f.weight == Weight::Contradiction);
        wrong.extend(against.map(|f| format!("{}: {}", drive.name, f.text)));
        report.notes.iter().for_each(|n| println!("{}: note: {n}", drive.name));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
