//! Vehicle motion, effective tyre forces, slope and road grade from signals that every car has.
//!
//! Three filters in cascade: motion and forces (`motion`), slope of the body (`pitch`), and road grade apart from body
//! pitch (`grade`). Wheel speed, yaw rate, forward and lateral specific force and the steering angle go in; barometer and
//! GNSS vertical velocity help the last filter where they exist.
//! Source: Kim, Kim & Lee 2014, as corrected and extended by SPEC slope sections 2 to 7.
//!
//! One epoch: for each sub-step the first filter predicts (on the slope of the second one) and updates, the second filter
//! predicts and updates with the first one's acceleration, the grade filter predicts; then the grade filter updates.
//! Measurements belong to the last sub-step. Departure: without a steering angle the last one holds (the specification
//! takes 0), since steering may come at its own rate. The rear-axle aid applies at inertial epochs.
//! With the filter `single` the first filter has the slope as a seventh state and there is no second one.
//! What can be known at all is in [`observability`].

mod axles;
mod delay;
mod estimate;
mod grade;
mod motion;
pub mod observability;
mod params;
mod pitch;
#[cfg(test)]
mod tests;
pub mod two_way;

use drivescope_drive::channel::Channel;
use drivescope_drive::drive::{Epoch, LogStart, Signal};
use drivescope_drive::signals::{Gnss, Imu, Steering};
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{SMatrix, SVector};

use self::axles::AxleCheck;
use self::delay::DelayLine;
use self::grade::{Aid, Datum, GradeFilter};
use self::motion::{Measured, MotionFilter, MotionNis, Steer};
use self::pitch::PitchFilter;
use self::two_way::Backward;
use crate::estimator::{Estimator, EstimatorError, Need, Notices};
use crate::kalman::NotPositiveDefinite;

pub use self::estimate::SlopeEstimate;
pub use self::params::{FilterChoice, SlopeParams};

/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.80665;
/// Longest step of the first two filters, s.
const LONGEST_STEP: f64 = 0.0501;
/// A longer hole in the log counts as this, s.
const LONGEST_GAP: f64 = 1.0;
/// Speed above which a sideslip angle means anything, m/s.
const SIDESLIP_SPEED: f64 = 1.0;

/// Beyond these a measurement is a fault: specific force m/s^2, yaw rate rad/s, wheel speed m/s, road-wheel angle rad.
const LARGEST_ACCEL: f64 = 50.0;
const LARGEST_YAW_RATE: f64 = 20.0;
const LARGEST_WHEEL: f64 = 100.0;
const LARGEST_STEER: f64 = 1.2;
/// A wheel speed with a larger normalized innovation squared is a fault: 30 sigmas.
const LARGEST_WHEEL_NIS: f64 = 1000.0;
/// A wheel speed that stays beyond that for so long is believed, s.
const JUMP_TIME: f64 = 0.1;
/// Higher or lower than any road, m.
const LARGEST_ALTITUDE: f64 = 1e4;

const OUT_OF_RANGE: &str = "a measurement beyond its sensor's range was left out";
const RESTARTED: &str =
    "the filters were restarted at the current wheel speed because a state or covariance had broken";
const WHEEL_LEFT_OUT: &str = "a wheel speed that no car could have reached since the last one was left out";
const WHEEL_JUMPED: &str = "the wheel speed jumped and stayed; the filters were restarted at the new one";
const TIME_REFUSED: &str = "an epoch whose time did not advance was skipped";
const GAP: &str = "a hole of more than 1 s was taken as 1 s";
const NOT_BACKWARD: &str = "the run backward through time failed; grade and altitude are those of the forward run";
const BARO_REJECTED: &str = "a barometric altitude was rejected by its gate";
const HEIGHT_REJECTED: &str = "a GNSS height was rejected by its gate";
const GNSS_REJECTED: &str = "a GNSS vertical velocity was rejected by its gate";

