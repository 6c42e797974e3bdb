//! Grade of real and simulated roads beyond the case logs: what a drive tells of its own sensors, both directions of time,
//! and several passes over one road. A failure means a sign in the drive played backward, an offset or a delay that is
//! found wrongly, or passes that are merged at different places.
#![allow(clippy::unwrap_used)]

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_estimation::estimator::run;
use drivescope_estimation::latency::{find_wheel_latency, with_earlier_wheels};
use drivescope_estimation::levelling::find_forward_offset;
use drivescope_estimation::road_profile::{RoadProfile, SPACING};
use drivescope_estimation::score::{Metric, score};
use drivescope_estimation::slope::two_way::run_two_way;
use drivescope_estimation::slope::{Slope, SlopeParams};
use drivescope_tests::svg::{Curve, plot};
use drivescope_tests::{open, rms, shared};

const RAV4: &str = "data/comma2k19_rav4/canonical.csv";

fn grade(series: &Series, drive: &Drive) -> Metric {
    score(series, drive, None).metrics.into_iter().find(|m| m.column == "grade").unwrap()
}

#[test]
fn the_motorway_drive_from_both_sides_meets_its_grade_at_every_row_with_the_defaults() {
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    let alone = SlopeParams { use_baro: false, use_gnss: false, ..SlopeParams::default() };
    let found = grade(&run_two_way(&drive, &alone, None).unwrap(), &drive);
    // The limits, over every row of the log, with the constant mount offset removed.
    assert!(found.correlation >= 0.955, "correlation {:.4}", found.correlation);
    assert!(found.rmse_centred.to_degrees() <= 0.58, "{:.3} deg", found.rmse_centred.to_degrees());
}

#[test]
fn the_motorway_drive_finds_its_own_mount_and_comes_below_half_a_degree() {
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    let offset = find_forward_offset(&drive).unwrap();
    // The phone leans 3.8 to 4.2 deg by other means: 0.65 to 0.72 m/s^2.
    assert!((-0.74..=-0.63).contains(&offset.offset), "{offset:?}");
    let params = SlopeParams { accel_offset: offset.offset, use_gnss_height: true, ..SlopeParams::default() };
    let found = grade(&run_two_way(&drive, &params, None).unwrap(), &drive);
    assert!(found.correlation >= 0.97, "correlation {:.4}", found.correlation);
    assert!(found.rmse_centred.to_degrees() <= 0.45, "{:.3} deg", found.rmse_centred.to_degrees());
    // Nothing is left to remove: the mean is right as well.
    assert!(found.rmse.to_degrees() <= 0.45, "{:.3} deg with its mean", found.rmse.to_degrees());
    println!(
        "{:.4} {:.3} deg, {:.3} deg with its mean",
        found.correlation,
        found.rmse_centred.to_degrees(),
        found.rmse.to_degrees()
    );
}

/// A column at `rate` rows a second: seconds since the drive's start, deg.
fn thinned(series: &Series, column: &str, start: f64, rate: f64, offset: f64) -> Vec<(f64, f64)> {
    let (index, end) = (series.index_of(column).unwrap(), *series.time().last().unwrap());
    let times = (0..).map(|k| start + f64::from(k) / rate).take_while(|t| *t <= end);
    let points = times.map(|t| (t - start, series.interpolate(index, t, 1.0).to_degrees() - offset));
    points.filter(|p| p.1.is_finite()).collect()
}

