//! What a disk of six accelerometers reads, and force and angular acceleration back from it.
//!
//! Sensor `i` at `r` with axis `u` reads `u . (f + alpha x r + w x (w x r)) + b`: linear in the specific force `f` and the
//! angular acceleration `alpha` of the disk's centre (rows `[u, r x u]`), plus a part `c(w)` of the rate and a bias.
//! Source: SPEC motion 3.1; the layout of Lee et al. 2010 is in a figure that is lost.

use drivescope_drive::disk::Disk;
use nalgebra::Vector3;

use super::linear::{Inverse, invert};

/// Condition number (row sums) of the six rows above which a layout does not tell six motions apart.
const WORST_CONDITION: f64 = 1e6;

/// Specific force and angular acceleration of the disk's centre, body axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Specific force, m/s^2.
    pub force: Vector3<f64>,
    /// Angular acceleration, rad/s^2.
    pub angular_acceleration: Vector3<f64>,
}

/// The six sensors do not tell force and angular acceleration apart.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
#[error(
    "six accelerometers in this layout do not tell specific force and angular acceleration apart (condition {0:e})"
)]
pub struct SingularLayout(pub f64);

/// A disk with the inverse of its six rows.
#[derive(Clone, Debug)]
pub struct Geometry {
    positions: [Vector3<f64>; 6],
    axes: [Vector3<f64>; 6],
    biases: [f64; 6],
    inverse: [[f64; 6]; 6],
    condition: f64,
}

impl Geometry {
    /// Prepare a disk.
    ///
    /// # Errors
    /// [`SingularLayout`] when the six rows are dependent, as those of two triads at opposite points are.
    pub fn new(disk: &Disk) -> Result<Self, SingularLayout> {
        let positions = disk.sensors.map(|s| Vector3::from(s.position));
        let axes = disk.sensors.map(|s| Vector3::from(s.axis));
        let rows = std::array::from_fn(|i| {
            let (u, turn) = (axes[i], positions[i].cross(&axes[i]));
            [u.x, u.y, u.z, turn.x, turn.y, turn.z]
        });
        let Inverse { inverse, condition } = invert::<6>(&rows).ok_or(SingularLayout(f64::INFINITY))?;
        if condition.is_nan() || condition > WORST_CONDITION {
            return Err(SingularLayout(condition));
        }
        Ok(Self { positions, axes, biases: disk.sensors.map(|s| s.bias), inverse, condition })
    }

    /// Condition number of the six rows, by row sums: about 30 for a disk of 0.1 m.
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// What the rate alone makes each sensor read, m/s^2: `u . (w x (w x r))`.
    pub fn centripetal(&self, rate: &Vector3<f64>) -> [f64; 6] {
        let square = rate.norm_squared();
        std::array::from_fn(|i| {
            let (r, u) = (&self.positions[i], &self.axes[i]);
            u.dot(rate) * rate.dot(r) - square * u.dot(r)
        })
    }

    /// What the sensors read in a motion at a rate (rad/s), m/s^2.
    pub fn outputs(&self, motion: &Motion, rate: &Vector3<f64>) -> [f64; 6] {
        let c = self.centripetal(rate);
        std::array::from_fn(|i| {
            let u = &self.axes[i];
            let turn = self.positions[i].cross(u);
            u.dot(&motion.force) + turn.dot(&motion.angular_acceleration) + c[i] + self.biases[i]
        })
    }

    /// The motion that makes the sensors read `outputs` (m/s^2) at a known rate (rad/s).
    pub fn motion(&self, outputs: &[f64; 6], rate: &Vector3<f64>) -> Motion {
        let c = self.centripetal(rate);
        let y: [f64; 6] = std::array::from_fn(|i| outputs[i] - self.biases[i] - c[i]);
        let x = self.inverse.map(|row| row.iter().zip(&y).map(|(m, y)| m * y).sum::<f64>());
        Motion { force: Vector3::new(x[0], x[1], x[2]), angular_acceleration: Vector3::new(x[3], x[4], x[5]) }
    }

