//! How late the wheel speed comes, from the drive itself.
//!
//! The change of the wheel speed over a window is the mean of the forward accelerometer over the same window, but for
//! gravity along the slope and the sensor's bias. Both, with what is slower than a few seconds taken off, are correlated
//! at every delay; the largest correlation is at the delay of the wheel speed against the accelerometer.
//! What else makes the two differ would shift it, and is fitted beside the force:
//! - A wheel that drives or brakes turns faster or slower than the car moves, by speed times slip: that looks like a lead
//!   of up to 0.2 s at 20 m/s. Where all four wheels are measured, the axles' difference tells which of them drives and
//!   how much its tyres slip, and so what the speed's own wheels are to be expected to slip.
//! - The body pitches: gravity along it goes by the pitch gyro, and the sensor above the springs swings forward and back.
//! - In a curve a sensor before the rear axle feels yaw rate squared, and sideslip adds lateral force squared.
//!
//! Source: SPEC slope 6 (a delay makes a false slope of delay times jerk over gravity); the fit is ours.
//! Not told apart: a late wheel speed and an early accelerometer. A car that hardly accelerates tells nothing, and one that
//! does so at one speed only tells little, as slip is the same as a delay there: the standard deviation covers that, and
//! what it leaves beyond `LARGEST_SIGMA` is no finding.

mod fit;

use drivescope_drive::channel::{Channel, OutOfOrder};
use drivescope_drive::drive::Drive;
use drivescope_drive::signals::{Imu, Wheels};

use fit::{Prior, SIGNALS, Sums, TRIED};

/// Step of the common grid, s.
const STEP: f64 = 0.01;
/// Half the window over which the speed changes, in steps.
const HALF_WINDOW: usize = 12;
/// Half the window that smooths everything alike, in steps: noise in the slip's signals would hide it.
const HALF_SMOOTH: usize = 24;
/// Every so many steps make a row: neighbours share nearly all of a window.
const STRIDE: usize = 8;
/// So many neighbours count as one row: half of those that share a window, as what is left varies faster than the window.
/// Over seven simulated drives with nine seeds each the errors are then 1.1 sigma, rms.
const SHARED_ROWS: f64 = (HALF_WINDOW + HALF_SMOOTH) as f64 / STRIDE as f64;
/// Half the window whose mean is taken off, in steps.
const HALF_SLOW: usize = 200;
/// Largest delay looked for, in steps.
const LONGEST: usize = 50;
/// Below this speed wheel pulses are sparse, m/s.
const SLOWEST: f64 = 1.5;
/// A wider hole between samples is not bridged, s.
const WIDEST_GAP: f64 = 0.15;
/// Stretches of the drive that are left out in turn, to see whether they agree.
const STRETCHES: usize = 8;
/// The smallest correlation that counts as a finding: below it what is not modelled, rough roads above all, has its say.
const SMALLEST_CORRELATION: f64 = 0.99;
/// The largest standard deviation of the delay that counts as a finding, s.
const LARGEST_SIGMA: f64 = 0.005;
/// Gravity, m/s^2.
const GRAVITY: f64 = 9.80665;
/// Specific force that a rolling car loses to rolling resistance, m/s^2, and to the air over speed squared, 1/m.
const DRAG: (f64, f64) = (0.12, 4e-4);

/// What is known of each signal's coefficient before: force, slip per specific force when driving and when braking in
/// 1/(m/s^2) (an undriven axle has none, a driven one 0.009), the sensor's distance before the rear axle in m, sideslip per
/// lateral force in 1/(m/s^2), and the sensor's height over the springs' centre in m.
const PRIORS: [Prior; SIGNALS] = [(1.0, 0.05), (0.002, 0.003), (0.002, 0.002), (0.0, 2.0), (0.005, 0.005), (0.0, 0.5)];
/// The least difference of the axles' slip that tells which of them drives, 1/(m/s^2), and in its own sigmas.
const DRIVEN: (f64, f64) = (0.001, 4.0);
/// How uncertain the undriven axle's slip is: 1/(m/s^2) when driving, as a share when braking (loads of the axles).
const UNDRIVEN: (f64, f64) = (0.0003, 0.15);

/// A delay that was found.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct WheelLatency {
    /// How much later than the accelerometer the wheel speed comes, s; negative if it is earlier.
    pub delay: f64,
    /// 1-sigma of it, the larger of what does not fit and of how the drive's stretches differ, s.
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

/// Without what is slow, smoothed.
fn smooth(values: &[f64]) -> Vec<f64> {
    moving_mean(&without_slow(values), HALF_SMOOTH)
}

