//! Of boxes in a row, which neighbour has the smallest common box with each? For building trees.
//!
//! Plain loops, compiled for AVX2 as well; both give the same.
#![allow(unsafe_code, reason = "a function for some processors only; see the SAFETY note")]

/// How far to look on either side.
pub(crate) const RADIUS: usize = 14;
/// Boxes of one call.
pub(crate) const BLOCK: usize = 128;
/// Boxes before and after them.
pub(crate) const PAD: usize = 16;

/// Lower and upper planes by axis, of [`BLOCK`] boxes with [`PAD`] others before and after.
pub(crate) type Planes = [[f32; BLOCK + 2 * PAD]; 6];

/// For each box the step to its partner. Areas count to 19 bits; of equal pairs the one first in order counts, for both
/// sides.
#[inline]
pub(crate) fn best_steps(planes: &Planes, steps: &mut [i32; BLOCK]) {
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: AVX2 was detected.
        return unsafe { with_avx2(planes, steps) };
    }
    plain(planes, steps);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2(planes: &Planes, steps: &mut [i32; BLOCK]) {
    plain(planes, steps);
}

/// The bits of a float's sign, and those that give way to the number of a pair.
const NO_KEY: u32 = 0x8000_001f;

#[inline(always)]
fn plain(planes: &Planes, steps: &mut [i32; BLOCK]) {
    let [ax, ay, az, bx, by, bz] = planes;
    let mut best = [i32::MAX; BLOCK];
    // Areas of the box with the one `d` further on, from `PAD` boxes before the block.
    let mut keys = [0_i32; BLOCK + PAD];
    for d in 1..=RADIUS {
        for i in 0..BLOCK + PAD {
            let x = greater(bx[i], bx[i + d]) - less(ax[i], ax[i + d]);
            let y = greater(by[i], by[i + d]) - less(ay[i], ay[i + d]);
            let z = greater(bz[i], bz[i + d]) - less(az[i], az[i + d]);
            keys[i] = ((x * y + y * z + z * x).to_bits() & !NO_KEY) as i32;
        }
        let (before, after) = ((RADIUS - d) as i32, (RADIUS - 1 + d) as i32);
        for i in 0..BLOCK {
            let key = (keys[PAD + i - d] | before).min(keys[PAD + i] | after);
            best[i] = best[i].min(key);
        }
    }
    for i in 0..BLOCK {
        let number = best[i] & 0x1f;
        let is_before = number < RADIUS as i32;
        steps[i] = number - if is_before { RADIUS as i32 } else { RADIUS as i32 - 1 };
    }
}

/// One instruction, where `f32::min` asks for numbers that are none.
#[inline(always)]
fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_find_the_nearest_of_points() {
        let unit = |i: usize| math::hash::unit_f32(math::hash::mix32(i as u32));
        let mut planes = [[0.0; BLOCK + 2 * PAD]; 6];
        for axis in 0..3 {
            planes[axis] = std::array::from_fn(|i| unit(3 * i + axis));
            planes[axis + 3] = std::array::from_fn(|i| planes[axis][i] + 0.1 * unit(1000 + 3 * i + axis));
        }
        let area = |i: usize, j: usize| {
            let d: [f32; 3] = std::array::from_fn(|a| {
                planes[a + 3][i].max(planes[a + 3][j]) - planes[a][i].min(planes[a][j])
            });
            d[0] * d[1] + d[1] * d[2] + d[2] * d[0]
        };
        let (mut found, mut portable) = ([0; BLOCK], [0; BLOCK]);
        best_steps(&planes, &mut found);
        plain(&planes, &mut portable);
        assert_eq!(found, portable);
        for (i, &step) in (PAD..).zip(&found) {
            let chosen = area(i, i.wrapping_add_signed(step as isize));
            let near = (i - RADIUS..=i + RADIUS).filter(|&j| j != i).map(|j| area(i, j));
            assert!(step != 0 && chosen <= near.fold(f32::INFINITY, f32::min) * (1.0 + 1e-5));
        }
    }
}
