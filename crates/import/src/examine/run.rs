//! The order in which a table is examined: what is surest first, since the rest leans on it.

use drivescope_drive::geodesy::STANDARD_GRAVITY;

use super::delay::{lag, of_fixes};
use super::gnss::{self, Motion};
use super::gyro::{self, Yaw};
use super::inertial::{self, Triad};
use super::linear::lean_rows;
use super::magnetic::{self, Earth};
use super::scene::{Field, Scene, slope};
use super::survey::{Kind, Role, Survey, Weight};
use super::{at_rest, evidence, grain, others, reversing, speeds, strangers};
use crate::candidate::{Candidate, Confidence};
use crate::table::Table;

/// The car's yaw answers to the steering so much later, s, and how far that varies from car to car.
const YAW_LAG: [f64; 2] = [0.06, 0.05];
/// Between the wheels of an axle, m.
const TRACK: f64 = 1.55;
/// Lags that are smaller do no harm, s.
const SMALL_DELAY: f64 = 0.03;

/// Examine a table whose rows have these times; `names` are believed.
pub(crate) fn run<'t>(
    table: &'t Table,
    time: &[f64],
    names: Vec<Option<Candidate>>,
    skip: &dyn Fn(usize) -> bool,
) -> Survey<'t> {
    let scene = Scene::new(table, time, skip);
    let mut s = Survey::new(table, scene, names);
    look(&mut s);
    s
}

/// Everything that the motion over ground tells, and then what needs none.
fn look(s: &mut Survey) {
    let found = in_motion(s);
    if let Some((motion, late)) = &found {
        let speed = fast_speed(s).map(|(column, v)| (column, Field::made(v)));
        evidence::lone_axes(s, (motion, *late), speed.as_ref());
        strangers::look(s, motion, *late);
        heading_span(s, motion);
    }
    reversing::look(s);
    at_rest::look(s, found.as_ref().map(|f| &f.0));
    grain::look(s);
}

/// Say that a straight road hides which way is right.
fn heading_span(s: &mut Survey, motion: &Motion) {
    let moving = (0..motion.time.len()).filter(|&i| motion.speed[i] > 2.0 * gnss::MOVING);
    let course: Vec<f64> = moving.map(|i| motion.velocity[i][1].atan2(motion.velocity[i][0])).collect();
    let Some(&first) = course.first().filter(|c| c.is_finite() && course.len() > 20) else { return };
    let off = |v: &f64| drivescope_drive::frames::wrap_angle(v - first);
    let ends = course.iter().map(off).fold([0.0_f64; 2], |r, v| [r[0].min(v), r[1].max(v)]);
    let span = ends[1] - ends[0];
    if span < 0.15 {
        let text = format!(
            "the course of {} stays within {:.1} deg: which way is right, lateral signs and the magnetometer this drive hardly shows.",
            motion.label,
            span.to_degrees()
        );
        s.find(Weight::Note, &[], text);
    }
}

/// The motion, and how late it is.
fn in_motion(s: &mut Survey) -> Option<(Motion, f64)> {
    let motion = gnss::find(s).or_else(|| by_named_speed(s))?;
    gnss::find_course(s, &motion);
    let accel = inertial::find_accel(s, &motion, 0.0, None, None);
    if let Some((triad, _)) = &accel {
        hold(s, &triad.columns);
    }
    speeds::find(s, &motion, None);
    let speed = fast_speed(s).map(|v| v.1);
    let late = inertial_sensor(s, &motion, accel, speed);
    Some((motion, late))
}

/// Without fixes: the motion that a named speed of the car gives.
fn by_named_speed(s: &Survey) -> Option<Motion> {
    let named =
        |c: &usize| s.names[*c].as_ref().is_some_and(|n| matches!(n.signal.as_str(), "speed" | "wheel_speed_rl"));
    let column = s.columns(Kind::Speed).into_iter().find(named)?;
    let candidate = s.names[column].as_ref()?;
    let factor = candidate.scale * crate::units::factor(&candidate.unit, "m/s")?;
    let field = &s.scene.fields[column];
    let mut motion = Motion { label: s.label(column), noise: 0.1, column: Some(column), ..Motion::default() };
    for k in 1..(field.grid.len() / 10) {
        let t = k as f64;
        let v = factor * field.mean(t - 0.25, t + 0.25);
        if v.is_finite() {
            motion.time.push(t);
            motion.velocity.push([f64::NAN; 2]);
            motion.speed.push(v);
        }
    }
    if let Some(sides) = sides_by_name(s) {
        let turned = Field::made(inertial::integral(&sides));
        motion.turned = motion.time.iter().map(|t| turned.at(*t) / TRACK).collect();
        motion.label += " and the wheels of both sides";
    }
    (motion.time.len() >= 10).then_some(motion)
}

