//! What the guided vehicle measures: inertial sensor, odometer, satellites, ultrasonic ring.
//!
//! Grades are those of SPEC navigation 3 and 10.2: `mems`, odometer noise 0.02 m/s and scale 0.5 %.

use drivescope_drive::signals::{Gnss, Imu, Range, Wheels};

use super::settings::LoopParams;
use crate::grades::{Grade, ImuGrade, PositionGrade};
use crate::motion::{Inertial, Motion};
use crate::rng::Rng;
use crate::sensors::imu::ImuSensor;
use crate::sensors::position::GnssSensor;
use crate::sensors::ring::Ring;
use crate::truth::Biases;

/// Noise of a sample of the odometer, m/s, and its scale error, 1-sigma.
const ODOMETER_NOISE: f64 = 0.02;
const ODOMETER_SCALE: f64 = 0.005;
/// Engine speed that the vibration, which is off, is asked for, rad/s.
const IDLE: f64 = 80.0;
/// Sigma of a satellite velocity, m/s.
const VELOCITY_SIGMA: f64 = 0.1;

/// The sensors with their errors.
#[derive(Clone, Debug)]
pub(super) struct Sensors {
    imu: ImuSensor,
    gnss: GnssSensor,
    ring: Ring,
    odometer_scale: f64,
    odometer: Rng,
    every: u64,
}

impl Sensors {
    /// Sensors sampled every `step` s among posts.
    pub fn new(course: &LoopParams, posts: &[[f64; 3]], step: f64, seed: u64) -> Self {
        let mems = Grade::named("mems").map_or(crate::grades::GRADES[0].imu, |g| g.imu);
        let (resolution, range) = (0.0, [200.0, 35.0]);
        let grade = ImuGrade {
            scale: 0.0,
            accel_resolution: resolution,
            gyro_resolution: resolution,
            vibration: 0.0,
            misalignment: 0.0,
            range,
            ..mems
        };
        let sigma = course.gnss_sigma;
        let position = PositionGrade {
            rate: course.gnss_rate,
            white: [sigma; 2],
            correlated: [0.0; 2],
            correlation_time: 100.0,
            velocity: [VELOCITY_SIGMA; 2],
            slowest_course: 0.4,
            baro: [0.0, 0.0, 100.0],
            latency: 0.0,
        };
        let mut odometer = Rng::new(seed, "odometer");
        Self {
            imu: ImuSensor::new(&grade, step, seed),
            gnss: GnssSensor::new(&position, seed),
            ring: Ring::among(posts, seed),
            odometer_scale: 1.0 + ODOMETER_SCALE * odometer.normal(),
            odometer,
            every: libm::rint(1.0 / (course.gnss_rate * step)).max(1.0) as u64,
        }
    }

    /// The inertial sample of the step that ends now.
    pub fn imu(&mut self, inertial: &Inertial) -> Imu {
        self.imu.next(inertial, 0.0, IDLE)
    }

    /// Biases now.
    pub fn biases(&self) -> Biases {
        Biases { accel: self.imu.accel_bias(), gyro: self.imu.gyro_bias() }
    }

    /// What the odometer says at a forward speed, m/s; a standing car's says 0.
    pub fn wheels(&mut self, speed: f64) -> Wheels {
        let noise = ODOMETER_NOISE * self.odometer.normal();
        let read = if speed.abs() < 1e-3 { 0.0 } else { (speed * self.odometer_scale + noise).max(0.0) };
        Wheels { speed: read, ..Wheels::default() }
    }

    /// The fix of this sample, if there is one.
    pub fn gnss(&mut self, sample: u64, motion: &Motion) -> Option<Gnss> {
        (sample > 0 && sample.is_multiple_of(self.every)).then(|| self.gnss.next(motion, false))
    }

    /// What the ring sees from a place at a heading.
    pub fn ring(&mut self, north: f64, east: f64, yaw: f64) -> Range {
        self.ring.read(north, east, yaw)
    }
}
