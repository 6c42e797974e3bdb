//! Latitude and longitude among the columns: unit and order, by whether they move like a car.

use drivescope_drive::frames::wrap_angle;
use drivescope_drive::geodesy::radii;

use super::gnss::{DEG, FASTEST, follow, part_of, samples, speed_unit, velocity};
use super::scene::Field;
use super::survey::{Kind, Role, Survey, Weight, kind};
use crate::candidate::Confidence;
use crate::correction::Amendment;
use crate::mapping::SignalSource;
use crate::order::sort_by;

/// Units of places and the factor to rad.
const ANGLES: [(&str, f64); 3] = [("deg", DEG), ("rad", 1.0), ("1e-7 deg", 1e-7 * DEG)];

/// Most columns that are tried as places, columns that are asked whether they follow, and instants of a way that are
/// compared: the work grows with their product.
const MOST: usize = 48;
const MOST_WITNESSES: usize = 64;
const MOST_INSTANTS: usize = 600;

/// A way over ground: time, metres to the north and to the east.
pub(super) type Track = Vec<[f64; 3]>;

/// A pair of columns that may be latitude and longitude.
struct Pair {
    columns: [usize; 2],
    unit: &'static str,
    track: Track,
}

/// Whether values in this unit move as a latitude or longitude of a car does.
fn moves_like_a_place(values: &[(f64, f64)], factor: f64) -> bool {
    let range = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v.1), r[1].max(v.1)]);
    let metres = factor * 6.37e6;
    if range[0].abs().max(range[1].abs()) * factor > std::f64::consts::TAU || (range[1] - range[0]) * metres < 15.0 {
        return false;
    }
    let fast =
        values.windows(2).filter(|w| (w[1].1 - w[0].1).abs() * metres > FASTEST * 1.3 * (w[1].0 - w[0].0)).count();
    // A straight line over time is a clock.
    let line = super::clock::straightness(values);
    50 * fast < values.len() && line > 1e-4
}

fn track(lat: &[(f64, f64)], lon: &[(f64, f64)], factor: f64) -> Track {
    let mut out: Track = Vec::new();
    let mut j = 0;
    let mut origin = None;
    for (t, a) in lat {
        while j < lon.len() && lon[j].0 < t - 1e-3 {
            j += 1;
        }
        let Some((_, b)) = lon.get(j).filter(|(time, _)| (time - t).abs() <= 1e-3) else { continue };
        let (a, b) = (a * factor, b * factor);
        let (a0, b0) = *origin.get_or_insert((a, b));
        let (meridian, transverse) = radii(a0);
        out.push([*t, (a - a0) * meridian, wrap_angle(b - b0) * transverse * a0.cos()]);
    }
    out
}

