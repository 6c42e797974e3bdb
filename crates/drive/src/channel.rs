//! Named, unit-carrying columns over one time column: the only container of numbers in Drivescope.

use std::marker::PhantomData;

/// What one column means. Written by [`record!`](crate::record), or as a table of constants.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Column {
    /// Name in files, plots and tables.
    pub name: &'static str,
    /// SI unit; `1` for a pure number.
    pub unit: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// The column this one is the 1-sigma of.
    pub sigma_of: Option<&'static str>,
    /// The truth signal this column estimates (name without the `truth_` prefix).
    pub truth: Option<&'static str>,
    /// Set on a normalized innovation squared: its degrees of freedom.
    pub nis: Option<u32>,
}

impl Column {
    /// A column with no relations.
    pub const fn new(name: &'static str, unit: &'static str, doc: &'static str) -> Self {
        Self { name, unit, doc: doc.trim_ascii(), sigma_of: None, truth: None, nis: None }
    }
    /// Name in files, where it differs from the field's.
    pub const fn name(mut self, name: &'static str) -> Self {
        self.name = name;
        self
    }
    /// Mark as the 1-sigma of `name`.
    pub const fn sigma_of(mut self, name: &'static str) -> Self {
        self.sigma_of = Some(name);
        self
    }
    /// Mark as an estimate of the truth signal `name`.
    pub const fn truth(mut self, name: &'static str) -> Self {
        self.truth = Some(name);
        self
    }
    /// Mark as a normalized innovation squared with `dof` degrees of freedom.
    pub const fn nis(mut self, dof: u32) -> Self {
        self.nis = Some(dof);
        self
    }
    /// Whether differences have to be wrapped to `(-pi, pi]` before they are compared.
    pub fn is_circular(&self) -> bool {
        matches!(self.truth.unwrap_or(self.name), "yaw" | "course" | "gnss_course")
    }
}

/// A row type whose fields are columns. Written with [`record!`](crate::record), never by hand.
pub trait Record: Copy {
    /// The columns, in the order of `write` and `read`.
    const COLUMNS: &'static [Column];
    /// Put the fields into `row`, which is as long as `COLUMNS`.
    fn write(&self, row: &mut [f64]);
    /// Build from a row as long as `COLUMNS`, cell by cell.
    fn read(cell: impl FnMut(usize) -> f64) -> Self;
}

/// The most columns that one record may have.
pub const MAX_COLUMNS: usize = 96;

/// A row that is not later than the one before it.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
#[error("sample at {time} s is not after the previous one at {previous} s")]
pub struct OutOfOrder {
    /// Time of the refused row, s.
    pub time: f64,
    /// Time of the row before it, s.
    pub previous: f64,
}

/// Columns over one time column, with their schema: a [`Channel`] whose row type has been forgotten.
///
/// NaN in a cell means "no value here". Times are seconds, strictly increasing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    time: Vec<f64>,
    schema: Vec<Column>,
    columns: Vec<Vec<f64>>,
}

impl Series {
    /// An empty series with the given columns.
    pub fn new(schema: &[Column]) -> Self {
        Self { time: Vec::new(), schema: schema.to_vec(), columns: vec![Vec::new(); schema.len()] }
    }

    /// A series over whole columns, one per entry of the schema and as long as `time`.
    ///
    /// # Errors
    /// [`OutOfOrder`] at the first time that is not finite or not after the one before it.
    ///
    /// # Panics
    /// When the number or the length of the columns does not fit.
    pub fn from_columns(schema: &[Column], time: Vec<f64>, columns: Vec<Vec<f64>>) -> Result<Self, OutOfOrder> {
        assert!(
            columns.len() == schema.len() && columns.iter().all(|c| c.len() == time.len()),
            "columns fit the schema"
        );
        let mut previous = f64::NEG_INFINITY;
        for &t in &time {
            if !(t > previous && t < f64::INFINITY) {
                return Err(OutOfOrder { time: t, previous });
            }
            previous = t;
        }
        Ok(Self { time, schema: schema.to_vec(), columns })
    }

    /// Append a row as wide as the schema.
    ///
    /// # Errors
    /// [`OutOfOrder`] when `time` is not finite or not after the last row's; the series is unchanged.
    pub fn push(&mut self, time: f64, row: &[f64]) -> Result<(), OutOfOrder> {
        let previous = self.time.last().copied().unwrap_or(f64::NEG_INFINITY);
        if !(time > previous && time < f64::INFINITY) {
            return Err(OutOfOrder { time, previous });
        }
        self.time.push(time);
        for (column, &value) in self.columns.iter_mut().zip(row) {
            column.push(value);
        }
        Ok(())
    }

