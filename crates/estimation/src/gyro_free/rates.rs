//! Body rates from angular accelerations, a yaw gyro and what the motion mode knows: seven states.
//!
//! State: rates `w`, biases `ba` of the angular accelerations, bias `bg` of the yaw gyro. The angular acceleration is
//! the input; the gyro reads `wz + bg`; at rest all rates are zero, in motion roll and pitch rate nearly so, on a straight
//! the yaw rate too. Source: Lee et al. 2010, section 3; SPEC motion 3.3.
//! Departure: no dense 7 x 7 covariance. No input and no row couples two axes, so that it is block-diagonal: three filters
//! of at most three states, and rows folded in one after the other, give the joint update of seven states.

use super::GyroFreeParams;
use crate::motion_mode::MotionMode;

/// Initial sigma of a rate, rad/s, of a bias of angular acceleration, rad/s^2, and of the gyro's bias, rad/s.
const INITIAL: [f64; 3] = [0.05, 0.5, 0.02];

/// One axis: rate, bias of its angular acceleration, bias of its gyro, and their covariance (upper triangle, by rows).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    rate: f64,
    accel_bias: f64,
    gyro_bias: f64,
    p: [f64; 6],
}

impl Axis {
    fn new(has_gyro: bool) -> Self {
        let [rate, accel, gyro] = INITIAL.map(|s| s * s);
        let gyro = if has_gyro { gyro } else { 0.0 };
        Self { rate: 0.0, accel_bias: 0.0, gyro_bias: 0.0, p: [rate, 0.0, 0.0, accel, 0.0, gyro] }
    }

    fn predict(&mut self, acceleration: f64, dt: f64, noise: &[f64; 3]) {
        self.rate += (acceleration - self.accel_bias) * dt;
        let [rr, ra, rg, aa, ag, gg] = self.p;
        self.p = [
            rr + dt * (dt * aa - 2.0 * ra + noise[0]),
            ra - dt * aa,
            rg - dt * ag,
            aa + dt * noise[1],
            ag,
            gg + dt * noise[2],
        ];
    }

    /// Fold in `z = rate + gyro * bias of the gyro`.
    fn update(&mut self, z: f64, gyro: f64, variance: f64) {
        let [rr, ra, rg, aa, ag, gg] = self.p;
        let ph = [rr + gyro * rg, ra + gyro * ag, rg + gyro * gg];
        let s = ph[0] + gyro * ph[2] + variance;
        let k = ph.map(|v| v / s);
        let innovation = z - self.rate - gyro * self.gyro_bias;
        self.rate += k[0] * innovation;
        self.accel_bias += k[1] * innovation;
        self.gyro_bias += k[2] * innovation;
        self.p = [
            (rr - k[0] * ph[0]).max(0.0),
            ra - k[0] * ph[1],
            rg - k[0] * ph[2],
            (aa - k[1] * ph[1]).max(0.0),
            ag - k[1] * ph[2],
            (gg - k[2] * ph[2]).max(0.0),
        ];
    }
}

/// Variances of what drives the states and of the rows.
#[derive(Clone, Copy, Debug)]
struct Noise {
    drive: [f64; 3],
    gyro: f64,
    rest: f64,
    level: f64,
    straight: f64,
}

/// The filter.
#[derive(Clone, Debug)]
pub struct RateFilter {
    axes: [Axis; 3],
    noise: Noise,
    use_gyro: bool,
    zero_reference: bool,
}

impl RateFilter {
    /// A filter that knows nothing yet.
    pub fn new(params: &GyroFreeParams) -> Self {
        let square = |v: f64| v * v;
        Self {
            axes: [Axis::new(false), Axis::new(false), Axis::new(true)],
            noise: Noise {
                drive: [params.acceleration_noise, params.acceleration_bias_walk, params.gyro_bias_walk].map(square),
                gyro: square(params.gyro_sigma),
                rest: square(params.rest_sigma),
                level: square(params.level_sigma),
                straight: square(params.straight_sigma),
            },
            use_gyro: params.use_gyro,
            zero_reference: params.zero_reference,
        }
    }

    /// Move on by `dt` s with an angular acceleration (rad/s^2), then fold in the yaw gyro (rad/s; NaN without) and what the
    /// mode says.
    pub fn step(&mut self, acceleration: &[f64; 3], dt: f64, gyro: f64, mode: MotionMode) {
        for (axis, acceleration) in self.axes.iter_mut().zip(acceleration) {
            axis.predict(*acceleration, dt, &self.noise.drive);
        }
        let [x, y, z] = &mut self.axes;
        if self.use_gyro && gyro.is_finite() {
            z.update(gyro, 1.0, self.noise.gyro);
        }
        if !self.zero_reference {
            return;
        }
        let (tilting, turning) = match mode {
            MotionMode::Stationary => (self.noise.rest, Some(self.noise.rest)),
            MotionMode::Straight => (self.noise.level, Some(self.noise.straight)),
            MotionMode::Cornering => (self.noise.level, None),
        };
        x.update(0.0, 0.0, tilting);
        y.update(0.0, 0.0, tilting);
        if let Some(variance) = turning {
            z.update(0.0, 0.0, variance);
        }
    }

