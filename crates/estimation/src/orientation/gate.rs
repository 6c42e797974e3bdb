//! Whether a magnetic field is the Earth's: a gate with a latch, adaptive noise and re-acquisition.
//!
//! Source: SPEC orientation 9. A field of the wrong strength, dip or direction is left out, and for a while after it, so
//! that a field that swings through the right one is not believed at its zero crossings. Beyond it: a field that turns
//! away slowly takes the attitude with it, each sample fitting well enough; the mean of how they fit shows it.

use super::params::OrientationParams;

/// Time over which the fit of the field's direction is averaged, s.
const DIRECTION_TIME: f64 = 0.2;

/// What the gate makes of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Decision {
    /// Use it, its variance times this factor (at least 1).
    Use(f64),
    /// Leave it out.
    Leave(Reason),
    /// It has been strange but steady for long: believe it again, and the attitude less.
    Reacquire,
}

/// Why a field is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// Its strength.
    Strength,
    /// Its angle below the horizontal.
    Dip,
    /// It does not fit the attitude as well as both are known.
    Innovation,
    /// One of them a moment ago.
    Latched,
}

impl Decision {
    /// Number of the column `gate`.
    pub(super) fn code(self) -> f64 {
        match self {
            Self::Use(scale) => f64::from(u8::from(scale > 1.0)),
            Self::Leave(_) => 2.0,
            Self::Reacquire => 3.0,
        }
    }
    /// Number of the column `gate_reason`.
    pub(super) fn reason(self) -> f64 {
        match self {
            Self::Leave(Reason::Strength) => 1.0,
            Self::Leave(Reason::Dip) => 2.0,
            Self::Leave(Reason::Innovation) => 3.0,
            Self::Leave(Reason::Latched) => 4.0,
            Self::Use(_) | Self::Reacquire => 0.0,
        }
    }
}

/// The gate and how long it has been closed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gate {
    norm_soft: f64,
    norm_hard: f64,
    dip_hard: f64,
    nis_soft: f64,
    nis_hard: f64,
    hold: f64,
    recovery: f64,
    /// Largest mean of the direction's fit, and the inverse of the field's variance, 1/uT^2.
    direction_hard: f64,
    over_variance: f64,
    latch: f64,
    rejected: f64,
    direction: f64,
}

impl Gate {
    pub(super) fn new(p: &OrientationParams) -> Self {
        Self {
            norm_soft: p.gate_norm_soft,
            norm_hard: p.gate_norm_hard,
            dip_hard: p.gate_dip_hard,
            nis_soft: p.gate_nis_soft,
            nis_hard: p.gate_nis_hard,
            hold: p.gate_hold,
            recovery: p.gate_recovery,
            direction_hard: p.gate_direction,
            over_variance: 1.0 / (p.field_sigma * p.field_sigma),
            latch: 0.0,
            rejected: 0.0,
            direction: 0.0,
        }
    }

    /// Judge a field `dt` after the one before by its strength error (uT), dip error (rad) and normalized innovation
    /// squared.
    pub(super) fn judge(&mut self, norm_error: f64, dip_error: f64, nis: f64, dt: f64) -> Decision {
        let strength = norm_error.abs();
        // No attitude changes the strength: what it adds to the innovation says nothing of the direction.
        let fit = (nis - strength * strength * self.over_variance).max(0.0).min(self.nis_hard);
        self.direction += dt / (DIRECTION_TIME + dt) * (fit - self.direction);
        let reason = self.reason(strength, dip_error.abs(), nis);
        if reason.is_some() {
            self.latch = self.hold;
        }
        self.rejected = if reason.is_some() && strength < self.norm_soft { self.rejected + dt } else { 0.0 };
        if self.rejected > self.recovery {
            (self.rejected, self.latch) = (0.0, 0.0);
            return Decision::Reacquire;
        }
        if self.latch > 0.0 {
            self.latch -= dt;
            return Decision::Leave(reason.unwrap_or(Reason::Latched));
        }
        if let Some(reason) = reason {
            return Decision::Leave(reason);
        }
        let ratio = strength / self.norm_soft;
        Decision::Use((ratio * ratio).max(nis / self.nis_soft).max(1.0))
    }

