//! The filter inside a closed loop: started from a known state, read as what guidance needs.

use drivescope_drive::drive::{Epoch, LogStart};
use drivescope_drive::geodesy::Geodetic;
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{Matrix3, Vector3};

use super::{GnssIns, GnssInsEstimate, GnssInsParams};
use crate::estimator::Estimator;
use crate::ins::Navigation;

/// A state that is known before the first epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownStart {
    /// Time of the state, s: before the first epoch.
    pub time: f64,
    /// Place; also the origin of the local frame.
    pub place: Geodetic,
    /// Velocity, north, east, down, m/s.
    pub velocity: Vector3<f64>,
    /// Rotation from body to north, east, down.
    pub body_to_nav: Matrix3<f64>,
}

impl GnssIns {
    /// The filter running from a known state instead of aligning; the sigmas of the start are those of the parameters.
    pub fn from_known(params: &GnssInsParams, start: &KnownStart) -> Self {
        let log = LogStart { speed: start.velocity.norm(), origin: Some(start.place), ..LogStart::UNKNOWN };
        let mut filter = Self::new(params, &VehicleParams::default(), &log);
        let KnownStart { place, velocity, body_to_nav, .. } = *start;
        filter.begin_at(start.time, Navigation { place, velocity, body_to_nav });
        filter
    }

    /// Step and read the planar motion: north, east (m), yaw (rad), forward and rightward speed (m/s), yaw rate (rad/s).
    ///
    /// The yaw rate is the gyro's less its estimated bias; NaN in an epoch without an inertial sample. `None` where the filter
    /// has no estimate or has lost it.
    pub fn planar(&mut self, epoch: &Epoch) -> Option<[f64; 6]> {
        let e: GnssInsEstimate = self.step(epoch).ok().flatten()?;
        let (sin, cos) = e.yaw.sin_cos();
        let yaw_rate = epoch.imu.map_or(f64::NAN, |imu| imu.gyro_z) - e.gyro_bias_z;
        let (ahead, aside) = (e.v_north * cos + e.v_east * sin, e.v_east * cos - e.v_north * sin);
        Some([e.north, e.east, e.yaw, ahead, aside, yaw_rate])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::frames::body_to_nav;
    use drivescope_drive::geodesy::gravity;
    use drivescope_drive::signals::Imu;

    #[test]
    fn a_known_start_runs_at_once_and_reads_along_its_own_heading() {
        let place = Geodetic { lat: 0.6, lon: 2.0, alt: 10.0 };
        let yaw = 0.7_f64;
        let velocity = Vector3::new(yaw.cos(), yaw.sin(), 0.0) * 3.0;
        let start = KnownStart { time: -0.01, place, velocity, body_to_nav: body_to_nav(0.0, 0.0, yaw) };
        let mut filter = GnssIns::from_known(&GnssInsParams::default(), &start);
        let imu =
            Imu { accel_x: 0.0, accel_y: 0.0, accel_z: -gravity(0.6, 10.0), gyro_x: 0.0, gyro_y: 0.0, gyro_z: 0.01 };
        let [north, east, heading, ahead, aside, rate] =
            filter.planar(&Epoch { imu: Some(imu), ..Epoch::default() }).unwrap();
        assert!((north - 0.03 * yaw.cos()).abs() < 1e-4 && (east - 0.03 * yaw.sin()).abs() < 1e-4);
        assert!((heading - yaw - 1e-4).abs() < 1e-5 && (ahead - 3.0).abs() < 1e-3 && aside.abs() < 1e-3);
        assert!((rate - 0.01).abs() < 1e-9);
        assert!(filter.planar(&Epoch { time: 0.01, ..Epoch::default() }).is_none(), "no inertial sample, no motion");
    }
}
