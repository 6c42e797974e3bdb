//! Topics of a robot's log: a table each, stamped by its messages or, failing that, by the recorder.

use std::rc::Rc;

use serde_json::Value;

use super::Context;
use super::grower::{Grower, Zero};
use super::proto::Schema;
use super::ros::{Plan, known};
use crate::error::ImportError;
use crate::opening::Gathered;
use crate::register::Named;

/// A stamp further than this from the time of recording is not of the same clock, ns.
const APART: i64 = 10_000_000_000;
/// Times before 2001 count from the start of something else than 1970, ns.
const EPOCH: i64 = 978_307_200_000_000_000;
/// Columns of a topic without a fixed layout beyond this are left out.
const WIDEST: usize = 256;

/// How the messages of a topic are read.
pub(crate) enum Layout {
    /// By a definition of ROS.
    Ros(Plan),
    /// JSON objects.
    Json,
    /// Protocol Buffers of a type.
    Proto(Rc<Schema>),
}

/// A topic and its table.
pub(crate) struct Topic {
    name: String,
    kind: String,
    layout: Layout,
    columns: Named<usize>,
    grower: Grower,
    /// Time of the stamp minus that of the recording, ns, of every message.
    late: Vec<i64>,
    stamped: bool,
    broken: usize,
    row: Vec<f64>,
}

impl Topic {
    /// A topic of messages of that type.
    pub fn new(context: &Context, name: &str, kind: &str, layout: Layout) -> Self {
        let within = if context.part.is_empty() { String::new() } else { format!("{}: ", context.part) };
        let mut topic = Self {
            name: name.to_owned(),
            kind: kind.to_owned(),
            layout,
            columns: Named::default(),
            grower: Grower::new(&context.file, &format!("{within}{name}")),
            late: Vec::new(),
            stamped: true,
            broken: 0,
            row: Vec::new(),
        };
        if let Layout::Ros(plan) = &topic.layout {
            let names = plan.names.clone();
            for name in &names {
                topic.column(name);
            }
        }
        topic
    }

    /// The column of a path, made if it is new; `None` if there are too many.
    fn column(&mut self, path: &str) -> Option<usize> {
        if let Some(index) = self.columns.get(path) {
            return Some(*index);
        }
        if self.columns.len() >= WIDEST {
            return None;
        }
        let (unit, meaning) = known(&self.kind, path);
        // Only what the type defines is a signal: the name of the topic keeps other columns from being taken for one.
        self.grower.column(&format!("{}.{path}", self.name), unit, meaning);
        self.columns.insert(path.to_owned(), self.columns.len());
        Some(self.columns.len() - 1)
    }

    /// Take a message recorded at `time`, ns.
    pub fn message(&mut self, time: i64, data: &[u8]) -> Result<(), ImportError> {
        let mut row = std::mem::take(&mut self.row);
        let stamp = match &self.layout {
            Layout::Ros(plan) => plan.read(data, &mut row),
            Layout::Json => self.json(data, &mut row),
            Layout::Proto(schema) => {
                let schema = schema.clone();
                self.proto(&schema, data, &mut row)
            }
        };
        self.row = row;
        let Some(stamp) = stamp else {
            self.broken += 1;
            return Ok(());
        };
        self.late.push(stamp.unwrap_or(0).saturating_sub(time));
        self.stamped &= stamp.is_some();
        self.grower.row(time, &self.row)
    }

    fn json(&mut self, data: &[u8], row: &mut Vec<f64>) -> Option<Option<i64>> {
        let value: Value = serde_json::from_slice(data).ok()?;
        let mut found = Vec::new();
        flatten(&value, String::new(), &mut found);
        Some(self.loose(&found, row))
    }

    fn proto(&mut self, schema: &Schema, data: &[u8], row: &mut Vec<f64>) -> Option<Option<i64>> {
        let mut found = Vec::new();
        schema.read(&self.kind, data, &mut |path, value| found.push((path.to_owned(), value)))?;
        Some(self.loose(&found, row))
    }

    /// A row of numbers with their paths; the stamp among them.
    fn loose(&mut self, found: &[(String, f64)], row: &mut Vec<f64>) -> Option<i64> {
        row.clear();
        let (mut seconds, mut nanos) = (None, 0.0);
        for (path, value) in found {
            let inner = path.strip_prefix("header.stamp.").or_else(|| path.strip_prefix("timestamp."));
            match inner {
                Some("sec" | "secs" | "seconds") => seconds = Some(*value),
                Some("nsec" | "nanosec" | "nsecs" | "nanos") => nanos = *value,
                _ => {
                    if let Some(index) = self.column(path) {
                        row.resize(row.len().max(index + 1), f64::NAN);
                        row[index] = *value;
                    }
                }
            }
        }
        seconds.map(|s| (s as i64).saturating_mul(1_000_000_000).saturating_add(nanos as i64))
    }

    pub fn rows(&self) -> usize {
        self.grower.rows()
    }

    /// The table, over the stamps if they are near the time of recording.
    pub fn finish(mut self, format: &'static str, log: &mut Gathered) {
        let mut sorted = self.late.clone();
        let middle = sorted.len() / 2;
        let typical = if sorted.is_empty() { 0 } else { *sorted.select_nth_unstable(middle).1 };
        if self.stamped && typical.abs() < APART {
            self.grower.retime(&self.late);
        }
        if self.broken > 0 {
            log.warn(format!("{}: messages that do not fit their definition left out ({}).", self.name, self.broken));
        }
        let zero = if self.grower.first().is_some_and(|t| t >= EPOCH) { Zero::Unix } else { Zero::Unknown };
        log.tables.extend(self.grower.finish(format, zero));
    }
}

/// The numbers of a JSON value with their paths; lists are left out.
fn flatten(value: &Value, path: String, out: &mut Vec<(String, f64)>) {
    match value {
        Value::Number(n) => out.extend(n.as_f64().map(|v| (path, v))),
        Value::Bool(b) => out.push((path, f64::from(u8::from(*b)))),
        Value::Object(map) => {
            for (name, inner) in map {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                flatten(inner, path, out);
            }
        }
        _ => {}
    }
}
