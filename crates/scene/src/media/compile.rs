//! Media from their descriptions.

use std::sync::Arc;

use math::{DVec3, Transform, Vec3};
use scatter::{BlendedPhase, HenyeyGreenstein, Isotropic, PhaseFunction, PurePhase, Rayleigh};
use scene_desc::{
    ColorSpaceName, GridEmission, GridLayout, MediumDesc, MediumInterface, MediumKind, PhaseDesc, Sink, Span,
    SpectrumDesc,
};
use spectrum::{ColorMode, ColorPipeline, SpectrumValue, photometric};

use super::field::{Cloud, Density, Emission, Field, Glow, RgbField, Varying};
use super::grid::{Grid, Majorants, Value};
use super::homogeneous::Homogeneous;
use super::{Body, Media, Medium};
use crate::MediumId;
use crate::linear_map::AffineMap;
use crate::materials::Interior;
use crate::textures::{SpectrumRole, color_space, spectral_curve, spectrum_value};

impl Media {
    /// Compiles media, and what is under the surfaces of materials.
    pub(crate) fn compile(
        descs: &[MediumDesc],
        interiors: &[Option<Interior>],
        colors: ColorPipeline,
        sink: &mut Sink,
    ) -> (Self, MediumIds) {
        let mut media = Self::default();
        let mut compiler = Compiler { colors, sink };
        let described = descs
            .iter()
            .map(|desc| {
                let body = compiler.body(desc)?;
                let phase = phase(&desc.phase, desc.span, compiler.sink);
                Some(media.add(Medium { phase, is_interior: false, body }))
            })
            .collect();
        let of_materials = interiors
            .iter()
            .map(|interior| {
                let Interior { sigma_a, sigma_s, g } = interior.clone()?;
                let body = Body::Homogeneous(Homogeneous { sigma_a, sigma_s, le: SpectrumValue::ZERO });
                let phase = HenyeyGreenstein::new(g).into();
                Some(media.add(Medium { phase, is_interior: true, body }))
            })
            .collect();
        (media, MediumIds { described, of_materials })
    }

    fn add(&mut self, medium: Medium) -> MediumId {
        self.list.push(medium);
        MediumId(self.list.len() as u32 - 1)
    }
}

/// Which medium is which.
#[derive(Clone, Debug, Default)]
pub(crate) struct MediumIds {
    /// By the description's ids; `None` is empty space.
    described: Vec<Option<MediumId>>,
    /// Under the surfaces of materials.
    of_materials: Vec<Option<MediumId>>,
}

impl MediumIds {
    /// The medium of a description's id.
    pub(crate) fn described(&self, id: Option<scene_desc::MediumId>) -> Option<MediumId> {
        self.described.get(id?.index()).copied().flatten()
    }

    /// The media inside and outside of a shape of the material.
    pub(crate) fn sides(
        &self,
        interface: Option<MediumInterface>,
        material: scene_desc::MaterialId,
    ) -> Option<[Option<MediumId>; 2]> {
        let own = self.of_materials.get(material.index()).copied().flatten();
        match (interface, own) {
            (None, None) => None,
            (interface, own) => {
                let MediumInterface { inside, outside } = interface.unwrap_or_default();
                Some([own.or_else(|| self.described(inside)), self.described(outside)])
            }
        }
    }
}

fn phase(desc: &PhaseDesc, span: Span, sink: &mut Sink) -> PhaseFunction {
    let pure = |desc: &PhaseDesc| match desc {
        PhaseDesc::Isotropic | PhaseDesc::HenyeyGreenstein(0.0) => Some(PurePhase::Isotropic(Isotropic)),
        PhaseDesc::HenyeyGreenstein(g) => Some(PurePhase::HenyeyGreenstein(HenyeyGreenstein::new(*g))),
        PhaseDesc::Rayleigh => Some(PurePhase::Rayleigh(Rayleigh)),
        PhaseDesc::Blend(_) => None,
    };
    if let PhaseDesc::Blend(parts) = desc {
        let parts: Option<Vec<_>> = parts.iter().map(|p| Some((p.weight, pure(&p.phase)?))).collect();
        if let Some(blend) = parts.and_then(|parts| BlendedPhase::new(&parts)) {
            return blend.into();
        }
        let most = PhaseDesc::MOST_PARTS;
        sink.error(span, "this blend of phase functions makes no sense")
            .hint(format!("expected 1 to {most} parts that are no blends, and a weight above 0"));
    }
    match pure(desc) {
        Some(PurePhase::HenyeyGreenstein(p)) => p.into(),
        Some(PurePhase::Rayleigh(p)) => p.into(),
        Some(PurePhase::Isotropic(_)) | None => Isotropic.into(),
    }
}

