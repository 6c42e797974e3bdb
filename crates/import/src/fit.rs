//! Pairs of values held against each other, and the nearest of some ratios.

/// Straight line through pairs of values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit {
    /// `y` per `x`, about the means.
    pub slope: f64,
    /// Correlation.
    pub correlation: f64,
    /// Number of pairs.
    pub count: usize,
    /// Standard deviation of `y`.
    pub spread: f64,
}

/// Fit `y` on `x`; pairs with NaN are passed over.
pub(crate) fn fit(pairs: &mut dyn Iterator<Item = (f64, f64)>) -> Fit {
    let pairs: Vec<(f64, f64)> = pairs.filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let n = pairs.len() as f64;
    let mean_x = pairs.iter().map(|p| p.0).sum::<f64>() / n;
    let mean_y = pairs.iter().map(|p| p.1).sum::<f64>() / n;
    let sum = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|(x, y)| f(x - mean_x, y - mean_y)).sum::<f64>();
    let (xx, yy, xy) = (sum(&|x, _| x * x), sum(&|_, y| y * y), sum(&|x, y| x * y));
    Fit { slope: xy / xx, correlation: xy / (xx * yy).sqrt(), count: pairs.len(), spread: (yy / n).sqrt() }
}

/// The candidate whose expected ratio is nearest to `ratio` by factor, and how far it is (log of the factor).
pub(crate) fn nearest<'n>(ratio: f64, candidates: &[(&'n str, f64)]) -> (&'n str, f64) {
    let distance = |expected: f64| (ratio / expected).ln().abs();
    let best = candidates.iter().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
    best.map_or(("", f64::INFINITY), |(name, expected)| (*name, distance(*expected)))
}
