//! What needs no motion over ground: gravity on a named accelerometer, a gyro at standstill, a field that turns.

use drivescope_drive::geodesy::STANDARD_GRAVITY;

use super::gnss::{MOVING, Motion};
use super::inertial::integral;
use super::linear::{Normal, norm};
use super::magnetic::Earth;
use super::survey::{Kind, Role, Survey, Weight, kind};
use crate::candidate::Confidence;
use crate::correction::Amendment;
use crate::units;

/// Further from 1 g, an accelerometer is not calibrated, as a share: a lean of 10 deg takes 1.5 % away.
const CALIBRATED: f64 = 0.025;
/// Fewer bins are too few: 5 s.
const FEW: usize = 50;

/// Say what standing sensors show.
pub(crate) fn look(s: &mut Survey, motion: Option<&Motion>) {
    gravity(s);
    zero_rate(s);
    if s.roles.iter().flatten().all(|r| kind(&r.signal) != Kind::Mag) {
        circle(s);
        if let Some(motion) = motion {
            strength(s, motion);
        }
    }
}

/// Named columns of a triad in the order x, y, z, with the factor to SI that their names give.
fn triad(s: &Survey, stem: &str) -> Option<[(usize, f64); 3]> {
    let one = |axis: &str| {
        let signal = format!("{stem}{axis}");
        let column = s.names.iter().position(|c| c.as_ref().is_some_and(|c| c.signal == signal))?;
        let c = s.names[column].as_ref()?;
        let si = crate::channels::signal(&signal)?.unit;
        Some((column, c.scale * units::factor(&c.unit, si)?))
    };
    Some([one("x")?, one("y")?, one("z")?])
}

fn mean(values: &[f64]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    values.iter().filter(|v| v.is_finite()).for_each(|v| (sum, count) = (sum + v, count + 1));
    if count < FEW { f64::NAN } else { sum / count as f64 }
}

/// Which named axis points down, and whether it reads 1 g, where the motion did not tell.
fn gravity(s: &mut Survey) {
    let Some(axes) = triad(s, "accel_") else { return };
    if axes.iter().any(|a| s.roles[a.0].is_some()) {
        return;
    }
    let means = axes.map(|(column, factor)| factor * mean(&s.scene.fields[column].grid));
    // Units that no name states are the proposal's to doubt.
    let off = (norm(means) / STANDARD_GRAVITY).ln().abs();
    if off.is_nan() || off > 0.15 {
        return;
    }
    let Some(down) = (0..3).find(|&k| means[k].abs() > 0.8 * STANDARD_GRAVITY) else { return };
    let (column, own) = (axes[down].0, means[down]);
    let Some(name) = s.names[column].clone() else { return };
    let sign = -own.signum() * name.scale.signum();
    let unit = name.unit.clone();
    let why =
        format!("gravity: its mean is {own:.2} m/s^2, those of the others stay below {:.2}", 0.8 * STANDARD_GRAVITY);
    let (confidence, signal) = (Confidence::Certain, "accel_z".to_owned());
    let mut role = Role { signal, unit, scale: sign, offset: 0.0, confidence, why };
    s.assign(column, role.clone());
    // On a slope gravity is shared with other axes; no slope makes it more.
    let share = own.abs().max(norm(means).min(STANDARD_GRAVITY)) / STANDARD_GRAVITY - 1.0;
    if share.abs() > CALIBRATED {
        role.scale /= 1.0 + share;
        let text = format!(
            "{} reads {own:.2} m/s^2 on average, the accelerometer {:+.1} % from gravity: it is not calibrated.",
            s.label(column),
            100.0 * share
        );
        let source = s.source(column, &role);
        s.propose(Weight::Contradiction, &[column], text, Amendment::of("accel_z", source));
    }
}

/// What the gyro reads while the car stands.
fn zero_rate(s: &mut Survey) {
    let Some(speed) = ["speed", "wheel_speed_rl", "wheel_speed_fl", "gnss_speed"].iter().find_map(|n| s.of(n)) else {
        return;
    };
    let factor = s.factor(speed);
    let stands = |s: &Survey, i: usize| (s.scene.fields[speed].grid[i] * factor).abs() < 0.05;
    let gyros: Vec<usize> = ["gyro_x", "gyro_y", "gyro_z"].iter().filter_map(|n| s.of(n)).collect();
    let (mut said, mut large) = (Vec::new(), false);
    for &column in &gyros {
        let (mut fit, unit) = (Normal::default(), s.factor(column));
        let grid = &s.scene.fields[column].grid;
        // A second of standing on both sides.
        (10..grid.len().saturating_sub(10))
            .filter(|&i| stands(s, i) && stands(s, i - 10) && stands(s, i + 10))
            .for_each(|i| fit.add(&[1.0], grid[i] * unit));
        let f = fit.solve(1);
        if f.count < FEW as f64 {
            return;
        }
        // A residual car shakes for a second at a time.
        let (rate, sigma) = (f.x[0].to_degrees() * 3600.0, f.sigma[0].to_degrees() * 3600.0 * 3.0);
        large |= rate.abs() > (4.0 * sigma).max(60.0);
        said.push(format!("{} {rate:.0} +- {sigma:.0}", s.label(column)));
    }
    if large {
        let text = format!("the gyro does not read 0 while the car stands, deg/h: {}.", said.join(", "));
        s.find(Weight::Note, &gyros, text);
    }
}

