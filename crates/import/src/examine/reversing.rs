//! A speed without a sign while the car drives backwards: braking and driving on then show the other way round.

use super::inertial::integral;
use super::linear::Normal;
use super::scene::{STEP, slope};
use super::survey::{Survey, Weight};

/// Slower, the car stands, m/s; a stretch goes faster than twice that.
const STANDS: f64 = 0.4;
/// Nobody drives backwards faster, m/s.
const FASTEST: f64 = 8.0;
/// Bins to each side that a rate of change is taken over.
const REACH: usize = 4;

/// From a standstill to the next: first and last bin.
fn stretches(speed: &[f64]) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    let mut from = None;
    for (i, v) in speed.iter().enumerate() {
        match (v.abs() > STANDS, from) {
            (true, None) => from = Some(i),
            (false, Some(start)) => {
                out.push((start, i));
                from = None;
            }
            _ => {}
        }
    }
    out.extend(from.map(|start| (start, speed.len())));
    out.retain(|s| s.1 - s.0 > 2 * REACH && fastest(speed, *s) > 2.0 * STANDS);
    out
}

fn fastest(speed: &[f64], (from, to): (usize, usize)) -> f64 {
    speed[from..to].iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// The car's own speed among the columns, fast enough to see one braking.
fn speed_of(s: &Survey) -> Option<(usize, f64)> {
    let names = ["speed", "wheel_speed_rl", "wheel_speed_rr", "wheel_speed_fl", "wheel_speed_fr"];
    names.iter().filter_map(|n| s.known(n)).find(|(c, _)| s.scene.fields[*c].is_fast())
}

/// Hold every stretch of the car's speed between two standstills against the forward accelerometer.
pub(crate) fn look(s: &mut Survey) {
    let (Some((column, unit)), Some((forward, factor))) = (speed_of(s), s.known("accel_x")) else { return };
    let grid = |c: usize, factor: f64| -> Vec<f64> { s.scene.fields[c].grid.iter().map(|v| v * factor).collect() };
    let (speed, force) = (grid(column, unit), grid(forward, factor));
    if speed.iter().any(|v| *v < -STANDS) {
        return;
    }
    let (force, change) = (slope(&integral(&force), REACH), slope(&speed, REACH));
    let (mut back, mut ahead, mut all) = (Vec::new(), 0, Normal::default());
    for (from, to) in stretches(&speed) {
        let mut fit = Normal::default();
        let near = from.saturating_sub(REACH)..(to + REACH).min(speed.len());
        near.clone().for_each(|i| fit.add(&[change[i], 1.0], force[i]));
        let f = fit.solve(2);
        // Neighbouring bins share what they are made of.
        let clear = f.explained > 0.6 && 3.0 * f.sigma[0] < 0.2;
        ahead += usize::from(clear && f.x[0] > 0.5);
        if clear && f.x[0] < -0.5 && fastest(&speed, (from, to)) < FASTEST {
            back.push((from, to));
            near.for_each(|i| all.add(&[change[i], 1.0], force[i]));
        }
    }
    // An accelerometer that is turned round shows all stretches so.
    let Some(&(from, to)) = back.first().filter(|_| ahead > 0) else { return };
    let f = all.solve(2);
    let text = format!(
        "{} has no sign, but the car drives backwards in {} of {} stretches between standstills, first from {:.1} to {:.1} s: there {} is {:.2} times d(speed)/dt, correlation {:.2}; the speed has to be negative there.",
        s.label(column),
        back.len(),
        back.len() + ahead,
        from as f64 * STEP,
        to as f64 * STEP,
        s.label(forward),
        f.x[0],
        -f.explained.sqrt()
    );
    s.find(Weight::Contradiction, &[column, forward], text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_lie_between_standstills() {
        let mut speed = vec![0.0; 20];
        speed.extend([2.0; 30]);
        speed.extend([0.0; 20]);
        speed.extend([20.0; 30]);
        speed.extend([0.0; 5]);
        speed.extend([1.0; 30]);
        assert_eq!(stretches(&speed), [(20, 50), (70, 100), (105, 135)]);
    }
}
