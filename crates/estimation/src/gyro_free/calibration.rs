//! Axes, scales and biases of the disk's accelerometers from rests in several poses.
//!
//! At rest sensor `i` reads `u_i . f + b_i` with the known specific force `f` of the pose: four unknowns, so four poses that
//! do not lie in a plane give them, more give them by least squares. Source: Lee et al. 2010, section 3; SPEC motion 3.2:
//! the paper lists gravity in body axes, specific force is minus that.
//!
//! Observable: for every sensor the direction times the scale, and the bias. Not observable: where the sensors sit (nothing
//! turns), a common rotation of disk and jig (it goes into every axis), errors of the poses, the scale of the yaw gyro (only
//! its bias), temperature, dependence on the force; with four poses there is no residual that could show any of it.

use drivescope_drive::channel::Series;
use drivescope_drive::disk::{Disk, DiskSensor};
use drivescope_drive::drive::Drive;
use drivescope_drive::geodesy::STANDARD_GRAVITY;

use super::geometry::Geometry;
use super::linear::invert;

/// Condition number of the normal equations above which the poses lie in a plane.
const WORST_CONDITION: f64 = 1e6;

/// Specific force of the paper's four poses, body axes, m/s^2: level, nose down, left side down, upside down.
///
/// Minus its gravity vectors `[0 0 g], [g 0 0], [0 -g 0], [0 0 -g]`.
pub const PAPER_POSES: [[f64; 3]; 4] = [
    [0.0, 0.0, -STANDARD_GRAVITY],
    [-STANDARD_GRAVITY, 0.0, 0.0],
    [0.0, STANDARD_GRAVITY, 0.0],
    [0.0, 0.0, STANDARD_GRAVITY],
];

/// A rest of the disk in a known pose.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pose {
    /// Specific force that the pose stands for, body axes, m/s^2.
    pub force: [f64; 3],
    /// Mean readings of the six accelerometers, m/s^2.
    pub mean: [f64; 6],
}

/// A disk found by calibration.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Calibration {
    /// The disk: positions as drawn, axes and biases as found.
    pub disk: Disk,
    /// Root mean square of what the fit leaves, per sensor, m/s^2; `None` with four poses, which leave nothing.
    pub residual: Option<[f64; 6]>,
    /// Sigma of the axis' three components (1) for means that err by 1 m/s^2; multiply by the means' sigma.
    pub axis_sigma: [f64; 3],
    /// The same for the bias, m/s^2.
    pub bias_sigma: f64,
}

/// The poses do not suffice.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
pub enum CalibrationError {
    /// Fewer than four poses, or all in one plane.
    #[error("{poses} poses do not give four unknowns a sensor: four that do not lie in one plane are needed")]
    TooFewPoses {
        /// How many there were.
        poses: usize,
    },
    /// A mean is not a number.
    #[error("pose {pose} has a reading that is not a number")]
    NotANumber {
        /// Which pose, from 1.
        pose: usize,
    },
}

/// Find axes, scales and biases of a disk whose sensors sit where `drawing` has them.
///
/// # Errors
/// [`CalibrationError`] when the poses do not determine four numbers a sensor.
pub fn calibrate(drawing: &Disk, poses: &[Pose]) -> Result<Calibration, CalibrationError> {
    if let Some(bad) = poses.iter().position(|p| !p.mean.iter().chain(&p.force).all(|v| v.is_finite())) {
        return Err(CalibrationError::NotANumber { pose: bad + 1 });
    }
    // Columns of force divided by g, so that rank and condition do not depend on the unit.
    let row = |p: &Pose| [p.force[0], p.force[1], p.force[2], STANDARD_GRAVITY].map(|v| v / STANDARD_GRAVITY);
    let mut normal = [[0.0; 4]; 4];
    for a in poses.iter().map(row) {
        for (i, line) in normal.iter_mut().enumerate() {
            line.iter_mut().zip(a).for_each(|(n, v)| *n += a[i] * v);
        }
    }
    let too_few = CalibrationError::TooFewPoses { poses: poses.len() };
    let found = invert(&normal).filter(|i| i.condition < WORST_CONDITION && poses.len() >= 4).ok_or(too_few)?;
    let solve = |sensor: usize| -> [f64; 4] {
        let mut right = [0.0; 4];
        for p in poses {
            right.iter_mut().zip(row(p)).for_each(|(r, a)| *r += a * p.mean[sensor]);
        }
        found.inverse.map(|line| line.iter().zip(right).map(|(m, r)| m * r).sum())
    };
    let solutions: [[f64; 4]; 6] = std::array::from_fn(solve);
    let sensors = std::array::from_fn(|i| DiskSensor {
        position: drawing.sensors[i].position,
        axis: [0, 1, 2].map(|k| solutions[i][k] / STANDARD_GRAVITY),
        bias: solutions[i][3],
    });
    let residual = (poses.len() > 4).then(|| {
        std::array::from_fn(|i| {
            let error = |p: &Pose| p.mean[i] - row(p).iter().zip(solutions[i]).map(|(a, x)| a * x).sum::<f64>();
            (poses.iter().map(|p| error(p).powi(2)).sum::<f64>() / (poses.len() - 4) as f64).sqrt()
        })
    });
    Ok(Calibration {
        disk: Disk { sensors },
        residual,
        axis_sigma: [0, 1, 2].map(|k| found.inverse[k][k].sqrt() / STANDARD_GRAVITY),
        bias_sigma: found.inverse[3][3].sqrt(),
    })
}

