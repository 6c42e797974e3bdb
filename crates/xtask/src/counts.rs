//! Counting tests in what the test programs print.

use std::ops::AddAssign;

/// How many tests ended how, and which of them somebody should look at.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    /// Tests that passed.
    pub passed: usize,
    /// Tests that failed.
    pub failed: usize,
    /// Tests that were ignored or said `SKIPPED:`.
    pub skipped: usize,
    /// Failures and skipped tests, each in one line.
    pub notes: Vec<String>,
}

impl Tally {
    /// One check that passed.
    pub fn pass() -> Self {
        Self { passed: 1, ..Self::default() }
    }

    /// One check that failed, and why.
    pub fn failure(why: impl Into<String>) -> Self {
        Self { failed: 1, notes: vec![why.into()], ..Self::default() }
    }

    /// The last line of a run.
    pub fn line(&self) -> String {
        let mut line = format!("{} passed, {} failed", self.passed, self.failed);
        if self.skipped > 0 {
            line.push_str(&format!(", {} skipped", self.skipped));
        }
        line
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
        self.notes.extend(other.notes);
    }
}

/// Reads the lines of one test program.
#[derive(Debug, Default)]
pub struct Counter {
    tally: Tally,
    said_skipped: usize,
}

impl Counter {
    /// Take notice of one line, whichever program wrote it.
    ///
    /// Known: `cargo test` and `wasm-bindgen-test-runner` (`test result: ...`), vitest (`Tests  1 failed | 2 passed (3)`),
    /// `node --test` (`# pass 3`), and tests of any of them that print a line `SKIPPED: why` and pass.
    pub fn line(&mut self, line: &str) {
        let line = line.trim();
        // A Rust test's own output may follow its name on one line, so this looks inside.
        if let Some((_, why)) = line.split_once("SKIPPED:") {
            self.said_skipped += 1;
            self.tally.notes.push(format!("skipped: {}", why.trim()));
        } else if let Some(result) = line.strip_prefix("test result:") {
            self.tally.passed += number_before(result, "passed");
            self.tally.failed += number_before(result, "failed");
            self.tally.skipped += number_before(result, "ignored");
        } else if let Some(result) = line.strip_prefix("Tests ").filter(|rest| rest.contains('(')) {
            self.tally.passed += number_before(result, "passed");
            self.tally.failed += number_before(result, "failed");
            self.tally.skipped += number_before(result, "skipped") + number_before(result, "todo");
        } else if let Some((name, count)) = node_summary(line) {
            match name {
                "pass" => self.tally.passed += count,
                "fail" | "cancelled" => self.tally.failed += count,
                "skipped" | "todo" => self.tally.skipped += count,
                _ => {}
            }
        } else if let Some(name) = failed_name(line) {
            self.tally.notes.push(format!("failed: {name}"));
        } else if line.starts_with("ok ")
            && let Some((test, why)) = line.split_once(" # SKIP")
        {
            let name = test.split_once(" - ").map_or(test, |(_, name)| name);
            self.tally.notes.push(format!("skipped: {name}{why}"));
        } else if let Some(test) = line.strip_prefix("test ")
            && let Some((name, why)) = test.split_once(" ... ignored")
        {
            self.tally.notes.push(format!("skipped: {name}{why}"));
        }
    }

    /// The counts, given whether the program ended well.
    ///
    /// A program that ended badly without naming a failed test (it did not compile, it crashed) is one failure;
    /// one that ended well without a single test is one too, because it shows nothing.
    pub fn finish(mut self, what: &str, ended_well: bool) -> Tally {
        let said = self.said_skipped.min(self.tally.passed);
        self.tally.passed -= said;
        self.tally.skipped += said;
        let seen = self.tally.passed + self.tally.failed + self.tally.skipped;
        if !ended_well && self.tally.failed == 0 {
            self.tally += Tally::failure(format!("failed: {what} ended with an error"));
        } else if ended_well && seen == 0 {
            self.tally += Tally::failure(format!("failed: {what} ran no test"));
        }
        self.tally
    }
}

