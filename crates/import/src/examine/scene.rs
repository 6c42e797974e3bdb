//! A table on a common clock: means over tenths of a second, and the single samples of slow columns.

use crate::clock::median;
use crate::table::Table;

/// Width of a bin, s.
pub(crate) const STEP: f64 = 0.1;
/// Most bins that are looked at: 100 minutes.
const LONGEST: usize = 60_000;
/// Most bins of all columns together: the wider a table, the less of it is looked at. 100 MB.
const MOST: usize = 4_000_000;
/// Values with more time between them are samples of their own, s.
const FAST: f64 = 0.15;
/// Longest time between samples that is bridged by a straight line: of fast and of slow columns, s.
const BRIDGE: [f64; 2] = [0.5, 3.0];

/// One column as it runs over time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Field {
    /// Value in each bin; NaN where there is none near.
    pub grid: Vec<f64>,
    /// Sum of the bins before each, for means over any time; and how many of them are blank.
    sums: Vec<(f64, u32)>,
    /// Single samples `(time, value)`, where they are further apart than a bin.
    pub events: Vec<(f64, f64)>,
    /// Median time between two samples, s; NaN for fewer than two.
    pub period: f64,
    /// Least and largest value.
    pub range: [f64; 2],
    /// Number of values.
    pub count: usize,
    /// Samples are repeated until the next one comes.
    pub held: bool,
}

/// All columns of a table on one clock.
#[derive(Debug)]
pub(crate) struct Scene {
    /// Fields, in the order of the table's columns; empty ones of columns that are passed over.
    pub fields: Vec<Field>,
}

impl Scene {
    /// Lay the columns of `table` out over the time of each row (NaN or earlier than before: passed over).
    pub fn new(table: &Table, time: &[f64], skip: &dyn Fn(usize) -> bool) -> Self {
        let start = time.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0);
        let end = time.iter().copied().filter(|t| t.is_finite()).fold(start, f64::max);
        let wide = (0..table.columns.len()).filter(|i| !skip(*i)).count().max(1);
        let bins = (((end - start) / STEP) as usize).min(LONGEST.min(MOST / wide)) + 1;
        let mut rows = Vec::with_capacity(time.len().min(u32::MAX as usize));
        let mut latest = f64::NEG_INFINITY;
        for (row, &t) in time.iter().enumerate() {
            if t > latest {
                rows.push((row, t - start));
                latest = t;
            }
        }
        rows.truncate(rows.partition_point(|(_, t)| *t < bins as f64 * STEP));
        let column = |(i, c): (usize, &crate::table::RawColumn)| {
            if skip(i) { Field::default() } else { Field::new(&c.values, &rows, bins) }
        };
        Self { fields: table.columns.iter().enumerate().map(column).collect() }
    }
}

impl Field {
    fn new(values: &[f64], rows: &[(usize, f64)], bins: usize) -> Self {
        let samples: Vec<(f64, f64)> =
            rows.iter().map(|(row, t)| (*t, values[*row])).filter(|(_, v)| v.is_finite()).collect();
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        samples.iter().for_each(|(_, v)| range = [range[0].min(*v), range[1].max(*v)]);
        let count = samples.len();
        let mut period = period(&samples);
        let mut events = Vec::new();
        let held = released(&samples, period);
        let is_held = held.is_some();
        if let Some(list) = held {
            period = self::period(&list);
            events = list;
        } else if period > FAST {
            events = samples.clone();
        }
        let mut grid = vec![f64::NAN; bins];
        if events.is_empty() {
            average(&samples, &mut grid);
            bridge(&mut grid, (BRIDGE[0] / STEP) as usize);
        } else {
            connect(&events, &mut grid);
        }
        let sums = sums(&grid);
        Self { grid, sums, events, period, range, count, held: is_held }
    }

