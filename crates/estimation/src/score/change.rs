//! Two scores side by side: did a change of tuning make the run better?

use super::{Metric, Score};

/// Relative change below which two numbers count as equal.
pub const INDIFFERENCE: f64 = 0.005;

/// What a [`Change`] compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Root mean square error of one column against truth: smaller is better.
    Rmse,
    /// Mean of the root mean square errors of roll, pitch and yaw: smaller is better.
    AttitudeRmse,
    /// Root mean square horizontal distance from truth: smaller is better.
    HorizontalRmse,
    /// Share of rows with the right motion mode: larger is better.
    ModeAccuracy,
    /// Mean normalized innovation squared per degree of freedom: nearer 1 is better.
    Consistency,
}

/// One number before and after.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Change {
    /// What is compared.
    pub measure: Measure,
    /// Of which column; the quantity's name where it is of several.
    pub column: String,
    /// Unit of `before` and `after`.
    pub unit: String,
    /// Before.
    pub before: f64,
    /// After.
    pub after: f64,
    /// `after / before`; 1 where they are equal.
    pub ratio: f64,
    /// Whether it got better; `None` within [`INDIFFERENCE`], or where it cannot be said.
    pub better: Option<bool>,
}

/// Everything that changed between two runs.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// The one number to print: position, mode, attitude, grade, the first column with truth, else consistency.
    pub headline: Option<Change>,
    /// Every column with truth in both.
    pub metrics: Vec<Change>,
    /// Every innovation sequence in both.
    pub consistency: Vec<Change>,
}

impl Change {
    fn new(measure: Measure, column: &str, unit: &str, before: f64, after: f64) -> Self {
        // What is judged is a distance from perfect, smaller is better.
        let distance = |v: f64| match measure {
            Measure::ModeAccuracy => 1.0 - v,
            Measure::Consistency => v.ln().abs(),
            _ => v,
        };
        Self {
            measure,
            column: column.into(),
            unit: unit.into(),
            before,
            after,
            ratio: if before == after { 1.0 } else { after / before },
            better: is_better(distance(before), distance(after)),
        }
    }
}

fn is_better(before: f64, after: f64) -> Option<bool> {
    let step = after - before;
    // Also false for NaN.
    (step.abs() > INDIFFERENCE * before.abs()).then_some(step < 0.0)
}

/// Compare two scores of the same estimator on the same drive.
pub fn compare(before: &Score, after: &Score) -> Comparison {
    let metrics: Vec<Change> = (before.metrics.iter())
        .filter_map(|b| after.metrics.iter().find(|a| a.column == b.column).map(|a| (b, a)))
        .map(|(b, a)| Change::new(Measure::Rmse, &b.column, &b.unit, b.rmse, a.rmse))
        .collect();
    let consistency: Vec<Change> = (before.consistency.iter())
        .filter_map(|b| after.consistency.iter().find(|a| a.column == b.column).map(|a| (b, a)))
        .map(|(b, a)| Change::new(Measure::Consistency, &b.column, "1", b.mean, a.mean))
        .collect();
    let headline = headline(before, after, &metrics, &consistency);
    Comparison { headline, metrics, consistency }
}

fn headline(before: &Score, after: &Score, metrics: &[Change], consistency: &[Change]) -> Option<Change> {
    if let (Some(b), Some(a)) = (&before.position, &after.position) {
        return Some(Change::new(Measure::HorizontalRmse, "position", "m", b.rmse_horizontal, a.rmse_horizontal));
    }
    if let (Some(b), Some(a)) = (&before.mode, &after.mode) {
        return Some(Change::new(Measure::ModeAccuracy, "mode", "1", b.accuracy, a.accuracy));
    }
    if let (Some(b), Some(a)) = (attitude(&before.metrics), attitude(&after.metrics)) {
        return Some(Change::new(Measure::AttitudeRmse, "attitude", "rad", b, a));
    }
    if let Some(first) = metrics.iter().find(|m| m.column == "grade").or(metrics.first()) {
        return Some(first.clone());
    }
    // Without truth: the mean departure of all sequences, as a factor of the variance.
    let departure = |pick: fn(&Change) -> f64| {
        let logs = consistency.iter().map(|c| pick(c).ln().abs());
        (logs.sum::<f64>() / consistency.len() as f64).exp()
    };
    (!consistency.is_empty())
        .then(|| Change::new(Measure::Consistency, "innovations", "1", departure(|c| c.before), departure(|c| c.after)))
}

/// Mean of the errors of roll, pitch and yaw, rad; `None` without roll and pitch.
fn attitude(metrics: &[Metric]) -> Option<f64> {
    let rmse = |truth: &str| metrics.iter().find(|m| m.truth == truth).map(|m| m.rmse);
    let tilt = rmse("roll")? + rmse("pitch")?;
    Some(rmse("yaw").map_or(tilt / 2.0, |yaw| (tilt + yaw) / 3.0))
}
