//! The magnetometer among the columns: unit, axes and lean, by how the Earth's field turns with the heading.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::Geodetic;
use drivescope_drive::magnetic_model::earth_field;

use super::gnss::{MOVING, Motion};
use super::inertial::integral;
use super::linear::{Normal, Solved, cross, dot, norm, seat, unit};
use super::scene::{STEP, slope};
use super::survey::{Kind, Role, Survey, Weight};
use crate::candidate::Confidence;
use crate::fit::nearest;

/// Units of a field: what 1 uT reads.
const UNITS: [(&str, f64); 6] = [("uT", 1.0), ("nT", 1e3), ("mG", 10.0), ("G", 0.01), ("mT", 1e-3), ("T", 1e-6)];
const MOST: usize = 24;

/// The Earth's field where the drive was: horizontal and vertical strength, uT, and declination, rad.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Earth {
    pub level: f64,
    pub down: f64,
    pub declination: f64,
}

impl Earth {
    /// The model's field at a place and a Unix time.
    pub fn at(lat: f64, lon: f64, unix: Option<f64>) -> Option<Self> {
        let year = unix.map_or(2025.0, |u| 1970.0 + u / 31_556_952.0);
        let f = earth_field(&Geodetic { lat, lon, alt: 0.0 }, year);
        let level = f.x.hypot(f.y);
        level.is_finite().then_some(Self { level, down: f.z, declination: f.y.atan2(f.x) })
    }
}

/// Heading on the grid: the yaw gyro's integral, led to the course at the fixes.
pub(crate) fn heading(motion: &Motion, late: f64, rate: Option<&[f64]>, bins: usize) -> Vec<f64> {
    let turned = rate.map_or_else(|| vec![0.0; bins], integral);
    let mut out = vec![f64::NAN; bins];
    let mut last: Option<(usize, f64)> = None;
    for (i, &t) in motion.time.iter().enumerate().filter(|(i, _)| motion.speed[*i] > MOVING) {
        let place = (t - late) / STEP - 0.5;
        if place < 0.0 || place as usize >= bins {
            continue;
        }
        let bin = place.round() as usize;
        if bin >= bins {
            continue;
        }
        let course = motion.velocity[i][1].atan2(motion.velocity[i][0]);
        let mut offset = course - turned[bin];
        if let Some((from, before)) = last {
            offset = before + wrap_angle(offset - before);
            let apart = bin.saturating_sub(from);
            if apart > 0 && (rate.is_some() && apart < 600 || apart <= 25) {
                for k in from..bin {
                    out[k] = turned[k] + before + (offset - before) * (k - from) as f64 / apart as f64;
                }
            }
        }
        last = Some((bin, offset));
    }
    out
}

/// Three columns as a magnetometer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Compass {
    pub columns: [usize; 3],
    pub unit: &'static str,
    pub one: f64,
    pub seating: super::linear::Seating,
    pub cost: f64,
    pub sigma: f64,
    /// Whether the vertical part agrees with the model, so that its sign is known.
    pub upright: bool,
    /// What is left when the Earth's field is taken away: the offset, uT, along the columns.
    pub offset: [f64; 3],
}

/// The three columns that turn with the heading as the Earth's field does.
///
/// `lean` is how the car pitches and rolls, rad, on the grid; level where it is not known.
pub(crate) fn find(s: &Survey, heading: &[f64], earth: &Earth, lean: Option<&[Vec<f64>; 2]>) -> Option<Compass> {
    let mut columns = s.columns(Kind::Mag);
    columns.retain(|&c| s.scene.fields[c].period < 0.6);
    columns.truncate(MOST);
    let ends = heading
        .iter()
        .filter(|h| h.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |r, h| [r[0].min(*h), r[1].max(*h)]);
    let span = ends[1] - ends[0];
    // The field along the car's forward and right axes.
    let field: Vec<[f64; 3]> = heading
        .iter()
        .enumerate()
        .map(|(i, psi)| {
            let (sin, cos) = (psi - earth.declination).sin_cos();
            let angle = |k: usize| lean.map_or(0.0, |l| l[k][i]).clamp(-0.4, 0.4);
            let (pitch, roll) = (angle(0), angle(1));
            let (ahead, aside) = (earth.level * cos, -earth.level * sin);
            [ahead - earth.down * pitch, aside + earth.down * roll, earth.down + pitch * ahead - roll * aside]
        })
        .collect();
    let fits: Vec<Fits> = columns
        .iter()
        .map(|&column| {
            let (mut free, mut clean) = (Normal::default(), Normal::default());
            for (b, y) in field.iter().zip(&s.scene.fields[column].grid).step_by(3) {
                free.add(&[b[0], b[1], 1.0], *y);
                clean.add(b, *y);
            }
            Fits { column, free: free.solve(3), clean: clean.solve(3) }
        })
        .collect();
    let mut best: Option<Compass> = None;
    for i in 0..fits.len() {
        for j in i + 1..fits.len() {
            for k in j + 1..fits.len() {
                let three = [&fits[i], &fits[j], &fits[k]];
                let found = calibrated(three).or_else(|| judge(three, earth, span));
                if let Some(c) = found.filter(|c| best.is_none_or(|b| c.cost < b.cost)) {
                    best = Some(c);
                }
            }
        }
    }
    best.filter(|b| b.cost < 14.0 && span > 0.5)
}

