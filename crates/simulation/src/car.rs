//! The car's parameters as the plant needs them, derived from the shared [`VehicleParams`] and a few of its own.

use drivescope_drive::vehicle::VehicleParams;
use nalgebra::Vector3;

use crate::tyre::Tyre;

/// Which axle the engine drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driven {
    /// Front axle.
    Front,
    /// Rear axle.
    Rear,
}

/// What is the same for every simulated car. Each number is a common value for saloons unless its source is named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Common {
    /// Rolling radius, m (CommonRoad vehicle 2: R_w).
    pub wheel_radius: f64,
    /// Moment of inertia of a wheel with its share of the drive line, kg m^2 (CommonRoad vehicle 2: I_y_w).
    pub wheel_inertia: f64,
    /// Drag coefficient times frontal area, m^2.
    pub drag_area: f64,
    /// Rolling resistance over load.
    pub rolling_resistance: f64,
    /// Share of the brake force on the front axle (CommonRoad vehicle 2: T_sb).
    pub front_brake_share: f64,
    /// Share of the anti-roll bars' stiffness at the front axle (CommonRoad vehicle 2: K_tsf, K_tsr).
    pub front_bar_share: f64,
    /// Largest engine power at the wheels, W.
    pub power: f64,
    /// Largest drive force, N per kg of the car.
    pub drive_force_per_mass: f64,
    /// Share of Ackermann's difference between the front wheels' angles.
    pub ackermann: f64,
}

/// The values of [`Common`] used for every preset.
pub const COMMON: Common = Common {
    wheel_radius: 0.344,
    wheel_inertia: 1.7,
    drag_area: 0.66,
    rolling_resistance: 0.011,
    front_brake_share: 0.66,
    front_bar_share: 0.72,
    power: 95e3,
    drive_force_per_mass: 4.0,
    ackermann: 0.8,
};

/// Air density at 15 deg C at sea level, kg/m^3 (ISO 2533).
pub const AIR_DENSITY: f64 = 1.225;

/// Wheels in the order front left, front right, rear left, rear right.
pub const WHEELS: usize = 4;

/// A car, ready for the plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Car {
    /// The parameters that estimators know too.
    pub params: VehicleParams,
    /// What all cars share.
    pub common: Common,
    /// Driven axle.
    pub driven: Driven,
    /// Mass, kg.
    pub mass: f64,
    /// Moments of inertia about the centre of gravity, body axes, kg m^2.
    pub inertia: Vector3<f64>,
    /// Ground points below the wheels in body axes with the body at rest on level ground, m.
    pub ground_points: [Vector3<f64>; WHEELS],
    /// Depth below the centre of gravity at which the links pass the tyres' forces to the body, m.
    pub link_depth: f64,
    /// Height of that point over the ground, m.
    pub link_height: f64,
    /// Load of each wheel at rest on level ground, N.
    pub rest_load: [f64; WHEELS],
    /// Spring rate at each wheel, N/m.
    pub spring: [f64; WHEELS],
    /// Damper rate at each wheel, N s/m.
    pub damper: [f64; WHEELS],
    /// Anti-roll bar's rate at each wheel, N per metre of difference to the wheel across.
    pub bar: [f64; WHEELS],
    /// Tyres.
    pub tyre: [Tyre; WHEELS],
}

/// A tyre of this cornering stiffness over load and this friction at its load at rest (N).
fn tyre(cornering_stiffness: f64, friction: f64, nominal_load: f64) -> Tyre {
    Tyre {
        slip_stiffness: 22.303, // CommonRoad p_kx1
        cornering_stiffness,
        friction,
        nominal_load,
        load_sensitivity: 0.08,
        relaxation_ahead: 0.3,
        relaxation_aside: 0.5,
    }
}

