//! Media: homogeneous ones, grids of density or of colours, clouds; and which of them a thing is in.
//!
//! Coefficients by name are measured values in 1/mm, for R, G, B, of [Jensen2001] and [Narasimhan2006], as pbrt-v4
//! lists them. Coefficients are per unit of world space, whatever a medium's transform.
//!
//! Departs from pbrt-v4: what a grid of colours emits is measured as a light's colour is.

use std::sync::Arc;

use math::{Transform, Vec3};
use scene_desc::{
    GridBorder, GridEmission, GridLayout, MediumDesc, MediumId, MediumKind, PhaseDesc, SpectrumDesc,
};
use spectrum::{MeasuredMedium, measured_media};

use super::build::Build;
use super::nanovdb;
use super::params::{Params, Type};
use super::spectra::Role;
use super::state::{Entity, NamedEntity};
use crate::{source, suggest};

/// Most points of a grid along an axis.
const MOST_POINTS: u32 = 1 << 16;

impl Build<'_, '_> {
    pub(super) fn media(&mut self, media: Vec<NamedEntity>) {
        for NamedEntity { name, entity } in media {
            let Some((kind, place)) = self.medium_kind(&entity) else { continue };
            let phase = PhaseDesc::HenyeyGreenstein(self.asymmetry(&entity.params));
            entity.params.report_unused(&format!("medium \"{}\"", entity.kind), self.report);
            let world_from_medium = self.fixed(&entity.ctm, "a medium", entity.span).start() * place;
            let id = MediumId(u32::try_from(self.scene.media.len()).unwrap_or(u32::MAX));
            self.media.insert(name.clone(), id);
            self.scene.media.push(MediumDesc { name, kind, phase, world_from_medium, span: entity.span });
        }
    }

    /// What it is, and where its own space lies in that of the file.
    fn medium_kind(&mut self, entity: &Entity) -> Option<(MediumKind, Transform)> {
        let kind = match entity.kind.as_str() {
            "homogeneous" => Some(self.homogeneous(&entity.params)),
            "uniformgrid" => self.uniform_grid(entity),
            "rgbgrid" => self.rgb_grid(entity),
            "cloud" => Some(self.cloud(&entity.params)),
            "nanovdb" => return self.nanovdb(entity),
            "heterogeneous" => {
                let old = "medium type \"heterogeneous\"";
                super::parser::old_syntax(self.report, entity.span, old, "\"uniformgrid\"");
                None
            }
            name => {
                let names = ["homogeneous", "uniformgrid", "rgbgrid", "cloud", "nanovdb"];
                let hint = suggest::hint(name, &names);
                self.refuse(entity.span, format!("unknown medium type \"{name}\""), hint)
            }
        };
        kind.map(|kind| (kind, Transform::IDENTITY))
    }

    /// The grids "density" and, if it is there, "temperature" of a file.
    fn nanovdb(&mut self, entity: &Entity) -> Option<(MediumKind, Transform)> {
        let p = &entity.params;
        let Some((name, span)) = p.string_opt("filename", self.report) else {
            let hint = "add \"string filename\" \"….nvdb\"";
            return self.refuse(entity.span, "medium \"nanovdb\" has no \"filename\"", hint);
        };
        let path = self.resolve(&name);
        let file = match source::read(&path) {
            Ok(file) => file,
            Err(e) => {
                return self.refuse(span, format!("{} cannot be read: {e}", path.display()), e.hint());
            }
        };
        self.hashes.push(file.hash);
        let grids = ["density", "temperature"].map(|name| nanovdb::grid(&file.bytes, name));
        let (density, heat) = match grids {
            [Ok(Some(density)), Ok(heat)] => (density, heat),
            [Ok(None), _] => {
                let message = format!("{} has no grid \"density\"", path.display());
                return self.refuse(
                    span,
                    message,
                    "pbrt asks for grids by the names density and temperature",
                );
            }
            [Err(e), _] | [_, Err(e)] => {
                return self.refuse(span, format!("{}: {e}", path.display()), "is it the right file?");
            }
        };
        let (sigma_a, sigma_s) = self.coefficients(p);
        let factor = p.float("Lescale", 1.0, self.report);
        let (offset, heat_scale) = self.temperature_scale(p);
        let emission = heat.map_or(GridEmission::None, |heat| {
            let kelvin = density.sampled(&heat);
            GridEmission::Temperature { kelvin, offset, scale: heat_scale, factor }
        });
        let layout =
            GridLayout { resolution: density.resolution, bounds: density.bounds(), border: GridBorder::Zero };
        let scale = self.factor(p, "scale");
        let place = density.place;
        let density = density.values.into();
        Some((MediumKind::Grid { layout, density, sigma_a, sigma_s, scale, emission }, place))
    }

