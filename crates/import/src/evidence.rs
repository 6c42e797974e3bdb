//! What the values of a table say together: means over short bins, compared between signals.

use drivescope_drive::csv::file_unit;

use crate::candidate::{Candidate, Confidence, Unused};
use crate::channels::signal;
use crate::table::Table;
use crate::units;

/// A mapping in the making over its table.
pub(crate) struct Draft<'a> {
    table: &'a Table,
    time: &'a [f64],
    candidates: Vec<Candidate>,
    notes: Vec<String>,
    removed: Vec<Unused>,
    repeating: Vec<String>,
}

/// A draft after its checks.
pub(crate) struct Settled {
    pub candidates: Vec<Candidate>,
    pub notes: Vec<String>,
    pub removed: Vec<Unused>,
    pub repeating: Vec<String>,
}

/// What one signal was during one bin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Binned {
    /// Mean of the values.
    pub mean: f64,
    /// The last value.
    pub last: f64,
    /// Mean time of the values, s.
    pub time: f64,
}

impl<'a> Draft<'a> {
    pub fn new(table: &'a Table, time: &'a [f64], candidates: Vec<Candidate>, notes: Vec<String>) -> Self {
        Self { table, time, candidates, notes, removed: Vec::new(), repeating: Vec::new() }
    }

    /// Hand over what was settled.
    pub fn finish(self) -> Settled {
        Settled { candidates: self.candidates, notes: self.notes, removed: self.removed, repeating: self.repeating }
    }

    pub fn get(&self, name: &str) -> Option<&Candidate> {
        self.candidates.iter().find(|c| c.signal == name)
    }

    /// Whether the signal is there and its unit is a convention that may be doubted.
    pub fn unit_is_open(&self, name: &str) -> bool {
        self.get(name).is_some_and(|c| !c.stated)
    }

    /// Name of the raw column of a signal, in backquotes; the signal's if there is none.
    pub fn column(&self, name: &str) -> String {
        self.get(name).map_or(format!("`{name}`"), |c| format!("`{}`", self.table.columns[c.column].name))
    }

    /// Change unit and scale of a signal, with the reason.
    pub fn revise(&mut self, name: &str, unit: Option<&str>, turn: bool, why: &str) {
        if let Some(c) = self.candidates.iter_mut().find(|c| c.signal == name) {
            let si = signal(name).map_or("1", |s| file_unit(name, s.unit));
            if let Some(unit) = unit {
                if unit != c.unit {
                    c.confidence = c.confidence.min(Confidence::Likely);
                    c.why.retain(|w| !w.contains("by convention"));
                }
                c.unit = if unit == si { si.to_owned() } else { unit.to_owned() };
            }
            if turn {
                c.scale = -c.scale;
                c.confidence = c.confidence.min(Confidence::Likely);
            }
            c.why.push(why.to_owned());
        }
    }

    pub fn note(&mut self, note: String) {
        self.notes.push(note);
    }

    /// Leave a signal out.
    pub fn remove(&mut self, name: &str, reason: &str) {
        if let Some(index) = self.candidates.iter().position(|c| c.signal == name) {
            let column = self.table.columns[self.candidates.remove(index).column].name.clone();
            self.removed.push(Unused { column, reason: reason.to_owned() });
        }
    }

    /// Have repeats of a channel's samples left out.
    pub fn drop_repeats(&mut self, channel: &str) {
        self.repeating.push(channel.to_owned());
    }

    /// Factor from the raw values to SI as the mapping stands.
    pub fn factor(&self, name: &str) -> f64 {
        let si = signal(name).map_or("1", |s| s.unit);
        self.get(name).map_or(f64::NAN, |c| c.scale * units::factor(&c.unit, si).unwrap_or(f64::NAN))
    }

    /// The raw values, all rows; empty if the signal is not there.
    pub fn raw(&self, name: &str) -> &'a [f64] {
        self.get(name).map_or(&[], |c| self.table.columns[c.column].values.as_slice())
    }

    /// Up to 20,000 of the raw values, evenly.
    pub fn some_raw(&self, name: &str) -> Vec<f64> {
        let values = self.raw(name);
        let count = values.iter().filter(|v| v.is_finite()).count();
        values.iter().copied().filter(|v| v.is_finite()).step_by(1 + count / 20_000).collect()
    }

    /// Largest magnitude of the raw values; 0 without any.
    pub fn max_abs(&self, name: &str) -> f64 {
        self.raw(name).iter().filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// Signals in SI over bins of `width` seconds; NaN where a bin has no value of one. Up to 20,000 bins.
    pub fn bins<const N: usize>(&self, names: [&str; N], width: f64) -> Vec<[Binned; N]> {
        let columns = names.map(|n| (self.raw(n), self.factor(n)));
        let mut bins = Vec::new();
        let mut sums = [(0.0, 0.0, 0.0, f64::NAN); N];
        let mut current = f64::NAN;
        let close =
            |sums: &[(f64, f64, f64, f64); N]| sums.map(|(n, v, t, last)| Binned { mean: v / n, last, time: t / n });
        for (row, &time) in self.time.iter().enumerate().filter(|(_, t)| t.is_finite()) {
            let index = (time / width).floor();
            if index != current {
                if sums.iter().any(|s| s.0 > 0.0) {
                    bins.push(close(&sums));
                }
                if bins.len() >= 20_000 {
                    return bins;
                }
                (sums, current) = ([(0.0, 0.0, 0.0, f64::NAN); N], index);
            }
            for ((values, factor), sum) in columns.iter().zip(&mut sums) {
                if let Some(v) = values.get(row).filter(|v| v.is_finite()) {
                    let v = v * factor;
                    *sum = (sum.0 + 1.0, sum.1 + v, sum.2 + time, v);
                }
            }
        }
        if sums.iter().any(|s| s.0 > 0.0) {
            bins.push(close(&sums));
        }
        bins
    }
}
