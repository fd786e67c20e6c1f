//! Media and their phase functions. Coefficients are `sigma_t · scale` split by `albedo`.

use std::sync::Arc;

use math::{Transform, Vec3};
use scene_desc::{
    ColorSpaceName, GridBorder, GridEmission, GridLayout, MediumDesc, MediumId, MediumKind, PhaseDesc,
    PhasePart, SpectrumDesc, WrapMode,
};

use super::build::Build;
use super::text;
use super::tree::{Class, Node, NodeId, Value};
use super::volumes::{Grid, Volume};
use crate::suggest;

const NAMES: [&str; 2] = ["homogeneous", "heterogeneous"];
const PHASES: [&str; 10] = [
    "blendphase",
    "hg",
    "isotropic",
    "kkay",
    "microflake",
    "mixturephase",
    "rayleigh",
    "sggx",
    "tabphase",
    "tabphase_polarized",
];
/// How often a grid that repeats is laid out, on each side of the origin of its space.
const REPEATS: u32 = 4;
const MOST_REPEATED_POINTS: u64 = 1 << 23;

/// A kind of medium in its place.
type Made = (MediumKind, Transform);

fn colour(rgb: [f32; 3]) -> SpectrumDesc {
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        SpectrumDesc::Constant(rgb[0])
    } else {
        SpectrumDesc::srgb(rgb)
    }
}

fn times(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| a[i] * b[i])
}

fn rest(albedo: [f32; 3]) -> [f32; 3] {
    albedo.map(|a| (1.0 - a).max(0.0))
}

impl<'t> Build<'t, '_, '_> {
    /// The medium of a node, made once.
    pub(super) fn medium(&mut self, id: NodeId) -> Option<MediumId> {
        let node = self.tree.node(id);
        if node.class != Class::Medium {
            return self.refuse(node.span, format!("{} is no medium", node.title()), "expected a medium");
        }
        if let Some(found) = self.media.get(&id) {
            return Some(*found);
        }
        let (kind, world_from_medium) = self.medium_kind(node);
        let mut phase = PhaseDesc::Isotropic;
        for (_, child, _) in self.children(node) {
            match child.class {
                Class::Phase => phase = self.phase(child),
                Class::Volume => {}
                _ => self.misplaced(child, node),
            }
        }
        self.unused(node);
        let name = node.id.clone().unwrap_or_default();
        self.scene.media.push(MediumDesc { name, kind, phase, world_from_medium, span: node.span });
        let medium = MediumId(u32::try_from(self.scene.media.len() - 1).unwrap_or(u32::MAX));
        self.media.insert(id, medium);
        Some(medium)
    }

    fn medium_kind(&mut self, node: &'t Node) -> Made {
        node.accept(&["sample_emitters", "has_spectral_extinction", "method", "strategy", "step_size"]);
        if !NAMES.contains(&node.kind.as_str()) {
            self.unknown(node, &NAMES);
            return (MediumKind::Unsupported(node.kind.clone()), Transform::IDENTITY);
        }
        if node.has("emission") {
            self.report
                .warning(node.span_of("emission"), "\"emission\" of media is not supported")
                .hint("it does not glow");
            node.accept(&["emission"]);
        }
        let scale = self.float(node, "scale", 1.0);
        if let Some((sigma_a, sigma_s)) = self.old_coefficients(node) {
            return (homogeneous(sigma_a, sigma_s, scale), Transform::IDENTITY);
        }
        // Version 0.x calls what varies "density".
        let name = if node.has("density") { "density" } else { "sigma_t" };
        let sigma_t = self.volume(node, name, 1.0);
        let albedo = self.volume(node, "albedo", 0.75);
        match (sigma_t, albedo) {
            (Volume::Constant(sigma_t), Volume::Constant(albedo)) => (
                homogeneous(times(sigma_t, rest(albedo)), times(sigma_t, albedo), scale),
                Transform::IDENTITY,
            ),
            (Volume::Grid { grid, world_from_grid, wrap }, Volume::Constant(albedo)) => {
                self.warn_of_repetition(node, wrap);
                let place = world_from_grid;
                if grid.is_grey {
                    let density = grid.values.iter().map(|v| v[0]).collect();
                    let (sigma_a, sigma_s) = (colour(rest(albedo)), colour(albedo));
                    let emission = GridEmission::None;
                    let layout = layout(grid.resolution);
                    return (MediumKind::Grid { layout, density, sigma_a, sigma_s, scale, emission }, place);
                }
                (coloured(&grid, scale, |_, v| (times(v, rest(albedo)), times(v, albedo))), place)
            }
            (
                Volume::Grid { grid, world_from_grid, wrap },
                Volume::Grid { grid: a, world_from_grid: to_a, .. },
            ) => {
                self.warn_of_repetition(node, wrap);
                let a_from_grid = to_a.inverse() * world_from_grid;
                let kind = coloured(&grid, scale, |p, v| {
                    let albedo = a.at(a_from_grid.point(math::Point(p)).0);
                    (times(v, rest(albedo)), times(v, albedo))
                });
                (kind, world_from_grid)
            }
            (Volume::Constant(sigma_t), Volume::Grid { grid, world_from_grid, wrap }) => {
                let (grid, around) = self.laid_out(node, grid, wrap);
                let kind = coloured(&grid, scale, |_, albedo| {
                    (times(sigma_t, rest(albedo)), times(sigma_t, albedo))
                });
                (kind, world_from_grid * around)
            }
        }
    }

