//! Patterns without a state of their own: how much of which texture shows at a point.
//!
//! | pattern      | source                                                          |
//! |--------------|-----------------------------------------------------------------|
//! | checkerboard | [PBR4e], sec. 10.4: filtered by a triangle 1.5 footprints wide  |
//! | dots         | [PBR3e], sec. 10.5.2                                            |
//! | marble       | [PBR3e], sec. 10.6.4                                            |

use math::{Vec2, Vec3, trig};

use super::mapping::{Coord2, Coord3};
use super::noise::{Octaves, fbm, noise_2d};

/// The share of the second texture of a checkerboard of unit squares, filtered over the footprint.
pub(crate) fn checkerboard_2d(c: &Coord2) -> f32 {
    let r = 1.5 * c.dx.abs().max(c.dy.abs());
    0.5 - 0.5 * filtered_sign(c.st.x, r.x) * filtered_sign(c.st.y, r.y)
}

/// The share of the second texture of a checkerboard of unit cubes, filtered over the footprint.
pub(crate) fn checkerboard_3d(c: &Coord3) -> f32 {
    let r = 1.5 * c.dx.abs().max(c.dy.abs());
    let signs = filtered_sign(c.p.x, r.x) * filtered_sign(c.p.y, r.y) * filtered_sign(c.p.z, r.z);
    0.5 - 0.5 * signs
}

/// Is the point inside a dot? Each unit square holds one, shifted, or none.
pub(crate) fn inside_dot(st: Vec2) -> bool {
    const RADIUS: f32 = 0.35;
    const MAX_SHIFT: f32 = 0.5 - RADIUS;
    let cell = (st + 0.5).floor();
    if noise_2d(cell.x + 0.5, cell.y + 0.5) <= 0.0 {
        return false;
    }
    let shift = Vec2::new(noise_2d(cell.x + 1.5, cell.y + 2.8), noise_2d(cell.x + 4.5, cell.y + 9.8));
    (st - cell - shift * MAX_SHIFT).length_squared() < RADIUS * RADIUS
}

/// Marble's parameters, in the terms of files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Marble {
    /// Most octaves.
    pub(crate) octaves: u32,
    /// Their falloff.
    pub(crate) omega: f32,
    /// Frequency.
    pub(crate) scale: f32,
    /// How far the noise moves the veins.
    pub(crate) variation: f32,
}

/// The colour of marble in linear sRGB.
pub(crate) fn marble(m: &Marble, c: &Coord3) -> [f32; 3] {
    /// Control points of six overlapping Bézier segments [PBR3e].
    const COLORS: [Vec3; 9] = [
        Vec3::new(0.58, 0.58, 0.6),
        Vec3::new(0.58, 0.58, 0.6),
        Vec3::new(0.58, 0.58, 0.6),
        Vec3::new(0.5, 0.5, 0.5),
        Vec3::new(0.6, 0.59, 0.58),
        Vec3::new(0.58, 0.58, 0.6),
        Vec3::new(0.58, 0.58, 0.6),
        Vec3::new(0.2, 0.2, 0.33),
        Vec3::new(0.58, 0.58, 0.6),
    ];
    const SEGMENTS: usize = COLORS.len() - 3;

    // A sine along y, its phase moved by noise.
    let p = c.p * m.scale;
    let noise =
        fbm(&Octaves { p, footprint: [c.dx * m.scale, c.dy * m.scale], omega: m.omega, max: m.octaves });
    let t = (0.5 + 0.5 * trig::sin(p.y + m.variation * noise)) * SEGMENTS as f32;

    // The segment's cubic, by de Casteljau.
    let first = (t as usize).min(SEGMENTS - 1);
    let t = t - first as f32;
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| COLORS[first + i]);
    let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
    (1.5 * ab.lerp(bc, t).lerp(bc.lerp(cd, t), t)).to_array()
}

