//! How late the wheel speed comes, from the drive itself.
//!
//! The change of the wheel speed over a window is the mean of the forward accelerometer over the same window, but for
//! gravity along the slope and the sensor's bias, which are slow. Both, with what is slower than a few seconds taken off,
//! are correlated at every delay; the largest correlation is at the delay of the wheel speed against the accelerometer.
//! A wheel that drives or brakes turns faster or slower than the car moves, by speed times slip: that looks like a lead of
//! up to 0.1 s at 20 m/s. So the correlation is a multiple one: the change of speed times force, speeding up and braking,
//! is fitted beside the force, with what tyres ordinarily give as prior.
//! Source: SPEC slope 6 (a delay makes a false slope of delay times jerk over gravity); the fit is ours.
//! Not told apart: a late wheel speed and an early accelerometer. A car that hardly accelerates tells nothing, and one that
//! does so at one speed only tells little: the slip is then taken for a delay.

use drivescope_drive::channel::{Channel, OutOfOrder};
use drivescope_drive::drive::Drive;
use nalgebra::{Matrix3, Vector3};

/// Step of the common grid, s.
const STEP: f64 = 0.01;
/// Half the window over which the speed changes, in steps.
const HALF_WINDOW: usize = 12;
/// Half the window that smooths everything alike, in steps: noise in the slip's signals would hide it.
const HALF_SMOOTH: usize = 8;
/// Every so many steps make a row: neighbours share nearly all of a window.
const STRIDE: usize = 4;
/// Rows that share one window: so many neighbours count as one.
const SHARED_ROWS: f64 = (2 * (HALF_WINDOW + HALF_SMOOTH) / STRIDE) as f64;
/// Delays are tried in steps of so many first.
const COARSE: usize = 4;
/// Half the window whose mean is taken off, in steps.
const HALF_SLOW: usize = 200;
/// Largest delay looked for, in steps.
const LONGEST: usize = 50;
/// Below this speed wheel pulses are sparse, m/s.
const SLOWEST: f64 = 1.5;
/// A wider hole between samples is not bridged, s.
const WIDEST_GAP: f64 = 0.15;
/// The smallest correlation that counts as a finding.
const SMALLEST_CORRELATION: f64 = 0.4;
/// The largest standard deviation of the delay that counts as a finding, s.
const LARGEST_SIGMA: f64 = 0.02;

/// Slip of the wheels that are measured per specific force, 1/(m/s^2), speeding up and braking, and how uncertain that is:
/// tyres give 0.005 where the force is shared like the load; an undriven axle has none when speeding up.
const SLIP: [(f64, f64); 2] = [(0.0, 0.0015), (0.0015, 0.0015)];

/// A delay that was found.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct WheelLatency {
    /// How much later than the accelerometer the wheel speed comes, s; negative if it is earlier.
    pub delay: f64,
    /// 1-sigma of it, from what does not fit, s.
    pub sigma: f64,
    /// Multiple correlation of the two accelerations at this delay.
    pub correlation: f64,
}

/// A delay from which on it is worth a word, s.
const NOTABLE: f64 = 0.02;

impl WheelLatency {
    /// Whether it is large enough and clear enough, at three sigmas, to be corrected.
    pub fn is_notable(&self) -> bool {
        self.delay >= NOTABLE && self.delay >= 3.0 * self.sigma
    }
}

/// Values on the common grid, linear between samples; NaN outside and across holes.
fn on_grid(samples: impl Iterator<Item = (f64, f64)>, start: f64, count: usize) -> Vec<f64> {
    let mut out = vec![f64::NAN; count];
    let mut before: Option<(f64, f64)> = None;
    for (t, v) in samples.filter(|s| s.1.is_finite()) {
        if let Some((t0, v0)) = before.filter(|b| t - b.0 <= WIDEST_GAP) {
            let first = ((t0 - start) / STEP).ceil().max(0.0) as usize;
            let end = (((t - start) / STEP).floor() + 1.0).clamp(0.0, count as f64) as usize;
            for (k, cell) in out.iter_mut().enumerate().take(end).skip(first) {
                *cell = v0 + (v - v0) * (start + k as f64 * STEP - t0) / (t - t0);
            }
        }
        before = Some((t, v));
    }
    out
}

/// Mean over `half` steps to both sides; NaN where a value is missing.
fn moving_mean(values: &[f64], half: usize) -> Vec<f64> {
    let (mut sum, mut holes) = (0.0, 0usize);
    let mut out = vec![f64::NAN; values.len()];
    let width = 2 * half + 1;
    let mut tally = |value: f64, add: bool| {
        match (value.is_nan(), add) {
            (true, true) => holes += 1,
            (true, false) => holes -= 1,
            (false, true) => sum += value,
            (false, false) => sum -= value,
        }
        if holes == 0 { sum } else { f64::NAN }
    };
    for k in 0..values.len() {
        let total = tally(values[k], true);
        if k + 1 >= width {
            out[k - half] = total / width as f64;
            tally(values[k + 1 - width], false);
        }
    }
    out
}

