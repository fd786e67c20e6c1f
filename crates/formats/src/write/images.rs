//! Images: copied as they are, or turned into pbrt's equal-area maps.

use math::{Vec3, trig};
use scene_desc::{ImageEncoding, ImageId, ImageTile, Span, SphericalMapping};

use super::params::Params;
use super::{WriteError, Writer};

/// Largest side of an equal-area map.
const LARGEST_MAP: usize = 4096;
/// Samples of the old map for each pixel of the new one, along both axes.
const SAMPLES: usize = 3;

impl Writer<'_, '_, '_> {
    /// Copies an image once; gives the name by which the scene calls it.
    pub(super) fn image(&mut self, id: ImageId) -> Result<String, WriteError> {
        if let Some(name) = self.images.get(&(id, false)) {
            return Ok(name.clone());
        }
        let image = &self.scene.images[id.index()];
        let bytes = std::fs::read(&image.path)
            .map_err(|source| WriteError::Io { path: image.path.clone(), source })?;
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
        let source = image::load(&self.scene.images[id.index()].path)?;
        let (width, height) = (source.width(), source.height());
        let side = ((width * height) as f64).sqrt().ceil() as usize;
        let side = side.clamp(1, LARGEST_MAP);
        let mut data = Vec::with_capacity(side * side * 3);
        for i in 0..side * side {
            let mut sum = [0.0_f32; 3];
            for k in 0..SAMPLES * SAMPLES {
                let at =
                    |pixel: usize, k: usize| (pixel as f32 + (k as f32 + 0.5) / SAMPLES as f32) / side as f32;
                let uv = [at(i % side, k % SAMPLES), at(i / side, k / SAMPLES)];
                let value = around(&source, sampling::warp::equal_area_sphere(uv).0, mapping);
                (0..3).for_each(|c| sum[c] += value[c]);
            }
            data.extend(sum.map(|s| s / (SAMPLES * SAMPLES) as f32));
        }
        let map = image::Image::from_data(side, side, ["R", "G", "B"].map(String::from).to_vec(), data)?;
        let bytes = image::encode(&map, image::Format::Exr, &image::SaveOptions::default())?;
        let name = self.file(&format!("{}-equal-area.exr", id.0), &bytes)?;
        self.images.insert((id, true), name.clone());
        Ok(name)
    }
}

/// The value in a direction of a map of longitude (from x towards y) and latitude (from z), between pixels.
fn around(map: &image::PixelBuffer, w: Vec3, mapping: SphericalMapping) -> [f32; 3] {
    use std::f32::consts::{PI, TAU};
    let (width, height) = (map.width(), map.height());
    let phi = trig::atan2(w.y, w.x);
    let phi = if phi < 0.0 { phi + TAU } else { phi };
    let x = phi / TAU * width as f32 - 0.5;
    let v = trig::safe_acos(w.z) / PI;
    let y = match mapping {
        SphericalMapping::EquiRectangularPoles => v * (height - 1) as f32,
        SphericalMapping::EquiRectangular | SphericalMapping::EqualArea => v * height as f32 - 0.5,
    };
    let (i, j) = (x.floor(), y.floor());
    let column = |k: i64| k.rem_euclid(width as i64) as usize;
    let row = |k: i64| k.clamp(0, height as i64 - 1) as usize;
    let mut sum = [0.0; 3];
    for (dx, wx) in [(0, 1.0 - (x - i)), (1, x - i)] {
        for (dy, wy) in [(0, 1.0 - (y - j)), (1, y - j)] {
            let pixel = map.rgb(column(i as i64 + dx), row(j as i64 + dy));
            (0..3).for_each(|c| sum[c] += pixel[c] * wx * wy);
        }
    }
    sum
}
