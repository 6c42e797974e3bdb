//! First filter: motion and tyre forces of a front-driven car, without a tyre model.
//!
//! State: forward speed and lateral speed at the centre of gravity, m/s; yaw rate, rad/s; effective longitudinal force of
//! the front axle, lateral forces of the front and the rear axle, N; slope, rad. Forces are random walks.
//! In the cascade the slope is an input: it is set before each step and its covariance is zero, which leaves the six
//! states of the paper. In the single filter it is a seventh state, a random walk.
//! Inputs: road-wheel angle. Measurements: wheel speed, yaw gyro, forward and lateral accelerometer.
//! Source: Kim, Kim & Lee 2014, (1) to (4), with the errata of SPEC slope 10. Departure: the row "the rear axle does not slide".

use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{SMatrix, SVector, vector};

use super::GRAVITY;
use super::params::{FilterChoice, SlopeParams};
use super::pitch::STEEPEST;
use crate::kalman::{NotPositiveDefinite, Outcome, propagate, update_sparse};

pub(super) const SPEED: usize = 0;
pub(super) const LATERAL_SPEED: usize = 1;
pub(super) const YAW_RATE: usize = 2;
pub(super) const FORCE_XF: usize = 3;
pub(super) const FORCE_YF: usize = 4;
pub(super) const FORCE_YR: usize = 5;
pub(super) const SLOPE: usize = 6;
pub(super) const STATES: usize = 7;

pub(super) type State = SVector<f64, STATES>;
pub(super) type Matrix = SMatrix<f64, STATES, STATES>;

/// The four numbers of the car that the model reads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Car {
    mass: f64,
    cg_to_front: f64,
    cg_to_rear: f64,
    yaw_inertia: f64,
}

impl Car {
    pub(super) fn new(vehicle: &VehicleParams) -> Self {
        Self {
            mass: vehicle.mass,
            cg_to_front: vehicle.cg_to_front,
            cg_to_rear: vehicle.cg_to_rear,
            yaw_inertia: vehicle.yaw_inertia,
        }
    }
}

/// Sine and cosine of the road-wheel angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steer {
    sin: f64,
    cos: f64,
}

impl Steer {
    pub(super) fn new(angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { sin, cos }
    }
}

/// `dx/dt` of the motion state `x`; forces and slope are constant.
fn derivative(x: &State, car: &Car, steer: Steer, sin_slope: f64) -> State {
    let [vx, vy, r, fxf, fyf, fyr, _] = x.data.0[0];
    let along = fxf * steer.cos - fyf * steer.sin;
    let across = fxf * steer.sin + fyf * steer.cos;
    vector![
        r * vy + along / car.mass - GRAVITY * sin_slope, // (3)
        -r * vx + (across + fyr) / car.mass,             // (3)
        (car.cg_to_front * across - car.cg_to_rear * fyr) / car.yaw_inertia, // (3)
        0.0,
        0.0,
        0.0,
        0.0,
    ]
}

/// The entries of the Jacobian of [`derivative`] that are not zero, times `dt`: the rows of both speeds and the yaw rate.
#[derive(Clone, Copy, Debug)]
struct Change {
    forward: [(usize, f64); 5],
    lateral: [(usize, f64); 5],
    yaw: [(usize, f64); 3],
}

impl Change {
    fn new(x: &State, car: &Car, steer: Steer, cos_slope: f64, dt: f64) -> Self {
        let (vx, vy, r) = (x[SPEED], x[LATERAL_SPEED], x[YAW_RATE]);
        let (s, c) = (steer.sin * dt / car.mass, steer.cos * dt / car.mass);
        let front = car.cg_to_front * dt / car.yaw_inertia;
        let rear = car.cg_to_rear * dt / car.yaw_inertia;
        Self {
            forward: [
                (LATERAL_SPEED, r * dt),
                (YAW_RATE, vy * dt),
                (FORCE_XF, c),
                (FORCE_YF, -s),
                (SLOPE, -GRAVITY * cos_slope * dt),
            ],
            lateral: [(SPEED, -r * dt), (YAW_RATE, -vx * dt), (FORCE_XF, s), (FORCE_YF, c), (FORCE_YR, dt / car.mass)],
            yaw: [(FORCE_XF, front * steer.sin), (FORCE_YF, front * steer.cos), (FORCE_YR, -rear)],
        }
    }

    fn rows(&self) -> [&[(usize, f64)]; 3] {
        [&self.forward, &self.lateral, &self.yaw]
    }
}

/// Jacobian of [`derivative`] with respect to the state.
pub(super) fn jacobian(x: &State, car: &Car, steer: Steer) -> Matrix {
    let mut a = Matrix::zeros();
    for (row, entries) in Change::new(x, car, steer, x[SLOPE].cos(), 1.0).rows().into_iter().enumerate() {
        entries.iter().for_each(|&(column, value)| a[(row, column)] = value);
    }
    a
}

