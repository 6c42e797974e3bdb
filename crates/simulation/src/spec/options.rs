//! How a drive is driven, and which sensors the car carries.

use serde::Serialize;

use super::error::{SpecError, within};
use super::read::{nameable, readable};
use crate::roughness::Class;

/// How hard the driver drives, m/s^2 and m/s^3.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limits {
    /// Largest lateral acceleration in curves.
    pub cornering: f64,
    /// Acceleration at low speed; the engine's power limits it further.
    pub acceleration: f64,
    /// Deceleration towards slower places and stops.
    pub braking: f64,
    /// Change of acceleration.
    pub jerk: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { cornering: 2.6, acceleration: 1.7, braking: 1.5, jerk: 2.2 }
    }
}

/// Parameters of a car that differ from the named one's: symbol or name, and value.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Changes(pub Vec<(String, f64)>);

/// Grades of single sensors, by name; those of `sensors` without.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Parts {
    /// Inertial sensor.
    pub imu: Option<String>,
    /// Magnetometer.
    pub mag: Option<String>,
    /// Wheels and steering.
    pub wheels: Option<String>,
    /// Receiver and barometer.
    pub gnss: Option<String>,
}

/// Which inertial sensors the car carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cluster {
    /// Three accelerometers and three gyros.
    #[default]
    Full,
    /// What stability control has: forward and lateral acceleration and the yaw rate.
    Esc,
    /// The disk of six accelerometers and the yaw gyro.
    Disk,
}

/// The car's own magnetism at the magnetometer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Iron {
    /// Offset fixed to the car, body axes, uT.
    pub hard: [f64; 3],
    /// Distortion, row by row.
    pub soft: [[f64; 3]; 3],
}

const UNDISTORTED: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

nameable!(Cluster, ["full" => Cluster::Full, "esc" => Cluster::Esc, "disk" => Cluster::Disk]);
nameable!(Class, ["A" => Class::A, "B" => Class::B, "C" => Class::C, "D" => Class::D]);
readable!(Limits, Limits::default(), [cornering, acceleration, braking, jerk], []);
readable!(Parts, Parts::default(), [imu, mag, wheels, gnss], []);
readable!(Iron, Iron { hard: [0.0; 3], soft: UNDISTORTED }, [hard, soft], []);

impl Limits {
    pub(super) fn check(&self) -> Result<(), SpecError> {
        within("driver.cornering", self.cornering, 0.3, 8.0)?;
        within("driver.acceleration", self.acceleration, 0.05, 4.0)?;
        within("driver.braking", self.braking, 0.05, 8.0)?;
        within("driver.jerk", self.jerk, 0.1, 50.0)
    }
}
