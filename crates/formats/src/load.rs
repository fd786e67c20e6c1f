//! Which reader a file goes to: by its extension, else by how it begins.

use std::path::Path;

use scene_desc::{SceneDesc, Sink, Span};

use crate::{gltf, mitsuba, pbrt};

/// What a file seems to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Pbrt,
    Mitsuba,
    Gltf,
    Unknown,
}

/// Reads a scene file and all that it refers to. `None` if there was an error; then `sink` says which.
/// The files that the diagnostics' spans name are in [`Sink::sources`].
pub fn load(path: &Path, sink: &mut Sink) -> Option<SceneDesc> {
    load_with(path, &[], sink)
}

/// [`load`], with values for the file's `$parameters` by name. One that the file does not have is an error.
pub fn load_with(path: &Path, defines: &[(String, String)], sink: &mut Sink) -> Option<SceneDesc> {
    let format = format_of(path);
    if let (Some((name, _)), Format::Pbrt | Format::Gltf) = (defines.first(), format) {
        sink.error(Span::NONE, format!("the scene has no parameter `{name}`"))
            .hint("-D sets a $parameter of a Mitsuba file; this one has none");
        return None;
    }
    match format {
        Format::Pbrt => pbrt::load(path, sink),
        Format::Mitsuba => mitsuba::load(path, defines, sink),
        Format::Gltf => gltf::load(path, sink),
        Format::Unknown => {
            let span = Span::file(sink.add_source(path));
            let message = match std::fs::metadata(path) {
                Ok(_) => "not a scene file that is known".to_owned(),
                Err(e) => format!("cannot be read: {e}"),
            };
            sink.error(span, message).hint("scenes end in .pbrt, .pbrt.gz, .xml (Mitsuba), .gltf or .glb");
            None
        }
    }
}

fn format_of(path: &Path) -> Format {
    let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
    let ends = |ends: &[&str]| ends.iter().any(|e| name.ends_with(e));
    if ends(&[".pbrt", ".pbrt.gz"]) {
        Format::Pbrt
    } else if ends(&[".xml"]) {
        Format::Mitsuba
    } else if ends(&[".gltf", ".glb"]) {
        Format::Gltf
    } else {
        by_content(path)
    }
}

fn by_content(path: &Path) -> Format {
    let mut head = Vec::new();
    let is_file = std::fs::metadata(path).is_ok_and(|m| m.is_file());
    if let (true, Ok(file)) = (is_file, std::fs::File::open(path)) {
        use std::io::Read;
        // What cannot be read stays empty, which is no format.
        let _ = file.take(1 << 16).read_to_end(&mut head);
    }
    let text = String::from_utf8_lossy(&head);
    let text = text.trim_start();
    if text.starts_with("glTF") || (text.starts_with('{') && text.contains("\"asset\"")) {
        Format::Gltf
    } else if text.starts_with('<') {
        Format::Mitsuba
    } else if text.contains("WorldBegin") {
        Format::Pbrt
    } else {
        Format::Unknown
    }
}
