//! How much a light emits: a spectrum or an image, with its size.
//!
//! As in pbrt-v4 a spectrum is divided by its luminance integral `∫ ȳ L dλ` (an RGB colour by its colour space's
//! illuminant's, so that it keeps its own size) and then scaled. A spectrum that is not to be normalised is divided
//! by `∫ ȳ dλ`: a constant of one has luminance one.
//!
//! Images are converted to the render's primaries once, negative values (out of gamut) to zero.

use math::Vec2;
use scene_desc::{ColorSpaceName, Illuminant, Sink, Span};
use spectrum::{ColorMode, ColorPipeline, ColorSpace, SpectralCurve, Spectrum, SpectrumValue, Wavelengths};

use crate::textures::{SpectrumRole, TextureImage, color_space, spectral_curve};

/// An emission, without a place.
#[derive(Clone, Debug)]
pub(crate) struct Emission {
    source: Source,
    mean: f32,
}

#[derive(Clone, Debug)]
enum Source {
    Value(SpectrumValue),
    Image(Box<ImageEmission>),
}

/// An emission that varies over the unit square.
#[derive(Clone, Debug)]
pub(crate) struct ImageEmission {
    image: LightImage,
    colors: ColorPipeline,
    /// Includes the division by the illuminant's size where a lookup does not.
    scale: f32,
    lookup: Lookup,
}

/// How an image is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lookup {
    /// The pixel around the point: pbrt-v4's infinite lights, projectors and goniometric lights.
    Nearest,
    /// Between pixels, the border repeated: pbrt-v4's area lights.
    Bilinear,
    /// Between pixels, around in x: Mitsuba's and glTF's environments.
    BilinearRound,
}

/// Linear colours in rows, the top row first.
#[derive(Clone, Debug)]
pub struct LightImage {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
    space: ColorSpace,
}

impl LightImage {
    /// From `width × height` pixels of `space`, the top row first. `None` if the number of pixels is another or zero.
    #[must_use]
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>, space: ColorSpaceName) -> Option<Self> {
        let fits = !pixels.is_empty() && pixels.len() == width * height;
        fits.then(|| Self { width, height, pixels, space: color_space(space) })
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    pub(crate) fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// Y of a pixel, for one of luminance-one white.
    pub(crate) fn luminance(&self, rgb: [f32; 3]) -> f32 {
        self.space.luminance(rgb)
    }

    /// Any pixel that is no finite number?
    pub(crate) fn has_bad_pixels(&self) -> bool {
        self.pixels.iter().any(|p| p.iter().any(|c| !c.is_finite()))
    }

    /// Mean over all pixels of `f` of a pixel and the place of its centre in the unit square.
    pub(crate) fn mean(&self, f: impl Fn([f32; 3], [f32; 2]) -> f32) -> f32 {
        let mut sum = 0.0_f64;
        for (i, &rgb) in self.pixels.iter().enumerate() {
            let center = [(i % self.width) as f32 + 0.5, (i / self.width) as f32 + 0.5];
            sum += f64::from(f(rgb, [center[0] / self.width as f32, center[1] / self.height as f32]));
        }
        (sum / self.pixels.len() as f64) as f32
    }

    fn nearest(&self, uv: [f32; 2]) -> [f32; 3] {
        let cell = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
        self.pixels[cell(uv[1], self.height) * self.width + cell(uv[0], self.width)]
    }

    /// `wrap(x, width)` brings a column back into the image.
    fn bilinear(&self, uv: [f32; 2], wrap: impl Fn(i64, i64) -> i64) -> [f32; 3] {
        let at = |x: f32, n: usize, wrap: &dyn Fn(i64, i64) -> i64| {
            let x = x * n as f32 - 0.5;
            let (i, n) = (x.floor() as i64, n as i64);
            (wrap(i, n) as usize, wrap(i + 1, n) as usize, x - x.floor())
        };
        let (x0, x1, dx) = at(uv[0], self.width, &wrap);
        let (y0, y1, dy) = at(uv[1], self.height, &|y, n| y.clamp(0, n - 1));
        let row = |y: usize, c: usize| {
            self.pixels[y * self.width + x0][c] * (1.0 - dx) + self.pixels[y * self.width + x1][c] * dx
        };
        std::array::from_fn(|c| row(y0, c) * (1.0 - dy) + row(y1, c) * dy)
    }
}

impl From<&TextureImage> for LightImage {
    fn from(image: &TextureImage) -> Self {
        let (width, height) = (image.width(), image.height());
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| image.texel_rgb(x, y))).collect();
        Self { width: width as usize, height: height as usize, pixels, space: image.color_space() }
    }
}

impl ImageEmission {
    pub(crate) fn new(image: LightImage, scale: f32, lookup: Lookup, colors: ColorPipeline) -> Self {
        let mut image = image;
        for p in &mut image.pixels {
            let rgb = match colors.mode {
                ColorMode::Rgb => image.space.convert(colors.space, *p),
                ColorMode::Spectral => *p,
            };
            *p = rgb.map(|c| c.max(0.0));
        }
        let scale = match colors.mode {
            ColorMode::Rgb => scale,
            ColorMode::Spectral => scale / image.space.illuminant_photometric() as f32,
        };
        Self { image, colors, scale, lookup }
    }

