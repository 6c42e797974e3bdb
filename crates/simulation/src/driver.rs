//! The driver: follows the road and the speeds asked for within limits, stops and sets off again.

use crate::car::Car;
use crate::driveline::Demand;
use crate::manoeuvre::{Line, Pedals};
use crate::math::{sin_cos, wrap_angle};
use crate::plant::Plant;
use crate::rng::Rng;
use crate::road::Road;
use crate::spec::{DriveSpec, Limits, Manoeuvre};

/// How often the driver acts, s.
pub const PERIOD: f64 = 0.01;

/// Acceleration falls to this power per mass, W/kg.
const POWER: f64 = 13.0;
/// How much more than planned the driver accelerates or brakes to catch up, m/s^2.
const CATCH_UP: [f64; 2] = [0.3, 2.0];
/// Deceleration to a stop after an open-loop manoeuvre, m/s^2.
const AFTERWARDS: f64 = 3.0;
/// How hard the speed is held in an open-loop manoeuvre, 1/s.
const HOLDING: f64 = 3.0;
/// Speed error answered by acceleration, 1/s.
const SPEED_GAIN: f64 = 0.7;
/// Grid of the speed plan, m.
const GRID: f64 = 1.0;
/// Lag of the hands, s, and their fastest turn of the road wheels, rad/s.
const STEER_LAG: f64 = 0.06;
const STEER_RATE: f64 = 0.6;
/// Brake force at a stop, N per kg of the car.
const HOLD: f64 = 4.0;
/// Wander in the lane: 1-sigma, m, and the time it takes, s.
const WANDER: f64 = 0.10;
const WANDER_TIME: f64 = 3.0;
/// A leg ends here before its stop, m: what is left is rolled out.
const ROLL_OUT: f64 = 0.25;

/// A drive from one standstill to the next.
#[derive(Clone, Debug)]
struct Leg {
    start: f64,
    end: f64,
    grid: f64,
    /// Square of the speed at each grid point, m^2/s^2.
    speed2: Vec<f64>,
    /// How long the car stands at the end, s.
    stand: f64,
}

/// A piece of road in a leg: its end, the speed asked for, m/s, and the acceleration, m/s^2.
struct Piece {
    until: f64,
    speed: f64,
    acceleration: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Standing {
        left: f64,
    },
    SettingOff {
        since: f64,
    },
    Driving,
    /// Open loop since this many seconds, begun at a speed.
    Manoeuvring {
        since: f64,
        from: f64,
    },
    /// To a stop, wherever the manoeuvre has led.
    Ending,
    Halting,
    Done,
}

/// State of the driver.
#[derive(Clone, Debug)]
pub struct Driver {
    legs: Vec<Leg>,
    leg: usize,
    phase: Phase,
    acceleration: f64,
    steer: f64,
    wanted_steer: f64,
    wander: Wander,
    limits: Limits,
    line: Line,
    manoeuvre: Option<Manoeuvre>,
}

/// Where in the lane the driver wants to be: noise through two lags, so that the hands move smoothly.
#[derive(Clone, Debug)]
struct Wander {
    first: f64,
    second: f64,
    rng: Rng,
}

impl Wander {
    fn next(&mut self) -> f64 {
        let step = PERIOD / WANDER_TIME;
        // Two equal lags of white noise: the variance is a quarter of step times the noise's.
        let noise = WANDER * 2.0 / step.sqrt() * self.rng.normal();
        self.first += step * (noise - self.first);
        self.second += step * (self.first - self.second);
        self.second
    }
}

impl Driver {
    /// A driver for a checked drive; the road's end is a stop if the last segment names none.
    pub fn new(spec: &DriveSpec, road: &Road) -> Self {
        let mut legs = Vec::new();
        let (mut first, mut start) = (0, 0.0);
        let limits = spec.driver;
        for (index, segment) in spec.segments.iter().enumerate() {
            let last = index + 1 == spec.segments.len();
            if segment.stop.is_none() && !last {
                continue;
            }
            let end = road.piece_start(index + 1);
            let pieces: Vec<Piece> = (first..=index)
                .map(|i| Piece {
                    until: road.piece_start(i + 1),
                    speed: spec.segments[i].speed_kmh / 3.6,
                    acceleration: spec.segments[i].acceleration.unwrap_or(limits.acceleration),
                })
                .collect();
            let from = if legs.is_empty() { spec.start_speed_kmh / 3.6 } else { 0.0 };
            legs.push(Leg::plan(road, start, end, &pieces, &limits, from, segment.stop.unwrap_or(0.0)));
            (first, start) = (index + 1, end);
        }
        let rolls = spec.start_speed_kmh > 0.0;
        let phase = if rolls { Phase::Driving } else { Phase::Standing { left: spec.stand_at_start } };
        // The driver is part of the drive: the same for every seed of the sensors' noise.
        let wander = Wander { first: 0.0, second: 0.0, rng: Rng::new(0, &format!("{} driver", spec.name)) };
        let (line, manoeuvre) = (Line::new(spec), spec.manoeuvre.filter(Manoeuvre::is_open_loop));
        Self { legs, leg: 0, phase, acceleration: 0.0, steer: 0.0, wanted_steer: 0.0, wander, limits, line, manoeuvre }
    }

