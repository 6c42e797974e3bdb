//! Ground robots' recordings for the tests: IMU and odometry out of an uncompressed MCAP file of ROS 2 messages.
//!
//! Enough of both formats for the two public recordings; no reader for users.

use drivescope_drive::drive::Drive;
use drivescope_drive::signals::{Imu, Wheels};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Little-endian numbers, one after the other.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> &'a [u8] {
        let (head, tail) = self.0.split_at(count.min(self.0.len()));
        self.0 = tail;
        head
    }
    fn number(&mut self, size: usize) -> u64 {
        self.take(size).iter().rev().fold(0, |n, b| n << 8 | u64::from(*b))
    }
    fn float(&mut self) -> f64 {
        f64::from_bits(self.number(8))
    }
}

/// Topic and payload of every message, in the order of the file.
fn messages(bytes: &[u8]) -> Vec<(String, &[u8])> {
    let (mut topics, mut found) = (std::collections::BTreeMap::new(), Vec::new());
    let mut open = vec![Bytes(&bytes[8..])];
    while let Some(mut records) = open.pop() {
        if records.0.len() < 9 {
            continue;
        }
        let (code, length) = (records.number(1), records.number(8) as usize);
        let mut record = Bytes(records.take(length));
        open.push(records);
        match code {
            4 => {
                let (id, _schema, size) = (record.number(2), record.number(2), record.number(4) as usize);
                topics.insert(id, String::from_utf8_lossy(record.take(size)).into_owned());
            }
            5 => {
                let id = record.number(2);
                record.take(4 + 8 + 8);
                found.push((topics.get(&id).cloned().unwrap_or_default(), record.0));
            }
            6 => {
                record.take(8 + 8 + 8 + 4);
                let size = record.number(4) as usize;
                assert!(record.take(size).is_empty(), "chunks are not compressed");
                record.take(8);
                open.push(record);
            }
            _ => {}
        }
    }
    found
}

/// Time of a message's header, s, and the rest behind its text, aligned to eight bytes after the CDR header.
fn header<'a>(payload: &'a [u8], texts: usize) -> (f64, Bytes<'a>) {
    let body = &payload[4..];
    let mut bytes = Bytes(body);
    let time = bytes.number(4) as f64 + bytes.number(4) as f64 * 1e-9;
    for _ in 0..texts {
        let gap = (body.len() - bytes.0.len()).next_multiple_of(4) - (body.len() - bytes.0.len());
        bytes.take(gap);
        let size = bytes.number(4) as usize;
        bytes.take(size);
    }
    let used = body.len() - bytes.0.len();
    bytes.take(used.next_multiple_of(8) - used);
    (time, bytes)
}

/// What a robot recorded: inertial samples in the sensor's own axes, and speed and yaw rate (left positive) by its wheels.
pub struct Robot {
    /// Time, specific force as read (up positive), rates.
    pub imu: Vec<(f64, Vector3<f64>, Vector3<f64>)>,
    /// Time, forward speed, yaw rate to the left. Skidding wheels overstate the yaw rate of a robot that steers by them.
    pub odometry: Vec<(f64, f64, f64)>,
    /// Time, and the turn of the sensor's axes against the ground by its own attitude filter.
    pub attitude: Vec<(f64, UnitQuaternion<f64>)>,
}

impl Robot {
    /// Read a recording; time counts from its first sample.
    pub fn read(bytes: &[u8]) -> Self {
        let (mut imu, mut odometry, mut attitude) = (Vec::new(), Vec::new(), Vec::new());
        for (topic, payload) in messages(bytes) {
            if topic.ends_with("/imu/data") {
                let (time, mut b) = header(payload, 1);
                let q: [f64; 4] = std::array::from_fn(|_| b.float());
                attitude.push((time, UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[0], q[1], q[2]))));
                b.take(8 * 9);
                let rate = Vector3::from_fn(|_, _| b.float());
                b.take(8 * 9);
                imu.push((time, Vector3::from_fn(|_, _| b.float()), rate));
            } else if topic.ends_with("/odom") {
                let (time, mut b) = header(payload, 2);
                b.take(8 * (7 + 36));
                let twist: [f64; 6] = std::array::from_fn(|_| b.float());
                odometry.push((time, twist[0], twist[5]));
            }
        }
        let first = imu.first().map_or(0.0, |i: &(f64, _, _)| i.0);
        imu.iter_mut().for_each(|i| i.0 -= first);
        odometry.iter_mut().for_each(|o| o.0 -= first);
        attitude.iter_mut().for_each(|a| a.0 -= first);
        imu.sort_by(|a, b| a.0.total_cmp(&b.0));
        odometry.sort_by(|a, b| a.0.total_cmp(&b.0));
        attitude.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { imu, odometry, attitude }
    }

    /// The speed and yaw rate by the wheels at a time; the last sample before it.
    pub fn wheels_at(&self, time: f64) -> Option<(f64, f64)> {
        let after = self.odometry.partition_point(|o| o.0 <= time);
        after.checked_sub(1).map(|i| (self.odometry[i].1, self.odometry[i].2))
    }

    /// Turn rate about the vertical by the robot's own attitude filter, over a second about a time, rad/s.
    pub fn turn_rate(&self, time: f64) -> Option<f64> {
        let at = |t: f64| self.attitude.get(self.attitude.partition_point(|a| a.0 < t));
        let (before, after) = (at(time - 0.5)?, at(time + 0.5)?);
        let turned = (after.1 * before.1.inverse()).scaled_axis();
        Some(turned.z / (after.0 - before.0))
    }

    /// Rotation from the sensor's axes to forward, right, down: down from gravity over the whole recording, forward the
    /// horizontal direction along which the force follows the change of the wheels' speed.
    pub fn mounting(&self) -> Matrix3<f64> {
        let mean = self.imu.iter().map(|i| i.1).sum::<Vector3<f64>>() / self.imu.len() as f64;
        let down = -mean.normalize();
        let mut along = Vector3::zeros();
        for (time, force, _) in &self.imu {
            let (Some((before, _)), Some((after, _))) = (self.wheels_at(time - 0.25), self.wheels_at(time + 0.25))
            else {
                continue;
            };
            let level = force - mean;
            along += (level - down * down.dot(&level)) * (after - before);
        }
        let forward = along.normalize();
        let right = down.cross(&forward);
        Matrix3::from_rows(&[forward.transpose(), right.transpose(), down.transpose()])
    }

    /// The drive in forward, right, down axes; without the wheels' speed unless `with_wheels`.
    pub fn drive(&self, with_wheels: bool) -> Drive {
        let mounting = self.mounting();
        let mut drive = Drive::default();
        for (time, force, rate) in &self.imu {
            let (f, w) = (mounting * force, mounting * rate);
            let imu = Imu { accel_x: f.x, accel_y: f.y, accel_z: f.z, gyro_x: w.x, gyro_y: w.y, gyro_z: w.z };
            // A repeated stamp is left out.
            let _ = drive.imu.push(*time, imu);
        }
        if with_wheels {
            for (time, speed, _) in &self.odometry {
                let _ = drive.wheels.push(*time, Wheels { speed: *speed, ..Wheels::default() });
            }
        }
        drive
    }
}
