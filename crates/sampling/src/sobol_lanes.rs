//! Numbers of the Sobol' sampler for sixteen paths of one pass at once, with the bits that [`crate::Sampler`] gives each.

use math::lanes::{Floats, Longs, Words};

/// The long words of a kind of floats.
pub type LongsOf<F> = <<F as Floats>::Words as Words>::Longs;

/// The next requests of sixteen camera paths.
#[derive(Clone, Copy)]
pub struct SobolLanes<F: Floats> {
    /// Hash of what each path belongs to: see [`crate::PathState`].
    pub keys: LongsOf<F>,
    /// Which point of the sequence all of them are, its bits reversed.
    pub index: u32,
    /// Which request of each comes next.
    pub dimension: F::Words,
}

impl<F: Floats> SobolLanes<F> {
    /// [`crate::Sampler::skip_1d`].
    #[inline(always)]
    pub fn skip(&mut self) {
        self.dimension = self.dimension + F::Words::splat(1);
    }

    /// [`crate::Sampler::next_1d`].
    #[inline(always)]
    pub fn next_1d(&mut self) -> F {
        let hash = self.hash();
        let shuffled = self.shuffled(hash);
        laine_karras::<F>(shuffled, hash.high()).reverse_bits().unit()
    }

    /// [`crate::Sampler::next_2d`].
    #[inline(always)]
    pub fn next_2d(&mut self) -> [F; 2] {
        let hash = self.hash();
        let shuffled = self.shuffled(hash);
        let first = laine_karras::<F>(shuffled, hash.high()).reverse_bits();
        let second = laine_karras::<F>(pascal::<F>(shuffled), hash.low()).reverse_bits();
        [first.unit(), second.unit()]
    }

    #[inline(always)]
    fn hash(&mut self) -> LongsOf<F> {
        let d = self.dimension;
        self.skip();
        (self.keys ^ (d.longs() * LongsOf::<F>::splat(0x9e37_79b9_7f4a_7c15))).mix64()
    }

    #[inline(always)]
    fn shuffled(&self, hash: LongsOf<F>) -> F::Words {
        let seed = (hash * LongsOf::<F>::splat(0x9e37_79b9_7f4a_7c15)).high();
        laine_karras::<F>(F::Words::splat(self.index), seed).reverse_bits()
    }
}

/// [`crate::sobol::laine_karras`].
#[inline(always)]
fn laine_karras<F: Floats>(x: F::Words, seed: F::Words) -> F::Words {
    let c = F::Words::splat;
    let x = x ^ (x * c(0x3d20_adea));
    let x = x + seed;
    let x = x * (seed.shr::<16>() | c(1));
    let x = x ^ (x * c(0x0552_6c56));
    x ^ (x * c(0x53a2_2864))
}

/// [`crate::sobol::pascal`].
#[inline(always)]
fn pascal<F: Floats>(i: F::Words) -> F::Words {
    let c = F::Words::splat;
    let i = i ^ (i.shr::<16>() & c(0x0000_ffff));
    let i = i ^ (i.shr::<8>() & c(0x00ff_00ff));
    let i = i ^ (i.shr::<4>() & c(0x0f0f_0f0f));
    let i = i ^ (i.shr::<2>() & c(0x3333_3333));
    i ^ (i.shr::<1>() & c(0x5555_5555))
}

#[cfg(test)]
mod tests {
    use math::lanes::{LANES, PortableFloats, PortableLongs, PortableWords};

    use super::*;
    use crate::{Sampler, SamplerKind};

    #[test]
    fn lanes_have_the_numbers_of_single_paths() {
        for pass in [0, 1, 7, 1000] {
            let mut paths: Vec<Sampler> = (0..LANES as i32)
                .map(|x| {
                    let mut s = Sampler::new(SamplerKind::Sobol, 5);
                    s.start([x, 3], pass);
                    s.set_dimension(x as u32 % 3);
                    s
                })
                .collect();
            let (mut keys, mut dimensions) = ([0; LANES], [0; LANES]);
            let mut index = 0;
            for (i, s) in paths.iter().enumerate() {
                let state = s.path_state().unwrap();
                (keys[i], dimensions[i], index) = (state.key, state.dimension, state.index);
            }
            let mut lanes = SobolLanes::<PortableFloats> {
                keys: PortableLongs::load(&keys),
                index,
                dimension: PortableWords::load(&dimensions),
            };
            for _ in 0..4 {
                let mut out = [[0.0; LANES]; 3];
                let [a, b] = lanes.next_2d();
                a.store(&mut out[0]);
                b.store(&mut out[1]);
                lanes.skip();
                lanes.next_1d().store(&mut out[2]);
                for (i, s) in paths.iter_mut().enumerate() {
                    assert_eq!([out[0][i], out[1][i]], s.next_2d());
                    s.skip_1d();
                    assert_eq!(out[2][i], s.next_1d());
                }
            }
        }
    }
}
