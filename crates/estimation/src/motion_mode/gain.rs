//! The speed that a car has gained since it stood: what contradicts rest where nothing shakes.
//!
//! At rest the mean forward specific force is gravity's share on that grade; what it departs by is acceleration, and its
//! integral speed. For the first seconds after a launch the grade is still nearly that of the rest, so that integral is a
//! speed to trust; later it is not, and nothing is said.

/// Time constant with which the force at rest is followed, and with which what has been gained at rest is forgotten, s.
const REST_TIME: f64 = 5.0;

/// Shortest rest whose force is trusted, s.
const SHORTEST_REST: f64 = 1.0;

/// Time after a launch for which the speed gained is trusted, s.
const TRUSTED_TIME: f64 = 4.0;

/// Forward force at rest, and its departures summed up.
#[derive(Clone, Debug)]
pub(super) struct SpeedGain {
    step: f64,
    smallest: f64,
    /// Rows at rest from which the reference was formed.
    rows_at_rest: usize,
    reference: f64,
    gained: f64,
    /// Rows for which it has been too much for rest, and how many of them contradict rest.
    fast_rows: usize,
    needed: usize,
    /// Rows for which the speed gained since a launch is still trusted; 0 before a launch and long after it.
    trusted: usize,
}

impl SpeedGain {
    /// For rows `step` s apart; a speed above `smallest` m/s for `needed` rows contradicts rest, none does if that is 0.
    pub(super) fn new(step: f64, smallest: f64, needed: usize) -> Self {
        let smallest = if smallest > 0.0 { smallest } else { f64::INFINITY };
        let needed = needed.max(1);
        Self { step, smallest, needed, fast_rows: 0, rows_at_rest: 0, reference: 0.0, gained: 0.0, trusted: 0 }
    }

    pub(super) fn clear(&mut self) {
        *self = Self::new(self.step, self.smallest, self.needed);
    }

    /// Take in the forward specific force of a row, m/s^2, at which the car rests or does not as far as known.
    pub(super) fn push(&mut self, force: f64, rests: bool) {
        if self.trusted > 0 {
            self.trusted -= 1;
            self.gained += (force - self.reference) * self.step;
            if self.trusted == 0 {
                (self.rows_at_rest, self.gained) = (0, 0.0);
            }
        } else if rests {
            self.rows_at_rest += 1;
            let share = self.step / REST_TIME;
            self.reference += (force - self.reference) * share.max(1.0 / self.rows_at_rest as f64);
            self.gained += (force - self.reference) * self.step - self.gained * share.min(1.0);
        } else {
            (self.rows_at_rest, self.gained) = (0, 0.0);
        }
        self.fast_rows = if self.gained.abs() > self.smallest { self.fast_rows + 1 } else { 0 };
    }

    /// Rest ended at this row, or seemed to.
    pub(super) fn launch(&mut self) {
        if self.trusted == 0 && self.is_reference_known() {
            self.trusted = (TRUSTED_TIME / self.step) as usize;
        }
    }

    /// Whether some speed has been gained, half of what contradicts rest, at rest or since it; `None` where that is not known.
    pub(super) fn has_gained(&self) -> Option<bool> {
        (self.trusted > 0 || self.is_reference_known()).then_some(self.gained.abs() > 0.5 * self.smallest)
    }

    fn is_reference_known(&self) -> bool {
        self.rows_at_rest as f64 * self.step >= SHORTEST_REST
    }

    /// Whether the car has gained too much speed to stand, for long enough.
    pub(super) fn contradicts_rest(&self) -> bool {
        self.fast_rows >= self.needed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 0.01;
    /// Gravity's share at rest on a slope of two per cent, m/s^2.
    const SLOPE: f64 = 0.2;

    fn rested(seconds: usize) -> SpeedGain {
        let mut gain = SpeedGain::new(STEP, 0.35, 30);
        (0..100 * seconds).for_each(|k| gain.push(SLOPE + 0.05 * (1.3 * k as f64).sin(), true));
        gain
    }

    /// Catches gravity's share of the force counted as acceleration, and vibration that piles up.
    #[test]
    fn a_car_on_a_slope_gains_nothing_and_one_that_creeps_off_does() {
        let mut gain = rested(60);
        assert!(!gain.contradicts_rest() && gain.gained.abs() < 0.01, "{}", gain.gained);
        let rows = (0..1000).take_while(|_| {
            gain.push(SLOPE + 0.3, true);
            !gain.contradicts_rest()
        });
        let seconds = STEP * rows.count() as f64;
        // 0.35 m/s at 0.3 m/s^2 are 1.17 s; with what the reference follows and what is forgotten t (1 - t / 5) is that. And
        // then 0.3 s, in which it stays so.
        assert!((1.47..2.2).contains(&seconds), "{seconds} s");
    }

    /// Catches a speed that outlives what is known of the grade, a rest too short to know its force, and a sum that a
    /// contradicted rest begins anew.
    #[test]
    fn speed_gained_since_a_launch_counts_for_some_seconds_and_only_after_a_rest() {
        let mut gain = rested(5);
        gain.launch();
        (0..200).for_each(|k| gain.push(SLOPE + 0.3, k % 2 == 0));
        gain.launch();
        assert!((gain.gained - 0.6).abs() < 0.02 && gain.contradicts_rest(), "{}", gain.gained);
        (0..200).for_each(|_| gain.push(SLOPE, false));
        assert!(!gain.contradicts_rest(), "four seconds are over");
        (0..50).for_each(|_| gain.push(5.0, true));
        gain.launch();
        (0..300).for_each(|_| gain.push(0.0, false));
        assert!(!gain.contradicts_rest(), "half a second of rest is no reference");
        let mut off = SpeedGain::new(STEP, 0.0, 0);
        (0..500).for_each(|k| off.push(f64::from(k), true));
        assert!(!off.contradicts_rest());
    }
}