    /// A field of a signal that was made on the grid.
    pub fn made(grid: Vec<f64>) -> Self {
        let sums = sums(&grid);
        let count = grid.iter().filter(|v| v.is_finite()).count();
        Self { grid, sums, period: STEP, count, ..Self::default() }
    }

    pub fn is_fast(&self) -> bool {
        self.period <= FAST && self.events.is_empty()
    }

    pub fn is_constant(&self) -> bool {
        self.range[0] >= self.range[1]
    }

    /// Mean from one time to another, both counted from the start; NaN where a bin is blank.
    pub fn mean(&self, from: f64, to: f64) -> f64 {
        match (self.integral(from), self.integral(to)) {
            (Some(a), Some(b)) if a.1 == b.1 && to > from => (b.0 - a.0) / (to - from),
            _ => f64::NAN,
        }
    }

    /// Integral from the start to a time, and the number of blank bins before it.
    fn integral(&self, time: f64) -> Option<(f64, u32)> {
        let place = time / STEP;
        if place.is_nan() || place < 0.0 || place >= self.grid.len() as f64 {
            return None;
        }
        let bin = place as usize;
        let (sum, blanks) = self.sums[bin];
        let part = place - bin as f64;
        let value = self.grid[bin];
        Some((STEP * (sum + if value.is_finite() { part * value } else { 0.0 }), blanks))
    }

    /// Value at a time, counted from the start, on the straight line between the middles of bins.
    pub fn at(&self, time: f64) -> f64 {
        let place = time / STEP - 0.5;
        if place.is_nan() || place < 0.0 || place + 1.0 >= self.grid.len() as f64 {
            return f64::NAN;
        }
        let (bin, part) = (place as usize, place.fract());
        self.grid[bin] * (1.0 - part) + self.grid[bin + 1] * part
    }
}

/// Rate of change of a signal on the grid by the straight line over `2 * reach + 1` bins around each, per second.
pub(crate) fn slope(grid: &[f64], reach: usize) -> Vec<f64> {
    let n = grid.len();
    let weight: f64 = (1..=reach).map(|k| 2.0 * (k * k) as f64).sum::<f64>() * STEP;
    let one = |i: usize| {
        if i < reach || i + reach >= n {
            return f64::NAN;
        }
        (1..=reach).map(|k| k as f64 * (grid[i + k] - grid[i - k])).sum::<f64>() / weight
    };
    (0..n).map(one).collect()
}

/// Sum of the bins before each, and the number of blank ones.
fn sums(grid: &[f64]) -> Vec<(f64, u32)> {
    let mut sums = Vec::with_capacity(grid.len() + 1);
    let mut sum = (0.0, 0);
    sums.push(sum);
    for v in grid {
        sum = if v.is_finite() { (sum.0 + v, sum.1) } else { (sum.0, sum.1 + 1) };
        sums.push(sum);
    }
    sums
}

fn period(samples: &[(f64, f64)]) -> f64 {
    let stride = 1 + samples.len() / 20_000;
    median(samples.windows(2).step_by(stride).map(|w| w[1].0 - w[0].0).filter(|s| *s > 0.0).collect())
}

/// The samples that a logger repeats until the next one comes; `None` where it does not.
fn released(samples: &[(f64, f64)], period: f64) -> Option<Vec<(f64, f64)>> {
    let mut changes: Vec<(f64, f64)> = samples.windows(2).filter(|w| w[0].1 != w[1].1).map(|w| w[1]).collect();
    if changes.len() < 8 || 3 * changes.len() > samples.len() {
        return None;
    }
    let steps: Vec<f64> = changes.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let usual = median(steps.clone());
    // A multiple of the usual step, up to a row.
    let fits =
        |s: &f64| (s / usual).round() >= 1.0 && (s - usual * (s / usual).round()).abs() < 0.1 * usual + 1.01 * period;
    let regular = steps.iter().filter(|s| fits(s)).count();
    let single = steps.iter().filter(|s| (*s / usual - 1.0).abs() < 0.2).count();
    if usual < 3.5 * period || 10 * regular < 9 * steps.len() || 2 * single < steps.len() {
        return None;
    }
    // A value that stays is a sample too.
    let mut out = Vec::with_capacity(changes.len());
    changes.push((samples[samples.len() - 1].0 + 0.5 * usual, f64::NAN));
    for w in changes.windows(2) {
        let mut t = w[0].0;
        while t < w[1].0 - 0.5 * usual {
            out.push((t, w[0].1));
            t += usual;
        }
    }
    Some(out)
}

