//! The shipped drive: what its description promises, its determinism, and that its inertial data close on its truth.

#![allow(clippy::unwrap_used)]

use std::sync::OnceLock;

use drivescope_drive::drive::Drive;
use drivescope_drive::geodesy::{EARTH_RATE, Geodetic, gravity, radii};
use drivescope_drive::{frames, signals::Imu};
use drivescope_simulation::rng::Rng;
use drivescope_simulation::spec::Segment;
use drivescope_simulation::{
    DriveSpec, Simulation, drives, fingerprint, named, named_with, simulate, simulate_measured,
};
use nalgebra::Vector3;

fn city() -> &'static Drive {
    static DRIVE: OnceLock<Drive> = OnceLock::new();
    DRIVE.get_or_init(|| simulate(&named("city_hills").unwrap(), None).unwrap())
}

fn truth<'a>(drive: &'a Drive, name: &str) -> &'a [f64] {
    drive.truth.column(name).unwrap()
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::MAX, f64::MIN), |(lo, hi), &v| (lo.min(v), hi.max(v)))
}

/// First and last row of every standstill.
fn stops(drive: &Drive) -> Vec<(usize, usize)> {
    let mode = truth(drive, "mode");
    let mut found = Vec::new();
    let mut start = None;
    for k in 0..=mode.len() {
        match (start, mode.get(k) == Some(&0.0)) {
            (None, true) => start = Some(k),
            (Some(first), false) => {
                found.push((first, k - 1));
                start = None;
            }
            _ => {}
        }
    }
    found
}

#[test]
fn the_drive_is_what_its_description_says() {
    let drive = city();
    let (first, last) = drive.span().unwrap();
    assert!(first == 0.0 && (570.0..=660.0).contains(&last), "{last} s");
    let hint = drives().iter().find(|d| d.name == "city_hills").unwrap().duration_hint;
    assert!((hint - last).abs() < 3.0, "the menu says {hint} s, it takes {last} s");
    let (down, up) = extremes(truth(drive, "grade"));
    assert!((up.tan() - 0.08).abs() < 0.002 && (down.tan() + 0.06).abs() < 0.002, "{up} {down}");
    let (left, right) = extremes(truth(drive, "bank"));
    assert!((5_f64..6.6).contains(&right.abs().max(left.abs()).to_degrees()), "{left} {right}");
    let (_, fastest) = extremes(truth(drive, "vx"));
    assert!((21.0..23.5).contains(&fastest), "{fastest} m/s");
    let (turn_left, turn_right) = extremes(truth(drive, "yaw_rate"));
    assert!(turn_left < -0.3 && turn_right > 0.3, "tight corners both ways");
}

#[test]
fn the_car_stands_as_often_and_as_long_as_declared_and_on_hills_too() {
    let (drive, spec) = (city(), named("city_hills").unwrap());
    let declared: Vec<f64> =
        [spec.stand_at_start].into_iter().chain(spec.segments.iter().filter_map(|s| s.stop)).collect();
    let stops = stops(drive);
    assert_eq!(stops.len(), declared.len());
    for (&(a, b), seconds) in stops.iter().zip(&declared) {
        let stood = (b - a) as f64 * 0.01;
        assert!(stood >= *seconds - 0.02 && stood < seconds + 2.0, "stood {stood} s instead of {seconds} s");
    }
    let hilly = stops.iter().filter(|&&(a, b)| truth(drive, "grade")[(a + b) / 2].abs() > 0.03).count();
    assert!(hilly >= 2 && stops.len() >= 5);
}

#[test]
fn the_satellites_are_away_for_exactly_a_minute() {
    let drive = city();
    let away: Vec<f64> = drive.gnss.iter().filter(|(_, g)| !g.is_usable()).map(|(t, _)| t).collect();
    assert_eq!(away.len(), 60, "one fix a second");
    assert_eq!(away[59] - away[0], 59.0);
    assert!(drive.gnss.iter().all(|(_, g)| g.is_usable() == g.lat.is_finite()));
    let moving = (away[0] * 100.0) as usize..(away[59] * 100.0) as usize;
    assert!(truth(drive, "vx")[moving].iter().sum::<f64>() / 5900.0 > 8.0, "an outage at rest proves nothing");
}

