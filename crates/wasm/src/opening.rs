//! Opening a drive in steps: a simulation, or the parts of what the readers' module has read. The open drive stays until
//! this has succeeded.

use drivescope_door::{Progress, sentence};
use drivescope_drive::drive::Drive;
use drivescope_drive::parts::{Assembly, Head};
use drivescope_simulation::Simulation;
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

/// Seconds simulated at a time.
const SIMULATED: f64 = 5.0;

/// A drive that has been opened.
pub struct Opened {
    /// The drive.
    pub drive: Drive,
    /// What the reader said, with the mapping it used, a plain object; absent for a simulation.
    pub report: Option<JsValue>,
}

/// What one piece of work led to.
pub enum Step {
    /// The drive is there.
    Done(Box<Opened>),
    /// There is more to do.
    More(Opening),
}

/// Work on opening a drive.
pub enum Opening {
    /// A drive that is being simulated.
    Simulation(Box<Simulation>),
    /// A drive that was read and comes part by part.
    Parts(Box<Coming>),
}

/// A drive of which parts are still to come.
pub struct Coming {
    assembly: Assembly,
    report: JsValue,
}

impl Opening {
    /// Start on the parts of a drive; `report` is what the reader said.
    pub fn parts(head: Head, report: JsValue) -> Result<Self, JsError> {
        Ok(Self::Parts(Box::new(Coming { assembly: Assembly::new(head).map_err(sentence)?, report })))
    }

    /// Do one more piece of work: the drive, or what is left to do. Parts are complete when nothing more comes.
    pub fn step(self) -> Result<Step, JsError> {
        match self {
            Self::Simulation(mut simulation) => Ok(if simulation.advance(SIMULATED) {
                if let Some(failure) = simulation.failure() {
                    return Err(sentence(failure));
                }
                Step::Done(Box::new(Opened { drive: simulation.finish(), report: None }))
            } else {
                Step::More(Self::Simulation(simulation))
            }),
            Self::Parts(coming) => {
                let Coming { assembly, report } = *coming;
                Ok(Step::Done(Box::new(Opened { drive: assembly.finish(), report: Some(report) })))
            }
        }
    }

    /// Take one part of a drive.
    pub fn add(
        &mut self,
        part: &str,
        names: Vec<String>,
        time: Vec<f64>,
        columns: &[Float64Array],
    ) -> Result<(), JsError> {
        let Self::Parts(coming) = self else { return Err(JsError::new("no drive is coming in parts")) };
        if names.len() != columns.len() {
            return Err(JsError::new("a part of a drive has as many columns as names"));
        }
        let columns = names.into_iter().zip(columns.iter().map(Float64Array::to_vec)).collect();
        coming.assembly.add(part, time, columns).map_err(sentence)
    }

    /// The drive as simulated so far; `None` for one that comes in parts, which is no drive before its end.
    pub fn so_far(&self) -> Option<&Drive> {
        match self {
            Self::Simulation(simulation) => Some(simulation.drive()),
            Self::Parts(_) => None,
        }
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        match self {
            Self::Simulation(s) => {
                let rows = s.drive().imu.len();
                Progress { done: false, fraction: s.fraction(), stage: "simulating", rows }
            }
            Self::Parts(_) => Progress { done: false, fraction: 1.0, stage: "reading", rows: 0 },
        }
    }
}
