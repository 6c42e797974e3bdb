//! A small picture of a drive without simulating it: its road from above and its speed over time.

use crate::math::sin_cos;
use crate::spec::{DriveSpec, Segment};

/// What a small picture of a drive needs.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Sketch {
    /// Road from above: east and north of the start, m.
    pub points: Vec<(f64, f64)>,
    /// Time, s, and the speed that is driven then, m/s; 0 while the car stands.
    pub speed: Vec<(f64, f64)>,
    /// Length of the road, m.
    pub length: f64,
}

/// About how many points a sketch has.
const POINTS: f64 = 300.0;

/// A place along the road: distance, m, square of the speed there, m^2/s^2, and how long the car stands there, s.
#[derive(Clone, Copy)]
struct Place {
    s: f64,
    square: f64,
    stand: f64,
}

/// Sketch a checked drive: turns without their blends, speeds with the driver's limits but without the car's.
pub fn sketch(spec: &DriveSpec) -> Sketch {
    let length: f64 = spec.segments.iter().map(|s| s.length).sum();
    let step = (length / POINTS).max(1.0);
    let mut sketch = Sketch { points: vec![(0.0, 0.0)], length, ..Sketch::default() };
    let (mut east, mut north, mut heading, mut s) = (0.0, 0.0, spec.heading_deg.to_radians(), 0.0);
    let mut places = vec![Place { s, square: (spec.start_speed_kmh / 3.6).powi(2), stand: spec.stand_at_start }];
    for (index, segment) in spec.segments.iter().enumerate() {
        // A curve needs a point every 20 deg or so to look like one.
        let pieces = (segment.length / step).max(segment.turn_deg.abs() / 20.0).ceil().max(1.0);
        let (piece, turn) = (segment.length / pieces, segment.turn_deg.to_radians() / pieces);
        for _ in 0..pieces as usize {
            let (sin, cos) = sin_cos(heading + 0.5 * turn);
            (east, north, heading, s) = (east + piece * sin, north + piece * cos, heading + turn, s + piece);
            sketch.points.push((east, north));
            places.push(Place { s, square: fastest(spec, segment), stand: 0.0 });
        }
        if let Some(last) = places.last_mut()
            && (segment.stop.is_some() || index + 1 == spec.segments.len())
        {
            (last.square, last.stand) = (0.0, segment.stop.unwrap_or(0.0));
        }
    }
    level(spec, &mut places);
    sketch.speed = over_time(&places);
    sketch
}

/// Speed over time: constant acceleration from place to place.
fn over_time(places: &[Place]) -> Vec<(f64, f64)> {
    let mut out = Vec::with_capacity(places.len());
    let (mut time, mut before) = (0.0, None::<Place>);
    for place in places {
        let speed = place.square.sqrt();
        if let Some(before) = before {
            time += 2.0 * (place.s - before.s) / (speed + before.square.sqrt()).max(0.1);
        }
        out.push((time, speed));
        if place.stand > 0.0 {
            time += place.stand;
            out.push((time, speed));
        }
        before = Some(*place);
    }
    out
}

/// Square of the speed that segment and driver allow, m^2/s^2.
fn fastest(spec: &DriveSpec, segment: &Segment) -> f64 {
    let asked = segment.speed_kmh / 3.6;
    (asked * asked).min(spec.driver.cornering / segment.curvature().abs().max(1e-6))
}

/// Reach and leave every speed with the driver's accelerations.
fn level(spec: &DriveSpec, places: &mut [Place]) {
    for k in (1..places.len()).rev() {
        let reach = places[k].square + 2.0 * spec.driver.braking * (places[k].s - places[k - 1].s);
        places[k - 1].square = places[k - 1].square.min(reach);
    }
    for k in 1..places.len() {
        let reach = places[k - 1].square + 2.0 * spec.driver.acceleration * (places[k].s - places[k - 1].s);
        places[k].square = places[k].square.min(reach);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drives::{drives, named};

    #[test]
    fn a_block_is_drawn_closed_and_a_stop_reaches_zero() {
        let drawn = sketch(&named("city_loop").unwrap());
        let (east, north) = drawn.points[drawn.points.len() - 1];
        // Corners of radius 11.5 m drawn in chords of 18 deg and less: some 0.4 % of each.
        assert!((east * east + north * north).sqrt() < 2.0, "{east} {north}");
        let arrivals = drawn.speed.windows(2).filter(|w| w[0].1 > 0.0 && w[1].1 == 0.0).count();
        assert_eq!(arrivals, 4, "three lights and the end");
    }

    #[test]
    fn every_drive_has_a_small_sketch_of_finite_numbers() {
        for drive in drives() {
            let drawn = sketch(&named(drive.name).unwrap());
            assert!((10..1500).contains(&drawn.points.len()), "{}: {}", drive.name, drawn.points.len());
            assert!(drawn.points.iter().chain(&drawn.speed).all(|(a, b)| a.is_finite() && b.is_finite()));
            assert!(drawn.speed.is_sorted_by(|a, b| a.0 <= b.0));
            // Jerk, the engine and curves driven wide cost a little; an open-loop manoeuvre ends where it likes.
            let seconds = drawn.speed[drawn.speed.len() - 1].0;
            let hint = drive.duration_hint;
            if named(drive.name).unwrap().manoeuvre.is_none() {
                assert!(seconds > 0.8 * hint && seconds < 1.05 * hint, "{}: {seconds} of {hint}", drive.name);
            }
        }
    }
}