/// A measurement's row: the states it depends on and by how much.
pub(super) type Row = [(usize, f64)];

/// Row of the wheel speed.
pub(super) const WHEEL_ROW: [(usize, f64); 1] = [(SPEED, 1.0)];
/// Row of the yaw gyro.
pub(super) const GYRO_ROW: [(usize, f64); 1] = [(YAW_RATE, 1.0)];

/// Row of the forward accelerometer: contact force over mass, so without gravity. (4)
pub(super) fn accel_x_row(car: &Car, steer: Steer) -> [(usize, f64); 2] {
    [(FORCE_XF, steer.cos / car.mass), (FORCE_YF, -steer.sin / car.mass)]
}

/// Row of the lateral accelerometer. (4)
pub(super) fn accel_y_row(car: &Car, steer: Steer) -> [(usize, f64); 3] {
    [(FORCE_XF, steer.sin / car.mass), (FORCE_YF, steer.cos / car.mass), (FORCE_YR, 1.0 / car.mass)]
}

/// Row of the rear-axle aid: the lateral speed at the rear axle. (SPEC slope 3)
pub(super) fn rear_axle_row(car: &Car) -> [(usize, f64); 2] {
    [(LATERAL_SPEED, 1.0), (YAW_RATE, -car.cg_to_rear)]
}

fn dot(row: &Row, x: &State) -> f64 {
    row.iter().map(|&(column, value)| value * x[column]).sum()
}

/// One row of measurements; NaN where there is none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub(super) wheel: f64,
    pub(super) wheel_sigma: f64,
    pub(super) yaw_rate: f64,
    pub(super) accel_x: f64,
    pub(super) accel_y: f64,
    /// Whether the rear-axle aid applies.
    pub(super) rear_axle: bool,
}

/// Normalized innovations squared of one row, each given those before it; NaN where there was no measurement.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionNis {
    pub(super) wheel: f64,
    pub(super) yaw_rate: f64,
    pub(super) accel_x: f64,
    pub(super) accel_y: f64,
}

/// State, covariance and noise of the first filter.
#[derive(Clone, Debug)]
pub(super) struct MotionFilter {
    pub(super) x: State,
    pub(super) p: Matrix,
    pub(super) car: Car,
    /// Whether the slope is a state.
    is_single: bool,
    rate: State,
    yaw_rate_variance: f64,
    accel_x_variance: f64,
    accel_y_variance: f64,
    rear_axle_variance: f64,
}

impl MotionFilter {
    pub(super) fn new(params: &SlopeParams, vehicle: &VehicleParams, speed: f64) -> Self {
        let is_single = params.filter == FilterChoice::Single;
        let (force, slope) = (params.force_walk, if is_single { params.slope_walk } else { 0.0 });
        let walks =
            vector![params.speed_walk, params.lateral_speed_walk, params.yaw_rate_walk, force, force, force, slope];
        let mut filter = Self {
            x: State::zeros(),
            p: Matrix::zeros(),
            car: Car::new(vehicle),
            is_single,
            rate: walks.component_mul(&walks),
            yaw_rate_variance: params.yaw_rate_sigma.powi(2),
            accel_x_variance: params.accel_x_sigma.powi(2),
            accel_y_variance: params.accel_y_sigma.powi(2),
            rear_axle_variance: params.rear_axle_sigma.powi(2),
        };
        filter.restart(speed);
        filter
    }

    /// Forget everything but the speed.
    pub(super) fn restart(&mut self, speed: f64) {
        let (force, slope) = (2.0 * self.car.mass, if self.is_single { 0.1 } else { 0.0 });
        self.x = State::zeros();
        self.x[SPEED] = speed;
        self.p = Matrix::from_diagonal(&vector![0.5, 0.5, 0.1, force, force, force, slope].map(|s| s * s));
    }

    /// The slope that the next steps assume; for the cascade only.
    pub(super) fn assume_slope(&mut self, slope: f64) {
        self.x[SLOPE] = slope;
    }

    /// Euler step over `dt`.
    pub(super) fn predict(&mut self, dt: f64, steer: Steer) {
        let (sin, cos) = self.x[SLOPE].sin_cos();
        let change = Change::new(&self.x, &self.car, steer, cos, dt);
        self.x += derivative(&self.x, &self.car, steer, sin) * dt;
        propagate(&mut self.p, &[SPEED, LATERAL_SPEED, YAW_RATE], &change.rows(), &(self.rate * dt));
    }

