//! Surfaces' looks: which BSDF stands at a point, and in which frame.
//!
//! | step                                  | source                                      |
//! |---------------------------------------|---------------------------------------------|
//! | textures to parameters                | pbrt-v4's materials ([PBR4e], ch. 10)       |
//! | bump mapping                          | [Blinn1978], with pbrt-v4's differences     |
//! | normal mapping                        | tangent space, [PBR4e], sec. 10.5           |
//! | mixtures                              | one of the two, by a hash of the point      |
//!
//! Departs from pbrt-v4: widths of microfacets up to and including 10⁻³ count as smooth (pbrt: below it), since
//! exporters write exactly 0.001 for mirrors; a mixture hashes the point and the materials but not the direction,
//! so that every path that comes to a point finds the same surface there.
//! Subsurface scattering is a dielectric border with a medium inside, which the compiler gives to the shapes.

mod artist;
mod bump;
mod compile;
mod half_space;
mod look;
mod matt;
mod measured;
mod metal;
mod parameters;
mod subsurface;

use math::{Frame, LocalDir, hash, trig};
use scatter::microfacet::Facets;
use scatter::{Bsdf, CoatProfiles, Conductor, DiffusionProfile, ThinDielectric};
use spectrum::{Spectrum, Wavelengths};

use self::look::Look;
pub(crate) use self::matt::Matt;
use self::matt::matt_ones;
use self::parameters::Lookup;
use self::subsurface::Diffuser;
pub(crate) use self::subsurface::Interior;
use crate::textures::{FloatHandle, Textures};
use crate::{Footprint, MaterialId, SurfaceInteraction, TextureContext};

/// All materials of a scene, by [`MaterialId`].
#[derive(Clone, Debug)]
pub struct Materials {
    /// Those of the scene, then a black one.
    list: Vec<Material>,
    profiles: Vec<CoatProfiles>,
    interiors: Vec<Option<Interior>>,
    has_diffusion: bool,
    /// Of each of the list.
    matt: Vec<Matt>,
}

/// Where rays pass a surface as if it were not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Gaps {
    /// It is a surface all over.
    Nowhere,
    /// It bounds a body, which others may displace: a walk knows (see [`crate::Surroundings`]).
    WhereDisplaced,
    /// It takes a look at the point.
    Somewhere,
    /// It is but a border of media.
    Everywhere,
}

/// How much of a point of a surface its material looks at, beyond its place and its normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Detail {
    /// Nothing: any frame about the normal will do.
    Frame,
    /// Tangents, and how (u, v) change: directions and footprints of textures.
    Tangents,
    /// How the normal changes too.
    Curvature,
}

/// A surface point, ready for transport.
#[derive(Clone, Debug)]
pub struct Shading {
    /// How it scatters, in `frame`.
    pub bsdf: Bsdf,
    /// The shading frame, bent by bump and normal maps; its normal is on the side of the geometric one.
    pub frame: Frame,
}

#[derive(Clone, Debug)]
struct Material {
    surface: Surface,
    relief: Relief,
    /// The BSDF, where it is the same everywhere.
    constant: Option<Bsdf>,
    /// Of the body that it bounds.
    priority: Option<i32>,
}

/// What stands at a point, or where to look further.
#[derive(Clone, Debug)]
enum Surface {
    Look(Look),
    /// One of two, by a hash of the point: the second with this chance.
    Mix {
        materials: [MaterialId; 2],
        amount: FloatHandle,
    },
    /// One on each side.
    TwoSided {
        front: MaterialId,
        back: MaterialId,
    },
    /// A pane of glass: by a hash of the point a mirror, or nothing but a border of media, each with the chance of what it
    /// carries.
    Pane(ThinDielectric),
    /// Nothing but a border of media.
    Interface,
}

/// What a [`Surface::Pane`] is where it reflects.
fn mirror() -> Bsdf {
    Conductor::new(Spectrum::ONE, Spectrum::splat(1e3), Facets::SMOOTH).into()
}

