//! Causal windows with running sums: what the detector's statistics are computed from.

/// The last values of a signal and their sum, in constant time.
///
/// The sum is formed anew once per window length, so rounding does not pile up: it is right to some 1e-14 relative.
#[derive(Clone, Debug)]
pub(super) struct RunningSum {
    values: Vec<f64>,
    next: usize,
    filled: usize,
    sum: f64,
}

impl RunningSum {
    pub(super) fn new(length: usize) -> Self {
        Self { values: vec![0.0; length.max(1)], next: 0, filled: 0, sum: 0.0 }
    }

    pub(super) fn clear(&mut self) {
        (self.next, self.filled, self.sum) = (0, 0, 0.0);
    }

    pub(super) fn push(&mut self, value: f64) {
        let slot = &mut self.values[self.next];
        if self.filled == 0 {
            self.sum = 0.0;
        }
        let leaving = std::mem::replace(slot, value);
        if self.is_full() {
            self.sum += value - leaving;
        } else {
            self.sum += value;
            self.filled += 1;
        }
        self.next += 1;
        if self.next == self.values.len() {
            self.next = 0;
            self.sum = self.values.iter().sum();
        }
    }

    pub(super) fn is_full(&self) -> bool {
        self.filled == self.values.len()
    }

    /// Mean of the values present; 0 without any.
    pub(super) fn mean(&self) -> f64 {
        self.sum / self.filled.max(1) as f64
    }
}

/// The last values of a signal, and how far they lie from the oldest of them.
///
/// Each value is kept twice, a window apart, so that the window is always one contiguous slice.
#[derive(Clone, Debug)]
pub(super) struct Lag {
    twice: Vec<f64>,
    next: usize,
    filled: usize,
}

impl Lag {
    pub(super) fn new(length: usize) -> Self {
        Self { twice: vec![0.0; 2 * length.max(1)], next: 0, filled: 0 }
    }

    pub(super) fn clear(&mut self) {
        (self.next, self.filled) = (0, 0);
    }

    pub(super) fn push(&mut self, value: f64) {
        let length = self.twice.len() / 2;
        self.twice[self.next] = value;
        self.twice[self.next + length] = value;
        self.next = if self.next + 1 == length { 0 } else { self.next + 1 };
        self.filled = (self.filled + 1).min(length);
    }

    /// Mean distance of the values present from the oldest of them; 0 without any.
    pub(super) fn mean_distance(&self) -> f64 {
        let length = self.twice.len() / 2;
        let window =
            if self.filled == length { &self.twice[self.next..self.next + length] } else { &self.twice[..self.filled] };
        let Some(&oldest) = window.first() else { return 0.0 };
        // Eight independent sums, which the compiler turns into vector registers.
        let mut sums = [0.0; 8];
        let mut chunks = window.chunks_exact(8);
        for chunk in &mut chunks {
            for (sum, value) in sums.iter_mut().zip(chunk) {
                *sum += (value - oldest).abs();
            }
        }
        let rest: f64 = chunks.remainder().iter().map(|v| (v - oldest).abs()).sum();
        (sums.iter().sum::<f64>() + rest) / self.filled as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn running_sums_equal_sums_written_out_at_every_row() {
        let value = |k: usize| ((k * k % 101) as f64).sin() * if k == 40 { 1e9 } else { 1.0 };
        let (mut sum, mut lag) = (RunningSum::new(7), Lag::new(19));
        for k in 0..200 {
            sum.push(value(k));
            lag.push(value(k));
            let window: Vec<f64> = (k.saturating_sub(6)..=k).map(value).collect();
            let mean = window.iter().sum::<f64>() / window.len() as f64;
            // The value of 1e9 leaves its rounding behind until the sum is formed anew, at most one window later.
            let tolerance = if (40..60).contains(&k) { 1e-6 } else { 1e-14 };
            assert!((sum.mean() - mean).abs() <= tolerance * (1.0 + mean.abs()), "{k}");
            let window: Vec<f64> = (k.saturating_sub(18)..=k).map(value).collect();
            let distance = window.iter().map(|v| (v - window[0]).abs()).sum::<f64>() / window.len() as f64;
            assert!((lag.mean_distance() - distance).abs() <= 1e-14 * (1.0 + distance), "{k}");
        }
    }

    #[test]
    fn a_cleared_window_starts_again() {
        let (mut sum, mut lag) = (RunningSum::new(3), Lag::new(3));
        for k in 0..5 {
            sum.push(f64::from(k));
            lag.push(f64::from(k));
        }
        sum.clear();
        lag.clear();
        assert_eq!((sum.mean(), lag.mean_distance(), sum.is_full()), (0.0, 0.0, false));
        sum.push(4.0);
        lag.push(4.0);
        lag.push(6.0);
        assert_eq!((sum.mean(), lag.mean_distance()), (4.0, 1.0));
    }
}
