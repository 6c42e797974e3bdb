//! The columns of a log on a grid of tenths of a second, for trying mappings on them.

use super::scene::{STEP, Scene};
use crate::table::Table;

/// Raw columns of a log, thinned to tenths of a second.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Thinned {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Middle of the first bin, s, on the clock of the drive.
    pub start: f64,
    /// Mean raw value in each bin, of each column; not a number where there is none near. Columns without values are empty.
    pub columns: Vec<Vec<f64>>,
}

impl Thinned {
    /// What a scene holds of a table with these times.
    pub(crate) fn new(table: &Table, time: &[f64], scene: Scene) -> Self {
        let start = time.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0) + 0.5 * STEP;
        let names = table.columns.iter().map(|c| c.name.clone()).collect();
        Self { names, start, columns: scene.fields.into_iter().map(|f| f.grid).collect() }
    }

    pub(super) fn bins(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }
}
