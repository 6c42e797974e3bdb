//! What the doors to JavaScript share: plain objects, sentences for the user, progress, and a drive on its way out.

mod handover;
mod plain;

pub use handover::Handover;
pub use plain::{Progress, plain, sentence};
