//! `steradian render`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use film::{Film, FilmLabel};
use image::Image;
use integrators::Counters;
use render::{Checkpoint, Error, Job, Stop, Workers};
use scene::Scene;
use serde::{Deserialize, Serialize};

use crate::args::RenderArgs;
use crate::cluster;
use crate::events::EventLog;
use crate::exit::{Done, Failure, Status};
use crate::interrupt::Interrupt;
use crate::load;
use crate::messages::{self, grouped};
use crate::progress::Bar;

/// The object of `--json`.
#[derive(Debug, Serialize)]
struct Report {
    wall_seconds: f64,
    load_seconds: f64,
    render_seconds: f64,
    /// Complete passes in the film.
    spp: u64,
    rays: u64,
    camera_paths: u64,
    light_paths: u64,
    dropped_samples: u64,
    /// Of linear R, G, B.
    mean: [f64; 3],
    /// Null below two passes.
    relmse_estimate: f64,
    passes_resumed: u64,
    outputs: Vec<PathBuf>,
    integrator: String,
    settings: String,
    seed: u64,
    threads: usize,
    interrupted: bool,
    /// Passes by node, and tasks that ran again, of a render on a cluster.
    #[serde(flatten)]
    cluster: Option<Nodes>,
}

pub(crate) fn run(args: &RenderArgs, python: Option<&Path>) -> Done {
    let start = Instant::now();
    check_files(args)?;
    if let Some(address) = &args.farm.cluster {
        return on_cluster(args, address, python, start);
    }
    let interrupt = Interrupt::install()?;
    let workers = load::workers(&args.scene)?;
    let opened = load::open(&args.scene, &args.method.set, &workers)?;
    let scene = &opened.scene;
    let pictures = pictures(args, scene.settings().filename.as_deref())?;
    let load_seconds = start.elapsed().as_secs_f64();

    // Render.
    let mut job = Job::new(scene, &load::method(&args.method))?;
    let checkpoint = args.checkpoint.as_ref().map(|path| Checkpoint {
        path: path.clone(),
        every: args.checkpoint_every,
        resume: args.resume,
    });
    let mut bar = Bar::new(!args.quiet, interrupt.cancel.clone());
    let mut log = EventLog::open(args.farm.events.as_deref())?;
    log.start(&args.scene.scene, job.film());
    interrupt.rendering();
    let mut on_event = |event: render::Event<'_>| {
        log.on(&event);
        bar.on(event);
    };
    let (checkpoint, cancel) = (checkpoint.as_ref(), &interrupt.cancel);
    let outcome = match args.error {
        Some(precision) => job.render_until(precision, checkpoint, &workers, cancel, &mut on_event),
        None => job.render(&stop(args, scene), checkpoint, &workers, cancel, &mut on_event),
    };
    bar.end();
    let outcome = outcome?;
    log.end(job.film(), outcome.report.cancelled);
    let done = DoneOf {
        seconds: [0.0, load_seconds, outcome.report.elapsed.as_secs_f64()],
        counters: outcome.report.counters,
        passes_resumed: outcome.passes_resumed,
        threads: workers.len(),
        interrupted: outcome.report.cancelled,
        cluster: None,
    };
    // Nobody looks at the scene any more.
    let film = job.into_film();
    drop(opened);
    let status = finish(args, film, done, &pictures, start)?;
    match outcome.checkpoint_error {
        Some(e) => Err(e.into()),
        None => Ok(status),
    }
}

/// The same by many machines: the Python package has them render, and what they made is a partial film.
fn on_cluster(args: &RenderArgs, address: &str, python: Option<&Path>, start: Instant) -> Done {
    let interrupt = Interrupt::install()?;
    let rendered = cluster::render(args, address, python, &interrupt)?;
    let Some(film) = rendered.film else { return Ok(nothing_saved()) };
    let pictures = pictures(args, rendered.filename.as_deref())?;
    finish(args, film, rendered.done, &pictures, start)
}

/// What a render did, here or elsewhere.
#[derive(Debug)]
pub(crate) struct DoneOf {
    /// In all (filled in at the end), of loading, of rendering.
    pub(crate) seconds: [f64; 3],
    pub(crate) counters: Counters,
    pub(crate) passes_resumed: u64,
    pub(crate) threads: usize,
    pub(crate) interrupted: bool,
    pub(crate) cluster: Option<Nodes>,
}

