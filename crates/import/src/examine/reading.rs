//! A drive as a mapping reads it, on a grid of tenths of a second.
//!
//! All series are in SI units and the frames of a drive. What the inertial sensors say is kept apart from what the
//! motion over ground says of the same, so that a wrong sign shows as a difference.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::{STANDARD_GRAVITY, radii};

use super::linear::{dot, lean_rows};
use super::run::shifted;
use super::scene::{Field, STEP, slope};
use super::survey::{canonical_unit, channel};
use super::thinned::Thinned;
use crate::channels::signal;
use crate::clock::median;
use crate::mapping::Mapping;
use crate::units;

/// Bins on either side over which the motion over ground is taken: fixes may come once a second.
pub(crate) const REACH: usize = 10;
/// Time after which the lean is what the accelerometer says, s.
const SETTLED: f64 = 4.0;
/// Slower, a car has no course, m/s.
const MOVING: f64 = 2.0;

/// What a mapping makes of thinned columns; every series has one value per bin, not a number where nothing is known.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reading {
    /// Number of bins.
    pub bins: usize,
    /// Places, m to the north and to the east of the first one.
    pub place: [Vec<f64>; 2],
    /// Speed over ground (m/s), course (rad) and its rate (rad/s), where a receiver tells them.
    pub ground: Option<[Vec<f64>; 3]>,
    /// What the car reports as its speed, m/s.
    pub speed: Option<Vec<f64>>,
    /// The speed that the accelerometer is held against, m/s: the car's where it agrees with that over ground.
    pub pace: Vec<f64>,
    /// The rate of turn that the rest is held against, rad/s: over ground, else the gyro's.
    pub turn: Vec<f64>,
    /// Specific force, turned on the mount, m/s^2.
    pub force: [Vec<f64>; 3],
    /// Rates, turned on the mount, rad/s.
    pub rates: [Vec<f64>; 3],
    /// Magnetic field, turned on the mount, uT.
    pub field: [Vec<f64>; 3],
    /// Rise of the road over the way by the heights, rad.
    pub grade: Vec<f64>,
}

/// One signal in SI units, each sample at its own time: `None` where it is not mapped or has no value.
pub(crate) fn series(thin: &Thinned, mapping: &Mapping, name: &str) -> Option<Vec<f64>> {
    let source = mapping.signals.get(name)?;
    let raw = &thin.columns[thin.names.iter().position(|n| *n == source.column)?];
    if raw.len() != thin.bins() {
        return None;
    }
    let si = signal(name)?.unit;
    let factor = source.scale * units::factor(source.unit.as_deref().unwrap_or(canonical_unit(name)), si)?;
    let known = |v: &f64| if source.blank.contains(v) { f64::NAN } else { v * factor + source.offset };
    let values: Vec<f64> = raw.iter().map(known).collect();
    let late = channel(name).and_then(|c| mapping.delays.get(c)).copied().unwrap_or(0.0);
    let values = if late == 0.0 { values } else { shifted(&values, late) };
    values.iter().any(|v| v.is_finite()).then_some(values)
}

impl Reading {
    /// Read thinned columns by a mapping.
    pub fn new(thin: &Thinned, mapping: &Mapping) -> Self {
        let bins = thin.bins();
        let get = |name: &str| series(thin, mapping, name);
        let triad = |names: [&str; 3], channel: &str| turned(names.map(get), mapping, channel, bins);
        let mut r = Self {
            bins,
            force: triad(["accel_x", "accel_y", "accel_z"], "imu"),
            rates: triad(["gyro_x", "gyro_y", "gyro_z"], "imu"),
            field: triad(["mag_x", "mag_y", "mag_z"], "mag"),
            place: places(get("gnss_lat"), get("gnss_lon"), bins),
            ..Self::default()
        };
        let velocity = match (get("gnss_vn"), get("gnss_ve")) {
            (Some(north), Some(east)) => Some([north, east]),
            _ if r.place[0].iter().any(|v| v.is_finite()) => Some(r.place.each_ref().map(|p| slope(p, REACH))),
            _ => None,
        };
        r.ground = velocity.map(|v| over_ground(&v));
        const SPEEDS: [&str; 5] = ["speed", "wheel_speed_rl", "wheel_speed_rr", "wheel_speed_fl", "wheel_speed_fr"];
        r.speed = SPEEDS.iter().find_map(|n| get(n));
        r.pace = r.paces();
        r.turn = r.ground.as_ref().map_or_else(|| r.rates[2].clone(), |g| g[2].clone());
        let height = get("gnss_alt").or_else(|| get("baro_alt"));
        r.grade = height.map_or_else(|| vec![f64::NAN; bins], |h| grade(&h, &r.pace));
        r
    }

