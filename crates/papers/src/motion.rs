//! Motion modes and a land navigation system aided by them: Lee et al. 2010.

use drivescope_drive::channel::Series;
use drivescope_drive::drive::Drive;
use drivescope_drive::select::midpoint;
use drivescope_estimation::score::mode::ModeScore;
use drivescope_estimation::score::score;

use crate::attempt::PaperError;
use crate::claim::{Claim, Measure, Paper, Source, Trial};
use crate::evidence::Evidence;
use crate::figure::Figure;

/// The chapter.
pub const PAPER: Paper = Paper {
    id: "motion",
    authors: "Lee et al. 2010",
    title: "Motion mode recognition and a land navigation system with low-cost sensors",
    setting: "The paper gives no window, threshold, rate or sensor data and no figure of accuracy in its section 5, only pictures. \
              Here: a saloon with automotive sensors on a drive with two corners, one tuning for all runs, nothing but inertial \
              sensors unless a run says otherwise, and the equations corrected where the print does not hold.",
    claims: &[
        Claim {
            id: "modes",
            place: "section 5, two-corner drive",
            says: "Rest, straight and corner of a drive with two corners are told from accelerometers and gyros alone.",
            remark: "The limits are those of the specification's own drives. After a stop the body rocks on its springs, and the \
                     window of a second has to forget that: by the paper's statistics and tables a stop is told more than a \
                     second late here, and a very gentle launch is taken back. The same sensors tell both in time once a body \
                     that has settled counts as resting and the speed gained since the last rest as motion.",
            trials: &[
                mode("two corners", Source::named("u_drive"), ALONE),
                mode("five stops", Source::named("stop_and_go"), ALONE),
                mode(
                    RULES_ALONE,
                    Source::named("stop_and_go"),
                    r#"{"use_speed": false, "settling": false, "launch_speed": 0}"#,
                ),
                mode("two corners, with wheels", Source::named("u_drive"), ""),
                mode("five stops, with wheels", Source::named("stop_and_go"), ""),
            ],
            measure: Measure::Runs(modes),
        },
        Claim {
            id: "launch",
            place: "section 4, equation (8)",
            says: "The step of the forward acceleration finds the launch without the delay of the long window.",
            remark: "Without it the launch waits until jerk and sway fill the window of a second and stay there for the escape time.",
            trials: &[
                mode("with the step", Source::named("u_drive"), r#"{"use_speed": false, "adaptive": false}"#),
                mode(
                    "without it",
                    Source::named("u_drive"),
                    r#"{"use_speed": false, "adaptive": false, "fd_threshold": 1.0, "escape_time": 0.02}"#,
                ),
            ],
            measure: Measure::Runs(launch),
        },
        Claim {
            id: "rates",
            place: "section 3, figure 6",
            says: "With one yaw gyro and the zero rates of the motion mode, six accelerometers give body rates that do not drift.",
            remark: "Plain integration of the angular accelerations drifts with their biases. On roll and pitch the filter is held \
                     near zero, where these rates of a car are; what it removes there is the drift.",
            trials: &[
                disk("filter", ""),
                disk("without the gyro", r#"{"use_gyro": false}"#),
                disk("without zero rates", r#"{"zero_reference": false}"#),
            ],
            measure: Measure::Runs(rates),
        },
        Claim {
            id: "navigation",
            place: "section 5.1",
            says: "Aided by its motion modes an inertial navigator errs far less than alone.",
            remark: "The constraint against motion sideways and zero velocity at rest do nearly all; along a straight the error \
                     still grows, and the next corner takes it back.",
            trials: &[
                plain("plain 300", 300),
                aided("modes 300", 300),
                plain("plain 301", 301),
                aided("modes 301", 301),
                plain("plain 302", 302),
                aided("modes 302", 302),
                plain("plain 303", 303),
                aided("modes 303", 303),
                plain("plain 304", 304),
                aided("modes 304", 304),
                plain("plain 305", 305),
                aided("modes 305", 305),
                plain("plain 306", 306),
                aided("modes 306", 306),
                plain("plain 307", 307),
                aided("modes 307", 307),
            ],
            measure: Measure::Runs(navigation),
        },
        Claim {
            id: "disk_navigation",
            place: "section 5.1, with the six-accelerometer sensor",
            says: "The same holds for the navigator with six accelerometers and one gyro.",
            remark: "The rates of the disk are held by the motion mode already, also where the navigator itself uses no mode: its \
                     plain run is good, so that the modes gain less here and can lose.",
            trials: &[
                land("plain", Source::named("u_drive_disk"), PLAIN),
                land("modes", Source::named("u_drive_disk"), MODES),
            ],
            measure: Measure::Runs(disk_navigation),
        },
        Claim {
            id: "satellites",
            place: "section 6, future work",
            says: "Combined with satellites, the six-accelerometer sensor navigates through their outages.",
            remark: "The paper leaves this to the future. Between fixes the modes hold what the sensor alone would lose.",
            trials: &[
                land(
                    "satellites alone",
                    OUTAGE,
                    r#"{"gnss": true, "zupt": false, "zaru": false, "nhc": false, "straight": false}"#,
                ),
                land("satellites and modes", OUTAGE, r#"{"gnss": true}"#),
            ],
            measure: Measure::Runs(satellites),
        },
    ],
};

const ALONE: &str = r#"{"use_speed": false}"#;
const PLAIN: &str =
    r#"{"zupt": false, "zaru": false, "nhc": false, "straight": false, "use_speed": false, "initial_yaw": 0}"#;
const MODES: &str = r#"{"use_speed": false, "initial_yaw": 0}"#;
const OUTAGE: Source = Source::named("u_drive_disk").changed(r#"{"gnss_outages": [{"start": 30, "duration": 30}]}"#);
const SEEDS: [u64; 8] = [300, 301, 302, 303, 304, 305, 306, 307];

/// The trial without what is added to the tables beyond hysteresis and escape.
const RULES_ALONE: &str = "five stops, the tables alone";

const fn mode(name: &'static str, source: Source, params: &'static str) -> Trial {
    Trial::new(name, source, "motion_mode", params)
}
const fn disk(name: &'static str, params: &'static str) -> Trial {
    Trial::new(name, Source::named("u_drive_disk"), "gyro_free", params)
}
const fn land(name: &'static str, source: Source, params: &'static str) -> Trial {
    Trial::new(name, source, "land_ins", params)
}
const fn plain(name: &'static str, seed: u64) -> Trial {
    land(name, Source::named("u_drive").seeded(seed), PLAIN)
}
const fn aided(name: &'static str, seed: u64) -> Trial {
    land(name, Source::named("u_drive").seeded(seed), MODES)
}

fn mode_score(e: &Evidence, trial: &str) -> Result<ModeScore, PaperError> {
    let (drive, series) = e.run(trial)?;
    score(series, drive, None).mode.ok_or_else(|| PaperError::Missing(["modes of ", trial].concat()))
}

fn modes(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let mut figures = Vec::new();
    for trial in ["two corners", "five stops", "two corners, with wheels", "five stops, with wheels"] {
        let m = mode_score(e, trial)?;
        let name = |what: &str| [what, ", ", trial].concat();
        figures.extend([
            Figure::at_least(name("rows with the right mode"), "%", 100.0 * m.accuracy, 95.0),
            Figure::at_least(name("outside 0.6 s of a change"), "%", 100.0 * m.accuracy_guarded, 98.0),
            Figure::at_most(name("longest delay of a launch"), "s", m.launch.max, 1.0),
            Figure::at_most(name("longest delay of a stop"), "s", m.stop.max, 1.2),
            Figure::at_most(name("longest delay into a corner"), "s", m.corner_entry.max, 0.6),
            Figure::shown(name("longest delay out of a corner"), "s", m.corner_exit.max),
        ]);
    }
    let rules = mode_score(e, RULES_ALONE)?;
    let name = |what: &str| [what, ", ", RULES_ALONE].concat();
    figures.push(Figure::shown(name("rows with the right mode"), "%", 100.0 * rules.accuracy));
    figures.push(Figure::shown(name("longest delay of a stop"), "s", rules.stop.max));
    Ok(figures)
}

fn launch(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let (with, without) = (mode_score(e, "with the step")?.launch, mode_score(e, "without it")?.launch);
    Ok(vec![
        Figure::at_most("delay of the launch with the step", "s", with.mean, 0.3),
        Figure::shown("delay of the launch without it", "s", without.mean),
        Figure::at_least("what the step saves", "s", without.mean - with.mean, 0.2),
    ])
}

fn rates(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let mut figures = Vec::new();
    for axis in ["x", "y", "z"] {
        let (rate, plain) = (["rate_", axis].concat(), ["plain_rate_", axis].concat());
        let filter = e.errors("filter", &rate)?;
        let integrated = e.errors("filter", &plain)?;
        let last = |errors: &crate::evidence::Errors| errors.0.last().map_or(f64::NAN, |(_, e)| e.abs());
        figures.extend([
            Figure::at_most(["RMS error of the rate, axis ", axis].concat(), "rad/s", filter.rms(), 0.012),
            Figure::at_most(["error at the end, axis ", axis].concat(), "rad/s", last(&filter), 0.012),
            Figure::shown(["RMS error by plain integration, axis ", axis].concat(), "rad/s", integrated.rms()),
            Figure::shown(["error at the end by plain integration, axis ", axis].concat(), "rad/s", last(&integrated)),
            Figure::at_most(
                ["filter over plain integration, axis ", axis].concat(),
                "1",
                filter.rms() / integrated.rms(),
                0.5,
            ),
        ]);
    }
    let yaw = |trial: &str| e.errors(trial, "rate_z").map(|errors| errors.rms());
    figures.push(Figure::at_least(
        "yaw rate without the gyro over with it",
        "1",
        yaw("without the gyro")? / yaw("filter")?,
        2.0,
    ));
    let roll = |trial: &str| e.errors(trial, "rate_x").map(|errors| errors.rms());
    figures.push(Figure::at_least(
        "roll rate without zero rates over with them",
        "1",
        roll("without zero rates")? / roll("filter")?,
        2.0,
    ));
    Ok(figures)
}

/// Root mean square horizontal distance from the truth, m.
fn horizontal((drive, series): (&Drive, &Series)) -> f64 {
    score(series, drive, None).position.map_or(f64::NAN, |p| p.rmse_horizontal)
}

fn navigation(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let errors = |kind: &str| -> Result<Vec<f64>, PaperError> {
        SEEDS.iter().map(|seed| Ok(horizontal(e.run(&[kind, " ", &seed.to_string()].concat())?))).collect()
    };
    let (mut plain, mut modes) = (errors("plain")?, errors("modes")?);
    let best_plain = plain.iter().copied().fold(f64::INFINITY, f64::min);
    let worst_modes = modes.iter().copied().fold(0.0, f64::max);
    let (plain, modes) = (midpoint(&mut plain), midpoint(&mut modes));
    Ok(vec![
        Figure::shown("RMS position error of plain navigation, median of eight", "m", plain),
        Figure::shown("the same, best of eight", "m", best_plain),
        Figure::shown("RMS position error with modes, median of eight", "m", modes),
        Figure::shown("the same, worst of eight", "m", worst_modes),
        Figure::at_most("with modes over plain, medians", "1", modes / plain, 0.25),
    ])
}

fn disk_navigation(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let (plain, modes) = (horizontal(e.run("plain")?), horizontal(e.run("modes")?));
    Ok(vec![
        Figure::shown("RMS position error of plain navigation", "m", plain),
        Figure::at_most("RMS position error with modes", "m", modes, 50.0),
        Figure::at_most("with modes over plain", "1", modes / plain, 0.25),
    ])
}

fn satellites(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let alone = horizontal(e.run("satellites alone")?);
    let modes = horizontal(e.run("satellites and modes")?);
    Ok(vec![
        Figure::shown("RMS position error with satellites alone, outage of 30 s", "m", alone),
        Figure::at_most("RMS position error with satellites and modes", "m", modes, 10.0),
        Figure::at_most("with modes over without", "1", modes / alone, 0.5),
    ])
}
