//! What every estimator is, and the loop that runs one over a drive.

use drivescope_drive::channel::{Channel, OutOfOrder, Record, Series};
use drivescope_drive::drive::{Drive, Epoch, EpochCursor, LogStart, Signal};
use drivescope_drive::param::{ParamError, Params};
use drivescope_drive::vehicle::VehicleParams;

use crate::blindfold::Blindfold;
use crate::kalman::NotPositiveDefinite;

/// A signal that an estimator reads, and what it costs to be without it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Need {
    /// The signal.
    pub signal: Signal,
    /// Whether the estimator cannot run without it.
    pub required: bool,
    /// What it is used for, and what is lost without it.
    pub why: &'static str,
}

/// Something that an estimator noticed while it ran, counted; shown to the user, never silent.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Notice {
    /// What happened, as a sentence.
    pub text: &'static str,
    /// How often.
    pub count: usize,
    /// When first, s.
    pub first: f64,
}

/// The notices of a run: few kinds, many occurrences.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Notices(Vec<Notice>);

impl Notices {
    /// Count one more occurrence of `text` at `time`.
    pub fn add(&mut self, text: &'static str, time: f64) {
        match self.0.iter_mut().find(|n| std::ptr::eq(n.text, text) || n.text == text) {
            Some(notice) => notice.count += 1,
            None => self.0.push(Notice { text, count: 1, first: time }),
        }
    }
    /// All kinds so far, in order of first occurrence.
    pub fn list(&self) -> &[Notice] {
        &self.0
    }
}

/// A filter or detector that is stepped through a drive, epoch by epoch.
///
/// The same `step` serves the page, the command line and live playback. An epoch that holds only sensors the estimator
/// does not use returns `None` before time is advanced: adding such a sensor to a drive changes nothing, bit for bit.
pub trait Estimator: Sized {
    /// Name on the command line and in menus.
    const NAME: &'static str;
    /// Title for people.
    const TITLE: &'static str;
    /// One or two sentences: what it estimates, from what, after which source.
    const DOC: &'static str;
    /// The signals it reads.
    const NEEDS: &'static [Need];
    /// The car it assumes when neither the user nor the drive says which (name of a preset).
    const VEHICLE: &'static str;
    /// Tuning.
    type Params: Params;
    /// What it puts out.
    type Estimate: Record;

    /// A fresh estimator. `start` is what the drive's first moments say.
    fn new(params: &Self::Params, vehicle: &VehicleParams, start: &LogStart) -> Self;

    /// Look at the drive before the first step, for what cannot be told from the first row: once, and optional. What is stepped
    /// without it finds the same a little later.
    fn look_ahead(&mut self, _drive: &Drive) {}

    /// Fold in one epoch; an estimate at the epochs that it uses.
    ///
    /// # Errors
    /// [`EstimatorError`] when the estimator cannot go on; a measurement it refuses is a [`Notice`], not an error.
    fn step(&mut self, epoch: &Epoch) -> Result<Option<Self::Estimate>, EstimatorError>;

    /// At the end of the drive: go on with a second, backward pass over the estimates, by work worth about `steps` steps.
    ///
    /// Returns the share of the pass that is done; it is called again until that is 1. An estimator without such a pass has
    /// nothing to do.
    fn look_back(&mut self, _rows: &mut Channel<Self::Estimate>, _steps: usize) -> f64 {
        1.0
    }

    /// Share of a whole run that the second pass takes, 0 to 1; 0 without one.
    fn look_back_share(&self) -> f64 {
        0.0
    }

    /// What it noticed so far.
    fn notices(&self) -> &Notices;
}

