//! `cargo xtask test` and `cargo xtask check`: numbered steps that do not hide each other's results.

use crate::counts::{Counter, Tally};
use crate::failure::{Explain, Result, fail};
use crate::place::{Place, WASM};
use crate::{hygiene, page, process, tools};
use std::process::Command;
use std::time::Instant;

/// Rust tests run in this profile: nearly the speed of release without its link time.
const TESTED: &str = "fast";
/// Lints and documentation share what they compile for each other, and with this program.
const LINTED: &str = "xtask";
/// A browser test may take this many seconds.
const BROWSER_SECONDS: &str = "300";

type Step = (&'static str, fn(&Place) -> Result<Tally>);

const QUICK: &[Step] = &[("format", format), ("lints", lints), ("Rust tests", rust_tests), ("hygiene", hygiene::check)];

const ALL: &[Step] = &[
    ("format", format),
    ("lints", lints),
    ("documentation", documentation),
    ("Rust tests", rust_tests),
    ("page: build and sizes", page_build),
    ("page: types", page_types),
    ("page: unit tests", page_unit_tests),
    ("tools for browser tests", browser_tools),
    ("modules in a browser", modules_in_browser),
    ("page in a browser", page_in_browser),
    ("hygiene", hygiene::check),
];

const CHECKS: &[Step] = &[
    ("format", format),
    ("lints", lints),
    ("documentation", documentation),
    ("page's package", page_package),
    ("page: types", page_types),
    ("hygiene", hygiene::check),
];

/// Run all tests, or with `quick` those that need neither a browser nor the page.
///
/// # Errors
///
/// At least one test failed.
pub fn test(place: &Place, quick: bool) -> Result<()> {
    run(place, if quick { QUICK } else { ALL })
}

/// Run what needs no test to run: format, lints, documentation, types.
///
/// # Errors
///
/// At least one check failed.
pub fn check(place: &Place) -> Result<()> {
    run(place, CHECKS)
}

/// Run the rules of the repository alone.
///
/// # Errors
///
/// At least one is broken.
pub fn hygiene(place: &Place) -> Result<()> {
    run(place, &[("hygiene", hygiene::check)])
}

/// Let every reader open `count` damaged files of its format; an overflow counts as a panic.
///
/// # Errors
///
/// A reader panicked, did not come to an end, or asked for absurd memory.
pub fn fuzz(place: &Place, count: u64) -> Result<()> {
    process::succeeds(
        place
            .cargo()
            .args(["test", "--profile", TESTED, "--package", "drivescope-import", "--test", "mutations"])
            .args(["--", "--nocapture"])
            .env(format!("CARGO_PROFILE_{}_OVERFLOW_CHECKS", TESTED.to_uppercase()), "true")
            .env("DRIVESCOPE_MUTATIONS", count.to_string()),
    )
}

/// Write the golden histories anew; the difference is for review.
///
/// # Errors
///
/// A golden test fails for another reason than its numbers.
pub fn golden_update(place: &Place) -> Result<()> {
    process::succeeds(
        place
            .cargo()
            .args(["test", "--profile", TESTED, "--package", "drivescope-tests", "--test", "golden"])
            .env("DRIVESCOPE_GOLDEN_UPDATE", "1"),
    )?;
    process::succeeds(Command::new("git").current_dir(&place.root).args(["diff", "--stat", "--", "tests"]))
}

fn run(place: &Place, steps: &[Step]) -> Result<()> {
    let begin = Instant::now();
    let mut total = Tally::default();
    let mut table = Vec::new();
    for (number, (name, step)) in steps.iter().enumerate() {
        println!("\n[{}/{}] {name}", number + 1, steps.len());
        let started = Instant::now();
        let tally = step(place).unwrap_or_else(|failure| Tally::failure(format!("failed: {failure}")));
        let seconds = started.elapsed().as_secs_f64();
        let line = tally.line();
        for note in &tally.notes {
            println!("    {note}");
        }
        println!("    {name}: {line} ({seconds:.1} s)");
        table.push(format!("{seconds:8.1} s  {name}: {line}"));
        total += tally;
    }
    println!("\n{}", table.join("\n"));
    println!("{:8.1} s  together", begin.elapsed().as_secs_f64());
    if !total.notes.is_empty() {
        println!("\n{}", total.notes.join("\n"));
    }
    println!("\n{}", total.line());
    if total.failed > 0 { fail(String::new()) } else { Ok(()) }
}

/// A command is one check: passed when it ends with status 0.
fn one_check(what: &str, command: &mut Command) -> Result<Tally> {
    if process::watched(command, |_| ())? {
        Ok(Tally::pass())
    } else {
        Ok(Tally::failure(format!("failed: {what}; its output is above")))
    }
}

fn counted(what: &str, command: &mut Command) -> Result<Tally> {
    let mut counter = Counter::default();
    let ended_well = process::watched(command, |line| counter.line(line))?;
    Ok(counter.finish(what, ended_well))
}

fn format(place: &Place) -> Result<Tally> {
    one_check("cargo fmt", place.cargo().args(["fmt", "--all", "--check"]))
}

fn lints(place: &Place) -> Result<Tally> {
    page::ensure_wasm_target(place)?;
    let clippy = |arguments: &[&str]| {
        let mut cargo = place.cargo();
        cargo.args(["clippy", "--profile", LINTED, "--all-targets"]).args(arguments).args(["--", "-D", "warnings"]);
        cargo
    };
    let mut tally = one_check("cargo clippy", &mut clippy(&["--workspace"]))?;
    let packages = page::MODULES.iter().flat_map(|module| ["--package", module.package]);
    let arguments: Vec<&str> = packages.chain(["--all-features", "--target", WASM]).collect();
    tally += one_check("cargo clippy for WebAssembly", &mut clippy(&arguments))?;
    Ok(tally)
}

fn documentation(place: &Place) -> Result<Tally> {
    one_check(
        "cargo doc",
        place.cargo().args(["doc", "--profile", LINTED, "--no-deps", "--workspace"]).env("RUSTDOCFLAGS", "-D warnings"),
    )
}

fn rust_tests(place: &Place) -> Result<Tally> {
    // Tests that say SKIPPED are seen only if the output of passed tests is shown.
    let cargo = |arguments: &[&str]| {
        let mut cargo = place.cargo();
        cargo.args(["test", "--no-fail-fast"]).args(arguments).args(["--", "--show-output"]);
        cargo
    };
    let ours = &["--package", "drivescope-xtask", "--profile", LINTED];
    let rest = &["--workspace", "--exclude", "drivescope-xtask", "--profile", TESTED];
    let mut tally = counted("cargo test of xtask", &mut cargo(ours))?;
    tally += counted("cargo test", &mut cargo(rest))?;
    Ok(tally)
}

fn page_build(place: &Place) -> Result<Tally> {
    page::build(place).map(|()| Tally::pass())
}

fn page_package(place: &Place) -> Result<Tally> {
    page::modules(place)?;
    page::node_modules(place).map(|()| Tally::pass())
}

fn page_types(place: &Place) -> Result<Tally> {
    one_check("tsc", place.npm().args(["run", "--silent", "check"]))
}

fn page_unit_tests(place: &Place) -> Result<Tally> {
    counted("vitest", place.npm().args(["test", "--silent"]).env("NO_COLOR", "1").env("CI", "1"))
}

fn browser_tools(place: &Place) -> Result<Tally> {
    tools::ensure(place).map(|()| Tally::pass())
}

fn modules_in_browser(place: &Place) -> Result<Tally> {
    let mut tally = Tally::default();
    for module in page::MODULES {
        tally += counted(
            "wasm-pack test",
            Command::new("wasm-pack")
                .current_dir(&place.root)
                .args(["test", "--headless", "--chrome", module.folder, "--profile", TESTED])
                .env("PATH", tools::path()?)
                .env("WASM_BINDGEN_TEST_TIMEOUT", BROWSER_SECONDS)
                .env_remove("RUSTFLAGS"),
        )?;
    }
    Ok(tally)
}

fn page_in_browser(place: &Place) -> Result<Tally> {
    if !place.dist().join("index.html").is_file() {
        return fail("there is no page to test: its build failed");
    }
    let browser =
        tools::browser().ok_or_else(|| crate::failure::Failure("there is no Chromium to test with".into()))?;
    let browser = std::path::absolute(&browser).when(|| format!("find {}", browser.display()))?;
    counted(
        "test:page",
        place.npm().args(["run", "--silent", "test:page"]).env("CHROMIUM", browser).env("NO_COLOR", "1"),
    )
}
