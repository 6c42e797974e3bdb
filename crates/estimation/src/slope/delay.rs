//! The inertial samples of a moment ago, for a wheel speed that comes late.

use std::collections::VecDeque;

use drivescope_drive::signals::Imu;

/// Samples kept at most: 0.3 s at 3 kHz.
const LONGEST: usize = 1024;

/// Inertial samples on their way through a delay; without a delay nothing is kept.
#[derive(Clone, Debug)]
pub(super) struct DelayLine {
    delay: f64,
    samples: VecDeque<(f64, Imu)>,
}

impl DelayLine {
    pub(super) fn new(delay: f64) -> Self {
        Self { delay, samples: VecDeque::new() }
    }

    /// Take in the sample of `time` and give back that of `delay` ago, linear between samples; NaN before the first one.
    pub(super) fn pass(&mut self, time: f64, sample: Imu) -> Imu {
        if self.delay <= 0.0 {
            return sample;
        }
        if !time.is_finite() || self.samples.back().is_some_and(|last| time <= last.0) {
            return Imu::default();
        }
        if self.samples.len() == LONGEST {
            self.samples.pop_front();
        }
        self.samples.push_back((time, sample));
        let due = time - self.delay;
        while self.samples.get(1).is_some_and(|next| next.0 <= due) {
            self.samples.pop_front();
        }
        match (self.samples.front(), self.samples.get(1)) {
            (Some((t0, a)), Some((t1, b))) if *t0 <= due => {
                let share = (due - t0) / (t1 - t0);
                let mix = |a: f64, b: f64| a + (b - a) * share;
                Imu {
                    accel_x: mix(a.accel_x, b.accel_x),
                    accel_y: mix(a.accel_y, b.accel_y),
                    gyro_z: mix(a.gyro_z, b.gyro_z),
                    ..Imu::default()
                }
            }
            _ => Imu::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_comes_back_as_it_was_a_delay_ago() {
        let mut line = DelayLine::new(0.035);
        for k in 0..200 {
            let time = f64::from(k) * 0.01;
            let back = line.pass(time, Imu { accel_x: 3.0 * time, ..Imu::default() }).accel_x;
            // From the first sample at or before the due time on; rounding only.
            if time < 0.035 { assert!(back.is_nan()) } else { assert!((back - 3.0 * (time - 0.035)).abs() < 1e-12) }
        }
        assert!(line.samples.len() <= 6, "old samples leave");
        assert!(line.pass(f64::NAN, Imu::default()).accel_x.is_nan());
    }
}
