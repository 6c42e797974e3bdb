//! A drive as parts: how it is handed from one WebAssembly module to another, channel by channel.
//!
//! A part is whole columns under their canonical names. Put together again the parts are the drive they came from, bit for
//! bit; what does not fit together is an error.

use crate::channel::{Channel, Column, OutOfOrder, Record, Series};
use crate::disk::Disk;
use crate::drive::Drive;
use crate::param::{ParamValue, Params};
use crate::satellites::{RAW_COLUMNS, RawGnss, Satellite};
use crate::truth::truth_column;
use crate::vehicle::VehicleParams;

/// Names of the parts, in the order of [`Drive::channels`], then the truth and the raw ranges.
pub const PARTS: [&str; 10] =
    ["imu", "mag", "wheels", "steering", "gnss", "baro", "accel_array", "range", "truth", "raw_gnss"];
const TRUTH: usize = 8;
const RAW: usize = 9;

/// One channel, the truth, or the raw ranges.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// One of [`PARTS`].
    pub name: &'static str,
    /// Time of every row, s: strictly increasing, but the same for the satellites of one instant.
    pub time: Vec<f64>,
    /// Columns by their names, as long as `time`; an empty one has no value in any row.
    pub columns: Vec<(&'static str, Vec<f64>)>,
}

/// What a drive says besides its columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Head {
    /// [`Drive::name`].
    pub name: String,
    /// [`Drive::vehicle`], its parameters in the order of their declaration.
    pub vehicle: Option<Vec<f64>>,
    /// [`Drive::rear_axle`], m.
    pub rear_axle: Option<f64>,
    /// [`Drive::unix_zero`], s.
    pub unix_zero: Option<f64>,
    /// [`Drive::disk`] as its numbers.
    pub disk: Option<Vec<f64>>,
}

/// A part that does not belong to a drive.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum PartError {
    /// No part has this name, or it has come before.
    #[error("a drive has no second part and no part called `{0}`")]
    Part(String),
    /// The part has no such column, or it has come before.
    #[error("part `{part}` has no second column and no column called `{column}`")]
    Column {
        /// The part.
        part: &'static str,
        /// What was given.
        column: String,
    },
    /// A column is not as long as the times.
    #[error("part `{part}`: column `{column}` has {found} rows, expected {rows}")]
    Length {
        /// The part.
        part: &'static str,
        /// The column.
        column: String,
        /// Its length.
        found: usize,
        /// Number of times.
        rows: usize,
    },
    /// Time does not run forward.
    #[error("part `{part}`: {cause}")]
    Time {
        /// The part.
        part: &'static str,
        /// The first time that is wrong.
        cause: OutOfOrder,
    },
    /// The parameters are no car's.
    #[error("vehicle: {0}")]
    Vehicle(String),
    /// The numbers are no disk's.
    #[error("a disk of six accelerometers has 42 finite numbers")]
    Disk,
}

/// The parts of a drive, each moved out of it; see [`parts`].
#[derive(Debug)]
pub struct Parts {
    series: std::iter::Zip<std::array::IntoIter<&'static str, 10>, std::array::IntoIter<Series, 9>>,
    raw: RawGnss,
}

/// Take a drive apart: its head, and the parts that hold something.
pub fn parts(drive: Drive) -> (Head, Parts) {
    let number = |v: &VehicleParams, i| match v.get(i) {
        ParamValue::Number(value) => value,
        _ => f64::NAN,
    };
    let vehicle = drive.vehicle.map(|v| (0..VehicleParams::SPECS.len()).map(|i| number(&v, i)).collect());
    let disk = drive.disk.map(|d| d.numbers());
    let head = Head { name: drive.name, vehicle, rear_axle: drive.rear_axle, unix_zero: drive.unix_zero, disk };
    let series = [
        drive.imu.into_series(),
        drive.mag.into_series(),
        drive.wheels.into_series(),
        drive.steering.into_series(),
        drive.gnss.into_series(),
        drive.baro.into_series(),
        drive.accel_array.into_series(),
        drive.range.into_series(),
        drive.truth,
    ];
    (head, Parts { series: PARTS.into_iter().zip(series), raw: drive.raw_gnss })
}

impl Iterator for Parts {
    type Item = Part;

