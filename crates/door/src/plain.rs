//! What crosses a door as plain objects.

use serde::Serialize;
use wasm_bindgen::prelude::*;

/// An error whose message is the sentence for the user.
pub fn sentence(error: impl std::fmt::Display) -> JsError {
    JsError::new(&error.to_string())
}

/// A plain object: maps become objects, no number becomes a BigInt.
///
/// # Errors
/// The sentence of what cannot become one.
pub fn plain(value: &impl Serialize) -> Result<JsValue, JsError> {
    value.serialize(&serde_wasm_bindgen::Serializer::json_compatible()).map_err(sentence)
}

/// How far a piece of long work has come.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Progress {
    /// Whether it has finished.
    pub done: bool,
    /// Share done, 0 to 1.
    pub fraction: f64,
    /// What is being done.
    pub stage: &'static str,
    /// Rows or samples so far; 0 where they mean nothing.
    pub rows: usize,
}
