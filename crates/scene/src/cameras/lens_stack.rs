//! A stack of spherical lenses before the film [Kolb1995], [PBR3e, sec. 6.4].
//!
//! Lens space: the film lies in z = 0, the scene towards +z, lengths in scene units (files have millimetres; pbrt takes a unit for
//! a metre, and so do we). The weight of a ray is `A cos⁴ θ / z²`, with `A` the area of the exit pupil's box from which it was drawn
//! and `z` the distance of the rearmost element: radiance times weight is the irradiance on the film. A stop that is not round is as bright as a round one, as in pbrt-v4.

use std::f32::consts::PI;

use math::{Vec2, Vec3, trig};
use scene_desc::{ApertureDesc, LensElement, LensStackDesc};

use super::aperture::Aperture;

/// Boxes over the film's radius in which exit pupils are found.
const N_PUPILS: usize = 64;
/// Rays along both sides of the rear element for each of them.
const N_RAYS: usize = 128;

/// A stack, focused.
#[derive(Clone, Debug)]
pub(super) struct LensStack {
    /// From front to rear, in scene units.
    elements: Vec<LensElement>,
    /// Half the film's width and height.
    half: Vec2,
    /// For film points at growing distance along +x: the box on the plane of the rear element.
    pupils: Vec<[Vec2; 2]>,
    /// Shape of the stop, for one of radius one; `None` for a round one.
    stop: Option<Aperture>,
}

/// A ray: origin and direction.
type Line = (Vec3, Vec3);

impl LensStack {
    /// `None` where no light gets through, or the distance cannot be focused on.
    pub(super) fn new(desc: &LensStackDesc, resolution: [u32; 2]) -> Option<Self> {
        let mut elements: Vec<LensElement> = desc
            .elements
            .iter()
            .map(|e| LensElement {
                curvature: e.curvature * 1e-3,
                thickness: e.thickness * 1e-3,
                eta: e.eta,
                aperture: e.aperture * 1e-3,
            })
            .collect();
        // A stop can be closed, not opened further than it goes.
        for e in elements.iter_mut().filter(|e| e.curvature == 0.0) {
            let wanted = desc.aperture_diameter * 1e-3;
            if wanted > 0.0 {
                e.aperture = e.aperture.min(wanted);
            }
        }
        let [x, y] = resolution.map(|r| r as f32);
        let half = Vec2::new(x, y) * (0.5e-3 * desc.diagonal_mm / (x * x + y * y).sqrt());
        let is_round = desc.aperture == ApertureDesc::Disk;
        let stop = if is_round { None } else { Some(Aperture::new(1.0, &desc.aperture)?) };
        let mut stack = Self { elements, half, pupils: Vec::new(), stop };
        let focused = stack.focused_thickness(desc.focus_distance)?;
        stack.elements.last_mut()?.thickness = focused;
        stack.pupils = (0..N_PUPILS).map(|i| stack.pupil(i)).collect();
        stack.pupils.iter().any(|[lo, hi]| hi.x > lo.x && hi.y > lo.y).then_some(stack)
    }

    /// The ray into the scene from a place on the film in [0, 1]², x right and y down in the picture, through the place
    /// `u` of its exit pupil, and its weight; `None` where it does not get through.
    pub(super) fn ray(&self, [x, y]: [f32; 2], u: [f32; 2]) -> Option<(Line, f32)> {
        // The image stands on its head, and left is right.
        let film = Vec2::new(1.0 - 2.0 * x, 2.0 * y - 1.0) * self.half;
        let (to, area) = self.sample_pupil(film, u)?;
        let origin = film.extend(0.0);
        let d = to - origin;
        let mut through = 1.0;
        let out = self.trace_to((origin, d), false, |p| through *= self.open(p))?;
        let cos = d.z / d.length();
        (through > 0.0).then(|| (out, through * area * cos * cos * cos * cos / (to.z * to.z)))
    }

