//! How good and how honest a run was: errors against truth, coverage of the stated sigmas, consistency of innovations.
//!
//! The schema says what to compare: `truth` names the truth signal of a column, `sigma_of` the column a sigma belongs to,
//! `nis` the degrees of freedom of a normalized innovation squared. Truth is looked up by time, see [`mod@reference`].
//! Rows where estimate or truth has no value are left out, column by column.

pub mod change;
pub mod errors;
pub mod labels;
pub mod mode;
pub mod reference;

use drivescope_drive::channel::{Column, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::radii;

use crate::chi_square::quantile;
use mode::ModeScore;
use reference::TruthTable;

/// How far a sigma may be off (as a factor) before a statistically significant inconsistency is called one.
///
/// With tens of thousands of innovations the 95 % band is narrower than 1 %; no sensor's sigma is known that well.
pub const SIGMA_TOLERANCE: f64 = 1.2;

/// The errors of one column against truth.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Metric {
    /// The column.
    pub column: String,
    /// Its unit, and that of every error here.
    pub unit: String,
    /// The truth signal it was compared with.
    pub truth: String,
    /// Rows compared.
    pub count: usize,
    /// Root mean square error.
    pub rmse: f64,
    /// Mean error, estimate less truth; of an angle that goes round, about its circular mean.
    pub bias: f64,
    /// Largest absolute error.
    pub max: f64,
    /// Root mean square error once `bias` is removed.
    pub rmse_centred: f64,
    /// Pearson's correlation with truth; NaN where either is constant.
    pub correlation: f64,
    /// Share of rows with an absolute error of at most 3 sigma; `None` without sigmas.
    pub coverage: Option<f64>,
    /// Mean of (error / sigma) squared, 1 for an honest sigma; `None` without sigmas.
    pub nees: Option<f64>,
}

/// What the mean normalized innovation squared says of the stated noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The mean is inside its band, or the sigma is off by less than [`SIGMA_TOLERANCE`].
    Consistent,
    /// Innovations are smaller than stated: sigmas too large.
    Cautious,
    /// Innovations are larger than stated: sigmas too small.
    Optimistic,
}

/// Consistency of one innovation sequence.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Consistency {
    /// The column of normalized innovations squared.
    pub column: String,
    /// Degrees of freedom of one value.
    pub dof: u32,
    /// Values.
    pub count: usize,
    /// Mean per degree of freedom: 1 for a consistent filter.
    pub mean: f64,
    /// Share of values inside the two-sided 95 % band of one chi-square value.
    pub inside: f64,
    /// Independent values that the sequence is worth: `count (1 - r) / (1 + r)`, `r` its correlation at lag 1 if positive.
    pub effective: f64,
    /// Two-sided 95 % band of `mean` for `effective` values.
    pub band: (f64, f64),
    /// What follows.
    pub verdict: Verdict,
    /// `sqrt(mean)`: multiply the sensor's sigma by this to match (exact where the sensor's noise dominates).
    pub sigma_factor: f64,
}

/// Position error in metres.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PositionScore {
    /// Rows compared.
    pub count: usize,
    /// Root mean square of the horizontal distance from truth.
    pub rmse_horizontal: f64,
    /// Median of the horizontal distance.
    pub median: f64,
    /// Its 95th percentile.
    pub p95: f64,
    /// Its largest value.
    pub max: f64,
    /// Its last value.
    pub last: f64,
    /// Root mean square of the vertical error, where both have a height.
    pub rmse_vertical: Option<f64>,
}

/// Everything that can be said of a run without an opinion.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Score {
    /// Errors, in the order of the estimate's columns; empty where the drive has no truth.
    pub metrics: Vec<Metric>,
    /// Innovations, in the order of the estimate's columns.
    pub consistency: Vec<Consistency>,
    /// Position error, for estimates of position.
    pub position: Option<PositionScore>,
    /// Decisions, for estimates of the motion mode.
    pub mode: Option<ModeScore>,
}

