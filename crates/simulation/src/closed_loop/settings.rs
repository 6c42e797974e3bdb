//! Named closed loops and everything that can be set about them.

use drivescope_control::following::FollowingParams;
use drivescope_control::tyre::LateralTyre;
use drivescope_control::vfh::VfhParams;
use drivescope_control::yaw_moment::{YawModel, YawMomentParams, YawTarget};
use drivescope_drive::param::{Choice, ParamError, ParamSpec, Params};
use drivescope_drive::vehicle::VehicleParams;
use drivescope_drive::{choice, params};
use serde_json::{Map, Value};

choice! {
    /// What is driven.
    pub enum PlantKind {
        /// The planar plants of the navigation specification.
        Specification = "specification",
        /// The project's own car with six degrees of freedom.
        SixDof = "six_dof",
    }
}
choice! {
    /// From what the controllers know where the car is.
    pub enum Navigation {
        /// From the filter that the caller brings.
        Filter = "filter",
        /// From dead reckoning and fixed shares of each fix.
        FixedGain = "fixed_gain",
        /// From the truth.
        Truth = "truth",
    }
}
choice! {
    /// Which car; the names are those of the vehicle presets.
    pub enum CarName {
        /// Table 2 of the paper.
        Yun2007 = "yun_2007",
        /// A saloon with rear drive.
        Bmw320i = "bmw_320i",
        /// A plausible front-driven saloon.
        Saloon = "saloon",
        /// A tall van.
        VwVanagon = "vw_vanagon",
    }
}

params! {
    /// What is driven, how fast, and what the sensors are worth.
    pub struct LoopParams {
        /// What is driven.
        plant (""): choice PlantKind, from "SPEC navigation 10";
        /// Which car.
        car (""): choice CarName, from "SPEC navigation 9: Table 2";
        /// From what the controllers know where the car is.
        navigation (""): choice Navigation, from "SPEC navigation 10";
        /// How long is driven.
        duration (""): number = 48.0, "s", 1.0 ..= 300.0 Linear, from "SPEC navigation 10";
        /// How long the car stands first.
        stand (""): number = 0.0, "s", 0.0 ..= 30.0 Linear, from "SPEC navigation 10.1: 10 s";
        /// Speed that is driven.
        speed ("V"): number = 1.0, "m/s", 0.2 ..= 40.0 Log, from "SPEC navigation 10";
        /// Acceleration to that speed; a car that starts in motion has it from the start.
        acceleration (""): number = 0.5, "m/s^2", 0.05 ..= 3.0 Linear, from "SPEC navigation 8";
        /// Start at the driven speed.
        start_in_motion (""): toggle = false, from "SPEC navigation 10.3";
        /// Hold the speed against brakes and tyres.
        hold_speed (""): toggle = true, from "SPEC navigation 10.3";
        /// Angle that the wheels are turned to in the J-turn.
        steer_angle ("delta"): number = 0.0629, "rad", -0.5 ..= 0.5 Linear, from "SPEC navigation 10.3: 0.2 g without control";
        /// How long turning the wheels takes.
        steer_rise (""): number = 0.3, "s", 0.01 ..= 5.0 Linear, from "SPEC navigation 11";
        /// Heading of the car at the start while everybody believes in north.
        heading_error (""): number = 0.0, "rad", -1.6 ..= 1.6 Linear, from "SPEC navigation 10.1";
        /// Friction of the road as a share of the tyres' own.
        road_friction (""): number = 1.0, "1", 0.05 ..= 1.5 Linear, from "SPEC navigation 10";
        /// Where along the line the obstacle stands.
        obstacle_north (""): number = 10.0, "m", 3.0 ..= 100.0 Linear, from "SPEC navigation 10.2";
        /// How far to the right of the line it stands.
        obstacle_east (""): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC navigation 10.2";
        /// Radius of the obstacle; 0 for none.
        obstacle_radius (""): number = 0.2, "m", 0.0 ..= 3.0 Linear, from "SPEC navigation 10.2";
        /// Sigma of a satellite position.
        gnss_sigma (""): number = 0.15, "m", 0.01 ..= 10.0 Log, from "SPEC navigation 10.2";
        /// Fixes per second.
        gnss_rate (""): number = 1.0, "Hz", 0.2 ..= 10.0 Log, from "SPEC navigation 10.2";
    }
}

