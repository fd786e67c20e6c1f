//! Image buffers, tone mapping and codecs.
//!
//! An [`Image`] is floats with named channels: what films develop into and what is compared. A [`PixelBuffer`] keeps the
//! file's own numbers, small, with the transfer function that makes light of them: what textures read.
//!
//! In: PNG, JPEG, TGA, BMP, Radiance HDR, OpenEXR, PFM, told apart by content. Out: OpenEXR, PNG, HDR, PFM.

mod atomic;
mod buffer;
mod codec;
mod error;
mod label;
mod pixels;
mod tonemap;

pub use atomic::write_atomically;
pub use buffer::{Image, MetaValue};
pub use codec::{
    Format, MAX_PIXELS, SaveOptions, decode, decode_image, encode, encode_pixels, load, load_image, save,
};
pub use error::ImageError;
pub use exr::prelude::f16;
pub use label::LETTER;
pub use pixels::{ChannelLayout, PixelBuffer, PixelData};
pub use spectrum::TransferFunction;
pub use tonemap::{Display, ToneMap};
