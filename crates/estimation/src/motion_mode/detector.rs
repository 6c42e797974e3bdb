//! The detector without clock and log: rows of specific force and rate in, decisions out.

use drivescope_drive::geodesy::STANDARD_GRAVITY;

use super::MotionModeParams;
use super::gain::SpeedGain;
use super::rules::{MotionMode, Row, Rule, Rules, Settings, Statistics, Thresholds, WheelState};
use super::windows::{Lag, RunningSum};

/// The longest window, rows: what a damaged clock or a rate above 10 kHz may ask of memory and time.
const LONGEST_WINDOW: f64 = 10_000.0;

/// Smallest adaptive thresholds: what a very quiet sensor would otherwise push below its own quantization.
const SMALLEST: Thresholds = Thresholds { jerk: 0.03, tilt_rate: 0.003, force_step: 0.15 };

/// Rate (rad/s) and standard deviation of the force's magnitude (m/s^2) above which the log does not start at rest.
const RATE_AT_REST: f64 = 0.1;
const FORCE_SPREAD_AT_REST: f64 = 0.5;

/// Time for which a body may rock after a stop that the wheels told, s.
const SETTLING: f64 = 1.0;

/// How far the sway of a settled body may still lie above its threshold: what is left of rocking, and a noisy sensor.
const NEARLY_STILL: f64 = 1.5;

/// How far above the fixed thresholds an engine may shake a car whose fixes stay.
const BEARABLE: f64 = 4.0;

/// Times after a launch for which fixes that stay do not take it back, s: where the force has gained no speed since, and where
/// that is not known.
const DOUBT: [f64; 2] = [1.0, 3.0];

/// Time after which the spread of the force is believed, s.
const SPREAD_TIME: f64 = 0.5;

/// One inertial row: specific force (m/s^2) and rate (rad/s) in body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialRow {
    /// Specific force.
    pub force: [f64; 3],
    /// Rate.
    pub rate: [f64; 3],
}

impl InertialRow {
    /// A level sensor at rest.
    pub const AT_REST: Self = Self { force: [0.0, 0.0, -STANDARD_GRAVITY], rate: [0.0; 3] };

    /// Whether every component is a number that a car's sensor can mean.
    pub fn is_plausible(&self) -> bool {
        // NaN and infinity fail the comparison.
        self.force.iter().all(|v| v.abs() < 1e4) && self.rate.iter().all(|v| v.abs() < 1e3)
    }
}

/// What the detector said of one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// The statistics.
    pub statistics: Statistics,
    /// Dynamics indicator, 1 to 3.
    pub indicator: u8,
    /// Thresholds after the row.
    pub thresholds: Thresholds,
    /// What the magnitude of the yaw rate was compared with, rad/s.
    pub yaw_threshold: f64,
    /// The mode.
    pub mode: MotionMode,
    /// The rule that decided it.
    pub rule: Rule,
}

/// Running sums over the rows at the beginning of the log, from which gyro bias and noise floor are learned.
#[derive(Clone, Debug)]
struct Learning {
    /// Rows to learn from.
    needed: usize,
    count: usize,
    rate_sum: [f64; 3],
    force_mean: f64,
    force_squares: f64,
    /// Horizontal rates of the rows in the window, kept raw because the bias changes with every row.
    raw: Vec<[f64; 2]>,
}

/// Motion mode from rows of specific force and rate at equal steps.
#[derive(Clone, Debug)]
pub struct Detector {
    step: f64,
    window: usize,
    jerk: RunningSum,
    tilt_rate: RunningSum,
    /// The later half of the same window.
    recent_tilt_rate: RunningSum,
    yaw_rate: RunningSum,
    forward_force: Lag,
    previous_magnitude: Option<f64>,
    learning: Option<Learning>,
    bias: [f64; 3],
    adaptive: Option<Adaptive>,
    thresholds: Thresholds,
    rules: Rules,
    gain: SpeedGain,
    /// Rows for which force and jerk have been quiet, and how many of them show that the body has settled.
    quiet_rows: usize,
    settled_rows: usize,
    /// Mean yaw rate above which the car does not stand, rad/s; infinite where the gyro's bias is not known.
    turning: f64,
    /// The most that a standing car may be shaken.
    bearable: Thresholds,
}

#[derive(Clone, Copy, Debug)]
struct Adaptive {
    factor: f64,
    launch_factor: f64,
    share: f64,
    floor: Option<Statistics>,
}

