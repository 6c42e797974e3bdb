//! Finding out that the filter, and not what it refuses, is wrong.
//!
//! A gate holds back what contradicts the filter. That is right where one sensor errs; it is a lock where the filter does. Two
//! sensors that know nothing of each other do not err together: satellites refused in position and velocity while the car's own
//! motion (odometer or constraint) is refused too, or after a time without satellites so long that nothing speaks for the filter, mean a filter that is lost.
//! Source: ours, beside the lock-out of SPEC navigation 4 (60 refusals), which opens up position and velocity only: a wrong tilt
//! or yaw drives the filter out again at once.

use super::estimate::{Tally, Verdicts};
use super::filter::Verdict;

/// Normalized innovation squared of a position about a hundred sigmas away.
const HOPELESS: f64 = 1e4;
/// Fixes in a row, each hopelessly far, after which the filter and not the receiver is wrong.
const HOPELESS_IN_A_ROW: usize = 10;
/// Contradicted fixes in a row after which the same holds, and the time over which they must come, s: longer than a reflection
/// at the end of a tunnel.
const CONTRADICTED_IN_A_ROW: usize = 5;
const CONTRADICTED_FOR: f64 = 5.0;

/// What speaks for and against the filter.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watch {
    hopeless: usize,
    contradicted: usize,
    contradicted_for: f64,
    unconfirmed: f64,
    since_position: f64,
    is_odometer_refused: bool,
    is_constraint_refused: bool,
}

impl Watch {
    /// Time passes: `dt` s.
    pub fn wait(&mut self, dt: f64) {
        self.unconfirmed += dt;
        self.since_position += dt;
        self.contradicted_for += dt;
    }

    /// What the sensors of an epoch were worth; `patience` is the time without satellites after which nothing speaks for the filter, s.
    pub fn look(&mut self, verdicts: &Verdicts, patience: f64) {
        if let Some(verdict) = verdicts.odometer {
            self.is_odometer_refused = !verdict.is_accepted;
        }
        if let Some(verdict) = verdicts.nhc {
            self.is_constraint_refused = !verdict.is_accepted;
        }
        if verdicts.zupt.is_some() {
            (self.is_odometer_refused, self.is_constraint_refused) = (false, false);
        }
        if verdicts.position.is_some_and(|v| v.is_accepted) {
            self.since_position = 0.0;
        }
        let Some((is_hopeless, is_refused)) = judged(verdicts) else { return };
        self.hopeless = if is_hopeless { self.hopeless + 1 } else { 0 };
        let is_motion_refused = self.is_odometer_refused || self.is_constraint_refused;
        let is_contradicted = is_refused && (is_motion_refused || self.unconfirmed > patience);
        if !is_contradicted {
            self.contradicted = 0;
        } else {
            self.contradicted += 1;
            if self.contradicted == 1 {
                self.contradicted_for = 0.0;
            }
        }
        if !is_refused {
            self.unconfirmed = 0.0;
        }
    }

    /// Positions refused in a row after which the filter's own is doubted: `patience`, but few after as many seconds without one.
    pub fn position_refusals(&self, patience: f64) -> f64 {
        if self.since_position > patience { patience.min(CONTRADICTED_IN_A_ROW as f64) } else { patience }
    }

    /// Whether the filter is lost.
    pub fn is_lost(&self) -> bool {
        let is_contradicted =
            self.contradicted >= CONTRADICTED_IN_A_ROW && self.contradicted_for > CONTRADICTED_FOR - 0.5;
        self.hopeless >= HOPELESS_IN_A_ROW || is_contradicted
    }
}

/// Whether the satellites of an epoch are hopelessly far, and whether both their position and their velocity were refused; `None`
/// without satellites.
fn judged(verdicts: &Verdicts) -> Option<(bool, bool)> {
    if verdicts.range.count > 0 {
        let range = &verdicts.range;
        let is_hopeless = range.accepted == 0 && range.nis > HOPELESS * range.count as f64;
        let mostly_refused = |tally: &Tally| tally.count >= 4 && 2 * tally.accepted <= tally.count;
        return Some((is_hopeless, mostly_refused(range) && mostly_refused(&verdicts.range_rate)));
    }
    let is_refused = |verdict: Option<Verdict>| verdict.is_some_and(|v| !v.is_accepted);
    let position = verdicts.position?;
    let is_hopeless = !position.is_accepted && position.nis > HOPELESS;
    Some((is_hopeless, !position.is_accepted && is_refused(verdicts.velocity)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(is_accepted: bool) -> Option<Verdict> {
        Some(Verdict { nis: if is_accepted { 1.0 } else { 100.0 }, rows: 3, is_accepted })
    }

    /// Whether the watch gives up within `seconds` of fixes at 1 Hz, after `before` s without any.
    fn lost(odometer: bool, position: bool, velocity: bool, before: f64, seconds: usize) -> bool {
        let mut watch = Watch::default();
        watch.wait(before);
        (0..seconds).any(|_| {
            watch.wait(1.0);
            let verdicts = Verdicts {
                odometer: verdict(odometer),
                position: verdict(position),
                velocity: verdict(velocity),
                ..Verdicts::default()
            };
            watch.look(&verdicts, 60.0);
            watch.is_lost()
        })
    }

    /// Reflections alone, or spinning wheels alone, must not throw the filter away; both together, and nothing else left, must.
    #[test]
    fn one_sensor_is_not_believed_against_the_filter_and_two_are() {
        assert!(!lost(true, false, false, 0.0, 50), "reflections for less than a minute");
        assert!(!lost(false, true, true, 0.0, 1000), "spinning wheels");
        assert!(!lost(false, false, true, 0.0, 1000), "a position that is off by some metres");
        assert!(lost(false, false, false, 0.0, 6));
        assert!(!lost(false, false, false, 0.0, 4), "not at once");
        assert!(lost(true, false, false, 100.0, 6), "after a tunnel");
    }
}
