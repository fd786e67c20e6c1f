//! From a film to pictures on disk.
//!
//! OpenEXR files get linear R, G, B in 32 bits, the variance of each as the layer `variance`, the further channels by their
//! names, and notes on how to make the same picture again. The other formats get R, G, B alone.

use std::fs;
use std::path::{Path, PathBuf};

use film::{Developed, FilmLabel};
use image::{Display, Format, Image, MetaValue, SaveOptions};
use rayon::prelude::*;

use crate::{Error, Workers};

/// The version that made a film: part of what makes two renders the same.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A developed film as an image, with all that OpenEXR can keep.
///
/// # Errors
/// Never, unless the film's arrays do not fit its size.
pub fn picture(film: &FilmLabel, developed: &Developed) -> Result<Image, image::ImageError> {
    let settings = &film.settings;
    let bounds = developed.bounds;
    let (w, h) = (bounds.width(), bounds.height());
    let rgb = || ["R", "G", "B"].map(str::to_owned).to_vec();
    let mut picture = Image::from_data(w, h, rgb(), developed.mean.as_flattened().to_vec())?;
    if developed.n_passes >= 2 {
        let variance = Image::from_data(w, h, rgb(), developed.variance.as_flattened().to_vec())?;
        picture.append("variance.", &variance)?;
    }
    if !developed.aovs.is_empty() {
        let names = settings.aovs.iter().chain(&settings.splat_aovs).cloned().collect();
        picture.append("", &Image::from_data(w, h, names, developed.aovs.clone())?)?;
    }
    picture.origin = bounds.min;
    picture.full_size = settings.resolution.map(|n| n as usize);

    let key = &settings.key;
    let notes = [
        ("software", format!("Steradian {VERSION}")),
        ("steradian.version", VERSION.to_owned()),
        ("steradian.scene", key.scene.clone()),
        ("steradian.integrator", key.integrator.clone()),
        ("steradian.settings", key.settings.clone()),
        ("steradian.seed", key.seed.to_string()),
        ("steradian.passes", film.passes.to_string()),
        ("steradian.dropped_samples", film.bad_samples.count().to_string()),
    ];
    picture.metadata.extend(notes.map(|(k, v)| (k.to_owned(), MetaValue::Text(v))));
    if let Some(note) = note_on_variance(&key.integrator, developed) {
        picture.metadata.insert("steradian.variance".to_owned(), MetaValue::Text(note));
    }
    Ok(picture)
}

/// What the variance of a biased integrator does not tell.
fn note_on_variance(integrator: &str, developed: &Developed) -> Option<String> {
    if let [_, _, ..] = developed.weights[..] {
        let weights: Vec<String> = developed.weights.iter().map(|w| format!("{w:.4}")).collect();
        let weights = weights.join(", ");
        return Some(format!(
            "of noise alone, as if the weights were fixed; the picture is biased: it combines iterations by the inverse of their \
             variance, as their own samples show it (weights {weights})"
        ));
    }
    let info = integrators::find(integrator).ok().filter(|info| !info.unbiased)?;
    Some(format!("of noise between passes alone, not of the bias of {integrator}: it misses {}", info.misses))
}

/// Writes a picture in the format of its ending, whole or not at all. `exposure` in stops is for formats of eight bits.
///
/// # Errors
/// The ending is unknown, or the file cannot be written.
pub fn save_picture(path: &Path, picture: &Image, exposure: f32) -> Result<(), Error> {
    let display = Display { exposure, ..Display::default() };
    image::save(path, picture, &SaveOptions { display }).map_err(|e| Error::Output {
        path: path.to_owned(),
        reason: std::error::Error::source(&e).map_or_else(|| e.to_string(), ToString::to_string),
    })
}

/// [`save_picture`] under several names, at the same time on the threads of `workers`.
#[must_use]
pub fn save_pictures(
    paths: &[PathBuf],
    picture: &Image,
    exposure: f32,
    workers: &Workers,
) -> Vec<Result<(), Error>> {
    workers.install(|| paths.par_iter().map(|path| save_picture(path, picture, exposure)).collect())
}

/// Can a picture have this name?
#[must_use]
pub fn is_picture(path: &Path) -> bool {
    match Format::of_path(path) {
        Some(Format::Exr | Format::Png | Format::Hdr | Format::Pfm) => true,
        Some(Format::Jpeg | Format::Tga | Format::Bmp | Format::Raw) | None => false,
    }
}

/// Finds out before the work whether a file can be written afterwards: tries to make one beside it.
///
/// # Errors
/// Why not.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let refuse = |reason: String| Err(Error::Output { path: path.to_owned(), reason });
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.file_name().is_none() || path.is_dir() {
        return refuse("it is a folder".to_owned());
    }
    if !folder.is_dir() {
        return refuse(format!("there is no folder {}", folder.display()));
    }
    let probe = folder.join(format!(".steradian-{}.probe", std::process::id()));
    match fs::OpenOptions::new().write(true).create_new(true).open(&probe) {
        Ok(_) => fs::remove_file(&probe).or_else(|e| refuse(e.to_string())),
        Err(e) => refuse(format!("the folder {} does not take files: {e}", folder.display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn developed(weights: Vec<f64>) -> Developed {
        let bounds = math::Bounds2i::new([0, 0], [1, 1]);
        let (mean, variance) = (vec![[0.0; 3]], vec![[0.0; 3]]);
        Developed { bounds, n_passes: 2, weights, mean, variance, aovs: Vec::new() }
    }

    #[test]
    fn the_variance_of_a_biased_integrator_has_a_note() {
        let note = note_on_variance("irradiance-cache", &developed(vec![1.0])).unwrap();
        assert!(note.contains("bias") && note.contains("interpolation error"), "{note}");
        assert_eq!(note_on_variance("path", &developed(vec![1.0])), None);
        assert_eq!(note_on_variance("no such", &developed(vec![1.0])), None);
        let note = note_on_variance("guided", &developed(vec![0.25, 0.75])).unwrap();
        assert!(note.contains("biased") && note.contains("0.2500, 0.7500"), "{note}");
    }
}