#[test]
fn the_plot_of_the_motorway_drive_in_the_documents_is_what_comes_out() {
    // DRIVESCOPE_GOLDEN_UPDATE writes it anew.
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    let start = drive.span().unwrap().0;
    let causal = run::<Slope>(&drive, &SlopeParams::default(), None).unwrap().into_series();
    let offset = find_forward_offset(&drive).unwrap().offset;
    let params = SlopeParams { accel_offset: offset, use_gnss_height: true, ..SlopeParams::default() };
    let corrected = run_two_way(&drive, &params, None).unwrap();
    let told = |series: &Series| {
        let found = grade(series, &drive);
        (
            found.bias.to_degrees(),
            format!("correlation {:.3}, RMS {:.2} deg", found.correlation, found.rmse_centred.to_degrees()),
        )
    };
    let ((bias, causal_told), (_, corrected_told)) = (told(&causal), told(&corrected));
    let names = [
        format!("as driven, defaults, {:.1} deg of mount taken off: {causal_told}", -bias),
        format!("offset found, GNSS heights, both directions: {corrected_told}"),
    ];
    let curves = [
        Curve { name: &names[0], colour: "#9aa4ae", width: 1.0, points: thinned(&causal, "grade", start, 5.0, bias) },
        Curve { name: &names[1], colour: "#0b63bd", width: 1.8, points: thinned(&corrected, "grade", start, 5.0, 0.0) },
        Curve { name: "truth", colour: "#15191e", width: 1.0, points: thinned(&drive.truth, "grade", start, 2.0, 0.0) },
    ];
    let title = "Grade of the motorway drive of comma2k19 (MIT licence): two estimates and the truth";
    let drawn = plot(title, ("time, s", 0.0, 60.0, 10.0), ("grade, deg", -6.0, 6.0, 2.0), &curves);
    let kept = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/slope_motorway.svg");
    if std::env::var_os("DRIVESCOPE_GOLDEN_UPDATE").is_some() {
        std::fs::write(&kept, &drawn).unwrap();
    }
    // The figures stand in the keys; a last digit of a coordinate may differ between machines.
    let keys =
        |text: &str| text.lines().filter(|l| l.starts_with("<text x=\"148\"")).map(String::from).collect::<Vec<_>>();
    let written = std::fs::read_to_string(&kept).unwrap();
    assert_eq!(keys(&drawn), keys(&written));
    assert_eq!(drawn.len().abs_diff(written.len()) * 100 / drawn.len(), 0, "another plot is in the documents");
}

#[test]
fn wheel_speeds_fifty_milliseconds_late_are_found_to_ten() {
    for case in ["b2_flat_accel_brake", "b4_mild_grade_accel_brake"] {
        let Some(path) = shared(&format!("spec/slope/{case}.csv.gz")) else { return };
        let drive = open(&path);
        let late = with_earlier_wheels(&drive, -0.05).unwrap();
        let (before, after) = (find_wheel_latency(&drive).unwrap(), find_wheel_latency(&late).unwrap());
        assert!((after.delay - before.delay - 0.05).abs() < 0.01, "{case}: {before:?} {after:?}");
    }
}

#[test]
fn every_offer_to_correct_late_wheels_is_right_to_ten_milliseconds() {
    // The table of docs/slope.md; run with --nocapture to see it. Catches slip, pitch and curves that are taken for a delay,
    // and a standard deviation that promises too much.
    let has_to_tell =
        ["city_hills", "urban", "slope_speedbump", "stop_and_go", "city_loop", "mountain_pass", "u_drive"];
    let wanted = |d: &&drivescope_simulation::NamedDrive| d.duration_hint < 250.0 || has_to_tell.contains(&d.name);
    let made = drivescope_simulation::drives().iter().filter(wanted).map(|d| {
        let spec = drivescope_simulation::named(d.name).unwrap();
        let grade =
            drivescope_simulation::grades::Grade::named(spec.parts.wheels.as_ref().unwrap_or(&spec.sensors)).unwrap();
        (d.name, grade.car.latency, drivescope_simulation::simulate(&spec, None).unwrap())
    });
    for (name, own, drive) in made {
        let read = [0.0, 0.05, 0.1].map(|late| {
            let found = find_wheel_latency(&with_earlier_wheels(&drive, -late).unwrap());
            if let Some(f) = found {
                assert!((f.delay - late - own).abs() < 0.01, "{name}, {late} s: {f:?}");
                assert_eq!(f.is_notable(), late + own > 0.02, "{name}, {late} s: {f:?}");
            }
            found.map_or("none".into(), |f| format!("{:.0} +- {:.1}", 1e3 * f.delay, 1e3 * f.sigma))
        });
        println!("{name} | {}", read.join(" | "));
        assert!(!has_to_tell.contains(&name) || read.iter().all(|r| r != "none"), "{name}: {read:?}");
    }
}

