//! Slide projectors, from descriptions.

use math::trig;
use sampling::distribution::PiecewiseConstant2D;
use scene_desc::{FovAxis, Throw};
use spectrum::ColorPipeline;

use super::Light;
use super::delta::{Profile, ProjectionLight};
use super::emission::{ImageEmission, LightImage, Lookup};
use super::infinite::smoothed;
use crate::linear_map::AffineMap;

/// A projector; `None` if it is black.
pub(super) fn projection(
    world_from_light: AffineMap,
    image: LightImage,
    (fov, throw): (f32, Throw),
    (scale, power): (f32, Option<f32>),
    colors: ColorPipeline,
) -> Option<Light> {
    let [width, height] = image.size();
    let half = half_extent(fov, throw, width as f32 / height as f32);
    let profile = match throw {
        Throw::Intensity => Profile::Even,
        Throw::Irradiance { .. } => Profile::Plane,
        Throw::Cone { cone_angle, cone_delta } => {
            let [end, start] = [cone_angle, (cone_angle - cone_delta).max(0.0)].map(f32::to_radians);
            Profile::Cone { start, end }
        }
    };
    let lookup = if throw == Throw::Intensity { Lookup::Nearest } else { Lookup::Bilinear };
    let pixel = [half[0] / width as f32, half[1] / height as f32];
    let n_pixels = (width * height) as f32;
    // Of the pixel around a place on the slide: ∫ profile dω. On a plane that is its area.
    let measure = |uv: [f32; 2]| {
        if matches!(profile, Profile::Plane) {
            return 4.0 * pixel[0] * pixel[1];
        }
        let (x, y) = ((2.0 * uv[0] - 1.0) * half[0], (2.0 * uv[1] - 1.0) * half[1]);
        let solid_angle = pixel_solid_angle([x - pixel[0], x + pixel[0]], [y - pixel[1], y + pixel[1]]);
        let at = |x: f32, y: f32| profile.at((x * x + y * y).sqrt());
        let mut sum = 0.0;
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            let within = |k: u8| 0.5 * f32::from(k) - 0.75;
            sum += at(x + within(i) * pixel[0], y + within(j) * pixel[1]);
        }
        // No place that shines has density zero.
        let most = at((x.abs() - pixel[0]).max(0.0), (y.abs() - pixel[1]).max(0.0));
        solid_angle * (0.98 * sum / 16.0 + 0.02 * most)
    };
    let factor =
        power.map_or(1.0, |p| p / (n_pixels * image.mean(|rgb, uv| image.luminance(rgb) * measure(uv))));
    let slide = ImageEmission::new(image, scale * factor, lookup, colors);
    let size: Vec<f32> = slide.image().pixels().iter().map(|&rgb| slide.size_of(rgb)).collect();
    let weights: Vec<f32> = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let uv = [(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32];
            let value = match lookup {
                Lookup::Nearest => size[i],
                Lookup::Bilinear | Lookup::BilinearRound => smoothed(&size, [width, height], [x, y], lookup),
            };
            value * measure(uv) * n_pixels
        })
        .collect();
    let distribution = PiecewiseConstant2D::new(&weights, width)?;
    (distribution.integral() > 0.0).then(|| {
        Light::Projection(Box::new(ProjectionLight { world_from_light, slide, profile, half, distribution }))
    })
}

/// Half extent of the slide on the plane z = 1.
fn half_extent(fov: f32, throw: Throw, aspect: f32) -> [f32; 2] {
    let tan = trig::tan(0.5 * fov.to_radians());
    match throw {
        Throw::Intensity => [tan * aspect.max(1.0), tan * (1.0 / aspect).max(1.0)],
        Throw::Cone { cone_angle, .. } => [trig::tan(cone_angle.to_radians()); 2],
        Throw::Irradiance { axis } => {
            let x = match axis {
                FovAxis::X => tan,
                FovAxis::Y => tan * aspect,
                FovAxis::Diagonal => tan * aspect / (1.0 + aspect * aspect).sqrt(),
                FovAxis::Smaller => tan * aspect.max(1.0),
                FovAxis::Larger => tan * aspect.min(1.0),
            };
            [x, x / aspect]
        }
    }
}

/// Solid angle of a rectangle on the plane z = 1, seen from the origin.
fn pixel_solid_angle(x: [f32; 2], y: [f32; 2]) -> f32 {
    let corner = |x: f32, y: f32| {
        let (x, y) = (f64::from(x), f64::from(y));
        trig::f64::atan2(x * y, (1.0 + x * x + y * y).sqrt())
    };
    (corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0])) as f32
}
