//! Where a pass went: places at equal distances, smoothed from satellite fixes, and which of another pass's are the same.

use drivescope_drive::drive::Drive;
use drivescope_drive::geodesy::{Geodetic, LocalFrame};
use nalgebra::Vector2;

/// Fixes this far along the road make a place, m.
const REACH: f64 = 40.0;
/// A pass that is farther away is on another road, m.
const FARTHEST: f64 = 25.0;
/// Points ahead and behind that are searched for the nearest place.
const WINDOW: usize = 24;
/// A pass that was lost is looked for everywhere once in so many points.
const SEARCH_EVERY: usize = 10;
/// Half the window over which the difference of two distances is averaged, in points.
const HALF_SMOOTH: usize = 10;
/// The difference is carried over at most so many points without places: an outage, not another road.
const LONGEST_BRIDGE: usize = 200;

/// Places of a pass, horizontal, m north and east of an origin, at its points; `None` where there were no fixes.
#[derive(Clone, Debug, Default)]
pub(super) struct Path {
    pub(super) frame: Option<LocalFrame>,
    pub(super) places: Vec<Option<Vector2<f64>>>,
}

/// Distances and horizontal places of the fixes, in order.
fn fixes(drive: &Drive, frame: &LocalFrame, time: &[f64], distance: &[f64]) -> Vec<(f64, Vector2<f64>)> {
    let mut row = 0;
    (drive.gnss.iter().filter(|(_, g)| g.is_usable() && g.lat.is_finite() && g.lon.is_finite()))
        .filter_map(|(t, g)| {
            while row + 1 < time.len() && time[row + 1] < t {
                row += 1;
            }
            let (t0, t1) = (*time.get(row)?, *time.get(row + 1)?);
            let share = (t - t0) / (t1 - t0);
            let along = distance[row] + (distance[row + 1] - distance[row]) * share;
            let place = frame.to_ned(Geodetic { lat: g.lat, lon: g.lon, alt: frame.origin.alt });
            (0.0..=1.0).contains(&share).then_some((along, place.xy()))
        })
        .collect()
}

/// The place at `centre`: a line through the fixes around it, the nearer the heavier; `None` unless they surround it.
fn place_at(fixes: &[(f64, Vector2<f64>)], centre: f64) -> Option<Vector2<f64>> {
    let (mut w, mut x, mut xx) = (0.0, 0.0, 0.0);
    let (mut y, mut xy) = (Vector2::zeros(), Vector2::zeros());
    let (mut before, mut after) = (false, false);
    for (along, place) in fixes {
        let away = along - centre;
        let weight = 1.0 - away.abs() / REACH;
        if weight <= 0.0 {
            continue;
        }
        (before, after) = (before || away <= 0.0, after || away >= 0.0);
        w += weight;
        x += weight * away;
        xx += weight * away * away;
        y += place * weight;
        xy += place * (weight * away);
    }
    let spread = w * xx - x * x;
    // The line's value where `away` is 0.
    (before && after && spread > 1e-6).then(|| (y * xx - xy * x) / spread)
}

impl Path {
    /// Places at `count` points `spacing` m apart of the pass whose rows have these times and distances.
    pub(super) fn new(drive: &Drive, time: &[f64], distance: &[f64], count: usize, spacing: f64) -> Self {
        let first = drive.gnss.iter().find(|(_, g)| g.is_usable() && g.lat.is_finite() && g.lon.is_finite());
        let Some((_, first)) = first else {
            return Self { frame: None, places: vec![None; count] };
        };
        let frame = LocalFrame::new(Geodetic { lat: first.lat, lon: first.lon, alt: 0.0 });
        let fixes = fixes(drive, &frame, time, distance);
        let (mut from, mut to) = (0, 0);
        let places = (0..count)
            .map(|index| {
                let centre = (index as f64 + 0.5) * spacing;
                while from < fixes.len() && fixes[from].0 < centre - REACH {
                    from += 1;
                }
                while to < fixes.len() && fixes[to].0 <= centre + REACH {
                    to += 1;
                }
                place_at(fixes.get(from..to)?, centre)
            })
            .collect();
        Self { frame: Some(frame), places }
    }

    /// Whether there is any place.
    fn has_places(&self) -> bool {
        self.places.iter().any(Option::is_some)
    }

    /// Latitude and longitude of a point, rad; NaN where unknown.
    pub(super) fn place(&self, index: usize) -> (f64, f64) {
        match (&self.frame, self.places.get(index)) {
            (Some(frame), Some(Some(place))) => {
                let place = frame.to_geodetic(&nalgebra::Vector3::new(place.x, place.y, 0.0));
                (place.lat, place.lon)
            }
            _ => (f64::NAN, f64::NAN),
        }
    }

