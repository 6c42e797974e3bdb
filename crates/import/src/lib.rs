//! The way from bytes to a drive: reading tables, mapping their columns to signals, checking that against physics.
//!
//! ```text
//! CSV   --CsvReader--------------------> Table --propose--> Proposal (Mapping, reasons, notes) --apply--> Drive
//! files --Opening--> Log (tables) --merge--^
//! ```
//!
//! A file is read in slices and only its columns of numbers are kept. What a column means is proposed from its name, its
//! unit and physics, or defined by its format; every guess is a note in words. What is wrong with a file is one sentence
//! ([`ImportError`]). Formats: [`FORMATS`].
//!
//! # Example
//!
//! ```
//! use drivescope_import::{IoSource, open_csv};
//! let text = "time [ms],ax [g],yaw_rate [deg/s],speed_kmh\n0,0.1,2,36\n10,0.1,2,36\n";
//! let (drive, report) = open_csv(&mut IoSource::new(text.as_bytes(), None), "log.csv", None)?;
//! assert!((drive.imu.at(1).1.accel_x - 0.980665).abs() < 1e-12);
//! assert!((drive.wheels.at(0).1.speed - 10.0).abs() < 1e-12);
//! assert_eq!(report.channels[0].rate, 100.0);
//! # Ok::<(), drivescope_import::ImportError>(())
//! ```

mod aliases;
mod apply;
mod by_name;
mod candidate;
mod cell;
mod channels;
mod check;
mod clock;
mod column;
mod correction;
mod csv;
mod csv_body;
mod dialect;
mod error;
mod evidence;
mod examine;
mod fit;
mod formats;
mod gps_time;
mod header;
mod keep;
mod load;
mod magic;
mod mapping;
mod merge;
mod names;
mod number;
mod offer;
mod open;
mod opening;
mod order;
mod pairing;
mod physics;
mod place;
mod propose;
mod raw_gnss;
mod register;
mod report;
mod settle;
mod source;
mod stamp;
mod table;
mod units;

pub use apply::apply;
pub use by_name::ByName;
pub use candidate::{Confidence, Unused};
pub use channels::signal;
pub use correction::Amendment;
pub use csv::{CsvReader, read_csv};
pub use error::{ImportError, MAX_ROW_BYTES, MAX_TABLE_COLUMNS};
pub use examine::{
    Choice, Clash, ColumnView, Correction, DelayFound, Examination, Finding, MountFound, TRIAL_SERIES, Thinned, Trial,
    Weight, choices, examine, try_out,
};
pub use formats::{FORMATS, Format};
pub use keep::Keep;
pub use load::{ChannelReport, MapReport, UsedColumn};
pub use mapping::{MAPPING_VERSION, Mapping, Mount, Origin, SignalSource, TimeFraction, TimeSource};
pub use offer::Offer;
pub use open::{
    Examined, examine_drawn, examine_log, open_csv, open_drawn, open_log, open_log_whole, open_raw, open_table,
};
pub use opening::{Log, Opening, Progress};
pub use propose::{Entry, Proposal, propose};
pub use raw_gnss::{is_raw_gnss, raw_gnss};
pub use report::{Missing, OpenReport, UsedSignal};
pub use source::{ByteSource, IoSource, MemorySource, ReadError, SeekSource, Source};
pub use table::{Layout, Meaning, RawColumn, Table, TextColumn, TimeEpoch, Warning};
pub use units::factor;
