//! From a scene file to a compiled scene, with what a caller wants otherwise than the file.

use std::path::Path;

use math::Bounds2i;
use scene::{CompileOptions, Kept, Scene};
use scene_desc::{LightSelection, SceneDesc, Severity, Sink, Span};

use crate::Workers;

/// What a caller wants otherwise than the file.
#[derive(Clone, Debug, Default)]
pub struct SceneOptions {
    /// Width and height of the whole film.
    pub resolution: Option<[u32; 2]>,
    /// Only these pixels.
    pub crop: Option<Bounds2i>,
    /// Four wavelengths instead of R, G, B.
    pub spectral: bool,
    /// The instruction set for rays.
    pub isa: Option<accel::Isa>,
    /// Are warnings errors?
    pub strict: bool,
    /// Values of the file's `$parameters`.
    pub defines: Vec<(String, String)>,
    /// Settings by name. Those named in [`SCENE_SETTINGS`] are used here, the others are the integrator's.
    pub settings: Vec<(String, String)>,
}

/// Settings that all integrators share.
pub const SCENE_SETTINGS: [&str; 2] = ["sampler", "light_selection"];

/// A scene, ready to be rendered.
pub struct Opened {
    /// It.
    pub scene: Scene,
    /// What the file had.
    pub contents: Contents,
}

/// How many of each kind of thing a description has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Contents {
    /// Shapes in the world and in objects.
    pub shapes: usize,
    /// Objects that can be instanced.
    pub objects: usize,
    /// Instances.
    pub instances: usize,
    /// Surfaces' looks.
    pub materials: usize,
    /// Values that vary over surfaces.
    pub textures: usize,
    /// Image files.
    pub images: usize,
    /// What fills space.
    pub media: usize,
    /// Lights that are not surfaces.
    pub lights: usize,
    /// Shapes that emit.
    pub area_lights: usize,
}

/// Loads and compiles a scene file on the threads of `workers`. `None`: `sink` says why.
pub fn open(path: &Path, options: &SceneOptions, workers: &Workers, sink: &mut Sink) -> Option<Opened> {
    let desc = load(path, options, workers, sink)?;
    compile(desc, options, workers, sink)
}

/// Reads a scene file on the threads of `workers`, as it stands. `None`: `sink` says why.
pub fn load(path: &Path, options: &SceneOptions, workers: &Workers, sink: &mut Sink) -> Option<SceneDesc> {
    workers.install(|| {
        let desc = formats::load_with(path, &options.defines, sink)?;
        (!is_refused(options, sink)).then_some(desc)
    })
}

/// Compiles a description on the threads of `workers`. `None`: `sink` says why.
pub fn compile(
    desc: SceneDesc,
    options: &SceneOptions,
    workers: &Workers,
    sink: &mut Sink,
) -> Option<Opened> {
    recompile(desc, options, None, workers, sink)
}

/// The same, with what an earlier compile made: what is alike is taken over and not made again.
pub fn recompile(
    mut desc: SceneDesc,
    options: &SceneOptions,
    kept: Option<Kept>,
    workers: &Workers,
    sink: &mut Sink,
) -> Option<Opened> {
    apply(&mut desc, options, sink);
    if is_refused(options, sink) {
        return None;
    }
    let contents = Contents::of(&desc);
    let options_of_scene = compile_options(options);
    let scene = workers.install(|| match kept {
        Some(kept) => scene::recompile(&desc, &options_of_scene, Some(kept), sink),
        None => scene::consume(desc, &options_of_scene, sink),
    })?;
    (!is_refused(options, sink)).then_some(Opened { scene, contents })
}

/// Is there something that stops the render?
fn is_refused(options: &SceneOptions, sink: &Sink) -> bool {
    let stops = |s: Severity| match s {
        Severity::Error => true,
        Severity::Warning => options.strict,
    };
    sink.diagnostics().iter().any(|d| stops(d.severity))
}

fn compile_options(options: &SceneOptions) -> CompileOptions {
    CompileOptions {
        spectral: options.spectral,
        resolution: options.resolution,
        crop: options.crop,
        isa: options.isa,
    }
}

/// Applies the settings that all integrators share.
fn apply(desc: &mut SceneDesc, options: &SceneOptions, sink: &mut Sink) {
    for (key, value) in &options.settings {
        match key.as_str() {
            "light_selection" => match light_selection(value) {
                Some(selection) => desc.integrator.light_selection = selection,
                None => wrong(sink, key, value, "uniform, power or spatial"),
            },
            "sampler" => match value.as_str() {
                "sobol" | "independent" | "stratified" => desc.sampler.name.clone_from(value),
                _ => wrong(sink, key, value, "sobol, independent or stratified"),
            },
            _ => {}
        }
    }
}

fn wrong(sink: &mut Sink, key: &str, value: &str, expected: &str) {
    sink.error(Span::NONE, format!("`{key}` cannot be `{value}`")).hint(format!("expected {expected}"));
}

fn light_selection(name: &str) -> Option<LightSelection> {
    match name {
        "uniform" => Some(LightSelection::Uniform),
        "power" => Some(LightSelection::Power),
        "spatial" => Some(LightSelection::Spatial),
        _ => None,
    }
}

impl Contents {
    fn of(desc: &SceneDesc) -> Self {
        let shapes = || desc.shapes.iter().chain(desc.objects.iter().flat_map(|o| &o.shapes));
        Self {
            shapes: shapes().count(),
            objects: desc.objects.len(),
            instances: desc.instances.len(),
            materials: desc.materials.len(),
            textures: desc.textures.len(),
            images: desc.images.len(),
            media: desc.media.len(),
            lights: desc.lights.len(),
            area_lights: shapes().filter(|s| s.area_light.is_some()).count(),
        }
    }
}
