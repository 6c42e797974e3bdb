//! Physics of a log: what each column is, how its sensor sits, and how late it is, with the reasons and in numbers.
//!
//! Names and units are a first opinion where they agree with what the columns measure, and are set aside where they do
//! not. Everything leans on the motion over ground: places tell velocity, that tells speeds, those tell the
//! accelerometer's axes, and so on to the magnetometer. What a drive cannot show is said as a guess.

mod at_rest;
mod choices;
mod clash;
mod clock;
mod compare;
mod delay;
mod evidence;
mod gnss;
mod grain;
mod gyro;
mod hold;
mod inertial;
mod linear;
mod magnetic;
mod others;
mod place_pairs;
mod reading;
mod reversing;
mod run;
mod scene;
mod sketch;
mod speeds;
mod strangers;
mod survey;
mod thinned;
mod trial;

use serde::Serialize;

pub use self::choices::{Choice, choices};
pub use self::clash::{Clash, Correction};
pub(crate) use self::compare::contradictions;
pub(crate) use self::grain::odd_columns;
pub(crate) use self::linear::lean_rows;
pub(crate) use self::sketch::sketch;
pub(crate) use self::survey::heaviest_first;
pub use self::survey::{Finding, Weight};
use self::survey::{Kind, Role, Survey, canonical_unit, channel, kind};
pub use self::thinned::Thinned;
pub use self::trial::{TRIAL_SERIES, Trial, try_out};
use crate::candidate::{Candidate, Confidence};
use crate::clock::times;
use crate::correction::Amendment;
use crate::error::ImportError;
use crate::mapping::{Mapping, Mount, SignalSource};
use crate::propose::{Proposal, choose, propose};
use crate::table::Table;

/// How the reason ends of a column that nothing but its name tells.
const BY_NAME: &str = "; by name only, this drive does not show it";

/// What was found about a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Examination {
    /// The mapping that follows, every correction in it.
    pub mapping: Mapping,
    /// Every column of numbers, in the order of the file.
    pub columns: Vec<ColumnView>,
    /// How housings lean on their mounts.
    pub mounts: Vec<MountFound>,
    /// How late sensors are.
    pub delays: Vec<DelayFound>,
    /// Guesses, contradictions and what else is worth knowing, heaviest first.
    pub findings: Vec<Finding>,
    /// Whether the names of the columns agree with what they measure.
    pub names_believed: bool,
}

/// One raw column, as a table of the mapping shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ColumnView {
    /// Name in the file.
    pub column: String,
    /// Unit that the file states.
    pub stated_unit: Option<String>,
    /// Samples per second.
    pub rate: Option<f64>,
    /// Least and largest value, raw.
    pub range: Option<[f64; 2]>,
    /// Number of values.
    pub values: usize,
    /// Samples are repeated in the file until the next one comes.
    pub held: bool,
    /// Signal that is proposed; `t` for the clock.
    pub signal: Option<String>,
    /// Unit of the raw values as proposed.
    pub unit: Option<String>,
    /// Sign or factor beside the unit.
    pub scale: f64,
    /// How sure that is.
    pub confidence: Option<Confidence>,
    /// Why, with numbers; why not, where no signal is proposed.
    pub why: String,
    /// What the name alone says, where physics says something else.
    pub name_says: Option<String>,
    /// Rests on its name alone: this drive does not show it.
    pub by_name: bool,
}

/// How a housing leans on its mount.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MountFound {
    /// `imu` or `mag`.
    pub channel: String,
    /// The lean.
    pub mount: Mount,
    /// 1-sigma of its directions, deg.
    pub sigma_deg: f64,
    /// Whether the mapping has it.
    pub applied: bool,
    /// What it rests on.
    pub why: String,
}

/// How late a sensor is against the inertial sensor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DelayFound {
    /// `wheels`, `steering`, `gnss` or `mag`.
    pub channel: String,
    /// s.
    pub late: f64,
    /// 1-sigma, s.
    pub sigma: f64,
    /// Whether the mapping has it.
    pub applied: bool,
    /// What it rests on.
    pub why: String,
}