    /// Put another row in the place of the one at `index`.
    ///
    /// # Panics
    /// When `index` is not below `len`.
    pub fn replace(&mut self, index: usize, row: &[f64]) {
        for (column, &value) in self.columns.iter_mut().zip(row) {
            column[index] = value;
        }
    }

    /// The time column and a column whose values may be changed.
    ///
    /// # Panics
    /// When `index` is outside the schema.
    pub fn column_mut(&mut self, index: usize) -> (&[f64], &mut [f64]) {
        (&self.time, &mut self.columns[index])
    }

    /// Make room for `rows` more rows.
    pub fn reserve(&mut self, rows: usize) {
        self.time.reserve(rows);
        self.columns.iter_mut().for_each(|c| c.reserve(rows));
    }

    /// Time, schema and columns, by value.
    pub fn into_columns(self) -> (Vec<f64>, Vec<Column>, Vec<Vec<f64>>) {
        (self.time, self.schema, self.columns)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time.len()
    }
    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }
    /// The time column, s.
    pub fn time(&self) -> &[f64] {
        &self.time
    }
    /// The columns' meanings.
    pub fn schema(&self) -> &[Column] {
        &self.schema
    }
    /// The index of a column.
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.schema.iter().position(|c| c.name == name)
    }
    /// A column by name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.index_of(name).map(|i| self.columns[i].as_slice())
    }
    /// A column by index.
    ///
    /// # Panics
    /// When `index` is outside the schema.
    pub fn column_at(&self, index: usize) -> &[f64] {
        &self.columns[index]
    }
    /// Whether the column exists and holds a value anywhere.
    pub fn has(&self, name: &str) -> bool {
        self.column(name).is_some_and(|c| c.iter().any(|v| v.is_finite()))
    }
    /// The value at `time`, linear between rows; NaN outside, beside a NaN, or across a hole wider than `max_gap` s.
    ///
    /// A circular column is interpolated the short way round.
    pub fn interpolate(&self, index: usize, time: f64, max_gap: f64) -> f64 {
        let after = self.time.partition_point(|&t| t < time);
        let column = &self.columns[index];
        if after < self.time.len() && self.time[after] == time {
            return column[after];
        }
        if after == 0 || after == self.time.len() || self.time[after] - self.time[after - 1] > max_gap {
            return f64::NAN;
        }
        let (t0, t1) = (self.time[after - 1], self.time[after]);
        let (a, b) = (column[after - 1], column[after]);
        let difference = if self.schema[index].is_circular() { crate::frames::wrap_angle(b - a) } else { b - a };
        a + difference * (time - t0) / (t1 - t0)
    }
}

/// Samples of one record type, column by column, on the drive's clock.
#[derive(Clone, Debug)]
pub struct Channel<R: Record> {
    series: Series,
    /// Where a sample becomes a row, so that no row is made anew.
    row: Vec<f64>,
    record: PhantomData<R>,
}

impl<R: Record> Default for Channel<R> {
    fn default() -> Self {
        Self::over(Series::new(R::COLUMNS))
    }
}

impl<R: Record> PartialEq for Channel<R> {
    fn eq(&self, other: &Self) -> bool {
        self.series == other.series
    }
}

impl<R: Record> Channel<R> {
    /// A channel over whole columns; see [`Series::from_columns`].
    ///
    /// # Errors
    /// [`OutOfOrder`] at the first time that is not finite or not after the one before it.
    ///
    /// # Panics
    /// When the number or the length of the columns does not fit.
    pub fn from_columns(time: Vec<f64>, columns: Vec<Vec<f64>>) -> Result<Self, OutOfOrder> {
        Ok(Self::over(Series::from_columns(R::COLUMNS, time, columns)?))
    }
    fn over(series: Series) -> Self {
        const { assert!(R::COLUMNS.len() <= MAX_COLUMNS) };
        Self { series, row: vec![f64::NAN; R::COLUMNS.len()], record: PhantomData }
    }
    /// Append a sample.
    ///
    /// # Errors
    /// [`OutOfOrder`] when `time` is not finite or not after the last sample's; the channel is unchanged.
    pub fn push(&mut self, time: f64, sample: R) -> Result<(), OutOfOrder> {
        sample.write(&mut self.row);
        self.series.push(time, &self.row)
    }
    /// Put another sample in the place of the one at `index`; its time stays.
    ///
    /// # Panics
    /// When `index` is not below `len`.
    pub fn replace(&mut self, index: usize, sample: R) {
        let mut row = [0.0; MAX_COLUMNS];
        sample.write(&mut row[..R::COLUMNS.len()]);
        self.series.replace(index, &row[..R::COLUMNS.len()]);
    }
    /// Make room for `samples` more samples.
    pub fn reserve(&mut self, samples: usize) {
        self.series.reserve(samples);
    }
    /// Time and sample at an index.
    ///
    /// # Panics
    /// When `index` is not below `len`.
    pub fn at(&self, index: usize) -> (f64, R) {
        (self.series.time[index], R::read(|c| self.series.columns[c][index]))
    }
    /// The samples in time order.
    pub fn iter(&self) -> impl Iterator<Item = (f64, R)> + '_ {
        (0..self.len()).map(|i| self.at(i))
    }
    /// The columns without the row type; their values may be changed, their number and times not.
    pub(crate) fn series_mut(&mut self) -> &mut Series {
        &mut self.series
    }
    /// The columns without the row type.
    pub fn series(&self) -> &Series {
        &self.series
    }
    /// The columns without the row type, by value.
    pub fn into_series(self) -> Series {
        self.series
    }
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.series.len()
    }
    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.series.is_empty()
    }
    /// The time column, s.
    pub fn time(&self) -> &[f64] {
        self.series.time()
    }
    /// A column by name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.series.column(name)
    }
}

