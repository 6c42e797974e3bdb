//! The car's motion: one rigid body with six degrees of freedom on four springs, four spinning wheels, eight tyre
//! deflections; fixed-step Runge-Kutta of fourth order.
//!
//! Justified simplifications: wheels have no mass of their own in the vertical (their resonance at 10 to 15 Hz is above
//! what the estimators follow); tyres are vertically rigid; camber and toe are zero; the gyroscopic moment of the wheels
//! is left out (below 1 % of the load transfer of a car).
//!
//! Tyres: transient slip with relaxation lengths (Pacejka 2012, section 7.2), which at rest is a spring between rim and
//! road: a braked car stands still exactly instead of creeping.

use nalgebra::{Matrix3, Vector3};

use crate::car::{AIR_DENSITY, Car, WHEELS};
use crate::math::{matrix_of, quaternion};
use crate::road::{Patch, Road};
use crate::tyre::Tyre;

/// Length of one integration step, s.
pub const STEP: f64 = 0.002;

const SIZE: usize = 25;
const PLACE: usize = 0;
const VELOCITY: usize = 3;
const ATTITUDE: usize = 6;
const RATE: usize = 10;
const SPIN: usize = 13;
const AHEAD: usize = 17;
const ASIDE: usize = 21;

/// Below this speed the tyres' deflection is damped in addition, m/s.
const SLOW: f64 = 2.0;
/// That damping at rest, N s/m per N of load.
const SLOW_DAMPING: f64 = 1.5;

type State = [f64; SIZE];

fn vector(state: &State, at: usize) -> Vector3<f64> {
    Vector3::new(state[at], state[at + 1], state[at + 2])
}

fn put(state: &mut State, at: usize, v: &Vector3<f64>) {
    state[at..at + 3].copy_from_slice(v.as_slice());
}

/// What driver and drive line do to the wheels during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Mean angle of the front wheels, right positive, rad.
    pub steer: f64,
    /// Drive torque at each wheel, N m.
    pub drive: [f64; WHEELS],
    /// Torque that each brake can hold, N m.
    pub brake: [f64; WHEELS],
}

/// What acts on the car.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forces {
    /// Vertical load of each tyre, N.
    pub load: [f64; WHEELS],
    /// Force of each tyre along its wheel's heading, N.
    pub ahead: [f64; WHEELS],
    /// Force of each tyre to the right of its wheel's heading, N.
    pub aside: [f64; WHEELS],
    /// Sum of the tyres' forces along the body's forward and right axes, by axle (front, rear), N.
    pub axle: [(f64, f64); 2],
}

/// How a wheel may spin during a step: brake and rolling resistance are dry friction.
#[derive(Clone, Copy, Debug, Default)]
struct Friction {
    locked: bool,
    torque: f64,
}

/// The moving car on its road.
#[derive(Clone, Debug)]
pub struct Plant {
    /// The car.
    pub car: Car,
    gravity: f64,
    state: State,
    patch: Patch,
    forces: Forces,
    /// Angle that each wheel has turned since the start, rad.
    turned: [f64; WHEELS],
}

impl Plant {
    /// The car at rest on the road at arc length `s`, springs at their level rest.
    pub fn new(car: Car, road: &Road, s: f64, gravity: f64) -> Self {
        let patch = road.patch(s);
        let p = patch.point;
        let mut state = [0.0; SIZE];
        put(&mut state, PLACE, &(patch.centre - patch.axes.column(2) * car.params.cg_height));
        state[ATTITUDE..ATTITUDE + 4].copy_from_slice(&quaternion(p.bank, p.grade, p.heading));
        let forces = Forces { load: car.rest_load, ..Forces::default() };
        Self { car, gravity, state, patch, forces, turned: [0.0; WHEELS] }
    }

    /// Set the car rolling along the road at a speed, m/s, wheels turning with it.
    pub fn set_speed(&mut self, speed: f64) {
        put(&mut self.state, VELOCITY, &(self.patch.axes.column(0) * speed));
        self.state[SPIN..SPIN + WHEELS].fill(speed / self.car.common.wheel_radius);
    }

