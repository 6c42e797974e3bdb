//! All sensors of a car: what each records at an instant, with the drive's faults.

use std::collections::VecDeque;

use drivescope_drive::channel::{MAX_COLUMNS, OutOfOrder, Record};
use drivescope_drive::drive::Drive;
use drivescope_drive::satellites::Satellite;
use drivescope_drive::signals::{Imu, Steering, Wheels};
use nalgebra::Vector3;

use super::satellites::Receiver;
use super::{car::CarSensors, disk::Disk, imu::ImuSensor, mag::MagSensor, magnetic, ring::Ring};
use super::{position::BaroSensor, position::GnssSensor};
use crate::driver::PERIOD;
use crate::grades::Grade;
use crate::motion::{Inertial, Motion};
use crate::plant::Plant;
use crate::road::Road;
use crate::spec::{Cluster, DriveSpec, Fault, FaultKind, SpecError};
use crate::truth::Biases;

/// Samples between two of the barometer and of the ring.
const SLOW_EVERY: u64 = 10;

/// What the sensors see of an instant.
#[derive(Clone, Copy, Debug)]
pub struct Instant<'a> {
    /// Time, s.
    pub time: f64,
    /// Number of the sample.
    pub sample: u64,
    /// The sensors' motion.
    pub motion: &'a Motion,
    /// What an error-free inertial sensor averages over the step that ends now.
    pub inertial: &'a Inertial,
    /// Mean change of the turn rate over that step, rad/s^2.
    pub turning: Vector3<f64>,
    /// The car.
    pub plant: &'a Plant,
    /// Angle of the road wheels, rad.
    pub steer: f64,
    /// Engine speed, rad/s.
    pub engine_speed: f64,
}

/// A line in which values wait.
#[derive(Clone, Debug)]
struct Delay<T> {
    waiting: VecDeque<T>,
    length: usize,
}

impl<T: Copy> Delay<T> {
    fn new(seconds: f64, step: f64) -> Self {
        Self { waiting: VecDeque::new(), length: (seconds / step).round() as usize }
    }
    /// Put a value in and take the one of that long ago out, or the first there was.
    fn pass(&mut self, value: T) -> T {
        self.waiting.push_back(value);
        let oldest = self.waiting.front().copied().unwrap_or(value);
        if self.waiting.len() > self.length {
            self.waiting.pop_front();
        }
        oldest
    }
}

/// Faults of single signals, with the value that each keeps.
#[derive(Clone, Debug)]
struct Meddler(Vec<(Fault, Option<f64>)>);

impl Meddler {
    fn apply<R: Record>(&mut self, (time, s): (f64, f64), row: R) -> R {
        if self.0.is_empty() {
            return row;
        }
        let mut cells = [0.0; MAX_COLUMNS];
        row.write(&mut cells[..R::COLUMNS.len()]);
        for (fault, kept) in self.0.iter_mut() {
            let Some(cell) = R::COLUMNS.iter().position(|c| Some(c.name) == fault.signal.as_deref()) else { continue };
            match (fault.acts(time, s), fault.kind) {
                (false, _) => *kept = None,
                (true, FaultKind::Bias) => cells[cell] += fault.size.unwrap_or(0.0),
                (true, _) => cells[cell] = *kept.get_or_insert(cells[cell]),
            }
        }
        R::read(|cell| cells[cell])
    }
}

#[derive(Clone, Debug)]
enum Fixes {
    Stated(GnssSensor),
    Solved(Receiver),
}

/// The sensors of a car.
#[derive(Clone, Debug)]
pub struct Suite {
    imu: ImuSensor,
    cluster: Cluster,
    disk: Option<Disk>,
    mag: MagSensor,
    car: CarSensors,
    late_car: Delay<(Wheels, Steering)>,
    fixes: Fixes,
    late_fix: Delay<Motion>,
    baro: BaroSensor,
    ring: Option<Ring>,
    gnss_every: u64,
    dark: Vec<Fault>,
    faults: Vec<Fault>,
    meddler: Meddler,
    view: Vec<Satellite>,
}

impl Suite {
    /// The sensors of a checked drive on its car and road.
    ///
    /// # Errors
    /// [`SpecError`] when a grade is not known.
    pub fn new(spec: &DriveSpec, plant: &Plant, road: &Road, rate: f64, seed: u64) -> Result<Self, SpecError> {
        let grade = grade(spec)?;
        let car = &plant.car;
        let gnss_every = (rate / grade.position.rate).round().max(1.0) as u64;
        let step = gnss_every as f64 * PERIOD;
        let fixes = if spec.has_satellites() {
            Fixes::Solved(Receiver::new(step, grade.position.slowest_course, &spec.faults, seed))
        } else {
            Fixes::Stated(GnssSensor::new(&grade.position, seed))
        };
        let dark = |f: &&Fault| matches!(f.kind, FaultKind::Outage | FaultKind::Tunnel);
        let on_signal = |f: &&Fault| f.signal.is_some();
        Ok(Self {
            imu: ImuSensor::new(&grade.imu, PERIOD, seed),
            cluster: spec.cluster,
            disk: (spec.cluster == Cluster::Disk).then(|| Disk::new(&grade.imu, PERIOD, seed)),
            mag: MagSensor::new(&grade.mag, seed),
            car: CarSensors::new(&grade.car, car.common.wheel_radius, car.params.steering_ratio, seed),
            late_car: Delay::new(grade.car.latency, PERIOD),
            fixes,
            late_fix: Delay::new(grade.position.latency, PERIOD),
            baro: BaroSensor::new(&grade.position, SLOW_EVERY as f64 * PERIOD, seed),
            ring: spec.ring.then(|| Ring::new(road, &spec.obstacles, seed)),
            gnss_every,
            dark: (spec.gnss_outages.iter().map(|o| Fault::outage(o.start, o.duration)))
                .chain(spec.faults.iter().filter(dark).cloned())
                .collect(),
            faults: spec.faults.clone(),
            meddler: Meddler(spec.faults.iter().filter(on_signal).map(|f| (f.clone(), None)).collect()),
            view: Vec::new(),
        })
    }

