//! The second door between the core and JavaScript: the claims of the papers, and closed loops.
//!
//! The page loads this module when the gallery is opened; what it loads at its opening knows neither controllers nor
//! claims. No view into wasm memory outlives a call. No arithmetic happens here.

mod attempt;
mod closed_loop;

pub use attempt::{Attempt, paper_catalogue};
pub use closed_loop::{DrivenLoop, loop_catalogue};