    /// At a place of the unit square, v down.
    pub(crate) fn eval(&self, uv: [f32; 2], wavelengths: &Wavelengths) -> Spectrum {
        let rgb = self.rgb(uv);
        match self.colors.mode {
            ColorMode::Rgb => Spectrum::from_rgb(rgb.map(|c| c * self.scale)),
            ColorMode::Spectral => {
                self.colors.texel_illuminant(self.image.space, rgb, wavelengths) * self.scale
            }
        }
    }

    fn rgb(&self, uv: [f32; 2]) -> [f32; 3] {
        match self.lookup {
            Lookup::Nearest => self.image.nearest(uv),
            Lookup::Bilinear => self.image.bilinear(uv, |x, n| x.clamp(0, n - 1)),
            Lookup::BilinearRound => self.image.bilinear(uv, i64::rem_euclid),
        }
    }

    pub(crate) fn lookup(&self) -> Lookup {
        self.lookup
    }

    pub(crate) fn image(&self) -> &LightImage {
        &self.image
    }

    /// Mean of R, G and B at a place of the unit square, v down.
    pub(crate) fn size_at(&self, uv: [f32; 2]) -> f32 {
        self.size_of(self.rgb(uv))
    }

    /// Mean of R, G and B of a pixel, as emitted.
    pub(crate) fn size_of(&self, rgb: [f32; 3]) -> f32 {
        let scale = match self.colors.mode {
            ColorMode::Rgb => self.scale,
            ColorMode::Spectral => self.scale * self.image.space.illuminant_photometric() as f32,
        };
        (rgb[0] + rgb[1] + rgb[2]) * (1.0 / 3.0) * scale
    }
}

impl Emission {
    /// A spectrum as a scene states it, times `factor`.
    pub(crate) fn new(
        desc: &Illuminant,
        factor: f32,
        colors: ColorPipeline,
        span: Span,
        sink: &mut Sink,
    ) -> Self {
        let curve = spectral_curve(&desc.spectrum, SpectrumRole::Illuminant, span, sink);
        let scale = desc.scale * factor / unit_of(&curve, desc.normalize);
        let scale = if scale.is_finite() { scale } else { 0.0 };
        let value = colors.illuminant(&curve).scaled(scale);
        let mean = mean_of(&value, colors);
        Self { source: Source::Value(value), mean }
    }

    /// An image over a surface's (u, v), v up.
    pub(crate) fn of_image(image: ImageEmission) -> Self {
        let mean = image.image.mean(|rgb, _| image.size_of(rgb));
        Self { source: Source::Image(Box::new(image)), mean }
    }

    pub(crate) fn eval(&self, uv: Vec2, wavelengths: &Wavelengths) -> Spectrum {
        match &self.source {
            Source::Value(value) => value.eval(wavelengths),
            Source::Image(image) => image.eval([uv.x, 1.0 - uv.y], wavelengths),
        }
    }

    /// Where there is no surface to vary over.
    pub(crate) fn value(&self, wavelengths: &Wavelengths) -> Spectrum {
        self.eval(Vec2::ZERO, wavelengths)
    }

    pub(crate) fn is_image(&self) -> bool {
        matches!(self.source, Source::Image(_))
    }

    /// Mean over R, G and B at a place of a surface.
    pub(crate) fn size_at(&self, uv: Vec2) -> f32 {
        match &self.source {
            Source::Value(_) => self.mean,
            Source::Image(image) => image.size_at([uv.x, 1.0 - uv.y]),
        }
    }

    /// Mean over R, G and B (and the image): the size that power is measured with. A white of luminance one has one.
    pub(crate) fn mean(&self) -> f32 {
        self.mean
    }
}

/// What a spectrum is divided by.
fn unit_of(curve: &SpectralCurve, normalize: bool) -> f32 {
    match curve {
        SpectralCurve::RgbIlluminant { .. } => spectrum::photometric(curve),
        SpectralCurve::Constant(_)
        | SpectralCurve::Piecewise(_)
        | SpectralCurve::Blackbody { .. }
        | SpectralCurve::Planck { .. }
        | SpectralCurve::Daylight { .. }
        | SpectralCurve::RgbAlbedo { .. }
        | SpectralCurve::RgbUnbounded { .. } => {
            if normalize {
                spectrum::photometric(curve)
            } else {
                spectrum::y_integral() as f32
            }
        }
    }
}

/// Mean of R, G and B; in spectral mode that of X, Y and Z, by a rule of 4 nm.
fn mean_of(value: &SpectrumValue, colors: ColorPipeline) -> f32 {
    if colors.mode == ColorMode::Rgb {
        return value.eval(&Wavelengths::RGB).rgb().iter().sum::<f32>() / 3.0;
    }
    const STEP: f32 = 4.0;
    let mut sum = 0.0_f64;
    let mut lambda = spectrum::LAMBDA_MIN;
    while lambda < spectrum::LAMBDA_MAX {
        let at = [0.5, 1.5, 2.5, 3.5].map(|k| lambda + k * STEP);
        let lanes = value.eval(&Wavelengths::new(at, [1.0; 4])).lanes();
        for (l, v) in at.into_iter().zip(lanes) {
            sum += f64::from(spectrum::xyz_bar(l).iter().sum::<f32>() * v * STEP);
        }
        lambda += 4.0 * STEP;
    }
    (sum / 3.0) as f32
}
