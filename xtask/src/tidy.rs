//! House rules that the compiler does not check: layers, heads of files, lengths, citations, open ends.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

/// The layer of every crate: it may use crates of lower layers only. `testkit` is for tests alone.
const LAYERS: &[(&str, u32)] = &[
    ("math", 0),
    ("statistics", 0),
    ("spectrum", 1),
    ("sampling", 1),
    ("image", 2),
    ("scatter", 2),
    ("accel", 2),
    ("film", 2),
    ("scene-desc", 2),
    ("formats", 3),
    ("scene", 3),
    ("integrators", 4),
    ("render", 5),
    ("lab", 6),
    ("cli", 7),
    ("python", 8),
    ("web", 7),
    ("testkit", 7),
];

/// Lines of a file, tests not counted.
const MAX_LINES: usize = 400;

/// Longer files, each with its reason. The list may only shrink.
const LONG_FILES: &[(&str, &str)] = &[];

/// Checks everything and reports all that is wrong.
pub(crate) fn check(root: &Path) -> Result<()> {
    let mut wrong = Vec::new();
    layers(root, &mut wrong)?;
    let bibliography = bibliography_keys(root)?;
    let mut used = BTreeSet::new();
    for file in rust_files(root)? {
        let text = fs::read_to_string(&file).with_context(|| file.display().to_string())?;
        let name = file.strip_prefix(root).unwrap_or(&file).display().to_string();
        head(&name, &text, &mut wrong);
        length(&name, &text, &mut wrong);
        open_ends(&name, &text, &mut wrong);
        for key in citations(&text) {
            if !bibliography.contains(&key) {
                wrong.push(format!("{name}: [{key}] is not in docs/references.bib"));
            }
            used.insert(key);
        }
    }
    wrong
        .extend(bibliography.difference(&used).map(|k| format!("docs/references.bib: {k} is cited nowhere")));
    if wrong.is_empty() {
        return Ok(());
    }
    bail!("{} rules broken\n  {}", wrong.len(), wrong.join("\n  "))
}

fn layers(root: &Path, wrong: &mut Vec<String>) -> Result<()> {
    let layer: BTreeMap<_, _> = LAYERS.iter().copied().collect();
    for entry in fs::read_dir(root.join("crates"))? {
        let dir = entry?.path();
        let name = dir.file_name().and_then(|n| n.to_str()).unwrap_or_default().to_owned();
        let Some(&own) = layer.get(name.as_str()) else {
            wrong.push(format!("crates/{name}: no layer; add it to xtask/src/tidy.rs"));
            continue;
        };
        let manifest: toml::Table = fs::read_to_string(dir.join("Cargo.toml"))?.parse()?;
        let uses = manifest.get("dependencies").and_then(|d| d.as_table()).into_iter().flat_map(|d| d.keys());
        for used in uses {
            if name != "testkit" && layer.get(used.as_str()).is_some_and(|&l| l >= own) {
                wrong.push(format!("crates/{name} (layer {own}) uses {used}, which is not below it"));
            }
        }
    }
    Ok(())
}

fn bibliography_keys(root: &Path) -> Result<BTreeSet<String>> {
    let text = fs::read_to_string(root.join("docs/references.bib")).context("docs/references.bib")?;
    let key = |line: &str| Some(line.strip_prefix('@')?.split_once('{')?.1.split(',').next()?.to_owned());
    Ok(text.lines().filter_map(key).collect())
}

fn rust_files(root: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![root.join("crates"), root.join("tests"), root.join("xtask")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            if path.is_dir() && path.file_name().is_none_or(|n| n != "target") {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

fn head(name: &str, text: &str, wrong: &mut Vec<String>) {
    if !text.starts_with("//!") {
        wrong.push(format!("{name}: does not open with `//!` and what it is"));
    }
}

fn length(name: &str, text: &str, wrong: &mut Vec<String>) {
    let code = text.split("\n#[cfg(test)]").next().unwrap_or(text).lines().count();
    let excused = LONG_FILES.iter().any(|(file, _)| *file == name);
    let is_test = name.contains("/tests/") || name.contains("/benches/");
    if code > MAX_LINES && !excused && !is_test {
        wrong.push(format!("{name}: {code} lines without tests, more than {MAX_LINES}"));
    }
    if code <= MAX_LINES && excused {
        wrong.push(format!("{name}: needs no exception any more; take it from the list"));
    }
}

fn open_ends(name: &str, text: &str, wrong: &mut Vec<String>) {
    let mark = concat!("TO", "DO");
    for (i, line) in text.lines().enumerate() {
        if line.contains(mark) && !line.contains('#') {
            wrong.push(format!("{name}:{}: an open end without an issue number", i + 1));
        }
    }
}

/// Keys such as `[Veach1997, sec. 9.2]` in comments: a year at the end, or a book or standard with a number.
fn citations(text: &str) -> BTreeSet<String> {
    let comments = text.lines().filter_map(|l| l.find("//").map(|at| &l[at..]));
    let bracketed = comments.flat_map(|line| line.split('[').skip(1));
    let inside = bracketed.filter_map(|rest| rest.split_once(']')).map(|(inside, _)| inside);
    inside.flat_map(|inside| inside.split(';')).filter_map(citation_key).collect()
}

fn citation_key(text: &str) -> Option<String> {
    let text = text.trim_start();
    let key: String = text.chars().take_while(char::is_ascii_alphanumeric).collect();
    let rest = &text[key.len()..];
    let letters = key.chars().take_while(char::is_ascii_alphabetic).count();
    let digits = key[letters..].chars().take_while(char::is_ascii_digit).count();
    let is_year = digits == 4 && letters >= 3 && key.len() - letters - digits <= 1;
    let is_book = ["PBR", "CIE", "BT", "IEC"].contains(&&key[..letters]) && digits > 0;
    let is_key = (is_year || is_book || key == "DLMF") && (rest.is_empty() || rest.starts_with(','));
    (is_key && key.starts_with(|c: char| c.is_ascii_uppercase())).then_some(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_told_from_links() {
        assert_eq!(citation_key("Veach1997, ch. 9"), Some("Veach1997".into()));
        assert_eq!(citation_key("Clarberg2008"), Some("Clarberg2008".into()));
        assert_eq!(citation_key("PBR4e, sec. 6.2"), Some("PBR4e".into()));
        assert_eq!(citation_key("SceneDesc"), None);
        assert_eq!(citation_key("0, 1"), None);
    }

    #[test]
    fn a_file_without_a_head_is_found() {
        let mut wrong = Vec::new();
        head("a.rs", "fn main() {}", &mut wrong);
        assert_eq!(wrong.len(), 1);
    }
}
