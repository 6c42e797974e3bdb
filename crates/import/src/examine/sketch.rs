//! Small pictures of raw columns, as a table of the mapping shows them beside their names.

/// The least and the largest value of each of `buckets` equal parts of a column, in turn: least, largest, least, ... A part
/// without a value has two that are not numbers; a column shorter than that has one part per value.
pub(crate) fn sketch(values: &[f64], buckets: usize) -> Vec<f64> {
    let buckets = buckets.min(values.len());
    let mut out = Vec::with_capacity(2 * buckets);
    for i in 0..buckets {
        let part = &values[i * values.len() / buckets..(i + 1) * values.len() / buckets];
        // What is not a number is passed over by both.
        let least = part.iter().copied().fold(f64::NAN, f64::min);
        let largest = part.iter().copied().fold(f64::NAN, f64::max);
        out.extend([least, largest]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a bucket that loses its last value, and blanks that spoil their bucket.
    #[test]
    fn a_sketch_holds_every_extreme_and_passes_over_blanks() {
        let drawn = sketch(&[1.0, f64::NAN, 3.0, -2.0, 5.0, 4.0, 9.0], 3);
        assert_eq!(drawn, [1.0, 1.0, -2.0, 3.0, 4.0, 9.0]);
    }

    /// Catches a division by the number of values and an infinity where nothing was measured.
    #[test]
    fn a_column_without_values_has_no_numbers() {
        assert!(sketch(&[f64::NAN; 4], 2).iter().all(|v| v.is_nan()));
        assert!(sketch(&[], 8).is_empty());
    }
}
