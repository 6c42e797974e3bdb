//! Reads a CSV file again and again and prints the seconds of each time, one a line: `csv_speed FILE ROUNDS [THREADS]`.
//! `tests/bench/csv_against_pandas.py` sets them beside those of pandas.

use std::io::Read as _;
use std::time::Instant;

use drivescope_import::CsvReader;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    const USAGE: &str = "csv_speed FILE ROUNDS [THREADS]";
    let args: Vec<String> = std::env::args().skip(1).collect();
    let path = args.first().ok_or(USAGE)?;
    let rounds: usize = args.get(1).ok_or(USAGE)?.parse()?;
    let threads: Option<usize> = args.get(2).map(|t| t.parse()).transpose()?;
    let mut slice = vec![0; 2 << 20];
    for _ in 0..rounds {
        let begin = Instant::now();
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
        let sum: f64 = table.columns.iter().filter_map(|c| c.values.last()).sum();
        println!("{} {} {sum}", begin.elapsed().as_secs_f64(), table.rows);
    }
    Ok(())
}
