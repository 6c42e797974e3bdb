use super::calibration::{PAPER_POSES, Pose, calibrate};
use super::*;
use crate::case_log::{Table, shared};
use crate::estimator::run;
use crate::score::score;
use drivescope_drive::channel::{Channel, Series};
use drivescope_drive::disk::Disk;
use drivescope_drive::drive::Drive;
use drivescope_drive::signals::{AccelArray, Imu};

/// The specification's drive with the disk, calibrated by its four poses.
fn case() -> Option<(Drive, Table)> {
    let log = shared("spec/motion/c2_u_6acc1gyro.csv.gz")?;
    let expected = Table::read(&shared("spec/motion/expected/c2_u_6acc1gyro.csv.gz")?);
    let table = Table::read(&shared("spec/motion/expected/disk_calibration.csv.gz")?);
    let mean = |k: usize| std::array::from_fn(|i| table.column(&format!("y_pose{}", k + 1))[i]);
    let poses = [0, 1, 2, 3].map(|k: usize| Pose { force: PAPER_POSES[k], mean: mean(k) });
    let mut drive = Table::read(&log).drive();
    drive.disk = Some(calibrate(&Disk::default(), &poses).unwrap().disk);
    Some((drive, expected))
}

fn estimate_of(drive: &Drive, params: &GyroFreeParams) -> Series {
    run::<GyroFree>(drive, params, None).unwrap().into_series()
}

/// Largest departure from the reference's kept rows (every tenth), in units of `relative |reference| + absolute`.
fn worst(series: &Series, ours: &str, expected: &[f64], relative: f64, absolute: f64) -> f64 {
    let kept: Vec<f64> = series.column(ours).unwrap().iter().step_by(10).copied().collect();
    assert_eq!(kept.len(), expected.len());
    kept.iter().zip(expected).map(|(a, b)| (a - b).abs() / (relative * b.abs() + absolute)).fold(0.0, f64::max)
}

#[test]
fn force_angular_acceleration_rates_and_modes_are_those_of_the_reference() {
    let Some((drive, expected)) = case() else { return };
    let adaptive = estimate_of(&drive, &GyroFreeParams::default());
    for (ours, theirs) in [
        ("force_x", "fx"),
        ("force_y", "fy"),
        ("force_z", "fz"),
        ("angular_accel_x", "alx"),
        ("angular_accel_y", "aly"),
        ("angular_accel_z", "alz"),
        ("rate_x", "wx"),
        ("rate_y", "wy"),
        ("rate_z", "wz"),
        ("gyro_bias", "bg"),
    ] {
        let worst = worst(&adaptive, ours, expected.column(theirs), 0.0, 1e-6);
        assert!(worst <= 1.0, "{ours}: {worst} times 1e-6");
    }
    for name in ["jd", "td", "fd", "yd"] {
        let worst = worst(&adaptive, name, expected.column(name), 1e-8, 1e-9);
        assert!(worst <= 1.0, "{name}: {worst} times the tolerance");
    }
    assert_eq!(worst(&adaptive, "mode", expected.column("mode_adaptive"), 0.0, 1.0), 0.0);
}

/// The reference's way to the fixed thresholds: they decide what the chain with adaptive ones reads, and feed nothing back.
fn fixed_modes(drive: &Drive) -> Series {
    let start = drive.start();
    let mut chain = GyroFree::new(&GyroFreeParams::default(), &VehicleParams::default(), &start);
    let fixed = MotionModeParams { adaptive: false, use_speed: false, ..MotionModeParams::default() };
    let mut detector = MotionModeDetector::new(&fixed, &VehicleParams::default(), &start);
    let mut modes = Channel::<MotionModeEstimate>::default();
    for epoch in drive.epochs() {
        if chain.step(&epoch).unwrap().is_none() {
            continue;
        }
        let ([accel_x, accel_y, accel_z], [gyro_x, gyro_y, gyro_z]) =
            (chain.detector.mode_row().force, chain.detector.mode_row().rate);
        let imu = Imu { accel_x, accel_y, accel_z, gyro_x, gyro_y, gyro_z };
        let row = Epoch { time: epoch.time, imu: Some(imu), ..Epoch::default() };
        modes.push(epoch.time, detector.step(&row).unwrap().unwrap()).unwrap();
    }
    modes.into_series()
}

#[test]
fn fixed_thresholds_decide_as_the_reference() {
    let Some((drive, expected)) = case() else { return };
    assert_eq!(worst(&fixed_modes(&drive), "mode", expected.column("mode"), 0.0, 1.0), 0.0);
}

