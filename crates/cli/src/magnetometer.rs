//! `drivescope calibrate-magnetometer`: hard and soft iron from a drive, or the reason why not.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use drivescope_drive::drive::Drive;
use drivescope_estimation::magnetometer_calibration::{AgainstCourse, Calibration, Examination, Kind, examine};
use drivescope_estimation::orientation::{OrientationParams, reference_of};
use serde_json::json;

use crate::log::LogArgs;
use crate::output;

/// What to calibrate, and where the result goes.
#[derive(clap::Args)]
pub struct CalibrateArgs {
    #[command(flatten)]
    log: LogArgs,
    /// A second log whose GNSS is used, where the first has none; on the same clock or up to 10 s beside it.
    #[arg(long, value_name = "LOG")]
    gnss: Option<PathBuf>,
    /// Mapping of the second log.
    #[arg(long, value_name = "M.json", requires = "gnss")]
    gnss_mapping: Option<PathBuf>,
    /// Decimal year of the Earth's field, where the log has no date.
    #[arg(long, value_name = "YEAR")]
    year: Option<f64>,
    /// Latitude and longitude of the Earth's field in degrees, where the log has no place.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    place: Option<String>,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
    /// Where the calibration goes, as JSON; `run --calibration` and the page take it.
    #[arg(long, value_name = "CALIBRATION.json")]
    out: Option<PathBuf>,
}

/// Calibrate, print what was found, and write the calibration.
///
/// # Errors
/// One sentence: a log that cannot be read, one without a magnetometer, or one that does not allow a calibration.
pub fn calibrate(args: &CalibrateArgs) -> Result<(), String> {
    let mut drive = args.log.open()?.drive;
    if let Some(path) = &args.gnss {
        drive.gnss = LogArgs::of(path.clone(), args.gnss_mapping.clone()).open()?.drive.gnss;
    }
    if drive.mag.is_empty() {
        return Err(format!("{}: has no magnetometer to calibrate", drive.name));
    }
    let params = place_and_date(args)?;
    let (earth, notices) = reference_of(&drive, &params);
    for notice in notices.list() {
        eprintln!("note: {}", notice.text);
    }
    let found = examine(&drive, &earth);
    if args.json {
        output::print(&format!("{:#}", json!(found)))?;
    }
    let Some(calibration) = &found.calibration else {
        let reason = found.refusal_text.as_deref().unwrap_or("no reason is known");
        return Err(format!("{}: the magnetometer cannot be calibrated: {reason}", drive.name));
    };
    if !args.json {
        output::print(&text(&found, calibration))?;
    }
    match &args.out {
        Some(path) => output::write(path, |file| writeln!(file, "{}", calibration.to_json())),
        None => Ok(()),
    }
}

/// Why the magnetometer of a drive should be calibrated before it is believed, if it should.
pub fn warning(drive: &Drive) -> Option<String> {
    // Without a place the strength of the field is not known.
    drive.origin().filter(|_| !drive.mag.is_empty())?;
    examine(drive, &reference_of(drive, &OrientationParams::default()).0).warning
}

fn place_and_date(args: &CalibrateArgs) -> Result<OrientationParams, String> {
    let mut params = OrientationParams { field_year: args.year.unwrap_or(f64::NAN), ..OrientationParams::default() };
    if let Some(place) = &args.place {
        let degrees = place.split_once(',').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
        let (lat, lon): (f64, f64) =
            degrees.filter(|(lat, lon): &(f64, f64)| lat.abs() <= 90.0 && lon.abs() <= 180.0).ok_or_else(|| {
                format!("--place expects latitude and longitude in degrees as 36.37,127.36, found `{place}`")
            })?;
        (params.field_latitude, params.field_longitude) = (lat.to_radians(), lon.to_radians());
    }
    Ok(params)
}

fn text(found: &Examination, calibration: &Calibration) -> String {
    let q = &found.quality;
    let kind = match calibration.kind {
        Kind::Full => "all nine unknowns",
        Kind::Planar => "the five of its horizontal ellipse: the car turned on a plane",
    };
    let mut text = String::new();
    let earth = nalgebra::Vector3::from(found.earth);
    let _ = writeln!(
        text,
        "Earth's field: {:.1} uT, dip {:.1} deg, declination {:.1} deg\n{} readings, {} of them different, in {} of 12 sectors of \
         heading\nfitted: {kind}",
        earth.norm(),
        earth.z.atan2(earth.xy().norm()).to_degrees(),
        earth.y.atan2(earth.x).to_degrees(),
        q.samples,
        q.used,
        q.sectors
    );
    let [x, y, z] = calibration.offset;
    let _ = writeln!(
        text,
        "offset {x:.2}, {y:.2}, {z:.2} uT (1-sigma {:.2}); the sensor reads {:.2} to {:.2} of the Earth's field\n\
         left after the fit: {:.2} uT, {:.1} %",
        q.offset_sigma,
        q.gain[0],
        q.gain[1],
        q.residual,
        100.0 * q.residual_relative
    );
    if let Some(clock) = &found.clock {
        let _ = writeln!(
            text,
            "GNSS clock: {:.2} s behind the sensors' (1-sigma {:.2}); antenna {:.1} m ahead of the rear axle",
            clock.offset, clock.sigma, clock.lever
        );
    }
    for (name, against) in [("raw", &found.before), ("calibrated", &found.after)] {
        if let Some(a) = against {
            let _ = writeln!(text, "{}", against_course(name, a));
        }
    }
    if let Some(warning) = &found.warning {
        let _ = writeln!(text, "{warning}");
    }
    text
}

fn against_course(name: &str, a: &AgainstCourse) -> String {
    let mut text = format!(
        "{name} heading against GNSS course: {:.1} deg RMS once the mount's yaw of {:.1} deg is taken off, consistency {:.3}\n  \
         by sector of course from north, deg RMS:",
        a.rms.to_degrees(),
        a.mount_yaw.to_degrees(),
        a.consistency.plain
    );
    for sector in &a.sectors {
        let _ = if sector.points > 0 { write!(text, " {:.1}", sector.rms.to_degrees()) } else { write!(text, " -") };
    }
    text
}

/// Correct a drive's magnetometer with a saved calibration.
///
/// # Errors
/// One sentence naming the file.
pub fn apply(path: &Path, drive: &mut Drive) -> Result<(), String> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|e| format!("{name}: could not be read: {e}"))?;
    Calibration::from_json(&text, &name)?.apply(drive).map_err(|e| format!("{name}: {e}"))
}
