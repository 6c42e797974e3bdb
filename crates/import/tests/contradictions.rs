//! Contradictions between columns and their names are said with numbers when a log is opened, and the correction that
//! comes with each puts it right. One drive, written down by its definition; each test spoils one thing.

#![allow(clippy::unwrap_used)]

use drivescope_drive::drive::Drive;
use drivescope_import::{Finding, IoSource, OpenReport, Weight, open_csv};

/// One instant, SI, forward-right-down.
#[derive(Clone, Copy)]
struct Sample {
    t: f64,
    /// Signed.
    speed: f64,
    accel: [f64; 3],
    gyro: [f64; 3],
    mag: [f64; 3],
    lat: f64,
    lon: f64,
    alt: f64,
}

/// Two minutes at 50 Hz: speed and yaw rate as waves that do not go together; with `backwards`, short stretches to and
/// fro with standstills between them.
fn drive(backwards: bool) -> Vec<Sample> {
    let (mut heading, mut lat, mut lon) = (0.4_f64, 42.3_f64.to_radians(), -71.1_f64.to_radians());
    let step = 0.02;
    let mut out = Vec::new();
    for k in 0..6000 {
        let t = f64::from(k) * step;
        let (speed, change) = if backwards {
            // Eight seconds to, eight seconds fro, with two seconds of standing after each.
            let (phase, there) = (t % 10.0, if ((t / 10.0) as u32).is_multiple_of(2) { 1.0 } else { -1.0 });
            let wave = std::f64::consts::PI / 8.0;
            let moves = phase < 8.0;
            let v = if moves { 1.5 * (1.0 - (2.0 * wave * phase).cos()) } else { 0.0 };
            let a = if moves { 3.0 * wave * (2.0 * wave * phase).sin() } else { 0.0 };
            (there * v, there * a)
        } else {
            (12.0 + 5.0 * (0.35 * t).sin(), 1.75 * (0.35 * t).cos())
        };
        let rate = 0.3 * (0.23 * t).sin() * (speed / 12.0).clamp(-1.0, 1.0);
        let shake = 0.1 * (173.0 * t).sin() + 0.05 * (311.0 * t).cos();
        let (s, c) = f64::sin_cos(heading);
        out.push(Sample {
            t,
            speed,
            accel: [change + shake, speed * rate + shake, -9.80665 + shake],
            gyro: [0.002 * shake, 0.001 * shake, rate],
            mag: [20.0 * c, -20.0 * s, 45.0],
            lat,
            lon,
            alt: 30.0 + 0.5 * (0.05 * t).sin(),
        });
        heading += rate * step;
        lat += speed * heading.cos() * step / 6.3690e6;
        lon += speed * heading.sin() * step / (6.3878e6 * lat.cos());
    }
    out
}

/// Open what `row` writes of each sample; fixes come once a second.
fn open_with(samples: &[Sample], header: &str, row: &dyn Fn(&Sample) -> Vec<f64>) -> (Drive, OpenReport, String) {
    let names: Vec<&str> = header.split(',').collect();
    let is_fix = |name: &str| ["lat", "lon", "alt", "gnss", "course"].iter().any(|p| name.starts_with(p));
    let mut text = format!("{header}\n");
    for (k, sample) in samples.iter().enumerate() {
        let cells: Vec<String> = (row(sample).iter().zip(&names))
            .map(|(v, name)| if k % 50 != 0 && is_fix(name) { String::new() } else { v.to_string() })
            .collect();
        text.push_str(&format!("{}\n", cells.join(",")));
    }
    let (drive, report) = open_csv(&mut IoSource::new(text.as_bytes(), None), "x.csv", None).unwrap();
    report.findings.iter().for_each(|f| println!("{:?}: {}", f.weight, f.text));
    (drive, report, text)
}

fn open(header: &str, row: impl Fn(&Sample) -> Vec<f64>) -> (Drive, OpenReport, String) {
    open_with(&drive(false), header, &row)
}

fn find<'r>(report: &'r OpenReport, words: &[&str]) -> &'r Finding {
    let found = report.findings.iter().find(|f| words.iter().all(|w| f.text.contains(w)));
    let texts: Vec<&String> = report.findings.iter().map(|f| &f.text).collect();
    found.unwrap_or_else(|| panic!("expected {words:?} in {texts:#?}"))
}

/// The same text under the mapping with a finding's correction.
fn corrected(report: &OpenReport, finding: &Finding, text: &str) -> Drive {
    let mut mapping = report.mapping.clone();
    mapping.correct(finding.correction.as_ref().expect("a correction"));
    open_csv(&mut IoSource::new(text.as_bytes(), None), "x.csv", Some(&mapping)).unwrap().0
}

