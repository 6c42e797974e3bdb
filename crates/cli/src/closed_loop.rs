//! `drivescope closed-loop`: controllers drive a car, and what it did is written down.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use drivescope_control::Pose;
use drivescope_drive::csv::{write_drive, write_series};
use drivescope_drive::drive::Epoch;
use drivescope_drive::param::ParamSpec;
use drivescope_estimation::gnss_ins::{GnssIns, GnssInsParams, KnownStart};
use drivescope_simulation::closed_loop::{ClosedLoop, SCENARIOS, Settings, Start};
use serde_json::{Map, Value, json};

use crate::{Sentence, output, parameters};

/// What the command takes.
#[derive(clap::Args)]
pub struct Args {
    /// Name of a closed loop.
    scenario: String,
    /// Settings as a JSON object.
    #[arg(long, value_name = "P.json")]
    params: Option<PathBuf>,
    /// One setting, `name=value`; may be given again.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Seed of all noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where the car's motion and the controller go, as CSV, a row for each sample.
    #[arg(long, value_name = "OUT.csv")]
    out: PathBuf,
    /// Where the guidance goes, as CSV, a row for each decision.
    #[arg(long, value_name = "GUIDANCE.csv")]
    guidance: Option<PathBuf>,
    /// Where the drive goes, as a log with its truth.
    #[arg(long, value_name = "LOG.csv")]
    log: Option<PathBuf>,
    /// Where the settings and the summary go, as JSON.
    #[arg(long, value_name = "OUT.json")]
    metrics: Option<PathBuf>,
}

/// Run a closed loop to its end and write what was asked for.
///
/// # Errors
/// One sentence.
pub fn run(args: &Args) -> Result<(), Sentence> {
    let unknown = || format!("there is no closed loop `{}`; see `list loops`", args.scenario);
    let mut settings = Settings::named(&args.scenario).ok_or_else(unknown)?;
    settings.set_all(&parameters(args.params.as_deref(), &args.set)?).map_err(|e| e.to_string())?;
    let mut run = ClosedLoop::new(settings, args.seed);
    let mut navigator = navigator(&run.start());
    while !run.advance(60.0, &mut navigator) {}
    output::write(&args.out, |file| write_series(run.rows().series(), file))?;
    if let Some(path) = &args.guidance {
        output::write(path, |file| write_series(run.guidance().series(), file))?;
    }
    if let Some(path) = &args.log {
        output::write(path, |file| write_drive(run.drive(), file))?;
    }
    let summary = json!(run.summary());
    if let Some(path) = &args.metrics {
        let settings = run.settings().to_json();
        let body = json!({ "closed_loop": args.scenario, "seed": args.seed, "settings": settings, "summary": summary });
        output::write(path, |file| writeln!(file, "{body:#}"))?;
    }
    if run.has_failed() {
        eprintln!("note: the car turned over at {:.2} s; what is written ends there", run.time());
    }
    output::print(&text(&summary))
}

/// The GNSS/INS filter, started from what may be known.
fn navigator(start: &Start) -> impl FnMut(&Epoch) -> Option<Pose> + use<> {
    let params = GnssInsParams { initial_yaw_sigma: start.yaw_sigma.min(1.571), ..GnssInsParams::default() };
    let Start { time, place, velocity, body_to_nav, .. } = *start;
    let mut filter = GnssIns::from_known(&params, &KnownStart { time, place, velocity, body_to_nav });
    move |epoch| filter.planar(epoch).map(Pose::from)
}

/// A summary line by line, without what has no meaning there.
fn text(summary: &Value) -> String {
    let mut text = String::new();
    for (name, value) in summary.as_object().into_iter().flatten().filter(|(_, v)| !v.is_null()) {
        let _ = writeln!(text, "{name:22} {:.4}", value.as_f64().unwrap_or(f64::NAN));
    }
    text
}

/// The closed loops and what can be set about them.
pub fn list(is_json: bool) -> String {
    let of = |name: &str| Settings::named(name).map_or(Value::Null, |s| s.to_json());
    if is_json {
        let loops: Vec<Value> = SCENARIOS
            .iter()
            .map(|s| json!({ "name": s.name, "title": s.title, "doc": s.doc, "settings": of(s.name) }))
            .collect();
        let groups: Map<String, Value> = Settings::specs().into_iter().map(|(g, s)| (g.into(), json!(s))).collect();
        return format!("{:#}", json!({ "loops": loops, "parameters": groups }));
    }
    let mut text = String::new();
    for s in SCENARIOS {
        let _ = writeln!(text, "{:18} {}", s.name, s.doc);
    }
    for (group, specs) in Settings::specs() {
        let _ = writeln!(text, "\n{group}");
        let line = |s: &ParamSpec| format!("  {:22} {:8} {}", s.name, s.unit, s.doc);
        specs.iter().for_each(|s| text.push_str(&(line(s) + "\n")));
    }
    text
}
