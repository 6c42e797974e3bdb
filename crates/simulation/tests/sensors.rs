//! Sensors against their own data sheet.

use drivescope_simulation::grades::{Grade, ImuGrade};
use drivescope_simulation::motion::Inertial;
use drivescope_simulation::sensors::imu::ImuSensor;
use nalgebra::Vector3;

/// Allan deviation of a column of samples every 0.01 s, for clusters of `n` samples, overlapping.
fn allan(values: &[f64], n: usize) -> f64 {
    let mut sums = vec![0.0];
    for v in values {
        sums.push(sums[sums.len() - 1] + v);
    }
    let mean = |k: usize| (sums[k + n] - sums[k]) / n as f64;
    let count = values.len() - 2 * n + 1;
    ((0..count).map(|k| (mean(k + n) - mean(k)).powi(2)).sum::<f64>() / (2.0 * count as f64)).sqrt()
}

#[test]
fn the_allan_deviation_of_a_resting_sensor_is_the_noise_density_of_its_grade() {
    for grade in drivescope_simulation::grades::GRADES.iter().filter(|g| g.imu.accel_noise > 0.0) {
        let mut sensor = ImuSensor::new(&ImuGrade { vibration: 0.0, ..grade.imu }, 0.01, 5);
        let truth = Inertial { force: Vector3::new(0.0, 0.0, -9.8), rate: Vector3::zeros(), forward_acceleration: 0.0 };
        let samples: Vec<_> = (0..360_000).map(|_| sensor.next(&truth, 0.0, 80.0)).collect();
        for (axis, density) in [
            (samples.iter().map(|s| s.accel_x).collect::<Vec<f64>>(), grade.imu.accel_noise),
            (samples.iter().map(|s| s.accel_z).collect(), grade.imu.accel_noise),
            (samples.iter().map(|s| s.gyro_y).collect(), grade.imu.gyro_noise),
        ] {
            // One hour: 3,600 clusters of 1 s give 1.5 %; quantization adds up to 0.1 %.
            for n in [10, 100] {
                let seconds = n as f64 * 0.01;
                let found = allan(&axis, n) * seconds.sqrt();
                assert!((found / density - 1.0).abs() < 0.1, "{}: {found} against {density}", grade.name);
            }
        }
    }
}

#[test]
fn turn_on_biases_have_the_spread_of_the_grade() {
    let grade = Grade::named("automotive").unwrap();
    let n = 2000;
    let mut squares = 0.0;
    for seed in 0..n {
        squares += ImuSensor::new(&grade.imu, 0.01, seed).accel_bias().x.powi(2) / n as f64;
    }
    // 2,000 draws know a spread to 1.6 %.
    assert!((squares.sqrt() / grade.imu.accel_bias - 1.0).abs() < 0.065, "{}", squares.sqrt());
}
