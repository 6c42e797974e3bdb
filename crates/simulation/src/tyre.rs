//! Tyre forces: the Magic Formula in normalized slip, isotropic combined slip, load-dependent friction.
//!
//! Source: Pacejka, "Tire and Vehicle Dynamics" (3rd ed. 2012), similarity method (section 4.2) with normalized slips;
//! shape factors from the CommonRoad vehicle models' `parameters_tire.yaml` (p_cx1, p_ex1, p_cy1, p_ey1).

/// One tyre. Stiffness is per unit of load: slip stiffness over vertical load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tyre {
    /// Longitudinal slip stiffness over load, 1.
    pub slip_stiffness: f64,
    /// Cornering stiffness over load, 1/rad.
    pub cornering_stiffness: f64,
    /// Peak friction at nominal load.
    pub friction: f64,
    /// Vertical load at which `friction` holds, N.
    pub nominal_load: f64,
    /// Loss of friction per doubling of the load.
    pub load_sensitivity: f64,
    /// Relaxation length of longitudinal deflection, m.
    pub relaxation_ahead: f64,
    /// Relaxation length of lateral deflection, m.
    pub relaxation_aside: f64,
}

const SHAPE_AHEAD: f64 = 1.6411;
const SHAPE_ASIDE: f64 = 1.3507;
const BEND_AHEAD: f64 = 0.46403;
const BEND_ASIDE: f64 = -0.007_474_7;

impl Tyre {
    /// Peak friction at a vertical load (N).
    pub fn friction_at(&self, load: f64) -> f64 {
        let excess = (load / self.nominal_load - 1.0).clamp(-1.0, 3.0);
        self.friction * (1.0 - self.load_sensitivity * excess)
    }

    /// Force ahead and to the right, N, at longitudinal slip `kappa`, tangent of the slip angle and vertical load (N).
    ///
    /// Positive `kappa` drives. A positive slip tangent is a wheel that slides to the right: the force points left.
    /// Never longer than friction times load.
    pub fn force(&self, kappa: f64, slip_tangent: f64, load: f64) -> (f64, f64) {
        if load <= 0.0 {
            return (0.0, 0.0);
        }
        let friction = self.friction_at(load);
        let ahead = self.slip_stiffness * kappa / friction;
        let aside = -self.cornering_stiffness * slip_tangent / friction;
        let (ahead2, aside2) = (ahead * ahead, aside * aside);
        let demand2 = ahead2 + aside2;
        if demand2 < 1e-12 {
            return (friction * load * ahead, friction * load * aside);
        }
        let demand = demand2.sqrt();
        let share = ahead2 / demand2;
        let shape = SHAPE_ASIDE + (SHAPE_AHEAD - SHAPE_ASIDE) * share;
        let bend = BEND_ASIDE + (BEND_AHEAD - BEND_ASIDE) * share;
        let x = demand / shape;
        let force = friction * load * libm::sin(shape * libm::atan(x - bend * (x - libm::atan(x)))) / demand;
        (force * ahead, force * aside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TYRE: Tyre = Tyre {
        slip_stiffness: 22.3,
        cornering_stiffness: 20.0,
        friction: 1.0,
        nominal_load: 3000.0,
        load_sensitivity: 0.1,
        relaxation_ahead: 0.3,
        relaxation_aside: 0.5,
    };

    #[test]
    fn small_slips_give_the_stated_stiffness_with_the_right_sign() {
        let (ahead, _) = TYRE.force(1e-5, 0.0, 3000.0);
        let (_, aside) = TYRE.force(0.0, 1e-5, 3000.0);
        assert!((ahead - 22.3e-5 * 3000.0).abs() < 1e-6, "drives forward");
        assert!((aside + 20e-5 * 3000.0).abs() < 1e-6, "opposes the slide");
    }

    #[test]
    fn no_slip_asks_for_more_than_friction_and_a_lifted_wheel_gives_nothing() {
        for i in -20..=20 {
            for j in -20..=20 {
                let (x, y) = TYRE.force(f64::from(i) * 0.05, f64::from(j) * 0.05, 4000.0);
                assert!(x.hypot(y) <= TYRE.friction_at(4000.0) * 4000.0 * (1.0 + 1e-12));
            }
        }
        assert_eq!(TYRE.force(0.1, 0.1, 0.0), (0.0, 0.0));
    }

    #[test]
    fn braking_takes_from_the_lateral_force() {
        let (_, free) = TYRE.force(0.0, 0.05, 3000.0);
        let (_, braked) = TYRE.force(-0.15, 0.05, 3000.0);
        assert!(braked.abs() < 0.6 * free.abs(), "{free} {braked}");
    }
}
