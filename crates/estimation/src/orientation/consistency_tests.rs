//! Consistency of the robust variant over seeds: with noise that is exactly what it believes, its errors and innovations
//! are as large as it says.
//!
//! Truth is a stochastic road and body written out here at 1 kHz; it calls no model of the filter. A failure means a sign
//! error in a Jacobian, a missing or doubled noise term, or a measurement that is used twice.

use drivescope_drive::drive::Epoch;
use drivescope_drive::frames::body_to_nav;
use drivescope_drive::signals::{Imu, Mag, Wheels};
use nalgebra::SVector;

use super::*;
use crate::chi_square::quantile;

const SEEDS: u64 = 24;
const SECONDS: usize = 120;
/// Errors are looked at from here on, every `EVERY` s: the start from one noisy field is no draw from the start's covariance.
const SETTLED: usize = 30;
const EVERY: usize = 10;
const FIELD: Vector3<f64> = Vector3::new(30.11237, -4.22703, 40.12585);

/// Normal numbers from SplitMix64 by the sum of twelve uniforms.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    fn normal(&mut self, sigma: f64) -> f64 {
        sigma * ((0..12).map(|_| self.uniform()).sum::<f64>() - 6.0)
    }
}

/// A car on a road whose bank and grade wander, with the walks of `p`.
struct World<'a> {
    p: &'a OrientationParams,
    v: VehicleParams,
    noise: Noise,
    time: f64,
    /// Suspension roll, pitch and their rates, yaw, bank, grade, gyro bias, mismatch: in the filter's order.
    x: SVector<f64, 9>,
    /// Lateral specific force as measured: it drives the springs.
    accel_y: f64,
}

impl World<'_> {
    fn speed(&self) -> f64 {
        20.0 + 3.0 * (0.1 * self.time).sin()
    }
    fn turn(&self) -> f64 {
        0.12 * (0.25 * self.time).sin() + 0.05 * (0.11 * self.time).cos()
    }
    fn turning(&self) -> f64 {
        0.03 * (0.25 * self.time).cos() - 0.0055 * (0.11 * self.time).sin()
    }

    /// The sensors now. The yaw gyro's noise is the walk of the yaw: it is put there, not into the reading.
    fn measure(&mut self) -> Epoch<'static> {
        let (roll, pitch, yaw) = (self.x[0] + self.x[5], self.x[2] + self.x[6], self.x[4]);
        let v = self.speed();
        let slip = self.v.cg_to_rear - v * v / (self.p.rear_slip_stiffness * 9.80665);
        let felt = v * self.turn() + slip * self.turning() + self.x[8] - 9.80665 * roll.sin() * pitch.cos();
        self.accel_y = felt + self.noise.normal(self.p.lateral_sigma);
        let field = body_to_nav(roll, pitch, yaw).transpose() * FIELD;
        let imu = Imu { gyro_z: self.turn() + self.x[7], accel_y: self.accel_y, ..Imu::default() };
        let mut axis = |v: f64| v + self.noise.normal(self.p.field_sigma);
        Epoch {
            time: self.time,
            imu: Some(imu),
            mag: Some(Mag { mag_x: axis(field.x), mag_y: axis(field.y), mag_z: axis(field.z) }),
            wheels: Some(Wheels { speed: v, ..Wheels::default() }),
            ..Epoch::default()
        }
    }

    /// One hundredth of a second in ten steps.
    fn advance(&mut self) {
        let (p, v, h) = (self.p, &self.v, 0.001f64);
        let lever = v.sprung_mass * v.sprung_cg_arm;
        for _ in 0..10 {
            let x = self.x;
            let (roll, pitch) = (x[0] + x[5], x[2] + x[6]);
            let w = self.turn();
            let forward = 0.3 * (0.1 * self.time).cos() + 9.80665 * pitch.sin();
            let along = -p.turn_share * w * x[5].sin();
            let mut walk = |sigma: f64| self.noise.normal(sigma * h.sqrt());
            let rates = [
                x[1],
                (-v.roll_stiffness * x[0] - v.roll_damping * x[1] - lever * self.accel_y) / v.roll_inertia,
                x[3],
                (-v.pitch_stiffness * x[2] - v.pitch_damping * x[3] + lever * forward) / v.pitch_inertia,
                (w + (x[3] + along) * roll.sin()) / (roll.cos() * pitch.cos()),
                p.turn_share * w * x[5].cos() * x[6].tan() - x[5] / p.bank_time,
                along - x[6] / p.grade_time,
                0.0,
                -x[8] / p.mismatch_time,
            ];
            let sigma = [
                0.0,
                p.suspension_walk,
                0.0,
                p.suspension_walk,
                p.road_yaw_walk,
                p.bank_walk,
                p.grade_walk,
                p.gyro_bias_walk,
                p.mismatch_sigma * (2.0 / p.mismatch_time).sqrt(),
            ];
            for i in 0..9 {
                self.x[i] += rates[i] * h + walk(sigma[i]);
            }
            self.time += h;
        }
    }
}

