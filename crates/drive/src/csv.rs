//! Writing CSV: an estimate's series, or a whole drive with canonical column names.

use std::io::{self, Write};

use crate::channel::Series;
use crate::drive::Drive;
use crate::json;
use crate::param::Params;
use crate::satellites::{RAW_COLUMNS, RawGnss};

/// Name of the comment `# rear_axle_x = -1.45` at the head of a written drive: m ahead of the inertial sensor.
pub const REAR_AXLE: &str = "rear_axle_x";
/// Name of the comment `# vehicle = {..}`: parameters of the car as JSON.
pub const VEHICLE: &str = "vehicle";
/// Name of the comment `# disk = 0.1, 0, ..`: the 42 numbers of the disk as calibrated, as [`crate::disk::Disk::numbers`].
pub const DISK: &str = "disk";

/// Unit of a canonical column in a file: SI, but degrees for latitude and longitude.
pub fn file_unit(name: &str, unit: &'static str) -> &'static str {
    match name {
        "gnss_lat" | "gnss_lon" | "truth_lat" | "truth_lon" => "deg",
        _ => unit,
    }
}

/// Ending of the column beside one of degrees that holds what the degrees leave of the stored radians, rad; a blank is 0.
pub const REST: &str = "_rest";

/// Degrees of an angle, and what is left of it, rad, once they are multiplied by pi / 180 again.
///
/// Degrees in f64 lie less dense than radians in a tenth of all places: no choice of them gives every angle back, one to
/// the last bit together with a rest does.
fn degrees_and_rest(angle: f64) -> (f64, f64) {
    let back = |degrees: f64| degrees * (std::f64::consts::PI / 180.0);
    let nearest = angle.to_degrees();
    let exact = |d: &f64| back(*d).to_bits() == angle.to_bits();
    if let Some(degrees) = [nearest, nearest.next_up(), nearest.next_down()].into_iter().find(exact) {
        return (degrees, 0.0);
    }
    let rest = angle - back(nearest);
    if rest.is_finite() && back(nearest) + rest == angle { (nearest, rest) } else { (0.0, angle) }
}

/// A column as it is written.
struct Written<'a> {
    name: String,
    values: &'a [f64],
    part: Part,
}

#[derive(Clone, Copy)]
enum Part {
    Whole,
    Degrees,
    Rest,
}

impl Written<'_> {
    fn value(&self, row: usize) -> f64 {
        let value = self.values[row];
        match self.part {
            Part::Whole => value,
            Part::Degrees => degrees_and_rest(value).0,
            Part::Rest => Some(degrees_and_rest(value).1).filter(|r| *r != 0.0).unwrap_or(f64::NAN),
        }
    }

    fn is_empty(&self) -> bool {
        !(0..self.values.len()).any(|row| self.value(row).is_finite())
    }
}

/// The columns of a series that hold a value.
fn written<'a>(series: &'a Series, prefix: &str) -> Vec<Written<'a>> {
    let mut columns = Vec::new();
    for (index, column) in series.schema().iter().enumerate() {
        let (name, values) = (format!("{prefix}{}", column.name), series.column_at(index));
        if file_unit(&name, "") == "deg" {
            let rest = format!("{name}{REST}");
            columns.push(Written { name, values, part: Part::Degrees });
            columns.push(Written { name: rest, values, part: Part::Rest });
        } else {
            columns.push(Written { name, values, part: Part::Whole });
        }
    }
    columns.retain(|c| !c.is_empty());
    columns
}

fn cell(out: &mut impl Write, value: f64) -> io::Result<()> {
    // The shortest text that reads back as the same f64; an empty cell is "no value here".
    if value.is_finite() { write!(out, ",{value}") } else { write!(out, ",") }
}

