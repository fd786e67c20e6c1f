//! `steradian info`.

use std::time::Instant;

use render::Contents;
use serde::Serialize;

use crate::args::InfoArgs;
use crate::exit::{Done, Status};
use crate::load;
use crate::messages::{self, bytes, grouped, say};

#[derive(Debug, Serialize)]
struct Report {
    scene: std::path::PathBuf,
    content_hash: String,
    load_seconds: f64,
    resolution: [u32; 2],
    /// x0, y0, x1, y1.
    crop: [i32; 4],
    spp: u32,
    integrator: String,
    sampler: String,
    #[serde(flatten)]
    contents: Contents,
    triangles: u64,
    other_primitives: u64,
    /// Geometry and tree.
    bytes_per_triangle: Option<f64>,
    accel_bytes: u64,
    geometry_bytes: u64,
    texture_bytes: u64,
    memory_bytes: u64,
    /// What the file asks for and does not get.
    unsupported: Vec<Message>,
}

#[derive(Debug, Serialize)]
struct Message {
    place: String,
    message: String,
    hint: Option<String>,
}

pub(crate) fn run(args: &InfoArgs) -> Done {
    let start = Instant::now();
    let workers = load::workers(&args.scene)?;
    let (opened, sink) = load::open_quietly(&args.scene, &[], &workers)?;
    let (s, contents) = (opened.scene.settings(), opened.contents);
    let counts = s.counts;
    let crop = s.crop;
    let geometry = counts.accel_bytes + counts.geometry_bytes;
    let unsupported = sink.diagnostics().iter().map(|d| Message {
        place: sink.sources().locate(d.span),
        message: d.message.clone(),
        hint: d.hint.clone(),
    });
    let report = Report {
        scene: args.scene.scene.clone(),
        content_hash: format!("{:016x}", s.content_hash),
        load_seconds: start.elapsed().as_secs_f64(),
        resolution: s.resolution,
        crop: [crop.min[0], crop.min[1], crop.max[0], crop.max[1]],
        spp: s.sampler.spp,
        integrator: s.integrator.name.clone(),
        sampler: s.sampler.name.clone(),
        contents,
        triangles: counts.triangles,
        other_primitives: counts.other_primitives,
        bytes_per_triangle: (counts.triangles > 0).then(|| geometry as f64 / counts.triangles as f64),
        accel_bytes: counts.accel_bytes,
        geometry_bytes: counts.geometry_bytes,
        texture_bytes: counts.texture_bytes,
        memory_bytes: geometry + counts.texture_bytes,
        unsupported: unsupported.collect(),
    };
    if args.json {
        messages::json(&report);
    } else {
        print(&report);
        messages::diagnostics(&sink, false);
    }
    Ok(Status::Done)
}

fn print(r: &Report) {
    let row = |name: &str, value: String| say(&format!("{name:<14}{value}"));
    let c = &r.contents;
    let count = |n: usize| grouped(n as u64);
    row("scene", format!("{} (hash {})", r.scene.display(), r.content_hash));
    row("image", format!("{} x {}, {} samples per pixel", r.resolution[0], r.resolution[1], r.spp));
    row("method", format!("{}, {} sampler", r.integrator, r.sampler));
    row("shapes", format!("{}, of which {} emit", count(c.shapes), count(c.area_lights)));
    row("objects", format!("{}, {} instances", count(c.objects), count(c.instances)));
    row("triangles", grouped(r.triangles));
    row("other", format!("{} patches, quadrics and strand segments", grouped(r.other_primitives)));
    row("lights", format!("{} besides shapes", count(c.lights)));
    row("materials", count(c.materials));
    row("textures", format!("{}, from {} images", count(c.textures), count(c.images)));
    row("media", count(c.media));
    let each = r.bytes_per_triangle.map(|b| format!(", {b:.0} bytes per triangle")).unwrap_or_default();
    row("memory", bytes(r.memory_bytes));
    row("  geometry", format!("{}{each}", bytes(r.accel_bytes + r.geometry_bytes)));
    row("  textures", bytes(r.texture_bytes));
    row("load time", format!("{:.2} s", r.load_seconds));
    row("unsupported", if r.unsupported.is_empty() { "nothing".into() } else { count(r.unsupported.len()) });
}
