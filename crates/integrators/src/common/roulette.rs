//! Russian roulette: paths that carry little end early, the others are paid for it; the mean stays [Arvo1990].

use spectrum::Spectrum;

/// When paths may end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Roulette {
    /// Never before this many scattering events.
    pub(crate) rr_depth: u32,
}

/// From this many scattering events on, even a path that loses nothing may end: between perfect mirrors, and without a limit
/// of depth, it would never return.
const ENDLESS: u32 = 64;

impl Roulette {
    /// The factor on the throughput of a path that goes on, or `None` where it ends. `eta_scale` undoes the η² of
    /// refractions on the way, which a path gets back when it leaves the glass.
    pub(crate) fn survive(self, depth: u32, throughput: Spectrum, eta_scale: f32, u: f32) -> Option<f32> {
        let most = if depth < ENDLESS { 1.0 } else { 0.95 };
        let q = (throughput.max_component() * eta_scale).min(most);
        if depth < self.rr_depth || q >= 1.0 {
            return Some(1.0);
        }
        (u < q).then(|| 1.0 / q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survivors_carry_what_the_others_lost() {
        let roulette = Roulette { rr_depth: 2 };
        let n = 1000;
        let total: f32 =
            (0..n).filter_map(|i| roulette.survive(3, Spectrum::splat(0.25), 1.0, i as f32 / n as f32)).sum();
        assert!((total / n as f32 - 1.0).abs() < 1e-3);
        let endless =
            (0..n).filter_map(|i| roulette.survive(ENDLESS, Spectrum::ONE, 1.0, i as f32 / n as f32));
        let (count, sum) = endless.fold((0, 0.0), |(count, sum), paid| (count + 1, sum + paid));
        assert!(count < n && (sum / n as f32 - 1.0).abs() < 1e-3, "{count} {sum}");
        assert_eq!(roulette.survive(1, Spectrum::splat(0.01), 1.0, 0.9), Some(1.0), "too early");
    }
}
