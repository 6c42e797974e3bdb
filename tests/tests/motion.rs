//! Motion mode, land navigation and the six-accelerometer disk on simulated drives, seed after seed. Thresholds and sigmas
//! were set on the specification's own cases, so that these drives, with another car, other sensors and other noise, are
//! blind. A failure means that a mode comes late or wrongly, or that an aid no longer holds what it should.
#![allow(clippy::unwrap_used)]

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::mode::{GUARD, ModeScore};
use drivescope_estimation::score::score;
use drivescope_simulation::{drives, named, simulate};
use drivescope_tests::rms;
use serde_json::{Value, json};

const SEEDS: std::ops::Range<u64> = 300..308;

fn drive(name: &str, seed: u64) -> Drive {
    simulate(&named(name).unwrap(), Some(seed)).unwrap()
}

fn estimate(drive: &Drive, estimator: &str, params: &Value) -> Series {
    run_by_name(estimator, drive, params, None).unwrap().into_series()
}

fn mode_score(drive: &Drive, estimator: &str, params: &Value) -> ModeScore {
    score(&estimate(drive, estimator, params), drive, None).mode.unwrap()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2])
}

#[test]
fn modes_are_right_and_prompt_over_eight_seeds() {
    for (name, estimator) in [("u_drive", "motion_mode"), ("u_drive_disk", "gyro_free"), ("stop_and_go", "motion_mode")]
    {
        for seed in SEEDS {
            let drive = drive(name, seed);
            let m = mode_score(&drive, estimator, &Value::Null);
            let missed = m.launch.missed + m.stop.missed + m.corner_entry.missed;
            assert!(m.accuracy >= 0.95 && m.accuracy_guarded >= 0.98 && missed == 0, "{name} {seed}: {m:?}");
            assert!(m.launch.max <= 1.0 && m.stop.max <= 1.2 && m.corner_entry.max <= 0.6, "{name} {seed}: {m:?}");
            // The inertial sensor alone, as the specification's reference has it: no wheels, no satellites.
            let alone = mode_score(&drive, estimator, &json!({"use_speed": false}));
            let missed = alone.launch.missed + alone.stop.missed + alone.corner_entry.missed;
            assert!(alone.accuracy >= 0.95 && missed == 0, "{name} {seed}: {alone:?}");
            assert!(alone.accuracy_guarded >= 0.98, "{name} {seed}: {alone:?}");
            assert!(alone.launch.max <= 1.0 && alone.stop.max <= 1.2, "{name} {seed}: {alone:?}");
            assert!(alone.corner_entry.max <= 0.6, "{name} {seed}: {alone:?}");
            println!(
                "{name} {seed}: accuracy {:.4}, guarded {:.4}, launch {:.2}, stop {:.2}, entry {:.2}, exit {:.2}; without wheels {:.4}, {:.4}, launch {:.2}, stop {:.2}",
                m.accuracy,
                m.accuracy_guarded,
                m.launch.max,
                m.stop.max,
                m.corner_entry.max,
                m.corner_exit.max,
                alone.accuracy,
                alone.accuracy_guarded,
                alone.launch.max,
                alone.stop.max
            );
        }
    }
}

/// Rows at rest found, rows at rest, rows in motion taken for rest, rows in motion; outside the guard of a change.
fn rest_counts(series: &Series, drive: &Drive) -> [f64; 4] {
    let truth = drive.truth.column("mode").unwrap();
    let time = drive.truth.time();
    let changes: Vec<f64> =
        (1..truth.len()).filter(|&k| (truth[k] == 0.0) != (truth[k - 1] == 0.0)).map(|k| time[k]).collect();
    let mut counts = [0.0; 4];
    for (row, &t) in series.time().iter().enumerate() {
        let near = changes.partition_point(|&c| c < t - GUARD);
        if changes.get(near).is_some_and(|c| (c - t).abs() <= GUARD) {
            continue;
        }
        let k = time.partition_point(|&x| x < t - 1e-6);
        let (rests, says) = (truth[k] == 0.0, series.column("mode").unwrap()[row] == 0.0);
        counts[if rests { 1 } else { 3 }] += 1.0;
        counts[if rests { 0 } else { 2 }] += f64::from(u8::from(says));
    }
    counts
}