fn error(drive: &Drive, name: &str, truth: impl Fn(&Sample) -> f64) -> f64 {
    let (series, index) = drive.column(name).expect("the signal exists");
    let samples = self::drive(false);
    let stride = if series.len() < 200 { 50 } else { 1 };
    let samples = samples.iter().step_by(stride);
    samples.zip(series.column_at(index)).map(|(s, v)| (v - truth(s)).abs()).fold(0.0, f64::max)
}

fn plain(s: &Sample) -> Vec<f64> {
    let ([ax, ay, az], [gx, gy, gz]) = (s.accel, s.gyro);
    vec![s.t, ax, ay, az, gx, gy, gz, s.speed, s.lat.to_degrees(), s.lon.to_degrees()]
}

const PLAIN: &str = "t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,speed,lat,lon";

/// Catches a check that contradicts a log that is right.
#[test]
fn a_log_that_is_right_is_contradicted_nowhere() {
    let (_, report, _) = open(PLAIN, plain);
    let against: Vec<_> = report.findings.iter().filter(|f| f.weight == Weight::Contradiction).collect();
    assert!(against.is_empty(), "{against:#?}");
    assert!(report.notes.is_empty() && report.warnings.is_empty(), "{:?} {:?}", report.notes, report.warnings);
}

/// Catches a sign that is looked at in a triad only: many cars give a forward acceleration alone.
#[test]
fn a_single_forward_accelerometer_has_the_opposite_sign_with_its_numbers() {
    let (_, report, text) = open("t,accel_x,speed,lat,lon", |s| {
        vec![s.t, -1.46 * s.accel[0], s.speed, s.lat.to_degrees(), s.lon.to_degrees()]
    });
    let finding = find(&report, &["`accel_x`", "opposite sign", "d(speed)/dt", "correlation -", "scale 1.46"]);
    assert_eq!(finding.weight, Weight::Contradiction);
    assert!(report.warnings.iter().any(|w| w.message == finding.text), "{:?}", report.warnings);
    let drive = corrected(&report, finding, &text);
    assert!(error(&drive, "accel_x", |s| 1.46 * s.accel[0]) < 1e-9);
}

#[test]
fn a_turned_yaw_gyro_and_a_turned_axis_of_a_triad_are_told_with_their_numbers() {
    let (_, report, text) = open(PLAIN, |s| {
        let mut row = plain(s);
        (row[2], row[6]) = (-row[2], -row[6]);
        row
    });
    let gyro = find(&report, &["`gyro_z`", "opposite sign", "d(course)/dt", "correlation -"]);
    assert!(error(&corrected(&report, gyro, &text), "gyro_z", |s| s.gyro[2]) < 1e-9);
    let accel = find(&report, &["`accel_y`", "opposite sign", "correlation -"]);
    assert!(error(&corrected(&report, accel, &text), "accel_y", |s| s.accel[1]) < 1e-9);
}

#[test]
fn exchanged_axes_are_told_and_the_correction_exchanges_them_back() {
    let (_, report, text) = open(PLAIN, |s| {
        let mut row = plain(s);
        row.swap(1, 2);
        row
    });
    let finding = find(&report, &["otherwise than its names say", "accel_x is +`accel_y`", "accel_y is +`accel_x`"]);
    let drive = corrected(&report, finding, &text);
    assert!(error(&drive, "accel_x", |s| s.accel[0]) < 1e-9 && error(&drive, "accel_y", |s| s.accel[1]) < 1e-9);
}

#[test]
fn swapped_places_are_told_and_the_correction_swaps_them_back() {
    let (_, report, text) = open("t,speed,lat,lon", |s| vec![s.t, s.speed, s.lon.to_degrees(), s.lat.to_degrees()]);
    let finding = find(&report, &["swapped"]);
    let drive = corrected(&report, finding, &text);
    assert!(error(&drive, "gnss_lat", |s| s.lat) < 1e-9 && error(&drive, "gnss_lon", |s| s.lon) < 1e-9);
}

/// Catches a unit that is put right in words only: what comes out of the opened drive is compared.
#[test]
fn places_in_degrees_radians_and_1e_7_degrees_are_the_same_places() {
    for (factor, bound) in
        [(180.0 / std::f64::consts::PI, 1e-12), (1.0, 1e-12), (1e7 * 180.0 / std::f64::consts::PI, 1e-9)]
    {
        let (drive, _, _) = open("t,speed,lat,lon", |s| vec![s.t, s.speed, s.lat * factor, s.lon * factor]);
        assert!(error(&drive, "gnss_lat", |s| s.lat) < bound && error(&drive, "gnss_lon", |s| s.lon) < bound);
    }
}

