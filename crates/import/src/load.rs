//! The channels of a drive out of a table: which rows have a sample, their values in SI, rates and gaps.

use drivescope_drive::channel::{Channel, Column, OutOfOrder, Record, Series};
use drivescope_drive::csv::file_unit;
use serde::Serialize;

use crate::channels::{CHANNELS, signal};
use crate::clock;
use crate::error::ImportError;
use crate::mapping::{Mapping, SignalSource};
use crate::table::{Table, Warning};

/// What became of a table under a mapping.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MapReport {
    /// Every signal that was read.
    pub used: Vec<UsedColumn>,
    /// Every channel that has samples.
    pub channels: Vec<ChannelReport>,
    /// Rows left out, times met twice, gaps.
    pub warnings: Vec<Warning>,
}

/// A signal and where it came from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UsedColumn {
    /// Canonical name.
    pub signal: String,
    /// Raw column.
    pub column: String,
    /// Unit of the raw values.
    pub unit: String,
    /// SI unit of the signal.
    pub si: &'static str,
    /// What the raw values were multiplied by.
    pub factor: f64,
    /// What was added then, SI.
    pub offset: f64,
    /// Number of rows with a value.
    pub values: usize,
}

/// A channel of the drive.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelReport {
    /// Name.
    pub name: &'static str,
    /// Number of samples.
    pub samples: usize,
    /// One over the median step, Hz.
    pub rate: f64,
    /// Time from first to last, s.
    pub duration: f64,
    /// Longest time between two samples, s.
    pub largest_gap: f64,
    /// Number of steps longer than ten median ones.
    pub gaps: usize,
}

/// Columns and factor of one channel's signals, in the order of the channel's schema.
struct Parts<'a> {
    name: &'static str,
    sources: Vec<Option<(&'a str, &'a SignalSource, f64)>>,
}

/// `1 row`, `2 rows`.
pub(crate) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

impl MapReport {
    pub(crate) fn warn(&mut self, message: String, column: Option<String>, row: Option<usize>, count: usize) {
        self.warnings.push(Warning { message, column, row, count });
    }
}

/// Names of columns; apart from what is made for every channel anew.
fn column_names(columns: &[Column]) -> Vec<&'static str> {
    columns.iter().map(|c| c.name).collect()
}

/// How often each raw column is still needed: the last use takes its values.
pub(crate) struct Shared<'a>(Vec<(&'a str, usize)>);

impl<'a> Shared<'a> {
    pub fn of(mapping: &'a Mapping) -> Self {
        let mut shared = Self(Vec::new());
        mapping.signals.values().for_each(|s| *shared.uses(&s.column, 0) += 1);
        shared
    }

    /// How often `column` is still needed; `first` where it was not met before.
    fn uses(&mut self, column: &'a str, first: usize) -> &mut usize {
        let place = self.0.iter().position(|(name, _)| *name == column).unwrap_or_else(|| {
            self.0.push((column, first));
            self.0.len() - 1
        });
        &mut self.0[place].1
    }
}

/// A sample that repeats is still taken when the one before is this old, s: a car that stands has fixes too.
const HOLD: f64 = 1.5;

/// Whether two rows hold the same values, blanks included.
fn same_row(columns: &[&[f64]], a: usize, b: usize) -> bool {
    columns.iter().all(|c| c[a] == c[b] || (c[a].is_nan() && c[b].is_nan()))
}

/// What loads one channel after the other.
pub(crate) struct Loader<'a, 'm> {
    pub table: &'a mut Table,
    pub times: &'a [f64],
    pub mapping: &'m Mapping,
    pub shared: &'a mut Shared<'m>,
    pub report: &'a mut MapReport,
}

