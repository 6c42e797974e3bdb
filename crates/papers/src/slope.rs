//! Road slope and motion of a car from wheel speeds and accelerometers: Kim, Kim & Lee 2014.

use crate::attempt::PaperError;
use crate::claim::{Claim, Measure, Paper, Source, Trial};
use crate::evidence::Evidence;
use crate::figure::Figure;

const CLIMB: Source = Source::named("uphill15_gearshift");
const FLAT: Source = Source::named("flat_accel_brake");
const SLOPES: Source = Source::named("slope_speedbump");
const HILLS: Source = Source::named("city_hills");

/// The paper's filter: no rear-axle aid, no barometer, no satellites.
const PAPERS_OWN: &str = r#"{"rear_axle_aid": false, "use_baro": false, "use_gnss": false}"#;
const LATE: &str = r#"{"rear_axle_aid": false, "use_baro": false, "use_gnss": false, "wheel_latency": 0.1}"#;
const SINGLE: &str = r#"{"filter": "single"}"#;

/// The chapter.
pub const PAPER: Paper = Paper {
    id: "slope",
    authors: "Kim, Kim & Lee 2014",
    title: "Vehicle Dynamics and Road Slope Estimation based on Cascade Extended Kalman Filter",
    setting: "The paper drives a real car whose logs it does not print and names neither noise nor tuning. Here: simulated \
              drives of the same course, automotive sensors, one tuning for all, uphill positive, and the equations corrected \
              where the print does not hold.",
    claims: &[
        Claim {
            id: "climb",
            place: "case 1",
            says: "On a road of 15 deg the slope is found, and found again after a gear shift takes the torque away.",
            remark: "Within a second of the road's bend and of the shift the slope is off by some degrees: the body pitches and the \
                     filter follows with its lag.",
            trials: &[trial("climb", CLIMB, PAPERS_OWN)],
            measure: Measure::Runs(climb),
        },
        Claim {
            id: "flat",
            place: "case 2",
            says: "On a flat road hard driving shows as a slope of up to 0.1 rad, because the body pitches.",
            remark: "Squat and dive alone give a third of that. The rest is timing: a braked wheel's slip makes its speed change early, \
                     a wheel speed that is late makes it change late, and either adds delay times jerk over gravity, which does not \
                     follow the body.",
            trials: &[trial("flat", FLAT, PAPERS_OWN), trial("flat, inertial sensor held back 0.1 s", FLAT, LATE)],
            measure: Measure::Runs(flat),
        },
        Claim {
            id: "table_3",
            place: "table 3",
            says: "The estimated longitudinal acceleration has less noise than the measured one: smaller deviation and extremes.",
            remark: "The order is that of the paper; the numbers are another drive's. What is removed is noise alone: how much \
                     depends on the sensor, and a slower force model removes more for more lag of the slope.",
            trials: &[trial("slopes", SLOPES, PAPERS_OWN)],
            measure: Measure::Runs(table_3),
        },
        Claim {
            id: "correlation",
            place: "results",
            says: "The slope correlates by 84 per cent with the pitch of a reference sensor.",
            remark: "On slopes the grade is most of the pitch and the correlation is far higher; on a flat road and on gentle hills \
                     body motion and timing count as much, and it is lower. In bends the paper's lateral speed drifts into the \
                     slope; that the rear axle does not slide holds it. Which road the paper's number is from cannot be told.",
            trials: &[
                trial("slopes", SLOPES, PAPERS_OWN),
                trial("flat", FLAT, PAPERS_OWN),
                trial("hills", HILLS, PAPERS_OWN),
                trial("hills, rear axle held", HILLS, ""),
            ],
            measure: Measure::Runs(correlation),
        },
        Claim {
            id: "one_filter_cannot",
            place: "introduction",
            says: "One filter cannot estimate forces and slope together, so that a cascade is needed.",
            remark: "Speed and forward specific force are both measured: the seven states are observable, and one filter gives the same \
                     slope. The cascade is a convenience.",
            trials: &[trial("slopes, cascade", SLOPES, ""), trial("slopes, one filter", SLOPES, SINGLE)],
            measure: Measure::Runs(one_filter_cannot),
        },
        Claim {
            id: "pitch_apart",
            place: "future work",
            says: "The pitch of the body can be taken off the slope, so that the grade of the road is left.",
            remark: "A model of squat and dive does it where they come from driving; a bump's pitch it does not know.",
            trials: &[trial("flat", FLAT, ""), trial("hills", HILLS, ""), trial("climb", CLIMB, "")],
            measure: Measure::Runs(pitch_apart),
        },
    ],
};