/// One column against the field: with an offset, and without.
struct Fits {
    column: usize,
    free: Solved,
    clean: Solved,
}

/// Three columns as a magnetometer without offset: then even a quarter turn tells how it sits.
fn calibrated(a: [&Fits; 3]) -> Option<Compass> {
    let take = |k: usize| a.map(|f| f.clean.x[k]);
    let parts = [take(0), take(1), take(2)];
    let size = (norm(parts[0]) * norm(parts[1]) * norm(parts[2])).cbrt();
    let (name, off) = nearest(size, &UNITS);
    let one = UNITS.iter().find(|u| u.0 == name).map_or(1.0, |u| u.1);
    let left = |fit: &dyn Fn(&Fits) -> f64| a.iter().map(|f| fit(f).powi(2)).sum::<f64>().sqrt() / one;
    let (free, clean) = (left(&|f| f.free.residual), left(&|f| f.clean.residual));
    let sigma = a.iter().map(|f| f.clean.sigma[0].powi(2) + f.clean.sigma[1].powi(2)).sum::<f64>().sqrt() / size;
    let sizes: f64 = parts.iter().map(|p| (norm(*p) / one).ln().powi(2)).sum();
    let slants: f64 = (0..3).map(|k| (dot(parts[k], parts[(k + 1) % 3]) / (one * one)).powi(2)).sum();
    let cost = sizes / 0.0064 + slants / 0.0064 + (clean / 5.0).powi(2) + (off / 0.1).powi(2);
    if !cost.is_finite() || cost > 6.0 || clean > 1.5 * free + 0.7 || !sigma.is_finite() || sigma > 0.5 {
        return None;
    }
    let rows = square(parts);
    let columns = a.map(|f| f.column);
    let rows = std::array::from_fn(|i| [rows[0][i], rows[1][i], rows[2][i]]);
    let offset = [0.0; 3];
    Some(Compass { columns, unit: name, one, seating: seat(rows), cost, sigma, upright: true, offset })
}

/// The orthonormal triple nearest to one that almost is: each is moved half way to what the other two say of it.
fn square(mut v: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    v = v.map(unit);
    let hand = dot(cross(v[0], v[1]), v[2]).signum();
    for _ in 0..6 {
        let said: [[f64; 3]; 3] = std::array::from_fn(|k| cross(v[(k + 1) % 3], v[(k + 2) % 3]).map(|x| x * hand));
        v = std::array::from_fn(|k| unit(std::array::from_fn(|i| v[k][i] + said[k][i])));
    }
    v
}

