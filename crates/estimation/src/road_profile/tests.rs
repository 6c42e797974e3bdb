//! Road profiles: distances, merging, and what is written.

use drivescope_drive::channel::Record;
use drivescope_drive::geodesy::{Geodetic, LocalFrame};
use drivescope_drive::signals::Gnss;
use nalgebra::Vector3;

use super::*;

record! {
    /// What a pass needs.
    struct Row {
        /// Speed.
        speed: "m/s";
        /// Grade.
        grade: "rad";
        /// Its sigma.
        grade_sigma: "rad";
        /// Altitude.
        altitude: "m";
        /// Its sigma.
        altitude_sigma: "m";
    }
}

const ORIGIN: Geodetic = Geodetic { lat: 0.84, lon: 0.15, alt: 400.0 };

fn road_grade(distance: f64) -> f64 {
    0.05 * (distance / 120.0).sin()
}

/// A pass at `speed` over a bend, from `from` m of the road on; wheels read `scale` times the truth, grades are `error` off.
fn pass(speed: f64, from: f64, scale: f64, error: f64, reverse: bool) -> (Series, Drive) {
    let frame = LocalFrame::new(ORIGIN);
    let (mut rows, mut drive) = (Channel::default(), Drive::default());
    for k in 0..((1500.0 - from) / speed / 0.05) as usize {
        let t = k as f64 * 0.05;
        let along = if reverse { 1500.0 - speed * t } else { from + speed * t };
        let sign = if reverse { -1.0 } else { 1.0 };
        let altitude = 100.0 - 0.05 * 120.0 * (along / 120.0).cos() + 40.0 * error;
        let row = Row {
            speed: speed * scale,
            grade: sign * road_grade(along) + error,
            grade_sigma: 0.004,
            altitude,
            altitude_sigma: 0.3,
        };
        rows.push(t, row).unwrap();
        if k % 20 == 0 {
            // A quarter circle of 600 m radius, then straight on.
            let angle = (along / 600.0).min(1.5);
            let rest = (along - 900.0).max(0.0);
            let (north, east) =
                (600.0 * angle.sin() + rest * angle.cos(), 600.0 * (1.0 - angle.cos()) + rest * angle.sin());
            let place = frame.to_geodetic(&Vector3::new(north, east, 0.0));
            drive.gnss.push(t, Gnss { lat: place.lat, lon: place.lon, ..Gnss::default() }).unwrap();
        }
    }
    (rows.into_series(), drive)
}

fn profile(speed: f64, from: f64, scale: f64, error: f64) -> RoadProfile {
    let (rows, drive) = pass(speed, from, scale, error, false);
    RoadProfile::of_pass(&rows, &drive, 5.0).unwrap()
}

