//! The lateral tyre of the controller's model: the Magic Formula as it was published in 1987.
//!
//! `F = D sin(C atan(B phi))`, `phi = (1 - E) alpha + (E / B) atan(B alpha)`; load in kN and slip angle in degrees inside
//! the coefficients, newtons and radians outside.
//! Source: Bakker, Nyborg & Pacejka 1987 (SAE 870421), Table 2 of Yun & Yu 2007; SPEC navigation 9.
//! Departure: C is not in the table; 1.30 is the published value for the lateral force. Camber and shifts are zero.

use drivescope_drive::choice;

/// Shape factor C of the lateral force (a0).
pub const SHAPE: f64 = 1.30;
/// A smaller load is taken as this one, N.
const LEAST_LOAD: f64 = 1.0;
/// Longitudinal slip is kept this far from a locked wheel.
const LEAST_ROLLING: f64 = 1e-3;

choice! {
    /// Named tyres.
    pub enum TyreName {
        /// Table 2 of the paper as printed: soft beyond belief, `a5` = 0.028.
        Table2 = "table2",
        /// The same with `a5` = 0.208, as two swapped digits suggest.
        Table2A5Fix = "table2_a5fix",
        /// The lateral set published in 1987.
        Bakker1987 = "bakker_1987",
    }
}

/// Coefficients `a1` to `a8` of a tyre's lateral force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LateralTyre {
    /// `a1` to `a8`, in the units of 1987: kN, degrees, N.
    pub a: [f64; 8],
}

impl LateralTyre {
    /// The tyre of a name.
    pub const fn named(name: TyreName) -> Self {
        let a = match name {
            TyreName::Table2 => [-10.12, 1260.0, 1040.0, 1.987, 0.028, -0.05, 0.39, -0.44],
            TyreName::Table2A5Fix => [-10.12, 1260.0, 1040.0, 1.987, 0.208, -0.05, 0.39, -0.44],
            TyreName::Bakker1987 => [-22.1, 1011.0, 1078.0, 1.82, 0.208, 0.0, -0.354, 0.707],
        };
        Self { a }
    }

    /// The curve at a load (N) on a road whose friction is a share of the tyre's own.
    pub fn curve(&self, load: f64, friction: f64) -> Curve {
        let [a1, a2, a3, a4, a5, a6, a7, a8] = self.a;
        let kn = load.max(LEAST_LOAD) / 1000.0;
        let slope = a3 * libm::sin(a4 * libm::atan(a5 * kn));
        Curve::new(slope.to_degrees(), friction * (a1 * kn * kn + a2 * kn), a6 * kn * kn + a7 * kn + a8)
    }
}

/// Lateral force over slip angle at one load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// B, 1/rad.
    pub stiffness_factor: f64,
    /// Peak force D, N.
    pub peak: f64,
    /// Curvature E, at most 1.
    pub curvature: f64,
}

impl Curve {
    /// A curve of a slope at zero (N/rad), a peak (N) and a curvature.
    pub fn new(slope: f64, peak: f64, curvature: f64) -> Self {
        let peak = peak.max(1e-9);
        Self { stiffness_factor: slope / (SHAPE * peak), peak, curvature: curvature.min(1.0) }
    }

    /// Slope at zero, N/rad.
    pub fn slope(&self) -> f64 {
        self.stiffness_factor * SHAPE * self.peak
    }

    /// Size of the force at a slip angle (rad), with the angle's sign, N.
    pub fn force(&self, slip_angle: f64) -> f64 {
        let b = self.stiffness_factor;
        let phi = (1.0 - self.curvature) * slip_angle + self.curvature / b * libm::atan(b * slip_angle);
        self.peak * libm::sin(SHAPE * libm::atan(b * phi))
    }

    /// Force along (x) and across (y, against the slip) under longitudinal slip and a slip angle (rad), N.
    ///
    /// Isotropic similarity: one curve over the length of the slip vector, shared in its direction. SPEC navigation 9.
    pub fn combined(&self, slip: f64, slip_angle: f64) -> (f64, f64) {
        let rolling = (1.0 + slip).max(LEAST_ROLLING);
        let (along, across) = (slip / rolling, libm::tan(slip_angle) / rolling);
        let length = (along * along + across * across).sqrt();
        if length < 1e-12 {
            return (0.0, 0.0);
        }
        let force = self.force(libm::atan(length));
        (force * along / length, -force * across / length)
    }

    /// Size of the force of a wheel that also carries a force along itself (N), on the friction ellipse.
    pub fn force_beside(&self, slip_angle: f64, along: f64) -> f64 {
        let share = along / self.peak;
        self.force(slip_angle) * (1.0 - (share * share).min(1.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_at_zero_and_the_peak_are_those_asked_for() {
        for name in [TyreName::Table2, TyreName::Table2A5Fix, TyreName::Bakker1987] {
            let curve = LateralTyre::named(name).curve(1961.33, 1.0);
            let slope = curve.force(1e-6) / 1e-6;
            assert!((slope / curve.slope() - 1.0).abs() < 1e-6, "{name:?}");
            let most = (0..9000).map(|k| curve.force(f64::from(k) * 1e-4)).fold(0.0, f64::max);
            assert!(most <= curve.peak && (name == TyreName::Table2 || most > 0.999 * curve.peak), "{name:?} {most}");
        }
    }

    #[test]
    fn the_printed_tyre_is_degenerate_and_the_other_reading_is_the_published_one() {
        // SPEC navigation 9: at 2 kN 115 N/deg as printed, 734 N/deg with 0.208, within 4 % of the set of 1987.
        let slope = |name| LateralTyre::named(name).curve(2000.0, 1.0).slope().to_radians();
        assert!((slope(TyreName::Table2) - 115.0).abs() < 1.0);
        assert!((slope(TyreName::Table2A5Fix) - 734.0).abs() < 1.0);
        assert!((slope(TyreName::Table2A5Fix) / slope(TyreName::Bakker1987) - 1.0).abs() < 0.04);
    }

    #[test]
    fn friction_moves_the_peak_and_leaves_the_slope() {
        let tyre = LateralTyre::named(TyreName::Table2A5Fix);
        let (dry, wet) = (tyre.curve(2000.0, 1.0), tyre.curve(2000.0, 0.5));
        assert!((wet.peak / dry.peak - 0.5).abs() < 1e-12 && (wet.slope() / dry.slope() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn forces_stay_finite_at_the_ends_of_their_ranges() {
        for load in [-100.0, 0.0, 1.0, 8000.0] {
            let curve = LateralTyre::named(TyreName::Table2).curve(load, 1.0);
            for (slip, angle) in [(0.0, 0.0), (-1.0, 0.1), (-2.0, -0.1), (5.0, 1.5)] {
                let (x, y) = curve.combined(slip, angle);
                assert!(x.is_finite() && y.is_finite() && x * slip >= 0.0 && y * angle <= 0.0);
            }
            assert_eq!(curve.force_beside(0.1, 2.0 * curve.peak), 0.0);
        }
    }
}
