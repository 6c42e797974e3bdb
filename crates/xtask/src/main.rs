//! What people and CI run: `cargo xtask <command>`.
//!
//! | command | does |
//! |---|---|
//! | `build [--out DIR]` | the page into `web/dist`, and its sizes |
//! | `serve [--port N] [--no-open]` | `build`, then the page on this machine |
//! | `test [--quick]` | everything that can fail, counted; `--quick` without browser, page and documentation |
//! | `check` | format, lints, documentation, types: no test is run |
//! | `hygiene` | what must not be in the repository, dependencies, licences; part of `test` and `check` |
//! | `bench [--quick]` | times natively and in the browser |
//! | `fuzz [--count N]` | every reader on N damaged files of its format, 100,000 if not said |
//! | `golden-update` | write the golden histories anew |

mod bench;
mod counts;
mod failure;
mod hygiene;
mod licences;
mod page;
mod place;
mod process;
mod serve;
mod sizes;
mod test;
mod tools;

use failure::{Failure, Result, fail};
use place::Place;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

const USAGE: &str = "usage: cargo xtask <command>

  build [--out DIR]            build the page into web/dist (and copy it to DIR)
  serve [--port N] [--no-open] build, then show the page on this machine
  test [--quick]               run everything that can fail; --quick: no browser, no page
  check                        format, lints, documentation, types, hygiene
  hygiene                      what must not be in the repository, dependencies, licences
  bench [--quick]              times natively and in the browser
  fuzz [--count N]             every reader on N damaged files of its format (100000)
  golden-update                write the golden histories anew";

fn main() -> ExitCode {
    match run(std::env::args().skip(1).collect()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure(sentence)) => {
            // A test run has said everything already; its count stays the last line.
            if !sentence.is_empty() {
                eprintln!("error: {sentence}");
            }
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: Vec<String>) -> Result<()> {
    let mut options = Options { rest: arguments };
    let command = if options.rest.is_empty() { "help".to_owned() } else { options.rest.remove(0) };
    match command.as_str() {
        "build" => {
            let out = options.value("--out")?.map(PathBuf::from);
            // A relative folder is meant from where the person stands.
            let out = out.map(|out| std::path::absolute(&out).unwrap_or(out));
            options.none_left()?;
            let place = Place::find()?;
            page::build(&place)?;
            out.map_or(Ok(()), |out| page::copy(&place, &out))
        }
        "serve" => {
            let port = match options.value("--port")? {
                Some(text) => {
                    text.parse().map_err(|_| Failure(format!("--port needs a number up to 65535, not {text}")))?
                }
                None => serve::PORT,
            };
            let open = !options.flag("--no-open");
            options.none_left()?;
            serve_page(&Place::find()?, port, open)
        }
        "test" => {
            let quick = options.flag("--quick");
            options.none_left()?;
            test::test(&Place::find()?, quick)
        }
        "check" => {
            options.none_left()?;
            test::check(&Place::find()?)
        }
        "hygiene" => {
            options.none_left()?;
            test::hygiene(&Place::find()?)
        }
        "bench" => {
            let quick = options.flag("--quick");
            options.none_left()?;
            bench::run(&Place::find()?, quick)
        }
        "fuzz" => {
            let count = options.value("--count")?.unwrap_or_else(|| "100000".into());
            let count = count.parse().map_err(|_| Failure(format!("--count needs a number, not {count}")))?;
            options.none_left()?;
            test::fuzz(&Place::find()?, count)
        }
        "golden-update" => {
            options.none_left()?;
            test::golden_update(&Place::find()?)
        }
        "help" | "--help" | "-h" => {
            println!("{USAGE}");
            Ok(())
        }
        other => fail(format!("there is no command {other}\n\n{USAGE}")),
    }
}

fn serve_page(place: &Place, port: u16, open: bool) -> Result<()> {
    page::build(place)?;
    let listener = serve::listen(port)?;
    let address = serve::address(&listener)?;
    println!("{address}");
    if open {
        show(&address);
    }
    let dist = place.dist();
    serve::answer(&listener, move |request| serve::file(&dist, request));
    Ok(())
}

/// Open an address in the person's browser where there is one; the printed address serves everybody else.
fn show(address: &str) {
    let (program, arguments) = if cfg!(target_os = "macos") {
        ("open", vec![address])
    } else if cfg!(windows) {
        ("cmd", vec!["/c", "start", address])
    } else if std::env::var_os("DISPLAY").is_some() || std::env::var_os("WAYLAND_DISPLAY").is_some() {
        ("xdg-open", vec![address])
    } else {
        return;
    };
    let _ =
        Command::new(program).args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
}

/// The arguments that nobody has asked for yet.
struct Options {
    rest: Vec<String>,
}

impl Options {
    fn flag(&mut self, name: &str) -> bool {
        let count = self.rest.len();
        self.rest.retain(|argument| argument != name);
        self.rest.len() < count
    }

    fn value(&mut self, name: &str) -> Result<Option<String>> {
        let Some(at) = self.rest.iter().position(|argument| argument == name) else { return Ok(None) };
        if at + 1 == self.rest.len() {
            return fail(format!("{name} needs a value"));
        }
        self.rest.remove(at);
        Ok(Some(self.rest.remove(at)))
    }

    fn none_left(&self) -> Result<()> {
        match self.rest.first() {
            Some(argument) => fail(format!("{argument} is no option of this command\n\n{USAGE}")),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_taken_in_any_order_and_the_rest_is_refused() {
        let mut options = Options { rest: ["--no-open", "--port", "9", "x"].map(String::from).to_vec() };
        assert_eq!(options.value("--port"), Ok(Some("9".into())));
        assert!(options.flag("--no-open") && !options.flag("--quick"));
        assert!(options.none_left().unwrap_err().0.starts_with("x is no option"));
        assert!(Options { rest: vec!["--port".into()] }.value("--port").is_err());
    }
}
