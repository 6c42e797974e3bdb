//! Parts of a large log, and mappings put right, as the command takes and writes them.
#![allow(clippy::unwrap_used)]

mod support;

use std::fs;
use std::process::Output;

use serde_json::Value;

use support::{Folder, drivescope};

fn said(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The sentence with which something is refused, leaving nothing else.
fn refused(args: &[&str]) -> String {
    let output = drivescope(args);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8_lossy(&output.stderr).trim_end().to_owned()
}

/// A minute at 100 Hz: the car speeds up and slows down; the forward axis is turned by `sign`.
fn minute(sign: f64) -> String {
    let rows = (0..6000).map(|k| {
        let t = f64::from(k) * 0.01;
        let (accel, speed) = (sign * 1.5 * (0.3 * t).cos(), 10.0 + 5.0 * (0.3 * t).sin());
        format!("{t},{accel},0,-9.8,0,0,0.01,{speed}\n")
    });
    format!("t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,speed\n{}", rows.collect::<String>())
}

/// Catches an option that is taken but does nothing, an end that is left out, and a clock that begins anew.
#[test]
fn parts_of_a_log_are_read_by_columns_time_and_every_nth_row() {
    let folder = Folder::new("parts");
    let log = folder.file("log.csv", minute(1.0));
    let part = |options: &[&str]| -> Value {
        let args = [&["info", &log, "--json"], options].concat();
        serde_json::from_str(&said(&drivescope(&args))).unwrap()
    };
    let rows = |info: &Value, name: &str| {
        let channels = info["channels"].as_array().unwrap();
        channels.iter().find(|c| c["name"] == name).map_or(0, |c| c["rows"].as_u64().unwrap())
    };
    let some = part(&["--columns", "accel_x,speed"]);
    let used: Vec<&str> =
        some["report"]["used"].as_array().unwrap().iter().map(|u| u["column"].as_str().unwrap()).collect();
    assert_eq!(used, ["t", "accel_x", "speed"]);
    let range = part(&["--from", "10", "--to", "19.995"]);
    assert_eq!((range["start"].as_f64(), range["end"].as_f64()), (Some(10.0), Some(19.99)));
    assert_eq!(rows(&range, "inertial"), 1000, "{range:#}");
    let thin = part(&["--every", "4"]);
    assert_eq!((rows(&thin, "inertial"), thin["end"].as_f64()), (1500, Some(59.96)), "{thin:#}");
    let warnings = range["report"]["warnings"].to_string();
    assert!(warnings.contains("only a part was read: the time from 10 s to 19.995 s"), "{warnings}");
    let out = folder.path("out.csv");
    let run = drivescope(&["run", &log, "--estimator", "slope", "--to", "5", "--out", &out]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(fs::read_to_string(&out).unwrap().lines().count(), 502, "a header and the rows from 0 to 5 s");
}

/// Catches an offer that does not hold: the options that the sentence names are given, as it names them.
#[test]
fn a_log_that_does_not_fit_is_refused_with_options_that_make_it_fit() {
    let folder = Folder::new("fit");
    // 24,000 rows of 8 columns are expected to need 1.92 MB.
    let text = minute(1.0);
    let body = text.split_once('\n').unwrap().1;
    let rows = (0..4).flat_map(|part| {
        body.lines().map(move |line| {
            let (t, rest) = line.split_once(',').unwrap();
            format!("{:.2},{rest}\n", t.parse::<f64>().unwrap() + 60.0 * f64::from(part))
        })
    });
    let log = folder.file("log.csv", format!("{}\n{}", text.split_once('\n').unwrap().0, rows.collect::<String>()));
    let sentence = refused(&["info", &log, "--memory", "1"]);
    assert!(
        sentence.contains("log.csv: expected a log that fits into 1 MB, found one that needs about 2 MB"),
        "{sentence}"
    );
    assert!(sentence.lines().count() == 1 && sentence.contains("columns beside the clock, at most"), "{sentence}");
    let (_, options) = sentence.rsplit_once(": ").unwrap();
    let options: Vec<&str> = options.split('`').skip(1).step_by(2).collect();
    let names: Vec<&str> = options.iter().filter_map(|o| o.split_whitespace().next()).collect();
    assert_eq!(names, ["--columns", "--to", "--every"], "{sentence}");
    for option in &options[1..] {
        let (name, value) = option.split_once(' ').unwrap();
        said(&drivescope(&["info", &log, "--memory", "1", name, value]));
    }
    said(&drivescope(&["info", &log, "--memory", "1", "--columns", "accel_x,speed"]));
    said(&drivescope(&["info", &log, "--memory", "1000"]));
}

#[test]
fn parts_that_cannot_be_taken_are_refused_in_one_sentence() {
    let folder = Folder::new("no-part");
    let log = folder.file("log.csv", minute(1.0));
    for (options, parts) in [
        (&["--columns", "accel_x,spede"][..], &["--columns", "`spede`"][..]),
        (&["--from", "5", "--to", "3"], &["--from 5 --to 3", "ends after it begins"]),
    ] {
        let sentence = refused(&[&["info", &log], options].concat());
        assert!(sentence.lines().count() == 1 && parts.iter().all(|p| sentence.contains(p)), "{sentence}");
    }
    for bad in [["--every", "0"], ["--from", "nan"], ["--to", "-1"], ["--memory", "0"]] {
        assert!(refused(&["info", &log, &bad.join("=")]).contains(bad[0]), "{bad:?}");
    }
    let fixes = "<gpx><trk><trkseg><trkpt lat=\"42\" lon=\"1\"><time>2024-05-31T12:00:00Z</time></trkpt>\
        <trkpt lat=\"42.0001\" lon=\"1\"><time>2024-05-31T12:00:01Z</time></trkpt></trkseg></trk></gpx>";
    let sentence = refused(&["info", &folder.file("log.gpx", fixes), "--every", "2"]);
    assert!(sentence.contains("--every: parts are taken of CSV files only, and log.gpx is GPX"), "{sentence}");
}

/// Catches a correction that is said and not written, one that is written and not said, and a mapping that does not read.
#[test]
fn a_mapping_is_written_with_the_corrections_of_contradictions_and_reads_the_log_right() {
    let folder = Folder::new("corrected");
    let (log, saved) = (folder.file("turned.csv", minute(-1.0)), folder.path("m.json"));
    let first = said(&drivescope(&["info", &log, "--save-mapping", &saved]));
    assert!(first.contains("applied: ") && first.contains("has the opposite sign of d(speed)/dt"), "{first}");
    assert!(first.lines().any(|l| l.starts_with("  accel_x <- accel_x") && l.ends_with(", times -1")), "{first}");
    let mapping: Value = serde_json::from_str(&fs::read_to_string(&saved).unwrap()).unwrap();
    assert_eq!(mapping["signals"]["accel_x"]["scale"], -1.0);
    assert!(mapping["signals"]["speed"].get("scale").is_none(), "nothing else was changed: {mapping:#}");
    let again = said(&drivescope(&["info", &log, "--mapping", &saved, "--save-mapping", &folder.path("again.json")]));
    assert!(!again.contains("opposite sign") && again.contains("applied: nothing"), "{again}");
    assert_eq!(fs::read(folder.path("again.json")).unwrap(), fs::read(&saved).unwrap(), "put right, it stays as it is");
    // What is estimated on the turned log with the mapping is what is estimated on the log as it should be.
    let straight = folder.file("straight.csv", minute(1.0));
    let run = |log: &str, options: &[&str]| {
        let out = folder.path("out.csv");
        let output = drivescope(&[&["run", log, "--estimator", "slope", "--out", &out], options].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read_to_string(&out).unwrap()
    };
    assert_eq!(run(&log, &["--mapping", &saved]), run(&straight, &[]));
    assert_ne!(run(&log, &[]), run(&straight, &[]));
}

/// Catches contradictions that a correction has put right and that are still said to be left: axes are left-handed as long as
/// one of them is turned.
#[test]
fn what_a_correction_puts_right_is_not_left() {
    let folder = Folder::new("handed");
    let simulated = folder.path("log.csv");
    said(&drivescope(&["simulate", "city_hills", "--seed", "2", "--out", &simulated]));
    let text = fs::read_to_string(&simulated).unwrap();
    let names: Vec<&str> = text.lines().find(|l| !l.starts_with('#')).unwrap().split(',').collect();
    let [accel, gyro] = ["accel_x", "gyro_z"].map(|name| names.iter().position(|n| *n == name).unwrap());
    let turn = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        for (place, factor) in [(accel, -1.0), (gyro, -180.0 / std::f64::consts::PI)] {
            if let Some(value) = cells.get(place).and_then(|c| c.parse::<f64>().ok()) {
                cells[place] = (value * factor).to_string();
            }
        }
        cells.join(",")
    };
    let turned: Vec<String> = text.lines().map(|l| if l.starts_with('#') { l.to_owned() } else { turn(l) }).collect();
    let (log, saved) = (folder.file("turned.csv", turned.join("\n") + "\n"), folder.path("m.json"));
    let first = said(&drivescope(&["info", &log, "--save-mapping", &saved]));
    assert!(first.contains("warning: the accelerometer's axes are left-handed"), "{first}");
    assert!(!first.contains("left: the accelerometer's axes are left-handed"), "{first}");
    let signals = serde_json::from_str::<Value>(&fs::read_to_string(&saved).unwrap()).unwrap()["signals"].clone();
    assert_eq!((&signals["accel_x"]["scale"], &signals["gyro_z"]["scale"]), (&(-1.0).into(), &(-1.0).into()));
    assert_eq!(signals["gyro_z"]["unit"], "deg/s");
    let again = said(&drivescope(&["info", &log, "--mapping", &saved]));
    assert!(!again.contains("warning: "), "{again}");
}

/// Catches a guess that is taken without being asked for.
#[test]
fn what_is_only_likely_is_left_unless_it_is_asked_for() {
    let folder = Folder::new("guesses");
    let simulated = folder.path("log.csv");
    said(&drivescope(&["simulate", "city_hills", "--seed", "1", "--out", &simulated]));
    // The receiver's fixes come 0.2 s late: what it measured is moved down by twenty rows of 10 ms.
    let text = fs::read_to_string(&simulated).unwrap();
    let late = late(&text, "gnss_", 20);
    let log = folder.file("late.csv", late);
    let (left, taken) = (folder.path("left.json"), folder.path("taken.json"));
    let careful = said(&drivescope(&["info", &log, "--save-mapping", &left]));
    let guess = careful.lines().find(|l| l.starts_with("left: gnss is ")).unwrap_or_else(|| panic!("{careful}"));
    assert!(guess.contains("--with-guesses takes it"), "{guess}");
    let delays =
        |path: &str| serde_json::from_str::<Value>(&fs::read_to_string(path).unwrap()).unwrap()["delays"].clone();
    assert_eq!(delays(&left), Value::Null);
    let willing = said(&drivescope(&["info", &log, "--save-mapping", &taken, "--with-guesses"]));
    assert!(willing.contains("applied: gnss is ") && willing.contains("  gnss late by 0."), "{willing}");
    assert!((delays(&taken)["gnss"].as_f64().unwrap() - 0.2).abs() < 0.05, "{}", delays(&taken));
    assert!(refused(&["info", &log, "--with-guesses"]).contains("--save-mapping"));
}

/// A log whose columns of that beginning come `rows` later.
fn late(text: &str, prefix: &str, rows: usize) -> String {
    let (comments, body): (Vec<&str>, Vec<&str>) = text.lines().partition(|l| l.starts_with('#'));
    let moved: Vec<bool> = body[0].split(',').map(|name| name.starts_with(prefix)).collect();
    let cells = |line: usize| body[line].split(',').collect::<Vec<_>>();
    let mut out: Vec<String> = comments.iter().map(|c| (*c).to_owned()).collect();
    out.push(body[0].to_owned());
    for line in 1..body.len() {
        let own = cells(line);
        let before = if line > rows { cells(line - rows) } else { vec![""; own.len()] };
        let row: Vec<&str> = (0..own.len()).map(|i| if moved[i] { before[i] } else { own[i] }).collect();
        out.push(row.join(","));
    }
    out.join("\n") + "\n"
}
