//! A drive written as CSV reads back bit for bit: what was measured is not changed by saving it.
#![allow(clippy::unwrap_used)]

use drivescope_drive::channel::{Channel, Record, Series};
use drivescope_drive::csv::{write_drive, write_raw_gnss};
use drivescope_drive::drive::Drive;
use drivescope_import::{CsvReader, Mapping, Table, open_table, raw_gnss};
use drivescope_simulation::{Simulation, drives, named};

fn table(name: &str, text: &[u8]) -> Table {
    let mut reader = CsvReader::new(name);
    text.chunks(1 << 16).for_each(|slice| reader.feed(slice).unwrap());
    reader.finish().unwrap()
}

/// The mapping under which every column is what its name says: noise is no reason to doubt units.
fn by_name(table: &Table) -> Mapping {
    let names = table.columns.iter().map(|c| c.name.as_str()).filter(|n| *n != "t");
    let signals: Vec<String> = names.map(|n| format!("\"{n}\": {{\"column\": \"{n}\"}}")).collect();
    let text = format!("{{\"version\": 1, \"time\": {{\"column\": \"t\"}}, \"signals\": {{{}}}}}", signals.join(", "));
    Mapping::from_json(&text, "mapping.json").unwrap()
}

fn read_back(drive: &Drive, proposed: bool) -> Drive {
    let (mut text, mut raw) = (Vec::new(), Vec::new());
    write_drive(drive, &mut text).unwrap();
    let found = table(&drive.name, &text);
    let mapping = if proposed { None } else { Some(by_name(&found)) };
    let (mut read, report) = open_table(found, mapping.as_ref()).unwrap();
    assert!(report.unused.is_empty(), "{}: {:?}", drive.name, report.unused);
    if !drive.raw_gnss.is_empty() {
        write_raw_gnss(&drive.raw_gnss, &mut raw).unwrap();
        read.raw_gnss = raw_gnss(&table("raw.csv", &raw), 0.0).unwrap();
    }
    read
}

/// Times and columns bit for bit; a column without any value is not written, and one blank is as good as another.
fn assert_same(written: &Series, read: &Series, what: &str) {
    let bits = |v: &f64| if v.is_finite() { v.to_bits() } else { f64::NAN.to_bits() };
    assert_eq!(written.time().len(), read.time().len(), "{what}");
    assert!(written.time().iter().map(bits).eq(read.time().iter().map(bits)), "{what}: times");
    for (index, column) in written.schema().iter().enumerate() {
        let values = written.column_at(index);
        let Some(again) = read.column(column.name) else {
            assert!(!values.iter().any(|v| v.is_finite()), "{what}: {} is lost", column.name);
            continue;
        };
        if let Some(row) = (0..values.len()).find(|&r| bits(&values[r]) != bits(&again[r])) {
            panic!("{what}: {}, row {row}: {:e} became {:e}", column.name, values[row], again[row]);
        }
    }
}

fn assert_same_drive(written: &Drive, read: &Drive) {
    for (one, other) in written.channels().into_iter().zip(read.channels()).chain([(&written.truth, &read.truth)]) {
        assert_same(one, other, &written.name);
    }
    assert_eq!(written.raw_gnss.len(), read.raw_gnss.len());
    for ((t, satellites), (u, again)) in written.raw_gnss.iter().zip(read.raw_gnss.iter()) {
        assert_eq!(t.to_bits(), u.to_bits());
        assert_eq!(satellites.len(), again.len());
        for (a, b) in satellites.iter().zip(again) {
            assert_eq!(a.cells().map(f64::to_bits), b.cells().map(f64::to_bits));
        }
    }
}

#[test]
fn every_built_in_drive_reads_back_bit_for_bit() {
    // Would catch degrees that do not give the radians back, too few digits, and rows that are lost or joined.
    for drive in drives() {
        let mut simulation = Simulation::new(&named(drive.name).unwrap(), None).unwrap();
        simulation.advance(60.0);
        let live = simulation.drive();
        assert_same_drive(live, &read_back(live, true));
    }
}

/// xorshift64*: the same numbers on every platform.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// Any finite number: of any size, an angle, a subnormal, a zero of either sign, or an edge.
    fn number(&mut self) -> f64 {
        const EDGES: [f64; 10] =
            [0.0, -0.0, 5e-324, -5e-324, f64::MIN_POSITIVE, f64::MAX, f64::MIN, 1e22, 9007199254740993.0, 0.1];
        let bits = self.next();
        let value = match self.next() >> 61 {
            0..3 => f64::from_bits(bits),
            3..6 => (bits as i64) as f64 * (std::f64::consts::PI / 9.3e18),
            6 => f64::from_bits(bits & ((1 << 63) | ((1 << 52) - 1))),
            _ => EDGES[(bits >> 32) as usize % EDGES.len()],
        };
        if value.is_finite() { value } else { -0.0 }
    }
}

/// A channel of random numbers; of two neighbouring ones not both are 0, since nobody is at latitude and longitude 0.
fn channel<R: Record>(random: &mut Random, rows: usize) -> Channel<R> {
    let time = (0..rows).map(|row| row as f64 * 0.01 + 0.1 / 3.0).collect();
    let mut number = |zero: bool| Some(random.number()).filter(|v| zero || *v != 0.0).unwrap_or(f64::MIN_POSITIVE);
    let columns =
        (0..R::COLUMNS.len()).map(|i| (0..rows).map(|row| number((row + i).is_multiple_of(2))).collect()).collect();
    Channel::from_columns(time, columns).unwrap()
}

#[test]
fn any_finite_number_in_any_channel_reads_back_bit_for_bit() {
    // Would catch digits that are lost of very small and very large numbers, a lost sign of zero, and angles between those
    // that degrees can give.
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for round in 0..4 {
        let rows = 3000;
        let drive = Drive {
            name: format!("random {round}"),
            imu: channel(&mut random, rows),
            mag: channel(&mut random, rows),
            wheels: channel(&mut random, rows),
            steering: channel(&mut random, rows),
            gnss: channel(&mut random, rows),
            baro: channel(&mut random, rows),
            accel_array: channel(&mut random, rows),
            range: channel(&mut random, rows),
            ..Drive::default()
        };
        assert_same_drive(&drive, &read_back(&drive, false));
    }
}
