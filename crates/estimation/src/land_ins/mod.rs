//! Position, velocity and attitude of a land vehicle from inertial sensors, held by what its motion mode implies.
//!
//! States: fifteen errors of a flat-Earth navigator ([`filter`]). Inputs: specific force and rates, from a triad of
//! accelerometers and gyros or from the six-accelerometer disk; optionally the reported speed and satellites.
//! Source: Lee et al. 2010, sections 2 and 4, with satellites their future work; SPEC motion 2.
//! At rest: zero velocity and zero rate. In motion: no velocity sideways or upward, and on a straight no yaw rate.
//! Zero velocity alone is no cure: at rest tilt and accelerometer bias cannot be told apart, and between two stops the
//! position still runs away. Without speed or satellites the error along the road grows on every straight; the next corner
//! pulls it back, because the constraint then sees the speed.
//! Departures: the heading may be found later than the start (the state is turned about the vertical then); the log's first
//! seconds are read before the first row, so that rows before the end of the levelling already hold the levelled state.

pub mod aids;
mod alignment;
pub mod errors;
mod estimate;
pub mod filter;
pub mod mechanisation;
mod running;
mod tuning;

use drivescope_drive::drive::{Drive, Epoch, EpochCursor, LogStart, Signal};
use drivescope_drive::geodesy::{Geodetic, LocalFrame};
use drivescope_drive::signals::Gnss;
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::Vector3;

use self::aids::Fix;
use self::alignment::{Alignment, Heading, Start, moving_start};
pub use self::estimate::LandInsEstimate;
use self::running::{Inputs, Outcome, Running};
pub use self::tuning::{LandInsParams, Tuning};
use crate::estimator::{Estimator, EstimatorError, Need, Notices};
use crate::motion_mode::{InertialRow, MotionMode, MotionModeDetector, MotionModeParams};

/// Largest specific force (m/s^2) and rate (rad/s) of a car.
const LARGEST_FORCE: f64 = 200.0;
const LARGEST_RATE: f64 = 35.0;
/// Fastest speed that is believed, m/s.
const FASTEST: f64 = 150.0;
/// Age up to which a reported speed counts, s.
const SPEED_AGE: f64 = 0.1;
/// Step of the log that is a hole, s.
const HOLE: f64 = 0.5;
/// Time without a fix after which satellites no longer hold the filter, s.
const GNSS_AGE: f64 = 2.0;
/// Shortest rest that a start is taken from when the car drives off, s.
const SHORTEST_REST: f64 = 1.0;
/// How far into the log the heading is looked for before the first row, s.
const LOOK_AHEAD: f64 = 120.0;
/// For how long after the first course further ones better the heading, s.
const COURSES_FOR: f64 = 15.0;

const NO_HEADING: &str =
    "Nothing gives the heading (no `initial_yaw`, magnetometer or satellite course): it starts at zero.";
const FOUND_HEADING: &str = "The heading was found from the satellites' course.";
const STARTS_MOVING: &str =
    "The log starts in motion: roll and pitch start at zero, velocity and heading from the satellites.";
const REPAIRED: &str = "The state stopped being a number and was put back.";
const IMPLAUSIBLE: &str = "An inertial row beyond a car's range: the row before it was used.";

/// What the estimator does at the moment.
#[derive(Clone, Debug)]
enum Phase {
    Aligning(Box<Alignment>),
    /// Levelled, with the state that holds until this time.
    Waiting(f64, Box<Start>),
    Running(Box<Running>),
}

/// The estimator: see the [module](self).
#[derive(Clone, Debug)]
pub struct LandIns {
    tuning: Tuning,
    mode: MotionModeDetector,
    frame: Option<LocalFrame>,
    phase: Phase,
    time: f64,
    good: InertialRow,
    speed: (f64, f64),
    fix: Option<(f64, Fix)>,
    gnss_time: f64,
    row: LandInsEstimate,
    notices: Notices,
}

