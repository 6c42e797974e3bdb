//! What the road filter keeps to take back the last moments before its gate shut.
//!
//! A disturbance grows before it is strange enough to be left out, and until then the filter follows it. When the gate
//! shuts, the filter goes back to a state of before and carries it forward again without fields. Beyond SPEC orientation 9.

use super::detector::Derivative;
use super::road_model::{Covariance, State};
use super::sample::Sample;

/// What a sample changes in the filter, but for its gate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    pub(super) x: State,
    pub(super) p: Covariance,
    pub(super) yaw_acceleration: Derivative,
    pub(super) forward: [Option<f64>; 2],
    pub(super) age: f64,
}

/// Two states of the filter and the samples since the older one, which is between one and two spans old.
#[derive(Clone, Debug)]
pub(super) struct Hindsight {
    span: f64,
    older: Option<Kept>,
    newer: Option<Kept>,
    samples: Vec<Sample>,
    /// How many of the samples came before the newer state.
    between: usize,
    /// Time since the newer state, s.
    since: f64,
}

impl Hindsight {
    /// To go back by at least `span` s; not at all for 0.
    pub(super) fn new(span: f64) -> Self {
        Self { span, older: None, newer: None, samples: Vec::new(), between: 0, since: 0.0 }
    }

    /// Note a sample that is about to be taken by a filter in the state `now`.
    #[inline]
    pub(super) fn note(&mut self, sample: &Sample, now: impl FnOnce() -> Kept) {
        if self.span <= 0.0 {
            return;
        }
        if self.newer.is_none() || self.since >= self.span {
            self.keep(now());
        }
        self.samples.push(Sample { field: None, ..*sample });
        self.since += sample.dt;
    }

    fn keep(&mut self, now: Kept) {
        self.samples.drain(..self.between);
        self.between = self.samples.len();
        self.older = self.newer.replace(now);
        self.since = 0.0;
    }

    /// The state of before and the samples since; nothing where the gate has not been open for a span.
    pub(super) fn take(&mut self) -> Option<(Kept, Vec<Sample>)> {
        (self.newer, self.between) = (None, 0);
        let samples = std::mem::take(&mut self.samples);
        self.older.take().map(|older| (older, samples))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orientation::model::{Input, PitchDrive};

    fn sample() -> Sample {
        Sample {
            input: Input { yaw_rate: 0.0, accel_y: 0.0, pitch: PitchDrive::Given(0.0) },
            speed: 20.0,
            speed_change: 0.0,
            accel_x: None,
            is_fresh: true,
            field: None,
            is_static: false,
            dt: 0.01,
        }
    }

    /// A state that tells its sample.
    fn state(k: usize) -> Kept {
        let derivative = Derivative::of_speed();
        Kept {
            x: State::zeros(),
            p: Covariance::zeros(),
            yaw_acceleration: derivative,
            forward: [None; 2],
            age: k as f64,
        }
    }

    #[test]
    fn a_state_of_at_least_a_span_ago_comes_back_with_every_sample_since() {
        // Catches a sample that is replayed twice or lost at a change of states.
        for count in [1, 49, 51, 99, 101, 149, 151, 998, 1003] {
            let mut h = Hindsight::new(0.5);
            (0..count).for_each(|k| h.note(&sample(), || state(k)));
            let Some((kept, samples)) = h.take() else {
                assert!(count <= 51, "{count}");
                continue;
            };
            assert_eq!(samples.len(), count - kept.age as usize, "{count}");
            assert!((50..=102).contains(&samples.len()), "{count}: {}", samples.len());
            assert!(h.take().is_none(), "once");
            h.note(&sample(), || state(7));
            assert!(h.take().is_none(), "not before the gate has been open for a span again");
        }
    }

    #[test]
    fn a_span_of_zero_keeps_nothing() {
        let mut h = Hindsight::new(0.0);
        (0..500).for_each(|k| h.note(&sample(), || state(k)));
        assert!(h.take().is_none() && h.samples.capacity() == 0);
    }
}
