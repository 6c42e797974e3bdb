//! Satellites and their pseudoranges: a Walker constellation 55:30/6/1 as in section 5 of the navigation specification.
//!
//! Transit time, Sagnac effect, ionosphere and relativity are left out. The fix is the least-squares solution of the
//! ranges in view, linear round the true place: the neglected second order of a 30 m error over 20,000 km is 0.05 mm.

use drivescope_drive::geodesy::{EARTH_RATE, GM};
use drivescope_drive::satellites::Satellite;
use drivescope_drive::signals::Gnss;
use nalgebra::{Matrix4, Vector3, Vector4};

use super::GaussMarkov;
use crate::earth::{Local, earth_centred};
use crate::math::sin_cos;
use crate::motion::Motion;
use crate::rng::Rng;
use crate::spec::{Fault, FaultKind};

const PLANES: usize = 6;
const PER_PLANE: usize = 5;
const SATELLITES: usize = PLANES * PER_PLANE;
const ORBIT: f64 = 26_559_700.0;
/// Time of the constellation at the drive's start, s.
const EPOCH: f64 = 3600.0;
/// Satellites below 10 deg are not used; in a canyon, those below 50 deg.
const MASK_SIN: f64 = 0.173_648_177_666_930_33;
const CANYON_SIN: f64 = 0.766_044_443_118_978;
/// Errors of a range: white and correlated, 1-sigma, m, and the correlation time, s; of a rate, m/s.
const WHITE: f64 = 0.5;
const CORRELATED: f64 = 1.0;
const CORRELATION_TIME: f64 = 120.0;
const RATE_NOISE: f64 = 0.05;
/// Receiver clock at the start: offset, m, and drift, m/s; noise of both, m^2/s and (m/s)^2/s.
const CLOCK: [f64; 2] = [3000.0, 30.0];
const CLOCK_NOISE: [f64; 2] = [0.009, 0.0355];
/// Geometry is refused beyond this dilution.
const WORST_PDOP: f64 = 30.0;

/// Place (m) and velocity (m/s) of a satellite, 0 to 29, at a time of the drive, s; Earth-fixed.
pub fn satellite(index: usize, time: f64) -> (Vector3<f64>, Vector3<f64>) {
    let tau = std::f64::consts::TAU;
    let (plane, slot) = ((index / PER_PLANE) as f64, (index % PER_PLANE) as f64);
    let t = time + EPOCH;
    let motion = (GM / (ORBIT * ORBIT * ORBIT)).sqrt();
    let (su, cu) = sin_cos(tau * slot / PER_PLANE as f64 + tau / SATELLITES as f64 * plane + motion * t);
    let (so, co) = sin_cos(tau * plane / PLANES as f64 - EARTH_RATE * t);
    let (si, ci) = sin_cos(55_f64.to_radians());
    let place = Vector3::new(cu * co - su * ci * so, cu * so + su * ci * co, su * si) * ORBIT;
    let along = Vector3::new(-su * co - cu * ci * so, -su * so + cu * ci * co, cu * si) * (ORBIT * motion);
    (place, along - Vector3::new(0.0, 0.0, EARTH_RATE).cross(&place))
}

/// A receiver of single satellites.
#[derive(Clone, Debug)]
pub struct Receiver {
    errors: Vec<GaussMarkov>,
    clock: [f64; 2],
    step: f64,
    rng: Rng,
    faults: Vec<Fault>,
    jumps: Vec<bool>,
    slowest_course: f64,
}

/// A satellite in view: what is measured of it, direction from the receiver (north, east, down), errors of range and rate.
struct InView {
    seen: Satellite,
    direction: Vector3<f64>,
    error: [f64; 2],
}

impl Receiver {
    /// A receiver with an epoch every `step` s.
    pub fn new(step: f64, slowest_course: f64, faults: &[Fault], seed: u64) -> Self {
        let mut rng = Rng::new(seed, "satellites");
        let errors = (0..SATELLITES).map(|_| GaussMarkov::new(CORRELATED, CORRELATION_TIME, step, &mut rng)).collect();
        let jumps = vec![false; faults.len()];
        Self { errors, clock: CLOCK, step, rng, faults: faults.to_vec(), jumps, slowest_course }
    }

    /// The next epoch, at a time (s) and a place along the road (m): the satellites in view go to `satellites`, their fix is returned.
    pub fn next(
        &mut self,
        (time, s): (f64, f64),
        motion: &Motion,
        outage: bool,
        satellites: &mut Vec<Satellite>,
    ) -> Gnss {
        self.run_clock(time, s);
        let mut view = self.look((time, s), motion, outage);
        self.reflect((time, s), &mut view);
        satellites.extend(view.iter().map(|v| v.seen));
        self.fix(motion, &view).unwrap_or(Gnss { valid: 0.0, satellites: view.len() as f64, ..Gnss::default() })
    }

    fn run_clock(&mut self, time: f64, s: f64) {
        let [phase, drift] = CLOCK_NOISE;
        self.clock[0] += self.clock[1] * self.step + (phase * self.step).sqrt() * self.rng.normal();
        self.clock[1] += (drift * self.step).sqrt() * self.rng.normal();
        for (fault, done) in self.faults.iter().zip(&mut self.jumps) {
            if fault.kind == FaultKind::ClockJump && fault.has_begun(time, s) && !*done {
                *done = true;
                self.clock[0] += fault.size.unwrap_or(299_792.458);
            }
        }
    }

