//! The constant offset of the forward accelerometer, from the drive's own balance of energy.
//!
//! Per unit of mass, the work of the specific force goes into speed and height:
//! `int a v dt = v^2 / 2 + g h + b s`, with `b` the sensor's offset (its bias, and the pitch of its mount times gravity) and
//! `s` the distance. `b` is the slope of what is left over against distance, by least squares over all heights of the drive.
//! Barometric heights are used where there are any, else the receiver's heights, else its vertical velocity, summed.
//! Not told apart: bias and mount. The error of the heights is taken as correlated over a minute.

use drivescope_drive::drive::Drive;
use drivescope_drive::geodesy::STANDARD_GRAVITY;

/// A hole in the record that is not bridged, s.
const WIDEST_GAP: f64 = 0.5;
/// How long an error of the height lasts, s.
const CORRELATION_TIME: f64 = 60.0;
/// The shortest distance that tells anything, m.
const SHORTEST: f64 = 200.0;

/// An offset that was found.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ForwardOffset {
    /// Offset of the forward accelerometer, m/s^2: what has to be taken off.
    pub offset: f64,
    /// 1-sigma of it, from what does not fit, m/s^2.
    pub sigma: f64,
    /// Distance over which it was found, m.
    pub distance: f64,
}

/// An offset from which on it is worth a word, m/s^2: 0.2 deg of grade.
const NOTABLE: f64 = 0.03;

impl ForwardOffset {
    /// Whether it is large enough and clear enough, at three sigmas, to be taken off.
    pub fn is_notable(&self) -> bool {
        self.offset.abs() > NOTABLE.max(3.0 * self.sigma)
    }
}

