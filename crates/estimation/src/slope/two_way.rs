//! Grade from both sides: the estimator run forward and, over the same drive played backward, once more.
//!
//! A car that drives backward through time obeys the same equations: speeds and turn rates change sign, forces and grades
//! do not. Only the body's oscillation on its springs does not reverse (its damping would feed it); in the backward run it
//! is critically damped and fast, so that the static squat remains. The lag of one run is the lead of the other.
//! The mean is weighted by the stated variances. The two runs share their input at the moment itself and the bias of the
//! accelerometer: the stated sigma is that of the better run, not less.

use drivescope_drive::channel::{Channel, OutOfOrder, Record, Series};
use drivescope_drive::drive::{Drive, Epoch};
use drivescope_drive::vehicle::VehicleParams;

use super::{Slope, SlopeEstimate, SlopeParams};
use crate::estimator::{Run, RunError, run};

/// The rows of both directions are as far apart as two inertial samples; across a wider hole they are not joined, s.
const WIDEST_GAP: f64 = 0.5;

/// The samples that a forward run has used, and the run over them backward.
#[derive(Clone, Debug)]
pub(super) struct Backward {
    vehicle: VehicleParams,
    /// What was measured; from the end of the forward run on played backward.
    drive: Drive,
    run: Option<Run<Slope>>,
    done: f64,
}

/// Columns that change their sign when time is played backward.
const TURNED: [&str; 11] = [
    "gyro_x",
    "gyro_y",
    "gyro_z",
    "speed",
    "wheel_speed_fl",
    "wheel_speed_fr",
    "wheel_speed_rl",
    "wheel_speed_rr",
    "gnss_vn",
    "gnss_ve",
    "gnss_vd",
];

/// Times and columns of a series played backward; a course has no meaning then.
fn reversed(series: Series) -> (Vec<f64>, Vec<Vec<f64>>) {
    let (mut time, schema, mut columns) = series.into_columns();
    time.reverse();
    time.iter_mut().for_each(|t| *t = -*t);
    for (column, values) in schema.iter().zip(&mut columns) {
        values.reverse();
        if TURNED.contains(&column.name) {
            values.iter_mut().for_each(|v| *v = -*v);
        } else if column.name == "course" {
            values.fill(f64::NAN);
        }
    }
    (time, columns)
}

/// The drive played backward: time is negated, and with it every speed and turn rate. Truth and the sensors that the slope
/// does not use are left out.
///
/// # Errors
/// [`OutOfOrder`], which a drive that was put together cannot cause.
pub fn played_backward(drive: Drive) -> Result<Drive, OutOfOrder> {
    fn turned<R: Record>(channel: Channel<R>) -> Result<Channel<R>, OutOfOrder> {
        let (time, columns) = reversed(channel.into_series());
        Channel::from_columns(time, columns)
    }
    Ok(Drive {
        imu: turned(drive.imu)?,
        wheels: turned(drive.wheels)?,
        steering: turned(drive.steering)?,
        gnss: turned(drive.gnss)?,
        baro: turned(drive.baro)?,
        vehicle: drive.vehicle,
        ..Drive::default()
    })
}

/// Mean of two estimates weighted by their variances, and the smaller sigma; the first where the second has none.
fn mean(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    let (u, v) = (b.1 * b.1, a.1 * a.1);
    let both = (a.0 * u + b.0 * v) / (u + v);
    if both.is_nan() { a } else { (both, a.1.min(b.1)) }
}

impl Backward {
    pub(super) fn new(vehicle: &VehicleParams) -> Self {
        Self { vehicle: vehicle.clone(), drive: Drive::default(), run: None, done: 0.0 }
    }

    /// Keep what an epoch measured. The inertial sensor comes as late as the wheels, as in the forward run.
    pub(super) fn keep(&mut self, epoch: &Epoch, latency: f64) {
        fn keep<R: Record>(channel: &mut Channel<R>, time: f64, sample: Option<R>) {
            // Times of a drive rise in every channel.
            let _ = sample.map(|sample| channel.push(time, sample));
        }
        let (drive, time) = (&mut self.drive, epoch.time);
        keep(&mut drive.imu, time + latency, epoch.imu);
        keep(&mut drive.wheels, time, epoch.wheels);
        keep(&mut drive.steering, time, epoch.steering);
        keep(&mut drive.gnss, time, epoch.gnss);
        keep(&mut drive.baro, time, epoch.baro);
    }

    /// Go on backward by about `steps` epochs, and at the end join both directions in `rows`; the share done.
    ///
    /// # Errors
    /// Those of the backward run; `rows` are then as they were.
    pub(super) fn advance(
        &mut self,
        params: &SlopeParams,
        rows: &mut Channel<SlopeEstimate>,
        steps: usize,
    ) -> Result<f64, RunError> {
        if self.done >= 1.0 {
            return Ok(1.0);
        }
        // Given up unless this step succeeds.
        self.done = 1.0;
        if self.run.is_none() {
            self.drive = played_backward(std::mem::take(&mut self.drive))?;
            let stiff = SlopeParams {
                two_way: false,
                wheel_latency: 0.0,
                pitch_frequency: 15.0,
                pitch_damping_ratio: 1.0,
                ..params.clone()
            };
            self.run = Some(Run::new(&self.drive, &stiff, Some(&self.vehicle))?);
        }
        let Some(run) = &mut self.run else { return Ok(1.0) };
        if run.advance(&self.drive, steps)? {
            join(rows, run.estimates().series())?;
            (self.run, self.drive) = (None, Drive::default());
        } else {
            self.done = run.fraction(&self.drive).min(0.999);
        }
        Ok(self.done)
    }
}

/// Put the mean of both directions into the rows of the forward one.
fn join(rows: &mut Channel<SlopeEstimate>, backward: &Series) -> Result<(), OutOfOrder> {
    const PAIRS: [[&str; 2]; 2] = [["grade", "grade_sigma"], ["altitude", "altitude_sigma"]];
    let forward = std::mem::take(rows).into_series();
    let index = |name| forward.index_of(name).zip(backward.index_of(name));
    let (speed, pairs) = (index("speed"), PAIRS.map(|pair| pair.map(index)));
    let (time, _, mut columns) = forward.into_columns();
    for (row, &time) in time.iter().enumerate() {
        let back = |column: usize| backward.interpolate(column, -time, WIDEST_GAP);
        if let Some((own, other)) = speed.filter(|s| back(s.1).is_finite()) {
            columns[own][row] = 0.5 * (columns[own][row] - back(other));
        }
        for pair in &pairs {
            if let [Some((value, other)), Some((sigma, other_sigma))] = *pair {
                let own = (columns[value][row], columns[sigma][row]);
                (columns[value][row], columns[sigma][row]) = mean(own, (back(other), back(other_sigma)));
            }
        }
    }
    *rows = Channel::from_columns(time, columns)?;
    Ok(())
}

/// Run the slope estimator forward and backward over `drive` and join both.
///
/// # Errors
/// Those of the forward run.
pub fn run_two_way(drive: &Drive, params: &SlopeParams, vehicle: Option<&VehicleParams>) -> Result<Series, RunError> {
    let params = SlopeParams { two_way: true, ..params.clone() };
    Ok(run::<Slope>(drive, &params, vehicle)?.into_series())
}
