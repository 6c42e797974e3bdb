//! Statistical detectors of rest, for comparison with the rules of [`crate::motion_mode`].
//!
//! Three statistics over a causal window, each small at rest: GLRT (also called SHOE), the misfit of "gravity and no rate";
//! ARED, the energy of the rates; MV, the variance of the specific force. Source: SPEC motion 1, after Skog et al. 2010.
//! Departure: means of squares come from running sums, so that a row costs the same for any window.
//! Not decided here: straight or cornering.

use drivescope_drive::drive::{Epoch, LogStart, Signal};
use drivescope_drive::geodesy::STANDARD_GRAVITY;
use drivescope_drive::select::midpoint;
use drivescope_drive::vehicle::VehicleParams;
use drivescope_drive::{params, record};

use crate::estimator::{Estimator, EstimatorError, Need, Notices};
use crate::motion_mode::{InertialRow, MotionModeDetector, MotionModeParams};

params! {
    /// Window, noise and thresholds of the stationarity detectors.
    pub struct StationarityParams {
        /// Window of all three statistics.
        window ("W"): number = 0.5, "s", 0.05 ..= 3.0 Log, from "SPEC motion 1: 50 rows at 100 Hz";
        /// Noise of the specific force that GLRT and MV divide by.
        accel_sigma ("s_a"): number = 0.05, "m/s^2", 0.005 ..= 0.5 Log, from "SPEC motion 1";
        /// Noise of the rates that GLRT divides by.
        gyro_sigma ("s_g"): number = 0.005, "rad/s", 5e-4 ..= 0.05 Log, from "SPEC motion 1";
        /// Whether thresholds are a multiple of the median over the first seconds, which must be at rest; else the fixed ones.
        automatic (""): toggle = true, from "SPEC motion 1";
        /// Automatic thresholds, as a multiple of that median.
        threshold_factor (""): number = 2.0, "1", 1.1 ..= 10.0 Log, from "SPEC motion 1";
        /// Time at the beginning over which the median is taken.
        learning_time (""): number = 3.0, "s", 0.5 ..= 10.0 Linear, from "SPEC motion 1";
        /// Fixed threshold of GLRT.
        glrt_threshold (""): number = 11.64, "1", 1.0 ..= 1000.0 Log, from "SPEC motion 4: automatic of a simulated drive";
        /// Fixed threshold of ARED.
        ared_threshold (""): number = 7.0e-5, "rad^2/s^2", 1e-6 ..= 0.01 Log, from "SPEC motion 4: same";
        /// Fixed threshold of MV.
        mv_threshold (""): number = 3.364_06, "1", 0.1 ..= 1000.0 Log, from "SPEC motion 4: same";
    }
}

record! {
    /// Three statistics, their thresholds and what each decides.
    pub struct StationarityEstimate {
        /// GLRT: mean misfit of gravity without rate, in squared sigmas.
        glrt: "1";
        /// ARED: mean squared rate.
        ared: "rad^2/s^2";
        /// MV: variance of the specific force, in squared sigmas.
        mv: "1";
        /// Threshold of `glrt`.
        glrt_threshold: "1";
        /// Threshold of `ared`.
        ared_threshold: "rad^2/s^2";
        /// Threshold of `mv`.
        mv_threshold: "1";
        /// 1 where GLRT takes the car for standing; not before its window is full.
        glrt_stationary: "1";
        /// 1 where ARED takes the car for standing; not before its window is full.
        ared_stationary: "1";
        /// 1 where MV takes the car for standing; not before its window is full.
        mv_stationary: "1";
    }
}

/// The longest window and the longest learning, rows.
const MOST_ROWS: f64 = 10_000.0;
const USUAL_STEP: f64 = 0.01;

/// What a window sums: force, its square, rate, its square.
const SUMS: usize = 8;

/// Sums over the last rows, formed anew once per window.
#[derive(Clone, Debug)]
struct Window {
    rows: Vec<[f64; SUMS]>,
    next: usize,
    filled: usize,
    sums: [f64; SUMS],
}

impl Window {
    fn new(length: usize) -> Self {
        Self { rows: vec![[0.0; SUMS]; length.max(1)], next: 0, filled: 0, sums: [0.0; SUMS] }
    }

    fn is_full(&self) -> bool {
        self.filled == self.rows.len()
    }

