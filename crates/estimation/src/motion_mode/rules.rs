//! The rules that turn statistics into a motion mode (tables 1 to 3), with hysteresis and an escape from rest.

/// What the car does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotionMode {
    /// At rest.
    #[default]
    Stationary,
    /// Moving straight on.
    Straight,
    /// Turning.
    Cornering,
}

impl MotionMode {
    /// The mode's code in columns and files: 0, 1, 2.
    pub fn code(self) -> f64 {
        f64::from(self as u8)
    }
}

/// The rule that decided a row. Its code in the column `rule` is its position here, from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// No rule fired: the mode stays.
    #[default]
    Keep,
    /// Rest ended: the forward force departed from what it was a launch window ago.
    LaunchByForce,
    /// Rest ended: both jerk and tilt rate were above their thresholds for the escape time.
    LaunchByEscape,
    /// Motion ended: force steady, jerk and tilt rate below their thresholds.
    Stop,
    /// A corner began: mean yaw rate above the upper threshold.
    EnterCorner,
    /// A corner ended: mean yaw rate at or below the lower threshold.
    LeaveCorner,
    /// The wheels turn: the mode left rest, or did not come to it.
    Wheels,
    /// Held at rest while biases and noise floor are learned.
    Learning,
    /// Motion kept although everything is quiet: the windows are not full yet.
    Filling,
    /// Motion ended: all four wheels have stood still for long enough, whatever still rocks.
    WheelsStand,
    /// Motion ended: force and jerk have been quiet for another launch window, and the last half of sway's window is.
    Settled,
    /// The forward force has gained too much speed since the last rest: the mode left rest, or did not come to it.
    SpeedGained,
    /// The car turns: the mode left rest, or did not come to it.
    Turns,
    /// Motion ended, or what seemed a launch: satellite fixes stay in their place, whatever shakes the car.
    FixesStay,
}

/// What the wheels say, or satellites in a log that has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WheelState {
    /// Nothing that decides.
    Unknown,
    /// They turn, clearly.
    Turn,
    /// All four have stood still for a while.
    Stand,
    /// There are none, and satellite fixes have stayed in their place for a while.
    Stay,
}

impl Rule {
    /// The rule's code in the column `rule`.
    pub fn code(self) -> f64 {
        f64::from(self as u8)
    }
}

/// Means over the windows, which the rules compare with [`Thresholds`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Mean absolute step of the specific force's magnitude, m/s^2 per sample; JD/n of (4).
    pub jerk: f64,
    /// Mean rate about the horizontal axes, rad/s; TD/n of (6).
    pub tilt_rate: f64,
    /// Mean distance of the forward specific force from its value a launch window ago, m/s^2; FD/(p+1) of (8).
    pub force_step: f64,
    /// Mean yaw rate, rad/s; (9).
    pub yaw_rate: f64,
}

/// What the statistics are compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thresholds {
    /// For [`Statistics::jerk`].
    pub jerk: f64,
    /// For [`Statistics::tilt_rate`].
    pub tilt_rate: f64,
    /// For [`Statistics::force_step`].
    pub force_step: f64,
}

impl Thresholds {
    /// Dynamics indicator: 1 and one more for each of jerk and tilt rate above its threshold (table 1).
    pub fn indicator(&self, statistics: &Statistics) -> u8 {
        1 + u8::from(statistics.jerk > self.jerk) + u8::from(statistics.tilt_rate > self.tilt_rate) // (5), (7)
    }
}

/// What does not depend on the row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Settings {
    /// Yaw rate above which a corner begins, rad/s.
    pub(super) yaw_on: f64,
    /// Yaw rate at or below which it ends, rad/s.
    pub(super) yaw_off: f64,
    /// Rows of full activity after which rest ends; 0 never.
    pub(super) escape_rows: usize,
    /// Rows after a stop that the wheels told, in which a car that still rocks does not launch while they stand.
    pub(super) settling_rows: usize,
    /// Rows after a launch in which fixes that stay do not take it back, where no speed has been gained and otherwise.
    pub(super) doubt_rows: [usize; 2],
}

/// What else a row brings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    pub(super) statistics: Statistics,
    pub(super) indicator: u8,
    pub(super) force_step_threshold: f64,
    pub(super) wheels: WheelState,
    /// Whether the windows hold enough to decide for rest.
    pub(super) is_full: bool,
    /// Whether the body has settled but for what the windows still remember of its rocking.
    pub(super) is_settled: bool,
    /// What else contradicts rest: [`Rule::SpeedGained`] or [`Rule::Turns`].
    pub(super) contradiction: Option<Rule>,
    /// Whether some speed has been gained, at rest or since it, as far as that is known.
    pub(super) has_gained: Option<bool>,
    /// Whether a standing car may be shaken like this.
    pub(super) is_bearable: bool,
}

