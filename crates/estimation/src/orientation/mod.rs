//! Roll, pitch and yaw of a car from a magnetometer, a yaw gyro, a lateral accelerometer and the speed.
//!
//! Variants, from one vector pair per sample to a filter that knows suspension, road and disturbed fields, the default.
//! Source: Hwang & Choi 2016, as corrected by SPEC orientation sections 3 to 6; beyond it the road filters of sections 8 and
//! 9; bad input as in section 12.
//!
//! Inertial epochs drive the filter. Speeds are held; a magnetic sample or a course of another epoch waits for the next
//! inertial one and is used once. Departure: before the first usable field there is no estimate (the specification puts
//! out zeros).
//! Not modelled: bank under the suspension model, grade under the static solution; but for the robust variants, disturbed
//! fields.

mod attitude;
#[cfg(test)]
mod claims_tests;
mod cone;
#[cfg(test)]
mod consistency_tests;
mod detector;
mod ekf;
mod estimate;
mod gate;
mod hindsight;
mod model;
mod params;
mod reference_field;
mod road;
mod road_model;
mod sample;
mod sanitize;
#[cfg(test)]
mod tests;
mod triad;
mod trig;
mod whitened;

use drivescope_drive::drive::{Epoch, LogStart, Signal};
use drivescope_drive::frames::{Euler, wrap_angle};
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{Vector3, Vector5, vector};

use self::attitude::down_in_body;
use self::cone::{LEAST_CONDITION, gravity_on_cone};
use self::detector::{Derivative, StaticDetector};
use self::ekf::{GyroFilter, Noise, SprungFilter, midpoint};
use self::gate::Decision;
use self::model::{Input, PitchDrive, Rates, Suspension, open_loop_rates};
use self::road::{Reference, RoadFilter, RoadSetup};
use self::sample::{Findings, Sample, dip_error};
use self::sanitize::{Inertial, Sanitizer};
use self::triad::{Triad, pseudo_gravity};
use crate::estimator::{Estimator, EstimatorError, Need, Notices};

pub use self::estimate::OrientationEstimate;
pub use self::params::{FieldModel, OrientationParams, PitchForce, Variant};
pub use self::reference_field::{DEFAULT_YEAR, reference_of};

/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.80665;
/// Step of the first sample, s.
const FIRST_STEP: f64 = 0.01;
/// A longer hole in the log starts the filter again, s.
const LONGEST_GAP: f64 = 0.5;
/// A magnetic sample or course that waits longer than this for an inertial one is dropped, s.
const LONGEST_WAIT: f64 = 0.1;
/// Speed above which a course says something of the sideslip, m/s.
const SIDESLIP_SPEED: f64 = 3.0;
/// Roll or pitch beyond this starts the filter again, rad.
const LARGEST_ANGLE: f64 = 75.0 * std::f64::consts::PI / 180.0;
/// 1-sigma of the yaw beyond which it is said to be lost, rad.
const LOST_YAW: f64 = 10.0 * std::f64::consts::PI / 180.0;

const TIME_REFUSED: &str = "an epoch whose time did not advance was skipped";
const GAP: &str = "the filter was started again after a hole of more than 0.5 s";
const RESTARTED: &str = "the filter was started again because its attitude had left its range: the measured field does not fit the field \
     set in the parameters (a magnetometer that is not calibrated, or a drive elsewhere)";
const FIELD_LEFT_OUT: &str = "a magnetic field that does not fit the Earth's or the attitude was left out";
const FIELD_BELIEVED: &str = "a magnetic field that had not fitted the attitude for long was believed again";
const LOST: &str = "the yaw was not known to 10 deg, because no magnetic field had fitted for long";
const NO_FORWARD: &str = "without a forward accelerometer the variant robust_ax is robust";

/// Estimator of roll, pitch and yaw.
#[derive(Clone, Debug)]
pub struct Orientation {
    params: OrientationParams,
    suspension: Suspension,
    noise: Noise,
    rates: Rates,
    road: RoadSetup,
    reference: Reference,
    triad: Triad,
    sanitizer: Sanitizer,
    derivative: Derivative,
    detector: StaticDetector,
    /// `None` until a field has given the first attitude.
    filter: Option<Filter>,
    /// Attitude put out last.
    last: Euler,
    time: Option<f64>,
    field: Option<(f64, Vector3<f64>)>,
    course: Option<(f64, f64)>,
    notices: Notices,
}

