//! Lights: what they send to a point, what they emit along rays, with all densities.
//!
//! | kind                                              | file       |
//! |---------------------------------------------------|------------|
//! | point, spot, projection, distant                  | `delta`    |
//! | goniometric: an image, or a photometric file      | `goniometric`, `ies`, `web` |
//! | infinite, even or by an image                     | `infinite` |
//! | the same through a window                         | `portal`   |
//! | emitting triangle, sphere, disk, cylinder, patch  | `area`, `emitter/` |
//! | the same in motion                                | `moving`   |
//!
//! Semantics, units and normalisation are pbrt-v4's [PBR4e, ch. 12]. Every emitting triangle of a mesh is a light of
//! its own. Densities leave out the choice of the light (see [`crate::LightSelector`]).
//!
//! Departs from pbrt-v4: lights under maps that scale unevenly have right densities; parts of spheres and rings
//! are sampled exactly; a light of zero power is there but never chosen.
//! Left out: motion of lights that are no surfaces (the first key's place counts, as in pbrt-v4; the builder says so),
//! cut-outs of emitters by alpha textures (the caller multiplies the sample with the alpha at its `uv`).

mod area;
mod bounds;
mod builder;
mod delta;
mod emission;
mod emitter;
mod goniometric;
mod ies;
mod infinite;
mod moving;
mod outgoing;
mod patches;
mod portal;
mod projection;
mod sample;
mod source;
mod web;

use math::{Bounds, Dir, Point, Vec2, Vec3};
use sampling::{Pdf, SolidAngle, warp};
use scatter::Density;
use spectrum::{Spectrum, Wavelengths};

use crate::{LightContext, LightId, SurfaceInteraction};

use area::AreaLight;
pub use area::LightPlace;
pub(crate) use bounds::LightBounds;
pub(crate) use builder::AreaEmission;
pub use builder::LightsBuilder;
use delta::{DistantLight, PointLight, ProjectionLight, SpotLight};
use emission::Emission;
pub use emission::LightImage;
use goniometric::GoniometricLight;
use infinite::{InfiniteConstant, InfiniteImage};
use moving::MovingLight;
use portal::PortalLight;
pub(crate) use portal::Side;
pub use sample::{EmissionSample, LightSample};
pub use source::{EmitterGeometry, EmitterSource};

/// All lights of a scene, by [`LightId`].
#[derive(Clone, Debug, Default)]
pub struct Lights {
    list: Vec<Light>,
    /// Shared by the triangles of a mesh.
    emissions: Vec<Emission>,
    power: Vec<f32>,
    infinite: Vec<LightId>,
    world: WorldSphere,
    /// Around all that emits at finite places.
    finite: Option<(Point, f32)>,
}

/// The kinds of light.
#[derive(Clone, Debug)]
enum Light {
    /// Emits nothing: a triangle without area, a black light. Keeps the ids of its neighbours in order.
    Dark,
    Point(PointLight),
    Spot(SpotLight),
    Goniometric(Box<GoniometricLight>),
    Projection(Box<ProjectionLight>),
    Distant(DistantLight),
    InfiniteConstant(InfiniteConstant),
    InfiniteImage(Box<InfiniteImage>),
    Portal(Box<PortalLight>),
    Area(AreaLight),
    Moving(Box<MovingLight>),
}

/// The sphere around the scene, from whose disks distant light comes.
#[derive(Clone, Copy, Debug, Default)]
struct WorldSphere {
    center: Point,
    radius: f32,
}

impl Lights {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// None at all?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// All ids in order.
    pub fn ids(&self) -> impl Iterator<Item = LightId> + use<> {
        (0..self.list.len() as u32).map(LightId)
    }

    /// The lights that shine from infinity onto rays that leave the scene (distant lights are not among them:
    /// no ray finds a single direction).
    #[must_use]
    pub fn infinite(&self) -> &[LightId] {
        &self.infinite
    }

    /// Emitted power, in the units of R, G and B's mean; of light from infinity, what passes the sphere around the
    /// scene. Zero only for lights that emit nothing. Of a light with an image under a map that scales unevenly, an
    /// estimate (as if the map kept angles).
    #[must_use]
    pub fn power(&self, light: LightId) -> f32 {
        self.power[light.index()]
    }

