//! A description and all its files in one piece, to be sent to another machine; and the hash of its content.
//!
//! Images travel decoded, so that no machine's decoder decides about a picture: a lossy one may differ from processor to
//! processor. The hash is of the files as they are, and travels too.
//!
//! The piece is for programs of the same version, not for keeping: [postcard](https://postcard.jamesmunns.com) data.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use scene_desc::{Geometry, SceneDesc};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use crate::source;

/// Why a scene was not packed or unpacked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PackError {
    /// One of its files cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The bytes are no packed scene.
    #[error("no packed scene of this version: {0}")]
    Format(#[from] postcard::Error),
}

/// What is sent.
#[derive(Serialize, Deserialize)]
struct Packed {
    desc: SceneDesc,
    /// In the order of [`SceneDesc::files_mut`].
    files: Vec<Vec<u8>>,
}

/// A hash of everything that a description says and of the files that it names, not of where they lie.
#[must_use]
pub fn content_hash(desc: &SceneDesc) -> u64 {
    HashCache::default().content_hash(desc)
}

/// Hashes of forms and files, so that an edit does not hash again what it left alone.
#[derive(Default)]
pub struct HashCache {
    /// By the address of the form, which is held so that no other can have it.
    forms: BTreeMap<usize, (Geometry, u64)>,
    files: BTreeMap<PathBuf, u64>,
}

impl HashCache {
    /// What [`content_hash`] says. Files that were hashed once count as they were then.
    #[must_use]
    pub fn content_hash(&mut self, desc: &SceneDesc) -> u64 {
        let mut desc = SceneDesc { content_hash: 0, ..desc.clone() };
        let mut hash = Hasher(Xxh3::new());
        for path in desc.files_mut() {
            // A file that cannot be read is told when the scene is compiled.
            let known = self.files.entry(path.clone());
            let of_file = *known.or_insert_with_key(|path| source::hash(path).unwrap_or_default());
            hash.0.update(&of_file.to_le_bytes());
            *path = path.extension().map(PathBuf::from).unwrap_or_default();
        }

        // Forms one by one; those of now are remembered, others forgotten.
        let before = std::mem::take(&mut self.forms);
        let objects = desc.objects.iter_mut().flat_map(|o| &mut o.shapes);
        for shape in desc.shapes.iter_mut().chain(objects) {
            let Some(address) = address(&shape.geometry) else { continue };
            let placeholder = Geometry::Disk { height: 0.0, radius: 0.0, inner_radius: 0.0, phi_max: 0.0 };
            let form = std::mem::replace(&mut shape.geometry, placeholder);
            let of_form = match before.get(&address) {
                Some((_, known)) => *known,
                None => hash_of(&form),
            };
            hash.0.update(&of_form.to_le_bytes());
            self.forms.insert(address, (form, of_form));
        }
        hash.0.update(&hash_of(&desc).to_le_bytes());
        hash.0.digest()
    }
}

/// Where a shared form lies; `None` for forms that are a few numbers.
fn address(geometry: &Geometry) -> Option<usize> {
    match geometry {
        Geometry::Mesh(a) => Some(Arc::as_ptr(a).addr()),
        Geometry::BilinearMesh(a) => Some(Arc::as_ptr(a).addr()),
        Geometry::LoopSubdiv(a) => Some(Arc::as_ptr(a).addr()),
        Geometry::Curve(a) => Some(Arc::as_ptr(a).addr()),
        Geometry::Sphere { .. } | Geometry::Disk { .. } | Geometry::Cylinder { .. } => None,
    }
}

fn hash_of(value: &impl Serialize) -> u64 {
    // Buffered, since numbers come one by one. Writing to a hash cannot fail.
    let writer = BufWriter::with_capacity(1 << 16, Hasher(Xxh3::new()));
    let written = postcard::to_io(value, writer).ok().and_then(|w| w.into_inner().ok());
    written.map_or(0, |hash| hash.0.digest())
}

/// The description with the bytes of all its files, images decoded; on the threads of the current rayon pool.
///
/// # Errors
/// A file cannot be read.
pub fn pack(desc: &SceneDesc) -> Result<Vec<u8>, PackError> {
    let mut desc = desc.clone();
    let embedded = desc.images.par_iter_mut().filter_map(|i| Some((i.path.clone(), i.embedded.as_mut()?)));
    embedded.for_each(|(path, bytes)| {
        if let Some(pixels) = decoded(bytes, &path) {
            *bytes = Arc::from(pixels);
        }
    });
    let read = |path: &mut PathBuf| {
        let bytes = std::fs::read(&*path).map_err(|source| PackError::File { path: path.clone(), source })?;
        Ok(decoded(&bytes, path).unwrap_or(bytes))
    };
    let files = desc.files_mut().into_par_iter().map(read).collect::<Result<_, PackError>>()?;
    Ok(postcard::to_allocvec(&Packed { desc, files })?)
}

