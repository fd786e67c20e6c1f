//! `Integrator` and `Sampler`: pbrt's names to ours.

use std::collections::BTreeMap;

use scene_desc::{IntegratorDesc, LightSelection, ParameterValue, SamplerDesc};

use super::build::Build;
use super::params::{Params, Type};
use super::state::Entity;
use crate::suggest;

/// Depths beyond that are no limit any more.
const DEEPEST: u32 = 1 << 20;

const INTEGRATORS: [&str; 11] = [
    "ambientocclusion",
    "bdpt",
    "function",
    "lightpath",
    "mlt",
    "path",
    "randomwalk",
    "simplepath",
    "simplevolpath",
    "sppm",
    "volpath",
];

const SAMPLERS: [&str; 7] =
    ["halton", "independent", "paddedsobol", "pmj02bn", "sobol", "stratified", "zsobol"];

impl Build<'_, '_> {
    pub(super) fn integrator(&mut self, integrator: Option<&Entity>) {
        let Some(entity) = integrator else { return };
        let (p, span) = (&entity.params, entity.span);
        let mut parameters = BTreeMap::new();
        let Some(name) = self.integrator_name(entity, &mut parameters) else { return };
        let max_depth =
            (name != "ao").then(|| p.count("maxdepth", 5, 0..=i32::MAX as u32, self.report).min(DEEPEST));
        if p.boolean("regularize", false, self.report) {
            let at = p.span_of("regularize").unwrap_or(span);
            self.report.warning(at, "\"regularize\" is not supported").hint(
                "rough reflections that diffuse light meets stay as sharp as they are; caustics are noisier",
            );
        }
        let light_selection = self.light_selection(p);
        p.report_unused(&format!("integrator \"{}\"", entity.kind), self.report);
        self.scene.integrator = IntegratorDesc {
            name: name.into(),
            max_depth,
            rr_depth: None,
            light_selection,
            parameters,
            span,
        };
    }

