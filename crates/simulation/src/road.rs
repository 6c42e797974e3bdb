//! The road: curvature, grade and bank along arc length, twice continuously differentiable by construction.
//!
//! The road is laid out in level coordinates (north, east, down) that follow the ellipsoid: grade 0 is level everywhere.

use nalgebra::{Matrix3, Vector3};

use crate::math::{rotation, sin_cos, smooth_step, smooth_step_integral, smooth_step_slope};
use crate::roughness::Roughness;
use crate::spec::{Bump, DriveSpec, Grip, Side};

/// A quantity along the road: constant pieces joined by smooth steps centred on their boundaries.
#[derive(Clone, Debug)]
struct Profile {
    values: Vec<f64>,
    /// Integral from the road's start to each piece's start.
    areas: Vec<f64>,
}

/// Where the pieces lie and how long the steps between them are; shared by the profiles.
#[derive(Clone, Debug)]
struct Pieces {
    /// Start of each piece, and the end of the last, m.
    starts: Vec<f64>,
    /// Length of the step at the start of each piece, m; 0 at the road's two ends.
    blends: Vec<f64>,
}

/// A place along the road, resolved to its piece: which step is near and how far into it.
#[derive(Clone, Copy, Debug)]
struct Spot {
    piece: usize,
    into: f64,
    /// Position in the step at the piece's start (0.5 to 1) and at its end (0 to 0.5).
    first: f64,
    last: f64,
}

impl Pieces {
    fn new(spec: &DriveSpec) -> Self {
        let mut starts = vec![0.0];
        let mut blends = vec![0.0];
        for (index, segment) in spec.segments.iter().enumerate() {
            starts.push(starts[index] + segment.length);
            if index > 0 {
                blends.push(segment.blend.min(segment.length).min(spec.segments[index - 1].length));
            }
        }
        blends.push(0.0);
        Self { starts, blends }
    }

    fn spot(&self, s: f64) -> Spot {
        let pieces = self.starts.len() - 1;
        let piece = self.starts.partition_point(|&start| start <= s).clamp(1, pieces) - 1;
        let into = s - self.starts[piece];
        let left = self.starts[piece + 1] - s;
        let (b0, b1) = (self.blends[piece], self.blends[piece + 1]);
        let first = if b0 > 0.0 { (0.5 + into / b0).min(1.0) } else { 1.0 };
        let last = if b1 > 0.0 { (0.5 - left / b1).max(0.0) } else { 0.0 };
        Spot { piece, into, first, last }
    }
}

impl Profile {
    fn new(pieces: &Pieces, values: Vec<f64>) -> Self {
        let mut profile = Self { values, areas: vec![0.0] };
        for piece in 1..profile.values.len() {
            let (start, before) = (pieces.starts[piece], piece - 1);
            let end = Spot { piece: before, into: start - pieces.starts[before], first: 1.0, last: 0.5 };
            let area = profile.integral(pieces, &end);
            profile.areas.push(area);
        }
        profile
    }

    /// Value of the neighbour less that of the piece: before it and after it.
    fn jumps(&self, piece: usize) -> (f64, f64) {
        let value = self.values[piece];
        let before = if piece > 0 { self.values[piece - 1] } else { value };
        (before - value, self.values.get(piece + 1).copied().unwrap_or(value) - value)
    }

    fn value(&self, spot: &Spot) -> f64 {
        let (before, after) = self.jumps(spot.piece);
        self.values[spot.piece] + before * (1.0 - smooth_step(spot.first)) + after * smooth_step(spot.last)
    }

    fn slope(&self, pieces: &Pieces, spot: &Spot) -> f64 {
        let (before, after) = self.jumps(spot.piece);
        let part = |jump: f64, t: f64, blend: f64| if blend > 0.0 { jump * smooth_step_slope(t) / blend } else { 0.0 };
        part(after, spot.last, pieces.blends[spot.piece + 1]) - part(before, spot.first, pieces.blends[spot.piece])
    }

