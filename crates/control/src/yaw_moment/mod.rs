//! Sliding-mode control of the yaw rate by braking the wheels of one side.
//!
//! State `x = [v_y / V, r]`, surface `s = S (x - x_d)` with `S = [s1, s2]` (default `[0, 1]`), input the yaw moment,
//! `b = [0, 1 / I_z]`. The reference is the steady yaw rate of the model at this steering angle and speed, limited by a
//! lateral acceleration and by friction, and smoothed; the reference of `v_y / V` is zero.
//! Source: Yun & Yu 2007, equations (20) to (42), corrected; SPEC navigation 9.
//! Departure: the paper does not give `x_d`; "yaw moment to zero" read literally is the mode `zero`, in which the car goes
//! straight on.

mod model;

use drivescope_drive::{choice, params, record};

pub use self::model::YawModel;
use crate::Pose;
use crate::sliding_mode::Law;
use crate::tyre::TyreName;

/// Standard gravity, m/s^2.
pub const GRAVITY: f64 = 9.80665;
/// Time constant of the reference, s. SPEC navigation 9.
const REFERENCE_LAG: f64 = 0.1;
/// Share of the friction that the reference may ask for.
const FRICTION_SHARE: f64 = 0.85;
/// Steering angle (0.5 deg, rad) and speed (m/s) below which the controller does nothing.
const LEAST_STEER: f64 = 0.008_726_646_259_971_648;
const LEAST_SPEED: f64 = 1.0;
/// Lower speeds are taken as this one where the model divides by the speed, m/s.
const SPEED_FLOOR: f64 = 0.5;
/// Share of a side's brake force on its front wheel, and share of a wheel's peak that a brake may use.
const FRONT_SHARE: f64 = 0.6;
const PEAK_SHARE: f64 = 0.8;

choice! {
    /// What the controller makes the yaw rate follow.
    pub enum YawTarget {
        /// The steady yaw rate of the model, limited.
        Limited = "limited",
        /// Zero, as the paper says literally.
        Zero = "zero",
        /// Nothing: the controller is off.
        Off = "off",
    }
}

params! {
    /// Tuning of the sliding-mode yaw-moment controller.
    pub struct YawMomentParams {
        /// What the yaw rate follows.
        yaw_target (""): choice YawTarget, from "SPEC navigation 9";
        /// Least speed of approach to the surface. More: harder braking, reached sooner.
        reaching_rate ("eta"): number = 0.5, "rad/s^2", 0.05 ..= 5.0 Log, from "SPEC navigation 9";
        /// Yaw acceleration by which the model may be wrong. More: harder braking, safer against a wrong model.
        model_error ("F_r"): number = 0.2, "rad/s^2", 0.0 ..= 2.0 Linear, from "SPEC navigation 9";
        /// Factor by which the model's yaw inertia may be wrong either way.
        gain_ratio ("xi_max"): number = 1.3, "1", 1.0 ..= 2.0 Linear, from "SPEC navigation 9";
        /// Half thickness of the boundary layer. More: smoother and less exact; 0: the brakes chatter.
        boundary_layer ("Phi"): number = 0.02, "rad/s", 0.0 ..= 0.2 Linear, from "SPEC navigation 9";
        /// Largest yaw moment.
        moment_limit ("mz_max"): number = 400.0, "N m", 10.0 ..= 20000.0 Log, from "SPEC navigation 9";
        /// Lateral acceleration that the reference is limited to.
        lateral_limit ("a_lim"): number = 1.470_997_5, "m/s^2", 0.49 ..= 9.81 Linear, from "SPEC navigation 9: 0.15 g";
        /// Time constant of the brakes.
        brake_lag (""): number = 0.05, "s", 0.0 ..= 0.5 Linear, from "SPEC navigation 9";
        /// Weight of the sideslip in the surface.
        sideslip_weight ("s1"): number = 0.0, "1/s", -5.0 ..= 5.0 Linear, from "SPEC navigation 9";
        /// Weight of the yaw rate in the surface.
        yaw_rate_weight ("s2"): number = 1.0, "1", 0.1 ..= 5.0 Linear, from "SPEC navigation 9";
        /// Friction that the model believes in, as a share of its tyres' own.
        model_friction ("mu"): number = 1.0, "1", 0.05 ..= 1.5 Linear, from "SPEC navigation 9";
        /// Tyre of the model.
        model_tyre (""): choice TyreName, from "Table 2 of the paper as printed";
    }
}

