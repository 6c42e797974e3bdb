//! Yaw, pitch, roll and the biases of gyros and accelerometers: a filter of nine states.
//!
//! State: see [`model`]. Inputs: body rates; specific force, compared with gravity and the acceleration that the odometer (or
//! the satellites' speed) and the yaw rate tell; satellite course.
//! Source: Yun & Yu 2007, equation (3); SPEC navigation 6. The paper does not say what its last three states are; they are the
//! accelerometer biases here: as positions they would need a velocity that the equation does not have.
//! Departure: the specific force is averaged over the time in which the speed changed (half a second by default) and compared
//! once: a speed differenced over a tenth of a second has a noise of 0.7 m/s^2 where 0.15 are assumed.
//! Not modelled: vertical acceleration, the lateral acceleration of a changing sideslip, the rotation of the Earth. Near a
//! pitch of 90 deg the angles mean nothing: beyond 89 deg it starts anew.

mod estimate;
pub mod model;

#[cfg(test)]
mod tests;

use drivescope_drive::drive::{Epoch, LogStart, Signal};
use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::{STANDARD_GRAVITY, gravity};
use drivescope_drive::signals::{Gnss, Imu};
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{Matrix3, Vector3};

pub use self::estimate::{AttitudeEstimate, AttitudeParams};
use self::model::{Covariance, GYRO_BIAS, State, YAW};
use crate::chi_square;
use crate::estimator::{Estimator, EstimatorError, Need, Notices};
use crate::gnss_ins::inertial::{Hold, Sample};
use crate::kalman::{self, Outcome};

/// Speed below which a car stands, m/s: by odometer, and by satellites.
const STANDING: [f64; 2] = [0.02, 0.3];
/// Mean rate above which a resting car is not resting, rad/s.
const LARGEST_GYRO_BIAS: f64 = 0.02;
/// Samples at rest from which a mean is worth something.
const FEWEST_SAMPLES: f64 = 20.0;
/// Longest inertial step that is integrated, s.
const LONGEST_STEP: f64 = 0.5;
/// Pitch beyond which the angles mean nothing.
const LARGEST_PITCH: f64 = 89.0 * std::f64::consts::PI / 180.0;
/// Sigma of a yaw of which nothing is known: uniform over the circle, rad.
const UNKNOWN_YAW_SIGMA: f64 = 1.813_799_364_234_217_8;

/// Sums of the inertial samples since some instant.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    samples: f64,
    time: f64,
    accel: Vector3<f64>,
    gyro: Vector3<f64>,
}

impl Mean {
    fn add(&mut self, sample: &Sample, dt: f64) {
        self.samples += 1.0;
        self.time += dt;
        self.accel += sample.accel;
        self.gyro += sample.gyro;
    }
}

/// The estimator: see the [module](self).
#[derive(Clone, Debug)]
pub struct Attitude {
    params: AttitudeParams,
    gates: [Option<f64>; 2],
    state: State,
    covariance: Covariance,
    is_running: bool,
    is_yaw_known: bool,
    hold: Hold,
    time: Option<f64>,
    rest: Mean,
    /// Since the speed in `reference`.
    window: Mean,
    reference: Option<(f64, f64)>,
    speed: Option<(f64, f64)>,
    has_odometer: bool,
    course: Option<(f64, f64)>,
    gravity: f64,
    notices: Notices,
}

impl Estimator for Attitude {
    const NAME: &'static str = "attitude";
    const TITLE: &'static str = "Attitude and sensor biases";
    const DOC: &'static str = "Yaw, pitch, roll and the biases of gyros and accelerometers from inertial sensors, speed and \
        satellite course. After Yun & Yu 2007, equation (3).";
    const NEEDS: &'static [Need] = NEEDS;
    const VEHICLE: &'static str = "saloon";
    type Params = AttitudeParams;
    type Estimate = AttitudeEstimate;

