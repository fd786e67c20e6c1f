//! Images: copied as they are, or turned into pbrt's equal-area maps.

use scene_desc::{ImageEncoding, ImageId, ImageTile, Span, SphericalMapping};

use super::params::Params;
use super::{WriteError, Writer};
use crate::equal_area::equal_area;

impl Writer<'_, '_, '_> {
    /// Copies an image once; gives the name by which the scene calls it.
    pub(super) fn image(&mut self, id: ImageId) -> Result<String, WriteError> {
        if let Some(name) = self.images.get(&(id, false)) {
            return Ok(name.clone());
        }
        let image = &self.scene.images[id.index()];
        let bytes = match &image.embedded {
            Some(bytes) => bytes.to_vec(),
            None => std::fs::read(&image.path)
                .map_err(|source| WriteError::Io { path: image.path.clone(), source })?,
        };
        let own = image.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let name = self.file(&format!("{}-{own}", id.0), &bytes)?;
        self.images.insert((id, false), name.clone());
        Ok(name)
    }

    /// Copies a set of tiles; gives the name of all, with the mark that stands for their numbers.
    pub(super) fn tiles(&mut self, tiles: &[ImageTile], span: Span) -> Result<String, WriteError> {
        self.otherwise(
            span,
            "set of images side by side",
            "its name has <UDIM> in it, which we alone can read",
        );
        let mut pattern = String::new();
        for tile in tiles {
            let path = &self.scene.images[tile.image.index()].path;
            let bytes =
                std::fs::read(path).map_err(|source| WriteError::Io { path: path.clone(), source })?;
            let kind = path.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
            let first = tiles.first().map_or(0, |t| t.image.0);
            let number = 1001 + tile.at[0] + 10 * tile.at[1];
            let name = self.file(&format!("tiles-{first}.{number}.{kind}"), &bytes)?;
            pattern = name.replace(&format!(".{number}."), ".<UDIM>.");
        }
        Ok(pattern)
    }

    /// How the image's numbers are to be read: pbrt asks in PNG files alone.
    pub(super) fn encoding(&mut self, p: &mut Params, id: ImageId) {
        let image = &self.scene.images[id.index()];
        let encoding = match image.encoding {
            ImageEncoding::Auto => return,
            ImageEncoding::Srgb => "sRGB".to_owned(),
            ImageEncoding::Linear => "linear".to_owned(),
            ImageEncoding::Gamma(g) => format!("gamma {g}"),
        };
        if image.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            p.string("encoding", &encoding);
        } else if image.encoding != ImageEncoding::Srgb {
            let (span, what) = (image.span, format!("encoding \"{encoding}\" of images that are no PNG"));
            self.otherwise(span, &what, "its numbers are read as sRGB where they are bytes");
        }
    }

    /// A map of longitude and latitude as an equal-area one, made once.
    pub(super) fn equal_area(
        &mut self,
        id: ImageId,
        mapping: SphericalMapping,
        span: Span,
    ) -> Result<String, WriteError> {
        if let Some(name) = self.images.get(&(id, true)) {
            return Ok(name.clone());
        }
        let instead = "it is resampled to pbrt's equal-area map";
        self.otherwise(span, "light of a map of longitude and latitude", instead);
        let image = &self.scene.images[id.index()];
        let source = match &image.embedded {
            Some(bytes) => image::decode(bytes, Some(&image.path))?,
            None => image::load(&image.path)?,
        };
        let map = equal_area(&source, mapping)?;
        let bytes = image::encode(&map, image::Format::Exr, &image::SaveOptions::default())?;
        let name = self.file(&format!("{}-equal-area.exr", id.0), &bytes)?;
        self.images.insert((id, true), name.clone());
        Ok(name)
    }
}
