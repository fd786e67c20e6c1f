//! Transcendental functions in lanes, with the operations of the single ones.

use super::{Floats, Words};

/// [`crate::trig::sin_cos_within_an_eighth`].
#[inline(always)]
pub fn sin_cos_within_an_eighth<F: Floats>(x: F) -> (F, F) {
    let c = F::splat;
    let t = x * x;
    let sin =
        x - x * t * (c(1.0 / 6.0) - t * (c(1.0 / 120.0) - t * (c(1.0 / 5040.0) - t * c(1.0 / 362_880.0))));
    let cos = t * (c(1.0 / 24.0) - t * (c(1.0 / 720.0) - t * (c(1.0 / 40_320.0) - t * c(1.0 / 3_628_800.0))));
    (sin, c(1.0) - t * (c(0.5) - cos))
}

/// [`crate::trig::atan2`] of numbers below 10³⁰: `libm`'s operations, all of its cases at once.
#[inline(always)]
pub fn atan2<F: Floats>(y: F, x: F) -> F {
    const PI: f32 = 3.141_592_741_0;
    const PI_LO: f32 = -8.742_277_657_3e-8;
    let (zero, word) = (F::splat(0.0), F::Words::splat);
    let sign = word(1 << 31);
    let (x_is_negative, y_is_negative) = ((x.bits() & sign).eq(sign), (y.bits() & sign).eq(sign));
    let (ix, iy) = (x.abs().bits(), y.abs().bits());

    // The angle to the x axis, of size up to π/2 …
    // (`libm` does not ask whether it is upright where x is one.)
    let steep = (ix + word(26 << 23)).lt_signed(iy) & !x.eq(F::splat(1.0));
    let flat = (iy + word(26 << 23)).lt_signed(ix);
    let z = atan_of_positive((y / x).abs());
    // Below 2⁻²⁶ and on the negative side it does not count.
    let z = zero.or_else(flat & x_is_negative, z);
    // … turned into its quadrant.
    let pi = F::splat(PI);
    let left = (pi - (z - F::splat(PI_LO))).or_else(!y_is_negative, (z - F::splat(PI_LO)) - pi);
    let angle = left.or_else(x_is_negative, (-z).or_else(y_is_negative, z));
    let upright = F::splat(-PI / 2.0).or_else(y_is_negative, F::splat(PI / 2.0));
    let angle = upright.or_else(steep | x.eq(zero), angle);
    let level = ((-pi).or_else(y_is_negative, pi)).or_else(x_is_negative, y);
    let angle = level.or_else(y.eq(zero), angle);
    angle.or_else(x.eq(x) & y.eq(y), x + y)
}

/// `libm`'s arctangent of a number that is not negative.
#[inline(always)]
fn atan_of_positive<F: Floats>(x: F) -> F {
    let (c, word) = (F::splat, F::Words::splat);
    let ix = x.bits();
    let below = |bits: u32| ix.lt_signed(word(bits));
    let (tiny, small) = (below(0x3980_0000), below(0x3ee0_0000));
    let (first, second, third) = (below(0x3f30_0000), below(0x3f98_0000), below(0x401c_0000));
    let huge = word(0x4c80_0000 - 1).lt_signed(ix);

    let (one, two) = (c(1.0), c(2.0));
    let above =
        (two * x - one).or_else(first, (x - one).or_else(second, (x - c(1.5)).or_else(third, c(-1.0))));
    let under = (two + x).or_else(first, (x + one).or_else(second, (one + c(1.5) * x).or_else(third, x)));
    let hi = c(4.636_476_039_9e-1).or_else(
        first,
        c(7.853_981_256_5e-1).or_else(second, c(9.827_936_887_7e-1).or_else(third, c(1.570_796_251_3))),
    );
    let lo = c(5.012_158_244e-9).or_else(
        first,
        c(3.774_894_707_9e-8).or_else(second, c(3.447_321_717e-8).or_else(third, c(7.549_789_415_9e-8))),
    );
    let reduced = x.or_else(small, above / under);

    let z = reduced * reduced;
    let w = z * z;
    let s1 = z * (c(3.333_332_836_6e-1) + w * (c(1.425_363_570_5e-1) + w * c(6.168_760_731_8e-2)));
    let s2 = w * (c(-1.999_915_838_2e-1) + w * c(-1.064_801_737_7e-1));
    let without = reduced - reduced * (s1 + s2);
    let with = hi - ((reduced * (s1 + s2) - lo) - reduced);
    let value = x.or_else(tiny, without.or_else(small, with));
    c(1.570_796_251_3 + 7.703_719_777_5e-34).or_else(huge, value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LANES, PortableFloats};
    use crate::{hash, trig};

    #[test]
    fn angles_have_the_bits_of_single_ones() {
        let mut edges =
            vec![0.0, -0.0, 1.0, -1.0, 0.4375, 0.6875, 1.1875, 2.4375, 1e-3, 1e-5, 1e-9, 3e7, 7e7, 1e9];
        edges.extend(edges.clone().iter().map(|e: &f32| -e));
        let mut pairs: Vec<[f32; 2]> = Vec::new();
        for &a in &edges {
            pairs.extend(edges.iter().map(|&b| [a, b]));
        }
        for i in 0..200_000_u64 {
            let h = hash::mix64(i);
            let u = [h as u32, (h >> 32) as u32].map(|b| hash::unit_f32(b) * 2.0 - 1.0);
            pairs.push(if i % 3 == 0 { [u[0] * u[0] * u[0] * 1e-3, u[1]] } else { u });
        }
        for chunk in pairs.chunks(LANES) {
            let (mut y, mut x, mut out) = ([0.5; LANES], [0.5; LANES], [0.0; LANES]);
            for (i, [a, b]) in chunk.iter().enumerate() {
                (y[i], x[i]) = (*a, *b);
            }
            atan2(PortableFloats::load(&y), PortableFloats::load(&x)).store(&mut out);
            for i in 0..LANES {
                let single = trig::atan2(y[i], x[i]);
                assert_eq!(
                    out[i].to_bits(),
                    single.to_bits(),
                    "atan2({}, {}): {} {single}",
                    y[i],
                    x[i],
                    out[i]
                );
            }
            let (mut s, mut c) = ([0.0; LANES], [0.0; LANES]);
            let (sin, cos) = sin_cos_within_an_eighth(PortableFloats::load(&x));
            sin.store(&mut s);
            cos.store(&mut c);
            for i in 0..LANES {
                assert_eq!((s[i], c[i]), trig::sin_cos_within_an_eighth(x[i]));
            }
        }
    }
}
