//! Gradient noise and the sums of it that procedural textures are made of.
//!
//! | step                          | source                                             |
//! |-------------------------------|----------------------------------------------------|
//! | permutation, quintic weights  | [Perlin2002]                                       |
//! | choice of gradients           | pbrt-v4's (cases 12 to 15 differ from [Perlin2002]) |
//! | octaves limited by footprint  | [PBR3e], sec. 10.6.2                               |
//!
//! The choice of gradients is pbrt's so that its procedural textures look the same here, stone by stone.

use math::{Vec3, trig};

/// The permutation of 0..256 [Perlin2002].
const PERMUTATION: [u8; 256] = [
    151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69, 142, 8, 99,
    37, 240, 21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94, 252, 219, 203, 117, 35, 11, 32,
    57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168, 68, 175, 74, 165, 71, 134, 139, 48, 27,
    166, 77, 146, 158, 231, 83, 111, 229, 122, 60, 211, 133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244,
    102, 143, 54, 65, 25, 63, 161, 1, 216, 80, 73, 209, 76, 132, 187, 208, 89, 18, 169, 200, 196, 135, 130,
    116, 188, 159, 86, 164, 100, 109, 198, 173, 186, 3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147,
    118, 126, 255, 82, 85, 212, 207, 206, 59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213, 119,
    248, 152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39, 253, 19, 98, 108, 110,
    79, 113, 224, 232, 178, 185, 112, 104, 218, 246, 97, 228, 251, 34, 242, 193, 238, 210, 144, 12, 191, 179,
    162, 241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31, 181, 199, 106, 157, 184, 84, 204, 176,
    115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205, 93, 222, 114, 67, 29, 24, 72, 243, 141, 128, 195, 78,
    66, 215, 61, 156, 180,
];

/// Frequency ratio of one octave to the next: not quite two, so that the lattices do not line up.
const LACUNARITY: f32 = 1.99;

/// Beyond this, cell numbers would not fit an `i32`.
const LIMIT: f32 = (1_u32 << 30) as f32;

/// Gradient noise in about [−1, 1], zero on the integer lattice; repeats every 256.
pub(crate) fn noise(p: Vec3) -> f32 {
    let p = if p.abs().max_element() < LIMIT { p } else { p % LIMIT };
    let cell = p.floor();
    let d = p - cell;
    let [x, y, z] = [cell.x as i32, cell.y as i32, cell.z as i32];
    let corner =
        |i: i32, j: i32, k: i32| gradient([x + i, y + j, z + k], d - Vec3::new(i as f32, j as f32, k as f32));

    // Trilinear with quintic weights between the gradients of the eight corners.
    let w = d * d * d * (d * (d * 6.0 - 15.0) + 10.0);
    let edge = |j: i32, k: i32| lerp(w.x, corner(0, j, k), corner(1, j, k));
    let face = |k: i32| lerp(w.y, edge(0, k), edge(1, k));
    lerp(w.z, face(0), face(1))
}

/// Noise on a plane, between the lattice's layers.
pub(crate) fn noise_2d(x: f32, y: f32) -> f32 {
    noise(Vec3::new(x, y, 0.5))
}

/// The part of a sum of octaves that a footprint leaves: where, how large, how it falls, how many.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octaves {
    /// The point.
    pub(crate) p: Vec3,
    /// Change of the point from pixel to pixel in x and y.
    pub(crate) footprint: [Vec3; 2],
    /// Amplitude ratio of one octave to the one before.
    pub(crate) omega: f32,
    /// At most so many.
    pub(crate) max: u32,
}

impl Octaves {
    /// How many octaves are no finer than the footprint: whole ones, and the weight of the next.
    fn visible(&self) -> (u32, f32) {
        let len2 = self.footprint[0].length_squared().max(self.footprint[1].length_squared());
        let most = self.max as f32;
        let n = if len2 > 0.0 { (-1.0 - 0.5 * trig::log2(len2)).clamp(0.0, most) } else { most };
        (n as u32, smooth_step(0.3, 0.7, n - n.floor()))
    }
}

/// Fractional Brownian motion: `Σ ωⁱ noise(λⁱ p)`.
pub(crate) fn fbm(o: &Octaves) -> f32 {
    let (whole, partial) = o.visible();
    let (mut sum, mut frequency, mut amplitude) = (0.0, 1.0, 1.0);
    for _ in 0..whole {
        sum += amplitude * noise(o.p * frequency);
        frequency *= LACUNARITY;
        amplitude *= o.omega;
    }
    if partial > 0.0 {
        sum += amplitude * partial * noise(o.p * frequency);
    }
    sum
}