impl Detector {
    /// A detector for rows `step` seconds apart. `starts_moving` starts in [`MotionMode::Straight`] and learns nothing.
    pub fn new(params: &MotionModeParams, step: f64, starts_moving: bool) -> Self {
        let rows = |seconds: f64| (seconds / step).round_ties_even().clamp(0.0, LONGEST_WINDOW) as usize;
        let window = rows(params.activity_window).max(1);
        let needed = rows(params.learning_time);
        let settings = Settings {
            yaw_on: params.yaw_on,
            yaw_off: params.yaw_off,
            // A tie between the escape time and a whole number of steps belongs to that number.
            settling_rows: rows(SETTLING),
            doubt_rows: DOUBT.map(rows),
            escape_rows: (params.escape_time / step - 1e-6).ceil().clamp(0.0, LONGEST_WINDOW) as usize,
        };
        let thresholds =
            Thresholds { jerk: params.jd_threshold, tilt_rate: params.td_threshold, force_step: params.fd_threshold };
        let learning = (needed > 0 && !starts_moving).then(|| Learning {
            needed,
            count: 0,
            rate_sum: [0.0; 3],
            force_mean: 0.0,
            force_squares: 0.0,
            raw: Vec::with_capacity(needed),
        });
        Self {
            step,
            window,
            jerk: RunningSum::new(window),
            tilt_rate: RunningSum::new(window),
            recent_tilt_rate: RunningSum::new(window.div_ceil(2)),
            yaw_rate: RunningSum::new(rows(params.yaw_window)),
            forward_force: Lag::new(rows(params.launch_window).max(1) + 1),
            gain: SpeedGain::new(step, if params.adaptive { params.launch_speed } else { 0.0 }, settings.escape_rows),
            quiet_rows: 0,
            settled_rows: if params.adaptive && params.settling {
                rows(params.launch_window).max(1)
            } else {
                usize::MAX
            },
            turning: if params.adaptive && learning.is_some() { params.yaw_on } else { f64::INFINITY },
            previous_magnitude: None,
            bias: [0.0; 3],
            adaptive: (params.adaptive && learning.is_some()).then_some(Adaptive {
                factor: params.threshold_factor,
                launch_factor: params.launch_threshold_factor,
                share: (step / params.floor_time).min(1.0),
                floor: None,
            }),
            learning,
            thresholds,
            bearable: Thresholds {
                jerk: BEARABLE * thresholds.jerk,
                tilt_rate: BEARABLE * thresholds.tilt_rate,
                force_step: BEARABLE * thresholds.force_step,
            },
            rules: Rules::new(settings, if starts_moving { MotionMode::Straight } else { MotionMode::Stationary }),
        }
    }

    /// Gyro biases learned so far, rad/s.
    pub fn bias(&self) -> [f64; 3] {
        self.bias
    }

    /// The mode after the last row.
    pub fn mode(&self) -> MotionMode {
        self.rules.mode
    }

    /// Forget the windows, after a hole in the log; the mode, the biases and the noise floor stay.
    pub fn clear_windows(&mut self) {
        self.jerk.clear();
        self.tilt_rate.clear();
        self.recent_tilt_rate.clear();
        self.yaw_rate.clear();
        self.forward_force.clear();
        self.gain.clear();
        self.quiet_rows = 0;
        self.previous_magnitude = None;
        if let Some(learning) = &mut self.learning {
            learning.raw.clear();
        }
    }

    /// Stop learning because the log does not start at rest: no bias, fixed thresholds, no hold. `false` if nothing was
    /// being learned.
    pub fn refuse_learning(&mut self) -> bool {
        let Some(learning) = self.learning.take() else { return false };
        self.bias = [0.0; 3];
        self.adaptive = None;
        self.turning = f64::INFINITY;
        self.recompute_tilt_rate(&learning.raw);
        true
    }

    /// Fold in a plausible row and decide; `is_new` is false where the row stands in for one that could not be read.
    ///
    /// Returns the decision, and whether learning was refused at this row.
    pub fn push(&mut self, row: &InertialRow, is_new: bool, wheels: WheelState) -> (Decision, bool) {
        let [fx, fy, fz] = row.force;
        let magnitude = (fx * fx + fy * fy + fz * fz).sqrt();
        self.jerk.push((magnitude - self.previous_magnitude.unwrap_or(magnitude)).abs()); // (4)
        self.previous_magnitude = Some(magnitude);
        self.forward_force.push(fx);
        self.gain.push(fx, self.rules.mode == MotionMode::Stationary);
        self.yaw_rate.push(row.rate[2]);
        let was_learning = self.learning.is_some();
        let mut refused = false;
        if was_learning {
            refused = !self.learn(row, is_new, magnitude) && self.refuse_learning();
        } else {
            self.push_tilt_rate(row.rate[0], row.rate[1]);
        }
        let statistics = Statistics {
            jerk: self.jerk.mean(),
            tilt_rate: self.tilt_rate.mean(),
            force_step: self.forward_force.mean_distance(), // (8)
            yaw_rate: self.yaw_rate.mean() - self.bias[2],  // (9)
        };
        let indicator = self.thresholds.indicator(&statistics);
        self.adapt(&statistics, indicator);
        let yaw_threshold = self.rules.yaw_threshold();
        let is_held = was_learning && !refused && self.adaptive.is_some();
        let rule = if is_held { Rule::Learning } else { self.decide(statistics, indicator, wheels) };
        let (thresholds, mode) = (self.thresholds, self.rules.mode);
        (Decision { statistics, indicator, thresholds, yaw_threshold, mode, rule }, refused)
    }

