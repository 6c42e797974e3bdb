//! What an estimator is worth while a sensor is blind: how far it drifts, and how that depends on where the window lies.
//!
//! [`Blindfold`] hides a sensor's samples from a run; [`drift`] measures what the run makes of it, against the truth or, where
//! there is none, against a run that saw everything; [`Sweep`] moves the window over the whole drive. A sweep puts as many
//! windows into one run as fit with time to recover between them, so that it costs few runs.

use drivescope_drive::channel::Series;
use drivescope_drive::drive::{Drive, Epoch};
use drivescope_drive::frames::wrap_angle;
use drivescope_drive::select::nth;
use drivescope_drive::vehicle::VehicleParams;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::estimator::RunError;
use crate::registry::AnyRun;
use crate::score::reference::TruthTable;

/// Times into a window at which the drift is told, s.
pub const AFTER: [f64; 3] = [10.0, 30.0, 60.0];

/// Shortest way of which a drift is a share, m.
const SHORTEST_WAY: f64 = 10.0;

/// A sensor that can be blinded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Satellites: fixes and ranges.
    Gnss,
    /// Magnetometer.
    Mag,
    /// Wheels.
    Odometer,
}

/// A sensor that is blind from the first to, not including, the second time (s) of each window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blindfold {
    /// Which sensor.
    pub sensor: Sensor,
    /// When.
    pub windows: Vec<(f64, f64)>,
}

impl Blindfold {
    /// Take the sensor's samples out of an epoch inside a window.
    pub fn apply(&self, epoch: &mut Epoch) {
        if !self.windows.iter().any(|(from, to)| epoch.time >= *from && epoch.time < *to) {
            return;
        }
        match self.sensor {
            Sensor::Gnss => {
                epoch.gnss = None;
                epoch.raw_gnss = None;
            }
            Sensor::Mag => epoch.mag = None,
            Sensor::Odometer => epoch.wheels = None,
        }
    }
}

/// The drift at one time into a window; NaN where the estimate or its reference has no value then.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DriftAt {
    /// Time since the window began, s.
    pub after: f64,
    /// Horizontal distance from where the car was, m.
    pub distance: f64,
    /// The same less the error that was there when the window began, as a vector, m.
    pub growth: f64,
    /// `growth` over the way driven since, 1; no value for a car that has hardly moved.
    pub share: f64,
    /// Error of the yaw less that of the beginning, rad.
    pub yaw: f64,
}

/// How an estimate went off in a window.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drift {
    /// Begin and end, s.
    pub window: (f64, f64),
    /// Way driven in the window, m.
    pub driven: f64,
    /// Largest horizontal distance from where the car was, m.
    pub largest: f64,
    /// At [`AFTER`], as far as the window reaches, and at its end.
    pub at: Vec<DriftAt>,
}

/// Errors of a blinded run, row by row.
struct Errors<'a> {
    time: &'a [f64],
    offset: Option<[Vec<f64>; 2]>,
    reference: Option<[Vec<f64>; 2]>,
    yaw: Option<Vec<f64>>,
}

impl<'a> Errors<'a> {
    fn new(blinded: &'a Series, drive: &Drive, seeing: Option<&Series>) -> Self {
        let time = blinded.time();
        let mut truths = TruthTable::new(drive, time);
        let mut reference = |truth: &str, column: &str| -> Option<Vec<f64>> {
            if let Some(values) = truths.get(truth) {
                return Some(values.to_vec());
            }
            let seeing = seeing?;
            let index = seeing.index_of(column)?;
            Some(time.iter().map(|&t| seeing.interpolate(index, t, 0.5)).collect())
        };
        let less = |column: &str, reference: &[f64]| -> Option<Vec<f64>> {
            Some(blinded.column(column)?.iter().zip(reference).map(|(a, b)| a - b).collect())
        };
        let place = reference("n", "north").zip(reference("e", "east"));
        let offset = place.as_ref().and_then(|(n, e)| Some([less("north", n)?, less("east", e)?]));
        let yaw = reference("yaw", "yaw").and_then(|yaw| less("yaw", &yaw));
        Self { time, offset, reference: place.map(|(n, e)| [n, e]), yaw }
    }

