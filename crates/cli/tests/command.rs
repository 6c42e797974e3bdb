//! The command as a person uses it: what it writes, and one sentence with exit status 2 for every bad input.
#![allow(clippy::unwrap_used)]

mod support;

use std::fs;

use support::{Folder, drivescope};

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

/// Catches labels that are read but not held against, and a broken file that is passed over.
#[test]
fn a_run_is_held_against_labels_painted_by_hand() {
    let folder = Folder::new("labels");
    let (log, out, metrics) = (folder.file("log.csv", log()), folder.path("out.csv"), folder.path("metrics.json"));
    let run = |labels: &str| {
        let mode =
            ["run", &log, "--estimator", "motion_mode", "--out", &out, "--metrics", &metrics, "--labels", labels];
        drivescope(&mode)
    };
    // The log drives straight on from its first row.
    for (name, text) in [
        ("l.csv", "t,truth_mode\n0,1\n3,2\n4.5,\n"),
        ("l.json", r#"[{"time":0,"mode":1},{"time":3,"mode":2},{"time":4.5,"mode":null}]"#),
    ] {
        let done = run(&folder.file(name, text));
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let metrics: serde_json::Value = serde_json::from_str(&fs::read_to_string(&metrics).unwrap()).unwrap();
        assert_eq!(metrics["score"]["mode"]["confusion"][1][1], 300, "{metrics:#}");
        assert_eq!(metrics["score"]["mode"]["confusion"][2][1], 150, "{metrics:#}");
    }
    let refused = run(&folder.file("bad.csv", "t,truth_mode\n0,1\n2,9\n"));
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("row 3"));
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
    let estimators = info["estimators"].as_array().unwrap();
    let waiting: Vec<_> = estimators.iter().filter(|e| e["runnable"] != true).map(|e| &e["name"]).collect();
    assert_eq!(waiting, ["gyro_free", "gnss"], "this drive has no disk and no ranges, and everything else");
    let from_pipe = drivescope(&["info", "-"]);
    assert_eq!(from_pipe.status.code(), Some(2), "standard input needs a format");
}

