//! From a file to its JSON and its buffers: `.gltf` with files or data URIs beside it, `.glb` in one piece.

use std::path::{Path, PathBuf};

use scene_desc::Span;

use super::json::Root;
use crate::report::Report;
use crate::source;

/// A file with all its bytes.
pub(super) struct Container {
    pub(super) root: Root,
    pub(super) buffers: Vec<Vec<u8>>,
    pub(super) hashes: Vec<u64>,
    pub(super) span: Span,
    pub(super) path: PathBuf,
}

impl Container {
    /// Reads a file; what is wrong is reported, and `None` if nothing can be made of it.
    pub(super) fn read(path: &Path, report: &mut Report<'_>) -> Option<Self> {
        let span = Span::file(report.add_source(path));
        let file = match source::read(path) {
            Ok(file) => file,
            Err(e) => {
                report.error(span, format!("{} cannot be read: {e}", path.display())).hint(e.hint());
                return None;
            }
        };
        let (json, binary) = match file.bytes.starts_with(b"glTF") {
            true => match chunks(&file.bytes) {
                Ok(chunks) => chunks,
                Err(e) => {
                    report.error(span, e).hint("the file is truncated or damaged");
                    return None;
                }
            },
            false => (file.bytes.as_slice(), None),
        };
        let root: Root = match serde_json::from_slice(json) {
            Ok(root) => root,
            Err(e) => {
                let place = Span { line: e.line() as u32, column: e.column() as u32, ..span };
                let place = if file.bytes.starts_with(b"glTF") { span } else { place };
                report.error(place, format!("not glTF 2.0: {e}"));
                return None;
            }
        };
        if !root.asset.version.starts_with("2.") {
            report
                .error(span, format!("glTF version `{}`: only 2.0 can be read", root.asset.version))
                .hint("asset.version says it; export the scene again as glTF 2.0");
            return None;
        }
        let mut it = Self { root, buffers: Vec::new(), hashes: vec![file.hash], span, path: path.to_owned() };
        it.read_buffers(binary, report);
        Some(it)
    }

    fn read_buffers(&mut self, binary: Option<&[u8]>, report: &mut Report<'_>) {
        for (i, buffer) in self.root.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                None => binary.map(<[u8]>::to_vec).ok_or_else(|| "the file has no binary part".to_owned()),
                Some(uri) => bytes_of(&self.path, uri, &mut self.hashes),
            };
            let bytes = match bytes {
                Ok(bytes) if bytes.len() < buffer.byte_length => {
                    let (has, says) = (bytes.len(), buffer.byte_length);
                    report.error(self.span, format!("buffer {i} has {has} bytes, not {says}"));
                    bytes
                }
                Ok(bytes) => bytes,
                Err(e) => {
                    report.error(self.span, format!("buffer {i} cannot be read: {e}"));
                    Vec::new()
                }
            };
            self.buffers.push(bytes);
        }
    }

    /// Bytes of a view.
    pub(super) fn view(&self, view: usize) -> Result<&[u8], String> {
        let v = self.root.buffer_views.get(view).ok_or_else(|| format!("there is no buffer view {view}"))?;
        let buffer = self.buffers.get(v.buffer).ok_or_else(|| format!("there is no buffer {}", v.buffer))?;
        let end = v.byte_offset.checked_add(v.byte_length);
        let bytes = end.and_then(|end| buffer.get(v.byte_offset..end));
        bytes.ok_or_else(|| format!("buffer view {view} reaches past the end of its buffer"))
    }
}

/// What a URI stands for: data in it, or a file beside the scene.
pub(super) fn bytes_of(scene: &Path, uri: &str, hashes: &mut Vec<u64>) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, data) = data.split_once("base64,").ok_or("a data URI that is not base64")?;
        return base64(data).ok_or_else(|| "damaged base64 data".to_owned());
    }
    let file = source::read(&beside(scene, uri)).map_err(|e| format!("{uri}: {e}"))?;
    hashes.push(file.hash);
    Ok(file.bytes)
}

/// The file of a URI, whose `%20` and the like are unpacked.
pub(super) fn beside(scene: &Path, uri: &str) -> PathBuf {
    let (mut name, mut rest) = (Vec::new(), uri.as_bytes());
    while let Some((&c, after)) = rest.split_first() {
        let hex = |i: usize| after.get(i).and_then(|&c| char::from(c).to_digit(16));
        if let (b'%', Some(high), Some(low)) = (c, hex(0), hex(1)) {
            name.push((16 * high + low) as u8);
            rest = &after[2..];
        } else {
            name.push(c);
            rest = after;
        }
    }
    let name = String::from_utf8_lossy(&name).into_owned();
    scene.parent().unwrap_or(Path::new("")).join(name)
}

/// JSON and binary part of a `.glb`.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| -> Option<u32> {
        Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
    };
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(format!("binary glTF version {version}: only 2 can be read")),
        None => return Err("binary glTF that ends in its head".to_owned()),
    }
    let (mut at, mut json, mut binary) = (12_usize, None, None);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let end = (at + 8).checked_add(length as usize).ok_or("a chunk without end")?;
        let data = bytes
            .get(at + 8..end)
            .ok_or_else(|| format!("binary glTF of {} bytes whose chunk ends at {end}", bytes.len()))?;
        match kind {
            0x4e4f_534a => json = json.or(Some(data)),
            0x004e_4942 => binary = binary.or(Some(data)),
            _ => {}
        }
        at = end;
    }
    json.map(|j| (j, binary)).ok_or_else(|| "binary glTF without JSON".to_owned())
}

/// Bytes of base64 text; white space and padding are passed over.
fn base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut n) = (0_u32, 0);
    for c in text.bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b' ' | b'\n' | b'\r' | b'\t' => continue,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        n += 6;
        if n >= 8 {
            n -= 8;
            bytes.push((bits >> n) as u8);
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_all_lengths() {
        for (text, bytes) in [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg", "foob")] {
            assert_eq!(base64(text).as_deref(), Some(bytes.as_bytes()));
        }
        assert_eq!(base64("Zm9*"), None);
    }

    #[test]
    fn names_of_files_are_unpacked() {
        assert_eq!(beside(Path::new("/a/b.gltf"), "my%20file%2.bin"), Path::new("/a/my file%2.bin"));
    }
}