    /// This path's places in the frame of another one.
    fn seen_from(&self, other: &Self) -> Vec<Option<Vector2<f64>>> {
        let (Some(own), Some(frame)) = (&self.frame, &other.frame) else { return vec![None; self.places.len()] };
        let moved = |place: &Vector2<f64>| {
            let place = own.to_geodetic(&nalgebra::Vector3::new(place.x, place.y, 0.0));
            frame.to_ned(Geodetic { alt: frame.origin.alt, ..place }).xy()
        };
        self.places.iter().map(|place| place.as_ref().map(moved)).collect()
    }

    /// For each point of `first` (at distances `theirs`) the distance of this pass (points at distances `own`) at the same
    /// place, NaN where it was not there. Without places in both, the distance itself.
    pub(super) fn distances_along(&self, first: &Self, theirs: &[f64], own: &[f64]) -> Vec<f64> {
        if !self.has_places() || !first.has_places() {
            return theirs.to_vec();
        }
        let places = self.seen_from(first);
        let (mut at, mut lost): (Option<usize>, usize) = (None, 0);
        let raw: Vec<f64> = (0..theirs.len())
            .map(|index| {
                let Some(place) = first.places[index] else { return f64::NAN };
                let range = match at {
                    Some(at) => at.saturating_sub(WINDOW)..(at + WINDOW).min(places.len()),
                    None if lost.is_multiple_of(SEARCH_EVERY) => 0..places.len(),
                    None => 0..0,
                };
                match nearest(&places, range, place, heading(&first.places, index)) {
                    Some((near, share)) => {
                        (at, lost) = (Some(near), 0);
                        own[near] + share * (own[near + 1] - own[near]) - theirs[index]
                    }
                    None => {
                        (at, lost) = (None, lost + 1);
                        f64::NAN
                    }
                }
            })
            .collect();
        let smooth = bridged(&averaged(&raw));
        let at = |index: usize| theirs[index] + smooth[index];
        // What is carried over an outage must not be carried along another road.
        let is_elsewhere = |index: usize| {
            let there = own.partition_point(|d| *d < at(index));
            let place = places.get(there).copied().flatten();
            raw[index].is_nan() && first.places[index].zip(place).is_some_and(|(a, b)| (a - b).norm() > FARTHEST)
        };
        (0..theirs.len()).map(|index| if is_elsewhere(index) { f64::NAN } else { at(index) }).collect()
    }
}

/// Direction of travel at a point; zero where there is no neighbour.
pub(super) fn heading(places: &[Option<Vector2<f64>>], index: usize) -> Vector2<f64> {
    let at = |k: usize| places.get(k).copied().flatten();
    let here = at(index);
    let (before, after) = (at(index.wrapping_sub(1)).or(here), at(index + 1).or(here));
    before.zip(after).map_or_else(Vector2::zeros, |(a, b)| b - a)
}

/// The segment of `places` nearest to `place`, and where on it, driven in the direction `along`.
fn nearest(
    places: &[Option<Vector2<f64>>],
    range: std::ops::Range<usize>,
    place: Vector2<f64>,
    along: Vector2<f64>,
) -> Option<(usize, f64)> {
    let mut best: Option<(f64, usize, f64)> = None;
    for index in range {
        let (Some(Some(a)), Some(Some(b))) = (places.get(index), places.get(index + 1)) else { continue };
        let step = b - a;
        if step.dot(&along) <= 0.0 || step.norm_squared() < 1e-6 {
            continue;
        }
        let share = ((place - a).dot(&step) / step.norm_squared()).clamp(0.0, 1.0);
        let away = (a + step * share - place).norm();
        if away <= FARTHEST && best.is_none_or(|b| away < b.0) {
            best = Some((away, index, share));
        }
    }
    best.map(|(_, index, share)| (index, share))
}

/// Mean over the neighbours that have a value; NaN stays NaN.
fn averaged(values: &[f64]) -> Vec<f64> {
    let around = |k: usize| {
        let window = &values[k.saturating_sub(HALF_SMOOTH)..(k + HALF_SMOOTH + 1).min(values.len())];
        let (sum, count) = window.iter().filter(|v| v.is_finite()).fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        sum / count
    };
    (0..values.len()).map(|k| if values[k].is_nan() { f64::NAN } else { around(k) }).collect()
}

/// Holes of up to [`LONGEST_BRIDGE`] points filled by a line between their ends, those at the ends by the nearest value.
fn bridged(values: &[f64]) -> Vec<f64> {
    let known: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_finite()).collect();
    let mut out = values.to_vec();
    let mut fill = |from: usize, to: usize, a: f64, b: f64| {
        if to - from <= LONGEST_BRIDGE + 1 {
            (from + 1..to).for_each(|k| out[k] = a + (b - a) * (k - from) as f64 / (to - from) as f64);
        }
    };
    for pair in known.windows(2) {
        fill(pair[0], pair[1], values[pair[0]], values[pair[1]]);
    }
    if let (Some(&first), Some(&last)) = (known.first(), known.last()) {
        (first.saturating_sub(LONGEST_BRIDGE)..first).for_each(|k| out[k] = values[first]);
        (last + 1..(last + 1 + LONGEST_BRIDGE).min(values.len())).for_each(|k| out[k] = values[last]);
    }
    out
}