#[test]
fn a_field_that_turns_about_another_point_is_hard_iron_in_every_unit() {
    for (unit, factor) in [("uT", 1.0), ("G", 0.01), ("T", 1e-6), ("nT", 1e3)] {
        let (drive, report, _) = open("t,gyro_x,gyro_y,gyro_z,mag_x,mag_y,mag_z,speed", |s| {
            let [x, y, z] = s.mag;
            let mut row = vec![s.t, s.gyro[0], s.gyro[1], s.gyro[2] + 0.2];
            // The car turns by 0.2 rad/s more than the drive does: more than three rounds.
            let (sin, cos) = (0.2 * s.t).sin_cos();
            let (x, y) = (x * cos + y * sin, y * cos - x * sin);
            row.extend([(x + 14.0) * factor, (y - 9.0) * factor, z * factor, s.speed]);
            row
        });
        find(&report, &["hard iron of 16.", &format!("read in {unit}")]);
        assert!(error(&drive, "mag_z", |s| s.mag[2]) < 1e-9, "{unit}");
    }
}

/// Catches a speed without sign that is believed, and a forward drive that is called backwards.
#[test]
fn a_speed_without_sign_is_contradicted_by_the_accelerometer_where_the_car_drives_backwards() {
    let samples = drive(true);
    let row = |unsigned: bool| {
        move |s: &Sample| {
            let mut row = plain(s);
            row[7] = if unsigned { s.speed.abs() } else { s.speed };
            row
        }
    };
    let (_, report, _) = open_with(&samples, PLAIN, &row(true));
    find(&report, &["`speed` has no sign", "backwards in 6 of 12 stretches", "first from 11.", "correlation -"]);
    for (samples, unsigned) in [(&samples, false), (&drive(false), true)] {
        let (_, report, _) = open_with(samples, PLAIN, &row(unsigned));
        assert!(!report.findings.iter().any(|f| f.text.contains("has no sign")), "{:?}", report.findings);
    }
}

#[test]
fn coarse_steps_still_columns_copies_and_sentinels_are_told() {
    let (drive, report, _) = open(&format!("{PLAIN},alt,roll,sent_again"), |s| {
        let mut row = plain(s);
        (1..4).for_each(|k| row[k] = (row[k] * 8.0).round() / 8.0);
        row.extend([if s.t < 10.0 { -5400.0 } else { s.alt }, 0.0, row[2]]);
        row
    });
    find(&report, &["copies of others", "`sent_again` is `accel_y`"]);
    find(&report, &["`accel_x`", "steps of 0.125"]);
    find(&report, &["`roll` is 0 in all 6000 rows"]);
    assert!(report.notes.iter().any(|n| n.contains("reads -5400 in 10 rows")), "{:?}", report.notes);
    let (series, index) = drive.column("gnss_alt").unwrap();
    assert!(series.column_at(index)[..10].iter().all(|a| a.is_nan()));
}

#[test]
fn a_clock_that_steps_back_stands_and_pauses_is_told_and_the_log_opens() {
    let mut samples = drive(false);
    (samples[3000].t, samples[3001].t) = (samples[2500].t, samples[2501].t);
    samples[4000].t = samples[3999].t;
    samples.drain(5000..5200);
    let (drive, report, _) = open_with(&samples, PLAIN, &plain);
    find(&report, &["steps back: 2 rows", "left out"]);
    find(&report, &["stands still in 1 of"]);
    find(&report, &["1 gap of more than ten steps", "the longest is 4.02"]);
    assert!(drive.imu.time().windows(2).all(|w| w[0] < w[1]));
}

#[test]
fn late_fixes_are_told_with_their_delay_and_the_correction_takes_it_out() {
    let samples = drive(false);
    let (_, report, text) = open_with(&samples, PLAIN, &|s| {
        let late = samples[((s.t * 50.0).round() as usize).saturating_sub(15)];
        let mut row = plain(s);
        (row[8], row[9]) = (late.lat.to_degrees(), late.lon.to_degrees());
        row
    });
    let finding = find(&report, &["gnss is", "ms late"]);
    let late = finding.correction.as_ref().unwrap().delays["gnss"];
    assert!((late - 0.3).abs() < 0.06, "{late}");
    let drive = corrected(&report, finding, &text);
    assert!((drive.gnss.time()[0] + late).abs() < 1e-9);
}

/// Catches a column that physics knows and that is left out because no name says so.
#[test]
fn a_column_without_a_known_name_is_taken_for_what_it_measures_and_that_is_said() {
    let (drive, report, _) = open("t,accel_x,accel_y,accel_z,q17,speed,lat,lon", |s| {
        let [x, y, z] = s.accel;
        vec![s.t, x, y, z, -s.gyro[2].to_degrees(), s.speed, s.lat.to_degrees(), s.lon.to_degrees()]
    });
    assert!(report.notes.iter().any(|n| n.contains("`q17` has no known name: taken as gyro_z")), "{:?}", report.notes);
    assert!(error(&drive, "gyro_z", |s| s.gyro[2]) < 1e-9);
}
