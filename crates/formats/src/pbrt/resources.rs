//! Files that a scene refers to: images (looked for and hashed, not decoded) and PLY meshes (read in parallel).

use std::collections::HashMap;
use std::path::PathBuf;

use rayon::prelude::*;
use scene_desc::{ColorSpaceName, ImageDesc, ImageEncoding, ImageId, ImageTile, Span};

use super::build::Build;
use super::params::Params;
use super::state::ShapeEntity;
use crate::mesh::ply::{self, Ply};
use crate::resources;

impl Build<'_, '_> {
    /// The path that a file name in the scene means.
    pub(super) fn resolve(&self, name: &str) -> PathBuf {
        self.base.join(name)
    }

    /// The image in a file; a file that is not there is an error at `span`.
    pub(super) fn image(&mut self, name: &str, span: Span, encoding: ImageEncoding) -> Option<ImageId> {
        let path = self.resolve(name);
        self.image_at(path, span, encoding)
    }

    /// The image in a file, or the images in the files of a set of tiles: the first of them, and all.
    pub(super) fn images_of(
        &mut self,
        name: &str,
        span: Span,
        encoding: ImageEncoding,
    ) -> Option<(ImageId, Vec<ImageTile>)> {
        let path = self.resolve(name);
        let files = resources::tiles(&path, span, self.report)?;
        if files.is_empty() {
            return Some((self.image_at(path, span, encoding)?, Vec::new()));
        }
        let tile = |(at, path)| Some(ImageTile { at, image: self.image_at(path, span, encoding)? });
        let tiles = files.into_iter().map(tile).collect::<Option<Vec<_>>>()?;
        Some((tiles.first()?.image, tiles))
    }

    fn image_at(&mut self, path: PathBuf, span: Span, encoding: ImageEncoding) -> Option<ImageId> {
        // pbrt asks for an encoding in PNG files alone: other 8-bit images are sRGB, the rest is linear.
        let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        let encoding = if is_png { encoding } else { ImageEncoding::Auto };
        let key = (path.clone(), encoding.into());
        if let Some(id) = self.images.get(&key) {
            return Some(*id);
        }
        if let Err(e) = resources::readable(&path) {
            if self.report.first(&format!("image {}", path.display())) {
                self.report
                    .error(span, format!("image {} cannot be read: {e}", path.display()))
                    .hint("paths are relative to the main scene file's folder");
            }
            return None;
        }
        let id = ImageId(u32::try_from(self.scene.images.len()).unwrap_or(u32::MAX));
        self.scene.images.push(ImageDesc {
            path,
            encoding,
            space: ColorSpaceName::Srgb,
            channel: None,
            embedded: None,
            span,
        });
        self.images.insert(key, id);
        Some(id)
    }

    /// The image that a string parameter names.
    pub(super) fn image_param(
        &mut self,
        p: &Params,
        name: &'static str,
        encoding: ImageEncoding,
    ) -> Option<ImageId> {
        let (file, span) = p.string_opt(name, self.report).filter(|(file, _)| !file.is_empty())?;
        self.image(&file, span, encoding)
    }

    /// Adds the hashes of all images to the scene's.
    pub(super) fn hash_images(&mut self) {
        let hashes = resources::hash_images(&self.scene.images, self.report);
        self.hashes.extend(hashes);
    }

    /// Reads every PLY file that shapes name, once and in parallel.
    pub(super) fn load_plys(&mut self, shapes: &[ShapeEntity]) -> HashMap<PathBuf, Option<Ply>> {
        let mut files: Vec<(PathBuf, Span)> = Vec::new();
        let mut seen = std::collections::HashSet::new();
        for shape in shapes.iter().filter(|s| s.entity.kind == "plymesh") {
            let Some((name, span)) = shape.entity.params.string_opt("filename", self.report) else {
                continue;
            };
            let path = self.resolve(&name);
            if seen.insert(path.clone()) {
                files.push((path, span));
            }
        }
        let loaded: Vec<_> =
            files.par_iter().map(|(path, _)| ply::load(path, ply::Extras::Skipped)).collect();
        let mut plys = HashMap::new();
        for ((path, span), ply) in files.into_iter().zip(loaded) {
            match ply {
                Ok(ply) => {
                    self.hashes.push(ply.hash);
                    for remark in &ply.remarks {
                        self.report
                            .warning(span, format!("{}: {}", path.display(), remark.what))
                            .hint(remark.instead);
                    }
                    plys.insert(path, Some(ply));
                }
                Err(e) => {
                    self.report.error(span, format!("{}: {}", path.display(), e.message)).hint(e.hint);
                    plys.insert(path, None);
                }
            }
        }
        plys
    }
}
