//! How fast trees are built, what they cost by the surface area heuristic and in bytes, and how fast Embree is.

use std::time::Instant;

use steradian_accel::{Blas, BuildOptions, TreeKind};

use crate::Options;
use crate::embree::Embree;
use crate::workload::Scene;

/// Builds each kind of tree on one thread and on all, in turn; the best of the rounds counts.
pub(crate) fn run(options: &Options, name: &str, scene: &Scene) {
    let n: usize = scene.meshes.iter().map(|m| m.indices.len()).sum();
    let most = rayon::current_num_threads();
    let threads: Vec<usize> = if most > 1 { vec![1, most] } else { vec![1] };
    let pool = |&n: &usize| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads");
    let pools: Vec<_> = threads.iter().map(pool).collect();
    println!("scene,triangles,tree,threads,s,CPU s,Mtri/s per core,cost,bytes per triangle,peak MiB");
    let kinds: Vec<TreeKind> = TreeKind::ALL
        .into_iter()
        .filter(|t| *t != TreeKind::Halves)
        .filter(|t| options.only.as_ref().is_none_or(|only| format!("{t:?}").contains(only.as_str())))
        .collect();
    let mut best = vec![vec![[f64::INFINITY; 2]; threads.len()]; kinds.len() + 1];
    let mut notes = vec![String::new(); kinds.len() + 1];
    for _ in 0..options.rounds {
        for (t, (&threads, pool)) in threads.iter().zip(&pools).enumerate() {
            for (k, &tree) in kinds.iter().enumerate() {
                let geometries = scene.geometries();
                let (start, cpu) = (Instant::now(), cpu_seconds());
                let blas =
                    pool.install(|| Blas::build(&geometries, &BuildOptions { tree })).expect("a proper mesh");
                let now = [start.elapsed().as_secs_f64(), cpu_seconds() - cpu];
                best[k][t] = [0, 1].map(|i| best[k][t][i].min(now[i]));
                let stats = blas.stats();
                notes[k] = format!("{:.3},{:.1},{}", stats.sah_cost, stats.bytes as f64 / n as f64, peak());
            }
            if let Some(path) = &options.embree {
                let embree = Embree::new(path, "embree", 0, &scene.meshes, threads);
                best[kinds.len()][t][0] = best[kinds.len()][t][0].min(embree.seconds);
                notes[kinds.len()] = ",,".to_owned();
            }
        }
    }
    let names = kinds.iter().map(|k| format!("{k:?}")).chain(["embree".to_owned()]);
    for ((tree, best), notes) in names.zip(best).zip(notes) {
        for (seconds, threads) in best.iter().zip(&threads).filter(|(s, _)| s[0].is_finite()) {
            let ([seconds, cpu], rate) = (seconds, n as f64 / seconds[0] / *threads as f64 * 1e-6);
            println!("{name},{n},{tree},{threads},{seconds:.3},{cpu:.3},{rate:.2},{notes}");
        }
    }
}

/// What the threads of this process have had of the processors, where the system tells. On a busy machine this says more
/// than the clock.
fn cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let of = |task: std::fs::DirEntry| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).unwrap_or_default();
        text.split_whitespace().next().and_then(|ns| ns.parse::<u64>().ok()).unwrap_or_default()
    };
    tasks.map(of).sum::<u64>() as f64 * 1e-9
}

/// The most memory that this process has held, in MiB, where the system tells.
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM:")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kib| kib.parse::<usize>().ok()).unwrap_or_default() / 1024
}