/// How much faster the left wheels run than the right ones, m/s, on the grid, by their names.
fn sides_by_name(s: &Survey) -> Option<Vec<f64>> {
    let wheel = |name: &str| {
        let column = s.names.iter().position(|c| c.as_ref().is_some_and(|c| c.signal == name))?;
        let c = s.names[column].as_ref()?;
        let field = &s.scene.fields[column];
        let factor = c.scale * crate::units::factor(&c.unit, "m/s")?;
        (field.is_fast() && !field.is_constant()).then_some((&field.grid, factor))
    };
    let pair = |l: &str, r: &str| Some((wheel(l)?, wheel(r)?));
    let ((left, p), (right, q)) =
        pair("wheel_speed_rl", "wheel_speed_rr").or_else(|| pair("wheel_speed_fl", "wheel_speed_fr"))?;
    Some(left.iter().zip(right).map(|(a, b)| p * a - q * b).collect())
}

/// The best fast column of the car's speed, and its values on the grid, m/s.
fn fast_speed(s: &Survey) -> Option<(usize, Vec<f64>)> {
    const NAMES: [&str; 5] = ["speed", "wheel_speed_rl", "wheel_speed_rr", "wheel_speed_fl", "wheel_speed_fr"];
    let columns: Vec<usize> = NAMES.iter().filter_map(|n| s.of(n)).filter(|c| s.scene.fields[*c].is_fast()).collect();
    let first = *columns.first()?;
    let factor = s.factor(first);
    Some((first, s.scene.fields[first].grid.iter().map(|v| v * factor).collect()))
}

/// Let go of the car's speeds, to tell the wheels apart by the gyro.
fn release_speeds(s: &mut Survey) {
    for role in &mut s.roles {
        if role.as_ref().is_some_and(|r| r.signal == "speed" || r.signal.starts_with("wheel_speed")) {
            *role = None;
        }
    }
}

/// Keep columns from being taken for anything else until they are seated.
fn hold(s: &mut Survey, columns: &[usize]) {
    for &c in columns {
        s.roles[c] = Some(Role {
            signal: String::new(),
            unit: String::new(),
            scale: 1.0,
            offset: 0.0,
            confidence: Confidence::Guess,
            why: String::new(),
        });
    }
}

/// A grid shifted so that what is `late` stands where it happened.
pub(crate) fn shifted(grid: &[f64], late: f64) -> Vec<f64> {
    let field = Field::made(grid.to_vec());
    (0..grid.len()).map(|i| field.at((i as f64 + 0.5) * super::scene::STEP + late)).collect()
}

