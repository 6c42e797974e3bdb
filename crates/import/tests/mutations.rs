//! No reader panics, hangs or asks for absurd memory on a damaged file. Each sample is damaged in ways that a seed
//! decides; a failure names the sample and the seed. `DRIVESCOPE_MUTATIONS` is how many damaged files of each format
//! there are (`cargo xtask fuzz` sets it); `DRIVESCOPE_MUTATION=SAMPLE` or
//! `SAMPLE:SEED` are those only.

#![allow(clippy::unwrap_used)]

mod samples;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use drivescope_import::{MemorySource, Opening, Source, open_log};
use samples::Sample;

/// Damaged files of each format without the variable.
const FILES: u64 = 700;
/// The longest that a damaged file of at most some hundred kilobytes may take, s: an undamaged one takes a millisecond.
const LONGEST: f64 = 5.0;
/// A file that takes so long is taken for one that never ends, s.
const NEVER: u32 = 120;
/// Address space that the readers may ask for beyond what the process had before, KiB.
const MEMORY: u64 = 256 << 10;

/// xorshift64*: the same numbers on every platform.
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
}

/// Damage a file in one to eight places.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    // Headers decide most: half of the damage is done in the first part, some at the end, where directories are.
    for _ in 0..=random.below(8) {
        if bytes.is_empty() {
            return;
        }
        let at = match random.below(8) {
            0..4 => random.below(bytes.len().min(512)),
            4 => bytes.len() - 1 - random.below(bytes.len().min(128)),
            _ => random.below(bytes.len()),
        };
        damage_at(bytes, at, random);
    }
}

fn damage_at(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    const EXTREMES: [u64; 9] = [0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, u32::MAX as u64, i64::MAX as u64, u64::MAX];
    const TEXTS: [&[u8]; 10] =
        [b"99999999999999999999", b"-1", b"1e308", b"-1e999", b"nan", b"4294967295", b"", b"0", b"\n", b"\xff\xfe\0"];
    let some = |random: &mut Random| at..(at + 1 + random.below(64)).min(bytes.len());
    match random.below(10) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next() as u8,
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(at..(at + 1 + random.below(16)).min(bytes.len()))),
        4 => {
            let copy = bytes[some(random)].to_vec();
            let to = random.below(bytes.len());
            bytes.splice(to..to, copy);
        }
        5 => {
            let value = EXTREMES[random.below(EXTREMES.len())];
            let size = [1, 2, 4, 8][random.below(4)];
            let value = if random.below(4) == 0 { value.to_be_bytes() } else { value.to_le_bytes() };
            bytes.iter_mut().skip(at).zip(&value[..size]).for_each(|(b, v)| *b = *v);
        }
        6 => {
            // A number of a header, a little larger or smaller.
            let by = 1 + random.below(9) as u8;
            bytes[at] = if random.below(2) == 0 { bytes[at].wrapping_add(by) } else { bytes[at].wrapping_sub(by) };
        }
        7 => {
            let end = bytes[at..].iter().position(|b| !b.is_ascii_alphanumeric()).map_or(bytes.len(), |i| at + i);
            bytes.splice(at..end, TEXTS[random.below(TEXTS.len())].iter().copied());
        }
        8 if random.below(8) == 0 => {
            // Many times the same: what takes the square of the length shows itself.
            let copy = bytes[some(random)].repeat(1 << random.below(12));
            bytes.splice(at..at, copy);
        }
        _ => bytes[at] = b"0123456789.-,;eE \n\"<>/:#*"[random.below(25)],
    }
}

/// Whether a drive came out.
fn open(files: Vec<(&'static str, Vec<u8>)>) -> bool {
    let sources = files.into_iter().map(|(n, b)| Box::new(MemorySource::new(n, b)) as Box<dyn Source>).collect();
    let opened = Opening::new(sources).and_then(|mut opening| {
        while opening.step()? {}
        open_log(opening.finish()?, None)
    });
    match opened {
        Ok((drive, _)) => {
            let times = drive.imu.time();
            assert!(times.windows(2).all(|w| w[0] < w[1]), "time runs forward in what is given out");
            true
        }
        Err(error) => {
            let sentence = error.to_string();
            assert!(
                !sentence.contains('\n') && sentence.ends_with('.'),
                "a sentence has one line and an end: {sentence:?}"
            );
            false
        }
    }
}

/// The most address space that this process has had so far, KiB; `None` where the system does not tell.
fn most_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|l| l.strip_prefix("VmPeak:"))?.trim().strip_suffix(" kB")?.parse().ok()
}

