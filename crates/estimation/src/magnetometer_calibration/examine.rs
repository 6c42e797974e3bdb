//! A whole drive's magnetometer examined: its calibration, and what the GNSS course says of it before and after.

use drivescope_drive::channel::{Channel, OutOfOrder, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::select::median;
use nalgebra::Vector3;

use super::course::{
    ClockOffset, Consistency, SectorError, Track, clock_offset, consistency, course_points, differences, mount_yaw,
    rms, sector_errors,
};
use super::quality::{Quality, Refusal, SECTORS};
use super::{Calibration, calibrate};

/// A clock offset found no better than this is not used, s.
const LOOSEST_CLOCK: f64 = 0.5;
/// Consistency below which a magnetometer needs calibrating.
const LEAST_CONSISTENCY: f64 = 0.95;
/// Consistency that a calibrated heading must reach: 0.9 is 26 deg of scatter.
const NEEDED_CONSISTENCY: f64 = 0.9;
/// Sectors of course from which the consistency says something.
const JUDGED_SECTORS: usize = 6;
/// Deviation of the raw strength from the Earth's, in parts of it, from which a magnetometer needs calibrating.
const LARGEST_DEVIATION: f64 = 0.1;

/// The heading of a magnetometer held against the GNSS course.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct AgainstCourse {
    /// How well they agree, whatever constant lies between.
    pub consistency: Consistency,
    /// The constant: how far the sensor's forward axis is left of the car's, rad; 0 is mounted straight, pi backwards.
    pub mount_yaw: f64,
    /// Root mean square of what remains, rad.
    pub rms: f64,
    /// What remains by 30 deg sector of course.
    pub sectors: [SectorError; SECTORS],
}

/// What a drive says of its magnetometer.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Examination {
    /// The Earth's field that it is held against: north, east, down, uT.
    pub earth: [f64; 3],
    /// What the readings are like.
    pub quality: Quality,
    /// The calibration, if the drive allows one.
    pub calibration: Option<Calibration>,
    /// Why there is none.
    pub refusal: Option<Refusal>,
    /// The same as a sentence.
    pub refusal_text: Option<String>,
    /// The receiver's clock against the sensors', where turns tell it.
    pub clock: Option<ClockOffset>,
    /// Raw heading against the course; `None` without courses.
    pub before: Option<AgainstCourse>,
    /// Calibrated heading against the course; also where that is why the calibration is refused.
    pub after: Option<AgainstCourse>,
    /// A sentence where the magnetometer should be calibrated before its heading is believed.
    pub warning: Option<String>,
}

impl Examination {
    /// The clock offset to use, s: the one found if it is tight, else 0.
    pub fn clock_offset(&self) -> f64 {
        self.clock.filter(|c| c.sigma <= LOOSEST_CLOCK).map_or(0.0, |c| c.offset)
    }
}

/// Points of a drive's magnetometer for a picture, sensor axes, uT.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Scatter {
    /// Readings: forward, right, down.
    pub raw: [Vec<f64>; 3],
    /// The same readings calibrated.
    pub calibrated: [Vec<f64>; 3],
    /// The fitted ellipse among the readings, a closed line: forward, right.
    pub ellipse: [Vec<f64>; 2],
    /// Radius of the circle that calibrated readings should lie on, uT.
    pub radius: f64,
}

impl Scatter {
    /// At most about `most` points of a drive, with the ellipse of a calibration if there is one.
    pub fn of(drive: &Drive, calibration: Option<&Calibration>, earth: &Vector3<f64>, most: usize) -> Self {
        let mut scatter = Self { radius: earth.xy().norm(), ..Self::default() };
        let stride = drive.mag.len().div_ceil(most.max(1)).max(1);
        for m in readings(drive).iter().step_by(stride) {
            (0..3).for_each(|axis| scatter.raw[axis].push(m[axis]));
            if let Some(c) = calibration {
                let b = c.correct(m);
                (0..3).for_each(|axis| scatter.calibrated[axis].push(b[axis]));
            }
        }
        let inverse = calibration.and_then(|c| Some((c, super::shape(&c.state()).try_inverse()?)));
        if let Some((c, inverse)) = inverse {
            for k in 0..=120 {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 120.0).sin_cos();
                let field = Vector3::new(scatter.radius * cos, scatter.radius * sin, earth.z);
                let m = inverse * (field + Vector3::from(c.offset));
                scatter.ellipse[0].push(m.x);
                scatter.ellipse[1].push(m.y);
            }
        }
        scatter
    }
}

/// The columns of a channel.
pub(super) fn columns(series: &Series) -> Vec<Vec<f64>> {
    (0..series.schema().len()).map(|i| series.column_at(i).to_vec()).collect()
}

/// The magnetometer's readings, sensor axes, uT.
pub(super) fn readings(drive: &Drive) -> Vec<Vector3<f64>> {
    let [x, y, z] = [0, 1, 2].map(|i| drive.mag.series().column_at(i));
    (0..drive.mag.len()).map(|row| Vector3::new(x[row], y[row], z[row])).collect()
}

