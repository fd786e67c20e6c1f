//! The command line: what is written on it, and what is printed in answer. All work is done by the crates below.

mod advise;
mod args;
mod bench;
mod cluster;
mod compare;
mod convert;
mod diff;
mod events;
mod exit;
mod info;
mod integrators;
mod interrupt;
mod lab_command;
mod load;
mod merge;
mod messages;
mod progress;
mod render;
mod replay;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;

use crate::args::{Cli, Command};
pub use crate::compare::user_cache;

/// Runs the command that the arguments of the process ask for.
#[must_use]
pub fn main() -> ExitCode {
    // A render on a cluster needs an interpreter that has the package.
    let python = std::env::var_os("STERADIAN_PYTHON").map(PathBuf::from);
    ExitCode::from(run(std::env::args_os(), python.as_deref()))
}

/// Runs a command and gives its exit status; the first argument is the program's name. `python` is an interpreter that has the
/// package (default: the one on the path).
pub fn run(
    args: impl IntoIterator<Item = impl Into<std::ffi::OsString> + Clone>,
    python: Option<&Path>,
) -> u8 {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(e) => {
            // Help and version go to standard output and are no failure.
            let _ = e.print();
            return if e.use_stderr() { 2 } else { 0 };
        }
    };
    let done = match &cli.command {
        Command::Render(args) => render::run(args, python),
        Command::Merge(args) => merge::run(args),
        Command::Info(args) => info::run(args),
        Command::Integrators(args) => integrators::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Lab(args) => lab_command::run(args),
        Command::Advise(args) => advise::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Replay(args) => replay::run(args),
    };
    exit::code(done)
}
