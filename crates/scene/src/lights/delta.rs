//! Lights without extent: point, spot, projection and distant lights.
//!
//! | light       | intensity                                                      | source             |
//! |-------------|----------------------------------------------------------------|--------------------|
//! | point       | constant                                                       | [PBR4e], sec. 12.2 |
//! | spot        | `smoothstep(cos θ_end, cos θ_start, cos θ)`, or linear in θ    | [PBR4e], sec. 12.2.1 |
//! | projection  | the slide's pixel at the direction's perspective projection    | [PBR4e], sec. 12.2.2 |
//! | distant     | one direction, from outside of the scene                       | [PBR4e], sec. 12.3 |
//!
//! Emission directions follow the intensity: the spot's falloff is inverted (its integral over cos θ is a quartic),
//! images are sampled by their pixels.

use std::f32::consts::TAU;

use math::{Dir, Frame, LocalDir, Point, Vec3, trig};
use sampling::distribution::{PiecewiseConstant2D, Sample2D};
use sampling::{Pdf, SolidAngle};
use scene_desc::SpotFalloff;
use spectrum::{Spectrum, Wavelengths};

use super::emission::{Emission, ImageEmission};
use crate::linear_map::{AffineMap, LinearMap};

/// From one point, evenly.
#[derive(Clone, Debug)]
pub(crate) struct PointLight {
    pub(super) p: Point,
    pub(super) intensity: Emission,
}

/// From one point, in a cone.
#[derive(Clone, Debug)]
pub(crate) struct SpotLight {
    pub(super) p: Point,
    pub(super) frame: Frame,
    /// Here the falloff starts, and here it ends.
    pub(super) cos_start: f32,
    pub(super) cos_end: f32,
    pub(super) falloff: SpotFalloff,
    pub(super) intensity: Emission,
}

/// How intensity depends on the angle to the axis, besides the slide.
#[derive(Clone, Copy, Debug)]
pub(super) enum Profile {
    /// Not at all.
    Even,
    /// `1 / cos³ θ`: even irradiance on a plane across the axis.
    Plane,
    /// Linear in the angle from `start` (radians) to zero at `end`.
    Cone {
        /// Full up to here.
        start: f32,
        /// Nothing from here.
        end: f32,
    },
}

impl Profile {
    /// For the tangent of the angle to the axis.
    pub(super) fn at(self, tan: f32) -> f32 {
        match self {
            Self::Even => 1.0,
            Self::Plane => {
                let s = (1.0 + tan * tan).sqrt();
                s * s * s
            }
            Self::Cone { start, end } => linear_falloff(trig::atan(tan), start, end),
        }
    }
}

/// One up to `start`, zero from `end`, a straight line between.
fn linear_falloff(angle: f32, start: f32, end: f32) -> f32 {
    if angle <= start {
        return 1.0;
    }
    if angle >= end { 0.0 } else { (end - angle) / (end - start) }
}

/// A slide projector.
#[derive(Clone, Debug)]
pub(crate) struct ProjectionLight {
    pub(super) world_from_light: AffineMap,
    pub(super) slide: ImageEmission,
    pub(super) profile: Profile,
    /// Half extent of the slide on the plane z = 1.
    pub(super) half: [f32; 2],
    /// Over the slide, by pixel times its solid angle; its integral is the power.
    pub(super) distribution: PiecewiseConstant2D,
}

/// Parallel light.
#[derive(Clone, Debug)]
pub(crate) struct DistantLight {
    /// Towards the light.
    pub(super) to_light: Dir,
    /// On a surface that faces it.
    pub(super) irradiance: Emission,
}

impl SpotLight {
    /// Of the cosine to the axis.
    fn falloff(&self, cos: f32) -> f32 {
        if self.falloff == SpotFalloff::Linear {
            return linear_falloff(
                trig::safe_acos(cos),
                trig::safe_acos(self.cos_start),
                trig::safe_acos(self.cos_end),
            );
        }
        if cos <= self.cos_end {
            return 0.0;
        }
        if cos >= self.cos_start {
            return 1.0;
        }
        let x = (cos - self.cos_end) / (self.cos_start - self.cos_end);
        x * x * (3.0 - 2.0 * x)
    }

