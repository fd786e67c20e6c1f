//! Light from all around: even, or by an image.
//!
//! An image is sampled pixel by pixel [PBR4e, sec. 12.5.2], with the mean of R, G and B as weight: where the lookup
//! is bilinear, each pixel's weight is the mean of the interpolated values over it (binomial weights 1, 6, 1 each way),
//! so that no direction that emits has density zero. Light samples are drawn by what the point may see of it: see `patches`.
//!
//! Left out: density compensation for multiple importance sampling [Karlik2019], of which little is left beside `patches`
//! (docs/decisions/0250).

use std::f32::consts::{PI, TAU};

use math::{Bounds, Dir, Ray, Vec3, trig};
use sampling::distribution::PiecewiseConstant2D;
use sampling::{Pdf, SolidAngle, warp};
use scene_desc::SphericalMapping;
use spectrum::{Spectrum, Wavelengths};

use super::delta::{inside, to_light};
use super::emission::{Emission, ImageEmission, Lookup};
use super::patches::Patches;
use crate::LightContext;
use crate::linear_map::LinearMap;

/// The same radiance from everywhere.
#[derive(Clone, Debug)]
pub(crate) struct InfiniteConstant {
    pub(super) radiance: Emission,
}

/// Radiance by an image of directions.
#[derive(Clone, Debug)]
pub(crate) struct InfiniteImage {
    world_from_light: LinearMap,
    emission: ImageEmission,
    mapping: SphericalMapping,
    distribution: PiecewiseConstant2D,
    patches: Option<Box<Patches>>,
    mean: f32,
}

impl InfiniteImage {
    /// `None` for an image that is black.
    pub(super) fn new(
        world_from_light: LinearMap,
        emission: ImageEmission,
        mapping: SphericalMapping,
    ) -> Option<Self> {
        let image = emission.image();
        let [width, height] = image.size();
        // One row has no poles.
        let mapping = if height < 2 && mapping == SphericalMapping::EquiRectangularPoles {
            SphericalMapping::EquiRectangular
        } else {
            mapping
        };
        let size: Vec<f32> = image.pixels().iter().map(|&rgb| emission.size_of(rgb)).collect();
        let weights: Vec<f32> = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let value = match emission.lookup() {
                    Lookup::Nearest => size[i],
                    Lookup::Bilinear | Lookup::BilinearRound => {
                        smoothed(&size, [width, height], [x, y], emission.lookup())
                    }
                };
                value * row_measure(mapping, y, height)
            })
            .collect();
        let distribution = PiecewiseConstant2D::new(&weights, width)?;
        // Both mappings: the mean over the sphere is the mean of weights over the mean of the measure.
        let measure: f32 = (0..height).map(|y| row_measure(mapping, y, height)).sum::<f32>() / height as f32;
        let mean = distribution.integral() as f32 / measure;
        if mean <= 0.0 {
            return None;
        }
        let patches = None;
        let mut sky = Self { world_from_light, emission, mapping, distribution, patches, mean };
        sky.patches = Patches::new(&weights, width, |p| sky.direction(p)).map(Box::new);
        Some(sky)
    }

    /// Radiance from the direction `w`.
    pub(super) fn radiance(&self, w: Dir, wavelengths: &Wavelengths) -> Spectrum {
        let (local, _) = to_light(&self.world_from_light, w);
        self.emission.eval(self.uv(local), wavelengths)
    }

    /// Learns how much of it is seen from where; `is_blocked` tells of rays to infinity.
    pub(super) fn look(&mut self, bounds: &Bounds, is_blocked: impl Fn(&Ray) -> bool + Sync) {
        if let Some(mut patches) = self.patches.take() {
            patches.look(bounds, |p| self.direction(p), is_blocked);
            self.patches = Some(patches);
        }
    }

    /// A direction towards the light, with its radiance and density: for a point, or for no place in particular.
    pub(super) fn sample(
        &self,
        context: Option<&LightContext>,
        u: [f32; 2],
        wavelengths: &Wavelengths,
    ) -> Option<(Dir, Spectrum, Pdf<SolidAngle>)> {
        let (p, density) = match (&self.patches, context) {
            (Some(patches), Some(context)) => {
                let s = patches.sample(context, u)?;
                (s.p, s.pdf)
            }
            (Some(_) | None, _) => {
                let s = self.distribution.sample(u);
                (s.p, s.pdf)
            }
        };
        let local = self.local(p)?;
        let mapped = self.world_from_light.apply(local.0);
        // M⁻¹ of the unit direction is the light's direction over |M w_light|.
        let ratio = self.world_from_light.inverse_solid_angle_ratio(1.0 / mapped.length());
        let pdf = density.value() * self.square_density(local) * ratio;
        (pdf > 0.0 && pdf.is_finite())
            .then(|| (Dir::normalize(mapped), self.emission.eval(p, wavelengths), Pdf::new(pdf)))
    }

    /// Density of [`InfiniteImage::sample`].
    pub(super) fn pdf(&self, context: Option<&LightContext>, w: Dir) -> Pdf<SolidAngle> {
        let (local, ratio) = to_light(&self.world_from_light, w);
        let density = match (&self.patches, context) {
            (Some(patches), Some(context)) => patches.pdf(context, self.uv(local)),
            (Some(_) | None, _) => self.distribution.pdf(self.uv(local)),
        };
        let p = density.value() * self.square_density(local) * ratio;
        Pdf::new(if p.is_finite() { p } else { 0.0 })
    }

    /// Number of pixels along the longer side.
    pub(super) fn side(&self) -> usize {
        self.emission.image().size().into_iter().fold(1, usize::max)
    }

    /// Directions of the world, the mean of R, G and B's radiance of each and the solid angle that it stands for: a few to
    /// a pixel.
    pub(super) fn each_direction(&self, mut f: impl FnMut(Dir, f32, f32)) {
        const TO_A_PIXEL: usize = 3;
        let [width, height] = self.emission.image().size().map(|n| n * TO_A_PIXEL);
        for i in 0..width * height {
            let p = [(i % width) as f32 + 0.5, (i / width) as f32 + 0.5];
            let p = [p[0] / width as f32, p[1] / height as f32];
            let Some(local) = self.local(p) else { continue };
            let mapped = self.world_from_light.apply(local.0);
            let ratio = self.world_from_light.inverse_solid_angle_ratio(1.0 / mapped.length());
            let solid_angle = 1.0 / (self.square_density(local) * ratio * (width * height) as f32);
            if solid_angle.is_finite() {
                f(Dir::normalize(mapped), self.emission.size_at(p), solid_angle);
            }
        }
    }

    /// Mean radiance over the sphere.
    pub(super) fn mean(&self) -> f32 {
        self.mean
    }

    /// Area of the unit square per solid angle.
    fn square_density(&self, local: Dir) -> f32 {
        match self.mapping {
            SphericalMapping::EqualArea => 1.0 / (4.0 * PI),
            SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
                let v = local.0;
                self.stretch() / (2.0 * PI * PI * (v.x * v.x + v.y * v.y).sqrt())
            }
        }
    }

    /// The world's direction of a place of the unit square; `None` where there is no sphere.
    fn direction(&self, p: [f32; 2]) -> Option<Dir> {
        Some(Dir::normalize(self.world_from_light.apply(self.local(p)?.0)))
    }

    /// The light's direction of a place of the unit square; `None` where there is no sphere.
    fn local(&self, p: [f32; 2]) -> Option<Dir> {
        Some(match self.mapping {
            SphericalMapping::EqualArea => warp::equal_area_sphere(p),
            SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
                let v = self.latitude(p[1]);
                if !(0.0..=1.0).contains(&v) {
                    return None;
                }
                let (sin_theta, cos_theta) = trig::sin_cos(PI * v);
                let (sin_phi, cos_phi) = trig::sin_cos(TAU * p[0]);
                Dir(Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta))
            }
        })
    }

    fn uv(&self, local: Dir) -> [f32; 2] {
        let v = local.0;
        inside(match self.mapping {
            SphericalMapping::EqualArea => warp::equal_area_sphere_inverse(local),
            SphericalMapping::EquiRectangular | SphericalMapping::EquiRectangularPoles => {
                let phi = trig::atan2(v.y, v.x);
                let phi = if phi < 0.0 { phi + TAU } else { phi };
                let latitude = trig::atan2((v.x * v.x + v.y * v.y).sqrt(), v.z) / PI;
                [phi / TAU, (latitude - 0.5) * self.stretch() + 0.5]
            }
        })
    }

    /// Height of the sphere on the unit square: rows that lie on the poles leave half of them outside.
    fn stretch(&self) -> f32 {
        let height = self.emission.image().size()[1] as f32;
        match self.mapping {
            SphericalMapping::EquiRectangularPoles => (height - 1.0) / height,
            SphericalMapping::EquiRectangular | SphericalMapping::EqualArea => 1.0,
        }
    }

    /// θ/π of a row of the unit square; outside of [0, 1] there is no sphere.
    fn latitude(&self, row: f32) -> f32 {
        (row - 0.5) / self.stretch() + 0.5
    }
}

