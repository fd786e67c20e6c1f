//! Surfaces with an artist's parameters.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{FloatInput, IndexOfRefraction, SpectrumDesc, SpectrumInput};

/// Disney's surface [Burley2012; Burley2015] as Mitsuba 3 has it in `principled` and `principledthin`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PrincipledDesc {
    /// Colour of diffuse reflection, of metal, and of what passes.
    pub base_color: SpectrumInput,
    /// 0: dielectric, 1: metal. Not for thin ones.
    pub metallic: FloatInput,
    /// In [0, 1]; the width of microfacets is its square.
    pub roughness: FloatInput,
    /// 0: isotropic; 1: ten times as wide across the tangent as along it.
    pub anisotropic: FloatInput,
    /// Index of the inside over the outside. (Mitsuba's `specular` s is the index `2 / (1 - √(0.08 s)) - 1`.)
    pub eta: IndexOfRefraction,
    /// How much specular reflection of dielectrics takes the base colour's hue.
    pub spec_tint: FloatInput,
    /// The part that is transparent rather than diffuse.
    pub spec_trans: FloatInput,
    /// A grazing lobe, of cloth.
    pub sheen: FloatInput,
    /// How much it takes the base colour's hue.
    pub sheen_tint: FloatInput,
    /// How much diffuse reflection is that of a flat subsurface.
    pub flatness: FloatInput,
    /// A second specular lobe above all. Not for thin ones.
    pub clearcoat: FloatInput,
    /// Its gloss: 0 is satin, 1 is gloss.
    pub clearcoat_gloss: FloatInput,
    /// Is it `F D G / (4 cos cos)`, a quarter strong, as Disney [Burley2012] and pbrt-v3 have it? Mitsuba leaves out `4 cos cos`.
    #[serde(default)]
    pub clearcoat_of_facets: bool,
    /// A sheet rather than the border of a solid: what is transmitted leaves at once.
    pub thin: Option<ThinSheet>,
}

/// What only a sheet has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThinSheet {
    /// The part of diffuse light that goes through, in [0, 2] as in Mitsuba: 1 is half to each side.
    pub diff_trans: FloatInput,
}

impl Default for PrincipledDesc {
    fn default() -> Self {
        Self {
            base_color: SpectrumDesc::Constant(0.5).into(),
            metallic: 0.0.into(),
            roughness: 0.5.into(),
            anisotropic: 0.0.into(),
            eta: IndexOfRefraction::Constant(1.5),
            spec_tint: 0.0.into(),
            spec_trans: 0.0.into(),
            sheen: 0.0.into(),
            sheen_tint: 0.0.into(),
            flatness: 0.0.into(),
            clearcoat: 0.0.into(),
            clearcoat_gloss: 0.0.into(),
            clearcoat_of_facets: false,
            thin: None,
        }
    }
}

/// glTF 2.0's surface with the parameters of `KHR_materials_ior`, `_specular`, `_anisotropy`, `_sheen`,
/// `_clearcoat`, `_transmission`, `_volume` and `_diffuse_transmission`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MetallicRoughnessDesc {
    /// Colour of diffuse reflection, of metal, and of what passes.
    pub base_color: SpectrumInput,
    /// 0: dielectric, 1: metal.
    pub metallic: FloatInput,
    /// In [0, 1]; the width of microfacets is its square.
    pub roughness: FloatInput,
    /// Index of the inside over the outside.
    pub eta: IndexOfRefraction,
    /// Factor on the dielectric's specular reflection.
    pub specular: FloatInput,
    /// Colour of the dielectric's specular reflection at normal incidence.
    pub specular_color: SpectrumInput,
    /// The width along the tangent goes from the square of the roughness to one, as the square of this.
    pub anisotropy: FloatInput,
    /// From the tangent to the direction of anisotropy, in radians, counter-clockwise.
    pub anisotropy_rotation: FloatInput,
    /// Colour of the cloth layer; black for none.
    pub sheen_color: SpectrumInput,
    /// Its roughness.
    pub sheen_roughness: FloatInput,
    /// Strength of the coat.
    pub clearcoat: FloatInput,
    /// Roughness of the coat.
    pub clearcoat_roughness: FloatInput,
    /// The part that is transparent rather than diffuse.
    pub transmission: FloatInput,
    /// The part of diffuse light that goes through.
    pub diffuse_transmission: FloatInput,
    /// Colour of the diffuse light that goes through.
    pub diffuse_transmission_color: SpectrumInput,
    /// A sheet, which light passes unbent (no `KHR_materials_volume`, or a thickness of zero), rather than the border
    /// of a solid, whose medium is its shape's.
    pub thin_walled: bool,
}

impl Default for MetallicRoughnessDesc {
    fn default() -> Self {
        let white = || SpectrumInput::from(SpectrumDesc::Constant(1.0));
        Self {
            base_color: white(),
            metallic: 1.0.into(),
            roughness: 1.0.into(),
            eta: IndexOfRefraction::Constant(1.5),
            specular: 1.0.into(),
            specular_color: white(),
            anisotropy: 0.0.into(),
            anisotropy_rotation: 0.0.into(),
            sheen_color: SpectrumDesc::Constant(0.0).into(),
            sheen_roughness: 0.0.into(),
            clearcoat: 0.0.into(),
            clearcoat_roughness: 0.0.into(),
            transmission: 0.0.into(),
            diffuse_transmission: 0.0.into(),
            diffuse_transmission_color: white(),
            thin_walled: true,
        }
    }
}
