//! Kalman filter of attitude that knows the road: bank and grade, gyro bias and lateral mismatch are states.
//!
//! The springs answer to the specific force, which holds gravity already; on a bank they tell the body's angle against
//! the road, and what the lateral accelerometer feels beyond the turn is the road's. With a gate it leaves disturbed
//! fields out; with the forward accelerometer it keeps the grade while it does.
//!
//! Source: SPEC orientation 8 and 9, beyond Hwang & Choi 2016. Departures: `P <- P - K S K'`, symmetric as it stands, where
//! the specification has Joseph's form; no variance here is so small against its innovation's that they differ by more
//! than rounding. The lateral force is used at rest and in reverse too: a standing car feels its lean best. A field that
//! is believed again but still far from the attitude starts the filter again from the vectors.

use drivescope_drive::frames::{Euler, wrap_angle};
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{Vector3, vector};

use super::GRAVITY;
use super::attitude::Rotation;
use super::detector::Derivative;
use super::estimate::OrientationEstimate;
use super::gate::{Decision, Gate};
use super::hindsight::{Hindsight, Kept};
use super::model::Input;
use super::params::{OrientationParams, Variant};
use super::road_model::{
    BANK, Covariance, GRADE, GYRO_BIAS, LEAN, MISMATCH, Point, RoadModel, SQUAT, STATES, State, Transition, YAW,
    jacobian, rates,
};
use super::sample::{RoadFindings, Sample};
use super::trig::sin_cos;
use super::whitened::Whitened;

/// Time constant of both poles of the yaw acceleration, s.
const YAW_ACCELERATION_TIME: f64 = 0.05;
/// The forward accelerometer is used once its filter has settled, s.
const FORWARD_DELAY: f64 = 1.0;
/// What a re-acquired field may have missed: standard deviations of yaw and of the road's angles, rad.
const REACQUIRED_YAW: f64 = 10.0 * std::f64::consts::PI / 180.0;
const REACQUIRED_ROAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// The longest time between two fields that the gate's clocks count, s.
const LONGEST_FIELD_STEP: f64 = 0.5;

/// What a road filter starts with, made once from parameters and car.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoadSetup {
    model: RoadModel,
    /// Variances of the start.
    start: State,
    /// Variances per second.
    walk: State,
    field_variance: f64,
    lateral_variance: f64,
    forward_variance: f64,
    /// Rear axle behind the centre of gravity, m, and its slip stiffness times gravity, m/s^2.
    rear_arm: f64,
    rear_slip: f64,
    gate: Option<Gate>,
    hindsight: f64,
    uses_forward: bool,
}

impl RoadSetup {
    pub(super) fn new(p: &OrientationParams, vehicle: &VehicleParams) -> Self {
        let (angle, rate) = (0.5f64.to_radians(), 2f64.to_radians());
        let (yaw, bank, grade) = (3f64.to_radians(), 3f64.to_radians(), 4f64.to_radians());
        let start = vector![angle, rate, angle, rate, yaw, bank, grade, p.gyro_bias_start, p.mismatch_sigma];
        let s = p.suspension_walk;
        let lateral = (2.0 / p.mismatch_time).sqrt() * p.mismatch_sigma;
        let walk = vector![0.0, s, 0.0, s, p.road_yaw_walk, p.bank_walk, p.grade_walk, p.gyro_bias_walk, lateral];
        Self {
            model: RoadModel::new(p, vehicle),
            start: start.map(|s| s * s),
            walk: walk.map(|s| s * s),
            field_variance: p.field_sigma * p.field_sigma,
            lateral_variance: p.lateral_sigma * p.lateral_sigma,
            forward_variance: p.forward_sigma * p.forward_sigma,
            rear_arm: vehicle.cg_to_rear,
            rear_slip: p.rear_slip_stiffness * GRAVITY,
            gate: (p.variant != Variant::Road).then(|| Gate::new(p)),
            hindsight: p.gate_hindsight,
            uses_forward: p.variant == Variant::RobustAx,
        }
    }
}

/// The Earth's field as the filter expects it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    /// North, east and down, uT.
    pub(super) field: Vector3<f64>,
    /// Strength, uT.
    pub(super) strength: f64,
    /// Angle below the horizontal, rad.
    pub(super) dip: f64,
}

/// The filter.
#[derive(Clone, Debug)]
pub(super) struct RoadFilter {
    setup: RoadSetup,
    pub(super) x: State,
    pub(super) p: Covariance,
    gate: Option<Gate>,
    hindsight: Hindsight,
    yaw_acceleration: Derivative,
    /// Forward force without gravity behind the two poles of the speed's derivative.
    forward: [Option<f64>; 2],
    age: f64,
    field_age: f64,
}

