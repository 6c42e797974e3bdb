//! The second table of a drive: raw satellite ranges, one row per satellite and instant.

use drivescope_drive::drive::Drive;
use drivescope_drive::satellites::{RAW_COLUMNS, RawGnss, Satellite};

use crate::clock;
use crate::error::{ImportError, form};
use crate::mapping::TimeSource;
use crate::table::{RawColumn, Table};
use crate::units;

/// Cells without which a row says nothing: `prn`, the satellite's place and the pseudorange.
const NEEDED: [usize; 5] = [0, 1, 2, 3, 7];

/// Whether a table holds raw ranges rather than a log: it has `prn` and `pr`.
pub fn is_raw_gnss(table: &Table) -> bool {
    ["prn", "pr"].iter().all(|name| table.column(name).is_some())
}

/// The raw ranges of a table with the columns `t` (s, on the log's clock) and [`RAW_COLUMNS`].
///
/// `offset` is what the log's mapping adds to its own time, s. A row without time, number, place or range is left out;
/// velocities and rates may be missing. `sat_*` are Earth-centred and Earth-fixed, m and m/s.
///
/// # Errors
/// [`ImportError::RawColumn`] for a missing column, [`ImportError::TimeBackwards`], [`ImportError::TooFewTimes`], and
/// [`ImportError::RawRow`] for a `prn` that is no satellite's number.
pub fn raw_gnss(table: &Table, offset: f64) -> Result<RawGnss, ImportError> {
    let missing = |column: &'static str| ImportError::RawColumn {
        file: table.name.clone(),
        place: table.header_place(),
        column,
        found: table.columns_found(),
    };
    let clock = table.column("t").ok_or_else(|| missing("t"))?;
    let columns = RAW_COLUMNS.map(|name| table.column(name));
    if let Some(index) = NEEDED.into_iter().find(|&i| columns[i].is_none()) {
        return Err(missing(RAW_COLUMNS[index]));
    }
    let unit = clock.unit.clone().filter(|u| units::factor(u, "s").is_some()).unwrap_or_else(|| "s".into());
    let times = clock::times(table, &TimeSource { offset, ..TimeSource::plain("t", &unit) })?;
    let (mut raw, mut view, mut since) = (RawGnss::default(), Vec::new(), f64::NAN);
    for (row, &time) in times.iter().enumerate() {
        let cells = columns.map(|c: Option<&RawColumn>| c.map_or(f64::NAN, |c| c.values[row]));
        if !time.is_finite() || NEEDED.iter().any(|&i| !cells[i].is_finite()) {
            continue;
        }
        if cells[0] < 0.0 || cells[0] > f64::from(u16::MAX) || cells[0].fract() != 0.0 {
            return Err(ImportError::RawRow { file: table.name.clone(), row: table.line_of(row), found: cells[0] });
        }
        if time != since {
            close(&mut raw, since, &mut view);
            since = time;
        }
        view.push(Satellite::of_cells(&cells));
    }
    close(&mut raw, since, &mut view);
    Ok(raw)
}

/// Take the table of raw ranges out of the tables of a log.
///
/// # Errors
/// [`ImportError::Nothing`] where there are several.
pub(crate) fn take_raw(tables: &mut Vec<Table>) -> Result<Option<Table>, ImportError> {
    let Some(index) = tables.iter().position(is_raw_gnss) else { return Ok(None) };
    let ranges = tables.remove(index);
    let name = &ranges.name;
    match tables.iter().find(|t| is_raw_gnss(t)) {
        Some(other) => {
            let what = "expected one table of raw ranges, found two; open the log with one.";
            Err(ImportError::Nothing { sentence: format!("{name} and {}: {what}", other.name) })
        }
        None => Ok(Some(ranges)),
    }
}

