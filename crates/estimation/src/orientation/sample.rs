//! What passes between the estimator and its filters: one sample, and what a step found.

use nalgebra::Vector3;

use super::gate::Decision;
use super::model::Input;

/// One sample, fit for the filters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) input: Input,
    /// Speed, m/s, and its change, m/s^2.
    pub(super) speed: f64,
    pub(super) speed_change: f64,
    /// Forward specific force, m/s^2.
    pub(super) accel_x: Option<f64>,
    /// Whether yaw rate, lateral force and speed are fresh.
    pub(super) is_fresh: bool,
    pub(super) field: Option<Vector3<f64>>,
    pub(super) is_static: bool,
    pub(super) dt: f64,
}

/// What a step of the road filter says beside the state; NaN where there was nothing to say.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoadFindings {
    pub(super) dip_error: f64,
    pub(super) nis: f64,
    pub(super) decision: Option<Decision>,
    pub(super) lateral_nis: f64,
}

/// What a step says beside the attitude.
#[derive(Clone, Copy, Debug)]
pub(super) struct Findings {
    pub(super) sigma: [f64; 3],
    pub(super) dip_error: f64,
    pub(super) nis: f64,
    pub(super) decision: Option<Decision>,
    pub(super) lateral_nis: f64,
}

impl Findings {
    pub(super) fn new(sigma: [f64; 3], dip_error: f64, nis: f64) -> Self {
        Self { sigma, dip_error, nis, decision: None, lateral_nis: f64::NAN }
    }

    /// A field that was left out is no innovation of the filter.
    pub(super) fn of_road(sigma: [f64; 3], f: &RoadFindings) -> Self {
        let nis = if matches!(f.decision, Some(Decision::Leave(_))) { f64::NAN } else { f.nis };
        Self { decision: f.decision, lateral_nis: f.lateral_nis, ..Self::new(sigma, f.dip_error, nis) }
    }
}

/// Angle of the field below the plane normal to `down`, less that of the reference, rad; NaN without a field.
pub(super) fn dip_error(field: Option<&Vector3<f64>>, down: Option<&Vector3<f64>>, reference: f64) -> f64 {
    let (Some(field), Some(down)) = (field, down) else { return f64::NAN };
    (field.dot(down) / field.norm()).clamp(-1.0, 1.0).asin() - reference
}
