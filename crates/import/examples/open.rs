//! Open logs of any format as one drive, print what was found, and how fast it was read:
//! `cargo run --release --example open -- LOG [MORE ..]`.

use std::time::Instant;

use drivescope_import::{Opening, SeekSource, Source, open_log};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sources: Vec<Box<dyn Source>> = Vec::new();
    let mut bytes = 0;
    for path in std::env::args().skip(1) {
        let source = SeekSource::new(&path, std::fs::File::open(&path)?)?;
        bytes += source.len();
        sources.push(Box::new(source));
    }
    let start = Instant::now();
    let mut opening = Opening::new(sources)?;
    while opening.step()? {}
    let log = opening.finish()?;
    let read = start.elapsed().as_secs_f64();
    for table in &log.tables {
        eprintln!("{} {}: {} rows of {} columns", table.format, table.part, table.rows, table.columns.len());
    }
    let start = Instant::now();
    let (_, report) = open_log(log, None)?;
    let mapped = start.elapsed().as_secs_f64();
    println!("{}", serde_json::to_string_pretty(&report)?);
    println!("read {:.1} MB/s ({read:.3} s), mapped in {mapped:.3} s", bytes as f64 / 1e6 / read);
    Ok(())
}
