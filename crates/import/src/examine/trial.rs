//! A drive as a mapping reads it, on a grid of tenths of a second: what a person sees who changes the mapping by hand.
//!
//! The raw columns are thinned once; every change of the mapping is then tried on them without reading the file again.
//! All series are in SI units and the frames of a drive. What the inertial sensors say is kept apart from what the
//! motion over ground says of the same, so that a wrong sign shows as a difference.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::{STANDARD_GRAVITY, radii};

use super::clash::{Clash, clashes};
use super::lean_rows;
use super::run::shifted;
use super::scene::{Field, STEP, Scene, slope};
use super::survey::canonical_unit;
use crate::clock::median;
use crate::error::ImportError;
use crate::mapping::Mapping;
use crate::names::signal;
use crate::table::Table;
use crate::units;

/// Bins on either side over which the motion over ground is taken: fixes may come once a second.
pub(crate) const REACH: usize = 10;
/// Time after which the lean is what the accelerometer says, s.
const SETTLED: f64 = 4.0;
/// Slower, a car has no course, m/s.
const MOVING: f64 = 2.0;

/// Raw columns of a log, thinned to tenths of a second.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Thinned {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Middle of the first bin, s, on the clock of the drive.
    pub start: f64,
    /// Mean raw value in each bin, of each column; not a number where there is none near. Columns without values are empty.
    pub columns: Vec<Vec<f64>>,
}

impl Thinned {
    /// What a scene holds of a table with these times.
    pub(crate) fn new(table: &Table, time: &[f64], scene: Scene) -> Self {
        let start = time.iter().copied().find(|t| t.is_finite()).unwrap_or(0.0) + 0.5 * STEP;
        let names = table.columns.iter().map(|c| c.name.clone()).collect();
        Self { names, start, columns: scene.fields.into_iter().map(|f| f.grid).collect() }
    }

    fn bins(&self) -> usize {
        self.columns.iter().map(Vec::len).max().unwrap_or(0)
    }
}

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
    let late = super::channel(name).and_then(|c| mapping.delays.get(c)).copied().unwrap_or(0.0);
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
            axis[i] = super::linear::dot(row, v);
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

/// What a mapping makes of a log, and where it contradicts itself.
#[derive(Clone, Debug, Default)]
pub struct Trial {
    /// Contradictions, the most basic first.
    pub clashes: Vec<Clash>,
    /// The series of [`TRIAL_SERIES`], in their order; all have one value per bin.
    pub series: Vec<Vec<f64>>,
}

/// Series of a trial; SI units and the frames of a drive. The first three are what the inertial sensors say, those that
/// are `expected` and over ground what the rest says of the same.
pub const TRIAL_SERIES: [&str; 17] = [
    "roll",
    "pitch",
    "turned",
    "accel_x",
    "accel_y",
    "accel_z",
    "gyro_z",
    "north",
    "east",
    "speed",
    "expected_x",
    "expected_y",
    "expected_turn",
    "course",
    "grade",
    "compass",
    "ground_speed",
];

