//! A picture from a file, for comparisons.

use std::path::Path;

use image::ImageError;

/// Linear R, G, B; what has eight bits is decoded from sRGB.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height.
    pub size: [usize; 2],
    /// Row by row, the top row first.
    pub rgb: Vec<[f32; 3]>,
    /// Variance of each value, if the file has the layer that `steradian render` writes.
    pub variance: Option<Vec<[f32; 3]>>,
    /// May it hold more than a screen shows?
    pub is_float: bool,
}

/// A file that is no picture.
#[derive(Debug, thiserror::Error)]
#[error("{text}")]
pub struct PictureError {
    text: String,
}

impl Picture {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or has no colours.
    pub fn load(path: &Path) -> Result<Self, PictureError> {
        let refuse = |e: ImageError| {
            let (text, name) = (render::sentence(&e), path.display().to_string());
            PictureError { text: if text.contains(&name) { text } else { format!("{name}: {text}") } }
        };
        let whole = image::load_image(path).map_err(refuse)?;
        let variance = variance(&whole);
        let image = whole.to_rgb().map_err(refuse)?;
        let rgb = image.data().chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        Ok(Self { size: [image.width(), image.height()], rgb, variance, is_float: is_float(path) })
    }
}

/// Has a file of this name more than eight bits?
fn is_float(path: &Path) -> bool {
    use image::Format::{Bmp, Jpeg, Png, Tga};
    !matches!(image::Format::of_path(path), Some(Png | Jpeg | Tga | Bmp))
}

/// The layer that `steradian render` writes beside the picture.
fn variance(image: &image::Image) -> Option<Vec<[f32; 3]>> {
    let mut channels = [0; 3];
    for (at, name) in channels.iter_mut().zip(["variance.R", "variance.G", "variance.B"]) {
        *at = image.channel(name)?;
    }
    let n = image.channels().len();
    Some(image.data().chunks_exact(n).map(|p| channels.map(|c| p[c])).collect())
}