/// The estimator cannot go on.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
pub enum EstimatorError {
    /// A covariance is broken beyond repair.
    #[error(transparent)]
    NotPositiveDefinite(#[from] NotPositiveDefinite),
    /// The state left the range in which the model means anything.
    #[error("the state left its range ({what})")]
    OutOfRange {
        /// Which quantity.
        what: &'static str,
    },
}

/// A run that could not start or go on.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum RunError {
    /// A parameter cannot be taken.
    #[error(transparent)]
    Params(#[from] ParamError),
    /// The drive lacks a signal.
    #[error("{estimator} needs {signal}, which this drive does not have: {why}")]
    Missing {
        /// The estimator.
        estimator: &'static str,
        /// The signal, for people.
        signal: &'static str,
        /// What it is needed for.
        why: &'static str,
    },
    /// No estimator has this name.
    #[error("no estimator `{name}`; there are {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// The estimator gave up.
    #[error("{estimator} failed at t = {time:.3} s: {source}")]
    Step {
        /// The estimator.
        estimator: &'static str,
        /// When, s.
        time: f64,
        /// Why.
        source: EstimatorError,
    },
    /// The drive's time is damaged.
    #[error(transparent)]
    Order(#[from] OutOfOrder),
}

/// The car that `E` assumes: the one that is given, else the drive's own, else its default.
pub fn vehicle_of<E: Estimator>(drive: &Drive, given: Option<&VehicleParams>) -> VehicleParams {
    known_or_preset(E::VEHICLE, drive, given)
}

// Compiled once for all estimators, as is `missing`.
#[inline(never)]
fn known_or_preset(preset: &str, drive: &Drive, given: Option<&VehicleParams>) -> VehicleParams {
    let known = given.or(drive.vehicle.as_ref()).cloned();
    known.or_else(|| VehicleParams::preset(preset)).unwrap_or_default()
}

#[inline(never)]
fn missing(needs: &'static [Need], drive: &Drive) -> Option<&'static Need> {
    needs.iter().find(|n| n.required && !drive.has(n.signal))
}

/// A pass of one estimator over a drive, that can stop and go on.
#[derive(Clone, Debug)]
pub struct Run<E: Estimator> {
    estimator: E,
    cursor: EpochCursor,
    looked_back: f64,
    blindfolds: Vec<Blindfold>,
    out: Channel<E::Estimate>,
}

impl<E: Estimator> Run<E> {
    /// Check parameters and signals and stand at the drive's beginning. `vehicle` overrides the drive's own.
    ///
    /// # Errors
    /// A parameter out of range, or a required signal that is missing.
    pub fn new(drive: &Drive, params: &E::Params, vehicle: Option<&VehicleParams>) -> Result<Self, RunError> {
        params.validate()?;
        if let Some(need) = missing(E::NEEDS, drive) {
            return Err(RunError::Missing { estimator: E::NAME, signal: need.signal.label(), why: need.why });
        }
        let vehicle = vehicle_of::<E>(drive, vehicle);
        let mut estimator = E::new(params, &vehicle, &drive.start());
        estimator.look_ahead(drive);
        let mut out = Channel::default();
        out.reserve(drive.imu.len());
        Ok(Self { estimator, cursor: EpochCursor::default(), looked_back: 0.0, blindfolds: Vec::new(), out })
    }

    /// Hide a sensor's samples in some windows, from here on, with those that are hidden already.
    pub fn blind(&mut self, blindfold: Blindfold) {
        self.blindfolds.push(blindfold);
    }

    /// Step through at most `epochs` more epochs, at the end of the drive through a second pass if there is one; `true` when
    /// all is done.
    ///
    /// # Errors
    /// When the estimator gives up.
    pub fn advance(&mut self, drive: &Drive, epochs: usize) -> Result<bool, RunError> {
        let mut pass = self.cursor.pass(drive);
        for _ in 0..epochs {
            let Some(epoch) = pass.next() else {
                self.looked_back = self.estimator.look_back(&mut self.out, epochs);
                return Ok(self.looked_back >= 1.0);
            };
            let stepped = if self.blindfolds.is_empty() {
                self.estimator.step(epoch)
            } else {
                let mut epoch = *epoch;
                self.blindfolds.iter().for_each(|blindfold| blindfold.apply(&mut epoch));
                self.estimator.step(&epoch)
            };
            let estimate = stepped.map_err(|source| RunError::Step { estimator: E::NAME, time: epoch.time, source })?;
            if let Some(estimate) = estimate {
                self.out.push(epoch.time, estimate)?;
            }
        }
        Ok(false)
    }

    /// Share of the run done, 0 to 1.
    pub fn fraction(&self, drive: &Drive) -> f64 {
        let back = self.estimator.look_back_share();
        self.cursor.fraction(drive) * (1.0 - back) + self.looked_back * back
    }
    /// The estimates so far.
    pub fn estimates(&self) -> &Channel<E::Estimate> {
        &self.out
    }
    /// What the estimator noticed so far.
    pub fn notices(&self) -> &Notices {
        self.estimator.notices()
    }
    /// The estimates as columns, by value.
    pub fn into_series(self) -> Series {
        self.out.into_series()
    }
}

/// Run `E` over the whole drive and return its estimates column by column.
///
/// # Errors
/// See [`Run::new`] and [`Run::advance`].
pub fn run<E: Estimator>(
    drive: &Drive,
    params: &E::Params,
    vehicle: Option<&VehicleParams>,
) -> Result<Channel<E::Estimate>, RunError> {
    let mut run = Run::<E>::new(drive, params, vehicle)?;
    while !run.advance(drive, usize::MAX)? {}
    Ok(run.out)
}