/// Examine a table: propose a mapping from physics, with names and units as a first opinion.
///
/// # Errors
/// [`ImportError::NoTime`] and [`ImportError::TooFewTimes`] without a clock, [`ImportError::NoSignals`] if neither names
/// nor physics explain a column.
pub fn examine(table: &Table) -> Result<Examination, ImportError> {
    examine_thinned(table).map(|(found, _)| found)
}

/// The same, with the columns thinned as they were looked at.
pub(crate) fn examine_thinned(table: &Table) -> Result<(Examination, Thinned), ImportError> {
    let mut findings = Vec::new();
    let mut found = clock::find(table, &mut findings)?;
    found.source.skip_steps_back = clock::oddities(table, &found.source, &mut findings);
    let time = times(table, &found.source)?;
    let is_time =
        |name: &str| name == found.source.column || found.source.fraction.as_ref().is_some_and(|f| f.column == name);
    let skip = |i: usize| {
        let c = &table.columns[i];
        is_time(&c.name) || c.epoch.is_some() || c.name.starts_with("truth_")
    };
    let none = || vec![None; table.columns.len()];
    let mut names = none();
    for c in choose(table, &is_time, &mut Vec::new(), &mut Vec::new()) {
        let column = c.column;
        names[column] = Some(c);
    }
    let mut s = run::run(table, &time, names.clone(), &skip);
    let mut believed = names.iter().flatten().count() > 0;
    if believed && doubtful(&s) {
        let other = run::run(table, &time, none(), &skip);
        let (agree, differ) = agreement(&other, &names);
        if differ > 2 && 2 * differ > agree {
            s = other;
            believed = false;
            let text = format!(
                "the names of {differ} of the {} columns that physics can tell contradict what they measure: names were set aside.",
                agree + differ
            );
            s.find(Weight::Contradiction, &[], text);
        }
    }
    s.findings.splice(0..0, findings);
    let by_name = if believed { propose(table).ok() } else { None };
    if let Some(p) = &by_name {
        fill(&mut s, p);
    }
    let mut finished = Finished { s, names, believed, by_name, clock: found };
    let examination = finished.finish()?;
    Ok((examination, Thinned::new(table, &time, finished.s.scene)))
}

/// Whether physics finds much less than the names promise.
fn doubtful(s: &Survey) -> bool {
    let checkable = |k: Kind| !matches!(k, Kind::Other | Kind::Altitude | Kind::Course | Kind::Steering);
    let named = s.names.iter().flatten().filter(|c| checkable(kind(&c.signal)));
    let confirmed = s.roles.iter().flatten().filter(|r| checkable(kind(&r.signal)));
    3 * confirmed.count() < 2 * named.count()
}

/// How many columns that physics is sure of have a name of their kind, and how many one of another.
fn agreement(s: &Survey, names: &[Option<Candidate>]) -> (usize, usize) {
    let (mut agree, mut differ) = (0, 0);
    for (role, name) in s.roles.iter().zip(names) {
        if let (Some(role), Some(name)) = (role, name)
            && role.confidence >= Confidence::Likely
        {
            if kind(&role.signal) == kind(&name.signal) { agree += 1 } else { differ += 1 }
        }
    }
    (agree, differ)
}

/// Columns that physics says nothing of keep what their names say.
fn fill(s: &mut Survey, p: &Proposal) {
    for (signal, source) in p.mapping.signals.iter() {
        let Some(column) = s.table.columns.iter().position(|c| c.name == source.column) else { continue };
        let entry = p.entries.iter().find(|e| e.signal == *signal);
        let (signal, turn) = moved(s, signal);
        if s.roles[column].is_some() || s.of(&signal).is_some() {
            continue;
        }
        let why = entry.map_or(String::new(), |e| e.why.clone());
        let told = entry.filter(|e| e.signal == signal && turn > 0.0);
        let confidence = told.map_or(Confidence::Guess, |e| e.confidence).min(Confidence::Likely);
        s.roles[column] = Some(Role {
            unit: source.unit.clone().unwrap_or_else(|| canonical_unit(&signal).into()),
            signal,
            scale: source.scale * turn,
            offset: source.offset,
            confidence,
            why: format!("{why}{BY_NAME}"),
        });
    }
}

