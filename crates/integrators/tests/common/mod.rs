//! Renders small scenes for tests, and compares what integrators say of them.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]
#![allow(dead_code, reason = "every test binary uses its part")]
#![allow(clippy::print_stdout, reason = "figures of the tests")]

use std::path::Path;

use film::{Film, FilmSettings, Filter, Sign};
use math::Bounds2i;
use scene::{CompileOptions, Scene, compile};
use scene_desc::{FilterDesc, ParameterValue, Sink};
use steradian_integrators::{Cell, CellOutput, Counters, Integrator, Making, PassContext, create};
use testkit::statistics::{Moments, welch_test};

/// A scene of `tests/scenes`; pbrt's format unless the name has an ending.
pub(crate) fn scene(name: &str, spectral: bool) -> Scene {
    let file = if name.contains('.') { name.to_owned() } else { format!("{name}.pbrt") };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenes").join(file);
    let mut sink = Sink::default();
    let desc = formats::load(&path, &mut sink);
    let scene = desc.and_then(|d| compile(&d, &CompileOptions { spectral, ..Default::default() }, &mut sink));
    scene.unwrap_or_else(|| panic!("{}", sink.render()))
}

/// An integrator with parameters as `name=value`, over those of the scene.
pub(crate) fn integrator(scene: &Scene, name: &str, set: &[&str], seed: u64) -> Box<dyn Integrator> {
    let text = |s: &str| ParameterValue::Text(s.to_owned());
    let given: Vec<_> = set.iter().filter_map(|s| s.split_once('=')).map(|(k, v)| (k, text(v))).collect();
    let making = Making { scene, sampler: &scene.settings().sampler, seed };
    create(name, given.iter().map(|(k, v)| (*k, v)), &making).unwrap().0
}

/// Renders passes and gives the mean of every square of `side` pixels and colour.
pub(crate) fn tile_means(
    scene: &Scene,
    integrator: &mut dyn Integrator,
    passes: std::ops::Range<u32>,
    side: usize,
) -> Vec<f64> {
    let settings = scene.settings();
    let film = Film::new(FilmSettings {
        splats: integrator.splats(),
        sign: Sign::Any,
        crop: settings.crop,
        ..FilmSettings::new(settings.resolution, filter(&settings.filter))
    })
    .unwrap();
    let bounds = settings.sample_bounds();
    assert_eq!(bounds, film.settings().sample_bounds());
    let mut buffer = film.pass_buffer().unwrap();
    let mut out = CellOutput { tile: film.tile(), splats: film.splat_list(), counters: Counters::default() };
    for pass in passes {
        let ctx = PassContext { scene, pass };
        integrator.prepare(ctx);
        buffer.begin(pass);
        out.splats.begin(pass);
        out.tile.begin(bounds, pass);
        integrator.cell(ctx, Cell::Tile(bounds), &mut out);
        for block in 0..integrator.light_blocks(scene) {
            integrator.cell(ctx, Cell::LightBlock(block), &mut out);
        }
        buffer.add_tile(&out.tile);
        buffer.add_splats(&mut out.splats);
        film.add_pass(&mut buffer).unwrap();
    }
    assert_eq!(film.bad_samples().count(), 0, "bad samples: {:?}", film.bad_samples());
    means(&film, settings.crop, side)
}

fn means(film: &Film, crop: Bounds2i, side: usize) -> Vec<f64> {
    let image = film.develop();
    let across = crop.width().div_ceil(side);
    let tile_of = |i: usize| i / crop.width() / side * across + i % crop.width() / side;
    let mut sums = vec![[0.0; 3]; across * crop.height().div_ceil(side)];
    let mut counts = vec![0.0; sums.len()];
    for (i, rgb) in image.mean.iter().enumerate() {
        counts[tile_of(i)] += 1.0;
        for c in 0..3 {
            sums[tile_of(i)][c] += f64::from(rgb[c]);
        }
    }
    sums.iter().zip(counts).flat_map(|(s, n)| s.map(|x| x / n)).collect()
}

