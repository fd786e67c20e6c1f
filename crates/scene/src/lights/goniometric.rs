//! Lights at a point whose intensity depends on the direction by measurement.
//!
//! | factor on the intensity | from                                   | source               |
//! |-------------------------|----------------------------------------|----------------------|
//! | image                   | an equal-area map, by pixel            | [PBR4e, sec. 12.2.3] |
//! | web                     | a photometric file, between its angles | [IES2002]            |
//!
//! The factor's z axis is the light's y axis, and the other way round: "up" is y.

use std::f32::consts::PI;

use math::{Dir, Point};
use sampling::distribution::PiecewiseConstant2D;
use sampling::{Pdf, SolidAngle, warp};
use spectrum::{Spectrum, Wavelengths};

use super::delta::{inside, to_light};
use super::emission::Emission;
use super::web::Web;
use crate::linear_map::AffineMap;

/// From one point, with a factor for each direction.
#[derive(Clone, Debug)]
pub(crate) struct GoniometricLight {
    /// From the factor's space.
    pub(super) world_from_light: AffineMap,
    pub(super) intensity: Emission,
    pub(super) factor: DirectionFactor,
}

/// A number for each direction.
#[derive(Clone, Debug)]
pub(crate) enum DirectionFactor {
    Image(ScalarImage),
    Web(Web),
}

/// Numbers over the unit square with their distribution.
#[derive(Clone, Debug)]
pub(crate) struct ScalarImage {
    width: usize,
    height: usize,
    values: Vec<f32>,
    distribution: PiecewiseConstant2D,
    mean: f32,
}

impl GoniometricLight {
    pub(super) fn p(&self) -> Point {
        Point(self.world_from_light.origin)
    }

    pub(super) fn intensity(&self, w: Dir, wavelengths: &Wavelengths) -> Spectrum {
        let (local, _) = to_light(&self.world_from_light.linear, w);
        self.intensity.value(wavelengths) * self.factor.at(local)
    }

    pub(super) fn sample_direction(&self, u: [f32; 2]) -> Dir {
        Dir::normalize(self.world_from_light.linear.apply(self.factor.sample(u).0))
    }

    pub(super) fn pdf_direction(&self, w: Dir) -> Pdf<SolidAngle> {
        let (local, ratio) = to_light(&self.world_from_light.linear, w);
        Pdf::new(self.factor.pdf(local) * ratio)
    }
}

impl DirectionFactor {
    /// Over the sphere.
    pub(super) fn mean(&self) -> f32 {
        match self {
            Self::Image(image) => image.mean,
            Self::Web(web) => web.power() / (4.0 * PI),
        }
    }

    fn at(&self, w: Dir) -> f32 {
        match self {
            Self::Image(image) => image.at(warp::equal_area_sphere_inverse(w)),
            Self::Web(web) => web.at(w),
        }
    }

    fn sample(&self, u: [f32; 2]) -> Dir {
        match self {
            Self::Image(image) => warp::equal_area_sphere(image.distribution.sample(u).p),
            Self::Web(web) => web.sample(u),
        }
    }

    fn pdf(&self, w: Dir) -> f32 {
        match self {
            Self::Image(image) => {
                let p = image.distribution.pdf(inside(warp::equal_area_sphere_inverse(w)));
                p.value() / (4.0 * PI)
            }
            Self::Web(web) => web.pdf(w),
        }
    }
}

impl ScalarImage {
    /// From rows of `width` numbers, none negative; `None` if they are none or all zero.
    pub(super) fn new(width: usize, values: Vec<f32>) -> Option<Self> {
        let distribution = PiecewiseConstant2D::new(&values, width)?;
        let mean = distribution.integral() as f32;
        let height = values.len() / width;
        (mean > 0.0).then_some(Self { width, height, values, distribution, mean })
    }

    fn at(&self, uv: [f32; 2]) -> f32 {
        let cell = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
        self.values[cell(uv[1], self.height) * self.width + cell(uv[0], self.width)]
    }
}
