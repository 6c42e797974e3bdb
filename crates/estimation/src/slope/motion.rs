//! First filter: motion and tyre forces of a front-driven car, without a tyre model.
//!
//! State: forward speed and lateral speed at the centre of gravity, m/s; yaw rate, rad/s; effective longitudinal force of
//! the front axle, lateral forces of the front and the rear axle, N. Forces are random walks.
//! Inputs: road-wheel angle, slope. Measurements: wheel speed, yaw gyro, forward and lateral accelerometer.
//! Source: Kim, Kim & Lee 2014, (1) to (4), with the errata of SPEC slope 10. Departure: the row "the rear axle does not slide".

use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{SMatrix, SVector, matrix, vector};

use super::GRAVITY;
use super::params::SlopeParams;
use crate::kalman::{NotPositiveDefinite, Outcome, predict, update_scalar};

pub(super) const SPEED: usize = 0;
pub(super) const LATERAL_SPEED: usize = 1;
pub(super) const YAW_RATE: usize = 2;
pub(super) const FORCE_XF: usize = 3;
pub(super) const FORCE_YF: usize = 4;
pub(super) const FORCE_YR: usize = 5;

type State = SVector<f64, 6>;
type Matrix = SMatrix<f64, 6, 6>;

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

/// `dx/dt` of the motion state `x` on a slope whose sine is `sin_slope`; forces are constant.
fn derivative(x: &State, car: &Car, steer: Steer, sin_slope: f64) -> State {
    let [vx, vy, r, fxf, fyf, fyr] = x.data.0[0];
    let along = fxf * steer.cos - fyf * steer.sin;
    let across = fxf * steer.sin + fyf * steer.cos;
    vector![
        r * vy + along / car.mass - GRAVITY * sin_slope, // (3)
        -r * vx + (across + fyr) / car.mass,             // (3)
        (car.cg_to_front * across - car.cg_to_rear * fyr) / car.yaw_inertia, // (3)
        0.0,
        0.0,
        0.0,
    ]
}

/// Jacobian of [`derivative`] with respect to the state.
fn jacobian(x: &State, car: &Car, steer: Steer) -> Matrix {
    let (vx, vy, r) = (x[SPEED], x[LATERAL_SPEED], x[YAW_RATE]);
    let (sm, cm) = (steer.sin / car.mass, steer.cos / car.mass);
    let front = car.cg_to_front / car.yaw_inertia;
    let rear = car.cg_to_rear / car.yaw_inertia;
    matrix![
        0.0, r,   vy,  cm,                -sm,               0.0;
        -r,  0.0, -vx, sm,                cm,                1.0 / car.mass;
        0.0, 0.0, 0.0, front * steer.sin, front * steer.cos, -rear;
        0.0, 0.0, 0.0, 0.0,               0.0,               0.0;
        0.0, 0.0, 0.0, 0.0,               0.0,               0.0;
        0.0, 0.0, 0.0, 0.0,               0.0,               0.0;
    ]
}

/// Row of the forward accelerometer: contact force over mass, so without gravity. (4)
fn accel_x_row(car: &Car, steer: Steer) -> State {
    vector![0.0, 0.0, 0.0, steer.cos / car.mass, -steer.sin / car.mass, 0.0]
}

/// Row of the lateral accelerometer. (4)
fn accel_y_row(car: &Car, steer: Steer) -> State {
    vector![0.0, 0.0, 0.0, steer.sin / car.mass, steer.cos / car.mass, 1.0 / car.mass]
}

fn unit(index: usize) -> State {
    let mut e = State::zeros();
    e[index] = 1.0;
    e
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
    rate: State,
    yaw_rate_variance: f64,
    accel_x_variance: f64,
    accel_y_variance: f64,
    rear_axle_variance: f64,
}

