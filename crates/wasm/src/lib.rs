//! The thin door between the core and JavaScript: sessions that live in a worker.
//!
//! In: the parts of a drive that another module has read or simulated, parameter values. Out: reports and schemas as plain
//! objects, columns as fresh `Float64Array`s that JavaScript owns. No view into wasm memory outlives a call. No arithmetic
//! happens here.

mod compass;
mod faults;
mod motion;
mod outages;
mod profile;
mod reports;
mod runs;
mod session;

pub use session::Session;

#[cfg(feature = "bench")]
#[wasm_bindgen::prelude::wasm_bindgen]
extern "C" {
    /// Milliseconds, finer than the clock of the calendar.
    #[wasm_bindgen(js_namespace = performance)]
    fn now() -> f64;
}

/// Measure what the core costs in this browser; see `drivescope_bench`.
#[cfg(feature = "bench")]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn bench_json(quick: bool) -> Result<String, wasm_bindgen::JsError> {
    drivescope_bench::bench_json(|| now() / 1000.0, quick).map_err(|e| wasm_bindgen::JsError::new(&e))
}
