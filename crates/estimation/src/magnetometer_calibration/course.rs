//! Magnetic heading against the GNSS course: clocks, mount, consistency, errors by sector.

use std::f64::consts::{PI, TAU};

use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::{Geodetic, LocalFrame};

use super::quality::{SECTORS, sector};

/// Slowest speed at which the course tells where the car points, m/s.
const SLOWEST: f64 = 1.5;
/// Baseline of a course between two positions, m and s.
const BASELINE: f64 = 2.0;
const LONGEST_BASELINE: f64 = 1.6;
/// Largest hole in a track that is bridged, s.
const LONGEST_HOLE: f64 = 1.0;
/// Largest clock offset looked for, and the step of the search, s.
const LARGEST_OFFSET: f64 = 10.0;
const OFFSET_STEP: f64 = 0.1;
/// Turns are compared over about this long, s.
const TURN_TIME: f64 = 4.0;
/// Lateral acceleration per slip of the rear axle, m/s^2/rad: 20 1/rad times gravity (SPEC orientation 4).
const AXLE_STIFFNESS: f64 = 196.0;
/// Pairs of courses used for the clock offset, at most.
const MOST_PAIRS: usize = 600;

/// A course over ground at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CoursePoint {
    pub time: f64,
    pub course: f64,
    pub speed: f64,
}

/// Courses of a drive while it moves: stated, else from velocity, else from one position to the next.
pub(super) fn course_points(drive: &Drive) -> Vec<CoursePoint> {
    let fixes = || drive.gnss.iter().filter(|(_, g)| g.is_usable());
    let stated: Vec<CoursePoint> = fixes()
        .filter(|(_, g)| g.ground_speed() >= SLOWEST && g.course_over_ground(SLOWEST).is_finite())
        .map(|(time, g)| CoursePoint { time, course: g.course_over_ground(SLOWEST), speed: g.ground_speed() })
        .collect();
    if !stated.is_empty() {
        return stated;
    }
    let Some(origin) = drive.origin().or_else(|| fixes().next().map(|_| Geodetic::default())) else {
        return Vec::new();
    };
    let frame = LocalFrame::new(origin);
    let places: Vec<(f64, f64, f64)> = fixes()
        .map(|(time, g)| {
            if g.north.is_finite() && g.east.is_finite() {
                return (time, g.north, g.east);
            }
            let ned = frame.to_ned(Geodetic { lat: g.lat, lon: g.lon, alt: origin.alt });
            (time, ned.x, ned.y)
        })
        .filter(|p| p.1.is_finite() && p.2.is_finite())
        .collect();
    let mut points = Vec::new();
    let mut from = 0;
    for to in 1..places.len() {
        // The nearest position behind that is far enough, within the longest baseline.
        while from < to && places[to].0 - places[from].0 > LONGEST_BASELINE {
            from += 1;
        }
        let far = |i: &usize| {
            let (a, b) = (places[*i], places[to]);
            (b.1 - a.1).hypot(b.2 - a.2) >= BASELINE.max(SLOWEST * (b.0 - a.0))
        };
        if let Some(i) = (from..to).rev().find(far) {
            let (a, b) = (places[i], places[to]);
            let (north, east) = (b.1 - a.1, b.2 - a.2);
            let speed = north.hypot(east) / (b.0 - a.0);
            points.push(CoursePoint { time: 0.5 * (a.0 + b.0), course: east.atan2(north), speed });
        }
    }
    points.dedup_by(|b, a| b.time <= a.time);
    points
}

/// An angle that goes on over full turns, over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Track {
    time: Vec<f64>,
    angle: Vec<f64>,
}

impl Track {
    /// Heading by the gyro, rad from where it began; `None` without a yaw gyro.
    pub fn of_gyro(drive: &Drive) -> Option<Self> {
        let mut track = Self::default();
        let (mut last, mut angle) = (None::<(f64, f64)>, 0.0);
        for (time, rate) in drive.imu.iter().map(|(t, s)| (t, s.gyro_z)).filter(|(_, r)| r.is_finite()) {
            if let Some((before, previous)) = last {
                angle += 0.5 * (rate + previous) * (time - before).min(LONGEST_HOLE);
            }
            last = Some((time, rate));
            track.time.push(time);
            track.angle.push(angle);
        }
        (track.time.len() > 1).then_some(track)
    }

    /// Headings that wrap, made to go on.
    pub fn of_headings(headings: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut track = Self::default();
        for (time, heading) in headings.filter(|(_, h)| h.is_finite()) {
            let last = track.angle.last().copied().unwrap_or(heading);
            track.time.push(time);
            track.angle.push(last + wrap_angle(heading - last));
        }
        track
    }

