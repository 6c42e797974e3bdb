//! Calibration of a car's magnetometer: hard and soft iron from the readings of a drive, or the reason why not.
//!
//! A reading `m` stands for the field `B = (I + D) m - b`; see [`model`]. A drive that tilts enough gives all nine
//! unknowns, a car on a plane the five of its horizontal ellipse, and a drive that does not turn none: [`calibrate`]
//! decides and says why. [`examine`] does the same for a whole drive and holds the result against the GNSS course.
//! Source: Crassidis, Lai & Harman 2005, as re-derived and extended in SPEC orientation 7.
//! Not modelled: currents of the car that change, magnets that move, the sensor's own tilt on its mount.

mod along_road;
mod course;
mod examine;
mod first_step;
pub mod model;
mod quality;
mod recursive;
mod refine;
mod small;
#[cfg(test)]
mod tests;

use drivescope_drive::channel::{Channel, OutOfOrder};
use drivescope_drive::drive::Drive;
use drivescope_drive::signals::Mag;
use nalgebra::Vector3;

use self::model::{State, corrected, shape};
use self::refine::Problem;
use self::small::eigen;

pub use self::along_road::{FieldSample, field_along_road};
pub use self::course::{ClockOffset, Consistency, SectorError, consistency, sector_errors};
pub use self::examine::{AgainstCourse, Examination, Scatter, examine, shift_gnss, turn_sensor};
pub use self::quality::{Quality, Refusal, SECTORS};
pub use self::recursive::RecursiveCalibration;
pub use self::refine::Prior;

/// Version of [`Calibration`] as a file.
pub const CALIBRATION_VERSION: u32 = 1;
/// Fewest different readings.
const FEWEST: usize = 50;
/// Fewest sectors of heading.
const FEWEST_SECTORS: usize = 8;
/// Spread from which all nine unknowns are tried.
const FULL_SPREAD: f64 = 0.25;
/// Largest residual in parts of the field: 8 deg RMS of tilt leave 18 % of the horizontal part.
const LARGEST_RESIDUAL: f64 = 0.25;
/// Largest 1-sigma of an offset in parts of the field: 5 % are 3 deg of heading.
const LARGEST_OFFSET_SIGMA: f64 = 0.05;
/// Largest difference between the offsets of the drive's halves in parts of the field: 25 % are 7 deg of heading each way.
const LARGEST_CHANGE: f64 = 0.25;
/// Least noise believed, uT: quantised readings that repeat show none.
const LEAST_NOISE: f64 = 0.05;

/// Which unknowns a calibration has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Three offsets and six distortions, from readings in all attitudes.
    Full,
    /// The horizontal ellipse and the vertical offset, from a car that turned on a plane.
    Planar,
}

/// Hard and soft iron of one magnetometer: data, saved as JSON, applied to a drive before anything is estimated from it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Version of this form.
    pub version: u32,
    /// Which unknowns it has.
    pub kind: Kind,
    /// Offset `b`, uT.
    pub offset: [f64; 3],
    /// Distortion `D11 D22 D33 D12 D13 D23`.
    pub distortion: [f64; 6],
}

impl Calibration {
    fn new(kind: Kind, x: &State) -> Self {
        let distortion = [x[3], x[4], x[5], x[6], x[7], x[8]];
        Self { version: CALIBRATION_VERSION, kind, offset: [x[0], x[1], x[2]], distortion }
    }

    /// The unknowns as a state.
    pub fn state(&self) -> State {
        State::from_iterator(self.offset.into_iter().chain(self.distortion))
    }

    /// The field (uT, body axes of the sensor) that a reading stands for.
    pub fn correct(&self, reading: &Vector3<f64>) -> Vector3<f64> {
        corrected(&self.state(), reading)
    }