/// The state of the chosen variant.
#[derive(Clone, Debug)]
enum Filter {
    Static(Euler),
    OpenLoop(Vector5<f64>),
    Gyro(GyroFilter),
    Sprung(SprungFilter),
    Road(Box<RoadFilter>),
}

impl Estimator for Orientation {
    const NAME: &'static str = "orientation";
    const TITLE: &'static str = "Orientation";
    const DOC: &'static str = "Roll, pitch and yaw from a three-axis magnetometer, yaw rate, lateral acceleration and speed, \
        with the suspension as model, after Hwang & Choi 2016; its robust variants also estimate bank and grade of the road and \
        leave disturbed magnetic fields out.";
    const NEEDS: &'static [Need] = &[
        Need { signal: Signal::Mag, required: true, why: "heading and tilt are measured by the Earth's field" },
        Need { signal: Signal::GyroZ, required: true, why: "it carries the heading through turns" },
        Need { signal: Signal::AccelY, required: true, why: "it tells gravity sideways and drives the roll model" },
        Need {
            signal: Signal::ForwardSpeed,
            required: true,
            why: "it tells steady driving and drives the pitch model",
        },
        Need {
            signal: Signal::AccelX,
            required: false,
            why: "drives the pitch model when that is chosen, and keeps the grade in the variant robust_ax",
        },
        Need { signal: Signal::GnssCourse, required: false, why: "sideslip is course less yaw" },
    ];
    const VEHICLE: &'static str = "bmw_320i";
    type Params = OrientationParams;
    type Estimate = OrientationEstimate;

    fn new(params: &OrientationParams, vehicle: &VehicleParams, start: &LogStart) -> Self {
        let mut notices = Notices::default();
        let field = reference_field::reference_field(params, start, &mut notices);
        let strength = field.norm();
        Self {
            params: params.clone(),
            suspension: Suspension::new(vehicle),
            noise: Noise::new(params),
            rates: if params.printed_rates { Rates::Printed } else { Rates::Euler },
            road: RoadSetup::new(params, vehicle),
            reference: Reference { field, strength, dip: (field.z / strength).clamp(-1.0, 1.0).asin() },
            triad: Triad::new(&field),
            sanitizer: Sanitizer::new(start.speed, strength),
            derivative: Derivative::of_speed(),
            detector: StaticDetector::new(params),
            filter: None,
            last: Euler::default(),
            time: None,
            field: None,
            course: None,
            notices,
        }
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<OrientationEstimate>, EstimatorError> {
        self.hold(epoch);
        let Some(imu) = &epoch.imu else { return Ok(None) };
        let Some(dt) = self.advance_time(epoch.time) else { return Ok(None) };
        let inertial = self.sanitizer.inertial(imu, dt, epoch.time, &mut self.notices);
        let field = self.field.take().filter(|(t, _)| epoch.time - t <= LONGEST_WAIT).map(|(_, field)| field);
        if self.filter.is_none() {
            let Some(field) = field else { return Ok(None) };
            self.start(&field, &inertial);
        }
        let sample = self.sample(&inertial, field, epoch.time, dt);
        let findings = self.step_filter(&sample);
        let findings = if is_in_range(&self.attitude()) { findings } else { None };
        if findings.is_none() {
            self.notices.add(RESTARTED, epoch.time);
            self.filter = None;
            if let Some(field) = field {
                self.start(&field, &inertial);
            }
        } else {
            self.last = self.attitude();
        }
        Ok(Some(self.estimate(epoch.time, &sample, findings)))
    }

    fn notices(&self) -> &Notices {
        &self.notices
    }
}

fn is_in_range(attitude: &Euler) -> bool {
    attitude.roll.abs() <= LARGEST_ANGLE && attitude.pitch.abs() <= LARGEST_ANGLE && attitude.yaw.is_finite()
}

impl Orientation {
    /// Keep what an epoch brings for the next inertial sample.
    fn hold(&mut self, epoch: &Epoch) {
        if let Some(wheels) = &epoch.wheels {
            self.sanitizer.hold_speed(wheels.forward_speed(), epoch.time, &mut self.notices);
        }
        if let Some(field) = epoch.mag.and_then(|m| self.sanitizer.field(&m, epoch.time, &mut self.notices)) {
            self.field = Some((epoch.time, field));
        }
        if let Some(fix) = epoch.gnss.filter(|g| g.is_usable()) {
            let course = fix.course_over_ground(SIDESLIP_SPEED);
            if course.is_finite() {
                self.course = Some((epoch.time, course));
            }
        }
    }

