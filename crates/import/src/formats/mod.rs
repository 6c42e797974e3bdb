//! The formats that logs are recorded in: one module each, told apart by content and then by name.
//!
//! A reader is fed slices and hands over its tables at the end ([`Reader`]); only formats with a directory at their end
//! (archives, MDF4) seek ([`Seeking`]).

mod asc;
mod bag;
mod blf;
mod bzip2;
mod can;
mod candump;
mod carry;
mod dbc;
mod gpx;
mod grower;
mod gzip;
mod json;
mod lines;
mod lz4;
mod mcap;
mod mdf4;
mod nmea;
mod npy;
mod oxts;
mod phone;
mod proto;
mod ros;
mod topics;
mod ulog;
mod vbo;
mod zip;

use std::rc::Rc;

use crate::csv::CsvReader;
use crate::error::ImportError;
use crate::keep::Keep;
use crate::opening::Gathered;
use crate::source::Source;
use crate::table::Table;

/// A format that is read here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma, tab, semicolon or space separated text: what is nothing else.
    Csv,
    /// NMEA 0183 sentences.
    Nmea,
    /// GPX tracks.
    Gpx,
    /// Racelogic VBO.
    Vbo,
    /// OxTS text as KITTI has it.
    Oxts,
    /// Times beside the rows of [`Format::Oxts`].
    OxtsTimes,
    /// NumPy array.
    Npy,
    /// OpenXC JSON trace.
    Trace,
    /// Database of bus signals.
    Dbc,
    /// Vector BLF.
    Blf,
    /// Vector ASC.
    Asc,
    /// Log of candump.
    Candump,
    /// PX4 ULog.
    Ulog,
    /// MCAP.
    Mcap,
    /// ROS 1 bag.
    Bag,
    /// ASAM MDF 4.
    Mdf4,
    /// gzip around any other.
    Gzip,
    /// ZIP around any others: phone recordings, `.npz`, KITTI.
    Zip,
}

/// Every format, with the name that the command line takes and what people call it.
pub const FORMATS: &[(Format, &str, &str)] = &[
    (Format::Csv, "csv", "comma, tab or space separated text"),
    (Format::Nmea, "nmea", "NMEA 0183 sentences"),
    (Format::Gpx, "gpx", "GPX track"),
    (Format::Vbo, "vbo", "Racelogic VBO"),
    (Format::Oxts, "oxts", "OxTS text (KITTI)"),
    (Format::OxtsTimes, "oxts-times", "times of OxTS text (KITTI)"),
    (Format::Npy, "npy", "NumPy array"),
    (Format::Trace, "openxc", "OpenXC JSON trace"),
    (Format::Dbc, "dbc", "DBC database"),
    (Format::Blf, "blf", "Vector BLF"),
    (Format::Asc, "asc", "Vector ASC"),
    (Format::Candump, "candump", "candump log"),
    (Format::Ulog, "ulg", "PX4 ULog"),
    (Format::Mcap, "mcap", "MCAP"),
    (Format::Bag, "bag", "ROS 1 bag"),
    (Format::Mdf4, "mf4", "ASAM MDF 4"),
    (Format::Gzip, "gz", "gzip around any other"),
    (Format::Zip, "zip", "ZIP archive (phone recordings, NumPy, KITTI)"),
];

/// Bytes at the beginning of a file that tell its format.
pub(crate) const HEAD: usize = 8 << 10;

impl Format {
    /// The format that a file with this beginning and name is in; CSV, if it is nothing else.
    pub fn detect(head: &[u8], name: &str) -> Self {
        const MAGIC: &[(&[u8], Format)] = &[
            (b"\x1f\x8b", Format::Gzip),
            (b"PK\x03\x04", Format::Zip),
            (b"PK\x05\x06", Format::Zip),
            (b"\x93NUMPY", Format::Npy),
            (b"LOGG", Format::Blf),
            (b"MDF ", Format::Mdf4),
            (b"ULog\x01\x12\x35", Format::Ulog),
            (b"\x89MCAP0\r\n", Format::Mcap),
            (b"#ROSBAG V2.0", Format::Bag),
            (b"UnFinMF ", Format::Mdf4),
        ];
        if let Some((_, format)) = MAGIC.iter().find(|(magic, _)| head.starts_with(magic)) {
            return *format;
        }
        Self::of_text(&head[..head.len().min(HEAD)], name)
    }

