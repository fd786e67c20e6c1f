//! `cargo xtask mutants`: puts known mistakes in, one at a time, and sees that tests find them.
//!
//! Works in a copy of the tree with a target folder of its own (`target/mutants`); the tree itself is not touched. A
//! mistake that does not compile, or whose place in the source is gone, is an error and counts as nothing found.

mod list;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use list::{MUTANTS, Mutant, Tests};

/// Runs those that are named, or all; prints the table of `docs/planted-bugs.md`.
pub(crate) fn run(root: &Path, names: &[String]) -> Result<()> {
    let chosen: Vec<&Mutant> = match names {
        [] => MUTANTS.iter().collect(),
        names => names.iter().map(|name| find(name)).collect::<Result<_>>()?,
    };
    let scratch = Scratch::new(root)?;
    println!("| mistake | where | caught by | how clearly |\n|---|---|---|---|");
    let mut missed = Vec::new();
    for mutant in chosen {
        let verdict = scratch.try_out(mutant);
        let caught_by = match &verdict {
            Ok(v) if v.failed.is_empty() => "**missed**".to_owned(),
            Ok(v) => v.caught_by(),
            Err(e) => format!("**not tried**: {e:#}"),
        };
        let file = Path::new(mutant.file).strip_prefix("crates").unwrap_or(Path::new(mutant.file));
        println!(
            "| {} (`{}`) | `{}` | {caught_by} | {} |",
            mutant.mistake,
            mutant.name,
            file.display(),
            verdict.as_ref().map_or("", |v| &v.clearly),
        );
        if verdict.is_ok_and(|v| !v.failed.is_empty()) {
            continue;
        }
        missed.push(mutant.name);
    }
    ensure!(missed.is_empty(), "not caught: {}", missed.join(", "));
    Ok(())
}

/// The names, for `--list`.
pub(crate) fn list() {
    MUTANTS.iter().for_each(|m| println!("{:30} {}", m.name, m.mistake));
}

fn find(name: &str) -> Result<&'static Mutant> {
    MUTANTS.iter().find(|m| m.name == name).with_context(|| format!("no mutant `{name}`; see mutants --list"))
}

impl Mutant {
    /// The file's text with the mistake.
    fn apply(&self, text: &str) -> Result<String> {
        let n = text.matches(self.from).count();
        ensure!(n == 1, "{}: `{}` stands {n} times in it, not once", self.file, self.from);
        Ok(text.replacen(self.from, self.to, 1))
    }
}

/// What became of a mistake.
#[derive(Default)]
struct Verdict {
    /// Tests that failed.
    failed: BTreeSet<String>,
    /// The clearest disagreement that one of them printed.
    clearly: String,
    statistic: f64,
}

impl Verdict {
    fn caught_by(&self) -> String {
        const SHOWN: usize = 3;
        let shown: Vec<String> = self.failed.iter().take(SHOWN).map(|t| format!("`{t}`")).collect();
        let more = self.failed.len().saturating_sub(SHOWN);
        if more > 0 { format!("{} and {more} more", shown.join(", ")) } else { shown.join(", ") }
    }

    /// Reads what a test binary printed.
    fn read(&mut self, output: &str) {
        let failed = output.lines().filter_map(|l| l.strip_prefix("test ")?.strip_suffix(" ... FAILED"));
        self.failed.extend(failed.map(ToOwned::to_owned));
        for line in output.lines() {
            if let Some((text, t)) = disagreement(line)
                && t.abs() > self.statistic
            {
                (self.clearly, self.statistic) = (text, t.abs());
            }
        }
    }
}

/// `path and light, +64 %, t = 23` of a line of the agreement tests, and its t.
fn disagreement(line: &str) -> Option<(String, f64)> {
    let (_, rest) = line.split_once(": ")?;
    let (pair, rest) = rest.split_once(": tile ")?;
    let methods =
        pair.split(" and ").map(|m| m.split(' ').next().unwrap_or(m)).collect::<Vec<_>>().join(" and ");
    let percent: f64 = rest.split_once('(')?.1.split_once(" %")?.0.parse().ok()?;
    let t: f64 = rest.split_once("t = ")?.1.split_once(',')?.0.parse().ok()?;
    Some((format!("{methods} {percent:+.0} %, t = {t:.0}"), t))
}

