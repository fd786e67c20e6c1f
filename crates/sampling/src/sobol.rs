//! The (0, 2)-sequence of Sobol', Owen-scrambled by hashing.
//!
//! | step                                   | source                                  |
//! |----------------------------------------|-----------------------------------------|
//! | first two dimensions                   | [Sobol1967]; the second is Pascal's triangle mod 2 |
//! | nested uniform scramble                | [Owen1995]                              |
//! | … as a hash of the reversed bits       | [Laine2011], [Burley2020]               |
//! | … with these constants                 | [Vegdahl2021]                           |
//! | padding by shuffled indices            | [Burley2020], sec. 4                    |
//!
//! Departs from [Burley2020]: only pairs of dimensions are used, each padded with an index shuffle of its own, and
//! the second dimension comes from five xor-shifts instead of a loop over direction numbers: by Lucas' theorem the
//! binomial C(j, i) is odd just when the bits of i are among those of j, which is the fivefold Kronecker
//! power of ((1, 1), (0, 1)).

/// A permutation of `u32` in which each bit depends on itself and the bits below it alone: seen from the highest bit of the
/// reversed word, a nested uniform scramble.
#[inline]
#[must_use]
pub const fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Owen scramble of a number in [0, 1) that is given as 32 bits.
#[inline]
#[must_use]
pub const fn owen_scramble(x: u32, seed: u32) -> u32 {
    laine_karras(x.reverse_bits(), seed).reverse_bits()
}

/// The bits of the second dimension, lowest first: `y = P i` with Pascal's matrix mod 2.
#[inline]
#[must_use]
pub const fn pascal(mut i: u32) -> u32 {
    i ^= (i >> 16) & 0x0000_ffff;
    i ^= (i >> 8) & 0x00ff_00ff;
    i ^= (i >> 4) & 0x0f0f_0f0f;
    i ^= (i >> 2) & 0x3333_3333;
    i ^ ((i >> 1) & 0x5555_5555)
}

/// The seeds of one padded pair: of the index shuffle, and of the scramble of each dimension.
#[derive(Clone, Copy, Debug)]
pub struct PairSeeds {
    /// Of the index.
    pub shuffle: u32,
    /// Of the two dimensions.
    pub scramble: [u32; 2],
}

impl PairSeeds {
    /// From a hash.
    #[inline]
    #[must_use]
    pub const fn new(hash: u64) -> Self {
        let shuffle = (hash.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as u32;
        Self { shuffle, scramble: [(hash >> 32) as u32, hash as u32] }
    }
}

/// One number as 32 bits. `reversed_index` is the index with its bits reversed.
#[inline]
#[must_use]
pub const fn scrambled_1d(reversed_index: u32, seeds: PairSeeds) -> u32 {
    let shuffled = laine_karras(reversed_index, seeds.shuffle).reverse_bits();
    // The radical inverse is the reversed index, and the scramble reverses it again.
    laine_karras(shuffled, seeds.scramble[0]).reverse_bits()
}

/// Two numbers as 32 bits each. `reversed_index` is the index with its bits reversed.
#[inline]
#[must_use]
pub const fn scrambled_2d(reversed_index: u32, seeds: PairSeeds) -> [u32; 2] {
    let shuffled = laine_karras(reversed_index, seeds.shuffle).reverse_bits();
    let first = laine_karras(shuffled, seeds.scramble[0]);
    let second = laine_karras(pascal(shuffled), seeds.scramble[1]);
    // Both reversed at once, which exchanges them.
    let both = ((first as u64) << 32 | second as u64).reverse_bits();
    [both as u32, (both >> 32) as u32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pascals_matrix_is_made_of_binomials_and_gives_the_sobol_points() {
        // Direction numbers of the polynomial x + 1: v1 = 1/2, v_{j+1} = v_j xor v_j / 2.
        let mut v = 1_u32 << 31;
        for bit in 0..32 {
            assert_eq!(pascal(1 << bit).reverse_bits(), v, "bit {bit}");
            v ^= v >> 1;
        }
        let first: Vec<u32> = (0..8).map(|i| pascal(i).reverse_bits() >> 29).collect();
        assert_eq!(first, [0, 4, 6, 2, 5, 1, 3, 7]);
    }

    #[test]
    fn the_scramble_is_nested() {
        // Numbers that share their first k bits share them after, and differ in the next bit after too.
        for seed in [0, 1, 0xdead_beef, 0x1234_5678] {
            for k in 0..31 {
                let (a, b) = (0xa5a5_5a5a_u32, 0xa5a5_5a5a ^ (1 << (31 - k)) ^ 5);
                let (x, y) = (owen_scramble(a, seed), owen_scramble(b, seed));
                assert_eq!((x ^ y).leading_zeros(), (a ^ b).leading_zeros(), "seed {seed} bit {k}");
            }
        }
    }
}
