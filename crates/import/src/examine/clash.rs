//! Where a drive contradicts itself as a mapping reads it: each with its numbers, and with what would put it right.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::STANDARD_GRAVITY;
use serde::Serialize;

use super::hold::Held;
use super::reading::{REACH, Reading, series};
use super::scene::{Field, STEP, slope};
use super::survey::canonical_unit;
use super::thinned::Thinned;
use crate::channels::signal;
use crate::clock::median;
use crate::mapping::{Mapping, SignalSource};
use crate::units;

/// Fewer values are too few.
const ENOUGH: usize = 20;
/// Between these, a bank explains the scale of the sideways force.
const BANKED: std::ops::Range<f64> = 0.4..2.5;
/// Between these, a field that turns turns with the car.
const TURNING: std::ops::Range<f64> = 0.3..3.0;
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

impl Correction {
    /// A source with it.
    pub(crate) fn of(&self, source: &SignalSource) -> SignalSource {
        let unit = Some(self.unit.clone()).filter(|u| u != canonical_unit(&self.signal));
        SignalSource { unit, scale: self.scale, ..source.clone() }
    }
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

/// The same of a rate: how much its integral changes over the two seconds, and its mean.
fn changes(integral: &[f64], measured: &[f64]) -> Vec<(f64, f64)> {
    let (a, b) = (Field::made(integral.to_vec()), Field::made(measured.to_vec()));
    let pair = |i: usize| {
        let (from, to) = ((i - REACH) as f64 * STEP, (i + REACH) as f64 * STEP);
        ((a.at(to) - a.at(from)) / (to - from), b.mean(from, to))
    };
    (REACH..integral.len()).step_by(REACH / 2).map(pair).collect()
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
        let columns = signals.iter().filter_map(|s| self.mapping.signals.get(s)).map(|s| s.column.clone()).collect();
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

    /// Say it where a signal has the wrong sign or scale, which `family` share with it. True where the sign is wrong.
    fn hold(&mut self, name: &'static str, family: &[&'static str], held: &Held, least: f64) -> bool {
        let (is_turned, is_scaled) = (held.is_turned(), held.is_scaled());
        if !held.shows(ENOUGH, least) || !is_turned && !is_scaled {
            return false;
        }
        let scaled = if is_scaled { self.rescale(family, held.scale().abs()) } else { Vec::new() };
        let turned = |mut c: Correction| {
            c.scale *= if is_turned && c.signal == name { -1.0 } else { 1.0 };
            c
        };
        // A factor that no unit explains is not taken for a calibration where the sign is wrong already.
        let is_unit = |c: &Correction| self.reading(&c.signal).is_some_and(|(unit, _)| unit != c.unit);
        let explains = is_scaled && (!is_turned || scaled.iter().any(is_unit));
        let corrections = if explains { scaled.into_iter().map(turned).collect() } else { self.flip(&[name]) };
        self.say(&[name], held.sentence(&format!("{} as {name}", self.label(name))), corrections);
        is_turned
    }

    /// The same where nothing but the sign can be told.
    fn hold_sign(&mut self, name: &'static str, held: &Held, least: f64) -> bool {
        held.is_turned() && self.hold(name, &[], held, least)
    }