#[test]
fn a_motorway_at_one_speed_does_not_tell_a_delay_from_slip() {
    // The wheels of the real drive turn in curves 70 to 80 ms after its yaw gyro, its bus tells the yaw rate 30 ms late, and a
    // fit without slip reads a lead: none of them may be offered.
    let Some(path) = shared(RAV4) else { return };
    let drive = open(&path);
    for late in [0.0, 0.05, 0.1] {
        let found = find_wheel_latency(&with_earlier_wheels(&drive, -late).unwrap());
        assert!(found.is_none(), "{late} s: {found:?}");
    }
}

/// Errors of a profile's grade against the truth at the same places, rad.
fn errors(profile: &RoadProfile, estimate: &Series, drive: &Drive) -> Vec<f64> {
    let (speed, index) = (estimate.column("speed").unwrap(), drive.truth.index_of("grade").unwrap());
    let (mut distance, mut truth): (f64, Vec<(f64, f64)>) = (0.0, Vec::new());
    for (row, pair) in estimate.time().windows(2).enumerate() {
        let mean = 0.5 * (speed[row] + speed[row + 1]);
        if mean.abs() >= 0.3 {
            distance += mean * (pair[1] - pair[0]);
            truth.push((distance, drive.truth.interpolate(index, pair[1], 1.0)));
        }
    }
    let near = |d: f64| {
        let range =
            truth.partition_point(|t| t.0 < d - 0.5 * SPACING)..truth.partition_point(|t| t.0 < d + 0.5 * SPACING);
        truth[range.clone()].iter().map(|t| t.1).sum::<f64>() / range.len() as f64
    };
    profile.points.iter().map(|(d, p)| p.grade - near(d)).filter(|e| e.is_finite()).collect()
}

#[test]
fn four_passes_over_one_road_are_better_than_one() {
    let spec = drivescope_simulation::named("mountain_pass").unwrap();
    let (mut passes, mut first) = (Vec::new(), None);
    for seed in 11..15 {
        let drive = drivescope_simulation::simulate(&spec, Some(seed)).unwrap();
        let params = SlopeParams::default().with_pitch_of(drive.vehicle.as_ref().unwrap());
        let causal = run::<Slope>(&drive, &params, None).unwrap().into_series();
        let single = rms(errors(&RoadProfile::of_pass(&causal, &drive, SPACING).unwrap(), &causal, &drive));
        assert!(single.to_degrees() <= 0.3, "one pass as it is driven: {:.3} deg", single.to_degrees());
        let estimate = run_two_way(&drive, &params, None).unwrap();
        let pass = RoadProfile::of_pass(&estimate, &drive, SPACING).unwrap();
        let both = rms(errors(&pass, &estimate, &drive));
        assert!(both < single, "from both sides: {:.3} deg", both.to_degrees());
        println!("seed {seed}: {:.3} deg, from both sides {:.3} deg", single.to_degrees(), both.to_degrees());
        passes.push(pass);
        first.get_or_insert((estimate, drive));
    }
    let merged = RoadProfile::merged(&passes).unwrap();
    let (estimate, drive) = first.unwrap();
    let error = rms(errors(&merged, &estimate, &drive));
    println!("merged {:.3} deg", error.to_degrees());
    assert!(error.to_degrees() <= 0.15, "four passes: {:.3} deg", error.to_degrees());
    assert!(merged.points.iter().filter(|(_, p)| p.passes == 4.0).count() * 10 > 9 * merged.points.len());
}

/// Rms error of the grade on a case, deg, after the first second.
fn case_error(drive: &Drive, params: &SlopeParams, mass: f64) -> f64 {
    let mut car = drivescope_drive::vehicle::VehicleParams::preset("kim_2014").unwrap();
    car.mass *= mass;
    let series = run::<Slope>(drive, params, Some(&car)).unwrap().into_series();
    let window = Some((drive.span().unwrap().0 + 1.0, f64::INFINITY));
    score(&series, drive, window).metrics.into_iter().find(|m| m.column == "grade").unwrap().rmse.to_degrees()
}