#[test]
fn rest_is_found_on_the_built_in_drives() {
    // Ten minutes at most each: the hour of motorway has no rest but its ends.
    let mut sum = [0.0; 4];
    for entry in drives().iter().filter(|d| d.duration_hint < 900.0) {
        let drive = simulate(&named(entry.name).unwrap(), None).unwrap();
        let found = rest_counts(&estimate(&drive, "motion_mode", &Value::Null), &drive);
        println!("{}: rest {} of {}, false {} of {}", entry.name, found[0], found[1], found[2], found[3]);
        sum.iter_mut().zip(found).for_each(|(s, f)| *s += f);
    }
    let (recall, wrong) = (sum[0] / sum[1], sum[2] / sum[3]);
    println!("recall {recall:.5}, false {wrong:.5}");
    assert!(recall >= 0.99 && wrong <= 0.003, "recall {recall}, false {wrong}");
}

/// Root mean square error of three rates, rad/s, against the truth at the same rows.
fn rate_errors(series: &Series, drive: &Drive, prefix: &str) -> [f64; 3] {
    ["x", "y", "z"].map(|axis| {
        let rates = series.column(&format!("{prefix}_{axis}")).unwrap();
        let truth = drive.truth.column(&format!("gyro_{axis}")).unwrap();
        rms(rates.iter().zip(truth).map(|(a, b)| a - b))
    })
}

#[test]
fn the_disk_holds_the_rates_that_plain_integration_loses() {
    for seed in SEEDS {
        let drive = drive("u_drive_disk", seed);
        let series = estimate(&drive, "gyro_free", &Value::Null);
        let (filtered, plain) = (rate_errors(&series, &drive, "rate"), rate_errors(&series, &drive, "plain_rate"));
        println!("{seed}: filter {filtered:.4?}, plain {plain:.4?} rad/s");
        assert!(filtered.iter().all(|e| *e <= 0.012), "{seed}: {filtered:?}");
        assert!(filtered.iter().zip(plain).all(|(f, p)| *f < 0.5 * p), "{seed}: {filtered:?} against {plain:?}");
    }
}

/// Aids of the land INS switched off, all of them.
fn plain() -> Value {
    json!({"zupt": false, "zaru": false, "nhc": false, "straight": false, "initial_yaw": 0.0, "use_speed": false})
}

fn horizontal(drive: &Drive, params: &Value) -> f64 {
    score(&estimate(drive, "land_ins", params), drive, None).position.unwrap().rmse_horizontal
}

#[test]
fn the_modes_divide_the_position_error_of_plain_navigation_by_four_or_more() {
    let modes = json!({"initial_yaw": 0.0, "use_speed": false});
    let mut errors = [Vec::new(), Vec::new(), Vec::new()];
    for seed in SEEDS {
        let drive = drive("u_drive", seed);
        let wheel = json!({"initial_yaw": 0.0, "use_speed": false, "wheel": true});
        for (errors, params) in errors.iter_mut().zip([plain(), modes.clone(), wheel]) {
            errors.push(horizontal(&drive, &params));
        }
    }
    println!("plain {:.1?}\nmodes {:.1?}\nmodes and wheels {:.1?} m", errors[0], errors[1], errors[2]);
    let [plain, modes, wheel] = errors.map(median);
    println!("medians: plain {plain:.1}, modes {modes:.1}, modes and wheels {wheel:.1} m");
    assert!(modes <= 0.25 * plain, "modes {modes} m, plain {plain} m");
    assert!(wheel <= 0.5 * modes, "wheels {wheel} m, modes {modes} m");
}

