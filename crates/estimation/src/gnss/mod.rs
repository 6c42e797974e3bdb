//! Position, velocity and clock of a satellite receiver from its pseudoranges: a filter of eight states and, beside it, the
//! fix of each instant alone with its integrity test and without the satellites that fail it.
//!
//! State: north, east, down of the frame at the local origin (m) with their rates (m/s), receiver clock offset (m) and drift
//! (m/s). Inputs: pseudoranges and their rates with the satellites' places and velocities.
//! Source: Yun & Yu 2007, equations (10) to (14), corrected; SPEC navigation 5. A jump of the clock is followed as in SPEC
//! navigation 4, and a filter that refuses everything is started again from a fix that passes its test.
//! Not modelled: transit time and rotation of the Earth under the signal, atmosphere, relativity: the ranges are taken as
//! corrected. Errors of a satellite that last for minutes are followed, so that the sigmas are too small then.

mod estimate;
pub mod filter;
pub mod integrity;
pub mod sight;
pub mod snapshot;

#[cfg(test)]
mod tests;

use drivescope_drive::drive::{Epoch, LogStart, Signal};
use drivescope_drive::geodesy::{Geodetic, LocalFrame};
use drivescope_drive::satellites::Satellite;
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::Vector3;

pub use self::estimate::{GnssEstimate, GnssParams};
use self::filter::{Filter, Tuning};
use self::integrity::Checked;
use self::snapshot::snapshot;
use crate::estimator::{Estimator, EstimatorError, Need, Notices};

/// Instants in a row at which everything is refused, after which the filter and not the sky is wrong.
const REFUSED_IN_A_ROW: usize = 5;
/// Dilution beyond which a fix counts as degraded.
const WORST_PDOP: f64 = 15.0;

/// The estimator: see the [module](self).
#[derive(Clone, Debug)]
pub struct GnssReceiver {
    tuning: Tuning,
    frame: Option<LocalFrame>,
    filter: Option<Filter>,
    last_fix: Option<Vector3<f64>>,
    time: f64,
    interval: f64,
    refused: usize,
    notices: Notices,
}

impl Estimator for GnssReceiver {
    const NAME: &'static str = "gnss";
    const TITLE: &'static str = "Satellite receiver";
    const DOC: &'static str = "Position, velocity and receiver clock from pseudoranges alone, filtered and as single fixes with \
        an integrity test (RAIM). After Yun & Yu 2007, corrected.";
    const NEEDS: &'static [Need] = &[
        Need {
            signal: Signal::RawGnss,
            required: true,
            why: "everything is computed from the ranges of single satellites",
        },
        Need {
            signal: Signal::GnssPosition,
            required: false,
            why: "tells that the receiver ran while it saw no satellite: a row is predicted then",
        },
    ];
    const VEHICLE: &'static str = "saloon";
    type Params = GnssParams;
    type Estimate = GnssEstimate;

    fn new(params: &GnssParams, _vehicle: &VehicleParams, start: &LogStart) -> Self {
        Self {
            tuning: Tuning::new(params),
            frame: start.origin.map(LocalFrame::new),
            filter: None,
            last_fix: None,
            time: f64::NAN,
            interval: f64::INFINITY,
            refused: 0,
            notices: Notices::default(),
        }
    }

    fn step(&mut self, epoch: &Epoch) -> Result<Option<GnssEstimate>, EstimatorError> {
        let since = epoch.time - self.time;
        let satellites = match epoch.raw_gnss {
            Some(satellites) => satellites,
            // The receiver ran and saw nothing.
            None if epoch.gnss.is_some() && since >= 0.999 * self.interval => &[],
            None => return Ok(None),
        };
        if !epoch.time.is_finite() || since <= 0.0 {
            self.notices.add("instant that is not later than the one before skipped", self.time);
            return Ok(None);
        }
        if since > 0.0 && !satellites.is_empty() {
            self.interval = self.interval.min(since);
        }
        self.time = epoch.time;
        Ok(self.fold(satellites, since))
    }

    fn notices(&self) -> &Notices {
        &self.notices
    }
}

impl GnssReceiver {
    /// One instant, `since` s after the last one.
    fn fold(&mut self, satellites: &[Satellite], since: f64) -> Option<GnssEstimate> {
        let frame = self.frame.or_else(|| first_frame(satellites))?;
        self.frame = Some(frame);
        let checked = self.tuning.integrity.fix(&frame, satellites, self.last_fix);
        let fix = checked.map(|checked| checked.fix);
        self.last_fix = fix.map(|fix| fix.place).or(self.last_fix);
        let passes = checked.is_some_and(|checked| checked.passes != Some(false));
        if self.refused >= REFUSED_IN_A_ROW && passes {
            self.notices.add("the filter refused every range and was started again from a fix", self.time);
            self.filter = None;
        }
        let mut row = GnssEstimate::default();
        match (&mut self.filter, &fix) {
            (Some(filter), _) => {
                filter.predict(since, &self.tuning);
                if filter.follow_jump(&frame, satellites) {
                    self.notices.add("the receiver clock jumped", self.time);
                }
                let used = filter.update(&frame, satellites, &self.tuning);
                let is_refused = used.range.count > 0 && used.range.accepted == 0;
                self.refused = if is_refused { self.refused + 1 } else { 0 };
                used.write(&mut row);
            }
            (none, Some(fix)) => {
                *none = Some(Filter::new(fix));
                self.refused = 0;
            }
            (_, None) => return None,
        }
        self.filter.as_ref()?.write(&frame, &mut row);
        self.write_fix(satellites, checked.as_ref(), &mut row);
        Some(row)
    }

    fn write_fix(&self, satellites: &[Satellite], checked: Option<&Checked>, row: &mut GnssEstimate) {
        let fix = checked.map(|checked| &checked.fix);
        let count = sight::usable(satellites).count();
        row.satellites = count as f64;
        row.degraded = f64::from(u8::from(count < 4 || fix.is_none_or(|fix| fix.pdop() > WORST_PDOP)));
        let Some(fix) = fix else { return };
        [row.fix_north, row.fix_east, row.fix_down] = fix.place.into();
        let sigma = |k: usize| self.tuning.params.range_sigma * fix.cofactor[(k, k)].sqrt();
        [row.fix_north_sigma, row.fix_east_sigma, row.fix_down_sigma] = [sigma(0), sigma(1), sigma(2)];
        row.pdop = fix.pdop();
        row.hdop = (fix.cofactor[(0, 0)] + fix.cofactor[(1, 1)]).sqrt();
        row.vdop = fix.cofactor[(2, 2)].sqrt();
        let Some((checked, passes)) = checked.and_then(|checked| Some((checked, checked.all_pass?))) else { return };
        row.raim = checked.all.0 / checked.all.1 as f64;
        row.raim_passed = f64::from(u8::from(passes));
        row.raim_excluded = f64::from(checked.left_out.count_ones());
        let first = satellites.get(checked.left_out.trailing_zeros() as usize);
        row.raim_excluded_satellite = first.map_or(f64::NAN, |satellite| f64::from(satellite.prn));
    }
}

/// The frame at the first fix, for a log that says nothing of its place.
pub(crate) fn first_frame(satellites: &[Satellite]) -> Option<LocalFrame> {
    let far = LocalFrame::new(Geodetic::default());
    let fix = snapshot(&far, satellites, 0, None, 1.0)?;
    Some(LocalFrame::new(far.to_geodetic(&fix.place)))
}
