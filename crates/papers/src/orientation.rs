//! Roll, pitch and yaw from a magnetometer and the sensors of stability control: Hwang & Choi 2016.

use crate::attempt::PaperError;
use crate::claim::{Claim, Measure, Paper, Source, Trial};
use crate::evidence::{Errors, Evidence};
use crate::figure::Figure;

/// The chapter.
pub const PAPER: Paper = Paper {
    id: "orientation",
    authors: "Hwang & Choi 2016",
    title: "Vehicle Orientation Estimation by Using Magnetometer and Inertial Sensors",
    setting: "The paper names neither car nor noise nor tuning. Here: a BMW 320i, sensors of stability control with noise, bias \
              and latency, one tuning for all drives, and the equations corrected where the print does not hold.",
    claims: &[Claim {
        id: "static_vectors",
        place: "section 4, cases 1 and 2",
        says: "The static solution alone fails while the car turns and is good on a banked straight road.",
        remark: "The lateral accelerometer is taken for gravity: in a turn it feels the turn, on the bank it feels the bank.",
        trials: &[
            trial("lane change", Source::named("dlc80_flat"), r#"{"variant": "triad"}"#),
            trial("bank", Source::named("bank20_80"), r#"{"variant": "triad"}"#),
        ],
        measure: Measure::Runs(static_vectors),
    }],
};

const fn trial(name: &'static str, source: Source, params: &'static str) -> Trial {
    Trial::new(name, source, "orientation", params)
}

/// Errors from 2 s on, when every variant has settled.
fn settled(evidence: &Evidence, trial: &str, column: &str) -> Result<Errors, PaperError> {
    Ok(evidence.errors(trial, column)?.when(|t| t >= 2.0))
}

fn static_vectors(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let turning = settled(e, "lane change", "yaw")?;
    let banked = settled(e, "bank", "yaw")?;
    Ok(vec![
        Figure::at_least("RMS error of yaw, lane change", "deg", turning.rms().to_degrees(), 5.0),
        Figure::at_least("largest error of yaw, lane change", "deg", turning.largest().to_degrees(), 20.0),
        Figure::at_most("RMS error of yaw, bank", "deg", banked.rms().to_degrees(), 1.5),
        Figure::at_most("RMS error of roll, bank", "deg", settled(e, "bank", "roll")?.rms().to_degrees(), 1.0),
    ])
}
