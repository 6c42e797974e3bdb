//! The door of the room of motion, in a worker of a real browser: rules with their thresholds, labels and the confusion with
//! them, aids, and a calibrated disk.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used)]

use drivescope_drive::disk::Disk;
use drivescope_wasm::Session;
use js_sys::{Array, JSON};
use wasm_bindgen::prelude::*;
use wasm_bindgen_test::*;

mod support;

use support::{get, text, with};

wasm_bindgen_test_configure!(run_in_dedicated_worker);

const MODES: &str = "motion_mode:current";

fn number(object: &JsValue, key: &str) -> f64 {
    get(object, key).as_f64().unwrap()
}

/// Run an estimator; the score of its modes, if it has them.
fn run(session: &mut Session, estimator: &str, params: &str) -> JsValue {
    session.begin_run(estimator, JSON::parse(params).unwrap(), None).map_err(text).unwrap();
    while !get(&session.run_some(estimator, 50.0).map_err(text).unwrap(), "done").as_bool().unwrap() {}
    let report = session.result(estimator, "current").map_err(text).unwrap();
    get(&get(&report, "score"), "mode")
}

/// The rows of some columns, without their times.
fn rows(session: &Session, source: &str, columns: &[&str]) -> Vec<Vec<f64>> {
    let names = columns.iter().map(|c| (*c).to_owned()).collect();
    let flat = session.table(source, names, 0.0, 1e4, 100_000).to_vec();
    flat.chunks_exact(columns.len() + 1).map(|row| row[1..].to_vec()).collect()
}

/// Changes of mode, thirteen numbers each.
fn decisions(session: &Session) -> Vec<Vec<f64>> {
    session.decisions(MODES).to_vec().chunks_exact(13).map(<[f64]>::to_vec).collect()
}

/// Confusion as plain rows.
fn confusion(score: &JsValue) -> Vec<Vec<f64>> {
    let rows = Array::from(&get(score, "confusion"));
    rows.iter().map(|row| Array::from(&row).iter().map(|n| n.as_f64().unwrap()).collect()).collect()
}

/// Catches decisions of another run, numbers in another order, and a threshold that does not reach the rules.
#[wasm_bindgen_test]
fn decisions_cross_with_rule_statistics_and_thresholds_and_follow_a_moved_threshold() {
    let mut session = with("stop_and_go");
    assert_eq!(session.decisions(MODES).length(), 0, "nothing has run");
    run(&mut session, "motion_mode", "{}");
    let adaptive = decisions(&session);
    assert!(adaptive[0][1].is_nan() && adaptive[0][2] == 0.0 && adaptive[0][3] == 7.0, "{:?}", adaptive[0]);
    let modes: Vec<f64> = rows(&session, MODES, &["mode"]).concat();
    assert_eq!(adaptive.len(), 1 + modes.windows(2).filter(|m| m[0] != m[1]).count());
    assert!(
        adaptive.windows(2).all(|d| d[0][0] < d[1][0] && d[0][2] == d[1][1]),
        "in order, each from the mode before"
    );
    let launch = adaptive.iter().find(|d| d[3] == 1.0).unwrap();
    assert!(launch[9] > launch[10], "FD {} above {}", launch[9], launch[10]);

    let params =
        r#"{"adaptive": false, "fd_threshold": 0.9, "jd_threshold": 0.06, "launch_speed": 0, "use_speed": false}"#;
    run(&mut session, "motion_mode", params);
    let moved = decisions(&session);
    assert!(moved.iter().all(|d| d[6] == 0.06 && d[10] == 0.9), "the thresholds are those that were set");
    let first = |list: &[Vec<f64>]| list.iter().find(|d| d[1] == 0.0).unwrap()[0];
    assert!(first(&moved) > first(&adaptive) + 0.05, "a launch by force alone is seen later");
}

/// Catches a confusion whose rows are decided and columns true, and counts that leave rows out.
#[wasm_bindgen_test]
fn modes_are_scored_against_the_truth_with_confusion_and_latencies() {
    let mut session = with("u_drive");
    let score = run(&mut session, "motion_mode", "{}");
    let truth: Vec<f64> = rows(&session, "truth", &["mode"]).concat();
    let confusion = confusion(&score);
    for (mode, row) in confusion.iter().enumerate() {
        let rows = truth.iter().filter(|m| **m == mode as f64).count();
        assert_eq!(row.iter().sum::<f64>(), rows as f64, "mode {mode}");
        assert!(row[mode] > 0.9 * rows as f64);
    }
    assert_eq!(number(&score, "count"), truth.len() as f64);
    assert!(number(&score, "accuracy") >= 0.95 && number(&score, "accuracy_guarded") >= 0.98);
    for (change, longest) in [("launch", 1.0), ("stop", 1.2), ("corner_entry", 0.6)] {
        let latency = get(&score, change);
        assert!(number(&latency, "count") >= 1.0 && number(&latency, "missed") == 0.0, "{change}");
        assert!(number(&latency, "max") <= longest, "{change}: {}", number(&latency, "max"));
    }
}

