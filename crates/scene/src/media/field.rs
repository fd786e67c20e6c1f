//! Media that vary: coefficients and emission at a point of a box.

use math::{Point, Ray, Vec3};
use spectrum::{ColorMode, ColorPipeline, ColorSpace, SpectralCurve, Spectrum, SpectrumValue, Wavelengths};

use super::Flight;
use super::grid::{Grid, Majorants};
use super::tracking::{Collision, Track, UnitRay};
use crate::linear_map::AffineMap;
use crate::textures::noise;

/// A medium that varies over a box.
#[derive(Clone, Debug)]
pub(super) struct Varying {
    /// The box is the image of the unit cube.
    pub(super) world_from_unit: AffineMap,
    pub(super) field: Field,
    /// Bounds on what [`Field::scale`] multiplies.
    pub(super) majorants: Majorants,
    /// Absorbs alone?
    pub(super) never_scatters: bool,
}

/// What varies.
#[derive(Clone, Debug)]
pub(super) enum Field {
    /// A density times coefficients.
    Density { density: Density, sigma_a: SpectrumValue, sigma_s: SpectrumValue, emission: Emission },
    /// Coefficients in colour.
    Rgb(RgbField),
}

/// How dense it is.
#[derive(Clone, Debug)]
pub(super) enum Density {
    Grid(Grid<f32>),
    Cloud(Cloud),
}

/// What glows.
#[derive(Clone, Debug)]
pub(super) enum Emission {
    None,
    Spectrum { le: SpectrumValue, scale: Option<Grid<f32>> },
    Temperature { kelvin: Grid<f32>, offset: f32, scale: f32, glow: Glow },
}

/// Coefficients in colour: grids of R, G, B in 1/length, in `space`.
#[derive(Clone, Debug)]
pub(super) struct RgbField {
    pub(super) sigma_a: Option<Grid<[f32; 3]>>,
    pub(super) sigma_s: Option<Grid<[f32; 3]>>,
    pub(super) le: Option<Grid<[f32; 3]>>,
    pub(super) space: ColorSpace,
    pub(super) colors: ColorPipeline,
    /// Factor on both coefficients.
    pub(super) scale: f32,
    /// Factor on emission.
    pub(super) le_scale: f32,
}

impl Varying {
    pub(super) fn emits(&self) -> bool {
        match &self.field {
            Field::Density { emission, .. } => !matches!(emission, Emission::None),
            Field::Rgb(f) => f.le.is_some(),
        }
    }

    pub(super) fn coefficients(&self, p: Point, wl: &Wavelengths) -> [Spectrum; 2] {
        let q = self.world_from_unit.inverse_point(p);
        if q.min_element() < 0.0 || q.max_element() > 1.0 {
            return [Spectrum::ZERO; 2];
        }
        let here = self.field.at_wavelengths(wl).at(q);
        [here.sigma_a, here.sigma_s]
    }

    pub(super) fn fly(
        &self,
        ray: &Ray,
        carried: Spectrum,
        wl: &Wavelengths,
        u: &mut impl FnMut() -> f32,
    ) -> Flight {
        if self.never_scatters {
            return self.pass(ray, wl, u);
        }
        let field = self.field.at_wavelengths(wl);
        self.track(ray, &field).fly(|q| field.at(q), carried, wl, u)
    }

    pub(super) fn pass(&self, ray: &Ray, wl: &Wavelengths, u: &mut impl FnMut() -> f32) -> Flight {
        let field = self.field.at_wavelengths(wl);
        self.track(ray, &field).pass(|q| field.at(q), u)
    }

    fn track(&self, ray: &Ray, field: &FieldAt<'_>) -> Track<'_> {
        let ray = UnitRay {
            origin: self.world_from_unit.inverse_point(ray.origin),
            dir: self.world_from_unit.linear.apply_inverse(ray.dir.0),
            t_max: ray.t_max,
        };
        Track { majorants: &self.majorants, scale: field.scale(), ray }
    }
}

/// A field at a path's wavelengths.
struct FieldAt<'a> {
    field: &'a Field,
    wl: &'a Wavelengths,
    /// Where the density is one.
    sigma_a: Spectrum,
    sigma_s: Spectrum,
    le: Spectrum,
}

impl Field {
    fn at_wavelengths<'a>(&'a self, wl: &'a Wavelengths) -> FieldAt<'a> {
        let (sigma_a, sigma_s, le) = match self {
            Self::Density { sigma_a, sigma_s, emission, .. } => {
                let le = match emission {
                    Emission::Spectrum { le, .. } => le.eval(wl),
                    Emission::None | Emission::Temperature { .. } => Spectrum::ZERO,
                };
                (sigma_a.eval(wl), sigma_s.eval(wl), le)
            }
            Self::Rgb(_) => Default::default(),
        };
        FieldAt { field: self, wl, sigma_a, sigma_s, le }
    }
}

