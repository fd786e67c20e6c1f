//! Density estimation: radiance from the photons around a place [Jensen1996].
//!
//! ```text
//! L(wo) = 1/N Σ f(wo, wi) · |wi·ns| / |wi·ng| · Φ · K(d),
//! ```
//!
//! with photons of power Φ of N light paths at distances d, and a kernel K that integrates to one over a disk of
//! radius r. The factor of cosines makes up for photons being counted by the geometric normal.
//!
//! In a medium the photons of a ball are as many as its scattering coefficient makes collisions [JensenChristensen1998]:
//!
//! ```text
//! ∫ p(wo, wi) L(wi) dwi = 1/N Σ p(wo, wi) · Φ / σs · K(d),
//! ```
//!
//! with the phase function p, σs where the photon is, and a kernel over the ball.
//!
//! | kernel         | K(d) π r²         | K(d) 4/3 π r³      |
//! |----------------|-------------------|--------------------|
//! | `constant`     | 1                 | 1                  |
//! | `cone`         | 3 (1 − d/r)       | 4 (1 − d/r)        |
//! | `epanechnikov` | 2 (1 − d²/r²)     | 5/2 (1 − d²/r²)    |
//!
//! The radius of a search is so many widths of a pixel as the camera sees it at that place, times a factor that
//! depends on the number of the pass alone [Knaus2011]: passes stay pure, and the bias vanishes as they go on. In
//! media it is `medium_radius` times as large. That shrinks faster than would be best deep inside, r³ as passes^(−1/2)
//! for −3/7 at the default α, but near a border a ball lacks photons, and that bias falls with r alone.
//!
//! With the k nearest photons, r is the distance of the k-th, which does not count itself: then a uniform density is
//! estimated without bias. Left out: flattened volumes and normals that must agree; photons beyond an edge or a corner
//! count, and beyond a border of a medium there are none.

use std::collections::BinaryHeap;
use std::f32::consts::PI;

use math::Point;
use scene::Scene;
use spectrum::{Spectrum, Wavelengths};

use super::{Near, Photon, PhotonMap, Vertex};
use crate::parameters::{ParameterInfo, ParameterKind, Parameters};

/// Parameter: see [`Radius`].
pub(crate) const RADIUS: ParameterInfo = ParameterInfo {
    name: "radius",
    kind: ParameterKind::Float(0.0),
    doc: "radius of the search for photons in the first pass, in units of the scene; 0: by radius_pixels",
};

/// Parameter: see [`Radius`].
pub(crate) const RADIUS_PIXELS: ParameterInfo = ParameterInfo {
    name: "radius_pixels",
    kind: ParameterKind::Float(2.5),
    doc: "the same in widths of a pixel at the place of the search",
};

/// Parameter: see [`Radius`].
pub(crate) const MEDIUM_RADIUS: ParameterInfo = ParameterInfo {
    name: "medium_radius",
    kind: ParameterKind::Float(2.0),
    doc: "the same in media, as a multiple of what it would be on a surface there",
};

/// Parameter: see [`Kernel`].
pub(crate) const KERNEL: ParameterInfo = ParameterInfo {
    name: "kernel",
    kind: ParameterKind::Choice(&["epanechnikov", "cone", "constant"]),
    doc: "how photons count by their distance",
};

/// How photons count by their distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kernel {
    Constant,
    Cone,
    Epanechnikov,
}

impl Kernel {
    /// What [`KERNEL`] was set to.
    pub(crate) fn of(p: &Parameters) -> Self {
        match p.text(KERNEL.name) {
            "constant" => Self::Constant,
            "cone" => Self::Cone,
            _ => Self::Epanechnikov,
        }
    }

    /// Per area.
    pub(crate) fn at(self, distance_squared: f32, radius: f32) -> f32 {
        self.shape(distance_squared, radius, [3.0, 2.0]) / disk(radius)
    }

    /// Per volume.
    pub(crate) fn in_ball(self, distance_squared: f32, radius: f32) -> f32 {
        self.shape(distance_squared, radius, [4.0, 2.5]) / ball(radius)
    }

