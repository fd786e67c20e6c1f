//! `MakeNamedMedium`.
//!
//! Coefficients by name are measured values in 1/mm, for R, G, B, of [Jensen2001] and [Narasimhan2006], as pbrt-v4
//! lists them.

use scene_desc::{MediumDesc, MediumId, MediumKind, PhaseDesc, SpectrumDesc};
use spectrum::{MeasuredMedium, measured_media};

use super::build::Build;
use super::params::Params;
use super::spectra::Role;
use super::state::{Entity, NamedEntity};
use crate::suggest;

impl Build<'_, '_> {
    pub(super) fn media(&mut self, media: Vec<NamedEntity>) {
        for NamedEntity { name, entity } in media {
            let Some(kind) = self.medium_kind(&entity) else { continue };
            self.report
                .warning(entity.span, format!("medium \"{name}\" is not rendered yet"))
                .hint("it is treated as empty space");
            let id = MediumId(u32::try_from(self.scene.media.len()).unwrap_or(u32::MAX));
            self.media.insert(name.clone(), id);
            self.scene.media.push(MediumDesc { name, kind, span: entity.span });
        }
    }

    fn medium_kind(&mut self, entity: &Entity) -> Option<MediumKind> {
        match entity.kind.as_str() {
            "homogeneous" => Some(self.homogeneous(&entity.params)),
            "uniformgrid" | "rgbgrid" | "cloud" | "nanovdb" => {
                Some(MediumKind::Unsupported(entity.kind.clone()))
            }
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
        }
    }

    fn homogeneous(&mut self, p: &Params) -> MediumKind {
        let (sigma_a, sigma_s) = match self.preset(p) {
            Some(both) => both,
            None => {
                let mut coefficient =
                    |name| self.spectrum(p, name, Role::Unbounded).unwrap_or(SpectrumDesc::Constant(1.0));
                (coefficient("sigma_a"), coefficient("sigma_s"))
            }
        };
        let le = self.spectrum(p, "Le", Role::Illuminant);
        let le_scale = p.float("Lescale", 1.0, self.report);
        let scale = p.float("scale", 1.0, self.report);
        let g = p.float("g", 0.0, self.report);
        for (name, value, fits) in [("scale", scale, scale >= 0.0), ("g", g, g.abs() < 1.0)] {
            if !fits {
                let at = p.span_of(name).unwrap_or_default();
                let expected = if name == "g" { "between -1 and 1" } else { "at least 0" };
                self.report.error(at, format!("\"{name}\" is {value}")).hint(format!("expected {expected}"));
            }
        }
        p.report_unused("medium \"homogeneous\"", self.report);
        let phase = PhaseDesc::HenyeyGreenstein(g);
        MediumKind::Homogeneous { sigma_a, sigma_s, le, scale, le_scale, phase }
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
