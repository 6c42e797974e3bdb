//! The motion over ground, and the velocity, course and speed columns that go with it.

use drivescope_drive::frames::wrap_angle;

use super::place_pairs::{Track, find_place};
use super::scene::Field;
use super::survey::{Kind, Role, Survey, Weight};
use crate::candidate::Confidence;

pub(super) const DEG: f64 = std::f64::consts::PI / 180.0;
/// Units of speeds: what 1 m/s reads.
pub(crate) const SPEEDS: [(&str, f64); 7] = [
    ("m/s", 1.0),
    ("km/h", 3.6),
    ("mph", 1.0 / 0.447_04),
    ("knots", 3600.0 / 1852.0),
    ("ft/s", 1.0 / 0.3048),
    ("cm/s", 100.0),
    ("mm/s", 1000.0),
];
/// Faster is no car, m/s.
pub(super) const FASTEST: f64 = 90.0;
/// Slower, a course says nothing, m/s.
pub(crate) const MOVING: f64 = 2.0;
/// Harder no car brakes, m/s^2: a receiver that finds itself jumps to where it is.
const HARDEST: f64 = 12.0;
const MOST_FIXES: usize = 4000;

/// The car's motion over ground at a few instants.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    pub time: Vec<f64>,
    /// To the north and to the east, m/s; NaN where only a speed is known.
    pub velocity: Vec<[f64; 2]>,
    /// m/s.
    pub speed: Vec<f64>,
    /// Heading from the first instant on, rad, where no velocity tells; empty without it.
    pub turned: Vec<f64>,
    /// What it rests on.
    pub label: String,
    /// How far a single velocity is off, m/s.
    pub noise: f64,
    /// The column that it is made of, where it is a speed of the car.
    pub column: Option<usize>,
}

/// What happened between two instants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval {
    pub from: f64,
    pub to: f64,
    /// Change of course, rad; NaN where the car is too slow.
    pub turn: f64,
    /// Mean speed, m/s, and its change per second.
    pub speed: f64,
    pub accel: f64,
}

impl Motion {
    /// The same at no more than so many of its instants.
    pub fn thinned(mut self, most: usize) -> Self {
        let stride = 1 + self.time.len() / most;
        self.time = self.time.into_iter().step_by(stride).collect();
        self.velocity = self.velocity.into_iter().step_by(stride).collect();
        self.speed = self.speed.into_iter().step_by(stride).collect();
        self
    }

    /// Stretches of at least 0.8 s between the instants, each `late` seconds earlier.
    pub fn intervals(&self, late: f64) -> Vec<Interval> {
        let mut out = Vec::new();
        let mut from = 0;
        for to in 1..self.time.len() {
            let step = self.time[to] - self.time[from];
            if step < 0.8 {
                continue;
            }
            let (a, b) = (self.speed[from], self.speed[to]);
            let course = |i: usize| self.velocity[i][1].atan2(self.velocity[i][0]);
            let turn = match (self.turned.get(from), self.turned.get(to)) {
                (Some(before), Some(after)) => after - before,
                _ if a.min(b) > MOVING => wrap_angle(course(to) - course(from)),
                _ => f64::NAN,
            };
            let still = a.max(b) < 0.3;
            let accel = (b - a) / step;
            if step < 2.5 && accel.abs() < HARDEST {
                let (from, to) = (self.time[from] - late, self.time[to] - late);
                let turn = if still { 0.0 } else { turn };
                out.push(Interval { from, to, turn, speed: 0.5 * (a + b), accel });
            }
            from = to;
        }
        out
    }
}

/// Samples of a column: its own, or one a second of a fast one; without the zeros of receivers that have no fix.
pub(super) fn samples(field: &Field) -> Vec<(f64, f64)> {
    let list: Vec<(f64, f64)> = if field.is_fast() {
        (0..field.grid.len()).step_by(10).map(|i| ((i as f64 + 0.5) * super::scene::STEP, field.grid[i])).collect()
    } else {
        field.events.clone()
    };
    let stride = 1 + list.len() / MOST_FIXES;
    list.into_iter().filter(|(_, v)| v.is_finite() && *v != 0.0).step_by(stride).collect()
}