/// An image's pixels in the form that is the same everywhere; `None` for what is no image, or a broken one: who compiles the scene
/// says so.
fn decoded(bytes: &[u8], path: &Path) -> Option<Vec<u8>> {
    image::encode_pixels(&image::decode(bytes, Some(path)).ok()?).ok()
}

/// Takes apart what [`pack`] made; its files go to `folder`, named by their content.
///
/// # Errors
/// The bytes are of another version, or a file cannot be written.
pub fn unpack(bytes: &[u8], folder: &Path) -> Result<SceneDesc, PackError> {
    let Packed { mut desc, files } = postcard::from_bytes(bytes)?;
    for (path, bytes) in desc.files_mut().into_iter().zip(files) {
        let mut name = PathBuf::from(format!("{:016x}", xxh3_64(&bytes)));
        if let Some(extension) = path.extension() {
            name.set_extension(extension);
        }
        let to = folder.join(name);
        if !to.exists() {
            std::fs::write(&to, &bytes).map_err(|source| PackError::File { path: to.clone(), source })?;
        }
        *path = to;
    }
    Ok(desc)
}

struct Hasher(Xxh3);

impl std::io::Write for Hasher {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_desc::{ColorSpaceName, ImageDesc, ImageEncoding, Span};

    fn desc(folder: &Path, bytes: &[u8]) -> SceneDesc {
        let path = folder.join("a.png");
        std::fs::write(&path, bytes).unwrap();
        let (encoding, space) = (ImageEncoding::Auto, ColorSpaceName::Srgb);
        SceneDesc {
            images: vec![ImageDesc {
                path,
                encoding,
                space,
                channel: None,
                embedded: None,
                span: Span::NONE,
            }],
            ..SceneDesc::default()
        }
    }

    #[test]
    fn a_scene_travels_with_its_files_and_keeps_its_hash() {
        let [here, there] = [0, 1].map(|_| tempfile::tempdir().unwrap());
        let desc = desc(here.path(), b"pixels");
        let packed = pack(&desc).unwrap();
        let unpacked = unpack(&packed, there.path()).unwrap();
        assert_eq!(std::fs::read(&unpacked.images[0].path).unwrap(), b"pixels");
        assert!(unpacked.images[0].path.starts_with(there.path()));
        assert_eq!(content_hash(&desc), content_hash(&unpacked));
        assert_eq!(desc.camera.world_from_camera, unpacked.camera.world_from_camera);
    }

    /// What a decoder makes of a file travels, not the file.
    #[test]
    fn images_travel_decoded_embedded_ones_too() {
        let [here, there] = [0, 1].map(|_| tempfile::tempdir().unwrap());
        let data = (0..12).map(|i| i as f32 / 12.0).collect();
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        let picture = image::Image::from_data(2, 2, names, data).unwrap();
        let png = image::encode(&picture, image::Format::Png, &image::SaveOptions::default()).unwrap();
        let mut desc = desc(here.path(), &png);
        let embedded =
            scene_desc::ImageDesc { embedded: Some(Arc::from(&png[..])), ..desc.images[0].clone() };
        desc.images.push(embedded);
        let unpacked = unpack(&pack(&desc).unwrap(), there.path()).unwrap();
        let file = std::fs::read(&unpacked.images[0].path).unwrap();
        let pixels = image::decode(&png, None).unwrap();
        for bytes in [&file[..], unpacked.images[1].embedded.as_deref().unwrap()] {
            assert_eq!(image::Format::of_content(bytes), Some(image::Format::Raw));
            assert_eq!(image::decode(bytes, None).unwrap(), pixels);
        }
        assert_eq!(unpacked.content_hash, desc.content_hash, "the hash is of the files as they are");
    }

    #[test]
    fn the_hash_sees_files_and_values() {
        let folder = tempfile::tempdir().unwrap();
        let a = content_hash(&desc(folder.path(), b"pixels"));
        let b = desc(folder.path(), b"others");
        assert_ne!(a, content_hash(&b));
        let c = SceneDesc {
            camera: scene_desc::CameraDesc { shutter_close: 0.5, ..b.camera.clone() },
            ..b.clone()
        };
        assert_ne!(content_hash(&b), content_hash(&c));
    }

    #[test]
    fn what_is_no_scene_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let good = pack(&SceneDesc::default()).unwrap();
        for n in 0..good.len() {
            assert!(unpack(&good[..n], folder.path()).is_err());
        }
        assert!(unpack(&[255; 64], folder.path()).is_err());
    }
}
