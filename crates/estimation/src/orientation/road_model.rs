//! The body on its springs over a road with bank and grade: rates, Jacobian and transition of the nine-state filter.
//!
//! State: roll and pitch of the body against the road with their rates, yaw, bank and grade of the road, bias of the yaw
//! gyro, lateral mismatch. Attitude is suspension plus road angle. Source: SPEC orientation 8.1, beyond Hwang & Choi 2016.

use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{SMatrix, SVector};

use super::GRAVITY;
use super::model::{Input, PitchDrive, Suspension};
use super::params::OrientationParams;
use super::trig::sin_cos;

pub(super) const STATES: usize = 9;
/// Roll of the body against the road, rad; its rate follows.
pub(super) const LEAN: usize = 0;
/// Pitch of the body against the road, rad; its rate follows.
pub(super) const SQUAT: usize = 2;
/// Yaw of the body, rad.
pub(super) const YAW: usize = 4;
/// Bank of the road, rad.
pub(super) const BANK: usize = 5;
/// Grade of the road, rad.
pub(super) const GRADE: usize = 6;
/// Bias of the yaw gyro, rad/s.
pub(super) const GYRO_BIAS: usize = 7;
/// Lateral acceleration that neither turn nor road explains, m/s^2.
pub(super) const MISMATCH: usize = 8;

pub(super) type State = SVector<f64, STATES>;
pub(super) type Covariance = SMatrix<f64, STATES, STATES>;

/// What the road filter believes of body and road.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoadModel {
    pub(super) suspension: Suspension,
    /// How much a turn leaves a fixed plane of the road behind, 0 to 1.
    turn_share: f64,
    /// Inverse correlation times of bank, grade and mismatch, 1/s.
    bank_decay: f64,
    grade_decay: f64,
    mismatch_decay: f64,
}

/// Sines, cosines and turn terms at one state, shared by rates and Jacobian.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    sin_roll: f64,
    cos_roll: f64,
    sin_pitch: f64,
    cos_pitch: f64,
    sin_bank: f64,
    cos_bank: f64,
    tan_grade: f64,
    /// Yaw rate without bias, rad/s.
    turn: f64,
    /// Change of the total pitch against the road's plane, rad/s.
    pitching: f64,
}

impl Point {
    pub(super) fn new(x: &State, u: &Input, m: &RoadModel) -> Self {
        let (sin_roll, cos_roll) = sin_cos(x[LEAN] + x[BANK]);
        let (sin_pitch, cos_pitch) = sin_cos(x[SQUAT] + x[GRADE]);
        let (sin_bank, cos_bank) = sin_cos(x[BANK]);
        let (sin_grade, cos_grade) = sin_cos(x[GRADE]);
        let turn = u.yaw_rate - x[GYRO_BIAS];
        let pitching = x[SQUAT + 1] - m.turn_share * turn * sin_bank;
        let tan_grade = sin_grade / cos_grade;
        Self { sin_roll, cos_roll, sin_pitch, cos_pitch, sin_bank, cos_bank, tan_grade, turn, pitching }
    }
}

/// `dx/dt` at `x`, whose trigonometry is `p`.
pub(super) fn rates(x: &State, p: &Point, u: &Input, m: &RoadModel) -> State {
    let lagging = m.turn_share * p.turn;
    let mut rates = State::zeros();
    rates[LEAN] = x[LEAN + 1];
    rates[LEAN + 1] = m.suspension.roll_acceleration(x[LEAN], x[LEAN + 1], u);
    rates[SQUAT] = x[SQUAT + 1];
    rates[SQUAT + 1] = m.suspension.pitch_acceleration(x[SQUAT], p.sin_pitch, x[SQUAT + 1], u);
    rates[YAW] = (p.turn + p.pitching * p.sin_roll) / (p.cos_roll * p.cos_pitch);
    rates[BANK] = lagging * p.cos_bank * p.tan_grade - x[BANK] * m.bank_decay;
    rates[GRADE] = -lagging * p.sin_bank - x[GRADE] * m.grade_decay;
    rates[MISMATCH] = -x[MISMATCH] * m.mismatch_decay;
    rates
}

/// The entries of the Jacobian of [`rates`] that are not zero; row by row, columns in the order of the state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jacobian {
    lean: [f64; 2],
    /// By squat, its rate and grade.
    squat: [f64; 3],
    /// By lean, squat, squat rate, bank, grade and gyro bias.
    yaw: [f64; 6],
    /// By bank, grade and gyro bias.
    bank: [f64; 3],
    /// By bank, grade and gyro bias.
    grade: [f64; 3],
    mismatch: f64,
}

