//! What a step, a megabyte of CSV and an hour of driving cost. The same work runs natively (`drivescope bench`) and in a
//! browser (the door's `bench_json`); `cargo xtask bench` sets both side by side.

mod navigation;

use drivescope_drive::channel::{Channel, Record};
use drivescope_drive::csv::write_drive;
use drivescope_drive::drive::Drive;
use drivescope_estimation::registry::{ESTIMATORS, run_by_name};
use drivescope_import::{CsvReader, open_table};
use serde::Serialize;
use serde_json::Value;

/// Copies of the ten-minute drive that make an hour.
const COPIES: usize = 6;
/// Bytes fed to the reader at a time.
const SLICE: usize = 1 << 20;

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
    let report = bench(&clock, if quick { 2 } else { 7 })?;
    serde_json::to_string_pretty(&report).map_err(|e| e.to_string())
}

fn timed<T>(clock: &impl Fn() -> f64, work: impl FnOnce() -> T) -> (f64, T) {
    let begin = clock();
    let result = work();
    (clock() - begin, result)
}

fn estimate_all(drive: &Drive) -> Result<(), String> {
    ESTIMATORS
        .iter()
        .filter(|e| e.needs.iter().all(|n| !n.required || drive.has(n.signal)))
        .try_for_each(|e| run_by_name(e.name, drive, &Value::Null, None).map(drop))
        .map_err(|e| e.to_string())
}

fn bench(clock: &impl Fn() -> f64, rounds: usize) -> Result<Report, String> {
    let entry = drivescope_simulation::drives().first().ok_or("there is no built-in drive")?;
    let spec = drivescope_simulation::named(entry.name).ok_or("the first built-in drive cannot be read")?;
    let (simulated, drive) = timed(clock, || drivescope_simulation::simulate(&spec, None));
    let drive = drive.map_err(|e| e.to_string())?;
    let mut entries = vec![Entry { name: "simulate ten minutes".into(), unit: "s", samples: vec![simulated] }];
    for e in ESTIMATORS.iter().filter(|e| e.needs.iter().all(|n| !n.required || drive.has(n.signal))) {
        let mut samples = Vec::new();
        for _ in 0..rounds {
            let (time, run) = timed(clock, || run_by_name(e.name, &drive, &Value::Null, None));
            samples.push(time * 1e9 / run.map_err(|e| e.to_string())?.series().len() as f64);
        }
        entries.push(Entry { name: format!("step {}", e.name), unit: "ns", samples });
    }
    entries.extend(navigation::entries(clock, &drive, rounds)?);
    let together = (0..rounds).map(|_| {
        let (time, outcome) = timed(clock, || estimate_all(&drive));
        outcome.map(|()| time)
    });
    let samples = together.collect::<Result<_, _>>()?;
    entries.push(Entry { name: "all estimators over ten minutes".into(), unit: "s", samples });

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