#[test]
fn raw_ranges_are_written_and_read_beside_the_log_and_refused_where_there_are_none() {
    let folder = Folder::new("raw");
    let (out, raw) = (folder.path("log.csv"), folder.path("raw.csv"));
    let run = drivescope(&["simulate", "table1", "--out", &out, "--gnss-raw", &raw]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let text = fs::read_to_string(&raw).unwrap();
    assert!(text.starts_with("t,prn,sat_x,sat_y,sat_z,sat_vx,sat_vy,sat_vz,pr,prr\n0,"), "{}", &text[..80]);
    let info = drivescope(&["info", &out, "--gnss-raw", &raw]);
    assert!(String::from_utf8_lossy(&info.stdout).contains("raw gnss: 14"), "an instant a second for 140 s");
    let cut = folder.file("cut.csv", text.replace("sat_z", "z"));
    let refused = drivescope(&["info", &out, "--gnss-raw", &cut]);
    assert!(refused.status.code() == Some(2) && String::from_utf8_lossy(&refused.stderr).contains("`sat_z`"));
    let none = drivescope(&["simulate", "j_turn", "--out", &out, "--gnss-raw", &raw]);
    assert!(none.status.code() == Some(2) && String::from_utf8_lossy(&none.stderr).contains("`satellites`"));
}

#[test]
fn values_of_a_drive_are_set_from_the_command_line_or_refused_in_one_sentence() {
    let folder = Folder::new("set");
    let out = folder.path("log.csv");
    let simulate =
        |change: &str| drivescope(&["simulate", "u_drive", "--set", "duration=10", "--set", change, "--out", &out]);
    assert!(simulate("sensors=ideal").status.success());
    let ideal = fs::read_to_string(&out).unwrap();
    assert!(ideal.lines().last().unwrap().starts_with("10,"), "{:?}", ideal.lines().last());
    assert!(simulate("sensors=phone").status.success());
    assert_ne!(fs::read_to_string(&out).unwrap(), ideal);
    let refused = simulate("sensors=tape");
    let sentence = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!((refused.status.code(), sentence.lines().count()), (Some(2), 1), "{sentence}");
    assert!(sentence.contains("u_drive: `sensors` = \"tape\" is not known; there are automotive"), "{sentence}");
}

#[test]
fn lists_name_everything_there_is() {
    for (what, part) in [
        ("estimators", "gnss_ins"),
        ("drives", "city_hills"),
        ("signals", "gnss_lat [deg]"),
        ("params", "q2_th"),
        ("vehicles", "kim_2014"),
        ("loops", "obstacle_course"),
    ] {
        let list = drivescope(&["list", what]);
        assert!(list.status.success() && String::from_utf8_lossy(&list.stdout).contains(part), "{what}");
        let json = drivescope(&["list", what, "--json"]);
        serde_json::from_slice::<serde_json::Value>(&json.stdout).unwrap();
    }
}

#[test]
fn a_closed_loop_is_driven_and_written_and_refuses_what_it_cannot_set() {
    let folder = Folder::new("closed_loop");
    let (out, guidance, log, metrics) =
        (folder.path("out.csv"), folder.path("guidance.csv"), folder.path("log.csv"), folder.path("metrics.json"));
    let set = ["--set", "duration=20", "--set", "look_ahead=6"];
    let files = ["--out", &out, "--guidance", &guidance, "--log", &log, "--metrics", &metrics];
    let run = drivescope(&[&["closed-loop", "obstacle_course"][..], &set, &files].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let lines = |path: &str| std::fs::read_to_string(path).unwrap().lines().count();
    assert_eq!((lines(&out), lines(&guidance)), (2002, 202), "a header, and rows from 0 to 20 s at 100 and 10 Hz");
    let metrics: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&metrics).unwrap()).unwrap();
    assert!(metrics["settings"]["look_ahead"] == 6.0 && metrics["summary"]["clearance"].as_f64().unwrap() > 0.35);
    let info = drivescope(&["info", &log, "--json"]);
    assert!(info.status.success(), "{}", String::from_utf8_lossy(&info.stderr));
    for (arguments, named) in [(["nothing", "look_ahead=6"], "nothing"), (["j_turn", "eta=50"], "reaching_rate")] {
        let refused = drivescope(&["closed-loop", arguments[0], "--set", arguments[1], "--out", &out]);
        assert!(refused.status.code() == Some(2) && String::from_utf8_lossy(&refused.stderr).contains(named));
    }
}