/// Give a drive its raw ranges; what there are, in words. `offset` as in [`raw_gnss`].
///
/// # Errors
/// Those of [`raw_gnss`], and [`ImportError::Form`] where they are of another time.
pub(crate) fn add_raw(drive: &mut Drive, table: &Table, offset: f64) -> Result<String, ImportError> {
    let raw = raw_gnss(table, offset)?;
    if let (Some((start, end)), false) = (drive.span(), raw.is_empty()) {
        let (first, last) = (raw.at(0).0, raw.at(raw.len() - 1).0);
        if last < start || first > end {
            let expected = format!("times within those of the log, {start:.1} to {end:.1} s");
            let found = format!("{first:.1} to {last:.1} s");
            return Err(form(&table.name, "column `t`".into(), &expected, &found, "give both the same clock"));
        }
    }
    let note = format!("{}: raw ranges of satellites at {} instants belong to this drive.", table.name, raw.len());
    drive.raw_gnss = raw;
    Ok(note)
}

/// Put the satellites of an instant in their place. Times run forward here: `clock::times` has seen to that.
fn close(raw: &mut RawGnss, time: f64, view: &mut Vec<Satellite>) {
    let _ = raw.push(time, view);
    view.clear();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::IoSource;

    fn read(text: &str) -> Result<RawGnss, String> {
        let table = crate::read_csv(&mut IoSource::new(text.as_bytes(), None), "raw.csv").unwrap();
        raw_gnss(&table, 10.0).map_err(|e| e.to_string())
    }

    #[test]
    fn rows_of_an_instant_are_its_satellites_and_an_incomplete_row_is_none() {
        let text = "t,prn,sat_x,sat_y,sat_z,sat_vx,sat_vy,sat_vz,pr,prr\n0,3,1,2,3,4,5,6,7,8\n0,9,1,2,3,,,,7,\n\
                    1,4,1,2,3,4,5,6,,8\n2,5,1,2,3,4,5,6,7,8\n";
        let raw = read(text).unwrap();
        let seen: Vec<(f64, Vec<u32>)> = raw.iter().map(|(t, s)| (t, s.iter().map(|s| s.prn).collect())).collect();
        assert_eq!(seen, [(10.0, vec![3, 9]), (12.0, vec![5])]);
        assert_eq!(raw.at(0).1[0].cells(), [3.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert!(raw.at(0).1[1].rate.is_nan());
    }

    #[test]
    fn what_is_written_is_read_back_to_the_last_bit() {
        let mut raw = RawGnss::default();
        for k in 0..40 {
            let t = 10.0 + f64::from(k);
            let cells: [f64; 9] = std::array::from_fn(|i| if i == 0 { 5.0 } else { 2.0e7 / 3.0 * (i as f64 + t) });
            raw.push(t, &[Satellite::of_cells(&cells); 3]).unwrap();
        }
        let mut text = Vec::new();
        drivescope_drive::csv::write_raw_gnss(&raw, &mut text).unwrap();
        let table = crate::read_csv(&mut IoSource::new(text.as_slice(), None), "raw.csv").unwrap();
        assert!(is_raw_gnss(&table));
        assert_eq!(raw_gnss(&table, 0.0).unwrap(), raw);
    }

    #[test]
    fn what_is_wrong_is_one_sentence_with_its_place() {
        assert_eq!(
            read("t,prn,sat_x,sat_y,pr\n0,1,2,3,4\n1,1,2,3,4\n").unwrap_err(),
            "raw.csv, row 1: expected the column `sat_z` of a table of raw ranges (`t`, `prn`, `sat_x`, .., `pr`), found `t`, `prn`, `sat_x`, `sat_y`, `pr`; rename the columns."
        );
        assert_eq!(
            read("t,prn,sat_x,sat_y,sat_z,pr\n0,1,2,3,4,5\n1,1.5,2,3,4,5\n").unwrap_err(),
            "raw.csv, row 3, column `prn`: expected the number of a satellite, found 1.5; correct the cell or delete the row."
        );
        assert!(read("t,prn,sat_x,sat_y,sat_z,pr\n1,1,2,3,4,5\n0,1,2,3,4,5\n").unwrap_err().contains("time runs"));
    }
}
