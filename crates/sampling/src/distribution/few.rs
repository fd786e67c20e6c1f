//! A choice among a handful, too few for a table.

/// Chances in proportion to weights; `None` where all are zero.
#[inline]
#[must_use]
pub fn chances<const N: usize>(weights: [f32; N]) -> Option<[f32; N]> {
    let sum: f32 = weights.iter().sum();
    (sum > 0.0).then(|| weights.map(|w| w / sum))
}

/// The one that `u` falls on, and the number that is left.
#[inline]
#[must_use]
pub fn choose<const N: usize>(chances: [f32; N], u: f32) -> (usize, f32) {
    let (mut left, mut last) = (u, 0);
    for (i, p) in chances.into_iter().enumerate() {
        if p > 0.0 {
            if left < p {
                return (i, left / p);
            }
            last = i;
        }
        left -= p;
    }
    (last, 1.0 - f32::EPSILON)
}
