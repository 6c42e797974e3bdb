//! What a stretch of a column comes to: its spread, and the distance that a speed makes.

use crate::channel::Series;

/// Slower than this a car counts as standing, m/s: what is left is the error of the speed.
const STANDING: f64 = 0.3;

/// Number, mean, standard deviation and extremes of the values of a stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Values counted.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation about it.
    pub deviation: f64,
    /// The least.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// The spread of a column's values from `start` to `end` (s); what is not a number is left out. `None` without a value.
    pub fn of(series: &Series, index: usize, (start, end): (f64, f64)) -> Option<Self> {
        let time = series.time();
        let rows = time.partition_point(|&t| t < start)..time.partition_point(|&t| t <= end);
        let column = series.column_at(index).get(rows)?;
        let mut spread = Self { count: 0, mean: 0.0, deviation: 0.0, min: f64::INFINITY, max: f64::NEG_INFINITY };
        for &value in column.iter().filter(|v| v.is_finite()) {
            // Sum of squares about the running mean: no cancellation for a small spread about a large mean.
            spread.count += 1;
            let away = value - spread.mean;
            spread.mean += away / spread.count as f64;
            spread.deviation += away * (value - spread.mean);
            (spread.min, spread.max) = (spread.min.min(value), spread.max.max(value));
        }
        spread.deviation = (spread.deviation / spread.count as f64).sqrt();
        (spread.count > 0).then_some(spread)
    }
}

/// Distance driven since `start`, forward or backward, at `count` instants evenly from `start` to `end` (s), m.
///
/// `index` is the column of the speed. Between its values it is taken on the straight line, also across holes; before the first and after the last
/// value the car stands, and so it does below 0.3 m/s. The distances never fall.
pub fn distances(series: &Series, index: usize, (start, end): (f64, f64), count: usize) -> Vec<f64> {
    let step = (end - start) / count.saturating_sub(1).max(1) as f64;
    let mut out = Vec::with_capacity(count);
    let (mut driven, mut before): (f64, Option<(f64, f64)>) = (0.0, None);
    let due = |k: usize| start + k as f64 * step;
    let values = series.time().iter().zip(series.column_at(index)).filter(|(_, v)| v.is_finite());
    for (&time, speed) in values {
        let speed = if speed.abs() < STANDING { 0.0 } else { speed.abs() };
        let (t0, v0) = before.unwrap_or((time, speed));
        let slope = if time > t0 { (speed - v0) / (time - t0) } else { 0.0 };
        // Distance from t0 on, on the straight line of the speed.
        let along = |t: f64| (t - t0) * (v0 + 0.5 * slope * (t - t0));
        // What was driven before `start` does not count.
        let unseen = along(start.clamp(t0, time));
        while out.len() < count && due(out.len()) <= time {
            out.push(driven + (along(due(out.len()).max(t0)) - unseen).max(0.0));
        }
        driven += along(time) - unseen;
        before = Some((time, speed));
    }
    out.resize(count, driven);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::Column;

    fn series(points: &[(f64, f64)]) -> Series {
        let mut s = Series::new(&[Column::new("speed", "m/s", "Speed.")]);
        points.iter().for_each(|&(t, v)| s.push(t, &[v]).unwrap());
        s
    }

    #[test]
    fn the_spread_of_a_stretch_leaves_out_what_is_outside_and_what_is_no_number() {
        let s = series(&[(0.0, 99.0), (1.0, 1e6 + 1.0), (2.0, f64::NAN), (3.0, 1e6 + 3.0), (4.0, -99.0)]);
        let found = Spread::of(&s, 0, (1.0, 3.0)).unwrap();
        assert_eq!((found.count, found.mean, found.deviation), (2, 1e6 + 2.0, 1.0));
        assert_eq!((found.min, found.max), (1e6 + 1.0, 1e6 + 3.0));
        assert_eq!(Spread::of(&s, 0, (1.5, 2.5)), None);
        assert_eq!(Spread::of(&s, 0, (3.0, 1.0)), None, "a stretch that ends before it begins");
    }

    #[test]
    fn distance_grows_with_the_speed_and_stands_still_with_the_car() {
        // 2 s up to 10 m/s, 2 s at it, 2 s down to rest, 2 s of noise about rest, 2 s backward at 1 m/s.
        let s = series(&[
            (0.0, 0.0),
            (2.0, 10.0),
            (4.0, 10.0),
            (6.0, 0.0),
            (6.1, 0.2),
            (8.0, -0.2),
            (8.001, -1.0),
            (10.0, -1.0),
        ]);
        let driven = distances(&s, 0, (0.0, 10.0), 11);
        for (k, expected) in [0.0, 2.5, 10.0, 20.0, 30.0, 37.5, 40.0, 40.0, 40.0, 41.0, 42.0].into_iter().enumerate() {
            assert!((driven[k] - expected).abs() < 2e-3, "{k} s: {}", driven[k]);
        }
        assert!(driven.windows(2).all(|w| w[1] >= w[0]));
        // A part of it counts from its own start; beyond the ends nothing is driven.
        let part = distances(&s, 0, (3.0, 5.0), 3);
        assert!(
            (part[0], (part[1] - 10.0).abs() < 1e-9, (part[2] - 17.5).abs() < 1e-9) == (0.0, true, true),
            "{part:?}"
        );
        assert_eq!(distances(&s, 0, (20.0, 30.0), 3), [0.0; 3]);
        assert_eq!(distances(&series(&[]), 0, (0.0, 1.0), 2), [0.0; 2]);
        // A hole is bridged.
        let holed = series(&[(0.0, 10.0), (1.0, f64::NAN), (10.0, 10.0)]);
        assert!((distances(&holed, 0, (0.0, 10.0), 3)[1] - 50.0).abs() < 1e-9);
    }
}
