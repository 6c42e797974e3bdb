//! Laws that every estimator obeys, run over all of them. A failure means: state that leaks between runs or depends on
//! how a run is cut up, an unused sensor that moves time, a NaN that enters a state, or a range that is not checked.
#![allow(clippy::unwrap_used)]

use drivescope_drive::channel::{Record, Series};
use drivescope_drive::drive::{Drive, Epoch, EpochCursor};
use drivescope_drive::param::{Kind, Params};
use drivescope_drive::signals::{AccelArray, Range};
use drivescope_drive::vehicle::VehicleParams;
use drivescope_estimation::estimator::{Estimator, Run, run};
use drivescope_tests::built_in;
use serde_json::json;

/// SplitMix64: enough randomness for hostile data, the same in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }
    fn hostile(&mut self, value: f64) -> f64 {
        match self.below(12) {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => -1e300,
            3 => 1e9,
            4 => -value,
            5 => 0.0,
            6 => value * 1000.0,
            _ => value,
        }
    }
}

fn spoil<R: Record>(record: Option<R>, random: &mut Random) -> Option<R> {
    let record = record?;
    let mut row = [0.0; drivescope_drive::channel::MAX_COLUMNS];
    record.write(&mut row[..R::COLUMNS.len()]);
    let mut spoiled = row;
    for value in &mut spoiled[..R::COLUMNS.len()] {
        *value = random.hostile(*value);
    }
    (random.below(10) > 0).then(|| R::read(|c| spoiled[c]))
}

fn bits(series: &Series) -> Vec<u64> {
    let columns = (0..series.schema().len()).flat_map(|c| series.column_at(c).iter().map(|v| v.to_bits()));
    series.time().iter().map(|t| t.to_bits()).chain(columns).collect()
}

fn whole<E: Estimator>(drive: &Drive, params: &E::Params) -> Series {
    run::<E>(drive, params, None).unwrap_or_else(|e| panic!("{}: {e}", E::NAME)).into_series()
}

fn the_same_drive_gives_the_same_bits<E: Estimator>(drive: &Drive, params: &E::Params) {
    assert!(bits(&whole::<E>(drive, params)) == bits(&whole::<E>(drive, params)), "{}", E::NAME);
}

fn a_run_in_pieces_gives_the_same_bits_as_one_in_one_go<E: Estimator>(drive: &Drive, params: &E::Params) {
    let mut pieces = Run::<E>::new(drive, params, None).unwrap();
    let mut size = 1;
    while !pieces.advance(drive, size).unwrap() {
        size = size % 97 + 13;
    }
    assert!(bits(&pieces.into_series()) == bits(&whole::<E>(drive, params)), "{}", E::NAME);
}

fn a_sensor_that_is_not_used_changes_nothing<E: Estimator>(drive: &Drive, params: &E::Params) {
    let mut more = drive.clone();
    let (start, end) = drive.span().unwrap();
    let mut t = start + 0.0031;
    while t < end {
        more.range.push(t, Range { range_1: 1.0, ..Range::default() }).unwrap();
        if drive.accel_array.is_empty() {
            more.accel_array.push(t, AccelArray::default()).unwrap();
        }
        t += 0.0173;
    }
    assert!(bits(&whole::<E>(&more, params)) == bits(&whole::<E>(drive, params)), "{}", E::NAME);
}

fn a_parameter_outside_its_range_is_refused<E: Estimator>(drive: &Drive) {
    for spec in E::Params::SPECS {
        let bad = match spec.kind {
            Kind::Number { max, .. } | Kind::Optional { max, .. } => json!(max * 2.0 + 1.0),
            Kind::Toggle { .. } => json!("perhaps"),
            Kind::Choice { .. } => json!("no such choice"),
        };
        assert!(E::Params::from_json(&json!({ spec.name: bad })).is_err(), "{}: {}", E::NAME, spec.name);
        assert!(!spec.doc.is_empty() && !spec.source.is_empty(), "{}: {} says what and whence", E::NAME, spec.name);
    }
    let mut params = E::Params::default();
    if let Some(index) = E::Params::SPECS.iter().position(|s| matches!(s.kind, Kind::Number { .. })) {
        params.put(index, drivescope_drive::param::ParamValue::Number(f64::NAN));
        assert!(Run::<E>::new(drive, &params, None).is_err(), "{}: NaN passed the range check", E::NAME);
    }
}

/// Every value that comes out is a number or "no value", sigmas and statistics are not negative.
fn check_row<E: Estimator>(estimate: &E::Estimate, time: f64) {
    let mut row = vec![0.0; E::Estimate::COLUMNS.len()];
    estimate.write(&mut row);
    for (column, value) in E::Estimate::COLUMNS.iter().zip(row) {
        assert!(!value.is_infinite(), "{} {} is {value} at {time}", E::NAME, column.name);
        if column.sigma_of.is_some() || column.nis.is_some() {
            assert!(value.is_nan() || value >= 0.0, "{} {} is {value} at {time}", E::NAME, column.name);
        }
    }
}