    /// `sigma_a` and `sigma_s`, or the name of a measured material: version 0.x.
    fn old_coefficients(&mut self, node: &'t Node) -> Option<([f32; 3], [f32; 3])> {
        if node.has("sigma_a") || node.has("sigma_s") {
            return Some((self.coefficient(node, "sigma_a", 0.0), self.coefficient(node, "sigma_s", 0.0)));
        }
        let name = self.string(node, "material")?;
        let media = spectrum::measured_media();
        match media.iter().find(|m| m.name.eq_ignore_ascii_case(&name)) {
            Some(m) => Some((m.sigma_a, m.sigma_s)),
            None => {
                let names: Vec<_> = media.iter().map(|m| m.name).collect();
                let message = format!("no medium \"{}\" is known", text::show(&name));
                self.refuse(node.span_of("material"), message, suggest::hint(&name, &names))
            }
        }
    }

    fn warn_of_repetition(&mut self, node: &Node, wrap: WrapMode) {
        if wrap != WrapMode::Clamp {
            self.report
                .warning(node.span, "a medium whose density repeats is not supported")
                .hint("it is there once, and nothing around it");
        }
    }

    /// A grid that goes on for ever, as far as it is laid out here, and its place.
    fn laid_out(&mut self, node: &Node, grid: Grid, wrap: WrapMode) -> (Grid, Transform) {
        let n = u64::from(2 * REPEATS).pow(3) * grid.values.len() as u64;
        let side = if n <= MOST_REPEATED_POINTS { 2 * REPEATS } else { 1 };
        let (first, last) = (-f64::from(side / 2), f64::from(side - side / 2));
        let hint = format!("it is laid out from {first} to {last} of its own space, and nothing is beyond");
        self.report.warning(node.span, "an even medium with an albedo that varies has no end").hint(hint);
        let [x, y, z] = grid.resolution.map(|r| r as usize);
        let s = side as usize;
        let mut values = Vec::with_capacity(grid.values.len() * s * s * s);
        let old = |i: usize, n: usize| match wrap {
            WrapMode::Repeat => i % n,
            WrapMode::Mirror => {
                let k = (i + s / 2 * n) % (2 * n);
                k.min(2 * n - 1 - k)
            }
            WrapMode::Clamp | WrapMode::Black => i.saturating_sub(s / 2 * n).min(n - 1),
        };
        for k in 0..z * s {
            for j in 0..y * s {
                values.extend((0..x * s).map(|i| grid.values[(old(k, z) * y + old(j, y)) * x + old(i, x)]));
            }
        }
        let resolution = grid.resolution.map(|r| r * side);
        let place = Transform::scale(math::DVec3::splat(f64::from(side))).unwrap_or_default();
        (Grid { resolution, values, ..grid }, Transform::translate(math::DVec3::splat(first)) * place)
    }