    fn offset(&self, row: usize) -> (f64, f64) {
        self.offset.as_ref().map_or((f64::NAN, f64::NAN), |[n, e]| (n[row], e[row]))
    }

    fn yaw(&self, row: usize) -> f64 {
        self.yaw.as_ref().map_or(f64::NAN, |yaw| yaw[row])
    }

    /// Way driven between two rows.
    fn driven(&self, from: usize, to: usize) -> f64 {
        let Some([n, e]) = &self.reference else { return f64::NAN };
        let mut last: Option<(f64, f64)> = None;
        let mut sum = 0.0;
        for row in (from..=to).filter(|&row| n[row].is_finite() && e[row].is_finite()) {
            if let Some((north, east)) = last.replace((n[row], e[row])) {
                sum += (n[row] - north).hypot(e[row] - east);
            }
        }
        sum
    }

    /// `None` where the estimates do not reach from before the window into it.
    fn drift(&self, window: (f64, f64)) -> Option<Drift> {
        let first = self.time.partition_point(|&t| t < window.0).checked_sub(1)?;
        let end = self.time.partition_point(|&t| t < window.1);
        let last = end.checked_sub(1).filter(|last| *last > first)?;
        let (north, east) = self.offset(first);
        let distance = |row: usize| {
            let (n, e) = self.offset(row);
            n.hypot(e)
        };
        let at = |after: f64| {
            let row = self.time.partition_point(|&t| t <= window.0 + after + 1e-9).saturating_sub(1).min(last);
            let (n, e) = self.offset(row);
            let growth = (n - north).hypot(e - east);
            let driven = self.driven(first, row);
            let share = if driven >= SHORTEST_WAY { growth / driven } else { f64::NAN };
            DriftAt { after, distance: n.hypot(e), growth, share, yaw: wrap_angle(self.yaw(row) - self.yaw(first)) }
        };
        let length = window.1 - window.0;
        let largest = (first + 1..=last).map(distance).filter(|d| d.is_finite()).fold(f64::NAN, f64::max);
        let times = AFTER.into_iter().filter(|after| *after < length - 1e-6).chain([length]);
        Some(Drift { window, driven: self.driven(first, last), largest, at: times.map(at).collect() })
    }
}

/// How `blinded`, a run with a sensor blind in the windows, went off in each of them.
///
/// Against the truth; where the drive has none, against `seeing`, a run over the same drive with all sensors. A window in which
/// there is no estimate gives nothing.
pub fn drift(blinded: &Series, drive: &Drive, seeing: Option<&Series>, windows: &[(f64, f64)]) -> Vec<Drift> {
    let errors = Errors::new(blinded, drive, seeing);
    windows.iter().filter_map(|window| errors.drift(*window)).collect()
}

/// How the window moves over the drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepPlan {
    /// Which sensor is blind.
    pub sensor: Sensor,
    /// For how long, s.
    pub length: f64,
    /// From one window to the next, s.
    pub step: f64,
    /// At least so long after the estimates' beginning, and between two windows of one run, s.
    pub recovery: f64,
}

impl SweepPlan {
    /// Windows of each run, over estimates from `start` to `end`.
    pub fn runs(&self, start: f64, end: f64) -> Vec<Vec<(f64, f64)>> {
        let step = self.step.max(1.0);
        // Windows whose numbers differ by this many fit into one run.
        let apart = ((self.length + self.recovery) / step).ceil().max(1.0) as usize;
        let mut runs = vec![Vec::new(); apart];
        for k in 0.. {
            let from = start + self.recovery + k as f64 * step;
            if from + self.length > end {
                break;
            }
            runs[k % apart].push((from, from + self.length));
        }
        runs.retain(|run| !run.is_empty());
        runs
    }
}