    /// The car's speed where it is that over ground within a tenth, since it is faster and smoother; else that over ground.
    fn paces(&self) -> Vec<f64> {
        match (&self.speed, &self.ground) {
            (Some(own), Some(ground)) => {
                let moving = own.iter().zip(&ground[0]).filter(|(_, g)| **g > MOVING);
                let ratio = median(moving.map(|(o, g)| o / g).filter(|r| r.is_finite()).collect());
                if (0.9..1.1).contains(&ratio) { own.clone() } else { ground[0].clone() }
            }
            (Some(own), None) => own.clone(),
            (None, Some(ground)) => ground[0].clone(),
            (None, None) => vec![f64::NAN; self.bins],
        }
    }

    /// Change of the speed, m/s^2, and speed times rate of turn, m/s^2: what the accelerometer shows on a level road.
    pub fn expected(&self) -> [Vec<f64>; 2] {
        let sideways = self.pace.iter().zip(&self.turn).map(|(v, r)| v * r).collect();
        [slope(&self.pace, REACH), sideways]
    }

    /// Roll and pitch by what gravity adds to the accelerometer, rad.
    pub fn lean_by_force(&self) -> [Vec<f64>; 2] {
        let [change, sideways] = self.expected();
        let angle = |share: f64| (share / STANDARD_GRAVITY).clamp(-1.0, 1.0).asin();
        let smooth = |v: &[f64]| {
            let field = Field::made(v.to_vec());
            move |i: usize| field.mean(i as f64 * STEP - 0.2, (i as f64 + 1.0) * STEP + 0.2)
        };
        let (x, y) = (smooth(&self.force[0]), smooth(&self.force[1]));
        let roll = (0..self.bins).map(|i| angle(sideways[i] - y(i))).collect();
        let pitch = (0..self.bins).map(|i| angle(x(i) - change[i])).collect();
        [roll, pitch]
    }

    /// Roll, pitch and the sum of all turning, rad, as the inertial sensors say: gyros, led to the lean by gravity.
    pub fn attitude(&self) -> [Vec<f64>; 3] {
        let lean = self.lean_by_force();
        let rest: Vec<usize> = (0..self.bins).filter(|i| self.pace[*i].abs() < 0.2).collect();
        let bias = self.rates.each_ref().map(|r| {
            let still: Vec<f64> = rest.iter().map(|i| r[*i]).filter(|v| v.is_finite()).collect();
            if still.len() < 10 { 0.0 } else { still.iter().sum::<f64>() / still.len() as f64 }
        });
        let led = |axis: usize| {
            let mut angle = lean[axis].iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
            let one = |i: usize| {
                let (rate, to) = (self.rates[axis][i] - bias[axis], lean[axis][i]);
                let part = if rate.is_finite() { STEP / SETTLED } else { 4.0 * STEP / SETTLED };
                angle += if rate.is_finite() { rate * STEP } else { 0.0 };
                angle += part * if to.is_finite() { to - angle } else { -angle };
                angle
            };
            (0..self.bins).map(one).collect()
        };
        let mut heading = 0.0;
        let turned = self.rates[2].iter().map(|r| {
            heading += if r.is_finite() { (r - bias[2]) * STEP } else { 0.0 };
            if r.is_finite() { heading } else { f64::NAN }
        });
        [led(0), led(1), turned.collect()]
    }