/// What a pane is where light passes.
static BORDER: Material =
    Material { surface: Surface::Interface, relief: Relief::None, constant: None, priority: None };

/// Tells panes' choices from others at the same point.
const PANE_KEY: u64 = 0x70_61_6e_65;

/// What bends the shading normal.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Relief {
    None,
    /// A height in scene units.
    Bump(FloatHandle),
    /// Normals in tangent space.
    NormalMap(bump::NormalMap),
}

impl Material {
    fn diffuser(&self) -> Option<&Diffuser> {
        match &self.surface {
            Surface::Look(Look::SoftBorder { profile, .. }) => profile.as_deref(),
            Surface::Look(_)
            | Surface::Mix { .. }
            | Surface::TwoSided { .. }
            | Surface::Pane(_)
            | Surface::Interface => None,
        }
    }
}

impl Materials {
    /// The BSDF and frame at a surface point; `None` where there is no surface, only the border of a medium. Glass
    /// with dispersion leaves the path its hero wavelength alone.
    #[inline]
    #[must_use]
    pub fn shade(
        &self,
        textures: &Textures,
        si: &SurfaceInteraction,
        footprint: &Footprint,
        wl: &mut Wavelengths,
    ) -> Option<Shading> {
        let material = &self.list[si.material.index()];
        match (&material.constant, material.relief) {
            (Some(bsdf), Relief::None) => Some(Shading { bsdf: bsdf.clone(), frame: si.frame }),
            (Some(_) | None, _) => self.shade_varying(textures, si, footprint, (1.0, wl)),
        }
    }

    /// The same where something else than nothing is outside of the surface: its index of refraction over that.
    pub(crate) fn shade_against(
        &self,
        textures: &Textures,
        si: &SurfaceInteraction,
        footprint: &Footprint,
        (outside, wl): (f32, &mut Wavelengths),
    ) -> Option<Shading> {
        self.shade_varying(textures, si, footprint, (outside, wl))
    }

    /// The index of refraction of what a material bounds: one where it has none. Dispersion leaves the path its hero
    /// wavelength alone.
    pub(crate) fn index_of_refraction(&self, material: MaterialId, wl: &mut Wavelengths) -> f32 {
        match &self.list[material.index()].surface {
            Surface::Look(look) => look.index_of_refraction(wl),
            Surface::Mix { .. } | Surface::TwoSided { .. } | Surface::Pane(_) | Surface::Interface => 1.0,
        }
    }

    /// Does light leave any of them elsewhere than it enters, by a diffusion profile?
    #[inline]
    #[must_use]
    pub fn has_diffusion(&self) -> bool {
        self.has_diffusion
    }

    /// By which light that enters at this point leaves elsewhere, if it does.
    #[must_use]
    pub fn diffusion(
        &self,
        textures: &Textures,
        si: &SurfaceInteraction,
        footprint: &Footprint,
        wl: &mut Wavelengths,
    ) -> Option<DiffusionProfile> {
        let diffuser = self.list[si.material.index()].diffuser()?;
        let ctx = TextureContext::at(si, *footprint);
        Some(diffuser.at(&mut Lookup::at(textures, &ctx, wl)))
    }

    /// The priority of the body that a material bounds, if it has one.
    pub(crate) fn priority(&self, material: MaterialId) -> Option<i32> {
        self.list[material.index()].priority
    }

    /// Is the surface nothing but the border of a medium at this point?
    #[must_use]
    pub fn is_interface(&self, textures: &Textures, si: &SurfaceInteraction) -> bool {
        match &self.list[si.material.index()].surface {
            Surface::Interface => true,
            Surface::Mix { .. } | Surface::TwoSided { .. } | Surface::Pane(_) => {
                let ctx = TextureContext::at(si, Footprint::default());
                let cos = si.ng.dot(si.wo);
                matches!(self.resolve(si.material, textures, &ctx, cos).surface, Surface::Interface)
            }
            Surface::Look(_) => false,
        }
    }