    /// Take in a row; the means over the window then.
    fn push(&mut self, row: &InertialRow) -> [f64; SUMS] {
        let ([fx, fy, fz], [wx, wy, wz]) = (row.force, row.rate);
        let new = [fx, fy, fz, fx * fx + fy * fy + fz * fz, wx, wy, wz, wx * wx + wy * wy + wz * wz];
        // Rows that are not there yet are zeros.
        let old = std::mem::replace(&mut self.rows[self.next], new);
        self.sums.iter_mut().zip(new.iter().zip(old)).for_each(|(s, (n, o))| *s += n - o);
        self.filled = (self.filled + 1).min(self.rows.len());
        self.next += 1;
        if self.next == self.rows.len() {
            self.next = 0;
            self.sums = [0.0; SUMS];
            for row in &self.rows {
                self.sums.iter_mut().zip(row).for_each(|(s, v)| *s += v);
            }
        }
        let count = self.filled as f64;
        self.sums.map(|s| s / count)
    }
}

/// The three statistics of a window's means, rates counted from their `bias` (rad/s); sigmas squared.
fn statistics(mean: &[f64; SUMS], bias: &[f64; 3], accel_variance: f64, gyro_variance: f64) -> [f64; 3] {
    let [fx, fy, fz, ff, wx, wy, wz, ww] = *mean;
    let mean2 = fx * fx + fy * fy + fz * fz;
    let [bx, by, bz] = *bias;
    let energy = (ww - 2.0 * (bx * wx + by * wy + bz * wz) + bx * bx + by * by + bz * bz).max(0.0);
    let variance = (ff - mean2).max(0.0);
    let g = STANDARD_GRAVITY;
    let misfit = (ff - 2.0 * g * mean2.sqrt() + g * g).max(0.0);
    [misfit / accel_variance + energy / gyro_variance, energy, variance / accel_variance]
}

/// The estimator: see the [module](self).
#[derive(Clone, Debug)]
pub struct Stationarity {
    params: StationarityParams,
    source: MotionModeDetector,
    window: Window,
    first: Vec<[f64; SUMS]>,
    rows: usize,
    needed: usize,
    thresholds: [f64; 3],
}

impl Estimator for Stationarity {
    const NAME: &'static str = "stationarity";
    const TITLE: &'static str = "Detectors of rest";
    const DOC: &'static str = "Whether the car stands, by three statistics (GLRT or SHOE, ARED, moving variance) after Skog et \
        al. 2010: to compare with the rules of the motion mode.";
    const NEEDS: &'static [Need] =
        &[Need { signal: Signal::SixAxes, required: true, why: "the statistics are those of force and rates" }];
    const VEHICLE: &'static str = "saloon";
    type Params = StationarityParams;
    type Estimate = StationarityEstimate;

    fn new(params: &StationarityParams, vehicle: &VehicleParams, start: &LogStart) -> Self {
        let step = if start.imu_step > 0.0 { start.imu_step } else { USUAL_STEP };
        let rows = |seconds: f64| (seconds / step).round().clamp(1.0, MOST_ROWS) as usize;
        let mode = MotionModeParams { use_speed: false, ..MotionModeParams::default() };
        let needed = if params.automatic { rows(params.learning_time) } else { 0 };
        Self {
            source: MotionModeDetector::new(&mode, vehicle, start),
            window: Window::new(rows(params.window)),
            first: Vec::with_capacity(needed),
            rows: 0,
            needed,
            thresholds: [params.glrt_threshold, params.ared_threshold, params.mv_threshold],
            params: params.clone(),
        }
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<StationarityEstimate>, EstimatorError> {
        let Some(mode) = self.source.step(epoch)? else { return Ok(None) };
        let bias = [mode.gyro_bias_x, mode.gyro_bias_y, mode.gyro_bias_z];
        let mean = self.window.push(&self.source.mode_row());
        self.learn(&mean, &bias);
        let [glrt, ared, mv] = self.statistics(&mean, &bias);
        let [glrt_threshold, ared_threshold, mv_threshold] = self.thresholds;
        let is_full = self.window.is_full();
        let is_small = |value: f64, threshold: f64| f64::from(u8::from(is_full && value <= threshold));
        Ok(Some(StationarityEstimate {
            glrt,
            ared,
            mv,
            glrt_threshold,
            ared_threshold,
            mv_threshold,
            glrt_stationary: is_small(glrt, glrt_threshold),
            ared_stationary: is_small(ared, ared_threshold),
            mv_stationary: is_small(mv, mv_threshold),
        }))
    }

    fn notices(&self) -> &Notices {
        self.source.notices()
    }
}

impl Stationarity {
    fn statistics(&self, mean: &[f64; SUMS], bias: &[f64; 3]) -> [f64; 3] {
        let p = &self.params;
        statistics(mean, bias, p.accel_sigma * p.accel_sigma, p.gyro_sigma * p.gyro_sigma)
    }