    /// Whether the last field was not left out.
    pub(super) fn is_open(&self) -> bool {
        self.latch <= 0.0
    }

    /// The normalized innovation squared up to which a field is used.
    pub(super) fn largest_nis(&self) -> f64 {
        self.nis_hard
    }

    fn reason(&self, strength: f64, dip: f64, nis: f64) -> Option<Reason> {
        if strength > self.norm_hard {
            return Some(Reason::Strength);
        }
        if dip > self.dip_hard {
            return Some(Reason::Dip);
        }
        // A NaN does not pass.
        let fits = nis <= self.nis_hard && self.direction <= self.direction_hard;
        (!fits).then_some(Reason::Innovation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate() -> Gate {
        Gate::new(&OrientationParams::default())
    }

    #[test]
    fn a_strange_field_is_left_out_and_the_latch_bridges_its_zero_crossings() {
        let mut g = gate();
        assert_eq!(g.judge(6.0, 0.0, 1.0, 0.01), Decision::Leave(Reason::Strength));
        // 0.6 s of latch are 60 samples, the strange one included; sums of 0.01 may lie on either side.
        let closed = (0..100).take_while(|_| g.judge(0.0, 0.0, 1.0, 0.01) != Decision::Use(1.0)).count();
        assert!((59..=60).contains(&closed), "{closed}");
        assert_eq!(g.judge(0.0, -0.2, 1.0, 0.01), Decision::Leave(Reason::Dip));
        assert_eq!(gate().judge(0.0, 0.0, 41.0, 0.01), Decision::Leave(Reason::Innovation));
        assert_eq!(gate().judge(0.0, 0.0, f64::NAN, 0.01), Decision::Leave(Reason::Innovation));
    }

    #[test]
    fn a_doubtful_field_counts_less() {
        // (3 / 1.5)^2 = 4 by strength, 22.68 / 11.34 = 2 by innovation: the larger holds.
        assert_eq!(gate().judge(-3.0, 0.0, 22.68, 0.01), Decision::Use(4.0));
        assert_eq!(gate().judge(0.1, 0.0, 5.0, 0.01), Decision::Use(1.0));
    }

    #[test]
    fn a_field_that_stays_strange_at_the_right_strength_is_believed_again_and_one_of_wrong_strength_never() {
        let (mut turned, mut strong) = (gate(), gate());
        let first = (0..4000).position(|_| turned.judge(0.5, 0.0, 80.0, 0.01) == Decision::Reacquire);
        // 25 s of samples at 100 Hz, within the rounding of their sum.
        assert!(matches!(first, Some(2499..=2501)), "{first:?}");
        assert!((0..9000).all(|_| matches!(strong.judge(2.0, 0.3, 80.0, 0.01), Decision::Leave(_))));
    }

    #[test]
    fn a_field_that_takes_the_attitude_with_it_is_left_out_and_one_of_wrong_strength_alone_is_not() {
        // Innovations of 20 pass one by one; six times the normal mean of 2 is passed after 0.2 s * ln(20 / 14) = 7 samples.
        let (mut turning, mut weak) = (gate(), gate());
        let used = (0..100).take_while(|_| matches!(turning.judge(0.1, 0.0, 20.0, 0.01), Decision::Use(_))).count();
        assert!((5..=9).contains(&used), "{used}");
        assert_eq!(turning.judge(0.1, 0.0, 20.0, 0.01), Decision::Leave(Reason::Innovation));
        // 2.4 uT of strength alone make 16.
        assert!((0..100).all(|_| matches!(weak.judge(2.4, 0.0, 17.0, 0.01), Decision::Use(_))));
    }

    #[test]
    fn without_a_hold_the_gate_still_leaves_the_strange_sample_out() {
        let mut g = Gate { hold: 0.0, ..gate() };
        assert_eq!(g.judge(6.0, 0.0, 1.0, 0.01), Decision::Leave(Reason::Strength));
        assert_eq!(g.judge(0.0, 0.0, 1.0, 0.01), Decision::Use(1.0));
    }
}
