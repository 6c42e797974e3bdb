//! What a step, a megabyte of CSV and an hour of driving cost. The same work runs natively (`drivescope bench`) and in a
//! browser (the door's `bench_json`); `cargo xtask bench` sets both side by side.

mod navigation;

use std::hint::black_box;

use drivescope_drive::channel::{Channel, Record};
use drivescope_drive::csv::write_drive;
use drivescope_drive::drive::{Drive, Epoch};
use drivescope_drive::frames::body_to_nav;
use drivescope_drive::param::Choice;
use drivescope_estimation::estimator::{Estimator, EstimatorError};
use drivescope_estimation::land_ins::{LandIns, LandInsParams};
use drivescope_estimation::magnetometer_calibration::calibrate;
use drivescope_estimation::motion_mode::{MotionModeDetector, MotionModeParams};
use drivescope_estimation::orientation::{Orientation, OrientationParams, Variant};
use drivescope_estimation::registry::{ESTIMATORS, run_by_name};
use drivescope_import::{CsvReader, open_table};
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::Value;

/// Copies of the ten-minute drive that make an hour.
const COPIES: usize = 6;
/// Epochs that a filter alone is stepped through at a time.
const STEPPED: usize = 20_000;
/// Bytes fed to the reader at a time.
const SLICE: usize = 1 << 20;

/// Earth's field at the built-in drives' place, north, east, down, uT.
const EARTH: Vector3<f64> = Vector3::new(30.1124, -4.2270, 40.1258);

/// One thing that was measured, several times.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// What.
    pub name: String,
    /// Unit of the samples.
    pub unit: &'static str,
    /// Every measurement.
    pub samples: Vec<f64>,
}

/// Everything that was measured.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// One entry per measurement.
    pub entries: Vec<Entry>,
}

fn repeat<R: Record>(channel: &Channel<R>, period: f64) -> Result<Channel<R>, String> {
    let mut out = Channel::default();
    for copy in 0..COPIES {
        for (time, sample) in channel.iter() {
            out.push(time + copy as f64 * period, sample).map_err(|e| e.to_string())?;
        }
    }
    Ok(out)
}

/// The drive `COPIES` times in a row, without its truth.
fn hour(drive: &Drive) -> Result<Drive, String> {
    let (start, end) = drive.span().ok_or("the built-in drive is empty")?;
    let period = ((end - start) * 100.0).round() / 100.0 + 0.01;
    Ok(Drive {
        name: "hour".into(),
        imu: repeat(&drive.imu, period)?,
        mag: repeat(&drive.mag, period)?,
        wheels: repeat(&drive.wheels, period)?,
        steering: repeat(&drive.steering, period)?,
        gnss: repeat(&drive.gnss, period)?,
        baro: repeat(&drive.baro, period)?,
        accel_array: repeat(&drive.accel_array, period)?,
        range: repeat(&drive.range, period)?,
        vehicle: drive.vehicle.clone(),
        rear_axle: drive.rear_axle,
        unix_zero: drive.unix_zero,
        disk: drive.disk,
        ..Drive::default()
    })
}

fn read(text: &[u8]) -> Result<Drive, String> {
    let mut reader = CsvReader::new("hour.csv");
    for slice in text.chunks(SLICE) {
        reader.feed(slice).map_err(|e| e.to_string())?;
    }
    let table = reader.finish().map_err(|e| e.to_string())?;
    Ok(open_table(table, None).map_err(|e| e.to_string())?.0)
}

/// Measure, and report as JSON. `clock` gives seconds; `quick` measures less often.
///
/// # Errors
/// One sentence.
pub fn bench_json(clock: impl Fn() -> f64, quick: bool) -> Result<String, String> {
    let report = bench(&clock, if quick { 4 } else { 16 })?;
    serde_json::to_string_pretty(&report).map_err(|e| e.to_string())
}

fn timed<T>(clock: &impl Fn() -> f64, work: impl FnOnce() -> T) -> (f64, T) {
    let begin = clock();
    let result = work();
    (clock() - begin, result)
}

/// Cost of an epoch that gives an estimate, ns, without merging channels and without keeping columns.
fn filter_steps<E: Estimator>(
    clock: &impl Fn() -> f64,
    drive: &Drive,
    params: &E::Params,
    rounds: usize,
) -> Result<Vec<f64>, String> {
    let epochs: Vec<Epoch> = drive.epochs().take(STEPPED).collect();
    let vehicle = drive.vehicle.clone().unwrap_or_default();
    let mut samples = Vec::new();
    for _ in 0..3 * rounds {
        let mut estimator = E::new(params, &vehicle, &drive.start());
        let (time, estimates) = timed(clock, || {
            epochs.iter().try_fold(0usize, |n, epoch| {
                // What is put out has to be made even though nothing reads it.
                Ok::<_, EstimatorError>(n + usize::from(black_box(estimator.step(epoch)?).is_some()))
            })
        });
        samples.push(time * 1e9 / estimates.map_err(|e| e.to_string())? as f64);
    }
    Ok(samples)
}

