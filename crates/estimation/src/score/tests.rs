use super::change::{Measure, compare};
use super::*;
use drivescope_drive::geodesy::{Geodetic, LocalFrame};
use drivescope_drive::signals::Gnss;
use nalgebra::Vector3;

const ESTIMATE: &[Column] = &[
    Column::new("grade", "rad", "Grade.").truth("grade"),
    Column::new("grade_sigma", "rad", "Its sigma.").sigma_of("grade"),
    Column::new("yaw", "rad", "Yaw.").truth("yaw"),
    Column::new("nis", "1", "Statistic.").nis(2),
    Column::new("mode", "1", "Mode.").truth("mode"),
];

/// A drive whose truth has the named columns, from rows of time and values.
fn drive_with(names: &[&str], rows: impl Iterator<Item = (f64, Vec<f64>)>) -> Drive {
    let schema: Vec<Column> = names.iter().map(|n| *drivescope_drive::truth::truth_column(n).unwrap()).collect();
    let mut truth = Series::new(&schema);
    rows.for_each(|(t, row)| truth.push(t, &row).unwrap());
    Drive { truth, ..Drive::default() }
}

fn estimate(rows: impl Iterator<Item = (f64, [f64; 5])>) -> Series {
    let mut series = Series::new(ESTIMATE);
    rows.for_each(|(t, row)| series.push(t, &row).unwrap());
    series
}

const NAN: f64 = f64::NAN;

#[test]
fn errors_of_an_offset_and_an_alternation_have_closed_forms() {
    // Error 0.3 +- 0.4 in turn: bias 0.3, centred 0.4, rms 0.5, largest 0.7. Truth is symmetric about the alternation.
    let drive = drive_with(&["grade"], (0..400).map(|k| (k as f64 * 0.01, vec![if k % 4 < 2 { 1.0 } else { -1.0 }])));
    let alternating = |k: usize| 0.3 + [0.4, -0.4][k % 2];
    let rows = (0..400).map(|k| (k as f64 * 0.01, [drive.truth.column_at(0)[k] + alternating(k), 0.2, NAN, NAN, NAN]));
    let m = score(&estimate(rows), &drive, None).metrics[0].clone();
    for (found, expected) in [(m.rmse, 0.5), (m.bias, 0.3), (m.rmse_centred, 0.4), (m.max, 0.7)] {
        assert!((found - expected).abs() < 1e-12, "{m:?}");
    }
    // Estimate = +-1 +- 0.4, independent: correlation 1 / sqrt(1 + 0.16).
    assert!((m.correlation - 1.0 / 1.16f64.sqrt()).abs() < 1e-12);
    // |0.7| > 3 sigma = 0.6 > |-0.1|: half covered; NEES (12.25 + 0.25) / 2.
    assert_eq!(m.coverage, Some(0.5));
    assert!((m.nees.unwrap() - 6.25).abs() < 1e-12);
    assert_eq!((m.count, m.column.as_str(), m.unit.as_str()), (400, "grade", "rad"));
}

#[test]
fn headings_are_compared_the_short_way_round_and_between_truth_rows() {
    use std::f64::consts::PI;
    // Truth turns through +-pi at 0.2 rad a row; the estimate runs halfway between its rows, 0.05 rad ahead.
    let yaw = |t: f64| wrap_angle(3.0 + 2.0 * t);
    let drive = drive_with(&["yaw"], (0..100).map(|k| (k as f64 * 0.1, vec![yaw(k as f64 * 0.1)])));
    let rows = (0..99).map(|k| {
        let t = k as f64 * 0.1 + 0.05;
        (t, [NAN, NAN, wrap_angle(yaw(t) + 0.05), NAN, NAN])
    });
    let m = score(&estimate(rows), &drive, None).metrics[0].clone();
    assert!((m.rmse - 0.05).abs() < 1e-12 && (m.bias - 0.05).abs() < 1e-12 && m.correlation > 0.999_999, "{m:?}");
    // An error of pi +- 0.1 changes sign; its circular mean is pi and its spread 0.1.
    let rows = (0..98).map(|k| (k as f64 * 0.1, [NAN, NAN, yaw(k as f64 * 0.1) + PI + [0.1, -0.1][k % 2], NAN, NAN]));
    let m = score(&estimate(rows), &drive, None).metrics[0].clone();
    assert!((m.bias.abs() - PI).abs() < 1e-9 && (m.rmse_centred - 0.1).abs() < 1e-9, "{m:?}");
}

