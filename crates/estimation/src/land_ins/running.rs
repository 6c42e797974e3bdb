//! The running navigator: clock of the aids, order within a row, heading from the course, refusals, repairs.
//!
//! Source: SPEC motion 2. Within a row: predict, aids of the motion mode every 0.1 s, satellites.

use drivescope_drive::frames::wrap_angle;
use nalgebra::Vector3;

use super::aids::{self, Fix};
use super::alignment::{COURSE_FLOOR, Heading, Start, course_sigma, is_rotation};
use super::estimate::Verdicts;
use super::filter::{Filter, Row, Verdict};
use super::tuning::Tuning;
use crate::motion_mode::MotionMode;

/// Time between two aids of the motion mode, s.
const AIDING_STEP: f64 = 0.1;
/// Refusals of an aid in a row after which the filter and not the aid is doubted.
const REFUSALS: usize = 60;
const FIX_REFUSALS: usize = 20;
/// Slowest satellite speed, and slowest own speed, from which the course gives the heading, m/s.
const ALIGNING_SPEED: f64 = 2.0;
const OWN_SPEED: f64 = 1.0;
/// Own speed from which, without any course, a satellite course from the wrong side would show, m/s.
const SLOWEST_ROBOT: f64 = 0.5;

/// What an inertial row brings.
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// Time since the row before, s.
    pub dt: f64,
    /// Specific force, m/s^2.
    pub force: Vector3<f64>,
    /// Rates, rad/s.
    pub rate: Vector3<f64>,
    /// The mode.
    pub mode: MotionMode,
    /// Reported speed, m/s, if it is of the last 0.1 s.
    pub speed: Option<f64>,
    /// A fix and its age, s.
    pub fix: Option<(Fix, f64)>,
}

/// What a row led to.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    /// What the motion mode's aids were worth, where they were due.
    pub verdicts: Option<Verdicts>,
    /// What position and velocity of the fix were worth.
    pub gnss: [Option<Verdict>; 2],
    /// Whether the heading was found.
    pub found_heading: bool,
    /// Whether the state had to be put back.
    pub was_repaired: bool,
}

/// A navigator that runs.
#[derive(Clone, Debug)]
pub struct Running {
    /// The filter.
    pub filter: Filter,
    /// How well the heading is known.
    pub heading: Heading,
    since_aid: f64,
    rate_sum: Vector3<f64>,
    rates: usize,
    refusals: usize,
    fix_refusals: usize,
    turned: Option<(f64, f64)>,
    /// Whether it runs ahead to find the heading: its own state is not turned, and later courses better the angle.
    pub is_scout: bool,
    good: Filter,
}

impl Running {
    /// Begin.
    pub fn new(start: Start) -> Self {
        Self {
            good: start.filter.clone(),
            filter: start.filter,
            heading: start.heading,
            since_aid: 0.0,
            rate_sum: Vector3::zeros(),
            rates: 0,
            refusals: 0,
            fix_refusals: 0,
            turned: None,
            is_scout: false,
        }
    }

    /// By how much the state is to be turned, by all courses since the heading was found, and the sigma of that, rad.
    pub fn turned(&self) -> Option<(f64, f64)> {
        self.turned
    }

    /// Let a hole of the log pass.
    pub fn wait(&mut self, seconds: f64, mode: MotionMode) {
        self.filter.wait(seconds, mode == MotionMode::Stationary);
        self.since_aid = 0.0;
        self.rate_sum = Vector3::zeros();
        self.rates = 0;
    }

    /// Move on by a row and fold in what else it brings.
    pub fn step(&mut self, inputs: &Inputs, tuning: &Tuning) -> Outcome {
        let mut outcome = Outcome::default();
        self.filter.predict(&inputs.force, &inputs.rate, inputs.dt, tuning);
        self.since_aid += inputs.dt;
        self.rate_sum += inputs.rate;
        self.rates += 1;
        if self.since_aid + 0.5 * inputs.dt >= AIDING_STEP {
            let mean = self.rate_sum / self.rates as f64;
            outcome.verdicts = Some(self.aid(inputs, &mean, tuning));
            self.since_aid = 0.0;
            self.rate_sum = Vector3::zeros();
            self.rates = 0;
            outcome.was_repaired = self.check();
        }
        if let Some((fix, age)) = &inputs.fix {
            outcome.found_heading = self.find_heading(fix, tuning);
            if tuning.params.gnss && self.heading != Heading::Unknown && !self.is_scout {
                outcome.gnss = self.aid_by_satellites(fix, *age, tuning);
            }
        }
        outcome
    }

