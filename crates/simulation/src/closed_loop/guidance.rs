//! Guidance: where to, round what, and with which angle of the wheels.

use drivescope_control::Pose;
use drivescope_control::following::{FollowingLaw, GoToGoal, pure_pursuit, stanley};
use drivescope_control::path::Path;
use drivescope_control::vfh::{AXES, Choice, Histogram, steer_into};

use super::settings::{Settings, Task};

/// Length of the line, so that its end is never aimed at within the course, m.
const LINE: f64 = 80.0;
/// Quarter circle of SPEC navigation 10.4: straight, radius, straight, m.
const CORNER: [f64; 3] = [20.0, 18.0, 40.0];
/// The goal of SPEC navigation 10.1, m to the north.
const GOAL: f64 = 110.0;
/// When the wheels are turned in the J-turn, s.
const TURN_AT: f64 = 1.0;

/// A decision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Decision {
    /// Angle of the wheels asked for; none where nobody steers by guidance.
    pub steer: Option<f64>,
    /// Point that is steered for, north and east, m.
    pub target: (f64, f64),
    /// Direction that is steered into, rad.
    pub direction: f64,
    /// What the histogram chose.
    pub choice: Choice,
}

/// Path or goal, obstacles and what is known of them.
#[derive(Clone, Debug)]
pub(super) struct Guidance {
    path: Option<Path>,
    goal: Option<GoToGoal>,
    posts: Vec<[f64; 3]>,
    histogram: Histogram,
    is_avoiding_on: bool,
    is_stopping: bool,
}

impl Guidance {
    pub fn new(settings: &Settings) -> Self {
        let task = settings.scenario.task;
        let path = match task {
            Task::Line => Some(Path::from_segments(&[(LINE, 0.0)])),
            Task::Arc => {
                let [before, radius, after] = CORNER;
                let arc = (radius * std::f64::consts::FRAC_PI_2, 1.0 / radius);
                Some(Path::from_segments(&[(before, 0.0), arc, (after, 0.0)]))
            }
            Task::Goal | Task::JTurn => None,
        };
        let course = &settings.course;
        let post = [course.obstacle_north, course.obstacle_east, course.obstacle_radius];
        Self {
            path,
            goal: (task == Task::Goal).then(|| GoToGoal::new((GOAL, 0.0))),
            posts: if course.obstacle_radius > 0.0 { vec![post] } else { Vec::new() },
            histogram: Histogram::new(settings.avoidance.clone()),
            is_avoiding_on: settings.avoidance.avoidance && task != Task::JTurn,
            is_stopping: false,
        }
    }

    pub fn path(&self) -> Option<&Path> {
        self.path.as_ref()
    }
    pub fn goal(&self) -> Option<(f64, f64)> {
        self.goal.map(|_| (GOAL, 0.0))
    }
    pub fn posts(&self) -> &[[f64; 3]] {
        &self.posts
    }
    pub fn histogram(&self) -> &Histogram {
        &self.histogram
    }
    /// Whether the ring is looked at.
    pub fn looks_out(&self) -> bool {
        self.is_avoiding_on
    }
    /// Whether the car is to stop.
    pub fn stops(&self) -> bool {
        self.is_stopping
    }

    /// Angle of the wheels in the J-turn, rad.
    pub fn turned_wheels(&self, settings: &Settings, time: f64) -> f64 {
        let course = &settings.course;
        course.steer_angle * ((time - TURN_AT) / course.steer_rise).clamp(0.0, 1.0)
    }

    /// Decide from the pose as it is known and what the ring reads.
    pub fn decide(&mut self, settings: &Settings, pose: &Pose, ranges: Option<&[f64; AXES]>) -> Decision {
        let wheelbase = settings.yaw_model(1.0).wheelbase();
        let (target, steer) = self.follow(settings, pose, wheelbase);
        let bearing = libm::atan2(target.1 - pose.east, target.0 - pose.north);
        let mut decision = Decision { steer, target, direction: bearing, choice: Choice::Clear };
        if let Some(ranges) = ranges.filter(|_| self.is_avoiding_on) {
            self.histogram.enter(pose, ranges);
            decision.choice = self.histogram.choose(pose, bearing);
            if let Choice::Around(direction) = decision.choice {
                decision.direction = direction;
                decision.steer = Some(steer_into(direction, pose, wheelbase));
            }
        }
        self.is_stopping = decision.choice == Choice::Stop || self.goal.as_mut().is_some_and(|goal| goal.stops(pose));
        decision
    }

    /// Target and angle of the wheels without obstacles.
    fn follow(&self, settings: &Settings, pose: &Pose, wheelbase: f64) -> ((f64, f64), Option<f64>) {
        let params = &settings.following;
        if let Some(goal) = &self.goal {
            return ((GOAL, 0.0), Some(goal.steer(pose, wheelbase, params.goal_gain)));
        }
        let Some(path) = &self.path else { return ((pose.north, pose.east), None) };
        let ahead = path.ahead(path.nearest(pose.north, pose.east), params.look_ahead);
        let target = (ahead.north, ahead.east);
        let steer = match params.following_law {
            FollowingLaw::PurePursuit => pure_pursuit(pose, target, wheelbase, params.look_ahead),
            FollowingLaw::Stanley => stanley(pose, path, settings.vehicle().cg_to_front, params),
        };
        (target, Some(steer))
    }
}
