//! The calls of JavaScript for trying a mapping on a log that was examined, without reading it again.

use drivescope_door::{plain, sentence};
use drivescope_import::{Mapping, Thinned, try_out};
use js_sys::{Array, Float64Array};
use wasm_bindgen::prelude::*;

/// Thinned columns as JavaScript holds them: the middle of the first bin (s), names, columns.
pub(crate) fn handed(thin: &Thinned) -> Array {
    let names: Array = thin.names.iter().map(JsValue::from).collect();
    Array::of3(&thin.start.into(), &names, &columns(&thin.columns))
}

fn columns(values: &[Vec<f64>]) -> Array {
    values.iter().map(|v| Float64Array::from(v.as_slice())).collect()
}

/// What a mapping (JSON) makes of thinned columns, as [`crate::Reader::examination`] gave them: contradictions
/// ([`drivescope_import::Clash`]), then the series of [`drivescope_import::TRIAL_SERIES`] in their order.
#[wasm_bindgen]
pub fn try_mapping(
    start: f64,
    names: Vec<String>,
    columns: Vec<Float64Array>,
    mapping: &str,
) -> Result<Array, JsError> {
    let mapping = Mapping::from_json(mapping, "mapping.json").map_err(sentence)?;
    let thin = Thinned { names, start, columns: columns.iter().map(Float64Array::to_vec).collect() };
    let trial = try_out(&thin, &mapping).map_err(sentence)?;
    Ok(Array::of2(&plain(&trial.clashes)?, &self::columns(&trial.series)))
}