impl Car {
    /// The car of a named preset with its parameters, on ground with this gravity (m/s^2).
    ///
    /// Springs: the pitch stiffness is split so that heave and pitch do not couple; what the roll stiffness has beyond
    /// the springs' is put into anti-roll bars. The body is one rigid mass; tyre forces reach it at such a height that
    /// mass times arm equals the shared parameters' sprung mass times its arm, so that the steady roll angle is theirs.
    pub fn new(preset: &str, params: VehicleParams, gravity: f64) -> Self {
        let p = &params;
        let (front, rear, half_track) = (p.cg_to_front, p.cg_to_rear, 0.5 * p.track);
        let base = front + rear;
        let link_depth = p.sprung_cg_arm * p.sprung_mass / p.mass;
        let arm2 = p.sprung_mass * p.sprung_cg_arm * p.sprung_cg_arm;
        let about_cg = |about_axis: f64| (about_axis - arm2).max(0.3 * about_axis);
        let split = |pitch_rate: f64| [pitch_rate / (2.0 * front * base), pitch_rate / (2.0 * rear * base)];
        let (spring, damper) = (split(p.pitch_stiffness), split(p.pitch_damping));
        let bars = p.roll_stiffness - 2.0 * half_track * half_track * (spring[0] + spring[1]);
        let bar_rate = |share: f64| share * bars / (4.0 * half_track * half_track);
        let share = COMMON.front_bar_share;
        let bar = [bar_rate(share), bar_rate(1.0 - share)];
        let rest = [0.5 * p.mass * gravity * rear / base, 0.5 * p.mass * gravity * front / base];
        let per_wheel = |axle: [f64; 2]| [axle[0], axle[0], axle[1], axle[1]];
        let tyres = [tyre(p.front_cornering, p.friction, rest[0]), tyre(p.rear_cornering, p.friction, rest[1])];
        Self {
            common: COMMON,
            driven: if matches!(preset, "bmw_320i" | "vw_vanagon") { Driven::Rear } else { Driven::Front },
            mass: p.mass,
            inertia: Vector3::new(about_cg(p.roll_inertia), about_cg(p.pitch_inertia), p.yaw_inertia),
            ground_points: [(front, -half_track), (front, half_track), (-rear, -half_track), (-rear, half_track)]
                .map(|(x, y)| Vector3::new(x, y, p.cg_height)),
            link_depth,
            link_height: p.cg_height - link_depth,
            rest_load: per_wheel(rest),
            spring: per_wheel(spring),
            damper: per_wheel(damper),
            bar: per_wheel(bar),
            tyre: [tyres[0], tyres[0], tyres[1], tyres[1]],
            params,
        }
    }

    /// The car with shares of its air drag and rolling resistance, and of its tyres' relaxation lengths.
    pub fn with_shares(mut self, resistance: f64, relaxation: f64) -> Self {
        self.common.drag_area *= resistance;
        self.common.rolling_resistance *= resistance;
        for tyre in &mut self.tyre {
            tyre.relaxation_ahead *= relaxation;
            tyre.relaxation_aside *= relaxation;
        }
        self
    }

    /// Distance between the axles, m.
    pub fn wheelbase(&self) -> f64 {
        self.params.cg_to_front + self.params.cg_to_rear
    }

    /// Extra steering per lateral acceleration in the linear range, rad per m/s^2; positive understeers.
    pub fn understeer_gradient(&self) -> f64 {
        let per_axle = |wheel: usize| 1.0 / self.tyre[wheel].cornering_stiffness;
        (per_axle(0) - per_axle(2)) * self.mass / (2.0 * (self.rest_load[0] + self.rest_load[2]))
    }

    /// Drag and rolling resistance at a forward speed, N; none at rest.
    pub fn resistance(&self, speed: f64) -> f64 {
        let rolling = self.common.rolling_resistance * 2.0 * (self.rest_load[0] + self.rest_load[2]);
        let drag = 0.5 * AIR_DENSITY * self.common.drag_area * speed * speed.abs();
        drag + if speed.abs() > 0.05 { rolling * speed.signum() } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn springs_and_bars_add_up_to_the_shared_stiffnesses() {
        for preset in ["bmw_320i", "ford_escort", "saloon", "vw_vanagon"] {
            let p = VehicleParams::preset(preset).unwrap();
            let car = Car::new(preset, p.clone(), 9.8);
            let pitch: f64 = (0..4).map(|i| car.spring[i] * car.ground_points[i].x.powi(2)).sum();
            let roll: f64 = (0..4).map(|i| (car.spring[i] + 2.0 * car.bar[i]) * car.ground_points[i].y.powi(2)).sum();
            assert!((pitch / p.pitch_stiffness - 1.0).abs() < 1e-12);
            assert!((roll / p.roll_stiffness - 1.0).abs() < 1e-12);
            assert!(car.bar.iter().all(|&b| b >= 0.0), "{preset}: the springs alone are stiffer in roll");
            assert!((car.rest_load.iter().sum::<f64>() - p.mass * 9.8).abs() < 1e-9);
        }
    }

    #[test]
    fn the_derived_springs_are_close_to_the_published_ones() {
        // CommonRoad vehicle 2: K_sf = 24453, K_sr = 19636 N/m, I_y_s = 1565.8 kg m^2.
        let car = Car::new("bmw_320i", VehicleParams::preset("bmw_320i").unwrap(), 9.81);
        assert!((car.spring[0] / 24453.0 - 1.0).abs() < 0.02 && (car.spring[2] / 19636.0 - 1.0).abs() < 0.02);
        assert!((car.inertia.y / 1565.8 - 1.0).abs() < 1e-3);
    }
}
