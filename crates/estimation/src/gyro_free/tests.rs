use super::calibration::{PAPER_POSES, Pose, calibrate};
use super::*;
use crate::case_log::{Table, shared};
use crate::estimator::run;
use crate::score::score;
use drivescope_drive::channel::Series;
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