record! {
    /// What the controller decided and what the brakes do.
    pub struct YawMomentRow {
        /// Distance to the sliding surface.
        surface: "rad/s";
        /// Yaw rate that is followed.
        yaw_rate_reference: "rad/s";
        /// Yaw moment that would hold the surface if the model were right.
        moment_equivalent: "N m";
        /// Gain of the switching part.
        switching_gain: "rad/s^2";
        /// Yaw moment asked for.
        moment_command: "N m";
        /// Yaw moment that the brakes give.
        moment: "N m";
        /// Brake force of the front left wheel.
        brake_fl: "N";
        /// Brake force of the front right wheel.
        brake_fr: "N";
        /// Brake force of the rear left wheel.
        brake_rl: "N";
        /// Brake force of the rear right wheel.
        brake_rr: "N";
    }
}

impl YawMomentRow {
    /// Brake forces: front left, front right, rear left, rear right, N.
    pub fn brakes(&self) -> [f64; 4] {
        [self.brake_fl, self.brake_fr, self.brake_rl, self.brake_rr]
    }
}

/// The controller with its reference filter and its brakes.
#[derive(Clone, Debug)]
pub struct YawMomentControl {
    params: YawMomentParams,
    model: YawModel,
    reference: f64,
    moment: f64,
}

impl YawMomentControl {
    /// A controller that believes in a model.
    pub fn new(params: YawMomentParams, model: YawModel) -> Self {
        Self { params, model, reference: 0.0, moment: 0.0 }
    }

    /// Decide for the next `dt` s from the car's motion and the angle of its front wheels (rad).
    ///
    /// A motion that is not finite asks for no moment.
    pub fn step(&mut self, pose: &Pose, steer: f64, dt: f64) -> YawMomentRow {
        let slope = self.advance_reference(pose, steer, dt);
        let mut row = YawMomentRow { surface: 0.0, yaw_rate_reference: self.reference, ..YawMomentRow::default() };
        let p = &self.params;
        let is_active = p.yaw_target != YawTarget::Off && steer.abs() > LEAST_STEER && pose.speed > LEAST_SPEED;
        let mut command = 0.0;
        (row.moment_equivalent, row.switching_gain) = (0.0, 0.0);
        if is_active && pose.is_finite() {
            let speed = pose.speed.max(SPEED_FLOOR);
            let rates = self.model.rates(pose, steer);
            let error = (pose.lateral_speed / speed, pose.yaw_rate - self.reference);
            row.surface = p.sideslip_weight * error.0 + p.yaw_rate_weight * error.1; // (22)
            let drift = p.sideslip_weight * rates.0 / speed + p.yaw_rate_weight * (rates.1 - slope);
            let law = Law {
                reaching_rate: p.reaching_rate,
                model_error: p.yaw_rate_weight * p.model_error,
                gain_ratio: p.gain_ratio,
                boundary: p.boundary_layer,
            };
            let input = law.input(row.surface, p.yaw_rate_weight / self.model.inertia, drift);
            command = input.total.clamp(-p.moment_limit, p.moment_limit);
            (row.moment_equivalent, row.switching_gain) = (input.equivalent, input.gain);
        }
        row.moment_command = command;
        self.moment += (command - self.moment) * follow(dt, p.brake_lag);
        let brakes = self.model.allocate(self.moment);
        row.moment = 0.5 * self.model.track * (brakes[1] + brakes[3] - brakes[0] - brakes[2]);
        [row.brake_fl, row.brake_fr, row.brake_rl, row.brake_rr] = brakes;
        row
    }

    /// Move the reference on and return its slope, rad/s^2.
    fn advance_reference(&mut self, pose: &Pose, steer: f64, dt: f64) -> f64 {
        let p = &self.params;
        let speed = if pose.speed.is_finite() { pose.speed } else { 0.0 };
        let limit = p.lateral_limit.min(FRICTION_SHARE * p.model_friction * GRAVITY) / speed.max(SPEED_FLOOR);
        let wanted = if p.yaw_target == YawTarget::Limited && steer.is_finite() {
            self.model.steady_yaw_rate(speed, steer).clamp(-limit, limit)
        } else {
            0.0
        };
        let before = self.reference;
        self.reference += (wanted - before) * follow(dt, REFERENCE_LAG);
        if dt > 0.0 { (self.reference - before) / dt } else { 0.0 }
    }
}

/// Share of the way that a first-order lag goes in `dt` s.
fn follow(dt: f64, lag: f64) -> f64 {
    if lag > 0.0 { 1.0 - libm::exp(-dt.max(0.0) / lag) } else { 1.0 }
}

#[cfg(test)]
mod tests;
