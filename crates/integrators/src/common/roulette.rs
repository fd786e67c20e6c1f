//! Russian roulette: paths that carry little end early, the others are paid for it; the mean stays [Arvo1990].

use math::lanes::{Floats, Words};
use sampling::Sampler;
use spectrum::Spectrum;

/// When paths may end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Roulette {
    /// Never before this many scattering events.
    pub(crate) rr_depth: u32,
    /// What the throughput is multiplied by to become the chance to go on.
    pub(crate) patience: f32,
}

/// From this many scattering events on, even a path that loses nothing may end: between perfect mirrors, and without a limit
/// of depth, it would never return.
const ENDLESS: u32 = 64;
/// The same in media, where long walks are the rule.
const ENDLESS_IN_MEDIA: u32 = 4096;

impl Roulette {
    /// The chance is the throughput: survivors carry no more than others began with.
    pub(crate) fn from(rr_depth: u32) -> Self {
        Self { rr_depth, patience: 1.0 }
    }

    /// For a walk whose vertices cost alike, such as those of `path`: it ends when it carries less than a third. The best chance is
    /// in proportion to the throughput, by a factor that grows where samples differ little from their pixel [Rath2022]; decision 0270
    /// has what other factors cost.
    pub(crate) fn patient(rr_depth: u32) -> Self {
        Self { rr_depth, patience: 3.0 }
    }

    /// The depth to ask with after a collision in a medium: long walks there come out in the end.
    pub(crate) fn depth_in_medium(depth: u32) -> u32 {
        if depth < ENDLESS_IN_MEDIA { depth.min(ENDLESS - 1) } else { depth }
    }

    /// The factor on the throughput of a path that goes on, or `None` where it ends. `eta_scale` undoes the η² of
    /// refractions on the way, which a path gets back when it leaves the glass. Takes one number of the sampler.
    #[inline]
    pub(crate) fn survive(
        self,
        depth: u32,
        throughput: Spectrum,
        eta_scale: f32,
        sampler: &mut Sampler,
    ) -> Option<f32> {
        let q = self.chance(depth, throughput, eta_scale);
        if q >= 1.0 {
            sampler.skip_1d();
            return Some(1.0);
        }
        paid(q, sampler.next_1d())
    }

    /// The same for a path of which a guide knows what it may `bring` here, in the share of what the whole path was expected
    /// to bring [Vorba2016, without splitting]: it ends where that is little, and never because of its throughput alone. What a guide
    /// expects is a mean over a leaf; a path that brings a tenth of its pixel is left alone, and no chance is below a tenth.
    pub(crate) fn survive_guided(self, depth: u32, share: f32, sampler: &mut Sampler) -> Option<f32> {
        let share =
            if depth < self.rr_depth || share.is_nan() { 1.0 } else { (10.0 * share).clamp(0.1, 1.0) };
        self.survive(depth, Spectrum::splat(share), 1.0, sampler)
    }

    /// The chance to go on.
    fn chance(self, depth: u32, throughput: Spectrum, eta_scale: f32) -> f32 {
        let most = if depth < ENDLESS { 1.0 } else { 0.95 };
        if depth < self.rr_depth {
            1.0
        } else {
            (throughput.max_component() * eta_scale * self.patience).min(most)
        }
    }

    /// The chances of sixteen paths to go on.
    #[inline(always)]
    pub(crate) fn chance_lanes<F: Floats>(self, depth: F::Words, throughput: [F; 4], eta_scale: F) -> F {
        let one = F::splat(1.0);
        let is_below = |d: u32| depth.lt_signed(F::Words::splat(d));
        let most = one.or_else(is_below(ENDLESS), F::splat(0.95));
        let [a, b, c, d] = throughput;
        let brightest = a.max(b).max(c.max(d));
        one.or_else(is_below(self.rr_depth), (brightest * eta_scale * F::splat(self.patience)).min(most))
    }
}

fn paid(q: f32, u: f32) -> Option<f32> {
    (u < q).then(|| 1.0 / q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survivors_carry_what_the_others_lost() {
        let roulette = Roulette::from(2);
        let n = 1000;
        for (depth, throughput, q) in [(3, 0.25, 0.25), (ENDLESS, 1.0, 0.95)] {
            let chance = roulette.chance(depth, Spectrum::splat(throughput), 1.0);
            assert_eq!(chance, q);
            let total: f32 = (0..n).filter_map(|i| paid(chance, i as f32 / n as f32)).sum();
            assert!((total / n as f32 - 1.0).abs() < 2e-3, "{total}");
        }
        assert_eq!(roulette.chance(1, Spectrum::splat(0.01), 1.0), 1.0, "too early");
        assert_eq!(roulette.chance(9, Spectrum::splat(0.5), 4.0), 1.0, "light in glass");
        let patient = Roulette::patient(2);
        assert_eq!([0.4, 0.25].map(|t| patient.chance(3, Spectrum::splat(t), 1.0)), [1.0, 0.75]);
    }

    #[test]
    fn a_number_is_taken_whether_it_is_looked_at_or_not() {
        let mut sampler = Sampler::new(sampling::SamplerKind::Sobol, 1);
        let roulette = Roulette::from(2);
        for depth in [0, 5] {
            sampler.start([1, 2], 3);
            let _ = roulette.survive(depth, Spectrum::splat(0.5), 1.0, &mut sampler);
            assert_eq!(sampler.dimension(), 1);
        }
    }
}