/// A stretch of a log in which the disk lay still.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Rest {
    /// First and last instant, s.
    pub span: (f64, f64),
    /// Mean readings of the six accelerometers, m/s^2.
    pub mean: [f64; 6],
    /// Sigma of a single reading, the largest of the six, m/s^2.
    pub spread: f64,
    /// Specific force that it shows if the disk were as drawn, body axes, m/s^2.
    pub force: [f64; 3],
    /// The pose meant, probably: that specific force turned to the nearest axis and made as large as gravity.
    pub pose: [f64; 3],
}

/// Length of a piece that is looked at as a whole, s.
const PIECE: f64 = 0.25;
/// Largest spread of a reading inside a piece at rest, and largest step of its mean to the next, m/s^2.
const STILL: f64 = 0.2;
const SAME: f64 = 0.15;

/// Every stretch of at least `shortest` s in which the disk lay still, its pose guessed from the `drawing`.
///
/// Its ends are cut by a quarter of a second, in which a hand may still be at the disk.
pub fn rests(drive: &Drive, drawing: &Disk, shortest: f64) -> Vec<Rest> {
    let series = drive.accel_array.series();
    let Ok(geometry) = Geometry::new(drawing) else { return Vec::new() };
    let pieces = pieces(series);
    let mut found = Vec::new();
    let mut first = 0;
    for k in 0..=pieces.len() {
        let goes_on = k > first
            && k < pieces.len()
            && pieces[k].is_still()
            && (0..6).all(|i| (pieces[k].mean[i] - pieces[k - 1].mean[i]).abs() < SAME);
        if goes_on {
            continue;
        }
        // The pieces at both ends are left out.
        if k >= first + 3 && pieces[k - 2].end - pieces[first + 1].begin >= shortest {
            found.push(rest(&pieces[first + 1..k - 1], &geometry));
        }
        first = if k < pieces.len() && !pieces[k].is_still() { k + 1 } else { k };
    }
    found
}

/// Means over a quarter of a second.
struct Piece {
    begin: f64,
    end: f64,
    count: f64,
    mean: [f64; 6],
    variance: [f64; 6],
}

impl Piece {
    fn is_still(&self) -> bool {
        self.variance.iter().all(|v| *v < STILL * STILL)
    }
}

fn pieces(series: &Series) -> Vec<Piece> {
    let time = series.time();
    let mut out = Vec::new();
    let mut first = 0;
    while first < time.len() {
        let end = time.partition_point(|&t| t < time[first] + PIECE).max(first + 1);
        let rows: Vec<usize> = (first..end).filter(|&r| (0..6).all(|c| series.column_at(c)[r].is_finite())).collect();
        let count = rows.len() as f64;
        if rows.len() >= 5 {
            let mean = std::array::from_fn(|c| rows.iter().map(|&r| series.column_at(c)[r]).sum::<f64>() / count);
            let square = |c: usize| rows.iter().map(|&r| (series.column_at(c)[r] - mean[c]).powi(2)).sum::<f64>();
            let variance = std::array::from_fn(|c| square(c) / count);
            out.push(Piece { begin: time[first], end: time[end - 1], count, mean, variance });
        }
        first = end;
    }
    out
}

