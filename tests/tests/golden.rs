//! Golden histories: what every estimator makes of the built-in drive, every ten seconds, as it was when last reviewed.
//! A failure means that behaviour changed. If that was meant, `cargo xtask golden-update` rewrites the files and the
//! difference goes into the commit.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use drivescope_drive::channel::Series;
use drivescope_drive::csv::write_series;
use drivescope_drive::frames::wrap_angle;
use drivescope_estimation::registry::{ESTIMATORS, run_by_name};
use drivescope_tests::{rows_at, table};
use serde_json::Value;

/// Rows kept: one in this many seconds.
const PERIOD: f64 = 10.0;

/// Another machine's mathematical functions differ in the last bit, and a run of a minute's worth of steps amplifies that
/// by far less than this.
const RELATIVE: f64 = 1e-9;

fn thinned(series: &Series) -> Series {
    let mut out = Series::new(series.schema());
    let mut due = f64::NEG_INFINITY;
    for (row, &time) in series.time().iter().enumerate() {
        if time >= due {
            let values: Vec<f64> = (0..series.schema().len()).map(|c| series.column_at(c)[row]).collect();
            out.push(time, &values).unwrap();
            due = time + PERIOD;
        }
    }
    out
}

#[test]
fn the_built_in_drive_is_estimated_as_it_was() {
    let name = drivescope_simulation::drives()[0].name;
    let drive = drivescope_simulation::simulate(&drivescope_simulation::named(name).unwrap(), None).unwrap();
    for estimator in ESTIMATORS.iter().filter(|e| e.can_run(&drive)) {
        let run = run_by_name(estimator.name, &drive, &Value::Null, None).unwrap();
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("golden/{}.csv", estimator.name));
        if std::env::var_os("DRIVESCOPE_GOLDEN_UPDATE").is_some() {
            let mut text = Vec::new();
            write_series(&thinned(run.series()), &mut text).unwrap();
            std::fs::write(&path, text).unwrap();
            continue;
        }
        let golden = table(&path);
        let rows = rows_at(run.series(), &golden["t"]);
        assert!(rows.len() > 50, "{} has {} rows", path.display(), rows.len());
        for (index, column) in run.series().schema().iter().enumerate() {
            let values = run.series().column_at(index);
            let scale =
                golden[column.name].iter().copied().filter(|v| v.is_finite()).fold(0.0, |a: f64, b| a.max(b.abs()));
            for (&row, &was) in rows.iter().zip(&golden[column.name]) {
                let now = values[row];
                let difference = if column.unit == "rad" { wrap_angle(now - was) } else { now - was };
                let same = now.is_nan() && was.is_nan() || difference.abs() <= RELATIVE * scale.max(1e-3);
                assert!(
                    same,
                    "{} {} at {} s: was {was}, is {now}",
                    estimator.name,
                    column.name,
                    run.series().time()[row]
                );
            }
        }
    }
}