/// Declare a row type once: fields, units, docs and relations.
///
/// Relations after the unit: `name "x"` (name in files), `sigma_of "x"`, `truth "x"`, `nis 3` (degrees of freedom).
/// `Default` is NaN in every field: no value yet.
#[macro_export]
macro_rules! record {
    ($(#[doc = $rdoc:literal])* $vis:vis struct $name:ident {
        $( $(#[doc = $doc:literal])+ $field:ident : $unit:literal $(, $key:ident $val:literal)* ; )+
    }) => {
        $(#[doc = $rdoc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis struct $name { $( $(#[doc = $doc])+ #[doc = concat!("\n\nUnit: ", $unit)] pub $field: f64, )+ }
        impl Default for $name {
            fn default() -> Self { Self { $( $field: f64::NAN, )+ } }
        }
        impl $crate::channel::Record for $name {
            const COLUMNS: &'static [$crate::channel::Column] = {
                // One copy in the program, where a constant would be copied to every crate that names it.
                static TABLE: [$crate::channel::Column; [ $( stringify!($field) ),+ ].len()] = [ $(
                    $crate::channel::Column::new(stringify!($field), $unit, concat!($($doc),+)) $( .$key($val) )*
                ),+ ];
                &TABLE
            };
            fn write(&self, row: &mut [f64]) {
                let mut next = 0;
                let row = &mut row[..[ $( stringify!($field) ),+ ].len()];
                $( row[next] = self.$field; next += 1; )+
                let _ = next;
            }
            fn read(mut cell: impl FnMut(usize) -> f64) -> Self {
                let mut next = 0;
                let mut take = || { next += 1; cell(next - 1) };
                Self { $( $field: take(), )+ }
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    record! {
        /// A row.
        pub struct Row {
            /// Heading.
            heading: "rad", name "yaw", truth "yaw";
            /// Its sigma.
            heading_sigma: "rad", sigma_of "yaw";
            /// Test statistic.
            nis: "1", nis 3;
        }
    }

    #[test]
    fn a_record_declares_its_columns_once() {
        assert_eq!(Row::COLUMNS[0], Column::new("yaw", "rad", "Heading.").truth("yaw"));
        assert_eq!((Row::COLUMNS[1].sigma_of, Row::COLUMNS[2].nis), (Some("yaw"), Some(3)));
        let mut channel = Channel::default();
        let row = Row { heading: 1.0, heading_sigma: 2.0, nis: 3.0 };
        channel.push(0.5, row).unwrap();
        assert_eq!(channel.at(0), (0.5, row));
        channel.push(1.5, row).unwrap();
        channel.replace(0, Row { heading: -1.0, ..row });
        assert_eq!(channel.at(0), (0.5, Row { heading: -1.0, ..row }));
        assert_eq!(channel.at(1), (1.5, row));
    }

    #[test]
    fn time_runs_forward_or_the_row_is_refused() {
        let mut channel = Channel::<Row>::default();
        channel.push(1.0, Row::default()).unwrap();
        for bad in [1.0, 0.5, f64::NAN, f64::INFINITY] {
            assert!(channel.push(bad, Row::default()).is_err());
        }
        assert_eq!(channel.len(), 1);
    }

    #[test]
    fn interpolation_goes_the_short_way_round_and_not_across_holes() {
        let mut channel = Channel::<Row>::default();
        channel.push(0.0, Row { heading: 3.0, ..Row::default() }).unwrap();
        channel.push(1.0, Row { heading: -3.0, ..Row::default() }).unwrap();
        let s = channel.series();
        assert!((s.interpolate(0, 0.5, 2.0) - std::f64::consts::PI).abs() < 1e-12);
        assert!(s.interpolate(0, 0.5, 0.9).is_nan());
        assert!(s.interpolate(0, -0.1, 2.0).is_nan());
        assert_eq!(s.interpolate(0, 1.0, 0.1), -3.0);
    }
}