    /// How open the stop is at a point of the unit disk: one for a round one, and in the mean over the disk.
    fn open(&self, p: Vec2) -> f32 {
        match &self.stop {
            None => 1.0,
            Some(stop) if stop.contains(p) => stop.pdf(p).map_or(1.0, |pdf| pdf.value() * PI),
            Some(_) => 0.0,
        }
    }

    /// The direction to the middle of what a place on the film sees: where a pinhole camera would look.
    pub(super) fn chief(&self, [x, y]: [f32; 2]) -> Line {
        let film = Vec2::new(1.0 - 2.0 * x, 2.0 * y - 1.0) * self.half;
        let middle = self.sample_pupil(film, [0.5; 2]);
        let through = middle.and_then(|(to, _)| self.trace((film.extend(0.0), to - film.extend(0.0)), false));
        through.unwrap_or_else(|| (Vec3::ZERO, (-film).extend(self.rear_z())))
    }

    /// Place and density (as an area) on the plane of the rear element.
    fn sample_pupil(&self, film: Vec2, u: [f32; 2]) -> Option<(Vec3, f32)> {
        let radius = film.length();
        let i = (radius / self.half.length() * N_PUPILS as f32) as usize;
        let [lo, hi] = self.pupils[i.min(N_PUPILS - 1)];
        let size = hi - lo;
        let area = size.x * size.y;
        if area <= 0.0 || area.is_nan() {
            return None;
        }
        let p = lo + size * Vec2::from(u);
        // The boxes are those of points on +x.
        let (cos, sin) = if radius > 0.0 { (film.x / radius, film.y / radius) } else { (1.0, 0.0) };
        Some((Vec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, self.rear_z()), area))
    }

    /// The box around what gets through from the `i`-th ring of the film.
    fn pupil(&self, i: usize) -> [Vec2; 2] {
        let r = |k: f32| k / N_PUPILS as f32 * self.half.length();
        let rear = self.elements.last().map_or(0.0, |e| 0.5 * e.aperture);
        let (z, side) = (self.rear_z(), 1.5 * rear);
        let step = 2.0 * side / N_RAYS as f32;
        let (mut lo, mut hi) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for k in 0..N_RAYS * N_RAYS {
            let cell = Vec2::new((k % N_RAYS) as f32 + 0.5, (k / N_RAYS) as f32 + 0.5);
            let p = cell * step - side;
            // From both ends of the ring and its middle.
            let passes = [0.0, 0.5, 1.0].into_iter().any(|f| {
                let origin = Vec3::new(r(i as f32 + f), 0.0, 0.0);
                self.trace((origin, p.extend(z) - origin), false).is_some()
            });
            if passes {
                (lo, hi) = (lo.min(p), hi.max(p));
            }
        }
        if lo.x > hi.x { [Vec2::ZERO; 2] } else { [lo - step, hi + step] }
    }

    /// Distance of the rear element from the film.
    fn rear_z(&self) -> f32 {
        self.elements.last().map_or(0.0, |e| e.thickness)
    }

    /// Distance of the front element's vertex.
    fn front_z(&self) -> f32 {
        self.elements.iter().map(|e| e.thickness).sum()
    }

    /// See [`LensStack::trace_to`].
    fn trace(&self, line: Line, reversed: bool) -> Option<Line> {
        self.trace_to(line, reversed, |_| ())
    }

    /// Through all elements from the film, or (`reversed`) from the scene with the direction towards −z. `at_stop` is told
    /// where the line passes stops, over their radius.
    fn trace_to(&self, (mut o, mut d): Line, reversed: bool, mut at_stop: impl FnMut(Vec2)) -> Option<Line> {
        let n = self.elements.len();
        // The vertex of each element, from the rear on.
        let mut z = if reversed { self.front_z() } else { 0.0 };
        for k in 0..n {
            let i = if reversed { k } else { n - 1 - k };
            let e = &self.elements[i];
            if !reversed {
                z += e.thickness;
            }
            let p = if e.curvature == 0.0 {
                let t = (z - o.z) / d.z;
                if t < 0.0 || !t.is_finite() {
                    return None;
                }
                o + d * t
            } else {
                // Radii of files are positive where the centre lies towards the film.
                let center = z - e.curvature;
                let t = sphere(e.curvature, center, o, d)?;
                o + d * t
            };
            if p.x * p.x + p.y * p.y > 0.25 * e.aperture * e.aperture {
                return None;
            }
            o = p;
            if e.curvature == 0.0 {
                at_stop(p.truncate() / (0.5 * e.aperture));
            } else {
                let front =
                    if i > 0 && self.elements[i - 1].eta != 0.0 { self.elements[i - 1].eta } else { 1.0 };
                let rear = if e.eta != 0.0 { e.eta } else { 1.0 };
                let (from, to) = if reversed { (front, rear) } else { (rear, front) };
                let normal = (p - Vec3::new(0.0, 0.0, z - e.curvature)).normalize_or_zero();
                d = refract(d.normalize_or_zero(), normal, from / to)?;
            }
            if reversed {
                z -= e.thickness;
            }
        }
        Some((o, d))
    }

    /// The thickness behind the rear element that brings what is `distance` before the film into focus, by the stack's
    /// cardinal points [PBR3e, sec. 6.4.4].
    fn focused_thickness(&self, distance: f32) -> Option<f32> {
        let x = 0.002 * self.half.length();
        // From the scene: where it meets the axis is the rear focus; where it is as far from the axis as it came, the plane.
        let (front, rear) = (self.front_z() + 1.0, 0.0);
        let (o, d) = self.trace((Vec3::new(x, 0.0, front), -Vec3::Z), true)?;
        let rear_focus = (o + d * (-o.x / d.x)).z;
        let rear_plane = (o + d * ((x - o.x) / d.x)).z;
        let (o, d) = self.trace((Vec3::new(x, 0.0, rear - 1.0), Vec3::Z), false)?;
        let front_plane = (o + d * ((x - o.x) / d.x)).z;
        // In scene-side order: 1/z' − 1/z = 1/f about both planes.
        let f = rear_plane - rear_focus;
        let gap = distance - front_plane;
        let spread = rear_plane;
        // Moving all by δ: the film at 0 and the point at `distance` are conjugate.
        // (gap − δ) and (spread + δ) are object and image distances: 1/(gap − δ) + 1/(spread + δ) = 1/f.
        let sum = gap + spread;
        let root = sum * sum - 4.0 * f * sum;
        if !(f > 0.0 && root >= 0.0) {
            return None;
        }
        // The image is the nearer of the two.
        let image = 0.5 * (sum - root.sqrt());
        let moved = self.rear_z() + image - spread;
        (moved > 0.0 && moved.is_finite()).then_some(moved)
    }
}

