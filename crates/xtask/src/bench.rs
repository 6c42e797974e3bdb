//! `cargo xtask bench`: the same measurements natively and in the browser, side by side.
//!
//! Both sides print or return one JSON object:
//! `{"entries": [{"name": "step gnss_ins", "unit": "ns", "samples": [612.0, 618.5]}]}`.
//! Natively it is the standard output of `drivescope bench --json [--quick]`; in the browser the string that the function
//! `bench_json(quick)` of the core returns when it is compiled with the feature `bench`. Equal names are one row.

use crate::failure::{Explain, Failure, Result, fail};
use crate::page::{self, CORE};
use crate::place::Place;
use crate::serve::{self, Response};
use crate::{process, sizes, tools};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

/// The browser may take this long.
const PATIENCE: Duration = Duration::from_secs(900);

/// Measure, print a table and the sizes of the modules.
///
/// # Errors
///
/// Something does not build, does not run or does not answer in the agreed form.
pub fn run(place: &Place, quick: bool) -> Result<()> {
    let rounds = if quick { 1 } else { 3 };
    let program = native_program(place)?;
    let folder = browser_folder(place, quick)?;
    let (mut native, mut browser) = (Vec::new(), Vec::new());
    for round in 1..=rounds {
        eprintln!("[{round}/{rounds}] natively");
        gather(&mut native, natively(&program, quick)?);
        eprintln!("[{round}/{rounds}] in the browser");
        gather(&mut browser, in_browser(place, &folder)?);
    }
    println!("\n{}\n", table(&native, &browser));
    page::modules(place)?;
    sizes::print_modules(&place.generated())
}

fn native_program(place: &Place) -> Result<PathBuf> {
    process::succeeds(place.cargo().args(["build", "--release", "--package", "drivescope-cli"]))?;
    Ok(place.target.join("release").join(format!("drivescope{}", std::env::consts::EXE_SUFFIX)))
}

fn natively(program: &Path, quick: bool) -> Result<Vec<Entry>> {
    let mut command = Command::new(program);
    // Its progress is on standard error.
    command.args(["bench", "--json"]).args(quick.then_some("--quick")).stderr(Stdio::inherit());
    entries(&process::output(&mut command)?)
}

/// The core with its measurements, and the page that starts them.
fn browser_folder(place: &Place, quick: bool) -> Result<PathBuf> {
    let folder = place.target.join("drivescope-bench");
    for wasm in page::compile(place, &[&CORE], &["--features", "bench"])? {
        page::generate(&CORE, &wasm, &folder)?;
    }
    write_page(&folder, quick)?;
    Ok(folder)
}

fn in_browser(place: &Place, folder: &Path) -> Result<Vec<Entry>> {
    let browser = tools::browser().ok_or_else(|| Failure("bench needs a Chromium: set CHROMIUM to its file".into()))?;
    let (address, answers) = host(folder)?;
    let profile = place.target.join("drivescope-bench-profile");
    let mut child = open(&browser, &profile, &address)?;
    let measured = wait_for(&answers);
    // It may have ended by itself.
    let _ = child.kill();
    let _ = child.wait();
    let _ = std::fs::remove_dir_all(&profile);
    measured
}

/// What the measuring page posted: where to, and the text.
type Answer = (String, String);

/// Serve a folder, and pass on what is posted.
fn host(folder: &Path) -> Result<(String, Receiver<Answer>)> {
    let listener = serve::listen(serve::PORT + 100)?;
    let address = serve::address(&listener)?;
    let folder = folder.to_path_buf();
    let (send, answers) = mpsc::channel();
    thread::spawn(move || {
        serve::answer(&listener, move |request| {
            if request.method != "POST" {
                return serve::file(&folder, request);
            }
            // The receiver is gone only when the result is no longer wanted.
            let _ = send.send((request.target.clone(), String::from_utf8_lossy(&request.body).into_owned()));
            Response::ok("text/plain", Vec::new())
        });
    });
    Ok((address, answers))
}

fn wait_for(answers: &Receiver<Answer>) -> Result<Vec<Entry>> {
    let started = Instant::now();
    loop {
        match answers.recv_timeout(Duration::from_secs(15)) {
            Ok((target, text)) if target == "/result" => return entries(&text),
            Ok((_, text)) => return fail(format!("the measuring page failed: {text}")),
            Err(RecvTimeoutError::Timeout) if started.elapsed() < PATIENCE => {
                eprintln!("    ... measuring in the browser for {} s", started.elapsed().as_secs());
            }
            Err(_) => return fail("the browser did not answer"),
        }
    }
}

