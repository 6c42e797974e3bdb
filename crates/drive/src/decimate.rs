//! Columns cut down to what a plot can show: least and greatest value per pixel, on one grid for all columns.

use crate::channel::Series;

/// A time window cut into equal buckets; every bucket gives two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Start of the window, s.
    pub start: f64,
    /// End of the window, s.
    pub end: f64,
    /// Number of buckets, at least one.
    pub buckets: usize,
}

impl Grid {
    /// Times of the points: a quarter and three quarters into each bucket.
    pub fn times(&self) -> Vec<f64> {
        let step = (self.end - self.start) / (2.0 * self.buckets as f64);
        (0..2 * self.buckets).map(|i| self.start + (i as f64 + 0.5) * step).collect()
    }

    /// Two values per bucket of one column: its extremes in the order in which they occur.
    ///
    /// A bucket without a sample takes the straight line between its neighbours (short way round for a circular column),
    /// unless they are further apart than `max_gap` seconds: then, and where samples are NaN, the points are NaN.
    /// A staircase (`is_step`) holds the last value instead.
    pub fn extremes(&self, series: &Series, index: usize, max_gap: f64, is_step: bool) -> Vec<f64> {
        let time = series.time();
        let column = series.column_at(index);
        let step = (self.end - self.start) / self.buckets as f64;
        let times = self.times();
        let mut out = Vec::with_capacity(2 * self.buckets);
        let mut row = time.partition_point(|&t| t < self.start);
        for bucket in 0..self.buckets {
            let until = self.start + (bucket + 1) as f64 * step;
            let first = row;
            let (mut low, mut high) = (usize::MAX, usize::MAX);
            while row < time.len() && time[row] < until {
                let value = column[row];
                if value.is_finite() {
                    if low == usize::MAX || value < column[low] {
                        low = row;
                    }
                    if high == usize::MAX || value > column[high] {
                        high = row;
                    }
                }
                row += 1;
            }
            if low != usize::MAX {
                out.push(column[low.min(high)]);
                out.push(column[low.max(high)]);
            } else if row > first {
                out.extend([f64::NAN; 2]);
            } else if is_step {
                let held = row.checked_sub(1).filter(|&r| row < time.len() && time[row] - time[r] <= max_gap);
                out.extend([held.map_or(f64::NAN, |r| column[r]); 2]);
            } else {
                out.extend(times[2 * bucket..2 * bucket + 2].iter().map(|&t| series.interpolate(index, t, max_gap)));
            }
        }
        out
    }
}

/// Rows of a window for a table: at most `most`, evenly spaced, each as time and the named columns (NaN where unknown).
pub fn sample_rows(series: &Series, columns: &[&str], window: (f64, f64), most: usize) -> Vec<f64> {
    let time = series.time();
    let first = time.partition_point(|&t| t < window.0);
    let last = time.partition_point(|&t| t <= window.1);
    let stride = (last - first).div_ceil(most.max(1)).max(1);
    let columns: Vec<Option<&[f64]>> = columns.iter().map(|name| series.column(name)).collect();
    let mut out = Vec::new();
    for row in (first..last).step_by(stride) {
        out.push(time[row]);
        out.extend(columns.iter().map(|c| c.map_or(f64::NAN, |c| c[row])));
    }
    out
}

/// A gap worth showing in a series: five times its median step, and no less than a fifth of a second.
pub fn visible_gap(series: &Series) -> f64 {
    let time = series.time();
    let stride = (time.len() / 1000).max(1);
    let mut steps: Vec<f64> = time.windows(2).step_by(stride).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() {
        return f64::INFINITY;
    }
    (5.0 * crate::select::median(&mut steps)).max(0.2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::Column;

    fn series(points: &[(f64, f64)]) -> Series {
        let mut s = Series::new(&[Column::new("x", "m", "X.")]);
        points.iter().for_each(|&(t, v)| s.push(t, &[v]).unwrap());
        s
    }

    #[test]
    fn a_spike_survives_any_reduction() {
        let points: Vec<_> = (0..10_000).map(|k| (f64::from(k), if k == 7777 { 9.0 } else { 0.0 })).collect();
        let grid = Grid { start: 0.0, end: 10_000.0, buckets: 10 };
        let out = grid.extremes(&series(&points), 0, 5.0, false);
        assert_eq!(out.len(), 20);
        assert_eq!(out[14..16], [0.0, 9.0], "in the order in which they occur");
    }

    #[test]
    fn zoomed_in_the_points_lie_on_the_line_between_samples_and_holes_stay_open() {
        let s = series(&[(0.0, 0.0), (1.0, 1.0), (50.0, 0.0)]);
        let grid = Grid { start: 0.0, end: 2.0, buckets: 16 };
        let out = grid.extremes(&s, 0, 5.0, false);
        let times = grid.times();
        assert!((out[7] - times[7]).abs() < 1e-12);
        assert!(out[30].is_nan());
        assert_eq!(grid.extremes(&s, 0, 100.0, true)[31], 1.0);
    }

    #[test]
    fn a_table_has_at_most_the_rows_asked_for_and_a_gap_for_an_unknown_column() {
        let s = series(&[(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]);
        let rows = sample_rows(&s, &["x", "y"], (0.5, 3.0), 2);
        assert_eq!((rows[0], rows[1], rows[3], rows[4]), (1.0, 1.0, 3.0, 3.0));
        assert!(rows[2].is_nan() && rows.len() == 6);
    }

    #[test]
    fn nan_samples_are_gaps_not_lines() {
        let s = series(&[(0.0, 0.0), (1.0, f64::NAN), (2.0, 2.0)]);
        let out = Grid { start: 0.0, end: 3.0, buckets: 3 }.extremes(&s, 0, 5.0, false);
        assert!(out[2].is_nan() && out[3].is_nan());
    }
}
