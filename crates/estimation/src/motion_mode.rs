//! Motion mode of a car, stationary, straight or cornering, from an inertial sensor, helped by wheels or satellites.
//!
//! Source: Lee et al. 2010, equations (4) to (9) and tables 1 to 3. Four statistics over causal windows: jerk of the
//! specific force's magnitude (JD), rate about the horizontal axes (TD), step of the forward specific force (FD) and mean
//! yaw rate (YD).
//!
//! Departures: statistics are means, not sums, so that windows and rates can change without retuning; yaw rate has two
//! thresholds (with one, table 3 has no memory) and counts with both signs; rest also ends after sustained activity (the
//! paper leaves it by FD only and can miss a creeping launch for good); thresholds may follow the noise floor at rest; rest
//! needs full windows, so that a log that starts in motion or has a hole does not begin with a stop; turning wheels
//! contradict rest, and four that stand end motion before the windows have settled; so does a body that has settled but for
//! what the window of sway remembers; speed gained since the last rest, and a turn, contradict rest; without wheels,
//! satellite fixes that stay in their place tell rest whatever the engine shakes, and fixes that go on contradict it.
//! Not known: which way the car moves, and what moves it: without wheels and fixes, a parked car with a loud engine may look
//! like a moving one.

pub mod decisions;
mod detector;
mod disk;
mod fixes;
mod gain;
mod rules;
mod speed;
mod windows;

pub use detector::{Decision, Detector, InertialRow};
pub use rules::{MotionMode, Rule, Statistics, Thresholds, WheelState};

use drivescope_drive::drive::{Epoch, LogStart, Signal};
use drivescope_drive::vehicle::VehicleParams;
use drivescope_drive::{params, record};

use self::disk::DiskSource;
use self::speed::SpeedEvidence;
use crate::estimator::{Estimator, EstimatorError, Need, Notices};
use crate::gyro_free::{Front, GyroFreeParams};

params! {
    /// Windows, thresholds and rules of the motion mode.
    pub struct MotionModeParams {
        /// Window of jerk and tilt rate; longer is steadier and reports a stop later.
        activity_window ("n_s"): number = 1.0, "s", 0.1 ..= 3.0 Linear, from "spec/motion section 1; the paper gives none";
        /// Window of the forward force's step; longer finds slower launches.
        launch_window ("p_s"): number = 0.4, "s", 0.05 ..= 1.0 Linear, from "spec/motion section 1";
        /// Window of the yaw rate; longer is steadier and reports a corner later.
        yaw_window ("m_s"): number = 0.5, "s", 0.05 ..= 2.0 Linear, from "spec/motion section 1";
        /// Mean jerk per sample above which the car counts as shaken.
        jd_threshold ("jd_th"): number = 0.075, "m/s^2", 0.01 ..= 0.5 Log, from "spec/motion section 1, simulated 100 Hz";
        /// Mean roll and pitch rate above which the car counts as swaying.
        td_threshold ("td_th"): number = 0.008, "rad/s", 0.001 ..= 0.05 Log, from "spec/motion section 1";
        /// Mean step of the forward force above which rest ends.
        fd_threshold ("fd_th"): number = 0.16, "m/s^2", 0.02 ..= 1.0 Log, from "spec/motion section 1";
        /// Mean yaw rate above which a corner begins.
        yaw_on ("yd_on"): number = 0.05, "rad/s", 0.01 ..= 0.3 Linear, from "spec/motion section 1";
        /// Mean yaw rate at or below which a corner ends.
        yaw_off ("yd_off"): number = 0.035, "rad/s", 0.01 ..= 0.3 Linear, from "spec/motion section 1";
        /// Time of uninterrupted shaking and swaying after which rest ends; 0 is the paper's rule without it.
        escape_time ("escape_s"): number = 0.3, "s", 0.0 ..= 2.0 Linear, from "spec/motion section 1";
        /// Time at the beginning, at rest, over which gyro biases and noise floor are learned; 0 learns nothing.
        learning_time ("bias_s"): number = 3.0, "s", 0.0 ..= 10.0 Linear, from "spec/motion section 1";
        /// Whether the three activity thresholds follow the noise floor at rest; the fixed ones then hold until it is known. Off,
        /// the rules are the specification's alone: a settled body, speed gained and a turn then say nothing about rest.
        adaptive (""): toggle = true, from "spec/motion section 1, recommended there";
        /// Adaptive thresholds of jerk and tilt rate, as multiples of the noise floor.
        threshold_factor ("ad_k"): number = 1.5, "1", 1.1 ..= 3.0 Linear, from "spec/motion section 1";
        /// Adaptive threshold of the forward force's step, as a multiple of its floor.
        launch_threshold_factor ("ad_kfd"): number = 4.0, "1", 1.5 ..= 8.0 Linear, from "spec/motion section 1";
        /// Time in which the noise floor follows the statistics at rest.
        floor_time ("ad_tau"): number = 20.0, "s", 2.0 ..= 120.0 Log, from "spec/motion section 1";
        /// Whether rest is also told by a body that has settled: force and jerk quiet for another launch window, and hardly any
        /// sway in the later half of its window. Only while thresholds are adaptive.
        settling (""): toggle = true, from "after a stop a body rocks on its springs, and the window of sway remembers it";
        /// Speed gained since a rest, by the forward force, above which the car does not stand once it has been so for the escape
        /// time; 0 leaves it out. Only while thresholds are adaptive.
        launch_speed (""): number = 0.25, "m/s", 0.0 ..= 5.0 Linear, from "as of four wheels; five times what noise reaches at rest";
        /// Whether turning wheels contradict rest and four standing ones end motion; in a log without wheel speeds, whether
        /// satellites (1 m/s) contradict rest and, while thresholds are adaptive, fixes that stay in their place tell it.
        use_speed (""): toggle = true, from "a smooth road at constant speed looks like rest to an inertial sensor";
    }
}