    /// Step to `time`, s; `None` if it does not advance. A long hole starts the filter again.
    fn advance_time(&mut self, time: f64) -> Option<f64> {
        let dt = self.time.map_or(FIRST_STEP, |previous| time - previous);
        if !(time.is_finite() && dt > 0.0) {
            self.notices.add(TIME_REFUSED, time);
            return None;
        }
        self.time = Some(time);
        if dt <= LONGEST_GAP {
            return Some(dt);
        }
        self.notices.add(GAP, time);
        self.filter = None;
        self.derivative = Derivative::of_speed();
        self.detector = StaticDetector::new(&self.params);
        Some(FIRST_STEP)
    }

    /// Start the chosen variant at the static attitude, or where it was last if there is none.
    fn start(&mut self, field: &Vector3<f64>, inertial: &Inertial) {
        let accel_y = inertial.accel_y;
        if matches!(self.params.variant, Variant::Road | Variant::Robust | Variant::RobustAx) {
            let gravity = accel_y - self.sanitizer.speed() * inertial.yaw_rate;
            let attitude = self.start_attitude(field, gravity);
            let filter = RoadFilter::new(&self.road, &attitude.unwrap_or(self.last), accel_y);
            self.filter = Some(Filter::Road(Box::new(filter)));
            return;
        }
        let attitude = self.static_attitude(field, accel_y).unwrap_or(self.last);
        self.filter = Some(match self.params.variant {
            Variant::Triad => Filter::Static(attitude),
            Variant::Model => Filter::OpenLoop(vector![0.0, 0.0, 0.0, 0.0, attitude.yaw]),
            Variant::EkfNoModel => Filter::Gyro(GyroFilter::new(&attitude, self.noise)),
            _ => Filter::Sprung(SprungFilter::new(&attitude, self.noise)),
        });
    }

    /// From the cone; on the level where there is none, and where the field lies across the car: there noise alone makes
    /// the cone's pitch.
    fn start_attitude(&self, field: &Vector3<f64>, gravity: f64) -> Option<Euler> {
        let h = &self.reference.field;
        let level = pseudo_gravity(gravity).and_then(|down| self.triad.attitude(field, &down));
        let ahead = level.map_or(f64::MAX, |a| (a.yaw.cos() * h.x + a.yaw.sin() * h.y).abs());
        if ahead < LEAST_CONDITION * self.reference.strength {
            return level;
        }
        let down = gravity_on_cone(field, gravity, h, self.last.pitch);
        down.and_then(|down| self.triad.attitude(field, &down)).or(level)
    }

    fn static_attitude(&self, field: &Vector3<f64>, accel_y: f64) -> Option<Euler> {
        self.triad.attitude(field, &pseudo_gravity(accel_y)?)
    }

    fn sample(&mut self, inertial: &Inertial, field: Option<Vector3<f64>>, time: f64, dt: f64) -> Sample {
        let speed = self.sanitizer.speed();
        let change = self.derivative.step(speed, dt);
        let [has_yaw_rate, has_accel_y] = inertial.has;
        let seen = if has_yaw_rate { inertial.yaw_rate } else { f64::NAN };
        let pitch = match (self.params.pitch_force, inertial.accel_x) {
            (PitchForce::Sensor, Some(force)) => PitchDrive::Given(force),
            (PitchForce::None, _) => PitchDrive::Given(0.0),
            _ => PitchDrive::Derived(change),
        };
        Sample {
            input: Input { yaw_rate: inertial.yaw_rate, accel_y: inertial.accel_y, pitch },
            speed,
            speed_change: change,
            accel_x: inertial.accel_x,
            is_fresh: has_yaw_rate && has_accel_y && self.sanitizer.has_speed(time),
            field,
            is_static: self.detector.step(speed, seen, change, dt),
            dt,
        }
    }

    fn attitude(&self) -> Euler {
        match &self.filter {
            None => self.last,
            Some(Filter::Static(attitude)) => *attitude,
            Some(Filter::OpenLoop(x)) => {
                Euler { roll: x[model::ROLL], pitch: x[model::PITCH], yaw: wrap_angle(x[model::YAW]) }
            }
            Some(Filter::Gyro(f)) => f.attitude(),
            Some(Filter::Sprung(f)) => f.attitude(),
            Some(Filter::Road(f)) => f.attitude(),
        }
    }

