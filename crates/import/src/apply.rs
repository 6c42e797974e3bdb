//! From a table and a mapping to a drive.

use drivescope_drive::csv::{DISK, REAR_AXLE, VEHICLE};
use drivescope_drive::disk::Disk;
use drivescope_drive::drive::Drive;
use drivescope_drive::param::Params;
use drivescope_drive::vehicle::VehicleParams;

use crate::clock;
use crate::error::ImportError;
use crate::load::{Loader, MapReport, Shared, counted};
use crate::mapping::Mapping;
use crate::table::{Table, TimeEpoch};

/// Build the drive that a mapping makes of a table. Columns are moved, not copied, where every row has a sample.
///
/// A sensor has a sample in a row where at least one of its signals has a value (`gnss_valid` alone is none). A row
/// with the time of the row before it adds the sensors that are new in it; a second sample of a sensor at the same
/// time is left out and counted.
///
/// # Errors
/// Those of [`Mapping::validate`] and [`Mapping::check_columns`], [`ImportError::TimeBackwards`],
/// [`ImportError::TooFewTimes`], and [`ImportError::NoSignals`] if no signal is mapped.
pub fn apply(mut table: Table, mapping: &Mapping, name: &str) -> Result<(Drive, MapReport), ImportError> {
    mapping.validate(&table.name)?;
    mapping.check_columns(&table)?;
    if mapping.signals.is_empty() {
        let (place, found) = (table.header_place(), table.columns_found());
        return Err(ImportError::NoSignals { file: table.name, place, found });
    }
    let times = clock::times(&table, &mapping.time)?;
    let mut report = MapReport::default();
    let timeless = times.iter().filter(|t| t.is_nan()).count();
    if timeless > 0 {
        let row = times.iter().position(|t| t.is_nan()).map(|r| table.line_of(r));
        report.warn(format!("{} without a time left out.", counted(timeless, "row")), None, row, timeless);
    }
    let mut shared = Shared::of(mapping);
    let unix_zero = unix_zero(&table, mapping);
    let mut drive = Drive { name: name.to_owned(), unix_zero, disk: mapping.disk, ..Drive::default() };
    take_stated(&table, &mut drive, &mut report);
    let mut load = Loader { table: &mut table, times: &times, mapping, shared: &mut shared, report: &mut report };
    drive.imu = load.channel(0)?;
    drive.mag = load.channel(1)?;
    drive.wheels = load.channel(2)?;
    drive.steering = load.channel(3)?;
    drive.gnss = load.channel(4)?;
    drive.baro = load.channel(5)?;
    drive.accel_array = load.channel(6)?;
    drive.range = load.channel(7)?;
    drive.truth = load.truth()?;
    if let Some(origin) = mapping.origin {
        drive.set_origin(origin.place());
    }
    Ok((drive, report))
}

/// The car, its rear axle and its disk, unless the mapping has one, where comments at the head of the file state them as our own writer does.
fn take_stated(table: &Table, drive: &mut Drive, report: &mut MapReport) {
    let stated = |name: &str| table.stated.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str());
    if let Some(text) = stated(REAR_AXLE) {
        match text.parse().ok().filter(|x: &f64| x.abs() < 20.0) {
            Some(x) => drive.rear_axle = Some(x),
            None => report.warn(format!("comment `{REAR_AXLE} = {text}`: expected metres; left out."), None, None, 1),
        }
    }
    if let Some(text) = stated(VEHICLE) {
        let read = serde_json::from_str(text).map_err(|e| e.to_string());
        match read.and_then(|json| VehicleParams::from_json(&json).map_err(|e| e.to_string())) {
            Ok(vehicle) => drive.vehicle = Some(vehicle),
            Err(cause) => report.warn(format!("comment `{VEHICLE}`: {cause}; left out."), None, None, 1),
        }
    }
    if let Some(text) = stated(DISK).filter(|_| drive.disk.is_none()) {
        let numbers: Vec<f64> = text.split(',').map_while(|number| number.trim().parse().ok()).collect();
        drive.disk = Disk::from_numbers(&numbers);
        if drive.disk.is_none() {
            report.warn(format!("comment `{DISK}`: expected 42 numbers; left out."), None, None, 1);
        }
    }
}

/// Unix time of the drive's `t = 0`, where the time column is of date and time.
fn unix_zero(table: &Table, mapping: &Mapping) -> Option<f64> {
    match table.column(&mapping.time.column)?.epoch? {
        TimeEpoch::Instant(ns) => Some(ns as f64 / 1e9 - mapping.time.offset),
        TimeEpoch::Midnight(_) => None,
    }
}
