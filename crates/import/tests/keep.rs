//! A part of a file instead of all of it: columns, a range of time, every nth row; and what does not fit is refused early.

#![allow(clippy::unwrap_used)]

use drivescope_import::{CsvReader, ImportError, Keep, MemorySource, Opening, Table, open_table};

/// 100 Hz for `rows` rows, a speed at 10 Hz, a position at 1 Hz, and a column of text.
fn log(rows: usize) -> Vec<u8> {
    let mut text = String::from("time [ms],accel_x,speed,gnss_lat,gnss_lon,note,gyro_z\n");
    for row in 0..rows {
        let speed = if row.is_multiple_of(10) { format!("{}", 10.0 + row as f64 * 0.01) } else { String::new() };
        let place = if row % 100 == 7 { format!("{},11.5", 48.0 + row as f64 * 1e-7) } else { ",".into() };
        let note = if row % 50 == 20 { "\"a \"\"word\"\",\nand\"" } else { "b" };
        text += &format!("{},{},{speed},{place},{note},{}\n", 5000 + 10 * row, row, row % 9);
        if row % 1000 == 500 {
            text += "# a comment\n";
        }
    }
    text.into_bytes()
}

fn read(bytes: &[u8], keep: Keep, threads: usize) -> Result<Table, ImportError> {
    let mut reader = CsvReader::new("x.csv");
    reader.expect_bytes(bytes.len() as u64);
    reader.split(threads, 1000);
    reader.keep(keep);
    for slice in bytes.chunks(30_000) {
        reader.feed(slice)?;
    }
    reader.finish()
}

fn whole(bytes: &[u8]) -> Table {
    read(bytes, Keep::default(), 1).unwrap()
}