impl MotionFilter {
    pub(super) fn new(params: &SlopeParams, vehicle: &VehicleParams, speed: f64) -> Self {
        let force = params.force_walk;
        let walks = vector![params.speed_walk, params.lateral_speed_walk, params.yaw_rate_walk, force, force, force];
        let mut filter = Self {
            x: State::zeros(),
            p: Matrix::zeros(),
            car: Car::new(vehicle),
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
        let force = 2.0 * self.car.mass;
        self.x = unit(SPEED) * speed;
        self.p = Matrix::from_diagonal(&vector![0.5, 0.5, 0.1, force, force, force].map(|s| s * s));
    }

    /// Euler step over `dt` on a slope whose sine is `sin_slope`.
    pub(super) fn predict(&mut self, dt: f64, steer: Steer, sin_slope: f64) {
        let phi = Matrix::identity() + jacobian(&self.x, &self.car, steer) * dt;
        self.x += derivative(&self.x, &self.car, steer, sin_slope) * dt;
        predict(&mut self.p, &phi, &Matrix::from_diagonal(&(self.rate * dt)));
    }

    /// Fold in the rows that are there, one after the other: their noises are independent.
    pub(super) fn update(&mut self, z: &Measured, steer: Steer) -> Result<MotionNis, NotPositiveDefinite> {
        let (accel_x, accel_y) = (accel_x_row(&self.car, steer), accel_y_row(&self.car, steer));
        let nis = MotionNis {
            wheel: self.fold(z.wheel, &unit(SPEED), z.wheel_sigma * z.wheel_sigma)?,
            yaw_rate: self.fold(z.yaw_rate, &unit(YAW_RATE), self.yaw_rate_variance)?,
            accel_x: self.fold(z.accel_x, &accel_x, self.accel_x_variance)?,
            accel_y: self.fold(z.accel_y, &accel_y, self.accel_y_variance)?,
        };
        if z.rear_axle {
            let row = vector![0.0, 1.0, -self.car.cg_to_rear, 0.0, 0.0, 0.0];
            self.fold(0.0, &row, self.rear_axle_variance)?;
        }
        Ok(nis)
    }

    fn fold(&mut self, measured: f64, row: &State, variance: f64) -> Result<f64, NotPositiveDefinite> {
        if !measured.is_finite() {
            return Ok(f64::NAN);
        }
        let outcome = update_scalar(&mut self.p, measured - row.dot(&self.x), row, variance, None)?;
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
            vector![14.0, -0.3, 0.2, 1500.0, -400.0, 900.0],
            vector![0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            vector![-2.0, 1.5, -0.7, -8000.0, 3000.0, -2000.0],
        ] {
            for angle in [0.0, 0.4, -0.9] {
                let steer = Steer::new(angle);
                // Rows 0 and 1 reach 30 m/s^2: their differences over 2e-6 carry 1e-9 of rounding.
                assert_jacobian(|x| derivative(x, &car(), steer, 0.1), &jacobian(&x, &car(), steer), &x, 1e-7);
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
            let x = vector![
                20.0,
                0.0,
                0.0,
                along * steer.cos + across * steer.sin,
                -along * steer.sin + across * steer.cos,
                rear
            ];
            assert!((accel_x_row(&car, steer).dot(&x) - ax).abs() < 1e-12);
            assert!((accel_y_row(&car, steer).dot(&x) - ay).abs() < 1e-12);
            assert!((derivative(&x, &car, steer, 0.0)[YAW_RATE] - dr).abs() < 1e-12);
        }
    }

    /// Rank of the linearised observability matrix with columns scaled to comparable size, of states and optionally theta.
    fn observability_rank(x: &State, theta: Option<f64>, aid: bool) -> usize {
        type M7 = SMatrix<f64, 7, 7>;
        let (car, steer) = (car(), Steer::new(0.05));
        let scale = SVector::<f64, 7>::from([1.0, 1.0, 0.1, 2000.0, 2000.0, 2000.0, 0.1]);
        let mut a = M7::zeros();
        a.fixed_view_mut::<6, 6>(0, 0).copy_from(&jacobian(x, &car, steer));
        a[(0, 6)] = -GRAVITY * theta.unwrap_or(0.0).cos();
        let mut rows = vec![unit(SPEED), unit(YAW_RATE), accel_x_row(&car, steer), accel_y_row(&car, steer)];
        if aid {
            rows.push(vector![0.0, 1.0, -car.cg_to_rear, 0.0, 0.0, 0.0]);
        }
        let mut gram = M7::zeros();
        for row in rows {
            let mut h = SMatrix::<f64, 1, 7>::zeros();
            h.fixed_columns_mut::<6>(0).copy_from(&row.transpose());
            for _ in 0..7 {
                let scaled = h.component_mul(&scale.transpose());
                gram += scaled.transpose() * scaled;
                h *= a;
            }
        }
        let states = if theta.is_some() { 7 } else { 6 };
        let gram = nalgebra::DMatrix::from_fn(states, states, |i, j| gram[(i, j)]);
        let values = gram.symmetric_eigenvalues();
        values.iter().filter(|v| **v > 1e-12 * values.max()).count()
    }

    #[test]
    fn the_rear_axle_aid_makes_the_lateral_speed_observable() {
        // The table of SPEC slope 6. Catches an aid row with a wrong sign, and a gravity term in the acceleration rows.
        let straight = vector![20.0, 0.0, 0.0, 500.0, 0.0, 0.0];
        let ranks = [(None, false), (None, true), (Some(0.05), false), (Some(0.05), true)]
            .map(|(theta, aid)| observability_rank(&straight, theta, aid));
        assert_eq!(ranks, [5, 6, 6, 7]);
        let turn = vector![20.0, -0.2, 0.3, 500.0, 2000.0, 6000.0];
        let ranks = [(None, false), (None, true), (Some(0.05), false), (Some(0.05), true)]
            .map(|(theta, aid)| observability_rank(&turn, theta, aid));
        assert_eq!(ranks, [6, 6, 6, 7]);
    }
}
