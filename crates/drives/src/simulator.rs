//! The calls of JavaScript.

use drivescope_door::{Handover, Progress, plain, sentence};
use drivescope_simulation::{DriveSpec, Simulation, drives, named, sketch};
use js_sys::{Array, Date, Float64Array};
use serde::Serialize;
use wasm_bindgen::prelude::*;

/// Seconds simulated between two looks at the clock.
const SIMULATED: f64 = 5.0;

#[derive(Serialize)]
struct Entry {
    name: &'static str,
    title: &'static str,
    doc: &'static str,
    duration: f64,
}

/// Simulates drives. Lives in the worker of the session.
#[wasm_bindgen]
#[derive(Default)]
pub struct Simulator {
    simulation: Option<Box<Simulation>>,
    /// The beginning that is wanted before the rest, s.
    first: Option<f64>,
    simulated: Option<Handover>,
}

#[wasm_bindgen]
impl Simulator {
    /// A simulator without a drive.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// The built-in drives: name, title, one sentence and about how long each lasts (s).
    pub fn catalogue(&self) -> Result<JsValue, JsError> {
        let entry = |d: &drivescope_simulation::NamedDrive| Entry {
            name: d.name,
            title: d.title,
            doc: d.doc,
            duration: d.duration_hint,
        };
        plain(&drives().iter().map(entry).collect::<Vec<_>>())
    }

    /// A small picture of a built-in drive: the road's length (m), the number of its points, then these (east, north,
    /// m), then its speed over time (s, m/s); empty if there is none of that name.
    pub fn sketch(&self, name: &str) -> Float64Array {
        let Some(spec) = named(name) else { return Float64Array::new_with_length(0) };
        let drawn = sketch(&spec);
        let mut flat = vec![drawn.length, drawn.points.len() as f64];
        flat.extend(drawn.points.iter().chain(&drawn.speed).flat_map(|&(a, b)| [a, b]));
        Float64Array::from(flat.as_slice())
    }

    /// JSON of a built-in drive; empty if there is none of that name.
    pub fn description(&self, name: &str) -> String {
        drives().iter().find(|d| d.name == name).map_or_else(String::new, |d| d.json().to_owned())
    }

    /// Start simulating a built-in drive, or the one that the JSON text `composed` describes; `seed` undefined takes
    /// the drive's own. With `first`, its first so many seconds are there to be looked at before the rest.
    pub fn begin(
        &mut self,
        name: &str,
        seed: Option<f64>,
        composed: Option<String>,
        first: Option<f64>,
    ) -> Result<(), JsError> {
        self.cancel();
        let spec = match composed {
            Some(text) => DriveSpec::from_json(&text).map_err(|e| JsError::new(&format!("{name}: {e}")))?,
            None => named(name).ok_or_else(|| JsError::new(&format!("there is no built-in drive `{name}`")))?,
        };
        let simulation = Simulation::new(&spec, seed.map(|s| s as u64)).map_err(sentence)?;
        (self.simulation, self.first) = (Some(Box::new(simulation)), first);
        Ok(())
    }

    /// Go on simulating for about `budget_ms`. Done means that there is a drive to be taken as its head and its parts:
    /// its beginning, which [`Simulator::is_partial`] then says, or all of it.
    pub fn simulate_some(&mut self, budget_ms: f64) -> Result<JsValue, JsError> {
        let deadline = Date::now() + budget_ms;
        let Some(mut simulation) = self.simulation.take() else {
            return Err(JsError::new("nothing is being simulated"));
        };
        loop {
            let until_first = self.first.map_or(SIMULATED, |first| first - simulation.time());
            let is_ended = simulation.advance(until_first.min(SIMULATED));
            let rows = simulation.drive().imu.len();
            let progress = |done| plain(&Progress { done, fraction: simulation.fraction(), stage: "simulating", rows });
            if is_ended {
                if let Some(failure) = simulation.failure() {
                    return Err(sentence(failure));
                }
                let progress = progress(true);
                self.simulated = Some(Handover::new(simulation.finish(), JsValue::UNDEFINED));
                return progress;
            }
            let is_beginning = self.first.take_if(|first| simulation.time() >= *first).is_some();
            if is_beginning {
                self.simulated = Some(Handover::new(simulation.drive().clone(), JsValue::UNDEFINED));
            }
            if is_beginning || Date::now() >= deadline {
                let progress = progress(is_beginning);
                self.simulation = Some(simulation);
                return progress;
            }
        }
    }

    /// Whether simulating can go on.
    pub fn is_partial(&self) -> bool {
        self.simulation.is_some()
    }

    /// What the drive says besides its columns: name, parameters of the car, rear axle (m), Unix time of `t = 0` (s); then
    /// undefined, as nothing was read.
    pub fn head(&self) -> Result<Array, JsError> {
        let simulated = self.simulated.as_ref().ok_or_else(|| JsError::new("nothing was simulated"))?;
        Ok(simulated.head())
    }

    /// The next part: its name, the names of its columns, its times (s), its columns (an empty one has no value);
    /// undefined after the last one. What was taken is no longer held here.
    pub fn next_part(&mut self) -> Option<Array> {
        let part = self.simulated.as_mut()?.next();
        if part.is_none() {
            self.simulated = None;
        }
        part
    }

    /// Give up what is being simulated or was simulated.
    pub fn cancel(&mut self) {
        *self = Self::default();
    }
}
