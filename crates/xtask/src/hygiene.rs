//! What must not be in the repository, and what must be said about what it depends on.

use crate::counts::Tally;
use crate::failure::{Explain, Result, fail};
use crate::licences;
use crate::place::{self, Place};
use crate::process;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Folders of a machine, without the leading slash so that this file does not break its own rule.
const MACHINE_FOLDERS: [&str; 5] = ["work", "tmp", "root", "home", "Users"];
/// Hosts that package tools download from, in two halves for the same reason.
const REGISTRY_HOSTS: [(&str, &str); 7] = [
    ("registry.npm", "js.org"),
    ("registry.yarn", "pkg.com"),
    ("index.crates", ".io"),
    ("static.crates", ".io"),
    ("files.python", "hosted.org"),
    ("deb.deb", "ian.org"),
    ("security.deb", "ian.org"),
];
const LOCKS: [&str; 2] = ["Cargo.lock", "package-lock.json"];
/// Folders and endings of files that are made, not written.
const MADE_FOLDERS: [&str; 8] = [
    "target/",
    "web/dist/",
    "web/node_modules/",
    "web/src/generated/",
    "crates/wasm/pkg/",
    "crates/drives/pkg/",
    "crates/gallery/pkg/",
    "crates/readers/pkg/",
];
const MADE_ENDINGS: [&str; 3] = [".wasm", ".tsbuildinfo", ".profraw"];

/// All rules of this file, one check each.
///
/// # Errors
///
/// The repository cannot be read.
pub fn check(place: &Place) -> Result<Tally> {
    let files = files(place)?;
    let mut texts = Vec::new();
    for name in &files {
        let is_lock = LOCKS.iter().any(|lock| Path::new(name).ends_with(lock));
        // A file that git knows may have been removed since; what is not text names nothing.
        if !is_lock && let Ok(text) = std::fs::read_to_string(place.root.join(name)) {
            texts.push((name.as_str(), text));
        }
    }
    let mut tally = judged("no file names a folder of a machine", found_in(&texts, names_machine_folder));
    tally += judged("no file names a package registry", found_in(&texts, names_registry));
    tally += judged("no made file is committed", made_files(&files));
    tally += judged("every dependency is explained", unexplained(place)?);
    tally += judged("licences of crates", licences::of_crates(&place::metadata(&place.root, &[])?));
    tally +=
        judged("licences of npm packages", licences::of_npm_packages(&json(&place.web().join("package-lock.json"))?));
    Ok(tally)
}

fn judged(rule: &str, offenders: Vec<String>) -> Tally {
    if offenders.is_empty() {
        return Tally::pass();
    }
    Tally::failure(format!("failed: {rule}: {}", offenders.join("; ")))
}

/// The names of all files that are committed or would be by `git add --all`.
fn files(place: &Place) -> Result<Vec<String>> {
    let mut git = Command::new("git");
    git.current_dir(&place.root).args(["ls-files", "--cached", "--others", "--exclude-standard"]);
    Ok(process::output(&mut git)?.lines().map(str::to_owned).collect())
}

fn found_in(texts: &[(&str, String)], wrong: fn(&str) -> bool) -> Vec<String> {
    let lines =
        texts.iter().flat_map(|(name, text)| text.lines().enumerate().map(move |(row, line)| (name, row, line)));
    lines.filter(|(_, _, line)| wrong(line)).map(|(name, row, _)| format!("{name}:{}", row + 1)).take(20).collect()
}

/// Whether a line holds an absolute path that starts at one of [`MACHINE_FOLDERS`].
fn names_machine_folder(line: &str) -> bool {
    MACHINE_FOLDERS.iter().any(|folder| {
        let path = format!("/{folder}");
        line.match_indices(&path).any(|(at, _)| {
            let before = line[..at].chars().next_back();
            let after = line[at + path.len()..].chars().next();
            let inside = |letter: char| letter.is_alphanumeric() || "._-~/*})$".contains(letter);
            !before.is_some_and(inside)
                && !after.is_some_and(|letter| letter.is_alphanumeric() || "_-.".contains(letter))
        })
    })
}