/// Score an estimate against a drive's truth and against its own statistics, over rows with time inside `window` (s,
/// both ends included; `None` is everything).
///
/// Local positions are compared with truth's latitude, longitude and height in the frame at `drive.start().origin`,
/// because truth's own north and east may count from elsewhere; see [`TruthTable`].
pub fn score(estimate: &Series, drive: &Drive, window: Option<(f64, f64)>) -> Score {
    let (from, to) = window.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let first = estimate.time().partition_point(|&t| t < from);
    let rows = Rows { series: estimate, first, end: estimate.time().partition_point(|&t| t <= to).max(first) };
    let mut truths = TruthTable::new(drive, &estimate.time()[rows.first..rows.end]);
    let mut out = Score::default();
    for (index, column) in estimate.schema().iter().enumerate() {
        if let Some(dof) = column.nis {
            out.consistency.extend(consistency(column, dof, rows.column(index)));
        }
        let Some(name) = column.truth else { continue };
        let Some(truth) = truths.get(name) else { continue };
        if name == "mode" {
            out.mode = ModeScore::new(rows.time(), rows.column(index), truth);
        } else {
            let sigma = estimate.schema().iter().position(|c| c.sigma_of == Some(column.name));
            out.metrics.extend(metric(column, rows.column(index), truth, sigma.map(|i| rows.column(i))));
        }
    }
    out.position = position(&rows, &mut truths);
    out
}

/// The rows of a series between two indices.
struct Rows<'a> {
    series: &'a Series,
    first: usize,
    end: usize,
}

impl<'a> Rows<'a> {
    fn column(&self, index: usize) -> &'a [f64] {
        &self.series.column_at(index)[self.first..self.end]
    }
    fn time(&self) -> &'a [f64] {
        &self.series.time()[self.first..self.end]
    }
    fn estimate_of(&self, truth: &str) -> Option<&'a [f64]> {
        self.series.schema().iter().position(|c| c.truth == Some(truth)).map(|i| self.column(i))
    }
}