    /// Velocities against the change of the places.
    fn velocities(&mut self) {
        for (axis, name) in ["gnss_vn", "gnss_ve"].into_iter().enumerate() {
            let Some(v) = series(self.thin, self.mapping, name) else { continue };
            let what = format!("the change of {}", self.label(["gnss_lat", "gnss_lon"][axis]));
            let held = Held::new(what, &pairs(&slope(&self.r.place[axis], REACH), &v));
            self.hold(name, &["gnss_vn", "gnss_ve", "gnss_vd"], &held, 1.0);
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
        if all.len() < ENOUGH {
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
        let held = Held::new(format!("d(course)/dt {}", self.of_ground()), &pairs(&ground[2], &self.r.rates[2]));
        self.hold("gyro_z", &GYRO, &held, 0.015);
    }

    /// The level accelerometers against the change of speed and speed times rate of turn.
    fn forces(&mut self, is_g: bool) {
        let of = if self.r.ground.is_some() { self.of_ground() } else { self.of_speed() };
        // Gravity tells the unit better.
        let family: &[&str] = if is_g { &["accel_x"] } else { &ACCEL };
        let held = Held::new(format!("d(speed)/dt {of}"), &changes(&self.r.pace, &self.r.force[0]));
        let is_forward = self.hold("accel_x", family, &held, 0.25) || held.goes_with();
        let [_, sideways] = self.r.expected();
        let pairs = pairs(&sideways, &self.r.force[1]);
        let held = Held::new(format!("speed times rate of turn {of}"), &pairs);
        // A bank takes part of the sideways force away or adds to it; only a unit is further off.
        let is_banked = is_g || BANKED.contains(&held.scale().abs());
        let is_turned =
            if is_banked { self.hold_sign("accel_y", &held, 0.25) } else { self.hold("accel_y", &ACCEL, &held, 0.25) };
        if !is_turned && is_g {
            self.circling(&pairs, is_forward);
        }
    }

    /// In a steady circle nothing changes, but the mean of the lateral force tells its side. A sensor that is sold is
    /// right-handed: unless the forward axis is known, both level axes point the other way.
    fn circling(&mut self, pairs: &[(f64, f64)], is_forward: bool) {
        let known: Vec<_> = pairs.iter().filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
        let n = known.len() as f64;
        let (expected, measured) = known.iter().fold((0.0, 0.0), |(e, m), p| (e + p.0 / n, m + p.1 / n));
        let apart = (measured - expected).abs();
        if known.len() < ENOUGH || expected.abs() < 0.8 || measured * expected > -0.4 * expected.powi(2) {
            return;
        }
        let text = format!(
            "{} averages {measured:+.2} m/s^2 where speed times rate of turn averages {expected:+.2} over {n} values: its axis points to the other side, or its housing leans by {:.0} deg.",
            self.label("accel_y"),
            (apart / STANDARD_GRAVITY).min(1.0).asin().to_degrees()
        );
        let names: &[&str] = if is_forward { &["accel_y"] } else { &["accel_x", "accel_y", "gyro_x", "gyro_y"] };
        let corrections = self.flip(names);
        self.say(&["accel_y"], text, corrections);
    }

    fn of_speed(&self) -> String {
        let name = SPEEDS.iter().find(|s| self.mapping.signals.contains_key(s));
        format!("of {}", self.label(name.unwrap_or(&"speed")))
    }

    /// Roll and pitch gyros against the change of the lean: only the sign, the lean is rough.
    fn leaning(&mut self) {
        for (axis, lean) in self.r.lean_by_force().iter().enumerate() {
            let what = format!("the change of the {} by the accelerometer", ["roll", "pitch"][axis]);
            let held = Held::new(what, &pairs(&slope(lean, REACH / 2), &self.r.rates[axis]));
            self.hold_sign(GYRO[axis], &held, 0.004);
        }
    }

    /// A steering angle against the path's curvature: only the sign, its ratio is the car's.
    fn steering(&mut self) {
        for name in ["steering_wheel", "steer"] {
            let Some(angle) = series(self.thin, self.mapping, name) else { continue };
            let bend = self.r.turn.iter().zip(&self.r.pace).map(|(w, v)| if *v > 3.0 { w / v } else { f64::NAN });
            let bend: Vec<f64> = bend.collect();
            self.hold_sign(name, &Held::new("the curvature of the path".into(), &pairs(&bend, &angle)), 0.001);
        }
    }

    /// The magnetometer's size, its sense of turning, and whether it points backwards.
    fn compass(&mut self) {
        let field = &self.r.field;
        let size = |i: usize| (field[0][i].powi(2) + field[1][i].powi(2) + field[2][i].powi(2)).sqrt();
        let all: Vec<f64> = (0..self.r.bins).map(size).filter(|v| v.is_finite()).collect();
        if all.len() < ENOUGH {
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
        let held = Held::new("the rate of turn".into(), &pairs(&self.r.turn, &slope(&turned, REACH / 2)));
        if TURNING.contains(&held.scale().abs()) && held.is_turned() {
            self.hold_sign("mag_y", &held, 0.03);
        } else {
            self.pointing();
        }
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
