//! The accelerometer among the columns: unit, axes, signs and lean.

use drivescope_drive::geodesy::STANDARD_GRAVITY;

use super::evidence;
use super::gnss::{Interval, Motion};
use super::linear::{Normal, Seating, Solved, cross, dot, lean_rows, norm, plus, seat, unit};
use super::scene::{Field, STEP, slope};
use super::survey::{Kind, Role, Survey, Weight};
use crate::candidate::Confidence;
use crate::fit::nearest;

/// Units of specific force: what 1 m/s^2 reads.
const FORCES: [(&str, f64); 4] =
    [("m/s^2", 1.0), ("g", 1.0 / STANDARD_GRAVITY), ("mg", 1000.0 / STANDARD_GRAVITY), ("ft/s2", 1.0 / 0.3048)];
/// Most columns of which triads are tried.
const MOST: usize = 24;

/// How sure the axes of a triad are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triad {
    pub columns: [usize; 3],
    pub unit: &'static str,
    /// What 1 SI unit reads.
    pub one: f64,
    pub seating: Seating,
    /// 1-sigma of forward and of right, rad; above 1 where they are not known.
    pub sigma: [f64; 2],
    /// Cost of the fit, 0 for a perfect one.
    pub cost: f64,
    /// What gravity reads, as a share of 1 g in this unit.
    pub gravity: f64,
    /// How much more than the sensor's own scale braking and cornering show.
    pub gain: [f64; 2],
}

/// One column against the motion: forward and sideways acceleration, and the rest at 1 g.
struct Fits {
    column: usize,
    fit: Solved,
}

/// Climb per metre of way, by time; 0 where it is not known.
pub(crate) type Climb<'c> = Option<&'c Field>;

fn fits(s: &Survey, columns: &[usize], intervals: &[Interval], climb: Climb) -> Vec<Fits> {
    let one = |&column: &usize| {
        let mut n = Normal::default();
        for i in intervals {
            let turn = if i.turn.is_finite() { i.turn / (i.to - i.from) } else { continue };
            let grade = climb.map_or(0.0, |c| c.mean(i.from, i.to));
            let grade = if grade.is_finite() { grade } else { 0.0 };
            let y = s.scene.fields[column].mean(i.from, i.to);
            n.add(&[i.accel + STANDARD_GRAVITY * grade, i.speed * turn, 1.0], y);
        }
        Fits { column, fit: n.solve(3) }
    };
    columns.iter().map(one).collect()
}

/// Spread of forward and sideways acceleration over the intervals, m/s^2.
fn excitation(intervals: &[Interval]) -> [f64; 2] {
    let spread = |value: &dyn Fn(&Interval) -> f64| {
        let list: Vec<f64> = intervals.iter().map(value).filter(|v| v.is_finite()).collect();
        let mean = list.iter().sum::<f64>() / list.len().max(1) as f64;
        (list.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / list.len().max(1) as f64).sqrt()
    };
    [spread(&|i| i.accel), spread(&|i| i.speed * i.turn / (i.to - i.from))]
}

/// Judge three columns as an accelerometer.
fn judge(a: [&Fits; 3], excited: [f64; 2]) -> Triad {
    let take = |k: usize| a.map(|f| f.fit.x[k]);
    let (forward, right, rest) = (take(0), take(1), take(2));
    let size = norm(rest) / STANDARD_GRAVITY;
    let (name, off) = nearest(size, &FORCES);
    let one = FORCES.iter().find(|u| u.0 == name).map_or(1.0, |u| u.1);
    let down = unit(rest.map(|v| -v));
    let mut cost = (off / 0.04).powi(2);
    let mut sigma = [f64::INFINITY; 2];
    let mut gain = [1.0; 2];
    for (k, (v, least)) in [(forward, 0.2), (right, 0.3)].into_iter().enumerate() {
        if excited[k] < least {
            continue;
        }
        gain[k] = norm(v) / one;
        sigma[k] = a.iter().map(|f| f.fit.sigma[k].powi(2)).sum::<f64>().sqrt() / norm(v);
        let slant = dot(v, down) / norm(v);
        // A banked road takes up to half of the sideways force away.
        let spread = if k == 1 && gain[k] < 1.0 { 0.4 } else { 0.25 };
        cost += ((gain[k] - 1.05) / spread).powi(2) + (slant / (0.15 + sigma[k])).powi(2) + (sigma[k] / 0.25).powi(2);
    }
    if sigma[0] < 1.0 && sigma[1] < 1.0 {
        let slant = dot(forward, right) / (norm(forward) * norm(right));
        cost += (slant / (0.15 + sigma[0] + sigma[1])).powi(2);
    }
    let rows = directions(forward, right, down, sigma);
    let columns = a.map(|f| f.column);
    Triad { columns, unit: name, one, seating: seat(rows), sigma, cost, gravity: size / one, gain }
}

