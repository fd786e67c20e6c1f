//! Maps of longitude and latitude as pbrt-v4's equal-area maps.

use math::{Vec3, trig};
use scene_desc::SphericalMapping;

/// Largest side of an equal-area map.
const LARGEST_MAP: usize = 4096;
/// Samples of the old map for each pixel of the new one, along both axes.
const SAMPLES: usize = 3;

/// An image with R, G and B, as many pixels as the map has.
pub(crate) fn equal_area(
    source: &image::PixelBuffer,
    mapping: SphericalMapping,
) -> Result<image::Image, image::ImageError> {
    let (width, height) = (source.width(), source.height());
    let side = ((width * height) as f64).sqrt().ceil() as usize;
    let side = side.clamp(1, LARGEST_MAP);
    let mut data = Vec::with_capacity(side * side * 3);
    for i in 0..side * side {
        let mut sum = [0.0_f32; 3];
        for k in 0..SAMPLES * SAMPLES {
            let at =
                |pixel: usize, k: usize| (pixel as f32 + (k as f32 + 0.5) / SAMPLES as f32) / side as f32;
            let uv = [at(i % side, k % SAMPLES), at(i / side, k / SAMPLES)];
            let value = around(source, sampling::warp::equal_area_sphere(uv).0, mapping);
            (0..3).for_each(|c| sum[c] += value[c]);
        }
        data.extend(sum.map(|s| s / (SAMPLES * SAMPLES) as f32));
    }
    image::Image::from_data(side, side, ["R", "G", "B"].map(String::from).to_vec(), data)
}

/// The value in a direction of a map of longitude (from x towards y) and latitude (from z), between pixels.
fn around(map: &image::PixelBuffer, w: Vec3, mapping: SphericalMapping) -> [f32; 3] {
    use std::f32::consts::{PI, TAU};
    let (width, height) = (map.width(), map.height());
    let phi = trig::atan2(w.y, w.x);
    let phi = if phi < 0.0 { phi + TAU } else { phi };
    let x = phi / TAU * width as f32 - 0.5;
    let v = trig::safe_acos(w.z) / PI;
    let y = match mapping {
        SphericalMapping::EquiRectangularPoles => v * (height - 1) as f32,
        SphericalMapping::EquiRectangular | SphericalMapping::EqualArea => v * height as f32 - 0.5,
    };
    let (i, j) = (x.floor(), y.floor());
    let column = |k: i64| k.rem_euclid(width as i64) as usize;
    let row = |k: i64| k.clamp(0, height as i64 - 1) as usize;
    let mut sum = [0.0; 3];
    for (dx, wx) in [(0, 1.0 - (x - i)), (1, x - i)] {
        for (dy, wy) in [(0, 1.0 - (y - j)), (1, y - j)] {
            let pixel = map.rgb(column(i as i64 + dx), row(j as i64 + dy));
            (0..3).for_each(|c| sum[c] += pixel[c] * wx * wy);
        }
    }
    sum
}
