//! A simulation that grows a drive step by step.

use drivescope_drive::channel::OutOfOrder;
use drivescope_drive::drive::Drive;
use nalgebra::Vector3;

use crate::car::Car;
use crate::driveline::Driveline;
use crate::driver::{Driver, PERIOD};
use crate::earth::{Local, TangentFrame};
use crate::motion::{FIELD_UNIX_TIME, Inertial, Motion, daejeon};
use crate::plant::{Inputs, Plant, STEP};
use crate::road::Road;
use crate::sensors::suite::{Instant, Suite};
use crate::spec::{DriveSpec, SpecError};
use crate::truth;

/// Samples per second of inertial sensor, magnetometer, wheels, steering and truth.
pub const RATE: f64 = 100.0;
/// Plant steps in a sample.
const STEPS: usize = 5;
/// Further from the centre line than this the car has left the road, m.
const ROAD_HALF_WIDTH: f64 = 5.0;
/// Without getting on for this long although it wants to, the car is stuck, s.
const PATIENCE: f64 = 60.0;

const _: () = assert!(STEPS as f64 * STEP == PERIOD && PERIOD * RATE == 1.0);

/// A drive being simulated: advance it, look at it as it grows, take it.
///
/// ```
/// use drivescope_simulation::{named, Simulation};
/// let spec = named("city_hills").ok_or("no such drive")?;
/// let mut simulation = Simulation::new(&spec, Some(7))?;
/// simulation.advance(1.0);
/// assert_eq!(simulation.drive().imu.len(), 101);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Simulation {
    road: Road,
    plant: Plant,
    line: Driveline,
    driver: Driver,
    sensors: Suite,
    lever_arm: Vector3<f64>,
    frame: TangentFrame,
    motion: Motion,
    drive: Drive,
    /// Further sensors that measure the same motion, each with what it has recorded.
    others: Vec<(Suite, Drive)>,
    sample: u64,
    moved: (f64, f64),
    end: f64,
    done: bool,
    failure: Option<SpecError>,
}

impl Simulation {
    /// Prepare a drive with the seed given or else its own; the drive holds the sample of time 0.
    ///
    /// # Errors
    /// [`SpecError`] when the drive does not pass its checks.
    pub fn new(spec: &DriveSpec, seed: Option<u64>) -> Result<Self, SpecError> {
        Self::measured(spec, (spec, seed.unwrap_or(spec.seed)), &[])
    }

    fn measured(spec: &DriveSpec, first: (&DriveSpec, u64), others: &[(&DriveSpec, u64)]) -> Result<Self, SpecError> {
        spec.check()?;
        let params = spec.vehicle()?;
        let origin = daejeon();
        let gravity = Local::at(&origin).gravity;
        let road = Road::new(spec);
        let car = Car::new(&spec.car, params.clone(), gravity).with_shares(spec.resistance, spec.relaxation);
        let mut plant = Plant::new(car, &road, 0.0, gravity);
        let driver = Driver::new(spec, &road);
        let mut line = Driveline::default();
        if spec.start_speed_kmh > 0.0 {
            plant.set_speed(spec.start_speed_kmh / 3.6);
            line = Driveline::rolling(&plant.car, spec.start_speed_kmh / 3.6);
        }
        let lever_arm = Vector3::from(spec.lever_arm);
        let sensors = |(spec, seed): (&DriveSpec, u64)| Suite::new(spec, &plant, &road, RATE, seed);
        let motion = Motion::of(&plant, &lever_arm, origin);
        let drive = Drive {
            name: spec.name.clone(),
            truth: truth::series(),
            rear_axle: Some(-params.cg_to_rear - lever_arm.x),
            vehicle: Some(params),
            unix_zero: Some(FIELD_UNIX_TIME),
            ..Drive::default()
        };
        let others = others.iter().map(|&o| Ok((sensors(o)?, drive.clone()))).collect::<Result<_, SpecError>>()?;
        let mut simulation = Self {
            sensors: sensors(first)?,
            others,
            road,
            plant,
            line,
            driver,
            lever_arm,
            frame: TangentFrame::new(&origin),
            motion,
            drive,
            sample: 0,
            moved: (0.0, 0.0),
            end: spec.duration.unwrap_or(f64::INFINITY),
            done: false,
            failure: None,
        };
        let at_rest = motion.inertial_until(&motion, PERIOD);
        simulation.done = simulation.record(&at_rest, Vector3::zeros()).is_err();
        Ok(simulation)
    }

    /// Advance by this many seconds or to the drive's end; says whether the end is reached.
    pub fn advance(&mut self, seconds: f64) -> bool {
        let until = self.sample.saturating_add((seconds.max(0.0) * RATE).ceil() as u64);
        while self.sample < until && !self.done {
            self.next_sample();
        }
        self.done
    }

    /// Why the drive ended before its last stop, if it did.
    pub fn failure(&self) -> Option<&SpecError> {
        self.failure.as_ref()
    }

    /// Share of the road, or of the time, that lies behind, 0 to 1.
    pub fn fraction(&self) -> f64 {
        if self.done {
            1.0
        } else {
            (self.plant.patch().s / self.road.length()).max(self.time() / self.end).clamp(0.0, 0.999)
        }
    }

