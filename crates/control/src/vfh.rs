//! Vector field histogram: echoes are counted in a grid, cells are gathered into sectors, and the car goes between them.
//!
//! After Borenstein & Koren 1991, with the sectors' enlargement by the car's radius and their hysteresis (VFH+).
//! Source: reference 1 of Yun & Yu 2007; SPEC navigation 8. Sectors are fixed to the world: sector `i` is centred on the
//! direction of `5 i` deg, clockwise from true north. Departure: cells close to the car block all of its front, where the
//! specification's arcsine has no value.

use std::f64::consts::{FRAC_PI_2, TAU};

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::params;

use crate::Pose;

/// Number of sensors of the ring.
pub const AXES: usize = 12;
/// Number of sectors all round.
pub const SECTORS: usize = 72;
/// Readings of this and beyond are no echo, m.
pub const FURTHEST: f64 = 4.0;

/// Directions of the first axis and from axis to axis, rad.
const FIRST_AXIS: f64 = -82.5 / 180.0 * std::f64::consts::PI;
const BETWEEN_AXES: f64 = 15.0 / 180.0 * std::f64::consts::PI;
const SECTOR: f64 = TAU / SECTORS as f64;
/// Edge of a cell, m, and cells along an edge of the grid, which moves with the car.
const CELL: f64 = 0.1;
const SIDE: i64 = 128;
/// What an echo adds to its cell, what a free cell before it loses, and the most that a cell holds.
const HIT: i8 = 3;
const MISS: i8 = 1;
const MOST: i8 = 15;
/// Magnitude of a full cell at no distance, and the share of it that goes with the active radius.
const WEIGHT: f64 = 10.0;
const FADING: f64 = 0.25;
/// Weights of the turn away from the target, from the heading and from the direction before.
const COST: [f64; 3] = [5.0, 2.0, 2.0];
/// Distance over which the chosen direction is steered for, m.
const STEER_DISTANCE: f64 = 1.2;

params! {
    /// How obstacles are passed.
    pub struct VfhParams {
        /// Pass obstacles that the ring sees.
        avoidance (""): toggle = true, from "SPEC navigation 8";
        /// Obstacles up to this distance count. More: earlier and wider around them.
        active_radius (""): number = 2.5, "m", 0.8 ..= 4.0 Linear, from "SPEC navigation 8";
        /// Radius that the car is taken to have.
        car_radius (""): number = 0.35, "m", 0.0 ..= 2.0 Linear, from "SPEC navigation 8";
        /// Room kept between car and obstacle.
        margin (""): number = 0.15, "m", 0.0 ..= 1.0 Linear, from "SPEC navigation 8";
        /// A sector becomes blocked above this magnitude.
        blocked_above (""): number = 4.0, "1", 0.5 ..= 50.0 Log, from "SPEC navigation 8";
        /// A blocked sector becomes free below this magnitude.
        free_below (""): number = 2.0, "1", 0.1 ..= 50.0 Log, from "SPEC navigation 8";
        /// Furthest turn from the heading that is considered.
        widest_turn (""): number = 1.745_329_251_994_329_5, "rad", 0.5 ..= 3.0 Linear, from "SPEC navigation 8: 100 deg";
    }
}

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// The way to the target is free.
    Clear,
    /// Go in this direction instead, clockwise from true north, rad.
    Around(f64),
    /// Every direction is blocked.
    Stop,
}

/// A cell: where in the world it is, in cells, and its count.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    at: (i64, i64),
    count: i8,
}

/// Grid and sectors.
#[derive(Clone, Debug)]
pub struct Histogram {
    params: VfhParams,
    cells: Vec<Cell>,
    magnitude: [f64; SECTORS],
    blocked: [bool; SECTORS],
    previous: Option<f64>,
}

/// Direction of an axis of the ring from the heading, rad; axes run from left to right.
pub fn axis_direction(axis: usize) -> f64 {
    FIRST_AXIS + BETWEEN_AXES * axis as f64
}

/// Angle of the wheels that turns the car into a direction (rad).
pub fn steer_into(direction: f64, pose: &Pose, wheelbase: f64) -> f64 {
    libm::atan(2.0 * wheelbase * libm::sin(direction - pose.yaw) / STEER_DISTANCE)
}

fn sector_of(direction: f64) -> usize {
    (libm::rint(direction / SECTOR) as i64).rem_euclid(SECTORS as i64) as usize
}

fn slot(at: (i64, i64)) -> usize {
    (at.0.rem_euclid(SIDE) * SIDE + at.1.rem_euclid(SIDE)) as usize
}

fn cell_at(north: f64, east: f64) -> (i64, i64) {
    (libm::floor(north / CELL) as i64, libm::floor(east / CELL) as i64)
}