    /// The format that a text has, by its first lines.
    fn of_text(head: &[u8], name: &str) -> Self {
        let has = |word: &[u8]| head.windows(word.len()).any(|w| w == word);
        let ends = |ending: &str| name.to_ascii_lowercase().ends_with(ending);
        let mut lines = head.split(|&b| b == b'\n').map(<[u8]>::trim_ascii).filter(|l| !l.is_empty());
        let first = lines.next().unwrap_or_default();
        if ends(".dbc") || (first.starts_with(b"VERSION") && (has(b"BO_ ") || has(b"NS_"))) || has(b"\nBU_:") {
            Self::Dbc
        } else if has(b"<gpx") {
            Self::Gpx
        } else if asc::is_asc(head) {
            Self::Asc
        } else if has(b"[column names]") || (ends(".vbo") && has(b"[header]")) {
            Self::Vbo
        } else if json::is_message(first) {
            Self::Trace
        } else if candump::is_frame(first) || lines.next().is_some_and(candump::is_frame) {
            Self::Candump
        } else if oxts::is_stamps(name, head) {
            Self::OxtsTimes
        } else if oxts::is_row(first) {
            Self::Oxts
        } else if nmea::is_sentence(first) || (ends(".nmea") && lines.any(nmea::is_sentence)) {
            Self::Nmea
        } else {
            Self::Csv
        }
    }

    /// Name of the format for people.
    pub fn label(self) -> &'static str {
        FORMATS.iter().find(|(f, ..)| *f == self).map_or("", |(_, _, label)| label)
    }

    /// Whether the format is read from several places of the file at once.
    pub(crate) fn seeks(self) -> bool {
        matches!(self, Self::Zip | Self::Mdf4)
    }
}

pub(crate) use dbc::Dbc;
pub(crate) use npy::Array;
pub(crate) use oxts::{Rows as OxtsRows, Stamps as OxtsStamps};

/// What a reader is told before its first slice.
#[derive(Clone, Debug, Default)]
pub(crate) struct Context {
    /// File name.
    pub file: Rc<str>,
    /// Member of an archive; empty for the file itself.
    pub part: String,
    /// Number of bytes that will come, if known.
    pub bytes: Option<u64>,
    /// How many archives are around it.
    pub depth: usize,
    /// What the frames of a bus hold.
    pub dbc: Rc<dbc::Dbc>,
    /// What of a text file is kept.
    pub keep: Rc<Keep>,
}

/// Reads one file fed in slices.
pub(crate) trait Reader {
    /// Take the next slice.
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError>;
    /// Hand over what was read.
    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError>;
    /// Rows or messages read so far.
    fn rows(&self) -> usize {
        0
    }
}

/// Reads one file from several of its places, piece by piece.
pub(crate) trait Seeking {
    /// Do one piece of work; the part of it all that is done, 1 at the end.
    fn step(&mut self, source: &mut dyn Source, log: &mut Gathered) -> Result<f64, ImportError>;
    /// Rows or messages read so far.
    fn rows(&self) -> usize {
        0
    }
}

