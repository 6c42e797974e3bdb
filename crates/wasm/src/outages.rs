//! Runs with a sensor blinded, how far they drift, and a sweep of the window over the whole drive.

use drivescope_door::{Progress, plain, sentence};
use drivescope_estimation::blindfold::{Blindfold, Sensor};
use drivescope_estimation::outage::{Distribution, Drift, Sweep, SweepPlan, drift};
use drivescope_estimation::registry::AnyRun;
use js_sys::Date;
use serde::Serialize;
use serde_json::Value;
use wasm_bindgen::prelude::*;

use crate::runs::estimator_of;
use crate::session::{EPOCHS, Session, vehicle};

#[derive(Serialize)]
struct Swept<'a> {
    drifts: &'a [Drift],
    distribution: Vec<Distribution>,
}

fn sensor(name: &str) -> Result<Sensor, JsError> {
    serde_json::from_value(Value::from(name)).map_err(sentence)
}

/// Windows from a flat list: begin, end, begin, end, ...
fn windows(flat: &[f64]) -> Vec<(f64, f64)> {
    flat.chunks_exact(2).map(|w| (w[0], w[1])).collect()
}

#[wasm_bindgen]
impl Session {
    /// Like `begin_run`, for a further run (`gnss_ins@blind`) to which `gnss`, `mag` or `odometer` is blind in some windows:
    /// one sensor for each window (begin, end, begin, end, ...; s).
    pub fn begin_blind_run(
        &mut self,
        name: &str,
        params: JsValue,
        car: Option<String>,
        sensors: Vec<String>,
        flat: &[f64],
    ) -> Result<(), JsError> {
        let params: Value = serde_wasm_bindgen::from_value(params).map_err(sentence)?;
        let vehicle = vehicle(car)?;
        let mut run = AnyRun::new(estimator_of(name), &self.drive, &params, vehicle.as_ref()).map_err(sentence)?;
        for (name, window) in sensors.iter().zip(windows(flat)) {
            run.blind(Blindfold { sensor: sensor(name)?, windows: vec![window] });
        }
        self.slots.start(name, run);
        Ok(())
    }

    /// How the current result of `blinded` went off in windows: against the truth, or, where the drive has none, against the
    /// current result of `seeing`.
    pub fn drift(&self, blinded: &str, seeing: &str, flat: &[f64]) -> Result<JsValue, JsError> {
        let current = |name: &str| self.slots.get(name).and_then(|slot| slot.series("current", &self.drive));
        let Some(series) = current(blinded) else { return Ok(JsValue::NULL) };
        plain(&drift(series, &self.drive, current(seeing), &windows(flat)))
    }

    /// Begin to move a window of `length` s in steps of `step` s over the whole drive, with `recovery` s between windows of a run.
    #[expect(clippy::too_many_arguments, reason = "one call instead of an object to take apart")]
    pub fn begin_sweep(
        &mut self,
        estimator: &str,
        params: JsValue,
        car: Option<String>,
        blind: &str,
        length: f64,
        step: f64,
        recovery: f64,
    ) -> Result<(), JsError> {
        let params: Value = serde_wasm_bindgen::from_value(params).map_err(sentence)?;
        let vehicle = vehicle(car)?;
        let plan = SweepPlan { sensor: sensor(blind)?, length, step, recovery };
        let sweep = Sweep::new(estimator, &self.drive, &params, vehicle.as_ref(), plan).map_err(sentence)?;
        self.sweep = Some(Box::new(sweep));
        Ok(())
    }

    /// Go on sweeping for about `budget_ms`.
    pub fn sweep_some(&mut self, budget_ms: f64) -> Result<JsValue, JsError> {
        let deadline = Date::now() + budget_ms;
        let sweep = self.sweep.as_mut().ok_or_else(|| JsError::new("nothing is being swept"))?;
        loop {
            let done = sweep.advance(&self.drive, EPOCHS).map_err(sentence)?;
            if done || Date::now() >= deadline {
                let fraction = sweep.fraction(&self.drive);
                return plain(&Progress { done, fraction, stage: "estimating", rows: sweep.drifts().len() });
            }
        }
    }

    /// The drift in every window, and the distribution of the drifts; null without a sweep.
    pub fn swept(&self) -> Result<JsValue, JsError> {
        plain(&self.sweep.as_ref().map(|s| Swept { drifts: s.drifts(), distribution: s.distribution() }))
    }

    /// Give up sweeping.
    pub fn cancel_sweep(&mut self) {
        self.sweep = None;
    }
}
