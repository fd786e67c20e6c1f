//! `sky`, `sun` and `sunsky`: an environment map that is made here, z up, north along y and east along x.

use math::{DVec3, Transform, trig::f64 as trig};
use scene_desc::{
    ColorSpaceName, ImageDesc, ImageEncoding, ImageId, LightKind, SpectrumDesc, SphericalMapping,
};
use spectrum::sky::{SUN_RADIUS, Sky, SunTime, sun_radiance};

use super::build::Build;
use super::tree::Node;

/// Columns of a map without and with the sun, which is then about three pixels wide.
const COLUMNS: [usize; 2] = [512, 2048];
/// Lookups along both sides of a pixel that the sun's border may cross.
const FINE: usize = 8;

impl<'t> Build<'t, '_, '_> {
    pub(super) fn sun_and_sky(&mut self, node: &'t Node) -> Option<(LightKind, Transform)> {
        let place = self.transform(node, "to_world");
        let turbidity = f64::from(self.float(node, "turbidity", 3.0));
        let albedo = match self.spectrum_desc(node, "albedo") {
            None => [0.3; 3],
            Some(SpectrumDesc::Constant(c)) => [f64::from(c); 3],
            Some(SpectrumDesc::Rgb { rgb, .. }) => rgb.map(f64::from),
            Some(_) => {
                self.report
                    .warning(node.span_of("albedo"), "the ground's \"albedo\" is a curve")
                    .hint("0.3 is used");
                [0.3; 3]
            }
        };
        let scale = f64::from(self.float(node, "scale", 1.0));
        let mut factor = |name| scale * f64::from(self.float(node, name, 1.0));
        let (sky_scale, sun_scale) = (factor("sky_scale"), factor("sun_scale"));
        let sky_scale = if node.kind == "sun" { 0.0 } else { sky_scale };
        let sun_scale = if node.kind == "sky" { 0.0 } else { sun_scale };
        let aperture = self.float_opt(node, "sun_aperture").map(|d| 0.5 * f64::from(d).to_radians());
        let radius = aperture.unwrap_or(SUN_RADIUS) * f64::from(self.float(node, "sun_radius_scale", 1.0));
        node.accept(&["complex_sun", "resolution", "stretch", "extend"]);
        if !(1.0..=10.0).contains(&turbidity) {
            let at = node.span_of("turbidity");
            self.report
                .warning(at, format!("a turbidity of {turbidity}"))
                .hint("expected 1 to 10: the border is used");
        }
        let sun = self.towards_the_sun(node)?;
        let elevation = trig::asin(sun.z.clamp(-1.0, 1.0));
        if elevation < 0.0 {
            self.report
                .warning(node.span, "the sun is below the horizon")
                .hint("neither it nor its sky shine");
            return None;
        }
        let sky = Sky::new(elevation, turbidity, albedo);
        // The light of the whole disk stays, however large it is made.
        let share = if radius > 0.0 { (SUN_RADIUS / radius) * (SUN_RADIUS / radius) } else { 0.0 };
        let disk = sun_radiance(elevation, turbidity).map(|c| c * share * sun_scale);
        let map = Map {
            sky: (sky_scale > 0.0).then_some((sky, sky_scale)),
            disk: (sun_scale > 0.0 && radius > 0.0).then_some((disk, radius)),
            sun,
        };
        let image = self.sky_image(&map, node)?;
        let mapping = SphericalMapping::EquiRectangular;
        let kind = LightKind::InfiniteImage { image, mapping, scale: 1.0, illuminance: None, portal: None };
        Some((kind, place))
    }

    /// By a direction, or by place and time, whose defaults are Mitsuba's: Tokyo, on a summer afternoon.
    fn towards_the_sun(&mut self, node: &Node) -> Option<DVec3> {
        if let Some(d) = self.vector(node, "sun_direction") {
            let d = d.as_dvec3().try_normalize();
            if d.is_none() {
                let at = node.span_of("sun_direction");
                self.report.error(at, "\"sun_direction\" is zero").hint("it must have a direction");
            }
            return d;
        }
        let mut number = |name, default: f64| self.float_opt(node, name).map_or(default, f64::from);
        let place = [number("latitude", 35.6894), number("longitude", 139.6917)];
        let timezone = number("timezone", 9.0);
        let hour = number("hour", 15.0) + number("minute", 0.0) / 60.0 + number("second", 0.0) / 3600.0;
        let mut whole =
            |name, default: i64| self.integer_opt(node, name).unwrap_or(default).clamp(-10_000, 10_000);
        let date = [whole("year", 2010), whole("month", 7), whole("day", 10)];
        let [elevation, azimuth] = SunTime { place, timezone, date, hour }.position();
        let flat = trig::cos(elevation);
        Some(DVec3::new(flat * trig::sin(azimuth), flat * trig::cos(azimuth), trig::sin(elevation)))
    }

