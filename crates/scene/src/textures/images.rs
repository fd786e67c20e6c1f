//! The image files of a scene, each decoded once, in parallel.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use scene_desc::{ImageDesc, ImageEncoding, ImageId, Sink};
use spectrum::{ColorSpace, TransferFunction};

use super::spectra::color_space;
use super::texture_image::{Texels, TextureImage};

/// What an image is needed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ImageUse {
    /// Nothing.
    None,
    /// Lookups at full resolution.
    Base,
    /// Filtered lookups.
    Pyramid,
}

/// All images of a scene by their ids in the description.
#[derive(Clone, Debug, Default)]
pub struct Images {
    list: Vec<TextureImage>,
}

impl Images {
    /// A decoded image. One that nothing uses, or that could not be read, is a single black texel.
    #[must_use]
    pub fn get(&self, id: ImageId) -> &TextureImage {
        &self.list[id.index()]
    }

    /// Bytes that all of them take. Images that share their texels count each for itself.
    #[must_use]
    pub fn memory(&self) -> usize {
        self.list.iter().map(TextureImage::memory).sum()
    }

    /// Reads what is used. Files that cannot be read are errors.
    pub(super) fn load(descs: &[ImageDesc], uses: &[ImageUse], sink: &mut Sink) -> Self {
        // Each file once, however many images it is.
        let used = || descs.iter().zip(uses).filter(|(_, u)| **u > ImageUse::None);
        let paths: BTreeMap<&Path, ()> = used().map(|(d, _)| (d.path.as_path(), ())).collect();
        let paths: Vec<&Path> = paths.into_keys().collect();
        let decoded: Vec<Result<Decoded, String>> = paths.par_iter().map(|p| decode(p)).collect();
        let file = |desc: &ImageDesc| {
            let index = paths.binary_search(&desc.path.as_path()).ok()?;
            Some(&decoded[index])
        };

        // Report in the order of the description.
        for (desc, _) in used() {
            if let Some(Err(e)) = file(desc) {
                sink.error(desc.span, format!("cannot read image \"{}\": {e}", desc.path.display()));
            }
        }
        let curves = Curves::default();
        let make = |(desc, &usage): (&ImageDesc, &ImageUse)| match file(desc) {
            Some(Ok(file)) if usage > ImageUse::None => {
                let mut image = file.image(desc, &curves);
                if usage == ImageUse::Pyramid {
                    image.build_pyramid();
                }
                image
            }
            Some(Ok(_) | Err(_)) | None => black(),
        };
        let jobs: Vec<_> = descs.iter().zip(uses).collect();
        Self { list: jobs.into_par_iter().map(make).collect() }
    }
}

/// A file's samples as they are stored: top row first, channels interleaved.
struct Decoded {
    size: [u32; 2],
    channels: usize,
    samples: Samples,
    /// What the file says of its primaries.
    space: Option<ColorSpace>,
}

enum Samples {
    /// Codes of 8 bits.
    Bytes(Arc<[u8]>),
    /// Codes of 16 bits.
    Words(Vec<u16>),
    /// Linear values.
    Floats(Arc<[f32]>),
}

impl Decoded {
    fn image(&self, desc: &ImageDesc, curves: &Curves) -> TextureImage {
        let transfer = match desc.encoding {
            ImageEncoding::Auto | ImageEncoding::Srgb => TransferFunction::Srgb,
            ImageEncoding::Linear => TransferFunction::Linear,
            ImageEncoding::Gamma(g) => TransferFunction::Gamma(g),
        };
        let texels = match &self.samples {
            Samples::Bytes(data) => Texels::Bytes { data: Arc::clone(data), curve: curves.get(transfer) },
            Samples::Words(words) => {
                let table: Vec<f32> =
                    (0..=u16::MAX).map(|w| transfer.decode(f32::from(w) / 65535.0)).collect();
                Texels::Floats(words.iter().map(|&w| table[usize::from(w)]).collect())
            }
            Samples::Floats(data) => Texels::Floats(Arc::clone(data)),
        };
        let space = self.space.unwrap_or(color_space(desc.space));
        TextureImage::new(self.size, self.channels, texels, space)
    }
}

/// The common curves of bytes, shared by all images.
struct Curves {
    srgb: Arc<[f32; 256]>,
    linear: Arc<[f32; 256]>,
}

impl Default for Curves {
    fn default() -> Self {
        Self { srgb: curve(TransferFunction::Srgb), linear: curve(TransferFunction::Linear) }
    }
}

impl Curves {
    fn get(&self, transfer: TransferFunction) -> Arc<[f32; 256]> {
        match transfer {
            TransferFunction::Srgb => Arc::clone(&self.srgb),
            TransferFunction::Linear => Arc::clone(&self.linear),
            TransferFunction::Gamma(_) => curve(transfer),
        }
    }
}

fn curve(transfer: TransferFunction) -> Arc<[f32; 256]> {
    Arc::new(std::array::from_fn(|i| transfer.decode_u8(i as u8)))
}

fn black() -> TextureImage {
    TextureImage::new([1, 1], 1, Texels::Floats(Arc::from([0.0])), ColorSpace::Srgb)
}

fn decode(path: &Path) -> Result<Decoded, String> {
    Err(format!("no decoder for {}", path.display()))
}
