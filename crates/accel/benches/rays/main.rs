//! Mrays/s by kind of ray and kernel, and Embree's on the same rays where its library is given.
//!
//! ```text
//! cargo bench -p steradian-accel --bench rays -- [SCENE] [--embree libembree4.so] [--rays N] [--rounds N] [--isa NAME] [--csv FILE]
//!     [--only KERNEL] [--set RAYS]
//! ```
//!
//! `--build` times the building of trees instead, on one thread and on all.
//! `--edges N` counts instead how many of `N` rays, aimed at edges and vertices of closed meshes, get through.
//!
//! `SCENE` is a PLY file, or a folder with `models/*.ply` and a pbrt file whose camera is taken, or `N` triangles of a
//! landscape that is made up; without it a furnished room is made up. One thread; rounds alternate between the kernels, and of each chunk of rays the best round
//! counts, so that others on the machine disturb the ratio little. Quote ratios, not figures.
#![allow(clippy::print_stdout, reason = "a program")]

mod builds;
mod edges;
mod embree;
mod ply;
mod workload;

use std::hint::black_box;
use std::io::Write;
use std::time::Instant;

use math::{AnimatedTransform, Ray, Transform};
use steradian_accel::{
    Accel, Blas, BuildOptions, Geometry, Hit, Instance, Isa, Shape, TreeKind, accept_all, accept_all_of,
};

use workload::{RaySet, Scene};

struct Options {
    scene: Option<String>,
    embree: Option<String>,
    csv: Option<String>,
    isa: Option<Isa>,
    /// Only the kernels whose name contains this.
    only: Option<String>,
    /// Only the rays whose name contains this.
    set: Option<String>,
    /// Time builds instead.
    build: bool,
    /// Count leaks of so many rays instead.
    edges: u64,
    rays: usize,
    rounds: usize,
}

fn options() -> Options {
    let mut o = Options {
        scene: None,
        embree: None,
        csv: None,
        isa: None,
        only: None,
        set: None,
        build: false,
        edges: 0,
        rays: 1 << 18,
        rounds: 5,
    };
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().unwrap_or_default();
        match arg.as_str() {
            "--embree" => o.embree = Some(value()),
            "--csv" => o.csv = Some(value()),
            "--isa" => o.isa = Isa::from_name(&value()),
            "--only" => o.only = Some(value()),
            "--set" => o.set = Some(value()),
            "--build" => o.build = true,
            "--edges" => o.edges = value().parse().expect("a number"),
            "--rays" => o.rays = value().parse().expect("a number"),
            "--rounds" => o.rounds = value().parse().expect("a number"),
            "--bench" => {}
            other => o.scene = Some(other.to_owned()),
        }
    }
    o
}

/// Rays timed at once: shorter than a slice of the scheduler, so that the best of some rounds is undisturbed.
pub(crate) const CHUNK: usize = 4096;

/// Something that traces.
trait Tracer {
    fn name(&self) -> String;
    /// Rays that hit.
    fn nearest(&mut self, rays: &[Ray]) -> usize;
    /// Rays that are blocked.
    fn any(&mut self, rays: &[Ray]) -> usize;
}

struct Ours(String, Accel);

impl Tracer for Ours {
    fn name(&self) -> String {
        self.0.clone()
    }
    fn nearest(&mut self, rays: &[Ray]) -> usize {
        rays.iter().filter(|r| black_box(self.1.intersect(r, &mut accept_all)).is_some()).count()
    }
    fn any(&mut self, rays: &[Ray]) -> usize {
        rays.iter().filter(|r| self.1.occluded(r, &mut accept_all)).count()
    }
}

/// The same in batches.
struct Streams {
    name: String,
    accel: Accel,
    hits: Vec<Option<Hit>>,
    blocked: Vec<bool>,
}

