//! Open logs of any format as one drive, print what was found, and how fast it was read:
//! `cargo run --release --example open -- LOG [MORE ..]`.

use std::time::Instant;

use drivescope_import::{Opening, SeekSource, Source, open_log};

/// The most memory that this process has held so far, kB; 0 where the system does not tell.
fn most_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().strip_suffix(" kB")?.parse().ok()).unwrap_or(0.0)
}

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
    let at_reading = most_memory();
    let columns = log.tables.iter().flat_map(|t| &t.columns);
    let kept: usize = columns.map(|c| 8 * c.values.capacity()).sum();
    for table in &log.tables {
        eprintln!("{} {}: {} rows of {} columns", table.format, table.part, table.rows, table.columns.len());
    }
    let start = Instant::now();
    let (_, report) = open_log(log, None)?;
    let mapped = start.elapsed().as_secs_f64();
    println!("{}", serde_json::to_string_pretty(&report)?);
    println!("read {:.1} MB/s ({read:.3} s), mapped in {mapped:.3} s", bytes as f64 / 1e6 / read);
    println!("columns {:.1} MB, {:.2} bytes per byte of file", kept as f64 / 1e6, kept as f64 / bytes as f64);
    println!("most memory {:.1} MB when read, {:.1} MB when mapped", at_reading / 1e3, most_memory() / 1e3);
    Ok(())
}
