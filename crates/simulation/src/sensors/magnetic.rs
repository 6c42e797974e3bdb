//! What disturbs the magnetic field round the car: bridges, passing trucks, tunnels.

use nalgebra::Vector3;

use crate::math::sin_cos;
use crate::motion::Motion;
use crate::spec::{Fault, FaultKind};

/// Direction of the extra field of a bridge's girders: mostly upward.
const GIRDERS: [f64; 3] = [0.36, 0.48, -0.8];
/// How far a truck passes on the left of the sensor, m, and how long it takes for these metres either side, m.
const TRUCK_ASIDE: f64 = 3.0;
const TRUCK_REACH: f64 = 40.0;
/// Field of a dipole of 1 A m^2 at 1 m, uT.
const DIPOLE: f64 = 0.1;
/// Wavelengths of the field's ripple in a tunnel, m.
const RIPPLE: [f64; 3] = [3.1, 7.3, 17.9];

/// The field at the sensor, north, east and down, uT, at a time (s) and a distance along the road (m).
pub fn field(undisturbed: &Vector3<f64>, faults: &[Fault], time: f64, s: f64, motion: &Motion) -> Vector3<f64> {
    let mut field = *undisturbed;
    for fault in faults {
        let Some(share) = fault.share(time, s) else { continue };
        let size = |default: f64| fault.size.unwrap_or(default);
        match fault.kind {
            FaultKind::Bridge => {
                let (sin, _) = sin_cos(std::f64::consts::PI * share);
                field += Vector3::from(GIRDERS) * (size(12.0) * sin * sin);
            }
            FaultKind::Truck => {
                let away = Vector3::new(TRUCK_REACH * (1.0 - 2.0 * share), -TRUCK_ASIDE, 0.0);
                let moment = undisturbed.normalize() * size(1500.0);
                field += dipole(&moment, &(motion.attitude * away));
            }
            FaultKind::Tunnel => {
                let edge = (4.0 * share.min(1.0 - share)).min(1.0);
                let ripple = RIPPLE.map(|length| sin_cos(std::f64::consts::TAU * s / length).0);
                let turned = Vector3::from(ripple) * (0.5 * undisturbed.norm()) - undisturbed;
                field += turned * (size(0.3) * edge);
            }
            _ => {}
        }
    }
    field
}

/// Field of a dipole (A m^2) at a distance from it, uT.
fn dipole(moment: &Vector3<f64>, away: &Vector3<f64>) -> Vector3<f64> {
    let distance = away.norm().max(1.0);
    let along = away / distance;
    (along * (3.0 * moment.dot(&along)) - moment) * (DIPOLE / (distance * distance * distance))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dipole_is_twice_as_strong_along_its_axis_and_falls_with_the_cube() {
        let moment = Vector3::new(0.0, 0.0, 1000.0);
        let along = dipole(&moment, &Vector3::new(0.0, 0.0, 4.0));
        let across = dipole(&moment, &Vector3::new(4.0, 0.0, 0.0));
        // mu_0 / (4 pi) = 1e-7 T m/A: 2 * 1e-7 * 1000 / 64 = 3.125 uT.
        assert!((along.z - 3.125).abs() < 1e-12 && (across.z + 1.5625).abs() < 1e-12);
        assert!((dipole(&moment, &Vector3::new(8.0, 0.0, 0.0)).z * 8.0 - across.z).abs() < 1e-12);
    }
}