    fn aid(&mut self, inputs: &Inputs, mean: &Vector3<f64>, tuning: &Tuning) -> Verdicts {
        let (p, gate) = (&tuning.params, Some(tuning.params.gate));
        let mut v = Verdicts::default();
        let f = &mut self.filter;
        if inputs.mode == MotionMode::Stationary {
            if p.zupt {
                v.zupt = f.update(&aids::zero_velocity(f, tuning), None);
            }
            if p.zaru {
                v.zaru = f.update(&aids::zero_rate(f, mean, tuning), gate);
            }
            return v;
        }
        if p.nhc {
            v.nhc = f.update(&aids::non_holonomic(f, tuning, inputs.mode == MotionMode::Cornering), gate);
        }
        if p.straight && inputs.mode == MotionMode::Straight {
            v.straight = f.update(&[aids::straight(f, mean, tuning)], gate);
        }
        if let Some(speed) = inputs.speed.filter(|_| p.wheel) {
            v.wheel = f.update(&[aids::wheel(f, tuning, speed)], gate);
        }
        let is_refused = [v.nhc, v.wheel].into_iter().flatten().any(|v| !v.is_accepted);
        self.refusals = if is_refused { self.refusals + 1 } else { 0 };
        if self.refusals >= REFUSALS {
            self.filter.open_up(false);
            self.refusals = 0;
        }
        v
    }

    /// Position and then velocity, each with its own gate.
    fn aid_by_satellites(&mut self, fix: &Fix, age: f64, tuning: &Tuning) -> [Option<Verdict>; 2] {
        let gate = Some(tuning.params.gate);
        let f = &mut self.filter;
        let fold = |f: &mut Filter, (rows, count): ([Row; 3], usize)| {
            if count > 0 { f.update(&rows[..count], gate) } else { None }
        };
        let position = aids::satellite_position(f, tuning, fix, age);
        let position = fold(f, position);
        let velocity = aids::satellite_velocity(f, tuning, fix);
        let velocity = fold(f, velocity);
        let is_refused = [position, velocity].into_iter().flatten().any(|v| !v.is_accepted);
        self.fix_refusals = if is_refused { self.fix_refusals + 1 } else { 0 };
        if self.fix_refusals >= FIX_REFUSALS {
            self.filter.open_up(true);
            self.fix_refusals = 0;
        }
        [position, velocity]
    }

    /// Turn the state to the first satellite course of a car that clearly moves.
    ///
    /// Own velocity against the satellites' gives the angle, so that a car which reverses is not turned round; where the own
    /// velocity is too small to have a direction, as a slow robot's, the forward axis takes its place.
    fn find_heading(&mut self, fix: &Fix, tuning: &Tuning) -> bool {
        if self.turned.is_some() {
            self.refine_heading(fix, tuning);
        }
        if self.turned.is_some() || self.heading == Heading::Known {
            return false;
        }
        let own = self.filter.velocity.xy();
        let is_slow = own.norm() < OWN_SPEED;
        let slowest = if is_slow { SLOWEST_ROBOT } else { ALIGNING_SPEED };
        let Some(course) = fix.velocity.filter(|v| v.xy().norm() >= slowest) else { return false };
        let direction = if is_slow { self.filter.rotation.column(0).xy() } else { own };
        if is_slow && course.xy().norm() >= ALIGNING_SPEED {
            // The own velocity is wrong, or a launch has not been seen yet.
            return false;
        }
        let angle = course.y.atan2(course.x) - direction.y.atan2(direction.x);
        let sigma = course_sigma(&course, tuning);
        self.turned = Some((angle, sigma));
        if self.is_scout {
            return false;
        }
        self.filter.turn(angle, sigma);
        self.heading = Heading::Known;
        true
    }

    /// Let a later course, of a faster car, better the angle of the turn by its weight.
    fn refine_heading(&mut self, fix: &Fix, tuning: &Tuning) {
        let own = self.filter.velocity.xy();
        let (Some((angle, sigma)), Some(course)) = (&mut self.turned, fix.velocity.map(|v| v.xy())) else { return };
        if !self.is_scout || own.norm().min(course.norm()) < ALIGNING_SPEED {
            return;
        }
        let left = wrap_angle(course.y.atan2(course.x) - own.y.atan2(own.x) - *angle);
        // What all courses share stays.
        let (before, one) = (*sigma - COURSE_FLOOR, tuning.params.gnss_velocity_sigma / course.norm());
        let share = before * before / (before * before + one * one);
        *angle += share * left;
        *sigma = COURSE_FLOOR + before * (1.0 - share).sqrt();
    }

    /// Keep a sound state, or put the last sound one back.
    fn check(&mut self) -> bool {
        if self.filter.is_sound() && is_rotation(&self.filter.rotation) {
            self.good.clone_from(&self.filter);
            return false;
        }
        self.filter.clone_from(&self.good);
        self.filter.open_up(true);
        true
    }
}