/// Catches paint that spills over its ends, a wipe that paints, and decisions held against other labels.
#[wasm_bindgen_test]
fn labels_are_painted_wiped_and_held_against_what_was_decided() {
    let mut session = with("u_drive");
    let paint =
        |session: &Session, labels: &[f64], from, to, mode| session.labels_paint(labels, from, to, mode).to_vec();
    let one = paint(&session, &[], 2.0, 6.0, 0.0);
    let (times, modes) = one.split_at(one.len() / 2);
    assert!(times == [2.0, 6.0] && modes[0] == 0.0 && modes[1].is_nan(), "{one:?}");
    let two = paint(&session, &one, 4.0, 8.0, 1.0);
    assert_eq!(two[..5], [2.0, 4.0, 8.0, 0.0, 1.0]);
    let wiped = paint(&session, &two, 3.0, 9.0, f64::NAN);
    assert!(wiped[..3] == [2.0, 3.0, 0.0] && wiped.len() == 4 && wiped[3].is_nan(), "{wiped:?}");
    let score = |session: &Session, labels: &[f64]| session.labels_score(MODES, labels).map_err(text).unwrap();
    assert!(score(&session, &one).is_null(), "nothing has been decided");

    run(&mut session, "motion_mode", "{}");
    assert!(score(&session, &[]).is_null());
    let mut decided = Vec::new();
    let all = decisions(&session);
    for (k, d) in all.iter().enumerate() {
        decided = paint(&session, &decided, d[0], all.get(k + 1).map_or(100.0, |next| next[0]), d[2]);
    }
    let own = score(&session, &decided);
    assert_eq!((number(&own, "accuracy"), number(&own, "count")), (1.0, rows(&session, MODES, &["mode"]).len() as f64));
    let wrong = paint(&session, &decided, 0.0, 3.0, 2.0);
    let held = score(&session, &wrong);
    assert!(number(&held, "accuracy") < 1.0 && confusion(&held)[2][0] > 250.0, "labels are the rows");
}

/// Catches an aid that is said to hold when it is switched off, and one that holds in the wrong mode.
#[wasm_bindgen_test]
fn aids_hold_by_mode_and_a_switched_off_one_never_does() {
    let mut session = with("u_drive");
    let aids = ["zupt_active", "zaru_active", "nhc_active", "straight_active", "wheel_active", "gnss_active", "mode"];
    let held = |session: &Session| {
        let rows = rows(session, "land_ins:current", &aids);
        let times = |aid: usize, mode: f64| rows.iter().filter(|r| r[aid] > 0.5 && r[6] == mode).count();
        [0, 1, 2, 3, 4, 5].map(|aid| [0.0, 1.0, 2.0].map(|mode| times(aid, mode)))
    };
    run(&mut session, "land_ins", r#"{"wheel": true}"#);
    let [zupt, zaru, nhc, straight, wheel, gnss] = held(&session);
    // Between two instants of aiding, 0.1 s apart, an aid is said to hold as at the last one: nine rows a change of mode.
    let late = 60;
    assert!(zupt[0] > 1000 && zupt[1] + zupt[2] < late, "{zupt:?}");
    assert!(zaru[0] > 1000 && zaru[1] + zaru[2] < late, "{zaru:?}");
    assert!(nhc[0] < late && nhc[1] > 1000 && nhc[2] > 500, "{nhc:?}");
    assert!(straight[1] > 1000 && straight[0] + straight[2] < late, "{straight:?}");
    assert!(wheel[0] < late && wheel[1] > 1000, "{wheel:?}");
    assert_eq!(gnss, [0; 3], "off by default");
    run(&mut session, "land_ins", r#"{"zupt": false, "nhc": false, "gnss": true}"#);
    let [zupt, zaru, nhc, _, wheel, gnss] = held(&session);
    assert_eq!([zupt, nhc, wheel], [[0; 3]; 3]);
    assert!(zaru[0] > 0 && gnss.iter().sum::<usize>() > 0);
}

/// Catches a disk that is applied to the page and not to the filter, one that cannot be taken back, and one that a saved
/// log loses.
#[wasm_bindgen_test]
fn a_calibrated_disk_changes_what_is_read_is_saved_with_the_log_and_is_taken_back() {
    let mut session = with("u_drive_disk");
    let last = |session: &mut Session| {
        run(session, "gyro_free", "{}");
        rows(session, "gyro_free:current", &["force_z", "rate_z"]).pop().unwrap()
    };
    let drawn = last(&mut session);
    let mut disk = Disk::default();
    disk.sensors[3].bias = 0.05;
    assert_eq!(session.disk_apply(&disk.numbers()).length(), 0, "it was read as drawn");
    let calibrated = last(&mut session);
    // One of three axial sensors reads less by its bias.
    assert!((calibrated[0] - drawn[0] + 0.05 / 3.0).abs() < 1e-3, "{drawn:?} {calibrated:?}");
    let saved = String::from_utf8(session.export_csv("drive").map_err(text).unwrap().to_vec()).unwrap();
    let stated = saved.lines().find_map(|line| line.strip_prefix("# disk = ")).unwrap();
    let numbers: Vec<f64> = stated.split(", ").map(|n| n.parse().unwrap()).collect();
    assert_eq!(numbers, disk.numbers());
    assert_eq!(session.disk_apply(&[]).to_vec(), disk.numbers(), "what it was read as comes back");
    assert_eq!(last(&mut session), drawn);
    assert!(
        !String::from_utf8(session.export_csv("drive").map_err(text).unwrap().to_vec()).unwrap().contains("# disk")
    );
    session.disk_apply(&[0.1; 41]);
    assert_eq!(last(&mut session), drawn, "what is no disk is the drawing");
}
