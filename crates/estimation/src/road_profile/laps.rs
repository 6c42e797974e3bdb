//! A pass that comes back to a place it has been at, cut into passes over the same road.

use std::collections::BTreeMap;

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

/// The points where a pass of these places comes back to one that it drove before in the same direction.
fn returns(path: &Path, distance: &[f64]) -> Vec<usize> {
    let mut cuts = Vec::new();
    let mut seen: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
    let square = |place: Vector2<f64>| ((place.x / SAME).floor() as i64, (place.y / SAME).floor() as i64);
    for (index, place) in path.places.iter().enumerate() {
        let (Some(place), Some(&here)) = (*place, distance.get(index)) else { continue };
        let along = heading(&path.places, index);
        let is_same = |&other: &usize| {
            let (Some(there), before) = (path.places[other], heading(&path.places, other)) else { return false };
            here - distance[other] >= SHORTEST
                && (there - place).norm() <= SAME
                && before.dot(&along) > SAME_DIRECTION * before.norm() * along.norm()
        };
        let (x, y) = square(place);
        let mut near = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
        if near.any(|square| seen.get(&square).is_some_and(|points| points.iter().any(is_same))) {
            cuts.push(index);
            seen.clear();
        }
        seen.entry(square(place)).or_default().push(index);
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