/// Estimator of motion, forces, slope and road grade.
#[derive(Clone, Debug)]
pub struct Slope {
    params: SlopeParams,
    steering_ratio: f64,
    motion: MotionFilter,
    pitch: PitchFilter,
    grade: GradeFilter,
    /// Time of the last used epoch, s; `None` while the speed is unknown.
    time: Option<f64>,
    /// Last wheel speed, m/s; before it the speed that the start of the drive tells, NaN if none.
    wheel: f64,
    /// Road-wheel angle in force, rad.
    steer: f64,
    inertial: DelayLine,
    axles: AxleCheck,
    /// Since when the wheel speed has been beyond belief, s.
    jumped: Option<f64>,
    backward: Option<Box<Backward>>,
    notices: Notices,
}

/// What one epoch measured, range-checked; NaN where there is nothing.
struct Row {
    wheel: f64,
    /// Error of the wheel speed beyond its sigma, m/s.
    wheel_doubt: f64,
    yaw_rate: f64,
    accel_x: f64,
    accel_y: f64,
    altitude: f64,
    /// Height of the receiver and the variance of its error.
    height: (f64, f64),
    upward: f64,
    has_imu: bool,
}

/// Normalized innovations squared of one epoch.
struct Nis {
    motion: MotionNis,
    pitch_wheel: f64,
    grade_wheel: f64,
    altitude: f64,
    height: f64,
    upward: f64,
}

impl Nis {
    const NONE: Self = Self {
        motion: MotionNis { wheel: f64::NAN, yaw_rate: f64::NAN, accel_x: f64::NAN, accel_y: f64::NAN },
        pitch_wheel: f64::NAN,
        grade_wheel: f64::NAN,
        altitude: f64::NAN,
        height: f64::NAN,
        upward: f64::NAN,
    };
}

impl Estimator for Slope {
    const NAME: &'static str = "slope";
    const TITLE: &'static str = "Slope, grade and forces";
    const DOC: &'static str = "Motion, effective tyre forces, slope of the body and grade of the road from wheel speed, yaw \
        rate and accelerations, by a cascade of Kalman filters after Kim, Kim & Lee 2014; the last one tells the grade of \
        the road from the pitch of the body.";
    const NEEDS: &'static [Need] = &[
        Need { signal: Signal::ForwardSpeed, required: true, why: "nothing else fixes the speed" },
        Need { signal: Signal::AccelX, required: true, why: "slope is specific force less change of speed" },
        Need { signal: Signal::GyroZ, required: false, why: "without it turns bias the slope" },
        Need {
            signal: Signal::AccelY,
            required: false,
            why: "without it lateral forces are unknown and turns bias the slope",
        },
        Need {
            signal: Signal::Steer,
            required: false,
            why: "without it the wheels count as straight and turns bias the slope",
        },
        Need {
            signal: Signal::BaroAltitude,
            required: false,
            why: "tells a long grade from a bias of the accelerometer",
        },
        Need {
            signal: Signal::GnssVerticalVelocity,
            required: false,
            why: "tells a long grade from a bias of the accelerometer",
        },
    ];
    const VEHICLE: &'static str = "kim_2014";
    type Params = SlopeParams;
    type Estimate = SlopeEstimate;

    fn new(params: &SlopeParams, vehicle: &VehicleParams, start: &LogStart) -> Self {
        Self {
            params: params.clone(),
            steering_ratio: vehicle.steering_ratio,
            motion: MotionFilter::new(params, vehicle, 0.0),
            pitch: PitchFilter::new(params, 0.0),
            grade: GradeFilter::new(params, 0.0),
            time: None,
            wheel: if start.speed.abs() <= LARGEST_WHEEL { start.speed } else { f64::NAN },
            steer: 0.0,
            inertial: DelayLine::new(params.wheel_latency),
            axles: AxleCheck::default(),
            jumped: None,
            backward: params.two_way.then(|| Box::new(Backward::new(vehicle))),
            notices: Notices::default(),
        }
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<SlopeEstimate>, EstimatorError> {
        let t = epoch.time;
        if let Some(backward) = &mut self.backward {
            backward.keep(epoch, self.params.wheel_latency);
        }
        if let Some(steering) = &epoch.steering {
            self.hold_steering(steering, t);
        }
        let Some(mut row) = self.row(epoch) else { return Ok(None) };
        if row.wheel.is_finite() {
            self.wheel = row.wheel;
        }
        let Some(previous) = self.time else {
            if !(self.wheel.is_finite() && t.is_finite()) {
                return Ok(None);
            }
            self.time = Some(t);
            self.restart();
            return Ok(Some(self.estimate(&Nis::NONE)));
        };
        let dt = t - previous;
        if !(dt > 0.0 && dt < f64::INFINITY) {
            self.notices.add(TIME_REFUSED, t);
            return Ok(None);
        }
        self.time = Some(t);
        if dt > LONGEST_GAP {
            self.notices.add(GAP, t);
        }
        if self.has_jumped(&mut row, t) {
            self.restart();
            return Ok(Some(self.estimate(&Nis::NONE)));
        }
        let nis = match self.advance(&row, dt.min(LONGEST_GAP)) {
            Ok(nis) if self.motion.is_sound() && self.pitch.is_sound() && self.grade.is_sound() => nis,
            _ => {
                self.notices.add(RESTARTED, t);
                self.restart();
                Nis::NONE
            }
        };
        Ok(Some(self.estimate(&nis)))
    }

    fn look_back(&mut self, rows: &mut Channel<SlopeEstimate>, steps: usize) -> f64 {
        let Some(backward) = &mut self.backward else { return 1.0 };
        backward.advance(&self.params, rows, steps).unwrap_or_else(|_| {
            self.notices.add(NOT_BACKWARD, self.time.unwrap_or(0.0));
            1.0
        })
    }

    fn look_back_share(&self) -> f64 {
        if self.backward.is_some() { 0.5 } else { 0.0 }
    }

    fn notices(&self) -> &Notices {
        &self.notices
    }
}

