//! Weighted choice in constant time: the alias method [Walker1977], built as in [Vose1991].

/// A choice among `n` with probabilities in proportion to weights.
#[derive(Clone, Debug, PartialEq)]
pub struct AliasTable {
    bins: Vec<Bin>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Bin {
    /// Below this share of the bin the choice is the bin itself.
    keep: f32,
    /// Above it, this one.
    alias: u32,
    /// Probability of the bin's own index.
    probability: f32,
}

/// An index, its probability, and a number that is uniform again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Which.
    pub index: usize,
    /// With what probability.
    pub probability: f32,
    /// Uniform in [0, 1), independent of the index; with as many fewer bits as the choice used.
    pub u: f32,
}

impl AliasTable {
    /// From weights, of which those that are not positive and finite count as zero; if all do, the choice is uniform.
    /// `None` if there are no weights.
    #[must_use]
    pub fn new(weights: &[f32]) -> Option<Self> {
        let n = weights.len();
        if n == 0 || u32::try_from(n).is_err() {
            return None;
        }
        let clean = |w: f32| if w > 0.0 && w.is_finite() { f64::from(w) } else { 0.0 };
        let sum: f64 = weights.iter().map(|&w| clean(w)).sum();
        let p = |i: usize| if sum > 0.0 { clean(weights[i]) / sum } else { 1.0 / n as f64 };
        let mut bins: Vec<Bin> =
            (0..n).map(|i| Bin { keep: 1.0, alias: i as u32, probability: p(i) as f32 }).collect();

        // Bins with less than the average take the rest of their share from one that has more.
        let mut share: Vec<f64> = (0..n).map(|i| p(i) * n as f64).collect();
        let (mut under, mut over): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| share[i] < 1.0);
        while let (Some(&small), Some(&large)) = (under.last(), over.last()) {
            under.pop();
            bins[small].keep = share[small] as f32;
            bins[small].alias = large as u32;
            share[large] -= 1.0 - share[small];
            if share[large] < 1.0 {
                over.pop();
                under.push(large);
            }
        }
        // What is left has a share of one but for rounding; a bin of zero weight must not be among it.
        let heaviest = (0..n).fold(0, |a, b| if bins[b].probability > bins[a].probability { b } else { a });
        for i in under {
            if bins[i].probability == 0.0 {
                (bins[i].keep, bins[i].alias) = (0.0, heaviest as u32);
            }
        }
        Some(Self { bins })
    }

    /// How many there are to choose from.
    #[must_use]
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Never: a table has at least one bin.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }

    /// Chooses.
    #[must_use]
    pub fn sample(&self, u: f32) -> Choice {
        let x = f64::from(u) * self.bins.len() as f64;
        let i = (x as usize).min(self.bins.len() - 1);
        let (bin, rest) = (&self.bins[i], (x - i as f64) as f32);
        let (index, u) = if rest < bin.keep {
            (i, rest / bin.keep)
        } else {
            (bin.alias as usize, (rest - bin.keep) / (1.0 - bin.keep))
        };
        Choice { index, probability: self.bins[index].probability, u: u.clamp(0.0, 1.0 - f32::EPSILON / 2.0) }
    }

    /// The probability of an index.
    #[must_use]
    pub fn probability(&self, index: usize) -> f32 {
        self.bins.get(index).map_or(0.0, |b| b.probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_the_unit_interval_are_the_probabilities() {
        let weights: Vec<f32> = (0..37).map(|i| if i % 5 == 0 { 0.0 } else { (i * i) as f32 }).collect();
        let table = AliasTable::new(&weights).unwrap();
        let n = 1 << 20;
        let (mut counts, mut sums) = (vec![0.0; 37], vec![0.0; 37]);
        for i in 0..n {
            let c = table.sample((i as f32 + 0.5) / n as f32);
            assert_eq!(c.probability, table.probability(c.index));
            counts[c.index] += 1.0;
            sums[c.index] += f64::from(c.u);
        }
        let total: f32 = weights.iter().sum();
        for i in 0..37 {
            // A grid hits the shares of a bin up to one point at each end, at most 37 times.
            let expected = f64::from(weights[i] / total);
            assert!((counts[i] / f64::from(n) - expected).abs() < 38.0 * 2.0 / f64::from(n), "{i}");
            assert!(
                counts[i] == 0.0 || (sums[i] / counts[i] - 0.5).abs() < 0.01,
                "{i}: {}",
                sums[i] / counts[i]
            );
        }
        assert!((0..37).filter(|i| i % 5 == 0).all(|i| counts[i] == 0.0));
    }

    #[test]
    fn odd_weights_are_harmless() {
        assert!(AliasTable::new(&[]).is_none());
        let uniform = AliasTable::new(&[0.0, f32::NAN, -1.0, 0.0]).unwrap();
        assert_eq!((uniform.sample(0.6).index, uniform.sample(0.6).probability), (2, 0.25));
        let one = AliasTable::new(&[0.0, 0.0, 1e-30, 0.0]).unwrap();
        assert!((0..100).all(|i| one.sample(i as f32 / 100.0).index == 2));
    }
}