    pub(super) fn intensity(&self, w: Dir, wavelengths: &Wavelengths) -> Spectrum {
        let falloff = self.falloff(self.frame.n.dot(w));
        if falloff == 0.0 { Spectrum::ZERO } else { self.intensity.value(wavelengths) * falloff }
    }

    /// Masses of the even part and of the falloff, in the cosine.
    fn masses(&self) -> [f32; 2] {
        let falling = match self.falloff {
            SpotFalloff::Smooth => 0.5 * (self.cos_start - self.cos_end),
            SpotFalloff::Linear => {
                // ∫ (θe − θ) sin θ dθ / (θe − θs).
                let [s, e] = [self.cos_start, self.cos_end].map(trig::safe_acos);
                let sines = trig::sin(e) - trig::sin(s);
                if e > s { (self.cos_start - sines / (e - s)).max(0.0) } else { 0.0 }
            }
        };
        [1.0 - self.cos_start, falling]
    }

    /// ∫ falloff dω.
    pub(super) fn solid_angle(&self) -> f32 {
        TAU * (self.masses()[0] + self.masses()[1])
    }

    /// A direction in proportion to a smooth falloff; for a linear one, even over the cone.
    pub(super) fn sample_direction(&self, u: [f32; 2]) -> Dir {
        let [even, falling] = self.masses();
        let x = u[0] * (even + falling);
        let cos = match self.falloff {
            SpotFalloff::Linear => 1.0 - u[0] * (1.0 - self.cos_end),
            SpotFalloff::Smooth if x < even => 1.0 - x,
            SpotFalloff::Smooth => {
                self.cos_end + (self.cos_start - self.cos_end) * sample_smoothstep(1.0 - (x - even) / falling)
            }
        };
        let sin = trig::safe_sqrt((1.0 - cos) * (1.0 + cos));
        let (sin_phi, cos_phi) = trig::sin_cos(TAU * u[1]);
        self.frame.to_world(LocalDir::new(sin * cos_phi, sin * sin_phi, cos))
    }

    pub(super) fn pdf_direction(&self, w: Dir) -> Pdf<SolidAngle> {
        let cos = self.frame.n.dot(w);
        match self.falloff {
            SpotFalloff::Smooth => Pdf::new(self.falloff(cos) / self.solid_angle()),
            SpotFalloff::Linear if cos > self.cos_end => Pdf::new(1.0 / (TAU * (1.0 - self.cos_end))),
            SpotFalloff::Linear => Pdf::ZERO,
        }
    }
}

/// x with density 6x² − 4x³ (twice the smoothstep) on [0, 1]: the root of `x³ (2 − x) = u` by safe Newton steps.
fn sample_smoothstep(u: f32) -> f32 {
    let (mut lo, mut hi, mut x) = (0.0_f32, 1.0_f32, u);
    for _ in 0..32 {
        let f = x * x * x * (2.0 - x) - u;
        if f < 0.0 {
            lo = x
        } else {
            hi = x
        }
        let slope = x * x * (6.0 - 4.0 * x);
        let next = x - f / slope;
        let next = if next > lo && next < hi { next } else { 0.5 * (lo + hi) };
        if (next - x).abs() < 1e-7 {
            return next;
        }
        x = next;
    }
    x
}

impl ProjectionLight {
    pub(super) fn p(&self) -> Point {
        Point(self.world_from_light.origin)
    }

    /// Where a direction of light space meets the slide, v down.
    fn uv(&self, w: Vec3) -> Option<[f32; 2]> {
        let uv = [0.5 + 0.5 * w.x / (w.z * self.half[0]), 0.5 - 0.5 * w.y / (w.z * self.half[1])];
        (w.z > 1e-3 && uv.iter().all(|x| (0.0..1.0).contains(x))).then_some(uv)
    }

