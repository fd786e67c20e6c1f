//! A ray from a vertex over surfaces that mirror or refract, with its derivatives by two angles of its direction there: ray
//! differentials [Igehy1999], exact at every surface.
//!
//! With the direction `d`, the index `η` of the near side over the far side, the normal `n` on the near side, `c = −d·n` and
//! `c' = √(1 − η² (1 − c²))`:
//!
//! | what       | direction             | derivative                                  |
//! |------------|-----------------------|---------------------------------------------|
//! | flight     | `p + t d`             | `∂p + t ∂d`, less its part off the surface along `d` |
//! | reflection | `d + 2 c n`           | `∂d + 2 (∂c n + c ∂n)`                      |
//! | refraction | `η d + (η c − c') n`  | `η ∂d + (η ∂c − ∂c') n + (η c − c') ∂n`, `∂c' = η² c ∂c / c'` |
//!
//! with `∂c = −(∂d·n + d·∂n)`. A refraction with `η = 1` goes straight on.

use math::{Dir, Frame, Ray, Vec3};
use sampling::rng::Rng;
use scatter::{BsdfSample, Density, Side, TransportMode};
use scene::{Curvature, Scene, Shading, SurfaceInteraction, Surroundings};
use spectrum::{Spectrum, Wavelengths};

use crate::common::Vertex;

/// Most surfaces of a chain.
pub(crate) const MOST_SURFACES: usize = 8;

/// Surfaces that a ray goes through because they are none, before it is given up.
const MOST_BORDERS: usize = 1000;

/// On which side the chain leaves each of its surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sides {
    sides: [Side; MOST_SURFACES],
    n: usize,
}

/// Where chains start.
#[derive(Clone, Copy)]
pub(super) struct Start<'a> {
    pub(super) scene: &'a Scene,
    pub(super) vertex: &'a Vertex,
    pub(super) wl: Wavelengths,
}

/// What is carried along a chain.
pub(super) struct Carried<'a> {
    pub(super) throughput: Spectrum,
    /// Makes uniform numbers, for media.
    pub(super) u: &'a mut dyn FnMut() -> f32,
}

/// The end of a chain: how the ray leaves its last surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chain {
    pub(super) last: SurfaceInteraction,
    pub(super) dir: Dir,
    /// Derivatives of the point on the last surface and of the direction, by two perpendicular angles at the start.
    pub(super) by_place: [Vec3; 2],
    pub(super) by_dir: [Vec3; 2],
    pub(super) around: Surroundings,
    pub(super) wl: Wavelengths,
}

/// A ray on its way.
struct Beam {
    ray: Ray,
    around: Surroundings,
    by_place: [Vec3; 2],
    by_dir: [Vec3; 2],
    wl: Wavelengths,
}

impl Start<'_> {
    /// The chain along `w` over surfaces that are left on these sides; `None` if there is none.
    pub(super) fn follow(
        &self,
        w: Dir,
        sides: &Sides,
        mut carried: Option<&mut Carried<'_>>,
        rays: &mut u64,
    ) -> Option<Chain> {
        let mut beam = self.beam(w);
        let mut last = None;
        for &side in &sides.sides[..sides.n] {
            let (si, shading, curvature) = beam.fly(self.scene, carried.as_deref_mut(), rays)?;
            let wo = shading.frame.to_local(si.wo);
            let sample = shading.bsdf.specular(wo, side, TransportMode::Radiance)?;
            beam.bend(self.scene, &si, &shading, &curvature, &sample);
            if let (Some(carried), Density::Delta { probability }) = (carried.as_deref_mut(), sample.density)
            {
                carried.throughput *= sample.weight * probability;
            }
            last = Some(si);
        }
        last.map(|last| beam.end(last))
    }

    /// A chain of `n` surfaces along `w`, whose sides are drawn as a walk would draw them.
    pub(super) fn draw(&self, w: Dir, n: usize, rng: &mut Rng, rays: &mut u64) -> Option<(Chain, Sides)> {
        let mut beam = self.beam(w);
        let mut last = None;
        let mut sides = Sides { sides: [Side::Reflection; MOST_SURFACES], n };
        for side in &mut sides.sides[..n] {
            let (si, shading, curvature) = beam.fly(self.scene, None, rays)?;
            let wo = shading.frame.to_local(si.wo);
            let sample = shading.bsdf.sample(wo, rng.next_f32(), [0.5; 2], TransportMode::Radiance)?;
            *side = sample.lobe.side;
            beam.bend(self.scene, &si, &shading, &curvature, &sample);
            last = Some(si);
        }
        last.map(|last| (beam.end(last), sides))
    }

    fn beam(&self, w: Dir) -> Beam {
        let frame = Frame::from_normal(w);
        Beam {
            ray: self.vertex.spawn_ray(w),
            around: self.vertex.surroundings_towards(self.scene, w),
            by_place: [Vec3::ZERO; 2],
            by_dir: [frame.s, frame.t],
            wl: self.wl,
        }
    }
}

