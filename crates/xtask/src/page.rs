//! Building the page: its modules to WebAssembly, their JavaScript packages, the static files, and their sizes.
//!
//! A step whose inputs did not change since it last succeeded is left out. What is remembered lies beside what was made
//! (`web/src/generated/.made-from`, `web/node_modules/.drivescope/`), so that removing the product forgets it too.

use crate::failure::{Explain, Result, fail};
use crate::place::{self, Place, WASM};
use crate::process;
use crate::sizes;
use std::path::{Path, PathBuf};
use std::process::Command;
use wasm_bindgen_cli_support::Bindgen;

/// A crate compiled to a WebAssembly module of the page.
pub struct Module {
    /// Its name.
    pub package: &'static str,
    /// The stem of the generated files: `drivescope_wasm.js`, `drivescope_wasm_bg.wasm`, ...
    pub stem: &'static str,
    /// Its folder.
    pub folder: &'static str,
}

/// What the page loads first.
pub const CORE: Module = Module { package: "drivescope-wasm", stem: "drivescope_wasm", folder: "crates/wasm" };
/// What makes the simulated drives; the page loads it first, beside the core.
pub const DRIVES: Module = Module { package: "drivescope-drives", stem: "drivescope_drives", folder: "crates/drives" };
/// What the page loads when the gallery of papers is opened.
pub const GALLERY: Module =
    Module { package: "drivescope-gallery", stem: "drivescope_gallery", folder: "crates/gallery" };
/// What the page loads to examine the sensors of a drive.
pub const DOCTOR: Module = Module { package: "drivescope-doctor", stem: "drivescope_doctor", folder: "crates/doctor" };
/// What the page loads to read files.
pub const READERS: Module =
    Module { package: "drivescope-readers", stem: "drivescope_readers", folder: "crates/readers" };
/// All modules of the page.
pub const MODULES: [&Module; 5] = [&CORE, &DRIVES, &DOCTOR, &GALLERY, &READERS];

/// Crates that are built smaller for the page than natively, with their level: CSV is read there a fifth slower for it, and
/// the readers weigh a tenth less.
const SMALL: [(&str, &str); 3] = [("drivescope-import", "z"), ("ruzstd", "z"), ("miniz_oxide", "s")];

/// Build everything that the page needs into `web/dist` and print sizes.
///
/// # Errors
///
/// A step fails, the WebAssembly names a folder of this machine, or a size is over its budget.
pub fn build(place: &Place) -> Result<()> {
    modules(place)?;
    node_modules(place)?;
    files(place)?;
    sizes::print_and_judge(place)
}

/// Compile the modules and generate their packages for the page in `web/src/generated`.
///
/// # Errors
///
/// A step fails, or the WebAssembly names a folder of this machine.
pub fn modules(place: &Place) -> Result<()> {
    let compiled = compile(place, &MODULES, &[])?;
    let mut input = String::new();
    for (module, wasm) in MODULES.iter().zip(&compiled) {
        let bytes = std::fs::read(wasm).when(|| format!("read {}", wasm.display()))?;
        refuse_machine_paths(place, module, &bytes)?;
        input.push_str(&format!("{:016x} ", fingerprint(&bytes)));
    }

    let out = place.generated();
    let stamp = out.join(".made-from");
    // Made from the modules, by wasm-bindgen of a version, in the way this file says.
    let version = place.locked_version("wasm-bindgen")?;
    input.push_str(&format!("{version} {:016x}", fingerprint(include_bytes!("page.rs"))));
    let is_there = |module: &&Module| out.join(format!("{}_bg.wasm", module.stem)).is_file();
    if remembered(&stamp, &input) && MODULES.iter().all(is_there) {
        eprintln!("    web/src/generated is up to date");
        return Ok(());
    }
    eprintln!("    generating web/src/generated");
    if out.exists() {
        std::fs::remove_dir_all(&out).when(|| "remove web/src/generated".into())?;
    }
    for (module, wasm) in MODULES.iter().zip(&compiled) {
        generate(module, wasm, &out)?;
    }
    remember(&stamp, &input)
}

