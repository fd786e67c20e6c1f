//! `render --cluster`: the Python package's `steradian._remote` has a Ray cluster render, and hands a partial film back.
//!
//! It is told what to do by a line of JSON on its standard input, which then stays open: when that closes, because a person asked
//! to stop or because this process died, it stops with what there is. It answers with a line of JSON.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use film::Film;
use integrators::Counters;
use render::Urgency;
use serde::Deserialize;
use serde_json::json;

use crate::args::RenderArgs;
use crate::exit::Failure;
use crate::interrupt::Interrupt;
use crate::messages;
use crate::render::{DoneOf, Nodes};

/// Where else it renders, and who watches.
#[derive(Debug, clap::Args)]
pub(crate) struct FarmArgs {
    /// Render on a Ray cluster: HOST:PORT, ray://HOST:PORT, auto, or local for this machine (needs pip install 'steradian[cluster]')
    #[arg(long, value_name = "ADDRESS", conflicts_with_all = ["time", "error", "isa", "threads"])]
    pub(crate) cluster: Option<String>,
    /// Append what happens to this file, one JSON object a line
    #[arg(long, value_name = "FILE")]
    pub(crate) events: Option<PathBuf>,
}

/// What came back.
pub(crate) struct Rendered {
    /// `None`: nothing was rendered.
    pub(crate) film: Option<Film>,
    /// The scene's own name for its picture.
    pub(crate) filename: Option<String>,
    pub(crate) done: DoneOf,
}

/// What the other side says.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Answer {
    Failed { error: String, input: bool },
    Done(Box<Told>),
}

#[derive(Debug, Deserialize)]
struct Told {
    filename: Option<String>,
    rendered: bool,
    interrupted: bool,
    passes_resumed: u64,
    processors: usize,
    load_seconds: f64,
    render_seconds: f64,
    rays: u64,
    camera_paths: u64,
    light_paths: u64,
    #[serde(flatten)]
    cluster: Nodes,
}

/// Renders on a cluster.
pub(crate) fn render(
    args: &RenderArgs,
    address: &str,
    python: Option<&Path>,
    interrupt: &Interrupt,
) -> Result<Rendered, Failure> {
    let folder = std::env::temp_dir();
    let partial = folder.join(format!("steradian-{}.partial", std::process::id()));
    let answer = ask(args, (address, &partial), python, interrupt);
    let film = if partial.exists() { Some(Film::load(&partial)) } else { None };
    // It was made for us alone.
    let _ = std::fs::remove_file(&partial);
    let told = match answer? {
        Answer::Failed { error, input: true } => return Err(Failure::input(error)),
        Answer::Failed { error, input: false } => return Err(Failure::failed(error)),
        Answer::Done(told) => told,
    };
    let film = film.transpose().map_err(|e| Failure::failed(format!("what the cluster made: {e}")))?;
    let counters =
        Counters { rays: told.rays, camera_paths: told.camera_paths, light_paths: told.light_paths };
    Ok(Rendered {
        film: film.filter(|_| told.rendered),
        filename: told.filename,
        done: DoneOf {
            seconds: [0.0, told.load_seconds, told.render_seconds],
            counters,
            passes_resumed: told.passes_resumed,
            threads: told.processors,
            interrupted: told.interrupted,
            cluster: Some(told.cluster),
        },
    })
}

/// Starts the other side, waits for it, and gives its answer.
fn ask(
    args: &RenderArgs,
    (address, partial): (&str, &Path),
    python: Option<&Path>,
    interrupt: &Interrupt,
) -> Result<Answer, Failure> {
    let (mut child, name) = start(python)?;
    let request = request(args, address, partial).to_string();
    let mut stdin = child.stdin.take();
    if let Some(stdin) = &mut stdin {
        // Whoever ended early says why below.
        let _ = writeln!(stdin, "{request}").and_then(|()| stdin.flush());
    }
    interrupt.rendering();
    let status = loop {
        if interrupt.cancel.urgency() > Urgency::None && stdin.take().is_some() {
            messages::note("stopping; Ctrl-C again to stop at once");
        }
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) => std::thread::sleep(Duration::from_millis(20)),
            Err(e) => return Err(Failure::failed(format!("{}: {e}", name.display()))),
        }
    };
    let mut text = String::new();
    if let Some(mut stdout) = child.stdout.take() {
        let _ = stdout.read_to_string(&mut text);
    }
    let answer = text.lines().last().and_then(|line| serde_json::from_str(line).ok());
    answer.ok_or_else(|| no_answer(&name, status))
}

/// Why there is no answer: as a rule, for want of the package.
fn no_answer(python: &Path, status: ExitStatus) -> Failure {
    Failure::input(format!(
        "a render on a cluster needs the Python package of this version: pip install 'steradian[cluster]' \
         ({} -m steradian._remote ended with {status}; the variable STERADIAN_PYTHON names another interpreter)",
        python.display()
    ))
}

/// An interpreter, in a process group of its own: Ctrl-C is for us, and we pass it on.
fn start(python: Option<&Path>) -> Result<(Child, PathBuf), Failure> {
    let names: Vec<PathBuf> = match python {
        Some(python) => vec![python.to_owned()],
        None => ["python3", "python"].map(PathBuf::from).to_vec(),
    };
    let mut failed = None;
    for name in names {
        let mut command = Command::new(&name);
        command.args(["-m", "steradian._remote"]).stdin(Stdio::piped()).stdout(Stdio::piped());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        match command.spawn() {
            Ok(child) => return Ok((child, name)),
            Err(e) => failed = Some((name, e)),
        }
    }
    let why = failed.map(|(name, e)| format!(" ({}: {e})", name.display())).unwrap_or_default();
    Err(Failure::input(format!(
        "a render on a cluster needs Python and the package: pip install 'steradian[cluster]'{why}"
    )))
}

/// The arguments, as `steradian._remote` reads them.
fn request(args: &RenderArgs, address: &str, partial: &Path) -> serde_json::Value {
    let (scene, method) = (&args.scene, &args.method);
    json!({
        "version": render::VERSION,
        "address": address,
        "partial": partial,
        "scene": scene.scene,
        "strict": scene.strict,
        "defines": scene.define,
        "integrator": method.integrator,
        "settings": method.set,
        "seed": method.seed,
        "resolution": scene.resolution,
        "crop": scene.crop,
        "spectral": scene.spectral,
        "spp": args.spp,
        "passes": args.passes.as_ref().map(|r| [r.start, r.end]),
        "checkpoint": args.checkpoint,
        "checkpoint_every": args.checkpoint_every.as_secs_f64(),
        "resume": args.resume,
        "events": args.farm.events,
        "quiet": args.quiet,
    })
}
