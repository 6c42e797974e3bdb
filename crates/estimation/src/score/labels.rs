//! Labels of the motion mode over time, painted by hand or read from a log, and decisions against them.
//!
//! A label holds from its instant to the next one. Labels need no clock in common with what is compared with them.

use drivescope_drive::channel::Series;
use serde::{Deserialize, Serialize};

use super::mode::ModeScore;

/// From an instant on, a mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// From when, s.
    pub time: f64,
    /// Motion mode: 0 stationary, 1 straight, 2 cornering; `None` where nothing is said.
    pub mode: Option<u8>,
}

/// Labels in time order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Labels(Vec<Label>);

fn code(value: f64) -> Option<u8> {
    (0..3u8).find(|&m| value == f64::from(m))
}

impl Labels {
    /// Labels from a mode at times (s, increasing); what is no mode is no label.
    pub fn from_rows(time: &[f64], mode: &[f64]) -> Self {
        let mut labels: Vec<Label> = Vec::new();
        for (&time, &mode) in time.iter().zip(mode) {
            let mode = code(mode);
            if labels.last().map_or(mode.is_some(), |l| l.mode != mode) {
                labels.push(Label { time, mode });
            }
        }
        Self(labels)
    }

    /// Labels from a column of a series; `None` where it has no such column.
    pub fn from_series(series: &Series, column: &str) -> Option<Self> {
        Some(Self::from_rows(series.time(), series.column(column)?))
    }

    /// The labels.
    pub fn list(&self) -> &[Label] {
        &self.0
    }

    /// The mode at a time, NaN where nothing is said.
    pub fn at(&self, time: f64) -> f64 {
        let after = self.0.partition_point(|l| l.time <= time);
        after.checked_sub(1).and_then(|i| self.0[i].mode).map_or(f64::NAN, f64::from)
    }

    /// Paint a mode (`None` wipes) over a stretch of time, s; times that are not numbers or not in order paint nothing.
    pub fn paint(&mut self, from: f64, to: f64, mode: Option<u8>) {
        if !(from < to && from.is_finite() && to.is_finite()) || mode.is_some_and(|m| m > 2) {
            return;
        }
        let after = code(self.at(to));
        self.0.retain(|l| l.time < from || l.time > to);
        let place = self.0.partition_point(|l| l.time < from);
        self.0.splice(place..place, [Label { time: from, mode }, Label { time: to, mode: after }]);
        // A label that repeats the one before it says nothing.
        self.0.dedup_by(|next, kept| next.mode == kept.mode);
        if self.0.first().is_some_and(|l| l.mode.is_none()) {
            self.0.remove(0);
        }
    }

    /// Confusion and latencies of decisions at times (s) against these labels; `None` where no row has both.
    pub fn score(&self, time: &[f64], decided: &[f64]) -> Option<ModeScore> {
        let truth: Vec<f64> = time.iter().map(|&t| self.at(t)).collect();
        ModeScore::new(time, decided, &truth)
    }

    /// The same for a column of a series.
    pub fn score_series(&self, series: &Series, column: &str) -> Option<ModeScore> {
        self.score(series.time(), series.column(column)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn painted() -> Labels {
        let mut labels = Labels::default();
        labels.paint(0.0, 100.0, Some(1));
        labels.paint(0.0, 10.0, Some(0));
        labels.paint(40.0, 45.0, Some(2));
        labels
    }

    #[test]
    fn painting_cuts_what_was_there_and_joins_equal_neighbours() {
        let mut labels = painted();
        let modes = |l: &Labels, times: &[f64]| times.iter().map(|&t| l.at(t)).collect::<Vec<_>>();
        assert_eq!(modes(&labels, &[0.0, 9.9, 10.0, 39.0, 40.0, 45.0, 99.0]), [0.0, 0.0, 1.0, 1.0, 2.0, 1.0, 1.0]);
        assert!(labels.at(-1.0).is_nan() && labels.at(100.0).is_nan());
        assert_eq!(labels.list().len(), 5);
        labels.paint(38.0, 50.0, Some(1));
        assert_eq!(labels.list().len(), 3, "a corner painted over leaves no seam: {labels:?}");
        labels.paint(0.0, 5.0, None);
        assert!(labels.at(2.0).is_nan() && labels.at(6.0) == 0.0);
        let before = labels.clone();
        labels.paint(5.0, 5.0, Some(2));
        labels.paint(f64::NAN, 7.0, Some(2));
        labels.paint(5.0, 7.0, Some(9));
        assert_eq!(labels, before);
        let text = serde_json::to_string(&labels).unwrap();
        assert_eq!(serde_json::from_str::<Labels>(&text).unwrap(), labels);
    }

    /// Catches rows and columns swapped, and a latency counted from the wrong clock.
    #[test]
    fn decisions_on_another_clock_are_scored_against_the_labels() {
        let labels = painted();
        let time: Vec<f64> = (0..1200).map(|k| 0.05 + f64::from(k) * 0.1).collect();
        // Everything is decided 0.5 s late, and the corner is missed but for its second half.
        let decided: Vec<f64> = time
            .iter()
            .map(|&t| {
                if t < 10.5 {
                    0.0
                } else if (42.5..45.5).contains(&t) {
                    2.0
                } else {
                    1.0
                }
            })
            .collect();
        let score = labels.score(&time, &decided).unwrap();
        assert_eq!(score.count, 1000);
        assert_eq!(score.confusion, [[100, 0, 0], [5, 840, 5], [0, 25, 25]]);
        assert!((score.launch.mean - 0.5).abs() < 1e-9 && (score.corner_entry.mean - 2.5).abs() < 1e-9);
        assert!(labels.score(&[200.0], &[1.0]).is_none());
    }

    #[test]
    fn labels_of_a_log_are_its_changes() {
        let time: Vec<f64> = (0..100).map(f64::from).collect();
        let mode: Vec<f64> = time
            .iter()
            .map(|&t| {
                if t < 5.0 {
                    f64::NAN
                } else if t < 30.0 {
                    0.0
                } else {
                    1.0
                }
            })
            .collect();
        let labels = Labels::from_rows(&time, &mode);
        assert_eq!(labels.list(), [Label { time: 5.0, mode: Some(0) }, Label { time: 30.0, mode: Some(1) }]);
        assert_eq!(labels.score(&time, &mode).unwrap().accuracy, 1.0);
    }
}
