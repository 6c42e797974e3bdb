//! What the browser tests need besides Rust and Node.js: a Chromium, its driver, wasm-pack and wasm-bindgen's test runner.

use crate::failure::{Explain, Failure, Result, fail};
use crate::place::{self, Place};
use crate::process;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The wasm-pack that this repository is tested with.
const WASM_PACK: &str = "0.15.0";
const BROWSERS: [&str; 5] = ["chromium", "chromium-browser", "google-chrome-stable", "google-chrome", "chrome"];

/// Install what is missing.
///
/// # Errors
///
/// Something is missing and cannot be installed from here; the sentence says how to do it by hand.
pub fn ensure(place: &Place) -> Result<()> {
    ensure_browser()?;
    ensure_driver()?;
    ensure_command(place, "wasm-pack", "wasm-pack", WASM_PACK)?;
    let version = place.locked_version("wasm-bindgen")?;
    ensure_command(place, "wasm-bindgen", "wasm-bindgen-cli", &version)
}

/// The Chromium to test with: the one that `CHROMIUM` names, else the first one in `PATH`.
pub fn browser() -> Option<PathBuf> {
    match std::env::var_os("CHROMIUM") {
        Some(file) => Some(PathBuf::from(file)),
        None => BROWSERS.iter().find_map(|name| process::which(name)),
    }
}

/// `PATH` with the tools installed by [`ensure`] in front.
///
/// # Errors
///
/// The folder of tools is unknown or cannot stand in `PATH`.
pub fn path() -> Result<OsString> {
    let bin = place::tools()?.join("bin");
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(std::iter::once(bin).chain(std::env::split_paths(&path))).when(|| "set PATH".into())
}

/// Whether this program runs as the system's administrator.
pub fn is_root() -> bool {
    process::output(Command::new("id").arg("-u")).is_ok_and(|id| id.trim() == "0")
}

fn ensure_browser() -> Result<()> {
    if let Some(found) = browser() {
        if found.is_file() {
            return Ok(());
        }
        return fail(format!("CHROMIUM names {}, which is no file", found.display()));
    }
    apt_install()?;
    browser().map(drop).ok_or_else(|| missing("a Chromium"))
}

fn ensure_driver() -> Result<()> {
    if process::which("chromedriver").is_some() {
        return Ok(());
    }
    apt_install()?;
    process::which("chromedriver").map(drop).ok_or_else(|| missing("chromedriver"))
}

fn missing(what: &str) -> Failure {
    Failure(format!(
        "{what} is missing: on Debian, `apt-get install chromium chromium-driver` as root; elsewhere, install Chrome or Chromium \
         with its chromedriver, put both in PATH or set CHROMIUM to the browser's file"
    ))
}

fn apt_install() -> Result<()> {
    if !is_root() || process::which("apt-get").is_none() {
        return Err(missing("Chromium or its chromedriver"));
    }
    eprintln!("    installing chromium and chromium-driver");
    let apt = || {
        let mut apt = Command::new("apt-get");
        apt.env("DEBIAN_FRONTEND", "noninteractive");
        apt
    };
    // An old list of packages may still do.
    let _ = process::watched(apt().args(["update", "-q"]), |_| ());
    let packages = ["chromium", "chromium-driver", "fonts-dejavu-core"];
    process::succeeds(apt().args(["install", "-q", "-y", "--no-install-recommends"]).args(packages))
        .map_err(|_| missing("Chromium or its chromedriver"))
}

/// Make sure that a command of exactly this version is in [`path`].
///
/// Built without optimisation: it is run a few times, and its build is what one waits for.
fn ensure_command(place: &Place, command: &str, package: &str, version: &str) -> Result<()> {
    let folder = place::tools()?;
    let ours = process::executable_in(&folder.join("bin"), command);
    if ours.is_some_and(|file| has_version(&file, version)) {
        return Ok(());
    }
    if process::which(command).is_some_and(|file| has_version(&file, version)) {
        return Ok(());
    }
    eprintln!("    installing {package} {version} from source");
    let build = folder.join("build");
    process::succeeds(
        place
            .cargo()
            .args(["install", package, "--version", version, "--debug", "--force", "--root"])
            .arg(&folder)
            .env("CARGO_TARGET_DIR", &build)
            .env("CARGO_PROFILE_DEV_DEBUG", "0")
            .env_remove("RUSTFLAGS"),
    )
    .map_err(|_| Failure(format!("{package} {version} is missing: `cargo install {package} --version {version}`")))?;
    // What was compiled on the way is not needed again; leaving it costs nothing but room.
    let _ = std::fs::remove_dir_all(&build);
    Ok(())
}

/// Whether `command --version` prints this version (`wasm-pack 0.15.0`).
fn has_version(command: &Path, version: &str) -> bool {
    process::output(Command::new(command).arg("--version"))
        .is_ok_and(|text| text.split_whitespace().nth(1) == Some(version))
}
