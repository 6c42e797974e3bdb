//! The changes of mode in a run, each with what it was decided from: what a timeline needs to explain itself.

use drivescope_drive::channel::Series;

/// The statistics and thresholds of a row, in the order of [`Change::statistics`].
const STATISTICS: [&str; 8] = ["jd", "jd_threshold", "td", "td_threshold", "fd", "fd_threshold", "yd", "yd_threshold"];

/// A row at which the mode became another, or the first row of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// When, s.
    pub time: f64,
    /// Mode before; NaN at the first row.
    pub from: f64,
    /// Mode from here on.
    pub to: f64,
    /// The rule that fired: a code of the column `rule`.
    pub rule: f64,
    /// Dynamics indicator, 1 to 3.
    pub indicator: f64,
    /// JD, TD, FD and YD, each followed by its threshold, at the row that decided.
    pub statistics: [f64; 8],
}

/// Every change of mode in the estimates of `motion_mode`; none where a column is missing.
pub fn changes(series: &Series) -> Vec<Change> {
    let column = |name| series.column(name).unwrap_or_default();
    let (mode, rule, indicator) = (column("mode"), column("rule"), column("indicator"));
    let statistics = STATISTICS.map(column);
    let mut out = Vec::new();
    for (row, (&time, &to)) in series.time().iter().zip(mode).enumerate() {
        let from = row.checked_sub(1).map_or(f64::NAN, |before| mode[before]);
        if to == from {
            continue;
        }
        let at = |column: &[f64]| column.get(row).copied().unwrap_or(f64::NAN);
        let (rule, indicator) = (at(rule), at(indicator));
        out.push(Change { time, from, to, rule, indicator, statistics: statistics.map(at) });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::{MotionModeDetector, MotionModeParams, Rule};
    use super::*;
    use crate::case_log::{Table, shared};
    use crate::estimator::Run;

    /// Catches a rule taken from the row before or after, and a change that is lost.
    #[test]
    fn every_change_of_a_drive_is_there_with_the_rule_and_the_numbers_that_decided() {
        let Some(path) = shared("spec/motion/c3_stopgo_3acc3gyro.csv.gz") else { return };
        let drive = Table::read(&path).drive();
        let mut run = Run::<MotionModeDetector>::new(&drive, &MotionModeParams::default(), None).unwrap();
        while !run.advance(&drive, usize::MAX).unwrap() {}
        let series = run.estimates().series();
        let changes = changes(series);
        assert!(changes[0].from.is_nan() && changes[0].to == 0.0 && changes[0].rule == Rule::Learning.code());
        let mode = series.column("mode").unwrap();
        assert_eq!(changes.len(), 1 + mode.windows(2).filter(|w| w[0] != w[1]).count());
        for c in &changes[1..] {
            let [jd, jd_th, td, td_th, fd, fd_th, yd, yd_th] = c.statistics;
            match (c.from, c.to) {
                (0.0, _) if c.rule == Rule::LaunchByForce.code() => assert!(fd > fd_th, "{c:?}"),
                (0.0, _) if c.rule == Rule::LaunchByEscape.code() => assert!(jd > jd_th && td > td_th, "{c:?}"),
                (_, 0.0) if c.rule == Rule::Stop.code() => assert!(jd <= jd_th && td <= td_th && fd <= fd_th, "{c:?}"),
                (1.0, 2.0) => assert!(yd.abs() > yd_th, "{c:?}"),
                (2.0, 1.0) => assert!(yd.abs() <= yd_th, "{c:?}"),
                _ => assert!(c.rule > 0.0, "{c:?}"),
            }
        }
    }
}
