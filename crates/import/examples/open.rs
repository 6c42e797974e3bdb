//! Open a CSV log, print what was found, and how fast it was read: `cargo run --example open -- LOG.csv`.

use std::time::Instant;

use drivescope_import::{IoSource, open_table, read_csv};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected the path of a CSV file")?;
    let file = std::fs::File::open(&path)?;
    let bytes = file.metadata()?.len();
    let start = Instant::now();
    let table = read_csv(&mut IoSource::new(file, Some(bytes)), &path)?;
    let read = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let (_, report) = open_table(table, None)?;
    let mapped = start.elapsed().as_secs_f64();
    println!("{}", serde_json::to_string_pretty(&report)?);
    println!("read {:.1} MB/s ({read:.3} s), mapped in {mapped:.3} s", bytes as f64 / 1e6 / read);
    Ok(())
}