fn judge(a: [&Fits; 3], earth: &Earth, span: f64) -> Option<Compass> {
    let take = |k: usize| a.map(|f| f.free.x[k]);
    let (forward, right, rest) = (take(0), take(1), take(2));
    let (size_f, size_r) = (norm(forward), norm(right));
    let size = (size_f * size_r).sqrt();
    let sigma = a.iter().map(|f| f.free.sigma[0].powi(2) + f.free.sigma[1].powi(2)).sum::<f64>().sqrt() / size;
    if !sigma.is_finite() || sigma > 0.5 {
        return None;
    }
    let (name, off) = nearest(size, &UNITS);
    let one = UNITS.iter().find(|u| u.0 == name).map_or(1.0, |u| u.1);
    let mut down = unit(cross(forward, right));
    let vertical = dot(rest, down) / one;
    // The sign that the model's vertical part asks for.
    if vertical * earth.down < 0.0 {
        down = down.map(|v| -v);
    }
    let short = (vertical.abs() - earth.down.abs()).abs() / earth.down.abs().max(10.0);
    let left = a.iter().map(|f| f.free.residual.powi(2)).sum::<f64>().sqrt() / one;
    let slant = dot(forward, right) / (size_f * size_r);
    let cost = (off / 0.25).powi(2)
        + ((size_f / size_r).ln() / (0.12 + sigma)).powi(2)
        + (slant / (0.12 + sigma)).powi(2)
        + (short / 0.5).powi(2)
        + (left / 6.0).powi(2)
        // An offset that nothing asks for.
        + 2.5;
    // Half way between forward and what right says of it.
    let hand = dot(cross(forward, right), down).signum();
    let from_right = cross(right, down).map(|v| v * hand / size_r);
    let f = unit(std::array::from_fn(|i| forward[i] / size_f + from_right[i]));
    let r = cross(down, f).map(|v| v * hand);
    let rows = std::array::from_fn(|i| [f[i], r[i], down[i]]);
    let offset = std::array::from_fn(|i| rest[i] / one - earth.down * down[i]);
    let columns = a.map(|f| f.column);
    // Within a third of a turn, an offset and a lean look alike.
    let upright = short < 0.35 && span > 2.0;
    Some(Compass { columns, unit: name, one, seating: seat(rows), cost, sigma, upright, offset })
}

/// Give the magnetometer's columns their roles.
pub(crate) fn seat_mag(s: &mut Survey, c: &Compass, earth: &Earth, motion: &Motion) {
    const MAG: [&str; 3] = ["mag_x", "mag_y", "mag_z"];
    for (axis, &(of, sign)) in c.seating.axes.iter().enumerate() {
        let column = c.columns[of];
        let clear = c.cost < 6.0 && c.sigma < 0.1;
        let confidence = match (clear, c.upright) {
            (true, true) => Confidence::Certain,
            (_, true) => Confidence::Likely,
            _ => Confidence::Guess,
        };
        let why = format!(
            "turns with the heading of {} as the model's {:.1} uT level and {:.1} uT down do, in {}; direction to {:.1} deg",
            motion.label,
            earth.level,
            earth.down,
            c.unit,
            c.sigma.to_degrees()
        );
        let role = Role { signal: MAG[axis].into(), unit: c.unit.into(), scale: sign, offset: 0.0, confidence, why };
        s.assign(column, role);
    }
    let offset = norm(c.offset);
    if offset > 5.0 {
        let text = format!(
            "the magnetometer reads the Earth's field with an offset of ({:.0}, {:.0}, {:.0}) uT along {}, {}, {}: the car's own iron, or a sensor that is not calibrated.",
            c.offset[0],
            c.offset[1],
            c.offset[2],
            s.label(c.columns[0]),
            s.label(c.columns[1]),
            s.label(c.columns[2])
        );
        s.find(Weight::Note, &c.columns, text);
    }
}

/// Rate at which the magnetometer's level part turns, on the grid, rad/s, over 0.8 s.
pub(crate) fn turning(s: &Survey, c: &Compass, earth: &Earth, roll: Option<&[f64]>) -> Vec<f64> {
    let rows = super::linear::lean_rows(c.seating.lean);
    let n = s.scene.fields[c.columns[0]].grid.len();
    let mut heading = Vec::with_capacity(n);
    let mut last = 0.0;
    for i in 0..n {
        let turned: [f64; 3] = std::array::from_fn(|k| {
            let (of, sign) = c.seating.axes[k];
            sign * (s.scene.fields[c.columns[of]].grid[i] / c.one - c.offset[of])
        });
        let tilt = roll.map_or(0.0, |l| l[i]) * earth.down;
        let (ahead, aside) = (dot(rows[0], turned), dot(rows[1], turned) - tilt);
        let angle = -aside.atan2(ahead);
        let next = last + wrap_angle(angle - last);
        heading.push(next);
        if next.is_finite() {
            last = next;
        }
    }
    slope(&heading, 4)
}
