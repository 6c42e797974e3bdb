//! Position, velocity and attitude from inertial sensors and satellites, loosely or tightly coupled, aided by the car's own
//! motion, smoothed if wanted.
//!
//! States: the nine errors of [`crate::ins`] and six residual sensor biases, fed back to the nominal state after each update;
//! with tight coupling offset and drift of the receiver clock; the odometer's scale if wanted.
//! Inputs: specific force and rates; satellite position and velocity (or speed and course), or pseudoranges; odometer.
//! Source: Yun & Yu 2007, equations (15) to (19), corrected; SPEC navigation 1 to 4, 7 and 11. Departures are named where they are
//! made: [`covariance`] (nodes), [`alignment`] (start from a log as it comes), [`running`] (unknown yaw).
//! A log with ranges and without fixes is navigated all the same: a fix is computed of them, without satellites that disagree.
//! Sensors with their own clock: an odometer sample or a fix is used at the next inertial sample, the fix carried on to it
//! with velocity and acceleration; one older than two inertial steps (at least 0.1 s) is dropped and counted.
//! While the car stands and is levelled, rows show the state that the filter would start from.
//! Not modelled: errors of the mounting of the inertial sensor; correlated satellite errors.

pub mod alignment;
pub mod covariance;
mod estimate;
pub mod filter;
mod fix;
pub mod inertial;
mod known_start;
pub mod measurement;
mod pair;
pub mod ranging;
pub mod running;
pub mod smoother;
pub mod standing;
pub mod state;
pub mod store;
mod tuning;
pub mod watch;

#[cfg(test)]
mod case_tests;
#[cfg(test)]
mod consistency_tests;
#[cfg(test)]
mod honesty_tests;

use drivescope_drive::channel::Channel;
use drivescope_drive::drive::{Drive, Epoch, LogStart, Signal};
use drivescope_drive::geodesy::LocalFrame;
use drivescope_drive::satellites::Satellite;
use drivescope_drive::vehicle::VehicleParams;

use self::alignment::{Alignment, Start};
pub use self::estimate::GnssInsEstimate;
use self::estimate::{Sigmas, Verdicts};
pub use self::fix::{Fix, NOMINAL_ORIGIN};
use self::inertial::{Hold, Sample};
pub use self::known_start::KnownStart;
use self::pair::Pair;
use self::running::{Aids, Running};
use self::smoother::Pass;
use self::standing::{Rolling, Standing};
use self::store::Store;
pub use self::tuning::{Coupling, GnssInsParams, Gravity, Smoother, Tuning};
use crate::estimator::{Estimator, EstimatorError, Need, Notices};
use crate::gnss::first_frame;
use crate::gnss::integrity::Integrity;
use crate::ins::GravityModel;

/// Shortest window at rest that a start is taken from when the car drives off, s.
const SHORTEST_ALIGNMENT: f64 = 0.5;
/// Age from which the odometer or the satellites no longer say whether the car stands, s.
const STALE: f64 = 2.0;

/// What the estimator does at the moment.
#[derive(Clone, Debug)]
enum Phase {
    Aligning(Box<Alignment>),
    Running(Box<Running>),
}

/// The estimator: see the [module](self).
#[derive(Clone, Debug)]
pub struct GnssIns {
    tuning: Tuning,
    frame: Option<LocalFrame>,
    gravity: Option<GravityModel>,
    phase: Phase,
    hold: Hold,
    last_time: Option<f64>,
    oldest_aid: f64,
    speed_time: Option<f64>,
    standing: Standing,
    ground_speed: Option<(f64, f64)>,
    fix: Option<(f64, Fix)>,
    pair: Pair,
    raw_only: Option<Box<Integrity>>,
    ranges: Vec<Satellite>,
    ranges_time: Option<f64>,
    store: Option<Box<Store>>,
    pass: Option<Box<Pass>>,
    row: GnssInsEstimate,
    revision: Option<u64>,
    notices: Notices,
}

impl Estimator for GnssIns {
    const NAME: &'static str = "gnss_ins";
    const TITLE: &'static str = "Trajectory and attitude";
    const DOC: &'static str = "Position, velocity, attitude and sensor biases from inertial sensors and satellites, with odometer, \
        non-holonomic and standstill aiding; bridges satellite outages. After Yun & Yu 2007, corrected.";
    const NEEDS: &'static [Need] = NEEDS;
    const VEHICLE: &'static str = "saloon";
    type Params = GnssInsParams;
    type Estimate = GnssInsEstimate;