    /// Integral from the road's start.
    fn integral(&self, pieces: &Pieces, spot: &Spot) -> f64 {
        let (before, after) = self.jumps(spot.piece);
        let fading = |t: f64| t - smooth_step_integral(t);
        self.areas[spot.piece]
            + self.values[spot.piece] * spot.into
            + before * pieces.blends[spot.piece] * (fading(spot.first) - fading(0.5))
            + after * pieces.blends[spot.piece + 1] * smooth_step_integral(spot.last)
    }
}

/// The road at one place: angles in rad, rates per metre.
#[derive(Clone, Copy, Debug)]
pub struct RoadPoint {
    /// Heading of the centre line.
    pub heading: f64,
    /// Change of heading per metre.
    pub curvature: f64,
    /// Grade, uphill positive.
    pub grade: f64,
    /// Change of grade per metre.
    pub grade_rate: f64,
    /// Bank, right side down positive.
    pub bank: f64,
    /// Change of bank per metre.
    pub bank_rate: f64,
}

/// The road's surface round a place on its centre line, to second order.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Arc length, m.
    pub s: f64,
    /// The place, level coordinates, m.
    pub centre: Vector3<f64>,
    /// Road axes (ahead, right, down) to level axes.
    pub axes: Matrix3<f64>,
    /// Rotation of the road axes per metre, in road axes, rad/m.
    pub turn: Vector3<f64>,
    /// The angles behind the axes.
    pub point: RoadPoint,
}

impl Patch {
    /// Depth of the surface below the patch's plane at a place ahead and right of its centre, m, and its two slopes.
    pub fn surface(&self, ahead: f64, right: f64) -> (f64, f64, f64) {
        let (twist, bend) = (self.turn.x, self.turn.y);
        let depth = ahead * (twist * right - 0.5 * bend * ahead);
        (depth, twist * right - bend * ahead, twist * ahead)
    }
}

/// The whole road.
#[derive(Clone, Debug)]
pub struct Road {
    pieces: Pieces,
    curvature: Profile,
    grade: Profile,
    bank: Profile,
    start_heading: f64,
    roughness: Option<Roughness>,
    bumps: Vec<Bump>,
    grip: Vec<Grip>,
    /// Centre line and its direction at every [`GRID`] m from [`BEFORE`] m before the start.
    nodes: Vec<(Vector3<f64>, Vector3<f64>)>,
}

/// Distance between the nodes of the centre line, m.
const GRID: f64 = 1.0;
/// The road goes on straight before its start and after its end, m.
const BEFORE: f64 = 50.0;

impl Road {
    /// Lay the road of a checked drive from the origin of level coordinates.
    pub fn new(spec: &DriveSpec) -> Self {
        let pieces = Pieces::new(spec);
        let of = |value: fn(&crate::spec::Segment) -> f64| {
            Profile::new(&pieces, spec.segments.iter().map(value).collect::<Vec<f64>>())
        };
        let curvature = of(|s| s.curvature());
        let grade = of(|s| libm::atan(s.grade_percent / 100.0));
        let bank = of(|s| s.bank_deg.to_radians());
        let start_heading = spec.heading_deg.to_radians();
        let (bumps, grip) = (spec.bumps.clone(), spec.grip.clone());
        let mut road =
            Self { curvature, grade, bank, pieces, start_heading, roughness: None, bumps, grip, nodes: Vec::new() };
        road.lay();
        road.roughness = spec.roughness.map(|class| Roughness::new(class, road.length(), &spec.name));
        road
    }

    /// Length from the first to the last segment, m.
    pub fn length(&self) -> f64 {
        self.pieces.starts.last().copied().unwrap_or(0.0)
    }

    /// Start of the piece with this index, or the road's end, m.
    pub fn piece_start(&self, index: usize) -> f64 {
        self.pieces.starts[index.min(self.pieces.starts.len() - 1)]
    }

