//! `steradian bench`: a table worth pasting into a bug report.

use std::time::{Duration, Instant};

use accel::Isa;
use render::{BenchRays, Cancel, Job, Method, RayRates, SceneOptions, Stop, VERSION, Workers};
use scene::Scene;
use scene_desc::Sink;
use serde::Serialize;

use crate::args::BenchArgs;
use crate::exit::{Done, Failure, Status};
use crate::messages::{self, grouped, say};

/// The object of `--json`.
#[derive(Debug, Serialize)]
struct Report {
    version: &'static str,
    system: String,
    cpu: String,
    /// The instruction set that rays use unless told otherwise.
    isa: &'static str,
    threads: usize,
    /// Those that the machine has for us.
    threads_available: usize,
    scene: String,
    resolution: [u32; 2],
    triangles: u64,
    /// Reading and compiling, trees included.
    load_seconds: f64,
    tree_bytes: u64,
    /// How long each figure was measured.
    seconds_each: f64,
    /// In millions a second.
    rays: Vec<Kernel>,
    paths: Vec<Paths>,
    /// Integrators that do not render this scene, and why.
    refused: Vec<Refused>,
    wall_seconds: f64,
}

#[derive(Debug, Serialize)]
struct Kernel {
    isa: &'static str,
    camera: f64,
    bounce: f64,
    shadow: f64,
}

#[derive(Debug, Serialize)]
struct Paths {
    integrator: &'static str,
    /// Millions a second: from the camera, from lights, and the rays of both.
    camera_mpaths: f64,
    light_mpaths: f64,
    mrays: f64,
    passes: u32,
    seconds: f64,
}

#[derive(Debug, Serialize)]
struct Refused {
    integrator: &'static str,
    reason: String,
}

pub(crate) fn run(args: &BenchArgs) -> Done {
    let start = Instant::now();
    let workers = Workers::new(args.threads)?;
    let mut scene = scene(args, &workers)?;
    let mut report = report(args, &scene, &workers, start.elapsed());
    if !args.json {
        head(args, &report);
    }

    // Rays, by each kernel that this processor runs.
    let best = scene.accel().isa();
    let rays = BenchRays::new(&scene);
    for isa in kernels() {
        scene = scene.with_isa(isa);
        let kernel = kernel(isa, rays.measure(&scene, &workers, args.time));
        if !args.json {
            let Kernel { isa, camera, bounce, shadow } = kernel;
            say(&format!("{isa:<20}{camera:>10.2}{bounce:>10.2}{shadow:>10.2}"));
        }
        report.rays.push(kernel);
    }
    scene = scene.with_isa(best);

    // Paths, by each integrator.
    if !args.rays {
        integrators(args, &scene, &workers, &mut report)?;
    }
    report.wall_seconds = start.elapsed().as_secs_f64();
    if args.json {
        messages::json(&report);
    }
    Ok(Status::Done)
}

fn scene(args: &BenchArgs, workers: &Workers) -> Result<Scene, Failure> {
    let mut sink = Sink::default();
    let scene = match &args.scene {
        Some(path) => {
            render::open(path, &SceneOptions::default(), workers, &mut sink).map(|opened| opened.scene)
        }
        None => workers
            .install(|| scene::compile(&render::bench_scene(), &scene::CompileOptions::default(), &mut sink)),
    };
    messages::diagnostics(&sink, false);
    scene.ok_or(Failure::InputSaid)
}

fn kernels() -> impl Iterator<Item = Isa> {
    Isa::ALL.into_iter().filter(|isa| isa.is_available())
}

