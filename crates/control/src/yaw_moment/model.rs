//! The car as the controller believes it to be: two axles, lateral tyres, brakes on four wheels.

use drivescope_drive::vehicle::VehicleParams;

use super::{FRONT_SHARE, GRAVITY, PEAK_SHARE, SPEED_FLOOR};
use crate::Pose;
use crate::tyre::{Curve, LateralTyre};

/// Mass, yaw inertia, axles and tyres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YawModel {
    /// Mass, kg.
    pub mass: f64,
    /// Yaw inertia, kg m^2.
    pub inertia: f64,
    /// Centre of gravity to the front axle, m.
    pub to_front: f64,
    /// Centre of gravity to the rear axle, m.
    pub to_rear: f64,
    /// Distance between the wheels of an axle, m.
    pub track: f64,
    /// Curve of one front wheel at its load.
    pub front: Curve,
    /// Curve of one rear wheel at its load.
    pub rear: Curve,
}

impl YawModel {
    /// The model of a car on tyres of Table 2's kind at their loads at rest, on a share of their friction.
    pub fn with_tyre(car: &VehicleParams, tyre: &LateralTyre, friction: f64) -> Self {
        let [front, rear] = loads(car);
        Self::new(car, tyre.curve(front, friction), tyre.curve(rear, friction))
    }

    /// The model of a car on tyres with its own stiffness per load and friction, times a share of that friction.
    pub fn with_own_tyres(car: &VehicleParams, friction: f64) -> Self {
        let [front, rear] = loads(car);
        let peak = car.friction * friction;
        let front = Curve::new(car.front_cornering * front, peak * front, 0.0);
        Self::new(car, front, Curve::new(car.rear_cornering * rear, peak * rear, 0.0))
    }

    fn new(car: &VehicleParams, front: Curve, rear: Curve) -> Self {
        let (to_front, to_rear) = (car.cg_to_front, car.cg_to_rear);
        Self { mass: car.mass, inertia: car.yaw_inertia, to_front, to_rear, track: car.track, front, rear }
    }

    /// Distance between the axles, m.
    pub fn wheelbase(&self) -> f64 {
        self.to_front + self.to_rear
    }

    /// Yaw rate of steady cornering at a speed (m/s) and an angle of the front wheels (rad), rad/s.
    pub fn steady_yaw_rate(&self, speed: f64, steer: f64) -> f64 {
        let (front, rear) = (2.0 * self.front.slope(), 2.0 * self.rear.slope());
        let base = self.wheelbase();
        let understeer = self.mass * (self.to_rear * rear - self.to_front * front) / (base * front * rear);
        speed * steer / (base + understeer * speed * speed)
    }

    /// What the model has for the lateral acceleration over the body `v_y'` (m/s^2) and `r'` (rad/s^2) without brakes.
    pub fn rates(&self, pose: &Pose, steer: f64) -> (f64, f64) {
        let speed = pose.speed.max(SPEED_FLOOR);
        let front_slip = libm::atan2(pose.lateral_speed + self.to_front * pose.yaw_rate, speed) - steer;
        let rear_slip = libm::atan2(pose.lateral_speed - self.to_rear * pose.yaw_rate, speed);
        let front = -2.0 * self.front.force(front_slip) * libm::cos(steer);
        let rear = -2.0 * self.rear.force(rear_slip);
        let sideways = (front + rear) / self.mass - pose.speed * pose.yaw_rate;
        (sideways, (self.to_front * front - self.to_rear * rear) / self.inertia)
    }

    /// Brake forces that give a yaw moment (N m, right positive): front left, front right, rear left, rear right, N.
    ///
    /// One side only, 60 % at the front, each wheel up to 80 % of its peak.
    pub fn allocate(&self, moment: f64) -> [f64; 4] {
        if !moment.is_finite() {
            return [0.0; 4];
        }
        let force = moment.abs() / (0.5 * self.track);
        let front = (FRONT_SHARE * force).min(PEAK_SHARE * self.front.peak);
        let rear = ((1.0 - FRONT_SHARE) * force).min(PEAK_SHARE * self.rear.peak);
        if moment > 0.0 { [0.0, front, 0.0, rear] } else { [front, 0.0, rear, 0.0] }
    }
}

/// Load at rest of one wheel of the front and of the rear axle, N.
fn loads(car: &VehicleParams) -> [f64; 2] {
    let per_metre = 0.5 * car.mass * GRAVITY / (car.cg_to_front + car.cg_to_rear);
    [per_metre * car.cg_to_rear, per_metre * car.cg_to_front]
}
