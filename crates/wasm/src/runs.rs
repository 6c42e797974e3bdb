//! The runs of a session: for each estimator the one under way, the current result and the one before it.

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_estimation::estimator::Notice;
use drivescope_estimation::registry::{AnyRun, ESTIMATORS};
use drivescope_estimation::score::change::{Comparison, compare};
use drivescope_estimation::score::{Score, score};
use serde_json::Value;

use crate::reports::RunReport;

/// A run that has ended.
pub struct Finished {
    name: &'static str,
    params: Value,
    /// Its estimates.
    pub series: Series,
    notices: Vec<Notice>,
    score: Score,
    seconds: f64,
}

impl Finished {
    /// What it did and how good it was.
    pub fn report(&self) -> RunReport<'_> {
        let time = self.series.time();
        RunReport {
            estimator: self.name,
            params: &self.params,
            rows: time.len(),
            start: time.first().copied().unwrap_or(f64::NAN),
            end: time.last().copied().unwrap_or(f64::NAN),
            seconds: self.seconds,
            notices: &self.notices,
            score: &self.score,
        }
    }
}

/// The runs of one estimator.
#[derive(Default)]
pub struct Slot {
    /// Under way.
    pub running: Option<AnyRun>,
    /// Computing time of the run under way, s.
    pub seconds: f64,
    /// The latest result.
    pub current: Option<Finished>,
    /// The result before it.
    pub previous: Option<Finished>,
    /// Whether the previous result stays where it is while further runs end.
    pub keeps_previous: bool,
}

impl Slot {
    /// End the run under way: it becomes the current result, the current one the previous unless that is kept.
    pub fn finish(&mut self, drive: &Drive) {
        let Some(run) = self.running.take() else { return };
        let (name, params, notices) = (run.info.name, run.params.clone(), run.notices().to_vec());
        let series = run.into_series();
        let score = score(&series, drive, None);
        let finished = Finished { name, params, series, notices, score, seconds: self.seconds };
        let replaced = self.current.replace(finished);
        if !(self.keeps_previous && self.previous.is_some()) {
            self.previous = replaced;
        }
    }

    /// What changed from the previous to the current result.
    pub fn change(&self) -> Option<Comparison> {
        Some(compare(&self.previous.as_ref()?.score, &self.current.as_ref()?.score))
    }

    /// The estimates of `current`, `previous` or `running`.
    pub fn series(&self, which: &str) -> Option<&Series> {
        match which {
            "current" => self.current.as_ref().map(|f| &f.series),
            "previous" => self.previous.as_ref().map(|f| &f.series),
            "running" => self.running.as_ref().map(AnyRun::series),
            _ => None,
        }
    }
}

/// Index of an estimator in the list, which is also the index of its slot.
pub fn slot_index(name: &str) -> Option<usize> {
    ESTIMATORS.iter().position(|e| e.name == name)
}
