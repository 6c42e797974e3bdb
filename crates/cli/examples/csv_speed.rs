//! Reads a CSV file once for every line it is sent and prints seconds, processor seconds and rows: `csv_speed FILE
//! [THREADS]`. `tests/bench/csv_against_pandas.py` sets them beside those of pandas.

use std::io::Read as _;
use std::time::Instant;

use drivescope_import::CsvReader;

/// As the command has it.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Processor time of this process, s: its own and the system's for it, in the kernel's ticks of 10 ms; 0 where there is none.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(") ").next().unwrap_or_default().split(' ');
    fields.skip(11).take(2).filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    const USAGE: &str = "csv_speed FILE [THREADS]";
    let args: Vec<String> = std::env::args().skip(1).collect();
    let path = args.first().ok_or(USAGE)?;
    let threads: Option<usize> = args.get(1).map(|t| t.parse()).transpose()?;
    let mut slice = vec![0; 2 << 20];
    for line in std::io::stdin().lines() {
        line?;
        let (begin, before) = (Instant::now(), processor());
        let mut file = std::fs::File::open(path)?;
        let mut reader = CsvReader::new("speed.csv");
        reader.expect_bytes(file.metadata()?.len());
        threads.into_iter().for_each(|t| reader.split(t, 128 << 10));
        loop {
            let count = file.read(&mut slice)?;
            if count == 0 {
                break;
            }
            reader.feed(&slice[..count])?;
        }
        let table = reader.finish()?;
        println!("{} {:.2} {}", begin.elapsed().as_secs_f64(), processor() - before, table.rows);
    }
    Ok(())
}