impl Beam {
    /// To the next surface, which must be one that a chain may pass.
    fn fly(
        &mut self,
        scene: &Scene,
        mut carried: Option<&mut Carried<'_>>,
        rays: &mut u64,
    ) -> Option<(SurfaceInteraction, Shading, Curvature)> {
        for _ in 0..MOST_BORDERS {
            *rays += 1;
            let hit = scene.intersect(&self.ray)?;
            if let (Some(carried), Some(medium)) = (carried.as_deref_mut(), self.around.medium()) {
                let piece = Ray { t_max: hit.t, ..self.ray };
                let passed = scene.media.pass(medium, &piece, &self.wl, &mut || (carried.u)());
                carried.throughput *= passed.factor;
            }
            for (by_place, by_dir) in self.by_place.iter_mut().zip(self.by_dir) {
                *by_place += by_dir * hit.t;
            }
            let si = scene.interaction(&self.ray, &hit);
            if let Some(shading) = scene.shade(&si, &self.around, &mut self.wl) {
                let curvature = scene.curvature(&self.ray, &hit)?;
                return shading.bsdf.is_delta_only().then_some((si, shading, curvature));
            }
            self.around = scene.surroundings_after(&si, self.ray.dir, &self.around);
            self.ray = si.spawn_ray(self.ray.dir);
        }
        None
    }

    /// Mirrors or refracts.
    fn bend(
        &mut self,
        scene: &Scene,
        si: &SurfaceInteraction,
        shading: &Shading,
        curvature: &Curvature,
        sample: &BsdfSample,
    ) {
        let d = self.ray.dir.0;
        let off = si.ng.0.dot(d);
        let n = shading.frame.n.face_forward(si.wo);
        let sign = if shading.frame.n.dot(si.wo) < 0.0 { -1.0 } else { 1.0 };
        let c = -d.dot(n.0);
        for (by_place, by_dir) in self.by_place.iter_mut().zip(&mut self.by_dir) {
            *by_place -= d * (si.ng.0.dot(*by_place) / off);
            let by_n = curvature.along(*by_place) * sign;
            let by_c = -(by_dir.dot(n.0) + d.dot(by_n));
            *by_dir = match sample.lobe.side {
                Side::Reflection => *by_dir + 2.0 * (by_c * n.0 + c * by_n),
                Side::Transmission => {
                    let eta = 1.0 / sample.eta;
                    let far = (1.0 - eta * eta * (1.0 - c * c)).max(0.0).sqrt();
                    let by_far = eta * eta * c * by_c / far;
                    eta * *by_dir + (eta * by_c - by_far) * n.0 + (eta * c - far) * by_n
                }
            };
        }
        let w = shading.frame.to_world(sample.wi);
        self.around = scene.surroundings_after(si, w, &self.around);
        self.ray = si.spawn_ray(w);
    }

    fn end(&self, last: SurfaceInteraction) -> Chain {
        let Self { by_place, by_dir, around, wl, .. } = *self;
        Chain { last, dir: self.ray.dir, by_place, by_dir, around, wl }
    }
}
