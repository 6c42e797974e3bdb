//! Whether a car whose wheels show no speed stands, or moves more slowly than its wheels can show.
//!
//! Wheel speeds are counted from pulses and read exactly zero below some tenths of a metre per second. Taken for a standing car,
//! a gentle start would be explained by tilt and accelerometer bias within a second, and the filter locked out of its own
//! odometer. What shows the difference is the specific force: the level that it has at rest, held against what it is now and
//! summed up to a speed.
//! Departure from SPEC navigation 4, whose odometer shows every speed: where it does, a zero is a standing car, as there.

use nalgebra::Vector3;

/// Odometer speed below which wheels show none, m/s.
pub const STANDING_SPEED: f64 = 0.02;
/// First speed after zero, or last one before it, from which an odometer is one that cannot show slower ones, m/s.
const SMALLEST_DEAD_BAND: f64 = 0.1;
/// No odometer is blind to more than this, m/s: what is beyond is a sample lost on the move.
const LARGEST_DEAD_BAND: f64 = 1.0;
/// Time over which the specific force is averaged before it is compared, s.
const BLOCK: f64 = 0.1;
/// Blocks in a row without motion that make a rest: longer than a brake holds a car that creeps to a stop.
const CONFIRMING: usize = 10;
/// Blocks to which the memory of the level reaches.
const MEMORY: usize = 50;
/// What a block leaves of the speed summed up before it, while the car is taken to stand: biases walk.
const LEAK: f64 = 0.9;
/// Speed, summed up from the specific force, of a car that has left its rest, m/s: the body's rocking stays below.
const LEAVING_SPEED: f64 = 0.03;
/// The same in units of the accelerometer's noise density: six sigma of the leaking sum.
const LEAVING_NOISE: f64 = 4.5;

/// What the odometer says of the car's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rolling {
    /// It rolls at this forward speed, m/s.
    At(f64),
    /// It stands.
    Standing,
    /// It is slower than this, m/s, and may stand.
    Slower(f64),
    /// It has left its rest, more slowly than the wheels can show.
    Leaving,
}

/// How the slowest speed that an odometer shows was found: from the samples beside its zeros.
#[derive(Clone, Copy, Debug, Default)]
struct DeadBand {
    last: Option<f64>,
    edges: usize,
    jumps: usize,
    sum: f64,
}

impl DeadBand {
    fn see(&mut self, speed: f64) {
        let speed = speed.abs();
        if let Some(last) = self.last.replace(speed)
            && (last < STANDING_SPEED) != (speed < STANDING_SPEED)
        {
            let shown = last.max(speed).min(LARGEST_DEAD_BAND);
            self.edges += 1;
            self.jumps += usize::from(shown >= SMALLEST_DEAD_BAND);
            self.sum += shown;
        }
    }

    /// The slowest speed shown, m/s; 0 where every speed is.
    fn size(&self) -> f64 {
        if 2 * self.jumps > self.edges { self.sum / self.edges as f64 } else { 0.0 }
    }
}

/// A mean that forgets.
#[derive(Clone, Copy, Debug, Default)]
struct Level {
    mean: Vector3<f64>,
    blocks: usize,
}

impl Level {
    fn add(&mut self, value: &Vector3<f64>) {
        self.blocks += 1;
        self.mean += (value - self.mean) / self.blocks.min(MEMORY) as f64;
    }
}

/// The watch over a car at rest.
#[derive(Clone, Debug, Default)]
pub struct Standing {
    band: DeadBand,
    /// Whether the wheels show no speed.
    is_zero: bool,
    speed: f64,
    sum: Vector3<f64>,
    samples: usize,
    time: f64,
    level: Level,
    gained: Vector3<f64>,
    has_left: bool,
}

impl Standing {
    /// A speed of a log that is not driven yet: what the odometer can show.
    pub fn learn(&mut self, speed: f64) {
        self.band.see(speed);
    }

    /// A new speed of the odometer, m/s; a zero after a speed is a new rest.
    pub fn odometer(&mut self, speed: f64) {
        self.band.see(speed);
        self.speed = speed;
        self.is_zero = speed.abs() < STANDING_SPEED;
        if !self.is_zero {
            self.begin();
        }
    }

    fn begin(&mut self) {
        (self.sum, self.samples, self.time) = (Vector3::zeros(), 0, 0.0);
        (self.level, self.gained, self.has_left) = (Level::default(), Vector3::zeros(), false);
    }

    /// An inertial sample of `dt` s; `noise` is the accelerometer's noise density.
    pub fn sample(&mut self, accel: &Vector3<f64>, dt: f64, noise: f64) {
        if !self.is_zero || self.band.size() == 0.0 {
            return;
        }
        self.sum += accel;
        self.samples += 1;
        self.time += dt;
        if self.time + 0.5 * dt < BLOCK {
            return;
        }
        let mean = self.sum / self.samples as f64;
        let time = self.time;
        (self.sum, self.samples, self.time) = (Vector3::zeros(), 0, 0.0);
        self.block(&mean, time, LEAVING_SPEED.max(LEAVING_NOISE * noise));
    }

