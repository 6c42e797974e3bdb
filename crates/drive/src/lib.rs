//! What was driven, and the law that the rest of Drivescope obeys.
//!
//! # The law: frames, signs, units, time
//!
//! - SI units and radians inside. Degrees, km/h, g and per cent only at the edges (readers, page), and there the name
//!   carries the unit (`yaw_deg`). Magnetic field in microtesla. The one exception in files: `gnss_lat` and `gnss_lon`
//!   are degrees in a canonical CSV.
//! - Body frame FRD: x forward, y right, z down (SAE J670 z-down). Navigation frame NED at a local origin on WGS-84.
//! - ZYX Tait-Bryan angles: roll right side down +, pitch nose up +, yaw clockwise from true north +.
//! - Accelerometers give specific force: level and at rest `accel_z = -9.80665`. Gyros are body rates. Steering angle
//!   and yaw rate: to the right +. Road grade: uphill +. Road bank: right side down +. Sideslip: `atan2(v_y, v_x)`.
//! - Time in seconds on one clock per drive, strictly increasing inside a channel; channels keep their own rates.
//! - NaN is "no value here" inside columns; it never enters a filter state.
//! - Motion modes: 0 stationary, 1 straight, 2 cornering.
//!
//! # Example
//!
//! ```
//! use drivescope_drive::{drive::Drive, signals::{Imu, Wheels}};
//! let mut drive = Drive::default();
//! for k in 0..100 {
//!     let t = f64::from(k) * 0.01;
//!     drive.imu.push(t, Imu { accel_x: 0.2, accel_z: -9.80665, ..Imu::default() })?;
//!     if k % 5 == 0 {
//!         drive.wheels.push(t, Wheels { speed: 10.0, ..Wheels::default() })?;
//!     }
//! }
//! assert_eq!(drive.epochs().filter(|e| e.wheels.is_some()).count(), 20);
//! # Ok::<(), drivescope_drive::channel::OutOfOrder>(())
//! ```

pub mod channel;
pub mod csv;
pub mod decimate;
pub mod disk;
pub mod drive;
pub mod fault;
pub mod frames;
pub mod geodesy;
pub mod json;
pub mod magnetic_model;
pub mod param;
pub mod parts;
pub mod satellites;
pub mod select;
pub mod signals;
pub mod summary;
pub mod truth;
pub mod vehicle;