/// Examine the magnetometer of a drive in the Earth's field (north, east, down; uT) of its place.
///
/// Headings are those of a level sensor: tilt of the car is in the errors.
pub fn examine(drive: &Drive, earth: &Vector3<f64>) -> Examination {
    let gyro = Track::of_gyro(drive);
    let readings = readings(drive);
    // Where the gyro is silent, the turn is taken as held.
    let turned = gyro.as_ref().map(|gyro| {
        let mut last = 0.0;
        let mut turned = Vec::with_capacity(readings.len());
        for &time in drive.mag.time() {
            let angle = gyro.at(time);
            last = if angle.is_finite() { angle } else { last };
            turned.push(last);
        }
        turned
    });
    let outcome = calibrate(&readings, earth, turned.as_deref());
    let points = course_points(drive);
    let clock = gyro.as_ref().and_then(|gyro| clock_offset(&points, gyro));
    let (calibration, refusal) = match outcome.result {
        Ok(calibration) => (Some(calibration), None),
        Err(refusal) => (None, Some(refusal)),
    };
    let mut examination = Examination {
        earth: [earth.x, earth.y, earth.z],
        quality: outcome.quality,
        refusal,
        refusal_text: None,
        clock,
        before: None,
        after: None,
        warning: None,
        calibration,
    };
    let declination = earth.y.atan2(earth.x);
    let offset = examination.clock_offset();
    let against = |calibration: Option<&Calibration>| {
        let mut track = Track::default();
        for (&time, m) in drive.mag.time().iter().zip(&readings) {
            let b = calibration.map_or(*m, |c| c.correct(m));
            track.push_heading(time, (-b.y).atan2(b.x) + declination);
        }
        let differences = differences(&points, &track, offset);
        (!differences.is_empty()).then(|| {
            let mount_yaw = mount_yaw(&differences);
            AgainstCourse {
                consistency: consistency(&differences),
                mount_yaw,
                rms: rms(&differences, mount_yaw),
                sectors: sector_errors(&differences, mount_yaw),
            }
        })
    };
    examination.before = against(None);
    examination.after = examination.calibration.as_ref().and_then(|c| against(Some(c)));
    if let Some(after) = examination.after.as_ref().map(|a| a.consistency)
        && after.sectors >= JUDGED_SECTORS
        && after.balanced < NEEDED_CONSISTENCY
    {
        examination.calibration = None;
        examination.refusal = Some(Refusal::Course { consistency: after.balanced, needed: NEEDED_CONSISTENCY });
    }
    examination.refusal_text = examination.refusal.as_ref().map(ToString::to_string);
    examination.warning = warning(&examination, &readings, earth.norm());
    examination
}

/// Why the magnetometer as it is should not be believed, if it should not.
fn warning(examination: &Examination, readings: &[Vector3<f64>], strength: f64) -> Option<String> {
    if let Some(before) = &examination.before
        && before.consistency.sectors >= JUDGED_SECTORS
    {
        let Consistency { balanced, sectors, .. } = before.consistency;
        return (balanced < LEAST_CONSISTENCY).then(|| {
            format!(
                "The magnetometer needs calibrating: over {sectors} sectors of course its heading agrees with the GNSS course \
                 with a consistency of {balanced:.2} only (1 is full agreement)."
            )
        });
    }
    // The median: iron beside the road is not the car's.
    let mut off: Vec<f64> =
        readings.iter().map(|m| (m.norm() / strength - 1.0).abs()).filter(|v| v.is_finite()).collect();
    let percent = 100.0 * median(&mut off);
    (percent > 100.0 * LARGEST_DEVIATION).then(|| {
        format!(
            "The magnetometer needs calibrating: what it measures differs by {percent:.0} % (median) from the \
             Earth's {strength:.1} uT."
        )
    })
}

/// Turn the sensors of a drive about the vertical by the mount's yaw (rad), so that their forward axis is the car's.
///
/// # Errors
/// None for a drive that was read: its times are in order already.
pub fn turn_sensor(drive: &mut Drive, mount_yaw: f64) -> Result<(), OutOfOrder> {
    let (sin, cos) = mount_yaw.sin_cos();
    // Course = heading of the sensor + mount yaw: the car's axes are the sensor's turned to the right by it.
    let turn = |columns: &mut [Vec<f64>], x: usize, y: usize| {
        for row in 0..columns[x].len() {
            let (a, b) = (columns[x][row], columns[y][row]);
            (columns[x][row], columns[y][row]) = (cos * a + sin * b, cos * b - sin * a);
        }
    };
    let mut imu = columns(drive.imu.series());
    turn(&mut imu, 0, 1);
    turn(&mut imu, 3, 4);
    let mut mag = columns(drive.mag.series());
    turn(&mut mag, 0, 1);
    drive.imu = Channel::from_columns(drive.imu.time().to_vec(), imu)?;
    drive.mag = Channel::from_columns(drive.mag.time().to_vec(), mag)?;
    Ok(())
}

/// Set the receiver's clock right: add a clock offset (s) to the times of its fixes.
///
/// # Errors
/// None for a drive that was read and an offset that is finite.
pub fn shift_gnss(drive: &mut Drive, offset: f64) -> Result<(), OutOfOrder> {
    let time = drive.gnss.time().iter().map(|t| t + offset).collect();
    drive.gnss = Channel::from_columns(time, columns(drive.gnss.series()))?;
    Ok(())
}
