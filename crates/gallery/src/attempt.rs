//! Claims for the page: list them, try one piece by piece, look at what came out.

use drivescope_door::{Progress, plain, sentence};
use drivescope_papers::{Attempt as Trying, Finding, PAPERS};
use js_sys::Date;
use wasm_bindgen::prelude::*;

/// The papers with their claims, a chapter each; a chapter without claims is one that is still to be written.
#[wasm_bindgen]
pub fn paper_catalogue() -> Result<JsValue, JsError> {
    plain(&PAPERS)
}

/// A claim that is being tried. Lives in a worker.
#[wasm_bindgen]
pub struct Attempt {
    trying: Trying,
    finding: Option<Finding>,
}

#[wasm_bindgen]
impl Attempt {
    /// Begin to try the claim called `paper/claim`.
    #[wasm_bindgen(constructor)]
    pub fn new(id: &str) -> Result<Self, JsError> {
        let trying = Trying::begin(id).map_err(sentence)?;
        Ok(Self { trying, finding: None })
    }

    /// Go on for about `budget_ms`; the stage is the name of the trial under way, empty for work of the claim's own.
    pub fn run_some(&mut self, budget_ms: f64) -> Result<JsValue, JsError> {
        let deadline = Date::now() + budget_ms;
        while self.finding.is_none() {
            self.finding = self.trying.advance().map_err(sentence)?;
            if Date::now() >= deadline {
                break;
            }
        }
        let done = self.finding.is_some();
        let fraction = if done { 1.0 } else { self.trying.fraction() };
        plain(&Progress { done, fraction, stage: self.trying.stage(), rows: 0 })
    }

    /// The figures and the verdict; `null` before the end. A limit that is not there is infinite.
    pub fn result(&self) -> Result<JsValue, JsError> {
        plain(&self.finding)
    }
}
