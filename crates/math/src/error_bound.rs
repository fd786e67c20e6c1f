//! Bounds on floating-point error, and ray origins that are safely off a surface [PBR4e, sec. 6.8].

use glam::Vec3;

use crate::{Dir, Point};

/// Half the distance from 1 to the next `f32`: the largest relative error of one rounding.
pub const MACHINE_EPSILON: f32 = f32::EPSILON * 0.5;

/// γₙ = nε / (1 − nε): bound on the relative error of `n` roundings [PBR4e, eq. 6.17].
#[must_use]
pub const fn gamma(n: i32) -> f32 {
    (n as f32 * MACHINE_EPSILON) / (1.0 - n as f32 * MACHINE_EPSILON)
}

/// `p` moved off its surface to the side of `w`, past the box of half-size `p_error` in which the true point lies.
/// `n` is the geometric normal.
#[must_use]
pub fn offset_ray_origin(p: Point, p_error: Vec3, n: Dir, w: Dir) -> Point {
    let d = n.0.abs().dot(p_error);
    let offset = if n.dot(w) < 0.0 { -n.0 * d } else { n.0 * d };
    let away = |x: f32, o: f32| {
        let y = x + o;
        if o > 0.0 {
            y.next_up()
        } else if o < 0.0 {
            y.next_down()
        } else {
            y
        }
    };
    Point::new(away(p.0.x, offset.x), away(p.0.y, offset.y), away(p.0.z, offset.z))
}
