//! What a description is where a person says nothing: the defaults that Python shows and fills in.
//!
//! A kind that is not here has no defaults: all its values must be given. File formats have defaults of their own, in
//! `formats`.

use math::{AnimatedTransform, Transform, Vec3};
use serde::Serialize;

use crate::{
    AreaLightDesc, CameraDesc, CameraKind, ColorSpaceName, ConductorSpectrum, FilmDesc, FilterDesc,
    FloatInput, Geometry, Illuminant, ImageDesc, ImageEncoding, ImageFilter, ImageId, IndexOfRefraction,
    InstanceDesc, IntegratorDesc, LightKind, Mapping2d, MaterialId, MaterialKind, MediumInterface,
    MediumKind, ObjectId, Roughness, SamplerDesc, Span, SpectrumDesc, SpectrumInput, SphericalMapping,
    SpotFalloff, TextureInput, TextureNode, Throw, Tint, WrapMode,
};

/// A default value of every kind that has one. Fields are named as the types.
#[derive(Debug, Serialize)]
#[allow(non_snake_case, missing_docs, reason = "the names of the types, for whoever looks them up")]
pub struct Prototypes {
    pub CameraDesc: CameraDesc,
    pub CameraKind: Vec<CameraKind>,
    pub FilmDesc: FilmDesc,
    pub FilterDesc: Vec<FilterDesc>,
    pub SamplerDesc: SamplerDesc,
    pub IntegratorDesc: IntegratorDesc,
    pub MaterialKind: Vec<MaterialKind>,
    pub Roughness: Roughness,
    pub Tint: Tint,
    pub TextureNode: Vec<TextureNode>,
    pub Mapping2d: Vec<Mapping2d>,
    pub ImageDesc: ImageDesc,
    pub MediumKind: Vec<MediumKind>,
    pub MediumInterface: MediumInterface,
    pub Illuminant: Illuminant,
    pub LightKind: Vec<LightKind>,
    pub AreaLightDesc: AreaLightDesc,
    pub Geometry: Vec<Geometry>,
    pub InstanceDesc: InstanceDesc,
}

/// All of them.
#[must_use]
pub fn prototypes() -> Prototypes {
    let constant_camera = CameraDesc::default();
    Prototypes {
        CameraKind: cameras(&constant_camera.kind),
        CameraDesc: constant_camera,
        FilmDesc: FilmDesc::default(),
        FilterDesc: filters(),
        SamplerDesc: SamplerDesc::default(),
        IntegratorDesc: IntegratorDesc::default(),
        MaterialKind: materials(),
        Roughness: Roughness::smooth(),
        Tint: Tint::default(),
        TextureNode: textures(),
        Mapping2d: vec![Mapping2d::default()],
        ImageDesc: ImageDesc {
            path: "".into(),
            encoding: ImageEncoding::default(),
            space: ColorSpaceName::default(),
            channel: None,
            embedded: None,
            span: Span::NONE,
        },
        MediumKind: media(),
        MediumInterface: MediumInterface::default(),
        Illuminant: white(1.0),
        LightKind: lights(),
        AreaLightDesc: AreaLightDesc {
            radiance: white(1.0),
            image: None,
            two_sided: false,
            power: None,
            span: Span::NONE,
        },
        Geometry: shapes(),
        InstanceDesc: InstanceDesc {
            object: ObjectId(0),
            world_from_object: AnimatedTransform::fixed(Transform::IDENTITY),
            span: Span::NONE,
        },
    }
}

fn gray(value: f32) -> SpectrumInput {
    SpectrumDesc::Constant(value).into()
}

/// White light of this size, in the primaries' own white.
fn white(value: f32) -> Illuminant {
    Illuminant { spectrum: SpectrumDesc::srgb([value; 3]), scale: 1.0, normalize: true }
}

fn copper() -> ConductorSpectrum {
    let named = |name: &str| SpectrumInput::from(SpectrumDesc::Named(name.to_owned()));
    ConductorSpectrum::EtaK { eta: named("metal-Cu-eta"), k: named("metal-Cu-k") }
}

fn cameras(perspective: &CameraKind) -> Vec<CameraKind> {
    vec![
        perspective.clone(),
        CameraKind::Orthographic { lens_radius: 0.0, focal_distance: 1e6 },
        CameraKind::Spherical { mapping: SphericalMapping::default() },
    ]
}

fn filters() -> Vec<FilterDesc> {
    vec![
        FilterDesc::Box { radius: [0.5; 2] },
        FilterDesc::Triangle { radius: [2.0; 2] },
        FilterDesc::default(),
        FilterDesc::Mitchell { radius: [2.0; 2], b: 1.0 / 3.0, c: 1.0 / 3.0 },
        FilterDesc::Sinc { radius: [4.0; 2], tau: 3.0 },
    ]
}