impl RoadFilter {
    /// Start at an attitude with the body leaning as the lateral force and gravity along the car make it.
    pub(super) fn new(setup: &RoadSetup, attitude: &Euler, accel_y: f64) -> Self {
        let (lean, squat) = setup.model.suspension.at_rest(accel_y, GRAVITY * attitude.pitch.sin());
        let mut x = State::zeros();
        (x[LEAN], x[SQUAT], x[YAW]) = (lean, squat, attitude.yaw);
        (x[BANK], x[GRADE]) = (attitude.roll - lean, attitude.pitch - squat);
        Self {
            setup: *setup,
            x,
            p: Covariance::from_diagonal(&setup.start),
            gate: setup.gate,
            hindsight: Hindsight::new(setup.hindsight),
            yaw_acceleration: Derivative::new(YAW_ACCELERATION_TIME),
            forward: [None; 2],
            age: 0.0,
            field_age: 0.0,
        }
    }

    /// Carry the filter over one sample; `None` if it broke.
    pub(super) fn step(&mut self, s: &Sample, reference: &Reference) -> Option<RoadFindings> {
        if self.gate.as_ref().is_some_and(Gate::is_open) {
            let Self { x, p, yaw_acceleration, forward, age, .. } = *self;
            self.hindsight.note(s, || Kept { x, p, yaw_acceleration, forward, age });
        }
        self.predict(&s.input, s.dt);
        let mut findings = RoadFindings { dip_error: f64::NAN, nis: f64::NAN, decision: None, lateral_nis: f64::NAN };
        if let Some(field) = &s.field {
            self.fold_in_field(field, reference, &mut findings)?;
        }
        findings.lateral_nis = self.fold_in_forces(s)?;
        self.x[YAW] = wrap_angle(self.x[YAW]);
        (0..STATES).all(|i| self.p[(i, i)] >= 0.0).then_some(findings)
    }

    /// Lateral and forward force. Returns the former's normalized innovation squared, NaN where it was not used.
    fn fold_in_forces(&mut self, s: &Sample) -> Option<f64> {
        let turning = self.yaw_acceleration.step(s.input.yaw_rate, s.dt);
        let nis = if s.is_fresh { self.fold_in_lateral(s, turning)? } else { f64::NAN };
        if self.setup.uses_forward
            && let Some(force) = s.accel_x
        {
            self.fold_in_forward(force, s)?;
        }
        Some(nis)
    }

    /// Take back what the fields before the gate shut have done, up to the prediction to now.
    #[cold]
    fn look_back(&mut self) -> Option<()> {
        let Some((before, samples)) = self.hindsight.take() else { return Some(()) };
        (self.x, self.p, self.yaw_acceleration) = (before.x, before.p, before.yaw_acceleration);
        (self.forward, self.age) = (before.forward, before.age);
        let (now, passed) = samples.split_last()?;
        for s in passed {
            self.predict(&s.input, s.dt);
            self.fold_in_forces(s)?;
        }
        self.predict(&now.input, now.dt);
        Some(())
    }

    fn predict(&mut self, u: &Input, dt: f64) {
        let m = &self.setup.model;
        let here = Point::new(&self.x, u, m);
        let transition = Transition::new(&jacobian(&here, u, m), dt);
        let middle = self.x + rates(&self.x, &here, u, m) * (0.5 * dt);
        self.x += rates(&middle, &Point::new(&middle, u, m), u, m) * dt;
        transition.propagate(&mut self.p, &(self.setup.walk * dt));
        self.age += dt;
        self.field_age += dt;
    }

    /// Columns of `P` summed to what roll, pitch and yaw share with every state.
    fn by_angle(&self) -> [State; 3] {
        let p = &self.p.data.0;
        let sum = |a: usize, b: usize| State::from_fn(|i, _| p[a][i] + p[b][i]);
        [sum(LEAN, BANK), sum(SQUAT, GRADE), State::from(p[YAW])]
    }