fn inertial_sensor(s: &mut Survey, motion: &Motion, accel: Option<(Triad, f64)>, speed: Option<Vec<f64>>) -> f64 {
    let mut car_late = 0.0;
    if let (Some((triad, _)), Some(speed)) = (&accel, &speed) {
        car_late = car_delay(s, triad, speed);
    }
    let upright = accel.as_ref().map(|(t, _)| lean_rows(t.seating.lean)[2][2]);
    let yaw = gyro::find_yaw(s, motion, 0.0, upright);
    if let Some(y) = &yaw {
        hold(s, &[y.column]);
        let rate = Field::made(yaw_rate(s, y));
        release_speeds(s);
        speeds::find(s, motion, Some(&rate));
        car_late = car_delay_in_turns(s, y).unwrap_or(car_late);
        s.roles[y.column] = None;
    }
    let late = fix_delay(s, motion, yaw.as_ref(), speed.as_deref().map(|v| (v, car_late)));
    let yaw = yaw.and_then(|_| gyro::find_yaw(s, motion, late, upright)).or(yaw);
    if let Some(y) = &yaw {
        hold(s, &[y.column]);
    }
    let again = |s: &Survey, triad: &Triad, climb: Option<&Field>| {
        inertial::find_accel(s, motion, late, climb, Some(triad.columns)).map(|t| t.0)
    };
    let second = accel.as_ref().map_or(0.0, |a| a.1);
    let mut triad = accel.map(|(t, _)| again(s, &t, None).unwrap_or(t));
    let aligned = speed.map(|v| shifted(&v, car_late));
    let mut leaning = None;
    if let (Some(t), Some(v), Some(y)) = (&triad, &aligned, &yaw) {
        let rate = yaw_rate(s, y);
        let fine = inertial::refine(s, t, v, &rate, None).unwrap_or(*t);
        leaning = Some(attitude(s, &fine, v, &rate));
        triad = Some(fine);
    }
    let rate = yaw.as_ref().map(|y| yaw_rate(s, y));
    compass(s, motion, late, rate.as_deref(), leaning.as_ref());
    if let (Some(rate), Some(v)) = (&rate, &aligned) {
        others::find_steering(s, motion, late, Some((rate, v)));
    }
    let mut across = None;
    if let (Some(t), Some(v), Some(y), Some(rate)) = (&triad, &aligned, &yaw, &rate) {
        across = gyro::find_across(s, y, t.seating.lean, &gyro::car_rates(s, t, rate, v));
    }
    if let Some(a) = &across {
        hold(s, &[a[0].column, a[1].column]);
    }
    if let Some(rate) = &rate {
        steering_delay(s, rate, aligned.as_deref());
    }
    if let (Some(t), Some(v)) = (&triad, &aligned) {
        let grade = heights(s, t, v, motion);
        let fine = rate.as_ref().and_then(|r| inertial::refine(s, t, v, r, grade.as_ref()));
        triad = fine.or_else(|| again(s, t, grade.as_ref())).or(triad);
    }
    if let Some(t) = &triad {
        inertial::seat_accel(s, t, motion, second);
        lean(s, "imu", t.seating.lean, t.sigma[0].min(t.sigma[1]), "gravity, the change of the speed and the turns");
        handed(s, t);
    }
    if let Some(y) = &yaw {
        gyro::seat_gyro(s, y, across, motion);
    }
    late
}

/// Pitch and roll of the car on the grid, by what gravity adds to the accelerometer, rad.
fn attitude(s: &Survey, triad: &Triad, speed: &[f64], rate: &[f64]) -> [Vec<f64>; 2] {
    let force = |axis: usize| slope(&inertial::integral(&inertial::along(s, triad, axis)), 4);
    let aside = slope(&inertial::integral(&inertial::sideways(speed, rate)), 4);
    let lost = slope(&inertial::integral(&inertial::swung(speed, rate)), 4);
    let (x, y, change) = (force(0), force(1), slope(speed, 4));
    let known = |v: f64| if v.is_finite() { v } else { 0.0 };
    let pitch = (0..x.len()).map(|i| known((x[i] - change[i] + lost[i]) / STANDARD_GRAVITY)).collect();
    let roll = (0..x.len()).map(|i| known((aside[i] - y[i]) / STANDARD_GRAVITY)).collect();
    [pitch, roll]
}

/// A sensor that is sold is right-handed: columns that are not have a sign or a name wrong.
fn handed(s: &mut Survey, t: &Triad) {
    let named = t.columns.iter().all(|&c| s.names[c].is_some());
    let clear = t.sigma[0] < 0.2 && t.sigma[1] < 0.2;
    // The sign of the arrangement of named columns x, y, z.
    let order = t.seating.axes.map(|(of, _)| {
        s.names[t.columns[of]]
            .as_ref()
            .map_or(0, |c| c.signal.bytes().last().unwrap_or(b'x').wrapping_sub(b'x') as usize)
    });
    let even = matches!(order, [0, 1, 2] | [1, 2, 0] | [2, 0, 1]);
    let signs: f64 = t
        .seating
        .axes
        .iter()
        .zip(0..3)
        .map(|((of, sign), _)| sign * s.names[t.columns[*of]].as_ref().map_or(1.0, |_| 1.0))
        .product();
    if named && clear && (signs > 0.0) != even {
        let text = "the accelerometer's axes are left-handed: one of its signs is turned, or two of its columns are exchanged.";
        s.find(Weight::Contradiction, &t.columns, text.into());
    }
}