impl Slope {
    fn hold_steering(&mut self, steering: &Steering, time: f64) {
        let angle =
            if steering.steer.is_finite() { steering.steer } else { steering.steering_wheel / self.steering_ratio };
        if angle.abs() <= LARGEST_STEER {
            self.steer = angle;
        } else if angle.is_finite() {
            self.notices.add(OUT_OF_RANGE, time);
        }
    }

    /// The epoch's measurements; `None` if it holds no sensor that is used.
    fn row(&mut self, epoch: &Epoch) -> Option<Row> {
        let altitude = epoch.baro.filter(|_| self.params.use_baro).map_or(f64::NAN, |b| b.altitude);
        let fix = epoch.gnss.filter(|g| g.is_usable());
        let upward = fix.filter(|_| self.params.use_gnss).map_or(f64::NAN, |g| -g.v_down);
        let height = fix.filter(|_| self.params.use_gnss_height).map_or((f64::NAN, f64::NAN), |g| self.height(&g));
        let has_aid = altitude.is_finite() || upward.is_finite() || height.0.is_finite();
        if epoch.imu.is_none() && epoch.wheels.is_none() && !has_aid {
            return None;
        }
        let imu = epoch.imu.map_or_else(Imu::default, |imu| self.inertial.pass(epoch.time, imu));
        let wheel = epoch.wheels.map_or(f64::NAN, |w| w.forward_speed());
        let wheel_doubt = match &epoch.wheels {
            Some(wheels) if self.params.axle_check => {
                self.axles.doubt(epoch.time, wheels, self.steer, 2.0 * self.params.wheel_sigma)
            }
            _ => 0.0,
        };
        let mut screen = |value: f64, largest: f64| {
            if value.abs() <= largest {
                return value;
            }
            if !value.is_nan() {
                self.notices.add(OUT_OF_RANGE, epoch.time);
            }
            f64::NAN
        };
        Some(Row {
            wheel: screen(wheel, LARGEST_WHEEL),
            wheel_doubt,
            yaw_rate: screen(imu.gyro_z, LARGEST_YAW_RATE),
            accel_x: screen(imu.accel_x, LARGEST_ACCEL) - self.params.accel_offset,
            accel_y: screen(imu.accel_y, LARGEST_ACCEL),
            altitude: screen(altitude, LARGEST_ALTITUDE),
            height: (screen(height.0, LARGEST_ALTITUDE), height.1),
            upward: screen(upward, LARGEST_WHEEL),
            has_imu: epoch.imu.is_some(),
        })
    }