fn filter(desc: &FilterDesc) -> Filter {
    match *desc {
        FilterDesc::Box { radius } => Filter::Box { radius },
        FilterDesc::Gaussian { radius, sigma } => Filter::Gaussian { radius, sigma },
        FilterDesc::Triangle { .. } | FilterDesc::Mitchell { .. } | FilterDesc::Sinc { .. } => {
            panic!("no test scene has this filter")
        }
    }
}

/// What an integrator says of a scene: moments of every tile's mean over batches of passes.
pub(crate) struct Estimate {
    pub(crate) label: String,
    pub(crate) tiles: Vec<Moments>,
    /// Of the whole picture, by colour.
    pub(crate) whole: [Moments; 3],
}

/// Renders `batches` times `passes` passes.
pub(crate) fn estimate(scene: &Scene, name: &str, set: &[&str], batches: u32, passes: u32) -> Estimate {
    let mut it = integrator(scene, name, set, 7);
    let (mut tiles, mut whole) = (Vec::new(), [Moments::default(); 3]);
    for b in 0..batches {
        let values = tile_means(scene, it.as_mut(), b * passes..(b + 1) * passes, TILE);
        for (c, whole) in whole.iter_mut().enumerate() {
            let n = (values.len() / 3) as f64;
            whole.push(values.iter().skip(c).step_by(3).sum::<f64>() / n);
        }
        tiles.resize(values.len(), Moments::default());
        for (m, v) in tiles.iter_mut().zip(values) {
            m.push(v);
        }
    }
    Estimate { label: format!("{name} {}", set.join(" ")), tiles, whole }
}

/// Side of a tile in pixels.
pub(crate) const TILE: usize = 8;

/// The tile and colour in which two estimates differ most.
fn worst(a: &Estimate, b: &Estimate, masked: &[usize]) -> usize {
    let p = |i: &usize| welch_test(&a.tiles[*i], &b.tiles[*i]).p_value;
    let seen = (0..a.tiles.len()).filter(|i| !masked.contains(&(i / 3)));
    seen.min_by(|i, j| p(i).total_cmp(&p(j))).unwrap()
}

/// Comparisons of one test: each is printed, and what disagrees is told at the end.
pub(crate) struct Findings {
    alpha: f64,
    failures: String,
}

impl Findings {
    /// With the false-alarm rate of one comparison.
    pub(crate) fn new(alpha: f64) -> Self {
        Self { alpha, failures: String::new() }
    }

    /// Two estimates where they differ most, tiles of `blind` left out.
    pub(crate) fn compare_tiles(&mut self, name: &str, a: &Estimate, b: &Estimate, blind: &[usize]) {
        let i = worst(a, b, blind);
        let what = format!("{name}: {} and {}: tile {} colour {}", a.label, b.label, i / 3, i % 3);
        self.compare(&what, &a.tiles[i], &b.tiles[i]);
    }

    /// Two estimates by their means over the whole picture.
    pub(crate) fn compare_whole(&mut self, name: &str, a: &Estimate, b: &Estimate) {
        for (c, (x, y)) in a.whole.iter().zip(&b.whole).enumerate() {
            self.compare(&format!("{name}: {} and {}: all, colour {c}", a.label, b.label), x, y);
        }
    }

    fn compare(&mut self, what: &str, a: &Moments, b: &Moments) {
        let t = welch_test(a, b);
        let line = format!(
            "{what}: {:.5} and {:.5} ({:+.2} % ± {:.2} %), t = {:.2}, p = {:.1e}",
            a.mean(),
            b.mean(),
            100.0 * (a.mean() / b.mean() - 1.0),
            100.0 * a.std_error().hypot(b.std_error()) / b.mean(),
            t.statistic,
            t.p_value
        );
        println!("{line}");
        if !t.is_consistent(self.alpha) {
            self.failures += &line;
            self.failures.push('\n');
        }
    }

    /// Fails if anything disagreed.
    pub(crate) fn end(self) {
        assert!(self.failures.is_empty(), "p < {:.1e}:\n{}", self.alpha, self.failures);
    }
}