/// The mode, and the little memory that the rules have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rules {
    settings: Settings,
    pub(super) mode: MotionMode,
    last_moving: MotionMode,
    active_rows: usize,
    settling: usize,
    /// Whether the wheels have turned since they last told a stop or the car left them standing.
    have_turned: bool,
    /// Rows since the last launch.
    moving_rows: usize,
    /// Whether fixes told the present rest: the engine's shaking does not end it while they stay.
    is_shaken: bool,
    /// Whether fixes stay where they are although the car has gone: the receiver holds them.
    has_gone: bool,
}

impl Rules {
    pub(super) fn new(settings: Settings, mode: MotionMode) -> Self {
        Self {
            settings,
            mode,
            last_moving: MotionMode::Straight,
            active_rows: 0,
            settling: 0,
            have_turned: false,
            // In motion since before the log.
            moving_rows: settings.doubt_rows[1],
            is_shaken: false,
            has_gone: false,
        }
    }

    /// What the magnitude of the yaw rate is compared with at the next row, rad/s.
    pub(super) fn yaw_threshold(&self) -> f64 {
        if self.mode == MotionMode::Cornering { self.settings.yaw_off } else { self.settings.yaw_on }
    }

    /// Decide one row and say by which rule; where two fire, the later one.
    pub(super) fn decide(&mut self, row: &Row) -> Rule {
        self.have_turned |= row.wheels == WheelState::Turn;
        let goes = row.contradiction.is_some() || row.statistics.yaw_rate.abs() > self.settings.yaw_on;
        self.has_gone = row.wheels == WheelState::Stay && (self.has_gone || goes);
        let mut rule = if self.mode == MotionMode::Stationary { self.leave_rest(row) } else { self.come_to_rest(row) };
        if self.mode != MotionMode::Stationary {
            let yaw_rate = row.statistics.yaw_rate.abs();
            match self.last_moving {
                MotionMode::Cornering if yaw_rate <= self.settings.yaw_off => {
                    (self.last_moving, rule) = (MotionMode::Straight, Rule::LeaveCorner);
                }
                MotionMode::Straight if yaw_rate > self.settings.yaw_on => {
                    (self.last_moving, rule) = (MotionMode::Cornering, Rule::EnterCorner);
                }
                _ => {}
            }
            self.mode = self.last_moving;
        }
        rule
    }

    fn leave_rest(&mut self, row: &Row) -> Rule {
        if self.settling > 0 && row.wheels == WheelState::Stand {
            self.settling -= 1;
            return Rule::Keep;
        }
        self.active_rows = if row.indicator == 3 { self.active_rows + 1 } else { 0 };
        let is_held = self.is_shaken && self.fixes_tell_rest(row) && row.has_gained != Some(true);
        if is_held && row.contradiction.is_none() {
            return Rule::Keep;
        }
        let rule = if row.statistics.force_step > row.force_step_threshold {
            Rule::LaunchByForce
        } else if self.settings.escape_rows > 0 && self.active_rows >= self.settings.escape_rows {
            Rule::LaunchByEscape
        } else if row.wheels == WheelState::Turn {
            Rule::Wheels
        } else if let Some(contradiction) = row.contradiction {
            contradiction
        } else {
            return Rule::Keep;
        };
        (self.mode, self.last_moving, self.active_rows) = (MotionMode::Straight, MotionMode::Straight, 0);
        (self.moving_rows, self.is_shaken) = (0, false);
        // A launch from standing wheels is believed before they begin to read.
        self.have_turned &= row.wheels != WheelState::Stand;
        rule
    }

    fn fixes_tell_rest(&self, row: &Row) -> bool {
        row.wheels == WheelState::Stay && row.is_bearable && !self.has_gone
    }