impl Streams {
    fn new(name: &str, accel: Accel) -> Self {
        let name = format!("{name} {}", accel.isa().name());
        Self { name, accel, hits: vec![None; CHUNK], blocked: vec![false; CHUNK] }
    }
}

impl Tracer for Streams {
    fn name(&self) -> String {
        self.name.clone()
    }
    fn nearest(&mut self, rays: &[Ray]) -> usize {
        self.accel.intersect_many(rays, &mut self.hits, &mut accept_all_of);
        black_box(&self.hits)[..rays.len()].iter().filter(|h| h.is_some()).count()
    }
    fn any(&mut self, rays: &[Ray]) -> usize {
        self.accel.occluded_many(rays, &mut self.blocked, &mut accept_all_of);
        black_box(&self.blocked)[..rays.len()].iter().filter(|h| **h).count()
    }
}

/// Every hit goes through a filter that the compiler cannot see through.
struct Filtered(Accel);

impl Tracer for Filtered {
    fn name(&self) -> String {
        format!("all filtered {}", self.0.isa().name())
    }
    fn nearest(&mut self, rays: &[Ray]) -> usize {
        let filter = &mut |h: &Hit| black_box(h).t >= 0.0;
        rays.iter().filter(|r| black_box(self.0.intersect(r, filter)).is_some()).count()
    }
    fn any(&mut self, rays: &[Ray]) -> usize {
        let filter = &mut |h: &Hit| black_box(h).t >= 0.0;
        rays.iter().filter(|r| self.0.occluded(r, filter)).count()
    }
}

/// Ways of seeing the same scene that cost more.
fn variants(scene: &Scene, blas: &Blas) -> Vec<Box<dyn Tracer>> {
    let whole = Instance { object: 0, world_from_object: AnimatedTransform::fixed(Transform::IDENTITY) };
    let instanced = Accel::new(Blas::default(), vec![blas.clone()], &[whole]).expect("the object is there");
    let name = format!("one instance {}", instanced.isa().name());
    let streams = Streams::new("streams, one instance", instanced.clone());
    let geometries: Vec<_> = scene
        .meshes
        .iter()
        .map(|m| Geometry::filtered(Shape::Mesh { positions: &m.positions, indices: &m.indices }))
        .collect();
    let filtered = Blas::build(&geometries, &BuildOptions::default()).expect("a proper mesh");
    vec![Box::new(Ours(name, instanced)), Box::new(streams), Box::new(Filtered(Accel::from_static(filtered)))]
}

