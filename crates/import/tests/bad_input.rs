//! Every kind of broken file gets one sentence that names the place, what was expected and what was found.

use drivescope_import::{CsvReader, IoSource, open_csv};

fn sentence(bytes: &[u8]) -> String {
    open_csv(&mut IoSource::new(bytes, None), "x.csv", None).expect_err("the file is broken").to_string()
}

#[test]
fn an_empty_file_is_refused() {
    let expected =
        "x.csv: expected a header row and rows of numbers, found an empty file; record or export the log again.";
    for text in ["", "\n\n", "\u{feff}", "# comment\n"] {
        assert_eq!(sentence(text.as_bytes()), expected, "{text:?}");
    }
}

#[test]
fn other_formats_are_named_and_binary_data_is_not_text() {
    assert_eq!(
        sentence(b"%PDF-1.7"),
        "x.csv: expected a log, found a PDF document; what can be opened: CSV, MDF 4, BLF, ASC and candump with their DBC, MCAP, ROS 1 bag, PX4 ULog, NMEA, GPX, VBO, OxTS, NumPy, OpenXC, and these in ZIP or gzip."
    );
    for (magic, name) in [
        (&b"LOGG\x90\0"[..], "BLF"),
        (b"#ROSBAG V2.0\n", "ROS 1 bag"),
        (b"\x89MCAP0\r\n", "MCAP"),
        (b"ULog\x01\x12\x35\x01", "ULog"),
        (b"PK\x03\x04rest", "ZIP"),
        (b"\x1f\x8b\x08", "gzip"),
        (b"\x89PNG\r\n\x1a\n", "PNG"),
        (b"\xff\xfet\0,\0", "UTF-16"),
    ] {
        assert!(sentence(magic).contains(name), "{name}: {}", sentence(magic));
    }
    let binary = sentence(b"t,ax\n0,\x001\n");
    assert!(binary.starts_with("x.csv, row 2: expected text, found binary data (byte 0x00 at offset 7) of an unknown"));
    assert!(binary.contains("what can be opened: CSV, MDF 4, BLF"), "{binary}");
}

#[test]
fn a_file_without_time_says_which_columns_it_has() {
    assert_eq!(
        sentence(b"accel_x,accel_y,note\n1,2,a\n3,4,b\n"),
        "x.csv, row 1: expected a time column (`t`, `time`, `timestamp`, ..), found `accel_x`, `accel_y`, `note`; name one column so or give a mapping."
    );
    assert_eq!(
        sentence(b"0,1,2\n1,2,3\n"),
        "x.csv, no header row: expected a time column (`t`, `time`, `timestamp`, ..), found `c1`, `c2`, `c3`; name one column so or give a mapping."
    );
}

#[test]
fn time_running_backwards_is_refused() {
    assert_eq!(
        sentence(b"t,accel_x\n0,1\n0.02,1\n0.01,1\n"),
        "x.csv, row 4, column `t`: expected a time after 0.02 (row 3), found 0.01; time runs backwards here: sort the rows by time or cut the file in two."
    );
}

#[test]
fn a_ragged_row_is_refused() {
    let expected = "x.csv, row 3: expected 3 cells as in the header (row 1), found 2; complete or delete the row.";
    assert_eq!(sentence(b"t,accel_x,b\n0,1,2\n1,2\n2,3,4\n"), expected);
    let expected = "x.csv, row 4: expected 3 cells as in the header (row 2), found 5; complete or delete the row.";
    assert_eq!(sentence(b"# c\nt,accel_x,b\n0,1,2\n1,2,3,4,5\n2,3,4\n"), expected);
    let expected = "x.csv, row 2: expected 3 cells as in the header (row 1), found 2; complete or delete the row.";
    assert_eq!(sentence(b"t,accel_x,b\n0,1\n1,2\n2,3\n"), expected, "every row differs from the header");
}

#[test]
fn text_in_a_column_of_numbers_is_refused() {
    let mut text = String::from("t,accel_x\n");
    (0..30).for_each(|i| text.push_str(&format!("{i},{}\n", if i == 15 { "abc".into() } else { i.to_string() })));
    let expected =
        "x.csv, row 17, column `accel_x`: expected a number, found `abc`; correct the cell or leave it blank.";
    assert_eq!(sentence(text.as_bytes()), expected);
    let expected =
        "x.csv, row 2, column `accel_x`: expected a number, found `abc`; correct the cell or leave it blank.";
    assert_eq!(sentence(b"t,accel_x\n0,abc\n1,2\n"), expected);
    let expected = "x.csv, row 3, column `time`: expected a time such as 2024-05-31 12:00:00.5, found `later`; correct the cell or delete the row.";
    assert_eq!(sentence(b"time,accel_x\n2024-01-01 00:00:00,1\nlater,2\n"), expected);
}