    fn new(params: &AttitudeParams, _vehicle: &VehicleParams, start: &LogStart) -> Self {
        let gate = |dof: f64| params.gate.then(|| chi_square::quantile(params.gate_probability, dof));
        Self {
            gates: [gate(1.0), gate(3.0)],
            params: params.clone(),
            state: State::zeros(),
            covariance: Covariance::zeros(),
            is_running: false,
            is_yaw_known: params.initial_yaw.is_finite(),
            hold: Hold::default(),
            time: None,
            rest: Mean::default(),
            window: Mean::default(),
            reference: None,
            speed: None,
            has_odometer: false,
            course: None,
            gravity: start.origin.map_or(STANDARD_GRAVITY, |place| gravity(place.lat, place.alt)),
            notices: Notices::default(),
        }
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<AttitudeEstimate>, EstimatorError> {
        self.receive(epoch);
        let Some(sample) = epoch.imu.and_then(|imu| self.complete(epoch.time, &imu)) else { return Ok(None) };
        let dt = epoch.time - self.time.unwrap_or(epoch.time);
        if !epoch.time.is_finite() || self.time.is_some() && dt <= 0.0 {
            self.notices.add("inertial sample that is not later than the one before skipped", self.time.unwrap_or(0.0));
            return Ok(None);
        }
        self.time = Some(epoch.time);
        let mut row = AttitudeEstimate::default();
        if self.is_running && !self.advance(&sample, dt, epoch.time) {
            self.notices.add("the pitch left its range: levelled again", epoch.time);
            self.restart();
            return Ok(None);
        }
        if self.is_running {
            self.compare_force(epoch.time, &mut row);
            self.compare_course(&mut row);
        } else if !self.start(&sample, dt, epoch.time) {
            return Ok(None);
        }
        estimate::write(&self.state, &self.covariance, self.is_yaw_known, &mut row);
        Ok(Some(row))
    }

    fn notices(&self) -> &Notices {
        &self.notices
    }
}

const NEEDS: &[Need] = &[
    Need { signal: Signal::AccelX, required: true, why: "gravity is seen by all three accelerometers" },
    Need { signal: Signal::AccelY, required: true, why: "gravity is seen by all three accelerometers" },
    Need { signal: Signal::AccelZ, required: true, why: "gravity is seen by all three accelerometers" },
    Need { signal: Signal::GyroX, required: true, why: "the angles are integrated from all three rates" },
    Need { signal: Signal::GyroY, required: true, why: "the angles are integrated from all three rates" },
    Need { signal: Signal::GyroZ, required: true, why: "the angles are integrated from all three rates" },
    Need {
        signal: Signal::ForwardSpeed,
        required: false,
        why: "its change is taken off the accelerometers; without it that of the satellites' speed is, else none",
    },
    Need {
        signal: Signal::GnssVelocity,
        required: false,
        why: "its course gives the heading when the car moves; without it, give `initial_yaw`",
    },
];

impl Attitude {
    /// Keep what an epoch says besides the inertial sample.
    fn receive(&mut self, epoch: &Epoch) {
        if let Some(speed) = epoch.wheels.map(|w| w.forward_speed()).filter(|v| v.is_finite()) {
            self.has_odometer = true;
            self.speed = Some((epoch.time, speed));
        }
        if let Some(gnss) = epoch.gnss.filter(Gnss::is_usable) {
            let ground = gnss.ground_speed();
            if !self.has_odometer && ground.is_finite() {
                self.speed = Some((epoch.time, ground));
            }
            let course = gnss.course_over_ground(self.params.course_speed);
            if course.is_finite() && ground >= self.params.course_speed {
                self.course = Some((course, self.params.course_speed_sigma / ground + self.params.course_sigma));
            }
        }
    }

    fn complete(&mut self, time: f64, imu: &Imu) -> Option<Sample> {
        let sample = self.hold.complete(time, imu)?;
        if let Some(flaw) = sample.flaw {
            self.notices.add(flaw, time);
        }
        Some(sample)
    }