/// The whole number in front of a word: 3 in `ok. 3 passed; 0 failed`.
fn number_before(text: &str, word: &str) -> usize {
    let mut before = "";
    for part in text.split([' ', ';', ',', '|', '(', ')', '.']).filter(|part| !part.is_empty()) {
        if part == word {
            return before.parse().unwrap_or(0);
        }
        before = part;
    }
    0
}

/// `# pass 3` in TAP, `ℹ pass 3` in node's own form.
fn node_summary(line: &str) -> Option<(&str, usize)> {
    let rest = line.strip_prefix("# ").or_else(|| line.strip_prefix("ℹ "))?;
    let (name, count) = rest.split_once(' ')?;
    Some((name, count.parse().ok()?))
}

/// The name of a failed test in its program's own line for it.
fn failed_name(line: &str) -> Option<&str> {
    if let Some(test) = line.strip_prefix("test ") {
        return test.strip_suffix(" ... FAILED").or_else(|| test.strip_suffix(" ... FAIL"));
    }
    if let Some(test) = line.strip_prefix("FAIL  ") {
        return Some(test);
    }
    let rest = line.strip_prefix("not ok ")?;
    rest.split_once(" - ").map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tally(text: &str, ended_well: bool) -> Tally {
        let mut counter = Counter::default();
        text.lines().for_each(|line| counter.line(line));
        counter.finish("it", ended_well)
    }

    #[test]
    fn results_of_several_cargo_tests_are_added() {
        let text = "test a::b ... ok\ntest a::c ... FAILED\ntest a::d ... ignored, needs a log\n\
            test result: FAILED. 3 passed; 1 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.01s\n\
            test result: ok. 12 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.20s";
        let tally = tally(text, false);
        assert_eq!((tally.passed, tally.failed, tally.skipped), (15, 1, 1));
        assert_eq!(tally.notes, ["failed: a::c", "skipped: a::d, needs a log"]);
    }

    #[test]
    fn a_test_that_says_skipped_is_not_counted_as_passed() {
        let text = "---- x stdout ----\nSKIPPED: no case logs here\ntest result: ok. 2 passed; 0 failed; 0 ignored; 0 measured";
        let tally = tally(text, true);
        assert_eq!((tally.passed, tally.failed, tally.skipped), (1, 0, 1));
        assert_eq!(tally.line(), "1 passed, 0 failed, 1 skipped");
    }

    #[test]
    fn vitest_is_understood() {
        let text = " Test Files  1 failed | 1 passed (2)\n      Tests  1 failed | 11 passed | 2 skipped (14)\n   Duration  2 s";
        let tally = tally(text, false);
        assert_eq!((tally.passed, tally.failed, tally.skipped), (11, 1, 2));
    }

    #[test]
    fn node_is_understood_in_both_its_forms() {
        for mark in ["#", "ℹ"] {
            let text = format!(
                "{mark} tests 4\n{mark} suites 0\n{mark} pass 2\n{mark} fail 1\n{mark} cancelled 0\n{mark} skipped 1\n{mark} todo 0\n{mark} duration_ms 51.2"
            );
            let tally = tally(&text, false);
            assert_eq!((tally.passed, tally.failed, tally.skipped), (2, 1, 1));
        }
    }

    #[test]
    fn failed_and_skipped_tests_are_named_in_every_dialect() {
        let text = "test a ... FAIL\n FAIL  test/b.test.ts > c\nnot ok 2 - d\nok 3 - e # SKIP no browser\n# fail 3";
        let notes = ["failed: a", "failed: test/b.test.ts > c", "failed: d", "skipped: e no browser"];
        assert_eq!(tally(text, false).notes, notes);
    }

    #[test]
    fn a_program_that_breaks_without_a_count_is_a_failure() {
        assert_eq!(tally("error[E0425]: cannot find value", false).line(), "0 passed, 1 failed");
        assert_eq!(tally("test result: ok. 2 passed; 0 failed; 0 ignored", false).line(), "2 passed, 1 failed");
    }

    #[test]
    fn a_program_without_tests_is_a_failure() {
        assert_eq!(tally("running 0 tests", true).line(), "0 passed, 1 failed");
    }
}
