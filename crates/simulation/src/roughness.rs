//! Roughness of the road under the left and the right wheels: random profiles of the classes of ISO 8608.

use serde::Serialize;

use crate::math::smooth_step;
use crate::rng::Rng;

/// Classes of ISO 8608, by the geometric mean of the displacement spectrum at 0.1 cycles/m.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Class {
    /// Very good: new motorway, 16e-6 m^3.
    A,
    /// Good: city street, 64e-6 m^3.
    B,
    /// Average: worn street, 256e-6 m^3.
    C,
    /// Poor: 1024e-6 m^3.
    D,
}

impl Class {
    /// Displacement spectrum at 0.1 cycles/m, m^3, one-sided.
    pub fn spectrum(self) -> f64 {
        match self {
            Self::A => 16e-6,
            Self::B => 64e-6,
            Self::C => 256e-6,
            Self::D => 1024e-6,
        }
    }
}

/// Distance between nodes, m.
const GRID: f64 = 0.1;
/// The tyre's patch and the wheel's own mass smooth the profile over this many nodes.
const SMOOTHED: usize = 5;
/// Waves longer than this belong to the road's grade, m.
const LONGEST: f64 = 60.0;
/// The two tracks differ in waves shorter than this, m.
const LONGEST_DIFFERENCE: f64 = 8.0;
/// The road starts even and becomes rough from here, m, over [`FADE`] m.
const EVEN: f64 = 5.0;
const FADE: f64 = 20.0;
/// The profile begins this far before the road, m.
const BEFORE: f64 = 50.0;

/// Heights of the two tracks along the road.
#[derive(Clone, Debug)]
pub struct Roughness {
    /// Left and right height at each node, m, upward.
    tracks: [Vec<f64>; 2],
}

/// White slope through a first-order high pass, node by node: heights whose spectrum falls with the wave number squared.
fn profile(count: usize, spectrum: f64, longest: f64, rng: &mut Rng) -> Vec<f64> {
    // A flat one-sided slope spectrum (2 pi n0)^2 G(n0) up to the Nyquist wave number 1 / (2 GRID).
    let wave = std::f64::consts::TAU * 0.1;
    let sigma = wave * (spectrum / (2.0 * GRID)).sqrt();
    let keep = libm::exp(-std::f64::consts::TAU * GRID / longest);
    let mut height = 0.0;
    let raw: Vec<f64> = (0..count + SMOOTHED)
        .map(|_| {
            height = keep * height + sigma * GRID * rng.normal();
            height
        })
        .collect();
    raw.windows(SMOOTHED).map(|w| w.iter().sum::<f64>() / SMOOTHED as f64).take(count).collect()
}

impl Roughness {
    /// Profiles of a class over a road of this length, m. The same road is rough in the same way for every seed.
    pub fn new(class: Class, length: f64, name: &str) -> Self {
        let count = ((length + 2.0 * BEFORE) / GRID) as usize + 2;
        let mut rng = Rng::new(0, name);
        let common = profile(count, class.spectrum(), LONGEST, &mut rng);
        let difference = profile(count, class.spectrum(), LONGEST_DIFFERENCE, &mut rng);
        let track = |sign: f64| {
            let fade = |k: usize| smooth_step((k as f64 * GRID - BEFORE - EVEN) / FADE);
            // Common and difference part each carry half of the variance where both are present.
            let of = |k: usize| fade(k) * (common[k] + sign * difference[k]) * std::f64::consts::FRAC_1_SQRT_2;
            (0..count).map(of).collect()
        };
        Self { tracks: [track(1.0), track(-1.0)] }
    }

    /// Height, m, and slope of a track (0 left, 1 right) at a place along the road.
    pub fn at(&self, track: usize, s: f64) -> (f64, f64) {
        let nodes = &self.tracks[track];
        let at = ((s + BEFORE) / GRID).clamp(0.0, (nodes.len() - 1) as f64 - 1e-6);
        let index = at as usize;
        let rise = nodes[index + 1] - nodes[index];
        (nodes[index] + rise * (at - index as f64), rise / GRID)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_a_wheelbase_apart_differ_as_the_class_says() {
        let rough = Roughness::new(Class::B, 50_000.0, "test");
        let lag = 2.8;
        let n = 100_000;
        let mean: f64 = (0..n)
            .map(|k| {
                let s = 30.0 + f64::from(k) * 0.49;
                (rough.at(0, s + lag).0 - rough.at(0, s).0).powi(2) / f64::from(n)
            })
            .sum();
        // Structure function of a random walk: half the slope spectrum times the lag, less what smoothing (0.25 m) and
        // the high passes (a few per cent common, 1 - (1 - e^-x)/x with x = 2.2 of the difference) take away.
        let walk = 0.5 * (std::f64::consts::TAU * 0.1).powi(2) * 64e-6 * (lag - 0.5 / 3.0);
        assert!((0.6..1.0).contains(&(mean / walk)), "{mean} against {walk}");
    }

    #[test]
    fn the_road_starts_even() {
        let rough = Roughness::new(Class::D, 100.0, "test");
        assert!([-3.0, 0.0, 4.5].iter().all(|&s| rough.at(0, s) == (0.0, 0.0) && rough.at(1, s) == (0.0, 0.0)));
        assert_ne!(rough.at(0, 60.0), rough.at(1, 60.0));
    }
}
