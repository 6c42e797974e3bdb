//! No reader panics or hangs on a damaged file. Each sample is damaged in ways that a seed decides; a failure names the
//! sample and the seed. `DRIVESCOPE_MUTATIONS` is how often each is damaged; `DRIVESCOPE_MUTATION=SAMPLE:SEED` is one only.

#![allow(clippy::unwrap_used)]

mod samples;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use drivescope_import::{MemorySource, Opening, Source, open_log};

/// Damaged copies of each sample without the variable.
const COPIES: u64 = 500;
/// The longest that a damaged file of a few kilobytes may take, s: an undamaged one takes a millisecond.
const LONGEST: f64 = 5.0;

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
    const EXTREMES: [u64; 8] = [0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, u32::MAX as u64, u64::MAX];
    // Headers decide most: half of the damage is done in the first part.
    for _ in 0..=random.below(8) {
        let reach = if random.below(2) == 0 { bytes.len() } else { bytes.len().min(512) };
        let at = random.below(reach);
        match random.below(7) {
            _ if bytes.is_empty() => return,
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..(at + 1 + random.below(16)).min(bytes.len()))),
            4 => {
                let end = (at + 1 + random.below(64)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            5 => {
                let value = EXTREMES[random.below(EXTREMES.len())].to_le_bytes();
                let size = [1, 2, 4, 8][random.below(4)];
                bytes.iter_mut().skip(at).zip(&value[..size]).for_each(|(b, v)| *b = *v);
            }
            _ => {
                let digit = b"0123456789.-,;eE \n\"<>/:#*"[random.below(25)];
                bytes[at] = digit;
            }
        }
    }
}

fn open(files: Vec<(&'static str, Vec<u8>)>) {
    let sources = files.into_iter().map(|(n, b)| Box::new(MemorySource::new(n, b)) as Box<dyn Source>).collect();
    let Ok(mut opening) = Opening::new(sources) else { return };
    loop {
        match opening.step() {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => return check(&error.to_string()),
        }
    }
    match opening.finish().and_then(|log| open_log(log, None)) {
        Ok((drive, _)) => {
            let times = drive.imu.time();
            assert!(times.windows(2).all(|w| w[0] < w[1]), "time runs forward in what is given out");
        }
        Err(error) => check(&error.to_string()),
    }
}

/// A sentence has one line and an end.
fn check(sentence: &str) {
    assert!(!sentence.contains('\n') && sentence.ends_with('.'), "{sentence:?}");
}

#[test]
fn no_reader_panics_or_hangs_on_damaged_files() {
    let copies = std::env::var("DRIVESCOPE_MUTATIONS").ok().and_then(|v| v.parse().ok()).unwrap_or(COPIES);
    let only = std::env::var("DRIVESCOPE_MUTATION").ok();
    for sample in samples::all() {
        for seed in 1..=copies {
            if only.as_ref().is_some_and(|o| *o != format!("{}:{seed}", sample.name)) {
                continue;
            }
            let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let mut files = sample.files.clone();
            // One in eight damages the database of a bus log instead of the log.
            let which = if random.below(8) == 0 { files.len() - 1 } else { 0 };
            damage(&mut files[which].1, &mut random);
            let mut took = f64::INFINITY;
            // A machine may stand still for a while: what takes long is tried once more.
            for _ in 0..2 {
                let (begin, files) = (Instant::now(), files.clone());
                let outcome = catch_unwind(AssertUnwindSafe(|| open(files)));
                assert!(outcome.is_ok(), "{}, seed {seed}: the reader panicked", sample.name);
                took = begin.elapsed().as_secs_f64();
                if took < LONGEST {
                    break;
                }
            }
            assert!(took < LONGEST, "{}, seed {seed}: {took:.1} s", sample.name);
        }
    }
}