/// Compile modules in release and say where the files are.
///
/// # Errors
///
/// The target is missing and cannot be added, or a crate does not compile.
pub fn compile(place: &Place, modules: &[&Module], arguments: &[&str]) -> Result<Vec<PathBuf>> {
    ensure_wasm_target(place)?;
    let remap = remap_config(place)?;
    let small = SMALL.map(|(name, level)| format!("profile.release.package.{name}.opt-level={level:?}"));
    for module in modules {
        eprintln!("    compiling {} for {WASM}", module.package);
        // One by one: built together they would share the features of the crates they use.
        process::succeeds(
            place
                .cargo()
                .env_remove("RUSTFLAGS")
                .env_remove("CARGO_ENCODED_RUSTFLAGS")
                .args(["build", "--release", "--target", WASM, "--package", module.package, "--config", &remap])
                .args(small.iter().flat_map(|setting| ["--config", setting]))
                .args(arguments),
        )?;
    }
    let release = place.target.join(WASM).join("release");
    Ok(modules.iter().map(|module| release.join(format!("{}.wasm", module.stem))).collect())
}

/// Write the JavaScript package of a compiled module, for a page without a bundler's help.
///
/// # Errors
///
/// The file is not what wasm-bindgen of this version made, or the folder cannot be written.
pub fn generate(module: &Module, wasm: &Path, out: &Path) -> Result<()> {
    // The library's own defaults leave out the types and the place of the WebAssembly file; the command's do not.
    let mut bindgen = Bindgen::new();
    bindgen.input_path(wasm).out_name(module.stem).typescript(true).omit_default_module_path(false);
    bindgen.remove_name_section(true).remove_producers_section(true);
    // The readers' memory is given back after every log.
    bindgen.reset_state_function(module.stem == READERS.stem);
    bindgen.web(true).when(|| "set up wasm-bindgen".into())?.generate(out).when(|| "generate the page's package".into())
}

/// Make sure that rustc can compile for WebAssembly.
///
/// # Errors
///
/// The target is missing and rustup cannot add it.
pub fn ensure_wasm_target(place: &Place) -> Result<()> {
    let sysroot = sysroot(place)?;
    if sysroot.join("lib/rustlib").join(WASM).is_dir() {
        return Ok(());
    }
    eprintln!("    adding the target {WASM}");
    let mut rustup = Command::new("rustup");
    if process::succeeds(rustup.current_dir(&place.root).args(["target", "add", WASM])).is_ok() {
        return Ok(());
    }
    fail(format!("rustc cannot compile for {WASM}: add that target (`rustup target add {WASM}`) and try again"))
}

/// Install the page's packages as the lock file fixes them, when they are not.
///
/// # Errors
///
/// Node.js is missing, there is no lock file, or npm fails.
pub fn node_modules(place: &Place) -> Result<()> {
    if process::which("node").is_none() {
        return fail("the page needs Node.js 20.19 or newer with npm: install it and try again");
    }
    let lock = place.web().join("package-lock.json");
    let Ok(bytes) = std::fs::read(&lock) else {
        return fail("web/package-lock.json is missing: run `npm install` in web/ and commit the lock file");
    };
    let stamp = stamps(place).join("lock");
    let input = format!("{:016x}", fingerprint(&bytes));
    if remembered(&stamp, &input) {
        return Ok(());
    }
    eprintln!("    installing the page's packages");
    process::succeeds(place.npm().args(["ci", "--no-audit", "--no-fund"]))?;
    remember(&stamp, &input)
}

/// Build `web/dist` from `web/`.
///
/// # Errors
///
/// npm fails, or it made no `index.html`.
pub fn files(place: &Place) -> Result<()> {
    let index = place.dist().join("index.html");
    let stamp = stamps(place).join("page");
    let input = format!("{:016x}", fingerprint_of_sources(place)?);
    if remembered(&stamp, &input) && index.is_file() {
        eprintln!("    web/dist is up to date");
        return Ok(());
    }
    eprintln!("    building web/dist");
    process::succeeds(place.npm().args(["run", "--silent", "build"]))?;
    if !index.is_file() {
        return fail("`npm run build` made no web/dist/index.html");
    }
    remember(&stamp, &input)
}

