//! Every estimator by name: one list feeds the page, the command line and the tests.

use drivescope_drive::channel::{Column, Record, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::param::{ParamSpec, Params};
use drivescope_drive::vehicle::VehicleParams;
use serde_json::Value;

use crate::blindfold::Blindfold;
use crate::estimator::{Estimator, Need, Notice, Run, RunError};

/// What a menu, a manual page or a slider panel needs to know about an estimator.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct EstimatorInfo {
    /// Name on the command line.
    pub name: &'static str,
    /// Title for people.
    pub title: &'static str,
    /// What it estimates, from what, after which source.
    pub doc: &'static str,
    /// Signals it reads.
    pub needs: &'static [Need],
    /// The car assumed by default.
    pub vehicle: &'static str,
    /// Its parameters.
    pub params: &'static [ParamSpec],
    /// Its columns.
    pub columns: &'static [Column],
}

impl EstimatorInfo {
    /// The signals it reads that a drive does not have.
    pub fn missing(&self, drive: &Drive) -> impl Iterator<Item = &'static Need> {
        self.needs.iter().filter(|n| !drive.has(n.signal))
    }

    /// Whether a drive has every signal that it cannot do without.
    pub fn can_run(&self, drive: &Drive) -> bool {
        self.missing(drive).all(|n| !n.required)
    }
}

const fn info<E: Estimator>() -> EstimatorInfo {
    EstimatorInfo {
        name: E::NAME,
        title: E::TITLE,
        doc: E::DOC,
        needs: E::NEEDS,
        vehicle: E::VEHICLE,
        params: <E::Params as Params>::SPECS,
        columns: <E::Estimate as Record>::COLUMNS,
    }
}

macro_rules! estimators {
    ($( $variant:ident = $ty:ty ),+ $(,)?) => {
        /// Every estimator.
        pub static ESTIMATORS: &[EstimatorInfo] = &[ $( info::<$ty>() ),+ ];

        #[derive(Debug)]
        enum Inner { $( $variant(Box<Run<$ty>>) ),+ }

        impl AnyRun {
            /// Start a run of the estimator called `name` with parameters from a JSON object (null: defaults).
            ///
            /// # Errors
            /// Unknown name, a parameter that cannot be taken, or a missing signal.
            #[inline(never)]
            pub fn new(
                name: &str, drive: &Drive, params: &Value, vehicle: Option<&VehicleParams>,
            ) -> Result<Self, RunError> {
                $( if name == <$ty as Estimator>::NAME {
                    let params = <<$ty as Estimator>::Params as Params>::from_json(params)?;
                    let run = Run::<$ty>::new(drive, &params, vehicle)?;
                    return Ok(Self {
                        info: info::<$ty>(), params: params.to_json(), inner: Inner::$variant(Box::new(run)),
                    });
                } )+
                let known = ESTIMATORS.iter().map(|e| e.name).collect::<Vec<_>>().join(", ");
                Err(RunError::Unknown { name: name.into(), known })
            }
            /// Step through at most `epochs` more epochs and then through a second pass, if there is one; `true` when all is done.
            ///
            /// # Errors
            /// When the estimator gives up.
            #[inline(never)]
            pub fn advance(&mut self, drive: &Drive, epochs: usize) -> Result<bool, RunError> {
                match &mut self.inner { $( Inner::$variant(run) => run.advance(drive, epochs) ),+ }
            }
            /// Hide a sensor's samples in some windows, from here on, with those that are hidden already.
            pub fn blind(&mut self, blindfold: Blindfold) {
                match &mut self.inner { $( Inner::$variant(run) => run.blind(blindfold) ),+ }
            }
            /// Share of the run done, 0 to 1.
            pub fn fraction(&self, drive: &Drive) -> f64 {
                match &self.inner { $( Inner::$variant(run) => run.fraction(drive) ),+ }
            }
            /// The estimates so far.
            pub fn series(&self) -> &Series {
                match &self.inner { $( Inner::$variant(run) => run.estimates().series() ),+ }
            }
            /// What the estimator noticed so far.
            pub fn notices(&self) -> &[Notice] {
                match &self.inner { $( Inner::$variant(run) => run.notices().list() ),+ }
            }
            /// The estimates, by value.
            pub fn into_series(self) -> Series {
                match self.inner { $( Inner::$variant(run) => run.into_series() ),+ }
            }
        }
    };
}

/// A run of any estimator, chosen by name when the program runs.
#[derive(Debug)]
pub struct AnyRun {
    /// The estimator.
    pub info: EstimatorInfo,
    /// Every parameter's value, as a JSON object.
    pub params: Value,
    inner: Inner,
}

estimators! {
    Orientation = crate::orientation::Orientation,
    Slope = crate::slope::Slope,
    MotionMode = crate::motion_mode::MotionModeDetector,
    GnssIns = crate::gnss_ins::GnssIns,
    LandIns = crate::land_ins::LandIns,
    GyroFree = crate::gyro_free::GyroFree,
    Stationarity = crate::stationarity::Stationarity,
    Gnss = crate::gnss::GnssReceiver,
    Attitude = crate::attitude::Attitude,
}

/// An estimator by name.
pub fn find(name: &str) -> Option<&'static EstimatorInfo> {
    ESTIMATORS.iter().find(|e| e.name == name)
}

/// Run an estimator by name over the whole drive.
///
/// # Errors
/// See [`AnyRun::new`] and [`AnyRun::advance`].
pub fn run_by_name(
    name: &str,
    drive: &Drive,
    params: &Value,
    vehicle: Option<&VehicleParams>,
) -> Result<AnyRun, RunError> {
    let mut run = AnyRun::new(name, drive, params, vehicle)?;
    while !run.advance(drive, usize::MAX)? {}
    Ok(run)
}
