//! Colour and light: spectra, wavelengths, colour spaces, upsampling, illuminants and metals.
//!
//! A [`Spectrum`] is four lanes. In RGB mode they hold linear R, G, B and nothing; in spectral mode, four
//! hero-wavelength samples. Transport code serves both: only textures, emitters and the film know which.
//!
//! The way of a colour: a reader makes a [`SpectralCurve`]; the scene's [`ColorPipeline`] turns it, by its role, into
//! a [`SpectrumValue`], which a path evaluates at its [`Wavelengths`]; the film's [`Sensor`] makes R, G, B of the result.

mod lanes;
mod wavelengths;

mod cie;
mod color_space;
mod curve;
mod dense;
mod measured_media;
mod named;
mod pipeline;
mod sensor;
mod sigmoid;
pub mod sky;
mod thermal;
mod transfer;
mod upsample;

pub use cie::{LAMBDA_MAX, LAMBDA_MIN, xyz_bar, y_integral};
pub use color_space::ColorSpace;
pub use curve::{CurveError, PiecewiseLinear, SpectralCurve, photometric};
pub use dense::DenseSpectrum;
pub use lanes::Spectrum;
pub use measured_media::{MeasuredMedium, measured_media};
pub use named::names as spectrum_names;
pub use pipeline::{ColorMode, ColorPipeline, SpectrumValue};
pub use sensor::Sensor;
pub use sigmoid::SigmoidPolynomial;
pub use thermal::{daylight_chromaticity, planck};
pub use transfer::{TransferFunction, srgb_decode, srgb_decode_u8, srgb_encode};
pub use upsample::RgbToSpectrumTable;
pub use wavelengths::Wavelengths;