/// A gyro sits in the housing of the accelerometer: where that was found to stand otherwise than named, so does the gyro.
fn moved(s: &Survey, signal: &str) -> (String, f64) {
    let accel = signal.strip_prefix("gyro_").map(|axis| format!("accel_{axis}"));
    let found = s.names.iter().zip(&s.roles).find_map(|(name, role)| {
        let (name, role) = (name.as_ref()?, role.as_ref()?);
        let axis = role.signal.strip_prefix("accel_")?;
        (Some(&name.signal) == accel.as_ref()).then(|| (format!("gyro_{axis}"), role.scale * name.scale))
    });
    found.unwrap_or((signal.to_owned(), 1.0))
}

/// A finished survey on its way out.
struct Finished<'t> {
    s: Survey<'t>,
    names: Vec<Option<Candidate>>,
    believed: bool,
    by_name: Option<Proposal>,
    clock: clock::Clock,
}

impl Finished<'_> {
    fn finish(&mut self) -> Result<Examination, ImportError> {
        let s = &mut self.s;
        if s.roles.iter().flatten().all(|r| r.signal.is_empty()) {
            let (place, found) = (s.table.header_place(), s.table.columns_found());
            return Err(ImportError::NoSignals { file: s.table.name.clone(), place, found });
        }
        s.roles.iter_mut().for_each(|r| {
            if r.as_ref().is_some_and(|r| r.signal.is_empty()) {
                *r = None;
            }
        });
        let altitudes: Vec<usize> = ["gnss_alt", "baro_alt"].iter().filter_map(|n| s.of(n)).collect();
        let blanks = others::sentinels(s, &altitudes);
        let mut mapping = Mapping::of(self.clock.source.clone());
        if let Some(p) = &self.by_name {
            mapping.drop_repeats = p.mapping.drop_repeats.clone();
        }
        for (i, role) in s.roles.iter().enumerate() {
            let Some(role) = role else { continue };
            let blank = blanks.iter().filter(|b| b.0 == i).map(|b| b.1).collect();
            let source = SignalSource { blank, ..s.source(i, role) };
            mapping.signals.insert(role.signal.clone(), source);
            let held = s.scene.fields[i].held.then(|| channel(&role.signal)).flatten();
            if let Some(channel) = held.filter(|c| ["gnss", "baro"].contains(c))
                && !mapping.drop_repeats.iter().any(|d| d == channel)
            {
                mapping.drop_repeats.push(channel.to_owned());
            }
        }
        let mounts = mounts(s, &mut mapping);
        let delays = delays(s, &mut mapping);
        say(s, &mounts, &delays);
        let columns = (0..s.table.columns.len()).map(|i| self.column(i)).collect();
        let mut findings = std::mem::take(&mut self.s.findings);
        heaviest_first(&mut findings);
        Ok(Examination { mapping, columns, mounts, delays, findings, names_believed: self.believed })
    }

    fn column(&self, i: usize) -> ColumnView {
        let (raw, field, role) = (&self.s.table.columns[i], &self.s.scene.fields[i], &self.s.roles[i]);
        let is_clock = raw.name == self.clock.source.column;
        let values = raw.values.iter().filter(|v| v.is_finite()).count();
        let name_says = self.names[i].as_ref().map(|c| c.signal.clone());
        let name_says = name_says.filter(|n| role.as_ref().is_none_or(|r| r.signal != *n));
        let mut view = ColumnView {
            column: raw.name.clone(),
            stated_unit: raw.unit.clone(),
            rate: Some(1.0 / field.period).filter(|r| r.is_finite() && *r > 0.0),
            range: Some(field.range).filter(|r| r[0] <= r[1] && field.count > 0),
            values,
            held: field.held,
            signal: role.as_ref().map(|r| r.signal.clone()),
            unit: role.as_ref().map(|r| r.unit.clone()),
            scale: role.as_ref().map_or(1.0, |r| r.scale),
            confidence: role.as_ref().map(|r| r.confidence),
            why: role.as_ref().map_or_else(|| self.why_not(i), |r| r.why.clone()),
            name_says,
            by_name: role.as_ref().is_some_and(|r| r.why.ends_with(BY_NAME)),
        };
        if is_clock {
            let step = crate::clock::median_step(&raw.values);
            let factor = crate::units::factor(&self.clock.source.unit, "s").unwrap_or(1.0);
            view.rate = Some(1.0 / (step * factor)).filter(|r| r.is_finite());
            let ends = raw.values.iter().copied().filter(|v| v.is_finite());
            view.range = Some(ends.fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)]));
            (view.signal, view.unit) = (Some("t".into()), Some(self.clock.source.unit.clone()));
            (view.confidence, view.why, view.name_says) = (Some(self.clock.confidence), self.clock.why.clone(), None);
        }
        view
    }

    /// Why a column has no signal.
    fn why_not(&self, i: usize) -> String {
        let column = &self.s.table.columns[i].name;
        let told = self.by_name.as_ref().and_then(|p| p.unused.iter().find(|u| u.column == *column));
        match told {
            Some(unused) => unused.reason.clone(),
            None if self.s.scene.fields[i].count == 0 => "has no value in any row".into(),
            None if self.s.scene.fields[i].is_constant() => "never changes".into(),
            None => "nothing in this drive tells what it is".into(),
        }
    }
}