#[test]
fn one_row_is_too_few() {
    assert_eq!(
        sentence(b"t,accel_x\n0,1\n"),
        "x.csv: expected at least 2 rows of data, found 1 (row 2); check that the recording or the export was not cut off."
    );
    assert_eq!(
        sentence(b"t,accel_x\n"),
        "x.csv: expected at least 2 rows of data, found 0 (after the header); check that the recording or the export was not cut off."
    );
}

#[test]
fn a_million_columns_are_refused_before_they_are_read() {
    // The reader has to stop within its first look, long before the 7 MB of the header are there.
    let header: String = (0..1_000_000).map(|i| format!("c{i},")).collect();
    let mut reader = CsvReader::new("x.csv");
    let mut taken = 0;
    let error = header.as_bytes().chunks(1 << 15).find_map(|slice| {
        taken += slice.len();
        reader.feed(slice).err()
    });
    assert_eq!(
        error.map(|e| e.to_string()).as_deref(),
        Some("x.csv, row 1: expected at most 4096 columns, found more; choose the columns to export.")
    );
    assert!(taken <= 128 << 10, "{taken}");
}

#[test]
fn a_line_without_end_is_refused() {
    let endless = "9".repeat(5 << 20);
    let expected =
        "x.csv, row 1: expected a line of at most 4194304 bytes, found a longer one; check that this is a CSV file.";
    assert_eq!(sentence(endless.as_bytes()), expected);
    let quoted = format!("t,accel_x\n{}0,\"{}", "0,1\n".repeat(40_000), "9\n".repeat(3 << 20));
    assert!(sentence(quoted.as_bytes()).contains("row 40002: expected a closing quote, found none"));
    let late = format!("t,accel_x\n{}0,{}", "0,1\n".repeat(40_000), "9".repeat(5 << 20));
    assert!(
        sentence(late.as_bytes()).contains("row 40002: expected a line of at most"),
        "{}",
        sentence(late.as_bytes())
    );
}

#[test]
fn a_quote_that_is_never_closed_is_refused() {
    let expected =
        "x.csv, row 3: expected a closing quote, found none; close or remove the quote that opens in this row.";
    assert_eq!(sentence(b"t,accel_x\n0,1\n1,\"2\n2,3\n"), expected);
    // The rest of the file is no row of thousands of columns, however long it is.
    for rows in [10_000, 2_000_000] {
        let mut long = String::from("t,accel_x\n0,1\n1,\"2\n");
        (2..rows).for_each(|i| long.push_str(&format!("{i},1\n")));
        assert_eq!(sentence(long.as_bytes()), expected);
    }
    let mut header = String::from("t,\"accel_x\n");
    (0..10_000).for_each(|i| header.push_str(&format!("{i},1\n")));
    assert!(
        sentence(header.as_bytes()).starts_with("x.csv, row 1: expected a closing quote"),
        "{}",
        sentence(header.as_bytes())
    );
    // In a cell of several lines the line of the quote counts, not that of the row.
    let inner = sentence(b"t,a,b\n0,\"x\ny\",1\n1,\"x\ny\",\"2\n2,x,3\n3,x,3\n");
    assert!(inner.starts_with("x.csv, row 5: "), "{inner}");
}

#[test]
fn names_met_twice_and_turned_names_are_explained() {
    let text = b"time [s],\"Speed, vehicle [km/h]\",speed,speed\n0,36,1,2\n1,36,1,2\n2,36,1,2\n";
    let (drive, report) = open_csv(&mut IoSource::new(&text[..], None), "x.csv", None).expect("it opens");
    assert_eq!(drive.wheels.len(), 3);
    let unused: Vec<_> = report.unused.iter().map(|u| (u.column.as_str(), u.reason.as_str())).collect();
    let taken = "speed is already taken from `speed`";
    assert_eq!(unused, [("Speed, vehicle", taken), ("speed (2)", taken)]);
    let text = b"time [s],\"Speed, vehicle [km/h]\"\n0,36\n1,36\n2,36\n";
    let (drive, _) = open_csv(&mut IoSource::new(&text[..], None), "x.csv", None).expect("it opens");
    assert_eq!(drive.wheels.at(0).1.speed, 10.0);
}

#[test]
fn columns_without_a_known_signal_are_named() {
    assert_eq!(
        sentence(b"t,foo,bar\n0,1,2\n1,2,3\n"),
        "x.csv, row 1: expected a column with a known signal (`accel_x`, `gyro_z`, `speed`, `gnss_lat`, ..), found `t`, `foo`, `bar`; rename the columns or give a mapping."
    );
}

#[test]
fn the_place_is_in_the_fields_too() {
    let error = open_csv(&mut IoSource::new(&b"t,accel_x\n0,1\n1,x\n2,3\n"[..], None), "x.csv", None).unwrap_err();
    assert_eq!((error.row(), error.column()), (Some(3), Some("accel_x")));
}