    /// Angles and their rates at a place; straight on before the start and after the end.
    pub fn point(&self, s: f64) -> RoadPoint {
        let inside = s.clamp(0.0, self.length());
        let spot = self.pieces.spot(inside);
        let straight = if inside == s { 1.0 } else { 0.0 };
        RoadPoint {
            heading: self.start_heading + self.curvature.integral(&self.pieces, &spot),
            curvature: straight * self.curvature.value(&spot),
            grade: self.grade.value(&spot),
            grade_rate: straight * self.grade.slope(&self.pieces, &spot),
            bank: self.bank.value(&spot),
            bank_rate: straight * self.bank.slope(&self.pieces, &spot),
        }
    }

    /// The surface round a place.
    pub fn patch(&self, s: f64) -> Patch {
        let point = self.point(s);
        let (sin_grade, cos_grade) = crate::math::sin_cos(point.grade);
        let (sin_bank, cos_bank) = crate::math::sin_cos(point.bank);
        let level_turn = point.curvature * cos_grade;
        let turn = Vector3::new(
            point.bank_rate - point.curvature * sin_grade,
            point.grade_rate * cos_bank + level_turn * sin_bank,
            level_turn * cos_bank - point.grade_rate * sin_bank,
        );
        Patch { s, centre: self.centre(s), axes: rotation(point.bank, point.grade, point.heading), turn, point }
    }

    /// Height of roughness and bumps, m, and its slope under a wheel of the left (0) or the right (1) track.
    pub fn roughness(&self, track: usize, s: f64) -> (f64, f64) {
        let (mut height, mut slope) = self.roughness.as_ref().map_or((0.0, 0.0), |r| r.at(track, s));
        for bump in self.bumps.iter().filter(|b| s > b.at && s < b.at + b.length) {
            let turn = std::f64::consts::TAU / bump.length;
            let (sin, cos) = sin_cos((s - bump.at) * turn);
            height += 0.5 * bump.height * (1.0 - cos);
            slope += 0.5 * bump.height * turn * sin;
        }
        (height, slope)
    }

    /// Friction under a wheel of the left (0) or the right (1) track as a share of the dry road's.
    pub fn grip(&self, track: usize, s: f64) -> f64 {
        let under = |side| side == Side::Both || (side == Side::Left) == (track == 0);
        let patch = self.grip.iter().rev().find(|g| s >= g.at && s < g.at + g.length && under(g.side));
        patch.map_or(1.0, |g| g.share)
    }

    fn direction(&self, s: f64) -> Vector3<f64> {
        let point = self.point(s);
        let (sin_heading, cos_heading) = crate::math::sin_cos(point.heading);
        let (sin_grade, cos_grade) = crate::math::sin_cos(point.grade);
        Vector3::new(cos_heading * cos_grade, sin_heading * cos_grade, -sin_grade)
    }

    /// Integrate the direction from node to node by Gauss' rule with three points.
    fn lay(&mut self) {
        let count = ((self.length() + 2.0 * BEFORE) / GRID) as usize + 2;
        let offset = 0.5 * GRID * (0.6_f64).sqrt();
        let mut place = -self.direction(-BEFORE) * BEFORE;
        for k in 0..count {
            let s = k as f64 * GRID - BEFORE;
            self.nodes.push((place, self.direction(s)));
            let middle = s + 0.5 * GRID;
            let ends = self.direction(middle - offset) + self.direction(middle + offset);
            place += (ends * (5.0 / 18.0) + self.direction(middle) * (4.0 / 9.0)) * GRID;
        }
    }