/// How late the car's speeds are against the forward accelerometer; 0 if that is not known.
fn car_delay(s: &mut Survey, triad: &Triad, speed: &[f64]) -> f64 {
    if triad.sigma[0] > 0.3 {
        return 0.0;
    }
    // Onsets of braking and driving, not the slow changes of the grade.
    let force = slope(&slope(&inertial::integral(&inertial::along(s, triad, 0)), 4), 4);
    let Some(l) = lag(&slope(&slope(speed, 4), 4), &force, 0.9).filter(|l| l.correlation > 0.7) else { return 0.0 };
    let text =
        format!("onsets of braking and driving against the forward accelerometer, correlation {:.2}", l.correlation);
    // Driven wheels slip ahead of the car the more, the faster it is.
    let usual = crate::clock::median(speed.iter().copied().filter(|v| *v > 1.0).collect());
    s.delays.push(("wheels", l.late, (2.0 * l.sigma).hypot(0.004 * usual).max(0.01), text));
    l.late
}

/// The same by left and right wheels against the yaw gyro; both opinions are weighed, and the sum is given.
fn car_delay_in_turns(s: &mut Survey, yaw: &Yaw) -> Option<f64> {
    let difference = |a: &str, b: &str| -> Option<Vec<f64>> {
        let (a, b) = (s.of(a)?, s.of(b)?);
        let (p, q) = (s.factor(a), s.factor(b));
        Some(s.scene.fields[a].grid.iter().zip(&s.scene.fields[b].grid).map(|(x, y)| p * x - q * y).collect())
    };
    let sides =
        difference("wheel_speed_rl", "wheel_speed_rr").or_else(|| difference("wheel_speed_fl", "wheel_speed_fr"))?;
    let smooth = |v: &[f64]| slope(&inertial::integral(v), 4);
    let l = lag(&smooth(&sides), &smooth(&yaw_rate(s, yaw)), 0.9).filter(|l| l.correlation.abs() > 0.7)?;
    let sigma = l.sigma.max(0.01);
    let text = format!("left and right wheels against the yaw gyro, correlation {:.2}", l.correlation.abs());
    let before = s.delays.iter().position(|d| d.0 == "wheels").map(|i| s.delays.remove(i));
    let (late, sigma, text) = match before {
        Some((_, other, other_sigma, why)) => {
            let (a, b) = (sigma.powi(-2), other_sigma.powi(-2));
            ((a * l.late + b * other) / (a + b), (a + b).sqrt().recip(), format!("{why}; {text}"))
        }
        None => (l.late, sigma, text),
    };
    s.delays.push(("wheels", late, sigma, text));
    Some(late)
}

/// The yaw gyro in rad/s to the right, on the grid.
fn yaw_rate(s: &Survey, yaw: &Yaw) -> Vec<f64> {
    s.scene.fields[yaw.column].grid.iter().map(|v| (v - yaw.bias) / yaw.factor).collect()
}

fn fix_delay(s: &mut Survey, motion: &Motion, yaw: Option<&Yaw>, speed: Option<(&[f64], f64)>) -> f64 {
    let rate = yaw.map(|y| Field::made(yaw_rate(s, y)));
    let speed = speed.map(|(v, late)| (Field::made(v.to_vec()), late));
    let Some(l) = of_fixes(motion, rate.as_ref(), speed.as_ref().map(|(f, late)| (f, *late))) else { return 0.0 };
    let text = format!("turns and changes of speed of {} against the yaw gyro and the car's speed", motion.label);
    if motion.column.is_none() {
        s.delays.push(("gnss", l.late, l.sigma.max(0.01), text));
    }
    if l.sigma < 0.1 { l.late } else { 0.0 }
}