    /// Place of the centre of gravity in level coordinates, m.
    pub fn place(&self) -> Vector3<f64> {
        vector(&self.state, PLACE)
    }
    /// Velocity of the centre of gravity in level axes, m/s.
    pub fn velocity(&self) -> Vector3<f64> {
        vector(&self.state, VELOCITY)
    }
    /// Rotation from body to level axes.
    pub fn attitude(&self) -> Matrix3<f64> {
        matrix_of(&self.quaternion())
    }
    fn quaternion(&self) -> [f64; 4] {
        [self.state[ATTITUDE], self.state[ATTITUDE + 1], self.state[ATTITUDE + 2], self.state[ATTITUDE + 3]]
    }
    /// Turn rate of the body against the level axes, body axes, rad/s.
    pub fn rate(&self) -> Vector3<f64> {
        vector(&self.state, RATE)
    }
    /// Speed of each wheel's rim, m/s; exactly 0 where the wheel is locked.
    pub fn rim_speed(&self) -> [f64; WHEELS] {
        std::array::from_fn(|i| self.state[SPIN + i] * self.car.common.wheel_radius)
    }
    /// Angle that each wheel has turned since the start, rad.
    pub fn turned(&self) -> [f64; WHEELS] {
        self.turned
    }
    /// The road round the car.
    pub fn patch(&self) -> &Patch {
        &self.patch
    }
    /// Forces at the end of the last step.
    pub fn forces(&self) -> &Forces {
        &self.forces
    }
    /// Offset of the centre of gravity to the right of the centre line, m.
    pub fn offset(&self) -> f64 {
        self.patch.axes.column(1).dot(&(self.place() - self.patch.centre))
    }

    /// Downward normal of the plane through the road under the four wheels, level axes; roughness is not part of it.
    pub fn wheel_plane(&self) -> Vector3<f64> {
        let to_road = self.patch.axes.transpose();
        let (centre, attitude) = (to_road * (self.place() - self.patch.centre), to_road * self.attitude());
        let under = |i: usize| {
            let q = centre + attitude * self.car.ground_points[i];
            Vector3::new(q.x, q.y, self.patch.surface(q.x, q.y).0)
        };
        let (forward_right, forward_left) = (under(1) - under(2), under(0) - under(3));
        (self.patch.axes * forward_left.cross(&forward_right)).normalize()
    }

    /// Energy of motion and of height, J; the springs' is left out.
    pub fn energy(&self) -> f64 {
        let (v, w) = (self.velocity(), self.rate());
        let spins: f64 = self.state[SPIN..SPIN + WHEELS].iter().map(|s| s * s).sum();
        let turning = self.car.inertia.component_mul(&w).dot(&w) + self.car.common.wheel_inertia * spins;
        let height = -self.place().z * self.car.mass * self.gravity;
        0.5 * (self.car.mass * v.norm_squared() + turning) + height
    }

