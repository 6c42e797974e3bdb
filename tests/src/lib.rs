//! Helpers of the tests: where the specifications' case logs and the real logs are, reading them, and comparing columns.

pub mod mcap;
pub mod svg;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_import::{CsvReader, open_table};
use drivescope_simulation::Simulation;

/// A file of the folder `shared` that lies beside the project; `None`, after one line that says so, where it is absent.
pub fn shared(file: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared").join(file);
    if path.exists() {
        return Some(path);
    }
    println!("SKIPPED: {file} is not on this machine");
    None
}

/// The bytes of a file, unpacked if it ends in `.gz`.
pub fn bytes(path: &Path) -> Vec<u8> {
    let mut file = File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut bytes = Vec::new();
    let read = if path.extension().is_some_and(|e| e == "gz") {
        flate2::read::GzDecoder::new(file).read_to_end(&mut bytes)
    } else {
        file.read_to_end(&mut bytes)
    };
    read.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    bytes
}

/// A log, opened the way the page opens it, without a mapping.
pub fn open(path: &Path) -> Drive {
    open_bytes(&path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()), &bytes(path))
}

/// A log in memory, opened the way the page opens it.
pub fn open_bytes(name: &str, bytes: &[u8]) -> Drive {
    let mut reader = CsvReader::new(name);
    bytes.chunks(1 << 16).for_each(|slice| reader.feed(slice).unwrap_or_else(|e| panic!("{e}")));
    let table = reader.finish().unwrap_or_else(|e| panic!("{e}"));
    open_table(table, None).unwrap_or_else(|e| panic!("{e}")).0
}

/// A table of numbers, column by column: what a reference implementation wrote.
pub fn table(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let text = String::from_utf8(bytes(path)).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let mut columns = vec![Vec::new(); names.len()];
    for line in lines {
        for (column, cell) in columns.iter_mut().zip(line.split(',')) {
            column.push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    names.into_iter().map(String::from).zip(columns).collect()
}

/// The rows of `series` at the times of `times`, matched to a microsecond; panics where a time has no row.
pub fn rows_at(series: &Series, times: &[f64]) -> Vec<usize> {
    let time = series.time();
    times
        .iter()
        .map(|&t| {
            let row = time.partition_point(|&x| x < t - 1e-6);
            assert!(row < time.len() && (time[row] - t).abs() <= 1e-6, "no estimate at {t} s");
            row
        })
        .collect()
}

/// Largest amount by which `series` leaves `expected` at `times`, in units of `absolute + relative * |expected|`.
pub fn worst(
    series: &Series,
    column: &str,
    times: &[f64],
    expected: &[f64],
    relative: f64,
    absolute: f64,
    circular: bool,
) -> f64 {
    let values = series.column(column).unwrap_or_else(|| panic!("there is no column {column}"));
    let rows = rows_at(series, times);
    rows.iter()
        .zip(expected)
        .map(|(&row, &e)| {
            let difference = values[row] - e;
            let difference = if circular { drivescope_drive::frames::wrap_angle(difference) } else { difference };
            assert!(difference.is_finite(), "{column}: {} against {e}", values[row]);
            difference.abs() / (absolute + relative * e.abs())
        })
        .fold(0.0, f64::max)
}

/// The first `seconds` of the built-in drive, simulated with a seed.
pub fn built_in(seconds: f64, seed: u64) -> Drive {
    let name = drivescope_simulation::drives()[0].name;
    let spec = drivescope_simulation::named(name).unwrap_or_else(|| panic!("{name} is listed but not there"));
    let mut simulation = Simulation::new(&spec, Some(seed)).unwrap_or_else(|e| panic!("{e}"));
    simulation.advance(seconds);
    simulation.drive().clone()
}

/// Root mean square.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0usize), |(s, n), v| (s + v * v, n + 1));
    (sum / count as f64).sqrt()
}
