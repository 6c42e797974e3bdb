//! However a text is cut into slices and shared between threads, the same comes out of it: rows, their lines, warnings, or
//! the same sentence.

#![allow(clippy::unwrap_used)]

use drivescope_import::{CsvReader, ImportError, Table};

/// xorshift64*: the same texts on every platform.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }
    fn below(&mut self, limit: usize) -> usize {
        (self.next() >> 16) as usize % limit.max(1)
    }
    fn one_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }
}

/// What a text is made of.
struct Style {
    separator: char,
    end: &'static str,
    /// One row in so many is odd; 0 for none.
    odd: usize,
    /// One row in so many is wrong; 0 for none.
    wrong: usize,
    sparse: bool,
}

fn number(random: &mut Random, comma: bool) -> String {
    let digits = random.below(12);
    let value = (random.next() as i64) as f64 / 10f64.powi(12 + random.below(8) as i32);
    let text = match random.below(12) {
        0 => format!("{}", random.below(2000)),
        1 => format!("{value:e}"),
        2 => format!("{value}"),
        3 => "nan".into(),
        4 => String::new(),
        _ => format!("{value:.digits$}"),
    };
    if comma { text.replace('.', ",") } else { text }
}

/// A row that is no plain one and still right.
fn odd_row(random: &mut Random, cells: &mut [String], separator: &str, end: &str) -> String {
    let at = 1 + random.below(cells.len() - 1);
    match random.below(9) {
        0 => return format!("# a \"comment{end}"),
        1 => return end.to_owned(),
        2 => return format!("// 1,2,3{end}"),
        3 => cells[at] = format!(" \"{}\"", cells[at]),
        4 => cells[at] = format!("  {} ", cells[at]),
        5 => cells[at] = "-inf".into(),
        6 => cells[at] = "1e999".into(),
        7 if random.one_in(2) => {
            // Lines in quotes that look like rows.
            let inner = format!("{}word{end}", format!("7{separator}").repeat(cells.len() - 1)).repeat(3);
            *cells.last_mut().unwrap() = format!("\"two{end}{inner}\"");
        }
        7 => *cells.last_mut().unwrap() = format!("\"two{end}lines, \"\"1\"\"{end}\""),
        _ => *cells.last_mut().unwrap() = "\"# 1,5\"".into(),
    }
    String::new()
}

/// A log; `long` ones have more regular rows at their head than the reader looks at before it decides on the layout.
fn text(random: &mut Random, style: &Style, long: bool) -> Vec<u8> {
    let (columns, rows) = (3 + random.below(6), 200 + random.below(600));
    let separator = style.separator.to_string();
    let join = |cells: &[String]| cells.join(&separator) + style.end;
    let mut text = join(&(0..columns).map(|i| if i == 0 { "t".into() } else { format!("a{i}") }).collect::<Vec<_>>());
    let comma = style.separator == ';';
    if long {
        let row =
            join(&(0..columns).map(|i| if i + 1 == columns { "word".into() } else { "1".into() }).collect::<Vec<_>>());
        text.push_str(&row.repeat((66 << 10) / row.len()));
    }
    for row in 0..rows {
        let mut cells: Vec<String> = (0..columns).map(|_| number(random, comma)).collect();
        cells[0] = format!("{}", row as f64 / 100.0).replace('.', if comma { "," } else { "." });
        if style.sparse && !row.is_multiple_of(7) {
            cells[1].clear();
        }
        *cells.last_mut().unwrap() = ["start", "", "brake hard", "nan", "if"][random.below(5)].to_owned();
        if row > 40 && style.odd > 0 && random.one_in(style.odd) {
            let line = odd_row(random, &mut cells, &separator, style.end);
            if !line.is_empty() {
                text.push_str(&line);
                continue;
            }
        }
        if row > 40 && style.wrong > 0 && random.one_in(style.wrong) {
            match random.below(3) {
                0 => cells[1] = "12:x".into(),
                1 => cells.truncate(2),
                _ => cells.push("7".into()),
            }
        }
        if random.one_in(50) {
            cells.push(String::new());
        }
        text.push_str(&join(&cells));
    }
    text.truncate(text.len() - [0, style.end.len(), 3][random.below(3)]);
    text.into_bytes()
}

