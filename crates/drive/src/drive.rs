//! A drive: what was measured, on one clock, and its epochs in time order.

use crate::channel::{Channel, Record, Series};
use crate::disk::Disk;
use crate::geodesy::{Geodetic, LocalFrame};
use crate::satellites::{RAW_COLUMNS, RawGnss, Satellite};
use crate::signals::{AccelArray, Baro, Gnss, Imu, Mag, Range, Steering, Wheels};
use crate::vehicle::VehicleParams;

/// Everything measured on one drive, a channel per sensor at its own rate, and the truth where it is known.
#[derive(Clone, Debug, Default)]
pub struct Drive {
    /// Name for people: file name or name of the built-in drive.
    pub name: String,
    /// Inertial sensor.
    pub imu: Channel<Imu>,
    /// Magnetometer.
    pub mag: Channel<Mag>,
    /// Speeds of the car.
    pub wheels: Channel<Wheels>,
    /// Steering.
    pub steering: Channel<Steering>,
    /// Satellite fixes.
    pub gnss: Channel<Gnss>,
    /// Ranges of single satellites; empty where the receiver gives fixes only.
    pub raw_gnss: RawGnss,
    /// Barometer.
    pub baro: Channel<Baro>,
    /// Six-accelerometer disk.
    pub accel_array: Channel<AccelArray>,
    /// Ultrasonic ring.
    pub range: Channel<Range>,
    /// The truth, over columns of [`TRUTH_COLUMNS`](crate::truth::TRUTH_COLUMNS); empty if unknown.
    pub truth: Series,
    /// Origin of local coordinates, where one was given; see [`Drive::set_origin`].
    pub local_origin: Option<Geodetic>,
    /// The car, where the drive says which.
    pub vehicle: Option<VehicleParams>,
    /// Where the rear axle is, seen from the inertial sensor, m ahead; where the drive says it.
    pub rear_axle: Option<f64>,
    /// Unix time of `t = 0`, s; where the drive knows it apart from its times.
    pub unix_zero: Option<f64>,
    /// The six-accelerometer disk as calibrated; where the drive says it.
    pub disk: Option<Disk>,
}

/// Everything measured at one instant; ranges of single satellites stay in the drive and are lent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Epoch<'a> {
    /// Time, s.
    pub time: f64,
    /// Inertial sensor.
    pub imu: Option<Imu>,
    /// Magnetometer.
    pub mag: Option<Mag>,
    /// Speeds of the car.
    pub wheels: Option<Wheels>,
    /// Steering.
    pub steering: Option<Steering>,
    /// Satellite fix.
    pub gnss: Option<Gnss>,
    /// Barometer.
    pub baro: Option<Baro>,
    /// Six-accelerometer disk.
    pub accel_array: Option<AccelArray>,
    /// Ultrasonic ring.
    pub range: Option<Range>,
    /// Ranges of the satellites then in view, at least one.
    pub raw_gnss: Option<&'a [Satellite]>,
}

/// Number of channels that are merged.
const CHANNELS: usize = 9;

/// Where a pass over the epochs stands. Holds no borrow, so that a pass can stop and go on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EpochCursor {
    next: [usize; CHANNELS],
}

/// Epochs of a drive in time order, from where a cursor stands; one epoch is filled over and over.
#[derive(Debug)]
pub struct Pass<'a, 'c> {
    drive: &'a Drive,
    cursor: &'c mut EpochCursor,
    /// Time of each channel's next sample, s; infinite at its end.
    due: [f64; CHANNELS],
    epoch: Epoch<'a>,
}

fn due(times: &[f64], next: usize) -> f64 {
    times.get(next).copied().unwrap_or(f64::INFINITY)
}

/// Put the sample that is due at `time` into its place, or empty the place.
#[inline(always)]
fn fill<R: Record>(channel: &Channel<R>, time: f64, next: &mut usize, due_time: &mut f64, place: &mut Option<R>) {
    if *due_time == time {
        *place = Some(channel.at(*next).1);
        *next += 1;
        *due_time = due(channel.time(), *next);
    } else if place.is_some() {
        *place = None;
    }
}

