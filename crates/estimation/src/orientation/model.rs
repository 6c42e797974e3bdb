//! The body on its springs, and attitude rates from a single yaw gyro.
//!
//! Source: Hwang & Choi 2016 (3), (5), (6) and (11), in FRD axes with the corrections of SPEC orientation 3: the inertia
//! divides the whole row, the raw specific force drives the springs, rates are Euler rates, and the pitch rate couples
//! into roll and yaw. `Rates::Printed` takes the rates of (3) and (11) as they are printed, for comparison.

use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{Matrix3, Matrix5, Vector3, Vector5, matrix, vector};

use super::GRAVITY;
use super::trig::sin_cos;

pub(super) const ROLL: usize = 0;
pub(super) const PITCH: usize = 2;
pub(super) const YAW: usize = 4;

/// The forward specific force that pitches the body.
#[derive(Clone, Copy, Debug)]
pub(super) enum PitchDrive {
    /// Change of speed, m/s^2, to which gravity along the estimated pitch is added.
    Derived(f64),
    /// Given, m/s^2.
    Given(f64),
}

/// What drives the models over one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Input {
    /// Yaw gyro, rad/s.
    pub(super) yaw_rate: f64,
    /// Lateral specific force, m/s^2.
    pub(super) accel_y: f64,
    /// What pitches the body.
    pub(super) pitch: PitchDrive,
}

/// How body rates become angle rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rates {
    /// ZYX kinematics.
    Euler,
    /// As the paper prints them.
    Printed,
}

/// Springs and dampers, divided by the inertias.
#[derive(Clone, Copy, Debug)]
pub(super) struct Suspension {
    pub(super) roll_stiffness: f64,
    pub(super) roll_damping: f64,
    pub(super) roll_lever: f64,
    pub(super) pitch_stiffness: f64,
    pub(super) pitch_damping: f64,
    pub(super) pitch_lever: f64,
}

impl Suspension {
    pub(super) fn new(v: &VehicleParams) -> Self {
        let lever = v.sprung_mass * v.sprung_cg_arm;
        Self {
            roll_stiffness: v.roll_stiffness / v.roll_inertia,
            roll_damping: v.roll_damping / v.roll_inertia,
            roll_lever: lever / v.roll_inertia,
            pitch_stiffness: v.pitch_stiffness / v.pitch_inertia,
            pitch_damping: v.pitch_damping / v.pitch_inertia,
            pitch_lever: lever / v.pitch_inertia,
        }
    }

    /// Roll and pitch against the road, rad, at which lateral and forward specific force are in balance with the springs.
    pub(super) fn at_rest(&self, accel_y: f64, accel_x: f64) -> (f64, f64) {
        (-self.roll_lever * accel_y / self.roll_stiffness, self.pitch_lever * accel_x / self.pitch_stiffness)
    }

    /// Roll acceleration at roll `angle` and rate `rate`, rad/s^2.
    pub(super) fn roll_acceleration(&self, angle: f64, rate: f64, u: &Input) -> f64 {
        -self.roll_stiffness * angle - self.roll_damping * rate - self.roll_lever * u.accel_y // (5)
    }

    /// Pitch acceleration at pitch `angle` (whose sine is `sin`) and rate `rate`, rad/s^2.
    pub(super) fn pitch_acceleration(&self, angle: f64, sin: f64, rate: f64, u: &Input) -> f64 {
        let force = match u.pitch {
            PitchDrive::Derived(change) => change + GRAVITY * sin,
            PitchDrive::Given(force) => force,
        };
        -self.pitch_stiffness * angle - self.pitch_damping * rate + self.pitch_lever * force // (6)
    }
}

/// `dx/dt` of roll, roll rate, pitch, pitch rate and yaw. (11)
pub(super) fn sprung_rates(x: &Vector5<f64>, u: &Input, s: &Suspension, rates: Rates) -> Vector5<f64> {
    let (sr, cr) = sin_cos(x[ROLL]);
    let (sp, cp) = sin_cos(x[PITCH]);
    let (p, q, r) = (x[1], x[3], u.yaw_rate);
    let (by_roll, by_pitch, by_yaw) = match rates {
        Rates::Euler => ((q * sr + r * cr) * sp / cp, q * cr - r * sr, (q * sr + r * cr) / cp),
        Rates::Printed => (r * cr * sp, q - r * sr, r * cr * cp),
    };
    vector![p + by_roll, s.roll_acceleration(x[ROLL], p, u), by_pitch, s.pitch_acceleration(x[PITCH], sp, q, u), by_yaw]
}

