//! What a ray found.

/// The `instance` of a [`Hit`] on static geometry.
pub const NO_INSTANCE: u32 = u32::MAX;

/// Where a ray met the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in units of its direction's length.
    pub t: f32,
    /// Triangles: the barycentric weight of vertex 1. Others: the first surface parameter, in \[0, 1\].
    pub u: f32,
    /// Triangles: the barycentric weight of vertex 2. Others: the second surface parameter, in \[0, 1\].
    pub v: f32,
    /// Index of the instance, or [`NO_INSTANCE`].
    pub instance: u32,
    /// Index of the geometry in its [`Blas`](crate::Blas).
    pub geometry: u32,
    /// Index of the triangle, patch or curve in that geometry; 0 for a sphere, disk or cylinder.
    pub primitive: u32,
}

/// The filter that lets every hit through; costs nothing.
#[inline(always)]
#[must_use]
pub fn accept_all(_: &Hit) -> bool {
    true
}

/// The same for many rays, of which a filter is told the index.
#[inline(always)]
#[must_use]
pub fn accept_all_of(_: usize, _: &Hit) -> bool {
    true
}

/// The best candidate so far, with what decides ties.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Best {
    pub(crate) t: f32,
    pub(crate) instance: u32,
    /// Item number within the Blas: increases with (geometry, primitive).
    pub(crate) item: u32,
    pub(crate) u: f32,
    pub(crate) v: f32,
    /// For a triangle whose `u` and `v` are not yet found: its [`place`]; else [`NOWHERE`].
    pub(crate) place: u64,
    pub(crate) found: bool,
}

/// No place.
pub(crate) const NOWHERE: u64 = u64::MAX;

/// A lane of a block of triangles.
#[inline(always)]
pub(crate) fn place(block: usize, lane: usize) -> u64 {
    (block as u64) << 3 | lane as u64
}

impl Best {
    /// Nothing yet: only `t < t_max` beats it.
    pub(crate) fn nothing(t_max: f32) -> Self {
        Self { t: t_max, instance: 0, item: 0, u: 0.0, v: 0.0, place: NOWHERE, found: false }
    }

    /// Does (t, instance, item) come before this one?
    #[inline(always)]
    pub(crate) fn loses_to(&self, t: f32, instance: u32, item: u32) -> bool {
        t < self.t || (t == self.t && (instance, item) < (self.instance, self.item))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_go_to_the_smaller_instance_then_item() {
        let best = Best { t: 1.0, instance: 2, item: 5, u: 0.0, v: 0.0, place: NOWHERE, found: true };
        assert!(best.loses_to(1.0, 1, 9) && best.loses_to(1.0, 2, 4) && best.loses_to(0.5, 7, 7));
        assert!(!best.loses_to(1.0, 2, 5) && !best.loses_to(1.0, 3, 0) && !best.loses_to(f32::NAN, 0, 0));
        assert!(!Best::nothing(1.0).loses_to(1.0, 0, 0), "t_max itself is out of range");
    }
}