    /// Whether the car stands; a car of unknown speed does.
    fn stands(&self) -> bool {
        let limit = STANDING[usize::from(!self.has_odometer)];
        self.speed.is_none_or(|(_, speed)| speed.abs() < limit)
    }

    /// Gather the car's rest, and begin when it ends or has lasted long enough; whether a row can be shown.
    fn start(&mut self, sample: &Sample, dt: f64, time: f64) -> bool {
        let p = &self.params;
        let stands = self.stands();
        if stands {
            self.rest.add(sample, dt);
        }
        let is_levelled = self.rest.samples >= FEWEST_SAMPLES;
        if !is_levelled {
            if stands {
                return false;
            }
            // A start in motion: one sample tells the tilt to a few degrees.
            self.rest = Mean::default();
            self.rest.add(sample, dt);
        }
        let f = self.rest.accel / self.rest.samples;
        let rate = self.rest.gyro / self.rest.samples;
        let (roll, pitch) = ((-f.y).atan2(-f.z), f.x.atan2(f.y.hypot(f.z)));
        let bias = if is_levelled && rate.norm() < LARGEST_GYRO_BIAS { rate } else { Vector3::zeros() };
        let yaw = if self.is_yaw_known { p.initial_yaw } else { 0.0 };
        self.state = State::from([yaw, pitch, roll, bias.z, bias.y, bias.x, 0.0, 0.0, 0.0]);
        let tilt = if is_levelled { p.initial_tilt_sigma } else { p.moving_tilt_sigma };
        let yaw = if self.is_yaw_known { p.initial_yaw_sigma } else { UNKNOWN_YAW_SIGMA };
        let (gyro, accel) = (p.initial_gyro_bias_sigma, p.initial_accel_bias_sigma);
        let sigma = State::from([yaw, tilt, tilt, gyro, gyro, gyro, accel, accel, accel]);
        self.covariance = Covariance::from_diagonal(&sigma.component_mul(&sigma));
        self.is_running = !stands || self.rest.time + 1e-9 >= p.align_time;
        if !is_levelled {
            self.notices.add("the log starts in motion: levelled by one sample", time);
        }
        true
    }

    /// Forget the state; speed and course stay.
    fn restart(&mut self) {
        self.is_running = false;
        self.is_yaw_known = false;
        self.rest = Mean::default();
        self.window = Mean::default();
        self.reference = None;
    }

    /// Move on by one sample; whether the angles still mean something.
    fn advance(&mut self, sample: &Sample, dt: f64, time: f64) -> bool {
        if dt > LONGEST_STEP {
            self.notices.add("hole in the inertial data: the angles stay and are doubted", time);
            let doubt = (0.2 * dt).min(UNKNOWN_YAW_SIGMA).powi(2);
            (YAW..GYRO_BIAS).for_each(|k| self.covariance[(k, k)] += doubt);
            self.window = Mean::default();
            self.reference = None;
            return true;
        }
        let angles: Matrix3<f64> = model::kinematics(self.state[1], self.state[2]);
        let jacobian = model::rates_jacobian(&self.state, &sample.gyro);
        // Midpoint rule.
        let mut middle = self.state;
        let half = model::rates(&self.state, &sample.gyro) * (0.5 * dt);
        (0..3).for_each(|k| middle[k] += half[k]);
        let moved = model::rates(&middle, &sample.gyro) * dt;
        (0..3).for_each(|k| self.state[k] += moved[k]);
        if !self.settle_angles() {
            return false;
        }
        let p = &self.params;
        let noise = [p.gyro_noise, p.gyro_bias_walk, p.accel_bias_walk].map(|n| n * n * sample.noise_factor);
        model::propagate(&mut self.covariance, &jacobian, &angles, noise, dt);
        self.window.add(sample, dt);
        true
    }

