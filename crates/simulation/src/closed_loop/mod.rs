//! Closed loops: a car, its sensors, something that knows where it is, and the controllers of `drivescope_control`.
//!
//! A loop runs sample by sample, so that a page can grow it and a filter that this crate knows nothing of can close it: the
//! caller hands in what turns an epoch into a pose. Every loop also grows a [`Drive`], with which any estimator can be
//! tried afterwards. Source: SPEC navigation 8 to 10; Yun & Yu 2007, figures 5 to 7.
//! Departure: the specification's reference moves its planar cars by explicit Euler steps; here place and heading are
//! integrated with the speeds.
//!
//! ```
//! use drivescope_simulation::closed_loop::{ClosedLoop, Settings};
//! let settings = Settings::named("j_turn").ok_or("no such loop")?;
//! let mut run = ClosedLoop::new(settings, 1);
//! while !run.advance(1.0, &mut |_| None) {}
//! let summary = run.summary();
//! assert!((summary.peak_lateral_g - 0.15).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bicycle;
mod body;
mod car;
mod guidance;
mod log;
mod rows;
mod sensors;
mod settings;
mod summary;

use drivescope_control::Pose;
use drivescope_control::fixed_gain::FixedGain;
use drivescope_control::following::{STOP_DECELERATION, Steering};
use drivescope_control::path::Path;
use drivescope_control::vfh::Histogram;
use drivescope_control::yaw_moment::{YawMomentControl, YawMomentRow};
use drivescope_drive::channel::Channel;
use drivescope_drive::drive::{Drive, Epoch};
use drivescope_drive::geodesy::Geodetic;
use nalgebra::{Matrix3, Vector3};

pub use self::bicycle::{Action, Bicycle, KinematicBicycle};
use self::body::Body;
pub use self::car::SixDof;
use self::guidance::Guidance;
use self::log::Log;
pub use self::rows::{GuidanceRow, LoopRow};
pub use self::settings::{CarName, LoopParams, Navigation, PlantKind, SCENARIOS, Scenario, Settings, Task};
pub use self::summary::Summary;
use crate::motion::{Motion, daejeon};

/// Length of a sample, s, and samples from one decision of the guidance to the next.
pub const STEP: f64 = 0.01;
const DECISION: u64 = 10;

/// What a filter may know before the first epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Time of this state, s: one sample before the first epoch.
    pub time: f64,
    /// Where the car is; also the origin of the local frame.
    pub place: Geodetic,
    /// Velocity, north, east, down, m/s.
    pub velocity: Vector3<f64>,
    /// Rotation from body to north, east, down as it is believed.
    pub body_to_nav: Matrix3<f64>,
    /// How wrong the heading may be, 1-sigma, rad: 1.2 times the scenario's error (SPEC navigation 10.1), at least 5 deg.
    pub yaw_sigma: f64,
}

/// A closed loop being run: advance it, look at it as it grows, sum it up.
pub struct ClosedLoop {
    settings: Settings,
    body: Body,
    motion: Motion,
    sensors: sensors::Sensors,
    fixed_gain: FixedGain,
    known: Pose,
    guidance: Guidance,
    steering: Steering,
    control: YawMomentControl,
    speed: f64,
    log: Log,
    sample: u64,
    has_failed: bool,
}

impl ClosedLoop {
    /// Prepare a loop; all noise comes from the seed.
    pub fn new(settings: Settings, seed: u64) -> Self {
        let course = &settings.course;
        let speed = if course.start_in_motion { course.speed } else { 0.0 };
        let start = Pose { yaw: course.heading_error, speed, ..Pose::default() };
        let believed = Pose { yaw: 0.0, ..start };
        let body = Body::new(&settings, &start);
        let motion = body.motion(daejeon());
        let guidance = Guidance::new(&settings);
        let model = settings.yaw_model(settings.yaw_moment.model_friction);
        let posts = guidance.posts().to_vec();
        Self {
            sensors: sensors::Sensors::new(course, &posts, STEP, seed),
            fixed_gain: FixedGain::new(believed, daejeon()),
            known: believed,
            guidance,
            steering: Steering::default(),
            control: YawMomentControl::new(settings.yaw_moment.clone(), model),
            speed,
            log: Log::new(settings.scenario.name, &settings.vehicle()),
            sample: 0,
            has_failed: false,
            body,
            motion,
            settings,
        }
    }

