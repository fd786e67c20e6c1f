//! Readers of scene files: from bytes on disk to a [`scene_desc::SceneDesc`], and a writer of pbrt-v4.
//!
//! | format  | where    | state                                   |
//! |---------|----------|-----------------------------------------|
//! | pbrt-v4 | `pbrt/`  | every directive; what renders: `scene`  |
//! | Mitsuba | `mitsuba/` | XML of 3.x and 0.x; see its head for plug-ins |
//! | glTF    | `gltf/`  | 2.0, text and binary; see its head for extensions |
//! | PLY     | `mesh/`  | ASCII, binary of both endians, gzip     |
//! | OBJ     | `mesh/`  | polygons; no materials                  |
//! | serialized | `mesh/` | Mitsuba's own, versions 3 and 4        |
//!
//! A reader never panics on input: it collects diagnostics with file, line and column in a
//! [`scene_desc::Sink`], as many as it can find in one go, and gives no scene if one of them is an error.

mod apertures;
mod equal_area;
mod gltf;
mod load;
mod mesh;
mod mitsuba;
mod packed;
mod pbrt;
mod report;
mod resources;
mod source;
mod suggest;
mod write;

pub use load::{load, load_with};
pub use packed::{HashCache, PackError, content_hash, pack, unpack};
pub use write::{WriteError, write_pbrt};
