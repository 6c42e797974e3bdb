//! The fix of one instant: least squares over its ranges, and whether they agree with each other.
//!
//! Source: Yun & Yu 2007 (14), corrected; SPEC navigation 5.

use drivescope_drive::geodesy::LocalFrame;
use drivescope_drive::satellites::Satellite;
use nalgebra::{Matrix4, Vector3, Vector4};

use super::sight::{Geometry, Sight, row, usable_but};

/// Steps of Gauss and Newton before a fix is given up.
const MOST_STEPS: usize = 15;
/// Step that ends the search, m.
const SMALLEST_STEP: f64 = 1e-4;
/// Condition number of the rows beyond which there is no fix.
const WORST_CONDITION: f64 = 1e4;

/// The fix of one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// North, east, down of the frame's origin, m.
    pub place: Vector3<f64>,
    /// Offset of the receiver clock, m.
    pub clock_bias: f64,
    /// Velocity, north, east, down, m/s, and drift of the clock, m/s; `None` with fewer than four rates.
    pub velocity: Option<(Vector3<f64>, f64)>,
    /// Covariance of place and offset for ranges of 1 m sigma.
    pub cofactor: Matrix4<f64>,
    /// Sum of the squared residuals over the variance of a range: chi-square with `satellites - 4` degrees of freedom.
    pub residuals: f64,
    /// Satellites used.
    pub satellites: usize,
}

impl Snapshot {
    /// Dilution of the position.
    pub fn pdop(&self) -> f64 {
        (self.cofactor[(0, 0)] + self.cofactor[(1, 1)] + self.cofactor[(2, 2)]).sqrt()
    }
}

/// Place and clock that fit the ranges best; `start` is a place to search from, the centre of the Earth without one.
///
/// `left_out` has a bit for each index of a satellite that is not to be used. `None` with fewer than four satellites, with directions too dependent, or when the search does not settle.
pub fn snapshot(
    frame: &LocalFrame,
    satellites: &[Satellite],
    left_out: u64,
    start: Option<Vector3<f64>>,
    range_sigma: f64,
) -> Option<Snapshot> {
    let mut place = start.unwrap_or_else(|| frame.of_ecef(&Vector3::zeros()));
    let mut clock = 0.0;
    for _ in 0..MOST_STEPS {
        let (geometry, right, squares) = normal_equations(frame, satellites, left_out, &place, clock);
        let cofactor = geometry.cofactor(WORST_CONDITION)?;
        let step: Vector4<f64> = cofactor * right;
        place += step.xyz();
        clock += step.w;
        if step.norm() < SMALLEST_STEP {
            // What the last step explains is no residual.
            let residuals = (squares - right.dot(&step)) / (range_sigma * range_sigma);
            let velocity = velocity(frame, satellites, left_out, &place);
            return Some(Snapshot {
                place,
                clock_bias: clock,
                velocity,
                cofactor,
                residuals: residuals.max(0.0),
                satellites: geometry.satellites,
            });
        }
    }
    None
}

/// Normal matrix, right side and sum of squares of the ranges at a place.
fn normal_equations(
    frame: &LocalFrame,
    satellites: &[Satellite],
    left_out: u64,
    place: &Vector3<f64>,
    clock: f64,
) -> (Geometry, Vector4<f64>, f64) {
    let (mut geometry, mut right, mut squares) = (Geometry::default(), Vector4::zeros(), 0.0);
    for (_, satellite) in usable_but(satellites, left_out) {
        let sight = Sight::new(frame, place, satellite);
        let residual = satellite.range - sight.distance - clock;
        geometry.add(&sight.direction);
        right += row(&sight.direction) * residual;
        squares += residual * residual;
    }
    (geometry, right, squares)
}

/// Velocity and clock drift that fit the rates best.
fn velocity(
    frame: &LocalFrame,
    satellites: &[Satellite],
    left_out: u64,
    place: &Vector3<f64>,
) -> Option<(Vector3<f64>, f64)> {
    let (mut geometry, mut right) = (Geometry::default(), Vector4::zeros());
    for (_, satellite) in usable_but(satellites, left_out) {
        let sight = Sight::new(frame, place, satellite);
        let rate = satellite.rate - sight.distance_rate(&Vector3::zeros());
        if rate.is_finite() {
            geometry.add(&sight.direction);
            right += row(&sight.direction) * rate;
        }
    }
    let solution: Vector4<f64> = geometry.cofactor(WORST_CONDITION)? * right;
    Some((solution.xyz(), solution.w))
}
