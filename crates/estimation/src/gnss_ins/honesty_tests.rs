//! Whether the filter's errors are as large as it says, over many seeds, with noise exactly as it believes.
//!
//! A failure of the NEES means a wrong sign or a missing term in the error model, a noise density that does not match, or a
//! Jacobian that is not the innovation's.

use drivescope_drive::satellites::Satellite;
use drivescope_drive::signals::Wheels;
use nalgebra::{DMatrix, DVector, SVector, Vector3};

use super::consistency_tests::{DT, Noise, ORIGIN, START, fix, imu, params};
use super::covariance::{ALL_STATES, CLOCK_BIAS, CLOCK_DRIFT, Covariance, Errors};
use super::state::State;
use super::*;
use crate::chi_square;
use crate::gnss::sight::Sight;
use crate::ins::tests::{Truth, inertial_sample, winding_drive};
use crate::ins::{ACCEL_BIAS, Earth, GYRO_BIAS, STATES};

/// Runs whose mean is held against the interval of SPEC navigation 10.6.
const GROUP: usize = 8;

/// Once a second of a run: normalized error squared of all states and of the fifteen, normalized innovation squared of the position
/// or of the ranges.
#[derive(Default)]
struct Statistics {
    nees: Vec<f64>,
    nees_15: Vec<f64>,
    nis: Vec<f64>,
}

/// Satellites above a place, and what a receiver with a clock reads of them with the noise of the parameters.
fn ranges(truth: &Truth, clock: [f64; 2], p: &GnssInsParams, noise: &mut Noise) -> Vec<Satellite> {
    let sky = LocalFrame::new(ORIGIN);
    let here = LocalFrame::new(truth.place);
    (0..9u32)
        .map(|k| {
            let (azimuth, elevation) = (f64::from(k) * 2.3, 0.2 + 0.14 * f64::from(k));
            let (sin, cos) = elevation.sin_cos();
            let at = Vector3::new(azimuth.cos() * cos, azimuth.sin() * cos, -sin) * 2.2e7;
            let mut satellite = Satellite { prn: k, place: sky.to_geodetic(&at).to_ecef(), ..Satellite::default() };
            let tangent = Vector3::new(900.0 * azimuth.sin(), -900.0 * azimuth.cos(), 300.0);
            satellite.velocity = sky.to_geodetic(&(at + tangent)).to_ecef() - satellite.place;
            let seen = Sight::new(&here, &Vector3::zeros(), &satellite);
            satellite.range = seen.distance + clock[0] + p.range_sigma * noise.normal();
            satellite.rate = seen.distance_rate(&truth.velocity) + clock[1] + p.range_rate_sigma * noise.normal();
            satellite
        })
        .collect()
}

/// What the sensors carry besides the motion, drawn from P0 and walking as the filter believes.
#[derive(Clone)]
struct Hidden {
    accel_bias: Vector3<f64>,
    gyro_bias: Vector3<f64>,
    clock: [f64; 2],
}

impl Hidden {
    fn walk(&mut self, p: &GnssInsParams, noise: &mut Noise) {
        let root = DT.sqrt();
        self.accel_bias += noise.vector(p.accel_bias_walk * root);
        self.gyro_bias += noise.vector(p.gyro_bias_walk * root);
        self.clock[0] += self.clock[1] * DT + (p.clock_bias_noise * DT).sqrt() * noise.normal();
        self.clock[1] += (p.clock_drift_noise * DT).sqrt() * noise.normal();
    }
}

/// Normalized error squared of those of the first `count` states that the run estimates.
fn nees(state: &State, covariance: &Covariance, truth: &Truth, hidden: &Hidden, count: usize) -> f64 {
    let mut e = Errors::zeros();
    let earth = Earth::at(&truth.place, GravityModel::Wgs84);
    e.fixed_rows_mut::<9>(0).copy_from(&state.navigation.errors_against(&truth.navigation(), &earth));
    e.fixed_rows_mut::<3>(ACCEL_BIAS).copy_from(&(hidden.accel_bias - state.accel_bias));
    e.fixed_rows_mut::<3>(GYRO_BIAS).copy_from(&(hidden.gyro_bias - state.gyro_bias));
    e[CLOCK_BIAS] = state.clock_bias - hidden.clock[0];
    e[CLOCK_DRIFT] = state.clock_drift - hidden.clock[1];
    let states: Vec<usize> = (0..count).filter(|&k| covariance[(k, k)] > 0.0).collect();
    let p = DMatrix::from_fn(states.len(), states.len(), |r, c| covariance[(states[r], states[c])]);
    let e = DVector::from_fn(states.len(), |r, _| e[states[r]]);
    e.dot(&p.cholesky().unwrap().solve(&e))
}

