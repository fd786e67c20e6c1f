//! Values that vary over surfaces.

mod mapping;
mod noise;
mod pattern;
mod pyramid;
mod texture_image;

pub use texture_image::TextureImage;
