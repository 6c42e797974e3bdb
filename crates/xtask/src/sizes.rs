//! What the page weighs after gzip, and how much it may.

use crate::failure::{Explain, Result, fail};
use crate::place::Place;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The core may weigh this many bytes after gzip.
pub const WASM_BUDGET: usize = 400_000;
/// Everything that the page loads at its opening may weigh this many bytes after gzip.
pub const PAGE_BUDGET: usize = 600_000;

/// A WebAssembly module beside the core.
struct Module {
    /// What it holds.
    name: &'static str,
    /// Its files hold this in their names.
    mark: &'static str,
    /// Its WebAssembly may weigh this many bytes after gzip.
    budget: usize,
    /// It is loaded when it is first needed and not at the opening; the page's tests hold it to that.
    is_on_demand: bool,
}

/// The simulated drives are loaded with the core; the gallery when it is opened; the doctor once a whole
/// drive is there; the readers when the first file is dropped
/// or the page is idle.
const MODULES: [Module; 4] = [
    Module { name: "drives", mark: "_drives", budget: 145_000, is_on_demand: false },
    Module { name: "doctor", mark: "_doctor", budget: 110_000, is_on_demand: true },
    Module { name: "gallery", mark: "gallery", budget: 430_000, is_on_demand: true },
    Module { name: "readers", mark: "_readers", budget: 430_000, is_on_demand: true },
];

/// Files of a room are loaded when it is entered first: the folder of a large room has a `room.ts`, which names them. The
/// table of columns is one too, and what watches over a file's columns (`shelf` is what both share).
const ROOMS: [&str; 4] = ["/room-", "/columns-", "/watch-", "/shelf-"];

/// Gzipped bytes of the built page.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Weight {
    /// The WebAssembly of the core.
    pub core: usize,
    /// All files that are loaded at the opening.
    pub page: usize,
    /// What rooms bring when they are entered.
    pub rooms: usize,
    /// The WebAssembly of each further module.
    pub modules: [usize; MODULES.len()],
    /// All files that each of these brings when it is loaded on demand.
    pub on_demand: [usize; MODULES.len()],
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
        let name = file.strip_prefix(folder).unwrap_or(&file).display().to_string();
        weight.add(&name, small);
        eprintln!("    {:>9} {small:>9}  {name}", bytes.len());
    }
    let line = |what: &str, size: usize, budget: usize| {
        eprintln!("    gzip: {what} {:.1} KB of {} KB allowed", size as f64 / 1e3, budget / 1000);
    };
    line("core", weight.core, WASM_BUDGET);
    line("page at its opening", weight.page, PAGE_BUDGET);
    eprintln!("    gzip: rooms, when they are entered {:.1} KB", weight.rooms as f64 / 1e3);
    for (i, module) in MODULES.iter().enumerate() {
        line(&format!("module of the {}", module.name), weight.modules[i], module.budget);
        if module.is_on_demand {
            eprintln!("    gzip: all that the {} bring {:.1} KB", module.name, weight.on_demand[i] as f64 / 1e3);
        }
    }
    Ok(weight)
}

impl Weight {
    /// Add a file; source maps count for nothing, only a debugger loads them.
    fn add(&mut self, name: &str, size: usize) {
        let (all, wasm) = match MODULES.iter().position(|module| name.contains(module.mark)) {
            Some(i) if MODULES[i].is_on_demand => (&mut self.on_demand[i], &mut self.modules[i]),
            Some(i) => (&mut self.page, &mut self.modules[i]),
            None if ROOMS.iter().any(|room| name.contains(room)) => (&mut self.rooms, &mut self.core),
            None => (&mut self.page, &mut self.core),
        };
        if !name.ends_with(".map") {
            *all += size;
        }
        if name.ends_with(".wasm") {
            *wasm += size;
        }
    }
}

fn judge(weight: Weight) -> Result<()> {
    let opening = [("core", weight.core, WASM_BUDGET), ("page at its opening", weight.page, PAGE_BUDGET)];
    let modules = MODULES.iter().zip(weight.modules).map(|(module, size)| (module.name, size, module.budget));
    match opening.into_iter().chain(modules).find(|(_, size, budget)| size > budget) {
        Some((what, size, budget)) => fail(format!("the {what} weighs {size} bytes after gzip, {budget} are allowed")),
        None => Ok(()),
    }
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
        let modules = MODULES.map(|module| module.budget);
        let full = Weight { core: WASM_BUDGET, page: PAGE_BUDGET, modules, ..Weight::default() };
        assert_eq!(judge(full), Ok(()));
        let refused = judge(Weight { core: 400_001, ..full }).unwrap_err();
        assert_eq!(refused.0, "the core weighs 400001 bytes after gzip, 400000 are allowed");
        assert!(judge(Weight { page: PAGE_BUDGET + 1, ..full }).is_err());
        for module in 0..MODULES.len() {
            let mut over = full;
            over.modules[module] += 1;
            assert!(judge(over).is_err());
        }
    }

    #[test]
    fn what_is_loaded_on_demand_is_no_part_of_the_opening_and_maps_count_for_nothing() {
        let mut weight = Weight::default();
        let files = [
            "index.html",
            "assets/drivescope_wasm_bg-1.wasm",
            "assets/a.js.map",
            "assets/gallery-2.js",
            "assets/x_gallery_bg-3.wasm",
            "assets/x_readers_bg-4.wasm",
            "assets/x_drives_bg-5.wasm",
            "assets/room-6.js",
            "assets/columns-8.js",
            "assets/x_doctor_bg-7.wasm",
        ];
        for (name, size) in files.iter().zip([1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 7, 4, 3]) {
            weight.add(name, size);
        }
        let modules = [1_000_000, 3, 10_000, 100_000];
        let on_demand = [0, 3, 11_000, 100_000];
        assert_eq!(weight, Weight { core: 10, page: 1_000_011, rooms: 11, modules, on_demand });
    }

    #[test]
    fn gzip_shortens_what_repeats() {
        assert!(gzip(&[7; 10_000]).unwrap() < 100);
    }
}