/// Velocity of a track at its inner points, from the points on both sides.
pub(super) fn velocity(track: &Track) -> Motion {
    let mut motion = Motion { label: "the positions".into(), noise: 0.6, ..Motion::default() };
    let step = crate::clock::median(track.windows(2).map(|w| w[1][0] - w[0][0]).collect());
    let reach = (1.0 / step).round().clamp(1.0, 50.0) as usize;
    for i in reach..track.len().saturating_sub(reach) {
        let (a, b) = (track[i - reach], track[i + reach]);
        let step = b[0] - a[0];
        if step > 4.0 || step <= 0.0 {
            continue;
        }
        let v = [(b[1] - a[1]) / step, (b[2] - a[2]) / step];
        motion.time.push(track[i][0]);
        motion.speed.push(v[0].hypot(v[1]));
        motion.velocity.push(v);
    }
    motion
}

/// How a column follows a motion: share of its size that is left, what 1 m/s reads, number of instants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Follow {
    pub left: f64,
    pub factor: f64,
    pub count: usize,
    /// Correlation about the means.
    pub correlation: f64,
}

/// Compare a column, averaged over `reach` seconds to both sides, with a part of the motion.
pub(crate) fn follow(field: &Field, motion: &Motion, reach: f64, part: &dyn Fn(usize) -> f64) -> Follow {
    let mut s = [0.0; 6];
    for (i, &t) in motion.time.iter().enumerate() {
        let y = if reach > 0.0 { field.mean(t - reach, t + reach) } else { field.at(t) };
        let x = part(i);
        if x.is_finite() && y.is_finite() {
            for (sum, v) in s.iter_mut().zip([1.0, x, y, x * x, y * y, x * y]) {
                *sum += v;
            }
        }
    }
    let [n, x, y, xx, yy, xy] = s;
    let factor = xy / xx;
    let left = ((yy - factor * xy).max(0.0) / yy).sqrt();
    let correlation = (xy - x * y / n) / ((xx - x * x / n) * (yy - y * y / n)).max(1e-300).sqrt();
    let sane = n >= 8.0 && xx > 0.0 && yy > 0.0;
    Follow {
        left: if sane { left } else { 1.0 },
        factor: if sane { factor } else { f64::NAN },
        count: n as usize,
        correlation,
    }
}

/// The unit in which 1 m/s reads `factor`, and the ratio that is left.
pub(crate) fn speed_unit(factor: f64) -> (&'static str, f64) {
    let (unit, _) = crate::fit::nearest(factor.abs(), &SPEEDS);
    let one = SPEEDS.iter().find(|u| u.0 == unit).map_or(1.0, |u| u.1);
    (unit, factor.abs() / one)
}

pub(super) fn part_of(motion: &Motion, i: usize, part: usize) -> f64 {
    if part == 2 { motion.speed[i] } else { motion.velocity[i][part] }
}

/// Find places, then what goes with them; gives the motion over ground by the best of them.
pub(crate) fn find(s: &mut Survey) -> Option<Motion> {
    let place = find_place(s);
    let motion = place.as_ref().map(velocity).filter(|m| m.time.len() >= 8);
    let by_speed = find_velocity(s, motion.as_ref());
    by_speed.or(motion)
}

/// Velocity to the north and east, course and speed of the receiver, by the way over the ground.
fn find_velocity(s: &mut Survey, by_place: Option<&Motion>) -> Option<Motion> {
    let motion = by_place?;
    let mut best: [Option<(f64, usize, Follow)>; 2] = [None, None];
    for c in s.columns(Kind::Velocity) {
        let field = &s.scene.fields[c];
        let f: Vec<Follow> = (0..3).map(|part| follow(field, motion, 1.0, &|i| part_of(motion, i, part))).collect();
        for part in 0..2 {
            let (_, ratio) = speed_unit(f[part].factor);
            let other = f[1 - part].left.min(f[2].left);
            let worth = f[part].left + ratio.ln().abs();
            let fits = f[part].left < 0.35 && ratio.ln().abs() < 0.06 && f[part].left < other;
            if fits && best[part].is_none_or(|b| worth < b.0) {
                best[part] = Some((worth, c, f[part]));
            }
        }
    }
    let mut known = [None, None];
    for (part, signal) in [(0, "gnss_vn"), (1, "gnss_ve")] {
        let Some((_, column, f)) = best[part] else { continue };
        let (unit, ratio) = speed_unit(f.factor);
        let confidence = if f.left < 0.15 { Confidence::Certain } else { Confidence::Likely };
        let why = format!(
            "follows the way of the positions to the {}: {:.3} times it in {unit}, {:.1} % left over {} fixes",
            if part == 0 { "north" } else { "east" },
            ratio * f.factor.signum(),
            100.0 * f.left,
            f.count
        );
        let role =
            Role { signal: signal.into(), unit: unit.into(), scale: f.factor.signum(), offset: 0.0, confidence, why };
        s.assign(column, role);
        known[part] = Some(column);
    }
    let [Some(north), Some(east)] = known else { return None };
    Some(from_columns(s, north, east))
}