/// Along a ray to the sphere about (0, 0, `center`): to its side that is the lens.
fn sphere(radius: f32, center: f32, o: Vec3, d: Vec3) -> Option<f32> {
    let o = o - Vec3::new(0.0, 0.0, center);
    let (a, b, c) = (d.length_squared(), 2.0 * d.dot(o), o.length_squared() - radius * radius);
    let root = b * b - 4.0 * a * c;
    if root < 0.0 {
        return None;
    }
    let root = root.sqrt();
    let q = if b < 0.0 { -0.5 * (b - root) } else { -0.5 * (b + root) };
    let (t0, t1) = (q / a, c / q);
    let (near, far) = (t0.min(t1), t0.max(t1));
    // The vertex is at +radius from the centre: towards the scene for positive radii.
    let t = if (d.z > 0.0) == (radius < 0.0) { near } else { far };
    (t >= 0.0 && t.is_finite()).then_some(t)
}

/// Refracts a unit direction at a surface of normal `n`; `eta` is the index before over that behind.
fn refract(d: Vec3, n: Vec3, eta: f32) -> Option<Vec3> {
    let n = if n.dot(d) > 0.0 { -n } else { n };
    let cos = -n.dot(d);
    let sin2 = eta * eta * (1.0 - cos * cos).max(0.0);
    (sin2 < 1.0).then(|| d * eta + n * (eta * cos - trig::safe_sqrt(1.0 - sin2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A biconvex lens of 50 mm radii and index 1.5, 2 mm thick, behind a stop.
    fn simple(focus: f32) -> LensStackDesc {
        let element =
            |curvature, thickness, eta, aperture| LensElement { curvature, thickness, eta, aperture };
        LensStackDesc {
            elements: vec![
                element(50.0, 2.0, 1.5, 20.0),
                element(-50.0, 1.0, 1.0, 20.0),
                element(0.0, 45.0, 0.0, 8.0),
            ],
            aperture_diameter: 8.0,
            focus_distance: focus,
            diagonal_mm: 35.0,
            aperture: ApertureDesc::Disk,
        }
    }

    #[test]
    fn rays_of_the_film_s_middle_meet_where_it_is_focused() {
        for focus in [1.0_f32, 3.0, 20.0] {
            let stack = LensStack::new(&simple(focus), [300, 200]).unwrap();
            let mut n = 0;
            for i in 0..64 {
                let u = [(i % 8) as f32 / 8.0 + 0.06, (i / 8) as f32 / 8.0 + 0.06];
                let Some(((o, d), weight)) = stack.ray([0.5, 0.5], u) else { continue };
                n += 1;
                assert!(weight > 0.0 && d.z > 0.0);
                let at = o + d * ((focus - o.z) / d.z);
                // Within what spherical aberration and the thick lens's planes leave.
                assert!(at.truncate().length() < 0.004 * focus, "{focus}: {at}");
            }
            assert!(n > 30, "{n}");
        }
    }

    #[test]
    fn the_picture_stands_upright() {
        let stack = LensStack::new(&simple(5.0), [300, 200]).unwrap();
        // Top left of the picture: left (−x) and up (+y) in the scene.
        let ((_, d), _) = stack.ray([0.3, 0.3], [0.5, 0.5]).unwrap();
        assert!(d.x < 0.0 && d.y > 0.0, "{d}");
        let (_, chief) = stack.chief([0.3, 0.3]);
        assert!(chief.x < 0.0 && chief.y > 0.0);
    }

    #[test]
    fn the_middle_is_as_bright_as_its_f_number_says() {
        // Irradiance over radiance: π / (4 N² (1 + m)²) = the solid angle of the stop's image, about A / z² on the axis.
        for aperture in [ApertureDesc::Disk, ApertureDesc::blades(5, 20.0).unwrap(), ApertureDesc::Gaussian] {
            let stack = LensStack::new(&LensStackDesc { aperture, ..simple(50.0) }, [300, 200]).unwrap();
            let n = 64;
            let mut sum = 0.0_f64;
            for i in 0..n * n {
                let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
                sum += stack.ray([0.5, 0.5], u).map_or(0.0, |(_, w)| f64::from(w));
            }
            let mean = sum / f64::from(n * n);
            // The stop is the rearmost element: 8 mm wide, seen by the film from its own distance.
            let z = f64::from(stack.rear_z());
            let exact = std::f64::consts::PI * 0.004 * 0.004 / (z * z);
            assert!((mean / exact - 1.0).abs() < 0.03, "{mean} is not {exact}: {:?}", stack.stop);
        }
    }

    #[test]
    fn a_stop_that_is_shut_or_a_lens_that_spreads_is_no_camera() {
        let mut shut = simple(5.0);
        shut.elements[1].aperture = 0.0;
        assert!(LensStack::new(&shut, [300, 200]).is_none());
        let mut spreads = simple(5.0);
        spreads.elements[0].curvature = -50.0;
        spreads.elements[1].curvature = 50.0;
        assert!(LensStack::new(&spreads, [300, 200]).is_none());
    }
}