struct Compiler<'s> {
    colors: ColorPipeline,
    sink: &'s mut Sink,
}

impl Compiler<'_> {
    fn body(&mut self, desc: &MediumDesc) -> Option<Body> {
        let span = desc.span;
        match &desc.kind {
            MediumKind::Homogeneous { sigma_a, sigma_s, le, scale, le_scale } => {
                let h = Homogeneous {
                    sigma_a: self.unbounded(sigma_a, *scale, span),
                    sigma_s: self.unbounded(sigma_s, *scale, span),
                    le: le.as_ref().map_or(SpectrumValue::ZERO, |le| self.illuminant(le, *le_scale, span)),
                };
                let is_there = !h.sigma_a.is_black() || !h.sigma_s.is_black();
                is_there.then_some(Body::Homogeneous(h))
            }
            MediumKind::Grid { layout, density, sigma_a, sigma_s, scale, emission } => {
                let grid = self.grid(layout, density, desc)?;
                let majorants = Majorants::of(&grid, |d| d);
                let emission = self.emission(emission, layout, desc)?;
                let (sigma_a, sigma_s) =
                    (self.unbounded(sigma_a, *scale, span), self.unbounded(sigma_s, *scale, span));
                let never_scatters = sigma_s.is_black();
                let field = Field::Density { density: Density::Grid(grid), sigma_a, sigma_s, emission };
                self.varying(layout.bounds, desc, (field, majorants, never_scatters))
            }
            MediumKind::RgbGrid { .. } => self.rgb_grid(desc),
            MediumKind::Cloud { bounds, density, wispiness, frequency, sigma_a, sigma_s } => {
                let cloud = Cloud {
                    bounds: *bounds,
                    density: *density,
                    wispiness: *wispiness,
                    frequency: *frequency,
                };
                let (sigma_a, sigma_s) =
                    (self.unbounded(sigma_a, 1.0, span), self.unbounded(sigma_s, 1.0, span));
                let never_scatters = sigma_s.is_black();
                let density = Density::Cloud(cloud);
                let field = Field::Density { density, sigma_a, sigma_s, emission: Emission::None };
                self.varying(*bounds, desc, (field, Majorants::constant(1.0), never_scatters))
            }
            MediumKind::Unsupported(_) => None,
        }
    }

    fn rgb_grid(&mut self, desc: &MediumDesc) -> Option<Body> {
        let MediumKind::RgbGrid { layout, sigma_a, sigma_s, le, space, scale, le_scale } = &desc.kind else {
            return None;
        };
        let sigma_a = self.rgb_values(layout, sigma_a.as_ref(), *space, desc)?;
        let sigma_s = self.rgb_values(layout, sigma_s.as_ref(), *space, desc)?;
        let le = self.rgb_values(layout, le.as_ref(), *space, desc)?;

        // A spectrum's factor is twice the largest channel (see `RgbToSpectrumTable::unbounded`).
        let (spectral, by) = match self.colors.mode {
            ColorMode::Rgb => (false, 1.0),
            ColorMode::Spectral => (true, 2.0),
        };
        let most = |rgb: [f32; 3]| by * rgb[0].max(rgb[1]).max(rgb[2]);
        let bound = |grid: &Option<Grid<[f32; 3]>>| match grid {
            Some(grid) => Majorants::of(grid, most),
            None => Majorants::everywhere(layout.resolution, 1.0),
        };
        let majorants = bound(&sigma_a).plus(&bound(&sigma_s));
        let own = color_space(*space);
        let space = if spectral { own } else { self.colors.space };
        // Radiance in RGB is what it says, as a light's is.
        let le_scale = *le_scale / space.illuminant_photometric() as f32;
        let never_scatters = sigma_s.as_ref().is_some_and(|g| g.all(|rgb| most(rgb) <= 0.0));
        let field =
            RgbField { sigma_a, sigma_s, le, space, colors: self.colors, scale: scale.max(0.0), le_scale };
        self.varying(layout.bounds, desc, (Field::Rgb(field), majorants, never_scatters))
    }

    /// A grid of colours, in the film's space in RGB mode. The outer `None` is an error.
    #[allow(clippy::option_option, reason = "wrong, or not there")]
    fn rgb_values(
        &mut self,
        layout: &GridLayout,
        data: Option<&Arc<[[f32; 3]]>>,
        space: ColorSpaceName,
        desc: &MediumDesc,
    ) -> Option<Option<Grid<[f32; 3]>>> {
        let Some(data) = data else { return Some(None) };
        let (from, colors) = (color_space(space), self.colors);
        let convert = |rgb: &[f32; 3]| {
            let rgb = match colors.mode {
                ColorMode::Rgb => from.convert(colors.space, *rgb),
                ColorMode::Spectral => *rgb,
            };
            rgb.map(|c| c.max(0.0))
        };
        let converted: Arc<[[f32; 3]]> = data.iter().map(convert).collect();
        self.grid(layout, &converted, desc).map(Some)
    }

    fn grid<T: Value>(&mut self, layout: &GridLayout, data: &Arc<[T]>, desc: &MediumDesc) -> Option<Grid<T>> {
        let grid = Grid::new(layout.resolution, Arc::clone(data), layout.border);
        if grid.is_none() {
            let [x, y, z] = layout.resolution;
            self.sink
                .error(desc.span, format!("medium \"{}\" has {} values", desc.name, data.len()))
                .hint(format!("a grid of {x} x {y} x {z} needs as many as their product, and at least one"));
        }
        grid
    }

    fn varying(
        &mut self,
        bounds: [Vec3; 2],
        desc: &MediumDesc,
        (field, majorants, never_scatters): (Field, Majorants, bool),
    ) -> Option<Body> {
        let [lo, hi] = bounds.map(|p| p.as_dvec3());
        let placed = Transform::scale(hi - lo)
            .filter(|_| (hi - lo).min_element() > 0.0)
            .map(|size| desc.world_from_medium * Transform::translate(DVec3::new(lo.x, lo.y, lo.z)) * size)
            .and_then(|t| AffineMap::of(&t));
        let Some(world_from_unit) = placed else {
            self.sink.error(desc.span, format!("the box of medium \"{}\" has no volume", desc.name)).hint(
                "its first corner must lie below the second in x, y and z, its transform needs an inverse",
            );
            return None;
        };
        Some(Body::Varying(Box::new(Varying { world_from_unit, field, majorants, never_scatters })))
    }

    fn emission(
        &mut self,
        emission: &GridEmission,
        layout: &GridLayout,
        desc: &MediumDesc,
    ) -> Option<Emission> {
        Some(match emission {
            GridEmission::None => Emission::None,
            GridEmission::Spectrum { le, scale, factor } => {
                let le = self.illuminant(le, *factor, desc.span);
                let scale = match scale {
                    Some(data) => Some(self.grid(layout, data, desc)?),
                    None => None,
                };
                if le.is_black() { Emission::None } else { Emission::Spectrum { le, scale } }
            }
            GridEmission::Temperature { kelvin, offset, scale, factor } => {
                let most = kelvin.iter().fold(0.0_f32, |m, t| m.max((t - offset) * scale));
                Emission::Temperature {
                    kelvin: self.grid(layout, kelvin, desc)?,
                    offset: *offset,
                    scale: *scale,
                    glow: Glow::new(*factor, most, self.colors),
                }
            }
        })
    }

    fn unbounded(&mut self, desc: &SpectrumDesc, scale: f32, span: Span) -> SpectrumValue {
        spectrum_value(desc, SpectrumRole::Unbounded, self.colors, span, self.sink).scaled(scale.max(0.0))
    }

    /// Radiance of a spectrum that is normalised as a light's.
    fn illuminant(&mut self, desc: &SpectrumDesc, scale: f32, span: Span) -> SpectrumValue {
        let curve = spectral_curve(desc, SpectrumRole::Illuminant, span, self.sink);
        let factor = scale.max(0.0) / photometric(&curve);
        self.colors.illuminant(&curve).scaled(if factor.is_finite() { factor } else { 0.0 })
    }
}