/// Altitudes and vertical speed; gives the grade of the road on the grid where an altitude is known.
fn heights(s: &mut Survey, triad: &Triad, speed: &[f64], motion: &Motion) -> Option<Field> {
    let force = inertial::along(s, triad, 0);
    let change = slope(speed, 4);
    let climb: Vec<f64> = (0..speed.len()).map(|i| speed[i] * (force[i] - change[i]) / STANDARD_GRAVITY).collect();
    let fixes = s.of("gnss_lat");
    let (climb, speed_field) = (Field::made(climb), Field::made(speed.to_vec()));
    others::find_altitude(s, &climb, &speed_field, fixes);
    others::find_vertical(s, motion);
    let altitude = s.of("baro_alt").or_else(|| s.of("gnss_alt"))?;
    let metre = s.factor(altitude);
    let height = &s.scene.fields[altitude];
    const REACH: f64 = 4.0;
    let grade = |i: usize| {
        let t = (i as f64 + 0.5) * super::scene::STEP;
        let way = speed_field.mean(t - REACH, t + REACH) * 2.0 * REACH;
        if way > 10.0 { metre * (height.at(t + REACH) - height.at(t - REACH)) / way } else { f64::NAN }
    };
    Some(Field::made((0..speed.len()).map(grade).collect()))
}

/// How late the steering is against the yaw gyro, less what the car itself takes to answer.
fn steering_delay(s: &mut Survey, rate: &[f64], speed: Option<&[f64]>) {
    let smooth = slope(&inertial::integral(rate), 4);
    if let Some(column) = s.of("steering_wheel").or_else(|| s.of("steer")) {
        let angle = slope(&inertial::integral(&s.scene.fields[column].grid), 4);
        let bend: Vec<f64> = smooth
            .iter()
            .enumerate()
            .map(|(i, w)| {
                let v = speed.map_or(10.0, |v| v[i]);
                if v > 3.0 { w / v } else { f64::NAN }
            })
            .collect();
        if let Some(l) = lag(&angle, &bend, 0.9) {
            let text = format!(
                "the path's curvature against the angle, correlation {:.2}, and the car's own answer of {:.2} s, which differs from car to car",
                l.correlation, YAW_LAG[0]
            );
            s.delays.push(("steering", l.late + YAW_LAG[0], l.sigma.hypot(YAW_LAG[1]), text));
        }
    }
}

fn compass(s: &mut Survey, motion: &Motion, late: f64, rate: Option<&[f64]>, leaning: Option<&[Vec<f64>; 2]>) {
    let (Some(lat), Some(lon)) = (s.of("gnss_lat"), s.of("gnss_lon")) else { return };
    let place = |c: usize| {
        crate::clock::median(s.scene.fields[c].grid.iter().copied().filter(|v| v.is_finite()).collect()) * s.factor(c)
    };
    let Some(earth) = Earth::at(place(lat), place(lon), None) else { return };
    let heading = magnetic::heading(motion, late, rate, s.scene.fields[lat].grid.len());
    let Some(c) = magnetic::find(s, &heading, &earth, leaning) else { return };
    magnetic::seat_mag(s, &c, &earth, motion);
    lean(s, "mag", c.seating.lean, c.sigma, "how its field turns with the heading");
    let Some(rate) = rate else { return };
    let smooth = slope(&inertial::integral(rate), 4);
    // Only what lasts: the onset of a turn shakes the roll.
    let rolling = leaning.map(|l| {
        let roll = Field::made(l[1].clone());
        let middle = |i: usize| (i as f64 + 0.5) * super::scene::STEP;
        let value = |i: usize| roll.mean(middle(i) - 1.2, middle(i) + 1.2);
        (0..l[1].len()).map(value).map(|v| if v.is_finite() { v } else { 0.0 }).collect::<Vec<f64>>()
    });
    if let Some(l) = lag(&magnetic::turning(s, &c, &earth, rolling.as_deref()), &smooth, 0.9) {
        let text = format!("its turning against the yaw gyro, correlation {:.2}", l.correlation);
        s.delays.push(("mag", l.late, l.sigma.max(0.008), text));
    }
}

/// Note how a housing leans.
fn lean(s: &mut Survey, channel: &'static str, angles: [f64; 3], sigma: f64, by: &str) {
    s.mounts.push((channel, angles, sigma, by.to_owned()));
}

/// Whether a delay is worth correcting: larger than what does no harm and than its own uncertainty.
pub(crate) fn matters(late: f64, sigma: f64) -> bool {
    late.abs() > SMALL_DELAY.max(1.2 * sigma) && late.abs() < 0.5 && sigma < 0.08
}