    fn come_to_rest(&mut self, row: &Row) -> Rule {
        self.settling = 0;
        if row.wheels == WheelState::Stand && self.have_turned {
            self.have_turned = false;
            (self.mode, self.settling, self.active_rows) = (MotionMode::Stationary, self.settings.settling_rows, 0);
            return Rule::WheelsStand;
        }
        self.moving_rows = self.moving_rows.saturating_add(1);
        let [gained_nothing, gain_unknown] = self.settings.doubt_rows;
        let doubt = if row.has_gained == Some(false) { gained_nothing } else { gain_unknown };
        if self.moving_rows >= doubt && row.contradiction.is_none() && self.fixes_tell_rest(row) {
            (self.mode, self.is_shaken, self.active_rows) = (MotionMode::Stationary, true, 0);
            return Rule::FixesStay;
        }
        let is_quiet = row.indicator == 1 || row.is_settled;
        if row.statistics.force_step > row.force_step_threshold || !is_quiet {
            return Rule::Keep;
        }
        if row.wheels == WheelState::Turn {
            return Rule::Wheels;
        }
        if let Some(contradiction) = row.contradiction {
            return contradiction;
        }
        if !row.is_full {
            return Rule::Filling;
        }
        self.mode = MotionMode::Stationary;
        if row.indicator == 1 { Rule::Stop } else { Rule::Settled }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Settings =
        Settings { yaw_on: 0.05, yaw_off: 0.035, escape_rows: 3, settling_rows: 2, doubt_rows: [4, 8] };
    const QUIET: Row = Row {
        statistics: Statistics { jerk: 0.0, tilt_rate: 0.0, force_step: 0.0, yaw_rate: 0.0 },
        indicator: 1,
        force_step_threshold: 0.16,
        wheels: WheelState::Unknown,
        is_full: true,
        is_settled: false,
        contradiction: None,
        has_gained: None,
        is_bearable: true,
    };

    fn with(force_step: f64, yaw_rate: f64, indicator: u8) -> Row {
        Row { statistics: Statistics { force_step, yaw_rate, ..QUIET.statistics }, indicator, ..QUIET }
    }

    #[test]
    fn the_indicator_counts_strict_exceedances() {
        let t = Thresholds { jerk: 0.1, tilt_rate: 0.01, force_step: 1.0 };
        let indicator = |jerk, tilt_rate| t.indicator(&Statistics { jerk, tilt_rate, ..Statistics::default() });
        assert_eq!(
            [indicator(0.1, 0.01), indicator(0.11, 0.01), indicator(0.1, 0.02), indicator(0.2, 0.02)],
            [1, 2, 2, 3]
        );
    }

    #[test]
    fn yaw_rate_has_hysteresis_and_both_signs_count() {
        let mut rules = Rules::new(SETTINGS, MotionMode::Straight);
        let mut mode = |yaw_rate| {
            rules.decide(&with(1.0, yaw_rate, 2));
            rules.mode
        };
        assert_eq!(mode(0.05), MotionMode::Straight, "the threshold itself is not above it");
        assert_eq!(mode(-0.051), MotionMode::Cornering, "a left turn is negative");
        assert_eq!(mode(-0.04), MotionMode::Cornering, "between the thresholds the corner goes on");
        assert_eq!(mode(0.035), MotionMode::Straight);
        assert_eq!(mode(0.04), MotionMode::Straight, "between the thresholds straight goes on");
    }

    #[test]
    fn one_yaw_threshold_has_no_memory() {
        // Table 3 as printed: with equal thresholds the decision is a comparator of the row alone.
        let mut rules = Rules::new(Settings { yaw_off: 0.05, ..SETTINGS }, MotionMode::Straight);
        for k in 0..200 {
            let yaw_rate = 0.08 * (0.37 * f64::from(k)).sin();
            rules.decide(&with(1.0, yaw_rate, 2));
            assert_eq!(rules.mode == MotionMode::Cornering, yaw_rate.abs() > 0.05);
        }
    }

    #[test]
    fn rest_ends_by_force_or_after_uninterrupted_activity() {
        let mut rules = Rules::new(SETTINGS, MotionMode::Stationary);
        assert_eq!(
            rules.decide(&with(0.16, 0.0, 2)),
            Rule::Keep,
            "the threshold itself and an indicator of 2 keep rest"
        );
        assert_eq!(rules.decide(&with(0.17, 0.0, 1)), Rule::LaunchByForce);
        assert_eq!(rules.decide(&QUIET), Rule::Stop);
        let fired = [3, 3, 1, 3, 3, 3].map(|indicator| rules.decide(&with(0.0, 0.0, indicator)));
        assert_eq!(fired[..5], [Rule::Keep; 5], "an interruption starts the count again");
        assert_eq!((fired[5], rules.mode), (Rule::LaunchByEscape, MotionMode::Straight));
        let mut paper = Rules::new(Settings { escape_rows: 0, ..SETTINGS }, MotionMode::Stationary);
        assert!((0..100).all(|_| paper.decide(&with(0.0, 0.0, 3)) == Rule::Keep), "the paper has no escape");
    }

    #[test]
    fn motion_goes_on_while_anything_is_active_or_wheels_turn_or_windows_fill() {
        let mut rules = Rules::new(SETTINGS, MotionMode::Straight);
        assert_eq!(rules.decide(&with(0.0, 0.0, 2)), Rule::Keep);
        assert_eq!(rules.decide(&Row { wheels: WheelState::Turn, ..QUIET }), Rule::Wheels);
        assert_eq!(rules.decide(&Row { is_full: false, ..QUIET }), Rule::Filling);
        assert_eq!((rules.decide(&QUIET), rules.mode), (Rule::Stop, MotionMode::Stationary));
        assert_eq!(rules.decide(&Row { wheels: WheelState::Turn, ..QUIET }), Rule::Wheels);
        assert_eq!(rules.mode, MotionMode::Straight);
    }

    /// Catches a contradiction that only keeps the car from resting, or one that outweighs what is active anyway.
    #[test]
    fn a_body_that_has_settled_rests_and_speed_gained_or_a_turn_contradict_rest_both_ways() {
        for rule in [Rule::SpeedGained, Rule::Turns] {
            let mut rules = Rules::new(SETTINGS, MotionMode::Straight);
            let settled = Row { is_settled: true, ..with(0.1, 0.0, 2) };
            let contradicted = Row { contradiction: Some(rule), ..settled };
            assert_eq!(
                rules.decide(&Row { is_settled: true, ..with(0.2, 0.0, 2) }),
                Rule::Keep,
                "the force still moves"
            );
            assert_eq!((rules.decide(&contradicted), rules.mode), (rule, MotionMode::Straight));
            assert_eq!((rules.decide(&settled), rules.mode), (Rule::Settled, MotionMode::Stationary));
            assert_eq!((rules.decide(&contradicted), rules.mode), (rule, MotionMode::Straight));
            assert_eq!(rules.decide(&QUIET), Rule::Stop);
        }
    }

    #[test]
    fn standing_wheels_end_motion_while_the_body_still_rocks_and_a_launch_is_seen_all_the_same() {
        let mut rules = Rules::new(SETTINGS, MotionMode::Straight);
        let rocking = |wheels| Row { wheels, ..with(1.0, 0.0, 3) };
        assert_eq!(rules.decide(&rocking(WheelState::Stand)), Rule::Keep, "they have not turned yet");
        rules.decide(&rocking(WheelState::Turn));
        let standing = [(); 3].map(|()| rules.decide(&rocking(WheelState::Stand)));
        assert_eq!(standing, [Rule::WheelsStand, Rule::Keep, Rule::Keep]);
        assert_eq!(rules.mode, MotionMode::Stationary);
        assert_eq!(rules.decide(&rocking(WheelState::Stand)), Rule::LaunchByForce, "settled: the force counts again");
        assert_eq!(rules.decide(&rocking(WheelState::Stand)), Rule::Keep, "and they do not take the launch back");
    }

    /// Catches a launch taken back as soon as it is told, an engine that ends the rest that fixes told, and one that no longer
    /// ends when speed is gained or the fixes go on.
    #[test]
    fn fixes_that_stay_take_a_launch_back_and_hold_rest_until_speed_is_gained() {
        let shaken = |has_gained| Row { wheels: WheelState::Stay, has_gained, ..with(0.2, 0.0, 3) };
        for (has_gained, rows) in [(Some(false), 4), (None, 8), (Some(true), 8)] {
            let mut rules = Rules::new(SETTINGS, MotionMode::Stationary);
            assert_eq!(rules.decide(&shaken(has_gained)), Rule::LaunchByForce, "rest that nothing shook ends as ever");
            assert!((1..rows).all(|_| rules.decide(&shaken(has_gained)) == Rule::Keep));
            assert_eq!((rules.decide(&shaken(has_gained)), rules.mode), (Rule::FixesStay, MotionMode::Stationary));
            assert!((0..20).all(|_| rules.decide(&shaken(Some(false))) == Rule::Keep));
            let (mut gained, mut gone, mut violent) = (rules, rules, rules);
            assert_eq!(gained.decide(&shaken(Some(true))), Rule::LaunchByForce);
            assert_eq!(gone.decide(&Row { wheels: WheelState::Unknown, ..shaken(None) }), Rule::LaunchByForce);
            assert_eq!(violent.decide(&Row { is_bearable: false, ..shaken(None) }), Rule::LaunchByForce);
            // A turn shows that the receiver holds its place: from there on it is not believed until the fixes go on.
            rules.decide(&Row { contradiction: Some(Rule::Turns), ..with(0.0, 0.1, 3) });
            rules.decide(&Row { wheels: WheelState::Stay, ..with(0.0, 0.1, 3) });
            assert!((0..50).all(|_| rules.decide(&shaken(None)) != Rule::FixesStay));
        }
    }
}