/// Who rendered what, of a cluster.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Nodes {
    /// Passes by node.
    nodes: BTreeMap<String, u64>,
    /// Tasks that ran again, since their worker or node was lost.
    retries: u64,
}

fn nothing_saved() -> Status {
    messages::note("interrupted before the first pass was complete; nothing was saved");
    Status::Interrupted
}

/// Saves what was rendered, and says so. Film, developed picture and image are large: each goes when the next is there.
fn finish(args: &RenderArgs, film: Film, mut done: DoneOf, pictures: &[PathBuf], start: Instant) -> Done {
    if film.passes().is_empty() {
        return Ok(nothing_saved());
    }
    let workers = load::workers(&args.scene)?;
    let mut saved = Saved::default();
    if let Some(path) = &args.partial {
        saved.note(path, render::save_film(&film, path));
    }
    let label = film.label();
    let developed = workers.install(|| film.develop());
    drop(film);
    let figures = Figures { mean: developed.mean_rgb(), relmse: developed.relmse_estimate() };
    if !pictures.is_empty() {
        let picture = render::picture(&label, &developed).map_err(Failure::failed)?;
        drop(developed);
        saved.pictures(args, &picture, pictures, &workers);
    }
    let outputs = saved.outputs()?;
    report_bad_samples(args, &label);
    done.seconds[0] = start.elapsed().as_secs_f64();
    let interrupted = done.interrupted;
    tell(args, &report(&label, &figures, done, outputs));
    Ok(if interrupted { Status::Interrupted } else { Status::Done })
}

/// What can be known to go wrong before the work.
fn check_files(args: &RenderArgs) -> Result<(), Failure> {
    check_endings(&args.output)?;
    let files = args.output.iter().chain(&args.partial).chain(&args.checkpoint).chain(&args.farm.events);
    for path in files {
        render::check_writable(path)?;
        if is_same_file(path, &args.scene.scene) {
            return Err(Failure::input(format!("{} is the scene itself", path.display())));
        }
    }
    Ok(())
}

