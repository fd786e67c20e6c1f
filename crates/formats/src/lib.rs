//! Readers of scene files: pbrt-v4; meshes.