    /// Leave out a wheel speed that is beyond belief; whether it has stayed there so long that it is the truth.
    fn has_jumped(&mut self, row: &mut Row, time: f64) -> bool {
        if row.wheel.is_nan() {
            return false;
        }
        let sigma = self.wheel_sigma(self.params.grade_wheel_sigma, row);
        let away = row.wheel - self.grade.x[grade::SPEED];
        if away * away <= LARGEST_WHEEL_NIS * (self.grade.p[(grade::SPEED, grade::SPEED)] + sigma * sigma) {
            self.jumped = None;
            return false;
        }
        let since = *self.jumped.get_or_insert(time);
        let has_stayed = time - since >= JUMP_TIME;
        self.notices.add(if has_stayed { WHEEL_JUMPED } else { WHEEL_LEFT_OUT }, time);
        if has_stayed {
            self.jumped = None;
        } else {
            row.wheel = f64::NAN;
        }
        has_stayed
    }

    /// Height that a fix gives, and the variance of its error.
    fn height(&self, fix: &Gnss) -> (f64, f64) {
        let sigma = if fix.std_down > 0.0 { fix.std_down } else { self.params.gnss_height_sigma };
        (if fix.alt.is_finite() { fix.alt } else { -fix.down }, sigma * sigma)
    }

    fn restart(&mut self) {
        self.motion.restart(self.wheel);
        self.pitch.restart(self.wheel);
        self.grade.restart(self.wheel);
    }

    /// Error of a wheel speed: from `low_speed` down to standstill it rises to `low_speed_gain` times `sigma`; a disagreement
    /// of the axles comes on top.
    fn wheel_sigma(&self, sigma: f64, row: &Row) -> f64 {
        let shortfall = (1.0 - row.wheel.abs() / self.params.low_speed).max(0.0);
        let sigma = sigma * (1.0 + (self.params.low_speed_gain - 1.0) * shortfall);
        if row.wheel_doubt > 0.0 { sigma.hypot(row.wheel_doubt) } else { sigma }
    }

    /// Carry all filters over `dt` and fold in the row at its end.
    fn advance(&mut self, row: &Row, dt: f64) -> Result<Nis, NotPositiveDefinite> {
        let steps = (dt / LONGEST_STEP).ceil().max(1.0) as usize;
        let h = dt / steps as f64;
        let steer = Steer::new(self.steer);
        let is_cascade = self.params.filter == FilterChoice::Cascade;
        let mut nis = Nis::NONE;
        for step in 1..=steps {
            if is_cascade {
                self.motion.assume_slope(if self.params.slope_feedback { self.pitch.x[pitch::SLOPE] } else { 0.0 });
            }
            self.motion.predict(h, steer);
            if step == steps {
                nis.motion = self.motion.update(&self.measured(row), steer)?;
            }
            let specific_force = self.motion.specific_force(steer).0;
            let forward = self.motion.x[motion::YAW_RATE] * self.motion.x[motion::LATERAL_SPEED] + specific_force;
            if is_cascade {
                self.pitch.predict(h, forward);
                if step == steps {
                    let sigma = self.wheel_sigma(self.params.slope_wheel_sigma, row);
                    nis.pitch_wheel = self.pitch.update(row.wheel, sigma)?;
                }
            }
            self.grade.predict(h, forward, specific_force);
        }
        let sigma = self.wheel_sigma(self.params.grade_wheel_sigma, row);
        nis.grade_wheel = self.grade.update_wheel(row.wheel, sigma)?;
        let altitude = self.grade.update_altitude(row.altitude, self.params.baro_sigma.powi(2), Datum::Baro)?;
        nis.altitude = self.report(altitude, BARO_REJECTED);
        let height = self.grade.update_altitude(row.height.0, row.height.1, Datum::Gnss)?;
        nis.height = self.report(height, HEIGHT_REJECTED);
        let upward = self.grade.update_climb(row.upward)?;
        nis.upward = self.report(upward, GNSS_REJECTED);
        Ok(nis)
    }

