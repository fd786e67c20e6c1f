//! Virtual lights: vertices of light paths on matt surfaces, each of which shines on what it sees [Keller1997].

use scatter::{Bsdf, LobeFlags, TransportMode};
use scene::{Scene, Shading, SurfaceInteraction, Surroundings, segment};
use spectrum::Spectrum;

use crate::common::{Keeper, LightPath, Site, Tools, scatter_at};

/// A virtual light.
#[derive(Clone, Debug)]
pub(super) struct VirtualLight {
    pub(super) si: SurfaceInteraction,
    pub(super) shading: Shading,
    /// Times the number of paths.
    power: Spectrum,
    /// Scattering events before it.
    pub(super) depth: u32,
    /// Its path carries its hero wavelength alone.
    pub(super) is_terminated: bool,
}

/// Is it matt, perhaps under a smooth coat: no lobe that is narrow but no delta?
pub(super) fn is_matt(bsdf: &Bsdf) -> bool {
    let matt = LobeFlags::DIFFUSE_REFLECTION | LobeFlags::DIFFUSE_TRANSMISSION;
    let flags = bsdf.flags();
    flags.intersects(matt) && flags.is_within(matt | LobeFlags::SPECULAR)
}

/// The most that a matt surface may reflect or transmit from one direction to another, per steradian: its `f` for
/// light along the normal, on the brighter side. Exact for Lambert's law; a coat lets most through along the normal;
/// rough matt surfaces may reflect somewhat more at grazing angles.
pub(super) fn most_f(shading: &Shading, wo: math::Dir, mode: TransportMode) -> Spectrum {
    let (frame, n) = (&shading.frame, math::LocalDir::new(0.0, 0.0, 1.0));
    let wo = frame.to_local(wo);
    let f = |n| shading.bsdf.eval(wo, n, mode);
    Spectrum(f(n).0.max(f(-n).0))
}

impl VirtualLight {
    /// The most that it sends per steradian and cosine: what clusters are chosen by.
    pub(super) fn intensity(&self) -> f32 {
        (self.power * most_f(&self.shading, self.si.wo, TransportMode::Importance)).max_component()
    }
}

/// How strongly near virtual lights may count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    /// Most of `|cos cos'| / d²`; infinite without a bound.
    pub(super) most: f32,
}

impl Bound {
    /// The share of the light between two places that counts: `min(1, most / G)`.
    pub(super) fn share(self, from: (&SurfaceInteraction, &Shading), to: &SurfaceInteraction) -> f32 {
        let d = to.p - from.0.p;
        let distance_squared = d.length_squared();
        let cosines = from.1.frame.n.0.dot(d).abs() * to.ng.0.dot(d).abs();
        let g = cosines / (distance_squared * distance_squared);
        if g <= self.most { 1.0 } else { self.most / g }
    }
}

/// A surface that virtual lights shine on.
#[derive(Clone, Copy)]
pub(super) struct Receiver<'a> {
    pub(super) scene: &'a Scene,
    pub(super) si: &'a SurfaceInteraction,
    pub(super) shading: &'a Shading,
    /// What the path came through to it.
    pub(super) around: Surroundings,
    pub(super) bound: Bound,
}

impl Receiver<'_> {
    /// What it sends on of a virtual light, times the number of paths.
    pub(super) fn reflected(&self, light: &VirtualLight, tools: &mut Tools<'_>) -> Spectrum {
        let (y, z) = (&light.si, self.si);
        let d = y.p - z.p;
        let distance_squared = d.length_squared();
        let w = math::Dir(d / distance_squared.sqrt());
        let f = scatter_at(z, self.shading, w, TransportMode::Radiance);
        if f.is_black() {
            return Spectrum::ZERO;
        }
        let share = self.bound.share((z, self.shading), y);
        let sent = scatter_at(y, &light.shading, -w, TransportMode::Importance) * light.power;
        let value = f * sent * (share / distance_squared);
        if value.is_black() || !value.is_finite() {
            return Spectrum::ZERO;
        }
        tools.counters.rays += 1;
        let (from, to) = (z.spawn_ray(w).origin, y.spawn_ray(-w).origin);
        let around = self.scene.surroundings_after(z, w, &self.around);
        let sampler = &mut *tools.sampler;
        let ray = segment(from, to, z.time);
        value * self.scene.transmittance(&ray, &around, tools.wl, &mut || sampler.next_1d())
    }
}

/// Keeps virtual lights.
#[derive(Debug, Default)]
pub(super) struct VirtualLights(pub(super) Vec<VirtualLight>);

impl Keeper for VirtualLights {
    fn keep(&mut self, path: &LightPath<'_>) {
        for v in &path.walk.vertices {
            let Site::Surface { si, shading } = &v.site else { continue };
            if !is_matt(&shading.bsdf) {
                continue;
            }
            let is_terminated = path.wl.is_terminated();
            let depth = v.events.saturating_sub(1);
            let (si, shading) = (*si, shading.clone());
            let light = VirtualLight { si, shading, power: v.throughput, depth, is_terminated };
            if light.intensity() > 0.0 {
                self.0.push(light);
            }
        }
    }

    fn bytes(&self) -> u64 {
        (self.0.len() * (size_of::<VirtualLight>() + super::tree::BYTES_PER_LIGHT)) as u64
    }

    fn append(&mut self, mut later: Self) {
        self.0.append(&mut later.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_virtual_light_costs_what_is_said() {
        let bytes = size_of::<VirtualLight>() + super::super::tree::BYTES_PER_LIGHT;
        assert_eq!(bytes, 512, "what the parameter's text and docs/performance.md say");
    }
}
