//! The door: files in, tables out, one bounded piece of work at a time.

use std::collections::VecDeque;
use std::rc::Rc;

use crate::error::ImportError;
use crate::formats::{
    Array, Context, Dbc, Format, HEAD, OxtsRows, OxtsStamps, Reader, Seeking, assemble, reader, seeking,
};
use crate::keep::Keep;
use crate::source::{MemorySource, Source};
use crate::table::{Table, Warning};

/// Bytes of a file that one step takes.
const SLICE: usize = 1 << 20;

/// What was read from all files together, before it is made one drive.
#[derive(Clone, Debug, Default)]
pub struct Log {
    /// Every table, each over its own clock.
    pub tables: Vec<Table>,
    /// What was passed over, beside what the tables say themselves.
    pub warnings: Vec<Warning>,
    /// What was assumed.
    pub notes: Vec<String>,
    /// Bytes read.
    pub bytes: u64,
}

/// What the readers have handed over so far.
#[derive(Debug, Default)]
pub(crate) struct Gathered {
    pub tables: Vec<Table>,
    pub warnings: Vec<Warning>,
    pub notes: Vec<String>,
    /// Members of archives that have to be read as files of their own.
    pub unpacked: Vec<(MemorySource, Context)>,
    /// Databases of bus signals read so far.
    pub dbc: Rc<Dbc>,
    /// Parts that make a table together with others, with the file they are from.
    pub arrays: Vec<(Rc<str>, Array)>,
    pub oxts: Vec<OxtsRows>,
    pub stamps: Vec<OxtsStamps>,
    /// Whole sentences about what gave no table: the first is the error if nothing else did.
    pub failures: Vec<String>,
}

impl Gathered {
    /// Say something about a file.
    pub fn warn(&mut self, message: String) {
        self.warnings.push(Warning { message, column: None, row: None, count: 1 });
    }

    fn finish(mut self, bytes: u64) -> Result<Log, ImportError> {
        assemble(&mut self)?;
        let failures = std::mem::take(&mut self.failures);
        if self.tables.is_empty() {
            let nothing = "a database of bus signals only: open it together with a log";
            let sentence = failures.into_iter().next().unwrap_or_else(|| {
                let found = if self.dbc.is_empty() { "nothing that is one" } else { nothing };
                format!("expected a log, found {found}.")
            });
            return Err(ImportError::Nothing { sentence });
        }
        failures.into_iter().for_each(|f| self.warn(f));
        Ok(Log { tables: self.tables, warnings: self.warnings, notes: self.notes, bytes })
    }
}

/// How far the reading has come.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Part of all bytes that was read, 0 to 1.
    pub fraction: f64,
    /// Rows or messages of the file that is being read.
    pub rows: usize,
    /// Its name.
    pub file: String,
}

/// A file that waits, with what its reader is told.
struct Waiting {
    source: Box<dyn Source>,
    format: Format,
    context: Context,
}

/// A file that is being read.
struct Work {
    waiting: Waiting,
    reading: Reading,
    fraction: f64,
}

enum Reading {
    Fed { offset: u64, reader: Box<dyn Reader> },
    Sought(Box<dyn Seeking>),
}

/// Files on their way to tables. Call [`Opening::step`] until it says that nothing is left, then [`Opening::finish`];
/// drop it to stop.
///
/// Databases of bus signals (DBC) are read first, whatever the order of the files.
///
/// ```
/// use drivescope_import::{MemorySource, Opening, open_log};
/// let csv = MemorySource::new("log.csv", b"t,ax [g]\n0,0\n0.5,0.1\n".to_vec());
/// let mut opening = Opening::new(vec![Box::new(csv)])?;
/// while opening.step()? {}
/// let (drive, report) = open_log(opening.finish()?, None)?;
/// assert_eq!(drive.imu.len(), 2);
/// assert_eq!(report.used[1].column, "ax");
/// # Ok::<(), drivescope_import::ImportError>(())
/// ```
pub struct Opening {
    waiting: VecDeque<Waiting>,
    work: Option<Work>,
    log: Gathered,
    total: u64,
    done: u64,
    slice: Vec<u8>,
    keep: Rc<Keep>,
}

