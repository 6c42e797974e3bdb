//! Whether the road shakes the car: on a bump the wheel speeds are not the car's.
//!
//! The suspension lets an axle that is pushed up also go back and forth, and its wheels turn so much faster and slower. The
//! vertical accelerometer tells it sooner and for both axles alike. Only the grade filter, whose grade is the road's, hears of
//! it: the other two have the body's slope, which a bump does change. A shake of `a` at the body's own frequency `w0` moves
//! with `a / w0`: so large an error the wheel speed is given, until the shake has died away on the suspension.

use super::params::SlopeParams;

/// How long the ordinary vertical specific force is averaged, s: gravity, bias, crests and dips are slower than a bump.
const MEMORY: f64 = 1.0;
/// A smaller shake is an ordinary road, m/s^2. The specification's cases stay below it, their speed bump included.
const SMALLEST: f64 = 2.0;

/// The ordinary vertical specific force as it was lately, and by how much the car has just left it.
#[derive(Clone, Debug)]
pub(super) struct Shake {
    /// Time, s, mean of the vertical specific force and the shake that is left, m/s^2.
    last: Option<(f64, f64, f64)>,
    /// Decay of a shake on the suspension, 1/s.
    decay: f64,
    /// Speed of a shake per acceleration, s.
    period: f64,
}

impl Shake {
    pub(super) fn new(params: &SlopeParams) -> Self {
        let frequency = params.pitch_frequency;
        Self { last: None, decay: params.pitch_damping_ratio * frequency, period: 1.0 / frequency }
    }

    /// Take in the vertical specific force, m/s^2.
    pub(super) fn feel(&mut self, time: f64, accel_z: f64) {
        if !(accel_z.abs() < super::row::LARGEST_ACCEL && time.is_finite()) {
            return;
        }
        let (before, mean, left) = self.last.unwrap_or((time, accel_z, 0.0));
        let passed = (time - before).max(0.0);
        let away = accel_z - mean;
        let left = left * (1.0 - self.decay * passed).max(0.0);
        self.last = Some((time, mean + (passed / MEMORY).min(1.0) * away, left.max(away.abs())));
    }

    /// Error of the wheel speed for the shake, m/s.
    pub(super) fn doubt(&self, time: f64) -> f64 {
        let Some((before, _, left)) = self.last else { return 0.0 };
        let left = left * (1.0 - self.decay * (time - before)).clamp(0.0, 1.0);
        if left > SMALLEST { self.period * left } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bump_is_felt_until_it_has_died_away_and_a_rough_road_is_not() {
        let mut shake = Shake::new(&SlopeParams::default());
        for k in 0..500 {
            // A road that shakes by 1 m/s^2 at 5 Hz, over a crest that takes off 3 m/s^2 within five seconds.
            let t = f64::from(k) * 0.01;
            shake.feel(t, -9.8 + 0.6 * t + (31.4 * t).sin());
            assert_eq!(shake.doubt(t), 0.0, "at {t} s");
        }
        let mut bump = Shake::new(&SlopeParams::default());
        bump.feel(0.0, -9.8);
        bump.feel(0.01, -15.8);
        // 6 m/s^2 at 8.3 rad/s.
        assert!((bump.doubt(0.01) - 6.0 / 8.3).abs() < 1e-9, "{}", bump.doubt(0.01));
        (2..40).for_each(|k| bump.feel(f64::from(k) * 0.01, -9.8));
        assert!(bump.doubt(0.39) > 0.0, "a decay time of 0.4 s later a third is left, more than an ordinary road");
        (40..80).for_each(|k| bump.feel(f64::from(k) * 0.01, -9.8));
        assert_eq!(bump.doubt(0.8), 0.0);
        bump.feel(f64::NAN, 30.0);
        bump.feel(0.81, f64::NAN);
        bump.feel(0.82, 1e9);
        assert_eq!(bump.doubt(0.82), 0.0, "what is no measurement is not felt");
    }
}