    fn sky_image(&mut self, map: &Map, node: &Node) -> Option<ImageId> {
        let columns = COLUMNS[usize::from(map.disk.is_some())];
        let bytes = map.file(columns);
        let id = ImageId(u32::try_from(self.scene.images.len()).ok()?);
        self.scene.images.push(ImageDesc {
            path: format!("#sky{}.pfm", id.0).into(),
            encoding: ImageEncoding::Linear,
            space: ColorSpaceName::Srgb,
            channel: None,
            embedded: Some(bytes.into()),
            span: node.span,
        });
        Some(id)
    }
}

/// What is in the map.
struct Map {
    sky: Option<(Sky, f64)>,
    /// Radiance and radius.
    disk: Option<([f64; 3], f64)>,
    sun: DVec3,
}

impl Map {
    /// Towards a direction.
    fn radiance(&self, d: DVec3) -> [f64; 3] {
        let cos_sun = d.dot(self.sun);
        let mut sum = self.sky.map_or([0.0; 3], |(sky, scale)| sky.radiance(d.z, cos_sun).map(|c| c * scale));
        if let Some((disk, radius)) = self.disk
            && cos_sun >= trig::cos(radius)
        {
            for (sum, disk) in sum.iter_mut().zip(disk) {
                *sum += disk;
            }
        }
        sum
    }

    /// A PFM file: rows from below.
    fn file(&self, columns: usize) -> Vec<u8> {
        let rows = columns / 2;
        let mut out = format!("PF\n{columns} {rows}\n-1.0\n").into_bytes();
        out.reserve(columns * rows * 12);
        let middle = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let around: Vec<[f64; 2]> = (0..columns).map(|x| circle(middle(x, columns))).collect();
        // Half a pixel's diagonal, in radians, and a little more.
        let pixel = 2.5 / columns as f64 * std::f64::consts::TAU;
        let border = self.disk.map(|(_, r)| {
            let inside = if r > pixel { trig::cos((r - pixel).min(3.0)) } else { 2.0 };
            trig::cos((r + pixel).min(3.0))..inside
        });
        for y in (0..rows).rev() {
            let [z, sin] = circle(0.5 * middle(y, rows));
            for (x, [cos_u, sin_u]) in around.iter().enumerate() {
                let d = DVec3::new(sin * cos_u, sin * sin_u, z);
                let at = |i: f64, j: f64| [(x as f64 + i) / columns as f64, (y as f64 + j) / rows as f64];
                let is_cut = border.as_ref().is_some_and(|b| b.contains(&d.dot(self.sun)));
                let rgb = if is_cut { self.mean(at) } else { self.radiance(d) };
                out.extend(rgb.iter().flat_map(|c| (*c as f32).to_le_bytes()));
            }
        }
        out
    }

    fn mean(&self, at: impl Fn(f64, f64) -> [f64; 2]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for i in 0..FINE * FINE {
            let place = |k: usize| (k as f64 + 0.5) / FINE as f64;
            let [u, v] = at(place(i % FINE), place(i / FINE));
            let ([z, sin], [cos_u, sin_u]) = (circle(0.5 * v), circle(u));
            let rgb = self.radiance(DVec3::new(sin * cos_u, sin * sin_u, z));
            for (sum, c) in sum.iter_mut().zip(rgb) {
                *sum += c / (FINE * FINE) as f64;
            }
        }
        sum
    }
}

/// Cosine and sine of a share of the full circle.
fn circle(share: f64) -> [f64; 2] {
    let angle = std::f64::consts::TAU * share;
    [trig::cos(angle), trig::sin(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_disk_in_the_map_has_the_sun_s_power() {
        let sun = DVec3::new(0.3, 0.5, 0.7).normalize();
        let map = Map { sky: None, disk: Some(([1.0, 2.0, 4.0], 0.02)), sun };
        let columns = 1024;
        let bytes = map.file(columns);
        let pixels = &bytes[bytes.len() - columns * columns / 2 * 12..];
        let mut sum = 0.0;
        for (i, p) in pixels.chunks_exact(12).enumerate() {
            let y = (columns / 2 - 1 - i / columns) as f64;
            let d = 2.0 * std::f64::consts::PI / columns as f64;
            let sin = trig::sin((y + 0.5) * d);
            sum += f64::from(f32::from_le_bytes([p[4], p[5], p[6], p[7]])) * sin * d * d;
        }
        let exact = 2.0 * std::f64::consts::TAU * (1.0 - trig::cos(0.02));
        assert!((sum / exact - 1.0).abs() < 0.01, "{sum} is not {exact}");
    }
}