#[test]
fn a_heading_that_is_found_serves_as_well_as_a_given_one() {
    // One course at 2 m/s is 5 deg off and more: taken alone it left up to 18 m on this way of 600 m.
    for seed in SEEDS {
        let drive = drive("u_drive", seed);
        let error = horizontal(&drive, &Value::Null);
        // An uncertain heading let the wheels turn the state while the courses were taken: up to 7.8 m, 3 deg off.
        let series = estimate(&drive, "land_ins", &json!({"wheel": true}));
        let wheel = score(&series, &drive, None).position.unwrap().rmse_horizontal;
        let sigma = series.column("yaw_sigma").unwrap()[0];
        println!("{seed}: {error:.2} m, with wheels {wheel:.2} m, yaw known to {:.2} deg", sigma.to_degrees());
        assert!(error <= 5.0 && wheel <= 2.5, "{seed}: {error} m, with wheels {wheel} m");
        // The courses' 1 deg and no more than half a degree of noise; the magnetometer's 11 deg are replaced.
        assert!((0.017..0.027).contains(&sigma), "{seed}: {sigma} rad");
    }
}

#[test]
fn satellites_and_modes_bridge_an_outage_with_either_sensor() {
    let changes = json!({"gnss_outages": [{"start": 30.0, "duration": 30.0}]});
    for name in ["u_drive", "u_drive_disk"] {
        let spec = drivescope_simulation::named_with(name, &changes).unwrap();
        let mut errors = [Vec::new(), Vec::new()];
        for seed in SEEDS {
            let drive = simulate(&spec, Some(seed)).unwrap();
            let satellites = json!({"zupt": false, "zaru": false, "nhc": false, "straight": false, "gnss": true});
            errors[0].push(horizontal(&drive, &satellites));
            errors[1].push(horizontal(&drive, &json!({"gnss": true})));
        }
        let [alone, modes] = errors.map(median);
        println!("{name}: satellites alone {alone:.2} m, with modes {modes:.2} m");
        assert!(modes <= 0.5 * alone && modes <= 10.0, "{name}: {modes} m against {alone} m");
    }
}

/// Modes against those of a reference by time.
fn agreement(series: &Series, reference: impl Fn(f64) -> Option<f64>) -> ModeScore {
    let labels: Vec<f64> = series.time().iter().map(|&t| reference(t).unwrap_or(f64::NAN)).collect();
    ModeScore::new(series.time(), series.column("mode").unwrap(), &labels).unwrap()
}

#[test]
fn modes_of_ground_robots_agree_with_wheels_and_heading() {
    // The Husky's sensor lies with its y axis up; the Jackal's is upright.
    for (file, down) in [("husky_test1_ros2.mcap", [0.0, -1.0, 0.0]), ("jackal_test2_ros2.mcap", [0.0, 0.0, -1.0])] {
        let Some(path) = drivescope_tests::shared(&format!("data/clearpath_bag/{file}")) else { return };
        let robot = drivescope_tests::mcap::Robot::read(&std::fs::read(path).unwrap());
        let mounting = robot.mounting();
        assert!((mounting.row(2).transpose() - nalgebra::Vector3::from(down)).norm() < 0.05, "{file}: {mounting:.2}");
        let series = estimate(&robot.drive(false), "motion_mode", &Value::Null);
        let found = agreement(&series, |t| {
            let (speed, turn) = (robot.wheels_at(t)?.0, robot.turn_rate(t)?);
            Some(if speed.abs() < 0.05 && turn.abs() < 0.02 {
                0.0
            } else if turn.abs() > 0.04 {
                2.0
            } else {
                1.0
            })
        });
        println!("{file}: {found:?}");
        assert!(found.count > 2900 && found.accuracy_guarded >= 0.95, "{file}: {found:?}");
    }
}