    /// Where a compass made of the field points, rad from magnetic north, clockwise.
    pub fn compass(&self) -> Vec<f64> {
        self.field[0].iter().zip(&self.field[1]).map(|(x, y)| (-y).atan2(*x)).collect()
    }
}

/// A triad turned on its mount; axes that are missing are without values.
fn turned(axes: [Option<Vec<f64>>; 3], mapping: &Mapping, channel: &str, bins: usize) -> [Vec<f64>; 3] {
    let is_whole = axes.iter().all(Option::is_some);
    let mut axes = axes.map(|a| a.unwrap_or_else(|| vec![f64::NAN; bins]));
    axes.iter_mut().for_each(|a| a.resize(bins, f64::NAN));
    let Some(mount) = mapping.mounts.get(channel).filter(|_| is_whole) else { return axes };
    let rows = lean_rows([mount.roll_deg, mount.pitch_deg, mount.yaw_deg].map(f64::to_radians));
    for i in 0..bins {
        let v = [axes[0][i], axes[1][i], axes[2][i]];
        for (axis, row) in axes.iter_mut().zip(rows) {
            axis[i] = dot(row, v);
        }
    }
    axes
}

/// Metres to the north and to the east of the first place.
fn places(lat: Option<Vec<f64>>, lon: Option<Vec<f64>>, bins: usize) -> [Vec<f64>; 2] {
    let nowhere = || [vec![f64::NAN; bins], vec![f64::NAN; bins]];
    let (Some(lat), Some(lon)) = (lat, lon) else { return nowhere() };
    let is_place = |i: &usize| lat[*i].is_finite() && lon[*i].is_finite() && (lat[*i] != 0.0 || lon[*i] != 0.0);
    let Some(first) = (0..bins.min(lat.len()).min(lon.len())).find(is_place) else { return nowhere() };
    let (lat0, lon0) = (lat[first], lon[first]);
    let (meridian, vertical) = radii(lat0);
    let metres = |i: usize| {
        if !is_place(&i) {
            return [f64::NAN; 2];
        }
        [(lat[i] - lat0) * meridian, wrap_angle(lon[i] - lon0) * vertical * lat0.cos()]
    };
    let both: Vec<[f64; 2]> = (0..bins).map(metres).collect();
    [0, 1].map(|k| both.iter().map(|p| p[k]).collect())
}

/// Speed, course and rate of the course of a velocity over ground.
fn over_ground([north, east]: &[Vec<f64>; 2]) -> [Vec<f64>; 3] {
    let speed: Vec<f64> = north.iter().zip(east).map(|(n, e)| n.hypot(*e)).collect();
    let course = |i: usize| if speed[i] > MOVING { east[i].atan2(north[i]) } else { f64::NAN };
    let courses: Vec<f64> = (0..speed.len()).map(course).collect();
    let mut sum = 0.0;
    let mut last = f64::NAN;
    let unwound: Vec<f64> = courses
        .iter()
        .map(|c| {
            sum += if c.is_finite() && last.is_finite() { wrap_angle(c - last) } else { 0.0 };
            last = if c.is_finite() { *c } else { last };
            if c.is_finite() { sum } else { f64::NAN }
        })
        .collect();
    let rate = slope(&unwound, REACH / 2);
    [speed, courses, rate]
}

/// Rise of the road over the way of some seconds, rad.
fn grade(height: &[f64], pace: &[f64]) -> Vec<f64> {
    let climb = slope(height, 2 * REACH);
    let one = |i: usize| if pace[i] > MOVING { (climb[i] / pace[i]).atan() } else { f64::NAN };
    (0..climb.len().min(pace.len())).map(one).collect()
}
