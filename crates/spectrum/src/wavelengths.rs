//! What the four lanes of a path mean: R, G, B, or four wavelengths.

use math::Vec4;

/// The wavelengths that a path carries, with their densities; or the statement that it carries R, G and B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelengths {
    /// In nm; zero in RGB mode.
    lambda: Vec4,
    /// Density of each wavelength in 1/nm; after [`Wavelengths::terminate_secondary`] only the first is positive.
    pdf: Vec4,
}

impl Wavelengths {
    /// RGB mode: the lanes are R, G and B.
    pub const RGB: Self = Self { lambda: Vec4::ZERO, pdf: Vec4::ONE };

    /// Four wavelengths (nm) with their densities (1/nm).
    #[must_use]
    pub fn new(lambda: [f32; 4], pdf: [f32; 4]) -> Self {
        Self { lambda: Vec4::from_array(lambda), pdf: Vec4::from_array(pdf) }
    }

    /// RGB mode?
    #[must_use]
    pub fn is_rgb(&self) -> bool {
        self.lambda.x == 0.0
    }

    /// The wavelengths in nm (zeros in RGB mode).
    #[must_use]
    pub fn lambda(&self) -> [f32; 4] {
        self.lambda.to_array()
    }

    /// Their densities in 1/nm.
    #[must_use]
    pub fn pdf(&self) -> [f32; 4] {
        self.pdf.to_array()
    }

    /// Keeps the hero wavelength alone: what follows (dispersion) differs between the lanes. No effect in RGB mode
    /// or when done already [Wilkie2014].
    pub fn terminate_secondary(&mut self) {
        if !self.is_rgb() && self.pdf.y != 0.0 {
            self.pdf = Vec4::new(self.pdf.x * 0.25, 0.0, 0.0, 0.0);
        }
    }

    /// Only the hero wavelength left?
    #[must_use]
    pub fn is_terminated(&self) -> bool {
        self.pdf.y == 0.0
    }
}