impl Estimator for LandIns {
    const NAME: &'static str = "land_ins";
    const TITLE: &'static str = "Land navigation by motion mode";
    const DOC: &'static str = "Position, velocity and attitude from inertial sensors alone, held by what the motion mode \
        implies: no velocity at rest, none sideways while moving. Speed and satellites on request. After Lee et al. 2010.";
    const NEEDS: &'static [Need] = &[
        Need { signal: Signal::SixAxes, required: true, why: "velocity and attitude are integrated from all six" },
        Need { signal: Signal::ForwardSpeed, required: false, why: "with `wheel`, holds the error along the road" },
        Need {
            signal: Signal::GnssVelocity,
            required: false,
            why: "its course gives the heading, unless `initial_yaw` does",
        },
        Need { signal: Signal::Mag, required: false, why: "gives a heading at the start, where satellites do not" },
        Need {
            signal: Signal::GnssPosition,
            required: false,
            why: "with `gnss`, holds the position; without wheels, fixes that stay tell rest",
        },
    ];
    const VEHICLE: &'static str = "saloon";
    type Params = LandInsParams;
    type Estimate = LandInsEstimate;

    fn new(params: &LandInsParams, vehicle: &VehicleParams, start: &LogStart) -> Self {
        let mode =
            MotionModeParams { adaptive: params.adaptive, use_speed: params.use_speed, ..MotionModeParams::default() };
        Self {
            tuning: Tuning::new(params, start),
            mode: MotionModeDetector::new(&mode, vehicle, start),
            frame: start.origin.map(LocalFrame::new),
            phase: Phase::Aligning(Box::default()),
            time: f64::NEG_INFINITY,
            good: InertialRow::AT_REST,
            speed: (f64::NEG_INFINITY, f64::NAN),
            fix: None,
            gnss_time: f64::NEG_INFINITY,
            row: LandInsEstimate::default(),
            notices: Notices::default(),
        }
    }

    /// Level on a copy, let it find the heading, and start from what it found.
    fn look_ahead(&mut self, drive: &Drive) {
        let has_course = drive.has(Signal::GnssVelocity) && !self.tuning.params.initial_yaw.is_finite();
        let Some(mut found) = self.scout(drive, has_course) else { return };
        if found.start.heading == Heading::Unknown && !has_course {
            self.notices.add(NO_HEADING, found.time);
            found.start.heading = Heading::Known;
        }
        if let Some((angle, sigma)) = found.turned {
            self.notices.add(FOUND_HEADING, found.time);
            // The turn's sigma is all that is not known of the heading.
            found.start.filter.count_from_yaw();
            found.start.filter.turn(angle, sigma);
            found.start.heading = Heading::Known;
        }
        self.phase = Phase::Waiting(found.time, Box::new(found.start));
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<LandInsEstimate>, EstimatorError> {
        self.receive(epoch);
        let Some(decision) = self.mode.step(epoch)? else { return Ok(None) };
        let dt = epoch.time - self.time;
        self.time = epoch.time;
        self.keep_plausible(epoch.time);
        let fix = self.fix.take().map(|(at, fix)| (fix, epoch.time - at));
        let speed = Some(self.speed).filter(|(at, _)| epoch.time - at < SPEED_AGE).map(|(_, speed)| speed);
        let inputs = Inputs {
            dt,
            force: Vector3::from(self.good.force),
            rate: Vector3::from(self.good.rate),
            mode: self.mode.mode(),
            speed,
            fix: fix.filter(|(_, age)| *age < HOLE),
        };
        self.row.mode = decision.mode;
        match &mut self.phase {
            Phase::Aligning(_) => self.align(epoch.time, &inputs),
            Phase::Waiting(until, start) => {
                if epoch.time >= *until {
                    self.phase = Phase::Running(Box::new(Running::new((**start).clone())));
                }
            }
            Phase::Running(running) => {
                if dt > HOLE {
                    running.wait(dt, inputs.mode);
                } else {
                    let outcome = running.step(&inputs, &self.tuning);
                    self.tell(epoch.time, &outcome);
                }
            }
        }
        Ok(self.estimate())
    }

    fn notices(&self) -> &Notices {
        &self.notices
    }
}

/// A start found ahead of the first row.
struct Scouted {
    time: f64,
    start: Start,
    turned: Option<(f64, f64)>,
}

impl LandIns {
    /// Where a copy that runs ahead starts to navigate from rest, and by how much its heading turned out to be wrong.
    fn scout(&self, drive: &Drive, has_course: bool) -> Option<Scouted> {
        let mut scout = self.clone();
        let mut cursor = EpochCursor::default();
        let mut found: Option<Scouted> = None;
        let begin = drive.span()?.0;
        let mut turned_at = None;
        while let Some(epoch) = cursor.next(drive).filter(|e| e.time - begin < LOOK_AHEAD) {
            scout.step(&epoch).ok()?;
            let Phase::Running(running) = &mut scout.phase else { continue };
            running.is_scout = true;
            if found.is_none() {
                let start = Start { filter: running.filter.clone(), heading: running.heading };
                found = Some(Scouted { time: epoch.time, start, turned: None });
                if has_course && running.heading != Heading::Known {
                    // An uncertain yaw would let the aids turn the state, which the courses are then held against.
                    running.filter.count_from_yaw();
                }
            }
            let Some(found) = &mut found else { continue };
            found.turned = running.turned();
            let is_done = match found.turned {
                Some(_) => epoch.time - *turned_at.get_or_insert(epoch.time) > COURSES_FOR,
                None => running.heading == Heading::Known || !has_course,
            };
            if is_done {
                break;
            }
        }
        // A car that drove before it stood has no state to show for its first rows.
        let latest = begin + self.tuning.params.align_time + SHORTEST_REST;
        found.filter(|f| f.start.filter.velocity == Vector3::zeros() && f.time <= latest)
    }

    /// Keep what an epoch says besides the inertial row.
    fn receive(&mut self, epoch: &Epoch) {
        if let Some(speed) = epoch.wheels.map(|w| w.forward_speed()).filter(|v| v.abs() < FASTEST) {
            self.speed = (epoch.time, speed);
        }
        if let (Some(mag), Phase::Aligning(alignment)) = (&epoch.mag, &mut self.phase) {
            alignment.field(mag);
        }
        if let Some(fix) = epoch.gnss.and_then(|gnss| self.read_fix(&gnss)) {
            self.fix = Some((epoch.time, fix));
        }
    }