/// Turbulence: `Σ ωⁱ |noise(λⁱ p)|`. Octaves too fine to see give their mean, about 0.2.
pub(crate) fn turbulence(o: &Octaves) -> f32 {
    const MEAN: f32 = 0.2;
    let (whole, partial) = o.visible();
    let (mut sum, mut frequency, mut amplitude) = (0.0, 1.0, 1.0);
    for _ in 0..whole {
        sum += amplitude * noise(o.p * frequency).abs();
        frequency *= LACUNARITY;
        amplitude *= o.omega;
    }
    sum += amplitude * lerp(partial, MEAN, noise(o.p * frequency).abs());
    for _ in whole..o.max {
        sum += amplitude * MEAN;
        amplitude *= o.omega;
    }
    sum
}

/// The gradient of a lattice point, dotted with the offset from it.
fn gradient(cell: [i32; 3], d: Vec3) -> f32 {
    let step = |hash: i32, i: i32| i32::from(PERMUTATION[((hash + i) & 255) as usize]);
    let h = step(step(step(0, cell[0]), cell[1]), cell[2]) & 15;
    let u = if h < 8 || h == 12 || h == 13 { d.x } else { d.y };
    let v = if h < 4 || h == 12 || h == 13 { d.y } else { d.z };
    (if h & 1 != 0 { -u } else { u }) + (if h & 2 != 0 { -v } else { v })
}

fn lerp(t: f32, a: f32, b: f32) -> f32 {
    (1.0 - t) * a + t * b
}

fn smooth_step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn octaves(p: Vec3, width: f32) -> Octaves {
        Octaves { p, footprint: [Vec3::X * width, Vec3::ZERO], omega: 0.5, max: 8 }
    }

    #[test]
    fn the_permutation_has_every_number_once() {
        let mut seen = [false; 256];
        PERMUTATION.iter().for_each(|&i| seen[usize::from(i)] = true);
        assert!(seen.iter().all(|&s| s));
    }

    #[test]
    fn noise_is_zero_on_the_lattice_with_the_slope_of_its_gradient() {
        // A gradient has two components ±1 and one 0, and is the slope at its lattice point.
        let h = PERMUTATION[usize::from(PERMUTATION[usize::from(PERMUTATION[0])])] & 15;
        let e = 1e-3;
        let slope =
            Vec3::from_array([Vec3::X, Vec3::Y, Vec3::Z].map(|a| (noise(a * e) - noise(a * -e)) / (2.0 * e)));
        assert!((slope.length_squared() - 2.0).abs() < 1e-2, "h {h}: {slope}");
        assert!(slope.abs().to_array().iter().all(|s| (s - s.round()).abs() < 1e-2));
        for p in [Vec3::ZERO, Vec3::new(3.0, -7.0, 250.0), Vec3::new(-1.0, 1000.0, 5.0)] {
            assert_eq!(noise(p), 0.0);
        }
    }

    #[test]
    fn noise_is_bounded_smooth_and_periodic() {
        for i in 0..2000 {
            let t = i as f32;
            let p = Vec3::new((t * 0.37) % 40.0, (t * 0.73) % 31.0, (t * 0.113) % 17.0);
            let x = noise(p);
            assert!(x.abs() <= 1.1, "{p}: {x}");
            assert!((noise(p + 1e-3) - x).abs() < 2e-2, "{p}");
            assert!((noise(p + Vec3::X * 256.0) - x).abs() < 1e-3, "{p}");
        }
        assert!(noise(Vec3::splat(3e12)).is_finite());
    }

    #[test]
    fn a_footprint_takes_octaves_away_and_turbulence_keeps_its_mean() {
        let p = Vec3::new(1.3, 0.7, -2.1);
        let manual: f32 = (0..8).map(|i| 0.5_f32.powi(i) * noise(p * LACUNARITY.powi(i))).sum();
        assert!((fbm(&octaves(p, 0.0)) - manual).abs() < 1e-5);
        assert_eq!(fbm(&octaves(p, 4.0)), 0.0);
        let limit = 0.2 + 0.2 * (0..8).map(|i| 0.5_f32.powi(i)).sum::<f32>();
        assert!((turbulence(&octaves(p, 4.0)) - limit).abs() < 1e-5);
    }
}