/// A column that may be a latitude or longitude: unit, factor to rad, samples.
type Fit = (usize, &'static str, f64, Vec<(f64, f64)>);

fn pairs(s: &Survey) -> Vec<Pair> {
    let columns = s.columns(Kind::Place);
    let mut fits: Vec<Fit> = Vec::new();
    for &c in &columns {
        let values = samples(&s.scene.fields[c]);
        for (unit, factor) in ANGLES {
            if fits.len() < MOST && values.len() >= 8 && moves_like_a_place(&values, factor) {
                fits.push((c, unit, factor, values.clone()));
            }
        }
    }
    let mut out = Vec::new();
    for a in &fits {
        let half_circle = a.3.iter().all(|v| (v.1 * a.2).abs() < std::f64::consts::FRAC_PI_2);
        for b in fits.iter().filter(|b| half_circle && b.0 != a.0 && b.1 == a.1) {
            let track = track(&a.3, &b.3, a.2);
            if 2 * track.len() > a.3.len() {
                out.push(Pair { columns: [a.0, b.0], unit: a.1, track });
            }
        }
    }
    out
}

/// What is left, as a share, of the first columns that follow this track's speed and velocity best, and the best of them.
fn support(s: &Survey, pair: &Pair) -> (f64, usize) {
    let motion = velocity(&pair.track).thinned(MOST_INSTANTS);
    let mut best = [(1.0, usize::MAX); 3];
    let asked = |(c, field): &(usize, &Field)| !pair.columns.contains(c) && field.count >= 10 && !field.is_constant();
    for (c, field) in s.scene.fields.iter().enumerate().filter(asked).take(MOST_WITNESSES) {
        for (part, best) in best.iter_mut().enumerate() {
            let f = follow(field, &motion, 1.0, &|i| part_of(&motion, i, part));
            let (_, ratio) = speed_unit(f.factor);
            let left = f.left + ratio.ln().abs();
            if left < best.0 && f.correlation.abs() > 0.5 {
                *best = (left, c);
            }
        }
    }
    // Mostly the speed; its parts tell which two columns belong together.
    let [north, east, speed] = best;
    let by = if speed.1 < usize::MAX { speed.1 } else { north.1.min(east.1) };
    // Named places without velocities: nothing else than a speed follows anything.
    let is_named = s.names[pair.columns[0]].is_some() && s.names[pair.columns[1]].is_some();
    let has_velocity = s.names.iter().flatten().any(|c| kind(&c.signal) == Kind::Velocity);
    if is_named && !has_velocity {
        return speed;
    }
    (speed.0.min(0.5 * (north.0 + east.0)) + 0.3 * (north.0 + east.0), by)
}

pub(super) fn find_place(s: &mut Survey) -> Option<Track> {
    let mut list: Vec<(f64, usize, Pair)> = pairs(s)
        .into_iter()
        .map(|p| {
            let (left, by) = support(s, &p);
            (left, by, p)
        })
        .collect();
    sort_by(&mut list, |a, b| a.0.total_cmp(&b.0));
    let mut list = list.into_iter();
    let (mut left, mut by, mut pair) = list.next()?;
    let [lat, lon] = pair.columns;
    // The same two the other way round, if that is possible too.
    let other = list.find(|(_, _, p)| p.columns == [lon, lat] && p.unit == pair.unit);
    let named = |c: usize, signal: &str| s.names[c].as_ref().is_some_and(|n| n.signal == signal);
    let mut order = Confidence::Certain;
    if let Some((left2, by2, pair2)) = other {
        let clear = left2 > 1.5 * left + 0.05;
        order = if clear { Confidence::Likely } else { Confidence::Guess };
        if !clear && named(lat, "gnss_lon") {
            (left, by, pair) = (left2, by2, pair2);
        }
    }
    let [lat, lon] = pair.columns;
    let supported = left < 0.75 && by != usize::MAX;
    let mut confidence = if supported { order } else { order.min(Confidence::Likely) };
    let length: f64 = pair.track.windows(2).map(|w| (w[1][1] - w[0][1]).hypot(w[1][2] - w[0][2])).sum();
    let mut why = format!("in {} the two columns move like a car, {length:.0} m in all", pair.unit);
    if supported {
        why += &format!(", as fast as {} says", s.label(by));
    } else if s.names.iter().all(Option::is_none) {
        confidence = Confidence::Guess;
    }
    if named(lat, "gnss_lon") || named(lon, "gnss_lat") {
        let text = format!("{} and {} are swapped: read the other way round, {why}.", s.label(lat), s.label(lon));
        let unit = (pair.unit != "deg").then(|| pair.unit.to_owned());
        let source = |c: usize| SignalSource { unit: unit.clone(), ..SignalSource::plain(&s.table.columns[c].name) };
        let mut correction = Amendment::of("gnss_lat", source(lat));
        correction.signals.insert("gnss_lon".into(), source(lon));
        s.propose(Weight::Contradiction, &[lat, lon], text, correction);
    } else if order == Confidence::Guess && !named(lat, "gnss_lat") {
        let text =
            format!("which of {} and {} is the latitude cannot be told: both orders fit.", s.label(lat), s.label(lon));
        s.find(Weight::Guess, &[lat, lon], text);
    } else if order == Confidence::Guess {
        confidence = Confidence::Likely;
    }
    for (column, signal) in [(lat, "gnss_lat"), (lon, "gnss_lon")] {
        let role = Role {
            signal: signal.into(),
            unit: pair.unit.into(),
            scale: 1.0,
            offset: 0.0,
            confidence,
            why: why.clone(),
        };
        s.assign(column, role);
    }
    Some(pair.track)
}
