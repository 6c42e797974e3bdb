//! The parts of the GNSS/INS filter, and its smoother.

use drivescope_drive::drive::Drive;
use drivescope_drive::frames::body_to_nav;
use drivescope_drive::geodesy::Geodetic;
use drivescope_estimation::gnss_ins::filter::Filter;
use drivescope_estimation::gnss_ins::{GnssInsParams, Tuning, measurement};
use drivescope_estimation::ins::{GravityModel, Navigation};
use drivescope_estimation::registry::run_by_name;
use nalgebra::Vector3;
use serde_json::json;

use crate::{Entry, timed};

/// Steps timed together: a browser's clock counts in milliseconds.
const STEPS: usize = 20_000;

fn filter(tuning: &Tuning) -> Filter {
    let navigation = Navigation {
        place: Geodetic { lat: 0.63, lon: 2.2, alt: 40.0 },
        velocity: Vector3::new(12.0, -7.0, 0.1),
        body_to_nav: body_to_nav(0.01, -0.02, -0.53),
    };
    Filter::new(navigation, Vector3::zeros(), tuning.initial_covariance(0.01, 0.09), GravityModel::Wgs84)
}

/// Inertial samples, ten to a node, as a car that turns gently gives them.
fn predict(filter: &mut Filter, tuning: &Tuning) -> Result<(), String> {
    for k in 0..STEPS {
        let wave = if k % 40 < 20 { 0.01 } else { -0.01 };
        let (accel, gyro) = (Vector3::new(10.0 * wave, 0.05, -9.79), Vector3::new(wave, 0.001, wave));
        filter.predict(&accel, &gyro, 0.01, 1.0, tuning).map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// Positions and velocities as they are indicated: every update is accepted.
fn update(filter: &mut Filter, tuning: &Tuning, is_position: bool) {
    for _ in 0..STEPS {
        let navigation = filter.state.navigation;
        let prediction = if is_position {
            measurement::position(&navigation, &filter.earth(), &tuning.antenna, &navigation.place)
        } else {
            measurement::velocity(&navigation, &tuning.antenna, &filter.rate, &navigation.velocity)
        };
        filter.update(&prediction, &Vector3::new(1.0, 1.0, 2.0), tuning);
    }
}

/// Prediction, updates, and a drive with and without the second pass.
pub fn entries(clock: &impl Fn() -> f64, drive: &Drive, rounds: usize) -> Result<Vec<Entry>, String> {
    let tuning = Tuning::new(&GnssInsParams::default(), None);
    let mut parts = [Vec::new(), Vec::new(), Vec::new()];
    let mut whole = [Vec::new(), Vec::new()];
    for _ in 0..rounds {
        let mut filter = filter(&tuning);
        let (time, outcome) = timed(clock, || predict(&mut filter, &tuning));
        outcome?;
        parts[0].push(time);
        parts[1].push(timed(clock, || update(&mut filter, &tuning, true)).0);
        parts[2].push(timed(clock, || update(&mut filter, &tuning, false)).0);
        for (samples, smoother) in whole.iter_mut().zip(["off", "rts"]) {
            let params = json!({ "smoother": smoother });
            let (time, run) = timed(clock, || run_by_name("gnss_ins", drive, &params, None));
            run.map_err(|e| e.to_string())?;
            samples.push(time);
        }
    }
    let names = ["gnss_ins prediction", "gnss_ins position update", "gnss_ins velocity update"];
    let parts = names.iter().zip(parts).map(|(name, samples)| Entry {
        name: (*name).into(),
        unit: "ns",
        samples: samples.into_iter().map(|s| s * 1e9 / STEPS as f64).collect(),
    });
    let names = ["gnss_ins over ten minutes", "gnss_ins over ten minutes, smoothed"];
    let whole = names.iter().zip(whole).map(|(name, samples)| Entry { name: (*name).into(), unit: "s", samples });
    Ok(parts.chain(whole).collect())
}
