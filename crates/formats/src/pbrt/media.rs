//! `MakeNamedMedium`.
//!
//! Coefficients by name are measured values in 1/mm, for R, G, B: from [Jensen2001], fig. 5, and [Narasimhan2006],
//! table 1, as pbrt lists them.

use scene_desc::{MediumDesc, MediumId, MediumKind, PhaseDesc, SpectrumDesc};

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
        if let Some((_, s, a)) = PRESETS.iter().find(|x| x.0 == name) {
            return Some((SpectrumDesc::srgb(*a), SpectrumDesc::srgb(*s)));
        }
        let names: Vec<_> = PRESETS.iter().map(|x| x.0).collect();
        self.report.warning(span, format!("unknown preset \"{name}\"")).hint(format!(
            "\"sigma_a\" and \"sigma_s\" are used, as in pbrt; {}",
            suggest::hint(&name, &names)
        ));
        None
    }
}

/// Name, reduced scattering, absorption.
type Preset = (&'static str, [f32; 3], [f32; 3]);

#[rustfmt::skip]
const PRESETS: [Preset; 12] = [
    // [Jensen2001], fig. 5.
    ("Apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046]),
    ("Chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    ("Chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20]),
    ("Cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    ("Ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    ("Marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071]),
    ("Potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12]),
    ("Skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
    ("Skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    ("Skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145]),
    ("Spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0]),
    ("Wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
];
