//! The signals that a drive can have, by channel and by name.

use drivescope_drive::channel::{Column, Record};
use drivescope_drive::signals::{AccelArray, Baro, Gnss, Imu, Mag, Range, Steering, Wheels};
use drivescope_drive::truth::truth_column;

/// The measured channels, in the order of [`drivescope_drive::drive::Drive::channels`].
pub(crate) const CHANNELS: [(&str, &[Column]); 8] = [
    ("imu", Imu::COLUMNS),
    ("mag", Mag::COLUMNS),
    ("wheels", Wheels::COLUMNS),
    ("steering", Steering::COLUMNS),
    ("gnss", Gnss::COLUMNS),
    ("baro", Baro::COLUMNS),
    ("accel_array", AccelArray::COLUMNS),
    ("range", Range::COLUMNS),
];

/// The declaration of a signal by its canonical name, `truth_` included.
pub fn signal(name: &str) -> Option<&'static Column> {
    match name.strip_prefix("truth_") {
        Some(rest) => truth_column(rest),
        None => CHANNELS.iter().flat_map(|(_, columns)| columns.iter()).find(|c| c.name == name),
    }
}
