//! Light that may reach sixteen points: choice of a light, place on it, and the ray there.

use math::lanes::{Columns, Floats, LANES, Mask, PointLanes, Vec3Lanes, in_lane, offset_ray_origin};
use math::{Dir, Point, Vec3};
use scatter::Density;
use spectrum::{Spectrum, Wavelengths};

use crate::scene::SHADOW_EPSILON;
use crate::{LightContext, Scene};

type Column = [f32; LANES];

/// Sixteen points that light shall reach.
#[derive(Clone, Copy)]
pub struct PlaceLanes<F: Floats> {
    /// Where.
    pub at: PointLanes<F>,
    /// Geometric normals.
    pub ng: Vec3Lanes<F>,
    /// Shading normals.
    pub ns: Vec3Lanes<F>,
    /// Moments.
    pub time: F,
}

/// Light that may reach sixteen points: see [`crate::LightSample`].
#[derive(Clone, Copy)]
pub struct LightLanes<F: Floats> {
    /// Where there is any.
    pub found: F::Mask,
    /// Probability with which its light was chosen.
    pub chosen: F,
    /// Incident radiance, of R, G and B.
    pub li: [F; 3],
    /// Towards the light.
    pub wi: Vec3Lanes<F>,
    /// Density of `wi`; of a delta, its probability.
    pub density: F,
    /// Where it is a delta's.
    pub is_delta: F::Mask,
    /// Where on the light.
    pub(crate) at: PointLanes<F>,
    /// Normals of the emitting sides.
    pub(crate) n: Vec3Lanes<F>,
    /// Where it is infinitely far away.
    pub(crate) is_infinite: F::Mask,
}

/// The ends of shadow rays.
#[derive(Clone, Copy)]
pub struct SegmentLanes<F: Floats> {
    /// Where rays start.
    pub origin: Vec3Lanes<F>,
    /// Their directions.
    pub dir: Vec3Lanes<F>,
    /// Where they end.
    pub t_max: F,
}

/// Samples that were had one by one.
#[derive(Default)]
struct Single {
    found: u32,
    is_delta: u32,
    is_infinite: u32,
    chosen: Column,
    density: Column,
    li: Columns,
    wi: Columns,
    p: Columns,
    p_error: Columns,
    n: Columns,
}

impl Scene {
    /// A light sample for each point of `wanted`. `u` are the numbers for the choice and for the place.
    #[inline(always)]
    pub fn sample_light_lanes<F: Floats>(
        &self,
        place: &PlaceLanes<F>,
        wanted: F::Mask,
        (u_choice, u): (F, [F; 2]),
        wl: &Wavelengths,
    ) -> LightLanes<F> {
        let of_one = self.light_selector.only().and_then(|light| self.lights.flat_lamp(light, wl));
        let (mut sample, rest) = match of_one {
            Some(lamp) => {
                let (sample, is_right) = lamp.sample::<F>(place.at.p, u);
                (sample, wanted & !is_right)
            }
            None => (LightLanes::nothing(), wanted),
        };
        if rest.any() {
            let single = self.sample_lights_singly(&Places::of(place, u_choice, u), rest.bits(), wl);
            sample = LightLanes::of_single(&single).or_else(rest, sample);
        }
        sample.found = sample.found & wanted;
        sample
    }

    /// One after the other.
    #[inline(never)]
    fn sample_lights_singly(&self, places: &Places, mut lanes: u32, wl: &Wavelengths) -> Single {
        let mut out = Single::default();
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & (LANES - 1);
            lanes &= lanes - 1;
            let at = |columns: &Columns| in_lane(columns, lane);
            let context = LightContext {
                p: Point(at(&places.p)),
                p_error: Vec3::ZERO,
                ng: Some(Dir(at(&places.ng))),
                ns: Some(Dir(at(&places.ns))),
                time: places.time[lane],
            };
            let u = [places.u[0][lane], places.u[1][lane]];
            // As in a stratum of one.
            let u_choice = places.u_choice[lane].min(1.0 - 0.5 * f32::EPSILON);
            let Some((light, chosen)) = self.light_selector.select(&context, u_choice) else { continue };
            let Some(sample) = self.lights.sample(light, &context, u, wl) else { continue };
            out.found |= 1 << lane;
            out.chosen[lane] = chosen;
            out.density[lane] = match sample.density {
                Density::Smooth(pdf) => pdf.value(),
                Density::Delta { probability } => {
                    out.is_delta |= 1 << lane;
                    probability
                }
            };
            out.is_infinite |= u32::from(sample.is_infinite) << lane;
            for c in 0..3 {
                out.li[c][lane] = sample.li.rgb()[c];
                out.wi[c][lane] = sample.wi.0[c];
                out.p[c][lane] = sample.p.0[c];
                out.p_error[c][lane] = sample.p_error[c];
                out.n[c][lane] = sample.n.0[c];
            }
        }
        out
    }
}

