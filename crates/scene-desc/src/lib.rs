//! A scene as plain data: what files, Python and the web make, and what the compiler turns into a scene.
//!
//! Every value that a user can leave out has its default here, every thing that a user wrote keeps the [`Span`]
//! where it was written, and nothing here opens a file or traces a ray. Conventions are pbrt-v4's: camera space
//! is left-handed (x right, y up, z forward), angles are in degrees, as in files.

mod camera;
mod diagnostic;
mod film;
mod integrator;
mod light;
mod material;
mod medium;
mod principled;
mod prototypes;
mod shape;
mod spectrum;
mod texture;
mod validate;

pub use camera::{ApertureDesc, CameraDesc, CameraKind, LensElement, LensStackDesc, SphericalMapping};
pub use diagnostic::{Diagnostic, FileId, Severity, Sink, SourceMap, Span};
pub use film::{FilmDesc, FilterDesc, SensorDesc};
pub use integrator::{IntegratorDesc, LightSelection, ParameterValue, SamplerDesc};
pub use light::{AreaLightDesc, FovAxis, Illuminant, LightDesc, LightKind, SpotFalloff, Throw};
pub use material::{
    ConductorSpectrum, Distribution, HairColor, IndexOfRefraction, Masking, MaterialDesc, MaterialKind,
    NormalLayout, Roughness, SubsurfaceMethod, SubsurfaceProfile, Tint,
};
pub use medium::{
    GridBorder, GridEmission, GridLayout, MediumDesc, MediumInterface, MediumKind, PhaseDesc, PhasePart,
};
pub use principled::{MetallicRoughnessDesc, PrincipledDesc, ThinSheet};
pub use prototypes::{Prototypes, prototypes};
pub use shape::{
    BilinearMesh, CurveDesc, CurveKind, DisplacementDesc, Geometry, InstanceDesc, LoopSubdiv, MeshAttribute,
    MeshDesc, ObjectDesc, ShapeDesc,
};
pub use spectrum::{ColorSpaceName, SpectrumDesc};
pub use texture::{
    FloatInput, ImageDesc, ImageEncoding, ImageFilter, ImageTile, Mapping2d, SpectrumInput, TextureDesc,
    TextureInput, TextureKind, TextureNode, WrapMode,
};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Index newtypes: no bare number names a thing.
macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
        pub struct $name(pub u32);
        impl $name {
            /// As an index into its vector.
            #[must_use]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

ids! {
    /// Index into [`SceneDesc::materials`].
    MaterialId,
    /// Index into [`SceneDesc::textures`].
    TextureId,
    /// Index into [`SceneDesc::images`].
    ImageId,
    /// Index into [`SceneDesc::media`].
    MediumId,
    /// Index into [`SceneDesc::objects`].
    ObjectId,
}

/// All of a scene.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct SceneDesc {
    /// The eye.
    pub camera: CameraDesc,
    /// What it falls on.
    pub film: FilmDesc,
    /// How samples become pixels.
    pub filter: FilterDesc,
    /// Where samples come from.
    pub sampler: SamplerDesc,
    /// The method that the file asks for.
    pub integrator: IntegratorDesc,
    /// Surfaces' looks, by [`MaterialId`].
    pub materials: Vec<MaterialDesc>,
    /// Values that vary over surfaces, by [`TextureId`]; a texture only refers to earlier ones.
    pub textures: Vec<TextureDesc>,
    /// Image files, each held once, by [`ImageId`].
    pub images: Vec<ImageDesc>,
    /// What fills space, by [`MediumId`].
    pub media: Vec<MediumDesc>,
    /// Lights that are not surfaces.
    pub lights: Vec<LightDesc>,
    /// Surfaces in world space.
    pub shapes: Vec<ShapeDesc>,
    /// Groups of shapes that instances repeat, by [`ObjectId`].
    pub objects: Vec<ObjectDesc>,
    /// Repetitions of objects in the world.
    pub instances: Vec<InstanceDesc>,
    /// The names of the files that spans refer to.
    #[serde(skip)]
    pub sources: SourceMap,
    /// A hash of every byte that was read to make this: the same scene, the same hash, on every machine.
    pub content_hash: u64,
}

impl SceneDesc {
    /// The paths of all files that are read when the scene is compiled.
    pub fn files_mut(&mut self) -> Vec<&mut std::path::PathBuf> {
        let images = self.images.iter_mut().filter(|i| i.embedded.is_none()).map(|i| &mut i.path);
        let measured = self.materials.iter_mut().filter_map(|m| {
            if let MaterialKind::Measured { path } = &mut m.kind { Some(path) } else { None }
        });
        let lamps = self
            .lights
            .iter_mut()
            .filter_map(|l| if let LightKind::Ies { path, .. } = &mut l.kind { Some(path) } else { None });
        let opening = match &mut self.camera.kind {
            CameraKind::Perspective { aperture, .. } => Some(aperture),
            CameraKind::Realistic(stack) => Some(&mut stack.aperture),
            CameraKind::Orthographic { .. } | CameraKind::Spherical { .. } => None,
        };
        let opening = opening.and_then(|a| if let ApertureDesc::Image(path) = a { Some(path) } else { None });
        images.chain(measured).chain(lamps).chain(opening).collect()
    }
}