    fn block(&mut self, mean: &Vector3<f64>, time: f64, leaving: f64) {
        if self.level.blocks == 0 {
            return self.level.add(mean);
        }
        let leak = if self.has_left { 1.0 } else { LEAK };
        self.gained = self.gained * leak + (mean - self.level.mean) * time;
        let gained = self.gained.norm();
        if self.has_left {
            // A car as fast as that would have turned its wheels visibly: it was tilted, as by someone who gets in.
            if gained > 2.0 * self.band.size() {
                self.begin();
            } else {
                self.has_left = gained > 0.5 * leaving;
            }
        } else if gained <= leaving {
            self.level.add(mean);
        } else if self.level.blocks >= CONFIRMING {
            self.has_left = true;
        } else {
            self.begin();
        }
    }

    /// What the newest speed means.
    pub fn rolling(&self) -> Rolling {
        let band = self.band.size();
        if !self.is_zero {
            Rolling::At(self.speed)
        } else if self.has_left {
            Rolling::Leaving
        } else if band == 0.0 || self.level.blocks >= CONFIRMING {
            Rolling::Standing
        } else {
            Rolling::Slower(band)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: Vector3<f64> = Vector3::new(0.1, -0.05, -9.8);
    const DT: f64 = 0.01;

    /// A car of which the wheels show nothing below `band`, driven with `force` (forward, m/s^2) from rest, told over time.
    fn drive(band: f64, force: impl Fn(f64) -> f64, seconds: f64) -> Vec<(f64, f64, Rolling)> {
        let mut standing = Standing::default();
        [0.0, band, 0.0, band].into_iter().for_each(|v| standing.learn(v));
        let mut speed = 0.0;
        (1..=(seconds / DT) as usize)
            .map(|k| {
                let t = k as f64 * DT;
                let a = force(t);
                speed += a * DT;
                // Noise of an engine at 27 Hz.
                let shake = 0.2 * (170.0 * t).sin();
                standing.odometer(if f64::abs(speed) < band { 0.0 } else { speed });
                standing.sample(&(REST + Vector3::new(a, 0.3 * shake, shake)), DT, 2e-3);
                (t, speed, standing.rolling())
            })
            .collect()
    }

    /// The mistake that this module is for: 3 s of motion at 0.1 m/s^2 taken for rest.
    #[test]
    fn a_gentle_start_below_what_the_wheels_show_is_not_a_rest() {
        let told = drive(0.3, |t| if t > 5.0 { 0.1 } else { 0.0 }, 9.0);
        for (t, speed, rolling) in told {
            if t > 1.2 && t < 5.0 {
                assert_eq!(rolling, Rolling::Standing, "{t}");
            }
            assert!(speed < 0.06 || rolling != Rolling::Standing, "{t} {speed} {rolling:?}");
            assert!(speed < 0.31 || rolling == Rolling::At(speed), "{t} {speed} {rolling:?}");
        }
    }

    /// A brake that holds at 0.5 m/s^2 looks like a rest, for the 0.6 s that it takes from 0.3 m/s on.
    #[test]
    fn a_car_that_creeps_to_a_stop_stands_only_when_it_stands() {
        let told = drive(
            0.3,
            |t| {
                if t < 4.0 {
                    0.5
                } else if t < 8.0 {
                    -0.5
                } else {
                    0.0
                }
            },
            12.0,
        );
        for (t, speed, rolling) in told.into_iter().filter(|(t, ..)| *t > 4.0) {
            assert!(speed.abs() < 0.02 || rolling != Rolling::Standing, "{t} {speed} {rolling:?}");
            assert!(t < 9.5 || rolling == Rolling::Standing, "{t} {rolling:?}");
        }
    }

    /// Someone gets in: the body tilts by 0.5 deg and stays so. Some seconds later the car stands again.
    #[test]
    fn a_new_tilt_is_doubted_and_then_believed() {
        let told = drive(0.3, |_| 0.0, 5.0);
        assert_eq!(told[450].2, Rolling::Standing);
        let mut standing = Standing::default();
        [0.0, 0.3, 0.0].into_iter().for_each(|v| standing.learn(v));
        standing.odometer(0.0);
        let told: Vec<Rolling> = (0..2000)
            .map(|k| {
                let tilt = if k > 500 { 0.09 } else { 0.0 };
                standing.sample(&(REST + Vector3::new(tilt, 0.0, 0.0)), DT, 2e-3);
                standing.rolling()
            })
            .collect();
        assert!(told[400] == Rolling::Standing && told[600] == Rolling::Leaving && told[1999] == Rolling::Standing);
    }

    /// An odometer that shows every speed is taken at its word, as the specification does.
    #[test]
    fn a_fine_odometer_stands_at_once() {
        let mut standing = Standing::default();
        [0.0, 0.03, 0.06, 0.02, 0.0, 0.05].into_iter().for_each(|v| standing.learn(v));
        standing.odometer(0.0);
        assert_eq!(standing.rolling(), Rolling::Standing);
        standing.sample(&(REST * 1.1), DT, 2e-3);
        assert_eq!(standing.rolling(), Rolling::Standing);
    }
}
