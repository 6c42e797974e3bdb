//! The second pass: what later measurements tell about earlier states (Rauch, Tung and Striebel).
//!
//! Source: SPEC navigation 7, for a filter whose errors are fed back. From the last node to the first:
//! `d = predicted [-] smoothed` at the end of an interval, `e = G d` at its beginning, `G = P+ Phi' (P-)^-1`;
//! smoothed = filtered corrected by `e`, its covariance `P+ + G (Ps - P-) G'`. Between two nodes the filter runs free, so that
//! the correction of a row is interpolated between `e` and `d`. Not smoothed across a yaw that was set, a start, or a hole that
//! was too long to bridge.

use drivescope_drive::channel::Channel;
use drivescope_drive::frames::body_to_nav;
use drivescope_drive::geodesy::{Geodetic, LocalFrame};
use nalgebra::Vector3;

use super::covariance::{self, ALL_STATES, CLOCK_BIAS, CLOCK_DRIFT, Covariance, Errors, Transition};
use super::estimate::{GnssInsEstimate, Sigmas, write_state};
use super::filter::{add_doubt, doubt_clock};
use super::state::State;
use super::store::{Kept, Node, Store};
use super::tuning::Tuning;
use crate::ins::{Earth, GravityModel, NAVIGATION_STATES, Navigation};

/// A backward pass that can stop and go on.
#[derive(Clone, Debug)]
pub struct Pass {
    store: Box<Store>,
    gravity: GravityModel,
    frame: LocalFrame,
    /// Nodes not yet smoothed.
    left: usize,
    /// Rows not yet smoothed.
    rows: usize,
    state: State,
    covariance: Covariance,
    sigmas: Sigmas,
    time: f64,
}

impl Pass {
    /// Stand at the end of what was stored; `None` if nothing was. `rows` is the number of estimates.
    pub fn new(store: Box<Store>, gravity: GravityModel, frame: LocalFrame, rows: usize) -> Option<Self> {
        let left = store.len();
        let (last, covariance) = store.at(left.checked_sub(1)?);
        let (state, time) = (last.after, last.time);
        let sigmas = Sigmas::new(&state, &covariance);
        Some(Self { store, gravity, frame, left, rows, state, covariance, sigmas, time })
    }

    /// Smooth at most `nodes` more nodes and their rows; `true` at the beginning of the drive.
    pub fn advance(&mut self, rows: &mut Channel<GnssInsEstimate>, nodes: usize, tuning: &Tuning) -> bool {
        for _ in 0..nodes {
            let Some(index) = self.left.checked_sub(1) else { break };
            self.left = index;
            self.step(index, rows, tuning);
        }
        self.left == 0
    }

    /// Share of the nodes done, 0 to 1.
    pub fn fraction(&self) -> f64 {
        1.0 - self.left as f64 / self.store.len() as f64
    }

    /// Where the pass stands: time, smoothed state and its covariance.
    #[cfg(test)]
    pub(super) fn here(&self) -> (f64, &State, &Covariance) {
        (self.time, &self.state, &self.covariance)
    }

    fn step(&mut self, index: usize, rows: &mut Channel<GnssInsEstimate>, tuning: &Tuning) {
        let (&kept, filtered) = self.store.at(index);
        let mut predicted = filtered;
        let (Some(cross), true) = (self.cross(&kept, &mut predicted, tuning), self.left + 1 < self.store.len()) else {
            // The end of a segment: nothing later tells about it.
            self.arrive(&kept, kept.after, filtered);
            self.rows = rows.time().partition_point(|&t| t < kept.time).min(self.rows);
            return;
        };
        let earth = Earth::at(&kept.before.navigation.place, self.gravity);
        let end = kept.before.errors_against(&self.state, &earth);
        let Some(gain) = gain(&predicted, &cross) else {
            self.arrive(&kept, kept.after, filtered);
            return;
        };
        let begin: Errors = Errors::from_fn(|row, _| dot(&gain[row], &end.data.0[0]));
        let mut state = kept.after;
        state.correct(&begin, &Earth::at(&state.navigation.place, self.gravity));
        let covariance = smoothed_covariance(&filtered, &(self.covariance - predicted), &gain);
        let (until, later) = (self.time, self.sigmas);
        self.arrive(&kept, state, covariance);
        self.write_rows(rows, until, &later, &begin, &end);
    }

    fn arrive(&mut self, kept: &Kept, state: State, covariance: Covariance) {
        self.time = kept.time;
        self.state = state;
        self.covariance = covariance;
        self.sigmas = Sigmas::new(&state, &self.covariance);
    }

    /// `P Phi'` as rows of the state before, and the prediction; `None` at the end of a segment.
    fn cross(&self, kept: &Kept, predicted: &mut Covariance, tuning: &Tuning) -> Option<Rows> {
        let mut rows = predicted.data.0;
        match kept.node {
            Node::End => return None,
            Node::Doubt => add_doubt(predicted),
            Node::Clock(variance) => {
                doubt_clock(predicted, variance);
                for (state, _) in [CLOCK_BIAS, CLOCK_DRIFT].iter().zip(variance).filter(|(_, v)| v.is_finite()) {
                    rows.iter_mut().for_each(|row| row[*state] = 0.0);
                }
            }
            Node::Interval(interval) => {
                let rates = interval.rates(&kept.before.navigation, self.gravity, tuning.params.earth_terms);
                let phi = covariance::propagate(predicted, &rates, &tuning.noise, interval.time, interval.noise_time);
                rows.iter_mut().for_each(|row| *row = carried(row, &phi));
            }
        }
        Some(rows)
    }

