//! Truth at the times of an estimate.
//!
//! Equal times are exact. Between two samples of truth: linear, the short way round for angles, nearest for the motion
//! mode. Never outside truth's span and never across a hole wider than [`MAX_GAP`].

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::{Geodetic, LocalFrame};

/// The widest hole in truth that is bridged, s.
pub const MAX_GAP: f64 = 0.5;

/// Truth signals at given times, looked up once each.
///
/// `n`, `e`, `d` are computed from truth's latitude, longitude and height in the frame at `drive.start().origin`, which is
/// where estimates count from. Truth's own `n`, `e`, `d` are used where it has no latitude, or where the receiver's
/// positions are local too.
pub struct TruthTable<'a> {
    drive: &'a Drive,
    times: &'a [f64],
    local: Option<[Vec<f64>; 3]>,
    found: Vec<(&'static str, Option<Vec<f64>>)>,
}

impl<'a> TruthTable<'a> {
    /// The truth of `drive` at `times` (s, increasing).
    pub fn new(drive: &'a Drive, times: &'a [f64]) -> Self {
        Self { drive, times, local: None, found: Vec::new() }
    }

    /// The truth signal `name` at each time, NaN where it has no value; `None` where the drive does not have it.
    pub fn get(&mut self, name: &str) -> Option<&[f64]> {
        let known = drivescope_drive::truth::truth_column(name)?;
        let place = self.found.iter().position(|(name, _)| *name == known.name).unwrap_or_else(|| {
            let values = self.look_up(known.name);
            self.found.push((known.name, values));
            self.found.len() - 1
        });
        self.found[place].1.as_deref()
    }

    fn look_up(&mut self, name: &str) -> Option<Vec<f64>> {
        let truth = &self.drive.truth;
        if let Some(axis) = ["n", "e", "d"].iter().position(|n| *n == name)
            && is_geodetic(self.drive)
        {
            let local = self.local.get_or_insert_with(|| local_truth(self.drive).unwrap_or_default());
            if !local[axis].is_empty() {
                return at_times(truth.time(), &local[axis], self.times, |a, b, s| a + (b - a) * s);
            }
        }
        let index = truth.index_of(name)?;
        let column = truth.column_at(index);
        if name == "mode" {
            at_times(truth.time(), column, self.times, |a, b, s| if s <= 0.5 { a } else { b })
        } else if truth.schema()[index].is_circular() {
            at_times(truth.time(), column, self.times, |a, b, s| wrap_angle(a + wrap_angle(b - a) * s))
        } else {
            at_times(truth.time(), column, self.times, |a, b, s| a + (b - a) * s)
        }
    }
}

/// Whether positions are compared through latitude and longitude.
fn is_geodetic(drive: &Drive) -> bool {
    let has_place = |s: &Series, lat: &str, lon: &str| s.has(lat) && s.has(lon);
    let gnss = drive.gnss.series();
    let is_local = has_place(gnss, "gnss_n", "gnss_e") && !has_place(gnss, "gnss_lat", "gnss_lon");
    has_place(&drive.truth, "lat", "lon") && !(is_local && has_place(&drive.truth, "n", "e"))
}

/// North, east, down of truth's places in the frame at the drive's origin, row by row.
fn local_truth(drive: &Drive) -> Option<[Vec<f64>; 3]> {
    let frame = LocalFrame::new(drive.start().origin?);
    let (lat, lon, alt) = (drive.truth.column("lat")?, drive.truth.column("lon")?, drive.truth.column("alt"));
    let mut out = [const { Vec::new() }; 3];
    for row in 0..lat.len() {
        let height = alt.map_or(f64::NAN, |a| a[row]);
        let place =
            Geodetic { lat: lat[row], lon: lon[row], alt: if height.is_finite() { height } else { frame.origin.alt } };
        let ned = frame.to_ned(place);
        out[0].push(ned.x);
        out[1].push(ned.y);
        out[2].push(if height.is_finite() { ned.z } else { f64::NAN });
    }
    Some(out)
}

/// The finite values of a column at `times`; `None` if it has no finite value. `between(a, b, share)` interpolates.
fn at_times(time: &[f64], column: &[f64], times: &[f64], between: impl Fn(f64, f64, f64) -> f64) -> Option<Vec<f64>> {
    let (mut kept_time, mut kept) = (Vec::with_capacity(time.len()), Vec::with_capacity(time.len()));
    for (&t, &v) in time.iter().zip(column) {
        if v.is_finite() {
            kept_time.push(t);
            kept.push(v);
        }
    }
    if kept.is_empty() {
        return None;
    }
    let mut next = 0;
    let values = times.iter().map(|&t| {
        while next < kept.len() && kept_time[next] < t {
            next += 1;
        }
        if next == kept.len() {
            return f64::NAN;
        }
        let after = kept_time[next];
        if after == t {
            return kept[next];
        }
        if next == 0 || after - kept_time[next - 1] > MAX_GAP {
            return f64::NAN;
        }
        let before = kept_time[next - 1];
        between(kept[next - 1], kept[next], (t - before) / (after - before))
    });
    Some(values.collect())
}
