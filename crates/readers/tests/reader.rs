//! The readers' door, in a worker of a real browser: what crosses it, and what it says when it refuses.
#![cfg(target_arch = "wasm32")]
#![allow(clippy::unwrap_used)]

use drivescope_readers::Reader;
use js_sys::{Array, Float64Array, Reflect};
use wasm_bindgen::prelude::*;
use wasm_bindgen_test::*;
use web_sys::{Blob, File};

wasm_bindgen_test_configure!(run_in_dedicated_worker);

fn get(object: &JsValue, key: &str) -> JsValue {
    Reflect::get(object, &key.into()).unwrap()
}

fn text(error: JsError) -> String {
    get(&JsValue::from(error), "message").as_string().unwrap()
}

fn file(name: &str, content: &str) -> File {
    File::new_with_str_sequence(&Array::of1(&content.into()), name).unwrap()
}

/// Read to the end; how many calls it took.
fn read(reader: &mut Reader, files: Vec<File>, mapping: Option<&str>) -> Result<usize, String> {
    reader.begin(files, mapping.map(String::from), None).map_err(text)?;
    for calls in 1.. {
        let progress = reader.read_some(20.0).map_err(text)?;
        if get(&progress, "done").as_bool().unwrap() {
            return Ok(calls);
        }
    }
    unreachable!()
}

/// Name, columns' names, times and columns.
type Part = (String, Vec<String>, Vec<f64>, Vec<Vec<f64>>);

/// All parts: name, names of columns, times, columns.
fn parts(reader: &mut Reader) -> Vec<Part> {
    let strings = |a: JsValue| a.unchecked_into::<Array>().iter().map(|s| s.as_string().unwrap()).collect();
    let numbers = |a: JsValue| a.unchecked_into::<Float64Array>().to_vec();
    std::iter::from_fn(|| reader.next_part())
        .map(|part| {
            let columns = part.get(3).unchecked_into::<Array>().iter().map(numbers).collect();
            (part.get(0).as_string().unwrap(), strings(part.get(1)), numbers(part.get(2)), columns)
        })
        .collect()
}

fn log(rows: i32) -> String {
    let row = |k| format!("{},0.1,0,-9.8,{},10\n", f64::from(k) * 0.01, if k % 2 == 0 { "0.01" } else { "" });
    let rows: String = (0..rows).map(row).collect();
    format!("# rear_axle_x = -1.5\nt,accel_x,accel_y,accel_z,gyro_z,speed\n{rows}")
}

#[wasm_bindgen_test]
fn a_dropped_file_is_handed_out_as_what_it_says_and_its_columns() {
    let mut reader = Reader::new();
    read(&mut reader, vec![file("good.csv", &log(500))], None).unwrap();
    let head = reader.head().map_err(text).unwrap();
    assert_eq!((head.get(0).as_string().unwrap().as_str(), head.get(2).as_f64()), ("good.csv", Some(-1.5)));
    assert!(head.get(1).is_undefined() && head.get(3).is_undefined());
    assert_eq!(get(&head.get(4), "rows").as_f64(), Some(500.0));
    let parts = parts(&mut reader);
    let names: Vec<&str> = parts.iter().map(|p| p.0.as_str()).collect();
    assert_eq!(names, ["imu", "wheels"]);
    let (_, columns, time, values) = &parts[0];
    assert_eq!(columns, &["accel_x", "accel_y", "accel_z", "gyro_z"]);
    assert!(time.len() == 500 && time[499] == 4.99 && values[3][0] == 0.01 && values[3][1].is_nan());
    assert_eq!(parts[1].3, [vec![10.0; 500]]);
    assert!(reader.head().is_err() && reader.next_part().is_none(), "what was taken is gone");
}