/// Say how housings lean and how late sensors are, with the corrections.
fn say(s: &mut Survey, mounts: &[MountFound], delays: &[DelayFound]) {
    for m in mounts.iter().filter(|m| m.sigma_deg < 20.0) {
        let Mount { roll_deg, pitch_deg, yaw_deg } = m.mount;
        let size = roll_deg.abs().max(pitch_deg.abs()).max(yaw_deg.abs());
        if size < 2.0 {
            continue;
        }
        let text = format!(
            "the housing of {} leans by roll {roll_deg:.1}, pitch {pitch_deg:.1}, yaw {yaw_deg:.1} deg on its mount, directions to {:.1} deg: by {}.",
            m.channel, m.sigma_deg, m.why
        );
        let mut correction = Amendment::default();
        if m.applied {
            correction.mounts.insert(m.channel.clone(), m.mount);
        }
        s.propose(Weight::Guess, &[], text, correction);
    }
    for d in delays.iter().filter(|d| d.applied) {
        let text = format!(
            "{} is {:.0} ms late against the inertial sensor (1-sigma {:.0} ms): by {}.",
            d.channel,
            1e3 * d.late,
            1e3 * d.sigma,
            d.why
        );
        let mut correction = Amendment::default();
        correction.delays.insert(d.channel.clone(), d.late);
        s.propose(Weight::Guess, &[], text, correction);
    }
}

fn mounts(s: &Survey, mapping: &mut Mapping) -> Vec<MountFound> {
    let mut out = Vec::new();
    for (channel, lean, sigma, why) in &s.mounts {
        let [roll_deg, pitch_deg, yaw_deg] = lean.map(f64::to_degrees);
        let mount = Mount { roll_deg, pitch_deg, yaw_deg };
        let size = roll_deg.abs().max(pitch_deg.abs()).max(yaw_deg.abs());
        let applied = size > 1.0_f64.max(2.0 * sigma.to_degrees()) && *sigma < 0.35;
        if applied {
            mapping.mounts.insert((*channel).to_owned(), mount);
        }
        out.push(MountFound {
            channel: (*channel).into(),
            mount,
            sigma_deg: sigma.to_degrees(),
            applied,
            why: why.clone(),
        });
    }
    out
}

fn delays(s: &Survey, mapping: &mut Mapping) -> Vec<DelayFound> {
    let mut out = Vec::new();
    for (channel, late, sigma, why) in &s.delays {
        let applied = run::matters(*late, *sigma);
        if applied {
            mapping.delays.insert((*channel).to_owned(), *late);
        }
        out.push(DelayFound { channel: (*channel).into(), late: *late, sigma: *sigma, applied, why: why.clone() });
    }
    out
}