/// Write a series: `t`, then its columns under their schema names; a NaN becomes an empty cell.
///
/// # Errors
/// Those of the writer.
pub fn write_series(series: &Series, out: &mut impl Write) -> io::Result<()> {
    write!(out, "t")?;
    for column in series.schema() {
        write!(out, ",{}", column.name)?;
    }
    writeln!(out)?;
    for (row, time) in series.time().iter().enumerate() {
        write!(out, "{time}")?;
        for index in 0..series.schema().len() {
            cell(out, series.column_at(index)[row])?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Write a drive: one row per instant, canonical names, truth columns with their prefix; a column without any value is
/// left out and a sensor without a sample in a row has empty cells. Beside a column of degrees, one with [`REST`] holds
/// what is missing to the stored angle, where anything is: a drive reads back bit for bit. What the drive says of its car goes before as
/// comments, [`REAR_AXLE`], [`VEHICLE`] and [`DISK`]; raw ranges are a table of their own, [`write_raw_gnss`].
///
/// # Errors
/// Those of the writer.
pub fn write_drive(drive: &Drive, out: &mut impl Write) -> io::Result<()> {
    let series = drive.channels().into_iter().map(|s| (s, "")).chain([(&drive.truth, "truth_")]);
    let mut parts: Vec<(&Series, Vec<Written>)> = series.map(|(s, prefix)| (s, written(s, prefix))).collect();
    parts.retain(|(_, columns)| !columns.is_empty());
    if let Some(x) = drive.rear_axle {
        writeln!(out, "# {REAR_AXLE} = {x}")?;
    }
    if let Some(vehicle) = &drive.vehicle {
        writeln!(out, "# {VEHICLE} = {}", json::flat(&vehicle.to_json()))?;
    }
    if let Some(disk) = &drive.disk {
        for (k, number) in disk.numbers().iter().enumerate() {
            if k == 0 { write!(out, "# {DISK} = {number}")? } else { write!(out, ", {number}")? }
        }
        writeln!(out)?;
    }
    write!(out, "t")?;
    for (_, columns) in &parts {
        for column in columns {
            write!(out, ",{}", column.name)?;
        }
    }
    writeln!(out)?;
    let mut next = vec![0; parts.len()];
    loop {
        let due = |i: usize| parts[i].0.time().get(next[i]).copied().unwrap_or(f64::INFINITY);
        let time = (0..parts.len()).map(due).fold(f64::INFINITY, f64::min);
        if time == f64::INFINITY {
            return Ok(());
        }
        let present: Vec<bool> = (0..parts.len()).map(|i| due(i) == time).collect();
        write!(out, "{time}")?;
        for (i, (_, columns)) in parts.iter().enumerate() {
            for column in columns {
                cell(out, if present[i] { column.value(next[i]) } else { f64::NAN })?;
            }
            next[i] += usize::from(present[i]);
        }
        writeln!(out)?;
    }
}

/// Write raw ranges: one row per satellite and instant, as `t`, then [`RAW_COLUMNS`].
///
/// # Errors
/// Those of the writer.
pub fn write_raw_gnss(raw: &RawGnss, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "t,{}", RAW_COLUMNS.join(","))?;
    for (time, satellites) in raw.iter() {
        for satellite in satellites {
            write!(out, "{time}")?;
            for value in satellite.cells() {
                cell(out, value)?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signals::{Gnss, Imu};

    #[test]
    fn a_drive_is_written_row_by_row_with_blanks_where_nothing_was_measured() {
        let mut drive = Drive::default();
        drive.imu.push(0.0, Imu { gyro_z: 0.5, ..Imu::default() }).unwrap();
        drive.imu.push(0.1, Imu { gyro_z: 0.25, ..Imu::default() }).unwrap();
        drive.gnss.push(0.1, Gnss { lat: std::f64::consts::FRAC_PI_4, ..Gnss::default() }).unwrap();
        let mut text = Vec::new();
        write_drive(&drive, &mut text).unwrap();
        assert_eq!(String::from_utf8(text).unwrap(), "t,gyro_z,gnss_lat\n0,0.5,\n0.1,0.25,45\n");
    }
}