/// For each column what it reads of the car's forward, right and down axes.
fn directions(forward: [f64; 3], right: [f64; 3], down: [f64; 3], sigma: [f64; 2]) -> [[f64; 3]; 3] {
    let level = |v: [f64; 3]| unit(plus(v, -dot(v, down), down));
    let (f, r) = (level(forward), level(right));
    let (knows_f, knows_r) = (sigma[0] < 0.5, sigma[1] < 0.5);
    let hand = if knows_f && knows_r { dot(cross(f, r), down).signum() } else { 1.0 };
    let from_right = cross(r, down).map(|v| v * hand);
    let f = match (knows_f, knows_r) {
        (true, true) => {
            let (a, b) = (sigma[0].max(0.01).powi(-2), sigma[1].max(0.01).powi(-2));
            level(plus(f.map(|v| v * a), b, from_right))
        }
        (true, false) => f,
        (false, true) => from_right,
        // Nothing tells: whichever column lies flattest is taken to be forward.
        (false, false) => {
            let flat = (0..3).min_by(|a, b| down[*a].abs().total_cmp(&down[*b].abs())).unwrap_or(0);
            level(std::array::from_fn(|i| f64::from(u8::from(i == flat))))
        }
    };
    let r = cross(down, f).map(|v| v * hand);
    std::array::from_fn(|i| [f[i], r[i], down[i]])
}

/// Columns that may be of a triad: fast ones, three by name or any.
pub(super) fn candidates(s: &Survey, kind: Kind) -> Vec<usize> {
    let mut list = s.columns(kind);
    list.retain(|&c| s.scene.fields[c].period < 0.3);
    list.truncate(MOST);
    list
}

/// The three columns that are an accelerometer, and how it sits.
pub(crate) fn find_accel(
    s: &Survey,
    motion: &Motion,
    late: f64,
    climb: Climb,
    known: Option<[usize; 3]>,
) -> Option<(Triad, f64)> {
    let intervals = motion.intervals(late);
    let excited = excitation(&intervals);
    let columns = known.map_or_else(|| candidates(s, Kind::Accel), |k| k.to_vec());
    let fits = fits(s, &columns, &intervals, climb);
    let mut best: Option<Triad> = None;
    let mut second = f64::INFINITY;
    for i in 0..fits.len() {
        for j in i + 1..fits.len() {
            for k in j + 1..fits.len() {
                let triad = judge([&fits[i], &fits[j], &fits[k]], excited);
                match best {
                    Some(b) if triad.cost >= b.cost => second = second.min(triad.cost),
                    old => {
                        second = old.map_or(second, |b| b.cost);
                        best = Some(triad);
                    }
                }
            }
        }
    }
    best.filter(|b| b.cost < 14.0).map(|b| (b, second))
}

/// The triad once more, in tenths of a second, against a fast speed, the yaw gyro and the grade of the road.
pub(crate) fn refine(s: &Survey, triad: &Triad, speed: &[f64], rate: &[f64], grade: Option<&Field>) -> Option<Triad> {
    let lost = slope(&integral(&swung(speed, rate)), 4);
    let change: Vec<f64> = slope(speed, 4).iter().zip(&lost).map(|(a, b)| a - b).collect();
    let turn = slope(&integral(&sideways(speed, rate)), 4);
    let mut excited = [0.0; 2];
    let fits = triad.columns.map(|column| {
        let smooth = slope(&integral(&s.scene.fields[column].grid), 4);
        let mut n = Normal::default();
        let mut sums = [[0.0; 3]; 2];
        for i in (0..smooth.len()).step_by(2) {
            let slant = grade.map_or(0.0, |g| g.grid[i]);
            let slant = if slant.is_finite() { STANDARD_GRAVITY * slant } else { 0.0 };
            let terms = [change[i] + slant, turn[i], 1.0];
            n.add(&terms, smooth[i]);
            for (sum, v) in sums.iter_mut().zip(terms).filter(|(_, v)| v.is_finite()) {
                (sum[0], sum[1], sum[2]) = (sum[0] + 1.0, sum[1] + v, sum[2] + v * v);
            }
        }
        excited = sums.map(|[n, a, b]| (b / n - (a / n) * (a / n)).max(0.0).sqrt());
        let mut fit = n.solve(3);
        // Neighbouring rows share their noise.
        fit.sigma.iter_mut().for_each(|v| *v *= 2.0);
        Fits { column, fit }
    });
    let [a, b, c] = &fits;
    Some(judge([a, b, c], excited)).filter(|t| t.cost < 14.0)
}

/// Sum of three columns of a triad along one axis of the car, in SI, on the grid.
pub(crate) fn along(s: &Survey, triad: &Triad, axis: usize) -> Vec<f64> {
    let turn = lean_rows(triad.seating.lean)[axis];
    let weights: [(usize, f64); 3] = std::array::from_fn(|k| {
        let (of, sign) = triad.seating.axes[k];
        (triad.columns[of], turn[k] * sign / triad.one)
    });
    let n = s.scene.fields[triad.columns[0]].grid.len();
    (0..n).map(|i| weights.iter().map(|(c, w)| w * s.scene.fields[*c].grid[i]).sum()).collect()
}

