//! The fifteen errors of the filter: their order, covariance and noise.
//!
//! Errors, in this order: position, velocity, attitude (`true rotation = exp([eps x]) rotation`, in navigation axes), gyro
//! bias, accelerometer bias; each is true minus indicated.
//! Source: SPEC motion 2, after Lee et al. 2010, section 2.

use nalgebra::SMatrix;

/// First position error.
pub const POSITION: usize = 0;
/// First velocity error.
pub const VELOCITY: usize = 3;
/// First attitude error.
pub const ATTITUDE: usize = 6;
/// First error of the gyro biases.
pub const GYRO_BIAS: usize = 9;
/// First error of the accelerometer biases.
pub const ACCEL_BIAS: usize = 12;
/// Number of errors.
pub const STATES: usize = 15;

/// Covariance of the errors.
pub type Covariance = SMatrix<f64, STATES, STATES>;

/// Variances of a second of each kind of noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Specific force, (m/s^2)^2 s.
    pub accel: f64,
    /// Rates, (rad/s)^2 s.
    pub gyro: f64,
    /// Walk of the gyro biases, (rad/s)^2 / s.
    pub gyro_bias: f64,
    /// Walk of the accelerometer biases, (m/s^2)^2 / s.
    pub accel_bias: f64,
}