#[test]
fn at_a_stop_wheels_read_zero_and_the_inertial_sensor_reads_noise() {
    let drive = city();
    for (a, b) in stops(drive) {
        // The body rocks for two seconds after a stop; the wheels' pulses run out within 0.2 s.
        let (calm, end) = ((a + 250).min(b), b.saturating_sub(60));
        for k in calm..end {
            let (_, w) = drive.wheels.at(k);
            let all = [w.speed, w.wheel_speed_fl, w.wheel_speed_fr, w.wheel_speed_rl, w.wheel_speed_rr];
            assert_eq!(all, [0.0; 5], "at {} s", drive.wheels.time()[k]);
            assert!(truth(drive, "vx")[k].abs() < 1e-4, "{}", truth(drive, "vx")[k]);
        }
        let spread = |name: &str| {
            let c = &drive.imu.column(name).unwrap()[calm..end];
            let mean = c.iter().sum::<f64>() / c.len() as f64;
            (c.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / c.len() as f64).sqrt()
        };
        // 8e-4 m/s^2/sqrt(Hz) at 100 Hz is 0.008; idle adds 0.003 ahead and 0.007 down.
        assert!((0.007..0.0105).contains(&spread("accel_x")), "{}", spread("accel_x"));
        assert!((0.007..0.014).contains(&spread("accel_z")), "{}", spread("accel_z"));
        assert!((0.0017..0.0024).contains(&spread("gyro_z")), "{}", spread("gyro_z"));
    }
}

#[test]
fn parked_on_the_level_truth_is_level_and_the_accelerometers_say_so_within_a_third_of_a_degree() {
    let drive = city();
    for k in 0..1900 {
        let angles = [truth(drive, "roll")[k], truth(drive, "pitch")[k]];
        assert!(angles.iter().all(|a| a.to_degrees().abs() < 0.05), "{angles:?}");
        let (_, i) = drive.imu.at(k);
        let (roll, pitch) = ((-i.accel_y).atan2(-i.accel_z), i.accel_x.atan2(-i.accel_z));
        assert!(roll.to_degrees().abs() < 0.3 && pitch.to_degrees().abs() < 0.3, "at {k}");
    }
}

