//! `drivescope`: the same core as the page, on the command line.

mod closed_loop;
mod corrections;
mod log;
mod magnetometer;
mod output;
mod papers;
mod part;
mod profile;
mod report;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use drivescope_drive::channel::Series;
use drivescope_drive::vehicle::VehicleParams;
use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::labels::Labels;
use drivescope_estimation::score::mode::ModeScore;
use drivescope_estimation::score::score;
use serde_json::{Map, Value, json};

/// Takes memory in large pages: the system's allocator spends a third of the time in which a CSV file is read on page faults.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

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
        /// Write the mapping with the corrections of all contradictions, for `--mapping`, and say what was applied and left.
        #[arg(long, value_name = "M.json")]
        save_mapping: Option<PathBuf>,
        /// Apply what is likely too: how housings lean, how late sensors are.
        #[arg(long, requires = "save_mapping")]
        with_guesses: bool,
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
        /// A magnetometer calibration to correct the log with, from `calibrate-magnetometer`.
        #[arg(long, value_name = "CALIBRATION.json")]
        calibration: Option<PathBuf>,
        /// Where the estimates go, as CSV.
        #[arg(long, value_name = "OUT.csv")]
        out: PathBuf,
        /// Where scores, consistency and notices go, as JSON.
        #[arg(long, value_name = "OUT.json")]
        metrics: Option<PathBuf>,
        /// Motion modes painted by hand, JSON or CSV: the metrics hold the mode against them.
        #[arg(long, value_name = "LABELS", requires = "metrics")]
        labels: Option<PathBuf>,
    },
    /// Grade and altitude of a road against distance: from one log, or from several passes over the same road, merged.
    Profile(profile::ProfileArgs),
    /// Find a magnetometer's hard and soft iron from a drive, or say why the drive does not allow it.
    CalibrateMagnetometer(magnetometer::CalibrateArgs),
    /// Simulate a built-in drive, or one described in a JSON file, and write it as a log with its truth.
    Simulate {
        /// Name of a built-in drive, or a JSON file.
        drive: String,
        /// Seed of all random numbers; the drive's own without it.
        #[arg(long)]
        seed: Option<u64>,
        /// One value of the drive's JSON, `path=value`; may be given again.
        #[arg(long = "set", value_name = "PATH=VALUE")]
        set: Vec<String>,
        /// Where the log goes, as CSV.
        #[arg(long, value_name = "LOG.csv")]
        out: PathBuf,
        /// Where the ranges of single satellites go, as CSV, for drives that have them.
        #[arg(long, value_name = "FILE")]
        gnss_raw: Option<PathBuf>,
    },
    /// Let controllers drive a car and write down what it did: `drivescope list loops` shows what there is.
    ClosedLoop(closed_loop::Args),
    /// Try what the papers claim, on drives simulated here, and print the numbers and the verdicts.
    Papers {
        /// A chapter (`orientation`) or one claim (`orientation/static_vectors`); all of them without it.
        id: Option<String>,
        /// Print JSON instead of text.
        #[arg(long)]
        json: bool,
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
    Loops,
}