/// What the wheels show and what it may follow from, on the common grid.
struct Model {
    /// The wheels' acceleration.
    wheel: Vec<f64>,
    /// The accelerometer's force without gravity's share, and what is fitted beside it.
    signals: [Vec<f64>; SIGNALS],
    /// The front axle's acceleration and that of the forward speed, both less that of the rear axle.
    over_rear: [Vec<f64>; 2],
    /// What makes such a difference without slip: a delay between the two, and a curve.
    aside: [Vec<f64>; 2],
}

/// Integral over time; a missing value stays missing and adds nothing.
fn integral(values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut add = |v: &f64| {
        if v.is_nan() {
            return f64::NAN;
        }
        sum += v * STEP;
        sum
    };
    values.iter().map(&mut add).collect()
}

/// Value by value; shorter names than iterators in the formulas below.
fn zip(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| f(*a, *b)).collect()
}

impl Model {
    fn new(drive: &Drive, start: f64, count: usize) -> Self {
        let felt = |get: fn(&Imu) -> f64| on_grid(drive.imu.iter().map(|(t, s)| (t, get(&s))), start, count);
        let turned = |get: fn(&Wheels) -> f64| on_grid(drive.wheels.iter().map(|(t, w)| (t, get(&w))), start, count);
        // A gyro that does not exist tells of no turning.
        let turning = |get: fn(&Imu) -> f64| {
            let rate = felt(get);
            if rate.iter().all(|r| r.is_nan()) { vec![0.0; count] } else { rate }
        };
        let over_window = |values: &[f64]| smooth(&moving_mean(values, HALF_WINDOW));
        let (raw, pitch_rate, yaw_rate) = (felt(|s| s.accel_x), turning(|s| s.gyro_y), turning(|s| s.gyro_z));
        let mut speed = turned(Wheels::forward_speed);
        speed.iter_mut().filter(|v| v.abs() < SLOWEST).for_each(|v| *v = f64::NAN);
        let change = rate(&speed);
        let force = zip(&raw, &integral(&pitch_rate), |f, pitch| f - GRAVITY * pitch);
        let tyres = tyre_force(&moving_mean(&raw, HALF_SMOOTH), &speed, &change);
        let slip = |sign: f64| {
            // A comparison drops a NaN: what is missing stays missing.
            let product = zip(&tyres, &speed, |f, v| if f.is_nan() || f * sign > 0.0 { f * v } else { 0.0 * v });
            without_slow(&rate(&product))
        };
        let signals = [
            over_window(&force),
            slip(1.0),
            slip(-1.0),
            over_window(&zip(&yaw_rate, &yaw_rate, |r, q| r * q)),
            over_window(&zip(&yaw_rate, &speed, |r, v| (r * v) * (r * v))),
            smooth(&rate(&pitch_rate)),
        ];
        let rear = |w: &Wheels| 0.5 * (w.wheel_speed_rl + w.wheel_speed_rr);
        let front_over = turned(|w| 0.5 * (w.wheel_speed_fl + w.wheel_speed_fr));
        let rear = on_grid(drive.wheels.iter().map(|(t, w)| (t, rear(&w))), start, count);
        let over_rear = [&front_over, &speed]
            .map(|axle| smooth(&rate(&zip(&zip(axle, &rear, |a, r| a - r), &speed, |d, v| d + 0.0 * v))));
        let curve = zip(&yaw_rate, &speed, |r, v| r * r / v);
        let aside = [smooth(&rate(&signals[0])), smooth(&rate(&curve))];
        Self { wheel: smooth(&change), signals, over_rear, aside }
    }

    /// How much more the front axle, and the forward speed, slip than the rear axle, driving and braking, with 1-sigma each;
    /// the wheels `shift` steps late.
    fn slip_over_rear(&self, shift: isize) -> [[Prior; 2]; 2] {
        self.over_rear.each_ref().map(|wheel| {
            let mut sums = Sums::new(1);
            for k in (LONGEST..wheel.len() - LONGEST).step_by(STRIDE) {
                let (s, a) = (&self.signals, &self.aside);
                let row = [s[1][k], s[2][k], a[0][k], a[1][k], 0.0, 0.0];
                sums.add(&row, |_| wheel[k.saturating_add_signed(shift)]);
            }
            sums.first_two()
        })
    }