    /// Time reached, s.
    pub fn time(&self) -> f64 {
        self.sample as f64 * PERIOD
    }

    /// The drive as grown so far.
    pub fn drive(&self) -> &Drive {
        &self.drive
    }

    /// The drive, simulated to its end, or to where it failed.
    pub fn finish(mut self) -> Drive {
        while !self.advance(60.0) {}
        self.drive
    }

    fn next_sample(&mut self) {
        let demand = self.driver.act(&self.plant, &self.road, self.line.drive_force());
        for _ in 0..STEPS {
            let speed = self.plant.rim_speed()[2];
            let (drive, brake) = self.line.step(&self.plant.car, speed, &demand);
            let steer = self.driver.turn_wheel(STEP);
            self.plant.step(&self.road, &Inputs { steer, drive, brake });
        }
        let before = self.motion;
        let velocity = Motion::of(&self.plant, &self.lever_arm, before.place).velocity;
        self.motion = Motion::of(&self.plant, &self.lever_arm, before.place_after(&velocity, PERIOD));
        self.sample += 1;
        let inertial = before.inertial_until(&self.motion, PERIOD);
        let turning = (self.motion.rate - before.rate) / PERIOD;
        let refused = self.record(&inertial, turning).is_err();
        self.failure = self.trouble();
        self.done = refused || self.failure.is_some() || self.driver.is_done() || self.time() >= self.end;
    }

    /// Why the drive cannot go on, if it cannot.
    fn trouble(&mut self) -> Option<SpecError> {
        let (position, time, offset) = (self.plant.patch().s, self.time(), self.plant.offset());
        let astray = self.driver.astray(position, offset);
        if position > self.moved.1 + 0.5 || self.driver.is_standing() {
            self.moved = (time, position);
        }
        if !astray.is_finite() || astray.abs() > ROAD_HALF_WIDTH {
            return Some(SpecError::LeftRoad { position, time, offset });
        }
        (time - self.moved.0 > PATIENCE).then_some(SpecError::Stuck { position, time })
    }

    fn record(&mut self, inertial: &Inertial, turning: Vector3<f64>) -> Result<(), OutOfOrder> {
        let (time, plant) = (self.time(), &self.plant);
        let ned = self.frame.to_ned(&self.motion.place);
        let now = Instant {
            time,
            sample: self.sample,
            motion: &self.motion,
            inertial,
            turning,
            plant,
            steer: self.driver.steer(),
            engine_speed: self.line.engine_speed(&plant.car, plant.rim_speed()[2]),
        };
        let others = self.others.iter_mut().map(|(sensors, drive)| (sensors, drive));
        for (sensors, drive) in std::iter::once((&mut self.sensors, &mut self.drive)).chain(others) {
            drive.truth.push(time, &truth::row(&self.motion, &ned, inertial, plant, &sensors.biases()))?;
            sensors.record(&now, drive)?;
        }
        Ok(())
    }
}

/// Simulate a drive to its end, with the seed given or else its own.
///
/// # Errors
/// [`SpecError`] when the drive does not pass its checks, or when the car cannot drive it.
pub fn simulate(spec: &DriveSpec, seed: Option<u64>) -> Result<Drive, SpecError> {
    let mut simulation = Simulation::new(spec, seed)?;
    while !simulation.advance(60.0) {}
    match simulation.failure {
        Some(failure) => Err(failure),
        None => Ok(simulation.drive),
    }
}

/// Simulate a drive to its end once and measure it several times: each with the sensors, and the faults of them, that a
/// description has (nothing else of it is read), and with a seed. Where only those differ, what comes out is bit for bit what
/// [`simulate`] gives for each, at little more than the cost of one.
///
/// # Errors
/// [`SpecError`] when a description does not pass its checks, or when the car cannot drive it.
pub fn simulate_measured(spec: &DriveSpec, by: &[(&DriveSpec, u64)]) -> Result<Vec<Drive>, SpecError> {
    let Some((&first, others)) = by.split_first() else { return Ok(Vec::new()) };
    by.iter().try_for_each(|(spec, _)| spec.check())?;
    let mut simulation = Simulation::measured(spec, first, others)?;
    while !simulation.advance(60.0) {}
    let Simulation { failure, drive, others, .. } = simulation;
    failure.map_or_else(|| Ok(std::iter::once(drive).chain(others.into_iter().map(|(_, drive)| drive)).collect()), Err)
}

/// Hash of every bit of a drive's times and columns (FNV-1a over 64-bit words; all NaN alike).
///
/// The same drive with the same seed has the same fingerprint natively and in wasm.
pub fn fingerprint(drive: &Drive) -> u64 {
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    let mut add = |value: &f64| {
        let word = if value.is_nan() { 1 } else { value.to_bits() };
        hash = (hash ^ word).wrapping_mul(0x100_0000_01b3);
    };
    for series in drive.channels().into_iter().chain([&drive.truth]) {
        series.time().iter().for_each(&mut add);
        (0..series.schema().len()).flat_map(|i| series.column_at(i)).for_each(&mut add);
    }
    for (time, satellites) in drive.raw_gnss.iter() {
        add(&time);
        satellites.iter().for_each(|s| s.cells().iter().for_each(&mut add));
    }
    hash
}