    /// Biases of the inertial sensor now.
    pub fn biases(&self) -> Biases {
        Biases { accel: self.imu.accel_bias(), gyro: self.imu.gyro_bias() }
    }

    /// Record an instant.
    ///
    /// # Errors
    /// [`OutOfOrder`] when it is not after the last one.
    pub fn record(&mut self, now: &Instant, drive: &mut Drive) -> Result<(), OutOfOrder> {
        let (time, motion, speed) = (now.time, now.motion, now.motion.velocity.norm());
        let here = (time, now.plant.patch().s);
        let imu = self.imu.next(now.inertial, speed, now.engine_speed);
        let imu = present(self.cluster, imu);
        drive.imu.push(time, self.meddler.apply(here, imu))?;
        if let Some(disk) = &mut self.disk {
            drive.accel_array.push(time, disk.next(now.inertial, &now.turning, speed, now.engine_speed))?;
        }
        let field = magnetic::field(&self.mag.field(), &self.faults, time, here.1, motion);
        drive.mag.push(time, self.meddler.apply(here, self.mag.next(motion, &field)))?;
        let wheels = self.car.wheels(time, &now.plant.rim_speed(), &now.plant.turned());
        let (wheels, steering) = self.late_car.pass((wheels, self.car.steering(now.steer)));
        drive.wheels.push(time, self.meddler.apply(here, wheels))?;
        drive.steering.push(time, self.meddler.apply(here, steering))?;
        let late = self.late_fix.pass(*motion);
        if now.sample.is_multiple_of(self.gnss_every) {
            let outage = self.dark.iter().any(|fault| fault.acts(here.0, here.1));
            self.view.clear();
            let fix = match &mut self.fixes {
                Fixes::Stated(sensor) => sensor.next(&late, outage),
                Fixes::Solved(receiver) => receiver.next(here, &late, outage, &mut self.view),
            };
            drive.gnss.push(time, self.meddler.apply(here, fix))?;
            drive.raw_gnss.push(time, &self.view)?;
        }
        if now.sample.is_multiple_of(SLOW_EVERY) {
            drive.baro.push(time, self.meddler.apply(here, self.baro.next(motion)))?;
            if let Some(ring) = &mut self.ring {
                drive.range.push(time, ring.next(now.plant))?;
            }
        }
        Ok(())
    }
}

/// The grade of the drive's sensors with its parts and iron.
fn grade(spec: &DriveSpec) -> Result<Grade, SpecError> {
    let named = |path: &str, name: &str| {
        Grade::named(name).ok_or_else(|| SpecError::Conflict { path: path.into(), expected: "a known grade".into() })
    };
    let mut grade = *named("sensors", &spec.sensors)?;
    let part = |name: &Option<String>| name.as_deref().map_or(Ok(None), |n| named("parts", n).map(Some));
    if let Some(other) = part(&spec.parts.imu)? {
        grade.imu = other.imu;
    }
    if let Some(other) = part(&spec.parts.mag)? {
        grade.mag = other.mag;
    }
    if let Some(other) = part(&spec.parts.wheels)? {
        grade.car = other.car;
    }
    if let Some(other) = part(&spec.parts.gnss)? {
        grade.position = other.position;
    }
    if let Some(iron) = &spec.iron {
        (grade.mag.hard_iron, grade.mag.soft_iron) = (iron.hard, iron.soft);
    }
    Ok(grade)
}

/// The sample as the cluster has it: NaN where there is no sensor.
fn present(cluster: Cluster, imu: Imu) -> Imu {
    match cluster {
        Cluster::Full => imu,
        Cluster::Esc => Imu { accel_x: imu.accel_x, accel_y: imu.accel_y, gyro_z: imu.gyro_z, ..Imu::default() },
        Cluster::Disk => Imu { gyro_z: imu.gyro_z, ..Imu::default() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delayed_value_comes_out_as_late_as_declared() {
        let mut delay = Delay::new(0.02, 0.01);
        let out: Vec<i32> = (0..6).map(|k| delay.pass(k)).collect();
        assert_eq!(out, [0, 0, 0, 1, 2, 3]);
        let mut none = Delay::new(0.0, 0.01);
        assert_eq!((none.pass(7), none.pass(8)), (7, 8));
    }
}