/// What is left when the slow part is taken off.
fn without_slow(values: &[f64]) -> Vec<f64> {
    let slow = moving_mean(values, HALF_SLOW);
    values.iter().zip(&slow).map(|(v, s)| v - s).collect()
}

/// Difference of the ends of the window over its length; NaN where one is missing.
fn rate(values: &[f64]) -> Vec<f64> {
    let end = |k: usize| values.get(k).copied().unwrap_or(f64::NAN);
    let start = |k: usize| k.checked_sub(HALF_WINDOW).map_or(f64::NAN, |i| values[i]);
    (0..values.len()).map(|k| (end(k + HALF_WINDOW) - start(k)) / (2.0 * HALF_WINDOW as f64 * STEP)).collect()
}

/// How well the wheels' acceleration follows from the accelerometer at one delay.
#[derive(Clone, Copy)]
struct Fit {
    /// Rows in which everything has a value.
    count: f64,
    /// Share of the wheels' acceleration squared that is explained.
    explained: f64,
}

/// Least squares of `wheel[k + shift]` on the accelerometer's signals at `k`.
fn fit(wheel: &[f64], signals: &[Vec<f64>; 3], shift: isize) -> Fit {
    let (w0, s0) = if shift >= 0 { (shift as usize, 0) } else { (0, shift.unsigned_abs()) };
    let (mut count, mut yy) = (0.0, 0.0);
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let rows = wheel.len() - w0.max(s0);
    let [a, b, c] = signals.each_ref().map(|s| &s[s0..s0 + rows]);
    for k in (0..rows).step_by(STRIDE) {
        let (y, row) = (wheel[w0 + k], Vector3::new(a[k], b[k], c[k]));
        if (y + row.sum()).is_nan() {
            continue;
        }
        count += 1.0;
        yy += y * y;
        normal += row * row.transpose();
        right += row * y;
    }
    let solve = |normal: &Matrix3<f64>, right: &Vector3<f64>| normal.cholesky().map(|f| right.dot(&f.solve(right)));
    // The slip's prior counts as much as rows of this variance: neighbours within a window are one row.
    let plain = normal + Matrix3::identity() * (1e-9 * normal.trace());
    let variance = (yy - solve(&plain, &right).unwrap_or(0.0)).max(0.0) / count * SHARED_ROWS;
    let mut total = yy;
    for (k, (slip, sigma)) in SLIP.into_iter().enumerate() {
        let weight = variance / (sigma * sigma);
        normal[(k + 1, k + 1)] += weight;
        right[k + 1] += weight * slip;
        total += weight * slip * slip;
    }
    let explained = solve(&normal, &right).map_or(f64::NAN, |sum| 1.0 - (total - sum) / yy);
    Fit { count, explained: if explained.is_finite() { explained } else { 0.0 } }
}

/// What the wheels show and what the accelerometer says of it, on the common grid.
fn signals(drive: &Drive, start: f64, count: usize) -> (Vec<f64>, [Vec<f64>; 3]) {
    let speed = on_grid(drive.wheels.iter().map(|(t, w)| (t, w.forward_speed())), start, count);
    let force = on_grid(drive.imu.iter().map(|(t, s)| (t, s.accel_x)), start, count);
    let moving: Vec<f64> = speed.iter().map(|v| if v.abs() >= SLOWEST { *v } else { f64::NAN }).collect();
    let felt = moving_mean(&without_slow(&force), HALF_SMOOTH);
    let slip = |sign: f64| {
        // A comparison drops a NaN: what is missing stays missing.
        let one_way = |a: f64| if a.is_nan() || a * sign > 0.0 { a } else { 0.0 };
        let product: Vec<f64> = speed.iter().zip(&felt).map(|(v, a)| v * one_way(*a)).collect();
        without_slow(&rate(&product))
    };
    let smooth = |values: &[f64]| moving_mean(&without_slow(values), HALF_SMOOTH);
    (smooth(&rate(&moving)), [smooth(&moving_mean(&force, HALF_WINDOW)), slip(1.0), slip(-1.0)])
}