    /// Thresholds from the median over the full windows of the first rows, with the bias known at their end.
    fn learn(&mut self, mean: &[f64; SUMS], bias: &[f64; 3]) {
        if self.rows == self.needed {
            return;
        }
        self.rows += 1;
        if self.window.is_full() {
            self.first.push(*mean);
        }
        if self.rows < self.needed || self.first.is_empty() {
            return;
        }
        let first = std::mem::take(&mut self.first);
        for k in 0..3 {
            let mut values: Vec<f64> = first.iter().map(|mean| self.statistics(mean, bias)[k]).collect();
            self.thresholds[k] = self.params.threshold_factor * midpoint(&mut values);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case_log::{Table, shared};
    use crate::estimator::run;

    /// Statistics as the specification writes them, over the rows of a window.
    fn written_out(rows: &[InertialRow], bias: &[f64; 3]) -> [f64; 3] {
        let n = rows.len() as f64;
        let mean: [f64; 3] = std::array::from_fn(|k| rows.iter().map(|r| r.force[k]).sum::<f64>() / n);
        let size = mean.iter().map(|v| v * v).sum::<f64>().sqrt();
        let square = |f: &dyn Fn(&InertialRow, usize) -> f64| {
            rows.iter().map(|r| (0..3).map(|k| f(r, k).powi(2)).sum::<f64>()).sum::<f64>() / n
        };
        let energy = square(&|r, k| r.rate[k] - bias[k]);
        let misfit = square(&|r, k| r.force[k] - STANDARD_GRAVITY * mean[k] / size);
        let spread = square(&|r, k| r.force[k] - mean[k]);
        [misfit / 0.0025 + energy / 2.5e-5, energy, spread / 0.0025]
    }

    #[test]
    fn running_sums_give_the_statistics_written_out() {
        let (mut window, mut rows) = (Window::new(7), Vec::new());
        let bias = [0.01, -0.02, 0.03];
        for k in 0..100 {
            let wave = |n: f64| (f64::from(k) * n).sin();
            let row =
                InertialRow { force: [wave(1.1), wave(0.7), -9.8 + wave(2.0)], rate: [wave(0.3), wave(0.2), 0.1] };
            rows.push(row);
            let found = statistics(&window.push(&row), &bias, 0.0025, 2.5e-5);
            let wanted = written_out(&rows[rows.len().saturating_sub(7)..], &bias);
            for (a, b) in found.iter().zip(wanted) {
                assert!((a - b).abs() < 1e-9 * (1.0 + b), "{k}: {found:?} {wanted:?}");
            }
        }
    }

    /// Balanced accuracy of rest against motion, over the whole log.
    fn balanced(decided: &[f64], truth: &[f64]) -> f64 {
        let share = |resting: bool| {
            let rows = decided.iter().zip(truth).filter(|(_, t)| (**t == 0.0) == resting);
            let (all, right) =
                rows.fold((0.0, 0.0), |(n, r), (d, _)| (n + 1.0, r + f64::from(u8::from((*d == 1.0) == resting))));
            right / all
        };
        0.5 * (share(true) + share(false))
    }

    #[test]
    fn thresholds_and_balanced_accuracies_are_the_specifications() {
        let cases = [("c1_u_3acc3gyro", [0.979, 0.982, 0.973]), ("c3_stopgo_3acc3gyro", [0.968, 0.972, 0.961])];
        for (name, wanted) in cases {
            let Some(path) = shared(&format!("spec/motion/{name}.csv.gz")) else { return };
            let drive = Table::read(&path).drive();
            let truth = drive.truth.column("mode").unwrap().to_vec();
            for automatic in [true, false] {
                let params = StationarityParams { automatic, ..StationarityParams::default() };
                let found = run::<Stationarity>(&drive, &params, None).unwrap();
                if automatic && name.starts_with("c1") {
                    let last = found.at(found.len() - 1).1;
                    // ARED and MV as printed; GLRT is 3e-6 of its value below the print.
                    assert!((last.glrt_threshold - 11.64).abs() < 5e-5, "{}", last.glrt_threshold);
                    assert!((last.ared_threshold - 7.0e-5).abs() < 5e-7, "{}", last.ared_threshold);
                    assert!((last.mv_threshold - 3.36406).abs() < 5e-6, "{}", last.mv_threshold);
                }
                for (column, wanted) in ["glrt_stationary", "ared_stationary", "mv_stationary"].into_iter().zip(wanted)
                {
                    let accuracy = balanced(found.column(column).unwrap(), &truth);
                    assert!((accuracy - wanted).abs() <= 5.001e-4, "{name} {column} {automatic}: {accuracy}");
                }
            }
        }
    }
}
