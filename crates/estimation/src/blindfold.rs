//! A sensor hidden from a run for some windows of time.

use drivescope_drive::drive::Epoch;
use serde::{Deserialize, Serialize};

/// A sensor that can be blinded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Satellites: fixes and ranges.
    Gnss,
    /// Magnetometer.
    Mag,
    /// Wheels.
    Odometer,
}

/// A sensor that is blind from the first to, not including, the second time (s) of each window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blindfold {
    /// Which sensor.
    pub sensor: Sensor,
    /// When.
    pub windows: Vec<(f64, f64)>,
}

impl Blindfold {
    /// Take the sensor's samples out of an epoch inside a window.
    pub fn apply(&self, epoch: &mut Epoch) {
        if !self.windows.iter().any(|(from, to)| epoch.time >= *from && epoch.time < *to) {
            return;
        }
        match self.sensor {
            Sensor::Gnss => {
                epoch.gnss = None;
                epoch.raw_gnss = None;
            }
            Sensor::Mag => epoch.mag = None,
            Sensor::Odometer => epoch.wheels = None,
        }
    }
}