record! {
    /// The motion mode and everything it was decided from.
    pub struct MotionModeEstimate {
        /// Mean absolute step of the specific force's magnitude from sample to sample.
        jd: "m/s^2";
        /// Mean rate about the horizontal axes.
        td: "rad/s";
        /// Mean distance of the forward specific force from its value a launch window ago.
        fd: "m/s^2";
        /// Mean yaw rate, to the right positive.
        yd: "rad/s";
        /// Dynamics indicator: 1 quiet, 2 shaken or swaying, 3 both.
        indicator: "1";
        /// Motion mode: 0 stationary, 1 straight, 2 cornering.
        mode: "1", truth "mode";
        /// Rule that fired: 0 none, 1 launch by force, 2 launch by activity, 3 stop, 4 corner begins, 5 corner ends,
        /// 6 wheels turn, 7 held while learning, 8 held until the windows are full, 9 wheels stand, 10 settled, 11 speed
        /// gained, 12 the car turns, 13 the fixes stay.
        rule: "1";
        /// Threshold of `jd`.
        jd_threshold: "m/s^2";
        /// Threshold of `td`.
        td_threshold: "rad/s";
        /// Threshold of `fd`.
        fd_threshold: "m/s^2";
        /// Threshold of the magnitude of `yd`: what begins a corner, or ends the one that is driven.
        yd_threshold: "rad/s";
        /// Learned bias of the roll gyro.
        gyro_bias_x: "rad/s", truth "gyro_bias_x";
        /// Learned bias of the pitch gyro.
        gyro_bias_y: "rad/s", truth "gyro_bias_y";
        /// Learned bias of the yaw gyro.
        gyro_bias_z: "rad/s", truth "gyro_bias_z";
    }
}

/// Step of the log above which the windows are cleared, s.
const LARGEST_STEP: f64 = 0.5;

/// Step assumed where the log has too few rows to tell, s.
const USUAL_STEP: f64 = 0.01;

const NOT_AT_REST: &str =
    "The log does not start at rest: gyro biases and noise floor are not learned, thresholds are fixed.";
const BAD_ROW: &str = "An inertial row without usable numbers: the row before it was used.";
const NO_FORCE: &str = "An inertial row with a specific force of zero was skipped.";
const NO_LAYOUT: &str =
    "The disk's six accelerometers do not tell force and angular acceleration apart: no row can be read.";
const NOT_LATER: &str = "An inertial row not later than the one before it was skipped.";
const HOLE: &str = "A hole of more than 0.5 s in the inertial rows: the windows start again, the mode stays.";

/// Motion mode over a log: the [`Detector`], with the log's clock, its bad rows and what tells its speed.
#[derive(Clone, Debug)]
pub struct MotionModeDetector {
    detector: Detector,
    disk: Option<DiskSource>,
    time: f64,
    good: InertialRow,
    speed: SpeedEvidence,
    starts_moving: bool,
    notices: Notices,
}

