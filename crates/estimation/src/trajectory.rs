//! A trajectory for the map: points of a window, thinned evenly in time, with position sigma and motion mode.

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_drive::geodesy::{Geodetic, LocalFrame};

/// One point of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Time, s.
    pub time: f64,
    /// North of the local origin, m.
    pub north: f64,
    /// East of the local origin, m.
    pub east: f64,
    /// Larger of the two horizontal 1-sigmas, m; NaN if unknown.
    pub sigma: f64,
    /// Motion mode; NaN if unknown.
    pub mode: f64,
}

fn thin(time: &[f64], window: (f64, f64), most: usize) -> impl Iterator<Item = usize> {
    let first = time.partition_point(|&t| t < window.0);
    let last = time.partition_point(|&t| t <= window.1);
    let stride = (last - first).div_ceil(most.max(1)).max(1);
    (first..last).step_by(stride)
}

/// The estimated path of a window: columns `north`, `east` and their sigmas, with the mode of another run at that time.
pub fn estimated_path(estimate: &Series, modes: Option<&Series>, window: (f64, f64), most: usize) -> Vec<PathPoint> {
    let (Some(north), Some(east)) = (estimate.column("north"), estimate.column("east")) else { return Vec::new() };
    let sigma = |i: usize| match (estimate.column("north_sigma"), estimate.column("east_sigma")) {
        (Some(n), Some(e)) => n[i].max(e[i]),
        _ => f64::NAN,
    };
    let mode = |t: f64| modes.map_or(f64::NAN, |m| held(m, "mode", t));
    thin(estimate.time(), window, most)
        .map(|i| {
            let time = estimate.time()[i];
            PathPoint { time, north: north[i], east: east[i], sigma: sigma(i), mode: mode(time) }
        })
        .filter(|p| p.north.is_finite() && p.east.is_finite())
        .collect()
}

/// The true path of a window, in the drive's local frame.
pub fn true_path(drive: &Drive, window: (f64, f64), most: usize) -> Vec<PathPoint> {
    let truth = &drive.truth;
    let frame = drive.origin().map(LocalFrame::new);
    let place = |i: usize| match (frame, truth.column("lat"), truth.column("lon"), truth.column("alt")) {
        (Some(frame), Some(lat), Some(lon), Some(alt)) => {
            let ned = frame.to_ned(Geodetic { lat: lat[i], lon: lon[i], alt: alt[i] });
            Some((ned.x, ned.y))
        }
        _ => Some((truth.column("n")?[i], truth.column("e")?[i])),
    };
    points(truth.time(), window, most, place, |i| truth.column("mode").map_or(f64::NAN, |m| m[i]))
}

/// The satellite fixes of a window, in the drive's local frame; their sigma as the receiver states it.
pub fn fixes(drive: &Drive, window: (f64, f64), most: usize) -> Vec<PathPoint> {
    let frame = drive.origin().map(LocalFrame::new);
    let gnss = &drive.gnss;
    let place = |i: usize| {
        let fix = gnss.at(i).1;
        if !fix.is_usable() {
            return None;
        }
        match frame {
            Some(frame) if fix.lat.is_finite() => {
                let alt = if fix.alt.is_finite() { fix.alt } else { frame.origin.alt };
                let ned = frame.to_ned(Geodetic { lat: fix.lat, lon: fix.lon, alt });
                Some((ned.x, ned.y))
            }
            _ => Some((fix.north, fix.east)),
        }
    };
    points(gnss.time(), window, most, place, |_| f64::NAN)
}

fn points(
    time: &[f64],
    window: (f64, f64),
    most: usize,
    place: impl Fn(usize) -> Option<(f64, f64)>,
    mode: impl Fn(usize) -> f64,
) -> Vec<PathPoint> {
    thin(time, window, most)
        .filter_map(|i| {
            let (north, east) = place(i)?;
            let point = PathPoint { time: time[i], north, east, sigma: f64::NAN, mode: mode(i) };
            (north.is_finite() && east.is_finite()).then_some(point)
        })
        .collect()
}

/// The last value of a column at or before a time; NaN if there is none.
pub fn held(series: &Series, column: &str, time: f64) -> f64 {
    let after = series.time().partition_point(|&t| t <= time);
    match (after.checked_sub(1), series.column(column)) {
        (Some(row), Some(values)) => values[row],
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::signals::Gnss;

    #[test]
    fn fixes_lie_where_the_receiver_said_and_refused_ones_are_left_out() {
        let mut drive = Drive::default();
        let origin = Geodetic { lat: 0.6, lon: 2.0, alt: 10.0 };
        let frame = LocalFrame::new(origin);
        for k in 0..10 {
            let place = frame.to_geodetic(&nalgebra::Vector3::new(f64::from(k), 2.0 * f64::from(k), 0.0));
            let valid = if k == 4 { 0.0 } else { 1.0 };
            let fix = Gnss { lat: place.lat, lon: place.lon, alt: place.alt, valid, ..Gnss::default() };
            drive.gnss.push(f64::from(k), fix).unwrap();
        }
        let path = fixes(&drive, (0.0, 9.0), 100);
        assert_eq!(path.len(), 9);
        assert!((path[8].north - 9.0).abs() < 1e-6 && (path[8].east - 18.0).abs() < 1e-6);
        assert_eq!(fixes(&drive, (2.0, 9.0), 4).len(), 3, "every second of eight, less the refused one");
    }

    #[test]
    fn a_mode_is_held_until_the_next_one() {
        let mut s = Series::new(&[drivescope_drive::channel::Column::new("mode", "1", "Mode.")]);
        s.push(1.0, &[0.0]).unwrap();
        s.push(2.0, &[2.0]).unwrap();
        assert!(held(&s, "mode", 0.5).is_nan());
        assert_eq!((held(&s, "mode", 1.9), held(&s, "mode", 2.0)), (0.0, 2.0));
    }
}
