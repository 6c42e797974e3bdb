//! The true motion of the sensors, and what an inertial sensor without errors would read.
//!
//! The plant moves in level coordinates that follow the ellipsoid, so its attitude and velocity are those of the local
//! level frame; latitude, longitude and height are its velocity integrated. An error-free inertial sample is the exact
//! inverse of a WGS-84 strapdown step from one instant to the next, Earth and transport rate included.

use drivescope_drive::geodesy::Geodetic;
use nalgebra::{Matrix3, Vector3};

use crate::earth::Local;
use crate::math::{rotation_by, sin_cos, vector_of};
use crate::plant::Plant;

/// Where the built-in drives start: Daejeon, 36.3721 N 127.3604 E, 60 m.
pub fn daejeon() -> Geodetic {
    Geodetic { lat: 36.3721_f64.to_radians(), lon: 127.3604_f64.to_radians(), alt: 60.0 }
}

/// Magnetic field there, north, east and down, uT: WMM2025 at 2026.0.
pub const DAEJEON_FIELD: [f64; 3] = [30.0822, -4.5908, 40.4962];
/// The moment of that field, s since 1970: when every simulated drive takes place. It is the year that a log without a
/// date is taken for, so that a drive written to a file and read back meets the same field.
pub const FIELD_UNIX_TIME: f64 = 1_767_225_600.0;

/// Averages over one step that an error-free inertial sensor reads, body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// Specific force, m/s^2.
    pub force: Vector3<f64>,
    /// Turn rate against inertial space, rad/s.
    pub rate: Vector3<f64>,
    /// Acceleration over ground along the body's forward axis, m/s^2.
    pub forward_acceleration: f64,
}

/// The sensors' motion at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Body to local level axes.
    pub attitude: Matrix3<f64>,
    /// Turn rate against the level axes, body axes, rad/s.
    pub rate: Vector3<f64>,
    /// Velocity in local level axes, m/s.
    pub velocity: Vector3<f64>,
    /// Place on the ellipsoid.
    pub place: Geodetic,
}

impl Motion {
    /// The plant's motion at a lever arm (body axes, m) from its centre of gravity, at a known place.
    pub fn of(plant: &Plant, lever_arm: &Vector3<f64>, place: Geodetic) -> Self {
        let (attitude, rate) = (plant.attitude(), plant.rate());
        let velocity = plant.velocity() + attitude * rate.cross(lever_arm);
        Self { attitude, rate, velocity, place }
    }

    /// Place reached from here after `dt` s if the velocity then is `next`, by the trapezoidal rule.
    pub fn place_after(&self, next: &Vector3<f64>, dt: f64) -> Geodetic {
        let local = Local::at(&self.place);
        let mean = (self.velocity + next) * 0.5;
        let lat = self.place.lat + mean.x * dt / local.north_radius;
        let (_, cos_between) = sin_cos(0.5 * (self.place.lat + lat));
        let lon = self.place.lon + mean.y * dt / (local.east_radius * cos_between);
        Geodetic { lat, lon, alt: self.place.alt - mean.z * dt }
    }

    /// What an error-free sensor averages over the `dt` s from here to `next`.
    pub fn inertial_until(&self, next: &Self, dt: f64) -> Inertial {
        let local = Local::at(&self.place);
        let level_turn = local.earth_rate + local.transport_rate(&self.velocity);
        let turned = self.attitude.transpose() * rotation_by(&(level_turn * dt)) * next.attitude;
        let acceleration = (next.velocity - self.velocity) / dt;
        let coriolis = (level_turn + local.earth_rate).cross(&self.velocity);
        let level_force = acceleration + coriolis - Vector3::new(0.0, 0.0, local.gravity);
        let mean = (self.attitude + next.attitude) * 0.5;
        let force = mean.try_inverse().unwrap_or_else(|| mean.transpose()) * level_force;
        let forward_acceleration = mean.column(0).dot(&acceleration);
        Inertial { force, rate: vector_of(&turned) / dt, forward_acceleration }
    }
}