    /// What temperatures are shifted and multiplied by.
    fn temperature_scale(&mut self, p: &Params) -> (f32, f32) {
        let old_offset = p.float("temperaturecutoff", 0.0, self.report);
        let offset = p.float("temperatureoffset", old_offset, self.report);
        (offset, p.float("temperaturescale", 1.0, self.report))
    }

    fn homogeneous(&mut self, p: &Params) -> MediumKind {
        let (sigma_a, sigma_s) = self.coefficients(p);
        let le = self.spectrum(p, "Le", Role::Illuminant);
        let le_scale = p.float("Lescale", 1.0, self.report);
        MediumKind::Homogeneous { sigma_a, sigma_s, le, scale: self.factor(p, "scale"), le_scale }
    }

    fn uniform_grid(&mut self, entity: &Entity) -> Option<MediumKind> {
        let p = &entity.params;
        let layout = self.layout(p);
        let (sigma_a, sigma_s) = self.coefficients(p);
        let density = self.values(entity, "density", &layout)?;
        if density.is_none() {
            let message = "medium \"uniformgrid\" needs \"density\"";
            return self.refuse(entity.span, message, "one value for each of nx * ny * nz points");
        }
        let le = self.spectrum(p, "Le", Role::Illuminant);
        let le_scale = self.values(entity, "Lescale", &layout)?;
        let kelvin = self.values(entity, "temperature", &layout)?;
        let (offset, scale) = self.temperature_scale(p);
        if let (Some(_), Some(_)) = (&le, &kelvin) {
            let message = "medium \"uniformgrid\" has both \"Le\" and \"temperature\"";
            return self.refuse(entity.span, message, "only one of them can say what glows");
        }
        let emission = match (le, kelvin) {
            (_, Some(kelvin)) => GridEmission::Temperature { kelvin, offset, scale, factor: 1.0 },
            (Some(le), None) => GridEmission::Spectrum { le, scale: le_scale, factor: 1.0 },
            (None, None) => GridEmission::None,
        };
        let scale = self.factor(p, "scale");
        Some(MediumKind::Grid { layout, density: density?, sigma_a, sigma_s, scale, emission })
    }

    fn rgb_grid(&mut self, entity: &Entity) -> Option<MediumKind> {
        let p = &entity.params;
        let layout = self.layout(p);
        let sigma_a = self.colors(entity, "sigma_a", &layout)?;
        let sigma_s = self.colors(entity, "sigma_s", &layout)?;
        let le = self.colors(entity, "Le", &layout)?;
        if sigma_a.is_none() && (sigma_s.is_none() || le.is_some()) {
            let what = if le.is_some() { "\"sigma_a\"" } else { "\"sigma_a\" or \"sigma_s\"" };
            let message = format!("medium \"rgbgrid\" needs {what}");
            return self.refuse(entity.span, message, "one colour for each of nx * ny * nz points");
        }
        let le_scale = p.float("Lescale", 1.0, self.report);
        let scale = self.factor(p, "scale");
        Some(MediumKind::RgbGrid { layout, sigma_a, sigma_s, le, space: p.space, scale, le_scale })
    }

    fn cloud(&mut self, p: &Params) -> MediumKind {
        let bounds = self.layout(p).bounds;
        let (sigma_a, sigma_s) = self.coefficients(p);
        MediumKind::Cloud {
            bounds,
            density: self.factor(p, "density"),
            wispiness: self.factor(p, "wispiness"),
            frequency: p.float("frequency", 5.0, self.report),
            sigma_a,
            sigma_s,
        }
    }