fn average(samples: &[(f64, f64)], grid: &mut [f64]) {
    let mut counts = vec![0_u32; grid.len()];
    for (t, v) in samples {
        // 0.3 / 0.1 is a little below 3.
        let bin = ((t / STEP + 1e-6) as usize).min(grid.len() - 1);
        grid[bin] = if counts[bin] == 0 { *v } else { grid[bin] + v };
        counts[bin] += 1;
    }
    for (v, n) in grid.iter_mut().zip(counts).filter(|(_, n)| *n > 1) {
        *v /= f64::from(n);
    }
}

/// Straight lines over at most `longest` blanks.
fn bridge(grid: &mut [f64], longest: usize) {
    let mut last: Option<usize> = None;
    for i in 0..grid.len() {
        if !grid[i].is_finite() {
            continue;
        }
        if let Some(from) = last.filter(|from| i - from > 1 && i - from <= longest) {
            let slope = (grid[i] - grid[from]) / (i - from) as f64;
            for k in from + 1..i {
                grid[k] = grid[from] + slope * (k - from) as f64;
            }
        }
        last = Some(i);
    }
}

/// Straight lines between samples.
fn connect(events: &[(f64, f64)], grid: &mut [f64]) {
    for w in events.windows(2).filter(|w| w[1].0 - w[0].0 <= BRIDGE[1]) {
        let (first, last) = ((w[0].0 / STEP - 0.5).ceil().max(0.0) as usize, (w[1].0 / STEP - 0.5).floor() as usize);
        for (bin, value) in grid.iter_mut().enumerate().take(last + 1).skip(first) {
            let part = ((bin as f64 + 0.5) * STEP - w[0].0) / (w[1].0 - w[0].0);
            *value = w[0].1 + part * (w[1].1 - w[0].1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(values: &[f64], step: f64) -> Field {
        let rows: Vec<(usize, f64)> = (0..values.len()).map(|i| (i, i as f64 * step)).collect();
        let bins = (values.len() as f64 * step / STEP) as usize + 1;
        Field::new(values, &rows, bins)
    }

    #[test]
    fn means_and_slopes_are_those_of_the_samples() {
        let values: Vec<f64> = (0..1000).map(|i| 0.02 * f64::from(i)).collect();
        let f = field(&values, 0.01);
        assert!(f.is_fast() && !f.held);
        // A sample stands for the hundredth of a second that it begins, hence half a sample below 2 t.
        assert!((f.mean(2.0, 4.0) - 5.99).abs() < 1e-9, "{}", f.mean(2.0, 4.0));
        assert!((slope(&f.grid, 3)[50] - 2.0).abs() < 1e-9);
        assert!((f.at(3.05) - 6.09).abs() < 1e-9, "{}", f.at(3.05));
    }

    #[test]
    fn values_that_are_repeated_become_single_samples() {
        let values: Vec<f64> = (0..3000).map(|i| if i / 100 < 12 { 5.0 } else { f64::from(i / 100) }).collect();
        let f = field(&values, 0.01);
        assert!(f.held && (f.period - 1.0).abs() < 1e-9, "{} {}", f.held, f.period);
        assert_eq!(f.events.iter().find(|e| e.1 == 20.0).map(|e| (e.0 * 100.0).round()), Some(2000.0));
    }
}