    /// Correct every magnetometer reading of a drive; to be done once, on the drive as it was read.
    ///
    /// # Errors
    /// None for a drive that was read: its times are in order already.
    pub fn apply(&self, drive: &mut Drive) -> Result<(), OutOfOrder> {
        let mut corrected = Channel::<Mag>::default();
        corrected.reserve(drive.mag.len());
        for (time, m) in drive.mag.iter() {
            let b = self.correct(&Vector3::new(m.mag_x, m.mag_y, m.mag_z));
            corrected.push(time, Mag { mag_x: b.x, mag_y: b.y, mag_z: b.z })?;
        }
        drive.mag = corrected;
        Ok(())
    }

    /// Read a saved calibration; `file` names it in the error.
    ///
    /// # Errors
    /// One sentence: not JSON, not of this form, another version, a value that is not finite.
    pub fn from_json(text: &str, file: &str) -> Result<Self, String> {
        let calibration: Self =
            serde_json::from_str(text).map_err(|e| format!("{file}: is not a magnetometer calibration: {e}"))?;
        if calibration.version != CALIBRATION_VERSION {
            let found = calibration.version;
            return Err(format!("{file}: expected a calibration of version {CALIBRATION_VERSION}, found {found}"));
        }
        Ok(calibration)
    }

    /// As JSON, for saving.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}

/// A calibration or the reason why there is none, with the figures either way.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// What the readings are like.
    pub quality: Quality,
    /// The calibration or the reason.
    pub result: Result<Calibration, Refusal>,
}

/// Calibrate readings (uT, sensor axes) to the Earth's field at their place (north, east, down; uT).
///
/// `turned` is the heading turned through since the first reading (rad, any constant), from a gyro: it tells how much
/// the car turned; without it the fit itself is asked, and a cloud of noise can look like turning. Full or planar as in
/// SPEC orientation 7, with a departure: all nine unknowns only where they come out tight, else the planar five.
pub fn calibrate(readings: &[Vector3<f64>], earth: &Vector3<f64>, turned: Option<&[f64]>) -> Outcome {
    let noise = quality::noise(readings).max(LEAST_NOISE);
    let mut quality = Quality { samples: readings.len(), noise, ..Quality::default() };
    let kept = quality::different(readings, turned, earth.norm());
    quality.used = kept.len();
    if kept.len() < FEWEST {
        let sectors = turned.map(|t| quality::sectors(t.iter().copied()));
        let result = Err(match sectors {
            Some(sectors) if sectors < FEWEST_SECTORS => Refusal::Coverage { sectors, needed: FEWEST_SECTORS },
            _ => Refusal::TooFew { used: kept.len(), needed: FEWEST },
        });
        quality.sectors = sectors.unwrap_or(0);
        return Outcome { quality, result };
    }
    let readings: Vec<Vector3<f64>> = kept.iter().map(|&i| readings[i]).collect();
    quality.spread = quality::spread(&readings);
    let headings = turned.map(|t| kept.iter().map(|&i| t[i]).collect::<Vec<f64>>());
    let full = (quality.spread >= FULL_SPREAD)
        .then(|| attempt(&readings, earth, headings.as_deref(), Kind::Full, quality))
        .filter(|outcome| outcome.result.is_ok());
    full.unwrap_or_else(|| attempt(&readings, earth, headings.as_deref(), Kind::Planar, quality))
}

/// Fit one kind and judge it.
fn attempt(
    readings: &[Vector3<f64>],
    earth: &Vector3<f64>,
    turned: Option<&[f64]>,
    kind: Kind,
    quality: Quality,
) -> Outcome {
    let mut quality = Quality { kind: Some(kind), ..quality };
    let result = fit(readings, earth, turned, kind, &mut quality);
    Outcome { quality, result }
}

