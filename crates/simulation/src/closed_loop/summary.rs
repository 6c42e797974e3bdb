//! A closed loop in a few numbers: those of SPEC navigation 10.

use drivescope_control::yaw_moment::GRAVITY;
use drivescope_drive::channel::Channel;

use super::rows::{GuidanceRow, LoopRow};

/// A car beyond this far north of the obstacle may have returned to its line, m; and how long it must stay there, m.
const AFTER_OBSTACLE: f64 = 1.0;
const STAYS: f64 = 2.0;
/// What counts as on the line, m.
const ON_LINE: f64 = 0.2;
/// Late part of the line: what lies more than this far north, m.
const LATE: f64 = 38.0;

/// Results of a closed loop; NaN where a number has no meaning there.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Largest offset from the path, m.
    pub max_cross_track: f64,
    /// Root mean square offset from the path, m.
    pub rms_cross_track: f64,
    /// The same beyond 38 m along the line, m.
    pub late_cross_track: f64,
    /// Largest offset beyond 38 m along the line, m.
    pub late_max_cross_track: f64,
    /// Least distance from the car's place to an obstacle's edge, m.
    pub clearance: f64,
    /// Distance along the line at which the car is back on it for 2 m, m.
    pub return_distance: f64,
    /// Distance of the car's last place from the goal, m.
    pub miss: f64,
    /// Root mean square error of the place that the controllers know, m.
    pub position_rms: f64,
    /// Largest lateral acceleration, in g.
    pub peak_lateral_g: f64,
    /// Lateral acceleration at the end, in g.
    pub end_lateral_g: f64,
    /// Largest yaw moment, N m.
    pub peak_moment: f64,
    /// Largest sideslip, deg.
    pub peak_sideslip_deg: f64,
    /// Speed at the end, m/s.
    pub end_speed: f64,
    /// Chattering: how much the yaw moment asked for goes up and down in a second, N m/s.
    pub moment_variation: f64,
}

/// Largest size; NaN of nothing.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(f64::NAN, f64::max)
}

/// Root mean square; NaN of nothing.
fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / count).sqrt()
}

/// Sum up what was written down; `goal` and `obstacle` (north, m) where there are any.
pub(super) fn summary(
    rows: &Channel<LoopRow>,
    guidance: &Channel<GuidanceRow>,
    goal: Option<(f64, f64)>,
    obstacle: Option<f64>,
) -> Summary {
    let column = |name: &str| rows.column(name).unwrap_or_default();
    let (north, east, time) = (column("north"), column("east"), rows.time());
    let cross_track = guidance.column("cross_track").unwrap_or_default();
    // The place at each decision: decisions are taken at samples.
    let at: Vec<usize> = guidance.time().iter().map(|t| time.partition_point(|x| x < t)).collect();
    let along: Vec<f64> = at.iter().map(|&i| north.get(i).copied().unwrap_or(f64::NAN)).collect();
    let late = || along.iter().zip(cross_track).filter(|(n, _)| **n > LATE).map(|(_, c)| *c);
    let lateral = column("lateral_acceleration");
    let command = column("moment_command");
    let end = |values: &[f64]| values.last().copied().unwrap_or(f64::NAN);
    let error = |i: usize| {
        let (dn, de) = (column("known_north")[i] - north[i], column("known_east")[i] - east[i]);
        (dn * dn + de * de).sqrt()
    };
    let span = time.last().copied().unwrap_or(0.0) - time.first().copied().unwrap_or(0.0);
    Summary {
        max_cross_track: largest(cross_track.iter().copied()),
        rms_cross_track: rms(cross_track.iter().copied()),
        late_cross_track: rms(late()),
        late_max_cross_track: largest(late()),
        clearance: guidance.column("clearance").unwrap_or_default().iter().copied().fold(f64::NAN, f64::min),
        return_distance: obstacle.map_or(f64::NAN, |o| returned(&along, cross_track, o + AFTER_OBSTACLE)),
        miss: goal.map_or(f64::NAN, |(n, e)| {
            let (dn, de) = (end(north) - n, end(east) - e);
            (dn * dn + de * de).sqrt()
        }),
        position_rms: rms((0..rows.len()).map(error)),
        peak_lateral_g: largest(lateral.iter().copied()) / GRAVITY,
        end_lateral_g: end(lateral) / GRAVITY,
        peak_moment: largest(column("moment").iter().copied()),
        peak_sideslip_deg: largest(column("sideslip").iter().copied()).to_degrees(),
        end_speed: end(column("speed")),
        moment_variation: command.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>() / span,
    }
}

/// First distance beyond `from` from which the offset stays small for the next metres.
fn returned(along: &[f64], cross_track: &[f64], from: f64) -> f64 {
    (0..along.len())
        .filter(|&i| along[i] > from)
        .find(|&i| {
            (i..along.len()).take_while(|&j| along[j] <= along[i] + STAYS).all(|j| cross_track[j].abs() < ON_LINE)
        })
        .map_or(f64::NAN, |i| along[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_return_is_where_the_car_stays_on_its_line() {
        let along: Vec<f64> = (0..40).map(f64::from).collect();
        let mut offset = vec![0.0; 40];
        (5..15).for_each(|i| offset[i] = 1.0);
        offset[18] = 0.3;
        assert_eq!(returned(&along, &offset, 11.0), 15.0, "18 m is more than 2 m on");
        offset[17] = 0.3;
        assert_eq!(returned(&along, &offset, 11.0), 19.0);
        offset[17] = 0.0;
        offset[18] = 0.0;
        assert_eq!(returned(&along, &offset, 11.0), 15.0);
        assert!(returned(&along, &vec![1.0; 40], 11.0).is_nan());
    }
}