/// Named magnetometer whose field turns with the yaw gyro about a point that is not 0: iron of the car.
fn circle(s: &mut Survey) {
    let (Some(mag), Some(gyro)) = (triad(s, "mag_"), triad(s, "gyro_")) else { return };
    let (yaw, factor) = gyro[2];
    let factor = if s.roles[yaw].is_some() { s.factor(yaw) } else { factor };
    let turned = integral(&s.scene.fields[yaw].grid.iter().map(|v| v * factor).collect::<Vec<f64>>());
    let rounds = turned.last().map_or(0.0, |t| t.abs() / std::f64::consts::TAU);
    if rounds < 0.7 {
        return;
    }
    let fits = mag.map(|(column, factor)| {
        let mut fit = Normal::default();
        for (psi, y) in turned.iter().zip(&s.scene.fields[column].grid) {
            fit.add(&[psi.cos(), psi.sin(), 1.0], y * factor);
        }
        fit.solve(3)
    });
    let raw = (0.5 * fits.iter().map(|f| f.x[0].powi(2) + f.x[1].powi(2)).sum::<f64>()).sqrt();
    // The level field of the Earth is 10 to 42 uT; a name's unit may be a convention only.
    const LEVEL: f64 = 22.0;
    let (unit, off) =
        crate::fit::nearest(raw / LEVEL, &[("uT", 1.0), ("G", 0.01), ("T", 1e-6), ("nT", 1e3), ("mG", 10.0)]);
    let Some(one) = units::factor(unit, "uT").filter(|_| off < 1.1) else { return };
    let offset = fits.map(|f| f.x[2] * one);
    let level = offset[0].hypot(offset[1]);
    let explained = 0.5 * (fits[0].explained + fits[1].explained);
    if explained > 0.7 && level > 5.0 {
        let columns = mag.map(|m| m.0);
        let text = format!(
            "in {rounds:.1} rounds the field of {}, {}, {} turns with a radius of {:.1} uT (read in {unit}) about ({:.1}, {:.1}) uT, not about 0: hard iron of {level:.1} uT level.",
            s.label(columns[0]),
            s.label(columns[1]),
            s.label(columns[2]),
            raw * one,
            offset[0],
            offset[1]
        );
        s.find(Weight::Contradiction, &columns, text);
    }
}

/// Mean course of the motion, rad, where it stays about the same.
fn mean_course(motion: &Motion) -> Option<f64> {
    let moving = motion.velocity.iter().zip(&motion.speed).filter(|(_, v)| **v > MOVING);
    let (mut north, mut east, mut count) = (0.0, 0.0, 0.0);
    moving.for_each(|(v, speed)| (north, east, count) = (north + v[0] / speed, east + v[1] / speed, count + 1.0));
    (count > 10.0 && north.hypot(east) > 0.95 * count).then(|| east.atan2(north))
}

/// Named magnetometer against the model's field, where the heading does not turn enough for more.
fn strength(s: &mut Survey, motion: &Motion) {
    let (Some(mag), Some(lat), Some(lon)) = (triad(s, "mag_"), s.of("gnss_lat"), s.of("gnss_lon")) else { return };
    let place = |c: usize| mean(&s.scene.fields[c].grid) * s.factor(c);
    let (Some(earth), Some(course)) = (Earth::at(place(lat), place(lon), None), mean_course(motion)) else { return };
    let (sin, cos) = (course - earth.declination).sin_cos();
    let model = [earth.level * cos, -earth.level * sin, earth.down];
    let means = mag.map(|(column, factor)| factor * mean(&s.scene.fields[column].grid));
    let off: [f64; 3] = std::array::from_fn(|k| means[k] - model[k]);
    let (size, expected) = (norm(means), norm(model));
    // A lean of 8 deg turns 7 uT from one axis to another.
    if size.is_finite() && (size / expected).ln().abs() < 2.0 && norm(off) > 15.0 {
        let columns = mag.map(|m| m.0);
        let show = |v: [f64; 3]| format!("({:.0}, {:.0}, {:.0})", v[0], v[1], v[2]);
        let text = format!(
            "the magnetometer reads {} uT on average where the model's field has {} uT along the car: an offset of {} uT of the car's iron or the sensor, or axes that lie otherwise than their names say.",
            show(means),
            show(model),
            show(off)
        );
        s.find(Weight::Contradiction, &columns, text);
    }
}