#[test]
fn truth_is_not_stretched_over_holes_ends_or_blanks() {
    let times = [0.0, 0.1, 0.2, 1.0, 1.1];
    let drive = drive_with(&["grade", "yaw"], times.iter().map(|&t| (t, vec![t, if t == 0.1 { NAN } else { 1.0 }])));
    let rows = [-0.1, 0.05, 0.1, 0.6, 1.05, 1.2].map(|t| (t, [t, NAN, 1.0, NAN, NAN]));
    let s = score(&estimate(rows.into_iter()), &drive, None);
    assert_eq!(s.metrics[0].count, 3, "0.05, 0.1 and 1.05; 0.6 is in a hole of 0.8 s, the others outside");
    assert!(s.metrics[0].rmse < 1e-15 && s.metrics[0].coverage.is_none() && s.metrics[0].nees.is_none());
    assert_eq!(s.metrics[1].count, 3, "a blank is bridged by its neighbours, 0.2 s apart");
    assert!(s.metrics[1].correlation.is_nan(), "truth is constant");
    let one = score(&estimate(rows.into_iter()), &drive, Some((0.05, 0.1)));
    assert_eq!(one.metrics[0].count, 2, "both ends of the window count");
    assert_eq!(score(&estimate(rows.into_iter()), &Drive::default(), None), Score::default(), "no truth, no metric");
}

#[test]
fn values_that_are_not_numbers_are_left_out_and_sigmas_of_zero_say_nothing() {
    let drive = drive_with(&["grade"], (0..4).map(|k| (k as f64, vec![0.0])));
    let rows = [[NAN, 1.0], [0.5, 0.0], [f64::INFINITY, 1.0], [0.5, 1.0]];
    let rows = rows.iter().enumerate().map(|(k, r)| (k as f64, [r[0], r[1], NAN, NAN, NAN]));
    let m = score(&estimate(rows), &drive, None).metrics[0].clone();
    assert_eq!((m.count, m.rmse, m.coverage, m.nees), (2, 0.5, Some(1.0), Some(0.25)));
}

/// `n` values with exactly the distribution of a chi-square variable with 2 degrees of freedom, in scrambled order.
fn chi_square_values(n: usize, factor: f64) -> Vec<f64> {
    (0..n).map(|k| -2.0 * (1.0 - ((k * 617) % n) as f64 / n as f64 - 0.5 / n as f64).ln() * factor).collect()
}

fn consistency_of(values: &[f64]) -> Consistency {
    let rows = values.iter().enumerate().map(|(k, &v)| (k as f64 * 0.1, [NAN, NAN, NAN, v, NAN]));
    score(&estimate(rows), &Drive::default(), None).consistency[0].clone()
}

#[test]
fn consistency_tells_honest_sigmas_from_small_and_large_ones() {
    let honest = consistency_of(&chi_square_values(2000, 1.0));
    assert!((honest.mean - 1.0).abs() < 2e-3 && (honest.inside - 0.95).abs() < 2e-3, "{honest:?}");
    assert_eq!((honest.verdict, honest.dof, honest.count), (Verdict::Consistent, 2, 2000));
    // Sigmas stated at half (twice) their size: four times (a quarter of) the statistic.
    let small = consistency_of(&chi_square_values(2000, 4.0));
    assert!((small.sigma_factor - 2.0).abs() < 2e-3 && small.verdict == Verdict::Optimistic, "{small:?}");
    let large = consistency_of(&chi_square_values(2000, 0.25));
    assert!((large.sigma_factor - 0.5).abs() < 1e-3 && large.verdict == Verdict::Cautious, "{large:?}");
    // Significant and unimportant: 10 % in sigma.
    let slight = consistency_of(&chi_square_values(2000, 1.21));
    assert!(slight.mean > slight.band.1 && slight.verdict == Verdict::Consistent, "{slight:?}");
    // Important and insignificant: three values.
    assert_eq!(consistency_of(&[3.9, 4.1, 4.0]).verdict, Verdict::Consistent);
}

