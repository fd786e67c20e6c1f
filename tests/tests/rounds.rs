//! What one process has learned another may take over, instead of learning it again: the bits are the same.

use std::path::Path;

use render::{Cancel, Checkpoint, Job, Method, SceneOptions, Stop};
use steradian_tests::{bytes, open, workers};

/// Small, and cheap to learn.
fn method(name: &str) -> Method {
    let settings = match name {
        "irradiance-cache" => vec![("rays", "64"), ("min_spacing", "8")],
        "many-light" => vec![("light_paths", "64"), ("max_cut", "40")],
        _ => vec![],
    };
    let settings = settings.into_iter().map(|(k, v)| (k.to_owned(), v.to_owned())).collect();
    Method { integrator: Some(name.to_owned()), settings, seed: Some(3) }
}

fn render(job: &mut Job<'_>, passes: std::ops::Range<u32>) -> Vec<u8> {
    let done = job.render(&Stop::Passes(passes), None, &workers(2), &Cancel::default(), &mut |_| {});
    done.unwrap_or_else(|e| panic!("{e}"));
    bytes(job.film())
}

/// Pass 192 of this picture reads a later round of the guide than pass 0: a job that begins there learns two rounds alone, or takes
/// over the second, which was learned on from the first.
#[test]
fn what_was_learned_elsewhere_gives_the_same_bits() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/rough-glass.pbrt");
    for (name, options) in
        [("guided", SceneOptions::default()), ("irradiance-cache", SceneOptions::default())]
            .into_iter()
            .chain([("irradiance-cache", SceneOptions { spectral: true, ..SceneOptions::default() })])
    {
        let scene = open(&path, &SceneOptions { resolution: Some([24, 24]), ..options });
        let new = || Job::new(&scene, &method(name)).unwrap_or_else(|e| panic!("{e}"));
        let alone = render(&mut new(), 192..194);

        let first = new().learn(0, &workers(1)).0.unwrap_or_default();
        let mut teacher = new();
        assert!(teacher.take_learned(&first), "{name}");
        let second = teacher.learn(192, &workers(3)).0.unwrap_or_default();
        assert!(name != "guided" || first != second, "{name}: two rounds");
        let mut pupil = new();
        assert!(pupil.take_learned(&second), "{name}");
        assert!(render(&mut pupil, 192..194) == alone, "{name}");
        assert!(!new().take_learned(&second[..second.len() / 2]), "{name}: half of it is refused");
    }
}

/// A checkpoint has nothing but the film, and yet every integrator goes on from it as if it had never stopped, those too that
/// learn from pass to pass.
#[test]
fn a_resumed_render_has_the_bits_of_an_uninterrupted_one_for_every_integrator() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/rough-glass.pbrt");
    let scene = open(&path, &SceneOptions { resolution: Some([20, 20]), ..SceneOptions::default() });
    let folder = tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"));
    let iterations = ("combine".to_owned(), "inverse-variance".to_owned());
    let by_variance = Method { settings: vec![iterations], ..method("guided") };
    let all = integrators::list().iter().map(|info| method(info.name));
    for (i, method) in all.chain([by_variance]).enumerate() {
        let name = method.integrator.as_deref().unwrap_or_default();
        let new = || Job::new(&scene, &method).unwrap_or_else(|e| panic!("{e}"));
        let every = std::time::Duration::from_secs(3600);
        let checkpoint = Checkpoint { path: folder.path().join(i.to_string()), every, resume: true };
        let go_on = |to: u32| {
            let mut job = new();
            let stop = Stop::Passes(0..to);
            let done = job.render(&stop, Some(&checkpoint), &workers(2), &Cancel::default(), &mut |_| {});
            (done.unwrap_or_else(|e| panic!("{e}")).passes_resumed, bytes(job.film()))
        };
        // After the second part, guided reads another round than after the first.
        let [first, all] = if name == "guided" { [100, 180] } else { [8, 20] };
        assert_eq!(go_on(first).0, 0);
        let (resumed, film) = go_on(all);
        assert!(resumed == u64::from(first) && film == render(&mut new(), 0..all), "{method:?}");
    }
}

/// The bias of weights by inverse variance is far below the noise where light is easy: it can be seen, always to the dark side, as
/// one or two hundredths of the standard error of the picture's mean (here as if pixels were independent).
#[test]
fn guides_combined_by_inverse_variance_agree_with_all_passes_alike() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/large-lamp.pbrt");
    let scene = open(&path, &SceneOptions { resolution: Some([24, 24]), ..SceneOptions::default() });
    let mut z = Vec::new();
    for seed in 1..=3 {
        let [alike, weighed] = ["count", "inverse-variance"].map(|combine| {
            let settings = vec![("combine".to_owned(), combine.to_owned())];
            let method = Method { settings, seed: Some(seed), ..method("guided") };
            let mut job = Job::new(&scene, &method).unwrap_or_else(|e| panic!("{e}"));
            render(&mut job, 0..128);
            job.film().develop()
        });
        assert_eq!((alike.weights.len(), weighed.weights.len()), (1, 2), "guides of 128 passes");
        let (a, b) = (alike.mean_rgb(), weighed.mean_rgb());
        let variance: f64 = weighed.variance.iter().map(|v| f64::from(v[0])).sum::<f64>() / 576.0 / 576.0;
        z.push((b[0] - a[0]) / variance.sqrt());
    }
    assert!(z.iter().all(|z| z.abs() < 0.1), "{z:?}");
}

/// The registry says which integrators learn, for those who plan a render without making the integrator.
#[test]
fn the_registry_knows_who_learns() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/small-lamp.pbrt");
    let scene = open(&path, &SceneOptions { resolution: Some([8, 8]), ..SceneOptions::default() });
    for info in integrators::list() {
        let mut job = Job::new(&scene, &method(info.name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(job.round(0).is_some(), integrators::learns(info.name), "{}", info.name);
        let learned = job.learn(0, &workers(1)).0;
        assert_eq!(learned.is_some(), integrators::learns(info.name), "{}", info.name);
    }
}