impl Estimator for MotionModeDetector {
    const NAME: &'static str = "motion_mode";
    const TITLE: &'static str = "Motion mode";
    const DOC: &'static str = "Whether the car stands, drives straight on or turns, from accelerometers and gyros by the \
        rules of Lee et al. 2010, with hysteresis, an escape from rest and thresholds that follow the noise floor.";
    const NEEDS: &'static [Need] = &[
        Need {
            signal: Signal::SixAxes,
            required: true,
            why: "a step of the forward force ends rest, jerk and sway tell motion from rest, the yaw rate tells corners",
        },
        Need {
            signal: Signal::ForwardSpeed,
            required: false,
            why: "turning wheels contradict rest, and tell whether the log starts at rest",
        },
        Need {
            signal: Signal::GnssPosition,
            required: false,
            why: "without wheels, fixes that stay tell a car at rest whose engine shakes it from one that rolls",
        },
    ];
    const VEHICLE: &'static str = "saloon";
    type Params = MotionModeParams;
    type Estimate = MotionModeEstimate;

    fn new(params: &MotionModeParams, _vehicle: &VehicleParams, start: &LogStart) -> Self {
        Self::with_disk(params, &GyroFreeParams::default(), start)
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<MotionModeEstimate>, EstimatorError> {
        self.speed.read(epoch);
        if self.disk.is_some() && self.is_disk_log(epoch) {
            return Ok(self.step_disk(epoch));
        }
        let Some(imu) = epoch.imu else { return Ok(None) };
        let row =
            InertialRow { force: [imu.accel_x, imu.accel_y, imu.accel_z], rate: [imu.gyro_x, imu.gyro_y, imu.gyro_z] };
        if !self.is_later(epoch.time) {
            return Ok(None);
        }
        if row.force == [0.0; 3] {
            self.notices.add(NO_FORCE, epoch.time);
            return Ok(None);
        }
        if epoch.time - self.time > LARGEST_STEP {
            self.after_hole(epoch.time);
        }
        let is_good = row.is_plausible();
        if is_good {
            self.good = row;
        }
        Ok(Some(self.decide(epoch.time, is_good)))
    }

    fn notices(&self) -> &Notices {
        &self.notices
    }
}

impl MotionModeDetector {
    /// A detector whose disk, in a log that has one in place of accelerometers and gyros, is filtered with these parameters.
    pub fn with_disk(params: &MotionModeParams, disk: &GyroFreeParams, start: &LogStart) -> Self {
        let step = if start.imu_step > 0.0 { start.imu_step } else { USUAL_STEP };
        let starts_moving = start.speed.abs() > speed::CLEARLY_MOVING;
        Self {
            detector: Detector::new(params, step, starts_moving),
            disk: Some(DiskSource::new(Front::new(start.disk.as_ref(), disk), step)),
            time: f64::NEG_INFINITY,
            good: InertialRow::AT_REST,
            speed: SpeedEvidence::new(params),
            starts_moving,
            notices: Notices::default(),
        }
    }

    /// The same for a log whose specific force and rates are to come from the disk even where there are accelerometers too.
    pub fn disk_only(mut self) -> Self {
        if let Some(disk) = &mut self.disk {
            disk.activate();
        }
        self
    }

    /// What a navigator integrates at the last row: specific force and rates, from the disk's filter where there is one.
    pub fn inertial_row(&self) -> InertialRow {
        match self.front() {
            Some(front) => front.inertial_row(),
            None => self.good,
        }
    }

    /// What the mode was decided from at the last row.
    pub fn mode_row(&self) -> InertialRow {
        self.good
    }

    /// The disk's front, in a log that has a disk in place of accelerometers and gyros.
    pub fn front(&self) -> Option<&Front> {
        self.disk.as_ref().and_then(DiskSource::active)
    }

    /// The mode now.
    pub fn mode(&self) -> MotionMode {
        self.detector.mode()
    }

    fn is_later(&mut self, time: f64) -> bool {
        let is_later = time > self.time && time < f64::INFINITY;
        if !is_later {
            self.notices.add(NOT_LATER, self.time);
        }
        is_later
    }

    /// Decide a row from `self.good`; `is_good` is false where that stands in for one that could not be read.
    fn decide(&mut self, time: f64, is_good: bool) -> MotionModeEstimate {
        self.time = time;
        if !is_good {
            self.notices.add(BAD_ROW, time);
        }
        let wheels = self.speed.state(time);
        if wheels == WheelState::Turn && self.detector.refuse_learning() {
            self.notices.add(NOT_AT_REST, time);
        }
        let (decision, refused) = self.detector.push(&self.good, is_good, wheels);
        if refused {
            self.notices.add(NOT_AT_REST, time);
        }
        estimate(&decision, self.detector.bias())
    }

    /// The first row, or one after a hole in the log.
    fn after_hole(&mut self, time: f64) {
        if self.time.is_finite() {
            self.notices.add(HOLE, time);
            self.detector.clear_windows();
        } else if self.starts_moving {
            self.notices.add(NOT_AT_REST, time);
        }
    }
}

fn estimate(decision: &Decision, bias: [f64; 3]) -> MotionModeEstimate {
    MotionModeEstimate {
        jd: decision.statistics.jerk,
        td: decision.statistics.tilt_rate,
        fd: decision.statistics.force_step,
        yd: decision.statistics.yaw_rate,
        indicator: f64::from(decision.indicator),
        mode: decision.mode.code(),
        rule: decision.rule.code(),
        jd_threshold: decision.thresholds.jerk,
        td_threshold: decision.thresholds.tilt_rate,
        fd_threshold: decision.thresholds.force_step,
        yd_threshold: decision.yaw_threshold,
        gyro_bias_x: bias[0],
        gyro_bias_y: bias[1],
        gyro_bias_z: bias[2],
    }
}

#[cfg(test)]
mod tests;