    /// Does the material look the same everywhere?
    #[inline]
    #[must_use]
    pub fn is_uniform(&self, material: MaterialId) -> bool {
        let m = &self.list[material.index()];
        m.constant.is_some() && m.relief == Relief::None
    }

    /// Does every one of them reflect and transmit by Lambert's law alone?
    #[must_use]
    pub fn are_all_lambertian(&self) -> bool {
        self.list[..self.len()].iter().all(|m| match &m.surface {
            Surface::Look(look) => matches!(look, Look::Diffuse { .. } | Look::DiffuseTransmission { .. }),
            // What is mixed is in the list too.
            Surface::Mix { .. } | Surface::TwoSided { .. } | Surface::Interface => true,
            Surface::Pane(_) => false,
        })
    }

    /// Does the shading normal follow from the form alone, and its surface from the place without chance?
    pub(crate) fn is_steady(&self, id: MaterialId) -> bool {
        let material = &self.list[id.index()];
        match &material.surface {
            Surface::Look(_) => material.relief == Relief::None,
            Surface::TwoSided { front, back } => self.is_steady(*front) && self.is_steady(*back),
            Surface::Mix { .. } | Surface::Pane(_) | Surface::Interface => false,
        }
    }

    /// May a surface of it be a steady one that mirrors or refracts, and scatters no other way?
    pub(crate) fn may_be_specular(&self, id: MaterialId) -> bool {
        let material = &self.list[id.index()];
        match (&material.surface, &material.constant) {
            (Surface::Look(_), Some(bsdf)) => {
                material.relief == Relief::None && bsdf.has_delta() && bsdf.is_delta_only()
            }
            (Surface::Look(look), None) => material.relief == Relief::None && look.may_be_specular(),
            (Surface::TwoSided { front, back }, _) => {
                self.may_be_specular(*front) || self.may_be_specular(*back)
            }
            (Surface::Mix { .. } | Surface::Pane(_) | Surface::Interface, _) => false,
        }
    }

    /// What is under the surfaces of each material, in order.
    pub(crate) fn interiors(&self) -> &[Option<Interior>] {
        &self.interiors
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.list.len() - 1
    }

