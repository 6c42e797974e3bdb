//! Trying a claim piece by piece.

use drivescope_drive::vehicle::VehicleParams;
use drivescope_estimation::estimator::RunError;
use drivescope_estimation::registry::AnyRun;
use drivescope_simulation::{Simulation, SpecError, named_with};
use serde_json::Value;

use crate::claim::{Claim, Measure, Trial};
use crate::evidence::Evidence;
use crate::figure::{Figure, Finding};

/// Seconds simulated in one piece of work.
const SIMULATED: f64 = 5.0;
/// Epochs estimated in one piece of work.
const EPOCHS: usize = 2000;

/// A claim that could not be tried.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum PaperError {
    /// No claim has this name.
    #[error("there is no claim `{id}`; there are {known}")]
    Unknown {
        /// The name asked for.
        id: String,
        /// The names that exist.
        known: String,
    },
    /// A declaration asks for what is not there.
    #[error("the claim asks for what is not there: {0}")]
    Missing(String),
    /// A drive could not be simulated.
    #[error(transparent)]
    Drive(#[from] SpecError),
    /// An estimator could not run.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// Work of a claim that is no run of an estimator.
pub trait Work: std::fmt::Debug {
    /// Do one piece of some tens of milliseconds; the figures when all is done.
    ///
    /// # Errors
    /// When the work cannot go on.
    fn advance(&mut self) -> Result<Option<Vec<Figure>>, PaperError>;
    /// Share done, 0 to 1.
    fn fraction(&self) -> f64;
}

enum Stage {
    /// Between two trials; the next one is `Attempt::next`.
    Between,
    Simulating(Box<Simulation>),
    Estimating(Box<AnyRun>),
    Own(Box<dyn Work>),
}

/// A claim being tried.
///
/// ```
/// use drivescope_papers::{Attempt, ids};
/// let id = ids().next().ok_or("no claims")?;
/// let mut attempt = Attempt::begin(&id)?;
/// let finding = loop {
///     assert!(attempt.fraction() < 1.0);
///     if let Some(finding) = attempt.advance()? {
///         break finding;
///     }
/// };
/// assert_eq!(finding.id, id);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Attempt {
    id: String,
    claim: &'static Claim,
    next: usize,
    stage: Stage,
    evidence: Evidence,
}

impl Attempt {
    /// Begin to try the claim called `paper/claim`.
    ///
    /// # Errors
    /// [`PaperError::Unknown`], or what the claim's own work cannot begin with.
    pub fn begin(id: &str) -> Result<Self, PaperError> {
        let (_, claim) = crate::find(id)?;
        let stage = match claim.measure {
            Measure::Runs(_) => Stage::Between,
            Measure::Own(begin) => Stage::Own(begin()?),
        };
        Ok(Self { id: id.into(), claim, next: 0, stage, evidence: Evidence::default() })
    }

    /// Do one piece of work of some tens of milliseconds; what was found when all is done.
    ///
    /// # Errors
    /// When a drive cannot be simulated or an estimator cannot run.
    pub fn advance(&mut self) -> Result<Option<Finding>, PaperError> {
        match std::mem::replace(&mut self.stage, Stage::Between) {
            Stage::Own(mut work) => {
                let figures = work.advance()?;
                self.stage = Stage::Own(work);
                return Ok(figures.map(|f| Finding::new(self.id.clone(), f)));
            }
            Stage::Between => match self.claim.trials.get(self.next) {
                Some(trial) => self.stage = self.begin_trial(trial)?,
                None => return self.judge().map(Some),
            },
            Stage::Simulating(simulation) => self.simulate(simulation)?,
            Stage::Estimating(run) => self.estimate(run)?,
        }
        Ok(None)
    }

    fn begin_trial(&self, trial: &Trial) -> Result<Stage, PaperError> {
        let source = &trial.source;
        if let Some(drive) = self.evidence.drive_of(source) {
            let vehicle = trial
                .vehicle
                .map(|name| VehicleParams::preset(name).ok_or_else(|| PaperError::Missing(["car ", name].concat())));
            let run = AnyRun::new(trial.estimator, drive, &json(trial.params)?, vehicle.transpose()?.as_ref())?;
            return Ok(Stage::Estimating(Box::new(run)));
        }
        let spec = named_with(source.drive, &json(source.changes)?)?;
        Ok(Stage::Simulating(Box::new(Simulation::new(&spec, source.seed)?)))
    }

    fn simulate(&mut self, mut simulation: Box<Simulation>) -> Result<(), PaperError> {
        if !simulation.advance(SIMULATED) {
            self.stage = Stage::Simulating(simulation);
            return Ok(());
        }
        if let Some(failure) = simulation.failure() {
            return Err(failure.clone().into());
        }
        if let Some(trial) = self.claim.trials.get(self.next) {
            self.evidence.keep_drive(trial.source, simulation.finish());
        }
        Ok(())
    }

    fn estimate(&mut self, mut run: Box<AnyRun>) -> Result<(), PaperError> {
        let Some(trial) = self.claim.trials.get(self.next) else { return Ok(()) };
        let Some(drive) = self.evidence.drive_of(&trial.source) else { return Ok(()) };
        if !run.advance(drive, EPOCHS)? {
            self.stage = Stage::Estimating(run);
            return Ok(());
        }
        self.evidence.keep_run(*trial, run.into_series());
        self.next += 1;
        Ok(())
    }

    fn judge(&self) -> Result<Finding, PaperError> {
        let figures = match self.claim.measure {
            Measure::Runs(figures) => figures(&self.evidence)?,
            Measure::Own(_) => Vec::new(),
        };
        Ok(Finding::new(self.id.clone(), figures))
    }

    /// Share done, 0 to 1.
    pub fn fraction(&self) -> f64 {
        let drive = || self.evidence.drive_of(&self.claim.trials.get(self.next)?.source);
        let within = match &self.stage {
            Stage::Own(work) => return work.fraction(),
            Stage::Between => drive().map_or(0.0, |_| 0.5),
            Stage::Simulating(simulation) => 0.5 * simulation.fraction(),
            Stage::Estimating(run) => 0.5 + 0.5 * drive().map_or(0.0, |d| run.fraction(d)),
        };
        ((self.next as f64 + within) / self.claim.trials.len().max(1) as f64).min(0.999)
    }

    /// What is being done, for a progress line: the trial's name, empty between trials' ends and for own work.
    pub fn stage(&self) -> &'static str {
        self.claim.trials.get(self.next).map_or("", |t| t.name)
    }
}

/// The JSON of a declaration; empty text is an empty object.
pub(crate) fn json(text: &str) -> Result<Value, PaperError> {
    if text.is_empty() {
        return Ok(Value::Object(serde_json::Map::new()));
    }
    serde_json::from_str(text).map_err(|e| PaperError::Missing([text, ": ", &e.to_string()].concat()))
}

/// Try a claim in one go.
///
/// # Errors
/// See [`Attempt::begin`] and [`Attempt::advance`].
pub fn attempt(id: &str) -> Result<Finding, PaperError> {
    let mut attempt = Attempt::begin(id)?;
    loop {
        if let Some(finding) = attempt.advance()? {
            return Ok(finding);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_done_only_grows() {
        let mut attempt = Attempt::begin("orientation/static_vectors").unwrap();
        let mut last = 0.0;
        while attempt.advance().unwrap().is_none() {
            assert!((last..1.0).contains(&attempt.fraction()), "{last} then {}", attempt.fraction());
            last = attempt.fraction();
        }
        assert!(last > 0.7);
    }
}