const fn trial(name: &'static str, source: Source, params: &'static str) -> Trial {
    Trial::new(name, source, "slope", params)
}

fn missing(what: &str) -> PaperError {
    PaperError::Missing(what.into())
}

/// A column of a trial after the first second and, beside it, a truth signal at the same rows, where both have a value.
fn pairs(e: &Evidence, trial: &str, column: &str, signal: &str) -> Result<Vec<(f64, f64)>, PaperError> {
    let (_, series) = e.run(trial)?;
    let values = series.column(column).ok_or_else(|| missing(column))?;
    let truth = e.truth(trial, signal)?;
    let start = series.time().first().copied().unwrap_or(0.0) + 1.0;
    let rows = series.time().iter().zip(values).zip(truth).filter(|((t, _), _)| **t >= start);
    Ok(rows.map(|((_, v), truth)| (*v, truth)).filter(|(v, truth)| v.is_finite() && truth.is_finite()).collect())
}

/// Pearson's correlation.
fn correlate(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let (a, b) = pairs.iter().fold((0.0, 0.0), |(a, b), p| (a + p.0 / n, b + p.1 / n));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        aa += (x - a) * (x - a);
        bb += (y - b) * (y - b);
        ab += (x - a) * (y - b);
    }
    ab / (aa * bb).sqrt()
}

/// Standard deviation, least and largest value.
fn spread(values: &[f64]) -> [f64; 3] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    let ends = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    [deviation, ends.0, ends.1]
}

fn climb(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let (_, series) = e.run("climb")?;
    let truth = e.truth("climb", "grade")?;
    let steep: Vec<usize> = (0..truth.len()).filter(|&k| truth[k] > 14.9f64.to_radians()).collect();
    let time = series.time();
    let (Some(&first), Some(&last)) = (steep.first(), steep.last()) else { return Err(missing("15 deg of grade")) };
    let (start, end) = (time[first], time[last]);
    let slope = series.column("slope").ok_or_else(|| missing("slope"))?;
    let mean = |from: f64, to: f64| {
        let range = time.partition_point(|&t| t < from)..time.partition_point(|&t| t <= to);
        (slope[range.clone()].iter().sum::<f64>() / range.len() as f64).to_degrees()
    };
    let errors = e.errors("climb", "slope")?.within(start + 1.0, end);
    Ok(vec![
        Figure::between("slope 2 to 4 s after the bend, on 15 deg", "deg", mean(start + 2.0, start + 4.0), 14.0, 17.0)
            .claimed(15.0),
        Figure::between("slope in the last 2 s on the climb", "deg", mean(end - 2.0, end), 14.0, 17.0).claimed(15.0),
        Figure::shown("largest error against the body's pitch on the climb", "deg", errors.largest().to_degrees()),
    ])
}

fn flat(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let peak = |trial: &str| -> Result<f64, PaperError> {
        let pairs = pairs(e, trial, "slope", "grade")?;
        Ok(pairs.iter().map(|(slope, _)| slope.abs()).fold(0.0, f64::max))
    };
    let with_pitch = correlate(&pairs(e, "flat", "slope", "body_pitch")?);
    Ok(vec![
        Figure::between("largest slope on a flat road", "rad", peak("flat")?, 0.05, 0.15).claimed(0.1),
        Figure::at_least("correlation of the slope with the body's pitch", "1", with_pitch, 0.8),
        Figure::shown(
            "largest slope with 0.1 s between wheels and sensor",
            "rad",
            peak("flat, inertial sensor held back 0.1 s")?,
        ),
    ])
}

