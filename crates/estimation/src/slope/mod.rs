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
mod row;
mod shake;
#[cfg(test)]
mod tests;
pub mod two_way;

use drivescope_drive::channel::Channel;
use drivescope_drive::drive::{Epoch, LogStart, Signal};
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{SMatrix, SVector};

use self::axles::AxleCheck;
use self::delay::DelayLine;
use self::estimate::Nis;
use self::grade::{Aid, Datum, GradeFilter};
use self::motion::{MotionFilter, Steer};
use self::pitch::PitchFilter;
use self::row::{LARGEST_WHEEL, Row};
use self::shake::Shake;
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
    shake: Shake,
    /// Since when the wheel speed has been beyond belief, s.
    jumped: Option<f64>,
    backward: Option<Box<Backward>>,
    notices: Notices,
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
            signal: Signal::AccelZ,
            required: false,
            why: "tells bumps, on which the wheel speeds are not the car's",
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
            shake: Shake::new(params),
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
    fn restart(&mut self) {
        self.motion.restart(self.wheel);
        self.pitch.restart(self.wheel);
        self.grade.restart(self.wheel);
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
                    let sigma = self.wheel_sigma(self.params.slope_wheel_sigma, row, row.disagreement);
                    nis.pitch_wheel = self.pitch.update(row.wheel, sigma)?;
                }
            }
            self.grade.predict(h, forward, specific_force);
        }
        let sigma = self.grade_wheel_sigma(row);
        nis.grade_wheel = self.grade.update_wheel(row.wheel, sigma)?;
        let altitude = self.grade.update_altitude(row.altitude, self.params.baro_sigma.powi(2), Datum::Baro)?;
        nis.altitude = self.report(altitude, BARO_REJECTED);
        let height = self.grade.update_altitude(row.height.0, row.height.1, Datum::Gnss)?;
        nis.height = self.report(height, HEIGHT_REJECTED);
        let upward = self.grade.update_climb(row.upward)?;
        nis.upward = self.report(upward, GNSS_REJECTED);
        Ok(nis)
    }

    fn report(&mut self, aid: Aid, rejected: &'static str) -> f64 {
        if aid.is_rejected {
            self.notices.add(rejected, self.time.unwrap_or(f64::NAN));
        }
        aid.nis
    }
}

/// Whether a state is finite and its covariance has a diagonal that can be one.
fn is_sound<const N: usize>(x: &SVector<f64, N>, p: &SMatrix<f64, N, N>) -> bool {
    x.iter().all(|v| v.is_finite()) && p.iter().all(|v| v.is_finite()) && (0..N).all(|i| p[(i, i)] >= 0.0)
}
