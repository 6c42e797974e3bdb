//! Recordings of phones: archives of one CSV per sensor, as Sensor Logger and phyphox write them.

use crate::opening::Gathered;
use crate::table::{Meaning, Table, TimeEpoch};

/// Sensors of Sensor Logger by the name of their file, and what their axes are.
const SENSORS: &[(&str, Option<[&str; 3]>)] = &[
    ("TotalAcceleration", Some(["accel_x", "accel_y", "accel_z"])),
    ("AccelerometerUncalibrated", None),
    ("Gyroscope", Some(["gyro_x", "gyro_y", "gyro_z"])),
    ("GyroscopeUncalibrated", None),
    ("Magnetometer", Some(["mag_x", "mag_y", "mag_z"])),
    ("MagnetometerUncalibrated", None),
    ("Accelerometer", None),
    ("Gravity", None),
    ("Orientation", None),
];

/// The name of a member without folders and ending.
fn stem(part: &str) -> &str {
    let file = part.rsplit('/').next().unwrap_or_default();
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// Name the columns of each sensor after it, and give phyphox's clocks their start.
pub(crate) fn assemble(log: &mut Gathered) {
    let total = log.tables.iter().any(|t| stem(&t.part) == "TotalAcceleration");
    let start = log.tables.iter().find_map(start_of);
    log.tables.retain(|t| start_of(t).is_none());
    for table in log.tables.iter_mut().filter(|t| t.format == "CSV" && !t.part.is_empty()) {
        name_axes(table, total);
        if let (Some(start), Some(clock)) = (start, table.columns.iter_mut().find(|c| c.name == "Time")) {
            clock.epoch.get_or_insert(TimeEpoch::Instant(start));
        }
    }
}

/// Columns called only `x`, `y` and `z` get the sensor's name before them, and its meaning where that is beyond doubt.
fn name_axes(table: &mut Table, total: bool) {
    let sensor = stem(&table.part).to_owned();
    let known = SENSORS.iter().find(|(name, _)| *name == sensor);
    let mut without_gravity = false;
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let Some(column) = table.columns.iter_mut().find(|c| c.name == axis) else { continue };
        column.name = format!("{sensor}_{axis}");
        let Some((_, meanings)) = known else { continue };
        column.meaning = meanings.map(|m| Meaning { signal: signal(m[i]), sign: 1.0 });
        if sensor == "Accelerometer" {
            // Sensor Logger's own accelerometer is without gravity; the sum with it is another file.
            column.name = format!("without gravity {axis}");
            without_gravity = !total;
        } else if meanings.is_none() {
            column.name = format!("{sensor} {axis} (not used)");
        }
    }
    if without_gravity {
        let message = format!(
            "{}: the accelerometer is recorded without gravity; record TotalAcceleration too for specific force.",
            table.part
        );
        table.warnings.push(crate::table::Warning { message, column: None, row: None, count: 1 });
    }
}

fn signal(name: &str) -> &'static str {
    crate::channels::signal(name).map_or("", |c| c.name)
}

/// Instant at which phyphox's experiment began, if this is its table of times.
fn start_of(table: &Table) -> Option<i64> {
    let (experiment, system) = (table.column("experiment time")?, table.column("system time")?);
    let (first, at) = (*experiment.values.first()?, *system.values.first()?);
    (first.is_finite() && at.is_finite()).then_some(((at - first) * 1e9) as i64)
}