impl<'a> Pass<'a, '_> {
    /// The next epoch; `None` at the drive's end. Channels that share an instant share the epoch.
    #[expect(clippy::should_implement_trait, reason = "the epoch is lent, which an iterator cannot do")]
    #[inline]
    pub fn next(&mut self) -> Option<&Epoch<'a>> {
        let mut time = f64::INFINITY;
        for &due in &self.due {
            // No time is NaN; `f64::min` would look.
            if due < time {
                time = due;
            }
        }
        if time == f64::INFINITY {
            return None;
        }
        let (drive, n, due, epoch) = (self.drive, &mut self.cursor.next, &mut self.due, &mut self.epoch);
        epoch.time = time;
        fill(&drive.imu, time, &mut n[0], &mut due[0], &mut epoch.imu);
        fill(&drive.mag, time, &mut n[1], &mut due[1], &mut epoch.mag);
        fill(&drive.wheels, time, &mut n[2], &mut due[2], &mut epoch.wheels);
        fill(&drive.steering, time, &mut n[3], &mut due[3], &mut epoch.steering);
        fill(&drive.gnss, time, &mut n[4], &mut due[4], &mut epoch.gnss);
        fill(&drive.baro, time, &mut n[5], &mut due[5], &mut epoch.baro);
        fill(&drive.accel_array, time, &mut n[6], &mut due[6], &mut epoch.accel_array);
        fill(&drive.range, time, &mut n[7], &mut due[7], &mut epoch.range);
        epoch.raw_gnss = None;
        if due[8] == time {
            epoch.raw_gnss = Some(drive.raw_gnss.at(n[8]).1);
            n[8] += 1;
            due[8] = self::due(drive.raw_gnss.time(), n[8]);
        }
        Some(epoch)
    }
}

impl EpochCursor {
    /// The epochs of `drive` from here on; the cursor moves with them.
    pub fn pass<'a, 'c>(&'c mut self, drive: &'a Drive) -> Pass<'a, 'c> {
        let [imu, mag, wheels, steering, gnss, baro, accel_array, range] = drive.channels().map(Series::time);
        let times = [imu, mag, wheels, steering, gnss, baro, accel_array, range, drive.raw_gnss.time()];
        let due = std::array::from_fn(|i| due(times[i], self.next[i]));
        Pass { drive, cursor: self, due, epoch: Epoch::default() }
    }

    /// The next epoch of `drive`; `None` at its end. A [`pass`](Self::pass) is cheaper where there are many.
    pub fn next<'a>(&mut self, drive: &'a Drive) -> Option<Epoch<'a>> {
        self.pass(drive).next().copied()
    }

    /// Share of the drive's samples already passed, 0 to 1.
    pub fn fraction(&self, drive: &Drive) -> f64 {
        let total = drive.sample_count();
        if total == 0 { 1.0 } else { self.next.iter().sum::<usize>() as f64 / total as f64 }
    }
}

/// A physical signal that an estimator may need, whichever columns carry it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Signal {
    /// Forward accelerometer.
    AccelX,
    /// Rightward accelerometer.
    AccelY,
    /// Downward accelerometer.
    AccelZ,
    /// Roll gyro.
    GyroX,
    /// Pitch gyro.
    GyroY,
    /// Yaw gyro.
    GyroZ,
    /// Three-axis magnetometer.
    Mag,
    /// Forward speed, reported or from the wheels.
    ForwardSpeed,
    /// Steering angle of the road wheels or of the steering wheel.
    Steer,
    /// Satellite position, geodetic or local.
    GnssPosition,
    /// A satellite position, or the ranges that one can be computed from.
    SatellitePlace,
    /// Satellite velocity, or speed and course.
    GnssVelocity,
    /// Satellite course.
    GnssCourse,
    /// Satellite vertical velocity.
    GnssVerticalVelocity,
    /// Barometric altitude.
    BaroAltitude,
    /// Six-accelerometer disk.
    AccelArray,
    /// Three accelerometers and three gyros, or the six-accelerometer disk.
    SixAxes,
    /// Ranges of single satellites.
    RawGnss,
}

impl Signal {
    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::AccelX => "forward acceleration",
            Self::AccelY => "lateral acceleration",
            Self::AccelZ => "vertical acceleration",
            Self::GyroX => "roll rate",
            Self::GyroY => "pitch rate",
            Self::GyroZ => "yaw rate",
            Self::Mag => "magnetic field",
            Self::ForwardSpeed => "speed or wheel speeds",
            Self::Steer => "steering angle",
            Self::GnssPosition => "GNSS position",
            Self::SatellitePlace => "GNSS position or raw satellite ranges",
            Self::GnssVelocity => "GNSS velocity, or speed and course",
            Self::GnssCourse => "GNSS course",
            Self::GnssVerticalVelocity => "GNSS vertical velocity",
            Self::BaroAltitude => "barometric altitude",
            Self::AccelArray => "six-accelerometer disk",
            Self::SixAxes => "three accelerometers and three gyros (or the six-accelerometer disk)",
            Self::RawGnss => "raw GNSS ranges",
        }
    }
}

