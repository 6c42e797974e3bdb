//! Two signals held against each other: how the one goes with the other, in numbers and in words.

use crate::fit::fit;

/// Correlation from which a sign is told, and from which a scale is.
const TELLS: [f64; 2] = [0.6, 0.85];
/// Scales between these are not contradicted: a car leans, and a road climbs.
const SCALES: [f64; 2] = [0.72, 1.4];

/// How what is measured goes with what is expected.
#[derive(Clone, Debug)]
pub(crate) struct Held {
    /// What it was held against, such as `d(speed)/dt`.
    pub against: String,
    /// Correlation, sign included.
    pub correlation: f64,
    /// What is measured where 1 is expected, sign included.
    pub slope: f64,
    /// Number of pairs.
    pub count: usize,
    /// Standard deviation of what is expected.
    pub spread: f64,
}

impl Held {
    /// Hold pairs of what is expected and what is measured against each other; those with NaN are passed over.
    pub fn new(against: String, pairs: &[(f64, f64)]) -> Self {
        let f = fit(&mut pairs.iter().copied());
        let spread = f.spread * (f.correlation / f.slope).abs();
        Self { against, correlation: f.correlation, slope: f.slope, count: f.count, spread }
    }

    /// The ratio of both standard deviations, with the sign of the correlation: noise in what is expected does not make it
    /// smaller.
    pub fn scale(&self) -> f64 {
        self.slope / self.correlation.abs()
    }

    /// Whether there are enough pairs that show something: what is expected spreads by `least`.
    pub fn shows(&self, count: usize, least: f64) -> bool {
        self.count >= count && self.correlation.is_finite() && self.spread > least
    }

    pub fn goes_with(&self) -> bool {
        self.correlation > TELLS[0]
    }

    pub fn is_turned(&self) -> bool {
        self.correlation < -TELLS[0]
    }

    pub fn is_scaled(&self) -> bool {
        self.correlation.abs() > TELLS[1] && !(SCALES[0]..SCALES[1]).contains(&self.scale().abs())
    }

    /// What contradicts `what` (a column and what it is read as), in one sentence.
    pub fn sentence(&self, what: &str) -> String {
        let size = self.scale().abs();
        let said = if self.is_turned() { "has the opposite sign of".into() } else { format!("is {size:.3} times") };
        let Self { against, correlation, count, .. } = self;
        format!("{what} {said} {against}: correlation {correlation:.2}, scale {size:.2} over {count} values.")
    }
}