fn names(table: &Table) -> Vec<&str> {
    table.columns.iter().map(|c| c.name.as_str()).collect()
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn chosen_columns_hold_what_they_hold_in_the_whole_file() {
    // Would catch a column that is left out but still counted as a cell, and one that is kept under a wrong name.
    let bytes = log(6000);
    let all = whole(&bytes);
    for threads in [1, 3] {
        let keep = Keep { columns: vec!["gyro_z".into(), "speed".into()], ..Keep::default() };
        let part = read(&bytes, keep, threads).unwrap();
        assert_eq!(names(&part), ["time", "speed", "gyro_z"], "the clock is kept though nobody named it");
        assert!(part.text_columns.is_empty());
        for column in &part.columns {
            assert!(bits(&column.values) == bits(&all.column(&column.name).unwrap().values), "{}", column.name);
        }
        assert_eq!([0, 21, 700].map(|r| part.line_of(r)), [0, 21, 700].map(|r| all.line_of(r)));
        assert!(part.warnings[0].message.contains("2 columns beside the clock"), "{:?}", part.warnings);
    }
}

#[test]
fn a_column_that_is_left_out_may_hold_anything() {
    let mut bytes = b"t,a,b\n".to_vec();
    (0..20_000).for_each(|i| bytes.extend_from_slice(format!("{i},{i},1\n").as_bytes()));
    bytes.extend_from_slice(b"20000,oops,1\n20001,1e999,\"x\ny\"\n20002,3,1\n");
    assert!(matches!(read(&bytes, Keep::default(), 2), Err(ImportError::NotANumber { row: 20_002, .. })));
    let part = read(&bytes, Keep { columns: vec!["b".into()], ..Keep::default() }, 2);
    assert!(matches!(part, Err(ImportError::NotANumber { row: 20_003, .. })), "what is kept is looked at: {part:?}");
    let keep = Keep { columns: vec!["t".into()], ..Keep::default() };
    assert_eq!(read(&bytes, keep, 2).unwrap().rows, 20_003);
}

#[test]
fn a_range_of_time_is_counted_from_the_first_row_in_seconds() {
    // Would catch a range in the file's own unit (ms), and one off by a row at either end.
    let bytes = log(6000);
    let part = read(&bytes, Keep { from: Some(10.0), to: Some(12.0), ..Keep::default() }, 3).unwrap();
    assert_eq!((part.rows, part.columns[0].values[0], part.columns[0].values[200]), (201, 15_000.0, 17_000.0));
    assert_eq!(part.line_of(0), whole(&bytes).line_of(1000));
    let open = read(&bytes, Keep { from: Some(59.0), ..Keep::default() }, 1).unwrap();
    assert_eq!(open.rows, 100);
}

#[test]
fn every_nth_row_keeps_the_values_of_slower_sensors() {
    // Would catch a decimation that throws away nearly all fixes because their rows are none of the nth ones.
    let bytes = log(6000);
    let (all, part) = (whole(&bytes), read(&bytes, Keep { every: 4, ..Keep::default() }, 2).unwrap());
    let counted = |t: &Table, name: &str| t.column(name).unwrap().values.iter().filter(|v| v.is_finite()).count();
    for slow in ["speed", "gnss_lat"] {
        assert_eq!(counted(&part, slow), counted(&all, slow), "{slow}");
    }
    assert!((1500..=2160).contains(&part.rows), "{}", part.rows);
    let clock = &all.columns[0].values;
    let rows: Vec<usize> = part.columns[0].values.iter().map(|t| clock.iter().position(|c| c == t).unwrap()).collect();
    for (row, &of) in rows.iter().enumerate() {
        assert_eq!(part.columns[1].values[row], all.columns[1].values[of]);
        assert_eq!(part.line_of(row), all.line_of(of));
    }
    let (drive, _) = open_table(part, None).unwrap();
    assert_eq!(drive.gnss.len(), 60);
}

#[test]
fn a_file_that_will_not_fit_is_refused_by_its_head_with_an_offer_that_fits() {
    let bytes = log(30_000);
    let memory = Some(600_000);
    let mut reader = CsvReader::new("x.csv");
    reader.expect_bytes(bytes.len() as u64);
    reader.keep(Keep { memory, ..Keep::default() });
    let error = bytes.chunks(64 << 10).take(2).try_for_each(|slice| reader.feed(slice)).unwrap_err();
    let sentence = error.to_string();
    let ImportError::TooLarge { needed, limit, rows, columns, offer, .. } = error else { panic!("{sentence}") };
    assert_eq!((limit, columns), (1, 6), "{sentence}");
    assert!((1..=3).contains(&needed) && (29_000..36_000).contains(&rows), "{sentence}");
    assert!(sentence.ends_with(&format!("read {offer}.")) && sentence.contains("at most"), "{sentence}");
    // Every offer is one that is taken.
    let seconds = Keep { to: Some(offer.seconds - 1.0), memory, ..Keep::default() };
    assert!(read(&bytes, seconds, 1).unwrap().rows > 6000);
    let every = Keep { every: offer.every + 1, memory, ..Keep::default() };
    assert!(read(&bytes, every, 1).unwrap().rows > 5000);
    let roomy = Some(1_500_000);
    let Err(ImportError::TooLarge { offer, .. }) = read(&bytes, Keep { memory: roomy, ..Keep::default() }, 1) else {
        panic!("2 MB fit into 1.5 MB");
    };
    assert!((2..=4).contains(&offer.columns), "{offer:?}");
    let columns = ["accel_x", "speed", "gyro_z", "gnss_lat"][..offer.columns].iter().map(|c| (*c).to_owned()).collect();
    assert_eq!(read(&bytes, Keep { columns, memory: roomy, ..Keep::default() }, 1).unwrap().rows, 30_000);
}

#[test]
fn the_door_keeps_a_part_of_every_csv_it_meets() {
    let open = |keep: Keep| {
        let source = MemorySource::new("log.csv", log(6000));
        let mut opening = Opening::new(vec![Box::new(source)])?;
        opening.keep(keep);
        while opening.step()? {}
        opening.finish()
    };
    let part = open(Keep { columns: vec!["speed".into()], to: Some(10.0), ..Keep::default() }).unwrap();
    assert_eq!((names(&part.tables[0]), part.tables[0].rows), (vec!["time", "speed"], 1001));
    assert!(matches!(open(Keep { memory: Some(1000), ..Keep::default() }), Err(ImportError::TooLarge { .. })));
}

#[test]
fn a_file_of_unknown_length_is_refused_when_its_rows_no_longer_fit() {
    // Standard input has no length: the rows are counted as they come.
    let bytes = log(30_000);
    let mut reader = CsvReader::new("x.csv");
    reader.keep(Keep { memory: Some(400_000), ..Keep::default() });
    let taken = bytes.chunks(10_000).take_while(|slice| reader.feed(slice).is_ok()).count();
    assert!((10..60).contains(&taken), "{taken} of {} slices", bytes.len() / 10_000);
}
