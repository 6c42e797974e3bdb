//! Satellite receiver and barometer.

use drivescope_drive::signals::{Baro, Gnss};
use nalgebra::Vector3;

use super::{GaussMarkov, quantized};
use crate::earth::Local;
use crate::grades::PositionGrade;
use crate::math::sin_cos;
use crate::motion::Motion;
use crate::rng::Rng;

/// State of the receiver.
#[derive(Clone, Debug)]
pub struct GnssSensor {
    grade: PositionGrade,
    error: [GaussMarkov; 3],
    sky: GaussMarkov,
    rng: Rng,
}

impl GnssSensor {
    /// A receiver of a grade.
    pub fn new(grade: &PositionGrade, seed: u64) -> Self {
        let mut rng = Rng::new(seed, "gnss");
        let [flat, tall] = grade.correlated;
        let step = 1.0 / grade.rate;
        let error = [flat, flat, tall].map(|sigma| GaussMarkov::new(sigma, grade.correlation_time, step, &mut rng));
        let sky = GaussMarkov::new(1.0, 40.0, step, &mut rng);
        Self { grade: *grade, error, sky, rng }
    }

    /// The next fix; `None` of its values but `valid` = 0 during an outage.
    pub fn next(&mut self, motion: &Motion, outage: bool) -> Gnss {
        let sky = self.sky.next(&mut self.rng);
        let [e0, e1, e2] = &mut self.error;
        let correlated = Vector3::new(e0.next(&mut self.rng), e1.next(&mut self.rng), e2.next(&mut self.rng));
        let (white, shaken) = (self.rng.normal3(), self.rng.normal3());
        if outage {
            return Gnss { valid: 0.0, satellites: 0.0, ..Gnss::default() };
        }
        let g = &self.grade;
        let split = |[flat, tall]: [f64; 2]| Vector3::new(flat, flat, tall);
        let error = correlated + white.component_mul(&split(g.white));
        let v = motion.velocity + shaken.component_mul(&split(g.velocity));
        let local = Local::at(&motion.place);
        let (_, cos_lat) = sin_cos(motion.place.lat);
        let speed = (v.x * v.x + v.y * v.y).sqrt();
        let total = |axis: usize| (g.white[axis] * g.white[axis] + g.correlated[axis] * g.correlated[axis]).sqrt();
        Gnss {
            lat: motion.place.lat + error.x / local.north_radius,
            lon: motion.place.lon + error.y / (local.east_radius * cos_lat),
            alt: motion.place.alt - error.z,
            v_north: v.x,
            v_east: v.y,
            v_down: v.z,
            speed,
            course: if speed > g.slowest_course { libm::atan2(v.y, v.x) } else { f64::NAN },
            std_north: total(0),
            std_east: total(0),
            std_down: total(1),
            satellites: libm::rint(11.0 + 1.3 * sky).clamp(6.0, 16.0),
            pdop: quantized(1.7 - 0.15 * sky.clamp(-3.0, 3.0), 0.01),
            valid: 1.0,
            ..Gnss::default()
        }
    }
}

/// State of the barometer.
#[derive(Clone, Debug)]
pub struct BaroSensor {
    noise: f64,
    drift: GaussMarkov,
    rng: Rng,
}

impl BaroSensor {
    /// A barometer of a grade, sampled every `step` s.
    pub fn new(grade: &PositionGrade, step: f64, seed: u64) -> Self {
        let mut rng = Rng::new(seed, "baro");
        let [noise, drift, time] = grade.baro;
        Self { noise, drift: GaussMarkov::new(drift, time, step, &mut rng), rng }
    }

    /// The next sample.
    pub fn next(&mut self, motion: &Motion) -> Baro {
        let error = self.drift.next(&mut self.rng) + self.noise * self.rng.normal();
        Baro { altitude: motion.place.alt + error }
    }
}
