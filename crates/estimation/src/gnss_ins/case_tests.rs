//! The case logs of SPEC navigation against the expected tables of its independent reference.

use drivescope_drive::channel::{Channel, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::frames::{body_to_nav, wrap_angle};
use drivescope_drive::geodesy::Geodetic;
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::Vector3;

use super::*;
use crate::case_log::{Table, shared};
use crate::ins::Navigation;

/// A case log: degrees of the file become radians.
fn case(name: &str) -> Option<Drive> {
    let mut table = Table::read(&shared(&format!("spec/navigation/{name}.csv.gz"))?);
    for (name, column) in table.names.iter().zip(&mut table.columns) {
        if name.ends_with("_lat") || name.ends_with("_lon") {
            column.iter_mut().for_each(|v| *v = v.to_radians());
        }
    }
    Some(table.drive())
}

fn truth(drive: &Drive, name: &str, row: usize) -> f64 {
    drive.truth.column(name).unwrap()[row]
}

/// Parameters of the reference's runs: yaw as the truth has it at the start row, aids as named.
fn params(drive: &Drive, start_row: usize, aided: bool) -> GnssInsParams {
    GnssInsParams {
        initial_yaw: truth(drive, "yaw", start_row),
        align_time: drive.imu.time()[start_row] - drive.imu.time()[0],
        odometer: aided,
        nhc: aided,
        zupt: aided,
        zaru: aided,
        ..GnssInsParams::default()
    }
}

fn run(drive: &Drive, params: &GnssInsParams) -> Series {
    crate::estimator::run::<GnssIns>(drive, params, None).unwrap().into_series()
}

/// The largest deviations from an expected table.
#[derive(Debug, Default)]
struct Worst {
    horizontal: f64,
    down: f64,
    velocity: f64,
    tilt: f64,
    yaw: f64,
    accel_bias: f64,
    gyro_bias: f64,
    sigma: f64,
}

fn compare(estimates: &Series, expected: &str, exclude: &[(f64, f64)]) -> Option<Worst> {
    let table = Table::read(&shared(&format!("spec/navigation/expected/{expected}.csv.gz"))?);
    let mut worst = Worst::default();
    for (i, &t) in table.column("t").iter().enumerate() {
        if exclude.iter().any(|(a, b)| t >= *a && t <= *b) {
            continue;
        }
        let row = estimates.time().partition_point(|&x| x < t - 1e-4);
        assert!((estimates.time()[row] - t).abs() < 1e-4, "no estimate at {t}");
        let off = |ours: &str, theirs: &str| (estimates.column(ours).unwrap()[row] - table.column(theirs)[i]).abs();
        let max = |slot: &mut f64, v: f64| *slot = slot.max(v);
        max(&mut worst.horizontal, off("north", "n").hypot(off("east", "e")));
        max(&mut worst.down, off("down", "d"));
        for (a, b) in [("v_north", "vn"), ("v_east", "ve"), ("v_down", "vd")] {
            max(&mut worst.velocity, off(a, b));
        }
        max(&mut worst.tilt, off("roll", "roll").max(off("pitch", "pitch")).to_degrees());
        let yaw = estimates.column("yaw").unwrap()[row] - table.column("yaw")[i];
        max(&mut worst.yaw, wrap_angle(yaw).abs().to_degrees());
        for axis in ["x", "y", "z"] {
            max(&mut worst.accel_bias, off(&format!("accel_bias_{axis}"), &format!("ba_{axis}")));
            max(&mut worst.gyro_bias, off(&format!("gyro_bias_{axis}"), &format!("bg_{axis}")));
        }
        for (a, b) in
            [("north", "n"), ("east", "e"), ("down", "d"), ("v_north", "vn"), ("v_east", "ve"), ("v_down", "vd")]
        {
            let theirs = table.column(&format!("sig_{b}"))[i];
            max(&mut worst.sigma, off(&format!("{a}_sigma"), &format!("sig_{b}")) / theirs);
        }
    }
    Some(worst)
}

/// Horizontal errors against the truth between two times: root mean square and largest.
fn horizontal_errors(drive: &Drive, estimates: &Series, from: f64, to: f64) -> (f64, f64) {
    let (mut sum, mut count, mut largest) = (0.0, 0, 0.0f64);
    for (i, &t) in estimates.time().iter().enumerate().filter(|(_, t)| **t >= from && **t <= to) {
        let truth = |name: &str| drive.truth.interpolate(drive.truth.index_of(name).unwrap(), t, 1.0);
        let error = (estimates.column("north").unwrap()[i] - truth("n"))
            .hypot(estimates.column("east").unwrap()[i] - truth("e"));
        if error.is_finite() {
            sum += error * error;
            count += 1;
            largest = largest.max(error);
        }
    }
    ((sum / f64::from(count)).sqrt(), largest)
}

#[test]
fn explore() {
    let t1 = case("table1").unwrap();
    let ur = case("urban").unwrap();
    let p = params(&t1, 1000, false);
    println!("table1_loose {:?}", compare(&run(&t1, &p), "table1_loose", &[]));
    let p = params(&t1, 1000, true);
    println!("table1_loose_aided {:?}", compare(&run(&t1, &p), "table1_loose_aided", &[]));
    let p = params(&ur, 900, false);
    let e = run(&ur, &p);
    println!("urban_loose {:?}", compare(&e, "urban_loose", &[]));
    println!("urban_loose nofault {:?}", compare(&e, "urban_loose", &[(300.0, 370.0), (420.0, 490.0)]));
    println!("{:?}", horizontal_errors(&ur, &e, 18.0, 600.0));
    let p = params(&ur, 900, true);
    let e = run(&ur, &p);
    println!("urban_loose_aided {:?}", compare(&e, "urban_loose_aided", &[]));
    println!("{:?}", horizontal_errors(&ur, &e, 18.0, 600.0));
    let e = run(&ur, &GnssInsParams { gate: false, ..p.clone() });
    println!("urban_loose_aided_nogate {:?}", compare(&e, "urban_loose_aided_nogate", &[]));
    for (zupt, zaru) in [(false, false), (true, true), (true, false)] {
        let e = run(&ur, &GnssInsParams { odometer: false, zupt, zaru, ..p.clone() });
        println!("urban_loose_nhc {zupt} {zaru} {:?}", compare(&e, "urban_loose_nhc", &[]));
    }
    for offset in [45.0f64, -20.0] {
        let mut p = params(&t1, 1000, true);
        p.initial_yaw += offset.to_radians();
        p.initial_yaw_sigma = 1.2 * offset.to_radians().abs();
        let name = format!("table1_offset{}{}", if offset > 0.0 { "+" } else { "" }, offset);
        println!("{name} {:?}", compare(&run(&t1, &p), &name, &[]));
    }
    let ob = case("obstacle").unwrap();
    let p = params(&ob, 0, true);
    let e = replay(&ob, &p);
    println!("obstacle {:?}", compare(&e, "obstacle_loose_aided", &[]));
    println!("{:?}", horizontal_errors(&ob, &e, 0.0, 600.0));
}

/// Replay from the truth of the first row.
fn replay(drive: &Drive, params: &GnssInsParams) -> Series {
    let at = |name: &str| truth(drive, name, 0);
    let mut estimator = GnssIns::new(params, &VehicleParams::default(), &drive.start());
    let navigation = Navigation {
        place: Geodetic { lat: at("lat"), lon: at("lon"), alt: at("alt") },
        velocity: Vector3::new(at("vn"), at("ve"), at("vd")),
        body_to_nav: body_to_nav(at("roll"), at("pitch"), at("yaw")),
    };
    estimator.begin_at(drive.imu.time()[0], navigation);
    let mut out = Channel::default();
    for epoch in drive.epochs().skip(1) {
        if let Some(estimate) = estimator.step(&epoch).unwrap() {
            out.push(epoch.time, estimate).unwrap();
        }
    }
    out.into_series()
}

#[test]
fn explore_comma() {
    let path = shared("data/comma2k19_rav4/canonical.csv").unwrap();
    let mut table = Table::read(&path);
    table.names.iter_mut().filter(|n| *n == "gnss_course").for_each(|n| *n = "course".into());
    let drive = table.drive();
    for (name, p) in [
        ("default", GnssInsParams::default()),
        ("no nhc", GnssInsParams { nhc: false, ..GnssInsParams::default() }),
        ("nhc 1", GnssInsParams { nhc_sigma: 1.0, ..GnssInsParams::default() }),
        ("no odo", GnssInsParams { odometer: false, ..GnssInsParams::default() }),
        ("no aid", GnssInsParams { odometer: false, nhc: false, ..GnssInsParams::default() }),
    ] {
        let mut r = crate::estimator::Run::<GnssIns>::new(&drive, &p, None).unwrap();
        r.advance(&drive, usize::MAX).unwrap();
        println!("{:?}", r.notices());
        let e = r.into_series();
        let (mut sum, mut count, mut largest) = (0.0, 0.0, 0.0f64);
        let mut att = [0.0; 3];
        let mut sq = [0.0; 3];
        for (i, &t) in e.time().iter().enumerate() {
            let tr = |n: &str| drive.truth.interpolate(drive.truth.index_of(n).unwrap(), t, 0.2);
            let d = (e.column("lat").unwrap()[i] - tr("lat")) * 6.36e6;
            let w = (e.column("lon").unwrap()[i] - tr("lon")) * 6.38e6 * tr("lat").cos();
            let x = d.hypot(w);
            if x.is_finite() {
                sum += x * x;
                count += 1.0;
                largest = largest.max(x);
                for (k, n) in ["roll", "pitch", "yaw"].iter().enumerate() {
                    let d = wrap_angle(e.column(n).unwrap()[i] - tr(n)).to_degrees();
                    att[k] += d;
                    sq[k] += d * d;
                }
            }
        }
        println!("{name}: rms {} max {largest} att mean {:?} rms {:?} n {count} of {}", (sum / count as f64).sqrt(), att.map(|a| a / count), sq.map(|a| (a / count).sqrt()), e.len());
        for n in ["position", "velocity", "odometer", "nhc"] {
            let a = e.column(&format!("{n}_accepted")).unwrap();
            let (yes, no) = (a.iter().filter(|v| **v == 1.0).count(), a.iter().filter(|v| **v == 0.0).count());
            print!("{n} {yes}/{no}  ");
        }
        println!();
        for i in [300, 1000, 3000, 6000] {
            println!("t {:.1} pitch {:.2} roll {:.2} yaw {:.2} ba {:?} v {:.2} alt {:.1}", e.time()[i] - e.time()[0], e.column("pitch").unwrap()[i].to_degrees(), e.column("roll").unwrap()[i].to_degrees(), e.column("yaw").unwrap()[i].to_degrees(), ["x","y","z"].map(|a| e.column(&format!("accel_bias_{a}")).unwrap()[i]), e.column("speed").unwrap()[i], e.column("alt").unwrap()[i]);
        }
    }
}

#[test]
fn explore_default() {
    for name in ["table1", "urban", "obstacle", "jturn", "table1_navgrade"] {
        let drive = case(name).unwrap();
        let mut r = crate::estimator::Run::<GnssIns>::new(&drive, &GnssInsParams::default(), None).unwrap();
        r.advance(&drive, usize::MAX).unwrap();
        println!("{:?}", r.notices());
        let e = r.into_series();
        let first = e.column("yaw").unwrap().iter().position(|y| y.is_finite()).unwrap_or(0);
        let yaw_at = |i: usize| wrap_angle(e.column("yaw").unwrap()[i] - drive.truth.interpolate(drive.truth.index_of("yaw").unwrap(), e.time()[i], 1.0)).to_degrees();
        println!("{name}: n {} yaw known {} off {:.2} sig {:.2} end off {:.2} sig {:.2} err {:?}", e.len(), e.time()[first], yaw_at(first), e.column("yaw_sigma").unwrap()[first].to_degrees(), yaw_at(e.len()-1), e.column("yaw_sigma").unwrap()[e.len()-1].to_degrees(), horizontal_errors(&drive, &e, 0.0, 1e9));
    }
}
