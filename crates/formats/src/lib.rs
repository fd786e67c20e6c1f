//! Readers of scene files: from bytes on disk to a [`scene_desc::SceneDesc`].
//!
//! | format  | where    | state                                   |
//! |---------|----------|-----------------------------------------|
//! | pbrt-v4 | `pbrt/`  | every directive; what renders: `scene`  |
//! | PLY     | `mesh/`  | ASCII, binary of both endians, gzip     |
//!
//! A reader never panics on input: it collects diagnostics with file, line and column in a
//! [`scene_desc::Sink`], as many as it can find in one go, and gives no scene if one of them is an error.

mod load;
mod mesh;
mod pbrt;
mod report;
mod source;
mod suggest;

pub use load::load;