/// Sums over runs and rows: normalized estimation error squared at each look, innovations of field and lateral force.
#[derive(Default)]
struct Sums {
    nees: Vec<f64>,
    field: (f64, f64),
    lateral: (f64, f64),
}

/// One drive in the world of `p`, seen by a filter with the parameters `told`.
fn run_seed(seed: u64, told: &OrientationParams, p: &OrientationParams, sums: &mut Sums) {
    let mut world = World {
        p,
        v: VehicleParams::default(),
        noise: Noise(seed.wrapping_mul(0x1234_5678_9abc_def1)),
        time: 0.0,
        x: SVector::zeros(),
        accel_y: 0.0,
    };
    world.x[4] = 0.5;
    world.x[7] = world.noise.normal(p.gyro_bias_start);
    let start = LogStart { imu_step: 0.01, ..LogStart::UNKNOWN };
    let mut o = Orientation::new(told, &world.v, &start);
    for k in 0..SECONDS * 100 {
        let epoch = world.measure();
        let e = o.step(&epoch).unwrap().unwrap();
        let Some(Filter::Road(f)) = &o.filter else { panic!("restarted at {}", world.time) };
        if k >= SETTLED * 100 {
            if e.field_nis.is_finite() {
                sums.field = (sums.field.0 + e.field_nis, sums.field.1 + 1.0);
            }
            sums.lateral = (sums.lateral.0 + e.lateral_nis, sums.lateral.1 + 1.0);
            if (k + 1) % (EVERY * 100) == 0 {
                let mut error = f.x - world.x;
                error[4] = wrap_angle(error[4]);
                let nees = error.dot(&f.p.cholesky().unwrap().solve(&error));
                let look = (k + 1) / (EVERY * 100) - SETTLED / EVERY - 1;
                sums.nees.resize(sums.nees.len().max(look + 1), 0.0);
                sums.nees[look] += nees;
            }
        }
        world.advance();
    }
}

fn over_seeds(p: &OrientationParams) -> Sums {
    let mut sums = Sums::default();
    (1..=SEEDS).for_each(|seed| run_seed(seed, p, p, &mut sums));
    sums
}

/// Walks of the road at which bank and grade stay drivable: the default walks reach 22 deg of bank.
fn drivable() -> OrientationParams {
    OrientationParams {
        variant: Variant::Robust,
        bank_walk: 1f64.to_radians(),
        grade_walk: 0.5f64.to_radians(),
        ..OrientationParams::default()
    }
}

/// Two-sided 95 % band of a mean per degree of freedom over so many degrees of freedom.
fn band(dof: f64) -> std::ops::RangeInclusive<f64> {
    quantile(0.025, dof) / dof..=quantile(0.975, dof) / dof
}

#[test]
fn the_robust_filters_errors_and_innovations_are_as_large_as_it_says() {
    let sums = over_seeds(&drivable());
    let dof = 9.0 * SEEDS as f64;
    assert_eq!(sums.nees.len(), (SECONDS - SETTLED) / EVERY);
    for (look, sum) in sums.nees.iter().enumerate() {
        assert!(band(dof).contains(&(sum / dof)), "errors of nine states, look {look}: {}", sum / dof);
    }
    let all = dof * sums.nees.len() as f64;
    let mean = sums.nees.iter().sum::<f64>() / all;
    assert!(band(all).contains(&mean), "all errors: {mean}");
    let (sum, count) = sums.field;
    let mean = sum / (3.0 * count);
    assert!(band(3.0 * count).contains(&mean), "innovations of the field: {mean} of {count}");
    // Not consistent: `Q dt` of first order gives the mismatch dt / tau_d = 3 % more variance than it has.
    let (sum, count) = sums.lateral;
    let mean = sum / count;
    assert!((0.98..*band(count).start()).contains(&mean), "innovations of the lateral force: {mean}");
}

#[test]
fn the_lateral_innovations_are_as_large_as_stated_where_a_step_is_short_against_the_mismatch() {
    let sums = over_seeds(&OrientationParams { mismatch_time: 2.0, ..drivable() });
    let (sum, count) = sums.lateral;
    assert!(band(count).contains(&(sum / count)), "{}", sum / count);
}

#[test]
fn a_field_noisier_than_stated_shows() {
    let mut sums = Sums::default();
    let told = OrientationParams { field_sigma: 0.4, ..drivable() };
    run_seed(1, &told, &drivable(), &mut sums);
    let mean = sums.field.0 / (3.0 * sums.field.1);
    // (0.6 / 0.4)^2 = 2.25, less what the gate leaves out.
    assert!((1.5..2.3).contains(&mean), "{mean}");
}
