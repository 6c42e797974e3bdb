//! What a closed loop writes down as it runs.

use drivescope_control::Pose;
use drivescope_control::vfh::{AXES, Choice};
use drivescope_drive::channel::{Channel, Column, Record, Series};
use drivescope_drive::drive::{Drive, Epoch};
use drivescope_drive::signals::{Range, Steering};
use drivescope_drive::truth::truth_column;
use drivescope_drive::vehicle::VehicleParams;

use super::guidance::{Decision, Guidance};
use super::rows::{GuidanceRow, LoopRow, RANGES_AT};
use crate::math::roll_pitch_yaw;
use crate::motion::Motion;
use crate::truth::Biases;

const TRUTH: [&str; 24] = [
    "roll",
    "pitch",
    "yaw",
    "grade",
    "bank",
    "sideslip",
    "course",
    "vx",
    "vy",
    "n",
    "e",
    "d",
    "lat",
    "lon",
    "alt",
    "vn",
    "ve",
    "vd",
    "yaw_rate",
    "gyro_bias_z",
    "accel_bias_x",
    "accel_bias_y",
    "gyro_bias_x",
    "gyro_bias_y",
];
/// Slower than this the truth has no course, m/s.
const NO_COURSE: f64 = 0.5;

pub(super) struct Log {
    pub rows: Channel<LoopRow>,
    pub guidance: Channel<GuidanceRow>,
    pub magnitudes: Vec<f64>,
    pub blocked: Vec<u8>,
    pub drive: Drive,
}

impl Log {
    pub fn new(name: &str, vehicle: &VehicleParams) -> Self {
        let columns: Vec<Column> = TRUTH.iter().filter_map(|name| truth_column(name).copied()).collect();
        let drive = Drive {
            name: name.into(),
            truth: Series::new(&columns),
            vehicle: Some(vehicle.clone()),
            ..Drive::default()
        };
        Self {
            rows: Channel::default(),
            guidance: Channel::default(),
            magnitudes: Vec::new(),
            blocked: Vec::new(),
            drive,
        }
    }

    /// An epoch and the truth behind it. Times only grow, so that nothing is refused.
    pub fn measured(&mut self, epoch: &Epoch, pose: &Pose, motion: &Motion, biases: &Biases) {
        let (time, drive) = (epoch.time, &mut self.drive);
        epoch.imu.map(|sample| drive.imu.push(time, sample));
        epoch.wheels.map(|sample| drive.wheels.push(time, sample));
        epoch.gnss.map(|sample| drive.gnss.push(time, sample));
        epoch.range.map(|sample| drive.range.push(time, sample));
        let [roll, pitch, yaw] = roll_pitch_yaw(&motion.attitude);
        let v = motion.velocity;
        let when_moving = |angle: f64| if v.norm() > NO_COURSE { angle } else { f64::NAN };
        let sideslip = when_moving(libm::atan2(pose.lateral_speed, pose.speed));
        let place = motion.place;
        let down = -(place.alt - crate::motion::daejeon().alt);
        let row: [f64; TRUTH.len()] = [
            roll,
            pitch,
            yaw,
            0.0,
            0.0,
            sideslip,
            when_moving(libm::atan2(v.y, v.x)),
            pose.speed,
            pose.lateral_speed,
            pose.north,
            pose.east,
            down,
            place.lat,
            place.lon,
            place.alt,
            v.x,
            v.y,
            v.z,
            pose.yaw_rate,
            biases.gyro.z,
            biases.accel.x,
            biases.accel.y,
            biases.gyro.x,
            biases.gyro.y,
        ];
        let _ = drive.truth.push(time, &row);
    }

    /// What the ring read at this time, if it did.
    pub fn last_ranges(&self, time: f64) -> Option<[f64; AXES]> {
        let range = &self.drive.range;
        let last = range.len().checked_sub(1).map(|i| range.at(i))?;
        let mut ranges = [0.0; AXES];
        last.1.write(&mut ranges);
        (last.0 == time).then_some(ranges)
    }

    /// A row of the car.
    pub fn row(&mut self, time: f64, row: LoopRow) {
        let _ = self.drive.steering.push(time, Steering { steer: row.steer, ..Steering::default() });
        let _ = self.rows.push(time, row);
    }

    /// A decision and what it was taken from.
    pub fn decided(
        &mut self,
        time: f64,
        guidance: &Guidance,
        decision: &Decision,
        truth: &Pose,
        ranges: Option<&[f64; AXES]>,
    ) {
        const { assert!(RANGES_AT + AXES == GuidanceRow::COLUMNS.len() && Range::COLUMNS.len() == AXES) };
        let cross_track = match guidance.path() {
            Some(path) => path.offset(path.nearest(truth.north, truth.east), truth.north, truth.east),
            None => guidance.goal().map_or(f64::NAN, |_| truth.east),
        };
        let away = |p: &[f64; 3]| {
            let (dn, de) = (p[0] - truth.north, p[1] - truth.east);
            (dn * dn + de * de).sqrt() - p[2]
        };
        let clearance = guidance.posts().iter().map(away).fold(f64::NAN, f64::min);
        let avoiding = match decision.choice {
            Choice::Clear => 0.0,
            Choice::Around(_) => 1.0,
            Choice::Stop => 2.0,
        };
        let mut cells = [f64::NAN; RANGES_AT + AXES];
        cells[..RANGES_AT].copy_from_slice(&[
            cross_track,
            clearance,
            decision.target.0,
            decision.target.1,
            decision.direction,
            avoiding,
            decision.steer.unwrap_or(f64::NAN),
        ]);
        if let Some(ranges) = ranges {
            cells[RANGES_AT..].copy_from_slice(ranges);
            self.magnitudes.extend_from_slice(guidance.histogram().magnitudes());
            self.blocked.extend(guidance.histogram().blocked().iter().map(|b| u8::from(*b)));
        }
        let _ = self.guidance.push(time, GuidanceRow::read(|i| cells[i]));
    }
}
