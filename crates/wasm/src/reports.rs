//! What crosses the door as plain objects.

use drivescope_door::plain;
use drivescope_drive::channel::Column;
use drivescope_drive::drive::Drive;
use drivescope_drive::param::ParamSpec;
use drivescope_drive::vehicle::PRESETS;
use drivescope_estimation::estimator::{Need, Notice};
use drivescope_estimation::registry::{ESTIMATORS, EstimatorInfo};
use drivescope_estimation::score::Score;
use js_sys::Reflect;
use serde::Serialize;
use serde_json::Value;
use wasm_bindgen::prelude::*;

/// What the core can offer.
#[derive(Serialize)]
pub struct Catalogue {
    version: &'static str,
    estimators: Vec<EstimatorEntry>,
    vehicles: Vec<VehicleEntry>,
}

#[derive(Serialize)]
struct EstimatorEntry {
    name: &'static str,
    title: &'static str,
    doc: &'static str,
    vehicle: &'static str,
    needs: Vec<NeedEntry>,
    params: &'static [ParamSpec],
    columns: &'static [Column],
}

/// A signal that an estimator reads.
#[derive(Serialize)]
pub struct NeedEntry {
    label: &'static str,
    required: bool,
    why: &'static str,
}

#[derive(Serialize)]
struct VehicleEntry {
    name: &'static str,
    doc: &'static str,
}

impl From<&Need> for NeedEntry {
    fn from(need: &Need) -> Self {
        Self { label: need.signal.label(), required: need.required, why: need.why }
    }
}

impl From<&EstimatorInfo> for EstimatorEntry {
    fn from(e: &EstimatorInfo) -> Self {
        let needs = e.needs.iter().map(NeedEntry::from).collect();
        Self {
            name: e.name,
            title: e.title,
            doc: e.doc,
            vehicle: e.vehicle,
            needs,
            params: e.params,
            columns: e.columns,
        }
    }
}

impl Catalogue {
    /// The catalogue of this build.
    pub fn new() -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            estimators: ESTIMATORS.iter().map(EstimatorEntry::from).collect(),
            vehicles: PRESETS.iter().map(|p| VehicleEntry { name: p.name, doc: p.doc }).collect(),
        }
    }
}

/// What a drive holds and which estimators can run on it.
#[derive(Serialize)]
pub struct DriveReport {
    name: String,
    kind: &'static str,
    start: f64,
    end: f64,
    channels: Vec<ChannelEntry>,
    truth: Vec<&'static str>,
    has_vehicle: bool,
    /// What the readers' module said: already a plain object.
    #[serde(skip)]
    import: Option<JsValue>,
    estimators: Vec<Runnable>,
}

#[derive(Serialize)]
struct ChannelEntry {
    name: &'static str,
    rows: usize,
    rate_hz: f64,
    columns: Vec<&'static str>,
}

#[derive(Serialize)]
struct Runnable {
    name: &'static str,
    runnable: bool,
    missing: Vec<NeedEntry>,
}

impl DriveReport {
    /// Report on a drive; `import` is what the reader said, absent for a simulated one.
    pub fn new(drive: &Drive, import: Option<JsValue>) -> Self {
        let (start, end) = drive.span().unwrap_or((0.0, 0.0));
        let channels = drive
            .channel_summaries()
            .into_iter()
            .map(|c| ChannelEntry { name: c.name, rows: c.rows, rate_hz: c.rate, columns: c.columns })
            .collect();
        let truth = drive.truth.schema().iter().map(|c| c.name).filter(|n| drive.truth.has(n)).collect();
        let estimators = ESTIMATORS
            .iter()
            .map(|e| {
                let missing = e.missing(drive).map(NeedEntry::from).collect();
                Runnable { name: e.name, runnable: e.can_run(drive), missing }
            })
            .collect();
        Self {
            name: drive.name.clone(),
            kind: if import.is_some() { "file" } else { "simulated" },
            start,
            end,
            channels,
            truth,
            has_vehicle: drive.vehicle.is_some(),
            import,
            estimators,
        }
    }

    /// As a plain object; `import` is null for a simulated drive.
    pub fn plain(&self) -> Result<JsValue, JsError> {
        let report = plain(self)?;
        let import = self.import.clone().unwrap_or(JsValue::NULL);
        Reflect::set(&report, &"import".into(), &import).map_err(|_| JsError::new("the report is no object"))?;
        Ok(report)
    }
}

/// What a run did and how good it was.
#[derive(Serialize)]
pub struct RunReport<'a> {
    /// Name of the estimator.
    pub estimator: &'static str,
    /// Every parameter's value.
    pub params: &'a Value,
    /// Number of estimates.
    pub rows: usize,
    /// First instant, s.
    pub start: f64,
    /// Last instant, s.
    pub end: f64,
    /// Computing time, s.
    pub seconds: f64,
    /// What the estimator noticed.
    pub notices: &'a [Notice],
    /// How good and how honest it was.
    pub score: &'a Score,
}