    /// A usable fix in local metres.
    fn read_fix(&mut self, gnss: &Gnss) -> Option<Fix> {
        if !gnss.is_usable() {
            return None;
        }
        let p = &self.tuning.params;
        let mut down = -gnss.alt;
        let position = if gnss.lat.is_finite() && gnss.lon.is_finite() {
            let alt = if gnss.alt.is_finite() { gnss.alt } else { 0.0 };
            let place = Geodetic { lat: gnss.lat, lon: gnss.lon, alt };
            let frame = self.frame.get_or_insert_with(|| LocalFrame::new(place));
            let alt = if gnss.alt.is_finite() { alt } else { frame.origin.alt };
            Some(frame.to_ned(Geodetic { alt, ..place }))
        } else if gnss.north.is_finite() && gnss.east.is_finite() {
            down = gnss.down;
            Some(Vector3::new(gnss.north, gnss.east, if down.is_finite() { down } else { 0.0 }))
        } else {
            None
        };
        let (north, east) = gnss.horizontal_velocity();
        let v_down = if gnss.v_down.is_finite() { gnss.v_down } else { 0.0 };
        let velocity = Some(Vector3::new(north, east, v_down)).filter(|v| v.norm() < FASTEST);
        let stated = |sigma: f64, default: f64| if sigma > 0.05 && sigma < 1e4 { sigma } else { default };
        let height_sigma = stated(gnss.std_down, p.gnss_height_sigma);
        let fix = Fix {
            position: position.filter(|p| p.norm() < 1e7),
            position_sigma: Vector3::new(
                stated(gnss.std_north, p.gnss_position_sigma),
                stated(gnss.std_east, p.gnss_position_sigma),
                if down.is_finite() { height_sigma } else { f64::INFINITY },
            ),
            velocity,
            has_vertical_velocity: gnss.v_down.is_finite(),
        };
        (fix.position.is_some() || fix.velocity.is_some()).then_some(fix)
    }

    fn keep_plausible(&mut self, time: f64) {
        let row = self.mode.inertial_row();
        let is_plausible =
            row.force.iter().all(|f| f.abs() <= LARGEST_FORCE) && row.rate.iter().all(|w| w.abs() <= LARGEST_RATE);
        if is_plausible {
            self.good = row;
        } else {
            self.notices.add(IMPLAUSIBLE, time);
        }
    }

    /// Use a row for levelling; begin when the time is up, or when the car drives off.
    fn align(&mut self, time: f64, inputs: &Inputs) {
        let Phase::Aligning(alignment) = &mut self.phase else { return };
        let fix = inputs.fix.as_ref().map(|(fix, _)| fix);
        if inputs.dt > HOLE {
            alignment.reset();
        }
        let start = if inputs.mode == MotionMode::Stationary {
            let is_long = alignment.duration(time) >= self.tuning.params.align_time;
            let start = if is_long { alignment.start(&self.tuning, true) } else { None };
            if start.is_none() {
                alignment.rest(time, &inputs.force, &inputs.rate);
                if let Some(fix) = fix {
                    alignment.fix(fix);
                }
            }
            start
        } else {
            let is_long = alignment.duration(time) >= SHORTEST_REST;
            let rested = if is_long { alignment.start(&self.tuning, false) } else { None };
            alignment.reset();
            let moving = || moving_start(fix, inputs.speed, &self.tuning);
            rested.or_else(|| moving().inspect(|_| self.notices.add(STARTS_MOVING, time)))
        };
        if let Some(start) = start {
            self.phase = Phase::Running(Box::new(Running::new(start)));
        }
    }

    /// Put what a row led to into columns and notices.
    fn tell(&mut self, time: f64, outcome: &Outcome) {
        estimate::write_aids(outcome.verdicts.as_ref(), &outcome.gnss, &mut self.row);
        if outcome.gnss.iter().flatten().next().is_some() {
            let is_used = outcome.gnss.iter().flatten().any(|v| v.is_accepted);
            self.gnss_time = if is_used { time } else { f64::NEG_INFINITY };
        }
        self.row.gnss_active = f64::from(u8::from(time - self.gnss_time <= GNSS_AGE));
        if outcome.found_heading {
            self.notices.add(FOUND_HEADING, time);
        }
        if outcome.was_repaired {
            self.notices.add(REPAIRED, time);
        }
    }

    fn estimate(&mut self) -> Option<LandInsEstimate> {
        let (filter, heading) = match &self.phase {
            Phase::Aligning(_) => return None,
            Phase::Waiting(_, start) => (&start.filter, start.heading),
            Phase::Running(running) => (&running.filter, running.heading),
        };
        estimate::write_state(filter, &mut self.row);
        estimate::write_sigmas(filter, &mut self.row);
        let mut row = self.row;
        if heading == Heading::Unknown {
            estimate::blank_heading(&mut row);
        }
        Some(row)
    }
}

#[cfg(test)]
mod tests;
