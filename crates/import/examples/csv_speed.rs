//! Reads a CSV file again and again and prints the seconds of each time, one a line: `csv_speed FILE ROUNDS`.
//! `tests/bench/csv_against_pandas.py` sets them beside those of pandas.

use std::time::Instant;

use drivescope_import::{IoSource, read_csv};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let path = args.next().ok_or("csv_speed FILE ROUNDS")?;
    let rounds: usize = args.next().ok_or("csv_speed FILE ROUNDS")?.parse()?;
    for _ in 0..rounds {
        let begin = Instant::now();
        let file = std::fs::File::open(&path)?;
        let length = file.metadata()?.len();
        let table = read_csv(&mut IoSource::new(file, Some(length)), "speed.csv")?;
        let sum: f64 = table.columns.iter().filter_map(|c| c.values.last()).sum();
        println!("{} {} {sum}", begin.elapsed().as_secs_f64(), table.rows);
    }
    Ok(())
}