    /// What the caller's filter may know before the first epoch.
    pub fn start(&self) -> Start {
        let yaw = if self.sample == 0 { 0.0 } else { self.known.yaw };
        let (sin, cos) = crate::math::sin_cos(yaw);
        Start {
            time: self.time() - STEP,
            place: daejeon(),
            velocity: Vector3::new(cos, sin, 0.0) * self.known.speed,
            body_to_nav: crate::math::rotation(0.0, 0.0, yaw),
            yaw_sigma: (1.2 * self.settings.course.heading_error.abs()).max(5.0_f64.to_radians()),
        }
    }

    /// Advance by this many seconds or to the end; says whether the end is reached.
    ///
    /// `navigator` turns an epoch into a pose in the local frame of the start; it is asked only where the setting
    /// `navigation` is `filter`. Where it has none, the last pose is kept.
    pub fn advance(&mut self, seconds: f64, navigator: &mut dyn FnMut(&Epoch) -> Option<Pose>) -> bool {
        let until = self.sample.saturating_add(libm::ceil(seconds.max(0.0) / STEP) as u64);
        while self.sample < until && !self.is_done() {
            let epoch = self.measure();
            self.known = match self.settings.course.navigation {
                Navigation::Truth => self.body.pose(),
                Navigation::FixedGain => self.fixed_gain.step(&epoch),
                Navigation::Filter => navigator(&epoch).filter(Pose::is_finite).unwrap_or(self.known),
            };
            self.act();
        }
        self.is_done()
    }

    /// Whether the end is reached, in time or because the car turned over.
    pub fn is_done(&self) -> bool {
        self.has_failed || self.sample > self.last_sample()
    }

    /// Whether the car turned over or left its model's range; what was written down ends before.
    pub fn has_failed(&self) -> bool {
        self.has_failed
    }

    /// Share that lies behind, 0 to 1.
    pub fn fraction(&self) -> f64 {
        if self.is_done() { 1.0 } else { self.sample as f64 / (self.last_sample() + 1) as f64 }
    }

    /// Time reached, s.
    pub fn time(&self) -> f64 {
        self.sample as f64 * STEP
    }

    fn last_sample(&self) -> u64 {
        libm::rint(self.settings.course.duration / STEP) as u64
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
    /// The car at every sample.
    pub fn rows(&self) -> &Channel<LoopRow> {
        &self.log.rows
    }
    /// The guidance at every decision.
    pub fn guidance(&self) -> &Channel<GuidanceRow> {
        &self.log.guidance
    }
    /// Magnitudes of the sectors at every decision, decision after decision; empty without avoidance.
    pub fn magnitudes(&self) -> &[f64] {
        &self.log.magnitudes
    }
    /// Whether each sector was blocked at every decision, as [`ClosedLoop::magnitudes`].
    pub fn blocked(&self) -> &[u8] {
        &self.log.blocked
    }
    /// The grid of echoes as it is now.
    pub fn histogram(&self) -> &Histogram {
        self.guidance.histogram()
    }
    /// The path, if one is followed.
    pub fn path(&self) -> Option<&Path> {
        self.guidance.path()
    }
    /// Obstacles: north and east of the start, and radius, m.
    pub fn obstacles(&self) -> &[[f64; 3]] {
        self.guidance.posts()
    }
    /// How large the car is: how far ahead of the place in the rows its front and its rear axle are, and its track, m.
    pub fn size(&self) -> [f64; 3] {
        let car = self.settings.vehicle();
        let rear = if matches!(self.body, Body::Kinematic(_)) { 0.0 } else { -car.cg_to_rear };
        [rear + car.cg_to_front + car.cg_to_rear, rear, car.track]
    }
    /// What the sensors measured, with the truth.
    pub fn drive(&self) -> &Drive {
        &self.log.drive
    }
    /// The loop so far in a few numbers.
    pub fn summary(&self) -> Summary {
        let obstacle = self.guidance.posts().first().map(|p| p[0]);
        summary::summary(&self.log.rows, &self.log.guidance, self.guidance.goal(), obstacle)
    }

    /// Measure at this sample.
    fn measure(&mut self) -> Epoch<'static> {
        let time = self.time();
        let next = self.body.motion(self.motion.place);
        let place = if self.sample == 0 { self.motion.place } else { self.motion.place_after(&next.velocity, STEP) };
        let now = Motion { place, ..next };
        let before = if self.sample == 0 { now } else { self.motion };
        let inertial = before.inertial_until(&now, STEP);
        self.motion = now;
        let pose = self.body.pose();
        let is_decision = self.sample.is_multiple_of(DECISION);
        let sees = is_decision && self.guidance.looks_out();
        let epoch = Epoch {
            time,
            imu: Some(self.sensors.imu(&inertial)),
            wheels: Some(self.sensors.wheels(pose.speed)),
            gnss: self.sensors.gnss(self.sample, &now),
            range: sees.then(|| self.sensors.ring(pose.north, pose.east, pose.yaw)),
            ..Epoch::default()
        };
        self.log.measured(&epoch, &pose, &now, &self.sensors.biases());
        epoch
    }

