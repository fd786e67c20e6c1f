//! The compiled scene: shapes, textures, materials, lights, cameras, ready for integrators.