    /// Correct the rows from this node up to, not including, the next one at `until`.
    fn write_rows(
        &mut self,
        rows: &mut Channel<GnssInsEstimate>,
        until: f64,
        later: &Sigmas,
        begin: &Errors,
        end: &Errors,
    ) {
        let step = until - self.time;
        while let Some(index) = self.rows.checked_sub(1) {
            let (time, mut row) = rows.at(index);
            if time < self.time {
                break;
            }
            self.rows = index;
            if time >= until || !row.yaw.is_finite() {
                continue;
            }
            let share = (time - self.time) / step;
            let mut state = state_of(&row);
            let earth = Earth::at(&state.navigation.place, self.gravity);
            state.correct(&(begin * (1.0 - share) + end * share), &earth);
            self.sigmas.between(later, share).write(&mut row);
            write_state(&state, &self.frame, &mut row);
            rows.replace(index, row);
        }
    }
}

/// Rows of a matrix over all states.
type Rows = [[f64; ALL_STATES]; ALL_STATES];

fn dot(a: &[f64; ALL_STATES], b: &[f64; ALL_STATES]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `Phi` times a vector.
fn carried(vector: &[f64; ALL_STATES], phi: &Transition) -> [f64; ALL_STATES] {
    let mut out = *vector;
    let mut navigation = [0.0; NAVIGATION_STATES];
    for (column, factor) in phi.navigation.data.0.iter().zip(vector) {
        for (out, phi) in navigation.iter_mut().zip(column) {
            *out += phi * factor;
        }
    }
    out[..NAVIGATION_STATES].copy_from_slice(&navigation);
    for (out, left) in out[NAVIGATION_STATES..].iter_mut().zip(phi.tail.iter()) {
        *out *= left;
    }
    out[CLOCK_BIAS] += phi.clock * vector[CLOCK_DRIFT];
    out
}

/// `cross` divided by a covariance from the right, row by row, by Cholesky's factors; `None` if it is none.
///
/// An error that is not estimated has a zero row, which is taken as a unit row.
fn gain(predicted: &Covariance, cross: &Rows) -> Option<Rows> {
    let mut factor = predicted.data.0;
    let mut inverse = [1.0; ALL_STATES];
    for column in 0..ALL_STATES {
        for before in 0..column {
            let (done, rest) = factor.split_at_mut(column);
            let scale = done[before][column];
            for (cell, left) in rest[0][column..].iter_mut().zip(&done[before][column..]) {
                *cell -= scale * left;
            }
        }
        let pivot = factor[column][column];
        if predicted[(column, column)] == 0.0 {
            factor[column] = [0.0; ALL_STATES];
            continue;
        }
        if !(pivot > 0.0 && pivot < f64::INFINITY) {
            return None;
        }
        inverse[column] = 1.0 / pivot.sqrt();
        factor[column].iter_mut().for_each(|cell| *cell *= inverse[column]);
    }
    let mut rows = *cross;
    for row in &mut rows {
        for column in 0..ALL_STATES {
            row[column] *= inverse[column];
            let value = row[column];
            for (cell, left) in row[column + 1..].iter_mut().zip(&factor[column][column + 1..]) {
                *cell -= value * left;
            }
        }
        for column in (0..ALL_STATES).rev() {
            let below: f64 = row[column + 1..].iter().zip(&factor[column][column + 1..]).map(|(a, b)| a * b).sum();
            row[column] = (row[column] - below) * inverse[column];
        }
    }
    Some(rows)
}

/// `P + G change G'`.
fn smoothed_covariance(filtered: &Covariance, change: &Covariance, gain: &Rows) -> Covariance {
    let mut out = *filtered;
    for column in 0..ALL_STATES {
        // change G' column by column; a row of the gain is a column of its transpose.
        let mut middle = [0.0; ALL_STATES];
        for (factor, change) in gain[column].iter().zip(&change.data.0).filter(|(factor, _)| **factor != 0.0) {
            for (middle, change) in middle.iter_mut().zip(change) {
                *middle += factor * change;
            }
        }
        for (row, gain) in gain.iter().enumerate().skip(column) {
            let value = out.data.0[column][row] + dot(gain, &middle);
            out.data.0[column][row] = value;
            out.data.0[row][column] = value;
        }
    }
    out
}

/// The state that a row shows.
fn state_of(row: &GnssInsEstimate) -> State {
    let known = |value: f64, default: f64| if value.is_finite() { value } else { default };
    State {
        navigation: Navigation {
            place: Geodetic { lat: row.lat, lon: row.lon, alt: row.alt },
            velocity: Vector3::new(row.v_north, row.v_east, row.v_down),
            body_to_nav: body_to_nav(row.roll, row.pitch, row.yaw),
        },
        accel_bias: Vector3::new(row.accel_bias_x, row.accel_bias_y, row.accel_bias_z),
        gyro_bias: Vector3::new(row.gyro_bias_x, row.gyro_bias_y, row.gyro_bias_z),
        odometer_scale: known(row.odometer_scale, 1.0),
        clock_bias: known(row.clock_bias, 0.0),
        clock_drift: known(row.clock_drift, 0.0),
    }
}