fn main() -> ExitCode {
    let outcome = match Args::parse().command {
        Command::Info { log, json, save_mapping, with_guesses } => {
            info(&log, json, save_mapping.as_deref().map(|path| (path, with_guesses)))
        }
        Command::Run { log, estimator, params, set, vehicle, calibration, out, metrics, labels } => {
            let (calibration, labels) = (calibration.as_deref(), labels.as_deref());
            let metrics = metrics.as_deref().map(|path| (path, labels));
            run(&log, &estimator, params.as_deref(), &set, vehicle.as_deref(), calibration, &out, metrics)
        }
        Command::Simulate { drive, seed, set, out, gnss_raw } => {
            simulate(&drive, seed, &set, &out, gnss_raw.as_deref())
        }
        Command::Profile(args) => profile::profile(&args),
        Command::CalibrateMagnetometer(args) => magnetometer::calibrate(&args),
        Command::ClosedLoop(args) => closed_loop::run(&args),
        Command::Papers { id, json } => papers::papers(id.as_deref(), json).and_then(|text| output::print(&text)),
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
            Listed::Loops => closed_loop::list(json),
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

/// Say what a log holds; with a path, write its mapping there, put right.
fn info(log: &log::LogArgs, json: bool, save: Option<(&std::path::Path, bool)>) -> Result<(), Sentence> {
    let opened = if save.is_some() { log.open_examined()? } else { log.open()? };
    if let Some(warning) = magnetometer::warning(&opened.drive) {
        eprintln!("note: {warning}");
    }
    output::print(&if json { report::info_json(&opened) } else { report::info_text(&opened) })?;
    let Some((path, guesses)) = save else { return Ok(()) };
    let said = corrections::save(log, &opened.report, path, guesses)?;
    if json {
        eprint!("{said}");
        return Ok(());
    }
    output::print(&said)
}

#[allow(clippy::too_many_arguments)]
fn run(
    log: &log::LogArgs,
    estimator: &str,
    params: Option<&std::path::Path>,
    set: &[String],
    vehicle: Option<&str>,
    calibration: Option<&std::path::Path>,
    out: &std::path::Path,
    metrics: Option<(&std::path::Path, Option<&std::path::Path>)>,
) -> Result<(), Sentence> {
    let params = parameters(params, set)?;
    let vehicle = vehicle
        .map(|name| VehicleParams::preset(name).ok_or_else(|| format!("there is no car `{name}`; see `list vehicles`")))
        .transpose()?;
    let mut opened = log.open()?;
    if let Some(path) = calibration {
        magnetometer::apply(path, &mut opened.drive)?;
    }
    let run = run_by_name(estimator, &opened.drive, &params, vehicle.as_ref()).map_err(|e| e.to_string())?;
    output::write(out, |file| drivescope_drive::csv::write_series(run.series(), file))?;
    if let Some((path, labels)) = metrics {
        let mut score = score(run.series(), &opened.drive, None);
        if let Some(file) = labels {
            score.mode = against_labels(file, run.series())?;
        }
        let body = json!({
            "estimator": run.info.name, "params": run.params, "rows": run.series().len(),
            "notices": run.notices(), "score": score,
        });
        output::write(path, |file| writeln!(file, "{body:#}"))?;
    }
    if estimator == "slope" {
        profile::remark(&opened.drive);
    }
    for notice in run.notices() {
        let often = if notice.count == 1 { "once,".into() } else { format!("{} times, first", notice.count) };
        eprintln!("note: {} ({often} at {:.2} s)", notice.text, notice.first);
    }
    Ok(())
}

/// The decided mode against labels painted by hand.
fn against_labels(file: &std::path::Path, series: &Series) -> Result<Option<ModeScore>, Sentence> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let labels = Labels::from_text(&text).map_err(|e| format!("{}: {e}", file.display()))?;
    if !series.has("mode") {
        return Err(format!(
            "{}: the estimator decides no motion mode that labels could be held against",
            file.display()
        ));
    }
    Ok(labels.score_series(series, "mode"))
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
    values.extend(pairs(set)?);
    Ok(Value::Object(values))
}

/// Names and values of `name=value` pairs.
fn pairs(set: &[String]) -> Result<Vec<(String, Value)>, Sentence> {
    set.iter()
        .map(|pair| {
            let (name, value) =
                pair.split_once('=').ok_or_else(|| format!("--set expects name=value, found `{pair}`"))?;
            Ok((name.trim().into(), Value::String(value.trim().into())))
        })
        .collect()
}

fn simulate(
    drive: &str,
    seed: Option<u64>,
    set: &[String],
    out: &std::path::Path,
    gnss_raw: Option<&std::path::Path>,
) -> Result<(), Sentence> {
    let built_in = drivescope_simulation::drives().iter().find(|d| d.name == drive);
    let text = match built_in {
        Some(built_in) => built_in.json().to_owned(),
        None if drive.ends_with(".json") => std::fs::read_to_string(drive).map_err(|e| format!("{drive}: {e}"))?,
        None => {
            return Err(format!("there is no built-in drive `{drive}` (see `list drives`), and it is not a JSON file"));
        }
    };
    let spec = drivescope_simulation::DriveSpec::from_json_with(&text, set).map_err(|e| format!("{drive}: {e}"))?;
    if gnss_raw.is_some() && !spec.has_satellites() {
        return Err(format!(
            "--gnss-raw: the receiver of `{}` gives fixes only; its drive needs `satellites`",
            spec.name
        ));
    }
    let drive = drivescope_simulation::simulate(&spec, seed).map_err(|e| e.to_string())?;
    output::write(out, |file| drivescope_drive::csv::write_drive(&drive, file))?;
    match gnss_raw {
        Some(path) => output::write(path, |file| drivescope_drive::csv::write_raw_gnss(&drive.raw_gnss, file)),
        None => Ok(()),
    }
}
