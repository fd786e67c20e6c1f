//! The compiled scene: immutable flat arrays addressed by ids, ready for integrators.
//!
//! Everything that needs a position, a texture or the ray kernel is here; formulas of directions alone are in
//! `scatter`, loops over bounces in `integrators`.

mod cameras;
mod compile;
mod crossing;
mod emergence;
mod ids;
mod interaction;
mod light_select;
mod lights;
mod linear_map;
mod materials;
mod media;
mod scene;
mod shapes;
mod specular;
mod surroundings;
mod textures;
pub mod wide;

pub use cameras::{Camera, CameraConnection, CameraRay, LensHit};
pub use compile::{CompileOptions, Kept, compile, consume, recompile};
pub use ids::{LightId, MaterialId, MediumId, ShapeId, TextureId};
pub use interaction::{Footprint, LightContext, Place, SurfaceInteraction, TextureContext};
pub use light_select::LightSelector;
pub use lights::{
    EmissionSample, EmitterGeometry, EmitterSource, LightImage, LightPlace, LightSample, Lights,
    LightsBuilder,
};
pub use materials::{Materials, Shading};
pub use media::{Collision, Flight, Media, lane_weights};
pub use scene::{Scene, SceneCounts, SceneSettings, segment};
pub use shapes::{Curvature, Shape};
pub use specular::SpecularSurfaces;
pub use surroundings::{BodyId, Surroundings};
pub use textures::{
    FloatHandle, Images, SpectrumHandle, SpectrumRole, TextureCompiler, TextureImage, Textures, color_space,
    spectral_curve, spectrum_value,
};