/// +1 on even, −1 on odd unit intervals, averaged by a triangle of half-width `r` around `x`.
fn filtered_sign(x: f32, r: f32) -> f32 {
    // Within one interval there is nothing to filter.
    let floor = x.floor();
    if (x - r).floor() == (x + r).floor() {
        return if floor.rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
    }
    // The triangle is a second difference: apply it to the second integral of the pattern. Its linear part
    // cancels and is left out, which keeps the precision far from the origin.
    let x = x.rem_euclid(2.0);
    let integral = |x: f32| {
        let y = 0.5 * x - (0.5 * x).floor() - 0.5;
        y * (1.0 - 2.0 * y.abs())
    };
    (integral(x + r) - 2.0 * integral(x) + integral(x - r)) / (r * r)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coord(st: Vec2, width: Vec2) -> Coord2 {
        Coord2 { st, dx: Vec2::new(width.x, 0.0), dy: Vec2::new(0.0, width.y) }
    }

    fn sign(x: f32) -> f32 {
        if x.floor().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 }
    }

    #[test]
    fn squares_alternate_also_left_of_zero() {
        let w = |s: f32, t: f32| checkerboard_2d(&coord(Vec2::new(s, t), Vec2::ZERO));
        assert_eq!(
            [w(0.5, 0.5), w(1.5, 0.5), w(1.5, 1.5), w(-0.5, 0.5), w(-0.5, -0.5)],
            [0.0, 1.0, 0.0, 1.0, 0.0]
        );
        let cube = |p: Vec3| checkerboard_3d(&Coord3 { p, dx: Vec3::ZERO, dy: Vec3::ZERO });
        assert_eq!(cube(Vec3::new(0.5, 0.5, 0.5)), 0.0);
        assert_eq!(cube(Vec3::new(0.5, 0.5, -0.5)), 1.0);
        assert_eq!(cube(Vec3::new(-0.5, 0.5, -0.5)), 0.0);
    }

    #[test]
    fn the_filtered_pattern_is_the_integral_over_the_triangle() {
        for (x, r) in [(0.9_f32, 0.3_f32), (1.02, 0.7), (-3.4, 1.7), (2.0, 0.05), (101.7, 2.9)] {
            // Midpoint rule over the triangle filter.
            let n = 20_000;
            let brute: f64 = (0..n)
                .map(|i| {
                    let y = (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
                    (1.0 - y.abs()) * f64::from(sign((f64::from(x) + y * f64::from(r)) as f32))
                })
                .sum::<f64>()
                * 2.0
                / f64::from(n);
            let exact = f64::from(filtered_sign(x, r));
            assert!((exact - brute).abs() < 2e-3, "x {x} r {r}: {exact} against {brute}");
        }
    }

    #[test]
    fn a_wide_footprint_gives_grey() {
        assert!((checkerboard_2d(&coord(Vec2::new(0.3, 0.4), Vec2::splat(50.0))) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn a_square_holds_a_whole_dot_or_none() {
        const CELLS: i32 = 64;
        const FINE: i32 = 32;
        let occupied = (0..CELLS * CELLS)
            .filter(|i| noise_2d((i % CELLS) as f32 + 0.5, (i / CELLS) as f32 + 0.5) > 0.0)
            .count() as f32;
        let n = CELLS * FINE;
        let inside = (0..n * n)
            .filter(|i| inside_dot((Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / FINE as f32 - 0.5))
            .count() as f32;
        let per_dot = inside / occupied / (FINE * FINE) as f32;
        let area = std::f32::consts::PI * 0.35 * 0.35;
        assert!((per_dot - area).abs() < 0.005 && occupied > 1000.0, "{per_dot}, {occupied} dots");
    }

    #[test]
    fn marble_is_its_end_colour_where_the_sine_is_lowest() {
        let m = Marble { octaves: 0, omega: 0.5, scale: 1.0, variation: 0.0 };
        let y = -std::f32::consts::FRAC_PI_2;
        let rgb = marble(&m, &Coord3 { p: Vec3::new(0.0, y, 0.0), dx: Vec3::ZERO, dy: Vec3::ZERO });
        assert!((Vec3::from(rgb) - Vec3::new(0.87, 0.87, 0.9)).length() < 1e-4, "{rgb:?}");
    }
}