fn rms(profile: &RoadProfile) -> f64 {
    let errors: Vec<f64> =
        profile.points.iter().map(|(d, p)| p.grade - road_grade(d)).filter(|e| e.is_finite()).collect();
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn a_pass_gives_the_grade_at_its_distance_and_the_place() {
    let profile = profile(14.0, 0.0, 1.0, 0.0);
    assert_eq!(profile.points.len(), 300);
    // Averages over 5 m of a wave of 750 m, sampled every 0.7 m: below 1e-3 of its steepest 0.05.
    assert!(rms(&profile) < 2e-4, "{}", rms(&profile));
    let (_, point) = profile.points.at(150);
    let ned = LocalFrame::new(ORIGIN).to_ned(Geodetic { lat: point.lat, lon: point.lon, alt: ORIGIN.alt });
    let angle: f64 = 752.5 / 600.0;
    let place = Vector3::new(600.0 * angle.sin(), 600.0 * (1.0 - angle.cos()), 0.0);
    // A line over 80 m of a bend of 600 m radius cuts it by 80^2 / (24 x 600) = 0.4 m.
    assert!((ned - place).xy().norm() < 1.0, "{ned}");
    assert!((point.altitude - (100.0 - 6.0 * (752.5f64 / 120.0).cos())).abs() < 0.05);
}

#[test]
fn passes_are_merged_at_the_same_place_whatever_their_wheels_and_starts() {
    // Merged by distance alone, 2 % of scale and 200 m of start would give errors as large as the grades.
    let passes = [profile(14.0, 0.0, 1.0, 0.002), profile(9.0, 200.0, 1.02, -0.002), profile(22.0, 30.0, 0.985, 0.0)];
    let merged = RoadProfile::merged(&passes).unwrap();
    assert!(rms(&merged) < 1.2e-3, "{}", rms(&merged));
    let (distance, point) = merged.points.at(200);
    assert_eq!((point.passes, merged.passes), (3.0, 3));
    // Three values with 0.004 each that differ by 0.002: what is stated counts.
    assert!((point.grade_sigma - 0.004 / 3f64.sqrt()).abs() < 1e-6, "{}", point.grade_sigma);
    assert_eq!(merged.points.at(10).1.passes, 2.0, "one pass began later");
    // Each day's barometer has its own datum: the first pass's counts.
    assert!((point.altitude - (100.08 - 6.0 * (distance / 120.0).cos())).abs() < 0.3, "{}", point.altitude);
}

#[test]
fn passes_that_differ_more_than_they_state_are_less_certain_than_they_state() {
    let passes = [profile(14.0, 0.0, 1.0, 0.02), profile(14.0, 0.0, 1.0, -0.02)];
    let merged = RoadProfile::merged(&passes).unwrap();
    // Two values 0.04 apart: their mean is known to 0.02.
    assert!((merged.points.at(100).1.grade_sigma - 0.02).abs() < 1e-4);
}

#[test]
fn what_cannot_be_merged_is_refused_with_a_sentence() {
    let first = profile(14.0, 0.0, 1.0, 0.0);
    let (rows, drive) = pass(14.0, 0.0, 1.0, 0.0, true);
    let back = RoadProfile::of_pass(&rows, &drive, 5.0).unwrap();
    assert_eq!(RoadProfile::merged(&[first, back]).err(), Some(ProfileError::Apart(2)));
    assert_eq!(RoadProfile::merged(&[]).err(), Some(ProfileError::Empty));
    let missing = RoadProfile::of_pass(&Series::new(&[]), &Drive::default(), 5.0).err();
    assert_eq!(missing, Some(ProfileError::NoColumn("speed")));
    let still = Series::new(Row::COLUMNS);
    assert!(matches!(RoadProfile::of_pass(&still, &Drive::default(), 5.0), Err(ProfileError::TooShort { .. })));
}

#[test]
fn a_profile_is_written_as_a_table_and_as_a_map() {
    let profile = profile(14.0, 0.0, 1.0, 0.0);
    let mut csv = Vec::new();
    write_csv(&profile, &mut csv).unwrap();
    let csv = String::from_utf8(csv).unwrap();
    assert_eq!(csv.lines().count(), 301);
    assert!(csv.starts_with("distance,grade,grade_sigma,altitude,altitude_sigma,passes,gnss_lat,gnss_lon\n2.5,"));
    let mut map = Vec::new();
    write_geojson(&profile, &mut map).unwrap();
    let map: serde_json::Value = serde_json::from_slice(&map).unwrap();
    let line = map["features"][0]["geometry"]["coordinates"].as_array().unwrap();
    assert_eq!(map["features"].as_array().unwrap().len(), line.len() + 1);
    assert!((line[0][1].as_f64().unwrap() - 0.84f64.to_degrees()).abs() < 1e-3, "latitude comes second");
    let (rows, _) = pass(14.0, 0.0, 1.0, 0.0, false);
    let nowhere = RoadProfile::of_pass(&rows, &Drive::default(), 5.0).unwrap();
    assert_eq!(write_geojson(&nowhere, &mut Vec::new()).unwrap_err().kind(), std::io::ErrorKind::InvalidInput);
}

/// A pass along `places` at 10 m/s, a fix each second, in a drive that says so.
fn along(places: impl Fn(f64) -> (f64, f64), length: f64) -> RoadProfile {
    let frame = LocalFrame::new(ORIGIN);
    let (mut rows, mut drive) = (Channel::default(), Drive::default());
    for k in 0..(length / 10.0 / 0.05) as usize {
        let (t, along) = (k as f64 * 0.05, k as f64 * 0.5);
        let row = Row { speed: 10.0, grade: 0.01, grade_sigma: 0.004, altitude: 100.0, altitude_sigma: 0.3 };
        rows.push(t, row).unwrap();
        if k % 20 == 0 {
            let (north, east) = places(along);
            let place = frame.to_geodetic(&Vector3::new(north, east, 0.0));
            drive.gnss.push(t, Gnss { lat: place.lat, lon: place.lon, ..Gnss::default() }).unwrap();
        }
    }
    RoadProfile::of_pass(&rows.into_series(), &drive, 5.0).unwrap()
}

#[test]
fn a_circuit_driven_three_times_is_three_passes_and_a_road_there_and_back_is_one() {
    // 300 m straight to a circle of 100 m radius, three times round.
    let circuit = along(
        |s| {
            let angle = (s - 300.0).max(0.0) / 100.0;
            (100.0 * angle.sin() + s.min(300.0) - 300.0, 100.0 * (1.0 - angle.cos()))
        },
        300.0 + 3.0 * 628.3 - 80.0,
    );
    let laps = circuit.laps();
    let lengths: Vec<usize> = laps.iter().map(|l| l.points.len()).collect();
    // A lap has 628 m, 126 points, and the first one the way to it as well. A cut comes early by as much as the bend is within
    // 12 m of the way it came on: sqrt(2 x 100 m x 12 m), ten points.
    assert_eq!(laps.len(), 3, "{lengths:?}");
    assert!((174..=187).contains(&lengths[0]) && (123..=127).contains(&lengths[1]), "{lengths:?}");
    assert_eq!(lengths.iter().sum::<usize>(), circuit.points.len());
    let (merged, common) = RoadProfile::of_laps(&laps, &[along(|s| (0.0, 5000.0 + s), 500.0)]).unwrap();
    assert_eq!((merged.points.len(), merged.passes, common), (circuit.points.len(), 3, vec![false]));
    let passes = [20, 120, 250, 370].map(|index| merged.points.at(index).1.passes);
    assert_eq!(passes, [1.0, 3.0, 3.0, 3.0], "the way to it was driven once");
    // Three values with 0.004 each, all the same.
    assert!((merged.points.at(250).1.grade_sigma - 0.004 / 3f64.sqrt()).abs() < 1e-9);
    assert!((merged.length() - circuit.length()).abs() < 1e-9);
    let back = along(|s| (if s < 800.0 { s } else { 1600.0 - s }, if s < 800.0 { 0.0 } else { 4.0 }), 1600.0);
    assert_eq!(back.laps().len(), 1, "the other direction has the other grade");
    let (rows, _) = pass(14.0, 0.0, 1.0, 0.0, false);
    assert_eq!(RoadProfile::of_pass(&rows, &Drive::default(), 5.0).unwrap().laps().len(), 1, "no places, no laps");
}

#[test]
fn a_pass_that_turns_off_is_not_merged_along_the_road_it_left() {
    let straight = along(|s| (s, 0.0), 2000.0);
    let turned = along(|s| (s.min(1000.0), (s - 1000.0).max(0.0)), 2000.0);
    let merged = RoadProfile::merged(&[straight, turned]).unwrap();
    let passes = |distance: f64| merged.points.at((distance / 5.0) as usize).1.passes;
    assert_eq!((passes(500.0), passes(1100.0), passes(1800.0)), (2.0, 1.0, 1.0));
}