/// Ends the process when a file takes for ever: a thread that never returns cannot be stopped from outside. Seconds are
/// counted, not measured: a machine that stands still for a while is no reader that hangs.
#[derive(Clone, Default)]
struct Watch(Arc<Mutex<Option<(String, u32)>>>);

impl Watch {
    fn start(&self) {
        let watch = self.clone();
        std::thread::spawn(move || {
            loop {
                std::thread::sleep(Duration::from_secs(1));
                if let Some((what, seconds)) = watch.0.lock().unwrap().as_mut() {
                    *seconds += 1;
                    if *seconds > NEVER {
                        eprintln!("{what}: the reader does not come to an end");
                        std::process::abort();
                    }
                }
            }
        });
    }
    fn now(&self, what: Option<String>) {
        *self.0.lock().unwrap() = what.map(|what| (what, 0));
    }
}

/// What came of the files of one format.
#[derive(Default)]
struct Count {
    files: u64,
    opened: u64,
    longest: f64,
}

/// One damaged copy of a sample; what went wrong with it.
fn one(sample: &Sample, seed: u64, count: &mut Count, watch: &Watch) -> Option<String> {
    let place = format!("{}, seed {seed}", sample.name);
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut files = sample.files.clone();
    // One in eight damages the database of a bus log instead of the log.
    let which = if random.below(8) == 0 { files.len() - 1 } else { 0 };
    damage(&mut files[which].1, &mut random);
    let before = most_memory();
    let mut took = f64::INFINITY;
    // A machine may stand still for a while: what takes long is tried once more.
    for _ in 0..2 {
        let (begin, files) = (Instant::now(), files.clone());
        watch.now(Some(place.clone()));
        let outcome = catch_unwind(AssertUnwindSafe(|| open(files)));
        watch.now(None);
        if outcome.is_err() {
            return Some(format!("{place}: the reader panicked"));
        }
        took = begin.elapsed().as_secs_f64();
        count.opened += u64::from(outcome.unwrap_or(false) && took < LONGEST);
        if took < LONGEST {
            break;
        }
    }
    count.files += 1;
    count.longest = count.longest.max(took);
    if took >= LONGEST {
        return Some(format!("{place}: {took:.1} s"));
    }
    let more = most_memory()?.saturating_sub(before?);
    (more > MEMORY).then(|| format!("{place}: {} MB of memory", more >> 10))
}

#[test]
fn no_reader_panics_or_hangs_on_damaged_files() {
    let files = std::env::var("DRIVESCOPE_MUTATIONS").ok().and_then(|v| v.parse().ok()).unwrap_or(FILES);
    let only = std::env::var("DRIVESCOPE_MUTATION").ok();
    let samples = samples::all();
    let format = |sample: &Sample| match sample.name.split(' ').next().unwrap_or_default() {
        "kitti" => "oxts",
        "npz" => "npy",
        "csv.gz" => "gzip",
        "sensor" | "phyphox" => "zip",
        name => name,
    };
    let watch = Watch::default();
    watch.start();
    let mut counts = BTreeMap::<&str, Count>::new();
    let mut failures = Vec::new();
    for sample in &samples {
        let kinds = samples.iter().filter(|s| format(s) == format(sample)).count() as u64;
        let count = counts.entry(format(sample)).or_default();
        for seed in 1..=files.div_ceil(kinds) {
            if only.as_ref().is_none_or(|o| *o == sample.name || *o == format!("{}:{seed}", sample.name)) {
                failures.extend(one(sample, seed, count, &watch));
            }
        }
        if files > FILES {
            println!("{}: {} failures so far", sample.name, failures.len());
        }
    }
    for (name, Count { files, opened, longest }) in counts {
        println!("{name}: {files} damaged files, {opened} opened all the same, {longest:.3} s at most");
    }
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures[..failures.len().min(40)].join("\n"));
}