/// The shortest built-in drive with a six-accelerometer disk, for estimators that need one.
fn disk_drive() -> Result<Drive, String> {
    let spec = drivescope_simulation::named("u_drive_disk").ok_or("the drive with the disk cannot be read")?;
    drivescope_simulation::simulate(&spec, None).map_err(|e| e.to_string())
}

fn estimate_all(drive: &Drive) -> Result<(), String> {
    ESTIMATORS
        .iter()
        .filter(|e| e.can_run(drive))
        .try_for_each(|e| run_by_name(e.name, drive, &Value::Null, None).map(drop))
        .map_err(|e| e.to_string())
}

/// Readings of a magnetometer with iron round it, turned through every attitude: what a full calibration has to fit.
fn readings(count: usize) -> Vec<Vector3<f64>> {
    (0..count)
        .map(|k| {
            let turn = k as f64 * 0.05;
            let field = body_to_nav(1.3 * turn, (0.37 * turn).sin(), turn).transpose() * EARTH;
            Vector3::new(1.04 * field.x + 0.02 * field.y + 12.0, 0.02 * field.x + 0.96 * field.y - 8.0, field.z + 5.0)
                + Vector3::new((7.0 * turn).sin(), (11.0 * turn).sin(), (13.0 * turn).sin()) * 0.4
        })
        .collect()
}

fn bench(clock: &impl Fn() -> f64, rounds: usize) -> Result<Report, String> {
    let entry = drivescope_simulation::drives().first().ok_or("there is no built-in drive")?;
    let spec = drivescope_simulation::named(entry.name).ok_or("the first built-in drive cannot be read")?;
    let (simulated, drive) = timed(clock, || drivescope_simulation::simulate(&spec, None));
    let drive = drive.map_err(|e| e.to_string())?;
    let mut entries = vec![Entry { name: "simulate ten minutes".into(), unit: "s", samples: vec![simulated] }];
    let disk = disk_drive()?;
    let first = entries.len();
    // `gnss` needs ranges of single satellites; `navigation` measures it.
    let steppable: Vec<_> = ESTIMATORS
        .iter()
        .filter_map(|e| Some((e, [&drive, &disk].into_iter().find(|drive| e.can_run(drive))?)))
        .collect();
    entries.extend(steppable.iter().map(|(e, _)| Entry {
        name: format!("step {}", e.name),
        unit: "ns",
        samples: Vec::new(),
    }));
    // In turn: a slow moment of the machine falls on every estimator.
    for _ in 0..rounds {
        for ((e, drive), entry) in steppable.iter().zip(&mut entries[first..]) {
            let (time, run) = timed(clock, || run_by_name(e.name, drive, &Value::Null, None));
            entry.samples.push(time * 1e9 / run.map_err(|e| e.to_string())?.series().len() as f64);
        }
    }
    for variant in [Variant::EkfModel, Variant::Robust, Variant::RobustAx] {
        let params = OrientationParams { variant, ..OrientationParams::default() };
        let samples = filter_steps::<Orientation>(clock, &drive, &params, rounds)?;
        entries.push(Entry { name: format!("filter alone, orientation {}", variant.name()), unit: "ns", samples });
    }
    let modes = filter_steps::<MotionModeDetector>(clock, &drive, &MotionModeParams::default(), rounds)?;
    entries.push(Entry { name: "filter alone, motion_mode".into(), unit: "ns", samples: modes });
    let land = filter_steps::<LandIns>(clock, &drive, &LandInsParams::default(), rounds)?;
    entries.push(Entry { name: "filter alone, land_ins".into(), unit: "ns", samples: land });
    entries.extend(navigation::entries(clock, &drive, rounds)?);
    let together = (0..rounds).map(|_| {
        let (time, outcome) = timed(clock, || estimate_all(&drive));
        outcome.map(|()| time)
    });
    let samples = together.collect::<Result<_, _>>()?;
    entries.push(Entry { name: "all estimators over ten minutes".into(), unit: "s", samples });

    let readings = readings(10_000);
    let mut samples = Vec::new();
    for _ in 0..rounds {
        let (time, outcome) = timed(clock, || calibrate(&readings, &EARTH, None));
        outcome.result.map_err(|refusal| refusal.to_string())?;
        samples.push(time * 1e3);
    }
    entries.push(Entry { name: "calibrate 10,000 magnetometer readings".into(), unit: "ms", samples });

    let mut text = Vec::new();
    write_drive(&hour(&drive)?, &mut text).map_err(|e| e.to_string())?;
    let (mut parse, mut whole) = (Vec::new(), Vec::new());
    for _ in 0..rounds.min(4) {
        let (reading, drive) = timed(clock, || read(&text));
        let drive = drive?;
        let (estimating, outcome) = timed(clock, || estimate_all(&drive));
        outcome?;
        parse.push(text.len() as f64 / 1e6 / reading);
        whole.push(reading + estimating);
    }
    entries.push(Entry {
        name: format!("read {:.0} MB of CSV", text.len() as f64 / 1e6),
        unit: "MB/s",
        samples: parse,
    });
    entries.push(Entry { name: "an hour at 100 Hz, read and estimated by all".into(), unit: "s", samples: whole });
    Ok(Report { entries })
}
