//! Whether everything that is used may be used in a work under MIT or Apache-2.0.

use serde_json::Value;

/// Licences that ask for no more than the two of this repository.
const PERMISSIVE: [&str; 15] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-1-Clause",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unicode-DFS-2016",
    "Unlicense",
    "Zlib",
];
/// Further licences of npm packages that only build or test the page: no part of them is in what is published.
const TOOLS_ONLY: [&str; 5] = ["BlueOak-1.0.0", "CC-BY-3.0", "CC-BY-4.0", "MPL-2.0", "Python-2.0"];

/// Crates whose licence is unknown or asks for more, from `cargo metadata`.
pub fn of_crates(metadata: &Value) -> Vec<String> {
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let wrong = packages.filter(|package| !allowed(package["license"].as_str().unwrap_or_default(), &PERMISSIVE));
    wrong.map(|package| described(package["name"].as_str(), package["license"].as_str())).collect()
}

/// npm packages whose licence is unknown or asks for more, from `package-lock.json`.
pub fn of_npm_packages(lock: &Value) -> Vec<String> {
    let tools: Vec<&str> = PERMISSIVE.iter().chain(&TOOLS_ONLY).copied().collect();
    let packages = lock["packages"].as_object().into_iter().flatten().filter(|(path, _)| !path.is_empty());
    let wrong = packages.filter(|(_, package)| {
        let list: &[&str] = if package["dev"] == true || package["devOptional"] == true { &tools } else { &PERMISSIVE };
        !allowed(package["license"].as_str().unwrap_or_default(), list)
    });
    let name = |path: &String| path.rsplit("node_modules/").next().unwrap_or_default().to_owned();
    wrong.map(|(path, package)| described(Some(&name(path)), package["license"].as_str())).collect()
}

fn described(name: Option<&str>, licence: Option<&str>) -> String {
    format!("{} is under {}", name.unwrap_or("a package"), licence.unwrap_or("no stated licence"))
}

/// Whether an SPDX expression can be met by licences of a list: `A OR B` by either, `A AND B` by both.
///
/// The older `A/B` means `A OR B`.
fn allowed(expression: &str, list: &[&str]) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ").replace(" WITH ", "+WITH+");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    either(&words, &mut at, list) && at == words.len()
}

fn either(words: &[&str], at: &mut usize, list: &[&str]) -> bool {
    let mut met = both(words, at, list);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        met |= both(words, at, list);
    }
    met
}

fn both(words: &[&str], at: &mut usize, list: &[&str]) -> bool {
    let mut met = one(words, at, list);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        met &= one(words, at, list);
    }
    met
}

fn one(words: &[&str], at: &mut usize, list: &[&str]) -> bool {
    let word = words.get(*at).copied().unwrap_or_default();
    *at += 1;
    if word != "(" {
        return list.contains(&word.replace("+WITH+", " WITH ").as_str());
    }
    let met = either(words, at, list);
    let closed = words.get(*at) == Some(&")");
    *at += 1;
    met && closed
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn expressions_are_met_as_spdx_means_them() {
        for good in [
            "MIT",
            "MIT/Apache-2.0",
            "GPL-3.0 OR MIT",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
            "Apache-2.0 WITH LLVM-exception",
        ] {
            assert!(allowed(good, &PERMISSIVE), "{good}");
        }
        for bad in [
            "",
            "GPL-3.0",
            "MIT AND GPL-3.0",
            "MIT OR",
            "(MIT",
            "MIT)",
            "Apache-2.0 WITH Something",
            "SEE LICENSE IN x",
        ] {
            assert!(!allowed(bad, &PERMISSIVE), "{bad}");
        }
    }

    #[test]
    fn a_tool_may_be_under_a_licence_that_a_part_of_the_page_may_not() {
        let lock = json!({"packages": {
            "": {"name": "page"},
            "node_modules/shipped": {"license": "MPL-2.0"},
            "node_modules/tool": {"license": "MPL-2.0", "dev": true},
            "node_modules/a/node_modules/b": {},
        }});
        assert_eq!(of_npm_packages(&lock), ["b is under no stated licence", "shipped is under MPL-2.0"]);
    }

    #[test]
    fn a_crate_without_a_licence_is_named() {
        let metadata = json!({"packages": [{"name": "x", "license": null}, {"name": "y", "license": "MIT"}]});
        assert_eq!(of_crates(&metadata), ["x is under no stated licence"]);
    }
}
