//! What the filter keeps for a smoother: at each node its state and covariance, and what happened until the next one.
//!
//! The predicted covariance and the transition are not kept: they follow again, bit for bit, from the covariance before and
//! the mean rates of the interval. A node costs 0.6 kB and the triangle of its covariance (1 to 1.4 kB): 10 min with a node
//! every 0.1 s are 12 MB.

use nalgebra::{Matrix3, Vector3};

use super::covariance::Covariance;
use super::state::State;
use crate::ins::{Earth, ErrorRates, GravityModel, Navigation, error_rates};

/// Sums over the inertial samples of a node, of which the covariance does not know yet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval {
    /// Samples.
    pub samples: usize,
    /// Their time, s.
    pub time: f64,
    /// The time for which noise acts, s.
    pub noise_time: f64,
    /// Specific force in NED times time, m/s.
    pub force: Vector3<f64>,
    /// Rotation from body to NED times time, s.
    pub rotation: Matrix3<f64>,
}

impl Interval {
    /// Mean rates of the errors, at the navigation state of the interval's end.
    pub fn rates(&self, end: &Navigation, gravity: GravityModel, earth_terms: bool) -> ErrorRates {
        let mean = Navigation { body_to_nav: self.rotation / self.time, ..*end };
        error_rates(&mean, &(self.force / self.time), &Earth::at(&end.place, gravity), earth_terms)
    }
}

/// How a node leads to the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Node {
    /// Inertial samples.
    Interval(Interval),
    /// The covariance was opened up after too many refusals.
    Doubt,
    /// The receiver clock was set anew, with these variances of offset and drift; NaN leaves one as it was.
    Clock([f64; 2]),
    /// It does not: the filter was set anew, or ended.
    End,
}

/// One node.
#[derive(Clone, Copy, Debug)]
pub struct Kept {
    /// Its time, s.
    pub time: f64,
    /// State after the updates at the node.
    pub after: State,
    /// State before the updates at the next node.
    pub before: State,
    /// What lies between.
    pub node: Node,
}

/// The nodes of a run.
#[derive(Clone, Debug, Default)]
pub struct Store {
    states: usize,
    nodes: Vec<Kept>,
    triangles: Vec<f64>,
    is_open: bool,
}

impl Store {
    /// Keep the covariance of the first `states` errors; before the first node.
    pub fn set_states(&mut self, states: usize) {
        self.states = states;
    }

    fn push(&mut self, time: f64, state: &State, covariance: &Covariance) {
        self.nodes.push(Kept { time, after: *state, before: *state, node: Node::End });
        for (column, p) in covariance.data.0.iter().enumerate().take(self.states) {
            self.triangles.extend_from_slice(&p[column..self.states]);
        }
    }

    /// A node begins with this state, after all updates.
    pub fn begin(&mut self, time: f64, state: &State, covariance: &Covariance) {
        self.push(time, state, covariance);
        self.is_open = true;
    }

    /// The node that began leads to `state`, before any update.
    pub fn end(&mut self, node: Node, state: &State) {
        if let Some(last) = self.nodes.last_mut().filter(|_| self.is_open) {
            last.node = node;
            last.before = *state;
        }
    }

    /// A segment ends: nothing after this instant tells about what was before.
    pub fn close(&mut self, time: f64, state: &State, covariance: &Covariance) {
        if self.is_open {
            self.push(time, state, covariance);
            self.is_open = false;
        }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// A node and its covariance.
    ///
    /// # Panics
    /// When `index` is not below `len`.
    pub fn at(&self, index: usize) -> (&Kept, Covariance) {
        let size = self.states * (self.states + 1) / 2;
        let mut cells = self.triangles[index * size..(index + 1) * size].iter();
        let mut covariance = Covariance::zeros();
        for column in 0..self.states {
            for (row, cell) in (column..self.states).zip(&mut cells) {
                covariance.data.0[column][row] = *cell;
                covariance.data.0[row][column] = *cell;
            }
        }
        (&self.nodes[index], covariance)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * std::mem::size_of::<Kept>() + self.triangles.capacity() * 8
    }
}