#[test]
fn a_wrong_mass_hardly_moves_the_grade_and_a_late_wheel_speed_does() {
    // The table of docs/slope.md; run with --nocapture to see it.
    let spec = SlopeParams::default();
    for case in ["b1_uphill15_gearshift", "b2_flat_accel_brake", "b3_slope_speedbump", "b4_mild_grade_accel_brake"] {
        let Some(path) = shared(&format!("spec/slope/{case}.csv.gz")) else { return };
        let drive = open(&path);
        let stiffer = |factor: f64| SlopeParams {
            squat_gain: spec.squat_gain / factor,
            pitch_frequency: spec.pitch_frequency * factor.sqrt(),
            ..spec.clone()
        };
        let late = with_earlier_wheels(&drive, -0.1).unwrap();
        let matched = SlopeParams { wheel_latency: 0.1, ..spec.clone() };
        let [right, heavy, light] = [1.0, 1.2, 0.8].map(|mass| case_error(&drive, &spec, mass));
        let [hard, soft] = [1.25, 0.75].map(|factor| case_error(&drive, &stiffer(factor), 1.0));
        let [late, matched] = [&spec, &matched].map(|params| case_error(&late, params, 1.0));
        println!("{case} | {right:.3} | {heavy:.3} | {light:.3} | {hard:.3} | {soft:.3} | {late:.3} | {matched:.3}");
        // The mass only scales the forces and with them how fast they may walk: a tenth of the error at most.
        assert!(
            (heavy / right - 1.0).abs() < 0.1 && (light / right - 1.0).abs() < 0.1,
            "{case}: {heavy} {light} {right}"
        );
        assert!(late >= right, "{case}: {late} late, {right} in time");
    }
}

#[test]
fn a_look_back_over_late_wheels_holds_the_sensor_back_in_both_directions_of_time() {
    // A backward run that delays the sensor once more, or the wheels the wrong way, would be twice as late as no correction.
    for case in ["b2_flat_accel_brake", "b4_mild_grade_accel_brake"] {
        let Some(path) = shared(&format!("spec/slope/{case}.csv.gz")) else { return };
        let late = with_earlier_wheels(&open(&path), -0.1).unwrap();
        let matched = SlopeParams { wheel_latency: 0.1, ..SlopeParams::default() };
        let both = SlopeParams { two_way: true, ..matched.clone() };
        let [ahead, both] = [&matched, &both].map(|params| case_error(&late, params, 1.0));
        println!("{case}: {ahead:.3} deg, looked back {both:.3} deg");
        assert!(both < ahead, "{case}: {both} looked back, {ahead} looking ahead only");
    }
}

#[test]
fn trusting_the_wheels_less_on_bumps_costs_no_drive_its_grade() {
    // The table of docs/slope.md; run with --nocapture to see it.
    let mut worse = Vec::new();
    for drive in drivescope_simulation::drives().iter().filter(|d| d.duration_hint < 250.0) {
        let spec = drivescope_simulation::named(drive.name).unwrap();
        let made = drivescope_simulation::simulate(&spec, None).unwrap();
        // The drives of the accelerometer disk have no forward accelerometer, and stationary ones no wheels.
        if run::<Slope>(&made, &SlopeParams::default(), None).is_err() {
            continue;
        }
        let errors = [true, false].map(|shake_check| {
            let params = SlopeParams { shake_check, ..SlopeParams::default() };
            let series = run::<Slope>(&made, &params, None).unwrap().into_series();
            grade(&series, &made).rmse.to_degrees()
        });
        let [grade, plain_grade] = errors;
        println!("{} | {plain_grade:.3} | {grade:.3}", drive.name);
        // What is shaken is told by noise as well: a hundredth is nothing that anyone would see.
        worse.extend((grade > 1.01 * plain_grade).then_some((drive.name, plain_grade, grade)));
    }
    assert!(worse.is_empty(), "{worse:?}");
}
