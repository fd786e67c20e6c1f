//! What fills space: free flights, transmittance and emission along rays [PBR4e, ch. 11 and 14].
//!
//! | medium                         | file           | how a flight ends                                        |
//! |--------------------------------|----------------|----------------------------------------------------------|
//! | homogeneous                    | `homogeneous`  | in closed form                                           |
//! | grid, RGB grid, cloud          | `field`        | null collisions under local majorants [Woodcock1965], `tracking` |
//!
//! **Many wavelengths.** A flight is one random choice for all lanes of light. It is drawn from the mean of the lanes'
//! densities, each weighed with what the path carries there; the factor is what each lane has over that mean. That is the
//! balance heuristic over lanes [Wilkie2014] in the form that needs no memory [Kutz2017]: if nothing is absorbed, the sum
//! of what the lanes carry stays what it was, however different their coefficients are.
//!
//! **Emission** is gathered on the way: in closed form where the medium is homogeneous, else at every tentative collision.
//!
//! Left out: media that move.

mod compile;
mod field;
mod grid;
mod homogeneous;
mod tracking;

use math::{Point, Ray};
use sampling::{Length, Pdf};
use scatter::PhaseFunction;
use spectrum::{Spectrum, Wavelengths};

pub(crate) use self::compile::MediumIds;
use self::field::Varying;
use self::homogeneous::Homogeneous;
use crate::MediumId;

/// All media of a scene, by [`MediumId`].
#[derive(Clone, Debug, Default)]
pub struct Media {
    list: Vec<Medium>,
}

#[derive(Clone, Debug)]
struct Medium {
    phase: PhaseFunction,
    /// See [`Media::is_interior`].
    is_interior: bool,
    body: Body,
}

#[derive(Clone, Debug)]
enum Body {
    Homogeneous(Homogeneous),
    Varying(Box<Varying>),
}

/// A free flight through a medium.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// The distance at which it scatters; `None`: it comes to the end of the ray.
    pub scatters_at: Option<f32>,
    /// What the path carries is multiplied by it: transmittance (and at a collision scattering) over the density of
    /// what happened.
    pub factor: Spectrum,
    /// Radiance that the medium emits along the ray, as it arrives at the ray's origin.
    pub emitted: Spectrum,
}

impl Flight {
    /// Through nothing.
    pub const EMPTY: Self = Self { scatters_at: None, factor: Spectrum::ONE, emitted: Spectrum::ZERO };
}

/// A collision at a given distance of a flight.
#[derive(Clone, Copy, Debug)]
pub struct Collision {
    /// What the path carries would be multiplied by it.
    pub factor: Spectrum,
    /// The density with which a flight has it there.
    pub pdf: Pdf<Length>,
}

/// Lanes that count, weighed with what the path carries in them. The unused lane of RGB mode and secondary wavelengths
/// that were ended do not.
#[must_use]
pub fn lane_weights(carried: Spectrum, wl: &Wavelengths) -> [f32; 4] {
    let [a, b, c, d] = carried.lanes();
    if wl.is_rgb() {
        [a, b, c, 0.0]
    } else if wl.is_terminated() {
        [a, 0.0, 0.0, 0.0]
    } else {
        [a, b, c, d]
    }
}

impl Media {
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

    /// Does any of them emit?
    #[must_use]
    pub fn any_emits(&self) -> bool {
        self.list.iter().any(|m| match &m.body {
            Body::Homogeneous(h) => h.emits(),
            Body::Varying(v) => v.emits(),
        })
    }

    /// Is it a subsurface material's? What happens in it is a part of what the surface does: its collisions are no
    /// scattering events of a path, and since it lies behind a border that bends light, nothing can be connected to them.
    #[must_use]
    pub fn is_interior(&self, medium: MediumId) -> bool {
        self.list[medium.index()].is_interior
    }

    /// How a medium scatters.
    #[must_use]
    pub fn phase(&self, medium: MediumId) -> PhaseFunction {
        self.list[medium.index()].phase
    }

    /// A free flight along the ray to its end. `carried` is what the path carries (only ratios of its lanes count); `u`
    /// makes uniform numbers. A medium that only absorbs never scatters: its transmittance is in the factor.
    pub fn fly(
        &self,
        medium: MediumId,
        ray: &Ray,
        carried: Spectrum,
        wl: &Wavelengths,
        u: &mut impl FnMut() -> f32,
    ) -> Flight {
        match &self.list[medium.index()].body {
            Body::Homogeneous(h) => h.fly(ray, carried, wl, u),
            Body::Varying(v) => v.fly(ray, carried, wl, u),
        }
    }

    /// What [`Media::fly`] does if it scatters at distance `t` of a ray that is long enough; `None` where that is not known
    /// (the medium varies), or cannot be.
    #[must_use]
    pub fn collision(
        &self,
        medium: MediumId,
        t: f32,
        carried: Spectrum,
        wl: &Wavelengths,
    ) -> Option<Collision> {
        match &self.list[medium.index()].body {
            Body::Homogeneous(h) => h.collision(t, carried, wl),
            Body::Varying(_) => None,
        }
    }

    /// Along the whole ray without scattering: the factor is its transmittance, exact where the medium is homogeneous,
    /// else an unbiased estimate (ratio tracking [Novak2014]).
    pub fn pass(&self, medium: MediumId, ray: &Ray, wl: &Wavelengths, u: &mut impl FnMut() -> f32) -> Flight {
        match &self.list[medium.index()].body {
            Body::Homogeneous(h) => h.pass(ray, wl),
            Body::Varying(v) => v.pass(ray, wl, u),
        }
    }

    /// Absorption and scattering in 1/length at a point.
    #[must_use]
    pub fn coefficients(&self, medium: MediumId, p: Point, wl: &Wavelengths) -> [Spectrum; 2] {
        match &self.list[medium.index()].body {
            Body::Homogeneous(h) => h.coefficients(wl),
            Body::Varying(v) => v.coefficients(p, wl),
        }
    }
}

#[cfg(test)]
mod tests;
