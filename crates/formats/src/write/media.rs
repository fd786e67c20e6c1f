//! `MakeNamedMedium`.

use math::AnimatedTransform;
use scene_desc::{
    GridBorder, GridEmission, GridLayout, MediumKind, PhaseDesc, PhasePart, Span, SpectrumDesc,
};

use super::Writer;
use super::params::Params;

impl Writer<'_, '_, '_> {
    pub(super) fn media(&mut self) {
        for (i, medium) in self.scene.media.iter().enumerate() {
            let mut p = Params::default();
            let kind = self.medium(&mut p, &medium.kind, medium.span);
            match &medium.phase {
                PhaseDesc::Isotropic => {}
                PhaseDesc::HenyeyGreenstein(g) => p.float_unless("g", *g, 0.0),
                PhaseDesc::Blend(parts) => {
                    let all: f32 = parts.iter().map(|p| p.weight.max(0.0)).sum();
                    let cosine = |p: &PhasePart| match p.phase {
                        PhaseDesc::HenyeyGreenstein(g) => g * p.weight.max(0.0),
                        PhaseDesc::Isotropic | PhaseDesc::Rayleigh | PhaseDesc::Blend(_) => 0.0,
                    };
                    let instead = "Henyey and Greenstein's of the same mean cosine is written";
                    self.otherwise(medium.span, "blend of phase functions", instead);
                    let g = parts.iter().map(cosine).sum::<f32>() / all.max(f32::MIN_POSITIVE);
                    p.float_unless("g", g, 0.0);
                }
                PhaseDesc::Rayleigh => {
                    self.otherwise(medium.span, "Rayleigh phase function", "an even one is written");
                }
            }
            self.line(0, "AttributeBegin");
            self.transform(1, &AnimatedTransform::fixed(medium.world_from_medium), medium.span);
            self.line(1, &format!("MakeNamedMedium \"medium-{i}\" \"string type\" \"{kind}\"{}", p.0));
            self.line(0, "AttributeEnd");
        }
    }

    fn coefficients(&mut self, p: &mut Params, a: &SpectrumDesc, s: &SpectrumDesc, span: Span) {
        self.spectrum(p, "sigma_a", a, span);
        self.spectrum(p, "sigma_s", s, span);
    }

    fn layout(&mut self, p: &mut Params, layout: &GridLayout, span: Span) {
        for (name, n) in ["nx", "ny", "nz"].into_iter().zip(layout.resolution) {
            p.integer(name, n);
        }
        p.vec3s("point3", "p0", &layout.bounds[..1]);
        p.vec3s("point3", "p1", &layout.bounds[1..]);
        if layout.border == GridBorder::Clamp {
            let instead = "within half a cell of its faces the grid fades to zero";
            self.otherwise(span, "grid that keeps its value up to its faces", instead);
        }
    }

    fn medium(&mut self, p: &mut Params, kind: &MediumKind, span: Span) -> &'static str {
        match kind {
            MediumKind::Homogeneous { sigma_a, sigma_s, le, scale, le_scale } => {
                self.coefficients(p, sigma_a, sigma_s, span);
                p.float_unless("scale", *scale, 1.0);
                if let Some(le) = le {
                    self.spectrum(p, "Le", le, span);
                    p.float_unless("Lescale", *le_scale, 1.0);
                }
                "homogeneous"
            }
            MediumKind::Grid { layout, density, sigma_a, sigma_s, scale, emission } => {
                self.layout(p, layout, span);
                self.coefficients(p, sigma_a, sigma_s, span);
                p.float_unless("scale", *scale, 1.0);
                p.floats("float", "density", density.iter().copied());
                match emission {
                    GridEmission::None => {}
                    GridEmission::Spectrum { le, scale, factor } => {
                        self.spectrum(p, "Le", le, span);
                        let n = density.len();
                        let each = |i: usize| scale.as_ref().map_or(1.0, |s| s[i]) * factor;
                        p.floats("float", "Lescale", (0..n).map(each));
                    }
                    GridEmission::Temperature { kelvin, offset, scale, .. } => {
                        p.floats("float", "temperature", kelvin.iter().copied());
                        p.float("temperatureoffset", *offset);
                        p.float("temperaturescale", *scale);
                    }
                }
                "uniformgrid"
            }
            MediumKind::RgbGrid { layout, sigma_a, sigma_s, le, space, scale, le_scale } => {
                self.layout(p, layout, span);
                self.check_space(*space, span);
                for (name, values) in [("sigma_a", sigma_a), ("sigma_s", sigma_s), ("Le", le)] {
                    if let Some(values) = values {
                        p.floats("rgb", name, values.iter().flatten().copied());
                    }
                }
                p.float_unless("scale", *scale, 1.0);
                p.float_unless("Lescale", *le_scale, 1.0);
                "rgbgrid"
            }
            MediumKind::Cloud { bounds, density, wispiness, frequency, sigma_a, sigma_s } => {
                p.vec3s("point3", "p0", &bounds[..1]);
                p.vec3s("point3", "p1", &bounds[1..]);
                for (name, x) in [("density", density), ("wispiness", wispiness), ("frequency", frequency)] {
                    p.float(name, *x);
                }
                self.coefficients(p, sigma_a, sigma_s, span);
                "cloud"
            }
            MediumKind::Unsupported(_) => {
                p.floats("rgb", "sigma_a", [0.0; 3]);
                p.floats("rgb", "sigma_s", [0.0; 3]);
                "homogeneous"
            }
        }
    }
}
