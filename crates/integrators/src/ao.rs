//! Ambient occlusion: how much of the sky above a point is open, `A = (1/π) ∫ V cosθ dω` times an albedo ρ.
//!
//! With N rays, uniform sampling estimates `(2ρ/N) Σ V cosθ`, cosine sampling `(ρ/N) Σ V`. Lights, materials and
//! normals that bend are ignored; borders of media are no obstacle. The value is grey, in spectral mode too.

use math::{Dir, Frame, Ray};
use sampling::{Sampler, warp};
use scene::{Scene, SurfaceInteraction, Surroundings};
use spectrum::{Spectrum, Wavelengths};

use crate::Integrator;
use crate::common::{CameraEstimator, CameraPath, PathOutput, PixelLoop, sampler_of};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters};
use crate::registry::{IntegratorInfo, Making, refuses_media};

/// For the registry.
pub(crate) const INFO: IntegratorInfo = IntegratorInfo {
    name: "ao",
    purpose: "ambient occlusion: how open the sky above each point is; needs no lights",
    misses: "everything but openness: it is no light transport",
    unbiased: true,
    refuses: refuses_media,
    parameters,
    make,
};

fn parameters() -> Vec<ParameterInfo> {
    vec![
        ParameterInfo {
            name: "sampling",
            kind: ParameterKind::Choice(&["cosine", "uniform"]),
            doc: "density of the rays over the hemisphere",
        },
        ParameterInfo { name: "samples", kind: ParameterKind::Integer(1), doc: "rays per camera sample, N" },
        ParameterInfo {
            name: "distance",
            kind: ParameterKind::Float(0.0),
            doc: "what is farther does not occlude, in scene units; 0 for no limit",
        },
        ParameterInfo { name: "albedo", kind: ParameterKind::Float(1.0), doc: "factor on the value, ρ" },
    ]
}

fn make(p: &Parameters, making: &Making<'_>) -> Box<dyn Integrator> {
    let distance = p.float("distance");
    let estimator = AmbientOcclusion {
        uniform: p.text("sampling") == "uniform",
        samples: p.integer("samples").max(1),
        distance: if distance > 0.0 { distance } else { f32::INFINITY },
        albedo: p.float("albedo"),
    };
    Box::new(PixelLoop { estimator, sampler: sampler_of(making.sampler, making.seed) })
}

struct AmbientOcclusion {
    uniform: bool,
    samples: u32,
    distance: f32,
    albedo: f32,
}

impl CameraEstimator for AmbientOcclusion {
    fn radiance(
        &self,
        scene: &Scene,
        path: &mut CameraPath,
        sampler: &mut Sampler,
        out: &mut PathOutput<'_>,
    ) -> Spectrum {
        let mut wl = path.wl;
        path.wl = Wavelengths::RGB;
        let (mut ray, mut around) = (path.ray, scene.camera_surroundings());
        loop {
            out.counters.rays += 1;
            let Some(hit) = scene.intersect(&ray) else { return Spectrum::ZERO };
            let si = scene.interaction(&ray, &hit);
            if scene.shade(&si, &around, &mut wl).is_none() {
                around = scene.surroundings_after(&si, ray.dir, &around);
                ray = si.spawn_ray(ray.dir);
                continue;
            }
            out.counters.rays += u64::from(self.samples);
            let sum: f32 = (0..self.samples).map(|_| self.term(scene, (&si, &around), sampler)).sum();
            let value = self.albedo * sum / self.samples as f32;
            return Spectrum::from_rgb([value; 3]);
        }
    }
}

impl AmbientOcclusion {
    /// `2 V cosθ` or `V` of one ray.
    fn term(
        &self,
        scene: &Scene,
        (si, around): (&SurfaceInteraction, &Surroundings),
        sampler: &mut Sampler,
    ) -> f32 {
        let n: Dir = si.ng.face_forward(si.wo);
        let u = sampler.next_2d();
        let (local, value) = match self.uniform {
            true => {
                let w = warp::uniform_hemisphere(u);
                (w, 2.0 * w.cos_theta())
            }
            false => (warp::cosine_hemisphere(u), 1.0),
        };
        let ray = Ray { t_max: self.distance, ..si.spawn_ray(Frame::from_normal(n).to_world(local)) };
        let around = scene.surroundings_after(si, ray.dir, around);
        if scene.is_blocked(&ray, &around) { 0.0 } else { value }
    }
}
