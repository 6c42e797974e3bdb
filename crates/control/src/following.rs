//! Steering that follows a path or makes for a goal.
//!
//! Source: SPEC navigation 8; the paper says only that the vehicle follows its optimal path.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::{choice, params};

use crate::Pose;
use crate::path::Path;

choice! {
    /// Which law follows the path.
    pub enum FollowingLaw {
        /// Steer along the arc to a point ahead.
        PurePursuit = "pure_pursuit",
        /// Turn into the path's heading and against the offset of the front axle.
        Stanley = "stanley",
    }
}

params! {
    /// How a path is followed.
    pub struct FollowingParams {
        /// Which law follows the path.
        following_law (""): choice FollowingLaw, from "SPEC navigation 8";
        /// How far ahead pure pursuit aims. More: smoother and later.
        look_ahead ("ld"): number = 4.0, "m", 1.0 ..= 15.0 Linear, from "SPEC navigation 8";
        /// Gain of Stanley's law on the offset. More: back on the path sooner, at last by swinging.
        stanley_gain ("k"): number = 1.0, "1/s", 0.1 ..= 5.0 Log, from "SPEC navigation 8";
        /// Speed added below Stanley's offset, so that standing does not divide by zero.
        stanley_softening ("ks"): number = 0.3, "m/s", 0.01 ..= 5.0 Log, from "SPEC navigation 8";
        /// Gain of go-to-goal on the angle between heading and goal.
        goal_gain (""): number = 1.2, "1", 0.2 ..= 5.0 Log, from "SPEC navigation 8";
        /// Largest angle of the wheels.
        steer_limit (""): number = 0.523_598_775_598_298_8, "rad", 0.05 ..= 1.0 Linear, from "SPEC navigation 8: 30 deg";
        /// Fastest change of that angle.
        steer_rate_limit (""): number = 1.047_197_551_196_597_6, "rad/s", 0.05 ..= 10.0 Log,
            from "SPEC navigation 8: 60 deg/s";
    }
}

/// Angle of the wheels that leads along an arc to a target (north, east), m.
///
/// `delta = atan(2 L sin(alpha) / d)`, `alpha` the bearing of the target from the heading, `d` its distance but at least
/// 30 % of the look-ahead distance.
pub fn pure_pursuit(pose: &Pose, target: (f64, f64), wheelbase: f64, look_ahead: f64) -> f64 {
    let (north, east) = (target.0 - pose.north, target.1 - pose.east);
    let distance = (north * north + east * east).sqrt();
    let alpha = libm::atan2(east, north) - pose.yaw;
    libm::atan(2.0 * wheelbase * libm::sin(alpha) / distance.max(0.3 * look_ahead))
}

/// Angle of the wheels after Stanley: the path's heading less ours, less `atan(k e / (v + ks))` of the front axle's offset.
///
/// `to_front` is how far the front axle lies ahead of the pose, m.
pub fn stanley(pose: &Pose, path: &Path, to_front: f64, params: &FollowingParams) -> f64 {
    let (sin, cos) = libm::sincos(pose.yaw);
    let (north, east) = (pose.north + to_front * cos, pose.east + to_front * sin);
    let at = path.nearest(north, east);
    let offset = path.offset(at, north, east);
    let softened = pose.speed.max(0.0) + params.stanley_softening;
    wrap_angle(path.points()[at].heading - pose.yaw) - libm::atan(params.stanley_gain * offset / softened)
}

/// Makes for a goal and stops there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoToGoal {
    goal: (f64, f64),
    is_stopping: bool,
}

/// Deceleration that a stop is planned with, m/s^2.
pub const STOP_DECELERATION: f64 = 0.5;
/// Margin before the goal, m.
const STOP_MARGIN: f64 = 0.05;

impl GoToGoal {
    /// Make for a goal (north, east), m.
    pub fn new(goal: (f64, f64)) -> Self {
        Self { goal, is_stopping: false }
    }

    /// Angle of the wheels: `atan(L k wrap(bearing - yaw))`.
    pub fn steer(&self, pose: &Pose, wheelbase: f64, gain: f64) -> f64 {
        let bearing = libm::atan2(self.goal.1 - pose.east, self.goal.0 - pose.north);
        libm::atan(wheelbase * gain * wrap_angle(bearing - pose.yaw))
    }

    /// Whether the car has to brake now; once it does, it does until it stands.
    pub fn stops(&mut self, pose: &Pose) -> bool {
        let (north, east) = (self.goal.0 - pose.north, self.goal.1 - pose.east);
        let needed = pose.speed * pose.speed / (2.0 * STOP_DECELERATION) + STOP_MARGIN;
        self.is_stopping |= (north * north + east * east).sqrt() <= needed;
        self.is_stopping
    }
}

