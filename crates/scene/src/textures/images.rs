//! The image files of a scene, each decoded once, in parallel.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use image::{ChannelLayout, PixelData, f16};
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
    /// What each was made for.
    uses: Vec<ImageUse>,
}

/// Images of an earlier compile and their descriptions: those that are wanted again are not read again.
pub(crate) struct KeptImages {
    pub(crate) descs: Vec<ImageDesc>,
    pub(crate) images: Images,
}

impl KeptImages {
    /// The image with a number, if it is the same one and can be used as is wanted.
    fn get(&self, index: usize, desc: &ImageDesc, usage: ImageUse) -> Option<&TextureImage> {
        let same = self.descs.get(index)? == desc && *self.images.uses.get(index)? == usage;
        if same { self.images.list.get(index) } else { None }
    }
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
    pub(super) fn load(
        descs: &[ImageDesc],
        uses: &[ImageUse],
        kept: Option<&KeptImages>,
        sink: &mut Sink,
    ) -> Self {
        // Each file once, however many images it is; none of what is there already.
        let had = |i: usize| kept.and_then(|k| k.get(i, &descs[i], uses[i]));
        let wanted = |i: &usize| uses[*i] > ImageUse::None && had(*i).is_none();
        let used = || (0..descs.len()).filter(wanted).map(|i| (&descs[i], &uses[i]));
        let files: BTreeMap<&Path, Option<&[u8]>> =
            used().map(|(d, _)| (d.path.as_path(), d.embedded.as_deref())).collect();
        let files: Vec<(&Path, Option<&[u8]>)> = files.into_iter().collect();
        let decoded: Vec<Result<Decoded, String>> =
            files.par_iter().map(|(path, embedded)| decode(path, *embedded)).collect();
        let file = |desc: &ImageDesc| {
            let index = files.binary_search_by_key(&desc.path.as_path(), |f| f.0).ok()?;
            Some(&decoded[index])
        };

        // Report in the order of the description.
        for (desc, _) in used() {
            if let Some(Err(e)) = file(desc) {
                sink.error(desc.span, format!("cannot read image \"{}\": {e}", desc.path.display()));
            }
        }
        let curves = Curves::default();
        let make = |(_, desc, usage): (usize, &ImageDesc, ImageUse)| match file(desc) {
            Some(Ok(file)) if usage > ImageUse::None => {
                let mut image = file.image(desc, &curves);
                if usage == ImageUse::Pyramid {
                    image.build_pyramid();
                }
                image
            }
            Some(Ok(_) | Err(_)) | None => black(),
        };
        let jobs: Vec<_> = descs.iter().zip(uses).enumerate().map(|(i, (d, u))| (i, d, *u)).collect();
        let list = jobs.into_par_iter().map(|job| had(job.0).cloned().unwrap_or_else(|| make(job))).collect();
        Self { list, uses: uses.to_vec() }
    }
}

/// A file's samples as they are stored: top row first, channels interleaved. An alpha that is one everywhere is left
/// out, and so is that of grey images, as in pbrt-v4.
struct Decoded {
    size: [u32; 2],
    channels: usize,
    samples: Samples,
}

enum Samples {
    /// Codes of 8 bits.
    Bytes(Arc<[u8]>),
    /// Codes of 16 bits.
    Words(Vec<u16>),
    /// Linear values.
    Halves(Arc<[f16]>),
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
        let (own, channels) = match desc.channel {
            Some(channel) => (Some(self.channel(usize::from(channel))), 1),
            None => (None, self.channels),
        };
        let texels = match own.as_ref().unwrap_or(&self.samples) {
            Samples::Bytes(data) => Texels::Bytes { data: Arc::clone(data), curve: curves.get(transfer) },
            Samples::Words(words) => {
                let table: Vec<f32> =
                    (0..=u16::MAX).map(|w| transfer.decode(f32::from(w) / 65535.0)).collect();
                Texels::Floats(words.iter().map(|&w| table[usize::from(w)]).collect())
            }
            Samples::Halves(data) => Texels::Halves(Arc::clone(data)),
            Samples::Floats(data) => Texels::Floats(Arc::clone(data)),
        };
        TextureImage::new(self.size, channels, texels, color_space(desc.space))
    }
}