    fn next(&mut self) -> Option<Part> {
        for (name, series) in self.series.by_ref() {
            // The schema of truth says which signals are known, whether or not they have a value.
            let is_truth = name == PARTS[TRUTH];
            if series.is_empty() && (!is_truth || series.schema().is_empty()) {
                continue;
            }
            let (time, schema, columns) = series.into_columns();
            let named = schema.iter().map(|c| c.name).zip(columns.into_iter().map(with_value));
            return Some(Part { name, time, columns: named.filter(|(_, c)| is_truth || !c.is_empty()).collect() });
        }
        let raw = std::mem::take(&mut self.raw);
        if raw.is_empty() {
            return None;
        }
        let rows = || raw.iter().flat_map(|(time, satellites)| satellites.iter().map(move |s| (time, s)));
        let column = |i: usize| with_value(rows().map(|(_, s)| s.cells()[i]).collect());
        let columns = RAW_COLUMNS.iter().enumerate().map(|(i, &name)| (name, column(i)));
        Some(Part { name: PARTS[RAW], time: rows().map(|(time, _)| time).collect(), columns: columns.collect() })
    }
}

/// The column, or an empty one if it has no value.
fn with_value(column: Vec<f64>) -> Vec<f64> {
    if column.iter().all(|v| v.is_nan()) { Vec::new() } else { column }
}

/// A drive that is being put together of its parts.
#[derive(Debug, Default)]
pub struct Assembly {
    drive: Drive,
    has: [bool; PARTS.len()],
}

impl Assembly {
    /// Begin with what the drive says besides its columns.
    ///
    /// # Errors
    /// [`PartError::Vehicle`] when the parameters are too few, too many or out of range; [`PartError::Disk`].
    pub fn new(head: Head) -> Result<Self, PartError> {
        let vehicle = head.vehicle.map(vehicle).transpose()?;
        let disk = head.disk.map(|numbers| Disk::from_numbers(&numbers).ok_or(PartError::Disk)).transpose()?;
        let Head { name, rear_axle, unix_zero, .. } = head;
        let drive = Drive { name, vehicle, rear_axle, unix_zero, disk, ..Drive::default() };
        Ok(Self { drive, has: [false; PARTS.len()] })
    }

    /// Add a part; columns that it does not have are without a value.
    ///
    /// # Errors
    /// What does not fit; the part is left out then.
    pub fn add(&mut self, name: &str, time: Vec<f64>, columns: Vec<(String, Vec<f64>)>) -> Result<(), PartError> {
        let index = PARTS.iter().position(|p| *p == name).filter(|&i| !self.has[i]);
        let Some(index) = index else { return Err(PartError::Part(name.to_owned())) };
        let (part, drive) = (PARTS[index], &mut self.drive);
        match index {
            0 => drive.imu = channel(part, time, columns)?,
            1 => drive.mag = channel(part, time, columns)?,
            2 => drive.wheels = channel(part, time, columns)?,
            3 => drive.steering = channel(part, time, columns)?,
            4 => drive.gnss = channel(part, time, columns)?,
            5 => drive.baro = channel(part, time, columns)?,
            6 => drive.accel_array = channel(part, time, columns)?,
            7 => drive.range = channel(part, time, columns)?,
            TRUTH => drive.truth = truth(part, time, columns)?,
            _ => drive.raw_gnss = raw_gnss(part, &time, columns)?,
        }
        self.has[index] = true;
        Ok(())
    }

    /// The drive.
    pub fn finish(self) -> Drive {
        self.drive
    }
}

fn vehicle(values: Vec<f64>) -> Result<VehicleParams, PartError> {
    let specs = VehicleParams::SPECS;
    if values.len() != specs.len() {
        return Err(PartError::Vehicle(format!("{} parameters, expected {}", values.len(), specs.len())));
    }
    let mut vehicle = VehicleParams::default();
    values.iter().enumerate().for_each(|(i, &value)| vehicle.put(i, ParamValue::Number(value)));
    vehicle.validate().map_err(|e| PartError::Vehicle(e.to_string()))?;
    Ok(vehicle)
}

/// The columns in the order of a schema, NaN where there is none.
fn arranged(
    part: &'static str,
    rows: usize,
    schema: &[&'static str],
    columns: Vec<(String, Vec<f64>)>,
) -> Result<Vec<Vec<f64>>, PartError> {
    let mut places: Vec<Option<Vec<f64>>> = vec![None; schema.len()];
    for (column, values) in columns {
        let place = schema.iter().position(|name| *name == column).map(|i| &mut places[i]);
        let Some(place) = place.filter(|p| p.is_none()) else { return Err(PartError::Column { part, column }) };
        if !values.is_empty() && values.len() != rows {
            return Err(PartError::Length { part, column, found: values.len(), rows });
        }
        *place = Some(values);
    }
    let filled = |values: Option<Vec<f64>>| values.filter(|v| !v.is_empty()).unwrap_or_else(|| vec![f64::NAN; rows]);
    Ok(places.into_iter().map(filled).collect())
}

fn names(schema: &[Column]) -> Vec<&'static str> {
    schema.iter().map(|c| c.name).collect()
}