fn build(scene: &Scene, tree: TreeKind) -> Blas {
    let geometries = scene.geometries();
    let n: usize = scene.meshes.iter().map(|m| m.indices.len()).sum();
    let seconds = (0..3)
        .map(|_| {
            let start = Instant::now();
            black_box(Blas::build(&geometries, &BuildOptions { tree }).expect("a proper mesh"));
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    let blas = Blas::build(&geometries, &BuildOptions { tree }).expect("a proper mesh");
    let stats = blas.stats();
    println!(
        "{tree:?}: {n} triangles in {:.3} s on {} threads ({:.2} Mtri/s), {:.1} bytes each, cost {:.2}, {} nodes, {} blocks, {:.2} per block",
        seconds,
        rayon::current_num_threads(),
        n as f64 / seconds * 1e-6,
        stats.bytes as f64 / n as f64,
        stats.sah_cost,
        stats.nodes,
        stats.blocks,
        stats.triangles as f64 / stats.blocks as f64,
    );
    blas
}

fn main() {
    let options = options();
    if options.edges > 0 {
        return edges::run(options.edges);
    }
    let scene = options.scene.as_deref().map_or_else(workload::furnished_room, workload::load);
    let name = options.scene.as_deref().unwrap_or("furnished room");
    if options.build {
        return builds::run(&options, name, &scene);
    }
    println!("{name}");

    let mut tracers: Vec<Box<dyn Tracer>> = Vec::new();
    let kernels: Vec<Isa> =
        Isa::ALL.into_iter().filter(|i| i.is_available() && options.isa.is_none_or(|o| o == *i)).collect();
    for tree in TreeKind::ALL.into_iter().filter(|t| *t != TreeKind::Halves) {
        let blas = build(&scene, tree);
        for &isa in kernels.iter().filter(|i| **i != Isa::Scalar || options.isa.is_some()) {
            let accel = Accel::from_static(blas.clone()).with_isa(isa);
            tracers.push(Box::new(Ours(format!("{tree:?} {}", isa.name()), accel)));
        }
    }
    let reference = Accel::from_static(build(&scene, TreeKind::default()));
    for &isa in kernels.iter().filter(|i| **i != Isa::Scalar || options.isa.is_some()) {
        tracers.push(Box::new(Streams::new("streams", reference.clone().with_isa(isa))));
    }
    tracers.extend(variants(&scene, reference.world()));
    let mut sets = workload::rays(&scene, &reference, options.rays);
    sets.retain(|s| match &options.set {
        Some(name) => s.name.contains(name.as_str()),
        None => !s.name.starts_with("same") && !s.name.starts_with("none"),
    });
    if let Some(path) = &options.embree {
        for (label, flags) in [("embree", 0), ("embree robust", 4)] {
            let embree = embree::Embree::new(path, label, flags, &scene.meshes, 2);
            println!("{label}: built in {:.3} s", embree.seconds);
            if flags == 0 {
                tracers.push(Box::new(embree.packets(true)));
                tracers.push(Box::new(embree.packets(false)));
            }
            tracers.push(Box::new(embree));
        }
    }
    tracers.retain(|t| options.only.as_ref().is_none_or(|name| t.name().contains(name.as_str())));
    report(&options, name, &sets, &mut tracers);
}

fn report(options: &Options, scene: &str, sets: &[RaySet], tracers: &mut [Box<dyn Tracer>]) {
    let mut best: Vec<Vec<Vec<f64>>> =
        vec![sets.iter().map(|s| vec![f64::INFINITY; s.chunks()]).collect(); tracers.len()];
    let mut hits = vec![vec![0; sets.len()]; tracers.len()];
    for _ in 0..options.rounds {
        for (s, set) in sets.iter().enumerate() {
            for (t, tracer) in tracers.iter_mut().enumerate() {
                hits[t][s] = 0;
                for (c, rays) in set.rays.chunks(CHUNK).enumerate() {
                    let start = Instant::now();
                    hits[t][s] += if set.any { tracer.any(rays) } else { tracer.nearest(rays) };
                    best[t][s][c] = best[t][s][c].min(start.elapsed().as_secs_f64());
                }
            }
        }
    }
    let rate = |t: usize, s: usize| sets[s].rays.len() as f64 / best[t][s].iter().sum::<f64>() * 1e-6;
    let mut table = String::from("scene,kernel");
    for set in sets {
        table += &format!(",{}", set.name);
    }
    table.push('\n');
    for (t, tracer) in tracers.iter().enumerate() {
        table += &format!("{scene},{}", tracer.name());
        for s in 0..sets.len() {
            table += &format!(",{:.2}", rate(t, s));
        }
        table.push('\n');
    }
    let base: Vec<usize> = (0..tracers.len()).filter(|&t| tracers[t].name().starts_with("embree")).collect();
    for t in 0..tracers.len() {
        for &b in base.iter().filter(|&&b| b != t) {
            table += &format!("{scene},{} / {}", tracers[t].name(), tracers[b].name());
            for s in 0..sets.len() {
                table += &format!(",{:.3}", rate(t, s) / rate(b, s));
            }
            table.push('\n');
        }
    }
    println!("{table}hits per set: {:?}", hits);
    if let Some(path) = &options.csv {
        let mut file =
            std::fs::OpenOptions::new().create(true).append(true).open(path).expect("a writable file");
        file.write_all(table.as_bytes()).expect("a writable file");
    }
}
