//! The receiver against the expected tables of SPEC navigation and against closed forms.

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;

use super::integrity::Integrity;
use super::sight::Sight;
use super::*;
use crate::case_log::{Table, navigation_case, shared};

fn run(drive: &Drive, params: &GnssParams) -> Series {
    crate::estimator::run::<GnssReceiver>(drive, params, None).unwrap().into_series()
}

/// Rows of the expected tables, 1 s apart; largest distance of position and velocity from them.
fn worst(estimates: &Series, expected: &Table, from: f64, to: f64) -> (f64, f64) {
    let (mut place, mut speed) = (0.0f64, 0.0f64);
    for (i, &t) in expected.column("t").iter().enumerate().filter(|(_, t)| **t >= from && **t <= to) {
        let row = estimates.time().partition_point(|&x| x < t - 1e-3);
        assert!((estimates.time()[row] - t).abs() < 1e-3, "no row at {t}: next is {}", estimates.time()[row]);
        let off = |ours: &str, theirs: &str| (estimates.column(ours).unwrap()[row] - expected.column(theirs)[i]).abs();
        place = place.max(off("north", "n").hypot(off("east", "e")).hypot(off("down", "d")));
        speed = speed.max(off("v_north", "vn").hypot(off("v_east", "ve")).hypot(off("v_down", "vd")));
    }
    println!("{from} to {to}: position {place:.4} m, velocity {speed:.5} m/s");
    (place, speed)
}

/// SPEC navigation 5 and 10: the eight-state filter on the case logs. 0.02 m is what section 13 allows elsewhere;
/// here it holds through outage and canyon too, where the filter drifts by hundreds of metres.
#[test]
fn the_case_drives_are_the_references() {
    for name in ["table1", "urban"] {
        let Some(drive) = navigation_case(name) else { return };
        let Some(path) = shared(&format!("spec/navigation/expected/{name}_gps8.csv.gz")) else { return };
        let expected = Table::read(&path);
        let estimates = run(&drive, &GnssParams::default());
        let end = expected.column("t")[expected.column("t").len() - 1];
        let (place, speed) = worst(&estimates, &expected, 0.0, end);
        assert!(place < 0.02 && speed < 0.02, "{name}: {place} {speed}");
    }
}

/// Horizontal distance of two columns from the truth between two times: root mean square and largest.
fn errors(drive: &Drive, estimates: &Series, columns: [&str; 2], from: f64, to: f64) -> (f64, f64) {
    let (mut sum, mut count, mut largest) = (0.0, 0, 0.0f64);
    for (row, &t) in estimates.time().iter().enumerate().filter(|(_, t)| **t >= from && **t < to) {
        let truth = ["n", "e"].map(|name| drive.truth.interpolate(drive.truth.index_of(name).unwrap(), t, 0.1));
        let at = columns.map(|name| estimates.column(name).unwrap()[row]);
        let error = (at[0] - truth[0]).hypot(at[1] - truth[1]);
        if error.is_finite() {
            sum += error * error;
            count += 1;
            largest = largest.max(error);
        }
    }
    ((sum / f64::from(count)).sqrt(), largest)
}

/// SPEC navigation 10.1 and 10.5, to 10 % or 0.05 m.
#[test]
fn the_summaries_are_the_specifications() {
    let (filtered, single) = (["north", "east"], ["fix_north", "fix_east"]);
    let close = |ours: f64, theirs: f64| (ours - theirs).abs() < (0.1 * theirs).max(0.05);
    if let Some(drive) = navigation_case("table1") {
        let estimates = run(&drive, &GnssParams::default());
        let (fix, filter) =
            (errors(&drive, &estimates, single, 0.0, 141.0), errors(&drive, &estimates, filtered, 0.0, 141.0));
        println!("table 1: fix {fix:.2?}, filter {filter:.2?}");
        assert!(close(fix.0, 0.73) && close(fix.1, 1.77) && close(filter.0, 0.60) && close(filter.1, 1.25));
    }
    let Some(drive) = navigation_case("urban") else { return };
    let estimates = run(&drive, &GnssParams::default());
    let open = errors(&drive, &estimates, filtered, 0.0, 150.0).0;
    let multipath = errors(&drive, &estimates, filtered, 150.0, 190.0).0;
    let outage = errors(&drive, &estimates, filtered, 300.0, 361.0).1;
    let canyon = errors(&drive, &estimates, filtered, 420.0, 481.0).1;
    println!("urban: open sky {open:.2}, multipath {multipath:.2}, outage {outage:.0}, canyon {canyon:.0}");
    assert!(close(open, 0.54) && close(multipath, 0.65) && close(outage, 476.0) && close(canyon, 382.0));
}

