//! Filters named by what they estimate, the Kalman steps they share, and the scoring that says whether they are honest.
//!
//! Every estimator implements [`estimator::Estimator`]; [`registry`] lists them by name. Conventions are those of
//! `drivescope_drive`; `docs/equations.md` maps the papers' equations to functions and tests.

pub mod attitude;
pub mod blindfold;
#[cfg(test)]
mod case_log;
pub mod chi_square;
pub mod estimator;
pub mod gnss;
pub mod gnss_ins;
pub mod gyro_free;
pub mod ins;
pub mod kalman;
pub mod land_ins;
pub mod latency;
pub mod levelling;
pub mod magnetometer_calibration;
pub mod motion_mode;
pub mod orientation;
pub mod outage;
pub mod registry;
pub mod road_profile;
pub mod score;
pub mod slope;
pub mod stationarity;
#[cfg(test)]
mod testing;
pub mod trajectory;
