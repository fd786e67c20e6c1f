//! Values that vary over surfaces: textures compiled to flat arrays, and the images that they and lights look up.
//!
//! A [`TextureCompiler`] turns the inputs of materials and shapes into handles ([`FloatHandle`],
//! [`SpectrumHandle`]), which hold the value itself where it does not vary; [`Textures`] evaluates them.

mod attributes;
mod compile;
mod images;
mod mapping;
mod node;
mod noise;
mod pattern;
mod pyramid;
mod space;
mod spectra;
mod texture_image;

pub use compile::TextureCompiler;
pub use images::Images;
pub(crate) use images::KeptImages;
pub(crate) use mapping::Mapping;
pub use node::{FloatHandle, SpectrumHandle, Textures};
pub(crate) use noise::noise;
pub use spectra::{SpectrumRole, color_space, spectral_curve, spectrum_value};
pub use texture_image::TextureImage;

use crate::{Footprint, Place, SurfaceInteraction, TextureContext};

impl TextureContext {
    /// Of a surface point. The normal is the geometric one, as in pbrt-v4.
    #[must_use]
    pub fn at(si: &SurfaceInteraction, footprint: Footprint) -> Self {
        let place = Place { shape: si.shape.0, primitive: si.primitive, at: si.at };
        Self { p: si.p, n: si.ng, uv: si.uv, footprint, place }
    }
}
