//! The doctor's door, in a worker of a real browser: what it makes of a drive that the core hands over.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used)]

use drivescope_doctor::Doctor;
use drivescope_drive::parts::{Part, parts};
use drivescope_simulation::{named, simulate};
use js_sys::{Array, Float64Array, Reflect};
use wasm_bindgen::prelude::*;
use wasm_bindgen_test::*;

wasm_bindgen_test_configure!(run_in_dedicated_worker);

fn get(object: &JsValue, key: &str) -> JsValue {
    Reflect::get(object, &key.into()).unwrap()
}

fn text(error: JsError) -> String {
    get(&JsValue::from(error), "message").as_string().unwrap()
}

/// A doctor with a built-in drive, handed over as the page does.
fn with(drive: &str) -> Doctor {
    let (head, parts) = parts(simulate(&named(drive).unwrap(), None).unwrap());
    let mut doctor = Doctor::new();
    doctor
        .begin_parts(head.name, head.vehicle, head.rear_axle, head.unix_zero, JsValue::UNDEFINED, head.disk)
        .map_err(text)
        .unwrap();
    for Part { name, time, columns } in parts {
        let (names, columns) = columns.iter().map(|(n, c)| (n.to_string(), Float64Array::from(c.as_slice()))).unzip();
        doctor.add_part(name, names, time, columns).map_err(text).unwrap();
    }
    doctor.end_parts().map_err(text).unwrap();
    doctor
}

/// Catches an examination of the wrong drive, a calibration that is not applied, and columns in another order.
#[wasm_bindgen_test]
fn a_magnetometer_is_examined_as_it_was_read_and_as_it_is_once_something_is_applied() {
    let mut doctor = with("city_loop");
    let examine = |doctor: &mut Doctor, applied: &[f64]| {
        doctor.compass(f64::NAN, f64::NAN, f64::NAN, applied, true).map_err(text).unwrap()
    };
    let raw = examine(&mut doctor, &[]);
    assert!(get(&raw, "applied").is_null() && get(&raw, "now").is_null());
    let found = get(&raw, "calibration");
    assert!(!found.is_null(), "a loop through a city is enough to calibrate");
    let numbers = |key: &str| -> Vec<f64> {
        get(&found, key).unchecked_into::<Array>().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let mut applied = [numbers("offset"), numbers("distortion")].concat();
    assert_eq!(applied.len(), 9);
    applied.extend([0.0, 0.0, 0.0]);
    let now = get(&examine(&mut doctor, &applied), "now");
    let after = get(&raw, "after");
    let rms = |of: &JsValue| get(of, "rms").as_f64().unwrap();
    assert!((rms(&now) - rms(&after)).abs() < 1e-6, "{} {}", rms(&now), rms(&after));
    let along = doctor.field(true);
    let columns: Vec<u32> = along.iter().map(|c| c.unchecked_into::<Float64Array>().length()).collect();
    assert!(columns.len() == 5 && columns.iter().all(|n| *n == columns[0] && *n > 1000), "{columns:?}");
}

/// Catches poses in another order than they are read in, and a calibration whose numbers are not those of its disk.
#[wasm_bindgen_test]
fn a_leaning_disk_is_calibrated_from_four_poses() {
    let g = 9.80665;
    let axis = |i: usize| [0.01 * i as f64, if i < 3 { 1.0 } else { 0.02 }, if i < 3 { -0.01 } else { 0.99 }];
    let bias = |i: usize| 0.05 - 0.02 * i as f64;
    let poses = [[0.0, 0.0, -g], [-g, 0.0, 0.0], [0.0, g, 0.0], [0.0, 0.0, g]];
    let mean = |f: [f64; 3], i: usize| axis(i).iter().zip(f).map(|(u, f)| u * f).sum::<f64>() + bias(i);
    let flat: Vec<f64> =
        poses.iter().flat_map(|f| f.iter().copied().chain((0..6).map(|i| mean(*f, i))).collect::<Vec<_>>()).collect();
    let found = Doctor::new().disk_calibrate(&flat).map_err(text).unwrap().unchecked_into::<Array>();
    let numbers: Vec<f64> = found.get(1).unchecked_into::<Array>().iter().map(|v| v.as_f64().unwrap()).collect();
    assert_eq!(numbers.len(), 42);
    for i in 0..6 {
        let wanted = [axis(i).as_slice(), &[bias(i)]].concat();
        let same = numbers[7 * i + 3..7 * i + 7].iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(same, "sensor {i}: {:?}, wanted {wanted:?}", &numbers[7 * i + 3..7 * i + 7]);
    }
    assert!(get(&found.get(0), "residual").is_null(), "four poses leave nothing to check");
    assert!(found.get(2).unchecked_into::<Array>().length() >= 3, "what cannot be known is said");
    let error = Doctor::new().disk_calibrate(&flat[..27]).map_err(text).unwrap_err();
    assert!(error.contains("pose"), "{error}");
}

#[wasm_bindgen_test]
fn a_drive_without_the_sensor_has_no_diagnosis_and_a_disk_has_its_rests() {
    let mut doctor = with("u_drive_disk");
    let rests = doctor.disk_rests(2.0).map_err(text).unwrap().unchecked_into::<Array>();
    assert!(rests.length() >= 2, "it stands before and after: {}", rests.length());
    let error = doctor.disk_calibrate(&[0.0; 9]).map_err(text).unwrap_err();
    assert!(error.contains("pose"), "{error}");
    doctor = Doctor::new();
    assert!(doctor.compass(f64::NAN, f64::NAN, f64::NAN, &[], false).map_err(text).unwrap().is_null());
    let sentence = doctor.end_parts().map_err(text).unwrap_err();
    assert_eq!(sentence, "no drive is coming");
}