fn materials() -> Vec<MaterialKind> {
    let glass = || IndexOfRefraction::Constant(1.5);
    let (smooth, tint, float) = (Roughness::smooth, Tint::default, |x: f32| FloatInput::from(x));
    vec![
        MaterialKind::default_diffuse(),
        MaterialKind::DiffuseTransmission { reflectance: gray(0.25), transmittance: gray(0.25), scale: 1.0 },
        MaterialKind::OrenNayar { reflectance: gray(0.5), sigma: float(20.0) },
        MaterialKind::Conductor { spectrum: copper(), roughness: smooth(), tint: tint() },
        MaterialKind::Dielectric { eta: glass(), roughness: smooth(), tint: tint() },
        MaterialKind::ThinDielectric { eta: glass(), tint: tint(), passes: false },
        MaterialKind::Plastic {
            reflectance: gray(0.5),
            eta: glass(),
            roughness: smooth(),
            tint: tint(),
            nonlinear: false,
        },
        MaterialKind::Principled(Box::default()),
        MaterialKind::MetallicRoughness(Box::default()),
        MaterialKind::CoatedDiffuse {
            reflectance: gray(0.5),
            roughness: smooth(),
            thickness: float(0.01),
            eta: glass(),
            g: float(0.0),
            albedo: gray(0.0),
            max_depth: 10,
            n_samples: 1,
        },
        MaterialKind::CoatedConductor {
            interface_roughness: smooth(),
            thickness: float(0.01),
            interface_eta: glass(),
            conductor: copper(),
            conductor_roughness: smooth(),
            g: float(0.0),
            albedo: gray(0.0),
            max_depth: 10,
            n_samples: 1,
        },
        MaterialKind::Mix { materials: [MaterialId(0), MaterialId(0)], amount: float(0.5) },
    ]
}

fn textures() -> Vec<TextureNode> {
    let (number, identity, mapping) = (TextureInput::Float, Transform::IDENTITY, Mapping2d::default);
    vec![
        TextureNode::Checkerboard {
            a: number(1.0),
            b: number(0.0),
            mapping: Some(mapping()),
            texture_from_world: identity,
        },
        TextureNode::Mix { a: number(0.0), b: number(1.0), amount: 0.5.into() },
        TextureNode::Product { a: number(1.0), b: number(1.0) },
        TextureNode::Step { tex: number(1.0), edge: 0.5 },
        TextureNode::Attribute { name: String::new(), scale: 1.0 },
        TextureNode::Dots { inside: number(1.0), outside: number(0.0), mapping: mapping() },
        TextureNode::Fbm { octaves: 8, roughness: 0.5, texture_from_world: identity },
        TextureNode::Wrinkled { octaves: 8, roughness: 0.5, texture_from_world: identity },
        TextureNode::Windy { texture_from_world: identity },
        TextureNode::Marble {
            octaves: 8,
            roughness: 0.5,
            scale: 1.0,
            variation: 0.2,
            texture_from_world: identity,
        },
        TextureNode::Triplanar {
            planes: [number(1.0), number(1.0), number(1.0)],
            sharpness: 4.0,
            texture_from_world: identity,
        },
        TextureNode::ImageMap {
            image: ImageId(0),
            tiles: Vec::new(),
            mapping: mapping(),
            wrap: [WrapMode::default(); 2],
            filter: ImageFilter::default(),
            max_anisotropy: 8.0,
            scale: 1.0,
            invert: false,
        },
    ]
}

fn media() -> Vec<MediumKind> {
    vec![MediumKind::Homogeneous {
        sigma_a: SpectrumDesc::Constant(1.0),
        sigma_s: SpectrumDesc::Constant(1.0),
        le: None,
        scale: 1.0,
        le_scale: 1.0,
    }]
}

fn lights() -> Vec<LightKind> {
    let (origin, ahead) = (Vec3::ZERO, Vec3::Z);
    vec![
        LightKind::Point { intensity: white(1.0), from: origin, power: None },
        LightKind::Spot {
            intensity: white(1.0),
            from: origin,
            to: ahead,
            cone_angle: 30.0,
            cone_delta: 5.0,
            falloff: SpotFalloff::default(),
            power: None,
        },
        LightKind::Distant { radiance: white(1.0), from: origin, to: ahead, illuminance: None },
        LightKind::InfiniteConstant { radiance: white(1.0), illuminance: None, portal: None },
        LightKind::InfiniteImage {
            image: ImageId(0),
            mapping: SphericalMapping::default(),
            scale: 1.0,
            illuminance: None,
            portal: None,
        },
        LightKind::Goniometric { intensity: white(1.0), image: None, power: None },
        LightKind::Ies { path: std::path::PathBuf::new(), intensity: white(1.0), power: None },
        LightKind::Projection {
            image: ImageId(0),
            fov: 90.0,
            throw: Throw::default(),
            scale: 1.0,
            power: None,
        },
    ]
}

fn shapes() -> Vec<Geometry> {
    vec![
        // Uncut: cuts are clamped to the radius.
        Geometry::Sphere { radius: 1.0, z_min: f32::MIN, z_max: f32::MAX, phi_max: 360.0 },
        Geometry::Disk { height: 0.0, radius: 1.0, inner_radius: 0.0, phi_max: 360.0 },
        Geometry::Cylinder { radius: 1.0, z_min: -1.0, z_max: 1.0, phi_max: 360.0 },
        Geometry::Mesh(std::sync::Arc::default()),
        Geometry::BilinearMesh(std::sync::Arc::default()),
        Geometry::LoopSubdiv(std::sync::Arc::default()),
        Geometry::Curve(std::sync::Arc::default()),
    ]
}