    /// The static attitude where the variant goes by it.
    fn fixed_attitude(&self, s: &Sample, down: Option<&Vector3<f64>>) -> Option<Euler> {
        match (self.params.variant, s.is_static) {
            (Variant::Triad, _) | (Variant::Switch, true) => self.triad.attitude(s.field.as_ref()?, down?),
            _ => None,
        }
    }

    /// Carry the filter over one sample; `None` if it broke.
    fn step_filter(&mut self, s: &Sample) -> Option<Findings> {
        let down = pseudo_gravity(s.input.accel_y);
        let fixed = self.fixed_attitude(s, down.as_ref());
        if let Some(Filter::Road(f)) = &mut self.filter {
            let findings = f.step(s, &self.reference)?;
            return Some(Findings::of_road(f.sigma(), &findings));
        }
        let reference = self.reference.field;
        let dip = |down: Option<Vector3<f64>>| dip_error(s.field.as_ref(), down.as_ref(), self.reference.dip);
        let none = [f64::NAN; 3];
        match self.filter.as_mut()? {
            Filter::Static(attitude) => {
                *attitude = fixed.unwrap_or(*attitude);
                Some(Findings::new(none, dip(down), f64::NAN))
            }
            Filter::OpenLoop(x) => {
                *x = midpoint(x, |x| open_loop_rates(x, &s.input, &self.suspension), s.dt);
                let attitude = self.attitude();
                Some(Findings::new(none, dip(Some(down_in_body(&attitude))), f64::NAN))
            }
            Filter::Gyro(f) => {
                f.predict(s.input.yaw_rate, self.rates, s.dt);
                let dip_error = dip(Some(down_in_body(&f.attitude())));
                let nis = s.field.map_or(Ok(f64::NAN), |field| f.update(&field, &reference)).ok()?;
                Some(Findings::new(f.sigma(), dip_error, nis))
            }
            Filter::Sprung(f) => {
                if let Some(attitude) = fixed {
                    *f = SprungFilter::new(&attitude, self.noise);
                    return Some(Findings::new(f.sigma(), dip(down), f64::NAN));
                }
                f.predict(&s.input, &self.suspension, self.rates, s.dt);
                let dip_error = dip(Some(down_in_body(&f.attitude())));
                let nis = s.field.map_or(Ok(f64::NAN), |field| f.update(&field, &reference)).ok()?;
                Some(Findings::new(f.sigma(), dip_error, nis))
            }
            Filter::Road(_) => None,
        }
    }

    fn estimate(&mut self, time: f64, s: &Sample, findings: Option<Findings>) -> OrientationEstimate {
        let course = self.course.take().filter(|(t, _)| time - t <= LONGEST_WAIT && s.speed > SIDESLIP_SPEED);
        let f = findings.unwrap_or(Findings::new([f64::NAN; 3], f64::NAN, f64::NAN));
        let mut out = OrientationEstimate::blank();
        (out.roll, out.pitch, out.yaw) = (self.last.roll, self.last.pitch, self.last.yaw);
        [out.roll_sigma, out.pitch_sigma, out.yaw_sigma] = f.sigma;
        if let Some((_, course)) = course {
            out.sideslip = wrap_angle(course - out.yaw);
            out.sideslip_sigma = out.yaw_sigma.hypot(self.params.course_sigma);
        }
        out.is_static = f64::from(u8::from(s.is_static));
        out.field_norm_error = s.field.map_or(f64::NAN, |field| field.norm() - self.reference.strength);
        (out.dip_error, out.field_nis, out.lateral_nis) = (f.dip_error, f.nis, f.lateral_nis);
        if f.sigma[2] > LOST_YAW {
            self.notices.add(LOST, time);
        }
        if self.params.variant == Variant::RobustAx && s.accel_x.is_none() {
            self.notices.add(NO_FORWARD, time);
        }
        if let Some(decision) = f.decision {
            match decision {
                Decision::Leave(_) => self.notices.add(FIELD_LEFT_OUT, time),
                Decision::Reacquire => self.notices.add(FIELD_BELIEVED, time),
                Decision::Use(_) => {}
            }
            (out.gate, out.gate_reason) = (decision.code(), decision.reason());
        }
        if let (Some(Filter::Road(filter)), Some(_)) = (&self.filter, &findings) {
            filter.fill(&mut out);
        }
        out
    }
}
