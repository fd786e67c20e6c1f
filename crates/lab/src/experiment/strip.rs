//! The pictures of an experiment side by side, each with its label: what the lecture shows.

use image::{Image, ImageError, LETTER};

use crate::comparison::Comparison;

const GAP: usize = 6;
const SCALE: usize = 2;
/// Most pictures in a row.
const COLUMNS: usize = 4;
/// What labels are written in, and what is behind the pictures; linear.
const INK: f32 = 0.7;
const PAPER: f32 = 0.02;

/// Every method's first picture, then the reference.
///
/// # Errors
/// Never, unless pictures are of other sizes than the comparison says.
pub fn strip(comparison: &Comparison) -> Result<Image, ImageError> {
    let [width, height] = comparison.size;
    let pictures: Vec<_> = comparison.pictures.iter().chain([&comparison.truth]).collect();
    let columns = pictures.len().min(COLUMNS);
    let rows = pictures.len().div_ceil(columns);
    let line = LETTER[1] * SCALE + GAP;
    let cell = [width + GAP, height + line + GAP];
    let mut sheet = Image::new(columns * cell[0] + GAP, rows * cell[1] + GAP, &["R", "G", "B"]);
    sheet.data_mut().fill(PAPER);
    for (i, picture) in pictures.iter().enumerate() {
        let (x, y) = (GAP + i % columns * cell[0], GAP + i / columns * cell[1]);
        let most = width / (LETTER[0] * SCALE);
        let label: String = picture.label.chars().take(most).collect();
        sheet.label([x, y], SCALE, &label, INK);
        for (k, rgb) in picture.rgb.iter().enumerate().take(width * height) {
            sheet.pixel_mut(x + k % width, y + line + k / width).copy_from_slice(rgb);
        }
    }
    Ok(sheet)
}
