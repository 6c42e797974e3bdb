//! The runs of a claim's trials, and errors against truth taken from them.

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;
use drivescope_estimation::score::reference::TruthTable;

use crate::attempt::PaperError;
use crate::claim::{Source, Trial};

/// What the trials of a claim gave.
#[derive(Debug, Default)]
pub struct Evidence {
    drives: Vec<(Source, Drive)>,
    runs: Vec<(Trial, Series)>,
}

impl Evidence {
    pub(crate) fn drive_of(&self, source: &Source) -> Option<&Drive> {
        self.drives.iter().find(|(s, _)| s == source).map(|(_, d)| d)
    }
    pub(crate) fn keep_drive(&mut self, source: Source, drive: Drive) {
        self.drives.push((source, drive));
    }
    pub(crate) fn keep_run(&mut self, trial: Trial, series: Series) {
        self.runs.push((trial, series));
    }

    /// Drive and estimates of a trial by its name.
    ///
    /// # Errors
    /// [`PaperError::Missing`] where no trial has this name.
    pub fn run(&self, trial: &str) -> Result<(&Drive, &Series), PaperError> {
        let found = self.runs.iter().find(|(t, _)| t.name == trial);
        found
            .and_then(|(t, series)| Some((self.drive_of(&t.source)?, series)))
            .ok_or_else(|| PaperError::Missing(["trial ", trial].concat()))
    }

    /// Estimate less truth of a column, over the rows in which both have a value.
    ///
    /// # Errors
    /// [`PaperError::Missing`] where the trial, the column or its truth is missing.
    pub fn errors(&self, trial: &str, column: &str) -> Result<Errors, PaperError> {
        let (drive, series) = self.run(trial)?;
        let missing = || PaperError::Missing([column, " of ", trial].concat());
        let index = series.index_of(column).ok_or_else(missing)?;
        let schema = &series.schema()[index];
        let mut table = TruthTable::new(drive, series.time());
        let truth = table.get(schema.truth.unwrap_or(column)).ok_or_else(missing)?;
        let circular = schema.is_circular();
        let rows = series.time().iter().zip(series.column_at(index)).zip(truth);
        let errors = rows
            .map(|((&t, e), truth)| (t, if circular { wrap_angle(e - truth) } else { e - truth }))
            .filter(|(_, e)| e.is_finite());
        Ok(Errors(errors.collect()))
    }

    /// A truth signal at the times of a trial's estimates; NaN where it has no value.
    ///
    /// # Errors
    /// [`PaperError::Missing`] where the trial or the signal is missing.
    pub fn truth(&self, trial: &str, signal: &str) -> Result<Vec<f64>, PaperError> {
        let (drive, series) = self.run(trial)?;
        let mut table = TruthTable::new(drive, series.time());
        let values = table.get(signal).map(<[f64]>::to_vec);
        values.ok_or_else(|| PaperError::Missing(["truth ", signal].concat()))
    }
}

/// Times (s) and errors, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors(pub Vec<(f64, f64)>);

impl Errors {
    /// Those from `start` to `end`, s.
    pub fn within(&self, start: f64, end: f64) -> Self {
        self.when(|t| (start..=end).contains(&t))
    }
    /// Those at the times that `keep` accepts.
    pub fn when(&self, keep: impl Fn(f64) -> bool) -> Self {
        Self(self.0.iter().copied().filter(|(t, _)| keep(*t)).collect())
    }
    /// Root mean square; NaN without errors.
    pub fn rms(&self) -> f64 {
        (self.0.iter().map(|(_, e)| e * e).sum::<f64>() / self.0.len() as f64).sqrt()
    }
    /// Mean; NaN without errors.
    pub fn mean(&self) -> f64 {
        self.0.iter().map(|(_, e)| e).sum::<f64>() / self.0.len() as f64
    }
    /// Largest magnitude; NaN without errors.
    pub fn largest(&self) -> f64 {
        self.0.iter().map(|(_, e)| e.abs()).fold(f64::NAN, f64::max)
    }
}
