//! Calibration against simulated readings (SPEC orientation 7), and its refusals.

use std::f64::consts::FRAC_PI_6;

use drivescope_drive::frames::{body_to_nav, wrap_angle};
use drivescope_drive::signals::Mag;
use nalgebra::{Matrix3, Vector3};

use super::model::{STATES, State};
use super::*;

/// Daejeon, WMM2015v2 at 2016.2.
const EARTH: Vector3<f64> = Vector3::new(30.112_37, -4.227_03, 40.125_85);
const NOISE: f64 = 0.3;

/// Normal random numbers: splitmix64 and Box and Muller's method.
struct Rng(u64);

impl Rng {
    fn new(seed: u64) -> Self {
        Self(seed)
    }
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// How the simulated car or hand turns the sensor.
#[derive(Clone, Copy)]
enum Turning {
    /// Every attitude.
    Full,
    /// Full turns of heading, roll and pitch with this RMS, deg.
    Tilt(f64),
    /// Headings of this width only, deg.
    Arc(f64),
}

/// The errors of the specification's runs: hard iron (12, -8, 5) uT, soft iron up to 6 %.
fn truth() -> State {
    let shape = Matrix3::new(1.06, 0.02, -0.03, 0.02, 0.95, 0.015, -0.03, 0.015, 1.02);
    model::state(&shape, &Vector3::new(12.0, -8.0, 5.0))
}

/// Readings with attitudes (roll, pitch, yaw).
fn readings(count: usize, turning: Turning, seed: u64) -> (Vec<Vector3<f64>>, Vec<[f64; 3]>) {
    let mut rng = Rng::new(seed);
    let inverse = model::shape(&truth()).try_inverse().unwrap();
    let offset = truth().fixed_rows::<3>(0).into_owned();
    (0..count)
        .map(|k| {
            let turn = std::f64::consts::TAU * 5.0 * k as f64 / count as f64;
            let [roll, pitch, yaw] = match turning {
                Turning::Full => [wrap_angle(7.3 * turn), (2.9 * turn).sin(), wrap_angle(turn)],
                Turning::Tilt(deg) => {
                    [deg.to_radians() * rng.normal(), deg.to_radians() * rng.normal(), wrap_angle(turn)]
                }
                Turning::Arc(deg) => [0.01 * rng.normal(), 0.01 * rng.normal(), 0.5 * deg.to_radians() * turn.sin()],
            };
            let field = body_to_nav(roll, pitch, yaw).transpose() * EARTH;
            let noise = Vector3::from_fn(|_, _| NOISE * rng.normal());
            (inverse * (field + offset) + noise, [roll, pitch, yaw])
        })
        .unzip()
}

/// RMS error of the level-sensor heading of the specification, deg: tilt removed with the true roll and pitch.
fn heading_rms(
    readings: &[Vector3<f64>],
    attitudes: &[[f64; 3]],
    correct: impl Fn(&Vector3<f64>) -> Vector3<f64>,
) -> f64 {
    let declination = EARTH.y.atan2(EARTH.x);
    let squares = readings.iter().zip(attitudes).map(|(m, [roll, pitch, yaw])| {
        let level = body_to_nav(*roll, *pitch, 0.0) * correct(m);
        wrap_angle((-level.y).atan2(level.x) + declination - yaw).to_degrees().powi(2)
    });
    (squares.sum::<f64>() / readings.len() as f64).sqrt()
}

#[test]
fn full_rotation_gives_all_nine_unknowns_by_every_method() {
    let (m, _) = readings(1500, Turning::Full, 1);
    let outcome = calibrate(&m, &EARTH, None);
    let fitted = outcome.result.unwrap();
    assert_eq!(fitted.kind, Kind::Full);
    let (mut extended, mut unscented) = (RecursiveCalibration::new(NOISE), RecursiveCalibration::new(NOISE));
    for m in &m {
        extended.update_extended(m, EARTH.norm());
        unscented.update_unscented(m, EARTH.norm());
    }
    for (name, x) in [("fit", fitted.state()), ("extended", extended.x), ("unscented", unscented.x)] {
        let error = x - truth();
        let (offset, shape) = (error.fixed_rows::<3>(0).amax(), error.fixed_rows::<6>(3).amax());
        println!("{name}: {offset:.3} uT, {shape:.4}");
        // What the specification measured: 0.15 uT and 0.003.
        assert!(error.fixed_rows::<3>(0).amax() <= 0.15, "{name} {error}");
        assert!(error.fixed_rows::<6>(3).amax() <= 0.003, "{name} {error}");
    }
}

#[test]
fn full_rotation_brings_the_heading_from_sixteen_degrees_below_one() {
    let (m, attitudes) = readings(1500, Turning::Full, 2);
    let before = heading_rms(&m, &attitudes, |m| *m);
    let calibration = calibrate(&m, &EARTH, None).result.unwrap();
    let after = heading_rms(&m, &attitudes, |m| calibration.correct(m));
    // The specification measured 16.3 and 0.58 deg; the noise alone gives 0.3 uT over 30 uT, 0.57 deg.
    println!("full rotation: heading {before:.1} to {after:.2} deg");
    assert!(before > 10.0 && after < 0.7, "{before:.1} {after:.2}");
}

#[test]
fn a_car_that_hardly_tilts_gets_the_planar_fit() {
    for (deg, limit) in [(2.0, 0.72), (8.0, 1.35)] {
        let (m, attitudes) = readings(1500, Turning::Tilt(deg), 3);
        let before = heading_rms(&m, &attitudes, |m| *m);
        let outcome = calibrate(&m, &EARTH, None);
        assert_eq!(outcome.quality.kind, Some(Kind::Planar), "{:?}", outcome.quality);
        let calibration = outcome.result.unwrap();
        let after = heading_rms(&m, &attitudes, |m| calibration.correct(m));
        // The specification measured 0.57 deg at 2 deg of tilt and 1.08 deg at 8 deg, and allows a quarter more on other noise.
        println!("{deg} deg of tilt: heading {before:.1} to {after:.2} deg");
        assert!(before > 15.0 && after < limit, "{deg} deg: {before:.1} {after:.2}");
        assert_eq!(calibration.distortion[2], 0.0);
    }
}

#[test]
fn the_ellipsoid_alone_starts_close_and_the_trap_of_one_place_is_avoided() {
    let (m, _) = readings(1500, Turning::Full, 4);
    let strength = vec![EARTH.norm(); m.len()];
    let start = first_step::first_step(&m, &strength, Kind::Full).unwrap();
    let error = start - truth();
    // Not the trivial solution D = -I, and near enough for the refinement.
    assert!(error.fixed_rows::<3>(0).amax() < 1.0 && error.fixed_rows::<6>(3).amax() < 0.02, "{error}");
}

#[test]
fn where_the_strength_varies_the_centred_solution_is_used_and_exact() {
    let (inverse, offset) = (model::shape(&truth()).try_inverse().unwrap(), truth().fixed_rows::<3>(0).into_owned());
    let (mut m, mut strength) = (Vec::new(), Vec::new());
    for k in 0..400 {
        let turn = 0.1 * f64::from(k);
        let scale = 1.0 + 0.1 * (0.37 * turn).sin();
        m.push(inverse * (body_to_nav(7.3 * turn, (2.9 * turn).sin(), turn).transpose() * EARTH * scale + offset));
        strength.push(EARTH.norm() * scale);
    }
    let start = first_step::first_step(&m, &strength, Kind::Full).unwrap();
    assert!((start - truth()).amax() < 1e-6, "{start}");
}

#[test]
fn the_refinement_is_not_pulled_by_disturbed_readings() {
    let (mut m, attitudes) = readings(1500, Turning::Tilt(2.0), 5);
    // A steel gate passed at one heading: a fifth of a turn of five, 15 uT off.
    m[200..260].iter_mut().for_each(|m| *m += Vector3::new(15.0, 5.0, 0.0));
    let calibration = calibrate(&m, &EARTH, None).result.unwrap();
    let clean: Vec<usize> = (0..m.len()).filter(|k| !(200..260).contains(k)).collect();
    let (m, attitudes): (Vec<_>, Vec<_>) = clean.iter().map(|&k| (m[k], attitudes[k])).unzip();
    let after = heading_rms(&m, &attitudes, |m| calibration.correct(m));
    assert!(after < 1.0, "{after:.2} deg");
}

#[test]
fn sigmas_and_noise_are_those_of_the_readings() {
    let mut squares = State::zeros();
    let mut noise = 0.0;
    for seed in 10..34 {
        let (m, _) = readings(600, Turning::Full, seed);
        let strength = vec![EARTH.norm(); m.len()];
        let start = first_step::first_step(&m, &strength, Kind::Full).unwrap();
        let problem = Problem { readings: &m, strength: &strength, kind: Kind::Full, noise: NOISE, prior: None };
        let refined = problem.refine(&start).unwrap();
        squares += (refined.x - truth()).component_div(&refined.sigma).map(|v| v * v / 24.0);
        noise += quality::noise(&readings(4000, Turning::Tilt(0.0), seed).0) / 24.0;
    }
    // 24 runs of 9 unknowns: the mean of 216 squares of unit variance, 0.76 to 1.24 at 99 % if they were independent.
    let mean = squares.sum() / STATES as f64;
    assert!((0.7..1.35).contains(&mean), "{mean:.2} {squares}");
    assert!((noise - NOISE).abs() < 0.02, "{noise}");
}

#[test]
fn the_scalar_noise_has_the_mean_and_variance_it_states() {
    let mut rng = Rng::new(7);
    let (shape, offset) = (model::shape(&truth()), truth().fixed_rows::<3>(0).into_owned());
    let sigma = 3.0;
    let field = Vector3::new(20.0, -15.0, 30.0);
    let clean = shape.try_inverse().unwrap() * (field + offset);
    let values: Vec<f64> = (0..200_000)
        .map(|_| {
            let m = clean + Vector3::from_fn(|_, _| sigma * rng.normal());
            (m.norm_squared() - field.norm_squared()) - model::scalar(&truth(), &m)
        })
        .collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
    let (stated_mean, stated_variance) = model::scalar_noise(&shape, &field, sigma);
    // The mean has a sigma of 240 / sqrt(200,000) = 0.5.
    assert!((mean - stated_mean).abs() < 2.0 && mean > 20.0, "{mean} {stated_mean}");
    assert!((variance / stated_variance - 1.0).abs() < 0.02, "{variance} {stated_variance}");
}

#[test]
fn a_prior_holds_what_the_readings_do_not_tell() {
    // Half a degree of tilt: all nine unknowns cannot be told apart.
    let (m, _) = readings(400, Turning::Tilt(0.5), 8);
    let strength = vec![EARTH.norm(); m.len()];
    let mut sigma = State::repeat(0.001);
    sigma.fixed_rows_mut::<3>(0).fill(0.1);
    let error = |prior| {
        let problem = Problem { readings: &m, strength: &strength, kind: Kind::Full, noise: NOISE, prior };
        problem.refine(&truth()).map(|r| (r.x - truth()).component_div(&sigma).amax())
    };
    let held = error(Some(Prior { mean: truth(), sigma })).unwrap();
    assert!(held < 3.0, "{held:.1} sigmas of the prior");
    assert!(error(None).is_none_or(|free| free > 10.0), "{:?}", error(None));
}

#[test]
fn drives_that_do_not_allow_a_calibration_are_refused_with_the_figures() {
    let refusal = |m: &[Vector3<f64>], turned: Option<&[f64]>| calibrate(m, &EARTH, turned).result.unwrap_err();
    let (arc, attitudes) = readings(3000, Turning::Arc(60.0), 9);
    let turned: Vec<f64> = attitudes.iter().map(|a| a[2]).collect();
    let found = refusal(&arc, Some(&turned));
    assert!(matches!(found, Refusal::Coverage { sectors: 2, needed: 8 }), "{found}");
    assert_eq!(
        found.to_string(),
        "the drive has readings in 2 of 12 sectors of heading, and at least 8 are needed: drive a full circle or two"
    );
    // Without a gyro an arc must not pass either, whatever the fit makes of it.
    refusal(&arc, None);
    let parked: Vec<Vector3<f64>> = readings(3000, Turning::Tilt(0.0), 9).0.iter().map(|m| m * 1e-3).collect();
    assert!(matches!(refusal(&parked, None), Refusal::TooFew { .. }), "{}", refusal(&parked, None));
    let (mut circle, attitudes) = readings(3000, Turning::Tilt(1.0), 10);
    let turned: Vec<f64> = attitudes
        .iter()
        .scan(0.0, |sum, a| {
            *sum += wrap_angle(a[2] - *sum);
            Some(*sum)
        })
        .collect();
    let weak: Vec<Vector3<f64>> = circle.iter().map(|m| m * 0.1).collect();
    assert!(matches!(refusal(&weak, Some(&turned)), Refusal::Gain { .. }));
    // A magnet that moved half-way.
    circle.iter_mut().skip(1500).for_each(|m| m.x += 25.0);
    let found = refusal(&circle, Some(&turned));
    assert!(matches!(found, Refusal::Changed { change, .. } if (change - 25.0).abs() < 2.0), "{found}");
    // Surroundings that come and go.
    let mut rng = Rng::new(11);
    circle.iter_mut().for_each(|m| *m = *m * 0.7 + Vector3::from_fn(|_, _| 12.0 * rng.normal()));
    let found = refusal(&circle, Some(&turned));
    assert!(matches!(found, Refusal::Residual { .. }), "{found}");
    let blank = vec![Vector3::repeat(f64::NAN); 500];
    assert!(matches!(refusal(&blank, None), Refusal::TooFew { used: 0, .. }));
    assert!(matches!(refusal(&[], Some(&[])), Refusal::Coverage { .. } | Refusal::TooFew { .. }));
}

#[test]
fn a_calibration_is_data_that_survives_a_file_and_corrects_a_drive() {
    let calibration = Calibration::new(Kind::Full, &truth());
    let back = Calibration::from_json(&calibration.to_json(), "c.json").unwrap();
    // The reader of JSON may miss the last bit.
    assert!((back.state() - calibration.state()).amax() < 1e-15 && back.kind == calibration.kind);
    assert!(
        Calibration::from_json("{}", "c.json").unwrap_err().starts_with("c.json: is not a magnetometer calibration")
    );
    let newer = calibration.to_json().replace("\"version\": 1", "\"version\": 2");
    assert!(Calibration::from_json(&newer, "c.json").unwrap_err().contains("version 1, found 2"));
    let (m, _) = readings(3, Turning::Full, 1);
    let mut drive = Drive::default();
    for (k, m) in m.iter().enumerate() {
        drive.mag.push(k as f64, Mag { mag_x: m.x, mag_y: m.y, mag_z: m.z }).unwrap();
    }
    calibration.apply(&mut drive).unwrap();
    let (_, first) = drive.mag.at(0);
    assert!((Vector3::new(first.mag_x, first.mag_y, first.mag_z) - calibration.correct(&m[0])).norm() < 1e-15);
}

#[test]
fn consistency_counts_every_sector_alike() {
    // A long straight that agrees with itself, and the rest of the compass that does not.
    let straight = (0..1000).map(|_| (0.1, 0.0));
    let turns = (1..12).map(|s| (f64::from(s) * FRAC_PI_6 + 0.1, f64::from(s) * FRAC_PI_6));
    let all: Vec<(f64, f64)> = straight.chain(turns).collect();
    let found = consistency(&all);
    assert!(found.plain > 0.95 && found.balanced < 0.05 && found.sectors == 12, "{found:?}");
    let errors = sector_errors(&[(0.1, 0.3), (0.2, 0.5), (3.2, -0.1)], 0.2);
    assert!((errors[0].mean + 0.2).abs() < 1e-12 && errors[0].points == 2 && errors[1].mean.is_nan());
    assert!((errors[6].mean - 0.3).abs() < 1e-12, "heading less course");
}
