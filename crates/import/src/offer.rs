//! What would make a file fit that is refused for its size.

use serde::Serialize;

/// What would make a file fit that does not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Offer {
    /// So many columns beside the clock, 0 if not even one fits.
    pub columns: usize,
    /// A part of so many seconds; NaN where the clock is not known.
    pub seconds: f64,
    /// Every nth row.
    pub every: usize,
}

impl std::fmt::Display for Offer {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        if self.columns > 0 {
            write!(f, "at most {} columns beside the clock, ", self.columns)?;
        }
        if self.seconds >= 1.0 {
            write!(f, "at most {} s of it, ", self.seconds as u64)?;
        }
        write!(f, "or one row in {}", self.every)
    }
}