#[test]
fn body_against_road_is_the_suspension_and_nothing_else() {
    let drive = city();
    let column = |name| truth(drive, name);
    for k in (0..column("roll").len()).step_by(7) {
        // To first order the body's angles are the road's plus the suspension's; 6 deg of bank leave 1e-3.
        let roll = column("bank")[k] + column("suspension_roll")[k];
        let pitch = column("grade")[k] + column("suspension_pitch")[k];
        assert!((column("roll")[k] - roll).abs() < 2e-3 && (column("pitch")[k] - pitch).abs() < 2e-3);
        assert!(column("suspension_roll")[k].abs() < 0.05 && column("suspension_pitch")[k].abs() < 0.03);
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_however_it_is_advanced_and_another_seed_does_not() {
    let spec = named("city_hills").unwrap();
    let grown = |seed: u64, step: f64| {
        let mut simulation = Simulation::new(&spec, Some(seed)).unwrap();
        while simulation.time() < 45.0 {
            simulation.advance(step);
        }
        simulation
    };
    let (once, pieces, other) = (grown(3, 45.0), grown(3, 0.5), grown(4, 45.0));
    assert!(once.drive().imu.len() == 4501 && !once.drive().gnss.is_empty());
    assert_eq!(fingerprint(once.drive()), fingerprint(pieces.drive()));
    assert_ne!(once.drive().imu.column("accel_x"), other.drive().imu.column("accel_x"));
    let place = |s: &Simulation| truth(s.drive(), "n").to_vec();
    assert_eq!(place(&once), place(&other), "the seed is of the noise, not of the drive");
}

#[test]
fn what_is_driven_once_and_measured_several_times_has_the_bits_of_each_by_itself() {
    let spec = named_with("dlc80_flat", &serde_json::json!({})).unwrap();
    let ideal = named_with("dlc80_flat", &serde_json::json!({"parts": {"imu": "ideal"}})).unwrap();
    let by = [(&spec, 3), (&ideal, 3), (&spec, 4)];
    let together = simulate_measured(&spec, &by).unwrap();
    let apart = by.map(|(spec, seed)| fingerprint(&simulate(spec, Some(seed)).unwrap()));
    assert_eq!(together.iter().map(fingerprint).collect::<Vec<_>>(), apart);
    assert!(apart[0] != apart[1] && apart[0] != apart[2]);
}

/// Strapdown navigation of error-free samples from the first row of truth; the largest errors in m, m/s and rad.
fn close(drive: &Drive) -> [f64; 3] {
    let at = |name: &str, k: usize| truth(drive, name)[k];
    let vector = |names: [&str; 3], k: usize| Vector3::from(names.map(|n| at(n, k)));
    let mut place = Geodetic { lat: at("lat", 0), lon: at("lon", 0), alt: at("alt", 0) };
    let mut v = vector(["vn", "ve", "vd"], 0);
    let mut c = frames::body_to_nav(at("roll", 0), at("pitch", 0), at("yaw", 0));
    let mut worst = [0.0_f64; 3];
    for k in 1..drive.imu.len() {
        let (_, Imu { accel_x, accel_y, accel_z, gyro_x, gyro_y, gyro_z }) = drive.imu.at(k);
        let (f, w, dt) = (Vector3::new(accel_x, accel_y, accel_z), Vector3::new(gyro_x, gyro_y, gyro_z), 0.01);
        let (rm, rt) = radii(place.lat);
        let (rm, rt) = (rm + place.alt, rt + place.alt);
        let (sin, cos) = place.lat.sin_cos();
        let earth = Vector3::new(cos, 0.0, -sin) * EARTH_RATE;
        let transport = Vector3::new(v.y / rt, -v.x / rm, -v.y * sin / cos / rt);
        let c1 = frames::exp_rotation(&(-(earth + transport) * dt)) * c * frames::exp_rotation(&(w * dt));
        let down = Vector3::new(0.0, 0.0, gravity(place.lat, place.alt));
        let v1 = v + ((c + c1) * f * 0.5 + down - (earth * 2.0 + transport).cross(&v)) * dt;
        let mean = (v + v1) * 0.5;
        let lat = place.lat + mean.x * dt / rm;
        let lon = place.lon + mean.y * dt / (rt * ((place.lat + lat) * 0.5).cos());
        place = Geodetic { lat, lon, alt: place.alt - mean.z * dt };
        (v, c) = (v1, frames::orthonormalize(&c1));
        let north = (place.lat - at("lat", k)) * rm;
        let east = (place.lon - at("lon", k)) * rt * cos;
        let true_c = frames::body_to_nav(at("roll", k), at("pitch", k), at("yaw", k));
        let errors = [
            Vector3::new(north, east, place.alt - at("alt", k)).norm(),
            (v - vector(["vn", "ve", "vd"], k)).norm(),
            frames::log_rotation(&(c.transpose() * true_c)).norm(),
        ];
        (0..3).for_each(|i| worst[i] = worst[i].max(errors[i]));
    }
    worst
}

#[test]
fn error_free_inertial_data_integrate_back_to_the_truth() {
    for lever_arm in [[0.0; 3], [-0.4, 0.2, -0.3]] {
        let spec = DriveSpec { sensors: "ideal".into(), lever_arm, ..named("city_hills").unwrap() };
        let [place, velocity, attitude] = close(&simulate(&spec, None).unwrap());
        // Only rounding separates the two: 1e-16 of 1e7 m a step, and the vertical channel doubles it within ten minutes.
        assert!(place < 1e-4 && velocity < 1e-6 && attitude < 1e-8, "{place} m, {velocity} m/s, {attitude} rad");
    }
}

#[test]
fn local_coordinates_are_those_of_the_law_and_velocity_is_their_rate() {
    let drive = city();
    let at = |name: &str, k: usize| truth(drive, name)[k];
    let frame = drivescope_drive::geodesy::LocalFrame::new(drive.start().origin.unwrap());
    for k in (100..drive.truth.len() - 1).step_by(997) {
        let ned = frame.to_ned(Geodetic { lat: at("lat", k), lon: at("lon", k), alt: at("alt", k) });
        assert!((ned - Vector3::new(at("n", k), at("e", k), at("d", k))).norm() < 1e-7);
        // Two kilometres from the origin the level axes are tilted by 3e-4 rad: 7 mm/s at 22 m/s.
        for (p, v) in [("n", "vn"), ("e", "ve"), ("d", "vd")] {
            let rate = (at(p, k + 1) - at(p, k - 1)) / 0.02;
            assert!((rate - at(v, k)).abs() < 0.012, "{p} at {k}: {rate} against {}", at(v, k));
        }
    }
}

#[test]
fn any_road_inside_the_ranges_is_driven_without_leaving_it_or_losing_a_number() {
    let mut rng = Rng::new(11, "roads");
    let mut between = |low: f64, high: f64| low + (high - low) * rng.uniform();
    for case in 0..25 {
        let mut spec = DriveSpec { segments: Vec::new(), stand_at_start: 1.0, ..named("city_hills").unwrap() };
        spec.car = ["saloon", "bmw_320i", "kim_2014", "ford_escort", "vw_vanagon"][case % 5].into();
        for piece in 0..6 {
            let length = between(15.0, 150.0);
            let tightest = (length / 9.0).to_degrees().min(150.0);
            spec.segments.push(Segment {
                length,
                speed_kmh: between(10.0, 130.0),
                turn_deg: between(-1.0, 1.0) * tightest,
                grade_percent: between(-10.0, 10.0),
                bank_deg: between(-8.0, 8.0),
                blend: between(5.0, 60.0),
                stop: (piece % 2 == 1).then_some(2.0),
                duration: None,
                acceleration: None,
            });
        }
        let drive = simulate(&spec, Some(1)).unwrap_or_else(|e| panic!("case {case}: {e}"));
        let (low, high) = extremes(truth(&drive, "roll"));
        assert!(low > -0.35 && high < 0.35, "case {case} rolls from {low} to {high}");
        for name in ["vx", "vy", "n", "alt", "gyro_z", "force_yf", "specific_force_x"] {
            assert!(truth(&drive, name).iter().all(|v| v.is_finite()), "case {case}: {name}");
        }
        let slid = truth(&drive, "vy").iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        assert!(slid < 2.5, "case {case} slides at {slid} m/s");
    }
}

#[test]
fn a_car_that_cannot_hold_the_road_is_reported_and_not_passed_off_as_a_drive() {
    // The all-terrain vehicle of Yun & Yu has a wheelbase of 0.8 m and the yaw inertia of a saloon.
    let spec = DriveSpec { car: "yun_2007".into(), ..named("motorway_bank").unwrap() };
    let error = simulate(&spec, None).unwrap_err().to_string();
    assert!(error.starts_with("the car left the road at "), "{error}");
}

#[test]
fn every_named_drive_is_driven_to_its_end_in_the_time_that_the_menu_says() {
    // The motorway's hour has the same pieces six times over: its first minutes are enough here.
    for entry in drives().iter().filter(|d| d.name != "motorway_hour") {
        let spec = named(entry.name).unwrap();
        let drive = simulate(&spec, None).unwrap_or_else(|e| panic!("{}: {e}", entry.name));
        let (_, last) = drive.span().unwrap();
        assert!(
            (entry.duration_hint - last).abs() < 3.0,
            "{}: {last} s, the menu says {}",
            entry.name,
            entry.duration_hint
        );
        for name in ["vx", "vy", "roll", "pitch", "gyro_z", "alt", "specific_force_x"] {
            assert!(truth(&drive, name).iter().all(|v| v.is_finite()), "{}: {name}", entry.name);
        }
        // Nobody slides through a named drive, but for the one on ice.
        let slid = truth(&drive, "vy").iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        assert!(slid < 1.2, "{} slides at {slid} m/s", entry.name);
    }
}

#[test]
fn the_motorway_is_driven_fast_from_the_start() {
    let mut simulation = Simulation::new(&named("motorway_hour").unwrap(), None).unwrap();
    assert!(!simulation.advance(240.0) && simulation.failure().is_none());
    let (_, fastest) = extremes(truth(simulation.drive(), "vx"));
    assert!((33.0..37.0).contains(&fastest), "{fastest}");
}