    /// Our name for pbrt's, and what is special to the method.
    fn integrator_name(
        &mut self,
        entity: &Entity,
        parameters: &mut BTreeMap<String, ParameterValue>,
    ) -> Option<&'static str> {
        let (p, span) = (&entity.params, entity.span);
        Some(match entity.kind.as_str() {
            "path" | "volpath" => "path",
            "simplepath" => {
                // Both flags change the noise, not the picture.
                p.accept(&[("samplelights", Type::Bool), ("samplebsdf", Type::Bool)]);
                "path"
            }
            "simplevolpath" | "randomwalk" => "path",
            "lightpath" => "light",
            "bdpt" => {
                p.accept(&[("visualizestrategies", Type::Bool), ("visualizeweights", Type::Bool)]);
                "bdpt"
            }
            "mlt" => {
                self.mlt(p, parameters);
                "mlt"
            }
            "sppm" => {
                self.sppm(p, parameters);
                "sppm"
            }
            "ambientocclusion" => {
                let sampling = if p.boolean("cossample", true, self.report) { "cosine" } else { "uniform" };
                parameters.insert("sampling".into(), ParameterValue::Text(sampling.into()));
                if let Some(d) = p.float_opt("maxdistance", self.report) {
                    parameters.insert("distance".into(), ParameterValue::Float(d.into()));
                }
                "ao"
            }
            "function" => {
                p.accept(&[("function", Type::String), ("imagefilename", Type::String)]);
                self.report
                    .warning(span, "integrator \"function\" is not supported")
                    .hint("it tests pbrt's samplers; \"path\" is used");
                "path"
            }
            "directlighting" | "whitted" => {
                let old = format!("integrator \"{}\"", entity.kind);
                super::parser::old_syntax(self.report, span, &old, "\"path\" with \"integer maxdepth\" 1");
                return None;
            }
            name => {
                let hint = suggest::hint(name, &INTEGRATORS);
                self.report.error(span, format!("unknown integrator \"{name}\"")).hint(hint);
                return None;
            }
        })
    }

    fn light_selection(&mut self, p: &Params) -> LightSelection {
        let Some((name, span)) = p.string_opt("lightsampler", self.report) else {
            return LightSelection::default();
        };
        match name.as_str() {
            "uniform" => LightSelection::Uniform,
            "power" => LightSelection::Power,
            "bvh" | "exhaustive" => LightSelection::Spatial,
            _ => {
                let hint = suggest::hint(&name, &["uniform", "power", "bvh", "exhaustive"]);
                self.report.error(span, format!("unknown lightsampler \"{name}\"")).hint(hint);
                LightSelection::default()
            }
        }
    }

    /// Chains of ours last for a pass, of which a render has as many as it is told; only the share of large steps means the
    /// same. Ours need few of them, since every pass has samples of its own.
    fn mlt(&mut self, p: &Params, parameters: &mut BTreeMap<String, ParameterValue>) {
        if let Some(share) = p.float_opt("largestepprobability", self.report) {
            parameters.insert("large_steps".into(), ParameterValue::Float(share.into()));
        }
        p.accept(&[
            ("bootstrapsamples", Type::Integer),
            ("chains", Type::Integer),
            ("mutationsperpixel", Type::Integer),
            ("sigma", Type::Float),
        ]);
    }

    fn sppm(&mut self, p: &Params, parameters: &mut BTreeMap<String, ParameterValue>) {
        // Without one, ours follows from the width of a pixel.
        if let Some(radius) = p.float_opt("radius", self.report) {
            if radius <= 0.0 {
                let at = p.span_of("radius").unwrap_or_default();
                self.report.error(at, format!("\"radius\" is {radius}")).hint("it must be above 0");
            }
            parameters.insert("radius".into(), ParameterValue::Float(radius.into()));
        }
        if let Some((n, _)) = p.integer_opt("photonsperiteration", self.report).filter(|n| n.0 > 0) {
            parameters.insert("photons".into(), ParameterValue::Integer(n.into()));
        }
        p.accept(&[("seed", Type::Integer)]);
    }

    pub(super) fn sampler(&mut self, sampler: Option<&Entity>, seed: Option<i64>) {
        if let Some(seed) = seed {
            self.scene.sampler.seed = seed as u64;
        }
        let Some(entity) = sampler else { return };
        let (p, span) = (&entity.params, entity.span);
        let mut desc = SamplerDesc { span, ..self.scene.sampler.clone() };
        match entity.kind.as_str() {
            "independent" => desc.name = "independent".into(),
            // Low-discrepancy points are all rendered with our Sobol points: they differ in noise only.
            "halton" | "paddedsobol" | "pmj02bn" | "sobol" | "zsobol" => {
                p.accept(&[("randomization", Type::String)]);
                desc.name = "sobol".into();
            }
            "stratified" => {
                p.accept(&[("jitter", Type::Bool)]);
                desc.name = "stratified".into();
                let x = p.count("xsamples", 4, 1..=4096, self.report);
                let y = p.count("ysamples", 4, 1..=4096, self.report);
                (desc.strata, desc.spp) = ([x, y], x * y);
            }
            "02sequence" | "lowdiscrepancy" | "random" | "maxmindist" => {
                let old = format!("sampler \"{}\"", entity.kind);
                super::parser::old_syntax(self.report, span, &old, "\"zsobol\" or \"independent\"");
                return;
            }
            name => {
                let hint = suggest::hint(name, &SAMPLERS);
                self.report.error(span, format!("unknown sampler \"{name}\"")).hint(hint);
                return;
            }
        }
        if desc.name != "stratified" {
            desc.spp = p.count("pixelsamples", 16, 1..=1 << 24, self.report);
        }
        if let Some((seed, _)) = p.integer_opt("seed", self.report) {
            desc.seed = i64::from(seed) as u64;
        }
        p.report_unused(&format!("sampler \"{}\"", entity.kind), self.report);
        self.scene.sampler = desc;
    }
}