/// One run from a start drawn from P0.
fn monte_carlo(truth: &[Truth], seed: u64, p: &GnssInsParams) -> Statistics {
    let mut statistics = Statistics::default();
    navigate(truth, seed, p, |estimator, estimate, at, hidden| {
        let filter = estimator.filter().unwrap();
        let nees = |count| nees(&filter.state, &filter.covariance, at, hidden, count);
        statistics.nees.push(nees(ALL_STATES));
        statistics.nees_15.push(nees(STATES));
        let is_tight = p.coupling == Coupling::Tight;
        statistics.nis.push(if is_tight { estimate.range_nis } else { estimate.position_nis });
    });
    statistics
}

/// Drive from a start drawn from P0 and look on once a second.
fn navigate(
    truth: &[Truth],
    seed: u64,
    p: &GnssInsParams,
    mut look: impl FnMut(&GnssIns, &GnssInsEstimate, &Truth, &Hidden),
) -> GnssIns {
    let mut noise = Noise(seed);
    let mut estimator = GnssIns::new(p, &VehicleParams::default(), &START);
    let sigma =
        Tuning::new(p, None).initial_covariance(p.initial_tilt_sigma, p.initial_yaw_sigma).map_diagonal(f64::sqrt);
    let errors: Errors = SVector::from_fn(|k, _| if k < STATES { sigma[k] * noise.normal() } else { 0.0 });
    let mut navigation = truth[0].navigation();
    let earth = Earth::at(&truth[0].place, GravityModel::Wgs84);
    navigation.correct(&-errors.fixed_rows::<9>(0).into_owned(), &earth);
    estimator.begin_at(0.0, navigation);
    let mut hidden = Hidden {
        accel_bias: errors.fixed_rows::<3>(ACCEL_BIAS).into_owned(),
        gyro_bias: errors.fixed_rows::<3>(GYRO_BIAS).into_owned(),
        clock: [3000.0, 30.0],
    };
    for (k, pair) in truth.windows(2).enumerate() {
        let (force, rate) = inertial_sample(&pair[0], &pair[1], DT);
        hidden.walk(p, &mut noise);
        let measured = imu(
            force + hidden.accel_bias + noise.vector(p.accel_noise / DT.sqrt()),
            rate + hidden.gyro_bias + noise.vector(p.gyro_noise / DT.sqrt()),
        );
        let is_fix = (k + 1) % 100 == 0;
        let is_tight = p.coupling == Coupling::Tight;
        let gnss = (is_fix && !is_tight).then(|| fix(&pair[1], &mut noise, 1.0));
        let satellites = (is_fix && is_tight).then(|| ranges(&pair[1], hidden.clock, p, &mut noise));
        let speed = (pair[1].rotation.transpose() * pair[1].velocity).x;
        let sigma = p.odometer_sigma + p.odometer_speed_sigma * speed.abs();
        let wheels = (p.odometer && (k + 1) % 10 == 0)
            .then(|| Wheels { speed: speed + sigma * noise.normal(), ..Wheels::default() });
        let epoch = Epoch {
            time: (k + 1) as f64 * DT,
            imu: Some(measured),
            gnss,
            wheels,
            raw_gnss: satellites.as_deref(),
            ..Epoch::default()
        };
        let estimate = estimator.step(&epoch).unwrap().unwrap();
        if is_fix {
            look(&estimator, &estimate, &pair[1], &hidden);
        }
    }
    estimator
}

/// Share of the epochs in which the mean NEES of `states` states over the runs lies in its 95 % interval (chi-square with `states`
/// times the runs degrees of freedom, over the runs: Bar-Shalom, Li & Kirubarajan 2001, section 5.4.2).
fn share_inside(runs: &[Statistics], states: usize, nees: fn(&Statistics) -> &[f64]) -> f64 {
    let count = runs.len() as f64;
    let band = [0.025, 0.975].map(|p| chi_square::quantile(p, states as f64 * count) / count);
    let epochs = nees(&runs[0]).len();
    let inside = |i: &usize| {
        let mean = runs.iter().map(|run| nees(run)[*i]).sum::<f64>() / count;
        mean > band[0] && mean < band[1]
    };
    (0..epochs).filter(inside).count() as f64 / epochs as f64
}

