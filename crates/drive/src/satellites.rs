//! Raw satellite ranges: what a receiver measured of each satellite, epoch by epoch.

use nalgebra::Vector3;

use crate::channel::OutOfOrder;

/// One satellite as a receiver saw it at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Satellite {
    /// Number of the satellite.
    pub prn: u32,
    /// Its place when the signal left it, in Earth-centred, Earth-fixed axes of the instant of reception, m.
    pub place: Vector3<f64>,
    /// Its velocity in the same axes, m/s; NaN where the receiver does not say.
    pub velocity: Vector3<f64>,
    /// Pseudorange: distance plus the receiver's clock offset, the satellite's own clock taken out, m.
    pub range: f64,
    /// Rate of the pseudorange, m/s; NaN where the receiver does not say.
    pub rate: f64,
}

/// Columns of the table of raw ranges after `t`, in the order of files.
pub const RAW_COLUMNS: [&str; 9] = ["prn", "sat_x", "sat_y", "sat_z", "sat_vx", "sat_vy", "sat_vz", "pr", "prr"];

impl Satellite {
    /// The cells of its row, in the order of [`RAW_COLUMNS`].
    pub fn cells(&self) -> [f64; 9] {
        let (p, v) = (&self.place, &self.velocity);
        [f64::from(self.prn), p.x, p.y, p.z, v.x, v.y, v.z, self.range, self.rate]
    }
    /// The satellite of a row of cells, in the order of [`RAW_COLUMNS`].
    pub fn of_cells(cells: &[f64; 9]) -> Self {
        let [prn, x, y, z, vx, vy, vz, range, rate] = *cells;
        Self { prn: prn as u32, place: Vector3::new(x, y, z), velocity: Vector3::new(vx, vy, vz), range, rate }
    }
}

/// Raw ranges on the drive's clock: at each instant the satellites then in view.
///
/// ```
/// use drivescope_drive::satellites::{RawGnss, Satellite};
/// let mut raw = RawGnss::default();
/// raw.push(0.5, &[Satellite { prn: 3, ..Satellite::default() }, Satellite { prn: 7, ..Satellite::default() }])?;
/// assert_eq!(raw.at(0).1[1].prn, 7);
/// # Ok::<(), drivescope_drive::channel::OutOfOrder>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawGnss {
    time: Vec<f64>,
    ends: Vec<usize>,
    satellites: Vec<Satellite>,
}

impl RawGnss {
    /// Append an instant with its satellites; one without any is none.
    ///
    /// # Errors
    /// [`OutOfOrder`] when `time` is not finite or not after the last one; nothing is changed.
    pub fn push(&mut self, time: f64, satellites: &[Satellite]) -> Result<(), OutOfOrder> {
        let previous = self.time.last().copied().unwrap_or(f64::NEG_INFINITY);
        if !(time > previous && time < f64::INFINITY) {
            return Err(OutOfOrder { time, previous });
        }
        if !satellites.is_empty() {
            self.time.push(time);
            self.satellites.extend_from_slice(satellites);
            self.ends.push(self.satellites.len());
        }
        Ok(())
    }
    /// Time and satellites at an index.
    ///
    /// # Panics
    /// When `index` is not below `len`.
    pub fn at(&self, index: usize) -> (f64, &[Satellite]) {
        let start = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        (self.time[index], &self.satellites[start..self.ends[index]])
    }
    /// Change every satellite of the instants from `from` until `to`, s.
    pub fn change(&mut self, from: f64, to: f64, mut change: impl FnMut(&mut Satellite)) {
        let begin = self.time.partition_point(|&t| t < from);
        let end = self.time.partition_point(|&t| t < to);
        let start = |index: usize| index.checked_sub(1).map_or(0, |before| self.ends[before]);
        let range = start(begin)..start(end).max(start(begin));
        self.satellites[range].iter_mut().for_each(&mut change);
    }
    /// The instants with their satellites, in time order.
    pub fn iter(&self) -> impl Iterator<Item = (f64, &[Satellite])> + '_ {
        (0..self.len()).map(|i| self.at(i))
    }
    /// The instants, s.
    pub fn time(&self) -> &[f64] {
        &self.time
    }
    /// Number of instants.
    pub fn len(&self) -> usize {
        self.time.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instant_has_its_own_satellites_and_time_runs_forward() {
        let of = |prns: &[u32]| prns.iter().map(|&prn| Satellite { prn, ..Satellite::default() }).collect::<Vec<_>>();
        let mut raw = RawGnss::default();
        raw.push(1.0, &of(&[1, 2])).unwrap();
        raw.push(2.0, &[]).unwrap();
        raw.push(3.0, &of(&[2, 5, 9])).unwrap();
        assert!(raw.push(3.0, &of(&[1])).is_err() && raw.push(f64::NAN, &of(&[1])).is_err());
        let seen: Vec<(f64, Vec<u32>)> = raw.iter().map(|(t, s)| (t, s.iter().map(|s| s.prn).collect())).collect();
        assert_eq!(seen, [(1.0, vec![1, 2]), (3.0, vec![2, 5, 9])]);
    }

    #[test]
    fn a_row_of_cells_is_read_back_as_it_was() {
        let cells = [7.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 9.0];
        assert_eq!(Satellite::of_cells(&cells).cells(), cells);
    }
}