#[test]
fn repeated_values_are_not_counted_as_independent() {
    let once = chi_square_values(500, 1.0);
    let repeated: Vec<f64> = once.iter().flat_map(|v| [*v; 9]).collect();
    let (a, b) = (consistency_of(&once), consistency_of(&repeated));
    // Correlation at lag 1 is 8/9: 4500 (1 - 8/9) / (1 + 8/9) = 265; the scrambled order is white to some 10 %.
    assert!((b.effective - 265.0).abs() < 30.0, "{b:?}");
    assert!(b.band.1 - b.band.0 > a.band.1 - a.band.0);
}

#[test]
fn bands_of_few_and_many_degrees_meet() {
    // Chi-square quantiles with 1000 degrees of freedom: 914.257 and 1089.531, to the three decimals of tables.
    let (exact, cube) = (mean_band(1000.0), mean_band(1000.0 + 1e-9));
    assert!((exact.0 - 0.914_257).abs() < 2e-6 && (exact.1 - 1.089_531).abs() < 2e-6, "{exact:?}");
    assert!((exact.0 - cube.0).abs() < 1e-5 && (exact.1 - cube.1).abs() < 1e-5);
}

#[test]
fn local_positions_are_compared_from_the_drives_own_origin() {
    // Truth's own north counts from 500 m elsewhere: using it would show an error of 500 m.
    let origin = Geodetic { lat: 0.65, lon: 2.2, alt: 40.0 };
    let frame = LocalFrame::new(origin);
    let place = |k: usize| frame.to_geodetic(&Vector3::new(3.0 * k as f64, -2.0 * k as f64, 0.5));
    let mut drive = drive_with(
        &["lat", "lon", "alt", "n", "e"],
        (0..100).map(|k| {
            let p = if k == 0 { origin } else { place(k) };
            (k as f64 * 0.1, vec![p.lat, p.lon, p.alt, 500.0, 0.0])
        }),
    );
    drive.gnss.push(0.0, Gnss { lat: 0.6501, lon: 2.2, alt: 40.0, ..Gnss::default() }).unwrap();
    let schema = [("north", "n"), ("east", "e"), ("down", "d")].map(|(n, t)| Column::new(n, "m", "Position.").truth(t));
    let mut local = Series::new(&schema);
    for k in 1..100 {
        local.push(k as f64 * 0.1, &[3.0 * k as f64 + 3.0, -2.0 * k as f64 - 4.0, 1.5]).unwrap();
    }
    let s = score(&local, &drive, None);
    let p = s.position.unwrap();
    for (found, expected) in [
        (p.rmse_horizontal, 5.0),
        (p.p95, 5.0),
        (p.median, 5.0),
        (p.max, 5.0),
        (p.last, 5.0),
        (p.rmse_vertical.unwrap(), 1.0),
    ] {
        assert!((found - expected).abs() < 1e-6, "{p:?}");
    }
    assert!((s.metrics[0].bias - 3.0).abs() < 1e-6 && (s.metrics[1].bias + 4.0).abs() < 1e-6);
    // A receiver that is local itself shares truth's local coordinates.
    drive.gnss = Default::default();
    drive.gnss.push(0.0, Gnss { north: 0.0, east: 0.0, ..Gnss::default() }).unwrap();
    assert!(
        (score(&local, &drive, None).metrics[0].bias - (mean((1..100).map(|k| 3.0 * f64::from(k) + 3.0)) - 500.0))
            .abs()
            < 1e-9
    );
}

#[test]
fn geodetic_estimates_have_a_position_error_in_metres() {
    let place = Geodetic { lat: 0.65, lon: 2.2, alt: 40.0 };
    let drive =
        drive_with(&["lat", "lon", "alt"], (0..10).map(|k| (k as f64 * 0.1, vec![place.lat, place.lon, place.alt])));
    let moved = LocalFrame::new(place).to_geodetic(&Vector3::new(3.0, 4.0, 0.0));
    let schema = ["lat", "lon"].map(|n| Column::new(n, "rad", "Place.").truth(n));
    let mut series = Series::new(&schema);
    (0..10).for_each(|k| series.push(k as f64 * 0.1, &[moved.lat, moved.lon]).unwrap());
    let p = score(&series, &drive, None).position.unwrap();
    // Radii at the ellipsoid for a place 40 m above it: 40 / 6.4e6 of 5 m.
    assert!((p.rmse_horizontal - 5.0).abs() < 5e-5 && p.rmse_vertical.is_none(), "{p:?}");
}