    /// Sigma of the three angular accelerations (rad/s^2) for white noise of `sigma` m/s^2 at each sensor.
    pub fn angular_acceleration_sigma(&self, sigma: f64) -> [f64; 3] {
        [3, 4, 5].map(|row| sigma * self.inverse[row].iter().map(|m| m * m).sum::<f64>().sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::disk::{DISK_RADIUS, DiskSensor};

    fn leaning() -> Disk {
        let mut disk = Disk::default();
        for (i, s) in disk.sensors.iter_mut().enumerate() {
            for (k, u) in s.axis.iter_mut().enumerate() {
                *u += 0.01 * ((3 * i + k) as f64).sin();
            }
            s.bias = 0.05 * (i as f64).cos();
        }
        disk
    }

    /// Catches a sign in the cross products or a lost bias: forward model and inverse are each other's inverse.
    #[test]
    fn a_motion_comes_back_from_what_the_sensors_read() {
        let motion =
            Motion { force: Vector3::new(0.4, -1.3, -9.7), angular_acceleration: Vector3::new(0.7, -0.2, 0.5) };
        let rate = Vector3::new(0.3, -0.4, 0.9);
        for disk in [Disk::default(), leaning()] {
            let geometry = Geometry::new(&disk).unwrap();
            let back = geometry.motion(&geometry.outputs(&motion, &rate), &rate);
            assert!((back.force - motion.force).norm() < 1e-12);
            assert!((back.angular_acceleration - motion.angular_acceleration).norm() < 1e-11);
        }
    }

    /// The closed form of SPEC motion 3.1, written out.
    #[test]
    fn the_inverse_of_the_drawn_disk_is_the_closed_form() {
        let geometry = Geometry::new(&Disk::default()).unwrap();
        let y = [0.3, -0.8, 0.5, -9.1, -10.2, -9.6];
        let motion = geometry.motion(&y, &Vector3::zeros());
        let angle = |i: usize| (i as f64 * 120.0).to_radians();
        let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
        let force = Vector3::new(
            -2.0 / 3.0 * sum(&|i| angle(i).sin() * y[i]),
            2.0 / 3.0 * sum(&|i| angle(i).cos() * y[i]),
            sum(&|i| y[i + 3]) / 3.0,
        );
        let turning = Vector3::new(
            2.0 / (3.0 * DISK_RADIUS) * sum(&|i| angle(i).sin() * y[i + 3]),
            -2.0 / (3.0 * DISK_RADIUS) * sum(&|i| angle(i).cos() * y[i + 3]),
            sum(&|i| y[i]) / (3.0 * DISK_RADIUS),
        );
        assert!((motion.force - force).norm() < 1e-13 && (motion.angular_acceleration - turning).norm() < 1e-12);
    }

    /// Section 3.1: what is read when the rate is left out of the model.
    #[test]
    fn a_rate_that_is_ignored_shows_in_the_tilting_accelerations_only() {
        let geometry = Geometry::new(&Disk::default()).unwrap();
        let w = Vector3::new(0.5, -0.7, 1.1);
        let motion = Motion { force: Vector3::new(1.0, 2.0, -9.8), angular_acceleration: Vector3::new(0.1, 0.2, 0.3) };
        let read = geometry.motion(&geometry.outputs(&motion, &w), &Vector3::zeros()).angular_acceleration;
        let expected = motion.angular_acceleration + Vector3::new(w.y * w.z, -w.x * w.z, 0.0);
        assert!((read - expected).norm() < 1e-12, "{read}");
    }

    #[test]
    fn noise_of_the_angular_accelerations_is_the_specifications() {
        let sigma = Geometry::new(&Disk::default()).unwrap().angular_acceleration_sigma(0.02);
        let (tilting, turning) = (0.02 * (2.0f64 / 3.0).sqrt() / DISK_RADIUS, 0.02 / (3f64.sqrt() * DISK_RADIUS));
        assert!((sigma[0] - tilting).abs() < 1e-12 && (sigma[1] - tilting).abs() < 1e-12);
        assert!((sigma[2] - turning).abs() < 1e-12);
    }

    /// The rotation about the line through two triads moves neither: a tempting layout that cannot work.
    #[test]
    fn two_triads_at_opposite_points_are_refused() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let position = |i: usize| if i < 3 { [0.06, 0.06, 0.06] } else { [-0.06, -0.06, -0.06] };
        let sensors = std::array::from_fn(|i| DiskSensor { position: position(i), axis: axes[i % 3], bias: 0.0 });
        assert!(Geometry::new(&Disk { sensors }).is_err());
        assert!(Geometry::new(&Disk::drawn(0.0)).is_err(), "without an arm nothing tells angular acceleration");
        assert!(Geometry::new(&Disk::drawn(f64::NAN)).is_err());
    }
}