/// A sweep under way, which can stop and go on.
#[derive(Debug)]
pub struct Sweep {
    name: &'static str,
    params: Value,
    vehicle: Option<VehicleParams>,
    plan: SweepPlan,
    seeing: Option<Series>,
    runs: Vec<Vec<(f64, f64)>>,
    done: usize,
    current: AnyRun,
    drifts: Vec<Drift>,
}

impl Sweep {
    /// Begin with a run that sees everything: it tells where there are estimates, and what to compare with.
    ///
    /// # Errors
    /// See [`AnyRun::new`].
    pub fn new(
        estimator: &str,
        drive: &Drive,
        params: &Value,
        vehicle: Option<&VehicleParams>,
        plan: SweepPlan,
    ) -> Result<Self, RunError> {
        let current = AnyRun::new(estimator, drive, params, vehicle)?;
        Ok(Self {
            name: current.info.name,
            params: params.clone(),
            vehicle: vehicle.cloned(),
            plan,
            seeing: None,
            runs: Vec::new(),
            done: 0,
            current,
            drifts: Vec::new(),
        })
    }

    /// Step through at most `epochs` more epochs; `true` when all windows are done.
    ///
    /// # Errors
    /// See [`AnyRun::advance`].
    pub fn advance(&mut self, drive: &Drive, epochs: usize) -> Result<bool, RunError> {
        if !self.current.advance(drive, epochs)? {
            return Ok(false);
        }
        if let Some(seeing) = &self.seeing {
            for drift in drift(self.current.series(), drive, Some(seeing), &self.runs[self.done]) {
                let place = self.drifts.partition_point(|other| other.window.0 < drift.window.0);
                self.drifts.insert(place, drift);
            }
            self.done += 1;
        } else {
            let seeing = self.current.series().clone();
            let (start, end) = (seeing.time().first().copied(), seeing.time().last().copied());
            self.runs = start.zip(end).map(|(start, end)| self.plan.runs(start, end)).unwrap_or_default();
            self.seeing = Some(seeing);
        }
        let Some(windows) = self.runs.get(self.done) else {
            return Ok(true);
        };
        let mut run = AnyRun::new(self.name, drive, &self.params, self.vehicle.as_ref())?;
        run.blind(Blindfold { sensor: self.plan.sensor, windows: windows.clone() });
        self.current = run;
        Ok(false)
    }

    /// Share done, 0 to 1.
    pub fn fraction(&self, drive: &Drive) -> f64 {
        let begun = self.done + usize::from(self.seeing.is_some());
        let all = if self.seeing.is_some() { self.runs.len() + 1 } else { 8 };
        ((begun as f64 + self.current.fraction(drive)) / all as f64).min(1.0)
    }

    /// The drift in every window, in the order of time.
    pub fn drifts(&self) -> &[Drift] {
        &self.drifts
    }

    /// The drift at each time into a window, over all windows.
    pub fn distribution(&self) -> Vec<Distribution> {
        let longest = self.drifts.iter().map(|d| d.at.len()).max().unwrap_or(0);
        (0..longest).filter_map(|k| Distribution::new(self.drifts.iter().filter_map(|d| d.at.get(k)))).collect()
    }
}

/// Drifts at one time into windows, over many windows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Distribution {
    /// Time since the windows began, s.
    pub after: f64,
    /// Windows counted: with a place or a yaw to go off.
    pub count: usize,
    /// Median, 95th percentile and largest distance from where the car was, m.
    pub distance: [f64; 3],
    /// The same of the growth over the way driven, 1.
    pub share: [f64; 3],
    /// The same of how far the yaw went off, without its sign, rad.
    pub yaw: [f64; 3],
}