    /// The sums over stretches of the drive that are as long as each other.
    fn stretches(&self) -> Vec<Sums> {
        // Rows that have everything at every delay: they are the same for all.
        let around = moving_mean(&self.wheel, LONGEST);
        let row = |k: usize| self.signals.each_ref().map(|s| s[k]);
        let ends = LONGEST..self.wheel.len() - LONGEST;
        let is_whole = |k: &usize| (around[*k] + row(*k).iter().sum::<f64>()).is_finite();
        let rows: Vec<usize> = ends.step_by(STRIDE).filter(is_whole).collect();
        let stretch = |rows: &[usize]| {
            let mut sums = Sums::new(TRIED);
            for &k in rows {
                sums.add(&row(k), |tried| self.wheel[k + fit::step_of(tried) - LONGEST]);
            }
            sums
        };
        rows.chunks(rows.len().div_ceil(STRETCHES).max(1)).map(stretch).collect()
    }
}

/// Specific force of the tyres: of the accelerometer without its offset over the drive, with what rolling costs.
fn tyre_force(felt: &[f64], speed: &[f64], change: &[f64]) -> Vec<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for over in felt.iter().zip(change).map(|(f, a)| f - a).filter(|d| d.is_finite()) {
        sum += over;
        count += 1.0;
    }
    let offset = sum / f64::max(count, 1.0);
    zip(felt, speed, |f, v| f - offset + DRAG.0 + DRAG.1 * v * v)
}

/// What the axles' difference tells of the slip of the forward speed's own wheels, put into the priors.
///
/// Slip is force over load and the tyres' stiffness, so that the mean of both axles is the same driving and braking: half of
/// what the driven axle slips, as the other does not.
fn expect_slip(priors: &mut [Prior; SIGNALS], [axles, mut own]: [[Prior; 2]; 2]) {
    let (gap, sigma) = (axles[0].0.abs(), axles[0].1);
    if !(gap >= DRIVEN.0 && gap >= DRIVEN.1 * sigma) {
        return;
    }
    // The forward speed is that of the rear wheels, of all or of the front wheels, where it is clear which.
    let share = (2.0 * own[0].0 / axles[0].0).round().clamp(0.0, 2.0) / 2.0;
    if own[0].1 < gap / 8.0 && (own[0].0 - share * axles[0].0).abs() < 3.0 * own[0].1 {
        own = axles.map(|(slip, sigma)| (share * slip, share * sigma));
    }
    // The forward speed's and the driven axle's slip less that of the axle that is not driven.
    let is_front_driven = axles[0].0 > 0.0;
    let over = |k: usize| if is_front_driven { own[k].0 } else { own[k].0 - axles[k].0 };
    let braked = 0.5 * (gap - if is_front_driven { axles[1].0 } else { -axles[1].0 });
    let total = |parts: [f64; 3]| parts.iter().map(|p| p * p).sum::<f64>().sqrt();
    priors[1] = (over(0), total([UNDRIVEN.0, own[0].1, 0.0]));
    priors[2] = (braked + over(1), total([UNDRIVEN.1 * braked, axles[1].1, own[1].1]));
}

/// Standard deviation of a delay from what it is without each stretch (jackknife).
fn spread(total: &Sums, stretches: &[Sums], priors: &[Prior; SIGNALS]) -> Option<f64> {
    let without = |s: &Sums| total.less(s).peak(priors).map(|p| p.delay);
    let delays: Vec<f64> = stretches.iter().map(without).collect::<Option<_>>()?;
    let n = delays.len() as f64;
    let mean = delays.iter().sum::<f64>() / n;
    Some(((n - 1.0) / n * delays.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>()).sqrt())
}

/// The delay of the wheel speed against the forward accelerometer; `None` where the drive does not tell it to
/// 10 ms, where its stretches do not agree, and where the wheels seem early by more than two sigmas.
pub fn find_wheel_latency(drive: &Drive) -> Option<WheelLatency> {
    let (start, end) = drive.span()?;
    let count = ((end - start) / STEP) as usize + 1;
    if !(4 * HALF_SLOW..=100_000_000).contains(&count) {
        return None;
    }
    let model = Model::new(drive, start, count);
    let stretches = model.stretches();
    if stretches.len() < STRETCHES {
        return None;
    }
    let total = stretches.iter().fold(Sums::new(TRIED), |sum, s| sum.more(s));
    let mut priors = PRIORS;
    let first = total.peak(&priors)?;
    expect_slip(&mut priors, model.slip_over_rear((first.delay / STEP).round() as isize));
    let peak = total.peak(&priors)?;
    let sigma = peak.sigma.max(spread(&total, &stretches, &priors)?);
    let found = WheelLatency { delay: peak.delay, sigma, correlation: peak.explained.max(0.0).sqrt() };
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
