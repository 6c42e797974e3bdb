//! Closed loops for the page: begin one, let it go on for a while, look at it as it grows.

use drivescope_control::Pose;
use drivescope_door::{Progress, plain, sentence};
use drivescope_drive::channel::{Column, Record, Series};
use drivescope_drive::drive::Epoch;
use drivescope_drive::param::ParamSpec;
use drivescope_estimation::gnss_ins::{GnssIns, GnssInsParams, KnownStart};
use drivescope_simulation::closed_loop::{ClosedLoop, GuidanceRow, LoopRow, SCENARIOS, Settings, Start};
use js_sys::{Date, Float64Array, Uint8Array};
use serde::Serialize;
use serde_json::Value;
use wasm_bindgen::prelude::*;

/// Seconds driven between two looks at the clock.
const DRIVEN: f64 = 0.5;

#[derive(Serialize)]
struct Catalogue {
    loops: Vec<Entry>,
    parameters: Vec<Group>,
    car_columns: &'static [Column],
    guidance_columns: &'static [Column],
}

#[derive(Serialize)]
struct Entry {
    name: &'static str,
    title: &'static str,
    doc: &'static str,
    settings: Value,
}

#[derive(Serialize)]
struct Group {
    name: &'static str,
    specs: &'static [ParamSpec],
}

/// The closed loops, what can be set about them, and the columns that they write.
#[wasm_bindgen]
pub fn loop_catalogue() -> Result<JsValue, JsError> {
    let settings = |name: &str| Settings::named(name).map_or(Value::Null, |s| s.to_json());
    let entry = |s: &drivescope_simulation::closed_loop::Scenario| Entry {
        name: s.name,
        title: s.title,
        doc: s.doc,
        settings: settings(s.name),
    };
    plain(&Catalogue {
        loops: SCENARIOS.iter().map(entry).collect(),
        parameters: Settings::specs().map(|(name, specs)| Group { name, specs }).into(),
        car_columns: LoopRow::COLUMNS,
        guidance_columns: GuidanceRow::COLUMNS,
    })
}

/// What turns an epoch into a pose.
type Navigator = Box<dyn FnMut(&Epoch) -> Option<Pose>>;

/// A closed loop that is being driven. Lives in a worker.
#[wasm_bindgen]
pub struct DrivenLoop {
    run: ClosedLoop,
    navigator: Navigator,
}

/// The GNSS/INS filter from what may be known before the first epoch.
fn navigator(start: &Start) -> Navigator {
    let params = GnssInsParams { initial_yaw_sigma: start.yaw_sigma.min(1.571), ..GnssInsParams::default() };
    let Start { time, place, velocity, body_to_nav, .. } = *start;
    let mut filter = GnssIns::from_known(&params, &KnownStart { time, place, velocity, body_to_nav });
    Box::new(move |epoch| filter.planar(epoch).map(Pose::from))
}

#[wasm_bindgen]
impl DrivenLoop {
    /// Begin a closed loop by name; `settings` is an object of names and values that differ from its own.
    #[wasm_bindgen(constructor)]
    pub fn new(name: &str, settings: JsValue, seed: f64) -> Result<Self, JsError> {
        let changes: Value = serde_wasm_bindgen::from_value(settings).map_err(sentence)?;
        let mut settings =
            Settings::named(name).ok_or_else(|| JsError::new(&format!("there is no closed loop `{name}`")))?;
        settings.set_all(&changes).map_err(sentence)?;
        let run = ClosedLoop::new(settings, seed as u64);
        let navigator = navigator(&run.start());
        Ok(Self { run, navigator })
    }

    /// Drive on for about `budget_ms`.
    pub fn drive_some(&mut self, budget_ms: f64) -> Result<JsValue, JsError> {
        let deadline = Date::now() + budget_ms;
        while !self.run.advance(DRIVEN, &mut self.navigator) && Date::now() < deadline {}
        plain(&Progress {
            done: self.run.is_done(),
            fraction: self.run.fraction(),
            stage: "simulating",
            rows: self.run.rows().len(),
        })
    }

    /// Whether the car turned over.
    pub fn has_failed(&self) -> bool {
        self.run.has_failed()
    }

    /// All settings.
    pub fn settings(&self) -> Result<JsValue, JsError> {
        plain(&self.run.settings().to_json())
    }

    /// The loop so far in a few numbers; NaN where one has no meaning.
    pub fn summary(&self) -> Result<JsValue, JsError> {
        plain(&self.run.summary())
    }

    /// Times of `car` (a row for each sample) or `guidance` (a row for each decision).
    pub fn times(&self, source: &str) -> Float64Array {
        Float64Array::from(self.series(source).map_or(&[][..], Series::time))
    }

    /// A column of `car` or `guidance`; empty if there is none of the name.
    pub fn column(&self, source: &str, name: &str) -> Float64Array {
        Float64Array::from(self.series(source).and_then(|s| s.column(name)).unwrap_or_default())
    }

    /// Magnitudes of the 72 sectors, decision after decision; sector i is centred on 5 i deg from north.
    pub fn magnitudes(&self) -> Float64Array {
        Float64Array::from(self.run.magnitudes())
    }

    /// 1 where a sector was blocked, decision after decision.
    pub fn blocked(&self) -> Uint8Array {
        Uint8Array::from(self.run.blocked())
    }

    /// Cells that hold echoes now, three numbers each: north, east, count from 1 to 15.
    pub fn cells(&self) -> Float64Array {
        let cells: Vec<f64> = self.run.histogram().occupied().flat_map(|(n, e, c)| [n, e, c]).collect();
        Float64Array::from(cells.as_slice())
    }

    /// The path, two numbers each: north and east; empty where none is followed.
    pub fn path(&self) -> Float64Array {
        let points = self.run.path().map(|p| p.points()).unwrap_or_default();
        let flat: Vec<f64> = points.iter().flat_map(|p| [p.north, p.east]).collect();
        Float64Array::from(flat.as_slice())
    }

    /// How far ahead of the place in the rows the front and the rear axle are, and the track, m.
    pub fn size(&self) -> Float64Array {
        Float64Array::from(&self.run.size()[..])
    }

    /// The obstacles, three numbers each: north, east, radius.
    pub fn obstacles(&self) -> Float64Array {
        let flat: Vec<f64> = self.run.obstacles().iter().flatten().copied().collect();
        Float64Array::from(flat.as_slice())
    }
}

impl DrivenLoop {
    fn series(&self, source: &str) -> Option<&Series> {
        match source {
            "car" => Some(self.run.rows().series()),
            "guidance" => Some(self.run.guidance().series()),
            _ => None,
        }
    }
}
