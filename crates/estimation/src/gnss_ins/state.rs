//! The nominal state of the filter, and the errors between two of them.

use nalgebra::Vector3;

use super::covariance::{CLOCK_BIAS, CLOCK_DRIFT, Errors, ODOMETER_SCALE};
use crate::ins::{ACCEL_BIAS, Earth, GYRO_BIAS, NAVIGATION_STATES, Navigation};

/// Everything that the filter estimates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Where, how fast, how turned.
    pub navigation: Navigation,
    /// Accelerometer biases, body axes, m/s^2.
    pub accel_bias: Vector3<f64>,
    /// Gyro biases, body axes, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// What the odometer shows over what is driven; 1 where it is not estimated.
    pub odometer_scale: f64,
    /// Offset of the receiver clock, m.
    pub clock_bias: f64,
    /// Drift of the receiver clock, m/s.
    pub clock_drift: f64,
}

impl State {
    /// A state of which only navigation and gyro biases are known.
    pub fn new(navigation: Navigation, gyro_bias: Vector3<f64>) -> Self {
        Self {
            navigation,
            accel_bias: Vector3::zeros(),
            gyro_bias,
            odometer_scale: 1.0,
            clock_bias: 0.0,
            clock_drift: 0.0,
        }
    }

    /// Take estimated errors off; residual biases (true less estimated) add to the biases.
    pub fn correct(&mut self, errors: &Errors, earth: &Earth) {
        self.navigation.correct(&errors.fixed_rows::<NAVIGATION_STATES>(0).into_owned(), earth);
        self.accel_bias += errors.fixed_rows::<3>(ACCEL_BIAS);
        self.gyro_bias += errors.fixed_rows::<3>(GYRO_BIAS);
        self.odometer_scale -= errors[ODOMETER_SCALE];
        self.clock_bias -= errors[CLOCK_BIAS];
        self.clock_drift -= errors[CLOCK_DRIFT];
    }

    /// The errors of this state against a `truth` near it.
    pub fn errors_against(&self, truth: &Self, earth: &Earth) -> Errors {
        let mut errors = Errors::zeros();
        let navigation = self.navigation.errors_against(&truth.navigation, earth);
        errors.fixed_rows_mut::<NAVIGATION_STATES>(0).copy_from(&navigation);
        errors.fixed_rows_mut::<3>(ACCEL_BIAS).copy_from(&(truth.accel_bias - self.accel_bias));
        errors.fixed_rows_mut::<3>(GYRO_BIAS).copy_from(&(truth.gyro_bias - self.gyro_bias));
        errors[ODOMETER_SCALE] = self.odometer_scale - truth.odometer_scale;
        errors[CLOCK_BIAS] = self.clock_bias - truth.clock_bias;
        errors[CLOCK_DRIFT] = self.clock_drift - truth.clock_drift;
        errors
    }
}