impl<'m> Loader<'_, 'm> {
    pub fn channel<R: Record>(&mut self, index: usize) -> Result<Channel<R>, ImportError> {
        let name = CHANNELS[index].0;
        let Some((time, columns)) = self.columns(name, &column_names(R::COLUMNS))? else {
            return Ok(Channel::default());
        };
        let channel = Channel::from_columns(time, columns).map_err(|e| self.out_of_order(e))?;
        self.describe(name, channel.series());
        Ok(channel)
    }

    /// The truth, over the columns that the mapping has.
    pub fn truth(&mut self) -> Result<Series, ImportError> {
        let names: Vec<&str> =
            self.mapping.signals.keys().map(String::as_str).filter(|n| n.starts_with("truth_")).collect();
        let schema: Vec<_> = names.iter().filter_map(|n| signal(n).copied()).collect();
        let Some((time, columns)) = self.columns("truth", &names)? else {
            return Ok(Series::default());
        };
        let series = Series::from_columns(&schema, time, columns).map_err(|e| self.out_of_order(e))?;
        self.describe("truth", &series);
        Ok(series)
    }

    fn out_of_order(&self, error: OutOfOrder) -> ImportError {
        ImportError::TimeBackwards {
            file: self.table.name.clone(),
            row: 0,
            column: self.mapping.time.column.clone(),
            found: error.time,
            previous: error.previous,
            previous_row: 0,
        }
    }

    /// Time and SI columns of one channel; `None` if it has no sample.
    #[allow(clippy::type_complexity, reason = "time and columns, used in two places")]
    fn columns(
        &mut self,
        channel: &'static str,
        names: &[&'m str],
    ) -> Result<Option<(Vec<f64>, Vec<Vec<f64>>)>, ImportError> {
        let mut parts = Parts { name: channel, sources: Vec::new() };
        for name in names {
            let source = self.mapping.signals.get(name);
            parts.sources.push(source.map(|s| Ok((*name, s, s.factor(name, &self.table.name)?))).transpose()?);
        }
        if parts.sources.iter().all(Option::is_none) {
            return Ok(None);
        }
        let rows = self.rows_of(&parts);
        let all = rows.len() == self.table.rows;
        let mut columns: Vec<Vec<f64>> = Vec::with_capacity(parts.sources.len());
        for source in &parts.sources {
            columns.push(match source {
                None => vec![f64::NAN; rows.len()],
                Some((name, source, factor)) => self.take(name, source, *factor, &rows, all),
            });
        }
        if rows.is_empty() {
            return Ok(None);
        }
        self.blank_null_island(&parts, &mut columns);
        let mut time: Vec<f64> =
            if all { self.times.to_vec() } else { rows.iter().map(|&r| self.times[r as usize]).collect() };
        if let Some(late) = self.mapping.delays.get(channel) {
            time.iter_mut().for_each(|t| *t -= late);
        }
        self.turn(&parts, &mut columns);
        Ok(Some((time, columns)))
    }

    /// Turn triads from their housing to the car; a triad with a missing axis stays, with a warning.
    fn turn(&mut self, parts: &Parts, columns: &mut [Vec<f64>]) {
        let Some(mount) = self.mapping.mounts.get(parts.name) else { return };
        let angles = [mount.roll_deg, mount.pitch_deg, mount.yaw_deg].map(f64::to_radians);
        let rows = crate::examine::lean_rows(angles);
        for first in (0..columns.len()).step_by(3) {
            let there = (first..first + 3).filter(|k| parts.sources.get(*k).is_some_and(Option::is_some)).count();
            let [x, y, z] = &mut columns[first..(first + 3).min(parts.sources.len())] else { continue };
            if there != 3 {
                if there > 0 {
                    let text = format!(
                        "{}: a triad with {there} axes cannot be turned on its mount; left as it is.",
                        parts.name
                    );
                    self.report.warn(text, None, None, 1);
                }
                continue;
            }
            for ((x, y), z) in x.iter_mut().zip(y.iter_mut()).zip(z.iter_mut()) {
                let v = [*x, *y, *z];
                let turned = rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
                (*x, *y, *z) = (turned[0], turned[1], turned[2]);
            }
        }
    }

    /// Receivers without a fix write latitude and longitude 0: such places become blank.
    fn blank_null_island(&mut self, parts: &Parts, columns: &mut [Vec<f64>]) {
        let index = |name: &str| parts.sources.iter().position(|s| s.is_some_and(|(n, ..)| n == name));
        let (Some(lat), Some(lon)) = (index("gnss_lat"), index("gnss_lon")) else { return };
        let nowhere: Vec<usize> =
            (0..columns[lat].len()).filter(|&i| columns[lat][i] == 0.0 && columns[lon][i] == 0.0).collect();
        for &i in &nowhere {
            (columns[lat][i], columns[lon][i]) = (f64::NAN, f64::NAN);
        }
        if !nowhere.is_empty() {
            let text =
                format!("gnss: {} at latitude and longitude 0 taken as no fix.", counted(nowhere.len(), "place"));
            self.report.warn(text, None, None, nowhere.len());
        }
    }

    /// The rows that hold a sample: a time after the sample before, and a value of a signal other than `gnss_valid`.
    fn rows_of(&mut self, parts: &Parts) -> Vec<u32> {
        let telling = parts.sources.iter().flatten().filter(|(name, ..)| *name != "gnss_valid");
        let columns: Vec<&[f64]> =
            telling.filter_map(|(_, s, _)| self.table.column(&s.column)).map(|c| c.values.as_slice()).collect();
        let mut rows = Vec::with_capacity(if columns.is_empty() { 0 } else { self.table.rows });
        let (mut previous, mut repeated, mut first_repeated) = (f64::NEG_INFINITY, 0, None);
        let holds = self.mapping.drop_repeats.iter().any(|d| d == parts.name);
        for (row, &time) in self.times.iter().enumerate() {
            if time.is_nan() || !columns.iter().any(|c| c[row].is_finite()) {
                continue;
            }
            if holds
                && time < previous + HOLD
                && rows.last().is_some_and(|&kept| same_row(&columns, kept as usize, row))
            {
                continue;
            }
            if time > previous {
                rows.push(row as u32);
                previous = time;
            } else {
                repeated += 1;
                first_repeated.get_or_insert(row);
            }
        }
        if let Some(row) = first_repeated {
            let line = self.table.line_of(row);
            let text = format!(
                "{}: {} at the time of the one before left out, first in row {line}.",
                parts.name,
                counted(repeated, "sample")
            );
            self.report.warn(text, None, Some(line), repeated);
        }
        rows
    }

    /// The SI values of a signal in these rows.
    fn take(&mut self, name: &str, source: &'m SignalSource, unit_factor: f64, rows: &[u32], all: bool) -> Vec<f64> {
        let (factor, offset) = (unit_factor * source.scale, source.offset);
        let rest = self.table.rests.iter().find(|(column, _)| *column == source.column);
        let rest: Option<Vec<f64>> = rest.map(|(_, rest)| rows.iter().map(|&r| rest[r as usize]).collect());
        let uses = self.shared.uses(&source.column, 1);
        *uses -= 1;
        let last_use = *uses == 0 && source.column != self.mapping.time.column;
        let Some(column) = self.table.columns.iter_mut().find(|c| c.name == source.column) else {
            return vec![f64::NAN; rows.len()];
        };
        let raw = if last_use { std::mem::take(&mut column.values) } else { column.values.clone() };
        let mut values = if all { raw } else { rows.iter().map(|&r| raw[r as usize]).collect() };
        if !source.blank.is_empty() {
            values.iter_mut().filter(|v| source.blank.contains(v)).for_each(|v| *v = f64::NAN);
        }
        if factor != 1.0 {
            values.iter_mut().for_each(|v| *v *= factor);
        }
        for (value, rest) in values.iter_mut().zip(rest.unwrap_or_default()).filter(|(_, rest)| rest.is_finite()) {
            *value += rest * source.scale;
        }
        // Adding 0 would take the sign of a negative 0.
        if offset != 0.0 {
            values.iter_mut().for_each(|v| *v += offset);
        }
        let si = signal(name).map_or("1", |c| c.unit);
        self.report.used.push(UsedColumn {
            signal: name.to_owned(),
            column: source.column.clone(),
            unit: source.unit.clone().unwrap_or_else(|| file_unit(name, si).to_owned()),
            si,
            factor,
            offset,
            values: values.iter().filter(|v| v.is_finite()).count(),
        });
        values
    }

    /// Rate and gaps of a channel.
    fn describe(&mut self, name: &'static str, series: &Series) {
        let time = series.time();
        let step = clock::median_step(time);
        let steps = || time.windows(2).map(|w| w[1] - w[0]);
        let limit = 10.0 * step;
        let (gaps, largest_gap) = (steps().filter(|s| *s > limit).count(), steps().fold(0.0, f64::max));
        let duration = time.last().unwrap_or(&0.0) - time.first().unwrap_or(&0.0);
        if gaps > 0 {
            let at = time.windows(2).find(|w| w[1] - w[0] == largest_gap).map_or(0.0, |w| w[0]);
            let text = format!(
                "{name}: {} of more than ten steps of {step:.4} s; the longest is {largest_gap:.3} s, after {at:.3} s.",
                counted(gaps, "gap")
            );
            self.report.warn(text, None, None, gaps);
        }
        let uneven = steps().filter(|s| (s - step).abs() > 0.5 * step).count();
        if 5 * uneven > time.len() {
            let percent = 100.0 * uneven as f64 / time.len() as f64;
            let text = format!(
                "{name}: the clock is uneven: {percent:.0} % of the steps differ by more than half from the median of {step:.4} s."
            );
            self.report.warn(text, None, None, uneven);
        }
        let rate = if step > 0.0 { 1.0 / step } else { f64::NAN };
        self.report.channels.push(ChannelReport { name, samples: series.len(), rate, duration, largest_gap, gaps });
    }
}
