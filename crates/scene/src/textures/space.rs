//! Textures of space: grids of values, and textures projected along three axes.
//!
//! | texture    | value                                                                                          |
//! |------------|------------------------------------------------------------------------------------------------|
//! | `Volume`   | trilinear between points at the centres of the cells of the unit cube, as Mitsuba's grids      |
//! | `Triplanar`| `Σ wᵢ tᵢ / Σ wᵢ` with `wᵢ = |nᵢ|^k`, of textures seen along x, y and z in texture space        |
//!
//! The normal of a projection is the geometric one, so that bumps and interpolated normals do not change what is seen.
//! Left out: the footprint in volumes, which are not filtered.

use std::ops::{Add, Mul};
use std::sync::Arc;

use math::{Transform, Vec2, Vec3, trig};
use scene_desc::WrapMode;

use super::mapping::Mapping3;
use crate::{Footprint, TextureContext};

/// Beyond this power nothing of a blend is left to see.
const MOST_SHARPNESS: f32 = 64.0;

/// A grid of values.
#[derive(Clone, Debug)]
pub(super) struct Volume {
    resolution: [u32; 3],
    values: Arc<[[f32; 3]]>,
    wrap: WrapMode,
    mapping: Mapping3,
}

impl Volume {
    /// `None` unless there is one value for each point, and at least one point.
    pub(super) fn new(
        resolution: [u32; 3],
        values: &Arc<[[f32; 3]]>,
        wrap: WrapMode,
        texture_from_world: &Transform,
    ) -> Option<Self> {
        let n = resolution.iter().try_fold(1_usize, |n, r| n.checked_mul(*r as usize))?;
        let mapping = Mapping3::compile(texture_from_world);
        (n > 0 && n == values.len()).then(|| Self { resolution, values: Arc::clone(values), wrap, mapping })
    }

    /// The value at a point.
    pub(super) fn at(&self, ctx: &TextureContext) -> Vec3 {
        let n = self.resolution.map(|n| n as f32);
        let q = self.mapping.map(ctx).p * Vec3::from(n) - 0.5;
        let (i, f) = (q.floor(), q - q.floor());
        let mut sum = Vec3::ZERO;
        for corner in 0..8_u8 {
            let step = [0, 1, 2].map(|a| corner >> a & 1);
            let weight: f32 = (0..3).map(|a| if step[a] == 1 { f[a] } else { 1.0 - f[a] }).product();
            if weight > 0.0 {
                sum += self.point([0, 1, 2].map(|a| i[a] as i64 + i64::from(step[a]))) * weight;
            }
        }
        sum
    }

    fn point(&self, at: [i64; 3]) -> Vec3 {
        let mut index = [0; 3];
        for a in 0..3 {
            let Some(i) = wrapped(at[a], i64::from(self.resolution[a]), self.wrap) else { return Vec3::ZERO };
            index[a] = i;
        }
        let [x, y, _] = self.resolution.map(|n| n as usize);
        Vec3::from(self.values[(index[2] * y + index[1]) * x + index[0]])
    }
}

/// Where beyond its border a row of `n` points is looked up; `None` where it is nothing.
fn wrapped(i: i64, n: i64, wrap: WrapMode) -> Option<usize> {
    let i = match wrap {
        WrapMode::Repeat => i.rem_euclid(n),
        WrapMode::Mirror => {
            let k = i.rem_euclid(2 * n);
            k.min(2 * n - 1 - k)
        }
        WrapMode::Clamp => i.clamp(0, n - 1),
        WrapMode::Black => i,
    };
    usize::try_from(i).ok().filter(|_| i < n)
}

/// Textures seen along three axes.
#[derive(Clone, Debug)]
pub(super) struct Triplanar<H> {
    planes: Box<[H; 3]>,
    sharpness: f32,
    mapping: Mapping3,
    /// What the components of a normal are in texture space, up to a factor.
    normals: [Vec3; 3],
}

impl<H> Triplanar<H> {
    pub(super) fn new(planes: [H; 3], sharpness: f32, texture_from_world: &Transform) -> Self {
        // A normal maps by the transpose of the inverse.
        let world_from_texture = texture_from_world.inverse();
        Self {
            planes: Box::new(planes),
            sharpness: if sharpness.is_finite() { sharpness.clamp(0.0, MOST_SHARPNESS) } else { 1.0 },
            mapping: Mapping3::compile(texture_from_world),
            normals: [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| world_from_texture.vector(axis)),
        }
    }