    /// With the greatest values of cone and Epanechnikov's.
    fn shape(self, distance_squared: f32, radius: f32, most: [f32; 2]) -> f32 {
        let x = (distance_squared / (radius * radius)).min(1.0);
        match self {
            Self::Constant => 1.0,
            Self::Cone => most[0] * (1.0 - x.sqrt()),
            Self::Epanechnikov => most[1] * (1.0 - x),
        }
    }
}

/// Area of a disk.
pub(crate) fn disk(radius: f32) -> f32 {
    PI * radius * radius
}

/// Volume of a ball.
pub(crate) fn ball(radius: f32) -> f32 {
    4.0 / 3.0 * PI * radius * radius * radius
}

/// How far photons are searched for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Radius {
    /// Of pass 0, in units of the scene; zero: by pixels.
    initial: f32,
    pixels: f32,
    /// In media, as a multiple.
    in_media: f32,
    /// Exponent α: the variance of all passes together falls with their number as N^−α.
    alpha: f64,
    /// The factor of the present pass.
    shrink: f32,
}

impl Radius {
    /// From [`RADIUS`] and [`RADIUS_PIXELS`]; with `alpha` 1 it is the same in all passes.
    pub(crate) fn of(p: &Parameters, alpha: f32) -> Self {
        let (initial, pixels) = (p.float(RADIUS.name).max(0.0), p.float(RADIUS_PIXELS.name).max(0.0));
        let in_media = p.float(MEDIUM_RADIUS.name).max(0.0);
        Self { initial, pixels, in_media, alpha: f64::from(alpha.clamp(0.0, 1.0)), shrink: 1.0 }
    }

    /// The same for another pass: r²(p) = r²(0) ∏ (k + α) / (k + 1) over k = 1 … p [Knaus2011].
    #[must_use]
    pub(crate) fn for_pass(self, pass: u32) -> Self {
        let product: f64 = (1..=pass).map(f64::from).map(|k| (k + self.alpha) / (k + 1.0)).product();
        Self { shrink: product.sqrt() as f32, ..self }
    }

    /// In units of the scene at a place of a surface: a function of the place alone, however a path came there.
    pub(crate) fn on_surface(&self, scene: &Scene, p: Point, time: f32) -> f32 {
        let initial = match self.initial > 0.0 {
            true => self.initial,
            false => self.pixels * scene.camera.pixel_width(p, time),
        };
        initial * self.shrink
    }

    /// The same in a medium.
    pub(crate) fn in_medium(&self, scene: &Scene, p: Point, time: f32) -> f32 {
        self.on_surface(scene, p, time) * self.in_media
    }

    /// What it is at a vertex.
    pub(crate) fn at(&self, scene: &Scene, vertex: &Vertex) -> f32 {
        match vertex.surface() {
            Some(si) => self.on_surface(scene, si.p, si.time),
            None => self.in_medium(scene, vertex.p(), vertex.time()),
        }
    }
}

/// Light that may have ended its secondary wavelengths before or after it was joined to a path.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    /// With all lanes.
    all: Spectrum,
    /// With the first alone.
    hero: f32,
}

impl Gathered {
    /// With all lanes.
    pub(crate) fn of(all: Spectrum) -> Self {
        Self { all, hero: 0.0 }
    }

    pub(crate) fn add(&mut self, value: Spectrum, is_terminated: bool) {
        match is_terminated {
            true => self.hero += value.lanes()[0],
            false => self.all += value,
        }
    }

    /// Adds `factor` times the other.
    pub(crate) fn add_scaled(&mut self, other: &Self, factor: Spectrum) {
        self.all += other.all * factor;
        self.hero += other.hero * factor.lanes()[0];
    }

    /// What the lanes are to the film, when the path is done: a lane alone stands for all four.
    pub(crate) fn radiance(&self, wl: &Wavelengths) -> Spectrum {
        let hero = if wl.is_terminated() { self.hero } else { 4.0 * self.hero };
        self.all + Spectrum::from_lanes([hero, 0.0, 0.0, 0.0])
    }
}

/// Which photons count at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Search {
    /// All within a radius.
    Radius(f32),
    /// The k nearest within a radius.
    Nearest(usize, f32),
}