#[test]
fn passes_over_one_road_become_a_table_and_a_map() {
    let folder = Folder::new("profile");
    let logs: Vec<String> = ["1", "2"]
        .map(|seed| {
            let log = folder.path(&format!("pass{seed}.csv"));
            let run = drivescope(&["simulate", "slope_speedbump", "--seed", seed, "--out", &log]);
            assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
            log
        })
        .into();
    let (table, map) = (folder.path("road.csv"), folder.path("road.geojson"));
    for out in [&table, &map] {
        let run = drivescope(&["profile", &logs[0], &logs[1], "--vehicle", "saloon", "--out", out]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    }
    let table = fs::read_to_string(&table).unwrap();
    assert!(table.starts_with("distance,grade,grade_sigma,altitude,"), "{}", &table[..60]);
    // 450 m of road in steps of 5 m, and the start's bearing surface.
    assert!((85..=95).contains(&table.lines().count()), "{} lines", table.lines().count());
    let map: serde_json::Value = serde_json::from_str(&fs::read_to_string(&map).unwrap()).unwrap();
    assert_eq!(map["features"][0]["properties"]["passes"], 2);
    let short = folder.file("short.csv", log().lines().take(40).collect::<Vec<_>>().join("\n"));
    let refused = drivescope(&["profile", &short, "--out", &folder.path("none.csv")]);
    assert_eq!(refused.status.code(), Some(2), "four metres are no road");
    let nowhere = drivescope(&["profile", &folder.file("log.csv", log()), "--out", &folder.path("none.geojson")]);
    assert!(String::from_utf8_lossy(&nowhere.stderr).contains("GNSS position"), "no places, no map");
    assert!(!folder.0.join("none.geojson").exists());
}

#[test]
fn papers_prints_numbers_and_a_verdict_and_knows_its_claims() {
    let tried = drivescope(&["papers", "orientation/static_vectors", "--json"]);
    assert!(tried.status.success(), "{}", String::from_utf8_lossy(&tried.stderr));
    let tried: serde_json::Value = serde_json::from_slice(&tried.stdout).unwrap();
    assert_eq!(tried[0]["verdict"], "supported");
    assert!(tried[0]["figures"].as_array().unwrap().len() > 1);
    let unknown = drivescope(&["papers", "nothing"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("orientation/static_vectors"));
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

/// Catches a reading that hides how sure it is, and a wrong sign that only the page tells.
#[test]
fn info_says_how_sure_each_reading_is_and_what_contradicts_it() {
    let folder = Folder::new("sure");
    let rows = (0..6000).map(|k| {
        let t = f64::from(k) * 0.01;
        format!("{t},{},0,-9.8,0,0,0.01,{}\n", -1.5 * (0.3 * t).cos(), 10.0 + 5.0 * (0.3 * t).sin())
    });
    let text = format!("t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,speed\n{}", rows.collect::<String>());
    let output = drivescope(&["info", &folder.file("turned.csv", text)]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("turned.csv: 60.0 s, from 0.000 to 59.990 s"), "{said}");
    let readings: Vec<&str> = said.lines().filter(|l| l.contains(" <- ")).collect();
    let is_sure = |l: &&str| ["; certain): ", "; likely): ", "; a guess): "].iter().any(|sure| l.contains(sure));
    assert!(readings.len() == 8 && readings.iter().all(is_sure), "{said}");
    assert!(said.contains("has the opposite sign of d(speed)/dt"), "{said}");
}

/// The second table of a receiver is a log of its own: `gnss` runs on it, and says its place from a given origin.
#[test]
fn raw_ranges_alone_are_a_log_and_an_origin_can_be_given() {
    let folder = Folder::new("raw-alone");
    let (log, raw, out) = (folder.path("log.csv"), folder.path("raw.csv"), folder.path("out.csv"));
    let spec = ["--set", "duration=30", "--gnss-raw", &raw];
    let run = drivescope(&[&["simulate", "table1", "--out", &log], &spec[..]].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let first = |out: &str| {
        let text = fs::read_to_string(out).unwrap();
        let cell = |name: &str| {
            let column = text.lines().next().unwrap().split(',').position(|n| n == name).unwrap();
            text.lines().nth(1).unwrap().split(',').nth(column).unwrap().parse::<f64>().unwrap()
        };
        [cell("north"), cell("east"), cell("lat").to_degrees(), cell("lon").to_degrees(), cell("alt")]
    };
    let run = drivescope(&["run", "--gnss-raw", &raw, "--estimator", "gnss", "--out", &out]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let [north, _, lat, lon, alt] = first(&out);
    assert!(north.abs() < 30.0 && (lat - 36.37).abs() < 0.01, "{north} {lat}");
    let origin = format!("{},{lon},{alt}", lat - 0.001);
    let run = drivescope(&["run", "--gnss-raw", &raw, "--origin", &origin, "--estimator", "gnss", "--out", &out]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let [north, east, ..] = first(&out);
    assert!((north - 111.0).abs() < 1.0 && east.abs() < 0.1, "a thousandth of a degree is 111 m: {north} {east}");
    // With the inertial log whose fixes are left out, tightly coupled.
    let text = fs::read_to_string(&log).unwrap();
    let blind = folder.file("blind.csv", text.replace("gnss_lat", "x_a").replace("gnss_lon", "x_b"));
    let tight = ["--estimator", "gnss_ins", "--set", "coupling=tight", "--out", &out];
    let run = drivescope(&[&["run", &blind, "--gnss-raw", &raw, "--origin", &origin], &tight[..]].concat());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert!((first(&out)[0] - 111.0).abs() < 10.0);
    for bad in ["36", "36,x,1", "95,127,0", "36,127,1,2"] {
        let run = drivescope(&["run", "--gnss-raw", &raw, "--origin", bad, "--estimator", "gnss", "--out", &out]);
        assert_eq!(run.status.code(), Some(2), "{bad}");
    }
}
