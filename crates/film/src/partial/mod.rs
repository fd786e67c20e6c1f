//! Partial films as bytes and files: what `docs/partial-file.md` says.
//!
//! The container is safetensors: a JSON header and arrays that numpy reads without us. All numbers are the film's own
//! integers, so that writing and reading changes no bit. The header's one metadata entry, `steradian`, says what
//! the film is of; the array `sha256` seals that entry and all other arrays.
//!
//! Nothing that is read is trusted: sizes are compared with the number of bytes there are before anything is
//! allocated, and every film that comes back has passed the same checks as one made from settings.

mod arrays;

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use math::Bounds2i;
use safetensors::tensor::{Dtype, Metadata, SafeTensors, TensorInfo};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::bad::{BadSamples, Sign};
use crate::error::Error;
use crate::film::{Film, Merged, Progress};
use crate::filter::Filter;
use crate::passes::PassSet;
use crate::settings::{FilmSettings, RenderKey};

use arrays::Field;

const FORMAT: &str = "steradian partial film";
const VERSION: u32 = 1;
const HEAD: &str = "steradian";
/// SHA-256 of the metadata entry and of all other arrays, in their order.
const SEAL: &str = "sha256";
const SEAL_LEN: usize = 32;

/// The metadata entry.
#[derive(Serialize, Deserialize)]
struct Head {
    format: String,
    version: u32,
    resolution: [u32; 2],
    /// x0, y0, x1, y1.
    crop: [i32; 4],
    filter: Filter,
    sign: Sign,
    splats: bool,
    aovs: Vec<String>,
    #[serde(default)]
    splat_aovs: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    iterations: Vec<u32>,
    key: RenderKey,
    passes: String,
    bad_samples: BadSamples,
}

impl Film {
    /// The film as the bytes of a partial file: equal films give equal bytes.
    ///
    /// # Errors
    /// If a pass is open.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        let Header { text, mut bytes } = self.header()?;
        let fields = Field::of(self.settings()).into_iter().map(|f| (f, f.len(self.settings())));
        let mut at = bytes.len();
        bytes.resize(at + fields.clone().map(|(_, len)| len).sum::<usize>(), 0);
        let mut seal = Sha256::new_with_prefix(text);
        for (field, len) in fields {
            field.write(self, &mut bytes[at..at + len]);
            seal.update(&bytes[at..at + len]);
            at += len;
        }
        bytes.extend(seal.finalize());
        Ok(bytes)
    }

    /// The film of such bytes.
    ///
    /// # Errors
    /// If they are not a partial film of this version, or were changed.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let part = Part::read(bytes)?;
        let mut film = Self::new(part.settings.clone())?;
        film.add_part(&part)?;
        Ok(film)
    }

    /// [`Film::merge`] with the film of such bytes, which is not made for that.
    ///
    /// # Errors
    /// As of [`Film::from_bytes`] and [`Film::merge`].
    pub fn merge_bytes(&mut self, bytes: &[u8]) -> Result<Merged, Error> {
        self.add_part(&Part::read(bytes)?)
    }

    fn add_part(&mut self, part: &Part<'_>) -> Result<Merged, Error> {
        let merged = self.admit(&part.settings, &part.progress)?;
        if merged == Merged::Added {
            for (field, data) in &part.arrays {
                field.add(self, data);
            }
        }
        Ok(merged)
    }

    /// Writes a partial file. It appears under its name complete or not at all.
    ///
    /// # Errors
    /// If a pass is open, or the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let io = |source: std::io::Error| Error::Io { path: path.to_owned(), source };
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let Header { text, bytes } = self.header()?;
        let mut file = new_file(folder, &temporary_prefix(path)).map_err(io)?;
        file.write_all(&bytes).map_err(io)?;
        let mut seal = Sha256::new_with_prefix(text);
        for field in Field::of(self.settings()) {
            // One array at a time: a film is large.
            let mut bytes = vec![0; field.len(self.settings())];
            field.write(self, &mut bytes);
            seal.update(&bytes);
            file.write_all(&bytes).map_err(io)?;
        }
        file.write_all(&seal.finalize()).map_err(io)?;
        file.as_file().sync_all().map_err(io)?;
        file.persist(path).map_err(|e| io(e.error))?;
        Ok(())
    }

    /// Removes what a [`Film::save`] under this name left behind when its process was killed. Only for a name that no other process
    /// writes to.
    pub fn remove_leftovers(path: impl AsRef<Path>) {
        let path = path.as_ref();
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let prefix = temporary_prefix(path);
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        for entry in entries.flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if name.starts_with(&prefix) && name.ends_with(TEMPORARY) {
                // Litter that cannot be removed harms nobody.
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Reads a partial file.
    ///
    /// # Errors
    /// If it cannot be read, or is no partial film, or is damaged.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })?;
        Self::from_bytes(&bytes)
            .map_err(|source| Error::File { path: path.to_owned(), source: Box::new(source) })
    }

    /// What stands before the arrays.
    fn header(&self) -> Result<Header, Error> {
        let (s, progress) = (self.settings(), self.progress().clone());
        if let Some(&pass) = progress.open.first() {
            return Err(Error::OpenPass(pass));
        }
        let head = Head {
            format: FORMAT.into(),
            version: VERSION,
            resolution: s.resolution,
            crop: [s.crop.min[0], s.crop.min[1], s.crop.max[0], s.crop.max[1]],
            filter: s.filter,
            sign: s.sign,
            splats: s.splats,
            aovs: s.aovs.clone(),
            splat_aovs: s.splat_aovs.clone(),
            iterations: s.iterations.clone(),
            key: s.key.clone(),
            passes: progress.passes.to_string(),
            bad_samples: progress.bad,
        };
        let json = |e: serde_json::Error| Error::Format(e.to_string());
        let text = serde_json::to_string(&head).map_err(json)?;

        // safetensors demands arrays without gaps, larger types first; the seal has the smallest.
        let fields = Field::of(s).into_iter().map(|f| (f.name(), f.dtype(), f.shape(s), f.len(s)));
        let mut end = 0;
        let arrays =
            fields.chain([(SEAL, Dtype::U8, vec![SEAL_LEN], SEAL_LEN)]).map(|(name, dtype, shape, len)| {
                let data_offsets = (end, end + len);
                end += len;
                (name.to_owned(), TensorInfo { dtype, shape, data_offsets })
            });
        // One entry alone, for a map has no order.
        let entry = HashMap::from([(HEAD.into(), text.clone())]);
        let metadata =
            Metadata::new(Some(entry), arrays.collect()).map_err(|e| Error::Format(e.to_string()))?;
        let mut header = serde_json::to_vec(&metadata).map_err(json)?;
        header.resize(header.len().next_multiple_of(8), b' ');
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.append(&mut header);
        Ok(Header { text, bytes })
    }
}

