//! The refinement: Levenberg-Marquardt on the scalar measurement, weighted, robust against disturbed readings.

use drivescope_drive::select::median;
use nalgebra::Vector3;

use super::Kind;
use super::model::{STATES, State, corrected, scalar_jacobian, scalar_noise, shape};
use super::small::{cholesky, solve, solve_factored};

/// Refinements at most; a well-posed fit takes five to ten.
const MOST_STEPS: usize = 40;
/// Deviations beyond this many robust sigmas weigh less (Huber).
const HUBER: f64 = 2.5;

/// A normal distribution of the unknowns, known beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Mean.
    pub mean: State,
    /// 1-sigma of each.
    pub sigma: State,
}

/// A refined calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Refined {
    pub x: State,
    /// 1-sigma of each unknown, from the scatter found; 0 where it is not fitted.
    pub sigma: State,
    /// Root mean square of the corrected strength less the Earth's, uT.
    pub residual: f64,
}

/// Indices of the unknowns that are fitted.
fn fitted(kind: Kind) -> &'static [usize] {
    match kind {
        Kind::Full => &[0, 1, 2, 3, 4, 5, 6, 7, 8],
        Kind::Planar => &[0, 1, 3, 4, 6],
    }
}

/// The readings and what they are fitted to.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub readings: &'a [Vector3<f64>],
    pub strength: &'a [f64],
    pub kind: Kind,
    /// Noise of one axis, uT.
    pub noise: f64,
    pub prior: Option<Prior>,
}

impl Problem<'_> {
    /// Refine from a first step; `None` where the fit is degenerate.
    pub fn refine(&self, start: &State) -> Option<Refined> {
        let which = fitted(self.kind);
        let n = which.len();
        let (mut x, mut damping) = (*start, 1e-3);
        let mut weights = self.weights(&x);
        let mut cost = self.cost(&x, &weights);
        for _ in 0..MOST_STEPS {
            let (normal, gradient) = self.normal_equations(&x, &weights, which);
            let (mut a, mut step) = (normal, gradient);
            (0..n).for_each(|i| a[i * n + i] *= 1.0 + damping);
            solve(&mut a[..n * n], n, &mut step[..n])?;
            let mut next = x;
            which.iter().zip(&step).for_each(|(&i, s)| next[i] += s);
            let next_cost = self.cost(&next, &weights);
            if next_cost < cost {
                let done = cost - next_cost <= 1e-9 * cost;
                x = next;
                damping = (damping * 0.1).max(1e-9);
                weights = self.weights(&x);
                cost = self.cost(&x, &weights);
                if done {
                    break;
                }
            } else {
                damping *= 10.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        self.finish(x, &weights, cost, which)
    }

    /// `|B|^2 - |H|^2` less its mean, of every reading.
    fn deviations(&self, x: &State) -> impl Iterator<Item = f64> + '_ {
        let (shape, offset) = (shape(x), Vector3::new(x[0], x[1], x[2]));
        let (mean, _) = scalar_noise(&shape, &offset, self.noise);
        (self.readings.iter().zip(self.strength)).map(move |(m, s)| (shape * m - offset).norm_squared() - s * s - mean)
    }

    /// One over the variance, and less for readings far off: refreshed with the state, held within a step.
    fn weights(&self, x: &State) -> Vec<f64> {
        let off: Vec<f64> = self.deviations(x).zip(self.strength).map(|(d, s)| d / (2.0 * s)).collect();
        let mut sorted: Vec<f64> = off.iter().map(|e| e.abs()).collect();
        let scale = 1.4826 * median(&mut sorted);
        let limit = HUBER * scale.max(self.noise);
        let (shape, offset) = (shape(x), Vector3::new(x[0], x[1], x[2]));
        let (_, floor) = scalar_noise(&shape, &Vector3::zeros(), self.noise);
        let slope = 4.0 * self.noise * self.noise;
        (off.iter().zip(self.readings))
            .map(|(e, m)| {
                let variance = slope * (shape * (shape * m - offset)).norm_squared() + floor;
                (limit / e.abs().max(limit)) / variance.max(1e-12)
            })
            .collect()
    }

    fn cost(&self, x: &State, weights: &[f64]) -> f64 {
        let data: f64 = self.deviations(x).zip(weights).map(|(d, w)| w * d * d).sum();
        let known = self.prior.map_or(0.0, |p| (x - p.mean).component_div(&p.sigma).norm_squared());
        data + known
    }

    fn normal_equations(&self, x: &State, weights: &[f64], which: &[usize]) -> ([f64; 81], [f64; STATES]) {
        let n = which.len();
        let (mut normal, mut gradient) = ([0.0; 81], [0.0; STATES]);
        for ((m, w), deviation) in self.readings.iter().zip(weights).zip(self.deviations(x)) {
            let row = scalar_jacobian(m, &corrected(x, m));
            for (i, &p) in which.iter().enumerate() {
                // The deviation falls where h rises.
                gradient[i] += w * row[p] * deviation;
                for (j, &q) in which.iter().enumerate().take(i + 1) {
                    normal[i * n + j] += w * row[p] * row[q];
                }
            }
        }
        if let Some(prior) = &self.prior {
            for (i, &p) in which.iter().enumerate() {
                let weight = 1.0 / (prior.sigma[p] * prior.sigma[p]);
                normal[i * n + i] += weight;
                gradient[i] += weight * (prior.mean[p] - x[p]);
            }
        }
        (normal, gradient)
    }

    /// Sigmas from the scatter that was found, which is the surroundings' more than the sensor's.
    fn finish(&self, x: State, weights: &[f64], cost: f64, which: &[usize]) -> Option<Refined> {
        let n = which.len();
        let (mut normal, _) = self.normal_equations(&x, weights, which);
        cholesky(&mut normal[..n * n], n)?;
        let scatter = (cost / (self.readings.len() as f64 - n as f64).max(1.0)).max(1.0);
        let mut sigma = State::zeros();
        for (i, &p) in which.iter().enumerate() {
            let mut unit = [0.0; STATES];
            unit[i] = 1.0;
            solve_factored(&normal[..n * n], n, &mut unit[..n]);
            sigma[p] = (unit[i] * scatter).sqrt();
        }
        let squares = (self.readings.iter().zip(self.strength)).map(|(m, s)| (corrected(&x, m).norm() - s).powi(2));
        let residual = (squares.sum::<f64>() / self.readings.len() as f64).sqrt();
        (x.iter().all(|v| v.is_finite()) && residual.is_finite()).then_some(Refined { x, sigma, residual })
    }
}
