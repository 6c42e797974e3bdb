//! A line to follow, as points at equal distances.

use drivescope_drive::frames::wrap_angle;

/// Distance between the points of a path, m.
pub const SPACING: f64 = 0.1;

/// One point of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Waypoint {
    /// North of the local origin, m.
    pub north: f64,
    /// East of the local origin, m.
    pub east: f64,
    /// Heading of the path there, rad.
    pub heading: f64,
}

/// A line to follow; never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    points: Vec<Waypoint>,
}

impl Path {
    /// A path from the origin to the north, of pieces with a length (m) and a curvature (1/m, right positive).
    ///
    /// A piece without a length or with a number that is not finite is left out.
    pub fn from_segments(segments: &[(f64, f64)]) -> Self {
        let mut points = vec![Waypoint::default()];
        let mut start = Waypoint::default();
        let (mut reached, mut s) = (0.0, SPACING);
        for &(length, curvature) in segments.iter().filter(|(l, c)| *l > 0.0 && l.is_finite() && c.is_finite()) {
            while s <= reached + length + 1e-9 {
                points.push(along(&start, s - reached, curvature));
                s = points.len() as f64 * SPACING;
            }
            start = along(&start, length, curvature);
            reached += length;
        }
        Self { points }
    }

    /// The points.
    pub fn points(&self) -> &[Waypoint] {
        &self.points
    }

    /// Length, m.
    pub fn length(&self) -> f64 {
        (self.points.len() - 1) as f64 * SPACING
    }

    /// The last point.
    pub fn end(&self) -> &Waypoint {
        &self.points[self.points.len() - 1]
    }

    /// Index of the point nearest to a place, m; the first of equals.
    pub fn nearest(&self, north: f64, east: f64) -> usize {
        let mut best = (0, f64::INFINITY);
        for (i, p) in self.points.iter().enumerate() {
            let (dn, de) = (p.north - north, p.east - east);
            let square = dn * dn + de * de;
            if square < best.1 {
                best = (i, square);
            }
        }
        best.0
    }

    /// The first point that lies more than `distance` m along the path after the point of an index; else the last.
    pub fn ahead(&self, index: usize, distance: f64) -> &Waypoint {
        let steps = (distance.max(0.0) / SPACING + 1e-9) as usize + 1;
        &self.points[index.saturating_add(steps).min(self.points.len() - 1)]
    }

    /// Offset of a place to the right of the path at the point of an index, m.
    pub fn offset(&self, index: usize, north: f64, east: f64) -> f64 {
        let p = &self.points[index.min(self.points.len() - 1)];
        let (sin, cos) = libm::sincos(p.heading);
        (east - p.east) * cos - (north - p.north) * sin
    }
}

/// The point `s` m after `start` on an arc.
fn along(start: &Waypoint, s: f64, curvature: f64) -> Waypoint {
    let turn = curvature * s;
    let (sin, cos) = libm::sincos(start.heading + 0.5 * turn);
    // Chord of the arc; its direction is the mean heading.
    let chord = if turn.abs() < 1e-9 { s } else { libm::sin(0.5 * turn) * 2.0 / curvature };
    Waypoint {
        north: start.north + chord * cos,
        east: start.east + chord * sin,
        heading: wrap_angle(start.heading + turn),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_quarter_circle_ends_to_the_right_of_its_start() {
        // Catches a turn to the wrong side and a chord taken for the arc.
        let path = Path::from_segments(&[(20.0, 0.0), (18.0 * FRAC_PI_2, 1.0 / 18.0), (40.0, 0.0)]);
        assert!((path.length() - 88.2).abs() < 0.11);
        let end = path.end();
        assert!((end.north - 38.0).abs() < 1e-6 && (end.heading - FRAC_PI_2).abs() < 1e-9);
        // The whole is 88.274 m, of which the points cover 88.2.
        assert!((end.east - (18.0 + 40.0 - 0.074)).abs() < 1e-3, "{}", end.east);
    }

    #[test]
    fn the_offset_is_positive_to_the_right_and_the_point_ahead_is_beyond_the_distance() {
        let path = Path::from_segments(&[(10.0, 0.0)]);
        let at = path.nearest(3.04, 0.7);
        assert_eq!(at, 30);
        assert!((path.offset(at, 3.04, 0.7) - 0.7).abs() < 1e-12);
        assert!((path.ahead(at, 5.0).north - 8.1).abs() < 1e-9, "more than the distance, not as much");
        assert_eq!(path.ahead(at, 50.0), path.end());
    }

    #[test]
    fn nonsense_pieces_leave_a_path_of_one_point() {
        let path = Path::from_segments(&[(f64::NAN, 0.0), (-3.0, 0.0), (5.0, f64::INFINITY)]);
        assert_eq!((path.points().len(), path.nearest(f64::NAN, 0.0)), (1, 0));
    }
}
