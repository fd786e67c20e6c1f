//! Nanoseconds per `sample` and per `eval_pdf` of every kind: `cargo bench -p steradian-scatter`.
#![allow(clippy::print_stdout, reason = "a benchmark's answer")]

use std::hint::black_box;
use std::time::Instant;

use math::LocalDir;
use spectrum::Spectrum;
use steradian_scatter::{
    Bsdf, Coat, CoatProfile, CoatedConductor, CoatedDiffuse, Conductor, Dielectric, Diffuse, TransportMode,
};
use testkit::chi2::uniform_pair;

const N: usize = 20_000;

fn kinds() -> Vec<(&'static str, Bsdf)> {
    let sand = Spectrum::from_rgb([0.9, 0.4, 0.2]);
    let metal = |alpha: f32| Conductor::new(Spectrum::splat(0.3), Spectrum::splat(3.0), [alpha; 2]);
    let coat = Coat::default();
    let rough = Coat { alpha: [0.3; 2], ..coat };
    let profile = CoatProfile::new(1.5, 0.3, coat.thickness);
    let smooth = CoatProfile::smooth(1.5, coat.thickness);
    vec![
        ("diffuse", Diffuse::new(sand).into()),
        ("conductor, rough", metal(0.3).into()),
        ("dielectric, smooth", Dielectric::new(1.5, [0.0; 2]).into()),
        ("dielectric, rough", Dielectric::new(1.5, [0.3; 2]).into()),
        ("coated diffuse, smooth", CoatedDiffuse::new(sand, &coat, Some(smooth)).into()),
        ("coated diffuse, rough", CoatedDiffuse::new(sand, &rough, Some(profile)).into()),
        ("coated diffuse, rough, walk", CoatedDiffuse::new(sand, &rough, None).into()),
        ("coated conductor, smooth coat", CoatedConductor::new(metal(0.3), &coat).into()),
        ("coated conductor, rough coat", CoatedConductor::new(metal(0.3), &rough).into()),
    ]
}

/// Time of a call (the best of twenty runs, for a busy machine) with pairs of directions and random numbers.
fn nanoseconds(mut call: impl FnMut(LocalDir, LocalDir, [f32; 2])) -> f64 {
    let dirs: Vec<_> = (0..1024).map(|i| sampling::warp::cosine_hemisphere(uniform_pair(3, i))).collect();
    let numbers: Vec<_> = (0..1024).map(|i| uniform_pair(4, i)).collect();
    let mut run = || {
        let start = Instant::now();
        for i in 0..N {
            call(dirs[i % 1024], dirs[(7 * i + 1) % 1024], numbers[(5 * i + 3) % 1024]);
        }
        start.elapsed().as_nanos() as f64 / N as f64
    };
    (0..20).map(|_| run()).fold(f64::INFINITY, f64::min)
}

fn main() {
    let mode = TransportMode::Radiance;
    println!("{:32} {:>9} {:>9}", "ns", "sample", "eval_pdf");
    for (name, b) in kinds() {
        let b = black_box(b);
        let sample = nanoseconds(|wo, _, u| {
            black_box(b.sample(wo, u[1], [u[0], 1.0 - u[0]], mode));
        });
        let eval = nanoseconds(|wo, wi, _| {
            black_box(b.eval_pdf(wo, wi, mode));
        });
        println!("{name:32} {sample:9.1} {eval:9.1}");
    }
}