/// The channels' names for people, in the order of [`Drive::channels`].
const CHANNEL_NAMES: [&str; 8] =
    ["inertial", "magnetometer", "wheels", "steering", "gnss", "barometer", "accelerometer disk", "range"];

/// What one channel of a drive holds.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelSummary {
    /// Name for people.
    pub name: &'static str,
    /// Number of samples.
    pub rows: usize,
    /// Mean rate, Hz.
    pub rate: f64,
    /// Columns that hold a value, by canonical name.
    pub columns: Vec<&'static str>,
}

/// What a drive's first moments say: read once, before an estimator steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogStart {
    /// Median step of the inertial (or disk) channel, s; NaN if it has fewer than two samples.
    pub imu_step: f64,
    /// First forward or ground speed within the first second, m/s; NaN if none.
    pub speed: f64,
    /// Origin of local coordinates: as given, else truth's first place, else the first valid fix; `None` where positions are local already.
    pub origin: Option<Geodetic>,
    /// Where the rear axle is, seen from the inertial sensor, m ahead; `None` where the drive does not say.
    pub rear_axle: Option<f64>,
    /// When the drive began, decimal year; `None` where it does not say.
    pub date: Option<f64>,
    /// The six-accelerometer disk as calibrated; `None` where the drive does not say.
    pub disk: Option<Disk>,
}

impl LogStart {
    /// Nothing is known.
    pub const UNKNOWN: Self =
        Self { imu_step: f64::NAN, speed: f64::NAN, origin: None, rear_axle: None, date: None, disk: None };
}

impl Drive {
    /// The channels without their row types, in a fixed order; `truth` is not among them.
    pub fn channels(&self) -> [&Series; 8] {
        [
            self.imu.series(),
            self.mag.series(),
            self.wheels.series(),
            self.steering.series(),
            self.gnss.series(),
            self.baro.series(),
            self.accel_array.series(),
            self.range.series(),
        ]
    }

