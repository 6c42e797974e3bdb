//! The built-in drive is an honest demonstration: a parked car stands still, and a filter whose innovations are not as
//! large as it says has a sentence that tells why. A failure means that the first thing an expert sees is wrong.
#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_estimation::registry::{ESTIMATORS, run_by_name};
use drivescope_estimation::score::{Verdict, score};
use serde_json::Value;

fn built_in() -> Drive {
    let name = drivescope_simulation::drives()[0].name;
    drivescope_simulation::simulate(&drivescope_simulation::named(name).unwrap(), None).unwrap()
}

#[test]
fn a_level_parked_car_shows_level_and_a_heading_that_does_not_move() {
    let drive = built_in();
    let mode = drive.truth.column("mode").unwrap();
    let start = mode.iter().position(|m| *m != 0.0).unwrap();
    let parked = drive.truth.time()[start] - 0.5;
    assert!(parked > 15.0, "the drive begins with a stand of {parked} s");
    // A filter that learns the bias of its gyro meanwhile, here 0.14 deg/s, must not turn by more than that in a second, nor by more
    // than a fifth of the sigma it states, 1.2 deg.
    for (name, largest) in [("orientation", 0.14), ("gnss_ins", 0.1)] {
        let run = run_by_name(name, &drive, &Value::Null, None).unwrap();
        let series = run.series();
        let rows = 0..series.time().partition_point(|&t| t < parked);
        let column = |c: &str| -> Vec<f64> {
            series.column(c).unwrap()[rows.clone()].iter().copied().filter(|v| v.is_finite()).collect()
        };
        for angle in ["roll", "pitch"] {
            let worst = column(angle).iter().fold(0.0f64, |a, v| a.max(v.abs())).to_degrees();
            assert!(worst < 0.3, "{name}: {angle} reads {worst:.3} deg");
        }
        // Heading: the mean of the last quarter against that of the first.
        let yaw = column("yaw");
        if yaw.is_empty() {
            continue; // the navigation filter does not know its heading before it moves, and says so
        }
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let quarter = yaw.len() / 4;
        let moved = (mean(&yaw[yaw.len() - quarter..]) - mean(&yaw[..quarter])).to_degrees();
        assert!(moved.abs() < largest, "{name}: the heading of a parked car moves by {moved:.3} deg");
        let sigma = column("yaw_sigma");
        assert!(moved.abs() < 0.2 * sigma[sigma.len() - 1].to_degrees(), "{name}: {moved:.3} deg is more than stated");
    }
}

#[test]
fn innovations_are_as_large_as_stated_or_the_page_says_why_not() {
    let drive = built_in();
    for estimator in ESTIMATORS.iter().filter(|e| e.can_run(&drive)) {
        let run = run_by_name(estimator.name, &drive, &Value::Null, None).unwrap();
        for c in score(run.series(), &drive, None).consistency {
            let doc = estimator.columns.iter().find(|column| column.name == c.column).unwrap().doc;
            let explains = match c.verdict {
                Verdict::Consistent => true,
                Verdict::Cautious => doc.contains("elow 1"),
                Verdict::Optimistic => doc.contains("above 1") || doc.contains("Above 1"),
            };
            assert!(
                explains,
                "{} {}: mean NIS {:.2} per degree, and its sentence is: {doc}",
                estimator.name, c.column, c.mean
            );
        }
    }
}
