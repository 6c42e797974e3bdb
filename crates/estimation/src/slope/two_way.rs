//! Grade from both sides: the estimator run forward and, over the same drive played backward, once more.
//!
//! A car that drives backward through time obeys the same equations: speeds and turn rates change sign, forces and grades
//! do not. Only the body's oscillation on its springs does not reverse (its damping would feed it); in the backward run it
//! is critically damped and fast, so that the static squat remains. The lag of one run is the lead of the other.
//! The mean is weighted by the stated variances. The two runs share their input at the moment itself and the bias of the
//! accelerometer: the stated sigma is that of the better run, not less.

use drivescope_drive::channel::{Channel, OutOfOrder, Record, Series};
use drivescope_drive::drive::Drive;
use drivescope_drive::record;
use drivescope_drive::signals::{Gnss, Imu, Wheels};
use drivescope_drive::vehicle::VehicleParams;

use super::{Slope, SlopeParams};
use crate::estimator::{RunError, run};

record! {
    /// Road grade and altitude at one instant, from the whole drive.
    pub struct TwoWayEstimate {
        /// Forward speed.
        speed: "m/s", truth "vx";
        /// Grade of the road, uphill positive.
        grade: "rad", truth "grade";
        /// 1-sigma of the road grade.
        grade_sigma: "rad", sigma_of "grade";
        /// Altitude, counted as the slope estimator counts it.
        altitude: "m";
        /// 1-sigma of the altitude.
        altitude_sigma: "m", sigma_of "altitude";
    }
}

fn reversed<R: Record>(channel: &Channel<R>, turn: impl Fn(R) -> R) -> Result<Channel<R>, OutOfOrder> {
    let mut out = Channel::default();
    out.reserve(channel.len());
    (0..channel.len()).rev().try_for_each(|i| {
        let (time, sample) = channel.at(i);
        out.push(-time, turn(sample))
    })?;
    Ok(out)
}

/// The drive played backward: time is negated, and with it every speed and turn rate. Truth is left out.
///
/// # Errors
/// [`OutOfOrder`], which a drive that was put together cannot cause.
pub fn played_backward(drive: &Drive) -> Result<Drive, OutOfOrder> {
    let imu = |s: Imu| Imu { gyro_x: -s.gyro_x, gyro_y: -s.gyro_y, gyro_z: -s.gyro_z, ..s };
    let wheels = |s: Wheels| Wheels {
        speed: -s.speed,
        wheel_speed_fl: -s.wheel_speed_fl,
        wheel_speed_fr: -s.wheel_speed_fr,
        wheel_speed_rl: -s.wheel_speed_rl,
        wheel_speed_rr: -s.wheel_speed_rr,
    };
    let gnss = |s: Gnss| Gnss { v_north: -s.v_north, v_east: -s.v_east, v_down: -s.v_down, course: f64::NAN, ..s };
    Ok(Drive {
        imu: reversed(&drive.imu, imu)?,
        wheels: reversed(&drive.wheels, wheels)?,
        steering: reversed(&drive.steering, |s| s)?,
        gnss: reversed(&drive.gnss, gnss)?,
        baro: reversed(&drive.baro, |s| s)?,
        vehicle: drive.vehicle.clone(),
        ..Drive::default()
    })
}

/// Mean of two estimates weighted by their variances, and the smaller sigma; NaN where either has none.
fn mean(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    let (u, v) = (b.1 * b.1, a.1 * a.1);
    ((a.0 * u + b.0 * v) / (u + v), a.1.min(b.1))
}

/// Run the slope estimator forward and backward over `drive` and join both.
///
/// # Errors
/// Those of the runs.
pub fn run_two_way(drive: &Drive, params: &SlopeParams, vehicle: Option<&VehicleParams>) -> Result<Series, RunError> {
    let forward = run::<Slope>(drive, params, vehicle)?.into_series();
    let stiff = SlopeParams { pitch_frequency: 15.0, pitch_damping_ratio: 1.0, ..params.clone() };
    let backward = run::<Slope>(&played_backward(drive)?, &stiff, vehicle)?.into_series();
    let cell = |series: &Series, row: usize, name: &str| series.column(name).map_or(f64::NAN, |c| c[row]);
    let mut out = Channel::<TwoWayEstimate>::default();
    out.reserve(forward.len());
    // Both have an estimate at nearly every epoch, the backward one in the opposite order.
    let mut other = backward.len();
    for (row, &time) in forward.time().iter().enumerate() {
        while other > 0 && -backward.time()[other - 1] < time {
            other -= 1;
        }
        if other == 0 {
            break;
        }
        if -backward.time()[other - 1] != time {
            continue;
        }
        let pair = |series, row, name, sigma| (cell(series, row, name), cell(series, row, sigma));
        let both = |name, sigma| mean(pair(&forward, row, name, sigma), pair(&backward, other - 1, name, sigma));
        let (grade, grade_sigma) = both("grade", "grade_sigma");
        let (altitude, altitude_sigma) = both("altitude", "altitude_sigma");
        let speed = 0.5 * (cell(&forward, row, "speed") - cell(&backward, other - 1, "speed"));
        out.push(time, TwoWayEstimate { speed, grade, grade_sigma, altitude, altitude_sigma })?;
    }
    Ok(out.into_series())
}
