//! The change of speed, and whether the car goes straight and steadily.

use super::params::OrientationParams;

/// Time constant of both poles of the speed derivative, s.
const SPEED_TIME: f64 = 0.2;
/// Slack of the dwell comparison, s: sums of steps are not exact.
const SLACK: f64 = 1e-9;

/// Derivative of a sampled signal behind two equal poles (SPEC orientation 4).
#[derive(Clone, Copy, Debug)]
pub(super) struct Derivative {
    time_constant: f64,
    smoothed: Option<f64>,
    value: f64,
}

impl Derivative {
    /// With poles of `time_constant` s.
    pub(super) fn new(time_constant: f64) -> Self {
        Self { time_constant, smoothed: None, value: 0.0 }
    }

    /// That of the speed.
    pub(super) fn of_speed() -> Self {
        Self::new(SPEED_TIME)
    }

    /// Share by which either pole of the speed's derivative follows its input in `dt`.
    pub(super) fn speed_gain(dt: f64) -> f64 {
        dt / (SPEED_TIME + dt)
    }

    /// Fold in one sample after `dt` and return the derivative; the first sample only starts it.
    pub(super) fn step(&mut self, sample: f64, dt: f64) -> f64 {
        let smoothed = self.smoothed.unwrap_or(sample);
        let over = 1.0 / (self.time_constant + dt);
        let gain = dt * over;
        let slope = (sample - smoothed) * over;
        self.smoothed = Some(smoothed + gain * (sample - smoothed));
        self.value += gain * (slope - self.value);
        self.value
    }
}

/// Limits on what may move in static driving.
#[derive(Clone, Copy, Debug)]
struct Limits {
    yaw_rate: f64,
    lateral: f64,
    forward: f64,
}

impl Limits {
    fn hold(&self, speed: f64, yaw_rate: f64, forward: f64) -> bool {
        yaw_rate.abs() <= self.yaw_rate && (speed * yaw_rate).abs() <= self.lateral && forward.abs() <= self.forward
    }
}

/// Quasi-static driving: entered after a calm time, left at once.
///
/// Source: Hwang & Choi 2016 ("from yaw rate and speed"); the thresholds are those of SPEC orientation 5.3.
#[derive(Clone, Copy, Debug)]
pub(super) struct StaticDetector {
    enter: Limits,
    stay: Limits,
    dwell: f64,
    calm: f64,
    is_static: bool,
}

impl StaticDetector {
    pub(super) fn new(p: &OrientationParams) -> Self {
        Self {
            enter: Limits { yaw_rate: p.static_yaw_rate, lateral: p.static_lateral, forward: p.static_forward },
            stay: Limits { yaw_rate: p.dynamic_yaw_rate, lateral: p.dynamic_lateral, forward: p.dynamic_forward },
            dwell: p.static_dwell,
            calm: 0.0,
            is_static: false,
        }
    }

    /// Fold in one sample; whether driving is static now. A NaN makes it dynamic.
    pub(super) fn step(&mut self, speed: f64, yaw_rate: f64, forward: f64, dt: f64) -> bool {
        self.calm = if self.enter.hold(speed, yaw_rate, forward) { self.calm + dt } else { 0.0 };
        self.is_static = if self.is_static {
            self.stay.hold(speed, yaw_rate, forward)
        } else {
            self.calm > 0.0 && self.calm >= self.dwell - SLACK
        };
        self.is_static
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_of_a_ramp_is_its_slope() {
        let mut d = Derivative::of_speed();
        assert_eq!(d.step(5.0, 0.01), 0.0);
        // 5 s are 25 time constants: what is left of the start is below 1e-9.
        let last = (1..=500).map(|k| d.step(5.0 + 0.03 * f64::from(k), 0.01)).last().unwrap();
        assert!((last - 3.0).abs() < 1e-8, "{last}");
    }

    #[test]
    fn static_driving_is_entered_after_the_dwell_and_left_at_once() {
        let mut d = StaticDetector::new(&OrientationParams::default());
        let states: Vec<bool> = (0..51).map(|_| d.step(20.0, 0.0, 0.0, 0.01)).collect();
        assert_eq!(states.iter().position(|s| *s), Some(49), "0.5 s of calm are 50 samples");
        assert!(d.step(20.0, 0.030, 0.0, 0.01), "between the limits it stays");
        assert!(!d.step(20.0, 0.036, 0.0, 0.01));
        assert!(!d.step(20.0, 0.0, 0.0, 0.01), "and has to dwell again");
        assert!(!d.step(20.0, f64::NAN, 0.0, 10.0));
    }
}
