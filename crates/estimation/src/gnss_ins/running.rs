//! The running filter: order of the updates within an epoch, aiding clock, lock-out, yaw alignment.
//!
//! Source: SPEC navigation 4 and 11. Within an epoch: predict, standing or (odometer, constraint) every 0.1 s, satellites.

use drivescope_drive::satellites::Satellite;
use nalgebra::{Vector3, vector};

use super::alignment::{Start, UNKNOWN_YAW_SIGMA};
use super::covariance::Covariance;
use super::estimate::Verdicts;
use super::filter::Filter;
use super::fix::Fix;
use super::inertial::Sample;
use super::measurement;
use super::ranging::{Lag, Ranging};
use super::standing::Rolling;
use super::tuning::{Coupling, Tuning};
use super::watch::Watch;
use crate::estimator::{EstimatorError, Notices};
use crate::ins::ATTITUDE;

/// Time between two updates by the car's own motion, s.
const AIDING_STEP: f64 = 0.1;
/// Longest wait for an odometer sample before the constraint is used without one, s.
const LONGEST_ODOMETER_WAIT: f64 = 0.25;
/// Speed that no car reaches, m/s.
const FASTEST_CAR: f64 = 150.0;
/// Satellite speed from which the course tells the yaw, m/s.
const ALIGNING_SPEED: f64 = 0.4;
/// Longest inertial step that is integrated as one, s.
const LONGEST_STEP: f64 = 0.5;
/// Substep with held inertial values across a hole, s.
const SUBSTEP: f64 = 0.02;
/// Longest hole that is bridged, s.
const LONGEST_BRIDGE: f64 = 5.0;

/// Zero velocities refused in a row after which the filter's velocity is doubted: 2 s, longer than wheels lock.
const STANDING_REFUSALS: f64 = 20.0;
/// Time without pseudoranges after which a tightly coupled filter takes fixes, s.
const LONGEST_RANGE_WAIT: f64 = 5.0;

/// What the car's sensors said since the last epoch.
#[derive(Clone, Copy, Debug, Default)]
pub struct Aids<'a> {
    /// What the odometer says, if it is of this epoch.
    pub rolling: Option<Rolling>,
    /// A fix and its age, s.
    pub fix: Option<(Fix, f64)>,
    /// Pseudoranges and their age, s.
    pub ranges: Option<(&'a [Satellite], f64)>,
}

impl Aids<'_> {
    /// Whether the odometer runs backward.
    pub fn is_reversing(&self) -> bool {
        matches!(self.rolling, Some(Rolling::At(speed)) if speed < 0.0)
    }
}

/// A filter that runs, with the clocks and counters around it.
#[derive(Clone, Debug)]
pub struct Running {
    /// The filter.
    pub filter: Filter,
    /// Whether the yaw means anything.
    pub is_yaw_known: bool,
    /// Pseudoranges and the receiver clock.
    pub ranging: Ranging,
    since_ranges: f64,
    has_seen_course: bool,
    since_aid: f64,
    since_odometer: f64,
    gyro_sum: Vector3<f64>,
    gyro_samples: usize,
    acceleration: Vector3<f64>,
    position_refusals: usize,
    velocity_refusals: usize,
    standing_refusals: usize,
    watch: Watch,
}

impl Running {
    /// Begin from a start.
    pub fn new(start: Start) -> Self {
        Self {
            filter: start.filter,
            is_yaw_known: start.is_yaw_known,
            ranging: Ranging::default(),
            since_ranges: f64::INFINITY,
            has_seen_course: false,
            since_aid: 0.0,
            since_odometer: f64::INFINITY,
            gyro_sum: Vector3::zeros(),
            gyro_samples: 0,
            acceleration: Vector3::zeros(),
            position_refusals: 0,
            velocity_refusals: 0,
            standing_refusals: 0,
            watch: Watch::default(),
        }
    }