    fn new(params: &GnssInsParams, _vehicle: &VehicleParams, start: &LogStart) -> Self {
        let gravity = match params.gravity {
            Gravity::Auto => None,
            Gravity::Wgs84 => Some(GravityModel::Wgs84),
            Gravity::Constant => Some(GravityModel::Constant),
        };
        let step = if start.imu_step.is_finite() { start.imu_step } else { 0.0 };
        Self {
            tuning: Tuning::new(params, start.rear_axle),
            frame: start.origin.map(LocalFrame::new),
            gravity,
            phase: Phase::Aligning(Box::default()),
            hold: Hold::default(),
            last_time: None,
            oldest_aid: (2.0 * step).max(0.1),
            speed_time: None,
            standing: Standing::default(),
            ground_speed: None,
            fix: None,
            pair: Pair::default(),
            raw_only: None,
            ranges: Vec::new(),
            ranges_time: None,
            store: (params.smoother == Smoother::Rts).then(Box::default),
            pass: None,
            row: GnssInsEstimate::default(),
            revision: None,
            notices: Notices::default(),
        }
    }

    fn look_ahead(&mut self, drive: &Drive) {
        let speeds = drive.wheels.iter().map(|(_, wheels)| wheels.forward_speed());
        speeds.filter(|speed| speed.is_finite()).for_each(|speed| self.standing.learn(speed));
        if !drive.has(Signal::GnssPosition) {
            let p = &self.tuning.params;
            self.raw_only = Some(Box::new(Integrity::new(p.gate_probability, p.gate, p.range_sigma)));
        }
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<GnssInsEstimate>, EstimatorError> {
        if !epoch.time.is_finite() {
            self.notices.add("epoch without a time skipped", self.last_time.unwrap_or(0.0));
            return Ok(None);
        }
        self.receive(epoch);
        let Some(sample) = epoch.imu.and_then(|imu| self.hold.complete(epoch.time, &imu)) else { return Ok(None) };
        if let Some(flaw) = sample.flaw {
            self.notices.add(flaw, epoch.time);
        }
        let dt = epoch.time - self.last_time.unwrap_or(epoch.time);
        if self.last_time.is_some() && dt <= 0.0 {
            self.notices.add("inertial sample that is not later than the one before skipped", epoch.time);
            return Ok(None);
        }
        self.standing.sample(&sample.accel, dt, self.tuning.params.accel_noise);
        let ranges = std::mem::take(&mut self.ranges);
        let aids = self.take_aids(epoch.time, dt, &ranges);
        let is_running = match self.phase {
            Phase::Aligning(_) => {
                self.pair.turn(sample.gyro.z * dt);
                self.align(epoch.time, &sample, &aids)
            }
            Phase::Running(_) => true,
        };
        let verdicts = match &mut self.phase {
            Phase::Running(running) if is_running => {
                running.step(epoch.time, dt, &sample, &aids, &self.tuning, &mut self.notices)?
            }
            _ => Verdicts::default(),
        };
        if matches!(&self.phase, Phase::Running(running) if running.is_lost()) {
            self.notices.add("the filter had lost its way and was started again", epoch.time);
            self.store = self.take_store();
            self.phase = Phase::Aligning(Box::default());
            self.revision = None;
        }
        self.ranges = ranges;
        self.last_time = Some(epoch.time);
        Ok(self.estimate(&verdicts))
    }

    fn look_back(&mut self, rows: &mut Channel<GnssInsEstimate>, steps: usize) -> f64 {
        if self.pass.is_none()
            && let (Some(store), Some(frame)) = (self.take_store(), self.frame)
        {
            let gravity = self.gravity.unwrap_or(GravityModel::Wgs84);
            self.pass = Pass::new(store, gravity, frame, rows.len()).map(Box::new);
        }
        let Some(pass) = &mut self.pass else { return 1.0 };
        // A node costs what ten steps of the filter cost.
        let is_done = pass.advance(rows, steps.div_ceil(10), &self.tuning);
        let fraction = if is_done { 1.0 } else { pass.fraction() };
        self.pass.take_if(|_| is_done);
        fraction
    }

    fn look_back_share(&self) -> f64 {
        if self.tuning.params.smoother == Smoother::Rts { 0.5 } else { 0.0 }
    }

    fn notices(&self) -> &Notices {
        &self.notices
    }
}

const NEEDS: &[Need] = &[
    Need { signal: Signal::AccelX, required: true, why: "the velocity is integrated from all three accelerations" },
    Need { signal: Signal::AccelY, required: true, why: "the velocity is integrated from all three accelerations" },
    Need { signal: Signal::AccelZ, required: true, why: "the velocity is integrated from all three accelerations" },
    Need { signal: Signal::GyroX, required: true, why: "the attitude is integrated from all three rates" },
    Need { signal: Signal::GyroY, required: true, why: "the attitude is integrated from all three rates" },
    Need { signal: Signal::GyroZ, required: true, why: "the attitude is integrated from all three rates" },
    Need {
        signal: Signal::SatellitePlace,
        required: true,
        why: "the trajectory starts at a satellite position and is held to them",
    },
    Need {
        signal: Signal::GnssVelocity,
        required: false,
        why: "its course gives the heading when the car moves; without it, places a second apart do so roughly",
    },
    Need {
        signal: Signal::GnssVerticalVelocity,
        required: false,
        why: "holds the height and the pitch; without it they rest on satellite heights and on the non-holonomic constraint",
    },
    Need {
        signal: Signal::ForwardSpeed,
        required: false,
        why: "bridges satellite outages and tells when the car stands; without it an outage drifts within seconds",
    },
    Need {
        signal: Signal::RawGnss,
        required: false,
        why: "for `coupling` = tight: single satellites help where there are too few for a fix, and a reflected one is refused alone",
    },
];

impl GnssIns {
    /// Keep what an epoch says besides the inertial sample.
    fn receive(&mut self, epoch: &Epoch) {
        if let Some(speed) = epoch.wheels.map(|w| w.forward_speed()).filter(|v| v.is_finite()) {
            self.speed_time = Some(epoch.time);
            self.standing.odometer(speed);
        }
        if let Some(ranges) = epoch.raw_gnss.filter(|_| self.tuning.params.coupling == Coupling::Tight) {
            self.ranges.clear();
            self.ranges.extend_from_slice(ranges);
            self.ranges_time = Some(epoch.time);
        }
        if let (Some(satellites), Some(integrity)) = (epoch.raw_gnss, &self.raw_only) {
            let Some(frame) = self.frame.or_else(|| first_frame(satellites)) else { return };
            self.row.satellites = satellites.len() as f64;
            let fix = Fix::of_ranges(&frame, satellites, integrity, &self.tuning.params);
            return fix.into_iter().for_each(|fix| self.keep(epoch.time, fix));
        }
        let Some(gnss) = epoch.gnss else { return };
        let keep = |old: &mut f64, new: f64| *old = if new.is_finite() { new } else { *old };
        keep(&mut self.row.satellites, gnss.satellites);
        keep(&mut self.row.pdop, gnss.pdop);
        let origin = self.frame.map_or(NOMINAL_ORIGIN, |frame| frame.origin);
        let Some(fix) = Fix::read(&gnss, origin, &self.tuning.params) else { return };
        self.keep(epoch.time, fix);
    }

