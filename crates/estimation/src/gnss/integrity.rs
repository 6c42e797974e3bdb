//! Whether the ranges of an instant agree with each other, and which of them does not (RAIM).
//!
//! Detection (SPEC navigation 5): the sum of the squared residuals of the single fix over the variance of a range against
//! chi-square with the number of satellites beyond four. Exclusion: the satellite whose removal lowers that sum most,
//! `r^2 / (1 - a' G a)` with its residual `r`, row `a` and the cofactor `G` (exact for a linear fix), until the rest agrees. One
//! satellite too many must be left, so that the rest is tested: six satellites exclude one, seven two.

use drivescope_drive::geodesy::LocalFrame;
use drivescope_drive::satellites::Satellite;
use nalgebra::Vector3;

use super::sight::{Sight, row, usable_but};
use super::snapshot::{Snapshot, snapshot};
use crate::chi_square;

/// Satellites that may be excluded from a fix: more faults at once than good ranges is another matter.
const MOST_EXCLUDED: u32 = 3;

/// The limits of the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrity {
    /// Largest statistics for one and more satellites too many.
    limits: [f64; 16],
    /// Whether satellites that disagree are left out.
    excludes: bool,
    /// Sigma of a range, m.
    range_sigma: f64,
}

/// A fix with what its test says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checked {
    /// The fix, of the satellites that agree.
    pub fix: Snapshot,
    /// Whether those agree; `None` without one too many.
    pub passes: Option<bool>,
    /// Squared residuals of all satellites over their variance, and for how many beyond four.
    pub all: (f64, usize),
    /// Whether all agree.
    pub all_pass: Option<bool>,
    /// The satellites left out: a bit for each index.
    pub left_out: u64,
}

impl Integrity {
    /// From the probability with which good ranges pass.
    pub fn new(probability: f64, excludes: bool, range_sigma: f64) -> Self {
        let limits = std::array::from_fn(|k| chi_square::quantile(probability, (k + 1) as f64));
        Self { limits, excludes, range_sigma }
    }

    /// Whether the residuals of a fix are as small as their noise; `None` without a satellite too many.
    fn passes(&self, fix: &Snapshot) -> Option<bool> {
        let spare = fix.satellites.checked_sub(4).filter(|n| *n > 0)?;
        Some(fix.residuals <= self.limits[(spare - 1).min(self.limits.len() - 1)])
    }

    /// The fix of an instant, searched from `start`; `None` as for [`snapshot`].
    pub fn fix(&self, frame: &LocalFrame, satellites: &[Satellite], start: Option<Vector3<f64>>) -> Option<Checked> {
        let fix = snapshot(frame, satellites, 0, start, self.range_sigma)?;
        let passes = self.passes(&fix);
        let all = (fix.residuals, fix.satellites - 4);
        let mut checked = Checked { fix, passes, all, all_pass: passes, left_out: 0 };
        while self.excludes
            && checked.passes == Some(false)
            && checked.fix.satellites >= 6
            && checked.left_out.count_ones() < MOST_EXCLUDED
        {
            let Some(worst) = worst(frame, satellites, &checked) else { break };
            let left_out = checked.left_out | 1 << worst;
            let Some(fix) = snapshot(frame, satellites, left_out, Some(checked.fix.place), self.range_sigma) else {
                break;
            };
            checked = Checked { fix, passes: self.passes(&fix), left_out, ..checked };
        }
        if checked.passes == Some(false) {
            // Nothing that agrees was found: the fix of all.
            checked = Checked { fix, passes, left_out: 0, ..checked };
        }
        Some(checked)
    }
}

/// Index of the satellite without which the residuals fall most.
fn worst(frame: &LocalFrame, satellites: &[Satellite], checked: &Checked) -> Option<usize> {
    let fix = &checked.fix;
    let gains = usable_but(satellites, checked.left_out).map(|(k, satellite)| {
        let sight = Sight::new(frame, &fix.place, satellite);
        let a = row(&sight.direction);
        let residual = satellite.range - sight.distance - fix.clock_bias;
        // A satellite without which there is no fix has a leverage of 1 and no residual.
        (k, residual * residual / (1.0 - (a.transpose() * fix.cofactor * a)[0]).max(1e-6))
    });
    gains.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}