fn read(bytes: &[u8], threads: (usize, usize), mut slice: impl FnMut() -> usize) -> Result<Table, ImportError> {
    let mut reader = CsvReader::new("x.csv");
    reader.split(threads.0, threads.1);
    let mut rest = bytes;
    while !rest.is_empty() {
        let (taken, after) = rest.split_at(slice().clamp(1, rest.len()));
        reader.feed(taken)?;
        rest = after;
    }
    reader.finish()
}

/// Everything that comes out, values as bits, since NaN is not equal to itself.
fn outcome(result: Result<Table, ImportError>) -> String {
    match result {
        Err(error) => error.to_string(),
        Ok(table) => {
            let lines: Vec<usize> = (0..table.rows).map(|r| table.line_of(r)).collect();
            let columns: Vec<_> = table
                .columns
                .iter()
                .map(|c| (&c.name, c.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>()))
                .collect();
            format!("{columns:?} {lines:?} {:?} {:?} {:?}", table.text_columns, table.warnings, table.layout)
        }
    }
}

#[test]
fn slices_and_threads_change_nothing_in_what_is_read() {
    // Would catch a border inside quotes taken for the start of a row, a row counted twice or not at all at a border, a
    // warning counted twice when a row is met again, line numbers that start anew in a part, and numbers that are parsed
    // otherwise near the end of a slice.
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (mut read_well, mut refused) = (0, 0);
    for round in 0..48 {
        let style = Style {
            separator: [',', ';', '\t', '|'][round % 4],
            end: ["\n", "\r\n", "\n", "\r"][round / 4 % 4],
            odd: [0, 40, 8, 3][round / 16 % 4],
            wrong: [0, 0, 150][round % 3],
            sparse: round.is_multiple_of(5),
        };
        for long in [true, true, false] {
            let bytes = text(&mut random, &style, long);
            let whole = read(&bytes, (1, 1), || bytes.len());
            if whole.is_ok() {
                read_well += 1
            } else {
                refused += 1
            }
            let whole = outcome(whole);
            for (threads, least, largest) in
                [(2, 1, 1 << 20), (5, 300, 1 << 20), (3, 64, 5000), (1, 1, 3000), (8, 1, 700)]
            {
                let cut = outcome(read(&bytes, (threads, least), || 1 + random.below(largest)));
                let rest = whole.bytes().zip(cut.bytes()).take_while(|(a, b)| a == b).count().saturating_sub(200);
                let [a, b] = [&whole, &cut].map(|s| s.get(rest..).unwrap_or_default());
                assert!(whole == cut, "round {round}, {threads} threads:\n{a:.600}\n{b:.600}");
            }
        }
    }
    assert!(read_well > 60 && refused > 10, "{read_well} {refused}");
}

#[test]
fn a_row_whose_quotes_are_cut_is_warned_of_once() {
    // A row that begins in one slice and ends in the next was parsed twice, and its infinite value counted twice.
    let mut bytes = b"t,a,b\n".to_vec();
    (0..9000).for_each(|i| bytes.extend_from_slice(format!("{i},1,word\n").as_bytes()));
    let cut = bytes.len() + 20;
    bytes.extend_from_slice(b"9001,1e999,\"two\nlines\"\n9002,2,word\n");
    let mut rest = [cut, usize::MAX].into_iter();
    let table = read(&bytes, (1, 1), || rest.next().unwrap_or(1)).unwrap();
    assert_eq!(table.warnings.len(), 1);
    assert_eq!(table.warnings[0].count, 1, "{:?}", table.warnings);
}
