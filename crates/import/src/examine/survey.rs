//! What is known while a table is examined: which columns are taken, by what, and what was found on the way.

use drivescope_drive::csv::file_unit;
use serde::Serialize;

use super::scene::Scene;
use crate::candidate::{Candidate, Confidence};
use crate::channels::{CHANNELS, signal};
use crate::correction::Amendment;
use crate::mapping::SignalSource;
use crate::table::Table;
use crate::units;

/// What a signal is about; a name narrows its column down to one of these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Place,
    Velocity,
    Course,
    GnssSpeed,
    Altitude,
    Speed,
    Steering,
    Accel,
    Gyro,
    Mag,
    Other,
}

/// The kind of a signal by its canonical name.
pub(crate) fn kind(signal: &str) -> Kind {
    match signal {
        "gnss_lat" | "gnss_lon" => Kind::Place,
        "gnss_vn" | "gnss_ve" | "gnss_vd" => Kind::Velocity,
        "course" => Kind::Course,
        "gnss_speed" => Kind::GnssSpeed,
        "gnss_alt" | "baro_alt" => Kind::Altitude,
        "speed" => Kind::Speed,
        "steer" | "steering_wheel" => Kind::Steering,
        s if s.starts_with("wheel_speed") => Kind::Speed,
        s if s.starts_with("accel_") => Kind::Accel,
        s if s.starts_with("gyro_") => Kind::Gyro,
        s if s.starts_with("mag_") => Kind::Mag,
        _ => Kind::Other,
    }
}

/// What a column was found to be.
#[derive(Clone, Debug)]
pub(crate) struct Role {
    pub signal: String,
    pub unit: String,
    /// Sign or pure factor beside the unit.
    pub scale: f64,
    /// Added after that, SI.
    pub offset: f64,
    pub confidence: Confidence,
    pub why: String,
}

/// How much a finding weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Weight {
    /// Worth knowing; nothing contradicts.
    Note,
    /// Something was decided that people should look at.
    Guess,
    /// Sensors contradict each other, or the file its own names.
    Contradiction,
}

/// What was found about a log, in one sentence with its numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// How much it weighs.
    pub weight: Weight,
    /// Raw columns concerned.
    pub columns: Vec<String>,
    /// The sentence.
    pub text: String,
    /// What it proposes to change in the mapping.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correction: Option<Amendment>,
}

/// Contradictions first, what is said first of equal weight.
pub(crate) fn heaviest_first(findings: &mut Vec<Finding>) {
    crate::order::sort_by(findings, |a, b| b.weight.cmp(&a.weight));
}