/// Multipath of 18 and 26 m on two satellites: the single fix is off by metres and its test says so, while with a clear sky it
/// passes. Ranges share an error of 1 m over minutes, which the stated 1.5 m cover.
#[test]
fn the_integrity_test_finds_multipath_and_passes_a_clear_sky() {
    let Some(drive) = navigation_case("urban") else { return };
    let estimates = run(&drive, &GnssParams::default());
    let share = |from: f64, to: f64| {
        let passed = estimates.column("raim_passed").unwrap().iter().zip(estimates.time());
        let inside: Vec<f64> =
            passed.filter(|(v, t)| v.is_finite() && **t >= from && **t < to).map(|(v, _)| *v).collect();
        inside.iter().sum::<f64>() / inside.len() as f64
    };
    println!("passed: clear {:.3}, multipath {:.3}", share(0.0, 150.0), share(150.0, 190.0));
    assert!(share(0.0, 150.0) == 1.0 && share(150.0, 190.0) < 0.05);
}

/// A sky of satellites over a place, seen by a receiver with a clock.
fn sky(frame: &LocalFrame, place: &Vector3<f64>, velocity: &Vector3<f64>, clock: [f64; 2]) -> Vec<Satellite> {
    (0..8u32)
        .map(|k| {
            let (azimuth, elevation) = (f64::from(k) * 0.8, 0.25 + 0.15 * f64::from(k));
            let direction =
                Vector3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), -elevation.sin());
            let at = direction * 2.2e7;
            let mut satellite = Satellite { prn: k, place: frame.to_geodetic(&at).to_ecef(), ..Satellite::default() };
            let tangent = Vector3::new(900.0 * azimuth.sin(), -900.0 * azimuth.cos(), 300.0);
            satellite.velocity = frame.to_geodetic(&(at + tangent)).to_ecef() - satellite.place;
            let seen = Sight::new(frame, place, &satellite);
            satellite.range = seen.distance + clock[0];
            satellite.rate = seen.distance_rate(velocity) + clock[1];
            satellite
        })
        .collect()
}

fn frame() -> LocalFrame {
    LocalFrame::new(Geodetic { lat: 0.63, lon: 2.2, alt: 40.0 })
}

const PLACE: Vector3<f64> = Vector3::new(120.0, -340.0, 12.0);
const VELOCITY: Vector3<f64> = Vector3::new(11.0, -5.0, 0.4);

/// From the centre of the Earth, without noise: place, clock, velocity and drift come back to the rounding of a range (4e-9 m).
#[test]
fn a_fix_from_the_centre_of_the_earth_is_exact_without_noise() {
    let fix = snapshot(&frame(), &sky(&frame(), &PLACE, &VELOCITY, [3000.0, 30.0]), 0, None, 1.5).unwrap();
    let (velocity, drift) = fix.velocity.unwrap();
    assert!((fix.place - PLACE).norm() < 1e-5 && (fix.clock_bias - 3000.0).abs() < 1e-5, "{fix:?}");
    assert!((velocity - VELOCITY).norm() < 1e-6 && (drift - 30.0).abs() < 1e-6 && fix.residuals < 1e-9);
}

