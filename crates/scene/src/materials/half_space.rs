//! Albedo inversion: which particles under a smooth border give back a share of the light that enters.
//!
//! A random walk under the border of a half-space without absorption, whose number of collisions is kept, tells the albedo for
//! every single-scattering albedo ω at once: the mean of `ω^n`. The border is a [`SoftBorder`]: light enters evenly. Of what
//! is reflected outside nothing is counted, as in pbrt's `subsurface` (there the albedo is that of photon beam diffusion).

use math::trig;
use sampling::rng::Rng;
use scatter::{HenyeyGreenstein, PhaseKind, SoftBorder};

/// How often light collides under a border before it leaves.
#[derive(Clone, Debug)]
pub(super) struct HalfSpace {
    /// Share of the light that leaves after `n` collisions.
    shares: Vec<f64>,
    /// Share that is still inside after that many.
    rest: f64,
}

/// Walks; the albedo has an error of a quarter of a per cent.
const WALKS: u32 = 1 << 14;
/// Collisions that are followed.
const MOST: usize = 1 << 12;

impl HalfSpace {
    /// Below a border with refractive index `eta` over outside, of particles with mean cosine `g`.
    pub(super) fn new(eta: f32, g: f32) -> Self {
        let (phase, reflectance) = (HenyeyGreenstein::new(g), SoftBorder::inside(eta));
        let mut rng = Rng::from_parts(&[0x5b5, u64::from(eta.to_bits()), u64::from(g.to_bits())]);
        let (mut shares, mut rest) = (vec![0.0; MOST], 0.0);
        let share = 1.0 / f64::from(WALKS);
        for i in 0..WALKS {
            let u = (i as f32 + rng.next_f32()) / WALKS as f32;
            match collisions(u.sqrt(), reflectance, phase, &mut rng) {
                Some(n) => shares[n] += share,
                None => rest += share,
            }
        }
        Self { shares, rest }
    }

    /// The share of the light that enters and leaves again for single-scattering albedo `omega`.
    fn albedo(&self, omega: f64) -> f64 {
        let below = self.shares.iter().rev().fold(0.0, |sum, share| sum * omega + share);
        // What is left would leave late, with a tail like n^(−3/2).
        below + self.rest * math::trig::f64::pow(omega, 3.0 * MOST as f64)
    }

    /// Albedos of half-spaces, by single-scattering albedo.
    pub(super) fn table(&self) -> AlbedoTable {
        AlbedoTable((0..AlbedoTable::SIZE).map(|i| self.albedo(AlbedoTable::omega(i)) as f32).collect())
    }

    /// The single-scattering albedo that gives back this share.
    pub(super) fn invert(&self, albedo: f32) -> f32 {
        let (mut lo, mut hi) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (lo + hi);
            if self.albedo(middle) < f64::from(albedo) { lo = middle } else { hi = middle }
        }
        hi as f32
    }
}

/// What half-spaces give back, for quick looks both ways.
#[derive(Clone, Debug)]
pub(super) struct AlbedoTable(std::sync::Arc<[f32]>);

impl AlbedoTable {
    const SIZE: usize = 129;

    /// Entries are denser towards one, where the albedo is steep: they are even in the root of 1 − ω.
    fn omega(i: usize) -> f64 {
        let root = 1.0 - i as f64 / (Self::SIZE - 1) as f64;
        1.0 - root * root
    }

    /// The share that single-scattering albedo `omega` gives back.
    pub(super) fn albedo(&self, omega: f32) -> f32 {
        let x = (1.0 - trig::safe_sqrt(1.0 - omega.min(1.0))) * (Self::SIZE - 1) as f32;
        let i = (x as usize).min(Self::SIZE - 2);
        let t = x - i as f32;
        self.0[i] * (1.0 - t) + self.0[i + 1] * t
    }

    /// The single-scattering albedo that gives back this share.
    pub(super) fn invert(&self, albedo: f32) -> f32 {
        let i = self.0.partition_point(|a| *a < albedo).clamp(1, Self::SIZE - 1);
        let (lo, hi) = (self.0[i - 1], self.0[i]);
        let t = if hi > lo { ((albedo - lo) / (hi - lo)).clamp(0.0, 1.0) } else { 0.0 };
        let root = 1.0 - (i as f32 - 1.0 + t) / (Self::SIZE - 1) as f32;
        1.0 - root * root
    }
}

/// Collisions of a walk that begins downwards with cosine `cos`; `None` for more than are followed. Lengths are in mean
/// free paths.
fn collisions(cos: f32, reflectance: f32, phase: HenyeyGreenstein, rng: &mut Rng) -> Option<usize> {
    let (mut depth, mut cos) = (0.0_f32, cos);
    for n in 0..MOST {
        depth -= trig::ln(1.0 - rng.next_f32()) * cos;
        while depth <= 0.0 {
            if rng.next_f32() >= reflectance {
                return Some(n);
            }
            cos = rng.next_f32().sqrt();
            depth = -trig::ln(1.0 - rng.next_f32()) * cos;
        }
        let turn = -phase.sample_cos(rng.next_f32());
        let across = trig::safe_sqrt((1.0 - cos * cos) * (1.0 - turn * turn));
        cos = (cos * turn + across * trig::cos(std::f32::consts::TAU * rng.next_f32())).clamp(-1.0, 1.0);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_spaces_have_the_albedo_of_chandrasekhar() {
        // Ground truth, sec. 6: A* of isotropic half-spaces without a border.
        let bare = HalfSpace::new(1.0, 0.0);
        for (omega, albedo) in
            [(0.5, 0.146_544_4), (0.8, 0.341_866_8), (0.9, 0.478_025_4), (0.99, 0.794_563_7), (1.0, 1.0)]
        {
            let found = bare.albedo(omega);
            assert!((found - albedo).abs() < 0.006, "ω {omega}: {found} is not {albedo}");
        }
        // Forward scattering is like less scattering (similarity); a border keeps light inside, where it is absorbed.
        assert!(HalfSpace::new(1.0, 0.8).albedo(0.9) < bare.albedo(0.9));
        let under_glass = HalfSpace::new(1.33, 0.0);
        assert!(under_glass.albedo(0.9) < bare.albedo(0.9) && under_glass.albedo(1.0) > 0.999);
    }

    #[test]
    fn a_table_says_what_the_walks_say() {
        let h = HalfSpace::new(1.33, 0.3);
        let table = h.table();
        for omega in [0.0, 0.3, 0.77, 0.9, 0.999, 1.0] {
            let albedo = h.albedo(omega);
            assert!((f64::from(table.albedo(omega as f32)) - albedo).abs() < 1e-3, "{omega}");
            assert!((f64::from(table.invert(albedo as f32)) - omega).abs() < 2e-3, "{omega}");
        }
    }

    #[test]
    fn inversion_undoes_the_albedo() {
        let h = HalfSpace::new(1.33, 0.3);
        for omega in [0.0, 0.3, 0.9, 0.999] {
            let back = h.invert(h.albedo(omega) as f32);
            assert!((f64::from(back) - omega).abs() < 1e-4, "{omega} {back}");
        }
    }
}
