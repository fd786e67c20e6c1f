//! Spectra, wavelengths, colour spaces, upsampling, illuminants and metals.