fn hostile_samples_never_panic_and_never_stay<E: Estimator>(drive: &Drive, params: &E::Params) {
    for seed in 0..6 {
        let mut random = Random(seed);
        let mut estimator = E::new(params, &VehicleParams::default(), &drive.start());
        let mut cursor = EpochCursor::default();
        let mut shift = 0.0;
        let step = |estimator: &mut E, epoch: &Epoch| {
            if let Ok(Some(estimate)) = estimator.step(epoch) {
                check_row::<E>(&estimate, epoch.time);
            }
        };
        for count in 0..4000 {
            let Some(mut epoch) = cursor.next(drive) else { break };
            if count > 600 && random.below(4) == 0 {
                epoch.imu = spoil(epoch.imu, &mut random);
                epoch.mag = spoil(epoch.mag, &mut random);
                epoch.wheels = spoil(epoch.wheels, &mut random);
                epoch.steering = spoil(epoch.steering, &mut random);
                epoch.gnss = spoil(epoch.gnss, &mut random);
                epoch.baro = spoil(epoch.baro, &mut random);
                if epoch.accel_array.is_some() {
                    epoch.accel_array = spoil(epoch.accel_array, &mut random);
                }
                match random.below(40) {
                    0 => epoch.time = f64::NAN,
                    1 => epoch.time -= 10.0,
                    2 => shift += 60.0,
                    _ => {}
                }
            }
            epoch.time += shift;
            step(&mut estimator, &epoch);
        }
        // Clean data again: a column with values in the last five seconds of a clean run has one there.
        let end = drive.span().unwrap().1;
        let mut alive = vec![false; E::Estimate::COLUMNS.len()];
        let mut row = alive.iter().map(|_| 0.0).collect::<Vec<f64>>();
        while let Some(mut epoch) = cursor.next(drive) {
            let is_late = epoch.time > end - 5.0;
            epoch.time += shift;
            if let Ok(Some(estimate)) = estimator.step(&epoch) {
                check_row::<E>(&estimate, epoch.time);
                estimate.write(&mut row);
                alive.iter_mut().zip(&row).for_each(|(a, v)| *a |= is_late && v.is_finite());
            }
        }
        let clean = whole::<E>(drive, params);
        let first = clean.time().partition_point(|&t| t <= end - 5.0);
        for (index, column) in E::Estimate::COLUMNS.iter().enumerate() {
            let was_alive = clean.column_at(index)[first..].iter().any(|v| v.is_finite());
            assert!(alive[index] || !was_alive, "{} {} stays without a value (seed {seed})", E::NAME, column.name);
        }
    }
}

/// A larger noise parameter must not make the filter surer of the quantity it measures.
fn more_noise_never_makes_it_surer<E: Estimator>(drive: &Drive, param: &str, sigma: &str, factor: f64) {
    let spec = E::Params::SPECS.iter().find(|s| s.name == param).unwrap_or_else(|| panic!("{}: {param}", E::NAME));
    let Kind::Number { default, .. } = spec.kind else { panic!("{param} is not a number") };
    let noisier = E::Params::from_json(&json!({ param: default * factor })).unwrap();
    let before = whole::<E>(drive, &E::Params::default());
    let after = run::<E>(drive, &noisier, None).unwrap().into_series();
    let mean = |s: &Series| {
        let values: Vec<f64> = s.column(sigma).unwrap().iter().copied().filter(|v| v.is_finite()).collect();
        assert!(values.len() > 100, "{} {sigma}", E::NAME);
        values.iter().sum::<f64>() / values.len() as f64
    };
    assert!(mean(&after) >= mean(&before), "{}: {param} x {factor} shrinks {sigma}", E::NAME);
}

/// The laws that hold for every setting of an estimator: one that chooses between filters has them for each.
macro_rules! run_laws {
    ($name:ident, $estimator:ty, $params:tt) => {
        run_laws!($name, $estimator, $params, built_in);
    };
    ($name:ident, $estimator:ty, $params:tt, $drive:ident) => {
        mod $name {
            use super::*;
            fn params() -> <$estimator as Estimator>::Params {
                Params::from_json(&json!($params)).unwrap()
            }
            #[test]
            fn is_deterministic() {
                the_same_drive_gives_the_same_bits::<$estimator>(&$drive(40.0, 7), &params());
            }
            #[test]
            fn steps_like_it_runs() {
                a_run_in_pieces_gives_the_same_bits_as_one_in_one_go::<$estimator>(&$drive(40.0, 7), &params());
            }
            #[test]
            fn ignores_what_it_does_not_use() {
                a_sensor_that_is_not_used_changes_nothing::<$estimator>(&$drive(40.0, 7), &params());
            }
            #[test]
            fn survives_hostile_samples() {
                hostile_samples_never_panic_and_never_stay::<$estimator>(&$drive(90.0, 7), &params());
            }
        }
    };
}