    /// The angle at an instant; NaN outside and in holes.
    pub fn at(&self, time: f64) -> f64 {
        let after = self.time.partition_point(|&t| t < time);
        if after == 0 || after == self.time.len() {
            return if self.time.get(after) == Some(&time) { self.angle[after] } else { f64::NAN };
        }
        let (t0, t1) = (self.time[after - 1], self.time[after]);
        if t1 - t0 > LONGEST_HOLE {
            return f64::NAN;
        }
        self.angle[after - 1] + (self.angle[after] - self.angle[after - 1]) * (time - t0) / (t1 - t0)
    }
}

/// By how much the sensors' clock is ahead of the receiver's.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ClockOffset {
    /// Sensors' time less the receiver's for the same instant, s.
    pub offset: f64,
    /// Its 1-sigma, s.
    pub sigma: f64,
    /// How far the antenna is ahead of the axle that does not slide, m, fitted with it.
    pub lever: f64,
}

/// Two courses some seconds apart.
struct Pair {
    from: CoursePoint,
    to: CoursePoint,
    turn: f64,
}

/// The clock offset at which turns by the gyro and turns of the course agree best; `None` where the drive does not tell.
///
/// Changes of course over some seconds are compared, so that neither the mount nor the gyro's drift enters. An antenna
/// ahead of the rear axle sees a turn earlier by its lever over the speed, which looks like a clock: the lever is fitted
/// too, and the slip of the rear axle taken off. A car that turns at a constant rate, or not at all, tells nothing of the clocks: the sigma is then large.
pub(super) fn clock_offset(points: &[CoursePoint], gyro: &Track) -> Option<ClockOffset> {
    let pairs = turns(points);
    let steps = (LARGEST_OFFSET / OFFSET_STEP) as i32;
    let cost = |offset: f64| agreement(&pairs, gyro, offset).0;
    let best = (-steps..=steps).map(|k| (cost(f64::from(k) * OFFSET_STEP), k)).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let centre = f64::from(best.1) * OFFSET_STEP;
    // A parabola through the neighbours half a second away.
    let reach = 0.5;
    let (low, middle, high) = (cost(centre - reach), best.0, cost(centre + reach));
    let bend = (low - 2.0 * middle + high) / (2.0 * reach * reach);
    if !(middle.is_finite() && bend.is_finite() && bend > 0.0) {
        return None;
    }
    let shift = ((low - high) / (4.0 * bend * reach)).clamp(-reach, reach);
    // Pairs overlap: what is independent are the stretches of the drive.
    let span = points.last()?.time - points.first()?.time;
    let independent = (span / TURN_TIME).min(pairs.len() as f64).max(1.0);
    let (offset, sigma) = (centre + shift, (middle / (bend * independent)).sqrt());
    Some(ClockOffset { offset, sigma, lever: agreement(&pairs, gyro, offset).1 })
}

/// Pairs of courses between which the car turned.
fn turns(points: &[CoursePoint]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    let mut next = 0;
    for from in points {
        while next < points.len() && points[next].time < from.time + TURN_TIME {
            next += 1;
        }
        let Some(to) = points.get(next).filter(|to| to.time < from.time + 2.0 * TURN_TIME) else { continue };
        let turn = wrap_angle(to.course - from.course);
        if turn.abs() > 5.0_f64.to_radians() {
            pairs.push(Pair { from: *from, to: *to, turn });
        }
    }
    let stride = pairs.len().div_ceil(MOST_PAIRS).max(1);
    pairs.into_iter().step_by(stride).collect()
}

/// Mean of one less the cosine of what is left between turns of course and gyro, and the lever that leaves least.
fn agreement(pairs: &[Pair], gyro: &Track, offset: f64) -> (f64, f64) {
    // The lever is known to be about this before (m), to this (m), where one turn is known to this (rad).
    const LEVER: (f64, f64) = (1.0, 1.0);
    const SIGMA: f64 = 0.05;
    let rate = |p: &CoursePoint| (gyro.at(p.time + offset + 0.25) - gyro.at(p.time + offset - 0.25)) / 0.5;
    let left: Vec<(f64, f64)> = pairs
        .iter()
        .map(|p| {
            let turned = gyro.at(p.to.time + offset) - gyro.at(p.from.time + offset);
            let (before, after) = (rate(&p.from), rate(&p.to));
            let slip = (after * p.to.speed - before * p.from.speed) / AXLE_STIFFNESS;
            (wrap_angle(p.turn - turned + slip), after / p.to.speed - before / p.from.speed)
        })
        .filter(|(error, curvature)| error.is_finite() && curvature.is_finite())
        .collect();
    if left.len() < 8 || 2 * left.len() < pairs.len() {
        return (f64::INFINITY, f64::NAN);
    }
    let weight = (SIGMA / LEVER.1).powi(2);
    let (mut squares, mut products) = (weight, weight * LEVER.0);
    for (error, curvature) in left.iter().filter(|(error, _)| error.abs() < 0.5) {
        squares += curvature * curvature;
        products += curvature * error;
    }
    let lever = (products / squares).clamp(-4.0, 4.0);
    let cost: f64 = left.iter().map(|(error, curvature)| 1.0 - (error - lever * curvature).cos()).sum();
    (cost / left.len() as f64, lever)
}

