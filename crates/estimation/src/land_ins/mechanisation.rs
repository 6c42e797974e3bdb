//! Plain inertial navigation in Euler angles over a flat Earth: the mechanisation of the paper.
//!
//! Source: Lee et al. 2010, equations (1) to (3), corrected (SPEC motion 2 and 6): the first factor of (2) is a yaw
//! rotation, (3) is the Euler-rate matrix times the body rates, gravity adds to specific force. Not aided, not estimated:
//! what the aided filter is compared with. Singular at a pitch of 90 deg, where the cosine is held away from zero.

use drivescope_drive::frames::{Euler, body_to_nav, wrap_angle};
use drivescope_drive::geodesy::{Geodetic, radii};
use nalgebra::Vector3;

/// Smallest magnitude of the cosine of the pitch.
const SMALLEST_COSINE: f64 = 1e-6;

/// Where the car is, how it moves and how it is turned, in local north, east, down.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EulerNavigation {
    /// Position, m.
    pub position: Vector3<f64>,
    /// Velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Attitude, rad.
    pub attitude: Euler,
}

/// Rates of roll, pitch and yaw for body rates (rad/s) at an attitude.
pub fn euler_rates(attitude: &Euler, rate: &Vector3<f64>) -> Vector3<f64> {
    let (sin_roll, cos_roll) = attitude.roll.sin_cos();
    let (sin_pitch, cos_pitch) = attitude.pitch.sin_cos();
    let cos_pitch = if cos_pitch.abs() < SMALLEST_COSINE { SMALLEST_COSINE.copysign(cos_pitch) } else { cos_pitch };
    let heading = sin_roll * rate.y + cos_roll * rate.z;
    Vector3::new(rate.x + sin_pitch / cos_pitch * heading, cos_roll * rate.y - sin_roll * rate.z, heading / cos_pitch) // (3)
}

/// Rates of latitude and longitude (rad/s) and height (m/s) for a velocity in north, east, down: `D^-1 v`. (1)
pub fn geodetic_rates(place: &Geodetic, velocity: &Vector3<f64>) -> Vector3<f64> {
    let (meridian, transverse) = radii(place.lat);
    Vector3::new(
        velocity.x / (meridian + place.alt),
        velocity.y / ((transverse + place.alt) * place.lat.cos()),
        -velocity.z,
    )
}

impl EulerNavigation {
    /// Move on by `dt` s with specific force (m/s^2) and body rates (rad/s) that held meanwhile; `gravity` in m/s^2.
    ///
    /// Midpoint rule: angles with the rate at the half step, velocity with the rotation there, position by the trapezoid.
    pub fn advance(&mut self, force: &Vector3<f64>, rate: &Vector3<f64>, dt: f64, gravity: f64) {
        let half = turned(&self.attitude, &(euler_rates(&self.attitude, rate) * (0.5 * dt)));
        self.attitude = turned(&self.attitude, &(euler_rates(&half, rate) * dt));
        self.attitude.yaw = wrap_angle(self.attitude.yaw);
        let mut acceleration = body_to_nav(half.roll, half.pitch, half.yaw) * force; // (2)
        acceleration.z += gravity;
        let before = self.velocity;
        self.velocity += acceleration * dt;
        self.position += (before + self.velocity) * (0.5 * dt);
    }
}

fn turned(attitude: &Euler, by: &Vector3<f64>) -> Euler {
    Euler { roll: attitude.roll + by.x, pitch: attitude.pitch + by.y, yaw: attitude.yaw + by.z }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::frames::{exp_rotation, log_rotation};
    use drivescope_drive::geodesy::STANDARD_GRAVITY;

    /// A drive of 104 s with two corners, hills and a rolling body, as functions of time.
    fn attitude(t: f64) -> Euler {
        let corner = |at: f64| 0.5 * (1.0 + ((t - at) / 1.5).tanh());
        Euler {
            roll: 0.03 * (0.9 * t).sin(),
            pitch: 0.02 * (0.5 * t).cos() + 0.03 * (0.11 * t).sin(),
            yaw: -std::f64::consts::FRAC_PI_2 * (corner(40.0) + corner(65.0)),
        }
    }

    fn velocity(t: f64) -> Vector3<f64> {
        let speed = 11.0 * (std::f64::consts::PI * t / 104.0).sin().powi(2);
        let a = attitude(t);
        body_to_nav(0.0, 0.03 * (0.11 * t).sin(), a.yaw) * Vector3::new(speed, 0.0, 0.0)
    }

    /// Section 2: a noise-free drive of 104 s closes to 0.006 m and 2e-4 rad. Catches a wrong Euler-rate row, the sign of
    /// gravity, a velocity that turns with the wrong rotation.
    #[test]
    fn a_noise_free_drive_closes_on_the_truth() {
        let (dt, steps) = (0.01, 10_400);
        let rotation = |t: f64| body_to_nav(attitude(t).roll, attitude(t).pitch, attitude(t).yaw);
        let mut n = EulerNavigation { velocity: velocity(0.0), attitude: attitude(0.0), ..EulerNavigation::default() };
        let mut position = Vector3::zeros();
        let mut farthest: f64 = 0.0;
        for k in 0..steps {
            let t = f64::from(k) * dt;
            // What perfect sensors read on average: from the truth's rotation and velocity, without an Euler angle.
            let rate = log_rotation(&(rotation(t).transpose() * rotation(t + dt))) / dt;
            let mean = rotation(t) * exp_rotation(&(rate * (0.5 * dt)));
            let acceleration = (velocity(t + dt) - velocity(t)) / dt;
            let force = mean.transpose() * (acceleration - Vector3::new(0.0, 0.0, STANDARD_GRAVITY));
            n.advance(&force, &rate, dt, STANDARD_GRAVITY);
            position += (velocity(t) + velocity(t + dt)) * 0.5 * dt;
            farthest = farthest.max((n.position - position).norm());
        }
        let end = attitude(f64::from(steps) * dt);
        let wrong = Vector3::new(
            n.attitude.roll - end.roll,
            n.attitude.pitch - end.pitch,
            wrap_angle(n.attitude.yaw - end.yaw),
        );
        assert!(farthest < 0.006, "{farthest} m");
        assert!(wrong.norm() < 2e-4, "{wrong}");
    }

    #[test]
    fn a_pitch_of_ninety_degrees_gives_numbers() {
        let up = Euler { pitch: std::f64::consts::FRAC_PI_2, ..Euler::default() };
        assert!(euler_rates(&up, &Vector3::new(0.1, 0.2, 0.3)).iter().all(|v| v.is_finite()));
    }

    #[test]
    fn a_velocity_north_moves_the_latitude_by_the_meridian_radius() {
        let place = Geodetic { lat: 0.63, lon: 2.0, alt: 100.0 };
        let rates = geodetic_rates(&place, &Vector3::new(10.0, 5.0, -1.0));
        let frame = drivescope_drive::geodesy::LocalFrame::new(place);
        let next =
            Geodetic { lat: place.lat + rates.x * 0.1, lon: place.lon + rates.y * 0.1, alt: place.alt + rates.z * 0.1 };
        assert!((frame.to_ned(next) - Vector3::new(1.0, 0.5, -0.1)).norm() < 1e-6);
    }
}