fn fit(
    readings: &[Vector3<f64>],
    earth: &Vector3<f64>,
    turned: Option<&[f64]>,
    kind: Kind,
    quality: &mut Quality,
) -> Result<Calibration, Refusal> {
    let horizontal = earth.xy().norm();
    let (flat, strength) = match kind {
        Kind::Full => (readings.to_vec(), earth.norm()),
        Kind::Planar => (readings.iter().map(|m| Vector3::new(m.x, m.y, 0.0)).collect(), horizontal),
    };
    if let Some(turned) = turned {
        check_sectors(turned.iter().copied(), quality)?;
    }
    let strengths = vec![strength; flat.len()];
    let start = first_step::first_step(&flat, &strengths, kind).ok_or(Refusal::NoEllipse)?;
    let problem = Problem { readings: &flat, strength: &strengths, kind, noise: quality.noise, prior: None };
    let refined = problem.refine(&start).ok_or(Refusal::NoEllipse)?;
    let mut x = refined.x;
    if turned.is_none() {
        check_sectors(flat.iter().map(|m| corrected(&x, m)).map(|b| (-b.y).atan2(b.x)), quality)?;
    }
    quality.residual = refined.residual;
    quality.residual_relative = refined.residual / strength;
    quality.offset_sigma = refined.sigma.fixed_rows::<3>(0).max();
    quality.gain = gain(&x, kind);
    quality.change = change_between_halves(&problem, turned, &start);
    judge(quality, strength)?;
    if kind == Kind::Planar {
        x[2] = readings.iter().map(|m| m.z).sum::<f64>() / readings.len() as f64 - earth.z;
    }
    Ok(Calibration::new(kind, &x))
}

/// Distance between the centres of the readings of the drive's two halves, uT; 0 where a half does not tell.
fn change_between_halves(whole: &Problem<'_>, turned: Option<&[f64]>, start: &State) -> f64 {
    let middle = whole.readings.len() / 2;
    let centre = |from: usize, to: usize| {
        let covered = turned.is_none_or(|t| quality::sectors(t[from..to].iter().copied()) >= FEWEST_SECTORS);
        let (readings, strength) = (&whole.readings[from..to], &whole.strength[from..to]);
        let problem = Problem { readings, strength, ..*whole };
        let refined = problem.refine(start).filter(|_| covered && readings.len() >= FEWEST)?;
        let x = refined.x;
        let is_loose = refined.sigma.fixed_rows::<3>(0).max() > LARGEST_OFFSET_SIGMA * strength[0];
        let centre = shape(&x).try_inverse()? * x.fixed_rows::<3>(0);
        (!is_loose).then_some(centre)
    };
    match (centre(0, middle), centre(middle, whole.readings.len())) {
        (Some(first), Some(second)) => (second - first).norm(),
        _ => 0.0,
    }
}

fn check_sectors(headings: impl Iterator<Item = f64>, quality: &mut Quality) -> Result<(), Refusal> {
    quality.sectors = quality::sectors(headings);
    if quality.sectors < FEWEST_SECTORS {
        return Err(Refusal::Coverage { sectors: quality.sectors, needed: FEWEST_SECTORS });
    }
    Ok(())
}

/// What the sensor reads of the Earth's strength along its weakest and strongest axis.
fn gain(x: &State, kind: Kind) -> [f64; 2] {
    let axes = eigen(&shape(x)).0;
    let gains = axes.map(|a| 1.0 / a);
    // A planar shape is 1 along the third axis, which is the third eigenvector.
    if kind == Kind::Planar { [gains.x.min(gains.y), gains.x.max(gains.y)] } else { [gains.min(), gains.max()] }
}

fn judge(quality: &Quality, strength: f64) -> Result<(), Refusal> {
    let [low, high] = quality.gain;
    if !(low >= quality::GAIN_LOW && high <= quality::GAIN_HIGH) {
        return Err(Refusal::Gain { low, high });
    }
    let limit = LARGEST_CHANGE * strength * high;
    if quality.change > limit {
        return Err(Refusal::Changed { change: quality.change, limit });
    }
    if quality.residual_relative > LARGEST_RESIDUAL {
        let (residual, percent) = (quality.residual, 100.0 * quality.residual_relative);
        return Err(Refusal::Residual { residual, percent, limit: 100.0 * LARGEST_RESIDUAL });
    }
    if quality.offset_sigma > LARGEST_OFFSET_SIGMA * strength {
        return Err(Refusal::Condition { sigma: quality.offset_sigma, limit: LARGEST_OFFSET_SIGMA * strength });
    }
    Ok(())
}