/// Points and numbers in memory.
struct Places {
    p: Columns,
    ng: Columns,
    ns: Columns,
    time: Column,
    u_choice: Column,
    u: [Column; 2],
}

impl Places {
    #[inline(always)]
    fn of<F: Floats>(place: &PlaceLanes<F>, u_choice: F, u: [F; 2]) -> Self {
        let mut out = Self {
            p: place.at.p.stored(),
            ng: place.ng.stored(),
            ns: place.ns.stored(),
            time: [0.0; LANES],
            u_choice: [0.0; LANES],
            u: [[0.0; LANES]; 2],
        };
        place.time.store(&mut out.time);
        u_choice.store(&mut out.u_choice);
        u[0].store(&mut out.u[0]);
        u[1].store(&mut out.u[1]);
        out
    }
}

impl<F: Floats> LightLanes<F> {
    #[inline(always)]
    fn nothing() -> Self {
        let (zero, none) = (F::splat(0.0), F::Mask::from_bits(0));
        let v = Vec3Lanes::new(zero, zero, zero);
        Self {
            found: none,
            chosen: zero,
            li: [zero; 3],
            wi: v,
            density: zero,
            is_delta: none,
            at: PointLanes { p: v, error: v },
            n: v,
            is_infinite: none,
        }
    }

    #[inline(always)]
    fn of_single(s: &Single) -> Self {
        Self {
            found: F::Mask::from_bits(s.found),
            chosen: F::load(&s.chosen),
            li: [F::load(&s.li[0]), F::load(&s.li[1]), F::load(&s.li[2])],
            wi: Vec3Lanes::load(&s.wi),
            density: F::load(&s.density),
            is_delta: F::Mask::from_bits(s.is_delta),
            at: PointLanes { p: Vec3Lanes::load(&s.p), error: Vec3Lanes::load(&s.p_error) },
            n: Vec3Lanes::load(&s.n),
            is_infinite: F::Mask::from_bits(s.is_infinite),
        }
    }

    #[inline(always)]
    fn or_else(self, mask: F::Mask, o: Self) -> Self {
        Self {
            found: (self.found & mask) | (o.found & !mask),
            chosen: self.chosen.or_else(mask, o.chosen),
            li: [
                self.li[0].or_else(mask, o.li[0]),
                self.li[1].or_else(mask, o.li[1]),
                self.li[2].or_else(mask, o.li[2]),
            ],
            wi: self.wi.or_else(mask, o.wi),
            density: self.density.or_else(mask, o.density),
            is_delta: (self.is_delta & mask) | (o.is_delta & !mask),
            at: PointLanes {
                p: self.at.p.or_else(mask, o.at.p),
                error: self.at.error.or_else(mask, o.at.error),
            },
            n: self.n.or_else(mask, o.n),
            is_infinite: (self.is_infinite & mask) | (o.is_infinite & !mask),
        }
    }

    /// A point of a surface of even radiance `li`, drawn with this density per steradian, as seen from `from`: see
    /// `AreaLight::seen`.
    #[inline(always)]
    pub(crate) fn of_lamp(
        from: Vec3Lanes<F>,
        (at, n): (PointLanes<F>, Vec3Lanes<F>),
        density: F,
        (li, two_sided): (Spectrum, bool),
    ) -> Self {
        let zero = F::splat(0.0);
        let (wi, is_apart) = (at.p - from).try_normalize();
        let faces = if two_sided { F::Mask::from_bits(u32::MAX) } else { !n.dot(-wi).le(zero) };
        let emits = F::Mask::from_bits(if li.is_black() { 0 } else { u32::MAX });
        let [r, g, b] = li.rgb();
        Self {
            found: is_apart & faces & emits & zero.lt(density),
            chosen: F::splat(1.0),
            li: [F::splat(r), F::splat(g), F::splat(b)],
            wi,
            density,
            is_delta: F::Mask::from_bits(0),
            at,
            n,
            is_infinite: F::Mask::from_bits(0),
        }
    }

    /// The rays from points to their light samples, just short of the lights: [`Scene::shadow_ray`].
    #[inline(always)]
    pub fn shadow_rays(&self, from: &PlaceLanes<F>) -> SegmentLanes<F> {
        let origin = offset_ray_origin(&from.at, from.ng, self.wi);
        let target = offset_ray_origin(&self.at, self.n, -self.wi);
        let d = target - origin;
        let length = d.dot(d).sqrt();
        let along = Vec3Lanes::new(d.x / length, d.y / length, d.z / length);
        let dir = along.or_else(F::splat(0.0).lt(length), Vec3Lanes::splat(Vec3::Z));
        SegmentLanes {
            origin,
            dir: self.wi.or_else(self.is_infinite, dir),
            t_max: F::splat(f32::INFINITY).or_else(self.is_infinite, length * F::splat(1.0 - SHADOW_EPSILON)),
        }
    }
}
