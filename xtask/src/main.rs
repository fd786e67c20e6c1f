//! The project's chores: `cargo xtask test`, `cargo xtask tidy`, `cargo xtask ci`.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

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
  tidy    the house rules that the compiler does not check
  lint    clippy over the workspace, warnings are errors
  doc     the documentation builds without a warning
  ci      what CI runs: test, lint, doc";

fn main() -> ExitCode {
    let command = std::env::args().nth(1).unwrap_or_default();
    match run(&command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("xtask {command}: {e:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: &str) -> Result<()> {
    match command {
        "test" => test(),
        "python" => python::test(&root()),
        "tidy" => tidy::check(&root()),
        "lint" => cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]),
        "doc" => cargo(&["doc", "--workspace", "--no-deps"]),
        "ci" => {
            test()?;
            run("lint")?;
            run("doc")
        }
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

fn program() -> OsString {
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

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_owned()
}