/// The motion that two columns of velocity give.
fn from_columns(s: &Survey, north: usize, east: usize) -> Motion {
    let label = format!("{} and {}", s.label(north), s.label(east));
    let mut motion = Motion { label, noise: 0.1, ..Motion::default() };
    let (a, b) = (s.factor(north), s.factor(east));
    let (first, second) = (&s.scene.fields[north], &s.scene.fields[east]);
    let list: Vec<(f64, f64)> = if first.is_fast() {
        (0..first.grid.len()).step_by(10).map(|i| ((i as f64 + 0.5) * super::scene::STEP, first.grid[i])).collect()
    } else {
        first.events.clone()
    };
    let mut k = 0;
    for (t, v) in list {
        let w = if first.is_fast() {
            second.at(t)
        } else {
            while k < second.events.len() && second.events[k].0 < t - 1e-3 {
                k += 1;
            }
            second.events.get(k).filter(|e| (e.0 - t).abs() < 1e-3).map_or(f64::NAN, |e| e.1)
        };
        let v = [a * v, b * w];
        if v[0].is_finite() && v[1].is_finite() {
            motion.time.push(t);
            motion.velocity.push(v);
            motion.speed.push(v[0].hypot(v[1]));
        }
    }
    motion
}

/// Course over ground and the receiver's speed: columns that are sampled with the fixes.
pub(crate) fn find_course(s: &mut Survey, motion: &Motion) {
    let mut best: Option<(f64, usize, &'static str, bool, f64)> = None;
    for c in s.columns(Kind::Course) {
        let field = &s.scene.fields[c];
        let list = samples(field);
        for (unit, factor) in [("deg", DEG), ("rad", 1.0)] {
            for east in [false, true] {
                let (mut errors, mut turned) = (Vec::new(), 0.0);
                let mut first = None;
                for (i, &t) in motion.time.iter().enumerate().filter(|(i, _)| motion.speed[*i] > 2.0 * MOVING) {
                    let near = list.partition_point(|e| e.0 < t - 0.05);
                    let Some(raw) = list.get(near).filter(|e| (e.0 - t).abs() < 0.06) else { continue };
                    let way = motion.velocity[i][1].atan2(motion.velocity[i][0]);
                    let own = if east { 0.5 * std::f64::consts::PI - raw.1 * factor } else { raw.1 * factor };
                    errors.push(wrap_angle(own - way).abs());
                    turned = wrap_angle(way - *first.get_or_insert(way)).abs().max(turned);
                }
                let count = errors.len();
                let error = crate::clock::median(errors);
                if count >= 8 && error < 0.2 && best.is_none_or(|b| error < b.0) {
                    best = Some((error, c, unit, east, turned));
                }
            }
        }
    }
    let Some((error, column, unit, east, turned)) = best else { return };
    let confidence = match (turned > 0.5, s.names[column].is_some()) {
        (true, _) => Confidence::Certain,
        (_, true) => Confidence::Likely,
        _ => Confidence::Guess,
    };
    let why = format!(
        "is the direction of {} up to {:.1} deg (median), {} in {unit}",
        motion.label,
        error / DEG,
        if east { "counted from east to the left" } else { "clockwise from north" }
    );
    if east {
        let text = format!("{} {why}: turned to clockwise from north.", s.label(column));
        s.find(Weight::Guess, &[column], text);
    }
    let (scale, offset) = if east { (-1.0, 0.5 * std::f64::consts::PI) } else { (1.0, 0.0) };
    s.assign(column, Role { signal: "course".into(), unit: unit.into(), scale, offset, confidence, why });
}
