//! Consistency over seeds: with sensors that err exactly as a filter believes, its innovations are as large as it says.
//!
//! Truth comes from a kinematic signal generator that calls no model of a filter. A failure means a sign error in a
//! Jacobian, a missing or doubled noise term, or a measurement that is used twice.
#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_drive::frames::body_to_nav;
use drivescope_drive::signals::{Baro, Gnss, Imu, Mag, Steering, Wheels};
use drivescope_estimation::chi_square::quantile;
use drivescope_estimation::registry::run_by_name;
use nalgebra::Vector3;
use serde_json::{Value, json};

const STANDARD_GRAVITY: f64 = 9.80665;
const SEEDS: u64 = 24;

/// Normal numbers from SplitMix64 by the sum of twelve uniforms: exact to the third moment, bounded at 6 sigma.
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

/// A car on a straight road whose grade walks with distance as the grade filter believes, speed changing smoothly.
fn graded_road(seed: u64) -> Drive {
    let mut noise = Noise(seed);
    let mut drive = Drive::default();
    let (dt, mut grade, mut altitude) = (0.01, 0.0f64, 0.0);
    let (mut speed, mut pitch, mut pitch_rate) = (15.0f64, 0.0f64, 0.0f64);
    for k in 0..12_000 {
        let t = f64::from(k) * dt;
        let acceleration = 1.2 * (0.35 * t).sin();
        let felt = acceleration + STANDARD_GRAVITY * (grade + pitch).sin();
        let wheels = Wheels { speed: speed + noise.normal(0.06), ..Wheels::default() };
        let imu = Imu {
            accel_x: felt + noise.normal(0.05),
            accel_y: noise.normal(0.05),
            accel_z: -STANDARD_GRAVITY,
            gyro_z: noise.normal(0.006),
            ..Imu::default()
        };
        drive.imu.push(t, imu).unwrap();
        drive.wheels.push(t, wheels).unwrap();
        drive.steering.push(t, Steering { steer: 0.0, ..Steering::default() }).unwrap();
        if k % 10 == 5 {
            drive.baro.push(t, Baro { altitude: altitude + noise.normal(0.30) }).unwrap();
            let v_down = -speed * grade.sin() + noise.normal(0.12);
            drive.gnss.push(t, Gnss { v_down, ..Gnss::default() }).unwrap();
        }
        grade += noise.normal((0.01f64.powi(2) * speed * dt).sqrt());
        grade = grade.clamp(-0.25, 0.25);
        pitch_rate += (-8.3f64.powi(2) * pitch - 2.0 * 0.3 * 8.3 * pitch_rate + 8.3f64.powi(2) * 0.005 * felt) * dt
            + noise.normal(0.02 * dt.sqrt());
        pitch += pitch_rate * dt;
        altitude += speed * grade.sin() * dt + noise.normal(0.03 * dt.sqrt());
        speed += acceleration * dt + noise.normal(0.05 * dt.sqrt());
    }
    drive
}

/// Mean of a statistic over all rows and seeds, per degree of freedom.
fn mean_nis(drives: impl Iterator<Item = Drive>, estimator: &str, params: &Value, column: &str, dof: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for drive in drives {
        let run = run_by_name(estimator, &drive, params, None).unwrap();
        let skip = run.series().time().partition_point(|&t| t < 10.0);
        for v in run.series().column(column).unwrap()[skip..].iter().filter(|v| v.is_finite()) {
            sum += v;
            count += 1;
        }
    }
    assert!(count > 1000, "{estimator} {column}: {count} innovations");
    sum / count as f64 / dof
}

#[test]
fn the_grade_filters_aids_are_as_noisy_as_it_believes() {
    // 24 seeds of 120 s: 27,600 innovations a sensor. The 99.9 % band of their mean is 1 +- 0.028; the filter's input u has
    // noise of its own (the force filter's lag) that the model does not know, so that the band here is 1 +- 0.1: a doubled or
    // forgotten noise term moves the mean by 0.5 or more.
    for (column, sigma) in [("baro_nis", "baro"), ("gnss_nis", "gnss")] {
        let mean = mean_nis((0..SEEDS).map(graded_road), "slope", &Value::Null, column, 1.0);
        assert!((mean - 1.0).abs() < 0.1, "{sigma}: mean NIS {mean:.3}");
    }
}

/// A parked car with a magnetometer, level or leaning, with exactly the noise the orientation filter is told.
fn parked(seed: u64, roll: f64, sigma: f64) -> Drive {
    let mut noise = Noise(seed ^ 0x5eed);
    let mut drive = Drive::default();
    let to_body = body_to_nav(roll, 0.0, 0.7).transpose();
    let field = to_body * Vector3::new(30.1124, -4.2270, 40.1258);
    let force = to_body * Vector3::new(0.0, 0.0, -STANDARD_GRAVITY);
    for k in 0..6000 {
        let t = f64::from(k) * 0.01;
        let imu = Imu { accel_x: force.x, accel_y: force.y, accel_z: force.z, gyro_x: 0.0, gyro_y: 0.0, gyro_z: 0.0 };
        drive.imu.push(t, imu).unwrap();
        drive.wheels.push(t, Wheels { speed: 0.0, ..Wheels::default() }).unwrap();
        let mut axis = |v: f64| v + noise.normal(sigma);
        let mag = Mag { mag_x: axis(field.x), mag_y: axis(field.y), mag_z: axis(field.z) };
        drive.mag.push(t, mag).unwrap();
    }
    drive
}

#[test]
fn the_orientation_filter_is_consistent_on_the_flat_road_it_assumes() {
    // 24 seeds of 60 s: 24 x 5000 innovations of 3 degrees. The process noise is there for manoeuvres, so that a parked car's
    // innovations are slightly smaller than stated; a wrong sigma moves the mean by its square.
    let mean = mean_nis(
        (0..SEEDS).map(|s| parked(s, 0.0, 0.6)),
        "orientation",
        &json!({"variant": "ekf_model"}),
        "field_nis",
        3.0,
    );
    assert!((0.8..=1.02).contains(&mean), "mean NIS per degree {mean:.3}");
    let doubled = mean_nis(
        (0..2).map(|s| parked(s, 0.0, 1.2)),
        "orientation",
        &json!({"variant": "ekf_model"}),
        "field_nis",
        3.0,
    );
    assert!(doubled > 2.5, "noise twice as large as stated must show: {doubled:.3}");
}

#[test]
fn chi_square_bands_of_many_innovations_close_on_one() {
    let band = |n: f64| (quantile(0.025, n) / n, quantile(0.975, n) / n);
    let (low, high) = band(10_000.0);
    assert!((low - 0.9725).abs() < 1e-3 && (high - 1.0279).abs() < 1e-3, "{low} {high}");
}
