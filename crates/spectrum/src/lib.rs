//! Colour and light: spectra, wavelengths, colour spaces, upsampling, illuminants and metals.
//!
//! A [`Spectrum`] is four lanes. In RGB mode they hold linear R, G, B and nothing; in spectral mode, four
//! hero-wavelength samples. Transport code serves both: only textures, emitters and the film know which.

mod lanes;
mod wavelengths;

pub use lanes::Spectrum;
pub use wavelengths::Wavelengths;