/// The wheels' angle with its limits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steering {
    angle: f64,
    wanted: f64,
}

impl Steering {
    /// Ask for an angle, rad; one that is not finite is not asked for.
    pub fn ask(&mut self, angle: f64, params: &FollowingParams) {
        if angle.is_finite() {
            self.wanted = angle.clamp(-params.steer_limit, params.steer_limit);
        }
    }

    /// The angle `dt` s later.
    pub fn advance(&mut self, dt: f64, params: &FollowingParams) -> f64 {
        let most = params.steer_rate_limit * dt;
        self.angle += (self.wanted - self.angle).clamp(-most, most);
        self.angle
    }

    /// The angle now, rad.
    pub fn angle(&self) -> f64 {
        self.angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drive a bicycle with rear-axle kinematics by a law of the path; returns the last offset and heading.
    fn drive(law: impl Fn(&Pose, &Path) -> f64, start: Pose, path: &Path) -> (f64, f64) {
        let (mut pose, mut steering, params) = (start, Steering::default(), FollowingParams::default());
        for k in 0..4000 {
            if k % 10 == 0 {
                steering.ask(law(&pose, path), &params);
            }
            let delta = steering.advance(0.01, &params);
            pose.yaw += pose.speed * delta.tan() / 0.8 * 0.01;
            pose.north += pose.speed * pose.yaw.cos() * 0.01;
            pose.east += pose.speed * pose.yaw.sin() * 0.01;
        }
        (path.offset(path.nearest(pose.north, pose.east), pose.north, pose.east), pose.yaw)
    }

    #[test]
    fn both_laws_return_to_the_line_from_either_side() {
        // Catches a sign: the car would leave the line for good.
        let path = Path::from_segments(&[(60.0, 0.0)]);
        let params = FollowingParams::default();
        for east in [-2.0, 2.0] {
            let start = Pose { east, speed: 1.0, ..Pose::default() };
            let pursuit = |p: &Pose, path: &Path| {
                let t = path.ahead(path.nearest(p.north, p.east), params.look_ahead);
                pure_pursuit(p, (t.north, t.east), 0.8, params.look_ahead)
            };
            for (offset, yaw) in
                [drive(pursuit, start, &path), drive(|p, path| stanley(p, path, 0.8, &params), start, &path)]
            {
                // 40 m on, the slower of both has come down from 2 m by more than e^-8.
                assert!(offset.abs() < 1e-3 && yaw.abs() < 1e-3, "{east}: {offset} {yaw}");
            }
        }
    }

    #[test]
    fn on_a_circle_pure_pursuit_steers_the_circles_angle() {
        // Geometry: the arc through the car along its heading to any point of the same circle is the circle.
        let radius: f64 = 18.0;
        let pose = Pose { speed: 1.0, ..Pose::default() };
        for angle in [0.1_f64, 0.3, 0.5] {
            let target = (radius * angle.sin(), radius * (1.0 - angle.cos()));
            let delta = pure_pursuit(&pose, target, 0.8, 1.0);
            assert!((delta - (0.8 / radius).atan()).abs() < 1e-12, "{angle}");
        }
    }

    #[test]
    fn the_stop_holds_once_it_has_begun() {
        let mut goal = GoToGoal::new((10.0, 0.0));
        let at = |north, speed| Pose { north, speed, ..Pose::default() };
        assert!(!goal.stops(&at(8.9, 1.0)), "1.1 m to go, 1.05 m needed");
        assert!(goal.stops(&at(8.96, 1.0)));
        assert!(goal.stops(&at(8.0, 0.1)), "a jump of the estimate does not let the brake go");
        assert!(goal.steer(&at(0.0, 1.0), 0.8, 1.2).abs() < 1e-12);
        assert!(GoToGoal::new((10.0, 1.0)).steer(&at(0.0, 1.0), 0.8, 1.2) > 0.0, "goal to the right, steer right");
    }

    #[test]
    fn the_wheels_turn_no_faster_and_no_further_than_they_can() {
        let (mut steering, params) = (Steering::default(), FollowingParams::default());
        steering.ask(3.0, &params);
        assert!((steering.advance(0.1, &params) - 0.1 * params.steer_rate_limit).abs() < 1e-15);
        (0..100).for_each(|_| _ = steering.advance(0.1, &params));
        assert_eq!(steering.angle(), params.steer_limit);
        steering.ask(f64::NAN, &params);
        assert_eq!(steering.advance(0.1, &params), params.steer_limit, "nonsense is not asked for");
    }
}