/// What is known before anything is measured.
fn report(args: &BenchArgs, scene: &Scene, workers: &Workers, load: Duration) -> Report {
    let settings = scene.settings();
    Report {
        version: VERSION,
        system: format!("{} {}", std::env::consts::ARCH, std::env::consts::OS),
        cpu: cpu(),
        isa: scene.accel().isa().name(),
        threads: workers.len(),
        threads_available: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        scene: args.scene.as_ref().map_or("built in".to_owned(), |path| path.display().to_string()),
        resolution: settings.resolution,
        triangles: settings.counts.triangles,
        load_seconds: load.as_secs_f64(),
        tree_bytes: settings.counts.accel_bytes,
        seconds_each: args.time.as_secs_f64(),
        rays: Vec::new(),
        paths: Vec::new(),
        refused: Vec::new(),
        wall_seconds: 0.0,
    }
}

fn head(args: &BenchArgs, r: &Report) {
    let integrators = if args.rays { 0 } else { integrators::list().len() };
    let figures = 3 * kernels().count() + integrators;
    let about = figures as f64 * r.seconds_each;
    messages::note(&format!("takes about {about:.0} s: {figures} figures of {} s", r.seconds_each));
    say(&format!("steradian {}, {}", r.version, r.system));
    say(&format!("{:<20}{}, {}", "processor", r.cpu, r.isa));
    say(&format!("{:<20}{} of {}", "threads", r.threads, r.threads_available));
    let [w, h] = r.resolution;
    say(&format!("{:<20}{}, {} triangles, {w}x{h}", "scene", r.scene, grouped(r.triangles)));
    let per_triangle = r.tree_bytes as f64 / r.triangles.max(1) as f64;
    say(&format!("{:<20}{:.2} s, tree of {per_triangle:.0} bytes a triangle", "load", r.load_seconds));
    say(&format!("\n{:<20}{:>10}{:>10}{:>10}", "Mrays/s", "camera", "bounce", "shadow"));
}

fn kernel(isa: Isa, r: RayRates) -> Kernel {
    Kernel { isa: isa.name(), camera: r.camera * 1e-6, bounce: r.bounce * 1e-6, shadow: r.shadow * 1e-6 }
}

/// Every integrator, with its own defaults.
fn integrators(
    args: &BenchArgs,
    scene: &Scene,
    workers: &Workers,
    report: &mut Report,
) -> Result<(), Failure> {
    if !args.json {
        say(&format!("\n{:<20}{:>10}{:>10}{:>10}", "Mpaths/s", "camera", "light", "Mrays/s"));
    }
    for info in integrators::list() {
        match paths(info.name, scene, workers, args)? {
            Ok(paths) => {
                if !args.json {
                    let Paths { integrator, camera_mpaths, light_mpaths, mrays, .. } = paths;
                    say(&format!("{integrator:<20}{camera_mpaths:>10.3}{light_mpaths:>10.3}{mrays:>10.2}"));
                }
                report.paths.push(paths);
            }
            Err(refused) => {
                if !args.json {
                    say(&format!("{:<20}{}", refused.integrator, refused.reason));
                }
                report.refused.push(refused);
            }
        }
    }
    Ok(())
}

/// An integrator's paths, or why it refuses the scene.
fn paths(
    integrator: &'static str,
    scene: &Scene,
    workers: &Workers,
    args: &BenchArgs,
) -> Result<Result<Paths, Refused>, Failure> {
    let method = Method { integrator: Some(integrator.to_owned()), ..Method::default() };
    let mut job = match Job::new(scene, &method) {
        Ok(job) => job,
        Err(e) => return Ok(Err(Refused { integrator, reason: render::sentence(&e) })),
    };
    let outcome = job.render(&Stop::Time(args.time), None, workers, &Cancel::default(), &mut |_| {})?;
    let (n, seconds) = (outcome.report.counters, outcome.report.elapsed.as_secs_f64().max(1e-9));
    let mega_per_second = |n: u64| n as f64 * 1e-6 / seconds;
    Ok(Ok(Paths {
        integrator,
        camera_mpaths: mega_per_second(n.camera_paths),
        light_mpaths: mega_per_second(n.light_paths),
        mrays: mega_per_second(n.rays),
        passes: outcome.report.passes,
        seconds,
    }))
}

/// The processor's name, where the system tells it.
fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| "unknown".to_owned(), |(_, name)| name.trim().to_owned())
}