    /// None at all?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn shade_varying(
        &self,
        textures: &Textures,
        si: &SurfaceInteraction,
        footprint: &Footprint,
        (outside, wl): (f32, &mut Wavelengths),
    ) -> Option<Shading> {
        let ctx = TextureContext::at(si, *footprint);
        let material = self.resolve(si.material, textures, &ctx, si.ng.dot(si.wo));
        let bsdf = match &material.constant {
            Some(bsdf) if outside == 1.0 => bsdf.clone(),
            Some(_) | None => match &material.surface {
                Surface::Look(look) => {
                    look.bsdf(&mut Lookup::at(textures, &ctx, wl).over(outside), &self.profiles)
                }
                Surface::Pane(_) => mirror(),
                Surface::Mix { .. } | Surface::TwoSided { .. } | Surface::Interface => return None,
            },
        };
        let frame = match material.relief {
            Relief::None => si.frame,
            Relief::Bump(height) => bump::bump(si, &ctx, |ctx| textures.float(&height, ctx)),
            Relief::NormalMap(map) => {
                let st = textures.coordinates(&map.mapping, &ctx);
                map.frame(si, st, textures.images().get(map.image))
            }
        };
        let rotation = match &material.surface {
            Surface::Look(look) => look.rotation(),
            Surface::Mix { .. } | Surface::TwoSided { .. } | Surface::Pane(_) | Surface::Interface => None,
        };
        let frame = match rotation {
            None => frame,
            Some(angle) => {
                let (sin, cos) = trig::sin_cos(textures.float(angle, &ctx));
                let (s, t) = (frame.s * cos + frame.t * sin, frame.t * cos - frame.s * sin);
                Frame { s, t, n: frame.n }
            }
        };
        Some(Shading { bsdf, frame })
    }

    /// The material that a mixture (of mixtures, of two sides, of a pane) is at this point, seen at this cosine to its
    /// outer normal.
    fn resolve(&self, id: MaterialId, textures: &Textures, ctx: &TextureContext, cos: f32) -> &Material {
        let mut material = &self.list[id.index()];
        loop {
            material = match &material.surface {
                Surface::Mix { materials: [a, b], amount } => {
                    let amount = textures.float(amount, ctx);
                    let pair = u64::from(a.0) << 32 | u64::from(b.0);
                    let key = hash::combine(hash::of_floats(&ctx.p.0.to_array()), pair);
                    let u = hash::unit_f32((key >> 32) as u32);
                    &self.list[if u < amount { b } else { a }.index()]
                }
                Surface::TwoSided { front, back } => {
                    let side = if cos >= 0.0 { front } else { back };
                    &self.list[side.index()]
                }
                Surface::Pane(pane) => {
                    let z = cos.clamp(-1.0, 1.0);
                    let wo = LocalDir::new((1.0 - z * z).max(0.0).sqrt(), 0.0, z);
                    let key = hash::combine(hash::of_floats(&ctx.p.0.to_array()), PANE_KEY);
                    let passes = hash::unit_f32((key >> 32) as u32) >= pane.reflectance(wo);
                    return if passes { &BORDER } else { material };
                }
                Surface::Look(_) | Surface::Interface => return material,
            };
        }
    }

    /// What a surface of this material needs to know of its points.
    pub(crate) fn detail(&self, id: MaterialId) -> Detail {
        let material = &self.list[id.index()];
        let own = match (material.relief, &material.constant, &material.surface) {
            (Relief::Bump(_), ..) => Detail::Curvature,
            (Relief::NormalMap(_), ..) => Detail::Tangents,
            (Relief::None, Some(bsdf), _) if bsdf.is_isotropic() => Detail::Frame,
            (Relief::None, _, Surface::Interface) => Detail::Frame,
            (Relief::None, ..) => Detail::Tangents,
        };
        match &material.surface {
            Surface::Mix { materials: [a, b], .. } | Surface::TwoSided { front: a, back: b } => {
                own.max(self.detail(*a)).max(self.detail(*b))
            }
            Surface::Look(_) | Surface::Pane(_) | Surface::Interface => own,
        }
    }

    /// Where is a surface of this material nothing but a border of media?
    pub(crate) fn gaps(&self, id: MaterialId) -> Gaps {
        match &self.list[id.index()].surface {
            Surface::Interface => Gaps::Everywhere,
            Surface::Mix { materials: [a, b], .. } | Surface::TwoSided { front: a, back: b } => {
                match (self.gaps(*a), self.gaps(*b)) {
                    (Gaps::Nowhere, Gaps::Nowhere) => Gaps::Nowhere,
                    (Gaps::Everywhere, Gaps::Everywhere) => Gaps::Everywhere,
                    (Gaps::Nowhere | Gaps::WhereDisplaced | Gaps::Somewhere | Gaps::Everywhere, _) => {
                        Gaps::Somewhere
                    }
                }
            }
            Surface::Pane(_) => Gaps::Somewhere,
            Surface::Look(_) => Gaps::Nowhere,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::ShapeId;
    use crate::textures::TextureCompiler;
    use math::{Dir, Point, Transform, Vec2, Vec3};
    use scatter::TransportMode;
    use scene_desc::{
        ConductorSpectrum, FloatInput, IndexOfRefraction, Mapping2d, MaterialDesc, MaterialKind, Roughness,
        SceneDesc, Sink, Span, SpectrumDesc, SpectrumInput, SubsurfaceProfile, TextureDesc, TextureInput,
        TextureKind, TextureNode, Tint,
    };
    use spectrum::{ColorMode, ColorPipeline, ColorSpace};

    const RGB: ColorPipeline = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);
    const SPECTRAL: ColorPipeline = ColorPipeline::new(ColorMode::Spectral, ColorSpace::Srgb);

    /// A point of the plane z = 0 with (u, v) = (x, y), seen from above.
    pub(crate) fn point() -> SurfaceInteraction {
        SurfaceInteraction {
            p: Point::new(0.3, 0.7, 0.0),
            p_error: Vec3::ZERO,
            ng: Dir::Z,
            frame: Frame { s: Vec3::X, t: Vec3::Y, n: Dir::Z },
            uv: Vec2::new(0.3, 0.7),
            dpdu: Vec3::X,
            dpdv: Vec3::Y,
            dndu: Vec3::ZERO,
            dndv: Vec3::ZERO,
            wo: Dir::Z,
            time: 0.0,
            t: 1.0,
            shape: ShapeId(0),
            primitive: 0,
            at: [0.0; 2],
            material: MaterialId(0),
            light: None,
        }
    }

    fn material(kind: MaterialKind) -> MaterialDesc {
        MaterialDesc::new(kind, Span::NONE)
    }

    fn scene(kinds: Vec<MaterialKind>, nodes: Vec<(TextureKind, TextureNode)>) -> SceneDesc {
        let texture = |(kind, node)| TextureDesc { name: String::new(), kind, node, span: Span::NONE };
        SceneDesc {
            materials: kinds.into_iter().map(material).collect(),
            textures: nodes.into_iter().map(texture).collect(),
            ..SceneDesc::default()
        }
    }

    fn compile(scene: &SceneDesc, colors: ColorPipeline) -> (Materials, Textures, Sink) {
        let mut sink = Sink::default();
        let mut compiler = TextureCompiler::new(scene, colors, &mut sink);
        let materials = Materials::compile(scene, &mut compiler);
        let textures = compiler.finish();
        (materials, textures, sink)
    }

    /// A texture that varies, but has this value everywhere.
    fn disguised(value: f32) -> TextureNode {
        let same = || TextureInput::Float(value);
        TextureNode::Checkerboard {
            a: same(),
            b: same(),
            mapping: Some(Mapping2d::default()),
            texture_from_world: Transform::IDENTITY,
        }
    }

    /// Every kind with constants, and the same with textures of these values: float 0 is roughness 0.25, float 1 is
    /// thickness 0.02, spectrum 2 is 0.6.
    fn kinds(textured: bool) -> Vec<MaterialKind> {
        let float = |value: f32, id: u32| {
            if textured { FloatInput::Texture(scene_desc::TextureId(id)) } else { value.into() }
        };
        let spectrum = || {
            if textured {
                SpectrumInput::Texture(scene_desc::TextureId(2))
            } else {
                SpectrumDesc::Constant(0.6).into()
            }
        };
        let rough = || Roughness::new(float(0.25, 0), float(0.25, 0), true);
        let eta = || IndexOfRefraction::Constant(1.5);
        vec![
            MaterialKind::Diffuse { reflectance: spectrum() },
            MaterialKind::DiffuseTransmission {
                reflectance: spectrum(),
                transmittance: spectrum(),
                scale: 0.5,
            },
            MaterialKind::Conductor {
                spectrum: ConductorSpectrum::Reflectance(spectrum()),
                roughness: rough(),
                tint: Tint::default(),
            },
            MaterialKind::Dielectric { eta: eta(), roughness: rough(), tint: Tint::default() },
            MaterialKind::CoatedDiffuse {
                reflectance: spectrum(),
                roughness: rough(),
                thickness: 0.02.into(),
                eta: eta(),
                g: 0.0.into(),
                albedo: SpectrumDesc::Constant(0.0).into(),
                max_depth: 10,
                n_samples: 1,
            },
        ]
    }

    const LOOKUPS: [(f32, f32); 3] = [(0.8, 0.5), (0.3, 0.9), (0.95, -0.6)];

    fn direction(z: f32) -> LocalDir {
        LocalDir::normalize(Vec3::new(0.3, -0.4, z))
    }

    #[test]
    fn what_bounds_no_body_has_no_priority_and_says_so() {
        let mut scene = scene(kinds(false), Vec::new());
        scene.materials.iter_mut().for_each(|m| m.priority = Some(3));
        scene.materials.push(MaterialDesc { priority: Some(-1), ..material(MaterialKind::Interface) });
        let (materials, _, sink) = compile(&scene, RGB);
        let priorities: Vec<_> = (0..6).map(|i| materials.priority(MaterialId(i))).collect();
        assert_eq!(priorities, [None, None, None, Some(3), None, Some(-1)]);
        assert_eq!(sink.render().matches("bounds no body").count(), 4, "{}", sink.render());
    }

    #[test]
    fn the_way_for_constants_gives_what_the_way_for_textures_gives() {
        let nodes = || {
            let float = |x| (TextureKind::Float, disguised(x));
            vec![float(0.25), float(0.02), (TextureKind::Spectrum, disguised(0.6))]
        };
        for colors in [RGB, SPECTRAL] {
            let mut wl = if colors == RGB {
                Wavelengths::RGB
            } else {
                Wavelengths::new([450.0, 550.0, 600.0, 700.0], [0.004; 4])
            };
            let (plain_scene, textured_scene) = (scene(kinds(false), vec![]), scene(kinds(true), nodes()));
            let (plain, none, _) = compile(&plain_scene, colors);
            let (textured, textures, sink) = compile(&textured_scene, colors);
            assert!(sink.diagnostics().is_empty(), "{sink:?}");
            for i in 0..plain.len() {
                let si = SurfaceInteraction { material: MaterialId(i as u32), ..point() };
                assert_eq!(plain.list[i].constant.is_some(), colors == RGB, "{i}");
                assert!(textured.list[i].constant.is_none());
                let a = plain.shade(&none, &si, &Footprint::default(), &mut wl).unwrap();
                let b = textured.shade(&textures, &si, &Footprint::default(), &mut wl).unwrap();
                for (zo, zi) in LOOKUPS {
                    let eval =
                        |s: &Shading| s.bsdf.eval(direction(zo), direction(zi), TransportMode::Radiance);
                    let (x, y) = (eval(&a).lanes(), eval(&b).lanes());
                    for (x, y) in x.iter().zip(y) {
                        // The table of coats over all roughnesses is interpolated.
                        assert!((x - y).abs() <= 0.01 * x.abs() + 1e-6, "kind {i}: {x} {y}");
                    }
                }
                assert_eq!(a.frame, b.frame);
            }
        }
    }

    #[test]
    fn a_mixture_has_its_share_of_each_and_is_the_same_for_every_path() {
        let grey = |x| MaterialKind::Diffuse { reflectance: SpectrumDesc::Constant(x).into() };
        let mix = |a, b, amount: f32| MaterialKind::Mix {
            materials: [scene_desc::MaterialId(a), scene_desc::MaterialId(b)],
            amount: amount.into(),
        };
        let scene = scene(
            vec![mix(1, 2, 0.25), grey(0.0), mix(3, 4, 0.5), grey(0.5), MaterialKind::Interface],
            vec![],
        );
        let (materials, textures, sink) = compile(&scene, RGB);
        assert!(sink.diagnostics().is_empty());
        let n = 40_000;
        let mut counts = [0_u32; 3];
        for i in 0..n {
            let mut si = point();
            si.p = Point::new(i as f32 * 0.001, (i % 7) as f32, 0.5);
            let shade = |wo| {
                let si = SurfaceInteraction { wo, ..si };
                materials.shade(&textures, &si, &Footprint::default(), &mut Wavelengths::RGB.clone())
            };
            let what = |s: Option<Shading>| match s {
                None => 2,
                Some(s) if s.bsdf.albedo_estimate(LocalDir::NORMAL) == Spectrum::ZERO => 0,
                Some(_) => 1,
            };
            let kind = what(shade(Dir::Z));
            assert_eq!(kind, what(shade(Dir(Vec3::X))));
            assert_eq!(kind == 2, materials.is_interface(&textures, &si));
            counts[kind] += 1;
        }
        // Five deviations of a binomial.
        for (count, p) in counts.into_iter().zip([0.75, 0.125, 0.125]) {
            let deviation = (f64::from(n) * p * (1.0 - p)).sqrt();
            assert!((f64::from(count) - f64::from(n) * p).abs() < 5.0 * deviation, "{counts:?}");
        }
    }

    #[test]
    fn a_pane_that_light_passes_is_a_border_with_the_chance_of_what_it_lets_through() {
        let pane = MaterialKind::ThinDielectric {
            eta: IndexOfRefraction::Constant(1.5),
            tint: Tint::default(),
            passes: true,
        };
        let (materials, textures, sink) = compile(&scene(vec![pane], vec![]), RGB);
        assert!(sink.diagnostics().is_empty());
        for z in [1.0_f32, 0.4, 0.1] {
            let wo = direction(z / (1.0 - z * z).max(1e-9).sqrt() * 0.5);
            let (n, mut passed) = (20_000, 0_u32);
            for i in 0..n {
                let mut si = point();
                (si.p, si.wo) = (Point::new(i as f32 * 0.013, (i % 11) as f32, 0.5), Dir(wo.0));
                let shading =
                    materials.shade(&textures, &si, &Footprint::default(), &mut Wavelengths::RGB.clone());
                assert_eq!(shading.is_none(), materials.is_interface(&textures, &si));
                match shading {
                    None => passed += 1,
                    Some(s) => {
                        assert!(s.bsdf.is_delta_only() && s.bsdf.albedo_estimate(wo).rgb()[0] > 0.999);
                    }
                }
            }
            let p = 1.0 - f64::from(scatter::ThinDielectric::new(1.5).reflectance(wo));
            // Five deviations of a binomial.
            let off = (f64::from(passed) - f64::from(n) * p).abs();
            assert!(off < 5.0 * (f64::from(n) * p * (1.0 - p)).sqrt() + 1e-9, "{passed} of {n}, {p}");
        }
    }

    #[test]
    fn a_mixture_of_itself_is_an_error() {
        let mix = |a, b| MaterialKind::Mix {
            materials: [scene_desc::MaterialId(a), scene_desc::MaterialId(b)],
            amount: 0.5.into(),
        };
        let (_, _, sink) = compile(&scene(vec![mix(1, 1), mix(0, 0)], vec![]), RGB);
        assert!(sink.has_errors());
        let (_, _, sink) = compile(&scene(vec![mix(7, 0)], vec![]), RGB);
        assert_eq!(sink.diagnostics()[0].message, "there is no material 7 to mix");
    }

    #[test]
    fn a_width_of_one_thousandth_is_a_mirror() {
        let glass = |r: f32, remap| MaterialKind::Dielectric {
            eta: IndexOfRefraction::Constant(1.5),
            roughness: Roughness::new(r, r, remap),
            tint: Tint::default(),
        };
        let (materials, textures, _) = compile(
            &scene(
                vec![glass(0.001, false), glass(0.0011, false), glass(1e-6, true), glass(0.01, true)],
                vec![],
            ),
            RGB,
        );
        let smooth = [0, 1, 2, 3].map(|i| {
            let si = SurfaceInteraction { material: MaterialId(i), ..point() };
            let shading =
                materials.shade(&textures, &si, &Footprint::default(), &mut Wavelengths::RGB.clone());
            shading.unwrap().bsdf.is_delta_only()
        });
        assert_eq!(smooth, [true, false, true, false]);
    }

    #[test]
    fn dispersive_glass_takes_the_hero_wavelength_and_in_rgb_says_so() {
        let bk7 = || MaterialKind::Dielectric {
            eta: IndexOfRefraction::Spectrum(SpectrumDesc::Named("glass-BK7".into())),
            roughness: Roughness::smooth(),
            tint: Tint::default(),
        };
        let (materials, textures, sink) = compile(&scene(vec![bk7()], vec![]), SPECTRAL);
        assert!(sink.diagnostics().is_empty());
        let mut wl = Wavelengths::new([450.0, 550.0, 600.0, 700.0], [0.004; 4]);
        assert!(materials.shade(&textures, &point(), &Footprint::default(), &mut wl).is_some());
        assert!(wl.is_terminated());

        let (materials, textures, sink) = compile(&scene(vec![bk7(), bk7()], vec![]), RGB);
        assert_eq!(
            sink.diagnostics()[0].message,
            "dispersion needs spectral mode: 2 refractive indices are averaged"
        );
        let shading = materials
            .shade(&textures, &point(), &Footprint::default(), &mut Wavelengths::RGB.clone())
            .unwrap();
        // ((n − 1)/(n + 1))² of n = 1.518, by the chance of reflection.
        let reflected =
            shading.bsdf.sample(LocalDir::NORMAL, 0.0, [0.5; 2], TransportMode::Radiance).unwrap();
        let scatter::Density::Delta { probability } = reflected.density else { panic!("not a delta") };
        assert!((probability - 0.0423).abs() < 2e-4, "{probability}");
    }

    #[test]
    fn subsurface_is_glass_with_something_inside_unless_it_varies() {
        let kind = |profile| MaterialKind::Subsurface {
            profile,
            scale: 2.0,
            g: 0.0,
            eta: 1.33,
            roughness: Roughness::smooth(),
            method: scene_desc::SubsurfaceMethod::Walk,
        };
        let skin = || kind(SubsurfaceProfile::Named("Skin1".into()));
        let mix = MaterialKind::Mix {
            materials: [scene_desc::MaterialId(2), scene_desc::MaterialId(2)],
            amount: 0.5.into(),
        };
        let soft = kind(SubsurfaceProfile::Reflectance {
            reflectance: SpectrumDesc::srgb([0.8, 0.4, 0.1]).into(),
            mfp: SpectrumDesc::Constant(0.5).into(),
        });
        let (materials, textures, sink) = compile(&scene(vec![skin(), soft, skin(), mix], vec![]), RGB);
        assert_eq!(sink.diagnostics().len(), 1, "{sink:?}");
        assert!(!sink.has_errors());
        let interior = |i: usize| {
            let it = materials.interiors()[i].as_ref();
            it.map(|it| [&it.sigma_a, &it.sigma_s].map(|s| s.eval(&Wavelengths::RGB).rgb()))
        };
        assert_eq!(interior(0).unwrap()[1], [1.48, 1.76, 2.02]);
        let [a, s] = interior(1).unwrap();
        for c in 0..3 {
            // Mean free path 0.5 × 2.
            assert!((a[c] + s[c] - 1.0).abs() < 1e-5 && s[0] > s[1] && s[1] > s[2], "{a:?} {s:?}");
        }
        assert!(interior(2).is_none() && interior(3).is_none());
        let si = SurfaceInteraction { material: MaterialId(2), ..point() };
        let shading =
            materials.shade(&textures, &si, &Footprint::default(), &mut Wavelengths::RGB.clone()).unwrap();
        let [r, g, b] = shading.bsdf.albedo_estimate(direction(0.8)).rgb();
        assert!(r > g && g > b && r > 0.2 && r < 1.0, "{r} {g} {b}");
    }

    #[test]
    fn a_bumpy_material_has_a_bent_frame() {
        let mut scene = scene(
            vec![MaterialKind::default_diffuse()],
            vec![(
                TextureKind::Float,
                TextureNode::Bilerp {
                    corners: [0.0, 0.0, 0.5, 0.5].map(TextureInput::Float),
                    mapping: Mapping2d::default(),
                },
            )],
        );
        scene.materials[0].displacement = Some(FloatInput::Texture(scene_desc::TextureId(0)));
        let (materials, textures, _) = compile(&scene, RGB);
        let shading = materials
            .shade(&textures, &point(), &Footprint::default(), &mut Wavelengths::RGB.clone())
            .unwrap();
        assert!(shading.frame.n.0.distance(Vec3::new(-0.5, 0.0, 1.0).normalize()) < 1e-3);
        assert!(materials.list[0].constant.is_some());
    }
}