/// A table under examination.
pub(crate) struct Survey<'t> {
    pub table: &'t Table,
    pub scene: Scene,
    /// What names say of each column, where names are believed.
    pub names: Vec<Option<Candidate>>,
    pub roles: Vec<Option<Role>>,
    pub findings: Vec<Finding>,
    /// How late each channel is against the inertial sensor: channel, s, 1-sigma, what it rests on.
    pub delays: Vec<(&'static str, f64, f64, String)>,
    /// How a housing leans on its mount: channel, roll, pitch and yaw, rad, 1-sigma of the directions, what it rests on.
    pub mounts: Vec<(&'static str, [f64; 3], f64, String)>,
}

impl<'t> Survey<'t> {
    /// Nothing known yet; `names` are believed.
    pub fn new(table: &'t Table, scene: Scene, names: Vec<Option<Candidate>>) -> Self {
        let count = table.columns.len();
        Self {
            table,
            scene,
            names,
            roles: vec![None; count],
            findings: Vec::new(),
            delays: Vec::new(),
            mounts: Vec::new(),
        }
    }

    /// Whether a column may be of a kind: not taken, with values that change, and not named otherwise.
    pub fn may_be(&self, column: usize, wanted: Kind) -> bool {
        let field = &self.scene.fields[column];
        if self.roles[column].is_some() || field.count < 10 || field.is_constant() {
            return false;
        }
        match &self.names[column] {
            Some(c) => kind(&c.signal) == wanted,
            // A column without a known name is asked only for what no named column is.
            None => !self.names.iter().flatten().any(|c| kind(&c.signal) == wanted),
        }
    }

    /// Columns that may be of a kind.
    pub fn columns(&self, wanted: Kind) -> Vec<usize> {
        (0..self.table.columns.len()).filter(|&i| self.may_be(i, wanted)).collect()
    }

    /// Name of a column in backquotes.
    pub fn label(&self, column: usize) -> String {
        format!("`{}`", self.table.columns[column].name)
    }

    /// The column that has a role.
    pub fn of(&self, signal: &str) -> Option<usize> {
        self.roles.iter().position(|r| r.as_ref().is_some_and(|r| r.signal == signal))
    }

    /// Column and factor to SI of a signal: by its role, else by its name.
    pub fn known(&self, wanted: &str) -> Option<(usize, f64)> {
        if let Some(column) = self.of(wanted) {
            return Some((column, self.factor(column)));
        }
        let column = self.names.iter().position(|c| c.as_ref().is_some_and(|c| c.signal == wanted))?;
        let c = self.names[column].as_ref().filter(|_| self.roles[column].is_none())?;
        Some((column, c.scale * units::factor(&c.unit, signal(wanted)?.unit)?))
    }

    /// Factor from the raw values of a column to SI as its role has it.
    pub fn factor(&self, column: usize) -> f64 {
        let Some(role) = &self.roles[column] else { return f64::NAN };
        let si = signal(&role.signal).map_or("1", |s| s.unit);
        units::factor(&role.unit, si).unwrap_or(f64::NAN) * role.scale
    }

    /// Give a column a role; a stated unit that differs stays, with a contradiction.
    pub fn assign(&mut self, column: usize, mut role: Role) {
        let stated = self.names[column].as_ref().filter(|c| c.stated).map(|c| c.unit.clone());
        if let Some(stated) = stated {
            let si = signal(&role.signal).map_or("1", |s| s.unit);
            let (own, found) = (units::factor(&stated, si), units::factor(&role.unit, si));
            match (own, found) {
                (Some(own), Some(found)) if (own / found).ln().abs() > 0.05 => {
                    let text = format!(
                        "{} is said to be in {stated}, but its values are those of {} in {}: {}.",
                        self.label(column),
                        role.signal,
                        role.unit,
                        role.why
                    );
                    let source = self.source(column, &role);
                    self.propose(Weight::Contradiction, &[column], text, Amendment::of(&role.signal, source));
                    role.confidence = role.confidence.min(Confidence::Likely);
                    role.unit = stated;
                }
                _ => role.unit = stated,
            }
        }
        self.roles[column] = Some(role);
    }

    /// Where a signal comes from as a role has it.
    pub fn source(&self, column: usize, role: &Role) -> SignalSource {
        let unit = (canonical_unit(&role.signal) != role.unit).then(|| role.unit.clone());
        let plain = SignalSource::plain(&self.table.columns[column].name);
        SignalSource { unit, scale: role.scale, offset: role.offset, ..plain }
    }

    /// Say something about columns.
    pub fn find(&mut self, weight: Weight, columns: &[usize], text: String) {
        self.propose(weight, columns, text, Amendment::default());
    }

    /// Say something about columns, with what it would change in the mapping.
    pub fn propose(&mut self, weight: Weight, columns: &[usize], text: String, correction: Amendment) {
        let columns = columns.iter().map(|&c| self.table.columns[c].name.clone()).collect();
        let correction = Some(correction).filter(|c| !c.is_empty());
        self.findings.push(Finding { weight, columns, text, correction });
    }
}

/// The canonical unit of a signal in files.
pub(crate) fn canonical_unit(name: &str) -> &'static str {
    signal(name).map_or("1", |s| file_unit(name, s.unit))
}

/// The channel of a signal.
pub(crate) fn channel(signal: &str) -> Option<&'static str> {
    CHANNELS.iter().find(|(_, columns)| columns.iter().any(|c| c.name == signal)).map(|(name, _)| *name)
}
