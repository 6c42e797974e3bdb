//! A part of a large log: some columns, a range of time, every nth row; and what is offered where the whole does not fit.

use drivescope_import::{ImportError, Keep, Log};

/// What of CSV files is read.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct PartArgs {
    /// Columns of a CSV log to read beside its clock, with commas between; all without it.
    #[arg(long, value_name = "A,B,..", value_delimiter = ',')]
    columns: Vec<String>,
    /// Leave out what a CSV log has before this, s after its first row.
    #[arg(long, value_name = "S", value_parser = seconds)]
    from: Option<f64>,
    /// Leave out what a CSV log has after this, s after its first row.
    #[arg(long, value_name = "S", value_parser = seconds)]
    to: Option<f64>,
    /// Read one row in N of a CSV log, and those with values of slower sensors.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// Memory that the columns of a CSV log may take, MB; three quarters of what the system has free without it.
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    memory: Option<u64>,
}

/// Seconds of a log.
fn seconds(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.trim().parse().ok();
    value.filter(|v| v.is_finite() && *v >= 0.0).ok_or_else(|| "expected seconds after the first row, 0 or more".into())
}

impl PartArgs {
    /// The columns that are asked for.
    fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|name| name.trim()).filter(|name| !name.is_empty())
    }

    /// What the reader is told.
    ///
    /// # Errors
    /// A range of time that ends before it begins.
    pub fn keep(&self) -> Result<Keep, String> {
        let (from, to) = (self.from, self.to);
        if let (Some(from), Some(to)) = (from, to)
            && from >= to
        {
            return Err(format!("--from {from} --to {to}: expected a range of time that ends after it begins"));
        }
        let columns = self.names().map(str::to_owned).collect();
        let memory = self.memory.map(|mega| mega * 1_000_000).or_else(|| free().map(|bytes| bytes / 4 * 3));
        Ok(Keep { columns, from, to, every: self.every.unwrap_or(1) as usize, memory })
    }

    /// Refuse parts that nothing was taken by: of files that are read whole only, and columns that no file has.
    ///
    /// # Errors
    /// One sentence that names the option and the file.
    pub fn check(&self, log: &Log) -> Result<(), String> {
        let asked = [
            (!self.columns.is_empty(), "--columns"),
            (self.from.is_some(), "--from"),
            (self.to.is_some(), "--to"),
            (self.every.is_some_and(|n| n > 1), "--every"),
        ];
        let Some((_, option)) = asked.into_iter().find(|(is_asked, _)| *is_asked) else { return Ok(()) };
        if let Some(table) = log.tables.iter().find(|t| t.format != "CSV") {
            let (name, format) = (&table.name, table.format);
            return Err(format!("{option}: parts are taken of CSV files only, and {name} is {format}; read it whole"));
        }
        let has = |name: &str| {
            let text = |t: &drivescope_import::Table| t.text_columns.iter().any(|c| c.name == name);
            log.tables.iter().any(|t| t.column(name).is_some() || text(t))
        };
        match self.names().find(|name| !has(name)) {
            Some(name) => Err(format!(
                "--columns: the log has no column `{name}`; `drivescope info` without it names all columns"
            )),
            None => Ok(()),
        }
    }
}

/// The sentence of an error; of a file that does not fit with the options that make it fit.
pub fn sentence(error: ImportError) -> String {
    let text = error.to_string();
    let with = |options: String| format!("{}: {options}.", text.trim_end_matches('.'));
    match &error {
        ImportError::TooLarge { offer, .. } => {
            let columns = (offer.columns > 0).then(|| "`--columns A,B,..`".to_owned());
            let to = (offer.seconds >= 1.0).then(|| format!("`--to {}`", offer.seconds as u64));
            let options: Vec<String> = columns.into_iter().chain(to).collect();
            let comma = if options.is_empty() { "" } else { " or " };
            with(format!("{}{comma}`--every {}`", options.join(", "), offer.every))
        }
        ImportError::OutOfMemory { .. } => with("`--columns A,B,..`, `--from S --to S` or `--every N`".into()),
        _ => text,
    }
}

/// Bytes of memory that programs can have without others being moved out of it; `None` where the system does not say.
fn free() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilo| kilo * 1024)
}