/// Section 4: accuracy, with guard, launch, stop (mean and longest), corner entry and exit of the drive with the disk.
#[test]
fn modes_from_the_disk_are_as_good_as_the_specifications() {
    let Some((calibrated, _)) = case() else { return };
    let drawn = Drive { disk: None, ..calibrated.clone() };
    let adaptive = |drive: &Drive| estimate_of(drive, &GyroFreeParams::default());
    let lines = [
        ("default", fixed_modes(&calibrated), [0.9775, 0.9975], [0.09, 0.34, 0.28, 0.30]),
        ("adaptive", adaptive(&calibrated), [0.9784, 0.9990], [0.01, 0.47, 0.28, 0.30]),
        ("adaptive, uncalibrated", adaptive(&drawn), [0.9792, 0.9998], [0.01, 0.47, 0.28, 0.30]),
    ];
    for (name, series, [accuracy, guarded], latencies) in lines {
        let m = score(&series, &calibrated, None).mode.unwrap();
        // Half a unit of the last printed digit, and rounding of ties.
        assert!((m.accuracy - accuracy).abs() <= 5.001e-5, "{name} {m:?}");
        assert!((m.accuracy_guarded - guarded).abs() <= 5.001e-5, "{name} {m:?}");
        let found = [m.launch.mean, m.stop.mean, m.corner_entry.mean, m.corner_exit.mean];
        assert!(found.iter().zip(latencies).all(|(a, b)| (a - b).abs() <= 5.001e-3), "{name} {found:?}");
    }
}

/// Root mean square error and error at the end of three columns against the true rates, rad/s.
fn rate_errors(series: &Series, drive: &Drive, columns: [&str; 3]) -> [[f64; 2]; 3] {
    std::array::from_fn(|k| {
        let truth = drive.truth.column(["gyro_x", "gyro_y", "gyro_z"][k]).unwrap();
        let errors: Vec<f64> = series.column(columns[k]).unwrap().iter().zip(truth).map(|(a, b)| a - b).collect();
        let square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        [square.sqrt(), errors[errors.len() - 1]]
    })
}

/// Section 4, the table of figure 6: root mean square and error at the end, x, y, z.
#[test]
fn rates_are_held_where_plain_integration_drifts() {
    let Some((drive, _)) = case() else { return };
    let filtered = ["rate_x", "rate_y", "rate_z"];
    let plain = ["plain_rate_x", "plain_rate_y", "plain_rate_z"];
    let full = GyroFreeParams::default;
    let lines = [
        ("plain", plain, full(), [[0.2192, -0.371], [0.1074, -0.166], [0.2774, -0.442]]),
        ("filter", filtered, full(), [[0.0072, 0.0], [0.0079, 0.0], [0.0090, -0.001]]),
        (
            "without gyro",
            filtered,
            GyroFreeParams { use_gyro: false, ..full() },
            [[0.0072, 0.0], [0.0079, 0.0], [0.0475, 0.0]],
        ),
        (
            "without zero references",
            filtered,
            GyroFreeParams { zero_reference: false, ..full() },
            [[0.1092, -0.088], [0.1480, 0.215], [0.0122, 0.005]],
        ),
    ];
    for (name, columns, params, wanted) in lines {
        let found = rate_errors(&estimate_of(&drive, &params), &drive, columns);
        for (axis, (found, wanted)) in found.iter().zip(wanted).enumerate() {
            // Half a unit of the last printed digits.
            assert!((found[0] - wanted[0]).abs() <= 5.001e-5, "{name}, axis {axis}: {found:?} {wanted:?}");
            assert!((found[1] - wanted[1]).abs() <= 5.001e-4, "{name}, axis {axis}: {found:?} {wanted:?}");
        }
    }
}

/// A resting disk: readings of gravity with a little noise.
fn resting(k: usize) -> AccelArray {
    let noise = |n: f64| 0.01 * (k as f64 * n).sin();
    AccelArray {
        acc6_1: noise(1.1),
        acc6_2: noise(1.7),
        acc6_3: noise(2.3),
        acc6_4: -9.8 + noise(2.9),
        acc6_5: -9.8 + noise(3.1),
        acc6_6: -9.8 + noise(3.7),
    }
}

#[test]
fn a_row_with_a_sensor_that_is_missing_moves_time_and_keeps_the_force() {
    let start = Drive::default().start();
    let mut estimator = GyroFree::new(&GyroFreeParams::default(), &VehicleParams::default(), &start);
    let mut step = |k: usize, readings: AccelArray| {
        let imu = Imu { gyro_z: 0.002, ..Imu::default() };
        let epoch = Epoch { time: k as f64 * 0.01, accel_array: Some(readings), imu: Some(imu), ..Epoch::default() };
        estimator.step(&epoch).unwrap().unwrap()
    };
    let before = (0..600).map(|k| step(k, resting(k))).last().unwrap();
    let during = (600..700).map(|k| step(k, AccelArray { acc6_3: f64::NAN, ..resting(k) })).last().unwrap();
    assert_eq!((during.force_x, during.force_z), (before.force_x, before.force_z));
    assert!(during.rate_x.abs() < 1e-3 && (during.gyro_bias - 0.002).abs() < 1e-3 && during.mode == 0.0);
    let after = step(700, resting(700));
    assert!((after.force_z + 9.8).abs() < 0.02 && after.force_z != before.force_z);
}

#[test]
fn a_disk_without_arms_is_refused_in_words() {
    let start = LogStart { disk: Some(Disk::drawn(0.0)), ..Drive::default().start() };
    let mut estimator = GyroFree::new(&GyroFreeParams::default(), &VehicleParams::default(), &start);
    let epoch = Epoch { time: 0.0, accel_array: Some(resting(0)), ..Epoch::default() };
    assert_eq!(estimator.step(&epoch).unwrap(), None);
    assert_eq!(estimator.notices().list().len(), 1);
}
