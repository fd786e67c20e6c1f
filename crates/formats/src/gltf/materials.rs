//! Materials, textures and what surfaces emit.

use std::collections::BTreeMap;

use math::trig;
use scene_desc::{
    AreaLightDesc, FloatInput, Illuminant, ImageId, IndexOfRefraction, MaterialDesc, MaterialId,
    MaterialKind, MediumDesc, MediumId, MediumKind, MetallicRoughnessDesc, NormalLayout, PhaseDesc,
    SceneDesc, SpectrumDesc, SpectrumInput, TextureInput, TextureKind, TextureNode,
};

use super::container::Container;
use super::geometry::{ALPHA, COLOR};
use super::json_material::{Material, MaterialExtensions, TextureInfo};
use super::textures::set_of;
use crate::report::Report;

/// What a material becomes.
#[derive(Clone)]
pub(super) struct Look {
    pub(super) material: MaterialId,
    pub(super) area_light: Option<AreaLightDesc>,
    /// What is inside of the surface.
    pub(super) medium: Option<MediumId>,
    /// Which texture coordinates its textures use.
    pub(super) uv_set: usize,
}

/// Makes looks.
pub(super) struct Materials<'a, 'r, 's> {
    pub(super) file: &'a Container,
    pub(super) scene: &'a mut SceneDesc,
    pub(super) report: &'r mut Report<'s>,
    pub(super) hashes: Vec<u64>,
    pub(super) images: BTreeMap<(usize, bool, Option<u8>), Option<ImageId>>,
    /// Of the material in the making.
    pub(super) name: String,
    pub(super) uv_set: usize,
    /// Is it multiplied with colours of vertices?
    vertex_colors: bool,
}

impl<'a, 'r, 's> Materials<'a, 'r, 's> {
    pub(super) fn new(file: &'a Container, scene: &'a mut SceneDesc, report: &'r mut Report<'s>) -> Self {
        Self {
            file,
            scene,
            report,
            hashes: Vec::new(),
            images: BTreeMap::new(),
            name: String::new(),
            uv_set: 0,
            vertex_colors: false,
        }
    }

    /// All looks of the file, and after them the default one; and again with colours of vertices, where a mesh has them.
    pub(super) fn all(&mut self) -> (Vec<Look>, Vec<Option<Look>>) {
        let file = self.file;
        let default = Material::default();
        let n = file.root.materials.len();
        let mut is_colored = vec![false; n + 1];
        for primitive in file.root.meshes.iter().flat_map(|m| &m.primitives) {
            if primitive.attributes.color_0.is_some() {
                is_colored[primitive.material.filter(|m| *m < n).unwrap_or(n)] = true;
            }
        }
        let all = || file.root.materials.iter().chain([&default]);
        let plain = all().map(|m| self.look(m)).collect();
        self.vertex_colors = true;
        let colored = all().zip(is_colored).map(|(m, colored)| colored.then(|| self.look(m))).collect();
        (plain, colored)
    }

    fn look(&mut self, m: &Material) -> Look {
        self.name.clone_from(&m.name);
        let x = &m.extensions;
        let pbr = &m.pbr_metallic_roughness;
        let textures = [&pbr.base_color_texture, &pbr.metallic_roughness_texture, &m.emissive_texture];
        self.uv_set = textures.into_iter().flatten().next().or(m.normal_texture.as_ref()).map_or(0, set_of);
        for (unknown, name) in
            [(&x.iridescence, "KHR_materials_iridescence"), (&x.dispersion, "KHR_materials_dispersion")]
        {
            if unknown.is_some() {
                self.warn(format!("{name} is not rendered"));
            }
        }
        let medium = self.medium(x);
        let kind = match &x.unlit {
            Some(_) => MaterialKind::Diffuse { reflectance: SpectrumDesc::Constant(0.0).into() },
            None => MaterialKind::MetallicRoughness(Box::new(self.surface(m))),
        };
        let alpha = || m.alpha_mode == "MASK" || m.alpha_mode == "BLEND";
        let opacity = alpha().then(|| self.opacity(m));
        let normal_map = m.normal_texture.as_ref().and_then(|t| self.image(t, false, None));
        let normal_layout = m.normal_texture.as_ref().map_or_else(NormalLayout::default, |t| NormalLayout {
            mapping: self.mapping(t),
            wrap: self.wraps(t),
            strength: t.scale,
            follows_v: true,
        });
        let desc = MaterialDesc {
            name: m.name.clone(),
            normal_map,
            normal_layout,
            opacity: opacity.filter(|o| *o != FloatInput::Constant(1.0)),
            ..MaterialDesc::new(kind, self.file.span)
        };
        let material = MaterialId(self.scene.materials.len() as u32);
        self.scene.materials.push(desc);
        Look { material, area_light: self.emission(m), medium, uv_set: self.uv_set }
    }

