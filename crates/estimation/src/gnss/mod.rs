//! Receiver.
pub mod sight;
