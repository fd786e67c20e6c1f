//! Integrators: their names, and depths that count one more than ours.

use std::collections::BTreeMap;

use scene_desc::{IntegratorDesc, ParameterValue};

use super::build::Build;
use super::tree::{Class, Node, NodeId, Prop};

const NAMES: [&str; 27] = [
    "adaptive",
    "ao",
    "aov",
    "bdpt",
    "depth",
    "direct",
    "direct_projective",
    "direct_reparam",
    "emission_reparam",
    "erpt",
    "irrcache",
    "mlt",
    "moment",
    "path",
    "photonmapper",
    "ppm",
    "prb",
    "prb_basic",
    "prb_projective",
    "prb_reparam",
    "prbvolpath",
    "pssmlt",
    "ptracer",
    "sppm",
    "stokes",
    "volpath",
    "volpathmis",
];

/// Mitsuba's Russian roulette begins at this depth if the file does not say.
const RR_DEPTH: u32 = 5;

impl<'t> Build<'t, '_, '_> {
    /// The integrator; of a scene without one, an unlimited `path`.
    pub(super) fn integrator(&mut self, children: &[(&'t Prop, &'t Node, NodeId)]) {
        let mut found = children.iter().map(|c| c.1).filter(|n| n.class == Class::Integrator);
        let first = found.next();
        for other in found {
            other.accept_all();
            self.report.warning(other.span, "a second integrator").hint("the first one is used");
        }
        self.scene.integrator =
            IntegratorDesc { max_depth: None, rr_depth: Some(RR_DEPTH), ..IntegratorDesc::default() };
        if let Some(node) = first {
            self.integrator_node(node);
        }
    }

    #[allow(clippy::too_many_lines, reason = "one arm a kind")]
    fn integrator_node(&mut self, node: &'t Node) {
        let mut parameters = BTreeMap::new();
        let mut max_depth = match self.integer_opt(node, "max_depth") {
            Some(n) if n > 0 => Some(u32::try_from(n - 1).unwrap_or(u32::MAX)),
            Some(0) => {
                self.report
                    .warning(node.span_of("max_depth"), "\"max_depth\" 0 renders nothing at all")
                    .hint("what emits is shown");
                Some(0)
            }
            _ => None,
        };
        let rr_depth = self.count(node, "rr_depth", RR_DEPTH, 1..=i64::from(u32::MAX));
        if self.boolean(node, "hide_emitters", false) {
            self.report
                .warning(node.span_of("hide_emitters"), "\"hide_emitters\" is not supported")
                .hint("emitters are shown");
        }
        node.accept(&["block_size", "timeout", "samples_per_pass"]);
        let name = match node.kind.as_str() {
            "path" | "volpath" | "volpathmis" | "prb" | "prb_basic" | "prb_reparam" | "prb_projective"
            | "prbvolpath" | "volpath_simple" => {
                node.accept(&["strict_normals", "use_spectral_mis"]);
                "path"
            }
            "ptracer" => {
                node.accept(&["granularity", "brute_force", "samples_per_pass"]);
                "light"
            }
            "direct" | "direct_reparam" | "direct_projective" => {
                max_depth = Some(1);
                node.accept(&["strict_normals"]);
                self.direct(node, &mut parameters)
            }
            "bdpt" => {
                node.accept(&["light_image", "sample_direct"]);
                "bdpt"
            }
            "mlt" | "pssmlt" | "erpt" => {
                self.unsupported(node, "our \"mlt\" renders it, with its own parameters");
                "mlt"
            }
            "photonmapper" | "ppm" | "sppm" => {
                self.unsupported(node, "our \"sppm\" renders it, with its own parameters");
                "sppm"
            }
            "irrcache" | "adaptive" | "moment" | "aov" | "stokes" => return self.outer(node),
            "ao" => {
                if let Some(length) = self.float_opt(node, "ray_length").filter(|l| *l > 0.0) {
                    parameters.insert("distance".into(), ParameterValue::Float(length.into()));
                }
                node.accept(&["shading_samples"]);
                "ao"
            }
            name if NAMES.contains(&name) => {
                self.unsupported(node, "\"path\" renders the scene");
                "path"
            }
            _ => {
                self.unknown(node, &NAMES);
                return;
            }
        };
        self.unused(node);
        self.scene.integrator = IntegratorDesc {
            name: name.into(),
            max_depth,
            rr_depth: Some(rr_depth),
            parameters,
            span: node.span,
            ..IntegratorDesc::default()
        };
    }

    /// An integrator around another: that one counts, and what this one adds is written anyway or told.
    fn outer(&mut self, node: &'t Node) {
        let children = self.children(node);
        let inner = children.iter().map(|c| c.1).find(|n| n.class == Class::Integrator);
        if node.kind == "aov" && node.has("aovs") {
            node.accept(&["aovs"]);
            self.report
                .warning(node.span_of("aovs"), "the list of \"aovs\" is not used")
                .hint("EXR files hold the variance");
        }
        if node.kind == "stokes" {
            self.report
                .warning(node.span, "light is not polarised here")
                .hint("the picture has no Stokes vectors");
        }
        node.accept_all();
        match inner {
            Some(inner) => self.integrator_node(inner),
            None => self.unused(node),
        }
    }

    /// Numbers of samples of the two techniques.
    fn direct(&mut self, node: &Node, parameters: &mut BTreeMap<String, ParameterValue>) -> &'static str {
        let both = self.count(node, "shading_samples", 1, 0..=1 << 16);
        let lights = self.count(node, "emitter_samples", both, 0..=1 << 16);
        let bsdfs = self.count(node, "bsdf_samples", both, 0..=1 << 16);
        let sampling = match (lights, bsdfs) {
            (0, 0) => {
                let hint = "\"emitter_samples\" or \"bsdf_samples\" must be above 0";
                self.report.error(node.span, "\"direct\" without samples").hint(hint);
                "mis"
            }
            (_, 0) => "light",
            (0, _) => "bsdf",
            (_, _) => "mis",
        };
        parameters.insert("sampling".into(), ParameterValue::Text(sampling.into()));
        for (name, n) in [("light_samples", lights), ("bsdf_samples", bsdfs)] {
            if n > 1 {
                parameters.insert(name.into(), ParameterValue::Integer(n.into()));
            }
        }
        "direct"
    }
}