#[wasm_bindgen_test]
fn a_log_and_its_raw_ranges_are_one_drive() {
    let raw = "t,prn,sat_x,sat_y,sat_z,pr\n0,3,1,2,3,7\n0,9,1,2,3,8\n1,3,1,2,3,9\n";
    let mut reader = Reader::new();
    read(&mut reader, vec![file("log.csv", &log(200)), file("raw.csv", raw)], None).unwrap();
    let parts = parts(&mut reader);
    let (name, columns, time, values) = parts.last().unwrap();
    assert_eq!((name.as_str(), time.as_slice()), ("raw_gnss", [0.0, 0.0, 1.0].as_slice()));
    let of = |column: &str| &values[columns.iter().position(|c| c == column).unwrap()];
    assert_eq!((of("prn").as_slice(), of("pr").as_slice()), ([3.0, 9.0, 3.0].as_slice(), [7.0, 8.0, 9.0].as_slice()));
    assert!(of("prr").is_empty(), "a column without a value");
    read(&mut reader, vec![file("a.csv", &log(9)), file("b.csv", &log(9))], None).unwrap();
    assert_eq!(reader.head().map_err(text).unwrap().get(0).as_string().unwrap(), "a.csv and b.csv");
    assert_eq!(self::parts(&mut reader)[0].2.len(), 18);
}

#[wasm_bindgen_test]
fn a_broken_file_is_one_sentence_and_the_next_one_is_read() {
    let mut reader = Reader::new();
    let broken = log(500).replace("3.33,0.1,", "3.33,abc,");
    let error = read(&mut reader, vec![file("broken.csv", &broken)], None).unwrap_err();
    assert!(error.contains("broken.csv") && error.contains("accel_x") && error.contains("abc"), "{error}");
    assert!(reader.next_part().is_none() && reader.read_some(1.0).is_err());
    let empty: Blob = file("empty.csv", "").into();
    assert_eq!(empty.size(), 0.0);
    assert!(read(&mut reader, vec![empty.unchecked_into()], None).unwrap_err().contains("empty"));
    assert!(read(&mut reader, vec![file("x.csv", &log(9))], Some("{\"signals\": ")).is_err());
    assert!(read(&mut reader, vec![], None).is_err());
    read(&mut reader, vec![file("good.csv", &log(50))], None).unwrap();
    assert_eq!(parts(&mut reader).len(), 2);
}

#[wasm_bindgen_test]
fn reading_comes_in_pieces_says_how_far_it_is_and_can_be_given_up() {
    let mut reader = Reader::new();
    reader.begin(vec![file("long.csv", &log(200_000))], None, None).map_err(text).unwrap();
    let progress = reader.read_some(0.0).map_err(text).unwrap();
    let fraction = get(&progress, "fraction").as_f64().unwrap();
    assert!(!get(&progress, "done").as_bool().unwrap() && fraction > 0.0 && fraction < 1.0, "{fraction}");
    assert_eq!(get(&progress, "stage").as_string().unwrap(), "reading");
    assert!(get(&progress, "rows").as_f64().unwrap() > 10_000.0);
    reader.cancel();
    assert!(reader.read_some(1.0).is_err() && reader.head().is_err());
}

#[wasm_bindgen_test]
fn a_file_is_told_by_its_content_and_a_bus_log_needs_its_database() {
    let frames = "(1600000000.0) can0 123#0100000000000000\n(1600000000.1) can0 123#0200000000000000\n";
    let database = "VERSION \"\"\n\nBO_ 291 MOTION: 8 X\n SG_ accel_x : 0|16@1+ (0.01,0) [0|0] \"m/s^2\" X\n";
    let role = |file: File| drivescope_readers::role(file).map_err(text).unwrap();
    let roles = [file("a.txt", frames), file("b.txt", database), file("c.txt", &log(3))].map(role);
    assert_eq!(roles, ["bus", "database", "log"]);
    let mut reader = Reader::new();
    let missing = read(&mut reader, vec![file("bus.log", frames)], None).unwrap_err();
    assert!(missing.contains("no DBC database"), "{missing}");
    read(&mut reader, vec![file("bus.log", frames), file("car.dbc", database)], None).unwrap();
    let parts = parts(&mut reader);
    assert_eq!((parts[0].1[0].as_str(), parts[0].3[0].as_slice()), ("accel_x", [0.01, 0.02].as_slice()));
}

