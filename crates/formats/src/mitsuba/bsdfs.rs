//! BSDFs to materials.
//!
//! Opaque surfaces of Mitsuba are black from behind, unless a `twosided` says otherwise; ours are the same on both sides.
//! Adapters (`mask`, `bumpmap`, `normalmap`, `twosided`) change the look of what they hold rather than wrap it.

use scene_desc::{
    FloatInput, ImageEncoding, MaterialDesc, MaterialId, MaterialKind, SpectrumDesc, TextureDesc, TextureId,
    TextureInput, TextureKind, TextureNode,
};

use super::build::Build;
use super::tree::{Class, Node, NodeId};

/// Names of BSDFs, supported or not.
const NAMES: [&str; 26] = [
    "blendbsdf",
    "bumpmap",
    "circular",
    "coating",
    "conductor",
    "dielectric",
    "difftrans",
    "diffuse",
    "hair",
    "mask",
    "measured",
    "measured_polarized",
    "mixturebsdf",
    "normalmap",
    "null",
    "plastic",
    "polarizer",
    "pplastic",
    "principled",
    "principledthin",
    "retarder",
    "roughconductor",
    "roughdielectric",
    "roughplastic",
    "thindielectric",
    "twosided",
];

/// A material on its way.
pub(super) struct Look {
    pub(super) desc: MaterialDesc,
    /// Is it black from behind?
    pub(super) one_sided: bool,
}

impl Look {
    pub(super) fn of(kind: MaterialKind, node: &Node, one_sided: bool) -> Self {
        let name = node.id.clone().unwrap_or_default();
        Self { desc: MaterialDesc { name, ..MaterialDesc::new(kind, node.span) }, one_sided }
    }
}

impl<'t> Build<'t, '_, '_> {
    /// The material of a BSDF, made once.
    pub(super) fn material(&mut self, id: NodeId) -> MaterialId {
        if let Some(found) = self.materials.get(&id) {
            return *found;
        }
        let look = self.look(id);
        let material = self.add_look(look);
        self.materials.insert(id, material);
        material
    }

    /// What a shape without a BSDF gets: grey, or black where it emits.
    pub(super) fn no_material(&mut self, emits: bool) -> MaterialId {
        let make = |build: &mut Self, reflectance: f32| {
            let kind = MaterialKind::Diffuse { reflectance: SpectrumDesc::Constant(reflectance).into() };
            let desc = MaterialDesc::new(kind, scene_desc::Span::NONE);
            build.add_look(Look { desc, one_sided: reflectance > 0.0 })
        };
        if emits {
            return make(self, 0.0);
        }
        if let Some(found) = self.default_material {
            return found;
        }
        let made = make(self, 0.5);
        self.default_material = Some(made);
        made
    }

    fn add_material(&mut self, desc: MaterialDesc) -> MaterialId {
        self.scene.materials.push(desc);
        MaterialId(u32::try_from(self.scene.materials.len() - 1).unwrap_or(u32::MAX))
    }

    pub(super) fn add_look(&mut self, look: Look) -> MaterialId {
        let Look { mut desc, one_sided } = look;
        if !one_sided {
            return self.add_material(desc);
        }
        let (opacity, name, span) = (desc.opacity.take(), desc.name.clone(), desc.span);
        let front = self.add_material(desc);
        let kind = MaterialKind::TwoSided { front, back: None };
        self.add_material(MaterialDesc { name, opacity, ..MaterialDesc::new(kind, span) })
    }

    /// The look of a BSDF; grey for what is none.
    pub(super) fn look(&mut self, id: NodeId) -> Look {
        let node = self.tree.node(id);
        if self.building.contains(&id) {
            self.report
                .error(node.span, format!("{} refers to itself", node.title()))
                .hint("take a reference out");
            return Look::of(MaterialKind::default_diffuse(), node, true);
        }
        self.building.push(id);
        let look = self.look_of(node);
        self.building.pop();
        self.unused(node);
        look
    }

    fn look_of(&mut self, node: &'t Node) -> Look {
        match node.kind.as_str() {
            "twosided" => self.two_sided(node),
            "mask" => self.mask(node),
            "bumpmap" => self.bump_map(node),
            "normalmap" => self.normal_map(node),
            "blendbsdf" => self.blend(node),
            "mixturebsdf" => self.mixture(node),
            "null" => Look::of(MaterialKind::Interface, node, false),
            "polarizer" | "retarder" | "circular" => {
                self.unsupported(node, "light is not polarised here: it passes unchanged");
                Look::of(MaterialKind::Interface, node, false)
            }
            "coating" | "roughcoating" => {
                node.accept(&["int_ior", "ext_ior", "sigma_a", "thickness", "alpha", "distribution"]);
                let look = self.inner(node);
                self.unsupported(node, "what is under the coat is shown without it");
                look
            }
            _ => match self.surface(node) {
                Some(look) => look,
                None => {
                    self.unknown(node, &NAMES);
                    Look::of(MaterialKind::default_diffuse(), node, true)
                }
            },
        }
    }

    /// The BSDFs within one.
    fn nested(&mut self, node: &'t Node) -> Vec<NodeId> {
        let children: Vec<_> = node
            .props
            .iter()
            .filter_map(|p| {
                let id = self.object_of(p)?;
                (self.tree.node(id).class == Class::Bsdf).then(|| {
                    p.used.set(true);
                    id
                })
            })
            .collect();
        children
    }

    /// The only BSDF within one.
    fn inner(&mut self, node: &'t Node) -> Look {
        match self.nested(node).as_slice() {
            [id] => self.look(*id),
            other => {
                let message = format!("{} holds {} BSDFs", node.title(), other.len());
                self.report.error(node.span, message).hint("expected one");
                Look::of(MaterialKind::default_diffuse(), node, true)
            }
        }
    }