    /// Fold in the rows that are there, one after the other: their noises are independent.
    pub(super) fn update(&mut self, z: &Measured, steer: Steer) -> Result<MotionNis, NotPositiveDefinite> {
        let (accel_x, accel_y) = (accel_x_row(&self.car, steer), accel_y_row(&self.car, steer));
        let nis = MotionNis {
            wheel: self.fold(z.wheel, &WHEEL_ROW, z.wheel_sigma * z.wheel_sigma)?,
            yaw_rate: self.fold(z.yaw_rate, &GYRO_ROW, self.yaw_rate_variance)?,
            accel_x: self.fold(z.accel_x, &accel_x, self.accel_x_variance)?,
            accel_y: self.fold(z.accel_y, &accel_y, self.accel_y_variance)?,
        };
        if z.rear_axle {
            self.fold(0.0, &rear_axle_row(&self.car), self.rear_axle_variance)?;
        }
        self.x[SLOPE] = self.x[SLOPE].clamp(-STEEPEST, STEEPEST);
        Ok(nis)
    }

    fn fold(&mut self, measured: f64, row: &Row, variance: f64) -> Result<f64, NotPositiveDefinite> {
        if !measured.is_finite() {
            return Ok(f64::NAN);
        }
        let outcome = update_sparse(&mut self.p, measured - dot(row, &self.x), row, variance, None)?;
        if let Outcome::Accepted { dx, .. } = outcome {
            self.x += dx;
        }
        Ok(outcome.nis())
    }

    /// Forward specific force from the estimated forces, and its sigma, m/s^2.
    pub(super) fn specific_force(&self, steer: Steer) -> (f64, f64) {
        let (c, s) = (steer.cos / self.car.mass, steer.sin / self.car.mass);
        let p = &self.p;
        let variance =
            c * c * p[(FORCE_XF, FORCE_XF)] - 2.0 * c * s * p[(FORCE_XF, FORCE_YF)] + s * s * p[(FORCE_YF, FORCE_YF)];
        (c * self.x[FORCE_XF] - s * self.x[FORCE_YF], variance.sqrt())
    }

    /// Sigma of the sideslip `atan(v_y / v_x)`, rad; the forward speed must not be 0.
    pub(super) fn sideslip_sigma(&self) -> f64 {
        let (vx, vy, p) = (self.x[SPEED], self.x[LATERAL_SPEED], &self.p);
        let square = vx * vx + vy * vy;
        let (along, across) = (-vy / square, vx / square);
        let variance = along * along * p[(SPEED, SPEED)]
            + 2.0 * along * across * p[(SPEED, LATERAL_SPEED)]
            + across * across * p[(LATERAL_SPEED, LATERAL_SPEED)];
        variance.sqrt()
    }

    /// Whether state and covariance are still numbers that mean something.
    pub(super) fn is_sound(&self) -> bool {
        super::is_sound(&self.x, &self.p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::assert_jacobian;

    fn car() -> Car {
        Car::new(&VehicleParams::preset("kim_2014").unwrap())
    }

    #[test]
    fn the_motion_jacobian_is_the_derivative_of_the_motion_model() {
        // Catches a dropped or sign-flipped term, such as l_r in place of l_f in the yaw row (erratum 2).
        for x in [
            vector![14.0, -0.3, 0.2, 1500.0, -400.0, 900.0, 0.1],
            vector![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            vector![-2.0, 1.5, -0.7, -8000.0, 3000.0, -2000.0, -0.4],
        ] {
            for angle in [0.0, 0.4, -0.9] {
                let steer = Steer::new(angle);
                let rates = |x: &State| derivative(x, &car(), steer, x[SLOPE].sin());
                // Rows 0 and 1 reach 30 m/s^2: their differences over 2e-6 carry 1e-9 of rounding.
                assert_jacobian(rates, &jacobian(&x, &car(), steer), &x, 1e-7);
            }
        }
    }

    #[test]
    fn forces_follow_from_accelerations_and_yaw_acceleration_in_closed_form() {
        // SPEC slope 6; catches a wrong sign or lever arm in the measurement rows or in the yaw row.
        let car = car();
        let (lf, lr) = (car.cg_to_front, car.cg_to_rear);
        for (ax, ay, dr, angle) in [(1.2, -3.0, 0.4, 0.1), (-2.0, 4.0, -0.8, -0.3), (0.5, 0.0, 0.0, 0.0)] {
            let steer = Steer::new(angle);
            let across = (lr * car.mass * ay + car.yaw_inertia * dr) / (lf + lr);
            let rear = (lf * car.mass * ay - car.yaw_inertia * dr) / (lf + lr);
            let along = car.mass * ax;
            let (front_x, front_y) = (along * steer.cos + across * steer.sin, -along * steer.sin + across * steer.cos);
            let x = vector![20.0, 0.0, 0.0, front_x, front_y, rear, 0.0];
            assert!((dot(&accel_x_row(&car, steer), &x) - ax).abs() < 1e-12);
            assert!((dot(&accel_y_row(&car, steer), &x) - ay).abs() < 1e-12);
            assert!((derivative(&x, &car, steer, 0.0)[YAW_RATE] - dr).abs() < 1e-12);
        }
    }
}
