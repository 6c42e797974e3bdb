//! Signals of one sensor that come over several clocks, put on one of them.

use crate::clock;
use crate::merge::Part;
use crate::table::RawColumn;

/// Values are interpolated between samples that are at most this far apart, s.
const BRIDGE: f64 = 0.25;

/// Inertial signals with clocks of their own are interpolated to the clock that has most of them, so that they make one
/// inertial sample.
pub(crate) fn pair_inertial(parts: &mut [Part], notes: &mut Vec<String>) {
    const SIGNALS: [&str; 6] = ["gyro_z", "gyro_x", "gyro_y", "accel_x", "accel_y", "accel_z"];
    let count = |p: &Part| SIGNALS.iter().filter(|s| p.has(s)).count();
    // The first of those with most; of equal ones that of the gyroscope, which is integrated.
    let rank = |(i, p): &(usize, &Part)| (count(p), p.has("gyro_z"), std::cmp::Reverse(*i));
    let Some((main, _)) = parts.iter().enumerate().max_by_key(rank).filter(|(_, p)| count(p) > 0) else { return };
    let at = parts[main].time.clone();
    for other in (0..parts.len()).filter(|&i| i != main) {
        let mut moved = Vec::new();
        for signal in SIGNALS {
            if parts[main].has(signal) || !parts[other].has(signal) {
                continue;
            }
            let is_it = |c: &RawColumn| !Part::is_clock(c) && Part::signals(c).iter().any(|s| s == signal);
            let Some(index) = parts[other].table.columns.iter().position(is_it) else { continue };
            let mut column = parts[other].table.columns.remove(index);
            column.values = interpolate(&parts[other].time, &column.values, &at);
            moved.push(format!("`{}`", column.name));
            parts[main].table.columns.push(column);
        }
        if !moved.is_empty() {
            let steps = [&parts[other].time, &at].map(|t| 1e3 * clock::median_step(t));
            notes.push(format!(
                "{} of {} were interpolated from their own clock to that of {}, so that both make one inertial sample \
                 (steps of {:.2} and {:.2} ms).",
                moved.join(", "),
                parts[other].label(),
                parts[main].label(),
                steps[0],
                steps[1]
            ));
        }
    }
    // The table with most inertial signals comes first: of two of a name it is the one that is taken.
    parts[..=main].rotate_right(1);
}

/// What a receiver sends in several messages of one burst is put together with its position.
pub(crate) fn gather_fixes(parts: &mut [Part], notes: &mut Vec<String>) {
    let Some(main) = parts.iter().position(|p| p.has("gnss_lat")) else { return };
    let at = parts[main].time.clone();
    let reach = 0.45 * clock::median_step(&at);
    let file = parts[main].table.name.clone();
    let is_gnss = |signal: &String| signal.starts_with("gnss_") || signal == "course";
    let mut gathered = Vec::new();
    for other in (0..parts.len()).filter(|&i| i != main) {
        if parts[other].table.name != file {
            continue;
        }
        let columns = std::mem::take(&mut parts[other].table.columns);
        for mut column in columns {
            let signal = if Part::is_clock(&column) { None } else { Part::signals(&column).into_iter().next() };
            match signal.filter(is_gnss).filter(|s| !parts[main].has(s)) {
                Some(_) => {
                    let values = nearest(&parts[other].time, &column.values, &at, reach);
                    if values.iter().all(|v| v.is_nan()) {
                        parts[other].table.columns.push(column);
                        continue;
                    }
                    column.values = values;
                    gathered.push(format!("`{}`", column.name));
                    parts[main].table.columns.push(column);
                }
                None => parts[other].table.columns.push(column),
            }
        }
    }
    if !gathered.is_empty() {
        let list = gathered.join(", ");
        notes.push(format!("{list} come in messages of their own and were put to the nearest position in time."));
    }
}

/// The value nearest to each time, within `reach`.
fn nearest(time: &[f64], values: &[f64], at: &[f64], reach: f64) -> Vec<f64> {
    let value = |&t: &f64| {
        let after = time.partition_point(|k| *k < t);
        let near = [after.wrapping_sub(1), after].into_iter().filter_map(|i| Some((time.get(i)?, values.get(i)?)));
        let best = near.min_by(|a, b| (a.0 - t).abs().total_cmp(&(b.0 - t).abs()));
        best.filter(|(k, _)| (**k - t).abs() <= reach).map_or(f64::NAN, |(_, v)| *v)
    };
    at.iter().map(value).collect()
}

fn interpolate(time: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let known: Vec<(f64, f64)> =
        time.iter().copied().zip(values.iter().copied()).filter(|(t, v)| t.is_finite() && v.is_finite()).collect();
    let value = |&t: &f64| {
        let after = known.partition_point(|(k, _)| *k < t);
        let (Some(&(t1, v1)), Some(&(t0, v0))) = (known.get(after), known.get(after.wrapping_sub(1))) else {
            return known.get(after).filter(|(k, _)| *k == t).map_or(f64::NAN, |(_, v)| *v);
        };
        if t1 == t {
            v1
        } else if t1 - t0 > BRIDGE {
            f64::NAN
        } else {
            v0 + (v1 - v0) * ((t - t0) / (t1 - t0))
        }
    };
    at.iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_interpolated_inside_and_not_across_gaps() {
        let found = interpolate(&[0.0, 0.1, 1.0], &[0.0, 1.0, 2.0], &[-0.1, 0.0, 0.05, 0.1, 0.5, 1.0, 1.1]);
        assert_eq!(&found[1..4], [0.0, 0.5, 1.0]);
        assert_eq!(found[5], 2.0);
        assert!([0, 4, 6].iter().all(|&i: &usize| found[i].is_nan()), "{found:?}");
    }

    #[test]
    fn the_nearest_value_is_taken_within_reach() {
        let found = nearest(&[0.0, 1.0], &[5.0, 6.0], &[0.3, 0.7, 2.0], 0.4);
        assert_eq!(&found[..2], [5.0, 6.0]);
        assert!(found[2].is_nan());
    }
}
