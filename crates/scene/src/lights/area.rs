//! A surface that emits the same radiance in all directions of its side, or of both.

use math::lanes::{Floats, Vec3Lanes};
use math::{Dir, Point, Vec2, Vec3};
use sampling::{Area, Pdf, SolidAngle};
use scatter::Density;
use spectrum::{Spectrum, Wavelengths};

use super::emission::Emission;
use super::emitter::{Emitter, FlatEmitter, SurfaceSample};
use super::{Light, LightSample, Lights};
use crate::LightId;
use crate::wide::LightLanes;

/// A place on an emitting surface.
#[derive(Clone, Copy, Debug)]
pub struct LightPlace {
    /// The point.
    pub p: Point,
    /// Half-size of the box in which the true point lies.
    pub p_error: Vec3,
    /// To the side that emits.
    pub n: Dir,
    /// Surface coordinates.
    pub uv: Vec2,
    /// Density, without the choice of the light: that of [`Lights::sample_emission`]'s place.
    pub pdf: Pdf<Area>,
}

impl Lights {
    /// A place on a light's surface at a moment, whoever may see it; `None` for a light without one and for one that no ray
    /// finds.
    #[must_use]
    pub fn sample_place(&self, light: LightId, u: [f32; 2], time: f32) -> Option<LightPlace> {
        let s = match &self.list[light.index()] {
            Light::Area(l) if l.visible => l.emitter.sample_area(u),
            Light::Moving(l) if l.area.visible => l.sample_area(time, u),
            Light::Area(_)
            | Light::Moving(_)
            | Light::Dark
            | Light::Point(_)
            | Light::Spot(_)
            | Light::Goniometric(_)
            | Light::Projection(_)
            | Light::Distant(_)
            | Light::InfiniteConstant(_)
            | Light::InfiniteImage(_)
            | Light::Portal(_) => return None,
        };
        let place = LightPlace { p: s.p, p_error: s.p_error, n: s.n, uv: s.uv, pdf: s.pdf };
        s.pdf.is_positive().then_some(place)
    }
}

/// A flat lamp of even radiance, as lanes draw it.
#[derive(Clone, Copy)]
pub(crate) struct FlatLamp<'a> {
    emitter: FlatEmitter<'a>,
    le: Spectrum,
    two_sided: bool,
}

impl FlatLamp<'_> {
    /// [`Lights::sample`] for sixteen points, and where it is right: elsewhere the light must be asked for each.
    #[inline(always)]
    pub(crate) fn sample<F: Floats>(&self, from: Vec3Lanes<F>, u: [F; 2]) -> (LightLanes<F>, F::Mask) {
        let (at, n, pdf, is_right) = self.emitter.sample_lanes::<F>(from, u);
        (LightLanes::of_lamp(from, (at, n), pdf, (self.le, self.two_sided)), is_right)
    }
}

impl Lights {
    /// The light as a lamp that lanes can draw, if it is one.
    #[inline]
    pub(crate) fn flat_lamp(&self, light: LightId, wavelengths: &Wavelengths) -> Option<FlatLamp<'_>> {
        let Light::Area(area) = &self.list[light.index()] else { return None };
        let emitter = area.emitter.flat().filter(|_| area.visible)?;
        let emission = &self.emissions[area.emission as usize];
        let le = emission.value(wavelengths) * area.factor;
        (!emission.is_image()).then_some(FlatLamp { emitter, le, two_sided: area.two_sided })
    }
}

/// An emitting surface.
#[derive(Clone, Debug)]
pub(crate) struct AreaLight {
    pub(super) emitter: Emitter,
    /// Index into the list of emissions.
    pub(super) emission: u32,
    /// On that emission.
    pub(super) factor: f32,
    pub(super) two_sided: bool,
    /// Can rays hit it? pbrt's way to an invisible lamp is an alpha of zero.
    pub(super) visible: bool,
}

impl AreaLight {
    /// Light on the way to `from`. An invisible lamp is found by no ray: its sample counts like a delta's, with the
    /// density divided out of `li`.
    #[inline]
    pub(super) fn sample(
        &self,
        emissions: &[Emission],
        light: LightId,
        from: Point,
        u: [f32; 2],
        wavelengths: &Wavelengths,
    ) -> Option<LightSample> {
        self.seen(emissions, light, &self.emitter.sample(from, u)?, (from, wavelengths))
    }

    /// What a point of the surface sends to `from`.
    #[inline]
    pub(super) fn seen(
        &self,
        emissions: &[Emission],
        light: LightId,
        s: &SurfaceSample<SolidAngle>,
        (from, wavelengths): (Point, &Wavelengths),
    ) -> Option<LightSample> {
        let wi = Dir((s.p - from).try_normalize()?);
        let le = self.emitted(emissions, s.n, s.uv, -wi, wavelengths);
        let (li, density) = if self.visible {
            (le, Density::Smooth(s.pdf))
        } else {
            (le / Pdf::value(s.pdf), Density::Delta { probability: 1.0 })
        };
        Some(LightSample {
            light,
            li,
            wi,
            p: s.p,
            p_error: s.p_error,
            n: s.n,
            uv: s.uv,
            density,
            is_infinite: false,
        })
    }

    /// Radiance along `w_out` from where the emitting side's normal is `n`.
    #[inline]
    pub(super) fn emitted(
        &self,
        emissions: &[Emission],
        n: Dir,
        uv: Vec2,
        w_out: Dir,
        wavelengths: &Wavelengths,
    ) -> Spectrum {
        if !self.two_sided && n.dot(w_out) <= 0.0 {
            return Spectrum::ZERO;
        }
        emissions[self.emission as usize].eval(uv, wavelengths) * self.factor
    }

    /// Mean over the surface. Of an image, an estimate by an 8 × 8 grid of points; at least a thousandth of the mean
    /// of the whole image, so that no surface that emits counts as dark.
    pub(super) fn mean(&self, emission: &Emission) -> f32 {
        const N: u16 = 8;
        let whole = emission.mean();
        if !emission.is_image() {
            return whole * self.factor;
        }
        let sum: f32 = (0..N * N)
            .map(|i| {
                let u = [i % N, i / N].map(|k| (f32::from(k) + 0.5) / f32::from(N));
                emission.size_at(self.emitter.sample_area(u).uv)
            })
            .sum();
        (sum / f32::from(N * N)).max(whole * 1e-3) * self.factor
    }

    pub(super) fn sides(&self) -> f32 {
        if self.two_sided { 2.0 } else { 1.0 }
    }
}