    /// Centre line, by Hermite's cubic between nodes.
    fn centre(&self, s: f64) -> Vector3<f64> {
        let end = (self.nodes.len() - 1) as f64;
        let at = ((s + BEFORE) / GRID).clamp(0.0, end - 1e-9);
        let beyond = s + BEFORE - (s + BEFORE).clamp(0.0, end * GRID);
        if beyond != 0.0 {
            let (place, direction) = self.nodes[if beyond < 0.0 { 0 } else { self.nodes.len() - 1 }];
            return place + direction * beyond;
        }
        let index = at as usize;
        let t = at - index as f64;
        let ((p0, d0), (p1, d1)) = (self.nodes[index], self.nodes[index + 1]);
        let (t2, t3) = (t * t, t * t * t);
        p0 * (2.0 * t3 - 3.0 * t2 + 1.0)
            + p1 * (3.0 * t2 - 2.0 * t3)
            + (d0 * (t3 - 2.0 * t2 + t) + d1 * (t3 - t2)) * GRID
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn road() -> Road {
        let segment = |length: f64, turn: f64, grade: f64, bank: f64| {
            format!(
                r#"{{"length": {length}, "speed_kmh": 40, "turn_deg": {turn}, "grade_percent": {grade}, "bank_deg": {bank}}}"#
            )
        };
        let segments = [
            segment(60.0, 0.0, 0.0, 0.0),
            segment(16.0, 90.0, 0.0, 0.0),
            segment(80.0, -40.0, 8.0, 5.0),
            segment(50.0, 0.0, -3.0, 0.0),
        ];
        let text = format!(r#"{{"name": "x", "description": "y", "segments": [{}]}}"#, segments.join(","));
        Road::new(&DriveSpec::from_json(&text).unwrap())
    }

    #[test]
    fn a_turn_turns_by_what_it_says_however_it_is_blended() {
        let road = road();
        let end = road.point(road.length());
        assert!((end.heading - 50_f64.to_radians()).abs() < 1e-14, "{}", end.heading.to_degrees());
    }

    #[test]
    fn heading_grade_and_bank_are_the_integrals_of_their_rates() {
        let road = road();
        let h = 1e-4;
        for k in 1..2050 {
            let s = f64::from(k) * 0.1;
            let (a, p, b) = (road.point(s - h), road.point(s), road.point(s + h));
            // Central difference: h^2 times the third derivative, below 1e-3 /m^3, plus rounding 1e-16/h.
            assert!(((b.heading - a.heading) / (2.0 * h) - p.curvature).abs() < 1e-9, "{s}");
            assert!(((b.grade - a.grade) / (2.0 * h) - p.grade_rate).abs() < 1e-9, "{s}");
            assert!(((b.bank - a.bank) / (2.0 * h) - p.bank_rate).abs() < 1e-9, "{s}");
        }
    }

    #[test]
    fn the_centre_line_runs_along_the_axes_and_the_axes_turn_as_stated() {
        let road = road();
        let h = 1e-3;
        for k in 1..500 {
            let s = f64::from(k) * 0.4;
            let (a, p, b) = (road.patch(s - h), road.patch(s), road.patch(s + h));
            let along = (b.centre - a.centre) / (2.0 * h);
            // Hermite's cubic on a 1 m grid follows a curve of radius 10 m to some 1e-5 in direction.
            assert!((along - p.axes.column(0)).norm() < 3e-5, "{s}: {}", (along - p.axes.column(0)).norm());
            let turn = crate::math::vector_of(&(a.axes.transpose() * b.axes)) / (2.0 * h);
            assert!((turn - p.turn).norm() < 1e-5, "{s}: a sign error in the frame's rate would show here");
        }
    }

    #[test]
    fn the_patch_follows_the_true_surface() {
        let road = road();
        let patch = road.patch(90.0);
        let ahead = road.patch(91.3);
        // A wheel 1.3 m ahead and 0.7 m right of the centre line, on the surface that the road really has there.
        let place = patch.axes.transpose() * (ahead.centre + ahead.axes.column(1) * 0.7 - patch.centre);
        let (depth, ..) = patch.surface(place.x, place.y);
        // Third order: rates change by their own size over the 40 m blend: 1.3^3 / 6 * 0.004 / 10 = 1.5e-4 m.
        assert!((depth - place.z).abs() < 2e-4, "{depth} {}", place.z);
        assert!(place.z.abs() > 1e-3, "the test needs a surface that is not flat");
    }
}