#[test]
fn three_satellites_make_no_fix_and_four_no_test() {
    let all = sky(&frame(), &PLACE, &VELOCITY, [0.0, 0.0]);
    assert!(snapshot(&frame(), &all[..3], 0, None, 1.5).is_none());
    let mut receiver = GnssReceiver::new(&GnssParams::default(), &VehicleParams::default(), &LogStart::UNKNOWN);
    let row = receiver.step(&Epoch { time: 0.0, raw_gnss: Some(&all[..4]), ..Epoch::default() }).unwrap().unwrap();
    assert!(row.raim_passed.is_nan() && row.pdop > 1.0 && row.north.hypot(row.east) < 1e-3, "{row:?}");
    // The filter goes on with two, and says that it is degraded.
    let two = Epoch { time: 1.0, raw_gnss: Some(&all[..2]), ..Epoch::default() };
    let row = receiver.step(&two).unwrap().unwrap();
    assert!(row.degraded == 1.0 && row.range_accepted == 1.0 && row.fix_north.is_nan() && row.north.is_finite());
}

/// One range 40 m too long among eight: the sum of residuals over 1.5^2 m^2 is far beyond the limit of 18.5 for four to spare.
#[test]
fn a_range_that_disagrees_with_the_others_is_noticed() {
    let mut all = sky(&frame(), &PLACE, &VELOCITY, [0.0, 0.0]);
    all[2].range += 40.0;
    let start = LogStart { origin: Some(frame().origin), ..LogStart::UNKNOWN };
    let mut receiver = GnssReceiver::new(&GnssParams::default(), &VehicleParams::default(), &start);
    let row = receiver.step(&Epoch { time: 0.0, raw_gnss: Some(&all), ..Epoch::default() }).unwrap().unwrap();
    assert!(row.raim_passed == 0.0 && row.raim > 10.0);
}

/// One range of eight that is 40 m too long is left out, whichever it is, and the fix is that of the other seven; of six
/// satellites too; of five it is found out and no more.
#[test]
fn the_satellite_at_fault_is_found_and_left_out_of_the_fix() {
    for count in [8, 6, 5] {
        for fault in 0..count {
            let mut all = sky(&frame(), &PLACE, &VELOCITY, [3000.0, 30.0]);
            all.truncate(count);
            all[fault].range += 40.0;
            let integrity = Integrity::new(0.999, true, 1.5);
            let checked = integrity.fix(&frame(), &all, None).unwrap();
            if count == 5 {
                assert!(checked.left_out == 0 && checked.passes == checked.all_pass);
                continue;
            }
            if checked.all_pass == Some(true) {
                // Six satellites: a fault that the geometry hides from the test cannot be excluded.
                assert!(count == 6 && checked.left_out == 0);
                continue;
            }
            assert_eq!((checked.left_out, checked.passes), (1 << fault, Some(true)), "{count} satellites, {fault}");
            assert!((checked.fix.place - PLACE).norm() < 1e-4);
        }
    }
}

/// Two faults of different size among eight, as under the multipath of the urban drive: both leave.
#[test]
fn two_satellites_at_fault_are_left_out_one_after_the_other() {
    let mut all = sky(&frame(), &PLACE, &VELOCITY, [3000.0, 30.0]);
    (all[1].range, all[5].range) = (all[1].range + 18.0, all[5].range + 26.0);
    let checked = Integrity::new(0.999, true, 1.5).fix(&frame(), &all, None).unwrap();
    assert_eq!((checked.left_out, checked.passes), (0b10_0010, Some(true)));
    assert!((checked.fix.place - PLACE).norm() < 1e-4 && checked.all_pass == Some(false));
    let kept = Integrity::new(0.999, false, 1.5).fix(&frame(), &all, None).unwrap();
    assert!(kept.left_out == 0 && (kept.fix.place - PLACE).norm() > 3.0);
}