/// A copy of the tree.
struct Scratch {
    tree: PathBuf,
    target: PathBuf,
}

impl Scratch {
    /// Brings the copy up to date; files that did not change keep their times, so that little is built again.
    fn new(root: &Path) -> Result<Self> {
        let base = root.join("target/mutants");
        let scratch = Self { tree: base.join("tree"), target: base.join("target") };
        let output = Command::new("git")
            .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
            .current_dir(root)
            .output();
        let output = output.context("cannot ask git for the tree's files")?;
        ensure!(output.status.success(), "git ls-files failed: the tree must be a checkout");
        let names = String::from_utf8(output.stdout).context("a file's name")?;
        for name in names.split('\0').filter(|n| !n.is_empty() && root.join(n).is_file()) {
            let bytes = fs::read(root.join(name)).with_context(|| name.to_owned())?;
            scratch.write(name, &bytes)?;
        }
        Ok(scratch)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let to = self.tree.join(name);
        if fs::read(&to).is_ok_and(|old| old == bytes) {
            return Ok(());
        }
        let folder = to.parent().unwrap_or(&self.tree);
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        fs::write(&to, bytes).with_context(|| to.display().to_string())
    }

    /// Plants the mistake, runs its tests, takes it out again.
    fn try_out(&self, mutant: &Mutant) -> Result<Verdict> {
        let path = self.tree.join(mutant.file);
        let sound = fs::read_to_string(&path).with_context(|| mutant.file.to_owned())?;
        self.write(mutant.file, mutant.apply(&sound)?.as_bytes())?;
        let mut verdict = Verdict::default();
        let outcome = mutant.tests.iter().try_for_each(|tests| self.test(tests, &mut verdict));
        self.write(mutant.file, sound.as_bytes())?;
        outcome.map(|()| verdict)
    }

    fn test(&self, tests: &Tests, verdict: &mut Verdict) -> Result<()> {
        let mut command = Command::new(crate::program());
        command.args(["test", "-p", tests.package]).args(tests.target);
        command.arg("--").args(tests.filters);
        command.env("CARGO_TARGET_DIR", &self.target).current_dir(&self.tree);
        let output = command.output().context("cannot start cargo")?;
        let printed = String::from_utf8_lossy(&output.stdout);
        if !printed.contains("test result:") {
            let errors = String::from_utf8_lossy(&output.stderr);
            let first = errors.lines().find(|l| l.starts_with("error")).unwrap_or("no test ran");
            bail!("the tests of {} were not run: {first}", tests.package);
        }
        ensure!(!printed.contains("running 0 tests"), "no test of {} is named so", tests.package);
        verdict.read(&printed);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What makes the list worth keeping: the source moves on, and a mistake must still have its place.
    #[test]
    fn every_mistake_still_has_its_place() {
        let root = crate::root();
        let mut names = BTreeSet::new();
        let mut wrong = Vec::new();
        for m in MUTANTS {
            let text = fs::read_to_string(root.join(m.file)).unwrap_or_default();
            match m.apply(&text) {
                Ok(changed) => assert_ne!(changed, text, "{} changes nothing", m.name),
                Err(e) => wrong.push(format!("{}: {e}", m.name)),
            }
            assert!(names.insert(m.name), "two mutants are named {}", m.name);
            assert!(!m.tests.is_empty(), "{} has no tests", m.name);
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn what_tests_print_is_read() {
        let mut verdict = Verdict::default();
        verdict.read(
            "test on_points ... ok\ntest on_lamps ... FAILED\n\
             lamps: path max_depth=4 and light max_depth=4: tile 3 colour 1: 0.1 and 0.2 (-19.42 %), t = -16.21, p = 1e-9\n\
             lamps: path max_depth=4 and bdpt max_depth=4: tile 3 colour 1: 0.1 and 0.1 (-1.00 %), t = -2.00, p = 1e-2\n",
        );
        assert_eq!(verdict.caught_by(), "`on_lamps`");
        assert_eq!(verdict.clearly, "path and light -19 %, t = -16");
    }
}
