//! What the wheels, or satellites in a log that has none, say of rest and motion.

use drivescope_drive::drive::Epoch;
use drivescope_drive::signals::Wheels;

use super::MotionModeParams;
use super::fixes::{Fixes, Verdict};
use super::rules::WheelState;

/// Reported speed above which the car clearly moves, m/s: the dead band and the noise of such a speed are not known.
pub(super) const CLEARLY_MOVING: f64 = 0.5;

/// The same for the speeds of four wheels, which read zero below some 0.3 m/s and are exact at rest.
const CLEARLY_TURNING: f64 = 0.25;

/// Speed below which a wheel stands, m/s.
const STANDING: f64 = 0.02;

/// Time for which all four wheels must have stood before they end motion, s: below their dead band a car still rolls.
const STANDING_TIME: f64 = 0.8;

/// Age up to which a wheel speed counts, s.
const SPEED_AGE: f64 = 0.5;

/// Ground speed from satellites above which a car without wheel speeds clearly moves, m/s: several sigma of a receiver.
const CLEARLY_MOVING_BY_SATELLITE: f64 = 1.0;

/// Ground speed up to which a receiver may stand, m/s.
const STANDING_BY_SATELLITE: f64 = 0.3;

/// Age up to which a ground speed counts, s: receivers give one a second.
const GROUND_SPEED_AGE: f64 = 1.5;

/// The latest speeds and fixes of a log.
#[derive(Clone, Debug)]
pub(super) struct SpeedEvidence {
    is_used: bool,
    /// Whether fixes may tell rest.
    may_stay: bool,
    speed: f64,
    time: f64,
    has_wheels: bool,
    has_four_wheels: bool,
    standing_since: f64,
    fixes: Fixes,
}

impl SpeedEvidence {
    pub(super) fn new(params: &MotionModeParams) -> Self {
        Self {
            is_used: params.use_speed,
            may_stay: params.adaptive,
            speed: f64::NAN,
            time: f64::NEG_INFINITY,
            has_wheels: false,
            has_four_wheels: false,
            standing_since: f64::INFINITY,
            fixes: Fixes::new(),
        }
    }

    /// The speed that may contradict rest: the wheels', or the satellites' in a log that has none of the wheels.
    pub(super) fn read(&mut self, epoch: &Epoch) {
        let wheels = epoch.wheels.map_or(f64::NAN, |w| w.forward_speed());
        if !self.is_used {
            return;
        }
        let fix = epoch.gnss.filter(|g| g.is_usable());
        let ground = fix.map_or(f64::NAN, |g| g.ground_speed());
        if let Some(wheels) = &epoch.wheels {
            self.watch_wheels(wheels, epoch.time);
        }
        if wheels.is_finite() {
            self.has_wheels = true;
            (self.speed, self.time) = (wheels, epoch.time);
        } else if ground.is_finite() && !self.has_wheels {
            (self.speed, self.time) = (ground, epoch.time);
        }
        if let Some(fix) = fix.filter(|_| !self.has_wheels) {
            if ground > STANDING_BY_SATELLITE {
                self.fixes.forget();
            }
            self.fixes.push(epoch.time, &fix);
        }
    }

    /// What wheels, or satellites in a log that has none, say at a time.
    pub(super) fn state(&self, time: f64) -> WheelState {
        let (age, slowest) = match (self.has_wheels, self.has_four_wheels) {
            (_, true) => (SPEED_AGE, CLEARLY_TURNING),
            (true, false) => (SPEED_AGE, CLEARLY_MOVING),
            (false, false) => (GROUND_SPEED_AGE, CLEARLY_MOVING_BY_SATELLITE),
        };
        let is_old = time - self.time > age;
        if !is_old && self.speed.abs() > slowest {
            WheelState::Turn
        } else if !self.has_wheels {
            self.by_fixes(time, is_old)
        } else if is_old {
            WheelState::Unknown
        } else if time - self.standing_since >= STANDING_TIME {
            WheelState::Stand
        } else {
            WheelState::Unknown
        }
    }

    /// What fixes say in a log without wheels; of motion only where there is no ground speed to say it.
    fn by_fixes(&self, time: f64, without_speed: bool) -> WheelState {
        match self.fixes.verdict(time) {
            Verdict::Go if without_speed => WheelState::Turn,
            Verdict::Stay if self.may_stay => WheelState::Stay,
            _ => WheelState::Unknown,
        }
    }

    /// Since when all four wheels stand, if the log has them.
    fn watch_wheels(&mut self, wheels: &Wheels, time: f64) {
        let four = [wheels.wheel_speed_fl, wheels.wheel_speed_fr, wheels.wheel_speed_rl, wheels.wheel_speed_rr];
        if four.iter().any(|v| !v.is_finite()) {
            return;
        }
        self.has_four_wheels = true;
        let stands = four.iter().all(|v| v.abs() < STANDING) && time.is_finite();
        self.standing_since = if stands { self.standing_since.min(time) } else { f64::INFINITY };
    }
}
