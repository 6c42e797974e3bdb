//! `drivescope profile`: a road's grade and altitude against distance, and what a drive says of its own sensors.

use std::path::PathBuf;

use drivescope_drive::drive::Drive;
use drivescope_drive::param::Params;
use drivescope_drive::vehicle::VehicleParams;
use drivescope_estimation::latency::{WheelLatency, find_wheel_latency, with_earlier_wheels};
use drivescope_estimation::levelling::{ForwardOffset, find_forward_offset};
use drivescope_estimation::road_profile::{ProfileError, RoadProfile, SPACING, write_csv, write_geojson};
use drivescope_estimation::slope::SlopeParams;
use drivescope_estimation::slope::two_way::run_two_way;

use crate::log::LogArgs;
use crate::output;

/// Which logs, and where the profile goes.
#[derive(clap::Args)]
pub struct ProfileArgs {
    /// The passes, the first one's distance counts; columns are proposed for each.
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// Where the profile goes: `.geojson` (or `.json`) for maps, else CSV.
    #[arg(long, value_name = "ROAD.csv|ROAD.geojson")]
    out: PathBuf,
    /// Distance between points, m.
    #[arg(long, default_value_t = SPACING)]
    spacing: f64,
    /// Name of the car, whose pitch on its springs is taken off; the specification's without it.
    #[arg(long)]
    vehicle: Option<String>,
    /// One parameter of the estimator `slope`, `name=value`; may be given again.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Bring late wheel speeds to their time and take off the accelerometer's offset, where the drive itself tells them.
    #[arg(long)]
    correct: bool,
}

fn notable(drive: &Drive) -> Option<WheelLatency> {
    find_wheel_latency(drive).filter(WheelLatency::is_notable)
}

/// Say what the drive tells of a late wheel speed, and what would correct it.
pub fn remark(drive: &Drive) {
    if let Some(l) = notable(drive) {
        eprintln!(
            "note: the wheel speed comes {:.0} ms (1 sigma: {:.0} ms) after the accelerometer, which makes a false slope of \
             {:.1} deg per 10 m/s^3 of jerk; correct it with --set wheel_latency={:.2}",
            1e3 * l.delay,
            1e3 * l.sigma,
            (10.0 * l.delay / 9.80665f64).to_degrees(),
            l.delay
        );
    }
}

/// Write the profile of one pass, or of several merged.
///
/// # Errors
/// One sentence.
pub fn profile(args: &ProfileArgs) -> Result<(), String> {
    let vehicle = args.vehicle.as_ref().map(|name| {
        VehicleParams::preset(name).ok_or_else(|| format!("there is no car `{name}`; see `list vehicles`"))
    });
    let vehicle = vehicle.transpose()?;
    let mut params = SlopeParams::default();
    if let Some(vehicle) = &vehicle {
        params = params.with_pitch_of(vehicle);
    }
    for (name, value) in crate::pairs(&args.set)? {
        params.set(&name, &value).map_err(|e| e.to_string())?;
    }
    if !(0.1..=1000.0).contains(&args.spacing) {
        return Err(format!("--spacing expects 0.1 to 1000 m, found {}", args.spacing));
    }
    let passes: Vec<RoadProfile> =
        args.logs.iter().map(|log| pass(log, args, &params, vehicle.as_ref())).collect::<Result<_, _>>()?;
    let merged = RoadProfile::merged(&passes).map_err(|e| match e {
        ProfileError::Apart(pass) => format!("{}: {e}", args.logs[pass - 1].display()),
        _ => e.to_string(),
    })?;
    let is_map = args.out.extension().is_some_and(|e| e == "geojson" || e == "json");
    output::write(&args.out, |file| if is_map { write_geojson(&merged, file) } else { write_csv(&merged, file) })
}

fn pass(
    log: &std::path::Path,
    args: &ProfileArgs,
    params: &SlopeParams,
    vehicle: Option<&VehicleParams>,
) -> Result<RoadProfile, String> {
    let named = |e: &dyn std::fmt::Display| format!("{}: {e}", log.display());
    let mut drive = LogArgs::of(log.to_path_buf(), None).open()?.drive;
    let mut params = params.clone();
    if args.correct {
        if let Some(latency) = notable(&drive) {
            eprintln!("note: {}: wheel speeds moved by {:.0} ms", log.display(), 1e3 * latency.delay);
            drive = with_earlier_wheels(&drive, latency.delay).map_err(|e| named(&e))?;
        }
        if let Some(found) = find_forward_offset(&drive).filter(ForwardOffset::is_notable) {
            eprintln!("note: {}: forward accelerometer less {:.3} m/s^2", log.display(), found.offset);
            params.accel_offset = found.offset.clamp(-3.0, 3.0);
        }
    } else {
        remark(&drive);
    }
    let estimate = run_two_way(&drive, &params, vehicle).map_err(|e| named(&e))?;
    RoadProfile::of_pass(&estimate, &drive, args.spacing).map_err(|e| named(&e))
}