/// How well a heading agrees with the course, whatever constant lies between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Consistency {
    /// Mean resultant length of course less heading, every course alike: 1 is a constant difference, 0 none.
    pub plain: f64,
    /// The same with every 30 deg sector of course alike, so that a long straight does not hide the rest.
    pub balanced: f64,
    /// Sectors with courses, of 12.
    pub sectors: usize,
    /// Number of courses.
    pub points: usize,
}

/// Error of the heading in one sector of course, once the mount's yaw is taken off.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SectorError {
    /// Where the sector begins, rad from north; it is 30 deg wide.
    pub begins: f64,
    /// Number of courses in it.
    pub points: usize,
    /// Mean of heading less course, rad; NaN without courses.
    pub mean: f64,
    /// Root mean square, rad; NaN without courses.
    pub rms: f64,
}

/// Sum of unit vectors.
#[derive(Clone, Copy, Default)]
struct Resultant {
    cos: f64,
    sin: f64,
    count: usize,
}

impl Resultant {
    fn add(&mut self, cos: f64, sin: f64) {
        (self.cos, self.sin, self.count) = (self.cos + cos, self.sin + sin, self.count + 1);
    }
    fn mean(&self) -> (f64, f64) {
        let count = self.count.max(1) as f64;
        (self.cos / count, self.sin / count)
    }
    fn length(&self) -> f64 {
        let (cos, sin) = self.mean();
        cos.hypot(sin)
    }
}

/// Consistency of differences course less heading (course and difference, rad).
pub fn consistency(differences: &[(f64, f64)]) -> Consistency {
    let (mut all, mut balanced) = (Resultant::default(), Resultant::default());
    let mut by_sector = [Resultant::default(); SECTORS];
    for &(course, difference) in differences {
        let (sin, cos) = difference.sin_cos();
        all.add(cos, sin);
        by_sector[sector(course)].add(cos, sin);
    }
    let seen = || by_sector.iter().filter(|s| s.count > 0);
    seen().map(Resultant::mean).for_each(|(cos, sin)| balanced.add(cos, sin));
    let (plain, balanced) = (all.length(), balanced.length());
    Consistency { plain, balanced, sectors: seen().count(), points: differences.len() }
}

/// The constant part of differences course less heading: the mount's yaw, rad.
pub(super) fn mount_yaw(differences: &[(f64, f64)]) -> f64 {
    let (sin, cos) = differences.iter().fold((0.0, 0.0), |(s, c), d| (s + d.1.sin(), c + d.1.cos()));
    sin.atan2(cos)
}

/// Errors of the heading by 30 deg sector of course, once a mount yaw (rad) is taken off.
pub fn sector_errors(differences: &[(f64, f64)], mount_yaw: f64) -> [SectorError; SECTORS] {
    std::array::from_fn(|s| {
        let (mut sum, mut squares, mut points) = (0.0, 0.0, 0usize);
        for &(_, difference) in differences.iter().filter(|(course, _)| sector(*course) == s) {
            let error = -wrap_angle(difference - mount_yaw);
            (sum, squares, points) = (sum + error, squares + error * error, points + 1);
        }
        let count = points as f64;
        SectorError {
            begins: s as f64 * TAU / SECTORS as f64,
            points,
            mean: sum / count,
            rms: (squares / count).sqrt(),
        }
    })
}

/// Course less heading at every course, the receiver's clock set right by `offset` s: (course, difference), rad.
pub(super) fn differences(points: &[CoursePoint], heading: &Track, offset: f64) -> Vec<(f64, f64)> {
    (points.iter().map(|p| (p.course, p.course - heading.at(p.time + offset))))
        .filter(|(_, d)| d.is_finite())
        .map(|(course, d)| (course, wrap_angle(d)))
        .collect()
}

/// Root mean square of the differences about a mount yaw, rad.
pub(super) fn rms(differences: &[(f64, f64)], mount_yaw: f64) -> f64 {
    let squares: f64 = differences.iter().map(|(_, d)| wrap_angle(d - mount_yaw).powi(2)).sum();
    (squares / differences.len() as f64).sqrt().min(PI)
}
