//! From a description to a scene: images decoded, meshes baked into world space, trees built, lights counted.
//!
//! What is wrong is reported with its place, all of it, before `None` is returned; what cannot be rendered yet is a
//! warning that says what is done instead.

mod displace;
mod emitters;
mod geometry;
mod kept;
mod patch_grid;
mod taken;

pub use kept::Kept;

use math::Bounds2i;
use scene_desc::{SceneDesc, Sink};
use spectrum::{ColorMode, ColorPipeline, Sensor};

use self::taken::Taken;
use crate::Surroundings;
use crate::cameras::Camera;
use crate::light_select::LightSelector;
use crate::lights::{LightImage, LightsBuilder};
use crate::materials::{Gaps, Materials};
use crate::media::Media;
use crate::scene::{Scene, SceneCounts, SceneSettings};
use crate::textures::{TextureCompiler, color_space};

/// What the caller wants otherwise than the file.
#[derive(Clone, Copy, Debug, Default)]
pub struct CompileOptions {
    /// Four hero wavelengths instead of R, G, B.
    pub spectral: bool,
    /// Another size of the whole film; crops are then taken anew from their share of it.
    pub resolution: Option<[u32; 2]>,
    /// Only these pixels.
    pub crop: Option<Bounds2i>,
    /// A certain instruction set for rays; `None`: the best that this processor has.
    pub isa: Option<accel::Isa>,
}

/// Compiles a scene, on all threads of the current rayon pool. `None` if `sink` has an error.
#[must_use]
pub fn compile(desc: &SceneDesc, options: &CompileOptions, sink: &mut Sink) -> Option<Scene> {
    recompile(desc, options, None, sink)
}

/// The same of a description that nobody needs any more: its meshes become the scene's.
#[must_use]
pub fn consume(mut desc: SceneDesc, options: &CompileOptions, sink: &mut Sink) -> Option<Scene> {
    let taken = Taken::from(&mut desc);
    compile_with(&desc, options, (None, taken), sink)
}

/// The same, with what an earlier compile made and this one needs alike: to the bit what [`compile`] gives.
#[must_use]
pub fn recompile(
    desc: &SceneDesc,
    options: &CompileOptions,
    kept: Option<Kept>,
    sink: &mut Sink,
) -> Option<Scene> {
    compile_with(desc, options, (kept, Taken::default()), sink)
}

fn compile_with(
    desc: &SceneDesc,
    options: &CompileOptions,
    (kept, taken): (Option<Kept>, Taken),
    sink: &mut Sink,
) -> Option<Scene> {
    let (kept_images, kept_world) = kept.map(|k| k.split(desc)).unzip();
    let colors = color_pipeline(desc, options);
    let displaced = displace::displaced(desc, colors, sink);
    let desc = displaced.as_ref().unwrap_or(desc);
    let (resolution, crop) = film_bounds(desc, options, sink)?;
    let camera = camera(desc, resolution, sink);

    // Looks and surfaces; then the images that they want.
    let mut compiler = TextureCompiler::new(desc, colors, sink);
    let materials = Materials::compile(desc, &mut compiler);
    let (media, medium_ids) = Media::compile(&desc.media, materials.interiors(), colors, compiler.sink());
    let given = (kept_world.flatten(), taken);
    let world = geometry::build(desc, &materials, &mut compiler, (options, &medium_ids), given);
    let textures = compiler.finish_with(kept_images.as_ref());

    // Lights.
    if sink.has_errors() {
        return None;
    }
    let (mut world, camera) = (world?, camera?);
    let image = |id| LightImage::from(textures.images().get(id));
    let mut lights = LightsBuilder::new(colors, &image);
    let declare = |light| (lights.add_light(light, sink), medium_ids.described(light.medium));
    let declared: Vec<_> = desc.lights.iter().map(declare).collect();
    let instance_lights = emitters::declare(&mut world, &mut lights, sink);
    let lights = lights.finish(world.accel.bounds());
    let light_selector = LightSelector::new(desc.integrator.light_selection, &lights);
    let counts = SceneCounts { texture_bytes: textures.memory() as u64, ..world.counts };
    let mut scene = Scene {
        hit_filter: world.shapes.iter().any(|s| s.alpha.is_some()),
        shadow_filter: world.shapes.iter().any(|s| s.alpha.is_some() || s.gaps != Gaps::Nowhere),
        accel: world.accel,
        shapes: world.shapes,
        object_base: world.object_base,
        instances: world.instances,
        instance_lights,
        textures,
        materials,
        media,
        bodies: world.bodies,
        camera_surroundings: Surroundings::default(),
        light_media: Vec::new(),
        lights,
        light_selector,
        camera,
        sensor: sensor(desc, colors.space),
        settings: SceneSettings {
            resolution,
            crop,
            filter: desc.filter,
            sampler: desc.sampler.clone(),
            integrator: desc.integrator.clone(),
            imaging_ratio: desc.film.sensor.imaging_ratio(),
            spectral: options.spectral,
            filename: desc.film.filename.clone(),
            content_hash: desc.content_hash,
            counts,
        },
    };
    scene.place_camera(medium_ids.described(desc.camera.medium));
    scene.place_lights(&declared);
    scene.look_at_skies();
    Some(scene)
}

/// How colours become lanes.
fn color_pipeline(desc: &SceneDesc, options: &CompileOptions) -> ColorPipeline {
    let mode = if options.spectral { ColorMode::Spectral } else { ColorMode::Rgb };
    ColorPipeline { mode, space: color_space(desc.film.color_space) }
}

fn camera(desc: &SceneDesc, resolution: [u32; 2], sink: &mut Sink) -> Option<Camera> {
    let camera = Camera::compile(&desc.camera, resolution).map(|c| c.with_border(desc.filter.reach()));
    if camera.is_none() {
        sink.error(desc.camera.span, "this camera has no meaning")
            .hint("its transform needs an inverse, its field of view lies between 0 and 180 degrees, its aperture lets light through");
    }
    camera
}

/// The whole film's resolution and the pixels to render.
fn film_bounds(desc: &SceneDesc, options: &CompileOptions, sink: &mut Sink) -> Option<([u32; 2], Bounds2i)> {
    let own = desc.film.resolution;
    let resolution = options.resolution.unwrap_or(own);
    let whole = Bounds2i::new([0, 0], resolution.map(|r| i32::try_from(r).unwrap_or(i32::MAX)));
    let crop = match (options.crop, desc.film.pixel_bounds) {
        (Some(crop), _) => crop,
        (None, Some([x0, x1, y0, y1])) => {
            let scale = |v: u32, axis: usize| {
                (u64::from(v) * u64::from(resolution[axis]) / u64::from(own[axis].max(1))) as i32
            };
            Bounds2i::new([scale(x0, 0), scale(y0, 1)], [scale(x1, 0), scale(y1, 1)])
        }
        (None, None) => whole,
    };
    let kept = crop.intersect(&whole);
    if kept.area() == 0 {
        let [w, h] = resolution;
        sink.error(
            desc.film.span,
            format!("nothing to render: {:?} to {:?} of {w}x{h} pixels", crop.min, crop.max),
        )
        .hint("a crop must overlap the film, and a film has at least one pixel");
        return None;
    }
    Some((resolution, kept))
}

fn sensor(desc: &SceneDesc, space: spectrum::ColorSpace) -> Sensor {
    let sensor = match desc.film.sensor.white_balance {
        Some(kelvin) => Sensor::with_white_balance(space, f64::from(kelvin)),
        None => Sensor::new(space),
    };
    sensor.with_exposure(desc.film.sensor.imaging_ratio())
}
