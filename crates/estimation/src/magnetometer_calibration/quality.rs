//! What the readings of a drive allow: covered headings, spread, noise, and the reasons for a refusal.

use std::f64::consts::TAU;

use drivescope_drive::select::median;
use nalgebra::{Matrix3, Vector3};

use super::Kind;
use super::small::eigen;

/// Sectors of heading in a full turn.
pub const SECTORS: usize = 12;

/// What the readings are like and how well a calibration fits them.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Quality {
    /// Readings of the drive.
    pub samples: usize,
    /// Readings used: those that differ from each other.
    pub used: usize,
    /// Sectors of heading (of 12) in which there are readings.
    pub sectors: usize,
    /// Smallest spread of the readings over their largest: 0 in a plane, 1 in a sphere.
    pub spread: f64,
    /// Noise of one axis from reading to reading, uT.
    pub noise: f64,
    /// Root mean square of the calibrated strength less the Earth's, uT.
    pub residual: f64,
    /// The same as a part of the Earth's strength (of its horizontal part, for a plane).
    pub residual_relative: f64,
    /// Largest 1-sigma of an offset, uT.
    pub offset_sigma: f64,
    /// How far the readings' centre moved from the first half of the drive to the second, uT; 0 where a half does not tell.
    pub change: f64,
    /// What the sensor reads of the Earth's strength along its weakest and strongest axis.
    pub gain: [f64; 2],
    /// Which fit it is.
    pub kind: Option<Kind>,
}

/// Why a drive gives no calibration, with its figures.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, thiserror::Error)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum Refusal {
    /// There is nothing to fit.
    #[error("the magnetometer has {used} different readings, and at least {needed} are needed: drive a full circle")]
    TooFew {
        /// Different readings.
        used: usize,
        /// Least number.
        needed: usize,
    },
    /// The car has not turned enough.
    #[error(
        "the drive has readings in {sectors} of {} sectors of heading, and at least {needed} are needed: drive a full circle or two",
        SECTORS
    )]
    Coverage {
        /// Sectors with readings.
        sectors: usize,
        /// Least number.
        needed: usize,
    },
    /// The readings lie on no ellipse.
    #[error("the readings do not lie on an ellipse: what is round the sensor moved or changed during the drive")]
    NoEllipse,
    /// The ellipse is too small, too large or too flat to be the Earth's field.
    #[error(
        "the readings' ellipse has half axes of {low:.2} to {high:.2} times the Earth's field, beyond what iron in a car does ({} to {}): \
         check unit and axes",
        GAIN_LOW,
        GAIN_HIGH
    )]
    Gain {
        /// Shortest half axis over the Earth's strength.
        low: f64,
        /// Longest half axis over the Earth's strength.
        high: f64,
    },
    /// The fit leaves too much.
    #[error(
        "{residual:.1} uT or {percent:.0} % of the field are left after the best fit, and at most {limit:.0} % can be used: \
         disturbed surroundings, or currents in the car that change"
    )]
    Residual {
        /// Root mean square, uT.
        residual: f64,
        /// The same in per cent of the field.
        percent: f64,
        /// Most that is allowed, per cent.
        limit: f64,
    },
    /// Something magnetic moved.
    #[error(
        "the readings' centre moved by {change:.1} uT from the first half of the drive to the second, and at most {limit:.1} uT can be \
         used: something magnetic in the car was moved or switched"
    )]
    Changed {
        /// Distance between the centres, uT.
        change: f64,
        /// Most that is allowed, uT.
        limit: f64,
    },
    /// The calibrated heading does not follow the course.
    #[error(
        "the calibrated heading does not follow the GNSS course (consistency {consistency:.2}, at least {needed} is needed): \
         check the signs of the axes"
    )]
    Course {
        /// Mean resultant length of course less heading, every sector alike.
        consistency: f64,
        /// Least value.
        needed: f64,
    },
    /// The fit is loose.
    #[error(
        "the readings fix the offset only to {sigma:.1} uT (1-sigma), and {limit:.1} uT are needed: drive full circles"
    )]
    Condition {
        /// Largest 1-sigma of an offset, uT.
        sigma: f64,
        /// Most that is allowed, uT.
        limit: f64,
    },
}

/// Shortest half axis, in parts of the Earth's strength, that iron in a car explains.
pub(super) const GAIN_LOW: f64 = 0.3;
/// Longest half axis.
pub(super) const GAIN_HIGH: f64 = 2.5;

/// Noise of one axis (1-sigma, uT): median second difference, which turns and offsets hardly enter.
pub(super) fn noise(readings: &[Vector3<f64>]) -> f64 {
    let mut bends: Vec<f64> =
        readings.windows(3).map(|w| (w[0] - w[1] * 2.0 + w[2]).norm_squared()).filter(|b| b.is_finite()).collect();
    // Three axes, each of variance 6 sigma^2: the median of chi-square with 3 degrees of freedom is 2.366.
    (median(&mut bends) / (6.0 * 2.366)).sqrt()
}

/// Smallest over largest standard deviation of the readings along any direction.
pub(super) fn spread(readings: &[Vector3<f64>]) -> f64 {
    let mean = readings.iter().sum::<Vector3<f64>>() / readings.len() as f64;
    let scatter: Matrix3<f64> = readings.iter().map(|m| (m - mean) * (m - mean).transpose()).sum();
    let values = eigen(&scatter).0;
    (values.min().max(0.0) / values.max()).sqrt()
}

/// Number of the twelve sectors in which there is a heading (rad).
pub fn sectors(headings: impl Iterator<Item = f64>) -> usize {
    let mut seen = [false; SECTORS];
    headings.filter(|h| h.is_finite()).for_each(|h| seen[sector(h)] = true);
    seen.iter().filter(|s| **s).count()
}

/// Which of the twelve sectors a heading (rad) is in; the first begins at north.
pub fn sector(heading: f64) -> usize {
    ((heading.rem_euclid(TAU) / TAU * SECTORS as f64) as usize).min(SECTORS - 1)
}

/// Readings worth a fit: those after a turn of two degrees or, without a gyro, a change of 2 % of the strength.
///
/// A parked minute or a long straight would otherwise outweigh the turns that tell offset from field.
pub(super) fn different(readings: &[Vector3<f64>], turned: Option<&[f64]>, strength: f64) -> Vec<usize> {
    const TURN: f64 = 2.0 * std::f64::consts::PI / 180.0;
    const CHANGE: f64 = 0.02;
    let mut kept: Vec<usize> = Vec::new();
    for (i, m) in readings.iter().enumerate() {
        let is_new = match (kept.last(), turned) {
            (None, _) => true,
            (Some(&last), Some(turned)) => (turned[i] - turned[last]).abs() >= TURN,
            (Some(&last), None) => (m - readings[last]).norm() >= CHANGE * strength,
        };
        if is_new && m.iter().all(|v| v.is_finite()) {
            kept.push(i);
        }
    }
    kept
}
