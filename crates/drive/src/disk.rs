//! The disk of six single-axis accelerometers as a thing: where each sits, which way it points, what it reads at rest.
//!
//! A property of the sensor, found by calibration or taken from its drawing; no equation of motion lives here.

use serde::{Deserialize, Serialize};

/// One accelerometer of the disk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiskSensor {
    /// Where it sits, seen from the disk's centre, body axes, m.
    pub position: [f64; 3],
    /// Unit vector of its axis times its scale, body axes.
    pub axis: [f64; 3],
    /// Its reading without specific force, m/s^2.
    pub bias: f64,
}

/// A disk of six accelerometers; 1 to 3 tangential, 4 to 6 axial, at 0, 120 and 240 deg from forward to the right.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disk {
    /// The accelerometers, in the order of the columns `acc6_1` to `acc6_6`.
    pub sensors: [DiskSensor; 6],
}

/// Radius of the circle on which the accelerometers sit by default, m.
pub const DISK_RADIUS: f64 = 0.10;

impl Disk {
    /// The drawing: perfect axes, no bias, on a circle of `radius` m.
    pub fn drawn(radius: f64) -> Self {
        let half = 0.5 * 3f64.sqrt();
        let directions = [(0.0, 1.0), (half, -0.5), (-half, -0.5)];
        let sensor = |i: usize| {
            let (sin, cos) = directions[i % 3];
            let axis = if i < 3 { [-sin, cos, 0.0] } else { [0.0, 0.0, 1.0] };
            DiskSensor { position: [radius * cos, radius * sin, 0.0], axis, bias: 0.0 }
        };
        Self { sensors: std::array::from_fn(sensor) }
    }

    /// Position (m), axis and bias (m/s^2) of sensor after sensor: 42 numbers, as a disk crosses a door.
    pub fn numbers(&self) -> Vec<f64> {
        self.sensors.iter().flat_map(|s| s.position.into_iter().chain(s.axis).chain([s.bias])).collect()
    }

    /// The disk of [`Disk::numbers`]; `None` for another count, or what is not finite.
    pub fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let is_whole = numbers.len() == 42 && numbers.iter().all(|v| v.is_finite());
        let three = |first: usize| std::array::from_fn(|k| numbers[first + k]);
        let sensor = |i: usize| DiskSensor { position: three(7 * i), axis: three(7 * i + 3), bias: numbers[7 * i + 6] };
        is_whole.then(|| Self { sensors: std::array::from_fn(sensor) })
    }
}

impl Default for Disk {
    fn default() -> Self {
        Self::drawn(DISK_RADIUS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangential_axes_are_perpendicular_to_their_arms_and_a_disk_survives_json() {
        let disk = Disk::default();
        for s in &disk.sensors {
            let dot: f64 = s.position.iter().zip(s.axis).map(|(r, u)| r * u).sum();
            let length: f64 = s.position.iter().map(|r| r * r).sum();
            assert!(dot.abs() < 1e-15 && (length.sqrt() - DISK_RADIUS).abs() < 1e-15);
        }
        let text = serde_json::to_string(&disk).unwrap();
        assert_eq!(serde_json::from_str::<Disk>(&text).unwrap(), disk);
        assert_eq!(Disk::from_numbers(&disk.numbers()), Some(disk));
        assert_eq!(Disk::from_numbers(&disk.numbers()[1..]), None);
    }
}
