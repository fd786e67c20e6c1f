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
#[inline]
#[must_use]
pub fn offset_ray_origin(p: Point, p_error: Vec3, n: Dir, w: Dir) -> Point {
    let d = n.0.abs().dot(p_error);
    let d = if n.dot(w) < 0.0 { -d } else { d };
    let o = n.0 * d;
    Point::new(moved(p.0.x, o.x), moved(p.0.y, o.y), moved(p.0.z, o.z))
}

/// `x + o`, rounded away from `x`: the next number beyond the nearest one. Both are finite. Without branches.
#[inline]
fn moved(x: f32, o: f32) -> f32 {
    const SIGN: u32 = 1 << 31;
    let y = x + o;
    let (bits, towards) = (y.to_bits(), o.to_bits() & SIGN);
    // One more where both have one sign, one less where they do not.
    let step = 1_u32.wrapping_sub(((bits ^ towards) >> 31) << 1);
    let beyond = if y == 0.0 { towards | 1 } else { bits.wrapping_add(step) };
    f32::from_bits(if o == 0.0 { bits } else { beyond })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_coordinate_is_the_next_number_beyond_the_sum() {
        let numbers = [0.0, -0.0, 1.0, -1.0, 1e-45, -1e-45, 0.1, -0.1, 3e-39, 1e30, -1e30, 2.0];
        for x in numbers {
            for o in numbers {
                let y: f32 = x + o;
                let expected = match o {
                    o if o > 0.0 => y.next_up(),
                    o if o < 0.0 => y.next_down(),
                    _ => y,
                };
                assert_eq!(moved(x, o).to_bits(), expected.to_bits(), "{x} {o}");
            }
        }
    }
}
