//! Where a drive contradicts itself as a mapping reads it: each with its numbers, and with what would put it right.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::STANDARD_GRAVITY;
use serde::Serialize;

use super::scene::{Field, STEP, slope};
use super::survey::canonical_unit;
use super::trial::{REACH, Reading, Thinned, series};
use crate::clock::median;
use crate::evidence::fit;
use crate::mapping::Mapping;
use crate::names::signal;
use crate::units;

/// Correlation from which a sign is told, and from which a scale is.
const TELLS: [f64; 2] = [0.6, 0.85];
/// Scales between these are not contradicted: a car leans, and a road climbs.
const SCALES: [f64; 2] = [0.72, 1.4];
/// A unit explains a scale this well, as the logarithm of the factor.
const NEAR: f64 = 0.12;

/// How one signal should be read instead.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correction {
    /// The signal.
    pub signal: String,
    /// Unit of its raw values.
    pub unit: String,
    /// Factor beside the unit.
    pub scale: f64,
}

/// A contradiction between what a mapping says and what the sensors measure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Clash {
    /// Signals that are read wrongly.
    pub signals: Vec<String>,
    /// Their raw columns.
    pub columns: Vec<String>,
    /// One sentence with numbers.
    pub text: String,
    /// What puts it right; empty where nothing simple does.
    pub corrections: Vec<Correction>,
}

/// What one signal measures against what others say that it should.
struct Against<'a> {
    name: &'static str,
    /// Signals that share its unit, itself among them.
    family: &'a [&'static str],
    /// What it is held against, in words.
    what: String,
    /// Expected and measured values.
    pairs: Vec<(f64, f64)>,
    /// Least standard deviation of what is expected.
    least: f64,
}

const ACCEL: [&str; 3] = ["accel_x", "accel_y", "accel_z"];
const GYRO: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];
const MAG: [&str; 3] = ["mag_x", "mag_y", "mag_z"];
const SPEEDS: [&str; 6] =
    ["speed", "wheel_speed_fl", "wheel_speed_fr", "wheel_speed_rl", "wheel_speed_rr", "gnss_speed"];

/// A mapping that is being held against itself.
struct Court<'a> {
    thin: &'a Thinned,
    mapping: &'a Mapping,
    r: &'a Reading,
    clashes: Vec<Clash>,
}

/// Every contradiction of a reading, the most basic first.
pub(crate) fn clashes(thin: &Thinned, mapping: &Mapping, r: &Reading) -> Vec<Clash> {
    let mut court = Court { thin, mapping, r, clashes: Vec::new() };
    court.velocities();
    court.speeds();
    let is_g = court.gravity();
    court.turning();
    court.forces(is_g);
    court.leaning();
    court.steering();
    court.compass();
    court.clashes
}

/// Means over two seconds at every half second of what is expected and what is measured.
fn pairs(expected: &[f64], measured: &[f64]) -> Vec<(f64, f64)> {
    let (a, b) = (Field::made(expected.to_vec()), Field::made(measured.to_vec()));
    let mean = |f: &Field, i: usize| f.mean((i - REACH) as f64 * STEP, (i + REACH) as f64 * STEP);
    (REACH..expected.len()).step_by(REACH / 2).map(|i| (mean(&a, i), mean(&b, i))).collect()
}