/// Speed over ground and turn rate from the positions of a log's fixes, over two seconds about a time.
fn by_fixes(drive: &Drive, time: f64) -> Option<(f64, f64)> {
    let frame = drivescope_drive::geodesy::LocalFrame::new(drive.origin()?);
    let (times, lat, lon) = (drive.gnss.time(), drive.gnss.column("gnss_lat")?, drive.gnss.column("gnss_lon")?);
    let at = |t: f64| {
        let after = times.partition_point(|&x| x < t);
        let k = after.checked_sub(1).filter(|_| after < times.len())?;
        let place = |k: usize| {
            let alt = frame.origin.alt;
            frame.to_ned(drivescope_drive::geodesy::Geodetic { lat: lat[k], lon: lon[k], alt })
        };
        Some(place(k) + (place(after) - place(k)) * ((t - times[k]) / (times[after] - times[k])))
    };
    let (back, here, ahead) = (at(time - 1.0)?, at(time)?, at(time + 1.0)?);
    let (a, b) = (here - back, ahead - here);
    let turn = drivescope_drive::frames::wrap_angle(b.y.atan2(b.x) - a.y.atan2(a.x));
    Some((0.5 * (a.norm() + b.norm()), turn))
}

/// The columns of a CSV file over its rows with all cells: a raw sentence in quotes may break a line in two.
fn whole_rows(path: &std::path::Path) -> std::collections::BTreeMap<String, Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<&str>> =
        lines.map(|l| l.split(',').collect()).filter(|r: &Vec<_>| r.len() >= names.len()).collect();
    let column = |i: usize| rows.iter().map(|r| r[i].parse().unwrap_or(f64::NAN)).collect();
    names.iter().enumerate().map(|(i, name)| ((*name).to_string(), column(i))).collect()
}

/// A car that drives in circles: inertial samples from one table, fixes from another, each with its own clock columns;
/// inertial stamps are `late` s behind those of the fixes.
fn circles(
    imu: &str,
    imu_time: [&str; 2],
    names: [&str; 6],
    gps: &str,
    gps_time: [&str; 2],
    late: f64,
) -> Option<Drive> {
    let (imu, gps) = (drivescope_tests::shared(imu)?, drivescope_tests::shared(gps)?);
    let (imu, gps) = (whole_rows(&imu), whole_rows(&gps));
    // Seconds and, in some of the files, nanoseconds; from a common instant.
    let clock = |table: &std::collections::BTreeMap<String, Vec<f64>>, [whole, rest]: [&str; 2]| -> Vec<f64> {
        let parts = table.get(rest).cloned().unwrap_or_else(|| vec![0.0; table[whole].len()]);
        table[whole].iter().zip(parts).map(|(s, n)| s + n * 1e-9).collect()
    };
    let (imu_time, gps_time) = (clock(&imu, imu_time), clock(&gps, gps_time));
    let start = imu_time.iter().copied().find(|t| t.is_finite())?;
    let mut drive = Drive::default();
    let columns = names.map(|n| &imu[n]);
    for (row, time) in imu_time.iter().enumerate().filter(|(_, t)| t.is_finite()) {
        let [accel_x, accel_y, accel_z, gyro_x, gyro_y, gyro_z] = columns.map(|c| c[row]);
        let sample = drivescope_drive::signals::Imu { accel_x, accel_y, accel_z, gyro_x, gyro_y, gyro_z };
        // A repeated stamp is left out.
        let _ = drive.imu.push(time - start, sample);
    }
    for (row, time) in gps_time.iter().enumerate().filter(|(_, t)| t.is_finite()) {
        let (lat, lon) = (gps["latitude"][row].to_radians(), gps["longitude"][row].to_radians());
        let fix = drivescope_drive::signals::Gnss { lat, lon, ..drivescope_drive::signals::Gnss::default() };
        let _ = drive.gnss.push(time - start + late, fix);
    }
    Some(drive)
}

/// The mode that positions alone tell, over the second before and the second after: where fixes a second apart tell neither
/// rest from creeping nor a bend from their own noise, they say nothing.
fn mode_by_fixes(drive: &Drive, time: f64) -> Option<f64> {
    let (speed, turn) = by_fixes(drive, time)?;
    Some(match (speed, turn.abs()) {
        (..0.1, _) => 0.0,
        (1.0.., 0.08..) => 2.0,
        (1.0.., ..0.04) => 1.0,
        _ => return None,
    })
}