    fn surface(&mut self, m: &Material) -> MetallicRoughnessDesc {
        let (pbr, x) = (&m.pbr_metallic_roughness, &m.extensions);
        let [r, g, b, _] = pbr.base_color_factor;
        let mut desc = MetallicRoughnessDesc {
            base_color: self.base_color(&pbr.base_color_texture, [r, g, b]),
            metallic: self.number(&pbr.metallic_roughness_texture, 2, pbr.metallic_factor),
            roughness: self.number(&pbr.metallic_roughness_texture, 1, pbr.roughness_factor),
            ..MetallicRoughnessDesc::default()
        };
        if let Some(ior) = x.ior.as_ref().and_then(|i| i.ior) {
            // 0 stands for perfect reflection: as near to it as an index can be.
            desc.eta = IndexOfRefraction::Constant(if ior >= 1.0 { ior } else { 1e3 });
        }
        if let Some(s) = &x.specular {
            desc.specular = self.number(&s.specular_texture, 3, s.specular_factor.unwrap_or(1.0));
            let factor = s.specular_color_factor.unwrap_or([1.0; 3]);
            desc.specular_color = self.color(&s.specular_color_texture, factor);
        }
        if let Some(a) = &x.anisotropy {
            desc.anisotropy = self.number(&a.anisotropy_texture, 2, a.anisotropy_strength);
            desc.anisotropy_rotation = a.anisotropy_rotation.into();
            if a.anisotropy_texture.is_some() {
                self.warn(
                    "the directions of its anisotropy texture are not used, its strength is".to_owned(),
                );
            }
        }
        if let Some(s) = &x.sheen {
            desc.sheen_color = self.color(&s.sheen_color_texture, s.sheen_color_factor);
            desc.sheen_roughness = self.number(&s.sheen_roughness_texture, 3, s.sheen_roughness_factor);
        }
        if let Some(c) = &x.clearcoat {
            desc.clearcoat = self.number(&c.clearcoat_texture, 0, c.clearcoat_factor);
            let roughness = c.clearcoat_roughness_factor;
            desc.clearcoat_roughness = self.number(&c.clearcoat_roughness_texture, 1, roughness);
            if c.clearcoat_normal_texture.is_some() {
                self.warn(
                    "its coat has the normals of its base: clearcoatNormalTexture is not used".to_owned(),
                );
            }
        }
        if let Some(t) = &x.transmission {
            desc.transmission = self.number(&t.transmission_texture, 0, t.transmission_factor);
        }
        if let Some(d) = &x.diffuse_transmission {
            let factor = d.diffuse_transmission_factor;
            desc.diffuse_transmission = self.number(&d.diffuse_transmission_texture, 3, factor);
            let color = d.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
            desc.diffuse_transmission_color = self.color(&d.diffuse_transmission_color_texture, color);
        }
        desc.thin_walled = x.volume.as_ref().is_none_or(|v| v.thickness_factor <= 0.0);
        desc
    }

    /// What absorbs light inside of a surface with `KHR_materials_volume`.
    fn medium(&mut self, x: &MaterialExtensions) -> Option<MediumId> {
        let volume = x.volume.as_ref().filter(|v| v.thickness_factor > 0.0)?;
        x.transmission.as_ref()?;
        let distance = volume.attenuation_distance.filter(|d| d.is_finite() && *d > 0.0)?;
        // What is left of white after the distance is the colour.
        let color = volume.attenuation_color.unwrap_or([1.0; 3]);
        let sigma_a = color.map(|c| -trig::ln(c.clamp(1e-6, 1.0)) / distance);
        let kind = MediumKind::Homogeneous {
            sigma_a: SpectrumDesc::srgb(sigma_a),
            sigma_s: SpectrumDesc::Constant(0.0),
            le: None,
            scale: 1.0,
            le_scale: 1.0,
        };
        let (name, span) = (self.name.clone(), self.file.span);
        let world_from_medium = math::Transform::IDENTITY;
        self.scene.media.push(MediumDesc {
            name,
            kind,
            phase: PhaseDesc::Isotropic,
            world_from_medium,
            span,
        });
        Some(MediumId(self.scene.media.len() as u32 - 1))
    }