    fn two_sided(&mut self, node: &'t Node) -> Look {
        match *self.nested(node).as_slice() {
            [id] => {
                let Look { desc, .. } = self.look(id);
                let is_alike =
                    matches!(desc.kind, MaterialKind::Diffuse { .. } | MaterialKind::Conductor { .. });
                if is_alike {
                    return Look { desc, one_sided: false };
                }
                let (opacity, name) = (desc.opacity.clone(), desc.name.clone());
                let front = self.add_material(MaterialDesc { opacity: None, ..desc });
                let kind = MaterialKind::TwoSided { front, back: Some(front) };
                let mut look = Look::of(kind, node, false);
                (look.desc.opacity, look.desc.name) = (opacity, name);
                look
            }
            [front, back] => {
                let [front, back] = [front, back].map(|id| self.look(id).desc);
                let [front, back] = [self.add_material(front), self.add_material(back)];
                Look::of(MaterialKind::TwoSided { front, back: Some(back) }, node, false)
            }
            _ => {
                let message = "bsdf \"twosided\" holds one BSDF, or one for each side";
                self.report.error(node.span, message).hint("put one into it");
                Look::of(MaterialKind::default_diffuse(), node, false)
            }
        }
    }

    fn mask(&mut self, node: &'t Node) -> Look {
        let opacity = self.float_input(node, "opacity", 0.5);
        let mut look = self.inner(node);
        look.desc.opacity = Some(match (look.desc.opacity.take(), opacity) {
            (None, opacity) => opacity,
            (Some(FloatInput::Constant(a)), FloatInput::Constant(b)) => (a * b).into(),
            (Some(FloatInput::Texture(t)), scale) | (Some(scale), FloatInput::Texture(t)) => {
                self.product(t, scale, node)
            }
        });
        look
    }

    /// A texture times a number.
    pub(super) fn product(&mut self, tex: TextureId, scale: FloatInput, node: &Node) -> FloatInput {
        let made = TextureNode::Scale { tex: TextureInput::Texture(tex), scale };
        self.scene.textures.push(TextureDesc {
            name: String::new(),
            kind: TextureKind::Float,
            node: made,
            span: node.span,
        });
        FloatInput::Texture(TextureId(u32::try_from(self.scene.textures.len() - 1).unwrap_or(u32::MAX)))
    }

    /// The first texture within, whatever its name.
    fn nested_texture(&mut self, node: &'t Node) -> Option<NodeId> {
        node.props.iter().find_map(|p| {
            let id = self.object_of(p)?;
            (self.tree.node(id).class == Class::Texture).then(|| {
                p.used.set(true);
                id
            })
        })
    }

    fn bump_map(&mut self, node: &'t Node) -> Look {
        let scale = self.float(node, "scale", 1.0);
        let texture = self.nested_texture(node).and_then(|id| self.texture(id, TextureKind::Float));
        let mut look = self.inner(node);
        match texture {
            Some(t) if scale == 1.0 => look.desc.displacement = Some(FloatInput::Texture(t)),
            Some(t) => look.desc.displacement = Some(self.product(t, scale.into(), node)),
            None => {
                self.report.error(node.span, "bsdf \"bumpmap\" holds no texture").hint("put one into it");
            }
        }
        look
    }

    fn normal_map(&mut self, node: &'t Node) -> Look {
        let texture = self.nested_texture(node);
        let mut look = self.inner(node);
        let Some(id) = texture else {
            self.report.error(node.span, "bsdf \"normalmap\" holds no texture").hint("put one into it");
            return look;
        };
        let bitmap = self.tree.node(id);
        if bitmap.kind != "bitmap" {
            self.unsupported(bitmap, "normal maps are bitmaps: the surface is left even");
            return look;
        }
        bitmap.accept(&["raw", "filter_type", "wrap_mode"]);
        look.desc.normal_map = self.image(bitmap, ImageEncoding::Linear);
        self.unused(bitmap);
        look
    }

    fn blend(&mut self, node: &'t Node) -> Look {
        let amount = self.float_input(node, "weight", 0.5);
        self.mix(node, amount)
    }

    fn mixture(&mut self, node: &'t Node) -> Look {
        let weights = self.number_list(node, "weights").unwrap_or_default();
        match weights.as_slice() {
            [a, b] if *a >= 0.0 && *b >= 0.0 && a + b > 0.0 => {
                if (a + b - 1.0).abs() > 1e-3 {
                    self.report
                        .warning(node.span_of("weights"), format!("weights {a} and {b} do not make 1"))
                        .hint("they are scaled to");
                }
                self.mix(node, ((b / (a + b)) as f32).into())
            }
            _ => {
                self.unsupported(node, "mixtures have two weights: the first BSDF is shown alone");
                match self.nested(node).first() {
                    Some(id) => self.look(*id),
                    None => Look::of(MaterialKind::default_diffuse(), node, true),
                }
            }
        }
    }

    /// Two materials, the second by a weight.
    fn mix(&mut self, node: &'t Node, amount: FloatInput) -> Look {
        match *self.nested(node).as_slice() {
            [a, b] => {
                let materials = [a, b].map(|id| self.material(id));
                Look::of(MaterialKind::Mix { materials, amount }, node, false)
            }
            ref other => {
                let message = format!("{} holds {} BSDFs", node.title(), other.len());
                self.report.error(node.span, message).hint("expected two");
                Look::of(MaterialKind::default_diffuse(), node, true)
            }
        }
    }
}
