//! `drivescope`: the same core as the page, on the command line.

mod log;
mod output;
mod report;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use drivescope_drive::vehicle::VehicleParams;
use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::score;
use serde_json::{Map, Value, json};

/// Everything that can end a command early is one sentence.
type Sentence = String;

/// Open a recorded drive, estimate it, simulate one.
#[derive(Parser)]
#[command(name = "drivescope", version, about)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Say what a log holds, how its columns are read, and which estimators can run on it.
    Info {
        #[command(flatten)]
        log: log::LogArgs,
        /// Print JSON instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Run an estimator over a log and write its estimates.
    Run {
        #[command(flatten)]
        log: log::LogArgs,
        /// Name of the estimator; `drivescope list estimators` shows them.
        #[arg(long)]
        estimator: String,
        /// Parameter values as a JSON object.
        #[arg(long, value_name = "P.json")]
        params: Option<PathBuf>,
        /// One parameter, `name=value`; may be given again.
        #[arg(long = "set", value_name = "NAME=VALUE")]
        set: Vec<String>,
        /// Name of the car; the drive's own or the estimator's without it.
        #[arg(long)]
        vehicle: Option<String>,
        /// Where the estimates go, as CSV.
        #[arg(long, value_name = "OUT.csv")]
        out: PathBuf,
        /// Where scores, consistency and notices go, as JSON.
        #[arg(long, value_name = "OUT.json")]
        metrics: Option<PathBuf>,
    },
    /// Simulate a built-in drive, or one described in a JSON file, and write it as a log with its truth.
    Simulate {
        /// Name of a built-in drive, or a JSON file.
        drive: String,
        /// Seed of all random numbers; the drive's own without it.
        #[arg(long)]
        seed: Option<u64>,
        /// Where the log goes, as CSV.
        #[arg(long, value_name = "LOG.csv")]
        out: PathBuf,
    },
    /// Measure what a step, a megabyte of CSV and an hour of driving cost; prints JSON.
    #[command(hide = true)]
    Bench {
        /// Accepted for symmetry with the other commands; JSON is the only form.
        #[arg(long)]
        json: bool,
        /// Measure less often.
        #[arg(long)]
        quick: bool,
    },
    /// List what there is.
    List {
        /// What to list.
        what: Listed,
        /// Print JSON instead of text.
        #[arg(long)]
        json: bool,
    },
}

#[derive(Clone, Copy, ValueEnum)]
enum Listed {
    Estimators,
    Drives,
    Signals,
    Params,
    Vehicles,
}

fn main() -> ExitCode {
    let outcome = match Args::parse().command {
        Command::Info { log, json } => info(&log, json),
        Command::Run { log, estimator, params, set, vehicle, out, metrics } => {
            run(&log, &estimator, params.as_deref(), &set, vehicle.as_deref(), &out, metrics.as_deref())
        }
        Command::Simulate { drive, seed, out } => simulate(&drive, seed, &out),
        Command::Bench { quick, .. } => {
            let begin = std::time::Instant::now();
            let report = drivescope_bench::bench_json(|| begin.elapsed().as_secs_f64(), quick);
            report.and_then(|text| output::print(&text))
        }
        Command::List { what, json } => output::print(&match what {
            Listed::Estimators => report::estimators(json),
            Listed::Drives => report::drives(json),
            Listed::Signals => report::signals(json),
            Listed::Params => report::params(json),
            Listed::Vehicles => report::vehicles(json),
        }),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => {
            eprintln!("drivescope: {sentence}");
            ExitCode::from(2)
        }
    }
}

fn info(log: &log::LogArgs, json: bool) -> Result<(), Sentence> {
    let opened = log.open()?;
    output::print(&if json { report::info_json(&opened) } else { report::info_text(&opened) })
}

fn run(
    log: &log::LogArgs,
    estimator: &str,
    params: Option<&std::path::Path>,
    set: &[String],
    vehicle: Option<&str>,
    out: &std::path::Path,
    metrics: Option<&std::path::Path>,
) -> Result<(), Sentence> {
    let params = parameters(params, set)?;
    let vehicle = vehicle
        .map(|name| VehicleParams::preset(name).ok_or_else(|| format!("there is no car `{name}`; see `list vehicles`")))
        .transpose()?;
    let opened = log.open()?;
    let run = run_by_name(estimator, &opened.drive, &params, vehicle.as_ref()).map_err(|e| e.to_string())?;
    output::write(out, |file| drivescope_drive::csv::write_series(run.series(), file))?;
    if let Some(path) = metrics {
        let score = score(run.series(), &opened.drive, None);
        let body = json!({
            "estimator": run.info.name, "params": run.params, "rows": run.series().len(),
            "notices": run.notices(), "score": score,
        });
        output::write(path, |file| writeln!(file, "{body:#}"))?;
    }
    for notice in run.notices() {
        let often = if notice.count == 1 { "once,".into() } else { format!("{} times, first", notice.count) };
        eprintln!("note: {} ({often} at {:.2} s)", notice.text, notice.first);
    }
    Ok(())
}

/// Values of a JSON file, overridden by `name=value` pairs.
fn parameters(file: Option<&std::path::Path>, set: &[String]) -> Result<Value, Sentence> {
    let mut values = Map::new();
    if let Some(path) = file {
        match log::json_file(path)? {
            Value::Object(map) => values = map,
            other => {
                return Err(format!("{}: expected a JSON object of names and values, found {other}", path.display()));
            }
        }
    }
    for pair in set {
        let (name, value) = pair.split_once('=').ok_or_else(|| format!("--set expects name=value, found `{pair}`"))?;
        values.insert(name.trim().into(), Value::String(value.trim().into()));
    }
    Ok(Value::Object(values))
}

fn simulate(drive: &str, seed: Option<u64>, out: &std::path::Path) -> Result<(), Sentence> {
    let spec = match drivescope_simulation::named(drive) {
        Some(spec) => spec,
        None if drive.ends_with(".json") => {
            let text = std::fs::read_to_string(drive).map_err(|e| format!("{drive}: {e}"))?;
            drivescope_simulation::DriveSpec::from_json(&text).map_err(|e| format!("{drive}: {e}"))?
        }
        None => {
            return Err(format!("there is no built-in drive `{drive}` (see `list drives`), and it is not a JSON file"));
        }
    };
    let drive = drivescope_simulation::simulate(&spec, seed).map_err(|e| e.to_string())?;
    output::write(out, |file| drivescope_drive::csv::write_drive(&drive, file))
}
