//! Whether front and rear wheels tell the same speed: an axle that jumps over a bump does not.

use drivescope_drive::signals::Wheels;

/// How long the ordinary difference of the axles is averaged, s: slip and scale change slowly, a bump lasts half a second.
const MEMORY: f64 = 1.0;

/// The ordinary difference of front and rear wheel speeds, as it was lately.
#[derive(Clone, Debug, Default)]
pub(super) struct AxleCheck {
    /// Time, s, and mean difference, m/s.
    last: Option<(f64, f64)>,
}

impl AxleCheck {
    /// By how much the axles' difference leaves its recent mean beyond `allowed`, m/s; 0 where a wheel is missing.
    ///
    /// The front wheels follow a larger circle: their speed times the cosine of the road-wheel angle is the rear's.
    pub(super) fn doubt(&mut self, time: f64, wheels: &Wheels, steer: f64, allowed: f64) -> f64 {
        let front = 0.5 * (wheels.wheel_speed_fl + wheels.wheel_speed_fr);
        let difference = front * steer.cos() - 0.5 * (wheels.wheel_speed_rl + wheels.wheel_speed_rr);
        if !(difference.abs() < super::row::LARGEST_WHEEL && time.is_finite()) {
            return 0.0;
        }
        let (before, mean) = self.last.unwrap_or((time, difference));
        let away = difference - mean;
        let share = ((time - before) / MEMORY).clamp(0.0, 1.0);
        self.last = Some((time, mean + share * away));
        (away.abs() - allowed).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wheels(front: f64, rear: f64) -> Wheels {
        let [wheel_speed_fl, wheel_speed_fr, wheel_speed_rl, wheel_speed_rr] = [front, front, rear, rear];
        Wheels { wheel_speed_fl, wheel_speed_fr, wheel_speed_rl, wheel_speed_rr, ..Wheels::default() }
    }

    #[test]
    fn a_constant_slip_is_ordinary_and_a_jump_is_not() {
        let mut check = AxleCheck::default();
        for k in 0..500 {
            assert_eq!(check.doubt(f64::from(k) * 0.01, &wheels(20.4, 20.0), 0.0, 0.12), 0.0);
        }
        assert!((check.doubt(5.0, &wheels(20.4, 20.6), 0.0, 0.12) - 0.48).abs() < 1e-9);
        assert_eq!(check.doubt(5.01, &Wheels { speed: 20.0, ..Wheels::default() }, 0.0, 0.12), 0.0, "one speed only");
        assert!(check.doubt(f64::NAN, &wheels(1e300, -1e300), 0.0, 0.12) == 0.0);
    }

    #[test]
    fn a_tight_turn_is_no_disagreement() {
        let mut check = AxleCheck::default();
        check.doubt(0.0, &wheels(5.0, 5.0), 0.0, 0.0);
        assert!(check.doubt(0.01, &wheels(5.0 / 0.5f64.cos(), 5.0), 0.5, 0.0) < 1e-12);
    }
}
