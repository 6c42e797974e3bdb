//! A pass that comes back to a place it has been at, cut into passes over the same road.

use drivescope_drive::channel::Channel;
use nalgebra::Vector2;

use super::path::{Path, heading};
use super::{RoadPoint, RoadProfile};

/// A place is the same when the pass was no farther from it, m.
const SAME: f64 = 12.0;
/// A way back to the same place is at least this long, m: a slow bend is no lap.
const SHORTEST: f64 = 150.0;
/// Cosine of the largest angle between two directions of travel that count as the same.
const SAME_DIRECTION: f64 = 0.8;

/// Lists of points by the square that they are in, squares that share a list being told apart by distance.
struct Squares {
    /// The last point of each list.
    last: Vec<usize>,
    /// The point before each point in its list.
    before: Vec<usize>,
}

/// No point.
const NONE: usize = usize::MAX;
/// Lists of squares.
const LISTS: i64 = 4096;

impl Squares {
    /// The list of the square so many squares north and east of a place's own.
    fn list(place: Vector2<f64>, north: i64, east: i64) -> usize {
        let (x, y) = ((place.x / SAME).floor() as i64 + north, (place.y / SAME).floor() as i64 + east);
        (x.wrapping_mul(73).wrapping_add(y)).rem_euclid(LISTS) as usize
    }

    fn add(&mut self, index: usize, place: Vector2<f64>) {
        let last = &mut self.last[Self::list(place, 0, 0)];
        self.before[index] = *last;
        *last = index;
    }

    /// Whether a point in or beside the square of a place passes a test.
    fn any(&self, place: Vector2<f64>, test: impl Fn(usize) -> bool) -> bool {
        (0..9).any(|k| {
            let mut at = self.last[Self::list(place, k / 3 - 1, k % 3 - 1)];
            while at != NONE && !test(at) {
                at = self.before[at];
            }
            at != NONE
        })
    }
}

/// The points where a pass of these places comes back to one that it drove before in the same direction.
fn returns(path: &Path, distance: &[f64]) -> Vec<usize> {
    let mut cuts = Vec::new();
    let mut seen = Squares { last: vec![NONE; LISTS as usize], before: vec![NONE; path.places.len()] };
    for (index, place) in path.places.iter().enumerate() {
        let (Some(place), Some(&here)) = (*place, distance.get(index)) else { continue };
        let along = heading(&path.places, index);
        let is_same = |other: usize| {
            let (Some(there), before) = (path.places[other], heading(&path.places, other)) else { return false };
            here - distance[other] >= SHORTEST
                && (there - place).norm() <= SAME
                && before.dot(&along) > SAME_DIRECTION * before.norm() * along.norm()
        };
        if seen.any(place, is_same) {
            cuts.push(index);
            seen.last.fill(NONE);
        }
        seen.add(index, place);
    }
    cuts
}

impl RoadProfile {
    /// The pass cut where it comes back to a place that it drove before in the same direction: its laps, the first one
    /// first. Without places it is one pass.
    pub fn laps(&self) -> Vec<Self> {
        let distance = self.points.time();
        let mut ends = returns(&self.path, distance);
        ends.push(self.points.len());
        let mut from = 0;
        let mut laps = Vec::with_capacity(ends.len());
        for end in ends {
            let mut points = Channel::<RoadPoint>::default();
            for index in from..end {
                let (distance, point) = self.points.at(index);
                // Distances rise by construction.
                let _ = points.push(distance, point);
            }
            let places = self.path.places.get(from..end).unwrap_or_default().to_vec();
            laps.push(Self { points, passes: 1, path: Path { frame: self.path.frame, places } });
            from = end;
        }
        laps
    }
}
