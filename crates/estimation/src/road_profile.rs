//! Grade and altitude of a road against distance: from one pass over it, or from several merged.
//!
//! A pass is what an estimator put out (columns `speed`, `grade`, `grade_sigma`, `altitude`, `altitude_sigma`) on a drive;
//! distance is the integral of the speed, and where the drive has satellite positions the profile has places.
//! Passes are merged over the first one's distance: each place of another pass is put where the first pass's path is
//! nearest, so that neither a scale error of the wheels nor another start matters. Without places the distances themselves
//! count. Grades are weighted by their variances; where passes differ by more than they state, the sigma grows to what
//! they differ by. Barometers have a datum of their own each day: altitudes are first brought to the first pass's mean.

use drivescope_drive::channel::{Channel, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::record;

mod laps;
mod path;
mod write;

pub use write::{write_csv, write_geojson};

use path::Path;

record! {
    /// One place of a road.
    pub struct RoadPoint {
        /// Grade, uphill in the direction of travel positive.
        grade: "rad";
        /// 1-sigma of the grade.
        grade_sigma: "rad", sigma_of "grade";
        /// Altitude in the datum of the first pass.
        altitude: "m";
        /// 1-sigma of the altitude against the other places of the road.
        altitude_sigma: "m", sigma_of "altitude";
        /// Passes that were there.
        passes: "1";
        /// Latitude.
        lat: "rad", name "gnss_lat";
        /// Longitude.
        lon: "rad", name "gnss_lon";
    }
}

/// Distance between points unless said otherwise, m.
pub const SPACING: f64 = 5.0;
/// The most points that a profile may have.
const MOST_POINTS: usize = 1_000_000;
/// Slower than this nothing is learned of the next metre, m/s.
const SLOWEST: f64 = 0.3;

/// Why there is no profile.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum ProfileError {
    /// The estimate lacks a column.
    #[error("a road profile needs the column `{0}`, which this estimate does not have")]
    NoColumn(&'static str),
    /// The car did not move.
    #[error("pass {pass} is {length:.0} m long; a road profile needs more than {spacing} m")]
    TooShort {
        /// Which pass, from 1.
        pass: usize,
        /// Its length, m.
        length: f64,
        /// Distance between points, m.
        spacing: f64,
    },
    /// Two passes have no place in common.
    #[error("pass {0} has no stretch in common with pass 1, driven in the same direction")]
    Apart(usize),
    /// There is nothing to merge.
    #[error("there is no pass")]
    Empty,
    /// The profile has no places.
    #[error("GeoJSON needs places, and the drive has no GNSS position")]
    NoPlaces,
}

/// Grade and altitude of a road at equal distances.
#[derive(Clone, Debug)]
pub struct RoadProfile {
    /// The points over their distance from the start, m, in place of time.
    pub points: Channel<RoadPoint>,
    /// Number of passes merged.
    pub passes: usize,
    path: Path,
}

/// Sums that make one point.
#[derive(Clone, Copy, Default)]
struct Cell {
    length: f64,
    grade: f64,
    grade_sigma: f64,
    altitude: f64,
    altitude_sigma: f64,
}

impl RoadProfile {
    /// The profile of one pass, a point every `spacing` m.
    ///
    /// # Errors
    /// A column that is missing, or a car that hardly moved.
    pub fn of_pass(estimate: &Series, drive: &Drive, spacing: f64) -> Result<Self, ProfileError> {
        const NAMES: [&str; 5] = ["speed", "grade", "grade_sigma", "altitude", "altitude_sigma"];
        let mut columns = [&[] as &[f64]; 5];
        for (column, name) in columns.iter_mut().zip(NAMES) {
            *column = estimate.column(name).ok_or(ProfileError::NoColumn(name))?;
        }
        let [speed, grade, grade_sigma, altitude, altitude_sigma] = columns;
        let time = estimate.time();
        let spacing = if spacing > 0.0 { spacing } else { SPACING };
        let mut cells: Vec<Cell> = Vec::new();
        let mut distance = vec![0.0; time.len()];
        for row in 1..time.len() {
            let mean = 0.5 * (speed[row - 1] + speed[row]);
            let step = if mean.abs() >= SLOWEST { mean * (time[row] - time[row - 1]) } else { 0.0 };
            distance[row] = distance[row - 1] + if step.is_finite() { step } else { 0.0 };
            let index = (distance[row] / spacing).max(0.0) as usize;
            let values = [grade[row], grade_sigma[row], altitude[row], altitude_sigma[row]];
            if !(step > 0.0 && values.iter().all(|v| v.is_finite()) && index < MOST_POINTS) {
                continue;
            }
            if cells.len() <= index {
                cells.resize(index + 1, Cell::default());
            }
            let cell = &mut cells[index];
            cell.length += step;
            cell.grade += values[0] * step;
            cell.grade_sigma += values[1] * step;
            cell.altitude += values[2] * step;
            cell.altitude_sigma += values[3] * step;
        }
        if cells.len() < 2 {
            let length = distance.last().copied().unwrap_or(0.0);
            return Err(ProfileError::TooShort { pass: 1, length, spacing });
        }
        let path = Path::new(drive, time, &distance, cells.len(), spacing);
        Ok(Self::from_cells(&cells, path, spacing))
    }

    fn from_cells(cells: &[Cell], path: Path, spacing: f64) -> Self {
        let mut points = Channel::default();
        for (index, cell) in cells.iter().enumerate() {
            let (lat, lon) = path.place(index);
            let point = RoadPoint {
                grade: cell.grade / cell.length,
                grade_sigma: cell.grade_sigma / cell.length,
                altitude: cell.altitude / cell.length,
                altitude_sigma: cell.altitude_sigma / cell.length,
                passes: if cell.length > 0.0 { 1.0 } else { 0.0 },
                lat,
                lon,
            };
            // Distances rise by construction.
            let _ = points.push((index as f64 + 0.5) * spacing, point);
        }
        Self { points, passes: 1, path }
    }

    /// The passes merged over the distance of the first one.
    ///
    /// # Errors
    /// No pass, or one that shares no stretch with the first.
    pub fn merged(passes: &[Self]) -> Result<Self, ProfileError> {
        let first = passes.first().ok_or(ProfileError::Empty)?;
        let mut columns: Vec<Vec<RoadPoint>> = vec![first.points.iter().map(|p| p.1).collect()];
        for (index, pass) in passes.iter().enumerate().skip(1) {
            columns.push(pass.along(first).ok_or(ProfileError::Apart(index + 1))?);
        }
        Ok(Self { points: first.joined(columns), passes: passes.len(), path: first.path.clone() })
    }

    /// A drive's profile over its whole distance: each of its `laps` (see [`RoadProfile::laps`]) merged with the other ones
    /// and with `others`, passes of other drives. Also which of `others` have a stretch in common with it.
    ///
    /// # Errors
    /// No lap.
    pub fn of_laps(laps: &[Self], others: &[Self]) -> Result<(Self, Vec<bool>), ProfileError> {
        let frame = laps.first().ok_or(ProfileError::Empty)?.path.frame;
        let mut is_common = vec![false; others.len()];
        let mut whole = Self { points: Channel::default(), passes: 1, path: Path { frame, places: Vec::new() } };
        for (own, lap) in laps.iter().enumerate() {
            let mut columns: Vec<Vec<RoadPoint>> = vec![lap.points.iter().map(|p| p.1).collect()];
            columns.extend(laps.iter().enumerate().filter(|(k, _)| *k != own).filter_map(|(_, l)| l.along(lap)));
            for (other, is_common) in others.iter().zip(&mut is_common) {
                let along = other.along(lap);
                *is_common |= along.is_some();
                columns.extend(along);
            }
            for (distance, point) in lap.joined(columns).iter() {
                whole.passes = whole.passes.max(point.passes as usize);
                // The distances of the laps follow one another.
                let _ = whole.points.push(distance, point);
            }
            whole.path.places.extend_from_slice(&lap.path.places);
        }
        Ok((whole, is_common))
    }

    /// The length of the profile, m.
    pub fn length(&self) -> f64 {
        let distance = self.points.time();
        distance.last().zip(distance.first()).map_or(0.0, |(last, first)| last - first)
    }

    /// The points of several passes at this one's places, this one's first, as one.
    fn joined(&self, mut columns: Vec<Vec<RoadPoint>>) -> Channel<RoadPoint> {
        level_altitudes(&mut columns);
        let mut points = Channel::default();
        for (row, (distance, point)) in self.points.iter().enumerate() {
            let at = columns.iter().map(|c| c[row]);
            let (grade, grade_sigma) = join(at.clone().map(|p| (p.grade, p.grade_sigma)));
            let (altitude, altitude_sigma) = join(at.clone().map(|p| (p.altitude, p.altitude_sigma)));
            let passes = at.filter(|p| p.grade.is_finite()).count() as f64;
            let _ = points.push(distance, RoadPoint { grade, grade_sigma, altitude, altitude_sigma, passes, ..point });
        }
        points
    }

    /// This pass's values at the places of `first`; NaN where it was not there. `None` if it was nowhere there.
    fn along(&self, first: &Self) -> Option<Vec<RoadPoint>> {
        let distance = self.points.time();
        let own = self.path.distances_along(&first.path, first.points.time(), distance);
        let value = |column: &str, at: f64| {
            let index = self.points.series().index_of(column);
            index.map_or(f64::NAN, |index| self.points.series().interpolate(index, at, f64::INFINITY))
        };
        let points: Vec<RoadPoint> = own
            .into_iter()
            .map(|at| RoadPoint {
                grade: value("grade", at),
                grade_sigma: value("grade_sigma", at),
                altitude: value("altitude", at),
                altitude_sigma: value("altitude_sigma", at),
                ..RoadPoint::default()
            })
            .collect();
        points.iter().any(|p| p.grade.is_finite()).then_some(points)
    }
}

/// Shift each pass's altitudes by its mean difference from the first one.
fn level_altitudes(columns: &mut [Vec<RoadPoint>]) {
    let Some((first, others)) = columns.split_first_mut() else { return };
    for other in others {
        let pairs = first.iter().zip(other.iter()).map(|(a, b)| b.altitude - a.altitude).filter(|d| d.is_finite());
        let (sum, count) = pairs.fold((0.0, 0.0), |(s, n), d| (s + d, n + 1.0));
        if count > 0.0 {
            other.iter_mut().for_each(|p| p.altitude -= sum / count);
        }
    }
}

/// Mean weighted by variances and its sigma: what is stated, or what the values differ by if that is more.
fn join(values: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
    let good = values.filter(|(v, s)| v.is_finite() && *s > 0.0);
    let weight = |sigma: f64| 1.0 / (sigma * sigma);
    let (total, sum, count) =
        good.clone().fold((0.0, 0.0, 0.0), |(w, s, n), (v, sigma)| (w + weight(sigma), s + weight(sigma) * v, n + 1.0));
    if total == 0.0 {
        return (f64::NAN, f64::NAN);
    }
    let mean = sum / total;
    let misfit: f64 = good.map(|(v, sigma)| weight(sigma) * (v - mean).powi(2)).sum();
    let scale = if count > 1.0 { (misfit / (count - 1.0)).max(1.0) } else { 1.0 };
    (mean, (scale / total).sqrt())
}

#[cfg(test)]
mod tests;
