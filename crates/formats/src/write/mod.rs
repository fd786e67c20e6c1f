//! Any scene as a pbrt-v4 file [pbrt-v4], with meshes (PLY) and images in a folder beside it.
//!
//! What pbrt-v4 cannot say is told in a warning at its place, with what is written instead. Numbers are written so that
//! reading them gives the same bits. Every file is written as a whole or not at all, the scene file last.

mod images;
mod lights;
mod materials;
mod media;
mod options;
mod params;
mod ply;
mod shapes;
mod textures;

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use math::{AnimatedTransform, Transform};
use scene_desc::{Geometry, ImageId, SceneDesc, Sink, Span};

use crate::report::Report;

/// Why a scene was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A file could not be written.
    #[error(transparent)]
    Image(#[from] image::ImageError),
    /// Something cannot be said, and warnings are errors.
    #[error("something in the scene has no place in pbrt-v4")]
    Strict,
    /// A folder could not be made, or a file not be read.
    #[error("{path}: {source}")]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Writes a scene as pbrt-v4 text to `path`, and what belongs to it to the folder `<name>-files` beside it. What pbrt
/// cannot say is warned about in `sink`.
///
/// # Errors
/// When a file cannot be read or written, or something cannot be said and `strict` is set; then the scene file is as it was
/// before.
pub fn write_pbrt(scene: &SceneDesc, path: &Path, strict: bool, sink: &mut Sink) -> Result<(), WriteError> {
    let mut report = Report::new(sink);
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = stem.strip_suffix(".pbrt").unwrap_or(&stem).to_owned();
    let folder_name = format!("{stem}-files");
    let folder = path.with_file_name(&folder_name);
    let mut writer = Writer {
        scene,
        report: &mut report,
        text: String::new(),
        folder,
        folder_name,
        images: HashMap::new(),
        meshes: HashMap::new(),
        n_meshes: 0,
        times: None,
    };
    let written = writer.all();
    let text = std::mem::take(&mut writer.text);
    let is_refused = strict && report.has_warnings();
    report.finish(None);
    written?;
    if is_refused {
        return Err(WriteError::Strict);
    }
    image::write_atomically(path, text.as_bytes())?;
    Ok(())
}

struct Writer<'a, 'r, 's> {
    scene: &'a SceneDesc,
    report: &'r mut Report<'s>,
    text: String,
    /// Where files go, and how the scene file calls it.
    folder: PathBuf,
    folder_name: String,
    /// Names of images that are written: as they are, and as equal-area maps.
    images: HashMap<(ImageId, bool), String>,
    /// Names of meshes that are written, by the address of their data.
    meshes: HashMap<usize, String>,
    n_meshes: usize,
    /// The moments of motion, which pbrt has once for all.
    times: Option<[f32; 2]>,
}

impl Writer<'_, '_, '_> {
    fn all(&mut self) -> Result<(), WriteError> {
        self.times = self.first_times();
        self.options()?;
        self.line(0, "WorldBegin\n");
        self.media();
        self.textures()?;
        self.materials()?;
        self.objects()?;
        self.lights()?;
        self.shapes()?;
        self.instances()
    }

    fn line(&mut self, depth: usize, line: &str) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{:1$}{line}", "", 4 * depth);
    }

    /// Says that something is written otherwise than it is.
    fn otherwise(&mut self, span: Span, what: &str, instead: &str) {
        if self.report.first(&format!("{what} {span:?}")) {
            self.report.warning(span, format!("pbrt-v4 has no {what}")).hint(instead);
        }
    }

    /// The text of a name in quotes.
    fn quoted(name: &str) -> String {
        format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
    }

    fn first_times(&self) -> Option<[f32; 2]> {
        let s = self.scene;
        let shapes = s.shapes.iter().chain(s.objects.iter().flat_map(|o| &o.shapes));
        let moving = shapes
            .clone()
            .map(|s| &s.world_from_object)
            .chain(s.instances.iter().map(|i| &i.world_from_object));
        let of_transform = |t: &&AnimatedTransform| t.is_animated();
        let meshes = shapes.filter_map(|shape| match &shape.geometry {
            Geometry::Mesh(mesh) => mesh.is_moving().then_some(mesh.key_times),
            Geometry::BilinearMesh(_)
            | Geometry::LoopSubdiv(_)
            | Geometry::Curve(_)
            | Geometry::Sphere { .. }
            | Geometry::Disk { .. }
            | Geometry::Cylinder { .. } => None,
        });
        let moving = moving.chain([&s.camera.world_from_camera]).find(of_transform);
        moving.map(AnimatedTransform::times).or_else(|| meshes.into_iter().next())
    }

    /// All that moves does so at the same times.
    fn check_times(&mut self, own: [f32; 2], span: Span) {
        if self.times.is_some_and(|times| times != own) {
            self.otherwise(
                span,
                "motion at times of its own",
                "it moves at the times of the first thing that moves",
            );
        }
    }

    /// Sets the transformation matrix.
    fn transform(&mut self, depth: usize, t: &AnimatedTransform, span: Span) {
        if !t.is_animated() {
            if t.start() != Transform::IDENTITY {
                self.line(depth, &matrix(&t.start()));
            }
            return;
        }
        self.check_times(t.times(), span);
        self.line(depth, "ActiveTransform StartTime");
        self.line(depth, &matrix(&t.start()));
        self.line(depth, "ActiveTransform EndTime");
        self.line(depth, &matrix(&t.end()));
        self.line(depth, "ActiveTransform All");
    }

    /// Writes a file beside the scene; gives the name by which the scene calls it.
    fn file(&self, name: &str, bytes: &[u8]) -> Result<String, WriteError> {
        let io = |source| WriteError::Io { path: self.folder.clone(), source };
        std::fs::create_dir_all(&self.folder).map_err(io)?;
        image::write_atomically(&self.folder.join(name), bytes)?;
        Ok(format!("{}/{name}", self.folder_name))
    }
}

/// pbrt's `Transform`: column by column.
fn matrix(t: &Transform) -> String {
    let numbers: Vec<_> = t.matrix().to_cols_array().iter().map(f64::to_string).collect();
    format!("Transform [ {} ]", numbers.join(" "))
}
