//! What the sensors make of the true motion.

pub mod car;
pub mod disk;
pub mod imu;
pub mod mag;
pub mod magnetic;
pub mod position;
pub mod ring;
pub mod satellites;
pub mod suite;
pub mod vibration;

/// Round to a resolution; 0 leaves the value as it is.
pub(crate) fn quantized(value: f64, resolution: f64) -> f64 {
    if resolution > 0.0 { libm::rint(value / resolution) * resolution } else { value }
}

/// First-order Gauss-Markov process with a stationary start.
#[derive(Clone, Debug)]
pub(crate) struct GaussMarkov {
    value: f64,
    sigma: f64,
    keep: f64,
    renew: f64,
}

impl GaussMarkov {
    /// A process of the given 1-sigma and correlation time, sampled every `step` s.
    pub(crate) fn new(sigma: f64, correlation_time: f64, step: f64, rng: &mut crate::rng::Rng) -> Self {
        let keep = libm::exp(-step / correlation_time);
        Self { value: sigma * rng.normal(), sigma, keep, renew: (1.0 - keep * keep).sqrt() }
    }
    /// The value one step later.
    pub(crate) fn next(&mut self, rng: &mut crate::rng::Rng) -> f64 {
        self.value = self.keep * self.value + self.renew * self.sigma * rng.normal();
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    #[test]
    fn a_gauss_markov_process_keeps_its_spread_and_forgets_at_its_time() {
        let mut rng = Rng::new(1, "gm");
        let mut process = GaussMarkov::new(2.0, 10.0, 1.0, &mut rng);
        let values: Vec<f64> = (0..200_000).map(|_| process.next(&mut rng)).collect();
        let mean = |lag: usize| -> f64 {
            values.windows(lag + 1).map(|w| w[0] * w[lag]).sum::<f64>() / (values.len() - lag) as f64
        };
        // 20,000 correlation times / 2 leave about 1.4 % on the variance; four of them.
        assert!((mean(0) / 4.0 - 1.0).abs() < 0.06, "{}", mean(0));
        assert!((mean(10) / mean(0) - (-1_f64).exp()).abs() < 0.05);
    }

    #[test]
    fn quantizing_rounds_to_the_nearest_step() {
        assert_eq!(quantized(0.26, 0.1), 0.1 * 3.0);
        assert_eq!(quantized(0.123, 0.0), 0.123);
    }
}