/// The delay of the wheel speed against the forward accelerometer; `None` where the drive does not tell, and where the
/// wheels seem early by more than two sigmas, which is slip rather than a clock.
pub fn find_wheel_latency(drive: &Drive) -> Option<WheelLatency> {
    let (start, end) = drive.span()?;
    let count = ((end - start) / STEP) as usize + 1;
    if !(4 * HALF_SLOW..=100_000_000).contains(&count) {
        return None;
    }
    let (wheel, signals) = signals(drive, start, count);
    let longest = LONGEST as isize;
    let at = |shift: isize| fit(&wheel, &signals, shift);
    let best_of = |from: isize, to: isize, step: usize| {
        let tried = (from..=to).step_by(step).map(|shift| (shift, at(shift).explained));
        tried.max_by(|a, b| a.1.total_cmp(&b.1)).map(|best| best.0)
    };
    let coarse = best_of(-longest, longest, COARSE)?;
    let best = best_of(coarse - COARSE as isize, coarse + COARSE as isize, 1)?;
    if best.abs() >= longest {
        return None;
    }
    let [before, peak, after] = [best - 1, best, best + 1].map(at);
    let bend = before.explained - 2.0 * peak.explained + after.explained;
    let aside = if bend < 0.0 { 0.5 * (before.explained - after.explained) / bend } else { 0.0 };
    // Residual variance over curvature, for as many independent rows as there are windows.
    let independent = peak.count / SHARED_ROWS;
    let sigma = STEP * (2.0 * (1.0 - peak.explained).max(0.0) / (-bend * independent)).sqrt();
    let found = WheelLatency { delay: (best as f64 + aside) * STEP, sigma, correlation: peak.explained.sqrt() };
    let is_clear = found.correlation >= SMALLEST_CORRELATION && found.sigma <= LARGEST_SIGMA;
    (is_clear && found.delay >= -2.0 * found.sigma).then_some(found)
}

/// The drive with its wheel speeds `delay` s earlier: what was late comes at its own time.
///
/// # Errors
/// [`OutOfOrder`] when `delay` is not finite.
pub fn with_earlier_wheels(drive: &Drive, delay: f64) -> Result<Drive, OutOfOrder> {
    let mut wheels = Channel::default();
    wheels.reserve(drive.wheels.len());
    drive.wheels.iter().try_for_each(|(time, sample)| wheels.push(time - delay, sample))?;
    Ok(Drive { wheels, ..drive.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::signals::{Imu, Wheels};

    /// A car that speeds up and slows down on a road with slow hills; the wheels slip by a share of force and come late.
    fn drive(late: f64, slip: f64) -> Drive {
        let mut drive = Drive::default();
        let force = |t: f64| 1.2 * (0.7 * t).sin() + 0.8 * (1.9 * t + 1.0).sin();
        let speed =
            |t: f64| 12.0 - 1.2 / 0.7 * (0.7 * t).cos() - 0.8 / 1.9 * (1.9 * t + 1.0).cos() + 6.0 * (0.05 * t).sin();
        for k in 0..12_000 {
            let t = f64::from(k) * 0.01;
            // The hills and the slow change of speed, 0.3 m/s^2, are felt too.
            let accel_x =
                force(t) + 0.3 * (0.05 * t).cos() + 0.5 * (0.1 * t).sin() + 0.005 * f64::from(k * 7919 % 101 - 50);
            drive.imu.push(t, Imu { accel_x, ..Imu::default() }).unwrap();
            let then = t - late;
            let turned = speed(then) * (1.0 + slip * force(then));
            drive.wheels.push(t, Wheels { speed: turned, ..Wheels::default() }).unwrap();
        }
        drive
    }

    #[test]
    fn a_delay_is_found_to_ten_milliseconds_whether_the_wheels_slip_or_not() {
        // Ten milliseconds by the issue; without the slip's terms a slip of 0.003 would shift it by 12 m/s x 0.003 = 36 ms.
        for (late, slip) in [(0.0, 0.0), (0.05, 0.0), (0.1, 0.0), (0.05, 0.003)] {
            let found = find_wheel_latency(&drive(late, slip)).unwrap();
            assert!((found.delay - late).abs() < 0.01, "{late} s, slip {slip}: {found:?}");
            assert!(found.correlation > 0.9 && found.sigma < 0.01, "{found:?}");
        }
    }

    #[test]
    fn the_corrected_drive_has_no_delay_left() {
        let late = drive(0.08, 0.0);
        let corrected = with_earlier_wheels(&late, find_wheel_latency(&late).unwrap().delay).unwrap();
        assert!(find_wheel_latency(&corrected).unwrap().delay.abs() < 2e-3);
        assert!(with_earlier_wheels(&late, f64::NAN).is_err());
    }

    #[test]
    fn a_drive_that_tells_nothing_gives_nothing() {
        assert!(find_wheel_latency(&Drive::default()).is_none());
        let mut steady = Drive::default();
        for k in 0..6000 {
            let t = f64::from(k) * 0.01;
            let noise = f64::from(k * 7919 % 101 - 50);
            steady.imu.push(t, Imu { accel_x: 0.01 * noise, ..Imu::default() }).unwrap();
            steady
                .wheels
                .push(t, Wheels { speed: 20.0 + 1e-3 * f64::from(k * 6007 % 97), ..Wheels::default() })
                .unwrap();
        }
        assert!(find_wheel_latency(&steady).is_none());
    }
}