    fn emission(&mut self, m: &Material) -> Option<AreaLightDesc> {
        let (factor, texture, strength) = match &m.extensions.unlit {
            Some(_) => {
                let pbr = &m.pbr_metallic_roughness;
                let [r, g, b, _] = pbr.base_color_factor;
                ([r, g, b], &pbr.base_color_texture, 1.0)
            }
            None => {
                let strength = m.extensions.strength.as_ref().and_then(|s| s.emissive_strength);
                (m.emissive_factor, &m.emissive_texture, strength.unwrap_or(1.0))
            }
        };
        let most = factor.iter().fold(0.0_f32, |a, &b| a.max(b));
        if most * strength <= 0.0 {
            return None;
        }
        let image = texture.as_ref().and_then(|t| self.plain_image(t, "emission", true));
        let (spectrum, scale) = match image {
            Some(_) => {
                if factor.iter().any(|&c| c != most) {
                    self.warn(
                        "the colour of its emission is that of its texture; the factor's is not used"
                            .to_owned(),
                    );
                }
                (SpectrumDesc::srgb([1.0; 3]), most * strength)
            }
            None => (SpectrumDesc::srgb(factor), strength),
        };
        Some(AreaLightDesc {
            radiance: Illuminant { spectrum, scale, normalize: false },
            image,
            two_sided: m.double_sided,
            power: None,
            span: self.file.span,
        })
    }

    pub(super) fn warn(&mut self, message: String) {
        let message = format!("material `{}`: {message}", self.name);
        if self.report.first(&message) {
            self.report.warning(self.file.span, message);
        }
    }

    /// A factor, times channel `channel` of a texture.
    fn number(&mut self, texture: &Option<TextureInfo>, channel: u8, factor: f32) -> FloatInput {
        let node = texture.as_ref().and_then(|t| self.image_node(t, false, Some(channel), factor));
        match node {
            Some(node) => FloatInput::Texture(self.texture(TextureKind::Float, node)),
            None => factor.into(),
        }
    }

    /// A colour, times that of a texture.
    fn color(&mut self, texture: &Option<TextureInfo>, factor: [f32; 3]) -> SpectrumInput {
        let even = factor[0] == factor[1] && factor[1] == factor[2];
        let scale = if even { factor[0] } else { 1.0 };
        let node = texture.as_ref().and_then(|t| self.image_node(t, true, None, scale));
        let Some(node) = node else { return SpectrumDesc::srgb(factor).into() };
        let image = self.texture(TextureKind::Spectrum, node);
        if even {
            return SpectrumInput::Texture(image);
        }
        let b = TextureInput::Spectrum(SpectrumDesc::srgb(factor));
        self.product(TextureInput::Texture(image), b)
    }

    fn product(&mut self, a: TextureInput, b: TextureInput) -> SpectrumInput {
        SpectrumInput::Texture(self.texture(TextureKind::Spectrum, TextureNode::Product { a, b }))
    }

    /// The base's colour, times that of vertices.
    fn base_color(&mut self, texture: &Option<TextureInfo>, factor: [f32; 3]) -> SpectrumInput {
        let color = self.color(texture, factor);
        if !self.vertex_colors {
            return color;
        }
        let node = TextureNode::Attribute { name: COLOR.to_owned(), scale: 1.0 };
        let own = TextureInput::Texture(self.texture(TextureKind::Spectrum, node));
        let color = match color {
            SpectrumInput::Constant(desc) => TextureInput::Spectrum(desc),
            SpectrumInput::Texture(id) => TextureInput::Texture(id),
        };
        self.product(own, color)
    }

    /// The chance that the surface is there: nothing or all of it for MASK.
    fn opacity(&mut self, m: &Material) -> FloatInput {
        let pbr = &m.pbr_metallic_roughness;
        let mut alpha = self.number(&pbr.base_color_texture, 3, pbr.base_color_factor[3]);
        if self.vertex_colors {
            let name = ALPHA.to_owned();
            let own = self.texture(TextureKind::Float, TextureNode::Attribute { name, scale: 1.0 });
            let node = TextureNode::Scale { tex: TextureInput::Texture(own), scale: alpha };
            alpha = FloatInput::Texture(self.texture(TextureKind::Float, node));
        }
        if m.alpha_mode != "MASK" {
            return alpha;
        }
        let edge = m.alpha_cutoff.unwrap_or(0.5);
        match alpha {
            FloatInput::Constant(a) => if a >= edge { 1.0 } else { 0.0 }.into(),
            FloatInput::Texture(id) => {
                let node = TextureNode::Step { tex: TextureInput::Texture(id), edge };
                FloatInput::Texture(self.texture(TextureKind::Float, node))
            }
        }
    }
}