    fn look(&mut self, (time, s): (f64, f64), motion: &Motion, outage: bool) -> Vec<InView> {
        let (here, to_ned) = earth_centred(&motion.place);
        let acts = |kind| self.faults.iter().any(|f| f.kind == kind && f.acts(time, s));
        let mask = if acts(FaultKind::Canyon) { CANYON_SIN } else { MASK_SIN };
        let mut view = Vec::new();
        for index in 0..SATELLITES {
            // Errors go on while a satellite is hidden, and every satellite draws, so that faults change nothing else.
            let correlated = self.errors[index].next(&mut self.rng);
            let error = [correlated + WHITE * self.rng.normal(), RATE_NOISE * self.rng.normal()];
            let (place, velocity) = satellite(index, time);
            let away = place - here;
            let range = away.norm();
            let direction = to_ned * away / range;
            if outage || -direction.z < mask {
                continue;
            }
            let rate = direction.dot(&(to_ned * velocity - motion.velocity));
            let seen = Satellite {
                prn: index as u32 + 1,
                place,
                velocity,
                range: range + self.clock[0] + error[0],
                rate: rate + self.clock[1] + error[1],
            };
            view.push(InView { seen, direction, error });
        }
        view
    }

    /// Lengthen the ranges of the two lowest satellites while there are reflections.
    fn reflect(&self, (time, s): (f64, f64), view: &mut [InView]) {
        let lowest = |but: Option<usize>| {
            let others = (0..view.len()).filter(|k| Some(*k) != but);
            others.reduce(|a, b| if view[b].direction.z > view[a].direction.z { b } else { a })
        };
        let first = lowest(None);
        let second = lowest(first);
        for fault in self.faults.iter().filter(|f| f.kind == FaultKind::Multipath && f.acts(time, s)) {
            let size = fault.size.unwrap_or(18.0);
            for (index, factor) in [(first, 1.0), (second, 26.0 / 18.0)] {
                if let Some(low) = index.and_then(|k| view.get_mut(k)) {
                    low.seen.range += size * factor;
                    low.error[0] += size * factor;
                }
            }
        }
    }

    /// Least squares over the satellites in view; `None` when they are too few or badly placed.
    fn fix(&self, motion: &Motion, view: &[InView]) -> Option<Gnss> {
        if view.len() < 4 {
            return None;
        }
        let (mut normal, mut range, mut rate) = (Matrix4::zeros(), Vector4::zeros(), Vector4::zeros());
        for seen in view {
            let row = Vector4::new(-seen.direction.x, -seen.direction.y, -seen.direction.z, 1.0);
            normal += row * row.transpose();
            range += row * seen.error[0];
            rate += row * seen.error[1];
        }
        let covariance = normal.try_inverse()?;
        let pdop = (covariance[(0, 0)] + covariance[(1, 1)] + covariance[(2, 2)]).sqrt();
        if pdop.is_nan() || pdop > WORST_PDOP {
            return None;
        }
        let (error, shaken) = (covariance * range, covariance * rate);
        let v = motion.velocity + shaken.xyz();
        let local = Local::at(&motion.place);
        let speed = (v.x * v.x + v.y * v.y).sqrt();
        let sigma = (WHITE * WHITE + CORRELATED * CORRELATED).sqrt();
        Some(Gnss {
            lat: motion.place.lat + error.x / local.north_radius,
            lon: motion.place.lon + error.y / (local.east_radius * sin_cos(motion.place.lat).1),
            alt: motion.place.alt - error.z,
            v_north: v.x,
            v_east: v.y,
            v_down: v.z,
            speed,
            course: if speed > self.slowest_course { libm::atan2(v.y, v.x) } else { f64::NAN },
            std_north: sigma * covariance[(0, 0)].sqrt(),
            std_east: sigma * covariance[(1, 1)].sqrt(),
            std_down: sigma * covariance[(2, 2)].sqrt(),
            satellites: view.len() as f64,
            pdop,
            valid: 1.0,
            ..Gnss::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_satellite_moves_as_its_velocity_says_and_stays_on_its_orbit() {
        for index in [0, 7, 29] {
            let (a, b) = (satellite(index, 99.5).0, satellite(index, 100.5).0);
            let (place, velocity) = satellite(index, 100.0);
            // Central difference over 1 s: jerk of 1e-4 m/s^3 / 24.
            assert!((b - a - velocity).norm() < 1e-4);
            assert!((place.norm() - 26_559_700.0).abs() < 1e-6);
        }
    }

    #[test]
    fn six_to_fourteen_satellites_are_in_view_at_36_deg_north_and_about_two_in_a_canyon() {
        let (here, to_ned) = earth_centred(&crate::motion::daejeon());
        let mut high = 0;
        for k in 0..720 {
            let up = |i: usize| -(to_ned * (satellite(i, f64::from(k) * 120.0).0 - here).normalize()).z;
            let seen = (0..SATELLITES).filter(|&i| up(i) > MASK_SIN).count();
            assert!((6..=14).contains(&seen), "{seen}");
            high += (0..SATELLITES).filter(|&i| up(i) > CANYON_SIN).count();
        }
        let mean = f64::from(u32::try_from(high).unwrap()) / 720.0;
        assert!((1.5..4.0).contains(&mean), "{mean}");
    }
}
