//! A small picture of a drive without simulating it: its road from above and its speed over distance.

use crate::math::sin_cos;
use crate::spec::{DriveSpec, Segment};

/// What a small picture of a drive needs.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Sketch {
    /// Road from above: east and north of the start, m.
    pub points: Vec<(f64, f64)>,
    /// Distance along the road, m, and the speed that is driven there, m/s; 0 where the car stops.
    pub speed: Vec<(f64, f64)>,
}

/// About how many points a sketch has.
const POINTS: f64 = 300.0;

/// Sketch a checked drive: turns without their blends, speeds with the driver's limits but without the car's.
pub fn sketch(spec: &DriveSpec) -> Sketch {
    let length: f64 = spec.segments.iter().map(|s| s.length).sum();
    let step = (length / POINTS).max(1.0);
    let mut sketch = Sketch { points: vec![(0.0, 0.0)], speed: Vec::new() };
    let (mut east, mut north, mut heading, mut s) = (0.0, 0.0, spec.heading_deg.to_radians(), 0.0);
    let mut squares = vec![(0.0, (spec.start_speed_kmh / 3.6).powi(2))];
    for (index, segment) in spec.segments.iter().enumerate() {
        // A curve needs a point every 20 deg or so to look like one.
        let pieces = (segment.length / step).max(segment.turn_deg.abs() / 20.0).ceil().max(1.0);
        let (piece, turn) = (segment.length / pieces, segment.turn_deg.to_radians() / pieces);
        for _ in 0..pieces as usize {
            let (sin, cos) = sin_cos(heading + 0.5 * turn);
            (east, north, heading, s) = (east + piece * sin, north + piece * cos, heading + turn, s + piece);
            sketch.points.push((east, north));
            squares.push((s, fastest(spec, segment)));
        }
        if segment.stop.is_some() || index + 1 == spec.segments.len() {
            squares.pop();
            squares.push((s, 0.0));
        }
    }
    level(spec, &mut squares);
    sketch.speed = squares.iter().map(|&(s, square)| (s, square.sqrt())).collect();
    sketch
}

/// Square of the speed that segment and driver allow, m^2/s^2.
fn fastest(spec: &DriveSpec, segment: &Segment) -> f64 {
    let asked = segment.speed_kmh / 3.6;
    (asked * asked).min(spec.driver.cornering / segment.curvature().abs().max(1e-6))
}

/// Reach and leave every speed with the driver's accelerations.
fn level(spec: &DriveSpec, squares: &mut [(f64, f64)]) {
    for k in (1..squares.len()).rev() {
        let reach = squares[k].1 + 2.0 * spec.driver.braking * (squares[k].0 - squares[k - 1].0);
        squares[k - 1].1 = squares[k - 1].1.min(reach);
    }
    for k in 1..squares.len() {
        let reach = squares[k - 1].1 + 2.0 * spec.driver.acceleration * (squares[k].0 - squares[k - 1].0);
        squares[k].1 = squares[k].1.min(reach);
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
        assert_eq!(drawn.speed.iter().filter(|(s, v)| *s > 0.0 && *v == 0.0).count(), 4, "three lights and the end");
    }

    #[test]
    fn every_drive_has_a_small_sketch_of_finite_numbers() {
        for drive in drives() {
            let drawn = sketch(&named(drive.name).unwrap());
            assert!((10..1500).contains(&drawn.points.len()), "{}: {}", drive.name, drawn.points.len());
            assert!(drawn.points.iter().chain(&drawn.speed).all(|(a, b)| a.is_finite() && b.is_finite()));
            assert!(drawn.speed.is_sorted_by(|a, b| a.0 <= b.0));
        }
    }
}
