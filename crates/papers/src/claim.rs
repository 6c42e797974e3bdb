//! What a paper says, and how it is tried.

use serde::Serialize;

use crate::attempt::{PaperError, Work};
use crate::evidence::Evidence;
use crate::figure::Figure;

/// A paper and what it claims.
#[derive(Debug, Serialize)]
pub struct Paper {
    /// Name of the chapter, as in `orientation`.
    pub id: &'static str,
    /// Authors and year.
    pub authors: &'static str,
    /// Title.
    pub title: &'static str,
    /// What is different here from the paper's own experiments, in a sentence or two: car, sensors, tuning, drives.
    pub setting: &'static str,
    /// Its claims, in the paper's order.
    pub claims: &'static [Claim],
}

/// One thing that a paper says and that can be tried.
#[derive(Debug, Serialize)]
pub struct Claim {
    /// Name inside the chapter, as in `static_vectors`.
    pub id: &'static str,
    /// Where it stands: section, table or figure.
    pub place: &'static str,
    /// What it says, in one plain sentence.
    pub says: &'static str,
    /// Why it comes out as it does here, in a sentence or two without numbers.
    pub remark: &'static str,
    /// The drives and estimators that try it; each can be opened on its own.
    pub trials: &'static [Trial],
    /// How the figures come about.
    #[serde(skip)]
    pub measure: Measure,
}

/// How the figures of a claim come about.
#[derive(Clone, Copy, Debug)]
pub enum Measure {
    /// From the runs of the claim's trials.
    Runs(fn(&Evidence) -> Result<Vec<Figure>, PaperError>),
    /// By work of the claim's own, for what is not a run of an estimator; the trials only name what it drives.
    Own(fn() -> Result<Box<dyn Work>, PaperError>),
}

/// One estimator on one drive.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Trial {
    /// Name for people and for [`Evidence`], unique in its claim, as in `lane change, switch`.
    pub name: &'static str,
    /// The drive.
    pub source: Source,
    /// Name of the estimator.
    pub estimator: &'static str,
    /// Its parameters, a JSON object; empty for the defaults.
    pub params: &'static str,
    /// The car that the estimator assumes, by name; the drive's own without it.
    pub vehicle: Option<&'static str>,
}

impl Trial {
    /// An estimator on a drive, with parameters as a JSON object (empty for the defaults) and the drive's own car.
    pub const fn new(name: &'static str, source: Source, estimator: &'static str, params: &'static str) -> Self {
        Self { name, source, estimator, params, vehicle: None }
    }
    /// Assuming another car.
    pub const fn assuming(mut self, vehicle: &'static str) -> Self {
        self.vehicle = Some(vehicle);
        self
    }
}

/// A built-in drive, as it is or changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Source {
    /// Name of the built-in drive.
    pub drive: &'static str,
    /// Fields that replace those of the drive's own file, a JSON object; empty for none.
    pub changes: &'static str,
    /// Seed of the noise; the drive's own without it.
    pub seed: Option<u64>,
}

impl Source {
    /// A built-in drive as it is.
    pub const fn named(drive: &'static str) -> Self {
        Self { drive, changes: "", seed: None }
    }
    /// With fields of its file replaced (a JSON object).
    pub const fn changed(mut self, changes: &'static str) -> Self {
        self.changes = changes;
        self
    }
    /// With another seed.
    pub const fn seeded(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }
}
