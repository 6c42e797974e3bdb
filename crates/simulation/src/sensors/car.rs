//! Wheel speeds from pulses, the speed that the car reports, and the steering wheel's angle.

use drivescope_drive::signals::{Steering, Wheels};

use super::quantized;
use crate::car::WHEELS;
use crate::grades::CarGrade;
use crate::rng::Rng;

/// Counter of one wheel: speed is distance between the last pulses over the time between them.
#[derive(Clone, Debug)]
struct Counter {
    /// Distance of one pulse, m, and the errors of the single pulses over one turn, m.
    pitch: f64,
    errors: Vec<f64>,
    /// Number of the last pulse, its time, and the speed held since, m/s.
    last: i64,
    time: f64,
    speed: f64,
    /// Distance and time of the sample before.
    before: (f64, f64),
}

impl Counter {
    /// Speed read at `time` s when the rim has gone `distance` m.
    fn read(&mut self, time: f64, distance: f64, slowest: f64) -> f64 {
        let pulse = libm::floor(distance / self.pitch) as i64;
        if pulse != self.last {
            let rise = distance - self.before.0;
            let edge = if pulse < self.last { pulse + 1 } else { pulse };
            let share = ((edge as f64 * self.pitch - self.before.0) / rise).clamp(0.0, 1.0);
            let when = self.before.1 + share * (time - self.before.1);
            let gone = (pulse - self.last) as f64 * self.pitch + self.error(pulse) - self.error(self.last);
            self.speed = if when > self.time { gone / (when - self.time) } else { 0.0 };
            (self.last, self.time) = (pulse, when);
        } else {
            // No pulse yet: the wheel is slower than one pitch since the last one.
            let bound = self.pitch / (time - self.time).max(1e-3);
            self.speed = self.speed.clamp(-bound, bound);
        }
        self.before = (distance, time);
        if self.speed.abs() < slowest { 0.0 } else { self.speed }
    }

    fn error(&self, pulse: i64) -> f64 {
        self.errors[pulse.rem_euclid(self.errors.len() as i64) as usize]
    }
}

/// State of the car's own sensors.
#[derive(Clone, Debug)]
pub struct CarSensors {
    grade: CarGrade,
    counters: Vec<Counter>,
    scale: [f64; WHEELS],
    radius: f64,
    steering_ratio: f64,
    steering_offset: f64,
    rng: Rng,
}

impl CarSensors {
    /// Sensors of a grade on wheels of a radius (m) and a steering of a ratio.
    pub fn new(grade: &CarGrade, radius: f64, steering_ratio: f64, seed: u64) -> Self {
        let mut rng = Rng::new(seed, "wheels");
        let common = grade.scale[0] * rng.normal();
        let scale = std::array::from_fn(|_| 1.0 + common + grade.scale[1] * rng.normal());
        let pitch = std::f64::consts::TAU * radius / grade.pulses;
        let count = if grade.pulses > 0.0 { WHEELS } else { 0 };
        let counters = (0..count)
            .map(|_| {
                let errors = (0..grade.pulses as usize).map(|_| grade.pulse_error * pitch * rng.normal()).collect();
                Counter { pitch, errors, last: 0, time: 0.0, speed: 0.0, before: (0.0, 0.0) }
            })
            .collect();
        let steering_offset = grade.steering_offset * Rng::new(seed, "steering").normal();
        Self { grade: *grade, counters, scale, radius, steering_ratio, steering_offset, rng: Rng::new(seed, "speed") }
    }

    /// The next sample of the wheels: their true rim speeds (m/s) and angles since the start (rad) at `time` s.
    ///
    /// The reported speed is the mean of the rear wheels with noise of its own; below the dead band it is 0.
    pub fn wheels(&mut self, time: f64, rim_speed: &[f64; WHEELS], turned: &[f64; WHEELS]) -> Wheels {
        let mut speeds = *rim_speed;
        for (i, counter) in self.counters.iter_mut().enumerate() {
            speeds[i] = counter.read(time, turned[i] * self.radius, self.grade.slowest);
        }
        let mean = 0.5 * (speeds[2] * self.scale[2] + speeds[3] * self.scale[3]);
        let noise = self.grade.speed_noise * self.rng.normal();
        let speed = if mean.abs() < self.grade.slowest { 0.0 } else { mean + noise };
        let read = |i: usize| quantized(speeds[i] * self.scale[i], self.grade.speed_resolution);
        Wheels {
            speed: quantized(speed, self.grade.speed_resolution),
            wheel_speed_fl: read(0),
            wheel_speed_fr: read(1),
            wheel_speed_rl: read(2),
            wheel_speed_rr: read(3),
        }
    }

    /// The next sample of the steering for the road wheels' true mean angle, rad.
    pub fn steering(&self, steer: f64) -> Steering {
        let angle = quantized(steer * self.steering_ratio + self.steering_offset, self.grade.steering_resolution);
        Steering { steer: angle / self.steering_ratio, steering_wheel: angle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_give_the_speed_forwards_and_backwards_and_zero_at_rest() {
        let mut c = Counter { pitch: 0.045, errors: vec![0.0], last: 0, time: 0.0, speed: 0.0, before: (0.0, 0.0) };
        let (mut distance, mut time) = (0.0, 0.0);
        let mut drive = |speed: f64, seconds: f64| {
            let mut read = 0.0;
            for _ in 0..(seconds / 0.01) as usize {
                time += 0.01;
                distance += speed * 0.01;
                read = c.read(time, distance, 0.3);
            }
            read
        };
        for speed in [0.5, 3.0, 20.0, -4.0] {
            assert!((drive(speed, 1.0) - speed).abs() < 1e-9, "{speed}");
        }
        assert_eq!(drive(0.0, 0.5), 0.0, "no pulse for half a second is below 0.3 m/s");
    }
}