    /// Decide and move on to the next sample.
    fn act(&mut self) {
        let (time, truth) = (self.time(), self.body.pose());
        if self.sample.is_multiple_of(DECISION) && self.settings.scenario.task != Task::JTurn {
            let ranges = self.log.last_ranges(time);
            let decided = self.guidance.decide(&self.settings, &self.known, ranges.as_ref());
            if let Some(steer) = decided.steer {
                self.steering.ask(steer, &self.settings.following);
            }
            self.log.decided(time, &self.guidance, &decided, &truth, ranges.as_ref());
        }
        let steer = match self.settings.scenario.task {
            Task::JTurn => self.guidance.turned_wheels(&self.settings, time),
            _ => self.steering.advance(STEP, &self.settings.following),
        };
        let control = self.control.step(&self.known, steer, STEP);
        let action = Action { steer, brakes: control.brakes(), is_speed_held: self.settings.course.hold_speed };
        self.log_row(time, &truth, &action, &control);
        self.speed = self.next_speed(time);
        self.body.advance(&action, self.speed, STEP);
        self.sample += 1;
        self.has_failed = !self.body.is_upright();
    }

    /// Speed at the next sample, as the actuator brings it about.
    fn next_speed(&self, time: f64) -> f64 {
        let course = &self.settings.course;
        let wanted = if self.guidance.stops() || time < course.stand - 0.5 * STEP { 0.0 } else { course.speed };
        let slowing = course.acceleration.max(STOP_DECELERATION) * STEP;
        self.speed + (wanted - self.speed).clamp(-slowing, course.acceleration * STEP)
    }

    fn log_row(&mut self, time: f64, truth: &Pose, action: &Action, control: &YawMomentRow) {
        let row = LoopRow {
            north: truth.north,
            east: truth.east,
            yaw: truth.yaw,
            speed: truth.speed,
            lateral_speed: truth.lateral_speed,
            yaw_rate: truth.yaw_rate,
            sideslip: if truth.speed > 0.5 { libm::atan2(truth.lateral_speed, truth.speed) } else { 0.0 },
            lateral_acceleration: self.body.lateral_acceleration(action),
            steer: action.steer,
            known_north: self.known.north,
            known_east: self.known.east,
            known_yaw: self.known.yaw,
            surface: control.surface,
            yaw_rate_reference: control.yaw_rate_reference,
            moment_equivalent: control.moment_equivalent,
            switching_gain: control.switching_gain,
            moment_command: control.moment_command,
            moment: control.moment,
            brake_fl: control.brake_fl,
            brake_fr: control.brake_fr,
            brake_rl: control.brake_rl,
            brake_rr: control.brake_rr,
        };
        self.log.row(time, row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// A picture that took one car's size for all, or put every car's place at the same spot, is caught.
    #[test]
    fn the_size_is_that_of_the_car_about_the_place_that_its_plant_tells() {
        let size = |name: &str, car: &str| {
            let mut settings = Settings::named(name).unwrap();
            settings.set("car", &json!(car)).unwrap();
            ClosedLoop::new(settings, 1).size()
        };
        assert_eq!(size("obstacle_course", "yun_2007"), [0.8, 0.0, 0.8]);
        assert_eq!(size("j_turn", "yun_2007"), [0.4, -0.4, 0.8]);
        let [front, rear, track] = size("corner", "bmw_320i");
        assert!((front - 1.1562).abs() < 1e-12 && rear == -1.42272 && track == 1.39, "{front} {rear} {track}");
    }
}
