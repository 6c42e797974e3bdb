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

/// Unit of a canonical column in a file: SI, but degrees for latitude and longitude.
pub fn file_unit(name: &str, unit: &'static str) -> &'static str {
    match name {
        "gnss_lat" | "gnss_lon" | "truth_lat" | "truth_lon" => "deg",
        _ => unit,
    }
}

fn file_value(name: &str, value: f64) -> f64 {
    if file_unit(name, "") == "deg" { value.to_degrees() } else { value }
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
/// left out and a sensor without a sample in a row has empty cells. What the drive says of its car goes before as
/// comments, [`REAR_AXLE`] and [`VEHICLE`]; raw ranges are a table of their own, [`write_raw_gnss`].
///
/// # Errors
/// Those of the writer.
pub fn write_drive(drive: &Drive, out: &mut impl Write) -> io::Result<()> {
    let mut parts: Vec<(&Series, Vec<(usize, String)>)> = Vec::new();
    for (series, prefix) in drive.channels().into_iter().map(|s| (s, "")).chain([(&drive.truth, "truth_")]) {
        let columns = (series.schema().iter().enumerate())
            .filter(|(i, _)| series.column_at(*i).iter().any(|v| v.is_finite()))
            .map(|(i, c)| (i, format!("{prefix}{}", c.name)))
            .collect::<Vec<_>>();
        if !columns.is_empty() {
            parts.push((series, columns));
        }
    }
    if let Some(x) = drive.rear_axle {
        writeln!(out, "# {REAR_AXLE} = {x}")?;
    }
    if let Some(vehicle) = &drive.vehicle {
        writeln!(out, "# {VEHICLE} = {}", json::flat(&vehicle.to_json()))?;
    }
    write!(out, "t")?;
    for (_, columns) in &parts {
        for (_, name) in columns {
            write!(out, ",{name}")?;
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
        for (i, (series, columns)) in parts.iter().enumerate() {
            for (index, name) in columns {
                let value = if present[i] { series.column_at(*index)[next[i]] } else { f64::NAN };
                cell(out, file_value(name, value))?;
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
