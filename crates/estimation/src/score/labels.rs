//! Labels of the motion mode over time, painted by hand or read from a log, and decisions against them.
//!
//! A label holds from its instant to the next one. Labels need no clock in common with what is compared with them.
//! As a file they are JSON (`[{"time": 0.0, "mode": 0}, ..]`) or CSV (`t,truth_mode`, an empty cell where nothing is said).

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

/// A text that holds no labels.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error("row {row}: {what}")]
pub struct LabelError {
    /// Which row of the CSV (the heading is 1), or which label of the JSON (from 1).
    pub row: usize,
    /// What was expected and what was found.
    pub what: String,
}

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

    /// Labels of a JSON or CSV text, with times in increasing order.
    ///
    /// # Errors
    /// [`LabelError`] with the row that is no label.
    pub fn from_text(text: &str) -> Result<Self, LabelError> {
        let error = |row: usize, what: String| LabelError { row, what };
        let text = text.trim_start_matches('\u{feff}').trim();
        let is_json = text.starts_with('[');
        let rows: Vec<Label> = if is_json {
            serde_json::from_str(text).map_err(|e| error(1, e.to_string()))?
        } else {
            let mut lines = text.lines();
            let heading = lines.next().unwrap_or_default().trim();
            if heading != HEADING {
                return Err(error(1, ["expected the heading `", HEADING, "`, found `", heading, "`"].concat()));
            }
            let cells = lines.enumerate().filter(|(_, line)| !line.trim().is_empty());
            cells.map(|(i, line)| row(line).ok_or_else(|| error(i + 2, refusal(line)))).collect::<Result<_, _>>()?
        };
        let mut labels = Self::default();
        let mut last = f64::NEG_INFINITY;
        for (i, label) in rows.iter().enumerate() {
            let place = i + if is_json { 1 } else { 2 };
            if !(label.time > last && label.time.is_finite()) {
                return Err(error(place, "its time is not later than the one before".into()));
            }
            if label.mode.is_some_and(|m| m > 2) {
                return Err(error(place, "modes are 0 stationary, 1 straight, 2 cornering".into()));
            }
            last = label.time;
            if labels.0.last().map_or(label.mode.is_some(), |l| l.mode != label.mode) {
                labels.0.push(*label);
            }
        }
        Ok(labels)
    }

    /// The labels as CSV, a row a label.
    pub fn to_csv(&self) -> String {
        let mut text = [HEADING, "\n"].concat();
        for Label { time, mode } in &self.0 {
            let mode = mode.map_or("", |m| ["0", "1", "2"][usize::from(m.min(2))]);
            text += &[&time.to_string(), ",", mode, "\n"].concat();
        }
        text
    }

    /// The labels as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
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

/// The first line of labels as CSV.
const HEADING: &str = "t,truth_mode";

/// A row of the CSV.
fn row(line: &str) -> Option<Label> {
    let (time, mode) = line.split_once(',')?;
    let time = time.trim().parse().ok().filter(|t: &f64| t.is_finite())?;
    let mode = match mode.trim() {
        "" | "nan" => None,
        mode => Some(mode.parse::<f64>().ok().and_then(code)?),
    };
    Some(Label { time, mode })
}

fn refusal(line: &str) -> String {
    ["expected a time and a mode (0, 1, 2 or empty), found `", line.trim(), "`"].concat()
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

    /// Catches a label lost or moved by saving, and a bad row that is passed over in silence.
    #[test]
    fn labels_come_back_from_both_files_and_a_bad_row_is_named() {
        let mut labels = painted();
        labels.paint(60.0, 70.5, None);
        assert_eq!(Labels::from_text(&labels.to_csv()).unwrap(), labels);
        assert_eq!(Labels::from_text(&labels.to_json()).unwrap(), labels);
        assert_eq!(labels.to_csv().lines().next(), Some("t,truth_mode"));
        let refused = |text: &str| Labels::from_text(text).unwrap_err();
        assert_eq!(refused("t,truth_mode\n0,1\n0.5,3\n").row, 3);
        assert_eq!(refused("t,truth_mode\n0,1\n0,2\n").row, 3);
        assert_eq!(refused("t,mode\n0,1\n").row, 1);
        assert_eq!(refused(r#"[{"time": 1, "mode": 1}, {"time": 0, "mode": 2}]"#).row, 2);
        assert_eq!(refused(r#"[{"time": 1, "mode": 7}]"#).row, 1);
        assert_eq!(Labels::from_text("t,truth_mode\n1,1\n2,1\n3,\n").unwrap().list().len(), 2);
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