    fn fold_in_field(&mut self, field: &Vector3<f64>, h: &Reference, out: &mut RoadFindings) -> Option<()> {
        let rotation = Rotation::new(&self.attitude());
        let (predicted, by_angle) = rotation.predicted_field(&h.field);
        let innovation = field - predicted;
        let strength = field.norm();
        let sine = field.dot(&rotation.down()) / strength;
        out.dip_error = sine.clamp(-1.0, 1.0).asin() - h.dip;
        let mut shared = self.by_angle();
        let nominal = self.setup.field_variance;
        let mut whitened = Whitened::new(&shared, &by_angle, nominal, &innovation)?;
        out.nis = whitened.nis;
        let mut decision = Decision::Use(1.0);
        if let Some(gate) = &mut self.gate {
            let dt = self.field_age.min(LONGEST_FIELD_STEP);
            decision = gate.judge(strength - h.strength, out.dip_error, out.nis, dt);
            out.decision = Some(decision);
        }
        self.field_age = 0.0;
        match decision {
            Decision::Leave(_) => return self.look_back(),
            Decision::Use(scale) if scale > 1.0 => {
                whitened = Whitened::new(&shared, &by_angle, nominal * scale, &innovation)?;
            }
            Decision::Use(_) => {}
            Decision::Reacquire => {
                self.p[(YAW, YAW)] += REACQUIRED_YAW * REACQUIRED_YAW;
                self.p[(BANK, BANK)] += REACQUIRED_ROAD * REACQUIRED_ROAD;
                self.p[(GRADE, GRADE)] += REACQUIRED_ROAD * REACQUIRED_ROAD;
                shared = self.by_angle();
                whitened = Whitened::new(&shared, &by_angle, nominal, &innovation)?;
                // An attitude that is wrong by more than this is not mended by a linear step.
                if whitened.nis > self.gate.as_ref().map_or(f64::MAX, Gate::largest_nis) {
                    return None;
                }
            }
        }
        self.correct(&whitened.gains(&shared, &by_angle), &whitened.innovation);
        Some(())
    }

    /// `x <- x + W z`, `P <- P - W W'` for independent unit innovations `z`.
    fn correct<const M: usize>(&mut self, gains: &[State; M], innovations: &[f64; M]) {
        for (w, z) in gains.iter().zip(innovations) {
            self.x += w * *z;
        }
        for (c, column) in self.p.data.0.iter_mut().enumerate() {
            for (r, value) in column.iter_mut().enumerate() {
                *value -= gains.iter().map(|w| w[r] * w[c]).sum::<f64>();
            }
        }
    }

    /// Fold in one number: what it shares with every state (`P h'`), its innovation variance and its innovation.
    /// Returns its normalized innovation squared.
    fn fold_in(&mut self, shared: &State, variance: f64, innovation: f64) -> Option<f64> {
        if !(variance > 0.0 && innovation.is_finite()) {
            return None;
        }
        let root = 1.0 / variance.sqrt();
        let z = innovation * root;
        self.correct(&[shared * root], &[z]);
        Some(z * z)
    }

    /// Lateral force: turn, change of turn through the slip of the rear axle, mismatch, gravity.
    fn fold_in_lateral(&mut self, s: &Sample, turning: f64) -> Option<f64> {
        let Euler { roll, pitch, .. } = self.angles();
        let ((sin_roll, cos_roll), (sin_pitch, cos_pitch)) = (sin_cos(roll), sin_cos(pitch));
        let slip = self.setup.rear_arm - s.speed * s.speed / self.setup.rear_slip;
        let felt = s.speed * (s.input.yaw_rate - self.x[GYRO_BIAS]) + slip * turning + self.x[MISMATCH]
            - GRAVITY * sin_roll * cos_pitch;
        let (by_roll, by_pitch) = (-GRAVITY * cos_roll * cos_pitch, GRAVITY * sin_roll * sin_pitch);
        let [roll, pitch, _] = self.by_angle();
        let shared = roll * by_roll + pitch * by_pitch - self.p.column(GYRO_BIAS) * s.speed + self.p.column(MISMATCH);
        let variance = by_roll * (shared[LEAN] + shared[BANK]) + by_pitch * (shared[SQUAT] + shared[GRADE])
            - s.speed * shared[GYRO_BIAS]
            + shared[MISMATCH]
            + self.setup.lateral_variance;
        self.fold_in(&shared, variance, s.input.accel_y - felt)
    }

    /// Forward force less gravity along the car against the change of speed, both behind the same two poles.
    fn fold_in_forward(&mut self, force: f64, s: &Sample) -> Option<()> {
        let (sin, cos) = sin_cos(self.x[SQUAT] + self.x[GRADE]);
        let input = force - GRAVITY * sin;
        let gain = Derivative::speed_gain(s.dt);
        let first = self.forward[0].map_or(input, |f| f + gain * (input - f));
        let second = self.forward[1].map_or(input, |f| f + gain * (first - f));
        self.forward = [Some(first), Some(second)];
        if self.age <= FORWARD_DELAY {
            return Some(());
        }
        let [_, pitch, _] = self.by_angle();
        let by_pitch = GRAVITY * cos;
        let shared = pitch * by_pitch;
        let variance = by_pitch * (shared[SQUAT] + shared[GRADE]) + self.setup.forward_variance;
        self.fold_in(&shared, variance, second - s.speed_change).map(|_| ())
    }

