//! Roll, pitch and yaw from a magnetometer and the sensors of stability control: Hwang & Choi 2016, section 4 and 5.

use crate::attempt::PaperError;
use crate::claim::{Claim, Measure, Paper, Source, Trial};
use crate::evidence::{Errors, Evidence};
use crate::figure::Figure;

const LANE_CHANGE: Source = Source::named("dlc80_flat");
const BANK: Source = Source::named("bank20_80");
const HILL: Source = Source::named("hill80");
const MOUNTAIN: Source = Source::named("mountain120");
const STEEL: Source = Source::named("truss_bridge");
const STEEL_AWAY: Source = STEEL.changed(r#"{"faults": []}"#);

const TRIAD: &str = r#"{"variant": "triad"}"#;
const MODEL: &str = r#"{"variant": "model"}"#;
const WITHOUT: &str = r#"{"variant": "ekf_nomodel"}"#;
const WITH: &str = r#"{"variant": "ekf_model"}"#;
const SWITCH: &str = r#"{"variant": "switch"}"#;
const ROBUST: &str = r#"{"variant": "robust"}"#;

/// The chapter.
pub const PAPER: Paper = Paper {
    id: "orientation",
    authors: "Hwang & Choi 2016",
    title: "Vehicle Orientation Estimation by Using Magnetometer and Inertial Sensors",
    setting: "The paper names neither car nor noise nor tuning, and prints no errors. Here: a BMW 320i, sensors of stability \
              control with noise, bias and latency, one tuning for all drives, and the equations corrected where the print \
              does not hold.",
    claims: &[
        Claim {
            id: "static_vectors",
            place: "section 4, cases 1 and 2",
            says: "The static solution alone fails while the car turns and is accurate where it does not, even on a bank.",
            remark: "The lateral accelerometer is taken for gravity: in a turn it feels the turn, on the bank it feels the bank.",
            trials: &[trial("lane change", LANE_CHANGE, TRIAD), trial("bank", BANK, TRIAD)],
            measure: Measure::Runs(static_vectors),
        },
        Claim {
            id: "suspension_model",
            place: "section 4, cases 1 to 3",
            says: "The roll and pitch model alone is accurate on the flat and does not show the slope of the road.",
            remark: "Springs answer to the specific force against the road; where the road leans they know nothing of it. Yaw is \
                     the gyro's alone and drifts with its bias.",
            trials: &[trial("lane change", LANE_CHANGE, MODEL), trial("bank", BANK, MODEL), trial("hill", HILL, MODEL)],
            measure: Measure::Runs(suspension_model),
        },
        Claim {
            id: "model_steadies_yaw",
            place: "section 4, figures 6, 7 and 9",
            says: "Without the roll and pitch model the filter's yaw keeps a steady error after lateral motion, and the model removes it.",
            remark: "The field leaves the turn about itself free, and noise and bias walk along it: with ideal sensors nothing is \
                     left of the manoeuvre even without the model. The springs fix that turn where the road is level; on a bank or \
                     a slope they fix it wrongly.",
            trials: &[
                trial("lane change 1, without", LANE_CHANGE, WITHOUT),
                trial("lane change 2, without", LANE_CHANGE.seeded(2), WITHOUT),
                trial("lane change 3, without", LANE_CHANGE.seeded(3), WITHOUT),
                trial("lane change 4, without", LANE_CHANGE.seeded(4), WITHOUT),
                trial("lane change 1, with", LANE_CHANGE, WITH),
                trial("lane change 2, with", LANE_CHANGE.seeded(2), WITH),
                trial("lane change 3, with", LANE_CHANGE.seeded(3), WITH),
                trial("lane change 4, with", LANE_CHANGE.seeded(4), WITH),
                trial("lane change, ideal sensors, without", LANE_CHANGE.changed(r#"{"sensors": "ideal"}"#), WITHOUT),
                trial("bank, without", BANK, WITHOUT),
                trial("bank, with", BANK, WITH),
                trial("mountain, without", MOUNTAIN, WITHOUT),
                trial("mountain, with", MOUNTAIN, WITH),
            ],
            measure: Measure::Runs(model_steadies_yaw),
        },
        Claim {
            id: "integrated",
            place: "section 4, all cases",
            says: "The integrated estimator follows the attitude in all cases and its steady error goes to zero.",
            remark: "Straight driving at constant speed counts as static on a hill too, and the static solution takes every road \
                     for one without grade; after the hill the error is gone.",
            trials: &[
                trial("lane change", LANE_CHANGE, SWITCH),
                trial("bank", BANK, SWITCH),
                trial("hill", HILL, SWITCH),
                trial("mountain", MOUNTAIN, SWITCH),
                trial("hill, robust", HILL, ROBUST),
                trial("mountain, robust", MOUNTAIN, ROBUST),
            ],
            measure: Measure::Runs(integrated),
        },
        Claim {
            id: "compound_slopes",
            place: "section 5, case 4",
            says: "On compound slopes driven fast the integrated estimator is more robust than what was there before.",
            remark: "On a slope both halves of the estimator assume what is not so: the springs a level road, the static solution \
                     one without grade.",
            trials: &[
                trial("mountain, switch", MOUNTAIN, SWITCH),
                trial("mountain, without model", MOUNTAIN, WITHOUT),
                trial("mountain, model alone", MOUNTAIN, MODEL),
                trial("mountain, robust", MOUNTAIN, ROBUST),
            ],
            measure: Measure::Runs(compound_slopes),
        },
        Claim {
            id: "bank_too_small",
            place: "section 5, limitation",
            says: "On a bank the springs take the road's angle for their own deflection, so that the bank is read too small.",
            remark: "More process noise on the angles does not help: the turn about the field is given by the springs alone. With \
                     the bank as a state of its own what is left is the accelerometer's bias over g.",
            trials: &[
                trial("bank", BANK, WITH),
                trial(
                    "bank, loose springs",
                    BANK,
                    r#"{"variant": "ekf_model", "roll_walk": 0.52, "pitch_walk": 0.52}"#,
                ),
                trial("bank, robust", BANK, ROBUST),
                trial("bank, robust, ideal inertial sensor", BANK.changed(r#"{"parts": {"imu": "ideal"}}"#), ROBUST),
            ],
            measure: Measure::Runs(bank_too_small),
        },
        Claim {
            id: "local_field",
            place: "section 5, future work",
            says: "Because it uses the magnetic field, the estimator suffers from terrain and structures around it.",
            remark: "Steel on the way moves the field by as much as the Earth's own. A gate on strength, dip and innovation keeps \
                     most of it out.",
            trials: &[
                trial("steel, switch", STEEL, SWITCH),
                trial("no steel, switch", STEEL_AWAY, SWITCH),
                trial("steel, road", STEEL, r#"{"variant": "road"}"#),
                trial("steel, robust", STEEL, ROBUST),
            ],
            measure: Measure::Runs(local_field),
        },
        Claim {
            id: "little_tuning",
            place: "section 5, conclusion",
            says: "Sensors that cars have and a simple model suffice, and another car needs little change of parameters.",
            remark: "Tried on the flat with the tuning unchanged: a tall van assumed with its springs and masses, and a phone's sensors in place of \
                     the car's. What the phone leaves uncalibrated in its magnetometer goes into the yaw.",
            trials: &[
                trial("right car", LANE_CHANGE, WITH),
                trial("a van assumed", LANE_CHANGE, WITH).assuming("vw_vanagon"),
                trial("phone", LANE_CHANGE.changed(r#"{"sensors": "phone"}"#), WITH),
            ],
            measure: Measure::Runs(little_tuning),
        },
    ],
};

const fn trial(name: &'static str, source: Source, params: &'static str) -> Trial {
    Trial::new(name, source, "orientation", params)
}

/// Errors from 2 s on, when every variant has settled.
fn settled(e: &Evidence, trial: &str, column: &str) -> Result<Errors, PaperError> {
    Ok(e.errors(trial, column)?.when(|t| t >= 2.0))
}

fn rms(e: &Evidence, trial: &str, column: &str) -> Result<f64, PaperError> {
    Ok(settled(e, trial, column)?.rms().to_degrees())
}

/// Mean error, deg, where a truth signal is beyond a limit, rad.
fn mean_beyond(e: &Evidence, trial: &str, column: &str, signal: &str, limit: f64) -> Result<f64, PaperError> {
    let truth = e.truth(trial, signal)?;
    let (_, series) = e.run(trial)?;
    let beyond: Vec<f64> = series.time().iter().zip(truth).filter(|(_, v)| *v > limit).map(|(t, _)| *t).collect();
    let (Some(first), Some(last)) = (beyond.first(), beyond.last()) else {
        return Err(PaperError::Missing(["truth beyond the limit: ", signal].concat()));
    };
    // The filters have settled on the road's new angle after a third of it.
    Ok(e.errors(trial, column)?.within(first + (last - first) / 3.0, *last).mean().to_degrees())
}

fn on_bank(e: &Evidence, trial: &str, column: &str) -> Result<f64, PaperError> {
    mean_beyond(e, trial, column, "bank", 0.34)
}

fn on_climb(e: &Evidence, trial: &str, column: &str) -> Result<f64, PaperError> {
    mean_beyond(e, trial, column, "grade", 0.13)
}

/// Mean error after the lane change, before the car brakes.
fn after_lane_change(e: &Evidence, trial: &str, column: &str) -> Result<f64, PaperError> {
    Ok(e.errors(trial, column)?.within(20.0, 35.0).mean().to_degrees())
}

fn static_vectors(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let turning = settled(e, "lane change", "yaw")?;
    Ok(vec![
        Figure::at_least("RMS error of yaw, lane change", "deg", turning.rms().to_degrees(), 5.0),
        Figure::at_least("largest error of yaw, lane change", "deg", turning.largest().to_degrees(), 20.0),
        Figure::at_most("RMS error of roll, bank", "deg", rms(e, "bank", "roll")?, 1.0),
        Figure::at_most("RMS error of yaw, bank", "deg", rms(e, "bank", "yaw")?, 2.0),
    ])
}

fn suspension_model(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    Ok(vec![
        Figure::at_most("RMS error of roll, lane change", "deg", rms(e, "lane change", "roll")?, 0.5),
        Figure::at_most("RMS error of pitch, lane change", "deg", rms(e, "lane change", "pitch")?, 0.5),
        Figure::at_most("steady error of roll on 20 deg of bank", "deg", on_bank(e, "bank", "roll")?, -15.0),
        Figure::at_most("steady error of pitch on 8 deg of grade", "deg", on_climb(e, "hill", "pitch")?, -6.0),
        Figure::shown("steady error of yaw after the lane change", "deg", after_lane_change(e, "lane change", "yaw")?),
    ])
}

fn model_steadies_yaw(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let lane = |filter: &str| {
        let mut squares = 0.0;
        for run in ["1", "2", "3", "4"] {
            squares += after_lane_change(e, &["lane change ", run, ", ", filter].concat(), "yaw")?.powi(2);
        }
        Ok::<f64, PaperError>((squares / 4.0).sqrt())
    };
    let (lane_without, lane_with) = (lane("without")?, lane("with")?);
    let ideal = after_lane_change(e, "lane change, ideal sensors, without", "yaw")?.abs();
    let bank = |trial| Ok::<f64, PaperError>(on_bank(e, trial, "yaw")?.abs());
    let (bank_without, bank_with) = (bank("bank, without")?, bank("bank, with")?);
    let (mountain_without, mountain_with) = (rms(e, "mountain, without", "yaw")?, rms(e, "mountain, with", "yaw")?);
    Ok(vec![
        Figure::at_least("steady error of yaw after the lane change, RMS of four, without", "deg", lane_without, 0.5),
        Figure::at_most("the same, with", "deg", lane_with, 0.5 * lane_without),
        Figure::shown("the same with ideal sensors, without", "deg", ideal),
        Figure::shown("steady error of yaw on the bank, without", "deg", bank_without),
        Figure::at_most("steady error of yaw on the bank, with", "deg", bank_with, 0.5 * bank_without),
        Figure::shown("RMS error of yaw, mountain, without", "deg", mountain_without),
        Figure::at_most("RMS error of yaw, mountain, with", "deg", mountain_with, mountain_without),
    ])
}

fn integrated(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let flat = after_lane_change(e, "lane change", "yaw")?.abs();
    let climb = on_climb(e, "hill", "yaw")?.abs();
    let after = e.errors("hill", "yaw")?.within(28.0, 32.0).mean().to_degrees().abs();
    Ok(vec![
        Figure::at_most("steady error of yaw after the lane change", "deg", flat, 1.5),
        Figure::at_most("steady error of yaw on the bank", "deg", on_bank(e, "bank", "yaw")?.abs(), 1.5),
        Figure::at_most("steady error of yaw on the climb", "deg", climb, 1.5),
        Figure::at_most("steady error of yaw after the hill", "deg", after, 1.5),
        Figure::at_most("RMS error of yaw, mountain", "deg", rms(e, "mountain", "yaw")?, 1.5),
        Figure::shown("steady error of yaw on the climb, robust", "deg", on_climb(e, "hill, robust", "yaw")?.abs()),
        Figure::shown("RMS error of yaw, mountain, robust", "deg", rms(e, "mountain, robust", "yaw")?),
    ])
}

fn compound_slopes(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let mut figures = Vec::new();
    for angle in ["roll", "pitch", "yaw"] {
        let of = |trial: &str| rms(e, ["mountain, ", trial].concat().as_str(), angle);
        let limit = of("without model")?;
        let name = |variant: &str| ["RMS error of ", angle, ", ", variant].concat();
        figures.push(Figure::at_most(name("switch"), "deg", of("switch")?, limit));
        figures.push(Figure::shown(name("filter without model"), "deg", limit));
        figures.push(Figure::shown(name("model alone"), "deg", of("model alone")?));
        figures.push(Figure::shown(name("robust"), "deg", of("robust")?));
    }
    Ok(figures)
}

fn bank_too_small(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    Ok(vec![
        Figure::at_most("steady error of roll on 20 deg of bank", "deg", on_bank(e, "bank", "roll")?, -5.0),
        Figure::at_most(
            "the same with 15 times the process noise",
            "deg",
            on_bank(e, "bank, loose springs", "roll")?,
            -5.0,
        ),
        Figure::shown("the same, robust", "deg", on_bank(e, "bank, robust", "roll")?),
        Figure::shown(
            "the same, robust, ideal inertial sensor",
            "deg",
            on_bank(e, "bank, robust, ideal inertial sensor", "roll")?,
        ),
    ])
}

fn local_field(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let away = rms(e, "no steel, switch", "yaw")?;
    Ok(vec![
        Figure::at_least("RMS error of yaw, switch", "deg", rms(e, "steel, switch", "yaw")?, 2.0 * away),
        Figure::shown("the same drive without steel", "deg", away),
        Figure::shown("RMS error of yaw, road states without gate", "deg", rms(e, "steel, road", "yaw")?),
        Figure::shown("RMS error of yaw, robust", "deg", rms(e, "steel, robust", "yaw")?),
    ])
}

fn little_tuning(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let (roll, yaw) = (rms(e, "right car", "roll")?, rms(e, "right car", "yaw")?);
    Ok(vec![
        Figure::shown("RMS error of roll, right car", "deg", roll),
        Figure::at_most("RMS error of roll, a van assumed", "deg", rms(e, "a van assumed", "roll")?, 1.0),
        Figure::shown("RMS error of yaw, right car", "deg", yaw),
        Figure::at_most("RMS error of yaw, a van assumed", "deg", rms(e, "a van assumed", "yaw")?, 1.5),
        Figure::at_most("RMS error of roll, phone", "deg", rms(e, "phone", "roll")?, 1.0),
        Figure::at_most("RMS error of yaw, phone", "deg", rms(e, "phone", "yaw")?, 1.5),
    ])
}
