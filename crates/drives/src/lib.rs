//! The door of the simulated drives: a WebAssembly module of its own, which the page loads at its opening beside the core.
//!
//! In: the name of a built-in drive or the description of another one, and a seed. Out: the list of built-in drives,
//! small pictures of them, and a simulated drive as parts (`drivescope_drive::parts`), whole or its beginning, whose columns
//! are fresh `Float64Array`s. The core puts the parts together again. No view into wasm memory outlives a call. No
//! arithmetic happens here.

mod simulator;

pub use simulator::Simulator;