/// Least squares of a line, one point at a time.
#[derive(Default)]
struct Line {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Line {
    fn add(&mut self, x: f64, y: f64) {
        self.count += 1.0;
        let (dx, dy) = (x - self.x, y - self.y);
        self.x += dx / self.count;
        self.y += dy / self.count;
        self.xx += dx * (x - self.x);
        self.xy += dx * (y - self.y);
        self.yy += dy * (y - self.y);
    }
    fn slope(&self) -> f64 {
        self.xy / self.xx
    }
    /// Variance of the slope if the points are worth `independent` ones.
    fn slope_variance(&self, independent: f64) -> f64 {
        let left = (self.yy - self.xy * self.xy / self.xx).max(0.0) / self.count;
        left / (self.xx / self.count * independent)
    }
}

/// Heights of the best source, m, with their times.
fn heights(drive: &Drive) -> Vec<(f64, f64)> {
    let baro: Vec<_> = drive.baro.iter().map(|(t, b)| (t, b.altitude)).filter(|h| h.1.is_finite()).collect();
    if baro.len() > 1 {
        return baro;
    }
    let usable = || drive.gnss.iter().filter(|(_, g)| g.is_usable());
    let height = usable().map(|(t, g)| (t, if g.alt.is_finite() { g.alt } else { -g.down }));
    let height: Vec<_> = height.filter(|h| h.1.is_finite()).collect();
    if height.len() > 1 {
        return height;
    }
    let mut sum = 0.0;
    let mut before: Option<(f64, f64)> = None;
    usable()
        .filter(|(_, g)| g.v_down.is_finite())
        .map(|(t, g)| {
            sum -= before.map_or(0.0, |(t0, v0)| 0.5 * (v0 + g.v_down) * (t - t0));
            before = Some((t, g.v_down));
            (t, sum)
        })
        .collect()
}

/// The offset of the forward accelerometer; `None` where the drive has no heights or is too short.
pub fn find_forward_offset(drive: &Drive) -> Option<ForwardOffset> {
    let heights = heights(drive);
    let first = heights.first()?;
    let (mut line, mut next) = (Line::default(), 0);
    let (mut distance, mut work) = (0.0, 0.0);
    let mut before: Option<(f64, f64, f64)> = None;
    let mut wheels = drive.wheels.iter().map(|(t, w)| (t, w.forward_speed())).filter(|w| w.1.is_finite()).peekable();
    let mut left = wheels.next()?;
    for (time, sample) in drive.imu.iter().filter(|(_, s)| s.accel_x.is_finite()) {
        while let Some(&right) = wheels.peek().filter(|w| w.0 <= time) {
            left = right;
            wheels.next();
        }
        let Some(&right) = wheels.peek() else { break };
        if left.0 > time || right.0 - left.0 > WIDEST_GAP {
            before = None;
            continue;
        }
        let speed = left.1 + (right.1 - left.1) * (time - left.0) / (right.0 - left.0);
        if let Some((t0, v0, a0)) = before.filter(|b| time - b.0 <= WIDEST_GAP) {
            distance += 0.5 * (v0 + speed) * (time - t0);
            work += 0.25 * (v0 + speed) * (a0 + sample.accel_x) * (time - t0);
        }
        before = Some((time, speed, sample.accel_x));
        while next < heights.len() && heights[next].0 <= time {
            let risen = heights[next].1 - first.1;
            line.add(distance, work - 0.5 * speed * speed - STANDARD_GRAVITY * risen);
            next += 1;
        }
    }
    let duration = heights.last()?.0 - first.0;
    let independent = (duration / CORRELATION_TIME).max(1.0);
    let found = ForwardOffset { offset: line.slope(), sigma: line.slope_variance(independent).sqrt(), distance };
    (distance >= SHORTEST && line.count > 2.0 && found.offset.is_finite() && found.sigma.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::signals::{Baro, Gnss, Imu, Wheels};

    const OFFSET: f64 = -0.7;

    /// Two minutes over hills with changing speed; the sensor leans and is biased.
    fn drive(heights: impl Fn(&mut Drive, f64, f64, f64)) -> Drive {
        let mut drive = Drive::default();
        let (mut speed, mut height) = (10.0, 50.0);
        for k in 0..12_000 {
            let t = f64::from(k) * 0.01;
            let (grade, net) = (0.05 * (0.06 * t).sin() + 0.01, 0.8 * (0.2 * t).sin());
            let accel_x = net + STANDARD_GRAVITY * f64::sin(grade) + OFFSET;
            drive.imu.push(t, Imu { accel_x, ..Imu::default() }).unwrap();
            drive.wheels.push(t + 0.003, Wheels { speed, ..Wheels::default() }).unwrap();
            if k % 10 == 0 {
                heights(&mut drive, t + 0.001, height, speed * f64::sin(grade));
            }
            speed += net * 0.01;
            height += speed * f64::sin(grade) * 0.01;
        }
        drive
    }

    #[test]
    fn the_offset_is_found_from_any_source_of_height() {
        // Without noise what is left is the sum over 10 ms steps: far below 0.01 m/s^2, a sixteenth of a degree.
        let baro = |d: &mut Drive, t, altitude, _| d.baro.push(t, Baro { altitude }).unwrap();
        let alt = |d: &mut Drive, t, alt, _| d.gnss.push(t, Gnss { alt, ..Gnss::default() }).unwrap();
        let climb = |d: &mut Drive, t, _, up: f64| d.gnss.push(t, Gnss { v_down: -up, ..Gnss::default() }).unwrap();
        for drive in [drive(baro), drive(alt), drive(climb)] {
            let found = find_forward_offset(&drive).unwrap();
            assert!((found.offset - OFFSET).abs() < 0.01, "{found:?}");
            assert!(found.distance > 1000.0 && found.sigma < 0.01, "{found:?}");
        }
    }

    #[test]
    fn without_heights_or_on_a_short_way_nothing_is_found() {
        assert!(find_forward_offset(&drive(|_, _, _, _| ())).is_none());
        assert!(find_forward_offset(&Drive::default()).is_none());
    }
}