    fn keep(&mut self, time: f64, fix: Fix) {
        let is_aligning = matches!(self.phase, Phase::Aligning(_));
        let fix = is_aligning.then(|| self.pair.complete(time, &fix)).flatten().unwrap_or(fix);
        if fix.ground_speed.is_finite() {
            self.ground_speed = Some((time, fix.ground_speed));
        }
        if let Some(place) = fix.place {
            self.gravity.get_or_insert(if fix.is_local { GravityModel::Constant } else { GravityModel::Wgs84 });
            let origin = if fix.is_local { NOMINAL_ORIGIN } else { place };
            self.frame.get_or_insert_with(|| LocalFrame::new(origin));
        }
        self.fix = Some((time, fix));
    }

    /// What is young enough to be used at an inertial sample at `time`, `dt` s after the one before.
    fn take_aids<'a>(&mut self, time: f64, dt: f64, ranges: &'a [Satellite]) -> Aids<'a> {
        let rolling = self.speed_time.filter(|at| time - at < dt.max(1e-9)).map(|_| self.standing.rolling());
        let fix = self.fix.take().map(|(at, fix)| (fix, time - at));
        let oldest = self.oldest_aid;
        if fix.is_some_and(|(_, age)| age > oldest) {
            self.notices.add("satellite fix inside a hole of the inertial data dropped", time);
        }
        let ranges = self.ranges_time.take().map(|at| (ranges, time - at)).filter(|(_, age)| *age <= oldest);
        Aids { rolling, fix: fix.filter(|(_, age)| *age <= oldest), ranges }
    }

    /// Whether the car stands: by odometer, else by satellites; `None` if neither says.
    fn stands(&self, time: f64) -> Option<bool> {
        if self.speed_time.is_some_and(|at| time - at < STALE) {
            return Some(matches!(self.standing.rolling(), Rolling::Standing | Rolling::Slower(_)));
        }
        // Ten sigma of a satellite velocity would be 1 m/s; a creeping car is not levelled on.
        self.ground_speed.filter(|(at, _)| time - at < STALE).map(|(_, speed)| speed < 0.5)
    }

    /// Use a sample for alignment. Returns whether the filter began before it, so that it has to be stepped.
    fn align(&mut self, time: f64, sample: &Sample, aids: &Aids) -> bool {
        let stands = self.stands(time);
        let Phase::Aligning(alignment) = &mut self.phase else { return true };
        let gravity = self.gravity.unwrap_or(GravityModel::Wgs84);
        let is_quiet = self.speed_time.is_some() || alignment.is_quiet(&sample.accel, &sample.gyro);
        if stands.unwrap_or(true) && is_quiet {
            alignment.rest(time, sample.accel, sample.gyro, stands.is_some());
            if alignment.duration(time) + 1e-9 >= self.tuning.params.align_time
                && let Some(start) = alignment.start(&self.tuning, gravity)
            {
                self.begin(start, time);
                return false;
            }
            if let Some((fix, _)) = &aids.fix
                && let Some(place) = fix.place
            {
                alignment.fix(place);
            }
            return false;
        }
        let is_long = alignment.duration(time) >= SHORTEST_ALIGNMENT;
        if let Some(start) = alignment.start(&self.tuning, gravity).filter(|_| is_long) {
            self.begin(start, self.last_time.unwrap_or(time));
            return true;
        }
        alignment.reset();
        let is_reversing = aids.is_reversing();
        let start = aids.fix.and_then(|(fix, _)| alignment::moving_start(&fix, is_reversing, &self.tuning, gravity));
        if let Some(start) = start {
            self.notices
                .add("the log starts in motion: attitude starts level, heading along the satellite course", time);
            self.begin(start, time);
        }
        false
    }

    fn begin(&mut self, mut start: Start, time: f64) {
        start.filter.time = time;
        if let Some(mut store) = self.store.take() {
            store.set_states(self.tuning.states());
            start.filter.store = Some(store);
        }
        self.phase = Phase::Running(Box::new(Running::new(start)));
        self.revision = None;
    }

    /// What the smoother needs of everything so far.
    fn take_store(&mut self) -> Option<Box<Store>> {
        if let Phase::Running(running) = &mut self.phase {
            running.filter.commit(&self.tuning);
            running.filter.close_store();
            return running.filter.store.take();
        }
        self.store.take()
    }

    /// The row of this epoch; `None` before anything is known.
    fn estimate(&mut self, verdicts: &Verdicts) -> Option<GnssInsEstimate> {
        let frame = self.frame?;
        let gravity = self.gravity.unwrap_or(GravityModel::Wgs84);
        let levelled;
        let (filter, is_yaw_known) = match &self.phase {
            Phase::Running(running) => (&running.filter, running.is_yaw_known),
            Phase::Aligning(alignment) => {
                levelled = alignment.start(&self.tuning, gravity)?;
                (&levelled.filter, levelled.is_yaw_known)
            }
        };
        if self.revision != Some(filter.revision()) {
            Sigmas::new(&filter.state, &filter.covariance).write(&mut self.row);
            self.revision = Some(filter.revision());
        }
        estimate::write_state(&filter.state, &frame, &mut self.row);
        verdicts.write(&mut self.row);
        let is_clock_known = match &self.phase {
            Phase::Running(running) => {
                if verdicts.range.count > 0 {
                    self.row.satellites = verdicts.range.accepted as f64;
                    self.row.pdop = running.ranging.pdop;
                }
                running.ranging.is_clock_known
            }
            Phase::Aligning(_) => false,
        };
        let mut row = self.row;
        if !is_clock_known {
            estimate::blank_clock(&mut row);
        }
        if !is_yaw_known {
            estimate::blank_yaw(&mut row);
        }
        Some(row)
    }

    /// Begin with a given state instead of aligning: for loops and replays that start from a known one.
    fn begin_at(&mut self, time: f64, navigation: crate::ins::Navigation) {
        let p = &self.tuning.params;
        let covariance = self.tuning.initial_covariance(p.initial_tilt_sigma, p.initial_yaw_sigma);
        let filter = filter::Filter::new(navigation, nalgebra::Vector3::zeros(), covariance, GravityModel::Wgs84);
        self.begin(Start { filter, is_yaw_known: true }, time);
        self.last_time = Some(time);
    }

    /// The running filter, if it runs.
    #[cfg(test)]
    fn filter(&self) -> Option<&filter::Filter> {
        match &self.phase {
            Phase::Running(running) => Some(&running.filter),
            Phase::Aligning(_) => None,
        }
    }
}
