//! `steradian bench`: a table worth pasting into a bug report.

use accel::Isa;
use render::{BenchRays, Cancel, Job, Method, RayRates, SceneOptions, Stop, VERSION, Workers};
use scene::Scene;
use scene_desc::Sink;
use serde::Serialize;

use crate::args::BenchArgs;
use crate::exit::{Done, Failure, Status};
use crate::messages::{self, grouped, say};

#[derive(Debug, Serialize)]
struct Report {
    version: &'static str,
    system: String,
    cpu: String,
    threads: usize,
    scene: String,
    triangles: u64,
    /// In millions a second.
    rays: Vec<Kernel>,
    paths: Vec<Paths>,
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
    paths_per_second: f64,
    mrays_per_second: f64,
}

pub(crate) fn run(args: &BenchArgs) -> Done {
    let workers = Workers::new(args.threads)?;
    let mut scene = scene(args, &workers)?;
    let mut report = Report {
        version: VERSION,
        system: format!("{} {}", std::env::consts::ARCH, std::env::consts::OS),
        cpu: cpu(),
        threads: workers.len(),
        scene: args.scene.as_ref().map_or("built in".to_owned(), |path| path.display().to_string()),
        triangles: scene.settings().counts.triangles,
        rays: Vec::new(),
        paths: Vec::new(),
    };
    if !args.json {
        head(&report);
    }

    // Rays, by each kernel that this processor runs.
    let best = scene.accel().isa();
    let rays = BenchRays::new(&scene);
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
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
    if !args.json && !args.rays {
        say(&format!("\n{:<20}{:>10}{:>10}", "integrator", "Mpaths/s", "Mrays/s"));
    }
    for info in integrators::list().iter().filter(|_| !args.rays) {
        let Some(paths) = paths(info.name, &scene, &workers, args)? else { continue };
        if !args.json {
            let (p, r) = (paths.paths_per_second * 1e-6, paths.mrays_per_second);
            say(&format!("{:<20}{p:>10.3}{r:>10.2}", paths.integrator));
        }
        report.paths.push(paths);
    }
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

fn head(r: &Report) {
    say(&format!("steradian {}, {}", r.version, r.system));
    say(&format!("{:<20}{}", "processor", r.cpu));
    say(&format!("{:<20}{}", "threads", r.threads));
    say(&format!("{:<20}{}, {} triangles", "scene", r.scene, grouped(r.triangles)));
    say(&format!("\n{:<20}{:>10}{:>10}{:>10}", "Mrays/s", "camera", "bounce", "shadow"));
}

fn kernel(isa: Isa, r: RayRates) -> Kernel {
    Kernel { isa: isa.name(), camera: r.camera * 1e-6, bounce: r.bounce * 1e-6, shadow: r.shadow * 1e-6 }
}

/// An integrator's paths, of camera or light; `None` if it refuses the scene, which is said.
fn paths(
    integrator: &'static str,
    scene: &Scene,
    workers: &Workers,
    args: &BenchArgs,
) -> Result<Option<Paths>, Failure> {
    let method = Method { integrator: Some(integrator.to_owned()), ..Method::default() };
    let mut job = match Job::new(scene, &method) {
        Ok(job) => job,
        Err(e) => {
            messages::note(&format!("{integrator}: {e}"));
            return Ok(None);
        }
    };
    let outcome = job.render(&Stop::Time(args.time), None, workers, &Cancel::default(), &mut |_| {})?;
    let (n, seconds) = (outcome.report.counters, outcome.report.elapsed.as_secs_f64().max(1e-9));
    Ok(Some(Paths {
        integrator,
        paths_per_second: (n.camera_paths + n.light_paths) as f64 / seconds,
        mrays_per_second: n.rays as f64 / seconds * 1e-6,
    }))
}

/// The processor's name, where the system tells it.
fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| "unknown".to_owned(), |(_, name)| name.trim().to_owned())
}
