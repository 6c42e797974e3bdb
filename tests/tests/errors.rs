//! The errors of a run as curves.
#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_estimation::registry::run_by_name;
use drivescope_estimation::score::errors::errors;
use drivescope_estimation::score::score;
use drivescope_simulation::{Simulation, named};
use serde_json::Value;

/// Catches a wrong sign, a sigma that lost its column, and curves that are not the errors of the score.
#[test]
fn curves_of_errors_have_the_root_mean_squares_of_the_score() {
    let spec = named("dlc80_flat").unwrap();
    let mut simulation = Simulation::new(&spec, None).unwrap();
    while !simulation.advance(10.0) {}
    let drive = simulation.finish();
    let run = run_by_name("gnss_ins", &drive, &Value::Null, None).unwrap().into_series();
    let curves = errors(&run, &drive).unwrap();
    let score = score(&run, &drive, None);
    assert!(score.metrics.len() > 10);
    for metric in &score.metrics {
        let values = curves.column(&metric.column).unwrap().iter().copied().filter(|v| v.is_finite());
        let (count, squares) = values.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v * v));
        let rms = f64::sqrt(squares / count);
        assert!((rms - metric.rmse).abs() <= 1e-9 * (1.0 + metric.rmse), "{}: {rms} {}", metric.column, metric.rmse);
    }
    let (row, yaw) = (run.len() / 2, run.index_of("yaw").unwrap());
    let truth = drive.truth.interpolate(drive.truth.index_of("yaw").unwrap(), run.time()[row], 0.5);
    assert!(
        (curves.column("yaw").unwrap()[row] - (run.column_at(yaw)[row] - truth)).abs() < 1e-9,
        "estimate less truth"
    );
    assert_eq!(curves.column("yaw_sigma"), run.column("yaw_sigma"));
    assert!(errors(&run, &Drive::default()).is_none(), "without a truth there are no errors");
}