    /// Does it have neither extent nor solid angle, so that only sampling the light finds it?
    #[must_use]
    pub fn is_delta(&self, light: LightId) -> bool {
        match &self.list[light.index()] {
            Light::Dark
            | Light::Point(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::Distant(_) => true,
            Light::InfiniteConstant(_) | Light::InfiniteImage(_) | Light::Portal(_) => false,
            Light::Area(a) => !a.visible,
            Light::Moving(m) => !m.area.visible,
        }
    }

    /// Does its light come from outside of the scene: a distant or an infinite light that emits?
    #[must_use]
    pub fn is_from_infinity(&self, light: LightId) -> bool {
        match &self.list[light.index()] {
            Light::Distant(_) | Light::InfiniteConstant(_) | Light::InfiniteImage(_) | Light::Portal(_) => {
                self.power(light) > 0.0
            }
            Light::Dark
            | Light::Point(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::Area(_)
            | Light::Moving(_) => false,
        }
    }

    /// The plane before which alone points get light of an infinite light through a portal: see [`Side`].
    pub(crate) fn portal_side(&self, light: LightId) -> Option<Side> {
        match &self.list[light.index()] {
            Light::Portal(l) => Some(l.side()),
            Light::Dark
            | Light::Point(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::Distant(_)
            | Light::InfiniteConstant(_)
            | Light::InfiniteImage(_)
            | Light::Area(_)
            | Light::Moving(_) => None,
        }
    }

    /// Light that may reach the context's point; `None` where the light sends none along the direction that `u` gives.
    #[inline]
    #[must_use]
    pub fn sample(
        &self,
        light: LightId,
        context: &LightContext,
        u: [f32; 2],
        wavelengths: &Wavelengths,
    ) -> Option<LightSample> {
        let kind = &self.list[light.index()];
        let sample = if let Light::Area(l) = kind {
            l.sample(&self.emissions, light, context.p, u, wavelengths)
        } else {
            self.sample_of(kind, (light, context), u, wavelengths)
        };
        sample.filter(|s| !s.li.is_black())
    }

    /// [`Lights::sample`] of a light of any kind, not inlined; black ones too.
    #[inline(never)]
    fn sample_of(
        &self,
        kind: &Light,
        (light, context): (LightId, &LightContext),
        u: [f32; 2],
        wavelengths: &Wavelengths,
    ) -> Option<LightSample> {
        let from = context.p;
        match kind {
            Light::Dark => None,
            Light::Point(l) => self.sample_point(light, from, l.p, |_| l.intensity.value(wavelengths)),
            Light::Spot(l) => self.sample_point(light, from, l.p, |w| l.intensity(w, wavelengths)),
            Light::Goniometric(l) => self.sample_point(light, from, l.p(), |w| l.intensity(w, wavelengths)),
            Light::Projection(l) => self.sample_point(light, from, l.p(), |w| l.intensity(w, wavelengths)),
            Light::Distant(l) => {
                let density = Density::Delta { probability: 1.0 };
                Some(self.sample_infinity(
                    light,
                    from,
                    (l.to_light, l.irradiance.value(wavelengths)),
                    density,
                ))
            }
            Light::InfiniteConstant(l) => {
                let density = Density::Smooth(warp::uniform_sphere_pdf());
                let wi = warp::uniform_sphere(u);
                Some(self.sample_infinity(light, from, (wi, l.radiance.value(wavelengths)), density))
            }
            Light::InfiniteImage(l) => {
                let (wi, li, pdf) = l.sample(Some(context), u, wavelengths)?;
                Some(self.sample_infinity(light, from, (wi, li), Density::Smooth(pdf)))
            }
            Light::Portal(l) => {
                let (wi, li, pdf) = l.sample(from, u, wavelengths)?;
                Some(self.sample_infinity(light, from, (wi, li), Density::Smooth(pdf)))
            }
            Light::Area(l) => l.sample(&self.emissions, light, from, u, wavelengths),
            Light::Moving(l) => {
                let s = l.sample(from, context.time, u)?;
                l.area.seen(&self.emissions, light, &s, (from, wavelengths))
            }
        }
    }

    /// Density with which [`Lights::sample`] chooses the direction `wi`, in which the light's surface is met at `p`
    /// with normal `n` (both count for surfaces alone). Zero for lights that only sampling finds.
    #[must_use]
    pub fn pdf(&self, light: LightId, context: &LightContext, p: Point, n: Dir, wi: Dir) -> Pdf<SolidAngle> {
        match &self.list[light.index()] {
            Light::Dark
            | Light::Point(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::Distant(_) => Pdf::ZERO,
            Light::InfiniteConstant(_) => warp::uniform_sphere_pdf(),
            Light::InfiniteImage(l) => l.pdf(Some(context), wi),
            Light::Portal(l) => l.pdf(context.p, wi),
            Light::Area(l) if l.visible => l.emitter.pdf(context.p, p, n),
            Light::Moving(l) if l.area.visible => l.pdf(context.p, (p, n), context.time),
            Light::Area(_) | Light::Moving(_) => Pdf::ZERO,
        }
    }

    /// Radiance that an emitting surface sends along `w_out` from where its normal is `n`.
    #[must_use]
    pub fn emitted(
        &self,
        light: LightId,
        n: Dir,
        uv: Vec2,
        w_out: Dir,
        wavelengths: &Wavelengths,
    ) -> Spectrum {
        match &self.list[light.index()] {
            Light::Area(l) => l.emitted(&self.emissions, n, uv, w_out, wavelengths),
            Light::Moving(l) => l.area.emitted(&self.emissions, n, uv, w_out, wavelengths),
            Light::Dark
            | Light::Point(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::Distant(_)
            | Light::InfiniteConstant(_)
            | Light::InfiniteImage(_)
            | Light::Portal(_) => Spectrum::ZERO,
        }
    }

    /// Radiance that a surface that was hit sends back along the ray; black if it is no light.
    #[must_use]
    pub fn emitted_at(&self, si: &SurfaceInteraction, wavelengths: &Wavelengths) -> Spectrum {
        si.light.map_or(Spectrum::ZERO, |l| self.emitted(l, si.ng, si.uv, si.wo, wavelengths))
    }

    /// Radiance of an infinite light from the direction `w` (away from the scene), at the point from where the straight
    /// line that leaves the scene began: where the path last scattered, or its eye.
    #[must_use]
    pub fn infinite_emitted(
        &self,
        light: LightId,
        from: Point,
        w: Dir,
        wavelengths: &Wavelengths,
    ) -> Spectrum {
        match &self.list[light.index()] {
            Light::InfiniteConstant(l) => l.radiance.value(wavelengths),
            Light::InfiniteImage(l) => l.radiance(w, wavelengths),
            Light::Portal(l) => l.radiance(from, w, wavelengths),
            Light::Dark
            | Light::Point(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::Distant(_)
            | Light::Area(_)
            | Light::Moving(_) => Spectrum::ZERO,
        }
    }

    /// Radiance of all infinite lights from the direction `w` at a point; see [`Lights::infinite_emitted`].
    #[must_use]
    pub fn background(&self, from: Point, w: Dir, wavelengths: &Wavelengths) -> Spectrum {
        self.infinite.iter().map(|&l| self.infinite_emitted(l, from, w, wavelengths)).sum()
    }

    /// The sphere around the scene: its centre and radius.
    #[must_use]
    pub fn world_sphere(&self) -> (Point, f32) {
        (self.world.center, self.world.radius)
    }

    /// Sets the scene's extent and what depends on it.
    fn finish(&mut self, scene_bounds: Bounds) {
        let (center, radius) =
            if scene_bounds.is_empty() { (Point::default(), 1.0) } else { scene_bounds.bounding_sphere() };
        self.world = WorldSphere { center, radius: radius.max(f32::MIN_POSITIVE) };
        self.power = self.ids().map(|l| self.compute_power(l)).collect();
        self.infinite = self
            .ids()
            .filter(|l| {
                let light = &self.list[l.index()];
                matches!(light, Light::InfiniteConstant(_) | Light::InfiniteImage(_) | Light::Portal(_))
            })
            .collect();
        let bounds = self.ids().filter_map(|l| self.light_bounds(l)).map(|b| b.bounds).reduce(Bounds::union);
        self.finite = bounds.map(|b| b.bounding_sphere());
    }

    /// A sample of a light at the point `p` with intensity by direction (away from the light).
    fn sample_point(
        &self,
        light: LightId,
        from: Point,
        p: Point,
        intensity: impl Fn(Dir) -> Spectrum,
    ) -> Option<LightSample> {
        let d = p - from;
        let distance_squared = d.length_squared();
        if distance_squared == 0.0 {
            return None;
        }
        let wi = Dir(d / distance_squared.sqrt());
        Some(LightSample {
            light,
            li: intensity(-wi) / distance_squared,
            wi,
            p,
            p_error: Vec3::ZERO,
            n: -wi,
            uv: Vec2::ZERO,
            density: Density::Delta { probability: 1.0 },
            is_infinite: false,
        })
    }

    fn sample_infinity(
        &self,
        light: LightId,
        from: Point,
        (wi, li): (Dir, Spectrum),
        density: Density,
    ) -> LightSample {
        // Twice the diameter is outside, wherever in the scene the point is.
        let p = from + wi.0 * (2.0 * self.world.radius + from.distance(self.world.center));
        LightSample {
            light,
            li,
            wi,
            p,
            p_error: Vec3::ZERO,
            n: -wi,
            uv: Vec2::ZERO,
            density,
            is_infinite: true,
        }
    }
}