fn open(browser: &Path, profile: &Path, address: &str) -> Result<Child> {
    // Chromium refuses its sandbox to root.
    Command::new(browser)
        .args(tools::is_root().then_some("--no-sandbox"))
        .args(["--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(address)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .when(|| format!("start {}", browser.display()))
}

/// The measuring worker, as the real page runs the core in one, and the page that starts it.
fn write_page(folder: &Path, quick: bool) -> Result<()> {
    let stem = CORE.stem;
    let worker = format!(
        "import init, * as core from './{stem}.js';\n\
         const post = (to, text) => fetch(to, {{ method: 'POST', body: text }});\n\
         try {{ await init(); await post('/result', core.bench_json({quick})); }}\n\
         catch (error) {{ await post('/failed', String(error)); }}\n"
    );
    let page = "<!doctype html><title>bench</title><script type=\"module\">\n\
        const worker = new Worker('worker.js', { type: 'module' });\n\
        worker.onerror = (error) => fetch('/failed', { method: 'POST', body: error.message ?? 'the worker did not start' });\n\
        </script>\n";
    std::fs::write(folder.join("worker.js"), worker).when(|| "write the measuring worker".into())?;
    std::fs::write(folder.join("index.html"), page).when(|| "write the measuring page".into())
}

/// One measured quantity.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    name: String,
    unit: String,
    samples: Vec<f64>,
}

impl Entry {
    fn median(&self) -> f64 {
        let middle = self.samples.len() / 2;
        if self.samples.len() % 2 == 1 {
            self.samples[middle]
        } else {
            (self.samples[middle - 1] + self.samples[middle]) / 2.0
        }
    }

    fn cell(&self) -> String {
        let last = self.samples.len() - 1;
        format!("{} ({}..{})", short(self.median()), short(self.samples[0]), short(self.samples[last]))
    }
}

fn entries(text: &str) -> Result<Vec<Entry>> {
    let value: Value = serde_json::from_str(text).when(|| "read the measurements".into())?;
    let list = value["entries"].as_array().into_iter().flatten();
    let found: Vec<Entry> = list.filter_map(entry).collect();
    if found.is_empty() { fail("the measurements hold no entry") } else { Ok(found) }
}

/// Add one round's samples to those of the rounds before it.
fn gather(all: &mut Vec<Entry>, round: Vec<Entry>) {
    for entry in round {
        match all.iter_mut().find(|known| known.name == entry.name) {
            Some(known) => {
                known.samples.extend(entry.samples);
                known.samples.sort_by(f64::total_cmp);
            }
            None => all.push(entry),
        }
    }
}

/// An entry with its samples in order; none if it has no samples.
fn entry(value: &Value) -> Option<Entry> {
    let mut samples: Vec<f64> = value["samples"].as_array()?.iter().filter_map(Value::as_f64).collect();
    samples.sort_by(f64::total_cmp);
    let name = value["name"].as_str()?.to_owned();
    let unit = value["unit"].as_str()?.to_owned();
    (!samples.is_empty()).then_some(Entry { name, unit, samples })
}

fn table(native: &[Entry], browser: &[Entry]) -> String {
    let mut text = String::from("| what | unit | native | browser | medians | best |\n|---|---|---|---|---|---|\n");
    for here in native {
        let there = browser.iter().find(|entry| entry.name == here.name);
        let (cell, ratio) = match there {
            Some(there) => {
                let [median, best] = slowdown(here, there);
                (there.cell(), format!("{median:.2} | {best:.2}"))
            }
            None => ("-".into(), "- | -".into()),
        };
        text.push_str(&format!("| {} | {} | {} | {cell} | {ratio} |\n", here.name, here.unit, here.cell()));
    }
    for there in browser.iter().filter(|there| native.iter().all(|here| here.name != there.name)) {
        text.push_str(&format!("| {} | {} | - | {} | - | - |\n", there.name, there.unit, there.cell()));
    }
    text.push_str(
        "\nMedian (smallest..largest). The last columns are how many times longer the browser takes: its median over the \
         native one, and best over best, which leaves out what else the machine did.",
    );
    text
}

/// How many times longer the browser takes, for times and for rates alike: median over median, best over best.
fn slowdown(native: &Entry, browser: &Entry) -> [f64; 2] {
    let median = browser.median() / native.median();
    if native.unit.contains("/s") {
        let most = |entry: &Entry| entry.samples[entry.samples.len() - 1];
        [1.0 / median, most(native) / most(browser)]
    } else {
        [median, browser.samples[0] / native.samples[0]]
    }
}

/// Four significant digits, no exponent.
fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    let decimals = (3.0 - digits).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const NATIVE: &str = r#"{"entries": [
        {"name": "step grade", "unit": "ns", "samples": [40.0, 30.0, 33.0]},
        {"name": "csv", "unit": "MB/s", "samples": [300.0]}]}"#;
    const BROWSER: &str = r#"{"entries": [
        {"name": "step grade", "unit": "ns", "samples": [66.0]},
        {"name": "csv", "unit": "MB/s", "samples": [100.0, 200.0]}]}"#;

    #[test]
    fn rows_are_medians_with_range_and_a_ratio_that_means_slower() {
        let text = table(&entries(NATIVE).unwrap(), &entries(BROWSER).unwrap());
        assert!(
            text.contains("| step grade | ns | 33.00 (30.00..40.00) | 66.00 (66.00..66.00) | 2.00 | 2.20 |"),
            "{text}"
        );
        assert!(text.contains("| csv | MB/s | 300.0 (300.0..300.0) | 150.0 (100.0..200.0) | 2.00 | 1.50 |"), "{text}");
    }

    #[test]
    fn measurements_in_another_form_are_refused() {
        assert!(entries("nonsense").is_err());
        assert!(entries("{}").is_err());
    }

    #[test]
    fn numbers_have_four_digits() {
        assert_eq!(
            [0.0, 0.012_345, 1.0, 123.456, 98_765.4].map(short),
            ["0.000", "0.01235", "1.000", "123.5", "98765"]
        );
    }
}
