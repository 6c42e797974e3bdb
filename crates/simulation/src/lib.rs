//! Truth: vehicle, tyre, road, sensors, driver and the named drives.
//!
//! The plant is independent of every estimator: it shares [`VehicleParams`](drivescope_drive::vehicle::VehicleParams),
//! never equations. Conventions are those of `drivescope_drive`. The same drive with the same seed has the same bits
//! natively and in wasm: every transcendental function comes from `libm`.
//!
//! | module | the room of |
//! |---|---|
//! | [`spec`], [`mod@drives`] | a drive as data, and the ones that ship |
//! | [`road`], [`roughness`] | curvature, grade and bank along arc length, and what is uneven |
//! | [`car`], [`tyre`], [`plant`] | the car and its motion |
//! | [`driveline`], [`driver`], [`manoeuvre`] | engine, gears, brakes; who drives, and what they try out |
//! | [`motion`], [`truth`], [`earth`] | the sensors' true motion and its columns |
//! | [`grades`], [`sensors`] | what the sensors make of it |
//! | [`closed_loop`] | controllers of `drivescope_control` driving a car |
//! | [`run`], [`mod@sketch`] | the simulation that grows a drive, and a picture of it without |

pub mod car;
pub mod closed_loop;
pub mod driveline;
pub mod driver;
pub mod drives;
pub mod earth;
pub mod grades;
pub mod manoeuvre;
pub mod math;
pub mod motion;
pub mod plant;
pub mod rng;
pub mod road;
pub mod roughness;
pub mod run;
pub mod sensors;
pub mod sketch;
pub mod spec;
pub mod truth;
pub mod tyre;

pub use drives::{NamedDrive, drives, named, named_with};
pub use run::{Simulation, fingerprint, simulate, simulate_measured};
pub use sketch::{Sketch, sketch};
pub use spec::{DriveSpec, SpecError};