fn names_registry(line: &str) -> bool {
    REGISTRY_HOSTS.iter().any(|(left, right)| line.contains(&format!("{left}{right}")))
}

fn made_files(files: &[String]) -> Vec<String> {
    let is_made = |name: &&String| {
        MADE_FOLDERS.iter().any(|folder| name.starts_with(folder)) || MADE_ENDINGS.iter().any(|end| name.ends_with(end))
    };
    files.iter().filter(is_made).cloned().collect()
}

/// Direct dependencies without a row in `docs/dependencies.md`, and rows without a dependency.
fn unexplained(place: &Place) -> Result<Vec<String>> {
    let text =
        std::fs::read_to_string(place.root.join("docs/dependencies.md")).when(|| "read docs/dependencies.md".into())?;
    let explained = rows(&text);
    let mut used = crates_used(&place.metadata);
    let package = json(&place.web().join("package.json"))?;
    for kind in ["dependencies", "devDependencies"] {
        used.extend(package[kind].as_object().into_iter().flatten().map(|(name, _)| name.clone()));
    }
    let missing = used.difference(&explained).map(|name| format!("docs/dependencies.md does not explain {name}"));
    let stale =
        explained.difference(&used).map(|name| format!("docs/dependencies.md explains {name}, which nothing uses"));
    Ok(missing.chain(stale).collect())
}

/// The names in the first cells of the document's tables: rows that start with a name in backticks.
fn rows(text: &str) -> BTreeSet<String> {
    text.lines().filter_map(|line| Some(line.strip_prefix("| `")?.split_once('`')?.0.to_owned())).collect()
}

/// The crates from outside that members of the workspace name.
fn crates_used(metadata: &Value) -> BTreeSet<String> {
    let packages = metadata["packages"].as_array().into_iter().flatten();
    packages
        .flat_map(|package| package["dependencies"].as_array().into_iter().flatten())
        .filter(|dependency| dependency["source"].is_string())
        .filter_map(|dependency| dependency["name"].as_str().map(str::to_owned))
        .collect()
}

fn json(file: &Path) -> Result<Value> {
    let Ok(text) = std::fs::read_to_string(file) else {
        return fail(format!("{} is missing", file.file_name().unwrap_or_default().to_string_lossy()));
    };
    serde_json::from_str(&text).when(|| format!("read {}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_a_machine_are_seen_and_web_paths_are_not() {
        for folder in MACHINE_FOLDERS {
            assert!(names_machine_folder(&format!("open(\"/{folder}/x.csv\")")), "{folder}");
            assert!(names_machine_folder(&format!("in /{folder}")), "{folder}");
            assert!(!names_machine_folder(&format!("https://example.org/{folder}/page")), "{folder}");
            assert!(!names_machine_folder(&format!("a/{folder}/b, /{folder}s")), "{folder}");
        }
    }

    #[test]
    fn registries_are_seen() {
        assert!(names_registry(&format!("https://{}{}/x", REGISTRY_HOSTS[0].0, REGISTRY_HOSTS[0].1)));
        assert!(!names_registry("https://docs.rs/nalgebra"));
    }

    #[test]
    fn made_files_are_seen() {
        let files = ["web/dist/index.html", "docs/a.md", "x/core.wasm"].map(String::from);
        assert_eq!(made_files(&files), ["web/dist/index.html", "x/core.wasm"]);
    }

    #[test]
    fn rows_are_names_in_backticks_at_the_start_of_a_row() {
        let text = "| name | why |\n|---|---|\n| `serde` | with `serde_json` |\n| `@types/node` | types |\ntext `x`";
        assert_eq!(rows(text).into_iter().collect::<Vec<_>>(), ["@types/node", "serde"]);
    }
}
