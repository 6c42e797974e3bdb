use super::*;
use crate::case_log::{Table, shared};
use crate::estimator::run;
use crate::gyro_free::calibration::{PAPER_POSES, Pose, calibrate};
use drivescope_drive::channel::{Channel, Series};
use drivescope_drive::disk::Disk;

fn estimate_of(drive: &Drive, params: &LandInsParams) -> Series {
    run::<LandIns>(drive, params, None).unwrap().into_series()
}

/// The drive, its reference, and the yaw that it starts with.
fn case(name: &str) -> Option<(Drive, Table, f64)> {
    let expected = Table::read(&shared(&format!("spec/motion/expected/{name}.csv.gz"))?);
    let mut drive = Table::read(&shared(&format!("spec/motion/{name}.csv.gz"))?).drive();
    if name.starts_with("c2") {
        let table = Table::read(&shared("spec/motion/expected/disk_calibration.csv.gz")?);
        let mean = |k: usize| std::array::from_fn(|i| table.column(&format!("y_pose{}", k + 1))[i]);
        let poses = [0, 1, 2, 3].map(|k: usize| Pose { force: PAPER_POSES[k], mean: mean(k) });
        drive.disk = Some(calibrate(&Disk::default(), &poses).unwrap().disk);
    }
    let yaw = drive.truth.column("yaw").unwrap()[0];
    Some((drive, expected, yaw))
}

/// The drive without the fixes of a stretch of time, ends included.
fn without_fixes(drive: &Drive, from: f64, to: f64) -> Drive {
    let mut gnss = Channel::default();
    for (t, fix) in drive.gnss.iter().filter(|(t, _)| *t < from || *t > to) {
        gnss.push(t, fix).unwrap();
    }
    Drive { gnss, ..drive.clone() }
}

const CASES: [&str; 3] = ["c1_u_3acc3gyro", "c2_u_6acc1gyro", "c3_stopgo_3acc3gyro"];

/// Largest departure in units of `1e-6 |reference| + 1e-5`.
fn worst(series: &Series, ours: &str, expected: &[f64]) -> f64 {
    let kept: Vec<f64> = series.column(ours).unwrap().iter().step_by(10).copied().collect();
    assert_eq!(kept.len(), expected.len());
    let difference = |a: f64, b: f64| if ours == "yaw" { drivescope_drive::frames::wrap_angle(a - b) } else { a - b };
    kept.iter().zip(expected).map(|(a, b)| difference(*a, *b).abs() / (1e-6 * b.abs() + 1e-5)).fold(0.0, f64::max)
}

#[test]
fn the_state_is_that_of_the_reference_at_every_kept_row() {
    for name in CASES {
        let Some((drive, expected, initial_yaw)) = case(name) else { return };
        let params = LandInsParams { initial_yaw, ..LandInsParams::default() };
        let series = estimate_of(&drive, &params);
        for (ours, theirs) in [
            ("north", "n"),
            ("east", "e"),
            ("down", "d"),
            ("v_north", "vn"),
            ("v_east", "ve"),
            ("v_down", "vd"),
            ("roll", "roll"),
            ("pitch", "pitch"),
            ("yaw", "yaw"),
            ("gyro_bias_x", "bgx"),
            ("gyro_bias_y", "bgy"),
            ("gyro_bias_z", "bgz"),
            ("accel_bias_x", "bax"),
            ("accel_bias_y", "bay"),
            ("accel_bias_z", "baz"),
        ] {
            let worst = worst(&series, ours, expected.column(theirs));
            println!("{name} {ours} {worst}");
        }
        let satellites = estimate_of(&without_fixes(&drive, 45.0, 75.0), &LandInsParams { gnss: true, ..params });
        for (ours, theirs) in [("north", "gn"), ("east", "ge"), ("down", "gd")] {
            let worst = worst(&satellites, ours, expected.column(theirs));
            println!("{name} with satellites {ours} {worst}");
        }
    }
}
