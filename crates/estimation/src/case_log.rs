//! Logs of the specifications and of real drives for the tests: a CSV with canonical names, as it stands, into a drive.

use std::io::Read;
use std::path::PathBuf;

use drivescope_drive::channel::{Channel, Record, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::satellites::{RAW_COLUMNS, RawGnss, Satellite};
use drivescope_drive::truth::truth_column;

/// A file of the shared material; `None`, with one line printed, where it is absent.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let full = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(path);
    if full.exists() {
        return Some(full);
    }
    println!("SKIPPED: ../shared/{path} is not here");
    None
}

/// The columns of a CSV file, plain or gzipped, by name; a cell that is not a number is NaN.
pub(crate) struct Table {
    pub(crate) names: Vec<String>,
    pub(crate) columns: Vec<Vec<f64>>,
}

impl Table {
    pub(crate) fn read(path: &std::path::Path) -> Self {
        let bytes = std::fs::read(path).unwrap();
        let mut text = String::new();
        if path.extension().is_some_and(|e| e == "gz") {
            flate2::read::GzDecoder::new(&bytes[..]).read_to_string(&mut text).unwrap();
        } else {
            text = String::from_utf8(bytes).unwrap();
        }
        let mut lines = text.lines();
        let names: Vec<String> = lines.next().unwrap().split(',').map(str::to_string).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for line in lines {
            for (column, cell) in columns.iter_mut().zip(line.split(',')) {
                column.push(cell.parse().unwrap_or(f64::NAN));
            }
        }
        Self { names, columns }
    }

    /// A column by name.
    pub(crate) fn column(&self, name: &str) -> &[f64] {
        self.find(name).unwrap_or_else(|| panic!("no column {name}"))
    }

    fn find(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|n| n == name).map(|i| self.columns[i].as_slice())
    }

    fn channel<R: Record>(&self) -> Channel<R> {
        let sources: Vec<Option<&[f64]>> = R::COLUMNS.iter().map(|c| self.find(c.name)).collect();
        let mut channel = Channel::default();
        for (row, &t) in self.column("t").iter().enumerate() {
            let cell = |i: usize| sources[i].map_or(f64::NAN, |c: &[f64]| c[row]);
            if (0..sources.len()).any(|i| cell(i).is_finite()) {
                channel.push(t, R::read(cell)).unwrap();
            }
        }
        channel
    }

    /// The drive that the columns describe; names that are not canonical are left out.
    pub(crate) fn drive(&self) -> Drive {
        let (columns, sources): (Vec<_>, Vec<_>) = (self.names.iter())
            .filter_map(|n| Some((*truth_column(n.strip_prefix("truth_")?)?, self.column(n))))
            .unzip();
        let mut truth = Series::new(&columns);
        for (row, &t) in self.column("t").iter().enumerate() {
            let cells: Vec<f64> = sources.iter().map(|s| s[row]).collect();
            if cells.iter().any(|v| v.is_finite()) {
                truth.push(t, &cells).unwrap();
            }
        }
        Drive {
            imu: self.channel(),
            mag: self.channel(),
            wheels: self.channel(),
            steering: self.channel(),
            gnss: self.channel(),
            baro: self.channel(),
            accel_array: self.channel(),
            range: self.channel(),
            truth,
            ..Drive::default()
        }
    }
}

/// A case log of SPEC navigation with its pseudoranges: degrees of the file become radians.
pub(crate) fn navigation_case(name: &str) -> Option<Drive> {
    let mut table = Table::read(&shared(&format!("spec/navigation/{name}.csv.gz"))?);
    for (name, column) in table.names.iter().zip(&mut table.columns) {
        if name.ends_with("_lat") || name.ends_with("_lon") {
            column.iter_mut().for_each(|v| *v = v.to_radians());
        }
    }
    let mut drive = table.drive();
    drive.raw_gnss = raw_gnss(name)?;
    Some(drive)
}

/// The pseudoranges beside a case log; empty where the case has none.
fn raw_gnss(name: &str) -> Option<RawGnss> {
    let mut raw = RawGnss::default();
    if !["table1", "urban"].contains(&name) {
        return Some(raw);
    }
    let table = Table::read(&shared(&format!("spec/navigation/{name}_gnss.csv.gz"))?);
    let time = table.column("t");
    let columns = RAW_COLUMNS.map(|c| table.column(c));
    let satellites: Vec<Satellite> = (0..time.len()).map(|row| Satellite::of_cells(&columns.map(|c| c[row]))).collect();
    let mut first = 0;
    for end in 1..=time.len() {
        if end == time.len() || time[end] != time[first] {
            raw.push(time[first], &satellites[first..end]).unwrap();
            first = end;
        }
    }
    Some(raw)
}