    fn decide(&mut self, statistics: Statistics, indicator: u8, wheels: WheelState) -> Rule {
        let (jerk, force_step) = (self.thresholds.jerk, self.thresholds.force_step);
        let is_quiet = statistics.jerk <= jerk && statistics.force_step <= force_step;
        self.quiet_rows = if is_quiet { self.quiet_rows + 1 } else { 0 };
        let is_nearly_still = self.recent_tilt_rate.mean() <= NEARLY_STILL * self.thresholds.tilt_rate;
        let rested = self.rules.mode == MotionMode::Stationary;
        let stays = wheels == WheelState::Stay;
        let rule = self.rules.decide(&Row {
            statistics,
            indicator,
            force_step_threshold: force_step,
            wheels,
            is_full: self.jerk.is_full(),
            is_settled: self.quiet_rows >= self.settled_rows && is_nearly_still,
            contradiction: if self.gain.contradicts_rest() {
                Some(Rule::SpeedGained)
            } else {
                (statistics.yaw_rate.abs() > self.turning).then_some(Rule::Turns)
            },
            has_gained: if stays { self.gain.has_gained() } else { None },
            is_bearable: stays
                && self.bearable.indicator(&statistics) == 1
                && statistics.force_step <= self.bearable.force_step,
        });
        if rested && self.rules.mode != MotionMode::Stationary {
            self.gain.launch();
        }
        rule
    }

    /// Take a row into the means; `false` if it shows that the car is not at rest.
    fn learn(&mut self, row: &InertialRow, is_new: bool, magnitude: f64) -> bool {
        let Some(learning) = &mut self.learning else { return true };
        if learning.raw.len() >= 2 * self.window {
            learning.raw.drain(..self.window);
        }
        learning.raw.push([row.rate[0], row.rate[1]]);
        if is_new {
            learning.count += 1;
            let count = learning.count as f64;
            for (sum, rate) in learning.rate_sum.iter_mut().zip(row.rate) {
                *sum += rate;
            }
            let deviation = magnitude - learning.force_mean;
            learning.force_mean += deviation / count;
            learning.force_squares += deviation * (magnitude - learning.force_mean);
            let is_spread_known = count * self.step >= SPREAD_TIME || learning.count == learning.needed;
            let spread2 = learning.force_squares / count;
            let rate2: f64 = row.rate.iter().map(|w| w * w).sum();
            if rate2 > RATE_AT_REST * RATE_AT_REST
                || is_spread_known && spread2 > FORCE_SPREAD_AT_REST * FORCE_SPREAD_AT_REST
            {
                return false;
            }
            self.bias = learning.rate_sum.map(|sum| sum / count);
        }
        let is_done = learning.count == learning.needed;
        let raw = std::mem::take(&mut learning.raw);
        self.recompute_tilt_rate(&raw);
        match &mut self.learning {
            Some(_) if is_done => self.learning = None,
            Some(learning) => learning.raw = raw,
            None => {}
        }
        true
    }

    fn recompute_tilt_rate(&mut self, raw: &[[f64; 2]]) {
        self.tilt_rate.clear();
        self.recent_tilt_rate.clear();
        for rate in &raw[raw.len().saturating_sub(self.window)..] {
            self.push_tilt_rate(rate[0], rate[1]);
        }
    }

    fn push_tilt_rate(&mut self, roll_rate: f64, pitch_rate: f64) {
        let rate = horizontal_rate(roll_rate, pitch_rate, &self.bias); // (6)
        self.tilt_rate.push(rate);
        self.recent_tilt_rate.push(rate);
    }

    /// Let the thresholds follow the noise floor, which follows the statistics at rest.
    fn adapt(&mut self, statistics: &Statistics, indicator: u8) {
        let Some(adaptive) = &mut self.adaptive else { return };
        if self.learning.is_some() {
            return;
        }
        match &mut adaptive.floor {
            None => adaptive.floor = Some(*statistics),
            Some(floor) if self.rules.mode == MotionMode::Stationary && indicator == 1 => {
                floor.jerk += adaptive.share * (statistics.jerk - floor.jerk);
                floor.tilt_rate += adaptive.share * (statistics.tilt_rate - floor.tilt_rate);
                floor.force_step += adaptive.share * (statistics.force_step - floor.force_step);
            }
            Some(_) => return,
        }
        if let Some(floor) = adaptive.floor {
            self.thresholds = Thresholds {
                jerk: SMALLEST.jerk.max(adaptive.factor * floor.jerk),
                tilt_rate: SMALLEST.tilt_rate.max(adaptive.factor * floor.tilt_rate),
                force_step: SMALLEST.force_step.max(adaptive.launch_factor * floor.force_step),
            };
        }
    }
}

/// Rate about the body's horizontal axes, rad/s. Plausible rates need no care for overflow.
fn horizontal_rate(roll_rate: f64, pitch_rate: f64, bias: &[f64; 3]) -> f64 {
    let (x, y) = (roll_rate - bias[0], pitch_rate - bias[1]);
    (x * x + y * y).sqrt()
}