    fn phase(&mut self, node: &'t Node) -> PhaseDesc {
        let made = match node.kind.as_str() {
            "isotropic" => PhaseDesc::Isotropic,
            "rayleigh" => PhaseDesc::Rayleigh,
            "hg" => {
                let g = self.float(node, "g", 0.8);
                if !(-1.0..=1.0).contains(&g) || g.abs() == 1.0 {
                    self.report.error(node.span_of("g"), format!("\"g\" is {g}")).hint("expected −1 to 1");
                }
                PhaseDesc::HenyeyGreenstein(g)
            }
            "blendphase" => self.blend_phase(node),
            name if PHASES.contains(&name) => {
                self.unsupported(node, "light scatters evenly in all directions");
                PhaseDesc::Isotropic
            }
            _ => {
                self.unknown(node, &PHASES);
                PhaseDesc::Isotropic
            }
        };
        self.unused(node);
        made
    }
}

impl<'t> Build<'t, '_, '_> {
    /// `weight` is the share of the second; blends within blends are written out.
    fn blend_phase(&mut self, node: &'t Node) -> PhaseDesc {
        let mut shares = [0.5; 2];
        if node.find("weight").is_some_and(|p| matches!(p.value, Value::Object(_) | Value::Ref(_))) {
            match self.volume(node, "weight", 0.5) {
                Volume::Constant([w, ..]) => shares = [1.0 - w, w],
                Volume::Grid { .. } => {
                    self.report
                        .warning(
                            node.span_of("weight"),
                            "a blend of phase functions that varies is not supported",
                        )
                        .hint("they are blended half and half");
                }
            }
        } else {
            let w = self.float(node, "weight", 0.5);
            if !(0.0..=1.0).contains(&w) {
                self.report
                    .error(node.span_of("weight"), format!("\"weight\" is {w}"))
                    .hint("expected 0 to 1");
            }
            shares = [1.0 - w, w];
        }
        let mut phases = Vec::new();
        for (_, child, _) in self.children(node) {
            match child.class {
                Class::Phase => phases.push(self.phase(child)),
                Class::Volume | Class::Texture => {}
                _ => self.misplaced(child, node),
            }
        }
        if phases.len() != 2 {
            self.report
                .error(node.span, format!("a blend of {} phase functions", phases.len()))
                .hint("expected two <phase> elements in it");
            return PhaseDesc::Isotropic;
        }
        let mut parts = Vec::new();
        for (share, phase) in shares.into_iter().zip(phases) {
            match phase {
                PhaseDesc::Blend(inner) => {
                    parts.extend(inner.into_iter().map(|p| PhasePart { weight: p.weight * share, ..p }));
                }
                phase => parts.push(PhasePart { weight: share, phase }),
            }
        }
        if parts.len() > PhaseDesc::MOST_PARTS {
            self.report
                .warning(node.span, format!("a blend of {} phase functions is not supported", parts.len()))
                .hint(format!("light scatters as by the first {} of them", PhaseDesc::MOST_PARTS));
            parts.truncate(PhaseDesc::MOST_PARTS);
        }
        PhaseDesc::Blend(parts)
    }
}

fn homogeneous(sigma_a: [f32; 3], sigma_s: [f32; 3], scale: f32) -> MediumKind {
    let (sigma_a, sigma_s) = (colour(sigma_a), colour(sigma_s));
    MediumKind::Homogeneous { sigma_a, sigma_s, le: None, scale, le_scale: 1.0 }
}

fn layout(resolution: [u32; 3]) -> GridLayout {
    GridLayout { resolution, bounds: [Vec3::ZERO, Vec3::ONE], border: GridBorder::Clamp }
}

/// A grid with absorption and scattering of its own at each point, by the point's place and value.
fn coloured(grid: &Grid, scale: f32, f: impl Fn(Vec3, [f32; 3]) -> ([f32; 3], [f32; 3])) -> MediumKind {
    let n = grid.resolution.map(|r| r as usize);
    let place = |i: usize| {
        let at = [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
        Vec3::from_array(std::array::from_fn(|k| (at[k] as f32 + 0.5) / n[k] as f32))
    };
    let both: Vec<_> = grid.values.iter().enumerate().map(|(i, v)| f(place(i), *v)).collect();
    let sigma_a: Arc<[[f32; 3]]> = both.iter().map(|b| b.0).collect();
    let sigma_s: Arc<[[f32; 3]]> = both.iter().map(|b| b.1).collect();
    MediumKind::RgbGrid {
        layout: layout(grid.resolution),
        sigma_a: Some(sigma_a),
        sigma_s: Some(sigma_s),
        le: None,
        space: ColorSpaceName::Srgb,
        scale,
        le_scale: 1.0,
    }
}
