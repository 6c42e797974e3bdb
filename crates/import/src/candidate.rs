//! What a column may be, how sure that is, and columns that are nothing.

use serde::Serialize;

/// How sure an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Confidence {
    /// A guess that people should look at.
    Guess,
    /// An alias, a unit by convention, or a unit that physics confirms.
    Likely,
    /// A canonical name or a stated unit.
    Certain,
}

/// A column that the mapping leaves out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Unused {
    /// Raw column.
    pub column: String,
    /// Why it is left out.
    pub reason: String,
}

/// An entry in the making.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub signal: String,
    pub column: usize,
    pub unit: String,
    /// Whether the file states the unit.
    pub stated: bool,
    pub scale: f64,
    pub rank: u8,
    pub why: Vec<String>,
    pub confidence: Confidence,
}