    /// Yaw and roll into their turn; whether the pitch is in its range.
    fn settle_angles(&mut self) -> bool {
        self.state[0] = wrap_angle(self.state[0]);
        self.state[2] = wrap_angle(self.state[2]);
        // What is not a number lies in no range.
        self.state[1].abs() < LARGEST_PITCH && self.state.iter().all(|v| v.is_finite())
    }

    /// Compare the mean specific force with the change of speed, once the speed is old enough.
    fn compare_force(&mut self, time: f64, row: &mut AttitudeEstimate) {
        let Some((at, speed)) = self.speed else {
            // Nobody says how fast the car is: level on the mean force, as often.
            if self.window.time + 1e-9 >= self.params.interval {
                self.fold_force(0.0, 0.0, row);
            }
            return;
        };
        let Some((since, before)) = self.reference else {
            if at >= time {
                self.reference = Some((at, speed));
                self.window = Mean::default();
            }
            return;
        };
        // Only a speed of this very instant belongs to the samples gathered.
        if at < time || at - since + 1e-9 < self.params.interval {
            return;
        }
        let forward = (speed - before) / (at - since);
        let rate = self.window.gyro / self.window.samples;
        let yaw_rate = model::rates(&self.state, &rate).x;
        self.fold_force(forward, 0.5 * (speed + before) * yaw_rate, row);
        self.reference = Some((at, speed));
    }

    fn fold_force(&mut self, forward: f64, rightward: f64, out: &mut AttitudeEstimate) {
        let measured = self.window.accel / self.window.samples;
        self.window = Mean::default();
        let (predicted, h) = model::specific_force(&self.state, forward, rightward, self.gravity);
        // Three rows of equal noise, one after the other: their statistics add up to that of all three.
        let (mut covariance, mut dx, mut nis) = (self.covariance, State::zeros(), 0.0);
        for row in 0..3 {
            let h = h.row(row).transpose();
            let y = measured[row] - predicted[row] - h.dot(&dx);
            let variance = self.params.accel_sigma.powi(2);
            let Ok(Outcome::Accepted { dx: step, nis: one }) =
                kalman::update_scalar(&mut covariance, y, &h, variance, None)
            else {
                return;
            };
            dx += step;
            nis += one;
        }
        out.force_nis = nis;
        out.force_accepted = 0.0;
        if nis <= self.gates[1].unwrap_or(f64::MAX) {
            self.covariance = covariance;
            out.force_accepted = self.take(&dx);
        }
    }

    /// The course is the yaw of a car that does not slide.
    fn compare_course(&mut self, row: &mut AttitudeEstimate) {
        let Some((course, sigma)) = self.course.take() else { return };
        let is_reversing = self.has_odometer && self.speed.is_some_and(|(_, speed)| speed < 0.0);
        let heading = if is_reversing { course + std::f64::consts::PI } else { course };
        if !self.is_yaw_known {
            self.is_yaw_known = true;
            self.state[YAW] = wrap_angle(heading);
            self.covariance.row_mut(YAW).fill(0.0);
            self.covariance.column_mut(YAW).fill(0.0);
            self.covariance[(YAW, YAW)] = sigma * sigma;
            return;
        }
        let mut h = State::zeros();
        h[YAW] = 1.0;
        let y = wrap_angle(heading - self.state[YAW]);
        if let Ok(outcome) = kalman::update_scalar(&mut self.covariance, y, &h, sigma * sigma, self.gates[0]) {
            row.course_nis = outcome.nis();
            row.course_accepted = match outcome {
                Outcome::Accepted { dx, .. } => self.take(&dx),
                Outcome::Rejected { .. } => 0.0,
            };
        }
    }

    /// Add a correction; 1 for the column that says so.
    fn take(&mut self, dx: &State) -> f64 {
        self.state += dx;
        self.state[YAW] = wrap_angle(self.state[YAW]);
        1.0
    }
}