/// Running integral on the grid; blanks count as 0.
pub(crate) fn integral(values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut step = |v: &f64| {
        // The value stands for its bin, the integral for the bin's middle.
        let half = if v.is_finite() { 0.5 * STEP * v } else { 0.0 };
        sum += half;
        let middle = sum;
        sum += half;
        middle
    };
    values.iter().map(&mut step).collect()
}

/// What sideslip takes from the forward acceleration as the car turns, m/s^2.
pub(crate) fn swung(speed: &[f64], rate: &[f64]) -> Vec<f64> {
    speed.iter().zip(rate).map(|(v, w)| w * v * super::delay::sideslip(*w, *v)).collect()
}

/// Sideways acceleration of the sensor on a level road, m/s^2: speed times the turning of heading and sideslip.
pub(crate) fn sideways(speed: &[f64], rate: &[f64]) -> Vec<f64> {
    let slip: Vec<f64> = speed.iter().zip(rate).map(|(v, w)| super::delay::sideslip(*w, *v)).collect();
    let change = slope(&slip, 3);
    let known = |v: f64| if v.is_finite() { v } else { 0.0 };
    (0..speed.len()).map(|i| speed[i] * (rate[i] + known(change[i]))).collect()
}

const ACCEL: [&str; 3] = ["accel_x", "accel_y", "accel_z"];
const AXES: [&str; 3] = ["forward", "right", "down"];

/// Give the accelerometer's columns their roles.
pub(crate) fn seat_accel(s: &mut Survey, triad: &Triad, motion: &Motion, second: f64) {
    for (axis, &(of, sign)) in triad.seating.axes.iter().enumerate() {
        let column = triad.columns[of];
        let known = match axis {
            0 => triad.sigma[0],
            1 => triad.sigma[1],
            _ => 0.02,
        };
        let other = triad.sigma[0].min(triad.sigma[1]);
        let named = s.names[column].is_some();
        let mut confidence = if known < 0.12 && triad.cost < 6.0 && second > triad.cost + 4.0 {
            Confidence::Certain
        } else if known < 0.35 {
            Confidence::Likely
        } else if other < 0.35 && named {
            // The third axis of a right-handed sensor.
            Confidence::Likely
        } else {
            Confidence::Guess
        };
        let mut why = if axis == 2 {
            format!("gravity, 1 g in {}, lies along the three columns mostly here", triad.unit)
        } else if known < 0.35 {
            let what = if axis == 0 { "the change of the speed" } else { "speed times rate of turn" };
            format!(
                "{what} of {} shows here, {:.2} times in {}, direction to {:.1} deg",
                motion.label,
                triad.gain[axis] * sign,
                triad.unit,
                known.to_degrees()
            )
        } else {
            format!("the {} axis that is left over; the drive does not show its sign", AXES[axis])
        };
        if axis < 2 && known >= 0.35 && other >= 0.35 {
            confidence = Confidence::Guess;
            why = "level by gravity; which way it points the drive does not show".into();
        }
        let role =
            Role { signal: ACCEL[axis].into(), unit: triad.unit.into(), scale: sign, offset: 0.0, confidence, why };
        s.assign(column, role);
    }
    if (triad.gravity - 1.0).abs() > 0.02 {
        let text = format!(
            "gravity reads {:.2} m/s^2 on this accelerometer, {:+.1} % from 9.81: it is not calibrated.",
            triad.gravity * STANDARD_GRAVITY,
            100.0 * (triad.gravity - 1.0)
        );
        s.find(Weight::Contradiction, &triad.columns, text);
    }
    for (k, word) in [(0, "forward"), (1, "sideways")] {
        let column = triad.columns[triad.seating.axes[k].0];
        // Only a column that goes with the motion shows its scale.
        let shows = evidence::against(s, column, ACCEL[k], (motion, 0.0), None);
        let usual = |gain: f64| (0.8..1.35).contains(&gain);
        let shows = shows.is_some_and(|e| e.correlation.abs() > 0.9 && !usual(e.slope.abs() / triad.one));
        if triad.sigma[k] > 0.1 || !shows || usual(triad.gain[k]) {
            continue;
        }
        // A banked road takes part of the sideways force away, and wheels tell turns as well as their track is known.
        let explained = k == 1 && (triad.gain[k] < 1.0 || !motion.turned.is_empty());
        let weight = if explained { Weight::Note } else { Weight::Contradiction };
        let text = format!(
            "the accelerometer shows {word} acceleration {:.2} times as large as {} does: {}check its scale.",
            triad.gain[k],
            motion.label,
            if explained { "a banked road, or " } else { "" }
        );
        s.find(weight, &triad.columns, text);
    }
}