/// What many seeds say: means of NEES and NIS, the scatter of a run's mean NEES over the root of the runs, the share of the epochs
/// in which the mean NEES of a group of 8 lies in its 95 % interval, and the standard error of that share; the share in which the
/// mean over all runs does, of all states and of the fifteen.
#[derive(Debug)]
struct Honesty {
    nees: f64,
    nees_error: f64,
    nis: f64,
    inside: f64,
    inside_error: f64,
    all_inside: f64,
    fifteen_inside: f64,
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}

fn honesty(p: &GnssInsParams, seeds: std::ops::Range<u64>, states: usize) -> Honesty {
    let truth = winding_drive(120.0, DT);
    let runs: Vec<_> = seeds.map(|seed| monte_carlo(&truth, seed, p)).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let shares: Vec<f64> = runs.chunks_exact(GROUP).map(|group| share_inside(group, states, |run| &run.nees)).collect();
    let (nees, nees_error) = mean_and_error(&runs.iter().map(|run| mean(&run.nees)).collect::<Vec<_>>());
    let (inside, inside_error) = mean_and_error(&shares);
    let nis = mean(&runs.iter().map(|run| mean(&run.nis)).collect::<Vec<_>>());
    let all_inside = share_inside(&runs, states, |run| &run.nees);
    let fifteen_inside = share_inside(&runs, STATES, |run| &run.nees_15);
    let honesty = Honesty { nees, nees_error, nis, inside, inside_error, all_inside, fifteen_inside };
    println!("{states} states, {} runs, groups of {GROUP}: {honesty:.3?}", runs.len());
    honesty
}

/// A start drawn from a fifth of the default sigmas, where the second order of the errors is below the scatter.
fn small_start(p: GnssInsParams) -> GnssInsParams {
    GnssInsParams {
        initial_yaw_sigma: 0.2 * p.initial_yaw_sigma,
        initial_tilt_sigma: 0.2 * p.initial_tilt_sigma,
        initial_accel_bias_sigma: 0.2 * p.initial_accel_bias_sigma,
        initial_gyro_bias_sigma: 0.2 * p.initial_gyro_bias_sigma,
        ..p
    }
}

/// Seeds of a test: 6 groups of 8, chosen before they were tried.
const SEEDS: std::ops::Range<u64> = 1..49;

/// The averaged NEES over all seeds inside its interval in at least 95 % of the epochs; the mean NEES within three standard errors of
/// the number of states; and groups of 8, whose share scatters by 7 %, not below 95 % by more than two standard errors.
///
/// The interval holds 95 % of an exact filter's epochs, so that "at least 95 %" is what half of all sets of seeds would show: the
/// seeds were fixed before they were tried, and the other two limits do not depend on that luck.
fn assert_honest(h: &Honesty, states: f64) {
    assert!(h.all_inside >= 0.95 && h.fifteen_inside >= 0.95, "{h:?}");
    assert!((h.nees - states).abs() < 3.0 * h.nees_error && h.nees_error < 0.05 * states, "{h:?}");
    assert!(h.inside + 2.0 * h.inside_error >= 0.95 && h.inside > 0.9, "{h:?}");
}

/// Issue 7: the averaged NEES of at least 8 seeds lies in its 95 % interval in at least 95 % of the epochs. Measured over 560 seeds in
/// 70 groups of 8: mean 15.13 with a standard error of 0.13, inside in 94.2 % with one of 0.8 %.
#[test]
fn errors_are_as_large_as_the_filter_says() {
    let h = honesty(&small_start(params()), SEEDS, 15);
    assert_honest(&h, 15.0);
    assert!((h.nis - 3.0).abs() < 0.12, "{h:?}");
}

/// The same of the 17 states of tight coupling: offset and drift of the clock with ranges and rates of nine satellites.
#[test]
fn errors_are_as_large_as_the_tightly_coupled_filter_says() {
    let h = honesty(&small_start(GnssInsParams { coupling: Coupling::Tight, ..params() }), SEEDS, 17);
    assert_honest(&h, 17.0);
    assert!((h.nis - 1.0).abs() < 0.03, "{h:?}");
}

/// The odometer with the noise that the filter believes: ten more measurements a second keep the filter honest.
#[test]
fn errors_are_as_large_as_the_filter_with_an_odometer_says() {
    let h = honesty(&small_start(GnssInsParams { odometer: true, ..params() }), SEEDS, 15);
    assert!((h.nees - 15.0).abs() < 3.0 * h.nees_error && h.inside > 0.9, "{h:?}");
}

