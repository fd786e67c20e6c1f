//! Transfer functions: how a stored number and linear light belong together [IEC61966].

use std::sync::OnceLock;

use math::trig;

/// How values in [0, 1] are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TransferFunction {
    /// As they are.
    Linear,
    /// The sRGB curve.
    #[default]
    Srgb,
    /// Linear light is the stored value to this power.
    Gamma(f32),
}

impl TransferFunction {
    /// Linear light of a stored value.
    #[must_use]
    pub fn decode(self, stored: f32) -> f32 {
        match self {
            Self::Linear => stored,
            Self::Srgb => srgb_decode(stored),
            Self::Gamma(g) => trig::pow(stored.max(0.0), g),
        }
    }

    /// The stored value of linear light.
    #[must_use]
    pub fn encode(self, linear: f32) -> f32 {
        match self {
            Self::Linear => linear,
            Self::Srgb => srgb_encode(linear),
            Self::Gamma(g) => trig::pow(linear.max(0.0), 1.0 / g),
        }
    }

    /// Linear light of the 8-bit value `stored / 255`.
    #[must_use]
    pub fn decode_u8(self, stored: u8) -> f32 {
        match self {
            Self::Srgb => srgb_decode_u8(stored),
            Self::Linear | Self::Gamma(_) => self.decode(f32::from(stored) / 255.0),
        }
    }
}

/// Linear light of an sRGB value; continues the curve above one, odd below zero.
#[must_use]
pub fn srgb_decode(stored: f32) -> f32 {
    let v = stored.abs();
    let linear = if v <= 0.040_45 { v / 12.92 } else { trig::pow((v + 0.055) / 1.055, 2.4) };
    linear.copysign(stored)
}

/// The sRGB value of linear light; continues the curve above one, odd below zero.
#[must_use]
pub fn srgb_encode(linear: f32) -> f32 {
    let v = linear.abs();
    let stored = if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * trig::pow(v, 1.0 / 2.4) - 0.055 };
    stored.copysign(linear)
}

/// [`srgb_decode`] of `stored / 255`, from a table.
#[must_use]
pub fn srgb_decode_u8(stored: u8) -> f32 {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| srgb_decode(i as f32 / 255.0)))[usize::from(stored)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_meets_its_published_values() {
        assert!((srgb_encode(0.5) - 0.735_357).abs() < 1e-6);
        assert!((srgb_encode(0.18) - 0.461_356_1).abs() < 1e-6);
        assert!((srgb_decode(0.5) - 0.214_041_1).abs() < 1e-6);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-7);
        assert_eq!(srgb_decode_u8(255), 1.0);
        assert_eq!(srgb_decode_u8(0), 0.0);
    }

    #[test]
    fn every_function_undoes_itself() {
        for f in [TransferFunction::Linear, TransferFunction::Srgb, TransferFunction::Gamma(2.2)] {
            for i in 0..=255_u8 {
                let v = f32::from(i) / 255.0;
                assert!((f.encode(f.decode(v)) - v).abs() < 2e-6, "{f:?} {i}");
                assert!((f.decode_u8(i) - f.decode(v)).abs() < 1e-7);
            }
        }
        assert!((srgb_decode(srgb_encode(7.5)) - 7.5).abs() < 1e-4);
        assert!((srgb_decode(srgb_encode(-0.3)) + 0.3).abs() < 1e-6);
    }
}