    /// How far the car is beside the line it is to follow, m; 0 once an open-loop manoeuvre has begun.
    pub fn astray(&self, s: f64, offset: f64) -> f64 {
        let last = self.leg + 1 >= self.legs.len();
        let free = matches!(self.phase, Phase::Manoeuvring { .. } | Phase::Ending)
            || (self.manoeuvre.is_some() && last && self.phase != Phase::Driving);
        if free { 0.0 } else { offset - self.line.at(s)[0] }
    }

    /// Whether the last stop is over.
    pub fn is_done(&self) -> bool {
        self.phase == Phase::Done
    }

    /// Whether the car stands because it is to stand.
    pub fn is_standing(&self) -> bool {
        matches!(self.phase, Phase::Standing { .. } | Phase::Done)
    }

    /// Mean angle of the road wheels now, rad.
    pub fn steer(&self) -> f64 {
        self.steer
    }

    /// Look at car and road, once every [`PERIOD`]; `force` is what the engine puts through now, N.
    pub fn act(&mut self, plant: &Plant, road: &Road, force: f64) -> Demand {
        let speed = plant.attitude().column(0).dot(&plant.velocity());
        let car = &plant.car;
        self.advance_phase(plant, speed, force);
        let wanted = self.wanted_acceleration(plant.patch().s, speed);
        let step = self.limits.jerk * PERIOD;
        self.acceleration += (wanted - self.acceleration).clamp(-step, step);
        self.look(plant, road, speed);
        let uphill = car.mass * 9.8 * sin_cos(plant.patch().point.grade).0;
        match self.phase {
            Phase::Standing { .. } | Phase::Done => Demand { force: 0.0, hold: HOLD * car.mass },
            Phase::SettingOff { .. } => {
                let force = uphill.max(0.0) + car.mass * 0.3;
                Demand { force, hold: HOLD * car.mass }
            }
            Phase::Manoeuvring { from, .. } => self.pedals(car, speed, from),
            Phase::Driving | Phase::Halting | Phase::Ending => {
                Demand { force: 1.04 * car.mass * self.acceleration + uphill + car.resistance(speed), hold: 0.0 }
            }
        }
    }

    fn pedals(&self, car: &Car, speed: f64, from: f64) -> Demand {
        let force = match self.manoeuvre.map(|m| m.pedals(from)) {
            Some(Pedals::Hold(held)) => car.resistance(speed) + HOLDING * car.mass * (held - speed),
            Some(Pedals::Brake(deceleration)) => -deceleration * car.mass,
            _ => 0.0,
        };
        Demand { force, hold: 0.0 }
    }

    fn advance_manoeuvre(&mut self, s: f64, speed: f64) {
        let Some(manoeuvre) = self.manoeuvre else { return };
        match &mut self.phase {
            Phase::Driving if s >= manoeuvre.at => {
                self.leg = self.legs.len().saturating_sub(1);
                self.phase = Phase::Manoeuvring { since: 0.0, from: speed };
            }
            Phase::Manoeuvring { since, .. } if manoeuvre.is_over(*since, speed) => {
                (self.phase, self.acceleration) = (Phase::Ending, 0.0);
            }
            Phase::Ending if speed < 0.5 => self.phase = Phase::Halting,
            _ => {}
        }
    }

    fn advance_phase(&mut self, plant: &Plant, speed: f64, force: f64) {
        self.advance_manoeuvre(plant.patch().s, speed);
        let left = self.legs.get(self.leg).map_or(0.0, |leg| leg.end - plant.patch().s);
        match &mut self.phase {
            Phase::Standing { left } => {
                *left -= PERIOD;
                if *left <= 0.5 * PERIOD {
                    let more = self.leg < self.legs.len();
                    self.phase = if more { Phase::SettingOff { since: 0.0 } } else { Phase::Done };
                }
            }
            Phase::SettingOff { since } => {
                *since += PERIOD;
                let uphill = plant.car.mass * 9.8 * sin_cos(plant.patch().point.grade).0;
                if *since > 0.2 && force >= uphill {
                    self.acceleration = 0.2;
                    self.phase = Phase::Driving;
                }
            }
            Phase::Driving if left < ROLL_OUT || (left < 3.0 && speed < 0.5) => self.phase = Phase::Halting,
            Phase::Halting if plant.rim_speed() == [0.0; 4] && speed.abs() < 0.02 => {
                self.advance_manoeuvre(plant.patch().s, speed);
                let left = self.legs.get(self.leg).map_or(0.0, |leg| leg.stand);
                self.leg += 1;
                self.acceleration = 0.0;
                self.phase = Phase::Standing { left };
            }
            _ => {}
        }
    }

