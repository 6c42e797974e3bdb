//! What the doors to JavaScript share: plain objects, sentences for the user, progress, and a drive on its way from
//! one module to another.

mod arrival;
mod handover;
mod plain;

pub use arrival::{Arrival, Arrived};
pub use handover::Handover;
pub use plain::{Progress, plain, sentence};