#[wasm_bindgen_test]
fn a_file_that_seeks_is_read_from_many_places() {
    // A ZIP archive of one stored member, its directory behind more than a window of other bytes.
    let member = log(9_000);
    let le = |v: u32, n: usize| v.to_le_bytes()[..n].to_vec();
    let crc = crc32(member.as_bytes());
    let fields = [le(20, 2), le(0, 2), le(0, 2), le(0, 4), le(crc, 4)].concat();
    let sizes = [le(member.len() as u32, 4), le(member.len() as u32, 4), le(7, 2), le(0, 2)].concat();
    let mut zip = [b"PK\x03\x04".to_vec(), fields.clone(), sizes.clone(), b"log.csv".to_vec()].concat();
    zip.extend(member.as_bytes());
    let directory = zip.len() as u32;
    zip.extend([b"PK\x01\x02".to_vec(), le(20, 2), fields, sizes, vec![0; 14], b"log.csv".to_vec()].concat());
    let length = zip.len() as u32 - directory;
    zip.extend(
        [b"PK\x05\x06".to_vec(), vec![0; 4], le(1, 2), le(1, 2), le(length, 4), le(directory, 4), le(0, 2)].concat(),
    );
    let bytes = js_sys::Uint8Array::from(zip.as_slice());
    let archive = File::new_with_u8_array_sequence(&Array::of1(&bytes), "phone.zip").unwrap();
    let mut reader = Reader::new();
    read(&mut reader, vec![archive], None).unwrap();
    assert_eq!(parts(&mut reader)[0].2.len(), 9_000);
}

/// Would catch bytes lost, taken twice or taken from the wrong place where what was read ahead ends and the next begins.
#[wasm_bindgen_test]
fn a_file_larger_than_what_is_read_ahead_keeps_every_row() {
    const ROWS: usize = 700_000;
    let rows: String =
        (0..ROWS).map(|k| format!("{:.2},0.{:04},0.123456,-9.81\n", k as f64 * 0.01, k % 9973)).collect();
    let content = format!("t,accel_x,accel_y,accel_z\n{rows}");
    assert!(content.len() > 16 << 20, "{} bytes are within what is read ahead", content.len());
    let mut reader = Reader::new();
    read(&mut reader, vec![file("long.csv", &content)], None).unwrap();
    let found = parts(&mut reader);
    let (_, names, times, columns) = found.iter().find(|(_, names, ..)| names.contains(&"accel_x".into())).unwrap();
    let x = &columns[names.iter().position(|n| n == "accel_x").unwrap()];
    assert_eq!((times.len(), x.len()), (ROWS, ROWS));
    assert!(x.iter().enumerate().all(|(k, x)| *x == (k % 9973) as f64 / 1e4));
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &b| (0..8).fold(crc ^ u32::from(b), step))
}

#[wasm_bindgen_test]
fn a_file_that_does_not_fit_is_refused_with_an_offer_that_fits() {
    let begin = |reader: &mut Reader, keep: &str| {
        reader.begin(vec![file("large.csv", &log(20_000))], None, Some(keep.into())).map_err(text).unwrap();
        loop {
            let progress = reader.read_some(20.0).map_err(text)?;
            if get(&progress, "done").as_bool().unwrap() {
                return Ok::<_, String>(());
            }
        }
    };
    let mut reader = Reader::new();
    let refused = begin(&mut reader, "{\"memory\":600000}").unwrap_err();
    assert!(refused.starts_with("large.csv: expected a log that fits into"), "{refused}");
    let every = get(&reader.offer().map_err(text).unwrap(), "every").as_f64().unwrap();
    assert!((2.0..=4.0).contains(&every), "{every}");
    begin(&mut reader, &format!("{{\"memory\":600000,\"every\":{every}}}")).unwrap();
    assert!(reader.offer().map_err(text).unwrap().is_undefined());
    assert!(parts(&mut reader)[0].2.len() <= 20_000);
}