/// Jacobian of [`rates`].
pub(super) fn jacobian(p: &Point, u: &Input, m: &RoadModel) -> Jacobian {
    let gravity = match u.pitch {
        PitchDrive::Derived(_) => m.suspension.pitch_lever * GRAVITY * p.cos_pitch,
        PitchDrive::Given(_) => 0.0,
    };
    let lagging = m.turn_share * p.turn;
    let (over_roll, over_pitch) = (1.0 / p.cos_roll, 1.0 / p.cos_pitch);
    let over = over_roll * over_pitch;
    let n = p.turn + p.pitching * p.sin_roll;
    let by_roll = p.pitching * over_pitch + n * p.sin_roll * over_roll * over;
    let by_pitch = n * p.sin_pitch * over_pitch * over;
    let share = m.turn_share * p.sin_bank;
    Jacobian {
        lean: [-m.suspension.roll_stiffness, -m.suspension.roll_damping],
        squat: [gravity - m.suspension.pitch_stiffness, -m.suspension.pitch_damping, gravity],
        yaw: [
            by_roll,
            by_pitch,
            p.sin_roll * over,
            by_roll - lagging * p.cos_bank * p.sin_roll * over,
            by_pitch,
            (share * p.sin_roll - 1.0) * over,
        ],
        bank: [
            -lagging * p.sin_bank * p.tan_grade - m.bank_decay,
            lagging * p.cos_bank * (1.0 + p.tan_grade * p.tan_grade),
            -m.turn_share * p.cos_bank * p.tan_grade,
        ],
        grade: [-lagging * p.cos_bank, -m.grade_decay, share],
        mismatch: -m.mismatch_decay,
    }
}

/// The entries of `Phi = I + F dt + (F dt)^2 / 2` that may differ from the identity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transition {
    /// Lean and its rate, by themselves.
    lean: [[f64; 2]; 2],
    /// Squat by squat, its rate and grade.
    squat: [f64; 3],
    /// Squat rate by squat, its rate, bank, grade and gyro bias.
    squat_rate: [f64; 5],
    /// Yaw by lean, its rate, squat, its rate, bank, grade and gyro bias.
    yaw: [f64; 7],
    /// Bank and grade by bank, grade and gyro bias.
    road: [[f64; 3]; 2],
    mismatch: f64,
}

impl Transition {
    pub(super) fn new(f: &Jacobian, dt: f64) -> Self {
        let (a, half) = (dt, 0.5 * dt);
        let [l0, l1] = f.lean.map(|v| v * dt);
        let [s2, s3, s6] = f.squat.map(|v| v * dt);
        let [y0, y2, y3, y5, y6, y7] = f.yaw.map(|v| v * dt);
        let (b, g) = (f.bank.map(|v| v * dt), f.grade.map(|v| v * dt));
        let d = f.mismatch * dt;
        let square = |row: &[f64; 3], k: usize| 0.5 * (row[0] * b[k] + row[1] * g[k]);
        Self {
            lean: [[1.0 + half * l0, a + half * l1], [l0 + 0.5 * l1 * l0, 1.0 + l1 + 0.5 * (l0 * a + l1 * l1)]],
            squat: [1.0 + half * s2, a + half * s3, half * s6],
            squat_rate: [
                s2 + 0.5 * s3 * s2,
                1.0 + s3 + 0.5 * (s2 * a + s3 * s3),
                0.5 * s6 * g[0],
                s6 + 0.5 * (s3 * s6 + s6 * g[1]),
                0.5 * s6 * g[2],
            ],
            yaw: [
                y0,
                half * y0,
                y2 + 0.5 * y3 * s2,
                y3 + 0.5 * (y2 * a + y3 * s3),
                y5 + 0.5 * (y5 * b[0] + y6 * g[0]),
                y6 + 0.5 * (y3 * s6 + y5 * b[1] + y6 * g[1]),
                y7 + 0.5 * (y5 * b[2] + y6 * g[2]),
            ],
            road: [
                [1.0 + b[0] + square(&b, 0), b[1] + square(&b, 1), b[2] + square(&b, 2)],
                [g[0] + square(&g, 0), 1.0 + g[1] + square(&g, 1), g[2] + square(&g, 2)],
            ],
            mismatch: 1.0 + d + 0.5 * d * d,
        }
    }

    /// `P <- Phi P Phi' + diag(q)` for a symmetric `P`, over the entries that are not zero.
    pub(super) fn propagate(&self, p: &mut Covariance, q: &State) {
        // Column i of `t` is P times row i of Phi; P is symmetric, so that rows of P are its columns.
        let mut t = *p;
        for (i, row) in self.lean.iter().enumerate() {
            t.set_column(LEAN + i, &combined(p, [0, 1], row));
        }
        t.set_column(SQUAT, &combined(p, [2, 3, 6], &self.squat));
        t.set_column(SQUAT + 1, &combined(p, [2, 3, 5, 6, 7], &self.squat_rate));
        t.set_column(YAW, &(p.column(YAW) + combined(p, [0, 1, 2, 3, 5, 6, 7], &self.yaw)));
        for (i, row) in self.road.iter().enumerate() {
            t.set_column(BANK + i, &combined(p, [5, 6, 7], row));
        }
        t.set_column(MISMATCH, &(p.column(MISMATCH) * self.mismatch));
        for c in 0..STATES {
            let column = t.data.0[c];
            for r in 0..=c {
                let value = self.row_times(r, &column);
                p[(r, c)] = value;
                p[(c, r)] = value;
            }
            p[(c, c)] += q[c];
        }
    }