/// Jacobian of [`sprung_rates`] with respect to the state.
pub(super) fn sprung_jacobian(x: &Vector5<f64>, u: &Input, s: &Suspension, rates: Rates) -> Matrix5<f64> {
    let (sr, cr) = sin_cos(x[ROLL]);
    let (sp, cp) = sin_cos(x[PITCH]);
    let (q, r) = (x[3], u.yaw_rate);
    let gravity = if matches!(u.pitch, PitchDrive::Derived(_)) { s.pitch_lever * GRAVITY * cp } else { 0.0 };
    let pitch_spring = gravity - s.pitch_stiffness;
    if rates == Rates::Printed {
        return matrix![
            -r * sr * sp,      1.0,             r * cr * cp,  0.0,              0.0;
            -s.roll_stiffness, -s.roll_damping, 0.0,          0.0,              0.0;
            -r * cr,           0.0,             0.0,          1.0,              0.0;
            0.0,               0.0,             pitch_spring, -s.pitch_damping, 0.0;
            -r * sr * cp,      0.0,             -r * cr * sp, 0.0,              0.0;
        ];
    }
    let tan = sp / cp;
    let (w, across) = (q * sr + r * cr, q * cr - r * sr);
    matrix![
        across * tan,      1.0,             w / (cp * cp),  sr * tan,         0.0;
        -s.roll_stiffness, -s.roll_damping, 0.0,            0.0,              0.0;
        -w,                0.0,             0.0,            cr,               0.0;
        0.0,               0.0,             pitch_spring,   -s.pitch_damping, 0.0;
        across / cp,       0.0,             w * tan / cp,   sr / cp,          0.0;
    ]
}

/// `dx/dt` of roll, pitch and yaw from the yaw gyro alone. (3)
pub(super) fn gyro_rates(x: &Vector3<f64>, yaw_rate: f64, rates: Rates) -> Vector3<f64> {
    let (sr, cr) = sin_cos(x[0]);
    let (sp, cp) = sin_cos(x[1]);
    match rates {
        Rates::Euler => vector![cr * sp / cp, -sr, cr / cp] * yaw_rate,
        Rates::Printed => vector![cr * sp, -sr, cr * cp] * yaw_rate,
    }
}

/// Jacobian of [`gyro_rates`] with respect to the angles.
pub(super) fn gyro_jacobian(x: &Vector3<f64>, yaw_rate: f64, rates: Rates) -> Matrix3<f64> {
    let (sr, cr) = sin_cos(x[0]);
    let (sp, cp) = sin_cos(x[1]);
    let unit = match rates {
        Rates::Euler => matrix![
            -sr * sp / cp, cr / (cp * cp),      0.0;
            -cr,           0.0,                 0.0;
            -sr / cp,      cr * sp / (cp * cp), 0.0;
        ],
        Rates::Printed => matrix![-sr * sp, cr * cp, 0.0; -cr, 0.0, 0.0; -sr * cp, -cr * sp, 0.0],
    };
    unit * yaw_rate
}

/// `dx/dt` of the open-loop model: roll and pitch against the road are the springs' alone, yaw is the gyro's.
pub(super) fn open_loop_rates(x: &Vector5<f64>, u: &Input, s: &Suspension) -> Vector5<f64> {
    let (sr, cr) = sin_cos(x[ROLL]);
    let (sp, cp) = sin_cos(x[PITCH]);
    vector![
        x[1],
        s.roll_acceleration(x[ROLL], x[1], u),
        x[3],
        s.pitch_acceleration(x[PITCH], sp, x[3], u),
        (u.yaw_rate + x[3] * sr) / (cr * cp)
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::assert_jacobian;

    #[test]
    fn every_jacobian_is_the_derivative_of_its_rates() {
        let s = Suspension::new(&VehicleParams::default());
        for rates in [Rates::Euler, Rates::Printed] {
            for pitch in [PitchDrive::Derived(1.5), PitchDrive::Given(-2.0)] {
                let u = Input { yaw_rate: -0.4, accel_y: 3.0, pitch };
                for x in [vector![0.2, -0.5, -0.1, 0.3, 2.0], vector![-0.6, 1.0, 0.5, -0.8, -3.0], Vector5::zeros()] {
                    // Spring terms reach 100 rad/s^2: 1e-8 of rounding in a central difference.
                    assert_jacobian(|x| sprung_rates(x, &u, &s, rates), &sprung_jacobian(&x, &u, &s, rates), &x, 1e-7);
                    let angles = vector![x[0], x[2], x[4]];
                    let j = gyro_jacobian(&angles, -0.4, rates);
                    assert_jacobian(|x| gyro_rates(x, -0.4, rates), &j, &angles, 1e-7);
                }
            }
        }
    }

    #[test]
    fn a_steady_turn_leans_the_body_outward_by_its_roll_gain() {
        // Turning right gives positive accel_y; the body leans left by m_s h_s accel_y / k_x: 5.07 deg for one g felt by the
        // sensor (5.6 deg/g in SPEC orientation 4 adds the weight of the leaning body).
        let v = VehicleParams::default();
        let u = Input { yaw_rate: 0.0, accel_y: GRAVITY, pitch: PitchDrive::Given(GRAVITY) };
        let s = Suspension::new(&v);
        let roll = -v.sprung_mass * v.sprung_cg_arm * GRAVITY / v.roll_stiffness;
        let pitch = v.sprung_mass * v.sprung_cg_arm * GRAVITY / v.pitch_stiffness;
        assert!((roll.to_degrees() + 5.07).abs() < 0.01 && (pitch.to_degrees() - 1.80).abs() < 0.01);
        let x = vector![roll, 0.0, pitch, 0.0, 0.0];
        assert!(open_loop_rates(&x, &u, &s).norm() < 1e-12);
    }
}