impl FieldAt<'_> {
    /// What bounds are multiplied by.
    fn scale(&self) -> f32 {
        match self.field {
            Field::Density { .. } => (self.sigma_a + self.sigma_s).max_component(),
            Field::Rgb(f) => f.scale,
        }
    }

    fn at(&self, q: Vec3) -> Collision {
        match self.field {
            Field::Density { density, emission, .. } => {
                let d = density.at(q);
                let le = match emission {
                    Emission::None => Spectrum::ZERO,
                    Emission::Spectrum { scale: None, .. } => self.le,
                    Emission::Spectrum { scale: Some(grid), .. } => self.le * grid.at(q),
                    Emission::Temperature { kelvin, offset, scale, glow } => {
                        glow.at((kelvin.at(q) - offset) * scale, self.wl)
                    }
                };
                Collision { sigma_a: self.sigma_a * d, sigma_s: self.sigma_s * d, le }
            }
            Field::Rgb(f) => f.at(q, self.wl),
        }
    }
}

impl RgbField {
    fn at(&self, q: Vec3, wl: &Wavelengths) -> Collision {
        let sigma = |grid: &Option<Grid<[f32; 3]>>| match grid {
            Some(grid) => self.colors.texel_unbounded(self.space, grid.at(q), wl) * self.scale,
            None => Spectrum::splat(self.scale),
        };
        let le = match &self.le {
            Some(grid) => self.colors.texel_illuminant(self.space, grid.at(q), wl) * self.le_scale,
            None => Spectrum::ZERO,
        };
        Collision { sigma_a: sigma(&self.sigma_a), sigma_s: sigma(&self.sigma_s), le }
    }
}

impl Density {
    fn at(&self, q: Vec3) -> f32 {
        match self {
            Self::Grid(grid) => grid.at(q),
            Self::Cloud(cloud) => cloud.density(q),
        }
    }
}

/// pbrt-v4's cloud: a sum of noises, torn by more of it, thinner with height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cloud {
    /// Its box in medium space.
    pub(super) bounds: [Vec3; 2],
    pub(super) density: f32,
    pub(super) wispiness: f32,
    pub(super) frequency: f32,
}

impl Cloud {
    /// In [0, 1] at a point of the unit cube.
    fn density(&self, q: Vec3) -> f32 {
        const LACUNARITY: f32 = 1.99;
        let p = self.bounds[0] + (self.bounds[1] - self.bounds[0]) * q;
        let mut torn = p * self.frequency;
        if self.wispiness > 0.0 {
            let (mut size, mut frequency) = (0.05 * self.wispiness, 10.0);
            for _ in 0..2 {
                torn += noise_gradient(torn * frequency) * size;
                size *= 0.5;
                frequency *= LACUNARITY;
            }
        }
        let (mut sum, mut size, mut frequency) = (0.0, 0.5, 1.0);
        for _ in 0..5 {
            sum += size * noise(torn * frequency);
            size *= 0.5;
            frequency *= LACUNARITY;
        }
        let d = ((1.0 - p.y) * 4.5 * self.density * sum).clamp(0.0, 1.0);
        (d + 2.0 * (0.5 - p.y).max(0.0)).clamp(0.0, 1.0)
    }
}

/// By differences over a hundredth, as pbrt has it.
fn noise_gradient(p: Vec3) -> Vec3 {
    const STEP: f32 = 0.01;
    let n = noise(p);
    let along = |axis: Vec3| (noise(p + axis * STEP) - n) / STEP;
    Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z))
}

/// Radiance of a black body by its temperature, with a maximum over wavelengths of `factor`.
#[derive(Clone, Debug)]
pub(super) struct Glow {
    factor: f32,
    /// In RGB mode: colours at equal steps of temperature.
    table: Vec<[f32; 3]>,
}

/// Kelvin from one entry of the table to the next, which begins at zero.
const TABLE_STEP: f32 = 50.0;
/// pbrt's bodies do not glow below.
const COLDEST: f32 = 100.0;

impl Glow {
    /// For temperatures up to `most`.
    pub(super) fn new(factor: f32, most: f32, colors: ColorPipeline) -> Self {
        // Radiance of one at all wavelengths has luminance one.
        let factor = factor / spectrum::y_integral() as f32;
        let n = match colors.mode {
            ColorMode::Rgb => (most.clamp(0.0, 1e5) / TABLE_STEP) as usize + 2,
            ColorMode::Spectral => 0,
        };
        let color = |i: usize| {
            let kelvin = (i as f32 * TABLE_STEP).max(COLDEST);
            SpectralCurve::Blackbody { kelvin }.emission_rgb(colors.space).map(|c| c.max(0.0) * factor)
        };
        Self { factor, table: (0..n).map(color).collect() }
    }

    fn at(&self, kelvin: f32, wl: &Wavelengths) -> Spectrum {
        if kelvin.is_nan() || kelvin <= COLDEST {
            return Spectrum::ZERO;
        }
        if !wl.is_rgb() {
            return SpectralCurve::Blackbody { kelvin }.sample(wl) * self.factor;
        }
        let x = (kelvin / TABLE_STEP).min(self.table.len() as f32 - 1.001);
        let i = x as usize;
        let (a, b, t) = (self.table[i], self.table[i + 1], x - i as f32);
        Spectrum::from_rgb([0, 1, 2].map(|c| a[c] * (1.0 - t) + b[c] * t))
    }
}