/// A reader of a format that is fed.
pub(crate) fn reader(format: Format, context: Context) -> Box<dyn Reader> {
    match format {
        Format::Csv => {
            let mut reader = CsvReader::new(&context.file);
            context.bytes.into_iter().for_each(|b| reader.expect_bytes(b));
            if *context.keep != Keep::default() {
                reader.keep((*context.keep).clone());
            }
            Box::new(Csv { reader, part: context.part })
        }
        Format::Nmea => Box::new(nmea::Nmea::new(context)),
        Format::Gpx => Box::new(gpx::Gpx::new(context)),
        Format::Vbo => Box::new(vbo::Vbo::new(context)),
        Format::Oxts => Box::new(oxts::Oxts::new(context)),
        Format::OxtsTimes => Box::new(oxts::StampList::new(context)),
        Format::Npy => Box::new(npy::Npy::new(context)),
        Format::Trace => Box::new(json::Trace::new(context)),
        Format::Dbc => Box::new(dbc::Database::new(context)),
        Format::Blf => Box::new(blf::Blf::new(context)),
        Format::Asc => Box::new(asc::Asc::new(context)),
        Format::Candump => Box::new(candump::Candump::new(context)),
        Format::Gzip => Box::new(gzip::Gunzip::new(context)),
        Format::Ulog => Box::new(ulog::Ulog::new(context)),
        Format::Mcap => Box::new(mcap::Mcap::new(context)),
        Format::Bag => Box::new(bag::Bag::new(context)),
        Format::Zip | Format::Mdf4 => Box::new(gzip::Unpack::new(context)),
    }
}

/// A reader of a format that seeks.
pub(crate) fn seeking(format: Format, context: &Context) -> Option<Box<dyn Seeking>> {
    match format {
        Format::Zip => Some(Box::new(zip::Zip::new(context.clone()))),
        Format::Mdf4 => Some(Box::new(mdf4::Mdf4::new(context.clone()))),
        _ => None,
    }
}

/// Make tables of what several files hold together.
pub(crate) fn assemble(log: &mut Gathered) -> Result<(), ImportError> {
    oxts::assemble(log)?;
    npy::assemble(log);
    phone::assemble(log);
    Ok(())
}

/// CSV as one of the formats.
struct Csv {
    reader: CsvReader,
    part: String,
}

impl Reader for Csv {
    fn feed(&mut self, bytes: &[u8]) -> Result<(), ImportError> {
        self.reader.feed(bytes)
    }
    fn finish(self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        let table = Table { part: self.part, ..self.reader.finish()? };
        log.tables.push(table);
        Ok(())
    }
    fn rows(&self) -> usize {
        self.reader.rows()
    }
}

/// A reader that looks at the first bytes before it decides which one it is.
pub(crate) struct Detecting {
    context: Context,
    head: Vec<u8>,
    reader: Option<Box<dyn Reader>>,
}

impl Detecting {
    pub fn new(context: Context) -> Self {
        Self { context, head: Vec::new(), reader: None }
    }

    fn decide(&mut self) -> Result<(), ImportError> {
        let name = if self.context.part.is_empty() { &self.context.file } else { self.context.part.as_str() };
        let format = Format::detect(&self.head, name);
        let context = self.context.clone();
        let mut reader: Box<dyn Reader> =
            if format.seeks() { Box::new(gzip::Unpack::new(context)) } else { reader(format, context) };
        reader.feed(&std::mem::take(&mut self.head))?;
        self.reader = Some(reader);
        Ok(())
    }
}

impl Reader for Detecting {
    fn feed(&mut self, mut bytes: &[u8]) -> Result<(), ImportError> {
        if self.reader.is_none() {
            let taken = bytes.len().min(HEAD - self.head.len());
            self.head.extend_from_slice(&bytes[..taken]);
            bytes = &bytes[taken..];
            if self.head.len() < HEAD {
                return Ok(());
            }
            self.decide()?;
        }
        self.reader.as_mut().map_or(Ok(()), |r| r.feed(bytes))
    }

    fn finish(mut self: Box<Self>, log: &mut Gathered) -> Result<(), ImportError> {
        if self.reader.is_none() {
            self.decide()?;
        }
        self.reader.map_or(Ok(()), |r| r.finish(log))
    }

    fn rows(&self) -> usize {
        self.reader.as_ref().map_or(0, |r| r.rows())
    }
}