    /// Absorption and scattering; one where nothing is given.
    fn coefficients(&mut self, p: &Params) -> (SpectrumDesc, SpectrumDesc) {
        self.preset(p).unwrap_or_else(|| {
            let mut coefficient =
                |name| self.spectrum(p, name, Role::Unbounded).unwrap_or(SpectrumDesc::Constant(1.0));
            (coefficient("sigma_a"), coefficient("sigma_s"))
        })
    }

    fn layout(&mut self, p: &Params) -> GridLayout {
        let resolution = ["nx", "ny", "nz"].map(|n| p.count(n, 1, 1..=MOST_POINTS, self.report));
        let corner = |name, default, report: &mut _| p.vec3(name, Type::Point3, default, report);
        let bounds = [corner("p0", Vec3::ZERO, self.report), corner("p1", Vec3::ONE, self.report)];
        GridLayout { resolution, bounds, border: GridBorder::Zero }
    }

    /// Numbers on a grid. The outer `None` is an error.
    #[allow(clippy::option_option, reason = "wrong, or not there")]
    fn values(
        &mut self,
        entity: &Entity,
        name: &'static str,
        layout: &GridLayout,
    ) -> Option<Option<Arc<[f32]>>> {
        let Some(param) = entity.params.find(name, &[Type::Float]) else { return Some(None) };
        self.check_length(param.floats().len(), 1, (param.span, name), layout)?;
        Some(Some(param.floats().into()))
    }

    /// Colours on a grid. The outer `None` is an error.
    #[allow(clippy::option_option, reason = "wrong, or not there")]
    fn colors(
        &mut self,
        entity: &Entity,
        name: &'static str,
        layout: &GridLayout,
    ) -> Option<Option<Arc<[[f32; 3]]>>> {
        let Some(param) = entity.params.find(name, &[Type::Rgb]) else { return Some(None) };
        self.check_length(param.floats().len(), 3, (param.span, name), layout)?;
        Some(Some(param.floats().as_chunks::<3>().0.into()))
    }

    fn check_length(
        &mut self,
        n: usize,
        each: usize,
        (span, name): (scene_desc::Span, &str),
        layout: &GridLayout,
    ) -> Option<()> {
        let [x, y, z] = layout.resolution.map(|r| r as usize);
        let expected = x.saturating_mul(y).saturating_mul(z).saturating_mul(each);
        if n == expected {
            return Some(());
        }
        let message = format!("\"{name}\" has {n} numbers, and {x} x {y} x {z} points need {expected}");
        self.refuse(span, message, "\"nx\", \"ny\" and \"nz\" say how many points there are")
    }

    /// A number that is not negative; one if it is not given.
    fn factor(&mut self, p: &Params, name: &'static str) -> f32 {
        let value = p.float(name, 1.0, self.report);
        self.check(p, name, (value, value >= 0.0), "at least 0");
        value
    }

    fn asymmetry(&mut self, p: &Params) -> f32 {
        let g = p.float("g", 0.0, self.report);
        self.check(p, "g", (g, g.abs() < 1.0), "between -1 and 1");
        g
    }

    fn check(&mut self, p: &Params, name: &str, (value, fits): (f32, bool), expected: &str) {
        if !fits {
            let at = p.span_of(name).unwrap_or_default();
            self.report.error(at, format!("\"{name}\" is {value}")).hint(format!("expected {expected}"));
        }
    }

    /// Absorption and scattering by a substance's name.
    fn preset(&mut self, p: &Params) -> Option<(SpectrumDesc, SpectrumDesc)> {
        let (name, span) = p.string_opt("preset", self.report)?;
        if let Some(MeasuredMedium { sigma_s: s, sigma_a: a, .. }) =
            measured_media().iter().find(|m| m.name == name)
        {
            return Some((SpectrumDesc::srgb(*a), SpectrumDesc::srgb(*s)));
        }
        let names: Vec<_> = measured_media().iter().map(|m| m.name).collect();
        self.report.warning(span, format!("unknown preset \"{name}\"")).hint(format!(
            "\"sigma_a\" and \"sigma_s\" are used, as in pbrt; {}",
            suggest::hint(&name, &names)
        ));
        None
    }
}