impl Distribution {
    fn new<'a>(drifts: impl Iterator<Item = &'a DriftAt> + Clone) -> Option<Self> {
        let after = drifts.clone().next()?.after;
        let (places, distance) = quantiles(drifts.clone().map(|d| d.distance));
        let (_, share) = quantiles(drifts.clone().map(|d| d.share));
        let (yaws, yaw) = quantiles(drifts.map(|d| d.yaw.abs()));
        Some(Self { after, count: places.max(yaws), distance, share, yaw })
    }
}

/// How many finite values there are; their median, 95th percentile and largest.
fn quantiles(values: impl Iterator<Item = f64>) -> (usize, [f64; 3]) {
    let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let Some(most) = values.len().checked_sub(1) else { return (0, [f64::NAN; 3]) };
    let ranks = [0.5, 0.95, 1.0].map(|share| (share * most as f64).round() as usize);
    (most + 1, ranks.map(|rank| nth(&mut values, rank)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case_log::{Table, navigation_case, shared};
    use serde_json::json;

    fn params(drive: &Drive) -> Value {
        json!({ "initial_yaw": drive.truth.column("yaw").unwrap()[900] })
    }

    /// Issue 7 and SPEC navigation 10.5: four windows of 60 s, odometer and constraint; at most 1.2 m in each.
    #[test]
    fn a_blinded_run_of_the_urban_drive_drifts_as_the_specification_says() {
        let Some(drive) = navigation_case("urban") else { return };
        let windows = [80.0, 220.0, 300.0, 500.0].map(|t| (t, t + 60.0)).to_vec();
        let mut run = AnyRun::new("gnss_ins", &drive, &params(&drive), None).unwrap();
        run.blind(Blindfold { sensor: Sensor::Gnss, windows: windows.clone() });
        while !run.advance(&drive, 10_000).unwrap() {}
        let drifts = drift(run.series(), &drive, None, &windows);
        for (drift, expected) in drifts.iter().zip([0.41, 0.55, 0.71, 1.14]) {
            println!("{drift:.3?}");
            assert!(drift.largest < 1.2 && (drift.largest - expected).abs() < 0.05, "{drift:?}");
            assert_eq!(drift.at.iter().map(|a| a.after).collect::<Vec<_>>(), [10.0, 30.0, 60.0]);
            let end = drift.at[2];
            assert!((end.growth / end.share - drift.driven).abs() < 1e-6 && drift.driven > 100.0);
            assert!(end.distance <= drift.largest);
        }
        assert_eq!(drifts.len(), 4);
    }

    /// Catches a second blindfold that takes the place of the first: without wheels a minute costs far more than with them.
    #[test]
    fn two_sensors_can_be_blind_at_once() {
        let Some(drive) = navigation_case("urban") else { return };
        let windows = vec![(220.0, 280.0)];
        let largest = |sensors: &[Sensor]| {
            let mut run = AnyRun::new("gnss_ins", &drive, &params(&drive), None).unwrap();
            sensors.iter().for_each(|&sensor| run.blind(Blindfold { sensor, windows: windows.clone() }));
            while !run.advance(&drive, usize::MAX).unwrap() {}
            drift(run.series(), &drive, None, &windows)[0].largest
        };
        let (gnss, both) = (largest(&[Sensor::Gnss]), largest(&[Sensor::Gnss, Sensor::Odometer]));
        assert!(both > 3.0 * gnss && both == largest(&[Sensor::Odometer, Sensor::Gnss]), "{gnss} m, {both} m");
    }

    /// Without truth the run that saw everything takes its place: the drift is then that against the unblinded filter, and at least
    /// within its error (a metre) of the true one.
    #[test]
    fn without_truth_a_run_that_sees_is_the_reference() {
        let Some(mut drive) = navigation_case("urban") else { return };
        let params = params(&drive);
        let windows = vec![(220.0, 280.0)];
        let seeing = crate::registry::run_by_name("gnss_ins", &drive, &params, None).unwrap();
        let mut run = AnyRun::new("gnss_ins", &drive, &params, None).unwrap();
        run.blind(Blindfold { sensor: Sensor::Gnss, windows: windows.clone() });
        while !run.advance(&drive, usize::MAX).unwrap() {}
        let with_truth = drift(run.series(), &drive, None, &windows);
        drive.truth = Series::default();
        assert!(drift(run.series(), &drive, None, &windows)[0].largest.is_nan());
        let without = drift(run.series(), &drive, Some(seeing.series()), &windows);
        assert!((without[0].largest - with_truth[0].largest).abs() < 1.0 && without[0].largest > 0.0);
    }

    #[test]
    fn every_window_of_a_sweep_is_run_once_with_time_to_recover() {
        let plan = SweepPlan { sensor: Sensor::Gnss, length: 60.0, step: 25.0, recovery: 40.0 };
        let runs = plan.runs(18.0, 600.0);
        let mut all: Vec<f64> = runs.iter().flatten().map(|w| w.0).collect();
        all.sort_unstable_by(f64::total_cmp);
        assert_eq!(all.first(), Some(&58.0));
        assert!(all.windows(2).all(|w| w[1] - w[0] == 25.0) && all[all.len() - 1] + 60.0 <= 600.0);
        for run in runs {
            assert!(run.windows(2).all(|w| w[1].0 - w[0].1 >= 40.0));
        }
        assert!(plan.runs(0.0, 90.0).is_empty());
    }

    /// A sweep in pieces ends, tells growing drifts, and its windows are those of the plan.
    #[test]
    fn a_sweep_over_the_urban_drive_gives_a_distribution() {
        let Some(drive) = navigation_case("urban") else { return };
        let plan = SweepPlan { sensor: Sensor::Gnss, length: 60.0, step: 30.0, recovery: 60.0 };
        let mut sweep = Sweep::new("gnss_ins", &drive, &params(&drive), None, plan).unwrap();
        let mut last = 0.0;
        while !sweep.advance(&drive, 5000).unwrap() {
            assert!(sweep.fraction(&drive) >= last);
            last = sweep.fraction(&drive);
        }
        let distribution = sweep.distribution();
        println!("{distribution:.3?}");
        assert_eq!(sweep.drifts().len(), 16);
        assert_eq!(distribution.len(), 3);
        assert!(distribution.windows(2).all(|w| w[1].distance[0] >= 0.5 * w[0].distance[0]));
        // Odometer and constraint: a per cent of the way at most at the end of a minute.
        assert!(distribution[2].count == 16 && distribution[2].share[1] < 0.01, "{distribution:?}");
    }

    /// The magnetometer concerns the heading of an estimator without places: its sweep tells the yaw and no metres.
    #[test]
    fn a_sweep_over_the_magnetometer_tells_how_far_the_yaw_goes_off() {
        let Some(path) = shared("spec/orientation/case1_flat_dlc80.csv.gz") else { return };
        let drive = Table::read(&path).drive();
        let plan = SweepPlan { sensor: Sensor::Mag, length: 5.0, step: 3.0, recovery: 5.0 };
        let mut sweep = Sweep::new("orientation", &drive, &json!({}), None, plan).unwrap();
        while !sweep.advance(&drive, 5000).unwrap() {}
        let end = sweep.distribution().pop().unwrap();
        println!("{end:.4?}");
        assert!(end.count == sweep.drifts().len() && end.count > 3 && end.distance[2].is_nan(), "{end:?}");
        assert!(end.yaw[0] > 0.0 && end.yaw[0] <= end.yaw[1] && end.yaw[1] <= end.yaw[2], "{end:?}");
        let worst = sweep.drifts().iter().map(|d| d.at.last().unwrap().yaw.abs()).fold(0.0, f64::max);
        assert_eq!(end.yaw[2], worst);
    }
}
