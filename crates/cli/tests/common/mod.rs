//! Running the program and looking at what it says.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::{Command, Output};

/// What the program answered.
pub(crate) struct Answer {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs `steradian` in a folder.
pub(crate) fn steradian(folder: &Path, args: &[&str]) -> Answer {
    let output =
        Command::new(env!("CARGO_BIN_EXE_steradian")).args(args).current_dir(folder).output().unwrap();
    answer(&output)
}

/// Of a program that has ended.
pub(crate) fn answer(output: &Output) -> Answer {
    Answer {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

impl Answer {
    /// Both streams and the status, for snapshots.
    #[allow(dead_code, reason = "not every test file takes snapshots")]
    pub(crate) fn all(&self) -> String {
        format!("exit {}\n--- stdout\n{}--- stderr\n{}", self.code, self.stdout, self.stderr)
    }

    /// The JSON object on the last line of standard output.
    #[allow(dead_code, reason = "not every test file asks for JSON")]
    pub(crate) fn json(&self) -> serde_json::Value {
        let last = self.stdout.lines().last().unwrap_or_default();
        serde_json::from_str(last).unwrap_or_else(|e| panic!("{e}: {}", self.all()))
    }
}
