//! The median and other ranks of numbers, in one place: every further copy of the selection costs the page a kilobyte.

/// The number of rank `index` (0 is the least); NaN if there is none. The order of `values` is lost.
#[inline(never)]
pub fn nth(values: &mut [f64], index: usize) -> f64 {
    if index >= values.len() {
        return f64::NAN;
    }
    *values.select_nth_unstable_by(index, f64::total_cmp).1
}

/// The median, the upper of two middle numbers; NaN of nothing. The order of `values` is lost.
pub fn median(values: &mut [f64]) -> f64 {
    nth(values, values.len() / 2)
}

/// The median, the mean of two middle numbers; NaN of nothing. The order of `values` is lost.
pub fn midpoint(values: &mut [f64]) -> f64 {
    let upper = median(values);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 || values.is_empty() {
        return upper;
    }
    // The selection has put what is below the upper one before it.
    0.5 * (upper + values[..middle].iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_count_from_the_least_and_nothing_has_none() {
        assert_eq!(nth(&mut [3.0, -1.0, 2.0], 0), -1.0);
        assert_eq!(median(&mut [3.0, -1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0]), 4.0);
        assert_eq!((midpoint(&mut [4.0, 1.0, 3.0, 2.0]), midpoint(&mut [5.0, 1.0, 3.0])), (2.5, 3.0));
        assert!(midpoint(&mut []).is_nan());
        assert!(median(&mut []).is_nan() && nth(&mut [1.0], 1).is_nan());
    }
}