/// What the car is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// Follow a straight line past an obstacle.
    Line,
    /// Follow a line through a quarter circle.
    Arc,
    /// Reach a goal to the north.
    Goal,
    /// Turn the wheels and hold them.
    JTurn,
}

/// A closed loop by name.
#[derive(Clone, Copy, Debug)]
pub struct Scenario {
    /// Name in menus and on the command line.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// What happens.
    pub doc: &'static str,
    /// What the car is to do.
    pub task: Task,
    defaults: fn(&mut Settings),
}

/// The closed loops that ship with Drivescope.
pub const SCENARIOS: &[Scenario] = &[
    Scenario {
        name: "obstacle_course",
        title: "Obstacle course",
        doc: "At 1 m/s along a line and round a post that the ultrasonic ring sees, as in figure 6 of Yun and Yu",
        task: Task::Line,
        defaults: |s| {
            s.following.look_ahead = 8.0;
            s.yaw_moment.yaw_target = YawTarget::Off;
        },
    },
    Scenario {
        name: "j_turn",
        title: "J-turn with yaw-moment control",
        doc: "The wheels are turned at 5 m/s and held; sliding-mode control brakes the wheels of one side, as in figure 7",
        task: Task::JTurn,
        defaults: |s| {
            s.course = LoopParams { duration: 10.0, speed: 5.0, start_in_motion: true, ..s.course.clone() };
            s.course.navigation = Navigation::Truth;
            s.course.obstacle_radius = 0.0;
        },
    },
    Scenario {
        name: "corner",
        title: "Corner with both",
        doc: "A quarter circle of 18 m radius at 5.5 m/s on a slippery road: path following and yaw-moment control together",
        task: Task::Arc,
        defaults: |s| {
            s.course = LoopParams { duration: 14.5, speed: 5.5, start_in_motion: true, ..s.course.clone() };
            (s.course.road_friction, s.yaw_moment.model_friction) = (0.6, 0.6);
            (s.course.gnss_rate, s.course.obstacle_radius) = (5.0, 0.0);
            s.following.look_ahead = 5.0;
            s.yaw_moment.lateral_limit = 0.6 * drivescope_control::yaw_moment::GRAVITY;
        },
    },
    Scenario {
        name: "goal",
        title: "To a goal from a wrong heading",
        doc: "110 m to a goal at 1 m/s after 10 s at rest, the car turned away from it without knowing, as in figure 5",
        task: Task::Goal,
        defaults: |s| {
            s.course = LoopParams { duration: 140.0, stand: 10.0, acceleration: 0.1, ..s.course.clone() };
            s.course.heading_error = std::f64::consts::FRAC_PI_4;
            (s.course.gnss_sigma, s.course.obstacle_radius) = (0.6, 0.0);
            s.yaw_moment.yaw_target = YawTarget::Off;
        },
    },
];

/// A closed loop with all its settings.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Which.
    pub scenario: Scenario,
    /// What is driven and measured.
    pub course: LoopParams,
    /// How a path is followed.
    pub following: FollowingParams,
    /// How obstacles are passed.
    pub avoidance: VfhParams,
    /// How the yaw rate is controlled.
    pub yaw_moment: YawMomentParams,
}

impl Settings {
    /// The settings that a named closed loop starts from; `None` if there is none of that name.
    pub fn named(name: &str) -> Option<Self> {
        let scenario = *SCENARIOS.iter().find(|s| s.name == name)?;
        let mut settings = Self {
            scenario,
            course: LoopParams::default(),
            following: FollowingParams::default(),
            avoidance: VfhParams::default(),
            yaw_moment: YawMomentParams::default(),
        };
        (scenario.defaults)(&mut settings);
        Some(settings)
    }

    /// The declarations of everything that can be set, group by group.
    pub fn specs() -> [(&'static str, &'static [ParamSpec]); 4] {
        [
            ("course", LoopParams::SPECS),
            ("following", FollowingParams::SPECS),
            ("avoidance", VfhParams::SPECS),
            ("yaw_moment", YawMomentParams::SPECS),
        ]
    }