/// The same drive with every second fix only, from the first or the second on.
fn with_half_the_fixes(drive: &Drive, first: usize) -> Drive {
    let mut half = Drive { gnss: drivescope_drive::channel::Channel::default(), ..drive.clone() };
    for k in (first..drive.gnss.len()).step_by(2) {
        let (time, fix) = drive.gnss.at(k);
        half.gnss.push(time, fix).unwrap();
    }
    half
}

fn first_car() -> Option<Drive> {
    let folder = "data/vn100_circles";
    circles(
        &format!("{folder}/circle_data_0_imu.csv"),
        ["t", "none"],
        ["acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"],
        &format!("{folder}/circle_data_0_gps.csv"),
        ["t", "none"],
        0.0,
    )
}

fn second_car() -> Option<Drive> {
    let linear = ["linear_acceleration_x", "linear_acceleration_y", "linear_acceleration_z"];
    let angular = ["angular_velocity_x", "angular_velocity_y", "angular_velocity_z"];
    let file = "data/vn100_circles/car2/data_going_in_circles.csv";
    circles(
        file,
        ["timestamp_sec_imu", "timestamp_nanosec_imu"],
        [linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]],
        file,
        ["timestamp_sec_gps", "timestamp_nanosec_gps"],
        // Yaw rate against course rate: correlation 0.75 as stamped, 0.965 at 4.75 s.
        4.75,
    )
}

#[test]
fn modes_of_cars_in_circles_agree_with_their_fixes() {
    for (name, drive) in [("first car", first_car()), ("second car", second_car())] {
        let Some(drive) = drive else { return };
        println!("{name}: {} inertial, {} fixes, span {:?}", drive.imu.len(), drive.gnss.len(), drive.span());
        let alone = estimate(&drive, "motion_mode", &json!({"use_speed": false}));
        let found = agreement(&alone, |t| mode_by_fixes(&drive, t));
        println!("{name}, inertial sensor alone: {found:?}");
        // The second car's log begins with a still engine; once that runs, it shakes the standing car beyond the threshold
        // learned before, and the inertial sensor alone cannot tell that from rolling: not held to the limit there.
        let engine_starts = if name == "second car" { 11.4 } else { f64::INFINITY };
        let found = agreement(&alone, |t| mode_by_fixes(&drive, t).filter(|mode| *mode > 0.0 || t < engine_starts));
        println!("{name}, inertial sensor alone, without rests with a running engine: {found:?}");
        assert!(found.count > 2300 && found.accuracy_guarded >= 0.95, "{name}: {found:?}");
        // With the fixes, over the whole log. What they are used for, whether they stayed for two seconds until now, and what
        // they are the reference for, the motion over the second before and the one to come, are not the same; how far the
        // agreement is the receiver's with itself, the two tests below say.
        let series = estimate(&drive, "motion_mode", &Value::Null);
        let found = agreement(&series, |t| mode_by_fixes(&drive, t));
        println!("{name}: {found:?}");
        assert!(found.count > 2400 && found.accuracy_guarded >= 0.95, "{name}: {found:?}");
        // By the tables alone the second car, which starts into a bend, is at rest until 0.8 m/s. The first one's log begins
        // in a bend: its first row is not yet known to be one.
        for series in [&alone, &series] {
            let (modes, turns) = (series.column("mode").unwrap(), series.column("yd").unwrap());
            let rows =
                modes.iter().zip(turns).filter(|(mode, yaw_rate)| **mode == 0.0 && yaw_rate.abs() > 0.05).count();
            assert!(rows <= usize::from(name == "first car"), "{name}: at rest and turning, {rows} rows");
        }
    }
}

