//! The door of the readers: a WebAssembly module of its own, which the page loads when it is idle or the first file is
//! dropped, so that the core that it loads first stays small.
//!
//! In: dropped files of any format, read in slices, and a mapping. Out: what was found, and the drive as parts
//! (`drivescope_drive::parts`) whose columns are fresh `Float64Array`s. The core puts the parts together again. No view
//! into wasm memory outlives a call. No arithmetic happens here.

mod dropped;
mod reader;
mod trial;

pub use reader::{Reader, role};
pub use trial::try_mapping;
