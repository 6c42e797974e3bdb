//! Why a command ends early: one clear sentence.

use std::fmt;

/// The sentence shown to the person who ran the command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure(pub String);

impl fmt::Display for Failure {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.0)
    }
}

/// What every step returns.
pub type Result<T> = std::result::Result<T, Failure>;

/// A failure with this sentence.
pub fn fail<T>(sentence: impl Into<String>) -> Result<T> {
    Err(Failure(sentence.into()))
}

/// Says what was being done when something else failed.
pub trait Explain<T> {
    /// Turn the error into `cannot <what>: <error>`.
    ///
    /// # Errors
    ///
    /// The error that was there, with the sentence in front.
    fn when(self, what: impl FnOnce() -> String) -> Result<T>;
}

impl<T, E: fmt::Display> Explain<T> for std::result::Result<T, E> {
    fn when(self, what: impl FnOnce() -> String) -> Result<T> {
        self.map_err(|error| Failure(format!("cannot {}: {error:#}", what())))
    }
}