/// The modes use one half of the fixes and the other half judges rest and motion: no fix is on both sides. Fixes two seconds
/// apart tell a halt a second later than those of the log, which the limit allows for. Catches modes that merely repeat the
/// fixes they are held against.
#[test]
fn modes_that_hear_half_the_fixes_agree_with_the_other_half() {
    let Some(drive) = second_car() else { return };
    let moves = |mode: f64| f64::from(u8::from(mode > 0.0));
    for first in [0, 1] {
        let others = with_half_the_fixes(&drive, 1 - first);
        let found = [json!({"use_speed": false}), Value::Null].map(|params| {
            let series = estimate(&with_half_the_fixes(&drive, first), "motion_mode", &params);
            let modes: Vec<f64> = series.column("mode").unwrap().iter().map(|m| moves(*m)).collect();
            let reference = |t: &f64| mode_by_fixes(&others, *t).map_or(f64::NAN, moves);
            let reference: Vec<f64> = series.time().iter().map(reference).collect();
            ModeScore::new(series.time(), &modes, &reference).unwrap()
        });
        println!("second car, fixes from {first} on, inertial sensor alone and with fixes: {found:?}");
        let [alone, found] = found;
        assert!(found.count > 2500 && found.accuracy_guarded >= 0.93, "{found:?}");
        assert!(found.accuracy_guarded >= alone.accuracy_guarded + 0.05, "{found:?} {alone:?}");
    }
}

/// A car that stands does not turn: the yaw gyro, which the rule of fixes reads for clear turns only, is nearly as quiet in the
/// rests that fixes tell as a standing engine leaves it, and is not so while the car rolls at walking pace, for nobody steers
/// that straight. Catches rest told of a car that rolls while its receiver holds its place.
#[test]
fn the_yaw_gyro_confirms_the_rests_that_fixes_tell() {
    let Some(drive) = second_car() else { return };
    let series = estimate(&drive, "motion_mode", &Value::Null);
    let column = |name| series.column(name).unwrap();
    let (modes, rules, turns) = (column("mode"), column("rule"), column("yd"));
    let fixes_stay = drivescope_estimation::motion_mode::Rule::FixesStay.code();
    let last_rest = modes.iter().rposition(|m| *m == 0.0).unwrap();
    let (mut is_told, mut told, mut rolls) = (false, Vec::new(), Vec::new());
    for row in 0..=last_rest {
        is_told = modes[row] == 0.0 && (is_told || rules[row] == fixes_stay);
        match (is_told, modes[row] > 0.0) {
            (true, _) => told.push(turns[row]),
            (_, true) => rolls.push(turns[row]),
            _ => {}
        }
    }
    let quiet = |turns: &[f64]| turns.iter().filter(|t| t.abs() < 0.003).count() as f64 / turns.len() as f64;
    let found = [quiet(&told), quiet(&rolls)];
    println!(
        "yaw rate below 0.003 rad/s: told by fixes {found:.3?} rolling; of {} and {} rows",
        told.len(),
        rolls.len()
    );
    // The rest of what is told is the launch out of the first rest, into a bend, which is told a second late.
    assert!(told.len() > 300 && found[0] >= 0.85 && found[1] <= 0.2, "{found:?}");
}

#[test]
#[ignore = "prints the time of a step; the number depends on the machine"]
fn a_step_costs_little() {
    let (full, disk) = (drive("u_drive", 300), drive("u_drive_disk", 300));
    for (name, drive) in [
        ("motion_mode", &full),
        ("land_ins", &full),
        ("stationarity", &full),
        ("gyro_free", &disk),
        ("land_ins", &disk),
    ] {
        let best = (0..15)
            .map(|_| {
                let begin = std::time::Instant::now();
                let rows = estimate(
                    drive,
                    name,
                    &json!(if name == "land_ins" { json!({"initial_yaw": 0}) } else { Value::Null }),
                )
                .len();
                begin.elapsed().as_secs_f64() * 1e9 / rows as f64
            })
            .fold(f64::INFINITY, f64::min);
        println!("{name}: {best:.0} ns a row");
    }
}