    /// Roll, pitch and yaw, the latter as the state has it.
    fn angles(&self) -> Euler {
        Euler { roll: self.x[LEAN] + self.x[BANK], pitch: self.x[SQUAT] + self.x[GRADE], yaw: self.x[YAW] }
    }

    pub(super) fn attitude(&self) -> Euler {
        let Euler { roll, pitch, yaw } = self.angles();
        Euler { roll, pitch, yaw: wrap_angle(yaw) }
    }

    /// 1-sigma of roll, pitch and yaw, rad.
    pub(super) fn sigma(&self) -> [f64; 3] {
        let sum = |a: usize, b: usize| root(self.p[(a, a)] + self.p[(b, b)] + 2.0 * self.p[(a, b)]);
        [sum(LEAN, BANK), sum(SQUAT, GRADE), self.p[(YAW, YAW)].sqrt()]
    }

    /// Put suspension, road and bias into an estimate.
    pub(super) fn fill(&self, out: &mut OrientationEstimate) {
        let sigma = |i: usize| root(self.p[(i, i)]);
        (out.suspension_roll, out.suspension_roll_sigma) = (self.x[LEAN], sigma(LEAN));
        (out.suspension_pitch, out.suspension_pitch_sigma) = (self.x[SQUAT], sigma(SQUAT));
        (out.road_bank, out.road_bank_sigma) = (self.x[BANK], sigma(BANK));
        (out.road_grade, out.road_grade_sigma) = (self.x[GRADE], sigma(GRADE));
        (out.gyro_bias, out.gyro_bias_sigma) = (self.x[GYRO_BIAS], sigma(GYRO_BIAS));
    }
}

