//! Running other programs so that somebody watching always sees that something goes on.

use crate::failure::{Explain, Result, fail};
use std::ffi::OsStr;
use std::io::{BufRead, BufReader, IsTerminal, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

/// After this long without a line from the child, a line of our own says that it still runs.
const QUIET: Duration = Duration::from_secs(15);
/// So many letters of a command are shown.
const SPELLED: usize = 80;

/// A program by its name, as the platform spells it.
pub fn program(name: &str) -> Command {
    if cfg!(windows) && matches!(name, "npm" | "npx") {
        return Command::new(format!("{name}.cmd"));
    }
    Command::new(name)
}

/// Cargo: the one that runs this program.
pub fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    if std::io::stderr().is_terminal() && std::env::var_os("CARGO_TERM_COLOR").is_none() {
        command.env("CARGO_TERM_COLOR", "always");
    }
    command
}

enum Line {
    Out(String),
    Err(String),
}

/// Run a command, pass its lines on as they come, and show each (without colour codes) to `watch`.
///
/// Returns whether it ended with status 0.
///
/// # Errors
///
/// The program cannot be started or waited for.
pub fn watched(command: &mut Command, mut watch: impl FnMut(&str)) -> Result<bool> {
    let name = spelled(command);
    let started = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .when(|| format!("start `{name}`"))?;
    let (send, lines) = mpsc::channel();
    if let Some(out) = child.stdout.take() {
        relay(out, send.clone(), Line::Out);
    }
    if let Some(err) = child.stderr.take() {
        relay(err, send.clone(), Line::Err);
    }
    drop(send);
    loop {
        match lines.recv_timeout(QUIET) {
            Ok(Line::Out(line)) => {
                println!("{line}");
                watch(&plain(&line));
            }
            Ok(Line::Err(line)) => {
                eprintln!("{line}");
                watch(&plain(&line));
            }
            Err(RecvTimeoutError::Timeout) => {
                eprintln!("    ... {name}: still running after {} s", started.elapsed().as_secs());
            }
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    std::io::stdout().flush().ok();
    let status = child.wait().when(|| format!("wait for `{name}`"))?;
    Ok(status.success())
}

/// Run a command that must succeed.
///
/// # Errors
///
/// It cannot be started, or its exit status is not 0.
pub fn succeeds(command: &mut Command) -> Result<()> {
    if watched(command, |_| ())? { Ok(()) } else { fail(format!("`{}` failed; its output is above", spelled(command))) }
}

/// Standard output of a command that must succeed, unseen.
///
/// # Errors
///
/// It cannot be started, or its exit status is not 0; the sentence carries what it wrote to standard error.
pub fn output(command: &mut Command) -> Result<String> {
    let name = spelled(command);
    let done = command.stdin(Stdio::null()).output().when(|| format!("start `{name}`"))?;
    if !done.status.success() {
        return fail(format!("`{name}` failed: {}", String::from_utf8_lossy(&done.stderr).trim()));
    }
    Ok(String::from_utf8_lossy(&done.stdout).into_owned())
}

/// The file that the shell would run for `name`, looked for in `PATH`.
pub fn which(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).find_map(|folder| executable_in(&folder, name))
}

/// The file of program `name` inside `folder`, if it is there.
pub fn executable_in(folder: &Path, name: &str) -> Option<PathBuf> {
    let file = folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    file.is_file().then_some(file)
}

/// Pass on every line of one pipe.
fn relay(pipe: impl Read + Send + 'static, lines: Sender<Line>, kind: fn(String) -> Line) {
    thread::spawn(move || {
        let mut pipe = BufReader::new(pipe);
        let mut bytes = Vec::new();
        while pipe.read_until(b'\n', &mut bytes).is_ok_and(|count| count > 0) {
            let line = String::from_utf8_lossy(&bytes).trim_end_matches(['\n', '\r']).to_owned();
            bytes.clear();
            if lines.send(kind(line)).is_err() {
                break;
            }
        }
    });
}

/// A command as one would type it, without the folders of the program and without its long end.
fn spelled(command: &Command) -> String {
    let name = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    let words: Vec<_> = std::iter::once(name).chain(command.get_args()).map(OsStr::to_string_lossy).collect();
    let text = words.join(" ");
    match text.char_indices().nth(SPELLED) {
        Some((end, _)) => format!("{} ...", text[..end].trim_end()),
        None => text,
    }
}

/// The line without terminal colour codes (`ESC [ ... letter`).
pub fn plain(line: &str) -> String {
    let mut text = String::with_capacity(line.len());
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        if letter == '\u{1b}' && letters.peek() == Some(&'[') {
            letters.next();
            letters.by_ref().find(|code| code.is_ascii_alphabetic());
        } else {
            text.push(letter);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_codes_are_taken_out() {
        assert_eq!(plain("\u{1b}[1m\u{1b}[32m 3 passed\u{1b}[39m (3)"), " 3 passed (3)");
    }

    #[test]
    fn a_program_that_does_not_exist_is_named() {
        let refused = watched(&mut Command::new("no-such-program-here"), |_| ()).unwrap_err();
        assert!(refused.0.starts_with("cannot start `no-such-program-here`"), "{refused}");
    }
}