/// Copy the built page to another folder.
///
/// # Errors
///
/// The folder holds something that is not an earlier copy of the page, or cannot be written.
pub fn copy(place: &Place, to: &Path) -> Result<()> {
    let holds_something = to.read_dir().is_ok_and(|mut entries| entries.next().is_some());
    if holds_something && !to.join("index.html").is_file() {
        return fail(format!("{} is not empty and is no earlier copy of the page: name an empty folder", to.display()));
    }
    if holds_something {
        std::fs::remove_dir_all(to).when(|| format!("empty {}", to.display()))?;
    }
    let dist = place.dist();
    for file in sizes::files_below(&dist)? {
        let target = to.join(file.strip_prefix(&dist).unwrap_or(&file));
        let folder = target.parent().unwrap_or(to);
        std::fs::create_dir_all(folder).when(|| format!("make {}", folder.display()))?;
        std::fs::copy(&file, &target).when(|| format!("write {}", target.display()))?;
    }
    eprintln!("    copied to {}", to.display());
    Ok(())
}

/// The cargo setting that keeps this machine's folders out of panic locations.
///
/// rustc takes the last prefix that fits: general folders first.
fn remap_config(place: &Place) -> Result<String> {
    let mut flags = Vec::new();
    for (folder, name) in [
        (place::home(), "~"),
        (place::cargo_home(), "cargo"),
        (Some(sysroot(place)?), "rust"),
        (Some(place.root.clone()), "."),
        (Some(place.target.clone()), "target"),
    ] {
        if let Some(folder) = folder.filter(|folder| folder.components().count() > 1) {
            flags.push(format!("--remap-path-prefix={}={name}", folder.display()));
        }
    }
    let list = serde_json::to_string(&flags).when(|| "write rustc's flags".into())?;
    Ok(format!("target.{WASM}.rustflags={list}"))
}

fn refuse_machine_paths(place: &Place, module: &Module, wasm: &[u8]) -> Result<()> {
    let folders = [place::home(), place::cargo_home(), Some(place.root.clone()), Some(place.target.clone())];
    for folder in folders.into_iter().flatten().filter(|folder| folder.components().count() > 1) {
        let name = folder.display().to_string();
        if wasm.windows(name.len()).any(|window| window == name.as_bytes()) {
            let package = module.package;
            return fail(format!("{package} names a folder of this machine, {name}: --remap-path-prefix missed it"));
        }
    }
    Ok(())
}

fn sysroot(place: &Place) -> Result<PathBuf> {
    let mut rustc = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
    Ok(process::output(rustc.current_dir(&place.root).args(["--print", "sysroot"]))?.trim().into())
}

/// A number that changes when anything changes that `npm run build` reads.
fn fingerprint_of_sources(place: &Place) -> Result<u64> {
    let web = place.web();
    let mut all = Vec::new();
    for entry in web.read_dir().when(|| "read web/".into())? {
        let path = entry.when(|| "read web/".into())?.path();
        if path.ends_with("node_modules") || path.ends_with("dist") {
            continue;
        }
        if path.is_dir() {
            all.extend(sizes::files_below(&path)?);
        } else {
            all.push(path);
        }
    }
    all.sort();
    let mut sum = Vec::new();
    for file in all {
        let bytes = std::fs::read(&file).when(|| format!("read {}", file.display()))?;
        sum.extend_from_slice(file.strip_prefix(&web).unwrap_or(&file).to_string_lossy().as_bytes());
        sum.extend_from_slice(&fingerprint(&bytes).to_le_bytes());
    }
    Ok(fingerprint(&sum))
}

/// FNV-1a, 64 bits.
fn fingerprint(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

fn stamps(place: &Place) -> PathBuf {
    place.web().join("node_modules/.drivescope")
}

fn remembered(stamp: &Path, input: &str) -> bool {
    std::fs::read_to_string(stamp).is_ok_and(|text| text == input)
}

fn remember(stamp: &Path, input: &str) -> Result<()> {
    if let Some(folder) = stamp.parent() {
        std::fs::create_dir_all(folder).when(|| format!("make {}", folder.display()))?;
    }
    std::fs::write(stamp, input).when(|| format!("write {}", stamp.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fingerprint_is_fnv_1a() {
        // Published test values of the algorithm.
        assert_eq!(fingerprint(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fingerprint(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
