//! Vibration felt by an inertial sensor beyond the rigid body's motion: road and engine.
//!
//! Road: band-limited noise round the wheels' resonance (12 Hz), without any part at zero frequency, so that it neither
//! moves nor turns the car; its level grows with speed. Engine: a tone at the second order of its speed, averaged over
//! the sample. Levels chosen so that the mean change of the specific force's size from sample to sample lies among
//! recorded drives: 0.17 m/s^2 at 5 to 10 m/s and 0.37 at 30 m/s, where the RAV4 of comma2k19 shows 0.42 and 0.40.

use nalgebra::Vector3;

use crate::math::sin_cos;
use crate::rng::Rng;

/// Resonance of wheel on tyre, rad/s, and its damping.
const RESONANCE: f64 = 75.4;
const DAMPING: f64 = 0.35;
/// Road vibration at 20 m/s, 1-sigma: ahead, right, down in m/s^2; about the same axes in rad/s.
const ROAD_FORCE: [f64; 3] = [0.22, 0.22, 0.38];
const ROAD_RATE: [f64; 3] = [0.015, 0.015, 0.004];
/// Engine vibration: amplitude at idle, m/s^2, and how much it grows per rad/s above idle.
const ENGINE_IDLE: f64 = 0.010;
const ENGINE_GROWTH: f64 = 1.5e-4;
const IDLE: f64 = 80.0;

/// State of the vibration at one sensor.
#[derive(Clone, Debug)]
pub struct Vibration {
    filter: Filter,
    band: [Band; 6],
    phase: f64,
    step: f64,
    rng: Rng,
}

impl Vibration {
    /// Vibration sampled every `step` s.
    pub fn new(step: f64, seed: u64) -> Self {
        Self {
            filter: Filter::new(step),
            band: [Band::default(); 6],
            phase: 0.0,
            step,
            rng: Rng::new(seed, "vibration"),
        }
    }

    /// Specific force (m/s^2) and turn rate (rad/s) of the next sample, at a speed (m/s) and an engine speed (rad/s).
    pub fn next(&mut self, speed: f64, engine_speed: f64) -> (Vector3<f64>, Vector3<f64>) {
        let level = (speed.abs() / 20.0).sqrt() * (speed.abs() / 0.5).min(1.0);
        let mut noise = [0.0; 6];
        for (value, band) in noise.iter_mut().zip(&mut self.band) {
            *value = level * band.next(&self.filter, self.rng.normal());
        }
        let before = self.phase;
        let turn = 2.0 * engine_speed * self.step;
        self.phase = (before + turn) % std::f64::consts::TAU;
        let tone = (sin_cos(before + turn).0 - sin_cos(before).0) / turn;
        let engine = tone * (ENGINE_IDLE + ENGINE_GROWTH * (engine_speed - IDLE).max(0.0));
        let force = Vector3::from(ROAD_FORCE).component_mul(&Vector3::new(noise[0], noise[1], noise[2]));
        let rate = Vector3::from(ROAD_RATE).component_mul(&Vector3::new(noise[3], noise[4], noise[5]));
        (force + Vector3::new(0.4, 0.4, 1.0) * engine, rate)
    }
}

/// Coefficients of a band-pass of second order with unit output variance for unit white input.
#[derive(Clone, Copy, Debug)]
struct Filter {
    back: [f64; 2],
    gain: f64,
}

impl Filter {
    fn new(step: f64) -> Self {
        let radius = libm::exp(-DAMPING * RESONANCE * step);
        let angle = RESONANCE * (1.0 - DAMPING * DAMPING).sqrt() * step;
        let (a1, a2) = (2.0 * radius * sin_cos(angle).1, -radius * radius);
        // Autocovariances of the all-pole part; its difference over two samples has the variance 2 (r0 - r2).
        let r0 = 1.0 / ((1.0 + a2) / (1.0 - a2) * ((1.0 - a2) * (1.0 - a2) - a1 * a1));
        let r1 = a1 / (1.0 - a2) * r0;
        let r2 = a1 * r1 + a2 * r0;
        Self { back: [a1, a2], gain: 1.0 / (2.0 * (r0 - r2)).sqrt() }
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Band {
    output: [f64; 2],
    input: [f64; 2],
}

impl Band {
    fn next(&mut self, filter: &Filter, white: f64) -> f64 {
        let [a1, a2] = filter.back;
        let output = a1 * self.output[0] + a2 * self.output[1] + filter.gain * (white - self.input[1]);
        self.output = [output, self.output[0]];
        self.input = [white, self.input[0]];
        output
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_band_has_unit_spread_and_no_mean() {
        let (filter, mut band) = (Filter::new(0.01), Band::default());
        let mut rng = Rng::new(3, "band");
        let values: Vec<f64> = (0..100_000).map(|_| band.next(&filter, rng.normal())).collect();
        let n = values.len() as f64;
        let variance = values.iter().map(|v| v * v).sum::<f64>() / n;
        // About 26 independent values a second: 26,000 values leave 0.9 %; four of them.
        assert!((variance - 1.0).abs() < 0.035, "{variance}");
        // The zero at zero frequency leaves a mean of the order 1/n, not 1/sqrt(n) = 3e-3.
        assert!((values.iter().sum::<f64>() / n).abs() < 2e-4);
    }

    #[test]
    fn a_standing_car_feels_the_idling_engine_only() {
        let mut vibration = Vibration::new(0.01, 1);
        for _ in 0..1000 {
            let (force, rate) = vibration.next(0.0, IDLE);
            assert!(force.amax() <= ENGINE_IDLE && rate == Vector3::zeros());
        }
    }
}