impl Histogram {
    /// An empty grid.
    pub fn new(params: VfhParams) -> Self {
        let cells = vec![Cell::default(); (SIDE * SIDE) as usize];
        Self { params, cells, magnitude: [0.0; SECTORS], blocked: [false; SECTORS], previous: None }
    }

    /// Enter a reading of the ring, m, axes from left to right, taken at a pose.
    pub fn enter(&mut self, pose: &Pose, ranges: &[f64; AXES]) {
        if !pose.is_finite() {
            return;
        }
        for (axis, &range) in ranges.iter().enumerate().filter(|(_, r)| r.is_finite()) {
            let (sin, cos) = libm::sincos(pose.yaw + axis_direction(axis));
            let range = range.clamp(0.0, FURTHEST);
            let end = cell_at(pose.north + range * cos, pose.east + range * sin);
            let mut last = None;
            for k in 0..(range / CELL) as usize {
                let reach = k as f64 * CELL;
                let at = cell_at(pose.north + reach * cos, pose.east + reach * sin);
                if at != end && last != Some(at) {
                    self.add(at, -MISS);
                }
                last = Some(at);
            }
            if range < FURTHEST {
                self.add(end, HIT);
            }
        }
    }

    fn add(&mut self, at: (i64, i64), change: i8) {
        let cell = &mut self.cells[slot(at)];
        if cell.at != at {
            *cell = Cell { at, count: 0 };
        }
        cell.count = (cell.count + change).clamp(0, MOST);
    }