/// From the default start (yaw 5 deg) the second order adds 0.45 (standard error 0.17) to the NEES over 400 seeds, and 92.3 % are
/// inside; no more than that.
#[test]
fn a_start_yaw_of_five_degrees_costs_little_honesty() {
    let h = honesty(&params(), SEEDS, 15);
    assert!(h.all_inside >= 0.95 && h.inside >= 0.88 && h.nees < 16.7 && (h.nis - 3.0).abs() < 0.12, "{h:?}");
}

/// The tests above must be able to fail: a filter that believes the satellites three times better than they are is outside.
#[test]
fn an_optimistic_filter_is_found_out() {
    let truth = winding_drive(60.0, DT);
    let optimistic = GnssInsParams { gnss_position_sigma: 0.5, gnss_height_sigma: 1.0, ..params() };
    let runs: Vec<_> = (1..=8).map(|seed| monte_carlo(&truth, seed, &optimistic)).collect();
    let nis = runs.iter().flat_map(|run| &run.nis).sum::<f64>() / (8.0 * runs[0].nis.len() as f64);
    assert!(nis > 6.0, "{nis}");
}

/// Once a second of a smoothed run: normalized error squared of all states, horizontal error before and after the second pass, m.
fn smoothed(truth: &[Truth], seed: u64, p: &GnssInsParams) -> Vec<[f64; 3]> {
    let off = |state: &State, at: &Truth| {
        let earth = Earth::at(&at.place, GravityModel::Wgs84);
        state.navigation.errors_against(&at.navigation(), &earth).fixed_rows::<2>(0).norm()
    };
    let mut filtered = Vec::new();
    let mut estimator = navigate(truth, seed, p, |estimator, _, at, hidden| {
        filtered.push((off(&estimator.filter().unwrap().state, at), hidden.clone()));
    });
    let store = estimator.take_store().unwrap();
    let (mut pass, mut rows) =
        (Pass::new(store, GravityModel::Wgs84, estimator.frame.unwrap(), 0).unwrap(), Channel::default());
    let (mut out, mut last) = (vec![[f64::NAN; 3]; filtered.len()], usize::MAX);
    loop {
        let is_done = pass.advance(&mut rows, 1, &estimator.tuning);
        let (time, state, covariance) = pass.here();
        let second = time.round() as usize;
        if (time - time.round()).abs() < 1e-6 && second != last && second > 0 {
            let (at, (before, hidden)) = (&truth[100 * second], &filtered[second - 1]);
            out[second - 1] = [nees(state, covariance, at, hidden, ALL_STATES), *before, off(state, at)];
            last = second;
        }
        if is_done {
            return out;
        }
    }
}

/// With noise as the filter believes the second pass must be optimal too: as honest as the first, tightly coupled with the clock, and
/// better by far. A transition, a clock or an order of updates that is stored wrongly shows here. Not in every run: an optimal
/// smoother is better on average, and by luck the filter may be nearer the truth for two minutes.
#[test]
fn errors_are_as_large_as_the_tightly_coupled_smoother_says() {
    let truth = winding_drive(120.0, DT);
    let p = GnssInsParams { coupling: Coupling::Tight, smoother: Smoother::Rts, range_error_time: 0.0, ..params() };
    let runs: Vec<_> = SEEDS.map(|seed| smoothed(&truth, seed, &small_start(p.clone()))).collect();
    let mean = |run: &[[f64; 3]], column: usize| run.iter().map(|row| row[column]).sum::<f64>() / run.len() as f64;
    let square = |run: &[[f64; 3]], column: usize| run.iter().map(|row| row[column].powi(2)).sum::<f64>();
    let sum = |column: usize| runs.iter().map(|run| square(run, column)).sum::<f64>();
    let (nees, error) = mean_and_error(&runs.iter().map(|run| mean(run, 0)).collect::<Vec<_>>());
    let ratio = (sum(2) / sum(1)).sqrt();
    let worse = runs.iter().filter(|run| square(run, 2) > square(run, 1)).count();
    println!("smoothed, 17 states: NEES {nees:.2} with {error:.2}; rms {ratio:.3} of the filter's, worse in {worse}");
    assert!((nees - 17.0).abs() < 3.0 * error && error < 0.05 * 17.0, "{nees} {error}");
    assert!(ratio < 0.7 && worse <= 2, "{ratio} {worse}");
}
