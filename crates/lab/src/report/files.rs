//! The files of a comparison: the report, the figures, and every picture with its variance.

use std::path::{Path, PathBuf};

use image::Image;
use render::Error;

use super::page;
use crate::comparison::{Comparison, Pictures};

/// Writes `report.html`, `comparison.json` and an EXR file for the reference and each method into a folder that is there; each file
/// whole or not at all. Gives their paths.
///
/// # Errors
/// A file cannot be written.
pub fn save(
    folder: &Path,
    title: &str,
    command: &str,
    comparison: &Comparison,
) -> Result<Vec<PathBuf>, Error> {
    let mut outputs = Vec::new();
    let report = folder.join("report.html");
    write(&report, page(comparison, title, command))?;
    let figures = folder.join("comparison.json");
    write(&figures, serde_json::to_string_pretty(comparison).map_err(|e| e.to_string()))?;
    outputs.extend([report, figures]);
    for pictures in std::iter::once(&comparison.truth).chain(&comparison.pictures) {
        let path = folder.join(format!("{}.exr", file_name(&pictures.label)));
        let picture = picture(pictures, comparison.size);
        let picture =
            picture.map_err(|e| Error::Output { path: path.clone(), reason: render::sentence(&e) })?;
        render::save_picture(&path, &picture, 0.0)?;
        outputs.push(path);
    }
    Ok(outputs)
}

fn write(path: &Path, text: Result<String, String>) -> Result<(), Error> {
    let failed = |reason| Error::Output { path: path.to_owned(), reason };
    let text = text.map_err(failed)?;
    image::write_atomically(path, text.as_bytes()).map_err(|e| failed(e.to_string()))
}

fn picture(pictures: &Pictures, [width, height]: [usize; 2]) -> Result<Image, image::ImageError> {
    let rgb = || ["R", "G", "B"].map(str::to_owned).to_vec();
    let of = |values: &[[f32; 3]]| Image::from_data(width, height, rgb(), values.as_flattened().to_vec());
    let mut picture = of(&pictures.rgb)?;
    picture.append("variance.", &of(&pictures.variance)?)?;
    Ok(picture)
}

/// A label as a file's name.
fn file_name(label: &str) -> String {
    label.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.=".contains(c) { c } else { '_' }).collect()
}
