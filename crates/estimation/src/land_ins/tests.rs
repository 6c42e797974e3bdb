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
            assert!(worst <= 1.0, "{name} {ours}: {worst} times 1e-6 relative + 1e-5");
        }
        let outage = without_fixes(&drive, 45.0, 74.9);
        let satellites = estimate_of(&outage, &LandInsParams { gnss: true, ..params });
        for (ours, theirs) in [("north", "gn"), ("east", "ge"), ("down", "gd")] {
            let worst = worst(&satellites, ours, expected.column(theirs));
            assert!(worst <= 1.0, "{name} with satellites {ours}: {worst} times 1e-6 relative + 1e-5");
        }
    }
}

/// Root mean square and largest horizontal distance from the truth, m.
fn horizontal(series: &Series, drive: &Drive) -> [f64; 2] {
    let position = crate::score::score(series, drive, None).position.unwrap();
    [position.rmse_horizontal, position.max]
}

/// Section 4: root mean square and largest horizontal error of each variant, m. The plain integration's numbers are chance
/// (alignment noise), but the reference's own, to the digit.
#[test]
fn position_errors_of_every_variant_are_the_specifications() {
    type Line = [[f64; 2]; 7];
    let lines: [Line; 3] = [
        [[563.9, 1647.4], [471.8, 1407.8], [24.1, 67.5], [22.6, 63.6], [5.2, 9.3], [25.2, 119.5], [3.0, 14.6]],
        [[37.7, 68.6], [281.4, 757.7], [24.8, 70.9], [25.1, 74.1], [10.8, 20.5], [20.6, 86.7], [6.4, 29.1]],
        [[1163.7, 2757.0], [14.1, 54.6], [6.3, 34.1], [6.6, 33.1], [2.4, 5.5], [8.8, 44.3], [0.9, 3.2]],
    ];
    for (name, wanted) in CASES.into_iter().zip(lines) {
        let Some((drive, _, initial_yaw)) = case(name) else { return };
        let outage = without_fixes(&drive, 45.0, 74.9);
        let all = LandInsParams { initial_yaw, ..LandInsParams::default() };
        let plain = LandInsParams { zupt: false, zaru: false, nhc: false, straight: false, ..all.clone() };
        let stops = LandInsParams { zupt: true, zaru: true, ..plain.clone() };
        let variants = [
            ("plain", &drive, plain.clone()),
            ("zupt, zaru", &drive, stops.clone()),
            ("zupt, zaru, nhc", &drive, LandInsParams { nhc: true, ..stops }),
            ("all modes", &drive, all.clone()),
            ("all modes, wheel", &drive, LandInsParams { wheel: true, ..all.clone() }),
            ("satellites", &outage, LandInsParams { gnss: true, ..plain }),
            ("satellites, all modes", &outage, LandInsParams { gnss: true, ..all }),
        ];
        for ((variant, drive, params), wanted) in variants.into_iter().zip(wanted) {
            let found = horizontal(&estimate_of(drive, &params), drive);
            // Half a unit of the last printed digit.
            let is_same = found.iter().zip(wanted).all(|(a, b)| (a - b).abs() <= 0.0501);
            assert!(is_same, "{name} {variant}: {found:?}, specification {wanted:?}");
        }
    }
}
