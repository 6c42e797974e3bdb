//! How late one signal is against another.

use super::gnss::Motion;
use super::linear::Normal;
use super::scene::{Field, STEP};

/// Furthest lag that is looked at, bins.
const FURTHEST: i32 = 5;

/// How late one signal is, s, with its 1-sigma and the correlation there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lag {
    pub late: f64,
    pub sigma: f64,
    pub correlation: f64,
}

/// Correlation of `y` with `x` as many bins later.
pub(crate) fn correlation(x: &[f64], y: &[f64], shift: i32) -> f64 {
    let mut s = [0.0; 6];
    for (i, &b) in y.iter().enumerate() {
        let Some(&a) = usize::try_from(i as i64 + i64::from(shift)).ok().and_then(|k| x.get(k)) else { continue };
        if a.is_finite() && b.is_finite() {
            for (sum, v) in s.iter_mut().zip([1.0, a, b, a * a, b * b, a * b]) {
                *sum += v;
            }
        }
    }
    let [n, x, y, xx, yy, xy] = s;
    if n < 50.0 { 0.0 } else { (xy - x * y / n) / ((xx - x * x / n) * (yy - y * y / n)).max(1e-300).sqrt() }
}

/// How much later `x` shows what `y` shows, both on the grid and equally smooth over `smooth` s.
pub(crate) fn lag(x: &[f64], y: &[f64], smooth: f64) -> Option<Lag> {
    let table: Vec<f64> = (-FURTHEST..=FURTHEST).map(|k| correlation(x, y, k)).collect();
    let best = (1..table.len() - 1).max_by(|a, b| table[*a].abs().total_cmp(&table[*b].abs()))?;
    let sign = table[best].signum();
    let [before, at, after] = [best - 1, best, best + 1].map(|k| sign * table[k]);
    let bend = 2.0 * at - before - after;
    if bend <= 0.0 || at < 0.5 {
        return None;
    }
    let part = (0.5 * (after - before) / bend).clamp(-1.0, 1.0);
    let free = (y.iter().filter(|v| v.is_finite()).count() as f64 * STEP / smooth).max(1.0);
    let sigma = ((1.0 - at * at).max(1e-6) / free / (bend / (STEP * STEP))).sqrt();
    Some(Lag { late: STEP * (best as f64 - f64::from(FURTHEST) + part), sigma, correlation: sign * at })
}

/// Where a sensor sits ahead of the rear axle, m, and how the rear tyres give way, s^2/m: of an ordinary car.
const AHEAD: f64 = 1.4;
const GIVING: f64 = 0.0025;

/// By how much the course differs from the heading at a turn rate and a speed, rad.
pub(crate) fn sideslip(rate: f64, speed: f64) -> f64 {
    rate * (AHEAD / speed.max(1.0) - GIVING * speed)
}

/// How late fixes are against a yaw rate (rad/s) and a fast speed: the delay at which both explain the fixes best.
pub(crate) fn of_fixes(motion: &Motion, rate: Option<&Field>, speed: Option<(&Field, f64)>) -> Option<Lag> {
    const TRIES: usize = 41;
    let delay = |k: usize| -0.6 + 0.04 * k as f64;
    let cost = |k: usize| {
        let (mut turn, mut change) = (Normal::default(), Normal::default());
        for i in motion.intervals(delay(k)) {
            let span = i.to - i.from;
            if let Some(rate) = rate {
                let slip = |t: f64, v: f64| sideslip(rate.mean(t - 0.15, t + 0.15), v);
                let half = 0.5 * i.accel * span;
                let slipped = slip(i.to, i.speed + half) - slip(i.from, i.speed - half);
                turn.add(&[rate.mean(i.from, i.to) * span, span], i.turn - slipped);
            }
            if let Some((speed, late)) = speed {
                change.add(&[speed.at(i.to + late) - speed.at(i.from + late)], i.accel * span);
            }
        }
        // Beside noise, a course is off by what the sideslip is not known to.
        let part = |n: &Normal, terms: usize, floor: f64| {
            let f = n.solve(terms);
            if f.count < 15.0 { 0.0 } else { 0.5 * f.count * (f.residual * f.residual + floor * floor).ln() }
        };
        part(&turn, 2, 6e-3) + part(&change, 1, 2e-2)
    };
    let costs: Vec<f64> = (0..TRIES).map(cost).collect();
    let best = (1..TRIES - 1).min_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
    // A parabola over two tries to each side.
    let reach = 2.min(best).min(TRIES - 1 - best);
    let (before, at, after) = (costs[best - reach], costs[best], costs[best + reach]);
    let width = 0.04 * reach as f64;
    let bend = (before + after - 2.0 * at) / (width * width);
    if bend <= 0.0 || costs.iter().all(|c| *c == 0.0) {
        return None;
    }
    let part = (0.5 * (before - after) / (before + after - 2.0 * at)).clamp(-1.0, 1.0);
    Some(Lag { late: delay(best) + part * width, sigma: 1.0 / bend.sqrt(), correlation: 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_between_bins_is_found() {
        let wave = |t: f64| (0.7 * t).sin() + 0.5 * (1.9 * t + 1.0).cos();
        let y: Vec<f64> = (0..900).map(|i| wave(0.1 * f64::from(i))).collect();
        let x: Vec<f64> = (0..900).map(|i| -3.0 * wave(0.1 * f64::from(i) - 0.137)).collect();
        let found = lag(&x, &y, 1.0).unwrap();
        assert!((found.late - 0.137).abs() < 0.004 && found.correlation < -0.99, "{found:?}");
    }
}