/// Refuses names that no picture can have.
fn check_endings(outputs: &[PathBuf]) -> Result<(), Failure> {
    match outputs.iter().find(|path| !render::is_picture(path)) {
        None => Ok(()),
        Some(path) => Err(Failure::input(format!(
            "cannot write a picture named {}: the endings .exr, .png, .hdr and .pfm are known",
            path.display()
        ))),
    }
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// The pictures to write: those asked for, or the file's own name here, as EXR and PNG.
fn pictures(args: &RenderArgs, own: Option<&str>) -> Result<Vec<PathBuf>, Failure> {
    if !args.output.is_empty() || args.partial.is_some() {
        return Ok(args.output.clone());
    }
    let own = own.map(Path::new);
    let stem = |path: &Path| path.file_stem().filter(|s| !s.is_empty()).map(PathBuf::from);
    let stem = own.and_then(stem).or_else(|| stem(&args.scene.scene)).unwrap_or_else(|| "steradian".into());
    let pictures: Vec<PathBuf> = ["exr", "png"].map(|ending| with_ending(&stem, ending)).to_vec();
    pictures.iter().try_for_each(|path| render::check_writable(path))?;
    Ok(pictures)
}

/// The name and an ending, whatever dots the name has.
fn with_ending(stem: &Path, ending: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(".");
    name.push(ending);
    name.into()
}

fn stop(args: &RenderArgs, scene: &Scene) -> Stop {
    match (&args.passes, args.time, args.spp) {
        (Some(range), _, _) => Stop::Passes(range.clone()),
        (None, Some(time), _) => Stop::Time(time),
        (None, None, spp) => Stop::Passes(0..spp.unwrap_or(scene.settings().sampler.spp).max(1)),
    }
}

/// What is known of the whole picture.
struct Figures {
    mean: [f64; 3],
    relmse: f64,
}

/// What was written: everything that can be; then it says what could not.
#[derive(Default)]
struct Saved {
    outputs: Vec<PathBuf>,
    failed: Option<Error>,
}

impl Saved {
    fn note(&mut self, path: &Path, saved: Result<(), Error>) {
        match saved {
            Ok(()) => self.outputs.push(path.to_owned()),
            Err(e) => self.failed = self.failed.take().or(Some(e)),
        }
    }

    fn pictures(&mut self, args: &RenderArgs, picture: &Image, paths: &[PathBuf], workers: &Workers) {
        let saved = render::save_pictures(paths, picture, args.exposure, workers);
        paths.iter().zip(saved).for_each(|(path, saved)| self.note(path, saved));
        // Pictures of one name share a sheet.
        match paths.first().map(|path| (path, render::save_sheet(path, picture, args.exposure))) {
            Some((_, Ok(Some(sheet)))) => self.note(&sheet, Ok(())),
            Some((path, Err(e))) => self.note(path, Err(e)),
            Some((_, Ok(None))) | None => {}
        }
    }

    fn outputs(self) -> Result<Vec<PathBuf>, Failure> {
        match self.failed {
            None => Ok(self.outputs),
            Some(e) => Err(e.into()),
        }
    }
}

/// Names the bad samples, and how to walk the first of them again.
fn report_bad_samples(args: &RenderArgs, film: &FilmLabel) {
    let bad = &film.bad_samples;
    let Some(first) = bad.first().next() else { return };
    let key = &film.settings.key;
    messages::warning(&format!(
        "{} bad samples were dropped; the first is at pixel {},{} of pass {} ({})",
        grouped(bad.count()),
        first.x,
        first.y,
        first.pass,
        crate::replay::kind(first.kind),
    ));
    let mut again = format!("steradian replay {}", args.scene.scene.display());
    again.push_str(&format!(" --pixel {},{} --pass {} --seed {}", first.x, first.y, first.pass, key.seed));
    again.push_str(&format!(" --integrator {}", key.integrator));
    args.method.set.iter().for_each(|(k, v)| again.push_str(&format!(" --set {k}={v}")));
    args.scene.define.iter().for_each(|(k, v)| again.push_str(&format!(" -D {k}={v}")));
    if let Some([w, h]) = args.scene.resolution {
        again.push_str(&format!(" --resolution {w}x{h}"));
    }
    if args.scene.spectral {
        again.push_str(" --spectral");
    }
    messages::note(&format!("  hint: {again}"));
}

fn report(film: &FilmLabel, figures: &Figures, done: DoneOf, outputs: Vec<PathBuf>) -> Report {
    let key = &film.settings.key;
    let [wall_seconds, load_seconds, render_seconds] = done.seconds;
    Report {
        wall_seconds,
        load_seconds,
        render_seconds,
        spp: film.passes.len(),
        rays: done.counters.rays,
        camera_paths: done.counters.camera_paths,
        light_paths: done.counters.light_paths,
        dropped_samples: film.bad_samples.count(),
        mean: figures.mean,
        relmse_estimate: figures.relmse,
        passes_resumed: done.passes_resumed,
        outputs,
        integrator: key.integrator.clone(),
        settings: key.settings.clone(),
        seed: key.seed,
        threads: done.threads,
        interrupted: done.interrupted,
        cluster: done.cluster,
    }
}

fn tell(args: &RenderArgs, r: &Report) {
    if r.interrupted {
        messages::note(&format!("interrupted; {} passes are saved", r.spp));
    }
    if args.json {
        messages::json(r);
        return;
    }
    if args.quiet {
        return;
    }
    let resumed =
        if r.passes_resumed > 0 { format!(" ({} resumed)", r.passes_resumed) } else { String::new() };
    let error = match r.relmse_estimate.is_finite() {
        true => format!(", relMSE about {:.2e}", r.relmse_estimate),
        false => String::new(),
    };
    messages::say(&format!(
        "{}, {} passes{resumed} in {:.2} s{error}, {:.2} Mrays/s",
        r.integrator,
        r.spp,
        r.render_seconds,
        r.rays as f64 / r.render_seconds.max(1e-9) * 1e-6,
    ));
    r.outputs.iter().for_each(|path| messages::say(&format!("wrote {}", path.display())));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_with_dots_keeps_them() {
        assert_eq!(with_ending(Path::new("killeroo-1.5"), "png"), Path::new("killeroo-1.5.png"));
    }

    #[test]
    fn other_endings_are_refused() {
        assert!(check_endings(&["a.exr".into(), "b.PNG".into(), "c.hdr".into(), "d.pfm".into()]).is_ok());
        assert!(check_endings(&["a.exr".into(), "b.jpg".into()]).is_err());
        assert!(check_endings(&["a".into()]).is_err());
    }
}
