//! Scrambled copies of simulated drives are put right by physics alone.
//!
//! A copy has its axes permuted and turned round at random (all 48 ways, accelerometer, gyro and magnetometer each for
//! itself), its housings lean by up to 15 deg in roll, pitch and yaw, its units are any that loggers write, each sensor
//! is up to 200 ms late, and the names of its columns are shuffled or removed. The columns stand in random order.
//!
//! **Put right** means, of every signal of the drive that an estimator reads:
//! - it comes from its own column, with its own unit and sign (factor to SI within 1 %);
//! - accelerometer, gyro and magnetometer, after axes and mount of the mapping, are turned by less than 3 deg (IMU) and
//!   5 deg (magnetometer) from the car. 3 deg is what the road itself hides: crossfall of 1.5 deg and 1 deg of mean lean
//!   of the body are part of what "level" means on a drive, and a bias of 0.1 m/s^2 is 0.6 deg;
//! - each sensor's delay against the inertial sensor is met within 50 ms (wheels), 60 ms (fixes, which come once a
//!   second), 50 ms (magnetometer) and 120 ms (steering, since the car's own answer of 50 to 150 ms looks the same).
//!
//! What a log without names cannot tell, and why, is decided from the truth, not from what the wizard admits; there the
//! signal may be missing or wrong, but never `certain`:
//! - front or rear wheel, on a drive that never turns by 0.2 rad/s: they differ by the squared wheelbase times the squared
//!   yaw rate over twice the speed, 0.1 % there, less than two tyres do;
//! - altitudes and vertical speed, where the road rises and falls by less than 8 m: they then show noise only;
//! - the magnetometer, where the heading stays within 60 deg: an offset and the field cannot be told apart;
//! - standard deviations, satellites, dilution, validity: numbers that follow nothing that moves;
//! - the barometer's delay: 0.2 s of climbing are 0.2 m.
#![allow(clippy::unwrap_used)]

mod scrambled;

use drivescope_import::examine;

use scrambled::verdict::judge;
use scrambled::{scrambled, source};

/// Drives on which everything that is asked for happens, with satellites in view: standing, driving on, braking, corners
/// to both sides or of more than a quarter turn; and how much of each is used, s.
const TELLING: [(&str, f64); 5] =
    [("city_hills", 150.0), ("city_loop", 150.0), ("mountain_pass", 120.0), ("u_drive", 90.0), ("stop_and_go", 176.0)];

/// Drives that hide something: a constant 120 km/h, one curve and that without satellites, banked curves only, a field
/// disturbed by steel, a street nearly straight. Of them only what the wizard calls certain is asked.
const HIDING: [(&str, f64); 5] =
    [("mountain120", 80.0), ("tunnel", 150.0), ("motorway_bank", 180.0), ("truss_bridge", 150.0), ("urban", 150.0)];

/// The method was made on the seeds from 1000 to 5039; these are others, that nothing was ever fitted to.
/// `DRIVESCOPE_FIRST_SEED` asks for others again.
fn first_seed() -> u64 {
    std::env::var("DRIVESCOPE_FIRST_SEED").ok().and_then(|v| v.parse().ok()).unwrap_or(7_700_000)
}

/// Scramble `copies` of each drive: how many were put right, how many there were, and what was certain and wrong.
fn count(drives: &[(&'static str, f64)], copies: u64) -> (u32, u32, Vec<String>) {
    let (mut right, mut all, mut bad) = (0, 0, Vec::new());
    for (i, (name, seconds)) in drives.iter().enumerate() {
        let source = source(name, *seconds);
        for k in 0..copies {
            let (table, scramble) = scrambled(&source, first_seed() + 1000 * (i as u64 + 1) + k);
            let found = examine(&table).unwrap_or_else(|e| panic!("{name} {k}: {e}"));
            let verdict = judge(&source, &scramble, &found);
            all += 1;
            right += u32::from(verdict.wrong.is_empty());
            if !verdict.wrong.is_empty() {
                let names = if scramble.shuffled { "shuffled" } else { "removed" };
                println!("{name} {k} ({names}): {}", verdict.wrong.join("; "));
            }
            bad.extend(verdict.certain_and_wrong.into_iter().map(|w| format!("{name} {k}: {w}")));
        }
    }
    println!("{right} of {all} put right, {} wrong with high confidence", bad.len());
    (right, all, bad)
}

#[test]
fn of_200_scrambled_copies_95_per_cent_are_put_right_and_none_is_wrong_with_high_confidence() {
    let (right, all, bad) = count(&TELLING, 40);
    assert!(bad.is_empty(), "{bad:#?}");
    assert!(all == 200 && 100 * right >= 95 * all, "{right} of {all}");
}

#[test]
fn where_a_drive_hides_something_nothing_wrong_is_called_certain() {
    let (_, all, bad) = count(&HIDING, 10);
    assert!(bad.is_empty(), "{bad:#?}");
    assert_eq!(all, 50);
}
