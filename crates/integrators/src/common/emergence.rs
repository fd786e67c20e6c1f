//! Where light that enters a surface leaves it again: places are drawn by a diffusion profile, along probing rays [King2013].
//!
//! A line is drawn parallel to one of three axes, at a distance from the point that the profile of one lane gives; of the
//! surfaces of the same material that it meets one is taken. The density is a mixture over axes and lanes, so that walls that
//! stand askew are found by the axis that faces them. The choice of one of n surfaces is paid for by n: which line was drawn
//! needs no place in the mixture, as its weights add up to one for every place.

use math::{Dir, Frame, Ray, Vec3, trig};
use sampling::Sampler;
use sampling::distribution::{chances, choose};
use scatter::DiffusionProfile;
use scene::{Scene, Shading, SurfaceInteraction, Surroundings, lane_weights};
use spectrum::{Spectrum, Wavelengths};

use crate::Counters;

/// A place where light emerges.
pub(crate) struct Emergence {
    /// Its `wo` points inside.
    pub(crate) si: SurfaceInteraction,
    pub(crate) shading: Shading,
    /// What the path carries is multiplied by it.
    pub(crate) factor: Spectrum,
}

/// The surface that light enters, and what it enters from.
pub(crate) struct Entrance<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) si: &'a SurfaceInteraction,
    pub(crate) around: &'a Surroundings,
    /// What the path carries.
    pub(crate) carried: Spectrum,
}

/// Chances of the normal and of both tangents.
const AXES: [f32; 3] = [0.5, 0.25, 0.25];
/// Surfaces along a probing ray that are looked at.
const MOST: u32 = 1000;

impl Entrance<'_> {
    /// A place drawn for light that enters; `None` if the probe meets nothing.
    pub(crate) fn emerge(
        &self,
        sampler: &mut Sampler,
        wl: &mut Wavelengths,
        counters: &mut Counters,
    ) -> Option<Emergence> {
        let (u_axis, u_lane, u_which) = (sampler.next_1d(), sampler.next_1d(), sampler.next_1d());
        let [u_radius, u_angle] = sampler.next_2d();
        let profile = self.scene.diffusion(self.si, wl)?;
        let frame = Frame::from_normal(self.si.ng);
        let axes = [frame.n.0, frame.s, frame.t];
        let lanes = chances(lane_weights(self.carried * profile.albedo(), wl))?;
        let ((axis, _), (lane, _)) = (choose(AXES, u_axis), choose(lanes, u_lane));

        // The line, as far as the profile reaches.
        let (radius, reach) = (profile.sample(lane, u_radius), profile.reach(lane));
        let half = trig::safe_sqrt(reach * reach - radius * radius);
        if half <= 0.0 {
            return None;
        }
        let (sin, cos) = trig::sin_cos(std::f32::consts::TAU * u_angle);
        let across = axes[(axis + 1) % 3] * cos + axes[(axis + 2) % 3] * sin;
        let start = self.si.p + across * radius + axes[axis] * half;
        let probe = Ray { t_max: 2.0 * half, ..Ray::new(start, Dir(-axes[axis]), self.si.time) };
        let (found, n) = self.probe(probe, u_which, counters)?;

        let pdf = self.pdf(&profile, (&axes, &lanes), &found);
        let distance = (found.p - self.si.p).length();
        let si = SurfaceInteraction { wo: -found.ng, ..found };
        let (shading, leaving) = self.scene.emergence(&si, self.around, wl)?;
        let factor = profile.eval(distance) * (leaving * n as f32 / pdf);
        factor.is_finite().then_some(Emergence { si, shading, factor })
    }

    /// One of the surfaces of the same material along a ray, and how many there are.
    fn probe(&self, mut ray: Ray, mut u: f32, counters: &mut Counters) -> Option<(SurfaceInteraction, u32)> {
        let (mut chosen, mut n) = (None, 0);
        for _ in 0..MOST {
            counters.rays += 1;
            let Some(hit) = self.scene.intersect(&ray) else { break };
            let si = self.scene.interaction(&ray, &hit);
            if si.material == self.si.material {
                n += 1;
                // Each new one takes the place with chance 1/n; what is left of the number is as even as it was.
                let chance = 1.0 / n as f32;
                if u < chance {
                    chosen = Some(si);
                    u /= chance;
                } else {
                    u = (u - chance) / (1.0 - chance);
                }
            }
            ray = Ray { t_max: ray.t_max - hit.t, ..si.spawn_ray(ray.dir) };
        }
        chosen.map(|si| (si, n))
    }

    /// Density per area with which a place is found, but for the choice among those of a line.
    fn pdf(
        &self,
        profile: &DiffusionProfile,
        (axes, lanes): (&[Vec3; 3], &[f32; 4]),
        found: &SurfaceInteraction,
    ) -> f32 {
        let d = found.p - self.si.p;
        let squared = d.length_squared();
        let mut sum = 0.0;
        for (axis, chance) in axes.iter().zip(AXES) {
            let along = d.dot(*axis);
            let radius = trig::safe_sqrt(squared - along * along);
            let cos = found.ng.0.dot(*axis).abs();
            for (lane, of_lane) in lanes.iter().enumerate().filter(|(_, c)| **c > 0.0) {
                let reach = profile.reach(lane);
                if squared < reach * reach {
                    sum += chance * of_lane * cos * profile.pdf_area(lane, radius).value();
                }
            }
        }
        sum
    }
}