#[test]
fn modes_have_accuracy_confusion_and_latency() {
    // 0 for 2 s, 1 for 4 s, 2 for 4 s, 1 for 0.5 s (too short for a latency), 0 for 2 s; decisions 0.3 s late.
    let truth = |t: f64| match (t * 100.0).round() as i64 {
        ..200 => 0.0,
        200..600 => 1.0,
        600..1000 => 2.0,
        1000..1050 => 1.0,
        _ => 0.0,
    };
    let times = || (0..1250).map(|k| k as f64 * 0.01);
    let drive = drive_with(&["mode"], times().map(|t| (t, vec![truth(t)])));
    let rows = times().map(|t| (t, [NAN, NAN, NAN, NAN, truth(t - 0.3)]));
    let s = score(&estimate(rows), &drive, None);
    let m = s.mode.unwrap();
    assert!(s.metrics.is_empty(), "a code has no root mean square error");
    assert_eq!(m.confusion, [[370, 30, 0], [30, 390, 30], [0, 30, 370]], "{m:?}");
    assert_eq!((m.count, m.accuracy, m.accuracy_guarded), (1250, 1130.0 / 1250.0, 1.0));
    for latency in [m.launch, m.stop, m.corner_entry] {
        assert!(latency.count == 1 && (latency.mean - 0.3).abs() < 1e-9 && latency.max == latency.mean, "{m:?}");
    }
    assert_eq!((m.corner_exit.count, m.corner_exit.missed), (0, 0));
}

#[test]
fn a_comparison_says_better_worse_or_the_same() {
    let drive = drive_with(&["grade"], (0..100).map(|k| (k as f64, vec![(k as f64).sin()])));
    let run = |error: f64, nis: f64| {
        let rows = (0..100).map(|k| (k as f64, [(k as f64).sin() + error, 0.1, NAN, nis, NAN]));
        score(&estimate(rows), &drive, None)
    };
    let c = compare(&run(0.2, 2.0), &run(0.1, 8.0));
    let headline = c.headline.unwrap();
    assert_eq!((headline.measure, headline.column.as_str(), headline.better), (Measure::Rmse, "grade", Some(true)));
    assert!((headline.ratio - 0.5).abs() < 1e-12);
    assert_eq!(c.consistency[0].better, Some(false), "from 1 to 4 per degree of freedom");
    assert_eq!(compare(&run(0.2, 1.0), &run(0.2008, 4.0)).headline.unwrap().better, None, "0.4 % is no change");
    assert_eq!(compare(&run(0.2, 1.0), &run(0.2012, 4.0)).headline.unwrap().better, Some(false));
    assert_eq!(compare(&run(0.0, 2.0), &run(0.0, 2.0)).headline.unwrap().ratio, 1.0);
}

#[test]
fn without_truth_the_headline_is_consistency() {
    let run = |nis: f64| {
        let rows = (0..100).map(|k| (k as f64, [NAN, NAN, NAN, nis, NAN]));
        score(&estimate(rows), &Drive::default(), None)
    };
    // Per degree of freedom 4 and 0.5: factors of 4 and 2 from consistent.
    let headline = compare(&run(8.0), &run(1.0)).headline.unwrap();
    assert_eq!((headline.measure, headline.better), (Measure::Consistency, Some(true)));
    assert!((headline.before - 4.0).abs() < 1e-12 && (headline.after - 2.0).abs() < 1e-12);
    assert_eq!(compare(&Score::default(), &Score::default()).headline, None);
}

#[test]
fn the_mode_headline_is_judged_by_the_rows_that_are_wrong() {
    let drive = drive_with(&["mode"], (0..1000).map(|k| (k as f64 * 0.1, vec![1.0])));
    let run = |wrong: usize| {
        let rows = (0..1000).map(|k| (k as f64 * 0.1, [NAN, NAN, NAN, NAN, if k < wrong { 0.0 } else { 1.0 }]));
        score(&estimate(rows), &drive, None)
    };
    // 0.998 to 0.999 is 0.1 % of the accuracy and half of the errors.
    let headline = compare(&run(2), &run(1)).headline.unwrap();
    assert_eq!((headline.measure, headline.better), (Measure::ModeAccuracy, Some(true)));
    assert_eq!((headline.before, headline.after), (0.998, 0.999));
}