    /// The channels by name, with values that may be changed.
    pub(crate) fn channels_mut(&mut self) -> [(&'static str, &mut Series); 8] {
        [
            (CHANNEL_NAMES[0], self.imu.series_mut()),
            (CHANNEL_NAMES[1], self.mag.series_mut()),
            (CHANNEL_NAMES[2], self.wheels.series_mut()),
            (CHANNEL_NAMES[3], self.steering.series_mut()),
            (CHANNEL_NAMES[4], self.gnss.series_mut()),
            (CHANNEL_NAMES[5], self.baro.series_mut()),
            (CHANNEL_NAMES[6], self.accel_array.series_mut()),
            (CHANNEL_NAMES[7], self.range.series_mut()),
        ]
    }

    /// The channels that hold samples, with rate and the columns that hold a value.
    pub fn channel_summaries(&self) -> Vec<ChannelSummary> {
        fn summary(name: &'static str, time: &[f64], columns: Vec<&'static str>) -> ChannelSummary {
            let rate = (time.len() - 1) as f64 / (time[time.len() - 1] - time[0]);
            ChannelSummary { name, rows: time.len(), rate: if rate.is_finite() { rate } else { 0.0 }, columns }
        }
        let mut all: Vec<ChannelSummary> = (CHANNEL_NAMES.iter().zip(self.channels()).filter(|(_, c)| !c.is_empty()))
            .map(|(name, c)| summary(name, c.time(), c.schema().iter().map(|c| c.name).filter(|n| c.has(n)).collect()))
            .collect();
        if !self.raw_gnss.is_empty() {
            all.push(summary("raw gnss", self.raw_gnss.time(), RAW_COLUMNS.to_vec()));
        }
        all
    }

    /// Number of samples over all channels.
    pub fn sample_count(&self) -> usize {
        self.channels().iter().map(|c| c.len()).sum::<usize>() + self.raw_gnss.len()
    }

    /// First and last instant of any channel, s; `None` for an empty drive.
    pub fn span(&self) -> Option<(f64, f64)> {
        let ends = self
            .channels()
            .into_iter()
            .chain([&self.truth])
            .map(Series::time)
            .chain([self.raw_gnss.time()])
            .filter_map(|time| Some((*time.first()?, *time.last()?)));
        ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// A measured column by its canonical name.
    pub fn column(&self, name: &str) -> Option<(&Series, usize)> {
        self.channels().into_iter().find_map(|c| c.index_of(name).map(|i| (c, i)))
    }

    /// Everything measured, in time order.
    pub fn epochs(&self) -> impl Iterator<Item = Epoch<'_>> {
        let mut cursor = EpochCursor::default();
        std::iter::from_fn(move || cursor.next(self))
    }

    /// Whether the drive holds a value of this signal anywhere.
    pub fn has(&self, signal: Signal) -> bool {
        let has = |name: &str| self.column(name).is_some_and(|(s, i)| s.column_at(i).iter().any(|v| v.is_finite()));
        match signal {
            Signal::AccelX => has("accel_x"),
            Signal::AccelY => has("accel_y"),
            Signal::AccelZ => has("accel_z"),
            Signal::GyroX => has("gyro_x"),
            Signal::GyroY => has("gyro_y"),
            Signal::GyroZ => has("gyro_z"),
            Signal::Mag => has("mag_x") && has("mag_y") && has("mag_z"),
            Signal::ForwardSpeed => {
                ["speed", "wheel_speed_rl", "wheel_speed_rr", "wheel_speed_fl", "wheel_speed_fr"].into_iter().any(has)
            }
            Signal::Steer => has("steer") || has("steering_wheel"),
            Signal::GnssPosition => has("gnss_lat") && has("gnss_lon") || has("gnss_n") && has("gnss_e"),
            Signal::SatellitePlace => self.has(Signal::GnssPosition) || self.has(Signal::RawGnss),
            Signal::GnssVelocity => has("gnss_vn") && has("gnss_ve") || has("gnss_speed") && has("course"),
            Signal::GnssCourse => has("course") || has("gnss_vn") && has("gnss_ve"),
            Signal::GnssVerticalVelocity => has("gnss_vd"),
            Signal::BaroAltitude => has("baro_alt"),
            Signal::AccelArray => self.accel_array.series().schema().iter().all(|c| has(c.name)),
            Signal::SixAxes => {
                ["accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z"].into_iter().all(has)
                    || self.has(Signal::AccelArray)
            }
            Signal::RawGnss => !self.raw_gnss.is_empty(),
        }
    }

    /// What the first moments say; see [`LogStart`].
    pub fn start(&self) -> LogStart {
        let median_step = |time: &[f64]| {
            let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
            crate::select::median(&mut steps)
        };
        let imu_time = if self.imu.len() >= self.accel_array.len() { self.imu.time() } else { self.accel_array.time() };
        let soon = self.span().map_or(0.0, |s| s.0) + 1.0;
        let wheel = self.wheels.iter().take_while(|(t, _)| *t <= soon).map(|(_, w)| w.forward_speed());
        let gnss = self.gnss.iter().take_while(|(t, _)| *t <= soon).map(|(_, g)| g.ground_speed());
        let speed = wheel.chain(gnss).find(|v| v.is_finite()).unwrap_or(f64::NAN);
        let imu_step = median_step(imu_time);
        LogStart {
            imu_step,
            speed,
            origin: self.origin(),
            rear_axle: self.rear_axle,
            date: self.date(),
            disk: self.disk,
        }
    }

    /// When the drive began, decimal year: stated, or told by times that count from 1970 (2001 or later).
    pub fn date(&self) -> Option<f64> {
        let start = self.span()?.0;
        let unix = match self.unix_zero {
            Some(zero) => zero + start,
            None => start,
        };
        (1e9..4.2e9).contains(&unix).then(|| crate::magnetic_model::decimal_year(unix))
    }

    /// Give the origin of local coordinates. A truth that knows its latitude, longitude and height is put into the new frame.
    pub fn set_origin(&mut self, origin: Geodetic) {
        self.local_origin = Some(origin);
        let columns = ["lat", "lon", "alt", "n", "e", "d"].map(|name| self.truth.index_of(name));
        let [Some(lat), Some(lon), Some(alt), Some(n), Some(e), Some(d)] = columns else { return };
        let frame = LocalFrame::new(origin);
        for row in 0..self.truth.len() {
            let [lat, lon, alt] = [lat, lon, alt].map(|column| self.truth.column_at(column)[row]);
            if lat.is_finite() && lon.is_finite() && alt.is_finite() {
                let place = frame.to_ned(Geodetic { lat, lon, alt });
                for (column, value) in [n, e, d].into_iter().zip(place.iter()) {
                    self.truth.column_mut(column).1[row] = *value;
                }
            }
        }
    }

    /// Origin of local coordinates; see [`LogStart::origin`].
    pub fn origin(&self) -> Option<Geodetic> {
        if self.local_origin.is_some() {
            return self.local_origin;
        }
        let truth = ["lat", "lon", "alt"].map(|n| self.truth.column(n));
        if let [Some(lat), Some(lon), Some(alt)] = truth
            && let Some(i) = (0..lat.len()).find(|&i| lat[i].is_finite() && lon[i].is_finite() && alt[i].is_finite())
        {
            return Some(Geodetic { lat: lat[i], lon: lon[i], alt: alt[i] });
        }
        let fix = self.gnss.iter().map(|(_, g)| g).find(|g| g.is_usable() && g.lat.is_finite() && g.lon.is_finite())?;
        Some(Geodetic { lat: fix.lat, lon: fix.lon, alt: if fix.alt.is_finite() { fix.alt } else { 0.0 } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive() -> Drive {
        let mut d = Drive::default();
        for k in 0..50 {
            let t = k as f64 * 0.01;
            d.imu.push(t, Imu { gyro_z: t, ..Imu::default() }).unwrap();
            if k % 5 == 0 {
                d.wheels.push(t, Wheels { speed: 2.0, ..Wheels::default() }).unwrap();
            }
            d.mag.push(t + 0.003, Mag::default()).unwrap();
        }
        d
    }

    #[test]
    fn epochs_come_in_time_order_and_share_an_instant() {
        let d = drive();
        let epochs: Vec<Epoch> = d.epochs().collect();
        assert_eq!(epochs.len(), 100, "50 inertial instants, ten of them with wheels, and 50 magnetic ones");
        assert!(epochs.is_sorted_by(|a, b| a.time < b.time));
        assert!(epochs[0].imu.is_some() && epochs[0].wheels.is_some() && epochs[0].mag.is_none());
        assert!(epochs[1].mag.is_some() && epochs[1].imu.is_none());
    }

    #[test]
    fn raw_ranges_join_the_instant_they_belong_to_or_make_one() {
        let mut d = drive();
        let view = [Satellite { prn: 4, ..Satellite::default() }; 5];
        d.raw_gnss.push(0.02, &view).unwrap();
        d.raw_gnss.push(0.0217, &view[..2]).unwrap();
        let epochs: Vec<Epoch> = d.epochs().collect();
        assert_eq!(epochs.len(), 101);
        let with: Vec<_> = epochs.iter().filter_map(|e| Some((e.time, e.imu.is_some(), e.raw_gnss?.len()))).collect();
        assert_eq!(with, [(0.02, true, 5), (0.0217, false, 2)]);
        let mut cursor = EpochCursor::default();
        while cursor.next(&d).is_some() {}
        assert_eq!(cursor.fraction(&d), 1.0);
        assert!(d.has(Signal::RawGnss));
    }

    #[test]
    fn a_cursor_stops_and_goes_on_without_losing_an_epoch() {
        let d = drive();
        let mut cursor = EpochCursor::default();
        let mut times = Vec::new();
        loop {
            // A copy that is abandoned must not move the one that goes on.
            let mut abandoned = cursor;
            let _ = abandoned.next(&d);
            let Some(epoch) = cursor.next(&d) else { break };
            times.push(epoch.time);
        }
        assert_eq!(times, d.epochs().map(|e| e.time).collect::<Vec<_>>());
        assert_eq!(cursor.fraction(&d), 1.0);
    }

    #[test]
    fn the_start_of_a_log_tells_rate_and_speed() {
        let start = drive().start();
        assert!((start.imu_step - 0.01).abs() < 1e-12);
        assert_eq!(start.speed, 2.0);
        assert_eq!(start.origin, None);
    }

    #[test]
    fn a_signal_is_there_only_if_it_has_a_value() {
        let d = drive();
        assert!(d.has(Signal::GyroZ) && d.has(Signal::ForwardSpeed));
        assert!(!d.has(Signal::AccelX) && !d.has(Signal::Mag));
    }
}
