//! An object placed in the world.

use math::{AnimatedTransform, Bounds, DMat4, Vec3};

/// A copy of an object, possibly moving.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index of the object among the [`Accel`](crate::Accel)'s objects.
    pub object: u32,
    /// Places the object.
    pub world_from_object: AnimatedTransform,
}

/// An instance with what traversal needs at hand.
#[derive(Clone, Debug)]
pub(crate) struct Placed {
    pub(crate) object: u32,
    /// Box in the world over all time.
    pub(crate) bounds: Bounds,
    object_from_world: DMat4,
    moving: Option<Box<AnimatedTransform>>,
}

impl Placed {
    pub(crate) fn new(instance: &Instance, object_bounds: &Bounds) -> Self {
        let a = &instance.world_from_object;
        let bounds = widen(&a.motion_bounds(*object_bounds));
        Self {
            object: instance.object,
            bounds,
            object_from_world: a.start().inverse_matrix(),
            moving: a.is_animated().then(|| Box::new(*a)),
        }
    }

    /// Origin and direction in the object's space; the direction keeps its scale, so that `t` is shared. Each is
    /// rounded once.
    #[inline(always)]
    pub(crate) fn to_object(&self, o: Vec3, d: Vec3, time: f32) -> (Vec3, Vec3) {
        let Some(moving) = &self.moving else { return map(&self.object_from_world, o, d) };
        map(&moved(moving, time), o, d)
    }

    /// [`Placed::to_object`] for many rays: origins, directions and times, by axis.
    #[allow(clippy::needless_range_loop, reason = "the same lane of many rows")]
    #[inline(always)]
    pub(crate) fn each_to_object<const N: usize>(
        &self,
        (o, d, time): (&[[f32; N]; 3], &[[f32; N]; 3], &[f32; N]),
        (o_to, d_to): (&mut [[f32; N]; 3], &mut [[f32; N]; 3]),
    ) {
        let mut put = |i: usize, m: &DMat4| {
            let (p, v) = map(m, Vec3::new(o[0][i], o[1][i], o[2][i]), Vec3::new(d[0][i], d[1][i], d[2][i]));
            for (axis, (p, v)) in p.to_array().into_iter().zip(v.to_array()).enumerate() {
                o_to[axis][i] = p;
                d_to[axis][i] = v;
            }
        };
        for i in 0..N {
            match &self.moving {
                None => put(i, &self.object_from_world),
                Some(moving) => put(i, &moved(moving, time[i])),
            }
        }
    }
}

#[inline(never)]
fn moved(a: &AnimatedTransform, time: f32) -> DMat4 {
    a.at(time).inverse_matrix()
}

/// A point and a vector.
#[inline(always)]
fn map(m: &DMat4, o: Vec3, d: Vec3) -> (Vec3, Vec3) {
    let (a, b, c, shift) = (m.x_axis, m.y_axis, m.z_axis, m.w_axis);
    let (o, d) = (o.as_dvec3(), d.as_dvec3());
    let point = |a: f64, b: f64, c: f64, shift: f64| (a * o.x + b * o.y + c * o.z + shift) as f32;
    let vector = |a: f64, b: f64, c: f64| (a * d.x + b * d.y + c * d.z) as f32;
    (
        Vec3::new(
            point(a.x, b.x, c.x, shift.x),
            point(a.y, b.y, c.y, shift.y),
            point(a.z, b.z, c.z, shift.z),
        ),
        Vec3::new(vector(a.x, b.x, c.x), vector(a.y, b.y, c.y), vector(a.z, b.z, c.z)),
    )
}

/// A little larger, for the roundings of the corners and of the ray in object space.
fn widen(b: &Bounds) -> Bounds {
    if b.is_empty() {
        return *b;
    }
    let margin = b.min.abs().max(b.max.abs()) * (4.0 * f32::EPSILON) + Vec3::splat(f32::MIN_POSITIVE);
    Bounds { min: b.min - margin, max: b.max + margin }
}