fn table_3(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let (drive, series) = e.run("slopes")?;
    let start = series.time().first().copied().unwrap_or(0.0) + 1.0;
    let measured: Vec<f64> =
        (drive.imu.iter()).filter(|(t, s)| *t >= start && s.accel_x.is_finite()).map(|(_, s)| s.accel_x).collect();
    let column = |name: &str| -> Result<Vec<f64>, PaperError> {
        let values = series.column(name).ok_or_else(|| missing(name))?;
        let rows = series.time().iter().zip(values).filter(|(t, v)| **t >= start && v.is_finite());
        Ok(rows.map(|(_, v)| *v).collect())
    };
    let (measured, estimated) = (spread(&measured), spread(&column("accel_x_estimated")?));
    let net = spread(&column("accel_x_net")?);
    let named = |what: &str, which: &str| [what, " of the acceleration, ", which].concat();
    let unit = "m/s^2";
    let [deviation, least, largest] = ["standard deviation", "minimum", "maximum"];
    Ok(vec![
        Figure::shown(named(deviation, "measured"), unit, measured[0]).claimed(0.77166),
        Figure::at_most(named(deviation, "estimated"), unit, estimated[0], measured[0]).claimed(0.73598),
        Figure::shown(named(deviation, "net"), unit, net[0]),
        Figure::shown(named(least, "measured"), unit, measured[1]).claimed(-2.10),
        Figure::at_least(named(least, "estimated"), unit, estimated[1], measured[1]).claimed(-1.63),
        Figure::shown(named(least, "net"), unit, net[1]),
        Figure::shown(named(largest, "measured"), unit, measured[2]).claimed(2.34),
        Figure::at_most(named(largest, "estimated"), unit, estimated[2], measured[2]).claimed(1.89),
        Figure::shown(named(largest, "net"), unit, net[2]),
    ])
}

fn correlation(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let with_pitch = |trial: &str| Ok::<f64, PaperError>(correlate(&pairs(e, trial, "slope", "pitch")?));
    Ok(vec![
        Figure::at_least("correlation of the slope with the pitch, slopes", "1", with_pitch("slopes")?, 0.84)
            .claimed(0.84),
        Figure::at_least("the same, flat road", "1", with_pitch("flat")?, 0.84).claimed(0.84),
        Figure::at_least("the same, hills", "1", with_pitch("hills")?, 0.84).claimed(0.84),
        Figure::shown("the same, hills, rear axle held", "1", with_pitch("hills, rear axle held")?),
        Figure::shown(
            "correlation of the slope with the road's grade, hills",
            "1",
            correlate(&pairs(e, "hills", "slope", "grade")?),
        ),
    ])
}

fn one_filter_cannot(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let of = |trial: &str| Ok::<f64, PaperError>(correlate(&pairs(e, trial, "slope", "pitch")?));
    let (cascade, single) = (of("slopes, cascade")?, of("slopes, one filter")?);
    Ok(vec![
        Figure::shown("correlation of the slope with the pitch, cascade", "1", cascade),
        // For the claim: one filter loses more than a tenth of what the cascade explains.
        Figure::at_most("the same, one filter of seven states", "1", single, 0.9 * cascade),
    ])
}

fn pitch_apart(e: &Evidence) -> Result<Vec<Figure>, PaperError> {
    let mut figures = Vec::new();
    for name in ["flat", "hills", "climb"] {
        let rms = |column: &str| -> Result<f64, PaperError> {
            let pairs = pairs(e, name, column, "grade")?;
            Ok((pairs.iter().map(|(v, g)| (v - g).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt().to_degrees())
        };
        let slope = rms("slope")?;
        figures.push(Figure::at_most(["RMS error of the grade, ", name].concat(), "deg", rms("grade")?, 0.8 * slope));
        figures.push(Figure::shown(["RMS error of the slope as grade, ", name].concat(), "deg", slope));
    }
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlation_and_spread_are_those_of_the_textbook() {
        let line: Vec<(f64, f64)> = (0..10).map(|k| (f64::from(k), 3.0 - 2.0 * f64::from(k))).collect();
        assert!((correlate(&line) + 1.0).abs() < 1e-12);
        let [deviation, least, largest] = spread(&[1.0, 3.0, 1.0, 3.0]);
        assert_eq!([deviation, least, largest], [1.0, 1.0, 3.0]);
    }
}