    fn measured(&self, row: &Row) -> Measured {
        Measured {
            wheel: row.wheel,
            wheel_sigma: self.wheel_sigma(self.params.wheel_sigma, row),
            yaw_rate: row.yaw_rate,
            accel_x: row.accel_x,
            accel_y: row.accel_y,
            rear_axle: self.params.rear_axle_aid && row.has_imu,
        }
    }

    fn report(&mut self, aid: Aid, rejected: &'static str) -> f64 {
        if aid.is_rejected {
            self.notices.add(rejected, self.time.unwrap_or(f64::NAN));
        }
        aid.nis
    }

    fn estimate(&self, nis: &Nis) -> SlopeEstimate {
        let (m, g) = (&self.motion, &self.grade);
        let sigma_m = |i: usize| m.p[(i, i)].sqrt();
        let sigma_g = |i: usize| g.p[(i, i)].sqrt();
        let (speed, lateral) = (m.x[motion::SPEED], m.x[motion::LATERAL_SPEED]);
        let is_moving = speed > SIDESLIP_SPEED;
        let (slope, slope_variance) = match self.params.filter {
            FilterChoice::Cascade => (self.pitch.x[pitch::SLOPE], self.pitch.p[(pitch::SLOPE, pitch::SLOPE)]),
            FilterChoice::Single => (m.x[motion::SLOPE], m.p[(motion::SLOPE, motion::SLOPE)]),
        };
        let (accel_x, accel_x_sigma) = m.specific_force(Steer::new(self.steer));
        SlopeEstimate {
            speed,
            speed_sigma: sigma_m(motion::SPEED),
            lateral_speed: lateral,
            lateral_speed_sigma: sigma_m(motion::LATERAL_SPEED),
            yaw_rate: m.x[motion::YAW_RATE],
            yaw_rate_sigma: sigma_m(motion::YAW_RATE),
            force_xf: m.x[motion::FORCE_XF],
            force_xf_sigma: sigma_m(motion::FORCE_XF),
            force_yf: m.x[motion::FORCE_YF],
            force_yf_sigma: sigma_m(motion::FORCE_YF),
            force_yr: m.x[motion::FORCE_YR],
            force_yr_sigma: sigma_m(motion::FORCE_YR),
            accel_x_estimated: accel_x,
            accel_x_estimated_sigma: accel_x_sigma,
            accel_x_net: accel_x - GRAVITY * slope.sin(), // (5)
            accel_x_net_sigma: (accel_x_sigma.powi(2) + (GRAVITY * slope.cos()).powi(2) * slope_variance).sqrt(),
            slope,
            slope_sigma: slope_variance.sqrt(),
            grade: g.x[grade::GRADE],
            grade_sigma: sigma_g(grade::GRADE),
            body_pitch: g.x[grade::BODY_PITCH],
            body_pitch_sigma: sigma_g(grade::BODY_PITCH),
            body_pitch_rate: g.x[grade::BODY_PITCH_RATE],
            body_pitch_rate_sigma: sigma_g(grade::BODY_PITCH_RATE),
            accel_bias: g.x[grade::ACCEL_BIAS],
            accel_bias_sigma: sigma_g(grade::ACCEL_BIAS),
            altitude: g.x[grade::ALTITUDE],
            altitude_sigma: sigma_g(grade::ALTITUDE),
            sideslip: if is_moving { lateral.atan2(speed) } else { f64::NAN },
            sideslip_sigma: if is_moving { m.sideslip_sigma() } else { f64::NAN },
            wheel_nis: nis.motion.wheel,
            gyro_nis: nis.motion.yaw_rate,
            accel_x_nis: nis.motion.accel_x,
            accel_y_nis: nis.motion.accel_y,
            ekf2_wheel_nis: nis.pitch_wheel,
            grade_wheel_nis: nis.grade_wheel,
            baro_nis: nis.altitude,
            gnss_height_nis: nis.height,
            gnss_nis: nis.upward,
        }
    }
}

/// Whether a state is finite and its covariance has a diagonal that can be one.
fn is_sound<const N: usize>(x: &SVector<f64, N>, p: &SMatrix<f64, N, N>) -> bool {
    x.iter().all(|v| v.is_finite()) && p.iter().all(|v| v.is_finite()) && (0..N).all(|i| p[(i, i)] >= 0.0)
}