/// The single fix under the multipath of the urban drive (18 and 26 m on two satellites): metres off with all ranges, and as good
/// as under a clear sky without those that disagree.
#[test]
fn excluding_satellites_mends_the_fix_under_multipath() {
    let Some(drive) = navigation_case("urban") else { return };
    let with = |exclude: bool| {
        let estimates = run(&drive, &GnssParams { exclude, ..GnssParams::default() });
        errors(&drive, &estimates, ["fix_north", "fix_east"], 150.0, 190.0).0
    };
    let (all, agreeing) = (with(false), with(true));
    println!("multipath: single fix rms {all:.2} m, {agreeing:.2} m without the satellites at fault");
    assert!(agreeing < 2.0 && agreeing < 0.3 * all);
}

/// Steps of 10 m and 1 m/s: second order of a range 10^2 / 4.4e7 = 2e-6 m; of a rate 3e-4 1/s * 10 m / 2.2e7 m: nothing.
#[test]
fn range_rows_are_the_derivatives_of_range_and_rate() {
    let all = sky(&frame(), &PLACE, &VELOCITY, [3000.0, 30.0]);
    let fix = snapshot(&frame(), &all, 0, None, 1.5).unwrap();
    let filter = Filter::new(&fix);
    for (k, satellite) in all.iter().enumerate() {
        let models = [Filter::range, Filter::range_rate];
        for (model, tolerance) in models.iter().zip([1e-5, 1e-7]) {
            let h = model(&filter, &frame(), satellite).1;
            for column in 0..super::filter::STATES {
                let size = if column % 2 == 0 { 10.0 } else { 1.0 };
                let moved = |sign: f64| {
                    let mut other = filter.clone();
                    other.state[column] += sign * size;
                    -model(&other, &frame(), satellite).0
                };
                let numeric = (moved(1.0) - moved(-1.0)) / (2.0 * size);
                assert!(
                    (numeric - h[column]).abs() < tolerance,
                    "satellite {k} column {column}: {numeric} {}",
                    h[column]
                );
            }
        }
    }
}

/// The clock jumps by 300 m: followed at once, the position stays; without the jump's logic every range would be refused.
#[test]
fn a_jump_of_the_clock_is_followed_and_moves_nothing() {
    let start = LogStart { origin: Some(frame().origin), ..LogStart::UNKNOWN };
    let mut receiver = GnssReceiver::new(&GnssParams::default(), &VehicleParams::default(), &start);
    for k in 0..40 {
        let time = f64::from(k);
        let place = PLACE + VELOCITY * time;
        let clock = [3000.0 + 30.0 * time + if k >= 20 { 300.0 } else { 0.0 }, 30.0];
        let all = sky(&frame(), &place, &VELOCITY, clock);
        let row = receiver.step(&Epoch { time, raw_gnss: Some(&all), ..Epoch::default() }).unwrap().unwrap();
        let error = Vector3::new(row.north, row.east, row.down) - place;
        assert!(error.norm() < 0.01, "at {time}: {error}");
        assert!((row.clock_bias - clock[0]).abs() < 0.01);
    }
    assert!(receiver.notices().list().iter().any(|n| n.text.contains("jumped") && n.first == 20.0));
}

#[test]
fn nonsense_never_enters_the_state() {
    let start = LogStart { origin: Some(frame().origin), ..LogStart::UNKNOWN };
    let mut receiver = GnssReceiver::new(&GnssParams::default(), &VehicleParams::default(), &start);
    let values = [f64::NAN, f64::INFINITY, -1e300, 1e9, 0.0, 5.0];
    for k in 0..600usize {
        let mut all = sky(&frame(), &PLACE, &Vector3::zeros(), [0.0, 0.0]);
        if k > 0 {
            let value = values[k % values.len()];
            let satellite = &mut all[k % 8];
            match k % 4 {
                0 => satellite.range = value,
                1 => satellite.rate = value,
                2 => satellite.place.x = value,
                _ => satellite.velocity.y = value,
            }
        }
        let row = receiver.step(&Epoch { time: k as f64, raw_gnss: Some(&all), ..Epoch::default() }).unwrap().unwrap();
        let place = Vector3::new(row.north, row.east, row.down);
        assert!(
            (place - PLACE).norm() < 1.0 && row.north_sigma.is_finite() && row.clock_drift.abs() < 1.0,
            "{k}: {row:?}"
        );
    }
}