    /// Move on by `dt` s to `time`, then fold in what the other sensors said.
    ///
    /// # Errors
    /// When the state leaves its range.
    pub fn step(
        &mut self,
        time: f64,
        dt: f64,
        sample: &Sample,
        aids: &Aids,
        tuning: &Tuning,
        notices: &mut Notices,
    ) -> Result<Verdicts, EstimatorError> {
        self.predict(time, dt, sample, tuning, notices)?;
        self.filter.time = time;
        let mut verdicts = Verdicts::default();
        self.aid_by_motion(dt, aids.rolling, tuning, &mut verdicts);
        self.since_ranges += dt;
        if let Some((fix, _)) = &aids.fix {
            self.align_yaw(fix, aids, tuning);
            self.has_seen_course |= fix.velocity.is_some();
        }
        match (aids.ranges, &aids.fix) {
            (Some((satellites, age)), _) if tuning.params.coupling == Coupling::Tight => {
                self.aid_by_ranges(satellites, age, time, tuning, &mut verdicts, notices);
                self.since_ranges = 0.0;
            }
            (_, Some((fix, age))) if self.since_ranges > LONGEST_RANGE_WAIT => {
                self.aid_by_satellites(fix, *age, tuning, &mut verdicts);
            }
            _ => {}
        }
        self.watch.wait(dt);
        self.watch.look(&verdicts, tuning.params.max_reject);
        if !self.filter.is_sound() {
            notices.add("covariance lost its meaning and was set back to that of the start", time);
            self.filter.close_store();
            self.filter.covariance = self.fresh_covariance(tuning);
        }
        Ok(verdicts)
    }

    /// Whether the state is no car's, or so much speaks against it that opening the gate would not bring the filter back.
    pub fn is_lost(&self) -> bool {
        self.watch.is_lost() || self.filter.state.navigation.velocity.norm() > FASTEST_CAR
    }

    fn fresh_covariance(&self, tuning: &Tuning) -> Covariance {
        tuning.initial_covariance(tuning.params.moving_tilt_sigma, tuning.params.initial_yaw_sigma)
    }

    fn predict(
        &mut self,
        time: f64,
        dt: f64,
        sample: &Sample,
        tuning: &Tuning,
        notices: &mut Notices,
    ) -> Result<(), EstimatorError> {
        let before = self.filter.state.navigation.velocity;
        if dt <= LONGEST_STEP {
            self.filter.predict(&sample.accel, &sample.gyro, dt, sample.noise_factor, tuning)?;
        } else {
            notices.add("hole in the inertial data bridged with held values (at most 5 s)", time);
            let bridged = dt.min(LONGEST_BRIDGE);
            let steps = (bridged / SUBSTEP).ceil();
            for _ in 0..steps as usize {
                self.filter.predict(&sample.accel, &sample.gyro, bridged / steps, sample.noise_factor, tuning)?;
            }
            if dt > LONGEST_BRIDGE {
                notices.add("hole too long to bridge: velocity and attitude start afresh", time);
                self.filter.reset_motion(&self.fresh_covariance(tuning), dt, tuning);
                if self.has_seen_course {
                    self.is_yaw_known = false;
                    self.filter.forget(ATTITUDE + 2, UNKNOWN_YAW_SIGMA.powi(2));
                }
            }
        }
        self.acceleration = (self.filter.state.navigation.velocity - before) / dt;
        self.gyro_sum += sample.gyro;
        self.gyro_samples += 1;
        Ok(())
    }

    /// Every 0.1 s: a standing car has neither velocity nor rate; a rolling one has the odometer's speed and moves along its axis.
    fn aid_by_motion(&mut self, dt: f64, rolling: Option<Rolling>, tuning: &Tuning, verdicts: &mut Verdicts) {
        self.since_aid += dt;
        self.since_odometer = if rolling.is_some() { 0.0 } else { self.since_odometer + dt };
        let is_due = self.since_aid + 0.5 * dt >= AIDING_STEP;
        let waits_for_odometer = rolling.is_none() && self.since_odometer < LONGEST_ODOMETER_WAIT;
        if !is_due || waits_for_odometer {
            return;
        }
        self.filter.commit(tuning);
        let p = &tuning.params;
        let sigma = |speed: f64| p.odometer_sigma + p.odometer_speed_sigma * speed.abs();
        let speed = match rolling {
            Some(Rolling::At(speed)) => Some((speed, sigma(speed))),
            Some(Rolling::Standing) => Some((0.0, sigma(0.0))),
            Some(Rolling::Slower(speed)) => Some((0.0, sigma(speed).max(speed))),
            Some(Rolling::Leaving) | None => None,
        };
        if rolling == Some(Rolling::Standing) && (p.zupt || p.zaru) {
            self.aid_standing(tuning, verdicts);
        } else if self.is_yaw_known {
            self.aid_rolling(speed, tuning, verdicts);
        }
        self.since_aid = 0.0;
        self.gyro_sum = Vector3::zeros();
        self.gyro_samples = 0;
    }