/// What stands before the arrays of a file.
struct Header {
    /// The metadata entry.
    text: String,
    bytes: Vec<u8>,
}

/// What the bytes of a partial film hold, checked.
struct Part<'a> {
    settings: FilmSettings,
    progress: Progress,
    arrays: Vec<(Field, &'a [u8])>,
}

impl<'a> Part<'a> {
    fn read(bytes: &'a [u8]) -> Result<Self, Error> {
        check_offsets(bytes)?;
        let format = |e: safetensors::SafeTensorError| Error::Format(e.to_string());
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(format)?;
        let arrays = SafeTensors::deserialize(bytes).map_err(format)?;
        let head_text = metadata.metadata().as_ref().and_then(|m| m.get(HEAD));
        let head_text = head_text.ok_or_else(|| Error::Format(format!("it has no entry `{HEAD}`")))?;
        let head = parse_head(head_text)?;

        // The arrays must be those of the settings, each of the right size, before a film of that size is made.
        let [x0, y0, x1, y1] = head.crop;
        let settings = FilmSettings {
            resolution: head.resolution,
            crop: Bounds2i::new([x0, y0], [x1, y1]),
            filter: head.filter,
            sign: head.sign,
            splats: head.splats,
            aovs: head.aovs,
            splat_aovs: head.splat_aovs,
            iterations: head.iterations,
            key: head.key,
        };
        settings.check()?;
        let fields = Field::of(&settings);
        if arrays.len() != fields.len() + 1 {
            return Err(Error::Format(format!(
                "it has {} arrays instead of {}",
                arrays.len(),
                fields.len() + 1
            )));
        }
        for field in &fields {
            let a = arrays.tensor(field.name()).map_err(format)?;
            if a.dtype() != field.dtype() || a.shape() != field.shape(&settings) {
                return Err(Error::Format(format!("array `{}` has the wrong type or shape", field.name())));
            }
        }
        let seal = arrays.tensor(SEAL).map_err(format)?;
        let data = |f: Field| (f, arrays.tensor(f.name()).map_or(&[][..], |a| a.data()));
        let arrays: Vec<_> = fields.into_iter().map(data).collect();
        let mut digest = Sha256::new_with_prefix(head_text);
        arrays.iter().for_each(|(_, data)| digest.update(data));
        if seal.data() != digest.finalize().as_slice() {
            return Err(Error::Checksum);
        }

        let passes = head.passes.parse::<PassSet>().map_err(Error::Format)?;
        let progress = Progress { passes, bad: head.bad_samples, ..Progress::default() };
        Ok(Self { settings, progress, arrays })
    }
}

/// How the names of temporary files end.
const TEMPORARY: &str = ".tmp";

/// How the names of temporary files of a file begin.
fn temporary_prefix(path: &Path) -> String {
    format!(".{}.steradian-", path.file_name().map(|n| n.to_string_lossy()).unwrap_or_default())
}

/// A temporary file that, once renamed, has the rights of any other new file.
fn new_file(folder: &Path, prefix: &str) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix).suffix(TEMPORARY);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

fn parse_head(text: &str) -> Result<Head, Error> {
    // Version first: the rest of another version may look different.
    #[derive(Deserialize)]
    struct Version {
        format: String,
        version: u32,
    }
    let json = |e: serde_json::Error| Error::Format(format!("entry `{HEAD}`: {e}"));
    let v: Version = serde_json::from_str(text).map_err(json)?;
    if v.format != FORMAT || v.version != VERSION {
        return Err(Error::Format(format!(
            "it is `{}` version {}, and this program reads `{FORMAT}` version {VERSION}",
            v.format, v.version
        )));
    }
    serde_json::from_str(text).map_err(json)
}

/// No array may end behind the last byte: offsets near 2⁶⁴ would overflow in the reader.
fn check_offsets(bytes: &[u8]) -> Result<(), Error> {
    let truncated = || Error::Format("it is truncated, or no safetensors file at all".into());
    let (length, rest) = bytes.split_first_chunk::<8>().ok_or_else(truncated)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| truncated())?;
    let header = rest.get(..length).ok_or_else(truncated)?;
    let header: HashMap<String, serde_json::Value> =
        serde_json::from_slice(header).map_err(|e| Error::Format(format!("its header: {e}")))?;
    let ends = header.values().filter_map(|v| v.get("data_offsets")?.get(1)?.as_u64());
    if ends.max().unwrap_or(0) > bytes.len() as u64 {
        return Err(truncated());
    }
    Ok(())
}