impl Court<'_> {
    /// Unit and factor with which a signal is read.
    fn reading(&self, name: &str) -> Option<(String, f64)> {
        let source = self.mapping.signals.get(name)?;
        Some((source.unit.clone().unwrap_or_else(|| canonical_unit(name).into()), source.scale))
    }

    fn label(&self, name: &str) -> String {
        self.mapping.signals.get(name).map_or(format!("`{name}`"), |s| format!("`{}`", s.column))
    }

    fn say(&mut self, signals: &[&str], text: String, corrections: Vec<Correction>) {
        let columns = signals.iter().filter_map(|s| self.mapping.signals.get(*s)).map(|s| s.column.clone()).collect();
        let signals = signals.iter().map(|s| (*s).to_owned()).collect();
        self.clashes.push(Clash { signals, columns, text, corrections });
    }

    fn flip(&self, names: &[&str]) -> Vec<Correction> {
        let one = |n: &&str| self.reading(n).map(|(unit, s)| Correction { signal: (*n).to_owned(), unit, scale: -s });
        names.iter().filter_map(one).collect()
    }

    /// Signals that read `ratio` times too much: in another unit if one explains it, else by a factor.
    fn rescale(&self, names: &[&str], ratio: f64) -> Vec<Correction> {
        let one = |n: &&str| {
            let (unit, scale) = self.reading(n)?;
            let si = signal(n)?.unit;
            let now = units::factor(&unit, si)?;
            let offered = units::spellings(si);
            let off = |u: &&str| units::factor(u, si).map_or(9.0, |f| (f * ratio / now).ln().abs());
            let best = offered.split(", ").min_by(|a, b| off(a).total_cmp(&off(b))).filter(|u| off(u) < NEAR);
            let (unit, scale) = best.map_or((unit, scale / ratio), |u| (u.to_owned(), scale));
            Some(Correction { signal: (*n).to_owned(), unit, scale })
        };
        names.iter().filter_map(one).collect()
    }

    /// Say it where a signal has the wrong sign or scale. True where the sign is wrong.
    fn hold(&mut self, case: Against) -> bool {
        let known = |p: &&(f64, f64)| p.0.is_finite() && p.1.is_finite();
        let count = case.pairs.iter().filter(known).count();
        let found = fit(case.pairs.iter().copied());
        let spread = found.spread * found.correlation.abs() / found.slope.abs();
        if count < 20 || !found.correlation.is_finite() || spread < case.least {
            return false;
        }
        let (c, scale) = (found.correlation, found.slope / found.correlation.abs());
        let (is_turned, size) = (c < -TELLS[0], scale.abs());
        let is_scaled = c.abs() > TELLS[1] && !(SCALES[0]..SCALES[1]).contains(&size);
        if !is_turned && !is_scaled {
            return false;
        }
        let label = self.label(case.name);
        let numbers = format!("correlation {c:.2}, scale {size:.2} over {count} values");
        let text = if is_turned {
            format!("{label} has the opposite sign of {}: {numbers}.", case.what)
        } else {
            format!("{label} is {size:.3} times {}: {numbers}.", case.what)
        };
        let scaled = if is_scaled { self.rescale(case.family, size) } else { Vec::new() };
        let turned = |mut c: Correction| {
            c.scale *= if is_turned && c.signal == case.name { -1.0 } else { 1.0 };
            c
        };
        let corrections = if is_scaled { scaled.into_iter().map(turned).collect() } else { self.flip(&[case.name]) };
        self.say(&[case.name], text, corrections);
        is_turned
    }

    /// Velocities against the change of the places.
    fn velocities(&mut self) {
        for (axis, name) in ["gnss_vn", "gnss_ve"].into_iter().enumerate() {
            let Some(v) = series(self.thin, self.mapping, name) else { continue };
            let what = format!("the change of {}", self.label(["gnss_lat", "gnss_lon"][axis]));
            let pairs = pairs(&slope(&self.r.place[axis], REACH), &v);
            self.hold(Against { name, family: &["gnss_vn", "gnss_ve", "gnss_vd"], what, pairs, least: 1.0 });
        }
    }

    /// Speeds against that over ground, in their unit and their sign.
    fn speeds(&mut self) {
        let Some(ground) = self.r.ground.as_ref().map(|g| g[0].clone()) else { return };
        let of = self.of_ground();
        for name in SPEEDS {
            let Some(own) = series(self.thin, self.mapping, name) else { continue };
            let moving: Vec<f64> = own
                .iter()
                .zip(&ground)
                .filter(|(_, g)| **g > 3.0)
                .map(|(o, g)| o / g)
                .filter(|r| r.is_finite())
                .collect();
            let (count, ratio) = (moving.len(), median(moving));
            if count < 100 || !ratio.is_finite() || ratio == 0.0 || (0.93..1.08).contains(&ratio) {
                continue;
            }
            let text = format!(
                "{} is {ratio:.3} times the speed over ground {of}: median of {:.0} s above 3 m/s.",
                self.label(name),
                count as f64 * STEP
            );
            let mut corrections = self.rescale(&[name], ratio.abs());
            corrections.iter_mut().for_each(|c| c.scale *= ratio.signum());
            self.say(&[name], text, corrections);
        }
    }

    fn of_ground(&self) -> String {
        let name = if self.mapping.signals.contains_key("gnss_vn") { "gnss_vn" } else { "gnss_lat" };
        format!("of {}", self.label(name))
    }

    /// Gravity: its size, and that it is felt upwards. True where its size is right.
    fn gravity(&mut self) -> bool {
        let force = &self.r.force;
        let size = |i: usize| (force[0][i].powi(2) + force[1][i].powi(2) + force[2][i].powi(2)).sqrt();
        let all: Vec<f64> = (0..self.r.bins).map(size).filter(|v| v.is_finite()).collect();
        if all.len() < 20 {
            return false;
        }
        let ratio = median(all) / STANDARD_GRAVITY;
        let down = median(force[2].iter().copied().filter(|v| v.is_finite()).collect());
        if !(0.89..1.12).contains(&ratio) {
            let text = format!(
                "the accelerometer's magnitude has a median of {:.3} m/s^2, {ratio:.3} times gravity's 9.807.",
                ratio * STANDARD_GRAVITY
            );
            // Near nothing, gravity was taken out, and no unit brings it back.
            let corrections = if (0.002..0.05).contains(&ratio) { Vec::new() } else { self.rescale(&ACCEL, ratio) };
            self.say(&ACCEL, text, corrections);
        } else if down > 0.6 * STANDARD_GRAVITY {
            let text = format!(
                "{} has a median of {down:+.2} m/s^2: its axis points up, and z is down.",
                self.label("accel_z")
            );
            let corrections = self.flip(&["accel_z"]);
            self.say(&["accel_z"], text, corrections);
        } else if down.abs() < 0.6 * STANDARD_GRAVITY {
            let text = format!(
                "gravity does not lie along {}, whose median is {down:+.2} m/s^2: the housing sits on its side, or axes are exchanged.",
                self.label("accel_z")
            );
            self.say(&ACCEL, text, Vec::new());
        }
        (0.89..1.12).contains(&ratio)
    }

    /// The yaw gyro against the rate of the course.
    fn turning(&mut self) {
        let Some(ground) = &self.r.ground else { return };
        let pairs = pairs(&ground[2], &self.r.rates[2]);
        let what = format!("the rate at which the course {} turns", self.of_ground());
        self.hold(Against { name: "gyro_z", family: &GYRO, what, pairs, least: 0.015 });
    }

    /// The level accelerometers against the change of speed and speed times rate of turn.
    fn forces(&mut self, is_g: bool) {
        let speed = if self.r.ground.is_some() { "speed".into() } else { self.speed_label() };
        let what = [format!("d({speed})/dt"), format!("{speed} times rate of turn")];
        for ((axis, expected), what) in self.r.expected().iter().enumerate().zip(what) {
            let pairs = pairs(expected, &self.r.force[axis]);
            // Gravity tells the unit better.
            let family: &[&str] = if is_g { &ACCEL[axis..=axis] } else { &ACCEL };
            self.hold(Against { name: ACCEL[axis], family, what, pairs, least: 0.25 });
        }
    }

    fn speed_label(&self) -> String {
        SPEEDS.iter().find(|s| self.mapping.signals.contains_key(**s)).map_or("speed".into(), |s| self.label(s))
    }

    /// Roll and pitch gyros against the change of the lean: only the sign, the lean is rough.
    fn leaning(&mut self) {
        for (axis, lean) in self.r.lean_by_force().iter().enumerate() {
            let pairs = pairs(&slope(lean, REACH / 2), &self.r.rates[axis]);
            let found = fit(pairs.iter().copied());
            if found.correlation < -TELLS[0] {
                let word = ["roll", "pitch"][axis];
                let what = format!("the change of the {word} by the accelerometer");
                self.hold(Against { name: GYRO[axis], family: &GYRO[axis..=axis], what, pairs, least: 0.004 });
            }
        }
    }

    /// A steering angle against the path's curvature: only the sign, its ratio is the car's.
    fn steering(&mut self) {
        for name in ["steering_wheel", "steer"] {
            let Some(angle) = series(self.thin, self.mapping, name) else { continue };
            let bend = self.r.turn.iter().zip(&self.r.pace).map(|(w, v)| if *v > 3.0 { w / v } else { f64::NAN });
            let pairs = pairs(&bend.collect::<Vec<f64>>(), &angle);
            if fit(pairs.iter().copied()).correlation < -TELLS[0] {
                self.hold(Against { name, family: &[], what: "the curvature of the path".into(), pairs, least: 0.001 });
            }
        }
    }

    /// The magnetometer's size, its sense of turning, and whether it points backwards.
    fn compass(&mut self) {
        let field = &self.r.field;
        let size = |i: usize| (field[0][i].powi(2) + field[1][i].powi(2) + field[2][i].powi(2)).sqrt();
        let all: Vec<f64> = (0..self.r.bins).map(size).filter(|v| v.is_finite()).collect();
        if all.len() < 20 {
            return;
        }
        let usual = median(all);
        if !(12.0..170.0).contains(&usual) {
            let text =
                format!("the magnetometer's magnitude has a median of {usual:.3} uT, the Earth's field has 25 to 65.");
            let ratio = units_away(usual);
            let corrections = ratio.map_or(Vec::new(), |ratio| self.rescale(&MAG, ratio));
            self.say(&MAG, text, corrections);
            return;
        }
        let middle = |axis: usize| {
            let ends = field[axis].iter().filter(|v| v.is_finite());
            let [low, high] = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(*v), r[1].max(*v)]);
            0.5 * (low + high)
        };
        // About its middle, a field that circles tells its turning whatever the car adds to it.
        let (x0, y0) = (middle(0), middle(1));
        let mut unwound = 0.0;
        let mut last = f64::NAN;
        let turned: Vec<f64> = (0..self.r.bins)
            .map(|i| {
                let now = (y0 - field[1][i]).atan2(field[0][i] - x0);
                unwound += if last.is_finite() && now.is_finite() { wrap_angle(now - last) } else { 0.0 };
                last = if now.is_finite() { now } else { last };
                if now.is_finite() { unwound } else { f64::NAN }
            })
            .collect();
        let pairs = pairs(&self.r.turn, &slope(&turned, REACH / 2));
        if fit(pairs.iter().copied()).correlation < -TELLS[0] {
            let what = "the rate of turn".to_owned();
            self.hold(Against { name: "mag_y", family: &[], what, pairs, least: 0.03 });
            return;
        }
        self.pointing();
    }

    /// Whether the compass points backwards of the course.
    fn pointing(&mut self) {
        let Some(ground) = &self.r.ground else { return };
        let apart: Vec<f64> =
            self.r.compass().iter().zip(&ground[1]).map(|(c, g)| c - g).filter(|d| d.is_finite()).collect();
        let n = apart.len() as f64;
        let (c, s) = apart.iter().fold((0.0, 0.0), |(c, s), d| (c + d.cos() / n, s + d.sin() / n));
        if apart.len() > 200 && c.hypot(s) > 0.7 && c < -0.7 * c.hypot(s) {
            let text = format!(
                "the compass of {} and {} points {:.0} deg off the course {}, alike in {:.0} % of {:.0} s.",
                self.label("mag_x"),
                self.label("mag_y"),
                s.atan2(c).to_degrees().abs(),
                self.of_ground(),
                100.0 * c.hypot(s),
                n * STEP
            );
            let corrections = self.flip(&["mag_x", "mag_y"]);
            self.say(&["mag_x", "mag_y"], text, corrections);
        }
    }
}

/// How many times too large a field reads that is one in another unit: these are powers of ten apart.
fn units_away(usual: f64) -> Option<f64> {
    (-9..=9).map(|k| 10.0_f64.powi(k)).find(|f| (20.0..110.0).contains(&(usual / f)))
}