    pub(super) fn intensity(&self, w: Dir, wavelengths: &Wavelengths) -> Spectrum {
        let (local, _) = to_light(&self.world_from_light.linear, w);
        let tan = |v: Vec3| (v.x * v.x + v.y * v.y).sqrt() / v.z;
        self.uv(local.0)
            .map_or(Spectrum::ZERO, |uv| self.slide.eval(uv, wavelengths) * self.profile.at(tan(local.0)))
    }

    /// A direction by the slide's pixels.
    pub(super) fn sample_direction(&self, u: [f32; 2]) -> Dir {
        let Sample2D { p, .. } = self.distribution.sample(u);
        let local =
            Vec3::new((2.0 * p[0] - 1.0) * self.half[0], (1.0 - 2.0 * p[1]) * self.half[1], 1.0).normalize();
        Dir::normalize(self.world_from_light.linear.apply(local))
    }

    pub(super) fn pdf_direction(&self, w: Dir) -> Pdf<SolidAngle> {
        let (local, ratio) = to_light(&self.world_from_light.linear, w);
        let Some(uv) = self.uv(local.0) else { return Pdf::ZERO };
        // dω = cos³ θ dA on the plane z = 1.
        let cos = local.0.z;
        let p = self.distribution.pdf(uv).value() / (self.slide_area() * cos * cos * cos);
        Pdf::new(p * ratio)
    }

    /// On the plane z = 1.
    pub(super) fn slide_area(&self) -> f32 {
        4.0 * self.half[0] * self.half[1]
    }
}

/// A world direction in light space, and solid angle there over solid angle here.
pub(super) fn to_light(world_from_light: &LinearMap, w: Dir) -> (Dir, f32) {
    let v = world_from_light.apply_inverse(w.0);
    let length = v.length();
    (Dir(v / length), world_from_light.inverse_solid_angle_ratio(length))
}

/// A point of the closed unit square in the half-open one.
pub(super) fn inside(uv: [f32; 2]) -> [f32; 2] {
    uv.map(|x| x.clamp(0.0, 1.0_f32.next_down()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_spot_s_power_is_its_integral() {
        let spot = |falloff| {
            let (cos_start, cos_end) = (trig::cos(0.3), trig::cos(0.5));
            let wavelengths = spectrum::ColorPipeline::default();
            let white = scene_desc::Illuminant {
                spectrum: scene_desc::SpectrumDesc::srgb([1.0; 3]),
                scale: 1.0,
                normalize: false,
            };
            let mut sink = scene_desc::Sink::default();
            let intensity = Emission::new(&white, 1.0, wavelengths, scene_desc::Span::NONE, &mut sink);
            let frame = Frame::from_normal(Dir(Vec3::Z));
            SpotLight { p: Point(Vec3::ZERO), frame, cos_start, cos_end, falloff, intensity }
        };
        for falloff in [SpotFalloff::Linear, SpotFalloff::Smooth] {
            let spot = spot(falloff);
            let n = 20_000;
            let cos = |i: usize| 1.0 - (i as f32 + 0.5) / n as f32 * (1.0 - spot.cos_end);
            let mean: f64 =
                (0..n).map(|i| f64::from(spot.falloff(cos(i)))).sum::<f64>() / f64::from(n as u32);
            let integral = TAU * (1.0 - spot.cos_end) * mean as f32;
            assert!((integral / spot.solid_angle() - 1.0).abs() < 1e-3, "{falloff:?}");
        }
    }

    #[test]
    fn the_smoothstep_is_inverted_to_the_last_digits() {
        for i in 0..=1000 {
            let u = i as f32 / 1000.0;
            let x = sample_smoothstep(u);
            assert!((x * x * x * (2.0 - x) - u).abs() < 1e-6, "{u}: {x}");
        }
    }
}
