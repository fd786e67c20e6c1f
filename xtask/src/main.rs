//! The project's chores: `cargo xtask test`, `cargo xtask tidy`, `cargo xtask ci`.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

mod mutants;
mod python;
mod tidy;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};

const HELP: &str = "\
usage: cargo xtask COMMAND

  test    everything that must be green: format, tidy, every test, also Python's
  python  the Python package alone: build it into target/python, test it, check its types
  kinds   write python/steradian/kinds.py anew, after a change of scene-desc
  tidy    the house rules that the compiler does not check
  lint    clippy over the workspace, warnings are errors
  doc     the documentation builds without a warning
  ci      what CI runs: test, lint, doc
  mutants puts known mistakes into a copy of the tree, one at a time, and sees that tests find them (long);
          mutants NAME... tries some, mutants --list names all";

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let command = args.next().unwrap_or_default();
    match run(&command, &args.collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("xtask {command}: {e:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: &str, args: &[String]) -> Result<()> {
    match command {
        "test" => test(),
        "python" => python::test(&root()),
        "kinds" => python::kinds(&root()),
        "tidy" => tidy::check(&root()),
        "lint" => cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]),
        "doc" => cargo(&["doc", "--workspace", "--no-deps"]),
        "ci" => {
            test()?;
            run("lint", &[])?;
            run("doc", &[])
        }
        "mutants" if args.first().is_some_and(|a| a == "--list") => {
            mutants::list();
            Ok(())
        }
        "mutants" => mutants::run(&root(), args),
        "" | "help" | "--help" | "-h" => {
            println!("{HELP}");
            Ok(())
        }
        other => bail!("no command `{other}`\n{HELP}"),
    }
}

fn test() -> Result<()> {
    if has("fmt") {
        cargo(&["fmt", "--all", "--check"])?;
    } else {
        println!("SKIPPED: cargo fmt --check (rustup component add rustfmt)");
    }
    tidy::check(&root())?;
    cargo(&["test", "--workspace", "--no-fail-fast"])?;
    python::test(&root())
}

/// Is a sub-command of cargo installed?
fn has(command: &str) -> bool {
    let output = Command::new(program()).args([command, "--version"]).output();
    output.is_ok_and(|o| o.status.success())
}

pub(crate) fn program() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

fn cargo(args: &[&str]) -> Result<()> {
    println!("$ cargo {}", args.join(" "));
    let mut command = Command::new(program());
    if args.first() == Some(&"doc") {
        command.env("RUSTDOCFLAGS", "-D warnings");
    }
    let status = command.args(args).current_dir(root()).status().context("cannot start cargo")?;
    if !status.success() {
        bail!("`cargo {}` failed", args.join(" "));
    }
    Ok(())
}

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_owned()
}
