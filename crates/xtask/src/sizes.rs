//! What the page weighs after gzip, and how much it may.

use crate::failure::{Explain, Result, fail};
use crate::place::Place;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The core may weigh this many bytes after gzip.
pub const WASM_BUDGET: usize = 400_000;
/// Everything that the page loads may weigh this many bytes after gzip.
pub const PAGE_BUDGET: usize = 600_000;

/// Gzipped bytes of the built page.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Weight {
    /// All WebAssembly files.
    pub wasm: usize,
    /// All files but source maps, which only a debugger loads.
    pub page: usize,
}

/// Print the sizes of all files of `web/dist`.
///
/// # Errors
///
/// A file cannot be read, or a budget is exceeded.
pub fn print_and_judge(place: &Place) -> Result<()> {
    let weight = print(&place.dist())?;
    judge(weight)
}

/// Print and add up the sizes of all files below a folder.
///
/// # Errors
///
/// A file cannot be read.
pub fn print(folder: &Path) -> Result<Weight> {
    let mut weight = Weight::default();
    eprintln!("    {:>9} {:>9}  file", "bytes", "gzip");
    for file in files_below(folder)? {
        let bytes = std::fs::read(&file).when(|| format!("read {}", file.display()))?;
        let small = gzip(&bytes)?;
        let kind = file.extension().and_then(|kind| kind.to_str()).unwrap_or_default();
        if kind != "map" {
            weight.page += small;
        }
        if kind == "wasm" {
            weight.wasm += small;
        }
        let name = file.strip_prefix(folder).unwrap_or(&file).display().to_string();
        eprintln!("    {:>9} {small:>9}  {name}", bytes.len());
    }
    eprintln!(
        "    gzip: core {:.1} KB of {} KB allowed, page {:.1} KB of {} KB allowed",
        weight.wasm as f64 / 1e3,
        WASM_BUDGET / 1000,
        weight.page as f64 / 1e3,
        PAGE_BUDGET / 1000
    );
    Ok(weight)
}

fn judge(weight: Weight) -> Result<()> {
    if weight.wasm > WASM_BUDGET {
        return fail(format!("the core weighs {} bytes after gzip, {} are allowed", weight.wasm, WASM_BUDGET));
    }
    if weight.page > PAGE_BUDGET {
        return fail(format!("the page weighs {} bytes after gzip, {} are allowed", weight.page, PAGE_BUDGET));
    }
    Ok(())
}

/// The length of some bytes after gzip at its strongest.
fn gzip(bytes: &[u8]) -> Result<usize> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).when(|| "compress".into())?;
    Ok(encoder.finish().when(|| "compress".into())?.len())
}

/// All files below a folder, sorted.
///
/// # Errors
///
/// A folder cannot be read.
pub fn files_below(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().when(|| format!("read {}", folder.display()))? {
            let path = entry.when(|| format!("read {}", folder.display()))?.path();
            if path.is_dir() { folders.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_over_budget_is_refused_with_both_numbers() {
        assert_eq!(judge(Weight { wasm: WASM_BUDGET, page: PAGE_BUDGET }), Ok(()));
        let refused = judge(Weight { wasm: 400_001, page: 500_000 }).unwrap_err();
        assert_eq!(refused.0, "the core weighs 400001 bytes after gzip, 400000 are allowed");
        assert!(judge(Weight { wasm: 1, page: PAGE_BUDGET + 1 }).is_err());
    }

    #[test]
    fn gzip_shortens_what_repeats() {
        assert!(gzip(&[7; 10_000]).unwrap() < 100);
    }
}