    /// The blend of the planes' values, each looked up in coordinates of its own.
    pub(super) fn eval<V>(&self, ctx: &TextureContext, value: impl Fn(&H, &TextureContext) -> V) -> Option<V>
    where
        V: Copy + Add<Output = V> + Mul<f32, Output = V>,
    {
        let n = Vec3::from(self.normals.map(|a| a.dot(ctx.n.0).abs())).try_normalize().unwrap_or(Vec3::Z);
        let weights = n.to_array().map(|c| trig::pow(c, self.sharpness));
        let sum: f32 = weights.iter().sum();
        let at = self.mapping.map(ctx);
        let mut blend: Option<V> = None;
        for (axis, (plane, weight)) in self.planes.iter().zip(weights).enumerate() {
            if weight > 0.0 {
                let flat = |v: Vec3| Vec2::new(v[(axis + 1) % 3], v[(axis + 2) % 3]);
                let footprint = Footprint { duvdx: flat(at.dx), duvdy: flat(at.dy), ..ctx.footprint };
                let seen = value(plane, &TextureContext { uv: flat(at.p), footprint, ..*ctx });
                let part = seen * (weight / sum);
                blend = Some(blend.map_or(part, |b| b + part));
            }
        }
        blend
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Place;
    use math::{DVec3, Dir, Point};

    fn at(p: Vec3, n: Vec3) -> TextureContext {
        let (footprint, place) = (Footprint::default(), Place::default());
        TextureContext { p: Point(p), n: Dir::normalize(n), uv: Vec2::splat(0.5), footprint, place }
    }

    #[test]
    fn volumes_are_trilinear_and_go_on_as_they_are_told() {
        let values: Arc<[[f32; 3]]> = (0..8).map(|i| [i as f32, 1.0, 0.0]).collect();
        let volume = |wrap| Volume::new([2, 2, 2], &values, wrap, &Transform::IDENTITY).unwrap();
        let x = |wrap, p: [f32; 3]| volume(wrap).at(&at(Vec3::from(p), Vec3::Z)).x;
        // x fastest: the value is x + 2y + 4z in points, whose first is at 1/4.
        assert_eq!(x(WrapMode::Clamp, [0.5; 3]), 3.5);
        assert_eq!(x(WrapMode::Clamp, [0.75, 0.25, 0.25]), 1.0);
        assert_eq!(x(WrapMode::Clamp, [9.0, 0.25, 0.25]), 1.0);
        assert_eq!(x(WrapMode::Repeat, [1.25, 0.25, 0.25]), 0.0);
        assert_eq!(x(WrapMode::Mirror, [1.25, 0.25, 0.25]), 1.0);
        assert_eq!(x(WrapMode::Black, [1.25, 0.25, 0.25]), 0.0);
        assert!(Volume::new([2, 2, 3], &values, WrapMode::Clamp, &Transform::IDENTITY).is_none());
    }

    #[test]
    fn a_projection_shows_each_side_its_own_picture() {
        let scale = Transform::scale(DVec3::new(1.0, 2.0, 1.0)).unwrap();
        let projection = Triplanar::new([1.0_f32, 10.0, 100.0], 2.0, &scale);
        let look = |n: Vec3| {
            projection
                .eval(&at(Vec3::new(0.1, 0.2, 0.3), n), |plane, ctx| Vec2::new(*plane, ctx.uv.x))
                .unwrap()
        };
        // Facing an axis, that plane alone, with its own coordinates: (y, z), (z, x), (x, y) of texture space.
        assert_eq!(look(Vec3::X), Vec2::new(1.0, 0.4));
        assert_eq!(look(-Vec3::Y), Vec2::new(10.0, 0.3));
        assert_eq!(look(Vec3::Z), Vec2::new(100.0, 0.1));
        // A plane that leans 45° in texture space, where y is twice as long: normals shrink as lengths grow.
        let half = look(Vec3::new(1.0, 2.0, 0.0)).x;
        assert!((half - 5.5).abs() < 1e-4, "{half}");
    }
}