    /// Rates, rad/s.
    pub fn rate(&self) -> [f64; 3] {
        self.axes.map(|a| a.rate)
    }

    /// Sigmas of the rates, rad/s.
    pub fn rate_sigma(&self) -> [f64; 3] {
        self.axes.map(|a| a.p[0].sqrt())
    }

    /// Bias of the yaw gyro and its sigma, rad/s.
    pub fn gyro_bias(&self) -> (f64, f64) {
        (self.axes[2].gyro_bias, self.axes[2].p[5].sqrt())
    }

    /// Let `dt` s pass unseen: rates stay, their sigmas grow.
    pub fn wait(&mut self, dt: f64) {
        for axis in &mut self.axes {
            axis.predict(axis.accel_bias, dt, &self.noise.drive);
        }
    }

    /// Forget everything but the tuning.
    pub fn restart(&mut self) {
        self.axes = [Axis::new(false), Axis::new(false), Axis::new(true)];
    }

    /// Whether every state is a number.
    pub fn is_finite(&self) -> bool {
        self.axes.iter().all(|a| (a.rate + a.accel_bias + a.gyro_bias + a.p.iter().sum::<f64>()).is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kalman;
    use nalgebra::{SMatrix, SVector};

    /// The specification's way: seven states, dense, one joint update.
    struct Dense {
        x: SVector<f64, 7>,
        p: SMatrix<f64, 7, 7>,
    }

    impl Dense {
        fn step(&mut self, acceleration: &[f64; 3], dt: f64, gyro: f64, mode: MotionMode) {
            let mut phi = SMatrix::<f64, 7, 7>::identity();
            for i in 0..3 {
                self.x[i] += (acceleration[i] - self.x[i + 3]) * dt;
                phi[(i, i + 3)] = -dt;
            }
            let q = [0.25f64, 0.25, 0.25, 0.02, 0.02, 0.02, 2e-4].map(|s| s * s * dt);
            kalman::predict(&mut self.p, &phi, &SMatrix::from_diagonal(&SVector::from(q)));
            let (tilting, turning) = match mode {
                MotionMode::Stationary => (0.004f64, 0.004f64),
                MotionMode::Straight => (0.03, 0.02),
                MotionMode::Cornering => (0.03, 1e9),
            };
            let mut h = SMatrix::<f64, 4, 7>::zeros();
            (h[(0, 2)], h[(0, 6)], h[(1, 0)], h[(2, 1)], h[(3, 2)]) = (1.0, 1.0, 1.0, 1.0, 1.0);
            let z = SVector::<f64, 4>::new(gyro, 0.0, 0.0, 0.0);
            let r = SVector::<f64, 4>::new(0.006, tilting, tilting, turning).map(|s| s * s);
            let observation = kalman::Observation { y: z - h * self.x, h, r: SMatrix::from_diagonal(&r) };
            if let kalman::Outcome::Accepted { dx, .. } = kalman::update(&mut self.p, &observation, None).unwrap() {
                self.x += dx;
            }
        }
    }

    /// Catches a coupling that is not there or a row folded in wrongly: three small filters against seven dense states.
    #[test]
    fn three_small_filters_are_the_joint_filter_of_seven_states() {
        let mut sparse = RateFilter::new(&GyroFreeParams::default());
        let p0 = [0.05, 0.05, 0.05, 0.5, 0.5, 0.5, 0.02].map(|s: f64| s * s);
        let mut dense = Dense { x: SVector::zeros(), p: SMatrix::from_diagonal(&SVector::from(p0)) };
        for k in 0..2000 {
            let t = f64::from(k) * 0.01;
            let acceleration = [0.4 * (3.0 * t).sin(), 0.2 - 0.3 * t.cos(), 0.5 * (2.0 * t).cos()];
            let mode = [MotionMode::Stationary, MotionMode::Straight, MotionMode::Cornering][k as usize / 300 % 3];
            sparse.step(&acceleration, 0.01, 0.01 + 0.3 * t.sin(), mode);
            dense.step(&acceleration, 0.01, 0.01 + 0.3 * t.sin(), mode);
            for i in 0..3 {
                assert!((sparse.rate()[i] - dense.x[i]).abs() < 1e-9, "{k} {i}");
                assert!((sparse.rate_sigma()[i] - dense.p[(i, i)].sqrt()).abs() < 1e-9);
            }
            assert!((sparse.gyro_bias().0 - dense.x[6]).abs() < 1e-9);
        }
    }
}
