//! From linear light to the screen: exposure, a curve, the sRGB transfer function.
//!
//! | curve    | source                                        |
//! |----------|-----------------------------------------------|
//! | Reinhard | [Reinhard2002], the curve L / (1 + L)         |
//! | Filmic   | [Narkowicz2016], a rational fit to ACES       |

use std::sync::OnceLock;

use math::trig;
use spectrum::srgb_encode;

/// What becomes of values above one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// They are white.
    #[default]
    Clamp,
    /// Luminance is compressed, hue kept.
    Reinhard,
    /// Each channel through an S-curve.
    Filmic,
}

/// How linear light is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// In stops: light times 2 to this power.
    pub exposure: f32,
    /// The curve.
    pub tone_map: ToneMap,
}

impl Display {
    /// sRGB in [0, 1] of linear light; zero for what is not a number.
    #[must_use]
    pub fn srgb(&self, rgb: [f32; 3]) -> [f32; 3] {
        self.shown(rgb).map(srgb_encode)
    }

    /// [`Display::srgb`] in 255ths, rounded to the nearest.
    #[must_use]
    pub fn srgb_u8(&self, rgb: [f32; 3]) -> [u8; 3] {
        self.shown(rgb).map(code)
    }

    /// Linear light on the screen, in [0, 1].
    fn shown(&self, rgb: [f32; 3]) -> [f32; 3] {
        let exposed = if self.exposure == 0.0 { rgb } else { rgb.map(|c| c * trig::exp2(self.exposure)) };
        let light = exposed.map(|c| c.max(0.0));
        let mapped = match self.tone_map {
            ToneMap::Clamp => light,
            ToneMap::Reinhard => {
                let luminance = 0.212_639 * light[0] + 0.715_169 * light[1] + 0.072_192 * light[2];
                light.map(|c| c / (1.0 + luminance))
            }
            ToneMap::Filmic => light.map(filmic),
        };
        mapped.map(|c| c.min(1.0))
    }
}

/// `srgb_encode` of a number in [0, 1] in 255ths, rounded to the nearest: from a table, since a picture has millions.
fn code(light: f32) -> u8 {
    /// By the upper half of a number's bits, the code of the least number that has them; and the least number of each code.
    struct Table {
        codes: Vec<u8>,
        least: [u32; 256],
    }
    static TABLE: OnceLock<Table> = OnceLock::new();
    const ONE: u32 = 1.0_f32.to_bits();
    let table = TABLE.get_or_init(|| {
        let slowly = |bits: u32| (srgb_encode(f32::from_bits(bits)) * 255.0 + 0.5) as u8;
        // Numbers from zero on are in the order of their bits, and so are their codes.
        let least = |code: usize| {
            let (mut below, mut from) = (0, ONE);
            while below < from {
                let middle = (below + from) / 2;
                if usize::from(slowly(middle)) < code { below = middle + 1 } else { from = middle }
            }
            from
        };
        let codes = (0..=ONE >> 16).map(|upper| slowly(upper << 16)).collect();
        Table { codes, least: std::array::from_fn(least) }
    });
    // (Zero may have a sign.)
    let bits = if light > 0.0 { light.to_bits().min(ONE) } else { 0 };
    let mut code = table.codes[(bits >> 16) as usize];
    while code < u8::MAX && table.least[usize::from(code) + 1] <= bits {
        code += 1;
    }
    code
}

fn filmic(x: f32) -> f32 {
    let x = x.min(1e6);
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plain_display_is_srgb_with_clipping() {
        let d = Display::default();
        assert_eq!(d.srgb_u8([0.0, 1.0, 0.5]), [0, 255, 188]);
        assert_eq!(d.srgb_u8([-3.0, f32::INFINITY, f32::NAN]), [0, 255, 0]);
        assert_eq!(Display { exposure: 1.0, ..d }.srgb_u8([0.25, 0.5, 9.0]), d.srgb_u8([0.5, 1.0, 1.0]));
    }

    #[test]
    fn the_table_of_codes_is_the_formula() {
        let slowly = |x: f32| (srgb_encode(x) * 255.0 + 0.5) as u8;
        // Every 997th number, and the neighbours of every change.
        let mut last = 0;
        for bits in (0..=1.0_f32.to_bits()).step_by(997) {
            let x = f32::from_bits(bits);
            assert_eq!(code(x), slowly(x), "{x}");
            if code(x) != last {
                for bits in bits - 997..bits {
                    assert_eq!(code(f32::from_bits(bits)), slowly(f32::from_bits(bits)));
                }
                last = code(x);
            }
        }
        assert_eq!((code(0.0), code(1.0), code(-0.0)), (0, 255, 0));
    }

    #[test]
    fn curves_keep_order_and_stay_in_range() {
        for tone_map in [ToneMap::Clamp, ToneMap::Reinhard, ToneMap::Filmic] {
            let d = Display { exposure: 0.0, tone_map };
            let mut last = -1.0;
            for i in 0..200 {
                let v = d.srgb([0.05 * i as f32; 3])[1];
                assert!((0.0..=1.0).contains(&v) && v >= last, "{tone_map:?} {i}");
                last = v;
            }
        }
    }
}
