//! Manoeuvres: open-loop steering and braking over time, and the line of lane changes over distance.

use crate::math::{sin_cos, smooth_step, smooth_step_bend, smooth_step_slope};
use crate::spec::{DriveSpec, LaneChange, Manoeuvre, ManoeuvreKind};

/// Sections of the double lane change, m: entry, transition, side lane, transition, exit (ISO 3888-1).
const SECTIONS: [f64; 5] = [15.0, 30.0, 25.0, 25.0, 30.0];
/// Offset of its side lane, m.
const SIDE_LANE: f64 = 3.5;
/// How far each transition reaches into the lanes, m.
const REACH: f64 = 7.0;

/// The line that the driver follows beside the centre line.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// Start, length and change of the offset, m.
    changes: Vec<(f64, f64, f64)>,
}

impl Line {
    /// The lane changes of a drive, those of a double lane change (to the left and back) among them.
    pub fn new(spec: &DriveSpec) -> Self {
        let mut list = spec.lane_changes.clone();
        if let Some(m) = spec.manoeuvre.filter(|m| m.kind == ManoeuvreKind::DoubleLaneChange) {
            let [entry, out, side, back, _] = SECTIONS.map(|length| length * m.stretch);
            let reach = REACH * m.stretch;
            let change =
                |at: f64, length: f64, to: f64| LaneChange { at: at - reach, length: length + 2.0 * reach, to };
            list.push(change(m.at + entry, out, -SIDE_LANE));
            list.push(change(m.at + entry + out + side, back, 0.0));
        }
        // A handful of entries: the library's sort would be as large as this file.
        for end in (1..list.len()).rev() {
            for k in 0..end {
                if list[k].at > list[k + 1].at {
                    list.swap(k, k + 1);
                }
            }
        }
        let mut before = 0.0;
        let changes = list.iter().map(|c| (c.at, c.length, c.to - std::mem::replace(&mut before, c.to))).collect();
        Self { changes }
    }

    /// Whether the line is the centre line.
    pub fn is_centre(&self) -> bool {
        self.changes.is_empty()
    }

    /// Offset to the right, m, and its first and second derivative along the road.
    pub fn at(&self, s: f64) -> [f64; 3] {
        self.changes.iter().fold([0.0; 3], |[y, slope, bend], &(at, length, change)| {
            let t = (s - at) / length;
            [
                y + change * smooth_step(t),
                slope + change * smooth_step_slope(t) / length,
                bend + change * smooth_step_bend(t) / (length * length),
            ]
        })
    }
}

/// What an open-loop manoeuvre does to the pedals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pedals {
    /// Hold this speed, m/s.
    Hold(f64),
    /// Neither pedal.
    Rolling,
    /// Brake with a force of this much per mass, m/s^2.
    Brake(f64),
}

impl Manoeuvre {
    /// Angle of the road wheels at a time since the beginning, rad.
    pub fn steer(&self, time: f64) -> f64 {
        let peak = self.steer_deg.to_radians();
        match self.kind {
            ManoeuvreKind::StepSteer | ManoeuvreKind::JTurn => peak * (time / self.rise).clamp(0.0, 1.0),
            ManoeuvreKind::SineWithDwell => {
                let second_peak = 0.75 / self.frequency;
                let running = if time < second_peak { time } else { (time - self.dwell).max(second_peak) };
                let ended = running * self.frequency >= 1.0;
                if ended { 0.0 } else { peak * sin_cos(std::f64::consts::TAU * self.frequency * running).0 }
            }
            ManoeuvreKind::Braking | ManoeuvreKind::DoubleLaneChange => 0.0,
        }
    }

    /// What it does to the pedals when begun at a speed, m/s.
    pub fn pedals(&self, speed: f64) -> Pedals {
        match self.kind {
            ManoeuvreKind::StepSteer => Pedals::Hold(speed),
            ManoeuvreKind::Braking => Pedals::Brake(self.deceleration),
            _ => Pedals::Rolling,
        }
    }

    /// Whether it is over, by the time since its beginning (s) and the speed (m/s).
    pub fn is_over(&self, time: f64, speed: f64) -> bool {
        if self.kind == ManoeuvreKind::Braking { speed < 0.3 } else { time >= self.duration || speed < 0.3 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(more: &str) -> DriveSpec {
        let text =
            format!(r#"{{"name": "x", "description": "y", "segments": [{{"length": 500, "speed_kmh": 80}}], {more}}}"#);
        DriveSpec::from_json(&text).unwrap()
    }

    #[test]
    fn the_double_lane_change_lies_where_the_standard_has_its_lanes() {
        let line = Line::new(&spec(r#""manoeuvre": {"kind": "double_lane_change", "at": 100}"#));
        assert_eq!(line.at(100.0)[0], 0.0);
        // The side lane reaches from 45 to 70 m after the entrance; transitions reach 7 m into it.
        assert!((line.at(152.0)[0] + 3.5).abs() < 1e-12 && (line.at(163.0)[0] + 3.5).abs() < 1e-12);
        assert!(line.at(202.0)[0].abs() < 1e-12);
        let h = 1e-4;
        for k in 0..1200 {
            let s = 95.0 + f64::from(k) * 0.1;
            let (a, b) = (line.at(s - h), line.at(s + h));
            // Central difference: h^2 times derivatives below 1e-3, plus rounding 1e-15 / h.
            assert!(((b[0] - a[0]) / (2.0 * h) - line.at(s)[1]).abs() < 1e-9);
            // The third derivative jumps by 60 * 3.5 / 39^3 /m^2 where a change ends: h times that.
            assert!(((b[1] - a[1]) / (2.0 * h) - line.at(s)[2]).abs() < 4e-7);
        }
    }

    #[test]
    fn the_sine_dwells_at_its_second_peak_and_ends_at_zero() {
        let m = spec(r#""manoeuvre": {"kind": "sine_with_dwell", "at": 100, "steer_deg": 3}"#).manoeuvre.unwrap();
        let peak = 3_f64.to_radians();
        assert!((m.steer(0.25 / 0.7) - peak).abs() < 1e-12);
        for after in [0.0, 0.2, 0.499] {
            assert!((m.steer(0.75 / 0.7 + after) + peak).abs() < 1e-12, "held for half a second");
        }
        assert!((m.steer(0.875 / 0.7 + 0.5) + peak * 0.5_f64.sqrt()).abs() < 1e-12);
        assert_eq!(m.steer(1.0 / 0.7 + 0.51), 0.0);
    }
}