    fn aid_standing(&mut self, tuning: &Tuning, verdicts: &mut Verdicts) {
        let p = &tuning.params;
        if p.zupt {
            self.settle(tuning);
            let prediction = measurement::zero_velocity(&self.filter.state.navigation);
            verdicts.zupt = self.filter.update(&prediction, &Vector3::repeat(p.zupt_sigma), tuning);
            self.filter.count_refusals(&mut self.standing_refusals, verdicts.zupt, STANDING_REFUSALS);
        }
        if p.zaru {
            self.settle(tuning);
            let mean = self.gyro_sum / self.gyro_samples as f64 - self.filter.state.gyro_bias;
            let prediction = measurement::zero_rate(&self.filter.state.navigation, &self.filter.earth(), &mean);
            verdicts.zaru = self.filter.update(&prediction, &Vector3::repeat(p.zaru_sigma), tuning);
        }
    }

    /// `speed`: of the odometer, with its sigma, m/s.
    fn aid_rolling(&mut self, speed: Option<(f64, f64)>, tuning: &Tuning, verdicts: &mut Verdicts) {
        let p = &tuning.params;
        let predict = |f: &Filter, v: f64| {
            let state = &f.state;
            measurement::body_velocity(&state.navigation, &tuning.odometer, &f.rate, v, state.odometer_scale)
        };
        if let Some((speed, sigma)) = speed.filter(|_| p.odometer) {
            let prediction = predict(&self.filter, speed).forward();
            verdicts.odometer = self.filter.update(&prediction, &vector![sigma], tuning);
        }
        if p.nhc {
            let prediction = predict(&self.filter, 0.0).sideways();
            verdicts.nhc = self.filter.update(&prediction, &vector![p.nhc_sigma, p.nhc_sigma], tuning);
        }
    }

    /// Position and velocity of a fix that is `age` seconds old: carried on to now with velocity and acceleration.
    fn aid_by_satellites(&mut self, fix: &Fix, age: f64, tuning: &Tuning, verdicts: &mut Verdicts) {
        if let Some(place) = fix.place {
            self.settle(tuning);
            let earth = self.filter.earth();
            let mut prediction = measurement::position(&self.filter.state.navigation, &earth, &tuning.antenna, &place);
            prediction.z -= self.filter.state.navigation.velocity * age;
            let sigma = fix.position_sigma;
            verdicts.position = if fix.has_height {
                self.filter.update(&prediction, &sigma, tuning)
            } else {
                self.filter.update(&prediction.horizontal(), &sigma.xy(), tuning)
            };
            let limit = self.watch.position_refusals(tuning.params.max_reject);
            self.filter.count_refusals(&mut self.position_refusals, verdicts.position, limit);
        }
        if let Some(velocity) = fix.velocity {
            self.settle(tuning);
            let navigation = &self.filter.state.navigation;
            let mut prediction = measurement::velocity(navigation, &tuning.antenna, &self.filter.rate, &velocity);
            prediction.z -= self.acceleration * age;
            verdicts.velocity = if fix.has_vertical_velocity {
                self.filter.update(&prediction, &fix.velocity_sigma, tuning)
            } else {
                self.filter.update(&prediction.horizontal(), &fix.velocity_sigma.xy(), tuning)
            };
            self.filter.count_refusals(&mut self.velocity_refusals, verdicts.velocity, tuning.params.max_reject);
        }
    }

    /// Pseudoranges and their rates, `age` seconds old.
    fn aid_by_ranges(
        &mut self,
        satellites: &[Satellite],
        age: f64,
        time: f64,
        tuning: &Tuning,
        verdicts: &mut Verdicts,
        notices: &mut Notices,
    ) {
        self.settle(tuning);
        let repeats = tuning.ranges_per_error(self.since_ranges);
        let lag = Lag { age, repeats, acceleration: self.acceleration };
        if self.ranging.aid(&mut self.filter, satellites, &lag, self.is_yaw_known, tuning, verdicts) {
            notices.add("the receiver clock jumped", time);
        }
    }

    /// One-shot: the first course of a moving car becomes the yaw (opposite to it if the odometer runs backward).
    fn align_yaw(&mut self, fix: &Fix, aids: &Aids, tuning: &Tuning) {
        let is_moving = fix.velocity.is_some_and(|v| v.x.hypot(v.y) > ALIGNING_SPEED);
        let is_slow = aids.rolling.is_some_and(|rolling| !matches!(rolling, Rolling::At(_)));
        if self.is_yaw_known || !is_moving || is_slow {
            return;
        }
        if let Some((course, sigma)) = fix.course() {
            self.filter.commit(tuning);
            self.filter.set_yaw(if aids.is_reversing() { course + std::f64::consts::PI } else { course }, sigma);
            self.is_yaw_known = true;
        }
    }

    /// Bring the covariance up to the state; a yaw that is not known stays out of the correction.
    fn settle(&mut self, tuning: &Tuning) {
        self.filter.commit(tuning);
        if !self.is_yaw_known {
            self.filter.isolate_yaw();
        }
    }
}