/// A density estimate.
#[derive(Clone, Copy)]
pub(crate) struct Estimate<'a> {
    pub(crate) map: &'a PhotonMap,
    pub(crate) kernel: Kernel,
    pub(crate) search: Search,
}

impl Estimate<'_> {
    /// Radiance that leaves `at` back along its walk, of the photons that are wanted. Deltas do not take part.
    pub(crate) fn radiance(
        &self,
        at: &Vertex,
        found: &mut BinaryHeap<Near>,
        is_wanted: impl Fn(&Photon) -> bool,
    ) -> Gathered {
        let mut sum = Gathered::default();
        let mut add = |photon: &Photon, distance_squared: f32, radius: f32| {
            if is_wanted(photon) {
                let weight = match at.surface() {
                    Some(_) => self.kernel.at(distance_squared, radius),
                    None => self.kernel.in_ball(distance_squared, radius),
                };
                sum.add(at.gather(photon.wi) * photon.power() * weight, photon.is_terminated());
            }
        };
        match self.search {
            Search::Radius(radius) => {
                self.map.within(at, radius, |photon, d| add(photon, d, radius));
            }
            Search::Nearest(k, radius) => {
                self.map.nearest(at, k, radius, found);
                let full = found.len() == k;
                let radius =
                    if full { found.pop().map_or(0.0, |last| last.distance_squared.sqrt()) } else { radius };
                for near in found.iter() {
                    add(&self.map.photons.vertices[near.index as usize], near.distance_squared, radius);
                }
            }
        }
        let mut mean = Gathered::default();
        mean.add_scaled(&sum, Spectrum::splat(1.0 / self.map.n_paths.max(1) as f32));
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_integrate_to_one_over_disk_and_ball() {
        let (radius, n) = (0.3_f32, 100_000);
        for kernel in [Kernel::Constant, Kernel::Cone, Kernel::Epanechnikov] {
            let sum: f64 = (0..n)
                .map(|i| {
                    let d = radius * (i as f32 + 0.5) / n as f32;
                    let ring = std::f64::consts::TAU * f64::from(d) * f64::from(radius) / f64::from(n);
                    f64::from(kernel.at(d * d, radius)) * ring
                })
                .sum();
            assert!((sum - 1.0).abs() < 1e-4, "{kernel:?} {sum}");
            let sum: f64 = (0..n)
                .map(|i| {
                    let d = radius * (i as f32 + 0.5) / n as f32;
                    let shell =
                        4.0 * std::f64::consts::PI * f64::from(d * d) * f64::from(radius) / f64::from(n);
                    f64::from(kernel.in_ball(d * d, radius)) * shell
                })
                .sum();
            assert!((sum - 1.0).abs() < 1e-4, "{kernel:?} in a ball {sum}");
        }
    }

    /// r² falls as N^(α − 1) in the end.
    #[test]
    fn the_radius_is_a_function_of_the_pass() {
        let at = |alpha: f64, pass| {
            let r = Radius { initial: 1.0, pixels: 0.0, in_media: 1.0, alpha, shrink: 0.5 }.for_pass(pass);
            f64::from(r.shrink) * f64::from(r.shrink)
        };
        assert_eq!(at(2.0 / 3.0, 0), 1.0);
        assert!((at(0.5, 1) - 0.75).abs() < 1e-6);
        assert!((at(0.5, 2) - 0.75 * 2.5 / 3.0).abs() < 1e-6);
        let slope = (at(2.0 / 3.0, 80_000) / at(2.0 / 3.0, 10_000)).log2() / 3.0;
        assert!((slope + 1.0 / 3.0).abs() < 1e-4, "{slope}");
        assert_eq!(at(1.0, 1000), 1.0);
    }

    #[test]
    fn a_hero_alone_stands_for_four() {
        let mut g = Gathered::default();
        g.add(Spectrum::splat(3.0), true);
        g.add(Spectrum::splat(1.0), false);
        let mut wl = Wavelengths::sample_visible(0.4);
        assert_eq!(g.radiance(&wl).lanes(), [13.0, 1.0, 1.0, 1.0]);
        wl.terminate_secondary();
        assert_eq!(g.radiance(&wl).lanes()[0], 4.0);
    }
}
