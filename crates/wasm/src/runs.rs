//! The runs of a session: for each estimator the one under way, the current result and the one before it.

use std::cell::OnceCell;

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_estimation::estimator::Notice;
use drivescope_estimation::registry::{AnyRun, ESTIMATORS};
use drivescope_estimation::score::change::{Comparison, compare};
use drivescope_estimation::score::errors::errors;
use drivescope_estimation::score::{Score, score};
use serde_json::Value;

use crate::reports::RunReport;

/// A run that has ended.
pub struct Finished {
    name: &'static str,
    /// Every parameter's value.
    pub params: Value,
    /// Its estimates.
    pub series: Series,
    notices: Vec<Notice>,
    score: Score,
    seconds: f64,
    errors: OnceCell<Option<Series>>,
}

impl Finished {
    /// Its errors against the truth of its drive, made when they are first looked at.
    fn errors(&self, drive: &Drive) -> Option<&Series> {
        self.errors.get_or_init(|| errors(&self.series, drive)).as_ref()
    }

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
        let finished =
            Finished { name, params, series, notices, score, seconds: self.seconds, errors: OnceCell::new() };
        let replaced = self.current.replace(finished);
        if !(self.keeps_previous && self.previous.is_some()) {
            self.previous = replaced;
        }
    }

    /// What changed from the previous to the current result.
    pub fn change(&self) -> Option<Comparison> {
        Some(compare(&self.previous.as_ref()?.score, &self.current.as_ref()?.score))
    }

    /// The estimates of `current`, `previous` or `running`; with `current_errors` or `previous_errors` estimate less truth.
    pub fn series(&self, which: &str, drive: &Drive) -> Option<&Series> {
        match which {
            "current_errors" => self.current.as_ref()?.errors(drive),
            "previous_errors" => self.previous.as_ref()?.errors(drive),
            "current" => self.current.as_ref().map(|f| &f.series),
            "previous" => self.previous.as_ref().map(|f| &f.series),
            "running" => self.running.as_ref().map(AnyRun::series),
            _ => None,
        }
    }
}

/// The slots of a session by name: one for each estimator, and those of further runs, `orientation@triad`.
pub struct Slots(Vec<(String, Slot)>);

impl Slots {
    /// An empty slot for each estimator.
    pub fn new() -> Self {
        Self(ESTIMATORS.iter().map(|e| (e.name.to_owned(), Slot::default())).collect())
    }

    /// The slot of this name.
    pub fn get(&self, name: &str) -> Option<&Slot> {
        self.0.iter().find(|(n, _)| n == name).map(|(_, slot)| slot)
    }

    /// The slot of this name, to be changed.
    pub fn get_mut(&mut self, name: &str) -> Option<&mut Slot> {
        self.0.iter_mut().find(|(n, _)| n == name).map(|(_, slot)| slot)
    }

    /// Put a run in the slot of this name, which is made where there is none.
    pub fn start(&mut self, name: &str, run: AnyRun) {
        if self.get(name).is_none() {
            self.0.push((name.to_owned(), Slot::default()));
        }
        if let Some(slot) = self.get_mut(name) {
            (slot.running, slot.seconds) = (Some(run), 0.0);
        }
    }

    /// Forget a further run with its results; the slots of estimators stay.
    pub fn forget(&mut self, name: &str) {
        self.0.retain(|(n, _)| n != name || estimator_of(n) == n);
    }
}

/// The estimator of a slot: its name up to `@`.
pub fn estimator_of(name: &str) -> &str {
    name.split_once('@').map_or(name, |(estimator, _)| estimator)
}
