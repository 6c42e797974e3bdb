//! The plants under one set of commands.

use drivescope_control::Pose;
use drivescope_drive::geodesy::Geodetic;
use drivescope_drive::param::Choice;
use nalgebra::Vector3;

use super::bicycle::{Action, Bicycle, KinematicBicycle};
use super::car::SixDof;
use super::settings::{PlantKind, Settings, Task};
use crate::math::{rotation, sin_cos};
use crate::motion::Motion;

/// What is driven.
#[derive(Clone, Debug)]
pub(super) enum Body {
    Kinematic(KinematicBicycle),
    Planar(Bicycle),
    SixDof(Box<SixDof>),
}

impl Body {
    /// The body that a task calls for: slow guidance is driven kinematically, turns on tyres.
    pub fn new(settings: &Settings, start: &Pose) -> Self {
        let (course, car) = (&settings.course, settings.vehicle());
        match (course.plant, settings.scenario.task) {
            (PlantKind::SixDof, _) => {
                let name = course.car.name();
                Self::SixDof(Box::new(SixDof::new(name, car, start.yaw, start.speed, course.road_friction)))
            }
            (PlantKind::Specification, Task::Line | Task::Goal) => {
                let wheelbase = car.cg_to_front + car.cg_to_rear;
                Self::Kinematic(KinematicBicycle { wheelbase, pose: *start })
            }
            (PlantKind::Specification, Task::Arc | Task::JTurn) => {
                Self::Planar(Bicycle::new(settings.yaw_model(course.road_friction), start))
            }
        }
    }

    /// True place and motion.
    pub fn pose(&self) -> Pose {
        match self {
            Self::Kinematic(bicycle) => bicycle.pose,
            Self::Planar(bicycle) => bicycle.pose(),
            Self::SixDof(car) => car.pose(),
        }
    }

    /// Whether the car is still one that drives: finite, and not turned over.
    pub fn is_upright(&self) -> bool {
        let stands = match self {
            Self::SixDof(car) => car.plant().attitude()[(2, 2)] > 0.5,
            _ => true,
        };
        stands && self.pose().is_finite()
    }

    /// Acceleration to the right, m/s^2.
    pub fn lateral_acceleration(&self, action: &Action) -> f64 {
        match self {
            Self::Kinematic(bicycle) => bicycle.pose.speed * bicycle.pose.yaw_rate,
            Self::Planar(bicycle) => bicycle.lateral_acceleration(action),
            Self::SixDof(car) => car.lateral_acceleration(),
        }
    }

    /// The sensors' motion at a place.
    pub fn motion(&self, place: Geodetic) -> Motion {
        if let Self::SixDof(car) = self {
            return Motion::of(car.plant(), &Vector3::zeros(), place);
        }
        let pose = self.pose();
        let (sin, cos) = sin_cos(pose.yaw);
        let (ahead, aside) = (pose.speed, pose.lateral_speed);
        Motion {
            attitude: rotation(0.0, 0.0, pose.yaw),
            rate: Vector3::new(0.0, 0.0, pose.yaw_rate),
            velocity: Vector3::new(ahead * cos - aside * sin, ahead * sin + aside * cos, 0.0),
            place,
        }
    }

    /// Move on by `dt` s, to a speed (m/s) where the plant lets it be set.
    pub fn advance(&mut self, action: &Action, speed: f64, dt: f64) {
        match self {
            Self::Kinematic(bicycle) => bicycle.advance(action.steer, speed, dt),
            Self::Planar(bicycle) => bicycle.advance(action, dt),
            Self::SixDof(car) => {
                car.advance(action.steer, &action.brakes, action.is_speed_held.then_some(speed), dt);
            }
        }
    }
}