impl Opening {
    /// Look at the beginning of every file.
    ///
    /// # Errors
    /// [`ImportError::Read`] when the system refuses.
    pub fn new(sources: Vec<Box<dyn Source>>) -> Result<Self, ImportError> {
        let mut opening = Self {
            waiting: VecDeque::new(),
            work: None,
            log: Gathered::default(),
            total: 0,
            done: 0,
            slice: vec![0; SLICE],
            keep: Rc::default(),
        };
        for source in sources {
            opening.total += source.len();
            let context = Context { file: source.name().into(), bytes: Some(source.len()), ..Context::default() };
            opening.queue(source, context)?;
        }
        Ok(opening)
    }

    fn queue(&mut self, mut source: Box<dyn Source>, context: Context) -> Result<(), ImportError> {
        let head = &mut self.slice[..HEAD];
        let count = read(&mut *source, 0, head)?;
        let format = Format::detect(&head[..count], source.name());
        let waiting = Waiting { source, format, context };
        if format == Format::Dbc {
            self.waiting.push_front(waiting)
        } else {
            self.waiting.push_back(waiting)
        }
        Ok(())
    }

    /// Keep a part only of every CSV, and refuse those that need more memory than they may. Say it before the first step.
    pub fn keep(&mut self, keep: Keep) {
        self.keep = Rc::new(keep);
    }

    /// Do one piece of work; whether there is more to do.
    ///
    /// # Errors
    /// The first thing that is wrong with a file, as one sentence. The opening is of no use afterwards.
    pub fn step(&mut self) -> Result<bool, ImportError> {
        let Some(mut work) = self.work.take().or_else(|| self.next_work()) else { return Ok(false) };
        let more = match &mut work.reading {
            Reading::Fed { offset, reader } => {
                let count = read(&mut *work.waiting.source, *offset, &mut self.slice)?;
                *offset += count as u64;
                work.fraction = *offset as f64 / work.waiting.source.len().max(1) as f64;
                if count > 0 {
                    reader.feed(&self.slice[..count])?;
                }
                count > 0
            }
            Reading::Sought(seeking) => {
                work.fraction = seeking.step(&mut *work.waiting.source, &mut self.log)?;
                work.fraction < 1.0
            }
        };
        if more {
            self.work = Some(work);
            return Ok(true);
        }
        if work.waiting.context.depth == 0 {
            self.done += work.waiting.source.len();
        }
        if let Reading::Fed { reader, .. } = work.reading {
            reader.finish(&mut self.log)?;
        }
        for (source, context) in std::mem::take(&mut self.log.unpacked) {
            self.queue(Box::new(source), context)?;
        }
        Ok(!self.waiting.is_empty())
    }

    fn next_work(&mut self) -> Option<Work> {
        let waiting = self.waiting.pop_front()?;
        let mut context = waiting.context.clone();
        context.dbc = self.log.dbc.clone();
        context.keep = self.keep.clone();
        let reading = match seeking(waiting.format, &context) {
            Some(seeking) => Reading::Sought(seeking),
            None => Reading::Fed { offset: 0, reader: reader(waiting.format, context) },
        };
        Some(Work { waiting, reading, fraction: 0.0 })
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        let Some(work) = &self.work else {
            return Progress { fraction: self.done as f64 / self.total.max(1) as f64, rows: 0, file: String::new() };
        };
        let own = if work.waiting.context.depth == 0 { work.waiting.source.len() as f64 * work.fraction } else { 0.0 };
        let rows = match &work.reading {
            Reading::Fed { reader, .. } => reader.rows(),
            Reading::Sought(seeking) => seeking.rows(),
        };
        let fraction = ((self.done as f64 + own) / self.total.max(1) as f64).min(1.0);
        Progress { fraction, rows, file: work.waiting.source.name().to_owned() }
    }

    /// The tables, once nothing is left to do.
    ///
    /// # Errors
    /// [`ImportError::Nothing`] if no file held a table, and those of parts that do not fit together.
    pub fn finish(self) -> Result<Log, ImportError> {
        self.log.finish(self.done)
    }
}

fn read(source: &mut dyn Source, offset: u64, buf: &mut [u8]) -> Result<usize, ImportError> {
    let file = source.name().to_owned();
    source.read_at(offset, buf).map_err(|cause| ImportError::Read { file, cause })
}
