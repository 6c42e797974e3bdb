//! The plants of the navigation specification: a kinematic bicycle, and one on nonlinear tyres.

use drivescope_control::Pose;
use drivescope_control::tyre::Curve;
use drivescope_control::yaw_moment::YawModel;

use crate::math::{sin_cos, wrap_angle};

/// Slower than this the slip angles are those of this speed, m/s.
const SPEED_FLOOR: f64 = 0.5;

/// A bicycle that goes where its wheels point; its place is that of the rear axle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KinematicBicycle {
    /// Distance between the axles, m.
    pub wheelbase: f64,
    /// Place and motion.
    pub pose: Pose,
}

impl KinematicBicycle {
    /// Move on by `dt` s along an arc with the wheels at `steer` (rad), reaching `speed` (m/s) at the end.
    pub fn advance(&mut self, steer: f64, speed: f64, dt: f64) {
        let p = &mut self.pose;
        let curvature = libm::tan(steer) / self.wheelbase;
        let way = 0.5 * (p.speed + speed) * dt;
        let (sin, cos) = sin_cos(p.yaw + 0.5 * curvature * way);
        p.north += way * cos;
        p.east += way * sin;
        p.yaw = wrap_angle(p.yaw + curvature * way);
        p.speed = speed;
        p.yaw_rate = speed * curvature;
    }
}

/// What acts on the bicycle during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Action {
    /// Angle of the front wheels, rad.
    pub steer: f64,
    /// Brake forces: front left, front right, rear left, rear right, N.
    pub brakes: [f64; 4],
    /// Whether the speed is held by whatever force it needs.
    pub is_speed_held: bool,
}

/// A planar car on two axles with nonlinear tyres, fourth-order Runge-Kutta.
///
/// Tyre forces of an axle are those of two equal wheels at rest load, on the ellipse with the axle's brake force; what the
/// brakes do on one side only enters as a yaw moment. SPEC navigation 9.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bicycle {
    car: YawModel,
    /// Forward and rightward speed, yaw rate, north, east, yaw.
    state: [f64; 6],
}

impl Bicycle {
    /// A car that starts at a pose; its tyres and masses are the true ones.
    pub fn new(car: YawModel, start: &Pose) -> Self {
        let state = [start.speed, start.lateral_speed, start.yaw_rate, start.north, start.east, start.yaw];
        Self { car, state }
    }

    /// Place and motion of the centre of gravity.
    pub fn pose(&self) -> Pose {
        let [speed, lateral_speed, yaw_rate, north, east, yaw] = self.state;
        Pose { north, east, yaw: wrap_angle(yaw), speed, lateral_speed, yaw_rate }
    }

    /// Acceleration to the right under an action, m/s^2.
    pub fn lateral_acceleration(&self, action: &Action) -> f64 {
        self.slope(&self.state, action)[1] + self.state[0] * self.state[2]
    }

    /// Move on by `dt` s.
    pub fn advance(&mut self, action: &Action, dt: f64) {
        let along = |k: &[f64; 6], h: f64| std::array::from_fn(|i| self.state[i] + h * k[i]);
        let k1 = self.slope(&self.state, action);
        let k2 = self.slope(&along(&k1, 0.5 * dt), action);
        let k3 = self.slope(&along(&k2, 0.5 * dt), action);
        let k4 = self.slope(&along(&k3, dt), action);
        for (i, x) in self.state.iter_mut().enumerate() {
            *x += dt / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
    }

    fn slope(&self, state: &[f64; 6], action: &Action) -> [f64; 6] {
        let [vx, vy, r, _, _, yaw] = *state;
        let car = &self.car;
        let [fl, fr, rl, rr] = action.brakes;
        let moment = 0.5 * car.track * (fr + rr - fl - rl);
        let (front_along, rear_along) = (-(fl + fr), -(rl + rr));
        let forward = vx.max(SPEED_FLOOR);
        let front_slip = libm::atan2(vy + car.to_front * r, forward) - action.steer;
        let rear_slip = libm::atan2(vy - car.to_rear * r, forward);
        let front = axle_force(&car.front, front_slip, front_along);
        let rear = axle_force(&car.rear, rear_slip, rear_along);
        let (sin, cos) = sin_cos(action.steer);
        let front_across = front * cos + front_along * sin;
        let vx_rate = (front_along * cos + rear_along - front * sin) / car.mass + vy * r;
        let (sin_yaw, cos_yaw) = sin_cos(yaw);
        [
            if action.is_speed_held { 0.0 } else { vx_rate },
            (front_across + rear) / car.mass - vx * r,
            (car.to_front * front_across - car.to_rear * rear + moment) / car.inertia,
            vx * cos_yaw - vy * sin_yaw,
            vx * sin_yaw + vy * cos_yaw,
            r,
        ]
    }
}

/// Lateral force of an axle of two equal wheels that also carry a force along themselves, N.
fn axle_force(wheel: &Curve, slip: f64, along: f64) -> f64 {
    -2.0 * wheel.force_beside(slip, 0.5 * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::vehicle::VehicleParams;

    #[test]
    fn the_kinematic_bicycle_closes_its_circle() {
        let mut bicycle = KinematicBicycle { wheelbase: 0.8, pose: Pose { speed: 1.0, ..Pose::default() } };
        let steer = (0.8 / 5.0_f64).atan();
        // One turn of radius 5 m in 1000 steps: chords are shorter than arcs by 1.6e-6 of 31 m.
        (0..1000).for_each(|_| bicycle.advance(steer, 1.0, std::f64::consts::TAU * 5.0 / 1000.0));
        assert!(bicycle.pose.north.abs() < 1e-4 && bicycle.pose.east.abs() < 1e-4 && bicycle.pose.yaw.abs() < 1e-9);
        assert!((bicycle.pose.yaw_rate - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_free_car_only_loses_what_its_tyres_take() {
        // Without steering and brakes nothing acts; a braked car slows by force over mass.
        let car = YawModel::with_own_tyres(&VehicleParams::default(), 1.0);
        let start = Pose { speed: 10.0, ..Pose::default() };
        let mut free = Bicycle::new(car, &start);
        free.advance(&Action::default(), 0.01);
        assert_eq!(free.pose(), Pose { north: free.pose().north, ..start });
        let mut braked = Bicycle::new(car, &start);
        let brakes = [100.0; 4];
        (0..100).for_each(|_| braked.advance(&Action { brakes, ..Action::default() }, 0.01));
        assert!((braked.pose().speed - (10.0 - 400.0 / car.mass)).abs() < 1e-9);
        assert!(braked.pose().yaw_rate.abs() < 1e-12, "even brakes do not turn the car");
    }
}