impl Decoded {
    /// One channel alone; in grey images all colours are the one that there is, and alpha is one.
    fn channel(&self, channel: usize) -> Samples {
        let alpha = channel == 3;
        let at = match self.channels {
            1 if !alpha => Some(0),
            n => Some(channel).filter(|c| *c < n),
        };
        match &self.samples {
            Samples::Bytes(v) => Samples::Bytes(one_channel(v, self.channels, at, u8::MAX).into()),
            Samples::Words(v) => Samples::Words(one_channel(v, self.channels, at, u16::MAX)),
            Samples::Halves(v) => Samples::Halves(one_channel(v, self.channels, at, f16::ONE).into()),
            Samples::Floats(v) => Samples::Floats(one_channel(v, self.channels, at, 1.0).into()),
        }
    }
}

/// Channel `at` of `n`; `one` everywhere if there is none.
fn one_channel<T: Copy>(data: &[T], n: usize, at: Option<usize>, one: T) -> Vec<T> {
    data.chunks_exact(n).map(|pixel| at.map_or(one, |at| pixel[at])).collect()
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

/// Reads a file. The cause's causes are part of the message.
fn decode(path: &Path, embedded: Option<&[u8]>) -> Result<Decoded, String> {
    let buffer = match embedded {
        Some(bytes) => image::decode(bytes, None),
        None => image::load(path),
    };
    let buffer = buffer.map_err(|e| chain(&e))?;
    let n = buffer.layout().count();
    let keep = match buffer.layout() {
        ChannelLayout::La => 1,
        ChannelLayout::Rgba if is_opaque(buffer.data()) => 3,
        ChannelLayout::L | ChannelLayout::Rgb | ChannelLayout::Rgba => n,
    };
    let samples = match buffer.data() {
        PixelData::U8(v) => Samples::Bytes(first_channels(v, n, keep).into()),
        PixelData::U16(v) => Samples::Words(first_channels(v, n, keep)),
        PixelData::F16(v) => Samples::Halves(first_channels(v, n, keep).into()),
        PixelData::F32(v) => Samples::Floats(first_channels(v, n, keep).into()),
    };
    let size = [buffer.width(), buffer.height()].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    Ok(Decoded { size, channels: keep, samples })
}

/// Is the last of four channels one everywhere?
fn is_opaque(data: &PixelData) -> bool {
    fn all<T: Copy + PartialEq>(data: &[T], one: T) -> bool {
        data.chunks_exact(4).all(|pixel| pixel[3] == one)
    }
    match data {
        PixelData::U8(v) => all(v, u8::MAX),
        PixelData::U16(v) => all(v, u16::MAX),
        PixelData::F16(v) => all(v, f16::ONE),
        PixelData::F32(v) => all(v, 1.0),
    }
}

/// The first `keep` of `n` channels.
fn first_channels<T: Copy>(data: &[T], n: usize, keep: usize) -> Vec<T> {
    if keep == n {
        return data.to_vec();
    }
    data.chunks_exact(n).flat_map(|pixel| &pixel[..keep]).copied().collect()
}

/// A message with all its causes.
fn chain(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |e| e.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_desc::{ColorSpaceName, Severity, Span};
    use std::path::PathBuf;

    fn desc(path: PathBuf, encoding: ImageEncoding) -> ImageDesc {
        ImageDesc {
            path,
            encoding,
            space: ColorSpaceName::Srgb,
            channel: None,
            embedded: None,
            span: Span { file: None, line: 7, column: 1 },
        }
    }

    /// Writes a PNG of these linear values.
    fn png(path: &Path, size: [usize; 2], channels: &[&str], data: Vec<f32>) {
        let names = channels.iter().map(|c| (*c).to_owned()).collect();
        let image = image::Image::from_data(size[0], size[1], names, data).unwrap();
        image::save(path, &image, &image::SaveOptions::default()).unwrap();
    }

    #[test]
    fn a_file_is_read_once_for_all_its_meanings() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        png(&path, [2, 1], &["R", "G", "B"], vec![0.0, 1.0, 0.215_860_5, 1.0, 0.0, 0.0]);
        let descs = [
            desc(path.clone(), ImageEncoding::Auto),
            desc(path.clone(), ImageEncoding::Linear),
            desc(path.clone(), ImageEncoding::Gamma(2.0)),
            desc(path, ImageEncoding::Srgb),
        ];
        let mut sink = Sink::default();
        let uses = [ImageUse::Base, ImageUse::Base, ImageUse::Pyramid, ImageUse::None];
        let images = Images::load(&descs, &uses, None, &mut sink);
        assert!(sink.diagnostics().is_empty(), "{sink:?}");

        // sRGB keeps 0.2159 as 128 of 255.
        let blue = |i: u32| images.get(ImageId(i)).texel_rgb(0, 0)[2];
        let code = 128.0_f32 / 255.0;
        assert!((blue(0) - 0.215_860_5).abs() < 1e-6, "{}", blue(0));
        assert!((blue(1) - code).abs() < 1e-6);
        assert!((blue(2) - code * code).abs() < 1e-6);
        assert_eq!((images.get(ImageId(3)).width(), images.get(ImageId(3)).height()), (1, 1));
        assert_eq!(images.get(ImageId(2)).n_levels(), 2);
        assert!(images.get(ImageId(0)).shares_texels_with(images.get(ImageId(1))));
    }

    #[test]
    fn a_missing_file_is_an_error_at_the_line_that_asked_for_it() {
        let mut sink = Sink::default();
        let descs = [desc("/nowhere/none.png".into(), ImageEncoding::Auto)];
        let images = Images::load(&descs, &[ImageUse::Base], None, &mut sink);
        let d = &sink.diagnostics()[0];
        assert_eq!((d.severity, d.span.line), (Severity::Error, 7));
        assert!(d.message.starts_with("cannot read image \"/nowhere/none.png\": "), "{}", d.message);
        assert_eq!(images.get(ImageId(0)).texel_rgb(0, 0), [0.0; 3]);
    }

    #[test]
    fn an_opaque_alpha_takes_no_memory() {
        let bytes = |v: &[u8]| PixelData::U8(v.to_vec());
        assert!(is_opaque(&bytes(&[1, 2, 3, 255, 4, 5, 6, 255])));
        assert!(!is_opaque(&bytes(&[1, 2, 3, 255, 4, 5, 6, 254])));
        assert_eq!(first_channels(&[1, 2, 3, 255, 4, 5, 6, 255], 4, 3), [1, 2, 3, 4, 5, 6]);
        assert_eq!(first_channels(&[1, 9, 2, 8], 2, 1), [1, 2]);
    }

    #[test]
    fn a_cut_out_keeps_its_alpha() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("leaf.exr");
        let names = ["R", "G", "B", "A"].map(str::to_owned).to_vec();
        let data = vec![0.5, 0.25, 1.0, 0.0, 0.5, 0.25, 1.0, 1.0];
        let image = image::Image::from_data(2, 1, names, data).unwrap();
        image::save(&path, &image, &image::SaveOptions::default()).unwrap();
        let mut sink = Sink::default();
        let images = Images::load(&[desc(path, ImageEncoding::Auto)], &[ImageUse::Base], None, &mut sink);
        assert!(sink.diagnostics().is_empty(), "{sink:?}");
        let leaf = images.get(ImageId(0));
        assert_eq!([leaf.texel_scalar(0, 0), leaf.texel_scalar(1, 0)], [0.0, 1.0]);
        assert_eq!(leaf.texel_rgb(0, 0), [0.5, 0.25, 1.0]);
    }

    #[test]
    fn floats_are_linear_whatever_is_asked_for() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.pfm");
        let image =
            image::Image::from_data(1, 1, ["R", "G", "B"].map(str::to_owned).to_vec(), vec![7.5, 0.25, 1e-3]);
        image::save(&path, &image.unwrap(), &image::SaveOptions::default()).unwrap();
        let mut sink = Sink::default();
        let images = Images::load(&[desc(path, ImageEncoding::Srgb)], &[ImageUse::Base], None, &mut sink);
        assert_eq!(images.get(ImageId(0)).texel_rgb(0, 0), [7.5, 0.25, 1e-3]);
    }
}
