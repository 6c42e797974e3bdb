//! What the page weighs after gzip, and how much it may.

use crate::failure::{Explain, Result, fail};
use crate::place::Place;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::collections::BTreeSet;
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
    /// It is loaded when it is first needed and not at the opening.
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

/// Gzipped bytes of the built page.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Weight {
    /// The WebAssembly of the core.
    pub core: usize,
    /// All files that are loaded at the opening.
    pub page: usize,
    /// What rooms and dialogs bring when they are opened.
    pub later: usize,
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

/// Print the sizes of the WebAssembly below a folder, which need not hold a page.
///
/// # Errors
///
/// A file cannot be read.
pub fn print_modules(folder: &Path) -> Result<()> {
    eprintln!("    {:>9} {:>9}  module", "bytes", "gzip");
    for file in files_below(folder)?.into_iter().filter(|file| file.extension().is_some_and(|kind| kind == "wasm")) {
        let bytes = std::fs::read(&file).when(|| format!("read {}", file.display()))?;
        let name = file.strip_prefix(folder).unwrap_or(&file).display();
        eprintln!("    {:>9} {:>9}  {name}", bytes.len(), gzip(&bytes)?);
    }
    Ok(())
}

/// Print and add up the sizes of all files of a built page.
///
/// # Errors
///
/// A file cannot be read.
fn print(folder: &Path) -> Result<Weight> {
    let mut weight = Weight::default();
    let opening = opening(folder)?;
    eprintln!("    {:>9} {:>9}  file (*: loaded at the opening)", "bytes", "gzip");
    for file in files_below(folder)? {
        let bytes = std::fs::read(&file).when(|| format!("read {}", file.display()))?;
        let small = gzip(&bytes)?;
        let name = file.strip_prefix(folder).unwrap_or(&file).display().to_string();
        let is_first = file.file_name().is_some_and(|name| opening.contains(&*name.to_string_lossy()));
        weight.add(&name, small, is_first);
        eprintln!("    {:>9} {small:>9}{} {name}", bytes.len(), if is_first { '*' } else { ' ' });
    }
    let line = |what: &str, size: usize, budget: usize| {
        eprintln!("    gzip: {what} {:.1} KB of {} KB allowed", size as f64 / 1e3, budget / 1000);
    };
    line("core", weight.core, WASM_BUDGET);
    line("page at its opening", weight.page, PAGE_BUDGET);
    eprintln!("    gzip: rooms and dialogs, when they are opened {:.1} KB", weight.later as f64 / 1e3);
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
    fn add(&mut self, name: &str, size: usize, is_first: bool) {
        let module = MODULES.iter().position(|module| name.contains(module.mark));
        let all = match module {
            _ if is_first => &mut self.page,
            Some(i) if MODULES[i].is_on_demand => &mut self.on_demand[i],
            _ => &mut self.later,
        };
        if !name.ends_with(".map") {
            *all += size;
        }
        if name.ends_with(".wasm") {
            *module.map_or(&mut self.core, |i| &mut self.modules[i]) += size;
        }
    }
}

/// The names of the files that `index.html` loads: what it names, what those import, and the worker's modules.
fn opening(folder: &Path) -> Result<BTreeSet<String>> {
    let mut named = BTreeSet::new();
    let mut files = vec!["index.html".to_string()];
    while let Some(name) = files.pop() {
        let path =
            if name == "index.html" || name == "icon.svg" { folder.to_path_buf() } else { folder.join("assets") };
        let path = path.join(&name);
        if named.insert(name) && path.extension().is_some_and(|kind| kind == "js" || kind == "html") {
            let text = std::fs::read_to_string(&path).when(|| format!("read {}", path.display()))?;
            files.extend(loaded_by(&text));
        }
    }
    let has = |stem: &str| named.iter().any(|name| name.contains(stem) && name.ends_with(".wasm"));
    if has("_wasm_bg") && has(MODULES[0].mark) {
        Ok(named)
    } else {
        fail("cannot tell what the page loads at its opening")
    }
}

/// The names of the files that a page or a script loads by itself; what it imports by a call comes later.
fn loaded_by(text: &str) -> impl Iterator<Item = String> {
    // As the bundler writes them.
    let ways = [("src=\"", '"'), ("href=\"", '"'), ("from\"", '"'), ("import\"", '"'), ("new URL(`", '`')];
    ways.into_iter().flat_map(move |(before, end)| {
        let names = text.split(before).skip(1).filter_map(move |rest| rest.split(end).next());
        names.filter_map(|name| name.rsplit('/').next()).filter(|name| name.contains('.')).map(str::to_string)
    })
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
            ("index.html", true),
            ("assets/drivescope_wasm_bg-1.wasm", true),
            ("assets/a.js.map", false),
            ("assets/gallery-2.js", false),
            ("assets/x_gallery_bg-3.wasm", false),
            ("assets/x_readers_bg-4.wasm", false),
            ("assets/x_drives_bg-5.wasm", true),
            ("assets/room-6.js", false),
            ("assets/help-8.js", false),
            ("assets/x_doctor_bg-7.wasm", false),
        ];
        for ((name, is_first), size) in files.iter().zip([1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 7, 4, 3]) {
            weight.add(name, size, *is_first);
        }
        let modules = [1_000_000, 3, 10_000, 100_000];
        let on_demand = [0, 3, 11_000, 100_000];
        assert_eq!(weight, Weight { core: 10, page: 1_000_011, later: 11, modules, on_demand });
    }

    #[test]
    fn a_script_loads_what_it_imports_and_its_worker_but_not_what_it_calls_for() {
        let script = "const d=[\"./room-1.js\"];import{t as e}from\"./messages-2.js\";import\"./side-3.js\";\
                      new Worker(new URL(`worker-4.js`,import.meta.url));()=>import(`./room-1.js`);new URL(e,t)";
        let mut names: Vec<String> = loaded_by(script).collect();
        names.sort();
        assert_eq!(names, ["messages-2.js", "side-3.js", "worker-4.js"]);
    }

    #[test]
    fn gzip_shortens_what_repeats() {
        assert!(gzip(&[7; 10_000]).unwrap() < 100);
    }
}
