//! Eight lanes of `f32`.

/// What the traversal needs of a register. Minimum and maximum give the second operand where the two are equal or
/// unordered, as x86 does; a comparison with NaN is false.
pub(super) trait Lanes: Copy {
    fn splat(x: f32) -> Self;
    fn load(a: &[f32; 8]) -> Self;
    fn store(self, a: &mut [f32; 8]);
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    /// `self · b + c`, rounded once.
    fn mul_add(self, b: Self, c: Self) -> Self;
    fn min(self, b: Self) -> Self;
    fn max(self, b: Self) -> Self;
    /// Bit `i` is set where lane `i` of `self` is at most that of `b`.
    fn le(self, b: Self) -> u32;
    /// `other` in lanes where the sign bit of `sign` is set, else `self`.
    fn or_if_negative(self, other: Self, sign: Self) -> Self;
}
