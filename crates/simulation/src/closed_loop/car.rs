//! The project's own car with six degrees of freedom under the same commands as the specification's plants.

use drivescope_control::Pose;
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::Vector3;

use crate::car::{Car, WHEELS};
use crate::motion::daejeon;
use crate::plant::{Inputs, Plant, STEP};
use crate::road::Road;
use crate::spec::{DriveSpec, Grip, Segment, Side};

/// Road before the car's start and in all, m: level and straight, and wide enough for any manoeuvre.
const BEFORE: f64 = 300.0;
const LENGTH: f64 = 1500.0;
/// The speed is held with this force per mass and difference, 1/s.
const HOLD: f64 = 4.0;

/// Plant and road; the local origin is where the car starts.
#[derive(Clone, Debug)]
pub struct SixDof {
    road: Road,
    plant: Plant,
    start: Vector3<f64>,
}

impl SixDof {
    /// A car at rest or rolling at a speed (m/s) along a heading (rad), on a road with a share of its friction.
    pub fn new(preset: &str, params: VehicleParams, heading: f64, speed: f64, friction: f64) -> Self {
        let segment = Segment { length: LENGTH, blend: 0.0, ..Segment::default() };
        let grip = Grip { at: -LENGTH, length: 3.0 * LENGTH, share: friction, side: Side::Both };
        let spec = DriveSpec {
            name: "closed loop".into(),
            heading_deg: heading.to_degrees(),
            segments: vec![segment],
            grip: vec![grip],
            ..DriveSpec::default()
        };
        let road = Road::new(&spec);
        let gravity = crate::earth::Local::at(&daejeon()).gravity;
        let mut plant = Plant::new(Car::new(preset, params, gravity), &road, BEFORE, gravity);
        if speed > 0.0 {
            plant.set_speed(speed);
        }
        let start = plant.place();
        Self { road, plant, start }
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Place and motion of the centre of gravity.
    pub fn pose(&self) -> Pose {
        let attitude = self.plant.attitude();
        let place = self.plant.place() - self.start;
        let yaw = libm::atan2(attitude[(1, 0)], attitude[(0, 0)]);
        let (sin, cos) = crate::math::sin_cos(yaw);
        let v = self.plant.velocity();
        Pose {
            north: place.x,
            east: place.y,
            yaw,
            speed: v.x * cos + v.y * sin,
            lateral_speed: v.y * cos - v.x * sin,
            yaw_rate: self.plant.rate().z,
        }
    }

    /// Acceleration to the right over the road, m/s^2, from the tyres' forces of the last step.
    pub fn lateral_acceleration(&self) -> f64 {
        let axle = &self.plant.forces().axle;
        (axle[0].1 + axle[1].1) / self.plant.car.mass
    }

    /// Move on by `dt` s with the wheels at `steer` (rad), the wheels braked with forces (N).
    ///
    /// `speed` (m/s) is held by drive torque on all wheels, or by their brakes; without it the car rolls.
    pub fn advance(&mut self, steer: f64, brakes: &[f64; WHEELS], speed: Option<f64>, dt: f64) {
        let steps = libm::rint(dt / STEP).max(1.0) as usize;
        let radius = self.plant.car.common.wheel_radius;
        for _ in 0..steps {
            let now = self.pose().speed;
            let held = speed.map_or(0.0, |wanted| {
                let against = brakes.iter().sum::<f64>() + self.plant.car.resistance(now);
                HOLD * self.plant.car.mass * (wanted - now) + if wanted > 0.0 { against } else { 0.0 }
            });
            let mut inputs = Inputs { steer, ..Inputs::default() };
            inputs.drive = [held.max(0.0) * radius / WHEELS as f64; WHEELS];
            inputs.brake = std::array::from_fn(|i| (brakes[i] + (-held).max(0.0) / WHEELS as f64) * radius);
            self.plant.step(&self.road, &inputs);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_one_sided_brake_turns_the_car_to_its_side_and_the_speed_is_held() {
        let params = VehicleParams::preset("bmw_320i").unwrap();
        let mut car = SixDof::new("bmw_320i", params, 0.3, 15.0, 1.0);
        assert!((car.pose().yaw - 0.3).abs() < 1e-12 && (car.pose().speed - 15.0).abs() < 1e-9);
        (0..100).for_each(|_| car.advance(0.0, &[0.0, 600.0, 0.0, 400.0], Some(15.0), 0.01));
        // 1000 N on a lever of 0.7 m: at 15 m/s the car settles at some 0.02 rad/s.
        assert!(car.pose().yaw_rate > 0.005, "{}", car.pose().yaw_rate);
        assert!((car.pose().speed - 15.0).abs() < 0.3, "{}", car.pose().speed);
    }

    #[test]
    fn a_slippery_road_holds_less() {
        let peak = |friction: f64| {
            let params = VehicleParams::preset("bmw_320i").unwrap();
            let mut car = SixDof::new("bmw_320i", params, 0.0, 20.0, friction);
            let turn = |_| {
                car.advance(0.1, &[0.0; 4], Some(20.0), 0.01);
                car.lateral_acceleration()
            };
            (0..300).map(turn).fold(0.0, f64::max)
        };
        let (dry, icy) = (peak(1.0), peak(0.2));
        assert!(dry > 6.0 && icy < 2.5, "{dry} {icy}");
    }
}