    /// Set a value by name or symbol.
    ///
    /// # Errors
    /// Unknown name, wrong kind, or out of range; nothing is changed then.
    pub fn set(&mut self, name: &str, value: &Value) -> Result<(), ParamError> {
        let mut known = Vec::new();
        let sets: [&mut dyn FnMut() -> Result<(), ParamError>; 4] = [
            &mut || self.course.set(name, value),
            &mut || self.following.set(name, value),
            &mut || self.avoidance.set(name, value),
            &mut || self.yaw_moment.set(name, value),
        ];
        for set in sets {
            match set() {
                Err(ParamError::Unknown { known: names, .. }) => known.push(names),
                other => return other,
            }
        }
        Err(ParamError::Unknown { name: name.into(), known: known.join(", ") })
    }

    /// Set every value of a JSON object.
    ///
    /// # Errors
    /// The first value that cannot be taken.
    pub fn set_all(&mut self, json: &Value) -> Result<(), ParamError> {
        match json {
            Value::Null => Ok(()),
            Value::Object(map) => map.iter().try_for_each(|(name, value)| self.set(name, value)),
            other => Err(ParamError::NotAnObject(drivescope_drive::json::named(other))),
        }
    }

    /// All values as one JSON object.
    pub fn to_json(&self) -> Value {
        let groups =
            [self.course.to_json(), self.following.to_json(), self.avoidance.to_json(), self.yaw_moment.to_json()];
        let entries = groups.into_iter().filter_map(|group| match group {
            Value::Object(map) => Some(map),
            _ => None,
        });
        Value::Object(entries.flatten().collect::<Map<_, _>>())
    }

    /// The car.
    pub fn vehicle(&self) -> VehicleParams {
        VehicleParams::preset(self.course.car.name()).unwrap_or_default()
    }

    /// The car as two axles on tyres with a share of their friction: Table 2's car on its own tyre, others on theirs.
    pub fn yaw_model(&self, friction: f64) -> YawModel {
        let car = self.vehicle();
        let is_planar = self.course.plant == PlantKind::Specification;
        if is_planar && self.course.car == CarName::Yun2007 {
            return YawModel::with_tyre(&car, &LateralTyre::named(self.yaw_moment.model_tyre), friction);
        }
        YawModel::with_own_tyres(&car, friction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_name_and_symbol_is_used_once_and_every_default_can_be_set_again() {
        // A name in two groups would set only the first of them.
        let specs: Vec<&ParamSpec> = Settings::specs().into_iter().flat_map(|(_, specs)| specs).collect();
        let mut names: Vec<&str> = specs.iter().flat_map(|s| [s.name, s.symbol]).filter(|n| !n.is_empty()).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|w| w[0] != w[1]), "{names:?}");
        for scenario in SCENARIOS {
            let settings = Settings::named(scenario.name).unwrap();
            let mut again = Settings::named(scenario.name).unwrap();
            again.set_all(&settings.to_json()).unwrap();
            assert_eq!(again.to_json(), settings.to_json());
            assert_eq!(settings.to_json().as_object().unwrap().len(), specs.len());
        }
    }

    #[test]
    fn a_value_out_of_range_and_an_unknown_name_are_refused_with_a_sentence() {
        let mut settings = Settings::named("j_turn").unwrap();
        assert!(settings.set("eta", &json!("50")).unwrap_err().to_string().contains("outside 0.05..=5"));
        let error = settings.set("etta", &json!(1)).unwrap_err().to_string();
        assert!(error.starts_with("no parameter `etta`") && error.contains("reaching_rate") && error.contains("speed"));
        settings.set("mz_max", &json!(800)).unwrap();
        assert_eq!(settings.yaw_moment.moment_limit, 800.0);
        assert!(Settings::named("nothing").is_none());
    }

    #[test]
    fn every_car_of_the_list_is_a_preset() {
        assert!(CarName::NAMES.iter().all(|name| VehicleParams::preset(name).is_some()));
    }
}
