//! The command as a person uses it: what it writes, and one sentence with exit status 2 for every bad input.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

/// A folder of its own for every test, gone at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("drivescope-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.0.join(name);
        fs::write(&path, content).unwrap();
        path.to_string_lossy().into_owned()
    }
    fn path(&self, name: &str) -> String {
        self.0.join(name).to_string_lossy().into_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn drivescope(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_drivescope")).args(args).output().unwrap()
}

fn log() -> String {
    let rows = (0..600).map(|k| format!("{},0.1,0,-9.8,0,0,0.01,10\n", f64::from(k) * 0.01));
    format!("t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,speed\n{}", rows.collect::<String>())
}

#[test]
fn a_run_writes_its_columns_and_its_metrics() {
    let folder = Folder::new("run");
    let (log, out, metrics) = (folder.file("log.csv", log()), folder.path("out.csv"), folder.path("metrics.json"));
    let run =
        drivescope(&["run", &log, "--estimator", "slope", "--set", "q2_th=0.02", "--out", &out, "--metrics", &metrics]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let written = fs::read_to_string(&out).unwrap();
    assert!(written.starts_with("t,speed,speed_sigma,"), "{}", &written[..60]);
    assert_eq!(written.lines().count(), 601);
    let metrics: serde_json::Value = serde_json::from_str(&fs::read_to_string(&metrics).unwrap()).unwrap();
    assert_eq!(metrics["params"]["slope_walk"], 0.02);
    assert!(metrics["score"]["consistency"].as_array().unwrap().len() > 1);
}

#[test]
fn every_bad_input_is_one_sentence_with_exit_status_2_and_leaves_nothing_behind() {
    let folder = Folder::new("bad");
    let good = log();
    let with = |from: &str, to: &str| good.replacen(from, to, 1);
    let wide = (0..1_000_000).map(|k| format!("c{k}")).collect::<Vec<_>>().join(",");
    let cases: [(&str, Vec<u8>, &[&str]); 8] = [
        ("empty.csv", Vec::new(), &["empty"]),
        ("binary.csv", (0..5000u32).map(|k| (k * 37 % 256) as u8).collect(), &["text"]),
        ("notime.csv", b"a,b\n1,2\n2,3\n".to_vec(), &["time"]),
        ("backwards.csv", with("\n0.05,", "\n0.01,").into_bytes(), &["row 7", "0.01"]),
        ("ragged.csv", with("\n0.05,0.1,0,", "\n0.05,0.1,").into_bytes(), &["row 7", "7", "8"]),
        ("text.csv", with("\n0.05,0.1,", "\n0.05,fast,").into_bytes(), &["row 7", "accel_x", "fast"]),
        ("one.csv", b"t,speed\n0,1\n".to_vec(), &["row"]),
        ("wide.csv", wide.into_bytes(), &["columns"]),
    ];
    for (name, content, parts) in cases {
        let (log, out) = (folder.file(name, content), folder.path("out.csv"));
        let run = drivescope(&["run", &log, "--estimator", "slope", "--out", &out]);
        let sentence = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{name}: {sentence}");
        assert_eq!(sentence.trim_end().lines().count(), 1, "{name}: {sentence}");
        assert!(sentence.contains(name), "{name}: {sentence}");
        for part in parts {
            assert!(sentence.contains(part), "{name} should name `{part}`: {sentence}");
        }
    }
    let left: Vec<_> = fs::read_dir(&folder.0).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(left.iter().all(|f| !f.to_string_lossy().starts_with("out")), "{left:?}");
}

#[test]
fn wrong_names_and_values_are_refused_with_what_there_is() {
    let folder = Folder::new("names");
    let (log, out) = (folder.file("log.csv", log()), folder.path("out.csv"));
    let refused = |args: &[&str]| {
        let run = drivescope(&[&["run", &log, "--out", &out], args].concat());
        assert_eq!(run.status.code(), Some(2));
        String::from_utf8_lossy(&run.stderr).into_owned()
    };
    assert!(refused(&["--estimator", "slop"]).contains("orientation, slope, motion_mode, gnss_ins"));
    assert!(refused(&["--estimator", "slope", "--set", "q2_th=9"]).contains("outside"));
    assert!(refused(&["--estimator", "slope", "--set", "q2_th"]).contains("name=value"));
    assert!(refused(&["--estimator", "slope", "--vehicle", "tank"]).contains("tank"));
    assert!(refused(&["--estimator", "gnss_ins"]).contains("GNSS"));
}

#[test]
fn a_simulated_drive_is_written_and_opens_again() {
    let folder = Folder::new("simulate");
    let out = folder.path("log.csv");
    let run = drivescope(&["simulate", "motorway_bank", "--seed", "3", "--out", &out]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let info = drivescope(&["info", &out, "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    assert!(info["estimators"].as_array().unwrap().iter().all(|e| e["runnable"] == true), "{info}");
    let from_pipe = drivescope(&["info", "-"]);
    assert_eq!(from_pipe.status.code(), Some(2), "standard input needs a format");
}

#[test]
fn lists_name_everything_there_is() {
    for (what, part) in [
        ("estimators", "gnss_ins"),
        ("drives", "city_hills"),
        ("signals", "gnss_lat [deg]"),
        ("params", "q2_th"),
        ("vehicles", "kim_2014"),
    ] {
        let list = drivescope(&["list", what]);
        assert!(list.status.success() && String::from_utf8_lossy(&list.stdout).contains(part), "{what}");
        let json = drivescope(&["list", what, "--json"]);
        serde_json::from_slice::<serde_json::Value>(&json.stdout).unwrap();
    }
}

#[test]
fn several_files_of_any_format_are_one_drive() {
    let folder = Folder::new("several");
    let later: String = log()
        .lines()
        .skip(1)
        .map(|l| l.split_once(',').unwrap())
        .fold("t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,speed\n".to_owned(), |text, (t, rest)| {
            format!("{text}{},{rest}\n", t.parse::<f64>().unwrap() + 6.0)
        });
    let sentence = |second: u32| {
        let body = format!("GPGGA,1200{second:02}.00,4220.0,N,07105.0,W,1,9,1.0,8.0,M,,M,,");
        let sum = body.bytes().fold(0, |a, b| a ^ b);
        format!("${body}*{sum:02X}\r\n")
    };
    let (a, b) = (folder.file("a.csv", log()), folder.file("b.csv", later));
    let c = folder.file("c.nmea", (0..12).map(sentence).collect::<String>());
    let output = drivescope(&["info", &b, &a, &c]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("inertial: 1200 samples") && text.contains("gnss: 12 samples"), "{text}");
    // A folder is the same as its files.
    let inside = drivescope(&["info", &folder.0.to_string_lossy()]);
    assert!(String::from_utf8_lossy(&inside.stdout).contains("inertial: 1200 samples"), "{inside:?}");
}