fn channel<R: Record>(
    part: &'static str,
    time: Vec<f64>,
    columns: Vec<(String, Vec<f64>)>,
) -> Result<Channel<R>, PartError> {
    let columns = arranged(part, time.len(), &names(R::COLUMNS), columns)?;
    Channel::from_columns(time, columns).map_err(|cause| PartError::Time { part, cause })
}

fn truth(part: &'static str, time: Vec<f64>, columns: Vec<(String, Vec<f64>)>) -> Result<Series, PartError> {
    let unknown = |column: &str| PartError::Column { part, column: column.to_owned() };
    let declared = columns.iter().map(|(name, _)| truth_column(name).copied().ok_or_else(|| unknown(name)));
    let schema = declared.collect::<Result<Vec<Column>, PartError>>()?;
    let columns = arranged(part, time.len(), &names(&schema), columns)?;
    Series::from_columns(&schema, time, columns).map_err(|cause| PartError::Time { part, cause })
}

fn raw_gnss(part: &'static str, time: &[f64], columns: Vec<(String, Vec<f64>)>) -> Result<RawGnss, PartError> {
    let columns = arranged(part, time.len(), &RAW_COLUMNS, columns)?;
    let (mut raw, mut view) = (RawGnss::default(), Vec::new());
    for (row, &t) in time.iter().enumerate() {
        view.push(Satellite::of_cells(&std::array::from_fn(|i| columns[i][row])));
        if time.get(row + 1) != Some(&t) {
            raw.push(t, &view).map_err(|cause| PartError::Time { part, cause })?;
            view.clear();
        }
    }
    Ok(raw)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn imu(time: &[f64], column: &str, values: &[f64]) -> Result<Drive, PartError> {
        let mut assembly = Assembly::default();
        assembly.add("imu", time.to_vec(), vec![(column.to_owned(), values.to_vec())])?;
        Ok(assembly.finish())
    }

    #[test]
    fn a_part_that_does_not_fit_is_refused_and_never_a_panic() {
        assert_eq!(imu(&[0.0, 1.0], "gyro_z", &[3.0, 4.0]).unwrap().imu.at(1).1.gyro_z, 4.0);
        let cause = |time: &[f64], column: &str, values: &[f64]| imu(time, column, values).unwrap_err().to_string();
        assert_eq!(cause(&[0.0], "speed", &[1.0]), "part `imu` has no second column and no column called `speed`");
        assert_eq!(cause(&[0.0], "gyro_z", &[1.0, 2.0]), "part `imu`: column `gyro_z` has 2 rows, expected 1");
        assert!(cause(&[], "gyro_z", &[1.0]).contains("expected 0"));
        for time in [[1.0, 1.0], [1.0, 0.5], [0.0, f64::NAN], [0.0, f64::INFINITY]] {
            assert!(cause(&time, "gyro_z", &[1.0, 2.0]).contains("is not after"));
        }
    }

    #[test]
    fn a_part_or_a_column_that_comes_twice_is_refused_and_the_first_stays() {
        let one = |name: &str, value| vec![(name.to_owned(), vec![value])];
        let mut assembly = Assembly::default();
        assembly.add("baro", vec![0.0], one("baro_alt", 1.0)).unwrap();
        assert!(assembly.add("baro", vec![0.0], one("baro_alt", 2.0)).is_err());
        assert!(assembly.add("tyres", vec![0.0], one("baro_alt", 2.0)).is_err());
        for (part, column) in [("wheels", "speed"), ("truth", "yaw"), ("raw_gnss", "pr")] {
            let twice = [one(column, 1.0), one(column, 2.0)].concat();
            assert!(matches!(assembly.add(part, vec![0.0], twice), Err(PartError::Column { .. })), "{part}");
            let empty = vec![(column.to_owned(), Vec::new()); 2];
            assert!(matches!(assembly.add(part, vec![0.0], empty), Err(PartError::Column { .. })), "{part}");
        }
        assert!(assembly.add("truth", vec![0.0], one("happiness", 1.0)).is_err());
        assert!(assembly.add("raw_gnss", vec![1.0, 0.0], vec![]).is_err());
        assert_eq!(assembly.finish().baro.at(0).1.altitude, 1.0);
    }

    #[test]
    fn a_car_that_is_none_is_refused() {
        let of = |vehicle| Assembly::new(Head { vehicle: Some(vehicle), ..Head::default() });
        let drive =
            Drive { vehicle: Some(VehicleParams { mass: 1234.5, ..VehicleParams::default() }), ..Drive::default() };
        let good = parts(drive.clone()).0.vehicle.unwrap();
        assert_eq!(of(good.clone()).unwrap().finish().vehicle, drive.vehicle);
        assert!(of(good[1..].to_vec()).is_err() && of(vec![]).is_err());
        assert!(of(vec![f64::NAN; good.len()]).is_err() && of(vec![-1.0; good.len()]).is_err());
    }
}
