//! Ring of twelve ultrasonic sensors over the front axle (navigation specification, section 8).

use drivescope_drive::channel::Record;
use drivescope_drive::signals::Range;
use nalgebra::Vector3;

use crate::math::{sin_cos, wrap_angle};
use crate::plant::Plant;
use crate::rng::Rng;
use crate::road::Road;
use crate::spec::Obstacle;

const AXES: usize = 12;
/// First axis, and the angle from axis to axis, deg.
const FIRST: f64 = -82.5;
const BETWEEN: f64 = 15.0;
/// Half the opening of a cone, deg.
const HALF_CONE: f64 = 7.5;
/// Furthest echo, m: this is read when there is none nearer.
pub const FURTHEST: f64 = 4.0;
const NOISE: f64 = 0.01;

/// State of the ring.
#[derive(Clone, Debug)]
pub struct Ring {
    /// Centres in level coordinates and radii, m.
    posts: Vec<(Vector3<f64>, f64)>,
    rng: Rng,
}

/// Distance to a post of a radius at a distance (m) and a bearing from the axis (rad) inside the cone; `None` outside.
fn echo(distance: f64, bearing: f64, radius: f64) -> Option<f64> {
    if distance <= radius {
        return Some(0.0);
    }
    let beside = (bearing.abs() - HALF_CONE.to_radians()).max(0.0);
    let (sin, cos) = sin_cos(beside);
    let chord = radius * radius - distance * distance * sin * sin;
    (chord >= 0.0 && cos > 0.0).then(|| distance * cos - chord.sqrt())
}

impl Ring {
    /// A ring on a road with these posts.
    pub fn new(road: &Road, obstacles: &[Obstacle], seed: u64) -> Self {
        let place = |o: &Obstacle| {
            let patch = road.patch(o.at);
            (patch.centre + patch.axes.column(1) * o.right, o.radius)
        };
        Self { posts: obstacles.iter().map(place).collect(), rng: Rng::new(seed, "ring") }
    }

    /// A ring among posts: north and east of the local origin, and radius, m.
    pub fn among(posts: &[[f64; 3]], seed: u64) -> Self {
        let place = |p: &[f64; 3]| (Vector3::new(p[0], p[1], 0.0), p[2]);
        Self { posts: posts.iter().map(place).collect(), rng: Rng::new(seed, "ring") }
    }

    /// The next sample, axes from left to right.
    pub fn next(&mut self, plant: &Plant) -> Range {
        let attitude = plant.attitude();
        let here = plant.place() + attitude.column(0) * plant.car.params.cg_to_front;
        self.read(here.x, here.y, libm::atan2(attitude[(1, 0)], attitude[(0, 0)]))
    }

    /// A sample from a place (north and east, m) at a heading (rad), axes from left to right.
    pub fn read(&mut self, north: f64, east: f64, heading: f64) -> Range {
        let readings: [f64; AXES] = std::array::from_fn(|axis| {
            let direction = heading + (FIRST + BETWEEN * axis as f64).to_radians();
            let nearest = self.posts.iter().filter_map(|(post, radius)| {
                let (north, east) = (post.x - north, post.y - east);
                let bearing = wrap_angle(libm::atan2(east, north) - direction);
                echo((north * north + east * east).sqrt(), bearing, *radius)
            });
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            let noise = NOISE * self.rng.normal();
            if nearest < FURTHEST { (nearest + noise).clamp(0.0, FURTHEST) } else { FURTHEST }
        });
        Range::read(|axis| readings[axis])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_post_is_as_far_as_its_nearest_point_inside_the_cone() {
        assert_eq!(echo(3.0, 0.1, 0.2), Some(2.8), "the axis of the post lies in the cone");
        // 10 deg off the axis: seen along the cone's edge, 2.5 deg beside the post's centre.
        let sin = 2.5_f64.to_radians().sin();
        let expected = 3.0 * 2.5_f64.to_radians().cos() - (0.04 - 9.0 * sin * sin).sqrt();
        assert!((echo(3.0, 10_f64.to_radians(), 0.2).unwrap() - expected).abs() < 1e-12);
        assert_eq!(echo(3.0, 12_f64.to_radians(), 0.2), None, "4.5 deg beside the edge is past its radius of 3.8 deg");
        assert_eq!(echo(3.0, 3.0, 0.2), None, "behind");
    }
}
