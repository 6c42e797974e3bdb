//! Least squares of the wheels' acceleration on a few signals at every delay, with what is known of the coefficients.

use super::{LONGEST, SHARED_ROWS, STEP};

/// Signals that are fitted.
pub(super) const SIGNALS: usize = 6;
/// Delays are tried in steps of so many.
const TRIED_STEP: usize = 4;
/// Delays that are tried.
pub(super) const TRIED: usize = 2 * LONGEST / TRIED_STEP + 1;

/// A value and its 1-sigma.
pub(super) type Prior = (f64, f64);
type Row = [f64; SIGNALS];

/// The delay that is tried as number `tried`, in steps from the shortest.
pub(super) fn step_of(tried: usize) -> usize {
    tried * TRIED_STEP
}

/// Sums over rows.
#[derive(Clone)]
pub(super) struct Sums {
    count: f64,
    normal: [Row; SIGNALS],
    /// By delay: the signals times the wheels' acceleration, and its square.
    right: Vec<(Row, f64)>,
}

/// The delay at which most is explained.
pub(super) struct Peak {
    /// Delay, s.
    pub(super) delay: f64,
    /// 1-sigma of it from the residuals and the bend of the peak, s.
    pub(super) sigma: f64,
    /// Share of the wheels' acceleration squared that is explained.
    pub(super) explained: f64,
}

/// The solution of `a x = b` for `a` symmetric and not negative; 0 where nothing tells.
fn solve(mut a: [Row; SIGNALS], mut b: Row) -> Row {
    for k in 0..SIGNALS {
        if a[k][k] <= 0.0 {
            continue;
        }
        let pivot = a[k];
        for i in k + 1..SIGNALS {
            let share = a[i][k] / pivot[k];
            (k..SIGNALS).for_each(|j| a[i][j] -= share * pivot[j]);
            b[i] -= share * b[k];
        }
    }
    let mut x = [0.0; SIGNALS];
    for k in (0..SIGNALS).rev() {
        let rest: f64 = (k + 1..SIGNALS).map(|j| a[k][j] * x[j]).sum();
        x[k] = if a[k][k] > 0.0 { (b[k] - rest) / a[k][k] } else { 0.0 };
    }
    x
}

fn dot(a: &Row, b: &Row) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Sums {
    /// No rows, for so many delays.
    pub(super) fn new(tried: usize) -> Self {
        Self { count: 0.0, normal: [[0.0; SIGNALS]; SIGNALS], right: vec![([0.0; SIGNALS], 0.0); tried] }
    }

    /// Add a row of signals and the wheels' acceleration at every delay, unless something is missing.
    pub(super) fn add(&mut self, row: &Row, wheel: impl Fn(usize) -> f64) {
        if !(wheel(0) + row.iter().sum::<f64>()).is_finite() {
            return;
        }
        self.count += 1.0;
        for (sums, a) in self.normal.iter_mut().zip(row) {
            sums.iter_mut().zip(row).for_each(|(sum, b)| *sum += a * b);
        }
        for (tried, (right, square)) in self.right.iter_mut().enumerate() {
            let y = wheel(tried);
            *square += y * y;
            right.iter_mut().zip(row).for_each(|(sum, a)| *sum += a * y);
        }
    }

    /// With the rows of `other`.
    pub(super) fn more(&self, other: &Self) -> Self {
        self.with(other, 1.0)
    }

    /// Without the rows of `other`.
    pub(super) fn less(&self, other: &Self) -> Self {
        self.with(other, -1.0)
    }

    fn with(&self, other: &Self, sign: f64) -> Self {
        let mut out = self.clone();
        out.count += sign * other.count;
        let add = |a: &mut Row, b: &Row| a.iter_mut().zip(b).for_each(|(a, b)| *a += sign * b);
        out.normal.iter_mut().zip(&other.normal).for_each(|(a, b)| add(a, b));
        for (a, b) in out.right.iter_mut().zip(&other.right) {
            add(&mut a.0, &b.0);
            a.1 += sign * b.1;
        }
        out
    }

    /// Variance of what is left of one independent row at a delay: neighbours within a window are one row.
    fn variance(&self, (right, square): &(Row, f64)) -> f64 {
        (square - dot(right, &solve(self.normal, *right))).max(0.0) / self.count.max(1.0) * SHARED_ROWS
    }

    /// The first two coefficients at the first delay, with 1-sigma.
    pub(super) fn first_two(&self) -> [Prior; 2] {
        let variance = self.variance(&self.right[0]);
        let x = solve(self.normal, self.right[0].0);
        [0, 1].map(|k| {
            let unit = std::array::from_fn(|i| f64::from(i == k));
            (x[k], (variance * solve(self.normal, unit)[k]).sqrt())
        })
    }

    /// The delay at which the signals, their coefficients near what is known of them, explain most.
    pub(super) fn peak(&self, priors: &[Prior; SIGNALS]) -> Option<Peak> {
        let variance = self.right.iter().map(|right| self.variance(right)).fold(f64::MAX, f64::min);
        let (mut normal, mut aside, mut total) = (self.normal, [0.0; SIGNALS], 0.0);
        for (k, (mean, sigma)) in priors.iter().enumerate() {
            let weight = variance / (sigma * sigma);
            normal[k][k] += weight;
            aside[k] = weight * mean;
            total += weight * mean * mean;
        }
        let explained = |(right, square): &(Row, f64)| {
            let right: Row = std::array::from_fn(|k| right[k] + aside[k]);
            (dot(&right, &solve(normal, right)) - total) / square
        };
        let all: Vec<f64> = self.right.iter().map(explained).collect();
        let best = (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b]))?;
        let (before, peak, after) = (all.get(best.checked_sub(1)?)?, all[best], all.get(best + 1)?);
        let bend = before - 2.0 * peak + after;
        let grid = TRIED_STEP as f64 * STEP;
        let delay = (best as f64 + 0.5 * (before - after) / bend) * grid - LONGEST as f64 * STEP;
        // Residual variance over curvature, for as many independent rows as there are windows.
        let sigma = grid * (2.0 * (1.0 - peak).max(0.0) / (-bend * self.count / SHARED_ROWS)).sqrt();
        (delay + sigma).is_finite().then_some(Peak { delay, sigma, explained: peak })
    }
}
