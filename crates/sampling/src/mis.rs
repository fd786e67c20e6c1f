//! Multiple importance sampling: weights for one sample from each of two techniques [Veach1997, ch. 9].

use crate::{Measure, Pdf};

/// How the densities of competing techniques become weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// In proportion to the density.
    Balance,
    /// In proportion to its square.
    #[default]
    Power,
}

impl Heuristic {
    /// The share of a technique beside another whose density is `ratio` times its own, and what both together are to a third:
    /// as one whose density is so many times the first's.
    #[must_use]
    pub fn beside(self, ratio: f32) -> (f32, f32) {
        match self {
            Self::Balance => (1.0 / (1.0 + ratio), 1.0 + ratio),
            Self::Power => (1.0 / (1.0 + ratio * ratio), (1.0 + ratio * ratio).sqrt()),
        }
    }

    /// The weight of the technique that made the sample.
    #[must_use]
    pub fn weight<M: Measure>(self, chosen: Pdf<M>, other: Pdf<M>) -> f32 {
        match self {
            Self::Balance => balance(chosen, other),
            Self::Power => power(chosen, other),
        }
    }
}

/// Balance heuristic `p / (p + q)` [Veach1997, eq. 9.8]. Both densities are of one measure; the types see to it.
#[must_use]
pub fn balance<M: Measure>(chosen: Pdf<M>, other: Pdf<M>) -> f32 {
    ratio(chosen, other, |r| r)
}

/// Power heuristic with exponent 2, `p² / (p² + q²)` [Veach1997, sec. 9.2.3].
#[must_use]
pub fn power<M: Measure>(chosen: Pdf<M>, other: Pdf<M>) -> f32 {
    ratio(chosen, other, |r| r * r)
}

/// `1 / (1 + g(q/p))`: densities are divided first, so that squares do not overflow.
fn ratio<M: Measure>(chosen: Pdf<M>, other: Pdf<M>, g: impl Fn(f32) -> f32) -> f32 {
    if chosen.is_positive() { 1.0 / (1.0 + g(other.value() / chosen.value())) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SolidAngle;

    #[test]
    fn weights_of_both_techniques_add_up_to_one() {
        for (a, b) in [(0.3, 2.0), (1e-20, 1e20), (1e30, 1e30), (1.0, 0.0)] {
            let (p, q) = (Pdf::<SolidAngle>::new(a), Pdf::new(b));
            for h in [Heuristic::Balance, Heuristic::Power] {
                assert!((h.weight(p, q) + h.weight(q, p) - 1.0).abs() < 1e-6, "{h:?} {a} {b}");
            }
        }
    }

    #[test]
    fn weights_of_three_techniques_add_up_to_one() {
        let pdf = Pdf::<SolidAngle>::new;
        for [a, b, c] in [[0.3, 2.0, 1.0], [1.0, 1e-3, 1e3], [2.0, 1e3, 0.0]] {
            for h in [Heuristic::Balance, Heuristic::Power] {
                let ((of_a, a_and_b), (of_b, b_and_a)) = (h.beside(b / a), h.beside(a / b));
                let sum = of_a * h.weight(pdf(a * a_and_b), pdf(c))
                    + of_b * h.weight(pdf(b * b_and_a), pdf(c))
                    + h.weight(pdf(c), pdf(a * a_and_b));
                assert!((sum - 1.0).abs() < 1e-6, "{h:?} {a} {b} {c}: {sum}");
            }
            assert_eq!(Heuristic::Power.beside(0.0), (1.0, 1.0));
        }
    }
}