fn metric(column: &Column, estimate: &[f64], truth: &[f64], sigma: Option<&[f64]>) -> Option<Metric> {
    let circular = column.is_circular();
    let mut errors = Vec::with_capacity(estimate.len());
    let mut reference = Vec::with_capacity(estimate.len());
    let (mut within, mut ratio2, mut with_sigma) = (0usize, 0.0, 0usize);
    for (row, (&value, &true_value)) in estimate.iter().zip(truth).enumerate() {
        let error = value - true_value;
        if !error.is_finite() {
            continue;
        }
        let error = if circular { wrap_angle(error) } else { error };
        // An angle that goes round is followed through its jumps, so that correlation means something.
        let reference_value = match reference.last() {
            Some(&last) if circular => last + wrap_angle(true_value - last),
            _ => true_value,
        };
        errors.push(error);
        reference.push(reference_value);
        if let Some(sigma) = sigma.map(|s| s[row]).filter(|s| *s > 0.0 && s.is_finite()) {
            let ratio = error / sigma;
            within += usize::from(ratio.abs() <= 3.0);
            ratio2 += ratio * ratio;
            with_sigma += 1;
        }
    }
    if errors.is_empty() {
        return None;
    }
    let max = errors.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    let (bias, rmse_centred) = spread(&errors, circular && max > std::f64::consts::FRAC_PI_2);
    let share = |sum: f64| (with_sigma > 0).then(|| sum / with_sigma as f64);
    Some(Metric {
        column: column.name.into(),
        unit: column.unit.into(),
        truth: column.truth.unwrap_or_default().into(),
        count: errors.len(),
        rmse: mean(errors.iter().map(|e| e * e)).sqrt(),
        bias,
        max,
        rmse_centred,
        correlation: correlation(&reference, &errors),
        coverage: share(within as f64),
        nees: share(ratio2),
    })
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// Mean of the errors and root mean square about it; `round` errors are angles that reach both sides of half a turn.
fn spread(errors: &[f64], round: bool) -> (f64, f64) {
    if !round {
        let bias = mean(errors.iter().copied());
        return (bias, mean(errors.iter().map(|e| (e - bias).powi(2))).sqrt());
    }
    let centre = mean(errors.iter().map(|e| e.sin())).atan2(mean(errors.iter().map(|e| e.cos())));
    let offset = mean(errors.iter().map(|e| wrap_angle(e - centre)));
    let spread = mean(errors.iter().map(|e| (wrap_angle(e - centre) - offset).powi(2))).sqrt();
    (wrap_angle(centre + offset), spread)
}

/// Pearson's correlation of `truth` and `truth + error`; NaN where either is constant.
fn correlation(truth: &[f64], errors: &[f64]) -> f64 {
    if truth.iter().all(|v| *v == truth[0]) {
        return f64::NAN;
    }
    let mean_truth = mean(truth.iter().copied());
    let mean_estimate = mean_truth + mean(errors.iter().copied());
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (t, e) in truth.iter().zip(errors) {
        let (x, y) = (t - mean_truth, t + e - mean_estimate);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    // Of two square roots: the product of the sums may underflow where each does not.
    xy / (xx.sqrt() * yy.sqrt())
}

fn consistency(column: &Column, dof: u32, values: &[f64]) -> Option<Consistency> {
    let values: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if values.is_empty() || dof == 0 {
        return None;
    }
    let (count, per_value) = (values.len(), f64::from(dof));
    let centre = mean(values.iter().copied());
    let variance: f64 = values.iter().map(|v| (v - centre).powi(2)).sum();
    let lagged: f64 = values.windows(2).map(|w| (w[0] - centre) * (w[1] - centre)).sum();
    let correlation = if variance > 0.0 { (lagged / variance).clamp(0.0, 0.999) } else { 0.0 };
    let effective = (count as f64 * (1.0 - correlation) / (1.0 + correlation)).max(1.0);
    let total = effective * per_value;
    let band = mean_band(total);
    let one = quantile(0.025, per_value)..=quantile(0.975, per_value);
    let mean = centre / per_value;
    let sigma_factor = mean.sqrt();
    let verdict = if mean > band.1 && sigma_factor > SIGMA_TOLERANCE {
        Verdict::Optimistic
    } else if mean < band.0 && sigma_factor < 1.0 / SIGMA_TOLERANCE {
        Verdict::Cautious
    } else {
        Verdict::Consistent
    };
    let inside = values.iter().filter(|v| one.contains(v)).count() as f64 / count as f64;
    Some(Consistency { column: column.name.into(), dof, count, mean, inside, effective, band, verdict, sigma_factor })
}

/// Two-sided 95 % band of a chi-square variable over its degrees of freedom; above 1000 by Wilson and Hilferty's cube,
/// which is then right to 1e-5.
fn mean_band(dof: f64) -> (f64, f64) {
    if dof <= 1000.0 {
        return (quantile(0.025, dof) / dof, quantile(0.975, dof) / dof);
    }
    let variance = 2.0 / (9.0 * dof);
    let cube = |z: f64| (1.0 - variance + z * variance.sqrt()).powi(3);
    (cube(-1.959_963_985), cube(1.959_963_985))
}

fn position(rows: &Rows, truths: &mut TruthTable) -> Option<PositionScore> {
    let mut offsets = |name: &str| -> Option<(&[f64], Vec<f64>)> {
        let estimate = rows.estimate_of(name)?;
        Some((estimate, truths.get(name)?.to_vec()))
    };
    let difference = |(a, b): (&[f64], Vec<f64>)| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
    let (north, east, vertical) = if let (Some(n), Some(e)) = (offsets("n"), offsets("e")) {
        (difference(n), difference(e), offsets("d").map(difference))
    } else {
        let (lat, lon) = (offsets("lat")?, offsets("lon")?);
        let scale: Vec<(f64, f64)> = lat.1.iter().map(|&l| (radii(l).0, radii(l).1 * l.cos())).collect();
        let north = difference(lat).iter().zip(&scale).map(|(d, s)| d * s.0).collect();
        let east = difference(lon).iter().zip(&scale).map(|(d, s)| wrap_angle(*d) * s.1).collect();
        (north, east, offsets("alt").map(difference))
    };
    let mut distances: Vec<f64> = north.iter().zip(&east).map(|(n, e)| (n * n + e * e).sqrt()).collect();
    distances.retain(|d| d.is_finite());
    let count = distances.len();
    let last = *distances.last()?;
    let rmse_horizontal = mean(distances.iter().map(|d| d * d)).sqrt();
    let rmse_vertical = vertical.and_then(|mut v| {
        v.retain(|d| d.is_finite());
        (!v.is_empty()).then(|| mean(v.iter().map(|d| d * d)).sqrt())
    });
    let max = distances.iter().fold(0.0, |m: f64, d| m.max(*d));
    let mut nth = |share: f64| {
        let index = (share * (count - 1) as f64).round() as usize;
        drivescope_drive::select::nth(&mut distances, index)
    };
    Some(PositionScore { count, rmse_horizontal, median: nth(0.5), p95: nth(0.95), max, last, rmse_vertical })
}

#[cfg(test)]
mod tests;