/// Relative solid angle of a pixel in row `y`.
fn row_measure(mapping: SphericalMapping, y: usize, height: usize) -> f32 {
    match mapping {
        SphericalMapping::EqualArea => 1.0,
        SphericalMapping::EquiRectangular => trig::sin(PI * (y as f32 + 0.5) / height as f32),
        // The mean of the sine over the part of the row that is on the sphere: none is zero.
        SphericalMapping::EquiRectangularPoles => {
            let n = (height - 1) as f32;
            let at = |row: f32| trig::cos(PI * (row / n).clamp(0.0, 1.0));
            (at(y as f32 - 0.5) - at(y as f32 + 0.5)) * n / PI
        }
    }
}

/// Mean over a pixel of what is interpolated between it and its neighbours, the border repeated in y, and in x as the
/// lookup has it.
pub(super) fn smoothed(
    values: &[f32],
    [width, height]: [usize; 2],
    [x, y]: [usize; 2],
    lookup: Lookup,
) -> f32 {
    let rows = [(y.saturating_sub(1), 0.125), (y, 0.75), ((y + 1).min(height - 1), 0.125)];
    let [left, right] = match lookup {
        Lookup::BilinearRound => [(x + width - 1) % width, (x + 1) % width],
        Lookup::Bilinear | Lookup::Nearest => [x.saturating_sub(1), (x + 1).min(width - 1)],
    };
    let columns = [(left, 0.125), (x, 0.75), (right, 0.125)];
    let mut sum = 0.0;
    for (j, wy) in rows {
        for (i, wx) in columns {
            sum += values[j * width + i] * wx * wy;
        }
    }
    sum
}
