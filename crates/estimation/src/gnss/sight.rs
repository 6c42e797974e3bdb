//! Lines of sight to satellites and what their directions are worth.

use drivescope_drive::geodesy::LocalFrame;
use drivescope_drive::satellites::Satellite;
use drivescope_drive::select::midpoint;
use nalgebra::{Matrix4, Vector3, Vector4};

/// Most satellites of one instant that are used.
pub const MOST_SATELLITES: usize = 64;

/// A satellite seen from a point of a local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Unit vector from the point to the satellite, north, east, down.
    pub direction: Vector3<f64>,
    /// Distance, m.
    pub distance: f64,
    /// Velocity of the satellite over the rotating Earth, north, east, down, m/s.
    pub velocity: Vector3<f64>,
}

impl Sight {
    /// From a point `at` (north, east, down, m) of `frame` to a satellite.
    pub fn new(frame: &LocalFrame, at: &Vector3<f64>, satellite: &Satellite) -> Self {
        let line = frame.of_ecef(&satellite.place) - at;
        let distance = line.norm();
        Self { direction: line / distance, distance, velocity: frame.turn(&satellite.velocity) }
    }

    /// Rate of the distance for a receiver that moves with `velocity`, m/s.
    pub fn distance_rate(&self, velocity: &Vector3<f64>) -> f64 {
        self.direction.dot(&(self.velocity - velocity))
    }
}

/// Whether place and pseudorange can be those of a satellite.
pub fn is_usable(satellite: &Satellite) -> bool {
    let radius = satellite.place.norm();
    // Between the lowest orbit and well beyond the geostationary one; a pseudorange may hold any clock.
    radius > 6.4e6 && radius < 1e9 && satellite.range.abs() < 1e12
}

/// The satellites of an instant that can be used, each number once.
pub fn usable(satellites: &[Satellite]) -> impl Iterator<Item = &Satellite> {
    usable_but(satellites, 0).map(|(_, s)| s)
}

/// The same without those left out: a bit for each index.
pub fn usable_but(satellites: &[Satellite], left_out: u64) -> impl Iterator<Item = (usize, &Satellite)> {
    (satellites.iter().enumerate().take(MOST_SATELLITES))
        .filter(|(k, s)| is_usable(s) && !satellites[..*k].iter().any(|earlier| earlier.prn == s.prn))
        .filter(move |(k, _)| left_out & (1 << k) == 0)
}

/// The normal matrix of ranges: rows `[-e, 1]` of position and clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    normal: Matrix4<f64>,
    /// Satellites counted.
    pub satellites: usize,
}

impl Default for Geometry {
    fn default() -> Self {
        Self { normal: Matrix4::zeros(), satellites: 0 }
    }
}

/// The row of a satellite in a direction.
pub fn row(direction: &Vector3<f64>) -> Vector4<f64> {
    Vector4::new(-direction.x, -direction.y, -direction.z, 1.0)
}

impl Geometry {
    /// Count a satellite in a direction.
    pub fn add(&mut self, direction: &Vector3<f64>) {
        let row = row(direction);
        self.normal += row * row.transpose();
        self.satellites += 1;
    }

    /// Covariance of position (m^2) and clock for ranges of unit noise; `None` below four satellites or where the rows are so
    /// dependent that their condition number exceeds `worst`.
    pub fn cofactor(&self, worst: f64) -> Option<Matrix4<f64>> {
        let inverse = self.normal.try_inverse().filter(|_| self.satellites >= 4)?;
        let condition = (largest_eigenvalue(&self.normal) * largest_eigenvalue(&inverse)).sqrt();
        // What is not a number is refused too.
        (condition < worst).then_some(inverse)
    }

    /// Dilution of the position; infinite where none can be computed.
    pub fn pdop(&self) -> f64 {
        self.cofactor(1e4).map_or(f64::INFINITY, |g| (g[(0, 0)] + g[(1, 1)] + g[(2, 2)]).sqrt())
    }
}

/// Largest eigenvalue of a positive definite matrix, by iteration, to a few per cent.
fn largest_eigenvalue(m: &Matrix4<f64>) -> f64 {
    let mut vector = Vector4::new(0.5, -0.4, 0.3, 0.7);
    let mut value = 0.0;
    for _ in 0..20 {
        let next = m * vector;
        value = next.norm();
        if !(value > 0.0 && value < f64::INFINITY) {
            return f64::INFINITY;
        }
        vector = next / value;
    }
    value
}

/// The median of at most [`MOST_SATELLITES`] values; `None` of none.
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut some = [0.0; MOST_SATELLITES];
    let mut count = 0;
    for value in values.take(MOST_SATELLITES) {
        some[count] = value;
        count += 1;
    }
    (count > 0).then(|| midpoint(&mut some[..count]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_that_of_the_sorted_values() {
        assert_eq!(median([3.0, -1.0, 7.0].into_iter()), Some(3.0));
        assert_eq!(median([3.0, -1.0, 7.0, 5.0].into_iter()), Some(4.0));
        assert_eq!(median([f64::NAN; 0].into_iter()), None);
    }

    /// Four satellites, one overhead and three at the horizon 120 deg apart: position cofactors in closed form.
    #[test]
    fn dilution_is_that_of_the_textbook_tetrahedron() {
        let mut geometry = Geometry::default();
        geometry.add(&Vector3::new(0.0, 0.0, -1.0));
        for k in 0..3 {
            let azimuth = f64::from(k) * std::f64::consts::TAU / 3.0;
            geometry.add(&Vector3::new(azimuth.cos(), azimuth.sin(), 0.0));
        }
        // Horizontal 2/3 each, vertical 1 + 1/3 (the clock is the mean of three ranges).
        assert!((geometry.pdop() - (2.0f64 / 3.0 * 2.0 + 4.0 / 3.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn satellites_in_one_plane_have_no_dilution() {
        let mut geometry = Geometry::default();
        for k in 0..6 {
            let elevation = 0.3 + 0.2 * f64::from(k);
            geometry.add(&Vector3::new(elevation.cos(), 0.0, -elevation.sin()));
        }
        assert_eq!(geometry.pdop(), f64::INFINITY);
    }

    #[test]
    fn a_number_that_comes_twice_counts_once_and_nonsense_not_at_all() {
        let good = Satellite { prn: 3, place: Vector3::new(2e7, 0.0, 0.0), range: 2e7, ..Satellite::default() };
        let twice = Satellite { range: 2.1e7, ..good };
        let lost = Satellite { prn: 4, range: f64::NAN, ..good };
        let centre = Satellite { prn: 5, place: Vector3::zeros(), ..good };
        let list = [good, twice, lost, centre];
        assert_eq!(usable(&list).collect::<Vec<_>>(), [&good]);
    }
}
