//! Engine, gearbox and brakes: from the driver's demand to torques at the wheels.

use crate::car::{Car, Driven, WHEELS};
use crate::math::smooth_step;
use crate::plant::STEP;

/// Speeds above which the next higher gear is taken, m/s.
const SHIFT_UP: [f64; 5] = [4.2, 8.3, 13.0, 18.0, 25.0];
/// The lower gear is taken this much below the speed of the shift up, m/s.
const HYSTERESIS: f64 = 1.4;
/// Overall ratio from engine to wheel by gear.
const RATIO: [f64; 6] = [14.5, 8.3, 5.5, 4.1, 3.2, 2.6];
/// Engine speed at idle, rad/s.
const IDLE: f64 = 80.0;
/// How long the torque is away during a shift, s, and how long it takes to go and to come back.
const GAP: f64 = 0.4;
const GAP_EDGE: f64 = 0.12;
/// Lags of engine torque and of brake torque, s.
const ENGINE_LAG: f64 = 0.12;
const BRAKE_LAG: f64 = 0.08;
/// Largest change of the engine's force, N/s per kg of the car.
const ENGINE_SLEW: f64 = 8.0;
/// Engine braking with the pedal up, N per kg of the car.
const ENGINE_BRAKING: f64 = 0.25;

/// State of the drive line.
#[derive(Clone, Debug)]
pub struct Driveline {
    gear: usize,
    since_shift: f64,
    force: f64,
    brake: f64,
}

impl Default for Driveline {
    fn default() -> Self {
        Self { gear: 0, since_shift: 10.0, force: 0.0, brake: 0.0 }
    }
}

/// What the driver asks for, N at the wheels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand {
    /// Accelerate (positive) or decelerate (negative) with this force.
    pub force: f64,
    /// Hold the car with at least this brake force.
    pub hold: f64,
}

impl Driveline {
    /// Rolling at a speed (m/s) in the gear for it, the engine holding it on the level.
    pub fn rolling(car: &Car, speed: f64) -> Self {
        let gear = SHIFT_UP.iter().filter(|s| speed > **s).count();
        Self { gear, force: car.resistance(speed), ..Self::default() }
    }

    /// Gear, from 1.
    pub fn gear(&self) -> usize {
        self.gear + 1
    }

    /// Engine speed at a forward speed (m/s), rad/s.
    pub fn engine_speed(&self, car: &Car, speed: f64) -> f64 {
        (RATIO[self.gear] * speed.abs() / car.common.wheel_radius).max(IDLE)
    }

    /// Force that the engine puts through now, N at the wheels, without the gap of a shift.
    pub fn drive_force(&self) -> f64 {
        self.force
    }

    /// Advance by [`STEP`] and return drive and brake torques of the wheels, N m.
    pub fn step(&mut self, car: &Car, speed: f64, demand: &Demand) -> ([f64; WHEELS], [f64; WHEELS]) {
        self.shift(speed);
        let brake_by_engine = -ENGINE_BRAKING * car.mass * (speed / 3.0).clamp(0.0, 1.0);
        let strongest = (car.common.power / speed.abs().max(1.0)).min(car.common.drive_force_per_mass * car.mass);
        let wanted = demand.force.clamp(brake_by_engine, strongest);
        let change = (wanted - self.force) * (STEP / ENGINE_LAG);
        let slew = ENGINE_SLEW * car.mass * STEP;
        self.force += change.clamp(-slew, slew);
        let braking = (brake_by_engine - demand.force).max(demand.hold).max(0.0);
        self.brake += (braking - self.brake) * (STEP / BRAKE_LAG);
        let radius = car.common.wheel_radius;
        let drive = 0.5 * radius * self.force * self.passed();
        let front = 0.5 * radius * self.brake * car.common.front_brake_share;
        let rear = 0.5 * radius * self.brake - front;
        let drive = match car.driven {
            Driven::Front => [drive, drive, 0.0, 0.0],
            Driven::Rear => [0.0, 0.0, drive, drive],
        };
        (drive, [front, front, rear, rear])
    }

    fn shift(&mut self, speed: f64) {
        self.since_shift += STEP;
        if self.since_shift < 1.0 {
            return;
        }
        let up = self.gear < SHIFT_UP.len() && speed > SHIFT_UP[self.gear];
        let down = self.gear > 0 && speed < SHIFT_UP[self.gear - 1] - HYSTERESIS;
        if up || down {
            self.gear = if up { self.gear + 1 } else { self.gear - 1 };
            // Coming to a stop the driver opens the clutch: no gap is felt.
            self.since_shift = if up { 0.0 } else { GAP };
        }
    }

    /// Share of the torque that a shift lets through.
    fn passed(&self) -> f64 {
        let gone = 1.0 - smooth_step(self.since_shift / GAP_EDGE);
        gone + smooth_step((self.since_shift - (GAP - GAP_EDGE)) / GAP_EDGE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::vehicle::VehicleParams;

    #[test]
    fn a_shift_up_takes_the_torque_away_and_gives_it_back() {
        let car = Car::new("saloon", VehicleParams::preset("saloon").unwrap(), 9.8);
        let mut line = Driveline::default();
        let demand = Demand { force: 2000.0, hold: 0.0 };
        let torque = |line: &mut Driveline, speed: f64| line.step(&car, speed, &demand).0[0];
        (0..1000).for_each(|_| _ = torque(&mut line, 4.0));
        let before = torque(&mut line, 4.0);
        assert!((before - 0.5 * 2000.0 * car.common.wheel_radius).abs() < 1.0);
        let during: Vec<f64> = (0..300).map(|_| torque(&mut line, 4.5)).collect();
        assert_eq!(line.gear(), 2);
        assert!(during[100] == 0.0, "after 0.2 s the torque is gone");
        assert!((during[299] - before).abs() < 1.0, "after 0.6 s it is back");
    }

    #[test]
    fn braking_goes_to_the_brakes_beyond_what_the_engine_does() {
        let car = Car::new("saloon", VehicleParams::preset("saloon").unwrap(), 9.8);
        let mut line = Driveline::default();
        let demand = Demand { force: -5000.0, hold: 0.0 };
        let mut last = ([0.0; 4], [0.0; 4]);
        (0..2000).for_each(|_| last = line.step(&car, 20.0, &demand));
        let total = (last.1.iter().sum::<f64>() - last.0.iter().sum::<f64>()) / car.common.wheel_radius;
        assert!((total - 5000.0).abs() < 1.0);
        assert!(last.1[0] > last.1[2], "front brakes work harder");
    }
}