    /// Cells that hold a count: centre north and east, m, and the count, 0 to 15.
    pub fn occupied(&self) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
        let centre = |i: i64| (i as f64 + 0.5) * CELL;
        (self.cells.iter().filter(|c| c.count > 0)).map(move |c| (centre(c.at.0), centre(c.at.1), f64::from(c.count)))
    }

    /// Magnitude of each sector at the last choice.
    pub fn magnitudes(&self) -> &[f64; SECTORS] {
        &self.magnitude
    }

    /// Which sectors were blocked at the last choice.
    pub fn blocked(&self) -> &[bool; SECTORS] {
        &self.blocked
    }

    /// Choose between the direction of the target (rad, clockwise from true north) and a free one near it.
    pub fn choose(&mut self, pose: &Pose, target: f64) -> Choice {
        if !pose.is_finite() || !target.is_finite() {
            return Choice::Stop;
        }
        self.gather(pose);
        for (blocked, &magnitude) in self.blocked.iter_mut().zip(&self.magnitude) {
            *blocked = magnitude > if *blocked { self.params.free_below } else { self.params.blocked_above };
        }
        if !self.blocked[sector_of(target)] {
            self.previous = Some(target);
            return Choice::Clear;
        }
        let previous = self.previous.unwrap_or(target);
        let mut best: Option<(f64, f64)> = None;
        for sector in (0..SECTORS).filter(|&s| !self.blocked[s]) {
            let direction = wrap_angle(sector as f64 * SECTOR);
            let turn = |from: f64| wrap_angle(direction - from).abs();
            if turn(pose.yaw) > self.params.widest_turn {
                continue;
            }
            let cost = COST[0] * turn(target) + COST[1] * turn(pose.yaw) + COST[2] * turn(previous);
            let is_right_of = |other: f64| wrap_angle(direction - other) > 0.0;
            // Of two that cost the same the right one is taken.
            if best.is_none_or(|(c, d)| cost < c - 1e-9 || (cost <= c + 1e-9 && is_right_of(d))) {
                best = Some((cost, direction));
            }
        }
        match best {
            Some((_, direction)) => {
                self.previous = Some(direction);
                Choice::Around(direction)
            }
            None => Choice::Stop,
        }
    }

    /// Gather the cells within the active radius into sectors.
    fn gather(&mut self, pose: &Pose) {
        self.magnitude = [0.0; SECTORS];
        let (here, radius) = (cell_at(pose.north, pose.east), self.params.active_radius);
        let reach = (radius / CELL) as i64 + 1;
        for i in here.0 - reach..=here.0 + reach {
            for j in here.1 - reach..=here.1 + reach {
                let cell = self.cells[slot((i, j))];
                if cell.count <= 0 || cell.at != (i, j) {
                    continue;
                }
                let north = (i as f64 + 0.5) * CELL - pose.north;
                let east = (j as f64 + 0.5) * CELL - pose.east;
                let distance = (north * north + east * east).sqrt();
                if distance <= radius {
                    self.gather_cell(f64::from(cell.count), distance, libm::atan2(east, north));
                }
            }
        }
    }

    fn gather_cell(&mut self, count: f64, distance: f64, bearing: f64) {
        let share = count / f64::from(MOST);
        let magnitude = WEIGHT * share * share * (1.0 - FADING * distance / self.params.active_radius);
        let room = self.params.car_radius + self.params.margin;
        let half = if room < distance { libm::asin(room / distance) } else { FRAC_PI_2 };
        let first = libm::ceil((bearing - half) / SECTOR) as i64;
        let last = libm::floor((bearing + half) / SECTOR) as i64;
        for sector in first..=last {
            self.magnitude[sector.rem_euclid(SECTORS as i64) as usize] += magnitude;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAR: [f64; AXES] = [FURTHEST; AXES];

    fn seen(readings: &[(usize, f64)], times: usize) -> Histogram {
        let mut histogram = Histogram::new(VfhParams::default());
        let mut ranges = FAR;
        readings.iter().for_each(|&(axis, range)| ranges[axis] = range);
        (0..times).for_each(|_| histogram.enter(&Pose::default(), &ranges));
        histogram
    }

    #[test]
    fn open_ground_is_clear_and_a_post_ahead_is_passed_on_the_right() {
        assert_eq!(seen(&[], 5).choose(&Pose::default(), 0.3), Choice::Clear);
        // Both middle axes see a post dead ahead: left and right cost the same.
        let mut histogram = seen(&[(5, 2.0), (6, 2.0)], 5);
        let Choice::Around(direction) = histogram.choose(&Pose::default(), 0.0) else { panic!("blocked ahead") };
        // Cells at 7.5 deg and 2 m, widened by asin(0.5 / 2.0) = 14.5 deg, block up to 22 deg.
        assert!((direction.to_degrees() - 25.0).abs() < 1e-9, "{}", direction.to_degrees());
        assert!(steer_into(direction, &Pose::default(), 0.8) > 0.0);
    }

    #[test]
    fn a_post_on_the_right_is_passed_on_the_left() {
        let mut histogram = seen(&[(6, 2.0), (7, 2.0)], 5);
        let Choice::Around(direction) = histogram.choose(&Pose::default(), 0.1) else { panic!("blocked ahead") };
        assert!(direction < 0.0, "{direction}");
    }

    #[test]
    fn one_echo_is_not_yet_an_obstacle_and_a_gone_one_is_forgotten() {
        assert_eq!(seen(&[(6, 2.0)], 1).choose(&Pose::default(), 0.13), Choice::Clear);
        let mut histogram = seen(&[(6, 2.0)], 5);
        assert_ne!(histogram.choose(&Pose::default(), 0.13), Choice::Clear);
        assert!(histogram.occupied().all(|(n, e, c)| (n * n + e * e).sqrt() < 2.1 && c == 15.0));
        // A full cell blocks with 8: it is below 2 from a count of 7 on, eight misses later.
        (0..8).for_each(|_| histogram.enter(&Pose::default(), &FAR));
        assert_eq!(histogram.choose(&Pose::default(), 0.13), Choice::Clear);
        assert!(histogram.magnitudes().iter().all(|m| *m < 2.0));
    }

    #[test]
    fn a_blocked_sector_stays_blocked_between_its_two_thresholds() {
        let mut histogram = seen(&[(6, 2.0)], 5);
        histogram.choose(&Pose::default(), 0.13);
        (0..6).for_each(|_| histogram.enter(&Pose::default(), &FAR));
        // Nine of fifteen: 10 * 0.36 * 0.8 = 2.9, between 2 and 4.
        assert_ne!(histogram.choose(&Pose::default(), 0.13), Choice::Clear);
        let mut fresh = seen(&[(6, 2.0)], 3);
        assert_eq!(fresh.choose(&Pose::default(), 0.13), Choice::Clear, "the same count was never above 4");
        assert!(!fresh.blocked().contains(&true));
    }

    #[test]
    fn a_wall_all_round_and_nonsense_stop_the_car() {
        let wall: Vec<(usize, f64)> = (0..AXES).map(|axis| (axis, 0.4)).collect();
        assert_eq!(seen(&wall, 5).choose(&Pose::default(), 0.0), Choice::Stop);
        let mut histogram = seen(&[], 1);
        histogram.enter(&Pose { north: f64::NAN, ..Pose::default() }, &FAR);
        histogram.enter(&Pose::default(), &[f64::NAN; AXES]);
        assert_eq!(histogram.choose(&Pose::default(), f64::NAN), Choice::Stop);
        assert_eq!(histogram.choose(&Pose::default(), 0.0), Choice::Clear);
    }

    #[test]
    fn what_was_seen_far_away_does_not_come_back_when_the_grid_wraps() {
        let mut histogram = seen(&[(5, 2.0), (6, 2.0)], 5);
        let beyond = Pose { north: SIDE as f64 * CELL, ..Pose::default() };
        assert_eq!(histogram.choose(&beyond, 0.0), Choice::Clear);
    }
}