fn rest(pieces: &[Piece], geometry: &Geometry) -> Rest {
    let count: f64 = pieces.iter().map(|p| p.count).sum();
    let mean: [f64; 6] = std::array::from_fn(|i| pieces.iter().map(|p| p.mean[i] * p.count).sum::<f64>() / count);
    let spread = |i: usize| (pieces.iter().map(|p| p.variance[i] * p.count).sum::<f64>() / count).sqrt();
    let force: [f64; 3] = geometry.motion(&mean, &nalgebra::Vector3::zeros()).force.into();
    let axis = (0..3).max_by(|&a, &b| force[a].abs().total_cmp(&force[b].abs())).unwrap_or(2);
    let mut pose = [0.0; 3];
    pose[axis] = STANDARD_GRAVITY.copysign(force[axis]);
    let ends = (pieces.first().map_or(0.0, |p| p.begin), pieces.last().map_or(0.0, |p| p.end));
    Rest { span: ends, mean, spread: (0..6).map(spread).fold(0.0, f64::max), force, pose }
}

/// What calibration by rests cannot find, for people.
pub const NOT_OBSERVABLE: &[&str] = &[
    "where the sensors sit: nothing turns at rest, so the drawing is believed",
    "a common rotation of the disk in its jig: it goes into every axis",
    "errors of the poses themselves: a tilted table tilts the axes",
    "the scale of the yaw gyro: only its bias shows at rest",
    "temperature, and readings that depend on the force itself",
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case_log::{Table, shared};
    use drivescope_drive::signals::AccelArray;
    use nalgebra::Vector3;

    fn leaning() -> Disk {
        let mut disk = Disk::default();
        for (i, s) in disk.sensors.iter_mut().enumerate() {
            s.axis.iter_mut().enumerate().for_each(|(k, u)| *u += 0.01 * ((5 * i + k) as f64).cos());
            s.bias = 0.05 * (i as f64).sin();
        }
        disk
    }

    fn pose(disk: &Disk, force: [f64; 3], geometry: &Geometry) -> Pose {
        let motion = super::super::Motion { force: Vector3::from(force), angular_acceleration: Vector3::zeros() };
        let _ = disk;
        Pose { force, mean: geometry.outputs(&motion, &Vector3::zeros()) }
    }

    fn distance(a: &Disk, b: &Disk) -> f64 {
        let difference = |(a, b): (&DiskSensor, &DiskSensor)| {
            (Vector3::from(a.axis) - Vector3::from(b.axis)).norm().max((a.bias - b.bias).abs())
        };
        a.sensors.iter().zip(&b.sensors).map(difference).fold(0.0, f64::max)
    }

    /// Mixing the signs of gravity and specific force flips every axis; a wrong column mixes them.
    #[test]
    fn four_poses_give_axes_scales_and_biases_exactly_and_the_closed_form() {
        let truth = leaning();
        let geometry = Geometry::new(&truth).unwrap();
        let poses = PAPER_POSES.map(|f| pose(&truth, f, &geometry));
        let found = calibrate(&Disk::default(), &poses).unwrap();
        assert!(distance(&found.disk, &truth) < 1e-13 && found.residual.is_none());
        for (i, s) in found.disk.sensors.iter().enumerate() {
            let y = [0, 1, 2, 3].map(|p: usize| poses[p].mean[i]);
            let bias = 0.5 * (y[0] + y[3]);
            let axis = [
                (bias - y[1]) / STANDARD_GRAVITY,
                (y[2] - bias) / STANDARD_GRAVITY,
                (y[3] - y[0]) / 2.0 / STANDARD_GRAVITY,
            ];
            assert!((s.bias - bias).abs() < 1e-12);
            assert!(s.axis.iter().zip(axis).all(|(a, b)| (a - b).abs() < 1e-13));
        }
        // Section 3.2: sigma(b) = s / sqrt 2, sigma(ux) = s sqrt(1.5) / g.
        assert!((found.bias_sigma - 0.5f64.sqrt()).abs() < 1e-12);
        assert!((found.axis_sigma[0] - 1.5f64.sqrt() / STANDARD_GRAVITY).abs() < 1e-12);
    }

    #[test]
    fn a_tilted_jig_goes_straight_into_the_axes_and_leaves_no_trace() {
        let truth = Disk::default();
        let geometry = Geometry::new(&truth).unwrap();
        let tilt = drivescope_drive::frames::body_to_nav(0.02, -0.01, 0.03);
        let poses = PAPER_POSES.map(|f| {
            let tilted = tilt.transpose() * Vector3::from(f);
            Pose { force: f, ..pose(&truth, tilted.into(), &geometry) }
        });
        let found = calibrate(&truth, &poses).unwrap();
        for (s, t) in found.disk.sensors.iter().zip(&truth.sensors) {
            assert!((Vector3::from(s.axis) - tilt * Vector3::from(t.axis)).norm() < 1e-13);
        }
    }

    #[test]
    fn more_poses_are_a_least_squares_fit_with_a_residual() {
        let truth = leaning();
        let geometry = Geometry::new(&truth).unwrap();
        let directions = [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.6, 0.8, 0.0], [1.0, 0.0, 0.0]];
        let more = directions.map(|d| d.map(|v: f64| v * STANDARD_GRAVITY));
        let mut poses: Vec<Pose> = PAPER_POSES.iter().chain(&more).map(|f| pose(&truth, *f, &geometry)).collect();
        let exact = calibrate(&Disk::default(), &poses).unwrap();
        assert!(distance(&exact.disk, &truth) < 1e-13 && exact.residual.unwrap().iter().all(|r| *r < 1e-12));
        poses[5].mean[2] += 0.1;
        let disturbed = calibrate(&Disk::default(), &poses).unwrap();
        let residual = disturbed.residual.unwrap();
        assert!(residual[2] > 0.02 && residual[1] < 1e-12);
        assert!(distance(&disturbed.disk, &truth) < 0.1, "an error in one of eight poses is shared out");
    }

    #[test]
    fn poses_in_a_plane_or_too_few_or_not_numbers_are_refused() {
        let truth = leaning();
        let geometry = Geometry::new(&truth).unwrap();
        let plane = [[0.0, 0.0, -9.8], [0.0, 0.0, 9.8], [9.8, 0.0, 0.0], [-9.8, 0.0, 0.0], [6.9, 0.0, 6.9]];
        let poses = plane.map(|f| pose(&truth, f, &geometry));
        assert_eq!(calibrate(&truth, &poses), Err(CalibrationError::TooFewPoses { poses: 5 }));
        assert!(calibrate(&truth, &poses[..3]).is_err());
        let mut broken = PAPER_POSES.map(|f| pose(&truth, f, &geometry));
        broken[1].mean[4] = f64::NAN;
        assert_eq!(calibrate(&truth, &broken), Err(CalibrationError::NotANumber { pose: 2 }));
    }

    #[test]
    fn the_specifications_calibration_is_found_again() {
        let Some(path) = shared("spec/motion/expected/disk_calibration.csv.gz") else { return };
        let table = Table::read(&path);
        let poses: Vec<Pose> = (0..4)
            .map(|k| {
                let column = table.column(&format!("y_pose{}", k + 1));
                Pose { force: PAPER_POSES[k], mean: std::array::from_fn(|i| column[i]) }
            })
            .collect();
        let found = calibrate(&Disk::default(), &poses).unwrap().disk;
        for (i, s) in found.sensors.iter().enumerate() {
            for (k, name) in ["rx", "ry", "rz"].into_iter().enumerate() {
                assert!((s.position[k] - table.column(name)[i]).abs() < 1e-11);
            }
            for (k, name) in ["ux", "uy", "uz"].into_iter().enumerate() {
                assert!((s.axis[k] - table.column(name)[i]).abs() < 1e-9, "{name} {i}");
            }
            assert!((s.bias - table.column("b")[i]).abs() < 1e-9);
        }
    }

    /// A log in which a hand turns the disk from pose to pose.
    #[test]
    fn rests_are_found_in_a_log_and_their_poses_guessed() {
        let truth = leaning();
        let geometry = Geometry::new(&truth).unwrap();
        let mut drive = Drive::default();
        for k in 0..3200 {
            let (t, place) = (f64::from(k) * 0.01, k / 800);
            let turning = k % 800 > 600;
            let to = PAPER_POSES[(place as usize + 1) % 4];
            let from = PAPER_POSES[place as usize];
            let share = if turning { f64::from(k % 800 - 600) / 200.0 } else { 0.0 };
            let wave = if turning { (0.3 * f64::from(k)).sin() } else { 0.01 * (1.7 * f64::from(k)).sin() };
            let force = [0, 1, 2].map(|i: usize| from[i] + share * (to[i] - from[i]) + wave);
            let y = pose(&truth, force, &geometry).mean;
            let [acc6_1, acc6_2, acc6_3, acc6_4, acc6_5, acc6_6] = y;
            drive.accel_array.push(t, AccelArray { acc6_1, acc6_2, acc6_3, acc6_4, acc6_5, acc6_6 }).unwrap();
        }
        let rests = rests(&drive, &Disk::default(), 2.0);
        assert_eq!(rests.iter().map(|r| r.pose).collect::<Vec<_>>(), PAPER_POSES, "{rests:?}");
        let poses: Vec<Pose> = rests.iter().map(|r| Pose { force: r.pose, mean: r.mean }).collect();
        // The wave of 0.01 m/s^2 averages out over five seconds.
        assert!(distance(&calibrate(&Disk::default(), &poses).unwrap().disk, &truth) < 1e-3);
    }
}