    /// Row `row` of Phi times a vector.
    #[inline(always)]
    fn row_times(&self, row: usize, v: &[f64; STATES]) -> f64 {
        match row {
            0 | 1 => self.lean[row][0] * v[0] + self.lean[row][1] * v[1],
            2 => self.squat[0] * v[2] + self.squat[1] * v[3] + self.squat[2] * v[6],
            3 => {
                let s = &self.squat_rate;
                s[0] * v[2] + s[1] * v[3] + s[2] * v[5] + s[3] * v[6] + s[4] * v[7]
            }
            4 => {
                let y = &self.yaw;
                v[4] + (y[0] * v[0] + y[1] * v[1])
                    + (y[2] * v[2] + y[3] * v[3])
                    + (y[4] * v[5] + y[5] * v[6] + y[6] * v[7])
            }
            5 | 6 => {
                let r = &self.road[row - 5];
                r[0] * v[5] + r[1] * v[6] + r[2] * v[7]
            }
            7 => v[7],
            _ => self.mismatch * v[8],
        }
    }
}

/// Weighted sum of columns of `p`.
#[inline(always)]
fn combined<const K: usize>(p: &Covariance, columns: [usize; K], weights: &[f64; K]) -> State {
    let mut sum = State::zeros();
    for (&column, &weight) in columns.iter().zip(weights) {
        let column = &p.data.0[column];
        for row in 0..STATES {
            sum[row] += weight * column[row];
        }
    }
    sum
}

impl RoadModel {
    pub(super) fn new(p: &OrientationParams, vehicle: &VehicleParams) -> Self {
        Self {
            suspension: Suspension::new(vehicle),
            turn_share: p.turn_share,
            bank_decay: 1.0 / p.bank_time,
            grade_decay: 1.0 / p.grade_time,
            mismatch_decay: 1.0 / p.mismatch_time,
        }
    }
}

#[cfg(test)]
pub(super) fn dense(f: &Jacobian) -> Covariance {
    let mut j = Covariance::zeros();
    let mut put = |row: usize, columns: &[usize], values: &[f64]| {
        columns.iter().zip(values).for_each(|(&c, &v)| j[(row, c)] = v);
    };
    put(0, &[1], &[1.0]);
    put(1, &[0, 1], &f.lean);
    put(2, &[3], &[1.0]);
    put(3, &[2, 3, 6], &f.squat);
    put(4, &[0, 2, 3, 5, 6, 7], &f.yaw);
    put(5, &[5, 6, 7], &f.bank);
    put(6, &[5, 6, 7], &f.grade);
    put(8, &[8], &[f.mismatch]);
    j
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kalman::{predict, transition};
    use crate::testing::assert_jacobian;
    use nalgebra::vector;

    fn states() -> [State; 3] {
        [
            vector![0.05, 0.2, -0.01, 0.1, 2.0, 0.3, -0.08, 0.005, 0.3],
            vector![-0.08, -1.0, 0.03, -0.4, -3.0, -0.35, 0.14, -0.01, -2.0],
            State::zeros(),
        ]
    }

    fn inputs() -> [Input; 2] {
        let input = |pitch| Input { yaw_rate: -0.4, accel_y: 3.0, pitch };
        [input(PitchDrive::Derived(1.5)), input(PitchDrive::Given(-2.0))]
    }

    #[test]
    fn the_road_jacobian_is_the_derivative_of_the_road_rates() {
        let m = RoadModel::new(&OrientationParams::default(), &VehicleParams::default());
        for x in states() {
            for u in inputs() {
                let j = dense(&jacobian(&Point::new(&x, &u, &m), &u, &m));
                // Spring terms reach 100 rad/s^2: 1e-8 of rounding in a central difference.
                assert_jacobian(|x| rates(x, &Point::new(x, &u, &m), &u, &m), &j, &x, 1e-7);
            }
        }
    }

    #[test]
    fn the_sparse_propagation_is_the_dense_one() {
        // Catches an entry of Phi that is forgotten or in the wrong column: each state has its own scale.
        let m = RoadModel::new(&OrientationParams::default(), &VehicleParams::default());
        let root = Covariance::from_fn(|i, j| ((7 * i + 3 * j) as f64).sin() / (1.0 + i as f64));
        let q = State::from_fn(|i, _| 1e-3 * (i + 1) as f64);
        for x in states() {
            for u in inputs() {
                let f = jacobian(&Point::new(&x, &u, &m), &u, &m);
                let (mut sparse, mut full) = (root * root.transpose(), root * root.transpose());
                Transition::new(&f, 0.01).propagate(&mut sparse, &q);
                predict(&mut full, &transition(&dense(&f), 0.01), &Covariance::from_diagonal(&q));
                assert!((sparse - full).norm() < 1e-13 * full.norm(), "{}", sparse - full);
                assert_eq!(sparse, sparse.transpose());
            }
        }
    }
}