    fn wanted_acceleration(&self, s: f64, speed: f64) -> f64 {
        match (self.phase, self.legs.get(self.leg)) {
            (Phase::Driving, Some(leg)) => {
                let (planned, slope) = leg.at(s + 0.3 * speed + 0.3);
                let [more, harder] = CATCH_UP;
                (slope + SPEED_GAIN * (planned - speed))
                    .clamp(-self.limits.braking - harder, self.limits.acceleration + more)
            }
            (Phase::Halting, _) => -0.8,
            (Phase::Ending, _) => -AFTERWARDS,
            _ => 0.0,
        }
    }

    /// Steer by preview: curvature ahead with the car's understeer, and the offset expected at a point ahead.
    fn look(&mut self, plant: &Plant, road: &Road, speed: f64) {
        if self.manoeuvre.is_some() && !matches!(self.phase, Phase::Driving | Phase::SettingOff { .. }) {
            self.wanted_steer = 0.0;
            return;
        }
        if speed < 0.1 {
            return;
        }
        let (car, patch) = (&plant.car, plant.patch());
        let velocity = plant.velocity();
        let forward = plant.attitude().column(0).into_owned();
        let heading = libm::atan2(forward.y, forward.x);
        let course = if speed > 1.0 { libm::atan2(velocity.y, velocity.x) } else { heading };
        let ahead = (0.9 * speed).max(4.0);
        // Nobody wanders while creeping.
        let steady = if self.manoeuvre.is_some() { 0.0 } else { 1.0 };
        let wander = self.wander.next() * steady * ((speed - 2.0) / 6.0).clamp(0.0, 1.0);
        let astray = plant.offset() - wander + ahead * sin_cos(wrap_angle(course - patch.point.heading)).0;
        let soon = patch.s + speed * (STEER_LAG + 0.05) + 0.3;
        let curvature = road.point(soon).curvature;
        let mut turning = curvature - 2.0 * astray / (ahead * ahead);
        if !self.line.is_centre() {
            let [y, slope, _] = self.line.at(patch.s);
            turning += self.line.at(soon)[2] + 2.0 * (y + ahead * slope) / (ahead * ahead);
        }
        let understeer = car.understeer_gradient() * speed * speed;
        self.wanted_steer = (libm::atan(car.wheelbase() * turning) + understeer * turning).clamp(-0.6, 0.6);
    }

    /// Hands: move towards the wanted angle for `dt` s and return the road wheels' angle, rad.
    pub fn turn_wheel(&mut self, dt: f64) -> f64 {
        if let (Phase::Manoeuvring { since, .. }, Some(manoeuvre)) = (&mut self.phase, self.manoeuvre) {
            *since += dt;
            self.steer = manoeuvre.steer(*since);
            return self.steer;
        }
        let change = (self.wanted_steer - self.steer) * (dt / STEER_LAG);
        self.steer += change.clamp(-STEER_RATE * dt, STEER_RATE * dt);
        self.steer
    }
}

impl Leg {
    /// Plan the speed: the segments' and the curves' limits, reached and left with the driver's accelerations.
    fn plan(road: &Road, start: f64, end: f64, pieces: &[Piece], limits: &Limits, from: f64, stand: f64) -> Self {
        let count = ((end - start) / GRID).ceil().max(2.0) as usize;
        let grid = (end - start) / count as f64;
        let piece = |s: f64| pieces.get(pieces.partition_point(|p| s > p.until)).or(pieces.last());
        let mut speed2: Vec<f64> = (0..=count)
            .map(|k| {
                let s = start + k as f64 * grid;
                let limit = piece(s).map_or(1.0, |p| p.speed);
                let curvature = road.point(s).curvature.abs();
                (limit * limit).min(limits.cornering / curvature.max(1e-6))
            })
            .collect();
        (speed2[0], speed2[count]) = (from * from, 0.0);
        for k in (0..count).rev() {
            speed2[k] = speed2[k].min(speed2[k + 1] + 2.0 * limits.braking * grid);
        }
        for k in 1..=count {
            let most = piece(start + (k - 1) as f64 * grid).map_or(limits.acceleration, |p| p.acceleration);
            let strongest = most.min(POWER / speed2[k - 1].sqrt().max(1.0));
            speed2[k] = speed2[k].min(speed2[k - 1] + 2.0 * strongest * grid);
        }
        Self { start, end, grid, speed2, stand }
    }

    /// Planned speed, m/s, and acceleration, m/s^2.
    fn at(&self, s: f64) -> (f64, f64) {
        let at = ((s - self.start) / self.grid).clamp(0.0, (self.speed2.len() - 1) as f64 - 1e-9);
        let index = at as usize;
        let (a, b) = (self.speed2[index], self.speed2[index + 1]);
        ((a + (b - a) * (at - index as f64)).max(0.0).sqrt(), (b - a) / (2.0 * self.grid))
    }
}
