//! The errors of an estimate as curves.

use drivescope_drive::channel::{Column, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;

use super::reference::TruthTable;

/// Estimate less truth, row by row, under the names of the columns that have a truth, with the sigmas of these; `None` where
/// the drive has the truth of none of them. Angles by the short way round, NaN where estimate or truth has no value.
pub fn errors(estimates: &Series, drive: &Drive) -> Option<Series> {
    let schema = estimates.schema();
    let mut truths = TruthTable::new(drive, estimates.time());
    let mut kept: Vec<Column> = Vec::new();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for (index, column) in schema.iter().enumerate() {
        let values = estimates.column_at(index);
        if let Some(truth) = column.truth.and_then(|name| truths.get(name)) {
            let is_circular = column.is_circular();
            let less = |(estimate, truth): (&f64, &f64)| {
                let error = estimate - truth;
                if is_circular { wrap_angle(error) } else { error }
            };
            columns.push(values.iter().zip(truth).map(less).collect());
            kept.push(*column);
        } else if column.sigma_of.is_some_and(|of| kept.iter().any(|k| k.name == of)) {
            columns.push(values.to_vec());
            kept.push(*column);
        }
    }
    if columns.is_empty() {
        return None;
    }
    Series::from_columns(&kept, estimates.time().to_vec(), columns).ok()
}