/// Square root, 0 of what rounding made negative.
fn root(variance: f64) -> f64 {
    if variance > 0.0 { variance.sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kalman::{Observation, Outcome, update};
    use crate::orientation::model::PitchDrive;
    use crate::testing::assert_jacobian;
    use nalgebra::SMatrix;

    const FIELD: Vector3<f64> = Vector3::new(30.11237, -4.22703, 40.12585);

    fn reference() -> Reference {
        Reference { field: FIELD, strength: FIELD.norm(), dip: (FIELD.z / FIELD.norm()).asin() }
    }

    fn filter(variant: Variant) -> RoadFilter {
        let params = OrientationParams { variant, ..OrientationParams::default() };
        let setup = RoadSetup::new(&params, &VehicleParams::default());
        let mut filter = RoadFilter::new(&setup, &Euler { roll: 0.2, pitch: -0.1, yaw: 0.7 }, 1.5);
        let root = Covariance::from_fn(|i, j| ((5 * i + 2 * j) as f64).sin() / (1.0 + j as f64));
        filter.p += root * filter.p * root.transpose();
        crate::kalman::symmetrize(&mut filter.p);
        (filter.x[GYRO_BIAS], filter.x[MISMATCH]) = (0.003, 0.2);
        filter
    }

    fn joint<const M: usize>(
        before: &RoadFilter,
        y: [f64; M],
        h: SMatrix<f64, M, 9>,
        r: f64,
    ) -> (State, Covariance, f64) {
        let mut p = before.p;
        let obs = Observation { y: y.into(), h, r: SMatrix::identity() * r };
        let Outcome::Accepted { dx, nis } = update(&mut p, &obs, None).unwrap() else { panic!() };
        (before.x + dx, p, nis)
    }

    fn assert_same(found: &RoadFilter, wanted: &(State, Covariance, f64), nis: f64) {
        assert!((found.x - wanted.0).norm() < 1e-12, "{}", found.x - wanted.0);
        assert!((found.p - wanted.1).norm() < 1e-13 * found.p.norm().max(1e-3), "{}", found.p - wanted.1);
        assert!((nis - wanted.2).abs() < 1e-9 * wanted.2.max(1.0), "{nis} {}", wanted.2);
        assert_eq!(found.p, found.p.transpose());
    }

    #[test]
    fn the_field_update_is_the_joint_one_in_josephs_form() {
        // Catches a gain in the wrong column and roll or pitch that reaches only one of its two states.
        let before = filter(Variant::Road);
        let mut after = before.clone();
        let field = Vector3::new(20.0, -22.0, 41.0);
        let mut found = RoadFindings { dip_error: 0.0, nis: 0.0, decision: None, lateral_nis: 0.0 };
        after.fold_in_field(&field, &reference(), &mut found).unwrap();
        let (h, by_angle) = Rotation::new(&before.attitude()).predicted_field(&FIELD);
        let mut rows = SMatrix::<f64, 3, 9>::zeros();
        for (column, angle) in [(LEAN, 0), (BANK, 0), (SQUAT, 1), (GRADE, 1), (YAW, 2)] {
            rows.set_column(column, &by_angle.column(angle));
        }
        assert_same(&after, &joint(&before, (field - h).into(), rows, 0.36), found.nis);
    }

    fn sample(input: Input) -> Sample {
        Sample {
            input,
            speed: 22.0,
            speed_change: 0.4,
            accel_x: Some(1.0),
            is_fresh: true,
            field: None,
            is_static: false,
            dt: 0.01,
        }
    }

    #[test]
    fn the_lateral_row_is_the_derivative_of_the_lateral_force() {
        let before = filter(Variant::Road);
        let input = Input { yaw_rate: 0.1, accel_y: 1.5, pitch: PitchDrive::Derived(0.0) };
        let (s, turning, speed) = (sample(input), 0.3, 22.0f64);
        let slip = 1.42272 - speed * speed / (20.0 * GRAVITY);
        let felt = |x: &State| {
            let (roll, pitch) = (x[LEAN] + x[BANK], x[SQUAT] + x[GRADE]);
            let gravity = GRAVITY * roll.sin() * pitch.cos();
            vector![speed * (0.1 - x[GYRO_BIAS]) + slip * turning + x[MISMATCH] - gravity]
        };
        let (roll, pitch): (f64, f64) = (before.x[LEAN] + before.x[BANK], before.x[SQUAT] + before.x[GRADE]);
        let mut row = SMatrix::<f64, 1, 9>::zeros();
        (row[LEAN], row[BANK]) = (-GRAVITY * roll.cos() * pitch.cos(), -GRAVITY * roll.cos() * pitch.cos());
        (row[SQUAT], row[GRADE]) = (GRAVITY * roll.sin() * pitch.sin(), GRAVITY * roll.sin() * pitch.sin());
        (row[GYRO_BIAS], row[MISMATCH]) = (-speed, 1.0);
        assert_jacobian(felt, &row, &before.x, 1e-7);
        let mut after = before.clone();
        let nis = after.fold_in_lateral(&s, turning).unwrap();
        assert_same(&after, &joint(&before, [1.5 - felt(&before.x)[0]], row, 0.15 * 0.15), nis);
    }

    #[test]
    fn the_forward_force_is_used_after_its_filter_has_settled_and_pulls_the_pitch() {
        let input = Input { yaw_rate: 0.0, accel_y: 0.0, pitch: PitchDrive::Derived(0.0) };
        let mut f = filter(Variant::RobustAx);
        let pitch = f.attitude().pitch;
        let force = GRAVITY * (pitch + 0.05f64).sin() + 0.4;
        f.fold_in_forward(force, &sample(input)).unwrap();
        assert_eq!(f.attitude().pitch, pitch, "not yet");
        f.age = 1.01;
        let before = f.clone();
        f.fold_in_forward(force, &sample(input)).unwrap();
        // The filtered force holds 0.4 of acceleration and 0.05 rad of pitch that the filter does not know yet.
        let mut row = SMatrix::<f64, 1, 9>::zeros();
        (row[SQUAT], row[GRADE]) = (GRAVITY * pitch.cos(), GRAVITY * pitch.cos());
        let innovation = GRAVITY * ((pitch + 0.05).sin() - pitch.sin());
        let wanted = joint(&before, [innovation], row, 4.0);
        assert_same(&f, &wanted, wanted.2);
        assert!(f.attitude().pitch > pitch);
    }

    #[test]
    fn a_reacquired_field_is_believed_more_than_the_yaw() {
        let mut f = filter(Variant::Robust);
        f.p = Covariance::from_diagonal(&f.setup.start) * 1e-3;
        let strange = Rotation::new(&Euler { yaw: 1.2, ..f.attitude() }).predicted_field(&FIELD).0;
        let mut found = RoadFindings { dip_error: 0.0, nis: 0.0, decision: None, lateral_nis: 0.0 };
        let mut steps = 0;
        while found.decision != Some(Decision::Reacquire) {
            f.field_age = 0.5;
            f.fold_in_field(&strange, &reference(), &mut found).unwrap();
            steps += 1;
            assert!(steps < 60, "25 s are 50 steps of 0.5 s");
        }
        // The filter was at 0.7 rad and sure of it.
        assert!((f.attitude().yaw - 1.2).abs() < 0.25, "{}", f.attitude().yaw);
    }
}