    /// Advance by [`STEP`].
    pub fn step(&mut self, road: &Road, inputs: &Inputs) {
        let friction = self.friction(inputs);
        let half = 0.5 * STEP;
        let (k1, forces) = self.slope(road, &self.state, inputs, &friction);
        let (k2, _) = self.slope(road, &along(&self.state, &k1, half), inputs, &friction);
        let (k3, _) = self.slope(road, &along(&self.state, &k2, half), inputs, &friction);
        let (k4, _) = self.slope(road, &along(&self.state, &k3, STEP), inputs, &friction);
        let mut next = self.state;
        for i in 0..SIZE {
            next[i] += STEP / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
        for (i, turned) in self.turned.iter_mut().enumerate() {
            let (before, after) = (self.state[SPIN + i], &mut next[SPIN + i]);
            // Dry friction stops a wheel; it never turns it round.
            if before * *after < 0.0 {
                *after = 0.0;
            }
            *turned += half * (before + *after);
        }
        let norm = 1.0 / next[ATTITUDE..ATTITUDE + 4].iter().map(|q| q * q).sum::<f64>().sqrt();
        next[ATTITUDE..ATTITUDE + 4].iter_mut().for_each(|q| *q *= norm);
        self.state = next;
        self.forces = forces;
        let ahead = self.patch.axes.column(0).dot(&(self.place() - self.patch.centre));
        self.patch = road.patch(self.patch.s + ahead / (1.0 - self.offset() * self.patch.turn.z));
    }

    fn friction(&self, inputs: &Inputs) -> [Friction; WHEELS] {
        std::array::from_fn(|i| {
            let common = &self.car.common;
            let rolling = common.rolling_resistance * self.forces.load[i] * common.wheel_radius;
            let holds = inputs.brake[i] + rolling;
            let spin = self.state[SPIN + i];
            let drive = inputs.drive[i] - common.wheel_radius * self.forces.ahead[i];
            if spin == 0.0 {
                return Friction { locked: drive.abs() <= holds, torque: holds * drive.signum() };
            }
            Friction { locked: false, torque: holds * spin.signum() }
        })
    }

    /// Time derivative of the state, and the forces behind it.
    fn slope(&self, road: &Road, state: &State, inputs: &Inputs, friction: &[Friction; WHEELS]) -> (State, Forces) {
        let car = &self.car;
        let to_road = self.patch.axes.transpose();
        let q = [state[ATTITUDE], state[ATTITUDE + 1], state[ATTITUDE + 2], state[ATTITUDE + 3]];
        let rate = vector(state, RATE);
        let attitude = to_road * matrix_of(&q);
        let view = View {
            centre: to_road * (vector(state, PLACE) - self.patch.centre),
            velocity: to_road * vector(state, VELOCITY),
            rate: attitude * rate,
            attitude,
        };
        let mut slope = [0.0; SIZE];
        let mut forces = Forces::default();
        let touch = self.touch(road, &view);
        let mut force = -view.velocity * (0.5 * AIR_DENSITY * car.common.drag_area * view.velocity.norm());
        let mut moment = Vector3::zeros();
        for i in 0..WHEELS {
            let tyre = self.rolling(state, &view, &touch[i], i, inputs.steer);
            let spring = touch[i].up * touch[i].spring;
            force += spring + tyre.force;
            moment += touch[i].arm.cross(&(spring + tyre.force));
            (slope[AHEAD + i], slope[ASIDE + i]) = tyre.deflection_rates;
            (forces.load[i], forces.ahead[i], forces.aside[i]) = (tyre.load, tyre.ahead, tyre.aside);
            let axle = &mut forces.axle[i / 2];
            axle.0 += tyre.force.dot(&view.attitude.column(0));
            axle.1 += tyre.force.dot(&view.attitude.column(1));
            let torque = inputs.drive[i] - car.common.wheel_radius * tyre.ahead - friction[i].torque;
            slope[SPIN + i] = if friction[i].locked { 0.0 } else { torque / car.common.wheel_inertia };
        }
        put(&mut slope, PLACE, &vector(state, VELOCITY));
        let gravity = Vector3::new(0.0, 0.0, self.gravity);
        put(&mut slope, VELOCITY, &(self.patch.axes * force / car.mass + gravity));
        let spun = car.inertia.component_mul(&rate);
        let turn = (attitude.transpose() * moment - rate.cross(&spun)).component_div(&car.inertia);
        put(&mut slope, RATE, &turn);
        slope[ATTITUDE..ATTITUDE + 4].copy_from_slice(&quaternion_rate(&q, &rate));
        (slope, forces)
    }

    /// Where springs and links reach the body above a wheel, body axes.
    fn link_point(&self, wheel: usize) -> Vector3<f64> {
        let ground = &self.car.ground_points[wheel];
        Vector3::new(ground.x, ground.y, self.car.link_depth)
    }

    /// Springs, dampers and bars against the surface under each wheel.
    fn touch(&self, road: &Road, view: &View) -> [Touch; WHEELS] {
        let car = &self.car;
        let mut touch: [Touch; WHEELS] = std::array::from_fn(|i| {
            let arm = view.attitude * self.link_point(i);
            let place = view.centre + arm;
            let velocity = view.velocity + view.rate.cross(&arm);
            let (depth, slope_ahead, slope_aside) = self.patch.surface(place.x, place.y);
            let s = self.patch.s + place.x / (1.0 - place.y * self.patch.turn.z);
            let (height, rough_slope) = road.roughness(i % 2, s);
            let depth = depth - height;
            let up = Vector3::new(slope_ahead - rough_slope, slope_aside, -1.0);
            let length = up.norm();
            let rate = -up.dot(&velocity);
            let squeeze = place.z + car.link_height - depth;
            let spring = car.rest_load[i] + car.spring[i] * squeeze + car.damper[i] * rate;
            Touch { arm, velocity, up: up / length, squeeze, spring, grip: road.grip(i % 2, s) }
        });
        for (left, right) in [(0, 1), (2, 3)] {
            let twist = car.bar[left] * (touch[left].squeeze - touch[right].squeeze);
            touch[left].spring = (touch[left].spring + twist).max(0.0);
            touch[right].spring = (touch[right].spring - twist).max(0.0);
        }
        touch
    }

    /// Load that the links, not the springs, carry to a wheel, N: from the forces of the last step.
    fn link_load(&self, wheel: usize) -> f64 {
        let car = &self.car;
        let axle = &self.forces.axle;
        let lateral = axle[wheel / 2].1 * car.link_height / car.params.track;
        let along = (axle[0].0 + axle[1].0) * car.link_height / (2.0 * car.wheelbase());
        (if wheel.is_multiple_of(2) { lateral } else { -lateral }) + if wheel < 2 { -along } else { along }
    }

    /// One tyre on its patch of road.
    fn rolling(&self, state: &State, view: &View, touch: &Touch, i: usize, steer: f64) -> Rolling {
        let dry = &self.car.tyre[i];
        let tyre = Tyre { friction: dry.friction * touch.grip, ..*dry };
        let load = (touch.spring + self.link_load(i)).max(0.0);
        let (sin, cos) = if i < 2 { short_sin_cos(self.wheel_angle(steer, i)) } else { (0.0, 1.0) };
        let heading = view.attitude * Vector3::new(cos, sin, 0.0);
        let ahead = (heading - touch.up * heading.dot(&touch.up)).normalize();
        let aside = ahead.cross(&touch.up);
        let velocity = touch.velocity;
        let rim = state[SPIN + i] * self.car.common.wheel_radius;
        let (along, across) = (velocity.dot(&ahead), velocity.dot(&aside));
        let slide = along - rim;
        let speed = along.abs().max(rim.abs());
        let kappa = state[AHEAD + i] / tyre.relaxation_ahead;
        let tangent = state[ASIDE + i] / tyre.relaxation_aside;
        let (mut force_ahead, mut force_aside) = tyre.force(kappa, tangent, load);
        if speed < SLOW {
            let fade = 1.0 - speed * speed / (SLOW * SLOW);
            let damping = SLOW_DAMPING * load * fade * fade;
            force_ahead -= damping * slide;
            force_aside -= damping * across;
        }
        Rolling {
            force: ahead * force_ahead + aside * force_aside,
            load,
            ahead: force_ahead,
            aside: force_aside,
            deflection_rates: (-slide - speed * kappa, across - speed * tangent),
        }
    }

    /// Angle of a front wheel: the inner one turns further.
    fn wheel_angle(&self, steer: f64, wheel: usize) -> f64 {
        let spread = 0.5 * self.car.common.ackermann * self.car.params.track / self.car.wheelbase() * steer * steer;
        if wheel == 1 { steer + spread } else { steer - spread }
    }
}

/// Derivative of an attitude quaternion at a turn rate in body axes, rad/s.
fn quaternion_rate([w, x, y, z]: &[f64; 4], rate: &Vector3<f64>) -> [f64; 4] {
    [
        -0.5 * (x * rate.x + y * rate.y + z * rate.z),
        0.5 * (w * rate.x + y * rate.z - z * rate.y),
        0.5 * (w * rate.y + z * rate.x - x * rate.z),
        0.5 * (w * rate.z + x * rate.y - y * rate.x),
    ]
}

/// The body as seen from the road's axes.
struct View {
    centre: Vector3<f64>,
    velocity: Vector3<f64>,
    rate: Vector3<f64>,
    attitude: Matrix3<f64>,
}

/// A wheel's stand on the road.
#[derive(Clone, Copy)]
struct Touch {
    /// From the centre of gravity to the point where springs and links reach the body.
    arm: Vector3<f64>,
    velocity: Vector3<f64>,
    up: Vector3<f64>,
    squeeze: f64,
    spring: f64,
    /// Friction here as a share of the dry road's.
    grip: f64,
}

/// One tyre's part of the motion: its force in road axes and along its own, and how its deflections change.
struct Rolling {
    force: Vector3<f64>,
    load: f64,
    ahead: f64,
    aside: f64,
    deflection_rates: (f64, f64),
}

/// Sine and cosine of a steering angle by their series; below 0.7 rad the next terms are under 2e-4.
fn short_sin_cos(angle: f64) -> (f64, f64) {
    let a2 = angle * angle;
    (angle * (1.0 - a2 / 6.0 * (1.0 - a2 / 20.0)), 1.0 - 0.5 * a2 * (1.0 - a2 / 12.0 * (1.0 - a2 / 30.0)))
}

fn along(state: &State, slope: &State, time: f64) -> State {
    std::array::from_fn(|i| state[i] + slope[i] * time)
}
