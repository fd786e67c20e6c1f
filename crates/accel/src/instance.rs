//! An object placed in the world.

use math::{AnimatedTransform, Bounds, DMat4, DVec3, Vec3};

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
    #[inline]
    pub(crate) fn to_object(&self, o: Vec3, d: Vec3, time: f32) -> (Vec3, Vec3) {
        let m = match &self.moving {
            None => self.object_from_world,
            Some(a) => a.at(time).inverse_matrix(),
        };
        let point: DVec3 = m.transform_point3(o.as_dvec3());
        (point.as_vec3(), m.transform_vector3(d.as_dvec3()).as_vec3())
    }
}

/// A little larger, for the roundings of the corners and of the ray in object space.
fn widen(b: &Bounds) -> Bounds {
    if b.is_empty() {
        return *b;
    }
    let margin = b.min.abs().max(b.max.abs()) * (4.0 * f32::EPSILON) + Vec3::splat(f32::MIN_POSITIVE);
    Bounds { min: b.min - margin, max: b.max + margin }
}