macro_rules! estimator_laws {
    (@noise $estimator:ty, ) => {};
    (@noise $estimator:ty, $( $param:literal => $sigma:literal ),+) => {
        #[test]
        fn more_noise_is_never_more_certainty() {
            for (param, sigma) in [ $( ($param, $sigma) ),+ ] {
                more_noise_never_makes_it_surer::<$estimator>(&built_in(60.0, 7), param, sigma, 3.0);
            }
        }
    };
    ($name:ident, $estimator:ty, [$($param:literal => $sigma:literal),*]) => {
        mod $name {
            use super::*;
            run_laws!(default, $estimator, {});
            #[test]
            fn refuses_parameters_out_of_range() {
                a_parameter_outside_its_range_is_refused::<$estimator>(&built_in(2.0, 7));
            }
            estimator_laws!(@noise $estimator, $( $param => $sigma ),*);
        }
    };
}

estimator_laws!(slope, drivescope_estimation::slope::Slope, ["wheel_sigma" => "speed_sigma", "slope_wheel_sigma" => "slope_sigma"]);
estimator_laws!(orientation, drivescope_estimation::orientation::Orientation, ["field_sigma" => "yaw_sigma"]);
estimator_laws!(motion_mode, drivescope_estimation::motion_mode::MotionModeDetector, []);
estimator_laws!(gnss_ins, drivescope_estimation::gnss_ins::GnssIns, ["gnss_scale" => "north_sigma"]);
estimator_laws!(attitude, drivescope_estimation::attitude::Attitude, ["accel_sigma" => "roll_sigma"]);

mod gnss_ins_variants {
    use super::*;
    use drivescope_estimation::gnss_ins::GnssIns;
    run_laws!(smoothed, GnssIns, { "smoother": "rts", "odometer_scale": true });
    run_laws!(with_fading_biases, GnssIns, { "smoother": "rts", "accel_bias_time": 300.0, "gyro_bias_time": 600.0 });
}

/// The beginning of a drive whose receiver gives the ranges of single satellites.
fn with_satellites(seconds: f64) -> Drive {
    let spec = drivescope_simulation::named("table1").unwrap();
    let mut simulation = drivescope_simulation::Simulation::new(&spec, Some(7)).unwrap();
    simulation.advance(seconds);
    simulation.drive().clone()
}

macro_rules! satellite_laws {
    ($name:ident, $estimator:ty, $params:tt) => {
        mod $name {
            use super::*;
            fn params() -> <$estimator as Estimator>::Params {
                Params::from_json(&json!($params)).unwrap()
            }
            #[test]
            fn is_deterministic_and_steps_like_it_runs() {
                the_same_drive_gives_the_same_bits::<$estimator>(&with_satellites(40.0), &params());
                a_run_in_pieces_gives_the_same_bits_as_one_in_one_go::<$estimator>(&with_satellites(40.0), &params());
            }
            #[test]
            fn ignores_what_it_does_not_use() {
                a_sensor_that_is_not_used_changes_nothing::<$estimator>(&with_satellites(40.0), &params());
            }
            #[test]
            fn survives_hostile_samples() {
                hostile_samples_never_panic_and_never_stay::<$estimator>(&with_satellites(90.0), &params());
            }
        }
    };
}

satellite_laws!(gnss, drivescope_estimation::gnss::GnssReceiver, {});
satellite_laws!(gnss_ins_tight, drivescope_estimation::gnss_ins::GnssIns, { "coupling": "tight", "smoother": "rts" });

mod orientation_variants {
    use super::*;
    use drivescope_estimation::orientation::Orientation;
    run_laws!(triad, Orientation, {"variant": "triad"});
    run_laws!(ekf_model, Orientation, {"variant": "ekf_model"});
    run_laws!(ekf_nomodel, Orientation, {"variant": "ekf_nomodel"});
    run_laws!(model, Orientation, {"variant": "model"});
    run_laws!(road, Orientation, {"variant": "road"});
    run_laws!(robust, Orientation, {"variant": "robust"});
    run_laws!(robust_ax, Orientation, {"variant": "robust_ax"});
}

/// The first `seconds` of the two-corner drive with the six-accelerometer disk.
fn disk_drive(seconds: f64, seed: u64) -> Drive {
    let spec = drivescope_simulation::named("u_drive_disk").unwrap();
    let mut simulation = drivescope_simulation::Simulation::new(&spec, Some(seed)).unwrap();
    simulation.advance(seconds);
    simulation.drive().clone()
}

estimator_laws!(land_ins, drivescope_estimation::land_ins::LandIns, ["zupt_sigma" => "v_north_sigma"]);
estimator_laws!(stationarity, drivescope_estimation::stationarity::Stationarity, []);

mod land_ins_variants {
    use super::*;
    use drivescope_estimation::land_ins::LandIns;
    run_laws!(with_everything, LandIns, {"gnss": true, "wheel": true});
}

mod disk {
    use super::*;
    use drivescope_estimation::gyro_free::GyroFree;
    use drivescope_estimation::land_ins::LandIns;
    use drivescope_estimation::motion_mode::MotionModeDetector;
    run_laws!(gyro_free, GyroFree, {}, disk_drive);
    run_laws!(motion_mode, MotionModeDetector, {}, disk_drive);
    run_laws!(land_ins, LandIns, {}, disk_drive);

    #[test]
    fn refuses_parameters_out_of_range() {
        a_parameter_outside_its_range_is_refused::<GyroFree>(&disk_drive(2.0, 7));
    }
}