/// Try a mapping on a thinned log: its motion, and what contradicts it.
///
/// # Errors
/// Those of [`Mapping::validate`].
pub fn try_out(thin: &Thinned, mapping: &Mapping) -> Result<Trial, ImportError> {
    mapping.validate("mapping.json")?;
    let r = Reading::new(thin, mapping);
    let clashes = clashes(thin, mapping, &r);
    let none = || vec![f64::NAN; r.bins];
    let ([roll, pitch, turned], [expected_x, expected_y], compass) = (r.attitude(), r.expected(), r.compass());
    let Reading { force: [ax, ay, az], rates: [_, _, gz], place: [north, east], ground, speed, grade, .. } = r;
    let speed = speed.unwrap_or_else(none);
    let [ground_speed, course, expected_turn] = ground.unwrap_or_else(|| [none(), none(), none()]);
    let series = vec![
        roll,
        pitch,
        turned,
        ax,
        ay,
        az,
        gz,
        north,
        east,
        speed,
        expected_x,
        expected_y,
        expected_turn,
        course,
        grade,
        compass,
        ground_speed,
    ];
    Ok(Trial { clashes, series })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::{SignalSource, TimeSource};

    const BINS: usize = 1200;

    /// A car that circles, brakes and speeds up, 10 samples a second; columns are named as the signals.
    fn driven() -> Thinned {
        let names = [
            "accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z", "speed", "gnss_vn", "gnss_ve", "mag_x",
            "mag_y", "mag_z",
        ];
        let mut columns = vec![Vec::new(); names.len()];
        let mut yaw: f64 = 0.3;
        for i in 0..BINS {
            let t = i as f64 * STEP;
            let (v, change) = (15.0 + 5.0 * (0.2 * t).sin(), (0.2 * t).cos());
            let rate = 0.2 * (0.13 * t).sin() + 0.1;
            let noise = |k: f64| 0.05 * (k * 1.9 * i as f64 + k).sin();
            let field = [20.0 * yaw.cos(), -20.0 * yaw.sin(), 43.0];
            let values = [
                change + noise(1.0),
                v * rate + noise(2.0),
                -STANDARD_GRAVITY + noise(3.0),
                0.01 * noise(4.0),
                0.01 * noise(5.0),
                rate + 0.01 * noise(6.0),
                v,
                v * yaw.cos(),
                v * yaw.sin(),
                field[0],
                field[1],
                field[2],
            ];
            columns.iter_mut().zip(values).for_each(|(c, v)| c.push(v));
            yaw += rate * STEP;
        }
        Thinned { names: names.map(String::from).to_vec(), start: 0.0, columns }
    }

    fn plain(thin: &Thinned) -> Mapping {
        let time =
            TimeSource { column: "t".into(), unit: "s".into(), offset: 0.0, fraction: None, skip_steps_back: false };
        let mut mapping = Mapping::of(time);
        for name in &thin.names {
            mapping.signals.insert(name.clone(), SignalSource::plain(name));
        }
        mapping
    }

    fn corrected(mapping: &mut Mapping, clash: &Clash) {
        for c in &clash.corrections {
            let source = mapping.signals.get_mut(&c.signal).unwrap();
            (source.unit, source.scale) = (Some(c.unit.clone()), c.scale);
        }
    }

    /// Catches a check that cries wolf: its sign convention is not the drive's.
    #[test]
    fn a_drive_in_canonical_columns_contradicts_nothing() {
        let thin = driven();
        let clashes = try_out(&thin, &plain(&thin)).unwrap().clashes;
        assert!(clashes.is_empty(), "{clashes:#?}");
    }

    /// Catches a contradiction that is not seen, that blames another column, or whose correction does not put it right.
    #[test]
    fn every_wrong_sign_and_unit_is_told_and_put_right() {
        let thin = driven();
        let wrong = [
            ("accel_x", None, -1.0),
            ("accel_y", None, -1.0),
            ("accel_z", None, -1.0),
            ("gyro_z", None, -1.0),
            ("gyro_z", Some("deg/s"), 1.0),
            ("gyro_z", Some("deg/s"), -1.0),
            ("speed", Some("km/h"), 1.0),
            ("speed", Some("mph"), -1.0),
            ("mag_y", None, -1.0),
        ];
        for (name, unit, scale) in wrong {
            let mut mapping = plain(&thin);
            let source = mapping.signals.get_mut(name).unwrap();
            (source.unit, source.scale) = (unit.map(String::from), scale);
            let found = try_out(&thin, &mapping).unwrap().clashes;
            let [clash] = &found[..] else { panic!("{name} {unit:?} {scale}: {found:#?}") };
            assert_eq!(clash.columns, [name]);
            assert!(clash.text.contains(|c: char| c.is_ascii_digit()), "{}", clash.text);
            corrected(&mut mapping, clash);
            let left = try_out(&thin, &mapping).unwrap().clashes;
            // The unit of a sensor is that of its three axes; these were right before.
            let left: Vec<_> = left.iter().filter(|c| c.signals == [name]).collect();
            assert!(left.is_empty(), "{name} {unit:?} {scale}: {left:#?}");
        }
    }

    /// Catches units of a whole triad that are corrected one axis at a time, and a compass that points backwards.
    #[test]
    fn a_triad_in_another_unit_is_put_right_as_a_whole() {
        let thin = driven();
        for (names, unit, scale) in
            [(["accel_x", "accel_y", "accel_z"], "g", 1.0), (["mag_x", "mag_y", "mag_z"], "nT", 1.0)]
        {
            let mut mapping = plain(&thin);
            for name in names {
                let source = mapping.signals.get_mut(name).unwrap();
                (source.unit, source.scale) = (Some(unit.into()), scale);
            }
            let found = try_out(&thin, &mapping).unwrap().clashes;
            corrected(&mut mapping, &found[0]);
            assert!(try_out(&thin, &mapping).unwrap().clashes.is_empty(), "{found:#?}");
        }
        let mut mapping = plain(&thin);
        for name in ["mag_x", "mag_y"] {
            mapping.signals.get_mut(name).unwrap().scale = -1.0;
        }
        let found = try_out(&thin, &mapping).unwrap().clashes;
        assert_eq!(found[0].columns, ["mag_x", "mag_y"]);
    }

    /// Catches a circle at one speed whose lateral force is on the wrong side and correlates with nothing.
    #[test]
    fn a_sensor_that_looks_backwards_in_a_steady_circle_is_turned_round() {
        let mut thin = driven();
        let (v, rate) = (7.0, 0.25);
        for i in 0..BINS {
            let yaw = rate * i as f64 * STEP;
            let noise = 0.2 * (1.7 * i as f64).sin();
            let values = [noise, -v * rate + noise, -STANDARD_GRAVITY, 0.0, 0.0, rate, v, v * yaw.cos(), v * yaw.sin()];
            thin.columns.iter_mut().zip(values).for_each(|(c, v)| c[i] = v);
            (thin.columns[9][i], thin.columns[10][i]) = (20.0 * yaw.cos(), -20.0 * yaw.sin());
        }
        let mut mapping = plain(&thin);
        let found = try_out(&thin, &mapping).unwrap().clashes;
        let [clash] = &found[..] else { panic!("{found:#?}") };
        assert_eq!(clash.columns, ["accel_y"]);
        corrected(&mut mapping, clash);
        assert_eq!(["accel_x", "accel_y", "accel_z"].map(|n| mapping.signals[n].scale), [-1.0, -1.0, 1.0]);
        assert!(try_out(&thin, &mapping).unwrap().clashes.is_empty());
    }

    /// Catches an attitude whose pitch or roll has the wrong sign: uphill the nose is up, and the body turns with the gyro.
    #[test]
    fn the_car_leans_and_turns_as_its_sensors_say() {
        let mut thin = driven();
        let (up, right) = (0.1_f64, 0.05_f64);
        for i in 0..BINS {
            thin.columns[0][i] += STANDARD_GRAVITY * up.sin();
            thin.columns[1][i] -= STANDARD_GRAVITY * right.sin();
        }
        let trial = try_out(&thin, &plain(&thin)).unwrap();
        let of = |name: &str| &trial.series[TRIAL_SERIES.iter().position(|n| *n == name).unwrap()];
        assert!((of("pitch")[600] - up).abs() < 0.03 && (of("roll")[600] - right).abs() < 0.03);
        let turned = of("turned")[600] - of("turned")[400];
        let course = wrap_angle(of("course")[600] - of("course")[400]);
        assert!(wrap_angle(turned - course).abs() < 0.05, "{turned} {course}");
    }
}
