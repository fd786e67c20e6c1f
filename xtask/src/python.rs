//! The Python half: a virtual environment under `target/`, the wheel built into it, its tests and its types.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

/// What building and testing need, beside what the package itself depends on.
const TOOLS: &[&str] = &[
    "maturin>=1.7,<2",
    "numpy>=1.24",
    "pytest>=8",
    "mypy>=1.11",
    "ray>=2.9",
    "ipython>=8",
    "anywidget>=0.9",
    "ipykernel>=6",
    "nbclient>=0.10",
];

/// What the notebook widget's test needs besides, where there is a browser.
const BROWSER_TOOLS: &[&str] = &["jupyterlab>=4", "playwright>=1.40"];

/// Builds, installs and tests the Python package.
pub(crate) fn test(root: &Path) -> Result<()> {
    let Some(python) = interpreter() else {
        println!("SKIPPED: the Python package's tests (they need Python 3.10 or newer with venv)");
        return Ok(());
    };
    let bin = environment(root, &python)?;
    install(root, &bin)?;
    run(root, Command::new(bin.join("python")).args(["-m", "pytest"]))?;
    run(root, Command::new(bin.join("python")).args(["-m", "mypy"]))?;
    let stubs = ["-m", "mypy.stubtest", "steradian._native", "--allowlist", "python/stubtest-allowed.txt"];
    run(root, Command::new(bin.join("python")).args(stubs))
}

/// Writes the dataclasses of everything that a scene can be made of, from the schema of what is built.
pub(crate) fn kinds(root: &Path) -> Result<()> {
    let python = interpreter().context("Python 3.10 or newer with venv is missing")?;
    let bin = environment(root, &python)?;
    install(root, &bin)?;
    let generated = Command::new(bin.join("python")).args(["-m", "steradian._generate"]).output()?;
    if !generated.status.success() {
        bail!("{}", String::from_utf8_lossy(&generated.stderr));
    }
    let path = root.join("python/steradian/kinds.py");
    fs::write(&path, generated.stdout).with_context(|| path.display().to_string())
}

/// A Python that is new enough.
fn interpreter() -> Option<PathBuf> {
    let check = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))";
    let works = |name: &&str| {
        Command::new(name).args(["-c", check]).output().is_ok_and(|output| output.status.success())
    };
    ["python3", "python"].into_iter().find(works).map(PathBuf::from)
}

/// Is there a browser for the tests that need one?
fn browser() -> bool {
    let runs = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    ["chromium", "chromium-browser", "google-chrome"].iter().any(runs)
}

/// The folder with the environment's programs; made once.
fn environment(root: &Path, python: &Path) -> Result<PathBuf> {
    let folder = root.join("target/python");
    let bin = folder.join(if cfg!(windows) { "Scripts" } else { "bin" });
    let stamp = folder.join("tools.txt");
    let tools = if browser() { [TOOLS, BROWSER_TOOLS].concat() } else { TOOLS.to_vec() };
    let wanted = tools.join("\n");
    if fs::read_to_string(&stamp).is_ok_and(|has| has == wanted) {
        return Ok(bin);
    }
    run(root, Command::new(python).args(["-m", "venv"]).arg(&folder))?;
    run(root, pip(&bin).args(["install", "--quiet"]).args(&tools))?;
    fs::write(&stamp, wanted).with_context(|| stamp.display().to_string())?;
    Ok(bin)
}

/// As `pip install .`, but with the profile that the tests use: what they compiled serves here too.
fn install(root: &Path, bin: &Path) -> Result<()> {
    let mut command = pip(bin);
    command.args(["install", "--quiet", "--no-build-isolation", "--no-deps", "--force-reinstall", "."]);
    command.env("MATURIN_PEP517_ARGS", "--profile dev").env("PATH", path_with(bin)?);
    run(root, &mut command)
}

fn pip(bin: &Path) -> Command {
    let mut command = Command::new(bin.join("python"));
    command.args(["-m", "pip", "--disable-pip-version-check"]);
    command
}

fn path_with(bin: &Path) -> Result<std::ffi::OsString> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = std::iter::once(bin.to_owned()).chain(std::env::split_paths(&path));
    std::env::join_paths(all).context("PATH")
}

fn run(root: &Path, command: &mut Command) -> Result<()> {
    println!("$ {command:?}");
    let status = command.current_dir(root).status().with_context(|| format!("cannot start {command:?}"))?;
    if !status.success() {
        bail!("{command:?} failed");
    }
    Ok(())
}
