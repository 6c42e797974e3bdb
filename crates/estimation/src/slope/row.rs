//! What one epoch measured: read from its samples, range-checked, with the error that the wheel speed is given.

use drivescope_drive::drive::Epoch;
use drivescope_drive::signals::{Gnss, Imu, Steering};

use super::motion::Measured;
use super::{OUT_OF_RANGE, Slope, WHEEL_JUMPED, WHEEL_LEFT_OUT, grade};

/// Beyond these a measurement is a fault: specific force m/s^2, yaw rate rad/s, wheel speed m/s, road-wheel angle rad.
pub(super) const LARGEST_ACCEL: f64 = 50.0;
const LARGEST_YAW_RATE: f64 = 20.0;
pub(super) const LARGEST_WHEEL: f64 = 100.0;
const LARGEST_STEER: f64 = 1.2;
/// A wheel speed with a larger normalized innovation squared is a fault: 30 sigmas.
const LARGEST_WHEEL_NIS: f64 = 1000.0;
/// A wheel speed that stays beyond that for so long is believed, s.
const JUMP_TIME: f64 = 0.1;
/// Higher or lower than any road, m.
const LARGEST_ALTITUDE: f64 = 1e4;

/// What one epoch measured, range-checked; NaN where there is nothing.
pub(super) struct Row {
    pub(super) wheel: f64,
    /// Error of the wheel speed from axles that disagree, m/s.
    pub(super) disagreement: f64,
    /// The same from a shake; the grade filter's.
    shake: f64,
    yaw_rate: f64,
    accel_x: f64,
    accel_y: f64,
    pub(super) altitude: f64,
    /// Height of the receiver and the variance of its error.
    pub(super) height: (f64, f64),
    pub(super) upward: f64,
    has_imu: bool,
}

impl Slope {
    pub(super) fn hold_steering(&mut self, steering: &Steering, time: f64) {
        let angle =
            if steering.steer.is_finite() { steering.steer } else { steering.steering_wheel / self.steering_ratio };
        if angle.abs() <= LARGEST_STEER {
            self.steer = angle;
        } else if angle.is_finite() {
            self.notices.add(OUT_OF_RANGE, time);
        }
    }

    /// The epoch's measurements; `None` if it holds no sensor that is used.
    pub(super) fn row(&mut self, epoch: &Epoch) -> Option<Row> {
        let altitude = epoch.baro.filter(|_| self.params.use_baro).map_or(f64::NAN, |b| b.altitude);
        let fix = epoch.gnss.filter(|g| g.is_usable());
        let upward = fix.filter(|_| self.params.use_gnss).map_or(f64::NAN, |g| -g.v_down);
        let height = fix.filter(|_| self.params.use_gnss_height).map_or((f64::NAN, f64::NAN), |g| self.height(&g));
        let has_aid = altitude.is_finite() || upward.is_finite() || height.0.is_finite();
        if epoch.imu.is_none() && epoch.wheels.is_none() && !has_aid {
            return None;
        }
        let imu = epoch.imu.map_or_else(Imu::default, |imu| self.inertial.pass(epoch.time, imu));
        let wheel = epoch.wheels.map_or(f64::NAN, |w| w.forward_speed());
        if self.params.shake_check {
            self.shake.feel(epoch.time, imu.accel_z);
        }
        let (disagreement, shake) = match &epoch.wheels {
            Some(wheels) if self.params.axle_check => {
                let doubt = self.axles.doubt(epoch.time, wheels, self.steer, 2.0 * self.params.wheel_sigma);
                (doubt, self.shake.doubt(epoch.time))
            }
            Some(_) => (0.0, self.shake.doubt(epoch.time)),
            None => (0.0, 0.0),
        };
        let mut screen = |value: f64, largest: f64| {
            if value.abs() <= largest {
                return value;
            }
            if !value.is_nan() {
                self.notices.add(OUT_OF_RANGE, epoch.time);
            }
            f64::NAN
        };
        Some(Row {
            wheel: screen(wheel, LARGEST_WHEEL),
            disagreement,
            shake,
            yaw_rate: screen(imu.gyro_z, LARGEST_YAW_RATE),
            accel_x: screen(imu.accel_x, LARGEST_ACCEL) - self.params.accel_offset,
            accel_y: screen(imu.accel_y, LARGEST_ACCEL),
            altitude: screen(altitude, LARGEST_ALTITUDE),
            height: (screen(height.0, LARGEST_ALTITUDE), height.1),
            upward: screen(upward, LARGEST_WHEEL),
            has_imu: epoch.imu.is_some(),
        })
    }

    /// Leave out a wheel speed that is beyond belief; whether it has stayed there so long that it is the truth.
    pub(super) fn has_jumped(&mut self, row: &mut Row, time: f64) -> bool {
        if row.wheel.is_nan() {
            return false;
        }
        let sigma = self.grade_wheel_sigma(row);
        let away = row.wheel - self.grade.x[grade::SPEED];
        if away * away <= LARGEST_WHEEL_NIS * (self.grade.p[(grade::SPEED, grade::SPEED)] + sigma * sigma) {
            self.jumped = None;
            return false;
        }
        let since = *self.jumped.get_or_insert(time);
        let has_stayed = time - since >= JUMP_TIME;
        self.notices.add(if has_stayed { WHEEL_JUMPED } else { WHEEL_LEFT_OUT }, time);
        if has_stayed {
            self.jumped = None;
        } else {
            row.wheel = f64::NAN;
        }
        has_stayed
    }

    /// Height that a fix gives, and the variance of its error.
    pub(super) fn height(&self, fix: &Gnss) -> (f64, f64) {
        let sigma = if fix.std_down > 0.0 { fix.std_down } else { self.params.gnss_height_sigma };
        (if fix.alt.is_finite() { fix.alt } else { -fix.down }, sigma * sigma)
    }

    /// Error of a wheel speed: from `low_speed` down to standstill it rises to `low_speed_gain` times `sigma`; a `doubt` comes
    /// on top.
    pub(super) fn wheel_sigma(&self, sigma: f64, row: &Row, doubt: f64) -> f64 {
        let shortfall = (1.0 - row.wheel.abs() / self.params.low_speed).max(0.0);
        let sigma = sigma * (1.0 + (self.params.low_speed_gain - 1.0) * shortfall);
        if doubt > 0.0 { sigma.hypot(doubt) } else { sigma }
    }

    /// The same in the grade filter.
    pub(super) fn grade_wheel_sigma(&self, row: &Row) -> f64 {
        self.wheel_sigma(self.params.grade_wheel_sigma, row, row.disagreement.hypot(row.shake))
    }

    pub(super) fn measured(&self, row: &Row) -> Measured {
        Measured {
            wheel: row.wheel,
            wheel_sigma: self.wheel_sigma(self.params.wheel_sigma, row, row.disagreement),
            yaw_rate: row.yaw_rate,
            accel_x: row.accel_x,
            accel_y: row.accel_y,
            rear_axle: self.params.rear_axle_aid && row.has_imu,
        }
    }
}
